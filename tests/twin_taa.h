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
    TAA_OUT_COLOR,
    TAA_OUT_COUNT,
    TAA_PORTS
};

typedef struct twin_taa_params {
    float blend, clip_gamma;
    uint32_t exclude[8];
} twin_taa_params;

/* out: R G B count. run->params is a twin_taa_params. */
void twin_taa(const shade_run *run, int x, int y, double *out);

#endif
