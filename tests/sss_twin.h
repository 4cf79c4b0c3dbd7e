/* The scattering passes in plain C and double precision, one pixel at a time: what the kernels are checked
 * against. */
#ifndef RL_TESTS_SSS_TWIN_H
#define RL_TESTS_SSS_TWIN_H

#include <stdbool.h>
#include <stdint.h>

#include "kernels/shared.h"

/* Equal to material_t of the sss passes: has_profile, their profile rows, their shading rows. */
typedef struct twin_material {
    int32_t has_profile;
    float scatter_distance_mm[3];
    int32_t texturing, border;
    int32_t param[13]; /* what scatter_distance_mm may be derived from: kernels do not read it */
    int32_t diffuse, exit_transmission;
} twin_material;

/* Host images in buffer coordinates, planes of columns × rows. */
typedef struct twin_scene {
    frame_t frame;
    const twin_material *materials;
    const float *diffuse, *lit, *albedo, *normal, *depth;
    const uint32_t *stencil;
    bool area;    /* weighting: area or surface */
    bool surface; /* weighting: surface */
    bool tangent; /* orientation: tangent */
    int rotation; /* of sss_burley */
} twin_scene;
enum { TWIN_STILL = 0, TWIN_WHITE = 1, TWIN_IGN = 2, TWIN_BLUE = 3 };

/* lit + filtered · exit · F_out at pixel (x, y), from the filtered radiance. */
void twin_resolve(const twin_scene *s, int x, int y, const double filtered[3], double color[3]);

/* The surface that a pixel sees, up to a factor; 1 with weighting: plain. */
double twin_area(const twin_scene *s, int x, int y);

/* The dense sum. */
void twin_reference(const twin_scene *s, int x, int y, double filtered[3]);

/* n taps (n > 0), the vector's common scale and the phase's pattern as the kernel has them. */
void twin_burley(const twin_scene *s, int x, int y, int n, int seed, double filtered[3]);

#endif
