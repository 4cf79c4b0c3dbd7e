/* Which frames the page holds. */
#include "graph/tool/ab_page.h"

#include <ctype.h>
#include <limits.h>
#include <math.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/tool/ab_page_parts.h"

enum { ALL_WORST = (1 << RL_METRICS) - 1 };

/* ---- --report-frames ----------------------------------------------------------------------------------- */

static rl_code take_word(rl_ab_page *page, const char *word, rl_str *numbers, rl_error *err)
{
    static const struct {
        const char *name;
        unsigned why;
    } words[] = {{"first", RL_PAGE_FIRST}, {"last", RL_PAGE_LAST}, {"worst", ALL_WORST}, {"none", 0}};
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        if (!strcmp(word, words[i].name)) {
            page->words |= words[i].why;
            return RL_OK;
        }
    if (!strcmp(word, "all")) {
        page->all = true;
        return RL_OK;
    }
    if (isalpha((unsigned char)*word) || !*word)
        return rl_fail_file(err, RL_E_USAGE, "--report-frames",
                            "'%s' is no frame; it takes first, last, worst, all, none, and numbers such as "
                            "1-24x2",
                            word);
    rl_str_printf(numbers, "%s%s", numbers->length ? "," : "", word);
    return RL_OK;
}

static rl_code read_frames(rl_ab_page *page, const char *spec, rl_error *err)
{
    rl_code code = RL_OK;
    rl_str numbers = {0};
    for (const char *at = spec; at && !code;) {
        size_t n = strcspn(at, ",");
        char *word = rl_arena_strndup(&page->arena, at, n), *end = word + n;
        if (!word) {
            code = rl_fail_memory(err, n);
            break;
        }
        while (end > word && end[-1] == ' ')
            *--end = 0;
        code = take_word(page, word + strspn(word, " "), &numbers, err);
        at = at[n] ? at + n + 1 : NULL;
    }
    if (!code && numbers.length)
        code = rl_frames_parse(&page->arena, numbers.text, (rl_where){.file = "--report-frames"},
                               &page->asked, err);
    if (!code && numbers.failed)
        code = rl_fail_memory(err, 64);
    rl_str_free(&numbers);
    return code == RL_E_CONFIG ? (err->code = RL_E_USAGE) : code;
}

/* ---- made and freed ------------------------------------------------------------------------------------ */

rl_code rl_ab_page_new(const rl_ab_plan *plan, const rl_ab_page_source *source,
                       const rl_ab_page_options *options, rl_ab_page **out, rl_error *err)
{
    rl_ab_page *page = *out = rl_calloc(1, sizeof *page);
    if (!page)
        return rl_fail_memory(err, sizeof *page);
    page->plan = plan;
    page->source = source;
    page->options = *options;
    page->spool.fd = -1;
    if (!page->options.budget)
        page->options.budget = RL_AB_PAGE_BUDGET;
    rl_code code = read_frames(page, options->frames ? options->frames : "first,last,worst", err);
    page->luts = code ? NULL : rl_calloc(source->n_displays + 1, sizeof *page->luts);
    if (!code && !page->luts)
        code = rl_fail_memory(err, sizeof *page->luts);
    for (size_t i = 0; i < source->n_displays && !code; i++)
        code = rl_page_lut_bake(&source->displays[i], &page->luts[i], err);
    if (!code)
        code = rl_page_spool_open(options->folder, &page->spool, err);
    if (code)
        rl_ab_page_free(out);
    return code;
}

const rl_frames *rl_ab_page_asked(const rl_ab_page *page)
{
    return &page->asked;
}

void rl_ab_page_free(rl_ab_page **out)
{
    rl_ab_page *page = *out;
    *out = NULL;
    if (!page)
        return;
    for (size_t i = 0; i < page->n_held; i++)
        rl_page_release(page, &page->held[i]);
    for (size_t i = 0; i < page->n_seen; i++) {
        rl_str_free(&page->seen[i].error);
        rl_str_free(&page->seen[i].files);
    }
    for (size_t i = 0; page->luts && i < page->source->n_displays; i++)
        rl_page_lut_free(&page->luts[i]);
    rl_page_spool_close(&page->spool);
    rl_free(page->luts);
    rl_free(page->held);
    rl_free(page->seen);
    rl_arena_free(&page->arena);
    rl_free(page);
}

/* ---- frames -------------------------------------------------------------------------------------------- */

/* The path from a folder to a file: both absolute or both relative to the same folder. */
void rl_page_relative(const char *folder, const char *path, rl_str *out)
{
    size_t same = 0, i = 0;
    while (!strncmp(folder, "./", 2))
        folder += 2;
    while (!strncmp(path, "./", 2))
        path += 2;
    if (!strcmp(folder, "."))
        folder = "";
    for (; folder[i] && folder[i] == path[i]; i++)
        if (folder[i] == '/')
            same = i + 1;
    if (!folder[i] && path[i] == '/')
        same = i + 1;
    const char *left = folder + (same < strlen(folder) ? same : strlen(folder));
    bool inside = false;
    if ((*folder == '/') != (*path == '/') || strstr(left, "..")) { /* no way is known */
        rl_str_add(out, path);
        return;
    }
    for (const char *c = left; *c; c++) {
        if (*c != '/' && !inside)
            rl_str_add(out, "../");
        inside = *c != '/';
    }
    rl_str_add(out, path + same);
}

static void list_files(const rl_ab_page *page, const rl_experiment_frame *f, rl_str *out)
{
    rl_str_add(out, "[");
    for (size_t v = 0; v < page->plan->n_listed; v++) {
        rl_str_add(out, v ? ",[" : "[");
        for (size_t i = 0; f->n_files && f->files && i < f->n_files[v]; i++) {
            rl_str path = {0};
            rl_page_relative(page->options.folder, f->files[v][i], &path);
            if (i)
                rl_str_add(out, ",");
            rl_page_json_text(out, rl_str_text(&path));
            out->failed |= path.failed;
            rl_str_free(&path);
        }
        rl_str_add(out, "]");
    }
    rl_str_add(out, "]");
}

static bool more_different(rl_metric metric, double a, double b)
{
    return rl_metric_rises(metric) ? a < b : a > b;
}

/* An image that is the same as the reference is no "worst" frame. */
static bool is_difference(rl_metric metric, double value)
{
    return metric == RL_METRIC_PSNR ? isfinite(value) : metric == RL_METRIC_SSIM ? value < 1 : value > 0;
}

static void find_worst(const rl_ab_results *results, rl_page_seen *seen)
{
    for (int m = 0; m < RL_METRICS; m++)
        seen->worst[m] = (double)NAN;
    for (size_t i = 0; results && i < results->n_values; i++) {
        const rl_ab_value *v = &results->values[i];
        double x = v->stats[RL_STAT_MEAN], *worst = &seen->worst[v->metric];
        if (v->capture == seen->capture && v->index == seen->index && v->material == RL_AB_WHOLE &&
            is_difference(v->metric, x) && (isnan(*worst) || more_different(v->metric, x, *worst)))
            *worst = x;
    }
}

static unsigned reasons(const rl_ab_page *page, const rl_page_seen *seen)
{
    unsigned why = RL_PAGE_FIRST;
    for (unsigned m = 0; m < RL_METRICS; m++)
        why |= isnan(seen->worst[m]) ? 0 : 1u << m;
    for (size_t i = 0; i < page->n_seen; i++) {
        const rl_page_seen *other = &page->seen[i];
        if (other->capture != seen->capture || other->error.length)
            continue;
        if (other->index < seen->index)
            why &= ~(unsigned)RL_PAGE_FIRST;
        for (unsigned m = 0; m < RL_METRICS; m++)
            if (!isnan(other->worst[m]) && !more_different((rl_metric)m, seen->worst[m], other->worst[m]))
                why &= ~(1u << m);
    }
    if (seen->index + 1 == page->source->n_frames[seen->capture])
        why |= RL_PAGE_LAST;
    why &= page->words;
    if (page->all || (seen->frame >= INT_MIN && seen->frame <= INT_MAX &&
                      rl_frames_find(&page->asked, (int)seen->frame) >= 0))
        why |= RL_PAGE_ASKED;
    return why;
}

static void drop(rl_ab_page *page, rl_page_held *held)
{
    page->held_bytes -= rl_page_held_bytes(held);
    rl_page_release(page, held);
    *held = page->held[--page->n_held];
}

/* What a new frame is held for, an older one is not any more. */
static void supersede(rl_ab_page *page, size_t capture, unsigned why)
{
    for (size_t i = page->n_held; i-- > 0;) {
        rl_page_held *held = &page->held[i];
        if (page->seen[held->seen].capture != capture)
            continue;
        held->why &= ~(why & ~(unsigned)RL_PAGE_ASKED);
        if (!held->why)
            drop(page, held);
    }
}

/* Small: the last to go when the page gets too large. */
static int rank(const rl_ab_page *page, const rl_page_held *held)
{
    static const unsigned order[] = {1u << RL_METRIC_FLIP, RL_PAGE_FIRST,        1u << RL_METRIC_HDRFLIP,
                                     RL_PAGE_LAST,         1u << RL_METRIC_RMSE, 1u << RL_METRIC_SSIM,
                                     1u << RL_METRIC_PSNR, 1u << RL_METRIC_MAX};
    int i = 0, n = (int)(sizeof order / sizeof *order);
    while (i < n && !(held->why & order[i]))
        i++;
    const rl_page_seen *seen = &page->seen[held->seen];
    int place = seen->index < 1000000 ? (int)seen->index : 1000000;
    return i * 1000001 + place;
}

void rl_page_shrink(rl_ab_page *page, unsigned long long fixed)
{
    while (page->n_held && page->held_bytes + fixed > page->options.budget) {
        rl_page_held *last = &page->held[0];
        for (size_t i = 1; i < page->n_held; i++)
            if (rank(page, &page->held[i]) > rank(page, last))
                last = &page->held[i];
        drop(page, last);
        page->left_out++;
    }
}

static rl_code make_room(rl_ab_page *page, rl_error *err)
{
    rl_page_seen *seen = rl_realloc(page->seen, (page->n_seen + 1) * sizeof *seen);
    if (seen)
        page->seen = seen;
    rl_page_held *held = rl_realloc(page->held, (page->n_held + 1) * sizeof *held);
    if (held)
        page->held = held;
    return seen && held ? RL_OK : rl_fail_memory(err, sizeof *seen);
}

static void compare_displays(rl_ab_page *page, const rl_experiment_frame *f)
{
    for (size_t v = 0; page->source->n_displays && v < page->plan->n_listed; v++)
        rl_page_lut_compare(&page->luts[page->source->display_of[v]], &f->images[v][RL_COMPARED_LINEAR],
                            &f->images[v][RL_COMPARED_DISPLAY]);
}

rl_code rl_ab_page_frame(rl_ab_page *page, const rl_ab_page_input *input, rl_error *err)
{
    const rl_experiment_frame *f = input->frame;
    bool failed = f->error && f->error->code;
    rl_page_seen seen = {.capture = f->capture, .index = f->index, .frame = f->frame};
    rl_page_held held = {0};
    rl_code code = make_room(page, err);
    if (!code && failed) {
        rl_str_add(&seen.error, f->error->text[0] ? f->error->text : rl_code_text(f->error->code));
    } else if (!code) {
        seen.x = f->x;
        seen.y = f->y;
        seen.width = f->width;
        seen.height = f->height;
        list_files(page, f, &seen.files);
        find_worst(input->results, &seen);
    }
    if (seen.error.failed || seen.files.failed)
        code = rl_fail_memory(err, 256);
    unsigned why = code || failed ? 0 : reasons(page, &seen);
    if (why)
        code = rl_page_hold(page, input, &held, err);
    if (code) {
        rl_str_free(&seen.error);
        rl_str_free(&seen.files);
        return code;
    }
    if (why) {
        supersede(page, seen.capture, why);
        compare_displays(page, f);
        held.why = why;
        held.seen = page->n_seen;
        page->held[page->n_held++] = held;
        page->held_bytes += rl_page_held_bytes(&held);
    }
    page->seen[page->n_seen++] = seen;
    rl_page_shrink(page, 0); /* what else is in the page is counted when it is written */
    return RL_OK;
}
