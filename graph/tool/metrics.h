/* Image metrics: what `relit diff` and `relit ab` measure. Always a test image against a reference; FLIP,
 * RMSE, max and SSIM (8-bit) are symmetric, HDR-FLIP, PSNR and SSIM of floats take their scale from the
 * reference.
 *
 * A metric makes a map, one number a pixel, and a map has statistics, over all pixels or those of a mask.
 * Arithmetic is in double; every result has the same bits for every thread count. */
#ifndef RL_TOOL_METRICS_H
#define RL_TOOL_METRICS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "graph/base/error.h"
#include "graph/base/pool.h"

/* What a map holds:
 *   flip     0 … 1. Andersson et al. 2020, at RL_PIXELS_PER_DEGREE. Encoded images are decoded from sRGB;
 *            linear ones are clamped to 0 … 1 and taken as linear Rec. 709, which they are for hdrflip too
 *   hdrflip  0 … 1. Andersson et al. 2021: the largest LDR-FLIP over a range of exposures through the ACES
 *            curve fit; negative values count as 0
 *   psnr     squared difference, mean over channels; its statistic is 10·log10(peak² / mean), dB
 *   ssim     −1 … 1. Wang et al. 2004: 11 × 11 Gaussian, σ = 1.5, K = 0.01 and 0.03, on luminance (weights of
 *            Rec. 709); NaN within 5 pixels of the border, where the window leaves the image. Encoded images:
 *            on their values, peak 1. Linear ones: luminance is divided by the largest of the reference and
 *            sRGB-encoded without a clamp, peak 1
 *   rmse     root of the mean over channels of the squared difference
 *   max      largest absolute difference of the channels */
typedef enum rl_metric {
    RL_METRIC_FLIP,
    RL_METRIC_HDRFLIP,
    RL_METRIC_PSNR,
    RL_METRIC_SSIM,
    RL_METRIC_RMSE,
    RL_METRIC_MAX,
    RL_METRICS /* how many there are */
} rl_metric;

/* Statistics of a map. Percentiles interpolate between the two nearest ranks (rank p·(n − 1)) and are those
 * of the values: 95 % of the pixels have an SSIM below its p95. The mean of rmse is the RMSE of all pixels:
 * the root of the mean square, not the mean of the roots. psnr has a mean only. */
typedef enum rl_stat { RL_STAT_MEAN, RL_STAT_MEDIAN, RL_STAT_P95, RL_STAT_MAX, RL_STATS } rl_stat;

/* 0.7 m from a display 0.7 m wide with 3840 pixels, the default of both FLIP papers: 67.02. */
#define RL_PIXELS_PER_DEGREE (3840 * 3.14159265358979323846 / 180)

/* "flip"; the other way round -1 when there is no such name. */
const char *rl_metric_name(rl_metric metric);
const char *rl_stat_name(rl_stat stat);
int rl_metric_named(const char *name);
int rl_stat_named(const char *name);
/* psnr and ssim: larger is more alike. */
bool rl_metric_rises(rl_metric metric);

/* Pixels, finite. Not owned. */
typedef struct rl_metric_image {
    int width, height;
    int channels; /* 1 or 3 (red, green, blue) for flip, hdrflip and ssim; 1 … 4 for the others */
    const float *plane[4];
    size_t stride; /* floats from row to row */
    bool encoded;  /* sRGB-encoded, 0 … 1, as integer files hold; false: scene-linear */
} rl_metric_image;

/* Fills map, width · height values without gaps. Both images have the same size, channels and encoding, else
 * RL_E_USAGE; so has ssim below 11 × 11 pixels. Other errors: RL_E_MEMORY. `pool` may be NULL. */
rl_code rl_metric_map(rl_metric metric, const rl_metric_image *reference, const rl_metric_image *test,
                      rl_pool *pool, float *map, rl_error *err);

/* The same for n test images against one reference, whose share of the work is done once: maps[i] is that of
 * tests[i], with the same bits as rl_metric_map. */
rl_code rl_metric_maps(rl_metric metric, const rl_metric_image *reference, const rl_metric_image *tests,
                       size_t n, rl_pool *pool, float *const *maps, rl_error *err);

/* What psnr takes as its peak: 1 for encoded images, the largest value of the reference for linear ones. */
double rl_metric_peak(const rl_metric_image *reference);

/* Statistics of n values of a map; NaN in it is left out, and so is every pixel whose mask is 0 (mask may be
 * NULL). Statistics that do not exist are NaN: all of no pixels, and all but the mean of psnr. PSNR of equal
 * images is +∞. `peak` is for psnr alone. RL_E_MEMORY. */
rl_code rl_metric_stats(rl_metric metric, const float *map, const uint8_t *mask, size_t n, double peak,
                        double out[RL_STATS], rl_error *err);

/* The same of n values without NaN, which are reordered; allocates nothing. */
void rl_metric_stats_of(rl_metric metric, float *values, size_t n, double peak, double out[RL_STATS]);

/* The exposures of HDR-FLIP, in stops: first + i · (last - first) / (n - 1), i = 0 … n - 1. They map the
 * largest and the median luminance of the reference to 0.85 through the tone curve. The paper leaves a median
 * of 0 open (it asks for an infinite exposure, and a rendered object before black has it): then the median is
 * taken of the pixels above 0, and an image that is black all over gets exposure 0. */
typedef struct rl_exposures {
    double first, last;
    int n;
} rl_exposures;
rl_code rl_metric_exposures(const rl_metric_image *reference, rl_exposures *out, rl_error *err);

#endif
