/* Reading pixels: wanted channels of one part into planes, chunks in parallel. */
#include "graph/run/exr_core.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>

#include "graph/base/alloc.h"

/* One rl_exr_read. Work is handed out in bands: a chunk of scanlines, or a row of tiles. */
typedef struct job {
    const rl_exr *file;
    int part;
    const rl_exr_part *info;
    rl_exr_plane *planes;
    size_t n_planes;
    int *first; /* per channel of the part: the first plane that wants it, or -1 */
    int *next;  /* per plane: the next one that wants the same channel, or -1 */
    int band_height, bands;
    int tiles_across; /* 0 for scanlines */
    const rl_exr_rows *rows;
    atomic_int next_band;
    pthread_mutex_t mutex; /* guards what follows, and the planes' counts */
    int bad_band;          /* the first band that failed, or `bands` */
    rl_error error;        /* of that band */
} job;

/* What one thread needs to read chunk after chunk. */
typedef struct worker {
    job *job;
    const rl_exr_kernels *kernels;
    rl_exr_inflater *inflater;
    uint8_t *row;        /* one decoded row of one channel */
    uint64_t *nonfinite; /* per plane */
} worker;

/* Where a chunk lies, relative to the data window. */
typedef struct place {
    int x, y, width, height;
} place;

/* A value of row `y` of a channel that does not fit its destination. */
static rl_code fail_value(const job *j, const rl_exr_plane *plane, rl_exr_pixel type, const uint8_t *raw,
                          int x, int y, rl_error *err)
{
    char value[32];
    uint32_t word = 0;
    memcpy(&word, raw, type == RL_EXR_HALF ? 2 : 4);
    float f = 0;
    memcpy(&f, &word, 4);
    if (type == RL_EXR_UINT)
        snprintf(value, sizeof value, "%u", word);
    else
        rl_format_float(type == RL_EXR_HALF ? rl_exr_half_value((uint16_t)word) : f, value);
    return rl_fail_file(
        err, RL_E_DATA, j->file->path, "channel '%s' holds %s at pixel (%d, %d), which is not %s",
        plane->channel, value, x + j->info->data_window.x0, y + j->info->data_window.y0,
        plane->ids ? "a 32-bit id (ids must not be filtered; Cryptomatte needs encoding: cryptomatte)"
                   : "exact as a float");
}

/* Half and float without replacing anything. */
static void store_as_is(rl_exr_pixel type, const uint8_t *raw, float *out, size_t n)
{
    if (type == RL_EXR_FLOAT)
        memcpy(out, raw, 4 * n);
    for (size_t i = 0; type == RL_EXR_HALF && i < n; i++) {
        uint16_t half;
        memcpy(&half, raw + 2 * i, 2);
        out[i] = rl_exr_half_value(half);
    }
}

/* One row of one channel, plain samples in file format, into one plane. */
static rl_code store_row(worker *w, int p, rl_exr_pixel type, const uint8_t *raw, const place *at, int y,
                         rl_error *err)
{
    const rl_exr_plane *plane = &w->job->planes[p];
    const rl_exr_fix fix = {plane->replace_inf, plane->inf_value};
    size_t n = (size_t)at->width, good = n;
    size_t to = (size_t)y * plane->stride + (size_t)at->x;
    if (plane->ids) {
        if (type == RL_EXR_UINT || (plane->bits && type == RL_EXR_FLOAT))
            memcpy(plane->ids + to, raw, 4 * n);
        else if (type == RL_EXR_HALF)
            good = rl_exr_half_to_id(raw, plane->ids + to, n);
        else
            good = rl_exr_float_to_id(raw, plane->ids + to, n);
    } else if (type == RL_EXR_UINT) {
        good = rl_exr_uint_to_float(raw, plane->floats + to, n);
    } else if (plane->keep_nonfinite) {
        store_as_is(type, raw, plane->floats + to, n);
    } else if (type == RL_EXR_HALF) {
        w->nonfinite[p] += w->kernels->half_to_float(raw, plane->floats + to, n, &fix);
    } else {
        w->nonfinite[p] += w->kernels->float_fix(raw, plane->floats + to, n, &fix);
    }
    if (good < n)
        return fail_value(w->job, plane, type, raw + good * (type == RL_EXR_HALF ? 2 : 4), at->x + (int)good,
                          y, err);
    return RL_OK;
}

/* The bytes that row `y` (absolute) of a channel takes in a chunk. */
static size_t row_bytes(const exr_coding_channel_info_t *c, int y)
{
    if (c->height == 0 || (c->y_samples > 1 && y % c->y_samples))
        return 0;
    return (size_t)c->width * (size_t)c->bytes_per_element;
}

/* Rows y0…y1-1 are complete. */
static void rows_done(const job *j, int y0, int y1)
{
    if (j->rows && j->rows->done)
        j->rows->done(j->rows->ctx, j->part, y0, y1);
}

/* Walks the rows of a chunk and stores the wanted channels. `data` holds `size` bytes in the order row,
 * channel, sample; `coded`: behind ZIP's predictor, even and odd bytes apart. */
static rl_code unpack(worker *w, const exr_coding_channel_info_t *channels, const uint8_t *data, size_t size,
                      bool coded, const place *at, rl_error *err)
{
    const job *j = w->job;
    size_t half = (size + 1) / 2, pos = 0;
    uint8_t carry[2] = {128, 0};
    if (coded)
        carry[1] = w->kernels->span_skip(data, half, 128);
    for (int y = 0; y < at->height; y++) {
        for (size_t c = 0; c < j->info->n_channels; c++) {
            size_t bytes = row_bytes(&channels[c], j->info->data_window.y0 + at->y + y);
            if (bytes > size - pos)
                return rl_fail_file(err, RL_E_FORMAT, j->file->path, "a chunk holds less than its rows need");
            const uint8_t *raw = data + pos;
            if (coded && j->first[c] >= 0) {
                w->kernels->span_decode(data + pos / 2, data + half + pos / 2, bytes / 2, carry, w->row);
                raw = w->row;
            } else if (coded) {
                carry[0] = w->kernels->span_skip(data + pos / 2, bytes / 2, carry[0]);
                carry[1] = w->kernels->span_skip(data + half + pos / 2, bytes / 2, carry[1]);
            }
            pos += bytes;
            for (int p = j->first[c]; p >= 0; p = j->next[p]) {
                rl_code code = store_row(w, p, j->info->channels[c].type, raw, at, at->y + y, err);
                if (code)
                    return code;
            }
        }
        if (!j->tiles_across)
            rows_done(j, at->y + y, at->y + y + 1);
    }
    return RL_OK;
}

static rl_code read_chunk(worker *w, const exr_chunk_info_t *chunk, const place *at, rl_error *err)
{
    const exr_coding_channel_info_t *channels;
    const uint8_t *data;
    size_t size;
    bool coded;
    rl_code code = rl_exr_inflate(w->inflater, chunk, &channels, &data, &size, &coded, err);
    return code ? code : unpack(w, channels, data, size, coded, at, err);
}

static rl_code read_band(worker *w, int band, rl_error *err)
{
    const job *j = w->job;
    const rl_exr *file = j->file;
    exr_chunk_info_t chunk;
    place at = {.y = band * j->band_height};
    rl_code code = RL_OK;
    for (int t = 0; !code && t < (j->tiles_across ? j->tiles_across : 1); t++) {
        rl_exr_core_listen();
        exr_result_t rv;
        if (j->tiles_across)
            rv = exr_read_tile_chunk_info(file->ctx, j->part, t, band, 0, 0, &chunk);
        else
            rv = exr_read_scanline_chunk_info(file->ctx, j->part, j->info->data_window.y0 + at.y, &chunk);
        if (rv)
            return rl_exr_core_fail(err, file->path, rv, "the file is broken or incomplete");
        at.x = t * j->info->tile_width;
        at.width = chunk.width;
        at.height = chunk.height;
        if (at.width < 1 || at.height < 1 || at.width > j->info->width - at.x ||
            at.height > j->info->height - at.y)
            return rl_fail_file(err, RL_E_FORMAT, file->path, "a chunk lies outside of the data window");
        code = read_chunk(w, &chunk, &at, err);
    }
    if (!code && j->tiles_across)
        rows_done(j, at.y, at.y + at.height);
    return code;
}

static void worker_free(worker *w)
{
    rl_exr_inflater_free(&w->inflater);
    rl_free(w->row);
    rl_free(w->nonfinite);
}

static rl_code worker_make(worker *w, rl_error *err)
{
    const rl_exr_part *info = w->job->info;
    size_t width = (size_t)(w->job->tiles_across ? info->tile_width : info->width);
    w->kernels = rl_exr_kernels_best();
    w->row = rl_aligned(4 * width);
    w->nonfinite = rl_calloc(w->job->n_planes, sizeof *w->nonfinite);
    if (!w->row || !w->nonfinite)
        return rl_fail_memory(err, 4 * width);
    return rl_exr_inflater_new(w->job->file, w->job->part, &w->inflater, err);
}

static void note_error(job *j, int band, const rl_error *err)
{
    pthread_mutex_lock(&j->mutex);
    if (band < j->bad_band) {
        j->bad_band = band;
        j->error = *err;
    }
    pthread_mutex_unlock(&j->mutex);
}

static bool is_pointless(job *j, int band)
{
    pthread_mutex_lock(&j->mutex);
    bool yes = band >= j->bad_band;
    pthread_mutex_unlock(&j->mutex);
    return yes;
}

static void work(void *ctx, int slot)
{
    (void)slot;
    job *j = ctx;
    worker w = {.job = j};
    rl_error err = {0};
    if (worker_make(&w, &err))
        note_error(j, -1, &err);
    for (int band; (band = atomic_fetch_add(&j->next_band, 1)) < j->bands && !is_pointless(j, band);) {
        err = (rl_error){0};
        if (read_band(&w, band, &err))
            note_error(j, band, &err);
    }
    if (w.nonfinite) {
        pthread_mutex_lock(&j->mutex);
        for (size_t p = 0; p < j->n_planes; p++)
            j->planes[p].nonfinite += w.nonfinite[p];
        pthread_mutex_unlock(&j->mutex);
    }
    worker_free(&w);
}

/* Links planes to the part's channels. */
static rl_code bind(job *j, rl_error *err)
{
    const rl_exr_part *info = j->info;
    j->first = rl_calloc(info->n_channels + j->n_planes, sizeof *j->first);
    if (!j->first)
        return rl_fail_memory(err, (info->n_channels + j->n_planes) * sizeof *j->first);
    j->next = j->first + info->n_channels;
    for (size_t c = 0; c < info->n_channels; c++)
        j->first[c] = -1;
    for (size_t p = 0; p < j->n_planes; p++) {
        rl_exr_plane *plane = &j->planes[p];
        const rl_exr_channel *channel = rl_exr_channel_named(info, plane->channel);
        plane->nonfinite = 0;
        if (!channel)
            return rl_fail_file(err, RL_E_FORMAT, j->file->path, "there is no channel '%s'", plane->channel);
        if (channel->x_sampling != 1 || channel->y_sampling != 1)
            return rl_fail_file(err, RL_E_FORMAT, j->file->path,
                                "channel '%s' is subsampled (%d x %d), which is not supported",
                                plane->channel, channel->x_sampling, channel->y_sampling);
        if (plane->ids && plane->bits && channel->type == RL_EXR_HALF)
            return rl_fail_file(err, RL_E_DATA, j->file->path,
                                "channel '%s' is half, but Cryptomatte's hashes need all 32 bits of a float",
                                plane->channel);
        if (!plane->floats == !plane->ids || plane->stride < (size_t)info->width)
            return rl_fail_file(err, RL_E_USAGE, j->file->path, "channel '%s' has no proper destination",
                                plane->channel);
        size_t c = (size_t)(channel - info->channels);
        j->next[p] = j->first[c];
        j->first[c] = (int)p;
    }
    return RL_OK;
}

uint64_t rl_exr_read_scratch(const rl_exr *file, int part, int threads)
{
    const rl_exr_part *info = &file->parts[part];
    uint64_t chunk_bytes = 0;
    rl_exr_core_listen();
    if (info->deep || exr_get_chunk_unpacked_size(file->ctx, part, &chunk_bytes))
        return 0;
    /* packed, unpacked and scratch of each worker, and a row */
    return (3 * chunk_bytes + 4 * (uint64_t)info->width) * (uint64_t)threads;
}

/* Cuts the part into bands and checks what decoding will take against the file's limit. */
static rl_code divide(job *j, int threads, int *slots, rl_error *err)
{
    const rl_exr_part *info = j->info;
    const rl_exr *file = j->file;
    uint64_t chunk_bytes = 0;
    rl_exr_core_listen();
    exr_result_t rv = exr_get_chunk_unpacked_size(file->ctx, j->part, &chunk_bytes);
    if (!rv && !info->tiled)
        rv = exr_get_scanlines_per_chunk(file->ctx, j->part, &j->band_height);
    if (info->tiled)
        j->band_height = info->tile_height;
    if (rv || j->band_height < 1 || (info->tiled && info->tile_width < 1))
        return rl_exr_core_fail(err, file->path, rv ? rv : EXR_ERR_INVALID_ATTR, "the header is broken");
    if (info->tiled) {
        j->tiles_across = (info->width - 1) / info->tile_width + 1;
    }
    j->bands = (info->height - 1) / j->band_height + 1;
    *slots = j->bands < threads ? j->bands : threads;
    /* packed, unpacked and scratch of each worker */
    uint64_t plane = (uint64_t)info->width * (uint64_t)info->height * 4;
    double bytes = (double)plane * (double)j->n_planes + 3.0 * (double)chunk_bytes * *slots;
    char text[32], limit[32];
    if (file->limit && bytes > (double)file->limit)
        return rl_fail_file(err, RL_E_MEMORY, file->path,
                            "reading %zu channels of %d x %d takes %s, the limit is %s", j->n_planes,
                            info->width, info->height, rl_format_bytes((uint64_t)bytes, text),
                            rl_format_bytes(file->limit, limit));
    return RL_OK;
}

rl_code rl_exr_read(const rl_exr *file, int part, rl_exr_plane *planes, size_t n_planes,
                    const rl_exr_rows *rows, rl_pool *pool, rl_error *err)
{
    if (part < 0 || part >= file->n_parts)
        return rl_fail_file(err, RL_E_USAGE, file->path, "there is no part %d", part);
    job j = {.file = file,
             .part = part,
             .info = &file->parts[part],
             .planes = planes,
             .n_planes = n_planes,
             .rows = rows};
    int slots = 1;
    if (j.info->deep)
        return rl_fail_file(err, RL_E_FORMAT, file->path,
                            "part %d '%s' holds deep data, which is not supported", part, j.info->name);
    rl_code code = bind(&j, err);
    if (!code)
        code = divide(&j, pool ? rl_pool_threads(pool) : 1, &slots, err);
    if (!code) {
        j.bad_band = j.bands;
        pthread_mutex_init(&j.mutex, NULL);
        if (pool)
            rl_pool_for(pool, slots, work, &j);
        else
            work(&j, 0);
        pthread_mutex_destroy(&j.mutex);
        if (j.bad_band < j.bands)
            code = rl_fail(err, j.error.code, (rl_where){j.error.file, 0, 0}, "%s", j.error.text);
    }
    rl_free(j.first);
    return code;
}
