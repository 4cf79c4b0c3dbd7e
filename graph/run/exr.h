/* OpenEXR files: what is in them, their pixels as planes, and writing them. Built on OpenEXR's C core; only
 * DWAA and DWAB chunks, which the core of OpenEXR 3.1 lacks, pass through the C++ library (shim_exr.h).
 *
 * Pixels are addressed relative to the data window: (0, 0) is its upper left corner. */
#ifndef RL_RUN_EXR_H
#define RL_RUN_EXR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "graph/base/error.h"
#include "graph/base/pool.h"
#include "graph/base/text.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Both enums have the numbers of the file format. */
typedef enum rl_exr_pixel { RL_EXR_UINT, RL_EXR_HALF, RL_EXR_FLOAT } rl_exr_pixel;

typedef enum rl_exr_compression {
    RL_EXR_NONE,
    RL_EXR_RLE,
    RL_EXR_ZIPS,
    RL_EXR_ZIP,
    RL_EXR_PIZ,
    RL_EXR_PXR24,
    RL_EXR_B44,
    RL_EXR_B44A,
    RL_EXR_DWAA,
    RL_EXR_DWAB,
    RL_EXR_COMPRESSIONS /* how many there are */
} rl_exr_compression;

/* "zip"; the other way round -1 when there is no such name (letter case does not matter). */
const char *rl_exr_compression_name(rl_exr_compression compression);
int rl_exr_compression_named(const char *name);
const char *rl_exr_pixel_name(rl_exr_pixel type); /* "half" */

/* A window in pixels, both corners included. */
typedef struct rl_exr_box {
    int x0, y0, x1, y1;
} rl_exr_box;

/* ---- reading ---- */

typedef struct rl_exr_channel {
    const char *name; /* with its layer: "albedo.R" */
    rl_exr_pixel type;
    int x_sampling, y_sampling; /* 1 as a rule; channels with another value cannot be read */
} rl_exr_channel;

typedef struct rl_exr_part {
    const char *name; /* "" when the file has none */
    bool tiled, deep;
    int tile_width, tile_height; /* 0 when not tiled */
    int width, height;           /* of the data window, pixels */
    rl_exr_box data_window, display_window;
    rl_exr_compression compression;
    float pixel_aspect;                   /* width / height of a pixel */
    float screen_width, screen_center[2]; /* the screen window, at distance 1 */
    const rl_exr_channel *channels;       /* sorted by name */
    size_t n_channels, n_attrs;
} rl_exr_part;

typedef struct rl_exr rl_exr;

/* Opens a file and reads its headers. `limit` is the most bytes that one channel of a part as floats may
 * take, and what a later rl_exr_read may take (its planes plus its buffers); 0 = no limit. Errors name the
 * file: RL_E_IO (cannot be read), RL_E_FORMAT (not an OpenEXR file, or corrupt), RL_E_MEMORY (beyond the
 * limit). The result is constant: every function below may be called from several threads at a time. */
rl_code rl_exr_open(const char *path, uint64_t limit, rl_exr **out, rl_error *err);
void rl_exr_close(rl_exr **file); /* NULL inside is safe */

const char *rl_exr_path(const rl_exr *file);
int rl_exr_parts(const rl_exr *file);
/* Lives as long as the file. `part` is 0…rl_exr_parts-1. */
const rl_exr_part *rl_exr_part_at(const rl_exr *file, int part);
/* The part's index, or -1. */
int rl_exr_part_named(const rl_exr *file, const char *name);
/* NULL when the part has no such channel. */
const rl_exr_channel *rl_exr_channel_named(const rl_exr_part *part, const char *name);

/* One channel to be read, and where to. Exactly one of `floats` and `ids` is given.
 *
 * As floats, half and float come as they are and uint as the number (one that a float cannot hold is
 * RL_E_DATA). NaN and infinities become 0 and are counted; with `replace_inf`, +Inf becomes inf_value instead
 * and is not counted (renderers write it where depth is empty); with `keep_nonfinite` all
 * of them stay and none is counted.
 *
 * As ids, uint comes as it is; half and float must be integral and within int32 or uint32, else RL_E_DATA
 * names the pixel and the value. A negative id keeps its 32 bits. With `bits`, a float channel's 32 bits are
 * the id (Cryptomatte), and half is RL_E_DATA. */
typedef struct rl_exr_plane {
    const char *channel;
    float *floats;
    uint32_t *ids;
    bool bits;
    size_t stride; /* elements from a row to the next, >= width */
    bool replace_inf;
    float inf_value;
    bool keep_nonfinite;
    uint64_t nonfinite; /* result: how many values were replaced by 0; the same for every thread count */
} rl_exr_plane;

/* Called on the thread that has just unpacked rows y0…y1-1 (relative to the data window) of all planes, so
 * that they can be converted while they are in the cache: of scanlines one row at a time, of tiles a row of
 * them. Calls run in parallel and in any order; each row comes once. */
typedef struct rl_exr_rows {
    void (*done)(void *ctx, int part, int y0, int y1);
    void *ctx;
} rl_exr_rows;

/* Reads channels of one part (level 0 of a tiled one), in parallel over chunks; channels that are not asked
 * for are not unpacked. `rows` and `pool` may be NULL. After an error the planes hold anything. Which error
 * is reported does not depend on the threads: the one of the first bad chunk. */
rl_code rl_exr_read(const rl_exr *file, int part, rl_exr_plane *planes, size_t n_planes,
                    const rl_exr_rows *rows, rl_pool *pool, rl_error *err);

/* The most that rl_exr_read allocates for a part with a pool of so many threads; 0 when the header is broken.
 */
uint64_t rl_exr_read_scratch(const rl_exr *file, int part, int threads);

/* ---- attributes ---- */

typedef enum rl_exr_type {
    RL_EXR_T_OTHER, /* has a printable form, no numbers */
    RL_EXR_T_STRING,
    RL_EXR_T_INT,
    RL_EXR_T_FLOAT,
    RL_EXR_T_DOUBLE,
    RL_EXR_T_V2I,
    RL_EXR_T_V2F,
    RL_EXR_T_V2D,
    RL_EXR_T_V3I,
    RL_EXR_T_V3F,
    RL_EXR_T_V3D,
    RL_EXR_T_M33F, /* row by row, as in the file: for row vectors, p·M */
    RL_EXR_T_M33D,
    RL_EXR_T_M44F,
    RL_EXR_T_M44D,
    RL_EXR_T_BOX2I, /* x0 y0 x1 y1 */
    RL_EXR_T_BOX2F,
    RL_EXR_T_CHROMATICITIES, /* red x y, green x y, blue x y, white x y */
    RL_EXR_T_TIMECODE,       /* the time and flags word, the user data word */
    RL_EXR_T_RATIONAL        /* numerator, denominator */
} rl_exr_type;

typedef struct rl_exr_value {
    rl_exr_type type;
    double v[16];     /* all types above fit a double exactly */
    const char *text; /* RL_EXR_T_STRING; when read, it lives as long as the file */
} rl_exr_value;

/* How many of v[] a type uses: 16 for a 4×4 matrix, 0 for a string. */
int rl_exr_type_numbers(rl_exr_type type);

/* An attribute by its name; false when the part has none. */
bool rl_exr_attr(const rl_exr *file, int part, const char *name, rl_exr_value *out);
/* The i-th (0…n_attrs-1, in the order of the file): name, the type's name in the file ("m44f"); any may be
 * NULL. */
void rl_exr_attr_at(const rl_exr *file, int part, size_t i, const char **name, const char **type,
                    rl_exr_value *out);
/* Adds the i-th as one line of text without its name: "24/1", "01:02:03:04", "[0 0 1919 1079]". Numbers in
 * the C locale, shortest; long or binary values are abbreviated. */
void rl_exr_attr_print(const rl_exr *file, int part, size_t i, rl_str *out);

/* ---- writing ---- */

/* A channel to be written. `floats` for half and float, `ids` for uint; half and float with `ids` alone is a
 * mask: 1 where the id is not 0. */
typedef struct rl_exr_source {
    const char *name; /* with its layer: "diffuse.R" */
    rl_exr_pixel type;
    const float *floats;
    const uint32_t *ids;
    size_t stride; /* elements from a row to the next */
} rl_exr_source;

typedef struct rl_exr_attribute {
    const char *name;
    rl_exr_value value;
} rl_exr_attribute;

#define RL_EXR_LEVEL_FAST 0 /* ISA-L: a fifth of the time of level 1, and 5 % larger */

typedef struct rl_exr_image {
    rl_exr_box data_window, display_window;
    const rl_exr_source *channels; /* in any order; names differ */
    size_t n_channels;             /* at least 1 */
    rl_exr_compression compression;
    int level;       /* ZIP and ZIPS: RL_EXR_LEVEL_FAST, or libdeflate's 1…12 */
    float dwa_level; /* DWAA and DWAB: quality loss, larger is smaller; 0 takes OpenEXR's default, 45 */
    float pixel_aspect, screen_width; /* 0 means 1 */
    float screen_center[2];
    const rl_exr_attribute *attrs;
    size_t n_attrs;
    /* Attributes to take over from an open file: names, or prefixes that end in '*'. What the file lacks,
     * what `attrs` gives, and what describes the pixels of that file (channels, windows, tiles, …) is left
     * out. */
    const rl_exr *copy_from;
    int copy_part;
    const char *const *copy;
    size_t n_copy;
} rl_exr_image;

/* Writes a single-part scanline file: a temporary name beside `path`, renamed when complete; after an error
 * nothing is left of it. Values beyond ±65504 (after rounding) that go into half channels are clamped and
 * counted in *clamped (may be NULL); NaN stays NaN. The file has the same bytes for every thread count
 * (across machines RL_EXR_LEVEL_FAST promises the same pixels only: ISA-L has other code for other
 * processors). Errors: RL_E_USAGE (a bad image), RL_E_IO, RL_E_MEMORY. `pool` may be NULL. */
rl_code rl_exr_write(const char *path, const rl_exr_image *image, rl_pool *pool, uint64_t *clamped,
                     rl_error *err);

#ifdef __cplusplus
}
#endif
#endif
