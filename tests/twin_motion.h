/* The motion that temporal anti-aliasing finds where there is no motion layer, in double and plain C. */
#ifndef RL_TESTS_TWIN_MOTION_H
#define RL_TESTS_TWIN_MOTION_H

#include "tests/twin_taa.h"

/* Displacement of pixel (x, y), as kernels/taa_motion.cl finds it for its tile; 0 without history. */
void twin_motion(const shade_run *run, int x, int y, double *out);

#endif
