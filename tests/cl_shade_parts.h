/* What the two halves of cl_shade share: host images and material rows (cl_shade_host.c), the device
 * (cl_shade.c). */
#ifndef RL_TESTS_CL_SHADE_PARTS_H
#define RL_TESTS_CL_SHADE_PARTS_H

#include "tests/cl_shade.h"

/* Floats of an image with its guards, with room for either layout. */
size_t shade_image_floats(const frame_t *f, int planes);

typedef bool shade_visit(void *ctx, const char *group, const rl_param *row, size_t word);

/* Visits each distinct row of the material table once, in the order of the device's struct, until a visit
 * returns true; returns whether one did. `word` is the row's place in an entry. */
bool shade_each_row(const shade_materials *m, shade_visit *visit, void *ctx);

/* A word of a params or material struct as a number. */
double shade_from_word(rl_type type, uint32_t word);

#endif
