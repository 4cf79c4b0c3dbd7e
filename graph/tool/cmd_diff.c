/* `relit diff`: how much an image differs from a reference. */
#include <math.h>
#include <string.h>
#include <unistd.h>

#include "graph/base/alloc.h"
#include "graph/run/image_file.h"
#include "graph/tool/compare_image.h"
#include "graph/tool/heatmap.h"
#include "graph/tool/threshold.h"
#include "graph/tool/tool.h"

static const char place[] = "relit diff";

typedef struct comparison {
    rl_compare_image reference, test;
    rl_metric metric;
    rl_threshold *thresholds;
    rl_pool *pool;
    float *map;
    bool known[RL_METRICS];
    double stats[RL_METRICS][RL_STATS];
} comparison;

/* ---- what was asked for -------------------------------------------------------------------------------- */

/* All that can be wrong before a pixel is read. */
static rl_code read_arguments(rl_tool *tool, comparison *c, rl_error *err)
{
    const rl_arguments *a = &tool->args;
    int metric = -1;
    if (a->metric && rl_threshold_metric(place, "metric", a->metric, &metric, err))
        return err->code;
    c->metric = metric < 0 ? RL_METRICS : (rl_metric)metric;
    c->thresholds = rl_arena_array(tool->arena, a->n_fail_over + 1, sizeof *c->thresholds);
    if (!c->thresholds)
        return rl_fail_memory(err, a->n_fail_over * sizeof *c->thresholds);
    for (size_t i = 0; i < a->n_fail_over; i++)
        if (rl_threshold_parse(tool->arena, place, a->fail_over[i], false, &c->thresholds[i], err))
            return err->code;
    if (a->heatmap)
        return rl_image_file_check(a->heatmap, (rl_where){.file = place}, err);
    return RL_OK;
}

/* ---- two images ---------------------------------------------------------------------------------------- */

static bool is_color(rl_metric metric)
{
    return metric <= RL_METRIC_HDRFLIP || metric == RL_METRIC_SSIM;
}

/* What rl_metric_map would refuse, said with the files' names. */
static rl_code check_pair(const rl_tool *tool, const comparison *c, rl_error *err)
{
    const char *a = tool->args.operand, *b = tool->args.second;
    const rl_metric_image *va = &c->reference.view, *vb = &c->test.view;
    if (va->width != vb->width || va->height != vb->height)
        return rl_fail_file(err, RL_E_DATA, b, "is %d x %d pixels, '%s' is %d x %d", vb->width, vb->height, a,
                            va->width, va->height);
    if (c->reference.x != c->test.x || c->reference.y != c->test.y)
        return rl_fail_file(err, RL_E_DATA, b, "its data window begins at (%d, %d), that of '%s' at (%d, %d)",
                            c->test.x, c->test.y, a, c->reference.x, c->reference.y);
    if (va->channels != vb->channels || c->reference.data != c->test.data)
        return rl_fail_file(err, RL_E_DATA, b, "has channels %s, '%s' has %s", c->test.channels, a,
                            c->reference.channels);
    if (va->encoded != vb->encoded)
        return rl_fail_file(err, RL_E_DATA, b, "is %s, '%s' is %s: their values do not mean the same",
                            vb->encoded ? "display-encoded (8 or 16 bits)" : "linear (half or float)", a,
                            va->encoded ? "display-encoded (8 or 16 bits)" : "linear (half or float)");
    return RL_OK;
}

static rl_code check_metric(const rl_tool *tool, const comparison *c, rl_metric metric, rl_error *err)
{
    const rl_log *log = &tool->report->log;
    if (is_color(metric) && c->reference.data)
        return rl_fail_file(err, RL_E_DATA, tool->args.operand,
                            "%s compares colours, but the channels are %s; take --metric rmse, max or psnr",
                            rl_metric_name(metric), c->reference.channels);
    if (is_color(metric) && !c->reference.rec709)
        rl_report(
            log, RL_NOTE, (rl_where){.file = tool->args.operand},
            "its primaries are not those of Rec. 709; %s takes its numbers as if they were, as the published "
            "tool does",
            rl_metric_name(metric));
    if (c->reference.rec709 != c->test.rec709)
        rl_report(log, RL_WARNING, (rl_where){.file = tool->args.second},
                  "its primaries differ from those of '%s': numbers are compared as they are",
                  tool->args.operand);
    return RL_OK;
}

static rl_code read_pair(const rl_tool *tool, comparison *c, rl_error *err)
{
    long cpus = sysconf(_SC_NPROCESSORS_ONLN);
    int threads = tool->args.run.threads ? tool->args.run.threads : cpus > 0 ? (int)cpus : 1;
    if (rl_pool_new(threads, &c->pool, err) ||
        rl_compare_image_read(tool->args.operand, c->pool, &c->reference, err) ||
        rl_compare_image_read(tool->args.second, c->pool, &c->test, err) || check_pair(tool, c, err))
        return err->code;
    if (c->metric == RL_METRICS)
        c->metric = c->reference.view.encoded ? RL_METRIC_FLIP : RL_METRIC_HDRFLIP;
    size_t n = (size_t)c->reference.view.width * (size_t)c->reference.view.height;
    c->map = rl_malloc(n * sizeof *c->map);
    return c->map ? RL_OK : rl_fail_memory(err, n * sizeof *c->map);
}

/* Leaves the metric's map in c->map. */
static rl_code measure(const rl_tool *tool, comparison *c, rl_metric metric, rl_error *err)
{
    const rl_metric_image *reference = &c->reference.view;
    if (check_metric(tool, c, metric, err) ||
        rl_metric_map(metric, reference, &c->test.view, c->pool, c->map, err))
        return err->code;
    c->known[metric] = true;
    return rl_metric_stats(metric, c->map, NULL, (size_t)reference->width * (size_t)reference->height,
                           rl_metric_peak(reference), c->stats[metric], err);
}

/* ---- what is said about it ----------------------------------------------------------------------------- */

static void print_text(const rl_tool *tool, const comparison *c, rl_str *out)
{
    rl_str_printf(out, "%s of %s against %s\n", rl_metric_name(c->metric), tool->args.second,
                  tool->args.operand);
    for (int i = 0; i < RL_STATS; i++)
        if (!isnan(c->stats[c->metric][i]))
            rl_str_printf(out, "  %-7s %.6g%s\n", rl_stat_name((rl_stat)i), c->stats[c->metric][i],
                          c->metric == RL_METRIC_PSNR ? " dB" : "");
}

static void print_json(const comparison *c, rl_str *out)
{
    rl_str_printf(out, "{\"metric\": \"%s\"", rl_metric_name(c->metric));
    for (int i = 0; i < RL_STATS; i++) {
        char number[32];
        double v = c->stats[c->metric][i];
        rl_str_printf(out, ", \"%s\": %s", rl_stat_name((rl_stat)i),
                      isfinite(v) ? rl_format_double(v, number) : "null");
    }
    rl_str_add(out, "}\n");
}

/* RL_OK when no threshold is exceeded, else an error that names all that are. */
static rl_code check_thresholds(const rl_tool *tool, const comparison *c, rl_error *err)
{
    rl_str text = {0};
    for (size_t i = 0; i < tool->args.n_fail_over; i++) {
        const rl_threshold *t = &c->thresholds[i];
        rl_metric metric = t->metric < 0 ? c->metric : (rl_metric)t->metric;
        double v = c->stats[metric][t->stat];
        if (!rl_threshold_is_over(metric, t->limit, v))
            continue;
        rl_str_printf(&text, "%s%s.%s is %.6g, %s %g", text.length ? "; " : "", rl_metric_name(metric),
                      rl_stat_name(t->stat), v, rl_metric_rises(metric) ? "under" : "over", t->limit);
    }
    if (text.length || text.failed)
        rl_fail_file(err, RL_E_DATA, tool->args.second, "%s", rl_str_text(&text));
    rl_str_free(&text);
    return err->code;
}

static rl_code measure_all(const rl_tool *tool, comparison *c, rl_error *err)
{
    rl_code code = measure(tool, c, c->metric, err);
    if (!code && tool->args.heatmap)
        code = rl_heatmap_write(tool->args.heatmap, c->metric, c->map, c->reference.view.width,
                                c->reference.view.height, c->pool, &tool->report->log, err);
    for (size_t i = 0; !code && i < tool->args.n_fail_over; i++) {
        int metric = c->thresholds[i].metric;
        if (metric >= 0 && !c->known[metric])
            code = measure(tool, c, (rl_metric)metric, err);
    }
    return code;
}

int rl_cmd_diff(rl_tool *tool, rl_error *err)
{
    comparison c = {0};
    rl_str text = {0};
    int status = RL_EXIT_WRONG;
    if (read_arguments(tool, &c, err) || read_pair(tool, &c, err) || measure_all(tool, &c, err))
        goto done;
    if (tool->args.json)
        print_json(&c, &text);
    else
        print_text(tool, &c, &text);
    status = rl_tool_print(tool, &text, err);
    if (status == RL_EXIT_DONE && check_thresholds(tool, &c, err))
        status = RL_EXIT_OVER;
done:
    rl_free(c.map);
    rl_compare_image_free(&c.reference);
    rl_compare_image_free(&c.test);
    rl_pool_free(&c.pool);
    return status;
}
