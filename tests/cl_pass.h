/* Runs one pass by itself: from its descriptor and images in host memory to the images that it writes, with
 * plain OpenCL and no executor. For tests and benches; single-threaded; failures print and return false. */
#ifndef RL_TESTS_CL_PASS_H
#define RL_TESTS_CL_PASS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "graph/model/materials.h"
#include "graph/model/pass.h"
#include "kernels/shared.h"

typedef struct cl_session cl_session;

/* The first OpenCL CPU device, else the first of any kind; threads > 0: only that many of its compute units.
 * NULL when there is none. Programs are kept until cl_close. */
cl_session *cl_open(int threads);
void cl_close(cl_session **s);

/* Buffers for a data window of width × height whose upper left pixel is (x, y) of the display window; a
 * camera that looks from the origin, focal length `focal` pixels, centre of the window in the middle of the
 * image. */
void cl_frame(frame_t *f, int x, int y, int width, int height, float focal);

/* One image of a port: planes of columns × rows, tightly packed; uint32_t for RL_ID. */
typedef struct cl_image {
    const char *port;
    const void *read; /* for RL_READ and RL_HISTORY; NULL is an absent optional port */
    float *write;     /* for RL_WRITE, RL_REDUCTION (RL_SUM_FLOATS: asked for), and RL_SCRATCH when somebody
                         wants to look at it */
} cl_image;

/* A pass's run. Entries of the material table: has_profile, then the pass's profile, material and shading
 * rows in their order, 4 bytes each (RGB rows three). */
typedef struct cl_job {
    const rl_pass *pass;
    const frame_t *frame;
    const void *params;
    const void *materials;
    size_t materials_bytes;
    const cl_image *images;
    size_t n_images;
    int repeat; /* runs, at least one; the fastest is reported */
    double *ms; /* one a step, or NULL */
    int width;  /* RL_W; 0 = 16 */
} cl_job;

bool cl_run(cl_session *s, const cl_job *job);

/* The job's materials as the host's side of the pass reads them, made in the arena. */
bool cl_read_materials(const cl_job *job, rl_arena *arena, rl_materials *m);

/* A program of its own, for peers: source text, entry point, `n` buffers (bytes each; read back when
 * `write`), global and local size. Milliseconds of the fastest of `repeat` runs; negative on failure. */
typedef struct cl_buffer {
    void *data;
    size_t bytes;
    bool write;
} cl_buffer;
double cl_run_text(cl_session *s, const char *text, const char *entry, const cl_buffer *buffers, size_t n,
                   const size_t global[2], const size_t local[2], int repeat);

/* A whole file, terminated; free with rl_free. */
char *cl_read_file(const char *path);

#endif
