/* sss_gaussian in plain C and double precision, from its definition: every pixel around is asked for its
 * distance in view space. */
#ifndef RL_TESTS_GAUSSIAN_TWIN_H
#define RL_TESTS_GAUSSIAN_TWIN_H

#include "tests/sss_twin.h"

/* Equal to material_t of the pass. */
typedef struct gaussian_material {
    int32_t has_profile;
    int32_t n;
    float variance_mm2[4];
    float weight[4][3];
    int32_t texturing, border;
    int32_t diffuse, exit_transmission;
} gaussian_material;

/* The filtered radiance of the whole image, planes of columns × rows, for pixels that scatter. `doubt` (one
 * plane) becomes 1 where a sample lies so close to the end of a Gaussian, one part in 1e5, that floats may
 * disagree about it. false when memory is out. */
bool twin_gaussian(const twin_scene *s, const gaussian_material *materials, bool separable, double *filtered,
                   char *doubt);

#endif
