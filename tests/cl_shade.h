/* Runs one pass on the OpenCL device outside of the executor, so that a kernel can be held against its twin:
 * generates what stands in front of a program (params_t, material_t, HAS_*, LAYOUT_*, P_*), builds it, places
 * host images in buffers as kernels/shared.h says, and reads the results back. Not thread-safe. */
#ifndef RL_TESTS_CL_SHADE_H
#define RL_TESTS_CL_SHADE_H

#include "graph/model/pass.h"
#include "kernels/shared.h"

enum { SHADE_PORTS = 24, SHADE_PLANES = 8, SHADE_MATERIALS = 16, SHADE_WORDS = 64, SHADE_LIGHTS = 8 };

/* A host image in RL_LINEAR with its guards; data points behind the front guard. */
typedef struct shade_image {
    int planes;
    float *data; /* owned; RL_ID planes hold uint32_t bits */
} shade_image;

/* The material table: the union of the rows of the passes given. */
typedef struct shade_materials {
    const rl_pass *const *passes;
    size_t n_passes;
    size_t n;                                     /* entries, the empty one included */
    uint32_t words[SHADE_MATERIALS][SHADE_WORDS]; /* as the device sees them, word 0 is has_profile */
} shade_materials;

typedef struct shade_run {
    const rl_pass *pass;
    frame_t frame;
    const void *params;                     /* NULL = the defaults */
    const shade_image *images[SHADE_PORTS]; /* in port order; NULL = absent */
    bool phase4[SHADE_PORTS];               /* any_layout outputs: ask the kernel for RL_PHASE4 */
    const shade_materials *materials;
    const light_t *lights;       /* frame.lights of them */
    const ambient_t *ambient;    /* NULL = none */
    const float *profiles, *sky; /* the tables of the lights (kernels/shared.h); NULL = none */
    size_t n_profiles, n_sky;    /* floats */
    int lanes;                   /* RL_W; 0 = 16 */
    int repeat;                  /* for timings: runs beyond the first */
    double best_ms;              /* out: the fastest run */
} shade_run;

/* A frame of w x h pixels whose data window starts at (x0, y0) in display pixels; camera all zero. */
frame_t shade_frame(int w, int h, int x0, int y0);

/* Zeroed; free with shade_image_free. NULL data when memory is out. */
shade_image shade_image_new(const frame_t *f, int planes);
void shade_image_free(shade_image *image);
float *shade_at(const shade_image *image, const frame_t *f, int plane, int x, int y);
uint32_t shade_id(const shade_image *image, const frame_t *f, int x, int y);
void shade_set_id(const shade_image *image, const frame_t *f, int x, int y, uint32_t id);

/* An entry with every row at its default; returns its index. */
size_t shade_material_add(shade_materials *m, bool has_profile);
/* Sets / reads a row; an RL_RGBF row takes three numbers. False when no pass declares it. */
bool shade_material_set(shade_materials *m, size_t entry, const char *group, const char *key,
                        const double *v);
bool shade_material_get(const shade_materials *m, size_t entry, const char *group, const char *key,
                        double *v);

/* Fills a pass's struct with the defaults of its rows. */
void shade_params_default(const rl_pass *pass, void *params);

/* False when there is no OpenCL device at all. */
bool shade_device(void);
/* Builds, runs, reads WRITE and SCRATCH ports back. False and a message on stderr when anything fails; a
 * build with a warning fails. */
bool shade_execute(shade_run *run);
/* The same for a program of one's own behind shared.h and common.cl: one float buffer in, one out, n items.
 */
bool shade_function(const char *source, const char *entry, const float *in, float *out, size_t n);

/* A small generator for reproducible tests: 0 <= value < 1. */
double shade_random(uint64_t *state);

#endif
