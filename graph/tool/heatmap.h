/* Maps of a metric as pictures. */
#ifndef RL_TOOL_HEATMAP_H
#define RL_TOOL_HEATMAP_H

#include "graph/base/log.h"
#include "graph/tool/metrics.h"

/* sRGB-encoded colour of t, 0 … 1 (clamped; NaN is black): black, violet, red, yellow, near white, with a
 * lightness L* that rises evenly from 0 to 97, so that a grey print has the same order. */
void rl_heat_color(double t, float rgb[3]);

/* What rl_heat_color is given: flip and hdrflip as they are, ssim as (1 - ssim), the square root of psnr's
 * squared difference, and the last, rmse and max divided by the largest value, which goes to *white (1 for
 * the others). Writes width · height values; out may be map. */
void rl_heat_scale(rl_metric metric, const float *map, size_t n, float *out, double *white);

/* Writes a picture, 8 bits, whole under its name or not at all. The format follows the extension. */
rl_code rl_heatmap_write(const char *path, rl_metric metric, const float *map, int width, int height,
                         rl_pool *pool, const rl_log *log, rl_error *err);

#endif
