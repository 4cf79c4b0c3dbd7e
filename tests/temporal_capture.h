/* How much a recorded sequence flickers, with and without temporal anti-aliasing: the deviation in time along
 * the true motion. */
#ifndef RL_TESTS_TEMPORAL_CAPTURE_H
#define RL_TESTS_TEMPORAL_CAPTURE_H

#include "graph/relit.h"

enum { TEMPORAL_FRAMES = 12, TEMPORAL_SPAN = 6 };

/* Frames of a capture, each plane width * height. */
typedef struct temporal_images {
    int width, height, n;
    float *raw[TEMPORAL_FRAMES][3], *done[TEMPORAL_FRAMES][3]; /* before and after the temporal pass */
    float *diffuse[TEMPORAL_FRAMES][3], *lit[TEMPORAL_FRAMES][3];
    float *motion[TEMPORAL_FRAMES][2], *shadow[TEMPORAL_FRAMES][8], *stencil[TEMPORAL_FRAMES];
    int lights;
} temporal_images;

/* Runs a pipeline over (at most 12 frames of) a capture; its graph has the passes light,
 * sss and aa of configs/skin.yaml. Free in any case. */
rl_code temporal_images_make(const rl_options *options, temporal_images *out, rl_error *err);
void temporal_images_free(temporal_images *images);

typedef struct temporal_flicker {
    long pixels;
    double raw,
        done; /* root mean square over the pixels of the deviation in time of the luminance, / its mean */
} temporal_flicker;

/* Over pixels of the last frame that show one material for all of the last TEMPORAL_SPAN frames, in 5x5, in
 * shadow of the same lights and under light that changes by at most 5 %; a linear change in time is no
 * flicker. Where a path leads between pixels the image is interpolated linearly, or with `nearest` not at
 * all. */
temporal_flicker temporal_measure_flicker(const temporal_images *images, bool nearest);

#endif
