/* The march of kernels/screen_shadow.cl for one pixel, in double, along a different way: the ray is kept in
 * space and cut with the planes through the camera and each column or row of pixels. */
#ifndef RL_TESTS_TWIN_MARCH_H
#define RL_TESTS_TWIN_MARCH_H

#include <stdbool.h>

#include "tests/cl_shade.h"

typedef struct march_params { /* in the order of lighting's table */
    int32_t steps;
    float thickness, bias; /* m */
    int32_t jitter, seed;
} march_params;

/* Visibility of light `which` at (x, y), 0 or 1. `margin`: the least relative distance from any decision that
 * was taken; where it is as small as float's rounding, a program may decide otherwise. */
int twin_march(const frame_t *f, const march_params *p, const shade_image *depth, const light_t *light,
               int which, int x, int y, double *margin);

#endif
