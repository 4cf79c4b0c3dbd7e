/* Image files other than EXR: PNG, TIFF, JPEG and whatever else OpenImageIO writes and reads. OpenImageIO is
 * a module that is loaded on first use (it takes a quarter of a second; load it in the background with
 * rl_image_file_load). It is looked for in $RELIT_MODULES (folders, separated by ':'), beside the program or
 * library, one folder up, in
 * ../lib/relit from there, and in the folder that relit was built for. All functions are thread-safe. */
#ifndef RL_RUN_IMAGE_FILE_H
#define RL_RUN_IMAGE_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "graph/base/error.h"
#include "graph/base/pool.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Loads the module; later calls return at once with the same result. RL_E_IO when it is not found or refuses.
 */
rl_code rl_image_file_load(rl_error *err);

/* The extension of `path` is of a format that can be written, else RL_E_USAGE at `where` with the ones that
 * can. Needs the module for extensions other than png, tif, tiff, jpg and jpeg. */
rl_code rl_image_file_check(const char *path, rl_where where, rl_error *err);

/* ---- writing
 * ------------------------------------------------------------------------------------------------ */

typedef enum rl_image_type { RL_IMAGE_U8, RL_IMAGE_U16, RL_IMAGE_HALF, RL_IMAGE_FLOAT } rl_image_type;

/* Floats, one plane a channel. Integer types in the file: 0…1 becomes 0…255 or 0…65535, rounded to nearest.
 */
typedef struct rl_image_planes {
    int width, height;
    int channels; /* 1 grey, 2 with alpha, 3 RGB, 4 RGBA */
    const float *plane[4];
    size_t stride; /* floats from row to row */
} rl_image_planes;

typedef struct rl_image_note {
    const char *name, *text; /* "Software", "ImageDescription", "relit:version", … */
} rl_image_note;

typedef struct rl_image_options {
    rl_image_type type;
    int x, y;       /* of the first pixel in the display window */
    int display[4]; /* x, y, width, height; all 0: the image itself */
    /* "sRGB" or "sRGB / view" tags the file so; all are kept as text "relit:colorspace" where the format can;
     * NULL: no tag. */
    const char *colorspace;
    int quality;     /* JPEG, WebP: 1…100; 0: 95 */
    int compression; /* PNG, TIFF: deflate level 1…9; 0: 1, since 6 takes several times as long */
    const rl_image_note *notes;
    size_t notes_n;
} rl_image_options;

typedef struct rl_image_counts {
    unsigned long long nan;     /* samples that were NaN and became 0 (integer types) */
    unsigned long long clipped; /* samples outside 0…1 (integer types) */
} rl_image_counts;

/* The file is whole under its name or not there at all. `pool` and `counts` may be NULL. The format follows
 * the extension; one that nothing can write is RL_E_USAGE with the ones that can, a folder or disk that
 * refuses RL_E_IO. */
rl_code rl_image_file_write(const char *path, const rl_image_planes *image, const rl_image_options *options,
                            rl_pool *pool, rl_image_counts *counts, rl_error *err);

/* ---- reading
 * ------------------------------------------------------------------------------------------------ */

typedef struct rl_image_file {
    int width, height, channels;
    int x, y, display[4];
    rl_image_type type;  /* in the file; the nearest of the four */
    char names[256];     /* of the channels: "R,G,B" */
    char colorspace[64]; /* as the file says or its format implies, or "" */
    float *planes;       /* channels * height * width; integers divided by their largest value */
} rl_image_file;

/* A missing or unreadable file is RL_E_IO, one that is not an image RL_E_FORMAT. Free with
 * rl_image_file_free. */
rl_code rl_image_file_read(const char *path, rl_image_file *out, rl_error *err);
/* The same; RL_E_MEMORY, before anything is decoded, when that takes more than `limit` bytes (0: no limit).
 */
rl_code rl_image_file_read_within(const char *path, uint64_t limit, rl_image_file *out, rl_error *err);
void rl_image_file_free(rl_image_file *file);

/* A text attribute of a file ("Software"), "" when it has none, cut to `size` bytes. */
rl_code rl_image_file_note(const char *path, const char *name, char *out, size_t size, rl_error *err);

#ifdef __cplusplus
}
#endif
#endif
