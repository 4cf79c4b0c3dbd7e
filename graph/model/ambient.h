/* Ambient light as pipelines write it: radiance from all directions, without shadows, in world space. All
 * parts add up.
 *
 *     ambient:
 *       sh: [[r, g, b], …]        9 coefficients of radiance: real orthonormal harmonics (1, y, z, x, xy, yz,
 * 3zz-1, xz, xx-yy) lobes: [{axis: [x, y, z], sharpness: 8, amplitude: [r, g, b]}, …]     amplitude
 * e^(sharpness (axis.v - 1)); at most 16 hdri: studio.exr          latitude-longitude, linear; relative to
 * the file that names it up: y                     hdri: the world axis that its upper edge shows, y or z
 *       rotation: 90              hdri: degrees around `up`, counter-clockwise from above
 *       specular: true            hdri: whether surfaces mirror it; the other parts are diffuse light alone
 *       intensity: 0.5            of all parts; one number or three
 *       colorspace: lin_rec709    of all parts; the default
 *
 * The middle of an HDRI is +z where y is up (as in OpenEXR's latitude-longitude maps), +x where z is up (as
 * in Blender). */
#ifndef RL_MODEL_AMBIENT_H
#define RL_MODEL_AMBIENT_H

#include "graph/base/arena.h"
#include "graph/base/error.h"
#include "graph/model/value.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { RL_AMBIENT_LOBES = 16, RL_AMBIENT_BANDS = 9 };

typedef struct rl_ambient_lobe {
    double axis[3]; /* unit */
    double sharpness;
    double amplitude[3];
} rl_ambient_lobe;

/* As written, with the defaults filled in. */
typedef struct rl_ambient {
    double sh[RL_AMBIENT_BANDS][3];
    rl_ambient_lobe lobes[RL_AMBIENT_LOBES];
    size_t n_lobes;
    const char *hdri; /* path, or NULL */
    rl_where hdri_where;
    bool z_up;
    double rotation; /* radians */
    bool specular;   /* default true */
    double intensity[3];
    const char *colorspace;
    rl_where colorspace_where;
} rl_ambient;

/* The pipeline's section. */
rl_code rl_ambient_parse(rl_arena *arena, const rl_value *v, rl_ambient *out, rl_error *err);

/* The 9 harmonics in a unit direction. */
void rl_ambient_basis(const double direction[3], double out[RL_AMBIENT_BANDS]);

/* The direction that a latitude-longitude image shows at (u, v), 0…1 from its left upper corner. */
void rl_ambient_direction(const rl_ambient *a, double u, double v, double out[3]);

/* Where it shows a unit direction: the inverse. */
void rl_ambient_place(const rl_ambient *a, const double direction[3], double *u, double *v);

/* Adds the projection of a latitude-longitude image (planes of width * height, linear) to sh, before
 * intensity: exact solid angles, harmonics at the pixels' centres, of coarse maps at those of at least 256
 * rows of parts: an even sky has an error of 1e-5. Samples that are not finite count as 0; their number is
 * returned. */
unsigned long long rl_ambient_project(const rl_ambient *a, const float *const plane[3], int width, int height,
                                      double sh[RL_AMBIENT_BANDS][3]);

/* The integral of a lobe over all directions, for an amplitude of 1: 2 pi (1 - e^-2s)/s. */
double rl_ambient_lobe_flux(double sharpness);

#ifdef __cplusplus
}
#endif
#endif
