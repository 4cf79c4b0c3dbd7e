/* SSIM. Wang, Bovik, Sheikh, Simoncelli: Image Quality Assessment: From Error Visibility to Structural
 * Similarity, IEEE TIP 2004. */
#include <math.h>
#include <stdatomic.h>

#include "graph/base/alloc.h"
#include "graph/tool/metric_color.h"
#include "graph/tool/metric_filter.h"
#include "graph/tool/metric_maps.h"

enum { RADIUS = 5 };
static const double sigma = 1.5, c1 = 0.01 * 0.01, c2 = 0.03 * 0.03; /* the peak is 1 */

/* Local means: of a, b, a², b², a·b. */
enum { MEAN_A, MEAN_B, MEAN_AA, MEAN_BB, MEAN_AB, MEANS };

typedef struct ssim_job {
    const rl_metric_image *image[2];
    double scale; /* of linear luminance */
    rl_filter filter;
    float *map;
    atomic_bool failed;
} ssim_job;

static double luminance_at(const rl_metric_image *image, int x, int y)
{
    size_t at = (size_t)y * image->stride + (size_t)x;
    double rgb[3];
    if (image->channels == 1)
        return (double)image->plane[0][at];
    for (int c = 0; c < 3; c++)
        rgb[c] = (double)image->plane[c][at];
    return rl_luminance(rgb);
}

static double value_at(const ssim_job *job, int k, int x, int y)
{
    double v = luminance_at(job->image[k], x, y);
    return job->image[k]->encoded ? v : rl_srgb_encode(v * job->scale);
}

/* The five products of row y, filtered along. Columns that need pixels beyond the ends are not used. */
static void filter_across(const ssim_job *job, int y, double *padded, double *out, size_t n)
{
    int width = job->image[0]->width;
    double *value[MEANS];
    size_t room = n + 2 * RL_FILTER_RADIUS;
    for (int m = 0; m < MEANS; m++)
        value[m] = padded + (size_t)m * room + RL_FILTER_RADIUS;
    for (int x = 0; x < width; x++) {
        double a = value_at(job, 0, x, y), b = value_at(job, 1, x, y);
        value[MEAN_A][x] = a;
        value[MEAN_B][x] = b;
        value[MEAN_AA][x] = a * a;
        value[MEAN_BB][x] = b * b;
        value[MEAN_AB][x] = a * b;
    }
    for (int m = 0; m < MEANS; m++)
        rl_filter_along(out + (size_t)m * n, padded + (size_t)m * room, &job->filter, (int)n);
}

static double similarity(const double mean[MEANS])
{
    double a = mean[MEAN_A], b = mean[MEAN_B];
    double var_a = mean[MEAN_AA] - a * a, var_b = mean[MEAN_BB] - b * b, cov = mean[MEAN_AB] - a * b;
    return (2 * a * b + c1) * (2 * cov + c2) / ((a * a + b * b + c1) * (var_a + var_b + c2));
}

static void compare_row(const ssim_job *job, int y, const double *across, double *const down[MEANS], size_t n)
{
    int width = job->image[0]->width;
    float *map = job->map + (size_t)y * (size_t)width;
    for (int m = 0; m < MEANS; m++) {
        const double *rows[2 * RADIUS + 1];
        for (size_t i = 0; i <= 2 * RADIUS; i++)
            rows[i] = across + (i * MEANS + (size_t)m) * n;
        rl_filter_sum(down[m], rows, job->filter.w, 2 * RADIUS + 1, (int)n);
    }
    for (int x = RADIUS; x < width - RADIUS; x++) {
        double mean[MEANS];
        for (int m = 0; m < MEANS; m++)
            mean[m] = down[m][x];
        map[x] = (float)similarity(mean);
    }
}

static void compare_band(void *ctx, int band)
{
    ssim_job *job = ctx;
    int height = job->image[0]->height, begin = band * RL_BAND_ROWS, end = begin + RL_BAND_ROWS;
    begin = begin > RADIUS ? begin : RADIUS;
    end = end < height - RADIUS ? end : height - RADIUS;
    if (begin >= end)
        return;
    size_t n = (size_t)rl_filter_width(job->image[0]->width);
    size_t rows = (size_t)(end - begin) + 2 * RADIUS, padding = MEANS * (n + 2 * RL_FILTER_RADIUS);
    double *scratch = rl_calloc(rows * MEANS * n + padding + MEANS * n, sizeof *scratch), *down[MEANS];
    if (!scratch) {
        atomic_store(&job->failed, true);
        return;
    }
    double *padded = scratch + rows * MEANS * n;
    for (size_t m = 0; m < MEANS; m++)
        down[m] = padded + padding + m * n;
    for (size_t i = 0; i < rows; i++)
        filter_across(job, begin - RADIUS + (int)i, padded, scratch + i * MEANS * n, n);
    for (int y = begin; y < end; y++)
        compare_row(job, y, scratch + (size_t)(y - begin) * MEANS * n, down, n);
    rl_free(scratch);
}

rl_code rl_ssim_map(const rl_metric_image *reference, const rl_metric_image *test, rl_pool *pool, float *map,
                    rl_error *err)
{
    int width = reference->width, height = reference->height;
    ssim_job job = {{reference, test}, 1, rl_filter_gaussian(sigma, RADIUS), map, false};
    double largest = 0;
    if (width <= 2 * RADIUS || height <= 2 * RADIUS)
        return rl_fail(err, RL_E_USAGE, RL_NOWHERE,
                       "ssim looks through a window of 11 x 11 pixels: an image of %d x %d is too small",
                       width, height);
    for (int y = 0; !reference->encoded && y < height; y++)
        for (int x = 0; x < width; x++)
            largest = fmax(largest, luminance_at(reference, x, y));
    if (largest > 0)
        job.scale = 1 / largest;
    for (size_t i = 0; i < (size_t)width * (size_t)height; i++)
        map[i] = NAN;
    rl_filter_bands(pool, rl_band_count(height), compare_band, &job);
    if (atomic_load(&job.failed))
        return rl_fail_memory(err, (size_t)(RL_BAND_ROWS + 2 * RADIUS) * MEANS * sizeof(double) *
                                       (size_t)rl_filter_width(width));
    return RL_OK;
}
