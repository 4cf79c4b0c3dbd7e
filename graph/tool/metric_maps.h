/* The metrics, a file each; rl_metric_maps checks the arguments and calls them. As rl_metric_maps. */
#ifndef RL_TOOL_METRIC_MAPS_H
#define RL_TOOL_METRIC_MAPS_H

#include "graph/tool/metric_flip_rows.h"
#include "graph/tool/metrics.h"

rl_code rl_flip_maps(const rl_metric_image *reference, const rl_metric_image *tests, size_t n, rl_pool *pool,
                     float *const *maps, rl_error *err);
rl_code rl_hdrflip_maps(const rl_metric_image *reference, const rl_metric_image *tests, size_t n,
                        rl_pool *pool, float *const *maps, rl_error *err);
rl_code rl_ssim_map(const rl_metric_image *reference, const rl_metric_image *test, rl_pool *pool, float *map,
                    rl_error *err);

/* A pixel as linear RGB, at least 0. Grey becomes three equal channels. */
void rl_metric_linear(const rl_metric_image *image, int x, int y, double rgb[3]);

/* LDR-FLIP of images against a reference; the values of a map are raised to the result, never lowered (start
 * with zeros). */
typedef struct rl_flip_input {
    const rl_metric_image *reference, *tests;
    size_t n_tests;
    rl_flip_curve curve;
    double scale; /* of the curve */
} rl_flip_input;
typedef struct rl_flip rl_flip;
/* For images of this size, for any number of rl_flip_raise one after the other. */
rl_code rl_flip_new(int width, int height, rl_flip **out, rl_error *err);
void rl_flip_free(rl_flip **flip);
rl_code rl_flip_raise(rl_flip *flip, const rl_flip_input *input, rl_pool *pool, float *const *maps,
                      rl_error *err);

#endif
