/* Inside the EXR codec: what its files share. Nothing else includes this. */
#ifndef RL_RUN_EXR_CORE_H
#define RL_RUN_EXR_CORE_H

#include <openexr.h>

#include "graph/base/arena.h"
#include "graph/run/exr.h"

struct rl_exr {
    rl_arena arena; /* path and parts */
    const char *path;
    int fd;
    uint64_t limit;
    exr_context_t ctx;
    rl_exr_part *parts;
    int n_parts;
};

/* ---- OpenEXR's core (exr_open.c) ---- */

/* The core's initializer: allocation through rl_malloc, messages kept for rl_exr_core_fail, nothing printed.
 */
exr_context_initializer_t rl_exr_core_init(void);
/* Forgets what the core said on this thread; called before a series of calls whose failure is reported. */
void rl_exr_core_listen(void);
/* An error made from the core's result and what it said first on this thread since rl_exr_core_listen. */
rl_code rl_exr_core_fail(rl_error *err, const char *path, exr_result_t result, const char *doing);

/* ---- rows of pixels (exr_pixel.c) ---- */

/* What becomes of infinities, as in rl_exr_plane. */
typedef struct rl_exr_fix {
    bool replace_inf;
    float inf_value;
} rl_exr_fix;

/* The loops that run over every sample. There is a portable set and, where the processor has them, vector
 * ones; all give the same bits. `n` counts samples (span kernels: bytes of one half). Nothing needs to be
 * aligned.
 *
 * ZIP stores the even bytes of a chunk, then the odd ones, and of all that byte for byte the difference to
 * the byte before, plus 128. A span is the part of one row of one channel in both halves; carry[0] and
 * carry[1] are the byte before it in either half (the first byte of all has 128 before it). */
typedef struct rl_exr_kernels {
    /* in: n coded bytes of each half; out: 2n plain ones. */
    void (*span_decode)(const uint8_t *even, const uint8_t *odd, size_t n, uint8_t carry[2], uint8_t *out);
    /* The byte behind n coded bytes that follow `carry`. */
    uint8_t (*span_skip)(const uint8_t *coded, size_t n, uint8_t carry);
    /* The reverse of span_decode. */
    void (*span_encode)(const uint8_t *in, size_t n, uint8_t carry[2], uint8_t *even, uint8_t *odd);
    /* Return how many values were replaced by 0. in == out is fine for the second. */
    size_t (*half_to_float)(const void *in, float *out, size_t n, const rl_exr_fix *fix);
    size_t (*float_fix)(const void *in, float *out, size_t n, const rl_exr_fix *fix);
    /* To nearest, ties to even. Returns how many were clamped. */
    size_t (*float_to_half)(const float *in, void *out, size_t n);
} rl_exr_kernels;

extern const rl_exr_kernels rl_exr_kernels_portable;
/* The fastest set for this processor. */
const rl_exr_kernels *rl_exr_kernels_best(void);
/* The sets that run on it, slowest first: i = 0, 1, …; NULL behind the last. */
const rl_exr_kernels *rl_exr_kernels_at(int i);
/* Puts loops of exr_pixel_wide.c in the place of others; false where the processor has none of them. */
bool rl_exr_kernels_widen(rl_exr_kernels *set);

/* Rare conversions, portable only. They return n, or the index of the first value that does not fit. */
size_t rl_exr_uint_to_float(const void *in, float *out, size_t n);
size_t rl_exr_half_to_id(const void *in, uint32_t *out, size_t n);
size_t rl_exr_float_to_id(const void *in, uint32_t *out, size_t n);

float rl_exr_half_value(uint16_t half);

/* ---- chunks (exr_inflate.c, exr_deflate.c) ---- */

/* Decompresses one chunk after the other; one a worker. */
typedef struct rl_exr_inflater rl_exr_inflater;

rl_code rl_exr_inflater_new(const rl_exr *file, int part, rl_exr_inflater **out, rl_error *err);
void rl_exr_inflater_free(rl_exr_inflater **in);
/* Reads and decompresses a chunk. The result is rows of channels one after the other (`coded` false) or the
 * same behind ZIP's predictor and byte order (true); it lives until the next call. */
rl_code rl_exr_inflate(rl_exr_inflater *in, const exr_chunk_info_t *chunk,
                       const exr_coding_channel_info_t **channels, const uint8_t **data, size_t *size,
                       bool *coded, rl_error *err);

/* Compresses. */
typedef struct rl_exr_deflater rl_exr_deflater;

rl_code rl_exr_deflater_new(exr_context_t ctx, const char *path, const rl_exr_image *image,
                            const rl_exr_source *sorted, rl_exr_deflater **out, rl_error *err);
void rl_exr_deflater_free(rl_exr_deflater **de);
/* Packs and compresses the chunk; *data lives until the next call. Adds to *clamped. */
rl_code rl_exr_deflate(rl_exr_deflater *de, const exr_chunk_info_t *chunk, const uint8_t **data, size_t *size,
                       uint64_t *clamped, rl_error *err);

/* ---- attributes (exr_attr.c) ---- */

/* The i-th attribute as the core has it; NULL when there are not that many. */
const exr_attribute_t *rl_exr_attr_raw(const rl_exr *file, int part, size_t i);

/* Puts the image's attributes, and those that it copies, into a file that is being written. */
rl_code rl_exr_attrs_write(exr_context_t ctx, const char *path, const rl_exr_image *image, rl_error *err);

#endif
