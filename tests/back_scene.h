/* Made-up captures with back faces for the tests of translucency: images, the pass run on them, and the exact
 * integral over the true back face. Camera and world are the same; it looks down -z. Failures fail the test.
 */
#ifndef RL_TESTS_BACK_SCENE_H
#define RL_TESTS_BACK_SCENE_H

#include "tests/cl_pass.h"

extern const rl_pass rl_pass_translucency;

/* material_t of the pass: has_profile, its profile rows, its shading rows. */
typedef struct back_material {
    int32_t has_profile;
    float scatter_distance_mm[3];
    int32_t param[13]; /* what that may be derived from: kernels do not read it */
    int32_t texturing, border, transmission;
    int32_t diffuse, transmits, exit_transmission;
} back_material;
enum { BACK_GATHER = 4, BACK_MATERIALS = 6 };
extern const back_material back_materials[BACK_MATERIALS]; /* 0: none; 1, 2, 5 gather; 3, 4 do not */

typedef struct back_params {
    int32_t taps, rotation, seed;
} back_params;

typedef struct back_scene {
    frame_t frame;
    const back_material *materials;
    float *back, *lit, *albedo, *normal, *depth, *back_depth, *back_normal; /* planes of columns x rows */
    uint32_t *stencil;
    float *through, *out;
    size_t n; /* pixels of a plane */
} back_scene;

extern cl_session *back_session; /* a group's set-up and tear-down */
extern int back_width;           /* of the vectors; 0 = as always */
int back_open(void **state);
int back_close(void **state);

/* A data window, all empty, albedo 1; back_scene_free. */
back_scene back_scene_make(int x, int y, int width, int height, float focal);
void back_scene_free(back_scene *s);
/* Blobs of all materials and of nothing, bumpy faces with steps, holes in the back, random light. */
void back_scene_random(back_scene *s, uint32_t seed);
/* Fills s->through and s->out. */
void back_scene_run(back_scene *s, back_params p);

/* The ray through a pixel's middle, z = -1. */
void back_ray(const back_scene *s, double x, double y, double ray[3]);

#define BACK_EACH_PIXEL(s, x, y, i)                                                                          \
    for (int y = (s)->frame.valid[1]; y < (s)->frame.valid[3]; y++)                                          \
        for (int x = (s)->frame.valid[0]; x < (s)->frame.valid[2]; x++)                                      \
            for (size_t i = (size_t)y * (size_t)(s)->frame.columns + (size_t)x, once_ = 1; once_; once_ = 0)

/* ---- plain C in double (back_twin.c) ---- */

/* n taps as the kernel places and weighs them. */
void back_twin(const back_scene *s, int x, int y, back_params p, double through[3]);
/* The sum over all pixels of the material that have a back face, every pixel at its middle. */
void back_dense(const back_scene *s, int x, int y, double through[3]);
/* lit + through exit(albedo) F_out. */
void back_resolve(const back_scene *s, int x, int y, const double through[3], double out[3]);

#endif
