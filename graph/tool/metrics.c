#include "graph/tool/metrics.h"

#include <math.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/tool/metric_color.h"
#include "graph/tool/metric_filter.h"
#include "graph/tool/metric_maps.h"
#include "graph/tool/select.h"

static const char *const metric_names[RL_METRICS] = {"flip", "hdrflip", "psnr", "ssim", "rmse", "max"};
static const char *const stat_names[RL_STATS] = {"mean", "median", "p95", "max"};

static int find(const char *const *names, int n, const char *name)
{
    for (int i = 0; i < n; i++)
        if (!strcmp(names[i], name))
            return i;
    return -1;
}

const char *rl_metric_name(rl_metric metric)
{
    return metric_names[metric];
}

const char *rl_stat_name(rl_stat stat)
{
    return stat_names[stat];
}

int rl_metric_named(const char *name)
{
    return find(metric_names, RL_METRICS, name);
}

int rl_stat_named(const char *name)
{
    return find(stat_names, RL_STATS, name);
}

bool rl_metric_rises(rl_metric metric)
{
    return metric == RL_METRIC_PSNR || metric == RL_METRIC_SSIM;
}

/* ---- maps ---------------------------------------------------------------------------------------------- */

void rl_metric_linear(const rl_metric_image *image, int x, int y, double rgb[3])
{
    for (int c = 0; c < 3; c++) {
        if (c > 0 && image->channels == 1) {
            rgb[c] = rgb[0];
            continue;
        }
        double v = (double)image->plane[c][(size_t)y * image->stride + (size_t)x];
        rgb[c] = fmax(image->encoded ? rl_srgb_decode(v) : v, 0);
    }
}

/* psnr, rmse and max. */
typedef struct difference_job {
    rl_metric metric;
    const rl_metric_image *a, *b;
    float *map;
} difference_job;

static void difference_row(void *ctx, int y)
{
    const difference_job *job = ctx;
    for (int x = 0; x < job->a->width; x++) {
        double sum = 0, largest = 0;
        for (int c = 0; c < job->a->channels; c++) {
            double d = (double)job->b->plane[c][(size_t)y * job->b->stride + (size_t)x] -
                       (double)job->a->plane[c][(size_t)y * job->a->stride + (size_t)x];
            sum += d * d;
            largest = fmax(largest, fabs(d));
        }
        sum /= job->a->channels;
        job->map[(size_t)y * (size_t)job->a->width + (size_t)x] =
            (float)(job->metric == RL_METRIC_PSNR   ? sum
                    : job->metric == RL_METRIC_RMSE ? sqrt(sum)
                                                    : largest);
    }
}

static rl_code check_images(rl_metric metric, const rl_metric_image *a, const rl_metric_image *b,
                            rl_error *err)
{
    if (a->width != b->width || a->height != b->height)
        return rl_fail(err, RL_E_USAGE, RL_NOWHERE, "the image is %d x %d pixels, its reference %d x %d",
                       b->width, b->height, a->width, a->height);
    if (a->channels != b->channels)
        return rl_fail(err, RL_E_USAGE, RL_NOWHERE, "the image has %d channels, its reference %d",
                       b->channels, a->channels);
    if (a->encoded != b->encoded)
        return rl_fail(err, RL_E_USAGE, RL_NOWHERE,
                       "the image is %s, its reference %s: their values do not mean the same",
                       b->encoded ? "display-encoded" : "scene-linear",
                       a->encoded ? "display-encoded" : "scene-linear");
    if (metric <= RL_METRIC_HDRFLIP || metric == RL_METRIC_SSIM)
        if (a->channels != 1 && a->channels != 3)
            return rl_fail(err, RL_E_USAGE, RL_NOWHERE,
                           "%s compares grey or RGB images, not %d channels; psnr, rmse and max take any",
                           rl_metric_name(metric), a->channels);
    return RL_OK;
}

rl_code rl_metric_maps(rl_metric metric, const rl_metric_image *reference, const rl_metric_image *tests,
                       size_t n, rl_pool *pool, float *const *maps, rl_error *err)
{
    for (size_t i = 0; i < n; i++)
        if (check_images(metric, reference, &tests[i], err))
            return err->code;
    if (metric == RL_METRIC_FLIP)
        return rl_flip_maps(reference, tests, n, pool, maps, err);
    if (metric == RL_METRIC_HDRFLIP)
        return rl_hdrflip_maps(reference, tests, n, pool, maps, err);
    for (size_t i = 0; i < n; i++) {
        difference_job job = {metric, reference, &tests[i], maps[i]};
        if (metric != RL_METRIC_SSIM)
            rl_filter_bands(pool, reference->height, difference_row, &job);
        else if (rl_ssim_map(reference, &tests[i], pool, maps[i], err))
            return err->code;
    }
    return RL_OK;
}

rl_code rl_metric_map(rl_metric metric, const rl_metric_image *reference, const rl_metric_image *test,
                      rl_pool *pool, float *map, rl_error *err)
{
    return rl_metric_maps(metric, reference, test, 1, pool, &map, err);
}

/* ---- statistics ---------------------------------------------------------------------------------------- */

double rl_metric_peak(const rl_metric_image *reference)
{
    double peak = -HUGE_VAL;
    if (reference->encoded)
        return 1;
    for (int c = 0; c < reference->channels; c++)
        for (int y = 0; y < reference->height; y++)
            for (int x = 0; x < reference->width; x++)
                peak = fmax(peak, (double)reference->plane[c][(size_t)y * reference->stride + (size_t)x]);
    return peak;
}

/* Percentiles in ascending order: what an earlier one left before *from is not above what is behind. */
static double percentile(float *values, size_t n, double p, size_t *from)
{
    double rank = p * (double)(n - 1);
    size_t k = (size_t)rank;
    double low = (double)rl_select(values + *from, n - *from, k - *from), high = low;
    *from = k;
    if (k + 1 < n) { /* the smallest of those behind */
        high = (double)values[k + 1];
        for (size_t i = k + 2; i < n; i++)
            high = fmin(high, (double)values[i]);
    }
    return low + (high - low) * (rank - (double)k);
}

static double mean_of(rl_metric metric, const float *values, size_t n, double peak)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++) {
        double v = (double)values[i];
        sum += metric == RL_METRIC_RMSE ? v * v : v;
    }
    sum /= (double)n;
    if (metric == RL_METRIC_RMSE)
        return sqrt(sum);
    if (metric != RL_METRIC_PSNR)
        return sum;
    return sum > 0 ? 20 * log10(fmax(peak, 0)) - 10 * log10(sum) : HUGE_VAL;
}

void rl_metric_stats_of(rl_metric metric, float *values, size_t n, double peak, double out[RL_STATS])
{
    for (int i = 0; i < RL_STATS; i++)
        out[i] = NAN;
    if (!n)
        return;
    out[RL_STAT_MEAN] = mean_of(metric, values, n, peak);
    if (metric == RL_METRIC_PSNR)
        return;
    size_t from = 0;
    out[RL_STAT_MEDIAN] = percentile(values, n, 0.5, &from);
    out[RL_STAT_P95] = percentile(values, n, 0.95, &from);
    float most = values[from];
    for (size_t i = from + 1; i < n; i++)
        most = values[i] > most ? values[i] : most;
    out[RL_STAT_MAX] = (double)most;
}

rl_code rl_metric_stats(rl_metric metric, const float *map, const uint8_t *mask, size_t n, double peak,
                        double out[RL_STATS], rl_error *err)
{
    float *values = rl_malloc(n * sizeof *values);
    size_t count = 0;
    if (!values)
        return rl_fail_memory(err, n * sizeof *values);
    for (size_t i = 0; i < n; i++)
        if ((!mask || mask[i]) && !isnan(map[i]))
            values[count++] = map[i];
    rl_metric_stats_of(metric, values, count, peak, out);
    rl_free(values);
    return RL_OK;
}
