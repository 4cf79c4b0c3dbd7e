#include "graph/tool/ab_words.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What is known of a pair. */
typedef struct seen {
    size_t pair;
    size_t n_values;
    rl_metric metric;         /* that is spoken of */
    const rl_ab_value *worst; /* of a material, or of all when there is none; NULL: identical */
    bool display;             /* the images for the display differ, not the linear ones alone */
} seen;

enum { LISTED = 3 /* names in a list, before "and N more" */ };

/* ---- looking ------------------------------------------------------------------------------------------- */

/* Do pixels differ? FLIP and SSIM cannot tell: they look around a pixel, and so at what is beside a material.
 * max is of the linear images, psnr of those for the display: one of them is there. */
static bool pixels_differ(const rl_ab_value *v)
{
    return (v->metric == RL_METRIC_PSNR && isfinite(v->stats[RL_STAT_MEAN])) ||
           (v->metric == RL_METRIC_MAX && v->stats[RL_STAT_MAX] > 0);
}

static bool is_worse(const rl_ab_value *v, const rl_ab_value *than)
{
    if (!than)
        return true;
    double a = v->stats[RL_STAT_P95], b = than->stats[RL_STAT_P95];
    if (a > b || a < b)
        return a > b;
    return v->stats[RL_STAT_MAX] > than->stats[RL_STAT_MAX];
}

/* The worst value of a metric; of materials if the frames have any, since all of them together hide it. */
static const rl_ab_value *find_worst(const rl_ab_results *r, size_t pair, rl_metric metric)
{
    const rl_ab_value *worst = NULL, *whole = NULL;
    for (size_t i = 0; i < r->n_values; i++) {
        const rl_ab_value *v = &r->values[i];
        if (v->pair != pair || v->metric != metric || !(v->stats[RL_STAT_MAX] > 0))
            continue;
        if (v->material == RL_AB_WHOLE)
            whole = is_worse(v, whole) ? v : whole;
        else
            worst = is_worse(v, worst) ? v : worst;
    }
    return worst ? worst : whole;
}

/* FLIP as people see it; where the files of --against give no such image, or the screen shows nothing, what
 * the linear images say. */
static seen look_at(const rl_ab_results *r, size_t pair)
{
    static const rl_metric order[] = {RL_METRIC_FLIP, RL_METRIC_HDRFLIP, RL_METRIC_MAX};
    seen s = {.pair = pair};
    bool any = false;
    for (size_t i = 0; i < r->n_values; i++) {
        s.n_values += r->values[i].pair == pair;
        any = any || (r->values[i].pair == pair && pixels_differ(&r->values[i]));
    }
    for (size_t i = 0; any && i < sizeof order / sizeof *order && !s.worst; i++) {
        s.metric = order[i];
        s.worst = find_worst(r, pair, order[i]);
        s.display = order[i] == RL_METRIC_FLIP;
    }
    return s;
}

static bool is_identical(const rl_ab_results *r, size_t pair, size_t capture, int material)
{
    bool any = false;
    for (size_t i = 0; i < r->n_values; i++) {
        const rl_ab_value *v = &r->values[i];
        if (v->pair != pair || v->capture != capture || v->material != material)
            continue;
        if (pixels_differ(v))
            return false;
        any = true;
    }
    return any;
}

/* All of them in the same frame. */
static const rl_ab_value *whole_of(const rl_ab_results *r, const rl_ab_value *value)
{
    for (size_t i = 0; i < r->n_values; i++) {
        const rl_ab_value *v = &r->values[i];
        if (v->pair == value->pair && v->capture == value->capture && v->index == value->index &&
            v->metric == value->metric && v->material == RL_AB_WHOLE)
            return v;
    }
    return NULL;
}

static int worst_first(const void *a, const void *b)
{
    const seen *x = a, *y = b;
    if (!x->worst != !y->worst)
        return x->worst ? -1 : 1;
    if (x->worst && x->metric != y->metric)
        return x->metric < y->metric ? -1 : 1;
    if (x->worst && is_worse(x->worst, y->worst))
        return -1;
    if (x->worst && is_worse(y->worst, x->worst))
        return 1;
    return x->pair < y->pair ? -1 : x->pair > y->pair;
}

/* ---- saying -------------------------------------------------------------------------------------------- */

static void add_number(rl_str *out, double v)
{
    if (v >= 0.0005 || !(v > 0))
        rl_str_printf(out, "%.3f", v);
    else
        rl_str_printf(out, "%.1g", v);
}

/* ", " or " and " in front of the i-th of n. */
static void add_comma(rl_str *out, size_t i, size_t n)
{
    if (i)
        rl_str_add(out, i + 1 == n ? " and " : ", ");
}

/* "FLIP p95 0.084", or what there is when 95 % of the pixels are equal. */
static void add_value(rl_str *out, const rl_ab_value *v)
{
    static const char *const names[RL_METRICS] = {
        [RL_METRIC_FLIP] = "FLIP", [RL_METRIC_HDRFLIP] = "HDR-FLIP", [RL_METRIC_MAX] = "linear difference"};
    bool spread = v->stats[RL_STAT_P95] > 0;
    rl_str_printf(out, "%s %s ", names[v->metric], spread ? "p95" : "of single pixels up to");
    add_number(out, v->stats[spread ? RL_STAT_P95 : RL_STAT_MAX]);
}

static void add_where(const rl_ab_report *r, const rl_ab_value *v, rl_str *out)
{
    const rl_session *session = rl_experiment_session(r->experiment, 0);
    size_t captures = rl_session_captures(session);
    if (rl_session_frames(session, v->capture) > 1)
        rl_str_printf(out, " in frame %lld", v->frame);
    if (captures > 1)
        rl_str_printf(out, " of capture '%s'", rl_ab_capture_name(r, v->capture));
}

/* "; plaster and leaf are identical". */
static void add_identical(const rl_ab_report *r, const seen *s, rl_str *out)
{
    size_t n, count = 0, said = 0, capture = s->worst->capture;
    const char *const *names = rl_experiment_materials(r->experiment, capture, &n);
    for (size_t m = 1; m < n; m++)
        count += is_identical(r->results, s->pair, capture, (int)m);
    if (!count)
        return;
    rl_str_add(out, "; ");
    if (count > LISTED) {
        rl_str_printf(out, "%zu other materials are identical", count);
        return;
    }
    for (size_t m = 1; m < n; m++)
        if (is_identical(r->results, s->pair, capture, (int)m)) {
            add_comma(out, said++, count);
            rl_str_add(out, names[m]);
        }
    rl_str_add(out, count > 1 ? " are identical" : " is identical");
}

static void add_chance(const rl_ab_report *r, const rl_ab_value *v, rl_str *out)
{
    const rl_ab_null *null = rl_ab_null_of(r->results, v->capture, v->material, v->metric);
    int beyond = rl_ab_beyond_chance(r->results, v);
    if (!null || beyond < 0)
        return;
    rl_str_printf(out, "; %s chance (mean ", beyond ? "beyond" : "within");
    add_number(out, v->stats[RL_STAT_MEAN]);
    rl_str_add(out, ", with other seeds up to ");
    add_number(out, null->bounds[RL_STAT_MEAN]);
    rl_str_add(out, ")");
}

/* The pair that differs most. */
static void say_worst(const rl_ab_report *r, const seen *s, rl_str *out)
{
    const rl_ab_value *v = s->worst, *whole = whole_of(r->results, v);
    const char *material = rl_ab_material_name(r, v->capture, v->material);
    const char *reference = rl_ab_reference_name(r, s->pair);
    rl_str_printf(out, "%s differs most from %s", rl_ab_test_name(r, s->pair), reference);
    if (material)
        rl_str_printf(out, " on %s", material);
    rl_str_add(out, ": ");
    add_value(out, v);
    add_where(r, v, out);
    if (material && whole && whole != v) {
        bool spread = v->stats[RL_STAT_P95] > 0;
        rl_str_add(out, " (whole image ");
        add_number(out, whole->stats[spread ? RL_STAT_P95 : RL_STAT_MAX]);
        rl_str_add(out, ")");
    }
    if (!s->display && s->metric == RL_METRIC_MAX)
        rl_str_add(out, "; nothing of it shows on the display");
    add_identical(r, s, out);
    add_chance(r, v, out);
    rl_str_add(out, ".");
}

static bool one_reference(const rl_ab_report *r)
{
    for (size_t i = 1; i < r->plan->n_pairs; i++)
        if (r->plan->pairs[i].reference != r->plan->pairs[0].reference)
            return false;
    return true;
}

/* "b", or "b against a" when not all pairs have one reference. */
static void add_pair(const rl_ab_report *r, size_t pair, rl_str *out)
{
    rl_str_add(out, rl_ab_test_name(r, pair));
    if (!one_reference(r))
        rl_str_printf(out, " against %s", rl_ab_reference_name(r, pair));
}

/* "Then c (FLIP p95 0.030 on skin) and d (FLIP p95 0.012 on wax)." */
static void say_next(const rl_ab_report *r, const seen *list, size_t n, rl_str *out)
{
    size_t said = n > LISTED ? LISTED - 1 : n;
    if (!n)
        return;
    rl_str_add(out, " Then ");
    for (size_t i = 0; i < said; i++) {
        const rl_ab_value *v = list[i].worst;
        const char *material = rl_ab_material_name(r, v->capture, v->material);
        add_comma(out, i, n > LISTED ? 0 : n);
        add_pair(r, list[i].pair, out);
        rl_str_add(out, " (");
        add_value(out, v);
        rl_str_printf(out, "%s%s)", material ? " on " : "", material ? material : "");
    }
    if (n > LISTED) {
        rl_str_printf(out, ", and %zu more down to ", n - said);
        add_pair(r, list[n - 1].pair, out);
        rl_str_add(out, " (");
        add_value(out, list[n - 1].worst);
        rl_str_add(out, ")");
    }
    rl_str_add(out, ".");
}

/* Pairs without a difference; `only`: there are no others. */
static void say_identical(const rl_ab_report *r, const seen *list, size_t n, bool only, rl_str *out)
{
    /* --against: a file of 8 bits and its image are equal after rounding, and that is all that is known. */
    const char *word = r->plan->against ? "identical" : "bit-identical";
    if (!n)
        return;
    if (!only)
        rl_str_add(out, " ");
    if (n > LISTED)
        rl_str_printf(out, only ? "All %zu comparisons are %s" : "%zu comparisons are %s", n, word);
    for (size_t i = 0; i < n && n <= LISTED; i++) {
        add_comma(out, i, n);
        add_pair(r, list[i].pair, out);
    }
    if (n <= LISTED)
        rl_str_printf(out, n > 1 ? " are %s" : " is %s", word);
    if (one_reference(r) && (n == 1 || (only && n <= LISTED)))
        rl_str_printf(out, " to %s", rl_ab_reference_name(r, list[0].pair));
    rl_str_printf(out, r->frames == 1 ? "." : " in all %zu frames.", r->frames);
}

static void say_chance(const rl_ab_report *r, bool any, rl_str *out)
{
    if (!any)
        return;
    if (r->plan->stochastic && !r->results->n_nulls) {
        rl_str_add(out, " Some passes draw random numbers, and one seed cannot tell a difference from noise "
                        "(--seeds).");
        return;
    }
    for (size_t i = 0; i < r->results->n_values; i++)
        if (rl_ab_beyond_chance(r->results, &r->results->values[i]) == 1)
            return;
    if (r->results->n_nulls)
        rl_str_printf(out, " No difference is larger than what other seeds make (%zu seeds).",
                      1 + r->plan->n_variants - r->plan->n_listed);
}

rl_code rl_ab_words(const rl_ab_report *r, rl_str *out, rl_error *err)
{
    rl_arena arena = {0};
    size_t n_pairs = r->plan->n_pairs, n = 0, differing = 0;
    seen *list = rl_arena_array(&arena, n_pairs + 1, sizeof *list);
    if (!list)
        return rl_fail_memory(err, n_pairs * sizeof *list);
    for (size_t i = 0; i < n_pairs; i++) {
        list[n] = look_at(r->results, i);
        differing += list[n].worst != NULL;
        n += list[n].n_values > 0;
    }
    qsort(list, n, sizeof *list, worst_first);
    if (!n)
        rl_str_add(out, n_pairs ? "No frame was compared." : "There is one variant: nothing to compare.");
    if (differing)
        say_worst(r, &list[0], out);
    if (differing > 1)
        say_next(r, list + 1, differing - 1, out);
    say_identical(r, list + differing, n - differing, !differing, out);
    say_chance(r, differing > 0, out);
    if (r->n_failures)
        rl_str_printf(out, " %zu frame%s failed and %s not counted.", r->n_failures,
                      r->n_failures > 1 ? "s" : "", r->n_failures > 1 ? "are" : "is");
    rl_arena_free(&arena);
    return out->failed ? rl_fail_memory(err, out->room) : RL_OK;
}
