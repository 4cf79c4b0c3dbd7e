/* report.html: the sources of the page with the data in their places. */
#include <errno.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/tool/ab_page_parts.h"
#include "graph/tool/heatmap.h"

/* Where the file goes. Errors of the stream stay in it until the end. */
typedef struct writer {
    FILE *file;
    bool *out_of_memory;
    rl_ab_page *page;
    json_t *metrics;
    const char *metrics_text;
    const rl_page_held **order; /* as the page lists them */
} writer;

static void put(const writer *w, const char *text)
{
    fputs(text, w->file);
}

static void put_text(const writer *w, rl_str *s)
{
    put(w, rl_str_text(s));
    *w->out_of_memory |= s->failed;
    rl_str_free(s);
}

static void put_number(rl_str *s, double value)
{
    char text[32];
    rl_str_add(s, isfinite(value) ? rl_format_double(value, text) : "null");
}

/* ---- what the page is told besides metrics.json -------------------------------------------------------- */

static void add_block(rl_str *s, const rl_page_held *held, size_t i, size_t first)
{
    const rl_page_block *b = &held->blocks[i];
    if (!b->size) {
        rl_str_add(s, "null");
        return;
    }
    rl_str_printf(s, "{\"id\":%zu,\"bits\":%d,\"planes\":%d,\"width\":%d,\"height\":%d", first + i, b->bits,
                  b->planes, b->width, b->height);
    if (b->based)
        rl_str_printf(s, ",\"base\":%zu", first);
    rl_str_add(s, "}");
}

static void add_why(rl_str *s, unsigned why)
{
    const char *between = "";
    rl_str_add(s, "[");
    for (unsigned m = 0; m < RL_METRICS; m++)
        if (why & 1u << m) {
            rl_str_printf(s, "%s\"worst %s\"", between, rl_metric_name((rl_metric)m));
            between = ",";
        }
    static const struct {
        unsigned bit;
        const char *name;
    } others[] = {{RL_PAGE_FIRST, "first"}, {RL_PAGE_LAST, "last"}, {RL_PAGE_ASKED, "chosen"}};
    for (size_t i = 0; i < sizeof others / sizeof *others; i++)
        if (why & others[i].bit) {
            rl_str_printf(s, "%s\"%s\"", between, others[i].name);
            between = ",";
        }
    rl_str_add(s, "]");
}

/* Ids of blocks count through the page: the tables of the displays come first. */
static void add_held(const writer *w, rl_str *s, const rl_page_held *held, size_t id)
{
    const rl_ab_page *page = w->page;
    size_t listed = page->plan->n_listed;
    rl_str_add(s, ",\"why\":");
    add_why(s, held->why);
    rl_str_add(s, ",\"images\":[");
    for (size_t v = 0; v < listed; v++) {
        rl_str_add(s, v ? "," : "");
        add_block(s, held, v, id);
    }
    rl_str_add(s, "],\"reference\":");
    add_block(s, held, listed, id);
    rl_str_printf(s, ",\"encoded\":%s,\"ids\":", held->encoded ? "true" : "false");
    add_block(s, held, listed + 1, id);
    rl_str_add(s, ",\"maps\":[");
    for (size_t i = listed + 2; i < held->n_blocks; i++) {
        size_t k = i - listed - 2;
        rl_str_printf(s, "%s{\"pair\":%zu,\"metric\":\"%s\",\"block\":", k ? "," : "", k / RL_PAGE_MAPS,
                      rl_metric_name(rl_page_maps[k % RL_PAGE_MAPS]));
        add_block(s, held, i, id);
        rl_str_add(s, "}");
    }
    rl_str_add(s, "]");
}

static void add_frames(const writer *w, rl_str *s)
{
    const rl_ab_page *page = w->page;
    size_t id = page->source->n_displays;
    rl_str_add(s, ",\"frames\":[");
    for (size_t i = 0; i < page->n_seen; i++) {
        const rl_page_seen *seen = &page->seen[i];
        rl_str_printf(s, "%s\n{\"capture\":%zu,\"index\":%zu,\"frame\":%lld", i ? "," : "", seen->capture,
                      seen->index, seen->frame);
        if (seen->error.length) {
            rl_str_add(s, ",\"error\":");
            rl_page_json_text(s, seen->error.text);
        } else {
            rl_str_printf(s, ",\"x\":%d,\"y\":%d,\"width\":%d,\"height\":%d,\"files\":%s", seen->x, seen->y,
                          seen->width, seen->height, rl_str_text(&seen->files));
        }
        const rl_page_held *held = w->order[i];
        if (held) {
            add_held(w, s, held, id);
            id += held->n_blocks;
        }
        rl_str_add(s, "}");
    }
    rl_str_add(s, "]");
}

static void add_displays(const rl_ab_page *page, rl_str *s)
{
    rl_str_add(s, "\"displays\":[");
    for (size_t i = 0; i < page->source->n_displays; i++) {
        const rl_page_lut *l = &page->luts[i];
        rl_str_add(s, i ? ",{\"name\":" : "{\"name\":");
        rl_page_json_text(s, l->display->name);
        rl_str_printf(s, ",\"id\":%zu,\"n\":%d", i, l->n);
        const struct {
            const char *name;
            double value;
        } numbers[] = {{"knee", l->knee},
                       {"first", l->first},
                       {"last", l->last},
                       {"low", l->low},
                       {"high", l->high},
                       {"errorMax", l->pixels ? l->error_max : (double)NAN},
                       {"errorMean", l->pixels ? l->error_sum / (double)l->pixels : (double)NAN}};
        for (size_t k = 0; k < sizeof numbers / sizeof *numbers; k++) {
            rl_str_printf(s, ",\"%s\":", numbers[k].name);
            put_number(s, numbers[k].value);
        }
        rl_str_printf(s, ",\"pixels\":%llu}", l->pixels);
    }
    rl_str_add(s, "],\"displayOf\":[");
    for (size_t v = 0; page->source->n_displays && v < page->plan->n_listed; v++)
        rl_str_printf(s, "%s%zu", v ? "," : "", page->source->display_of[v]);
    rl_str_add(s, "]");
}

/* 256 colours, three bytes each. */
static void add_heat(rl_str *s)
{
    rl_str_add(s, ",\"heat\":[");
    for (int i = 0; i < 256; i++) {
        float rgb[3];
        rl_heat_color(i / 255.0, rgb);
        for (int c = 0; c < 3; c++)
            rl_str_printf(s, "%s%d", i || c ? "," : "", (int)lrintf(rgb[c] * 255));
    }
    rl_str_add(s, "]");
}

static void put_page(const writer *w)
{
    rl_str s = {0};
    rl_str_add(&s, "{");
    add_displays(w->page, &s);
    rl_str_printf(&s, ",\"budget\":%llu,\"leftOut\":%zu", w->page->options.budget, w->page->left_out);
    add_heat(&s);
    add_frames(w, &s);
    rl_str_add(&s, "}\n");
    put_text(w, &s);
}

/* ---- blocks -------------------------------------------------------------------------------------------- */

static rl_code put_block(const writer *w, size_t id, const uint8_t *data, size_t size, rl_error *err)
{
    size_t n = rl_page_base64_size(size);
    char *text = rl_malloc(n);
    if (!text)
        return rl_fail_memory(err, n);
    rl_page_base64(data, size, text);
    fprintf(w->file, "<script type=\"application/octet-stream\" id=\"block-%zu\">", id);
    fwrite(text, 1, n, w->file);
    put(w, "</script>\n");
    rl_free(text);
    return RL_OK;
}

static rl_code put_held(const writer *w, const rl_page_held *held, size_t id, rl_error *err)
{
    rl_code code = RL_OK;
    for (size_t i = 0; i < held->n_blocks && !code; i++) {
        const rl_page_block *b = &held->blocks[i];
        if (!b->size)
            continue;
        uint8_t *data = rl_malloc(b->size);
        code = data ? rl_page_spool_read(&w->page->spool, b->at, data, b->size, err)
                    : rl_fail_memory(err, b->size);
        if (!code)
            code = put_block(w, id + i, data, b->size, err);
        rl_free(data);
    }
    return code;
}

static rl_code put_blocks(const writer *w, rl_error *err)
{
    const rl_ab_page *page = w->page;
    size_t id = page->source->n_displays;
    rl_code code = RL_OK;
    for (size_t i = 0; i < page->source->n_displays && !code; i++)
        code = put_block(w, i, page->luts[i].packed, page->luts[i].size, err);
    for (size_t i = 0; i < page->n_seen && !code; i++) {
        if (!w->order[i])
            continue;
        code = put_held(w, w->order[i], id, err);
        id += w->order[i]->n_blocks;
    }
    return code;
}

/* ---- the page ------------------------------------------------------------------------------------------ */

static void put_html(const writer *w, const char *text)
{
    rl_str s = {0};
    rl_page_html_text(&s, text);
    put_text(w, &s);
}

static void put_title(const writer *w)
{
    enum { MOST = 4 };
    size_t n = w->page->plan->n_listed, named = n > MOST ? MOST - 1 : n;
    for (size_t v = 0; v < named; v++) {
        put(w, v ? "\xc2\xa0· " : "");
        put_html(w, w->page->plan->variants[v].name);
    }
    if (named < n)
        fprintf(w->file, " and %zu more", n - named);
}

static const char *const scripts[] = {"text.js",     "decode.js",  "display.js", "look.js",
                                      "look_gl.js",  "look_2d.js", "viewer.js",  "viewer_input.js",
                                      "readout.js",  "plot.js",    "tables.js",  "graph.js",
                                      "sections.js", "main.js",    NULL};

static void put_n(void *ctx, const char *text, size_t n)
{
    fwrite(text, 1, n, ((const writer *)ctx)->file);
}

static rl_code put_part(void *ctx, const char *name, size_t n, rl_error *err)
{
    const writer *w = ctx;
    const rl_page_maker maker = {put_n, NULL, ctx};
    const char *summary = json_string_value(json_object_get(w->metrics, "summary"));
    if (!strncmp(name, "title", n))
        put_title(w);
    else if (!strncmp(name, "style", n))
        put(w, rl_page_source("page.css"));
    else if (!strncmp(name, "summary", n))
        put_html(w, summary ? summary : "");
    else if (!strncmp(name, "metrics", n))
        rl_page_put_json(&maker, w->metrics_text);
    else if (!strncmp(name, "page", n))
        put_page(w);
    else if (!strncmp(name, "script", n))
        rl_page_put_scripts(&maker, scripts);
    else if (!strncmp(name, "blocks", n))
        return put_blocks(w, err);
    return RL_OK;
}

static rl_code write_file(writer *w, const char *path, unsigned long long *bytes, rl_error *err)
{
    char temp[4096];
    rl_code code = rl_file_temp(path, temp, sizeof temp, err);
    if (code)
        return code;
    bool out_of_memory = false;
    w->out_of_memory = &out_of_memory;
    w->file = fopen(temp, "wbe");
    if (!w->file)
        return rl_fail_file(err, RL_E_IO, path, "cannot be written: %s", strerror(errno));
    const rl_page_maker maker = {put_n, put_part, w};
    code = rl_page_expand("page.html", &maker, err);
    long size = ftell(w->file);
    bool bad = ferror(w->file) || size < 0;
    bad |= fclose(w->file) != 0;
    if (!code && out_of_memory)
        code = rl_fail_memory(err, 4096);
    if (!code && bad)
        code = rl_fail_file(err, RL_E_IO, path, "cannot be written: %s", strerror(errno));
    *bytes = size > 0 ? (unsigned long long)size : 0;
    if (!code)
        return rl_file_commit(temp, path, err);
    rl_file_discard(temp);
    return code;
}

/* What is in the page besides frames, a little more than less. */
static unsigned long long fixed_bytes(const rl_ab_page *page, const char *metrics)
{
    unsigned long long bytes =
        strlen(metrics) + strlen(rl_page_source("page.html")) + strlen(rl_page_source("page.css")) + 8192;
    for (const char *const *name = scripts; *name; name++)
        bytes += strlen(rl_page_source(*name));
    for (size_t i = 0; i < page->source->n_displays; i++)
        bytes += rl_page_base64_size(page->luts[i].size) + 256;
    for (size_t i = 0; i < page->n_seen; i++)
        bytes += 512 + page->seen[i].files.length + page->seen[i].error.length;
    return bytes;
}

static void summarize(const rl_ab_page *page, unsigned long long bytes, rl_ab_page_summary *out)
{
    *out = (rl_ab_page_summary){.held = page->n_held, .left_out = page->left_out, .bytes = bytes};
    for (size_t i = 0; i < page->n_seen; i++)
        out->frames += page->seen[i].error.length == 0;
}

rl_code rl_ab_page_write(rl_ab_page *page, const char *path, const char *metrics, rl_ab_page_summary *out,
                         rl_error *err)
{
    json_error_t bad;
    writer w = {.page = page, .metrics_text = metrics};
    unsigned long long bytes = 0;
    rl_code code = RL_OK;
    w.metrics = json_loads(metrics, 0, &bad);
    if (!json_is_object(w.metrics)) {
        code = rl_fail_file(err, RL_E_FORMAT, path, "the metrics are no JSON object: %s", bad.text);
        goto done;
    }
    rl_page_shrink(page, fixed_bytes(page, metrics));
    w.order = rl_calloc(page->n_seen + 1, sizeof *w.order);
    if (!w.order) {
        code = rl_fail_memory(err, page->n_seen * sizeof *w.order);
        goto done;
    }
    for (size_t i = 0; i < page->n_held; i++)
        w.order[page->held[i].seen] = &page->held[i];
    code = write_file(&w, path, &bytes, err);
    if (!code && page->left_out)
        rl_report(page->options.log, RL_NOTE, (rl_where){.file = path},
                  "%zu frames are linked and not held: the page would be larger than %llu MiB",
                  page->left_out, page->options.budget >> 20);
    if (!code && out)
        summarize(page, bytes, out);
done:
    json_decref(w.metrics);
    rl_free(w.order);
    return code;
}
