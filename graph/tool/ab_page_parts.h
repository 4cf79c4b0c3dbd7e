/* What the files of the page share; nothing else includes this. */
#ifndef RL_TOOL_AB_PAGE_PARTS_H
#define RL_TOOL_AB_PAGE_PARTS_H

#include <sys/types.h>

#include "graph/base/text.h"
#include "graph/model/frames.h"
#include "graph/tool/ab_page.h"
#include "graph/tool/page_source.h"

/* ---- blocks of numbers (ab_page_pack.c) ---- */

/* Planes of unsigned integers one after the other, rows without gaps. */
typedef struct rl_page_plain {
    int bits; /* 8 or 16 */
    int planes, width, height;
    const void *data; /* uint8_t or uint16_t */
} rl_page_plain;

/* As the page stores it: each value minus the one on its left (in the first column the one above; the first
 * of a plane as it is), 16 bits turned so that small differences of both signs are small numbers, their high
 * bytes, then their low ones, raw deflate. *packed is freed with rl_free. RL_E_MEMORY. */
rl_code rl_page_pack(const rl_page_plain *plain, uint8_t **packed, size_t *size, rl_error *err);
/* Bytes that rl_page_pack makes at most; 0: more than a size_t holds. */
size_t rl_page_pack_bound(const rl_page_plain *plain);

/* RFC 4648, with padding: out has room for rl_page_base64_size(n) bytes, not terminated. */
size_t rl_page_base64_size(size_t n);
void rl_page_base64(const uint8_t *in, size_t n, char *out);

/* ---- displays as tables (ab_page_lut.c) ---- */

enum { RL_PAGE_LUT = 65 };

/* Entry (r, g, b) is at (r · n + g) · n + b of each of three planes: v = low + (high - low) · entry / 65535.
 * An axis of the table is t(x) = sign(x) · log2(1 + |x| / knee), from t(first) at 0 to t(last) at n - 1.
 * Between entries: tetrahedra. */
typedef struct rl_page_lut {
    const rl_ab_page_display *display;
    int n;
    double knee, first, last; /* scene-linear; what lies outside is moved to the end */
    double low, high;         /* encoded values */
    uint16_t *entries;        /* [3 · n³], owned */
    uint8_t *packed;          /* the same as a block, owned */
    size_t size;
    /* |table - display|, both clamped to 0 … 1, over pixels that were compared. */
    double error_max, error_sum;
    unsigned long long pixels;
} rl_page_lut;

rl_code rl_page_lut_bake(const rl_ab_page_display *display, rl_page_lut *out, rl_error *err);
void rl_page_lut_free(rl_page_lut *lut);
void rl_page_lut_apply(const rl_page_lut *lut, const float in[3], double out[3]);
/* Adds the pixels of a picture to the error, every so many that there are some 16,000 of them. */
void rl_page_lut_compare(rl_page_lut *lut, const rl_compared_image *linear, const rl_compared_image *display);

/* ---- what is held (ab_page.c, ab_page_hold.c, ab_page_spool.c) ---- */

/* Why a frame is held: bit i < RL_METRICS means the worst by that metric. */
enum { RL_PAGE_FIRST = 1 << RL_METRICS, RL_PAGE_LAST = 2 << RL_METRICS, RL_PAGE_ASKED = 4 << RL_METRICS };

typedef struct rl_page_block {
    off_t at; /* in the spool */
    size_t size;
    int bits, planes, width, height;
    bool based; /* the frame's first block has to be added, modulo 2^bits */
} rl_page_block;

typedef struct rl_page_seen {
    size_t capture, index;
    long long frame;
    int x, y, width, height;
    rl_str error; /* why it failed; empty when it ran */
    rl_str files; /* JSON: a list a variant of what was written, relative to the folder */
    double
        worst[RL_METRICS]; /* of the pairs' means over all pixels, the most different; NaN: no difference */
} rl_page_seen;

/* A part of the spool. It has holes: what was never written takes no disk. */
typedef struct rl_page_extent {
    off_t at;
    size_t room;
} rl_page_extent;

typedef struct rl_page_spool {
    int fd;
    off_t end;
    size_t n_extents;     /* that there are: as many fit into `free` */
    rl_page_extent *free; /* those that can be used again */
    size_t n_free;
} rl_page_spool;

/* A file without a name in the folder. */
rl_code rl_page_spool_open(const char *folder, rl_page_spool *out, rl_error *err);
void rl_page_spool_close(rl_page_spool *spool);
/* A part of at least `room` bytes, and giving it back (an empty one is no part). */
rl_code rl_page_spool_take(rl_page_spool *spool, size_t room, rl_page_extent *out, rl_error *err);
void rl_page_spool_give(rl_page_spool *spool, rl_page_extent extent);
rl_code rl_page_spool_write(const rl_page_spool *spool, off_t at, const void *data, size_t size,
                            rl_error *err);
rl_code rl_page_spool_read(const rl_page_spool *spool, off_t at, void *data, size_t size, rl_error *err);

typedef struct rl_page_held {
    size_t seen; /* the frame: index into page->seen */
    unsigned why;
    bool encoded; /* the reference has no scene-linear image: it was decoded from sRGB */
    rl_page_extent extent;
    /* An image a variant, the reference, the ids of the materials, then for each pair its maps. */
    rl_page_block *blocks; /* owned; size 0: absent */
    size_t n_blocks;
} rl_page_held;

struct rl_ab_page {
    rl_arena arena;
    const rl_ab_plan *plan;
    const rl_ab_page_source *source;
    rl_ab_page_options options;
    unsigned words;    /* of --report-frames: bits of `why`; all the metrics' bits for "worst" */
    bool all;          /* "all" */
    rl_frames asked;   /* numbers */
    rl_page_lut *luts; /* [source->n_displays] */
    rl_page_spool spool;
    rl_page_seen *seen;
    size_t n_seen;
    rl_page_held *held;
    size_t n_held;
    unsigned long long held_bytes; /* of them in the page: base64 */
    size_t left_out;
};

/* Packs a frame into the spool. On an error nothing stays. */
rl_code rl_page_hold(rl_ab_page *page, const rl_ab_page_input *input, rl_page_held *out, rl_error *err);
void rl_page_release(rl_ab_page *page, rl_page_held *held);
/* Lets go of frames, the least telling first, until they fit the budget beside `fixed` bytes. */
void rl_page_shrink(rl_ab_page *page, unsigned long long fixed);
/* Bytes of its blocks in the page. */
unsigned long long rl_page_held_bytes(const rl_page_held *held);
/* How many maps a pair can have, and which metrics they are of. */
enum { RL_PAGE_MAPS = 2 };
extern const rl_metric rl_page_maps[RL_PAGE_MAPS];

/* A path as seen from a folder. */
void rl_page_relative(const char *folder, const char *path, rl_str *out);

#endif
