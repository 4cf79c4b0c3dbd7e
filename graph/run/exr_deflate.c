/* Rows of samples into chunks: ZIP by ISA-L or libdeflate, DWA by the shim, the rest by the core. */
#include "graph/run/exr_core.h"

#include <isa-l/igzip_lib.h>
#include <libdeflate.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/run/shim_exr.h"

#define LOOK_AHEAD 512 /* bytes behind the input that ISA-L may look at: more than ISAL_LOOK_AHEAD */

struct rl_exr_deflater {
    exr_context_t ctx;
    const char *path;
    const rl_exr_image *image;
    const rl_exr_source *channels; /* in the order of the file */
    const rl_exr_kernels *kernels;
    exr_encode_pipeline_t pipeline; /* for what the core compresses */
    bool ready;
    rl_exr_layout *layout;
    uint8_t *plain; /* the chunk as rows of channels; for ZIP one row of a channel */
    size_t plain_room;
    uint8_t *coded, *packed; /* ZIP: behind the predictor, and compressed */
    size_t room;             /* of coded and packed */
    struct libdeflate_compressor *deflate;
    struct isal_zstream *stream; /* ISA-L */
    uint8_t *level_buffer;
    char message[256];
};

static size_t sample_bytes(rl_exr_pixel type)
{
    return type == RL_EXR_HALF ? 2 : 4;
}

static void pack_mask(const uint32_t *ids, rl_exr_pixel type, size_t width, uint8_t *out)
{
    const uint16_t one = 0x3c00;
    for (size_t x = 0; type == RL_EXR_HALF && x < width; x++) {
        uint16_t half = ids[x] ? one : 0;
        memcpy(out + 2 * x, &half, sizeof half);
    }
    for (size_t x = 0; type == RL_EXR_FLOAT && x < width; x++) {
        float f = ids[x] ? 1.0f : 0.0f;
        memcpy(out + 4 * x, &f, sizeof f);
    }
}

/* Row `y` (relative to the data window) of a channel as the file has it; returns how many values were
 * clamped. */
static size_t pack_row(const rl_exr_deflater *de, const rl_exr_source *source, int y, size_t width,
                       uint8_t *out)
{
    size_t from = (size_t)y * source->stride;
    if (source->type != RL_EXR_UINT && !source->floats) {
        pack_mask(source->ids + from, source->type, width, out);
        return 0;
    }
    if (source->type == RL_EXR_HALF)
        return de->kernels->float_to_half(source->floats + from, out, width);
    memcpy(out, source->type == RL_EXR_UINT ? (const void *)(source->ids + from) : (source->floats + from),
           4 * width);
    return 0;
}

static size_t pack_plain(const rl_exr_deflater *de, const exr_chunk_info_t *chunk, uint8_t *out)
{
    size_t clamped = 0, width = (size_t)chunk->width;
    int first = chunk->start_y - de->image->data_window.y0;
    for (int y = first; y < first + chunk->height; y++) {
        for (size_t c = 0; c < de->image->n_channels; c++) {
            clamped += pack_row(de, &de->channels[c], y, width, out);
            out += width * sample_bytes(de->channels[c].type);
        }
    }
    return clamped;
}

static size_t pack_coded(const rl_exr_deflater *de, const exr_chunk_info_t *chunk)
{
    size_t clamped = 0, width = (size_t)chunk->width, pos = 0, half = (size_t)chunk->unpacked_size / 2;
    int first = chunk->start_y - de->image->data_window.y0;
    uint8_t carry[2] = {128, 128};
    for (int y = first; y < first + chunk->height; y++) {
        for (size_t c = 0; c < de->image->n_channels; c++) {
            size_t n = width * sample_bytes(de->channels[c].type) / 2;
            clamped += pack_row(de, &de->channels[c], y, width, de->plain);
            de->kernels->span_encode(de->plain, n, carry, de->coded + pos, de->coded + half + pos);
            pos += n;
        }
    }
    /* The byte before the odd half is the last even one, which is known only now. */
    de->coded[half] = (uint8_t)(de->coded[half] - carry[0] + 128);
    return clamped;
}

/* The output must depend on nothing but the chunk. ISA-L's init leaves the window's size (hist_bits) as it
 * finds it, so all is cleared. And levels 1 and 2 of 2.30 put bits 16 to 47 of the stream's address where the
 * hash of the bytes from the third on belongs, when their fast loop codes a stream's first byte
 * (isal_deflate_icf_body_hash_hist: a register is hashed that is not loaded yet): about one chunk in ten
 * thousand is coded otherwise at another address. The loop leaves the last 16 bytes of what it is given to
 * another one, which does not; so the first 16 go ahead, and are flushed. That takes 8 bytes a chunk. */
#define AHEAD 16

/* A zlib stream around ISA-L's: its own checksum takes ten times as long as libdeflate's. */
enum { ZLIB_HEADER = 2, ZLIB_TRAILER = 4 };

static size_t deflate_isal(rl_exr_deflater *de, uint32_t size, uint8_t *out, uint32_t room)
{
    struct isal_zstream *s = de->stream;
    uint32_t ahead = size < AHEAD ? size : AHEAD;
    memset(s, 0, sizeof *s);
    memset(de->level_buffer, 0, ISAL_DEF_LVL1_REQ);
    memset(de->coded + size, 0, LOOK_AHEAD);
    isal_deflate_init(s);
    s->gzip_flag = IGZIP_DEFLATE;
    s->level = 1;
    s->level_buf = de->level_buffer;
    s->level_buf_size = ISAL_DEF_LVL1_DEFAULT;
    s->next_in = de->coded;
    s->next_out = out;
    s->avail_out = room;
    s->avail_in = ahead;
    s->flush = SYNC_FLUSH;
    if (isal_deflate(s) != COMP_OK || s->avail_in > 0)
        return 0;
    s->avail_in = size - ahead;
    s->flush = NO_FLUSH;
    s->end_of_stream = 1;
    return isal_deflate(s) == COMP_OK && s->internal_state.state == ZSTATE_END ? s->total_out : 0;
}

static size_t compress_isal(rl_exr_deflater *de, uint32_t size)
{
    if (size <= ZLIB_HEADER + ZLIB_TRAILER + 1)
        return 0;
    size_t n = deflate_isal(de, size, de->packed + ZLIB_HEADER, size - 1 - ZLIB_HEADER - ZLIB_TRAILER);
    if (n == 0)
        return 0;
    uint32_t sum = libdeflate_adler32(1, de->coded, size);
    uint8_t *end = de->packed + ZLIB_HEADER + n;
    memcpy(de->packed, "\x78\x01", ZLIB_HEADER);
    for (int i = 0; i < ZLIB_TRAILER; i++)
        end[i] = (uint8_t)(sum >> (24 - 8 * i));
    return ZLIB_HEADER + n + ZLIB_TRAILER;
}

/* Compresses `size` bytes of de->coded into de->packed; 0 when the result would not be smaller. */
static size_t compress_zip(rl_exr_deflater *de, size_t size)
{
    if (de->deflate)
        return libdeflate_zlib_compress(de->deflate, de->coded, size, de->packed, size - 1);
    return compress_isal(de, (uint32_t)size);
}

static rl_code ensure_zip(rl_exr_deflater *de, const exr_chunk_info_t *chunk, rl_error *err)
{
    size_t size = (size_t)chunk->unpacked_size;
    if (de->room >= size)
        return RL_OK;
    de->plain = rl_aligned(4 * (size_t)chunk->width); /* the first chunk is the largest: once is enough */
    de->coded = rl_aligned(size + LOOK_AHEAD);
    de->packed = rl_aligned(size);
    if (!de->plain || !de->coded || !de->packed)
        return rl_fail_memory(err, size);
    de->room = size;
    if (de->image->level > 0) {
        de->deflate = libdeflate_alloc_compressor(de->image->level);
        return de->deflate ? RL_OK : rl_fail_memory(err, size);
    }
    de->stream = rl_aligned(sizeof *de->stream);
    de->level_buffer = rl_aligned(ISAL_DEF_LVL1_DEFAULT);
    return de->stream && de->level_buffer ? RL_OK : rl_fail_memory(err, sizeof *de->stream);
}

static rl_code deflate_zip(rl_exr_deflater *de, const exr_chunk_info_t *chunk, const uint8_t **data,
                           size_t *size, uint64_t *clamped, rl_error *err)
{
    rl_code code = ensure_zip(de, chunk, err);
    if (code)
        return code;
    *clamped += pack_coded(de, chunk);
    *size = compress_zip(de, (size_t)chunk->unpacked_size);
    *data = de->packed;
    if (*size == 0) { /* not smaller: the format stores it plain */
        pack_plain(de, chunk, de->packed);
        *size = (size_t)chunk->unpacked_size;
    }
    return RL_OK;
}

/* Compression by the core: its pipeline gives the function, the chunk is packed by us. */
static rl_code deflate_core(rl_exr_deflater *de, const exr_chunk_info_t *chunk, const uint8_t **data,
                            size_t *size, rl_error *err)
{
    exr_encode_pipeline_t *p = &de->pipeline;
    rl_exr_core_listen();
    exr_result_t rv;
    if (!de->ready) {
        rv = exr_encoding_initialize(de->ctx, 0, chunk, p);
        de->ready = rv == EXR_ERR_SUCCESS;
        if (!rv)
            rv = exr_encoding_choose_default_routines(de->ctx, 0, p);
    } else {
        p->packed_buffer = NULL;
        rv = exr_encoding_update(de->ctx, 0, chunk, p);
    }
    if (!rv) {
        p->packed_buffer = de->plain;
        p->packed_bytes = chunk->unpacked_size;
        p->packed_alloc_size = 0; /* not the pipeline's to free */
        rv = p->compress_fn(p);
        p->packed_buffer = NULL;
    }
    if (rv)
        return rl_exr_core_fail(err, de->path, rv, "a chunk cannot be compressed");
    *data = p->compressed_buffer;
    *size = p->compressed_bytes;
    return RL_OK;
}

static rl_code deflate_dwa(rl_exr_deflater *de, const exr_chunk_info_t *chunk, const uint8_t **data,
                           size_t *size, rl_error *err)
{
    rl_shim_exr_block block = {.layout = de->layout,
                               .n_channels = de->image->n_channels,
                               .width = chunk->width,
                               .height = chunk->height,
                               .dwa_level = de->image->dwa_level};
    de->message[0] = 0;
    *data = de->packed;
    if (rl_shim_exr_compress(&block, de->plain, de->packed, de->room, size, de->message, sizeof de->message))
        return rl_fail_file(err, RL_E_FORMAT, de->path, "a chunk cannot be compressed: %s", de->message);
    return RL_OK;
}

static rl_code ensure_plain(rl_exr_deflater *de, const exr_chunk_info_t *chunk, rl_error *err)
{
    size_t size = (size_t)chunk->unpacked_size, n = de->image->n_channels;
    if (de->plain_room >= size)
        return RL_OK;
    bool dwa = de->image->compression == RL_EXR_DWAA || de->image->compression == RL_EXR_DWAB;
    de->plain = rl_aligned(size); /* the first chunk is the largest */
    if (dwa) {
        de->packed = rl_aligned(size);
        de->layout = rl_calloc(n, sizeof *de->layout);
    }
    if (!de->plain || (dwa && (!de->packed || !de->layout)))
        return rl_fail_memory(err, size);
    for (size_t c = 0; dwa && c < n; c++)
        de->layout[c] = (rl_exr_layout){de->channels[c].name, de->channels[c].type};
    de->plain_room = de->room = size;
    return RL_OK;
}

rl_code rl_exr_deflate(rl_exr_deflater *de, const exr_chunk_info_t *chunk, const uint8_t **data, size_t *size,
                       uint64_t *clamped, rl_error *err)
{
    rl_exr_compression method = de->image->compression;
    if (method == RL_EXR_ZIP || method == RL_EXR_ZIPS)
        return deflate_zip(de, chunk, data, size, clamped, err);
    rl_code code = ensure_plain(de, chunk, err);
    if (code)
        return code;
    *clamped += pack_plain(de, chunk, de->plain);
    size_t plain = (size_t)chunk->unpacked_size;
    *size = plain;
    if (method == RL_EXR_DWAA || method == RL_EXR_DWAB)
        code = deflate_dwa(de, chunk, data, size, err);
    else if (method != RL_EXR_NONE)
        code = deflate_core(de, chunk, data, size, err);
    /* Readers take a chunk of exactly the plain size for plain, so equal is not good enough either. */
    if (!code && *size >= plain) {
        *data = de->plain;
        *size = plain;
    }
    return code;
}

rl_code rl_exr_deflater_new(exr_context_t ctx, const char *path, const rl_exr_image *image,
                            const rl_exr_source *sorted, rl_exr_deflater **out, rl_error *err)
{
    rl_exr_deflater *de = *out = rl_calloc(1, sizeof *de);
    if (!de)
        return rl_fail_memory(err, sizeof *de);
    de->ctx = ctx;
    de->path = path;
    de->image = image;
    de->channels = sorted;
    de->kernels = rl_exr_kernels_best();
    return RL_OK;
}

void rl_exr_deflater_free(rl_exr_deflater **deflater)
{
    rl_exr_deflater *de = *deflater;
    *deflater = NULL;
    if (!de)
        return;
    if (de->ready)
        exr_encoding_destroy(de->ctx, &de->pipeline);
    if (de->deflate)
        libdeflate_free_compressor(de->deflate);
    rl_free(de->layout);
    rl_free(de->plain);
    rl_free(de->coded);
    rl_free(de->packed);
    rl_free(de->stream);
    rl_free(de->level_buffer);
    rl_free(de);
}
