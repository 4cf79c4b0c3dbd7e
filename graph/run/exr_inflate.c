/* Chunks into rows of samples. The core reads them and undoes what it can; ZIP is libdeflate's, DWA the
 * shim's. */
#include "graph/run/exr_core.h"

#include <libdeflate.h>
#include <stdio.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/run/shim_exr.h"

struct rl_exr_inflater {
    const rl_exr *file;
    const rl_exr_part *info;
    int part;
    exr_decode_pipeline_t pipeline;
    bool ready; /* the pipeline is initialized */
    exr_result_t (*core_decompress)(exr_decode_pipeline_t *);
    struct libdeflate_decompressor *deflate;
    rl_exr_layout *layout; /* DWA only */
    bool coded;            /* the last chunk is still behind ZIP's predictor */
    char message[256];     /* of the shim */
};

static exr_result_t inflate_zip(rl_exr_inflater *in)
{
    const exr_decode_pipeline_t *p = &in->pipeline;
    if (!in->deflate)
        in->deflate = libdeflate_alloc_decompressor();
    if (!in->deflate)
        return EXR_ERR_OUT_OF_MEMORY;
    in->coded = true;
    enum libdeflate_result r = libdeflate_zlib_decompress(in->deflate, p->packed_buffer, p->chunk.packed_size,
                                                          p->unpacked_buffer, p->chunk.unpacked_size, NULL);
    return r == LIBDEFLATE_SUCCESS ? EXR_ERR_SUCCESS : EXR_ERR_CORRUPT_CHUNK;
}

static exr_result_t inflate_dwa(rl_exr_inflater *in)
{
    const exr_decode_pipeline_t *p = &in->pipeline;
    if (!in->layout)
        in->layout = rl_calloc(in->info->n_channels, sizeof *in->layout);
    if (!in->layout)
        return EXR_ERR_OUT_OF_MEMORY;
    for (size_t c = 0; c < in->info->n_channels; c++) {
        if (in->info->channels[c].x_sampling != 1 || in->info->channels[c].y_sampling != 1) {
            snprintf(in->message, sizeof in->message,
                     "channel '%.100s' is subsampled, which is not supported", in->info->channels[c].name);
            return EXR_ERR_FEATURE_NOT_IMPLEMENTED;
        }
        in->layout[c] = (rl_exr_layout){in->info->channels[c].name, in->info->channels[c].type};
    }
    rl_shim_exr_block block = {.layout = in->layout,
                               .n_channels = in->info->n_channels,
                               .width = p->chunk.width,
                               .height = p->chunk.height};
    return rl_shim_exr_decompress(&block, p->packed_buffer, p->chunk.packed_size, p->unpacked_buffer,
                                  in->message, sizeof in->message)
               ? EXR_ERR_CORRUPT_CHUNK
               : EXR_ERR_SUCCESS;
}

/* The pipeline's decompress hook. */
static exr_result_t decompress(exr_decode_pipeline_t *p)
{
    rl_exr_inflater *in = p->decoding_user_data;
    in->coded = false;
    /* A chunk that compression would not have made smaller is stored plain. The core of 3.1 forgets that for
     * B44. */
    if (p->chunk.packed_size == p->chunk.unpacked_size)
        return EXR_ERR_SUCCESS; /* both buffers are one */
    switch (in->info->compression) {
    case RL_EXR_ZIPS:
    case RL_EXR_ZIP:
        return inflate_zip(in);
    case RL_EXR_DWAA:
    case RL_EXR_DWAB:
        return inflate_dwa(in);
    case RL_EXR_NONE:
        return EXR_ERR_CORRUPT_CHUNK;
    default:
        return in->core_decompress(p);
    }
}

rl_code rl_exr_inflater_new(const rl_exr *file, int part, rl_exr_inflater **out, rl_error *err)
{
    rl_exr_inflater *in = *out = rl_calloc(1, sizeof *in);
    if (!in)
        return rl_fail_memory(err, sizeof *in);
    in->file = file;
    in->part = part;
    in->info = &file->parts[part];
    return RL_OK;
}

void rl_exr_inflater_free(rl_exr_inflater **inflater)
{
    rl_exr_inflater *in = *inflater;
    *inflater = NULL;
    if (!in)
        return;
    if (in->ready)
        exr_decoding_destroy(in->file->ctx, &in->pipeline);
    if (in->deflate)
        libdeflate_free_decompressor(in->deflate);
    rl_free(in->layout);
    rl_free(in);
}

/* The pipeline with our hooks: the core reads (and decompresses what is not replaced), nothing is unpacked.
 */
static exr_result_t start_pipeline(rl_exr_inflater *in, const exr_chunk_info_t *chunk)
{
    exr_result_t rv = exr_decoding_initialize(in->file->ctx, in->part, chunk, &in->pipeline);
    if (rv)
        return rv;
    in->ready = true;
    rv = exr_decoding_choose_default_routines(in->file->ctx, in->part, &in->pipeline);
    in->core_decompress = in->pipeline.decompress_fn;
    in->pipeline.decompress_fn = decompress;
    in->pipeline.unpack_and_convert_fn = NULL;
    in->pipeline.decoding_user_data = in;
    return rv;
}

rl_code rl_exr_inflate(rl_exr_inflater *in, const exr_chunk_info_t *chunk,
                       const exr_coding_channel_info_t **channels, const uint8_t **data, size_t *size,
                       bool *coded, rl_error *err)
{
    rl_exr_core_listen();
    in->message[0] = 0;
    exr_result_t rv = in->ready ? exr_decoding_update(in->file->ctx, in->part, chunk, &in->pipeline)
                                : start_pipeline(in, chunk);
    if (!rv)
        rv = exr_decoding_run(in->file->ctx, in->part, &in->pipeline);
    if (rv && in->message[0])
        return rl_fail_file(err, RL_E_FORMAT, in->file->path, "a chunk is broken: %s", in->message);
    if (rv == EXR_ERR_CORRUPT_CHUNK && in->info->tiled)
        return rl_fail_file(err, RL_E_FORMAT, in->file->path,
                            "tile (%d, %d) is broken: its %s data does not decompress", chunk->start_x,
                            chunk->start_y, rl_exr_compression_name(in->info->compression));
    if (rv == EXR_ERR_CORRUPT_CHUNK)
        return rl_fail_file(err, RL_E_FORMAT, in->file->path,
                            "rows %d to %d are broken: their %s data does not decompress", chunk->start_y,
                            chunk->start_y + chunk->height - 1,
                            rl_exr_compression_name(in->info->compression));
    if (rv)
        return rl_exr_core_fail(err, in->file->path, rv, "a chunk is broken");
    *channels = in->pipeline.channels;
    *data = in->pipeline.unpacked_buffer;
    *size = (size_t)chunk->unpacked_size;
    *coded = in->coded;
    return RL_OK;
}
