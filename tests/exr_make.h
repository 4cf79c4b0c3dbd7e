/* For the EXR tests: files written and read by OpenEXR's core with its own default pipelines, to be held
 * against ours. */
#ifndef RL_TESTS_EXR_MAKE_H
#define RL_TESTS_EXR_MAKE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "graph/base/pool.h"
#include "graph/run/exr.h"

typedef struct made_channel {
    const char *name; /* in alphabetical order */
    rl_exr_pixel type;
    int sampling;       /* on both axes; 0 means 1 */
    const void *pixels; /* of that type (half: its bits), rows without gaps */
} made_channel;

/* What a header says beyond the pixels; every attribute is written only when it is asked for. */
typedef struct made_header {
    int display[4];             /* x, y, width, height; width 0 = the data window */
    float screen_width, aspect; /* 0 means 1 */
    float screen_center[2];
    const float *matrix;   /* worldToCamera, 16 numbers for row vectors */
    float fov_x;           /* camera:fovx, radians */
    const float *jitter;   /* camera:jitter */
    uint32_t time_code[2]; /* the second word is the user's */
    int fps[2];            /* framesPerSecond */
    const char *owner;
} made_header;

typedef struct made_part {
    const char *name; /* NULL in a file of one part */
    int x0, y0, width, height;
    rl_exr_compression compression;
    int tile;    /* side of a tile; 0 = scanlines */
    bool mipmap; /* all levels; those above 0 hold zeros */
    bool deep;   /* header only */
    const made_channel *channels;
    int n_channels;
    const made_header *header; /* may be NULL */
} made_part;

/* Fails the running test when the core refuses. */
void made_write(const char *path, const made_part *parts, int n_parts);

/* The pixels of a channel of a scanline file in the channel's own type, rows without gaps. */
void made_read(const char *path, int part, const char *channel, void *out);

/* A folder for this test program, made on first use; made_clean removes it and the files in it. */
const char *made_path(const char *name);
void made_clean(void);
/* How many files are in it. */
int made_count(void);

/* Fails the running test with the error, if there is one. */
void made_good(rl_code code, const rl_error *err);

/* A group's setup and teardown: pools of 1, 2 and 4 threads, and made_clean. */
extern rl_pool *made_pools[3];
int made_setup(void **state);
int made_teardown(void **state);

/* Deterministic noise. */
uint32_t made_random(uint32_t *state);

uint16_t made_half(float f); /* to nearest, by the portable kernel */

#endif
