/* Made-up scenes for the tests of the scattering passes, and the passes run on them. Failures fail the test.
 */
#ifndef RL_TESTS_SSS_SCENE_H
#define RL_TESTS_SSS_SCENE_H

#include "tests/cl_pass.h"
#include "tests/sss_twin.h"

extern const rl_pass rl_pass_sss_burley, rl_pass_sss_reference;

/* The structs of the passes' parameters, in the order of their rows. */
typedef struct sss_burley_params {
    int32_t taps, orientation, weighting, rotation, seed;
} sss_burley_params;
typedef struct sss_reference_params {
    int32_t orientation, weighting;
} sss_reference_params;
enum { SCREEN = 0, TANGENT = 1 };
enum { AREA = 0, PLAIN = 1, SURFACE = 2, AUTO = -1 };

extern cl_session *sss_session; /* between sss_open and sss_close: a group's set-up and tear-down */
extern int sss_width;           /* of the vectors; 0 = as always */
int sss_open(void **state);
int sss_close(void **state);

/* 0: no material; 1, 2, 4, 5 scatter in different ways; 3 does not. */
#define SSS_MATERIALS 6
extern twin_material sss_materials[SSS_MATERIALS];

typedef struct sss_scene {
    twin_scene twin;
    float *diffuse, *lit, *albedo, *normal, *depth, *color, *filtered;
    uint32_t *stencil;
    float *energy; /* RL_SUM_FLOATS; NULL: the ledger is not asked for. rl_free */
    size_t n;      /* pixels of a plane */
} sss_scene;

/* Planes of zeros; rl_free. */
float *sss_planes(size_t n);

/* 0 to below 1. */
float sss_random(uint32_t *state);

/* A data window, all empty; free with sss_scene_free. */
sss_scene sss_scene_make(int x, int y, int width, int height, float focal);
void sss_scene_free(sss_scene *s);

/* Blobs of all materials and of nothing, a bumpy surface with jumps in depth, random light. */
void sss_scene_random(sss_scene *s, uint32_t seed);

/* A plane parallel to the screen, one material, `light` everywhere. */
void sss_scene_flat(sss_scene *s, uint32_t id, float depth, float light);

/* The same picture with another data window: what `whole` holds at the pixels of `part`, which lies in it. */
void sss_scene_crop(sss_scene *part, const sss_scene *whole);
/* Their s->color has the same bits, but for so many pixels along the border of `part`. */
void sss_crop_is_same(const sss_scene *part, const sss_scene *whole, int left_right, int top_bottom);

/* Fill s->color and s->filtered. `orientation` and `rotation` are the scene's. */
void sss_run(sss_scene *s, const rl_pass *pass, const void *params, cl_session *on);
void sss_run_burley(sss_scene *s, int taps, int weighting);
void sss_run_reference(sss_scene *s, int weighting);

/* The worst difference of s->color to the twin's, a pixel in `step`; relative to the value, at least to 0.01.
 * taps 0: the dense sum. */
double sss_worst(sss_scene *s, int taps, int weighting, int step);

/* For every pixel inside: its place and its index in a plane. */
#define SSS_EACH_PIXEL(s, x, y, i)                                                                           \
    for (int y = (s)->twin.frame.valid[1]; y < (s)->twin.frame.valid[3]; y++)                                \
        for (int x = (s)->twin.frame.valid[0]; x < (s)->twin.frame.valid[2]; x++)                            \
            for (size_t i = (size_t)y * (size_t)(s)->twin.frame.columns + (size_t)x, once_ = 1; once_;       \
                 once_ = 0)

#endif
