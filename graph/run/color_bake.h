/* A transform as a table, for operations that have no generator. Internal to graph/run/color*.c. */
#ifndef RL_RUN_COLOR_BAKE_H
#define RL_RUN_COLOR_BAKE_H

#include "graph/run/color_emit.h"

/* Samples the transform on a cube of 65³ colours behind a logarithmic shaper (0 to 256; what is darker than 0
 * is taken as 0), appends the program that reads it, and measures: *error is the largest difference from
 * OpenColorIO over 20,000 random colours between -0.1 and 20, in output units. About 300 ms. */
rl_code rl_color_bake(const rl_ocio_transform *transform, rl_color_text *text, double *error, rl_error *err);

#endif
