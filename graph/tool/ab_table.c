#include "graph/tool/ab_table.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

typedef struct column {
    const char *title;
    rl_metric metric;
    rl_stat stat;
} column;

static const column columns[] = {
    {"FLIP", RL_METRIC_FLIP, RL_STAT_MEAN},        {"p95", RL_METRIC_FLIP, RL_STAT_P95},
    {"HDR-FLIP", RL_METRIC_HDRFLIP, RL_STAT_MEAN}, {"p95", RL_METRIC_HDRFLIP, RL_STAT_P95},
    {"PSNR dB", RL_METRIC_PSNR, RL_STAT_MEAN},     {"SSIM", RL_METRIC_SSIM, RL_STAT_MEAN},
    {"RMSE", RL_METRIC_RMSE, RL_STAT_MEAN},        {"max", RL_METRIC_MAX, RL_STAT_MAX},
};
enum { COLUMNS = sizeof columns / sizeof *columns, NAME = 16, CELL = 9 };

/* The values of a pair and capture; they stand together frame by frame, not as a whole. */
typedef struct place {
    const rl_ab_report *r;
    size_t capture, pair;
} place;

static const rl_ab_value *next(const place *p, int material, rl_metric metric, size_t *at)
{
    const rl_ab_results *results = p->r->results;
    while (*at < results->n_values) {
        const rl_ab_value *v = &results->values[(*at)++];
        if (v->capture == p->capture && v->pair == p->pair && v->material == material && v->metric == metric)
            return v;
    }
    return NULL;
}

/* Over the frames that have it: the mean; of squares for rmse and psnr; the largest of max. *marked: a value
 * of them is beyond chance. */
static double over_frames(const place *p, int material, const column *c, bool *marked)
{
    const rl_ab_value *v;
    double sum = 0;
    size_t n = 0;
    for (size_t at = 0; (v = next(p, material, c->metric, &at));) {
        double x = v->stats[c->stat];
        if (isnan(x))
            continue;
        if (c->metric == RL_METRIC_RMSE)
            sum += x * x;
        else if (c->metric == RL_METRIC_PSNR)
            sum += pow(10, -x / 10); /* 10^-inf: equal images */
        else if (c->stat == RL_STAT_MAX)
            sum = n ? fmax(sum, x) : x;
        else
            sum += x;
        n++;
        *marked = *marked || (c->stat == RL_STAT_MEAN && rl_ab_beyond_chance(p->r->results, v) == 1);
    }
    if (!n)
        return NAN;
    if (c->stat == RL_STAT_MAX)
        return sum;
    sum /= (double)n;
    return c->metric == RL_METRIC_RMSE   ? sqrt(sum)
           : c->metric == RL_METRIC_PSNR ? (sum > 0 ? -10 * log10(sum) : (double)INFINITY)
                                         : sum;
}

/* The frame of the worst mean; *n: how many frames have the material. */
static const rl_ab_value *worst_frame(const place *p, int material, size_t *n)
{
    static const rl_metric order[] = {RL_METRIC_FLIP, RL_METRIC_HDRFLIP};
    const rl_ab_value *v, *worst = NULL;
    *n = 0;
    for (size_t i = 0; i < 2 && !worst; i++)
        for (size_t at = 0; (v = next(p, material, order[i], &at));) {
            ++*n;
            if (!worst || v->stats[RL_STAT_MEAN] > worst->stats[RL_STAT_MEAN])
                worst = v;
        }
    return worst;
}

static double of_frame(const place *p, int material, const column *c, const rl_ab_value *frame, bool *marked)
{
    const rl_ab_value *v;
    for (size_t at = 0; (v = next(p, material, c->metric, &at));)
        if (v->index == frame->index) {
            *marked = c->stat == RL_STAT_MEAN && rl_ab_beyond_chance(p->r->results, v) == 1;
            return v->stats[c->stat];
        }
    return NAN;
}

static void add_cell(rl_str *out, const column *c, double v, bool marked)
{
    char text[32];
    if (isnan(v))
        snprintf(text, sizeof text, "-");
    else if (isinf(v))
        snprintf(text, sizeof text, "equal");
    else if (c->metric == RL_METRIC_PSNR)
        snprintf(text, sizeof text, "%.2f", v);
    else if (c->metric == RL_METRIC_SSIM)
        snprintf(text, sizeof text, "%.5f", v);
    else if (v > 0 && v < 5e-5)
        snprintf(text, sizeof text, "%.1e", v);
    else
        snprintf(text, sizeof text, v < 1000 ? "%.4f" : "%.3g", v);
    rl_str_printf(out, "%*s%s", CELL, text, marked ? "*" : " ");
}

/* Names are cut to the column, with a mark. */
static void add_name(rl_str *out, const char *indent, const char *name)
{
    int room = NAME - (int)strlen(indent);
    if ((int)strlen(name) <= room)
        rl_str_printf(out, "%s%-*s", indent, room, name);
    else
        rl_str_printf(out, "%s%.*s~", indent, room - 1, name);
}

/* No space at the end of a line. */
static void end_line(rl_str *out)
{
    while (out->length && out->text[out->length - 1] == ' ')
        out->text[--out->length] = 0;
    rl_str_add(out, "\n");
}

static bool add_rows(const place *p, int material, rl_str *out)
{
    size_t n;
    bool any = false;
    const char *name = rl_ab_material_name(p->r, p->capture, material);
    const rl_ab_value *worst = worst_frame(p, material, &n);
    char label[32];
    if (!worst)
        return false;
    add_name(out, "  ", name ? name : "all");
    for (int i = 0; i < COLUMNS; i++) {
        bool marked = false;
        double v = over_frames(p, material, &columns[i], &marked);
        any = any || marked;
        add_cell(out, &columns[i], v, marked);
    }
    end_line(out);
    if (n < 2)
        return any;
    snprintf(label, sizeof label, "frame %lld", worst->frame);
    add_name(out, "    ", label);
    for (int i = 0; i < COLUMNS; i++) {
        bool marked = false;
        double v = of_frame(p, material, &columns[i], worst, &marked);
        add_cell(out, &columns[i], v, marked);
    }
    end_line(out);
    return any;
}

static bool add_table(const place *p, rl_str *out)
{
    size_t n;
    bool any = false;
    const rl_session *session = rl_experiment_session(p->r->experiment, 0);
    rl_experiment_materials(p->r->experiment, p->capture, &n);
    rl_str_printf(out, "%s against %s", rl_ab_test_name(p->r, p->pair), rl_ab_reference_name(p->r, p->pair));
    if (rl_session_captures(session) > 1)
        rl_str_printf(out, ", capture '%s'", rl_ab_capture_name(p->r, p->capture));
    rl_str_add(out, "\n");
    rl_str_printf(out, "%*s", NAME, "");
    for (int i = 0; i < COLUMNS; i++)
        rl_str_printf(out, "%*s ", CELL, columns[i].title);
    end_line(out);
    for (int m = RL_AB_WHOLE; m < (int)n; m++)
        if (m)
            any = add_rows(p, m, out) || any;
    rl_str_add(out, "\n");
    return any;
}

static void add_legend(const rl_ab_report *r, bool any, rl_str *out)
{
    size_t replicates = r->plan->n_variants - r->plan->n_listed;
    rl_str_add(out,
               "Mean over the frames, then the worst frame. Pixels without material are left out. FLIP and "
               "SSIM look\naround a pixel: what is beside a material shows in its numbers.\n");
    if (!r->plan->stochastic)
        rl_str_add(out, "No pass draws random numbers: every difference is one of the variants.\n");
    if (!r->results->n_nulls)
        return;
    if (any)
        rl_str_printf(out,
                      "* beyond chance: more than %zu other seed%s make. Without a cause, a material and "
                      "metric gets a * in at\n  most 1 of %zu runs.\n",
                      replicates, replicates == 1 ? "" : "s", replicates + 1);
    else
        rl_str_printf(out, "No difference is larger than what %zu other seed%s make.\n", replicates,
                      replicates == 1 ? "" : "s");
}

void rl_ab_table(const rl_ab_report *r, rl_str *out)
{
    size_t captures = rl_session_captures(rl_experiment_session(r->experiment, 0));
    bool any = false;
    for (size_t pair = 0; pair < r->plan->n_pairs; pair++)
        for (size_t c = 0; c < captures; c++)
            any = add_table(&(place){r, c, pair}, out) || any;
    if (r->plan->n_pairs && r->results->n_values)
        add_legend(r, any, out);
}
