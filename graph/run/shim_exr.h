/* DWAA and DWAB: single chunks through OpenEXR's C++ library, which has these two where the C core of 3.1 has
 * not. A chunk is wrapped as a file of one tile in memory. Thread-safe. */
#ifndef RL_RUN_SHIM_EXR_H
#define RL_RUN_SHIM_EXR_H

#include "graph/run/exr.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct rl_exr_layout {
    const char *name; /* DWA treats .R .G .B, .Y and .A each in a way of its own */
    rl_exr_pixel type;
} rl_exr_layout;

typedef struct rl_shim_exr_block {
    const rl_exr_layout *layout; /* sorted by name, none subsampled */
    size_t n_channels;
    int width, height;
    float dwa_level; /* compressing; 0 takes the library's default */
} rl_shim_exr_block;

/* Both return 0, or 1 with the reason in `message` (room for `room` bytes). `plain` holds rows of channels,
 * one after the other. */
int rl_shim_exr_decompress(const rl_shim_exr_block *block, const void *packed, size_t size, void *plain,
                           char *message, size_t room);

/* *size is set to the compressed size; when that does not fit `limit` bytes, to `limit`, and `packed` holds
 * anything. */
int rl_shim_exr_compress(const rl_shim_exr_block *block, const void *plain, void *packed, size_t limit,
                         size_t *size, char *message, size_t room);

#ifdef __cplusplus
}
#endif
#endif
