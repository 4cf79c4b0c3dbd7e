/* Temporal anti-aliasing for one pixel, in double and plain C. */
#ifndef RL_TESTS_TWIN_TAA_H
#define RL_TESTS_TWIN_TAA_H

#include "tests/cl_shade.h"

/* Ports of the pass, in their order. */
enum {
    TAA_COLOR,
    TAA_DEPTH,
    TAA_MOTION,
    TAA_STENCIL,
    TAA_LAST_COLOR,
    TAA_LAST_DEPTH,
    TAA_LAST_STENCIL,
    TAA_LAST_COUNT,
    TAA_MOVED,
    TAA_OUT_COLOR,
    TAA_OUT_COUNT,
    TAA_PORTS
};

typedef struct twin_taa_params {
    float blend, clip_gamma;
    uint32_t exclude[8];
} twin_taa_params;

/* Samples of a port as the kernels see them: outside of the image the nearest one; depth, 1e18 where empty.
 */
double twin_tap(const shade_run *run, int port, int plane, int x, int y);
uint32_t twin_tap_id(const shade_run *run, int port, int x, int y);
double twin_depth(const shade_run *run, int port, int x, int y);

/* Displacement and previous depth by the cameras, for the sample of pixel (x, y) at depth z. */
void twin_follow(const frame_t *f, int x, int y, double z, double *d, double *then);

/* out: R G B count. run->params is a twin_taa_params. Without a motion layer the motion is that of TAA_MOVED.
 */
void twin_taa(const shade_run *run, int x, int y, double *out);

#endif
