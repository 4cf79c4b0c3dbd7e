/* Writing EXR files: chunks compressed in parallel, written in order, renamed when complete. */
#include "graph/run/exr_core.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"

/* A file that is being written. Chunks are compressed in any order and written in theirs. */
typedef struct job {
    const char *path; /* the final name, for errors */
    const rl_exr_image *image;
    rl_exr_source *sorted;
    char temp[4096];
    int fd;
    exr_context_t ctx;
    int chunks, chunk_height;
    atomic_int next;       /* the next chunk to be compressed */
    pthread_mutex_t mutex; /* guards what follows */
    pthread_cond_t turn;
    int written; /* chunks that are in the file */
    bool failed;
    uint64_t clamped;
    rl_error error;
} job;

static int64_t write_bytes(exr_const_context_t ctx, void *user, const void *buffer, uint64_t size,
                           uint64_t offset, exr_stream_error_func_ptr_t report)
{
    const job *j = user;
    uint64_t done = 0;
    while (done < size) {
        ssize_t n = pwrite(j->fd, (const char *)buffer + done, size - done, (off_t)(offset + done));
        if (n < 0 && errno == EINTR)
            continue;
        if (n <= 0) {
            report(ctx, EXR_ERR_WRITE_IO, "%s", n ? strerror(errno) : "nothing was written");
            return -1;
        }
        done += (uint64_t)n;
    }
    return (int64_t)done;
}

/* ---- the header ---- */

static int by_name(const void *a, const void *b)
{
    return strcmp(((const rl_exr_source *)a)->name, ((const rl_exr_source *)b)->name);
}

static rl_code check_image(const char *path, const rl_exr_image *im, rl_error *err)
{
    const rl_exr_box *d = &im->data_window, *s = &im->display_window;
    const int far = 1 << 29; /* the format stops at 2^30 */
    if (d->x0 > d->x1 || d->y0 > d->y1 || s->x0 > s->x1 || s->y0 > s->y1 || d->x0 < -far || d->y0 < -far ||
        d->x1 > far || d->y1 > far || s->x0 < -far || s->y0 < -far || s->x1 > far || s->y1 > far)
        return rl_fail_file(err, RL_E_USAGE, path,
                            "the data window or the display window is empty or too far out");
    if (im->n_channels < 1 || im->n_channels > INT16_MAX)
        return rl_fail_file(err, RL_E_USAGE, path, "an EXR file needs 1 to %d channels", INT16_MAX);
    if ((unsigned)im->compression >= RL_EXR_COMPRESSIONS || im->level < 0 || im->level > 12)
        return rl_fail_file(err, RL_E_USAGE, path, "compression %d, level %d: there is none like that",
                            (int)im->compression, im->level);
    if (im->copy_from && (im->copy_part < 0 || im->copy_part >= rl_exr_parts(im->copy_from)))
        return rl_fail_file(err, RL_E_USAGE, path, "the file to copy attributes from has no part %d",
                            im->copy_part);
    size_t width = (size_t)(d->x1 - d->x0) + 1;
    for (size_t c = 0; c < im->n_channels; c++) {
        const rl_exr_source *source = &im->channels[c];
        bool has = source->ids || (source->type != RL_EXR_UINT && source->floats);
        if (!has || source->stride < width || (unsigned)source->type > RL_EXR_FLOAT)
            return rl_fail_file(err, RL_E_USAGE, path, "channel '%s' has no proper pixels", source->name);
        if (!source->name[0] || strlen(source->name) > 255)
            return rl_fail_file(err, RL_E_USAGE, path, "a channel's name must have 1 to 255 characters");
    }
    return RL_OK;
}

static rl_code sort_channels(job *j, rl_error *err)
{
    size_t n = j->image->n_channels;
    j->sorted = rl_calloc(n, sizeof *j->sorted);
    if (!j->sorted)
        return rl_fail_memory(err, n * sizeof *j->sorted);
    memcpy(j->sorted, j->image->channels, n * sizeof *j->sorted);
    qsort(j->sorted, n, sizeof *j->sorted, by_name);
    for (size_t c = 1; c < n; c++)
        if (!strcmp(j->sorted[c - 1].name, j->sorted[c].name))
            return rl_fail_file(err, RL_E_USAGE, j->path, "two channels are called '%s'", j->sorted[c].name);
    return RL_OK;
}

static exr_attr_box2i_t box_to(const rl_exr_box *b)
{
    exr_attr_box2i_t box;
    box.min.x = b->x0;
    box.min.y = b->y0;
    box.max.x = b->x1;
    box.max.y = b->y1;
    return box;
}

/* Names beyond 31 characters set a flag in the file that readers from before 2013 refuse. */
static bool needs_long_names(const rl_exr_image *im)
{
    size_t longest = 0, n = im->copy_from ? rl_exr_part_at(im->copy_from, im->copy_part)->n_attrs : 0;
    const char *name, *type;
    for (size_t i = 0; i < im->n_channels; i++)
        if (strlen(im->channels[i].name) > longest)
            longest = strlen(im->channels[i].name);
    for (size_t i = 0; i < im->n_attrs; i++)
        if (strlen(im->attrs[i].name) > longest)
            longest = strlen(im->attrs[i].name);
    for (size_t i = 0; i < n; i++) {
        rl_exr_attr_at(im->copy_from, im->copy_part, i, &name, &type, NULL);
        size_t length = strlen(name) > strlen(type) ? strlen(name) : strlen(type);
        if (length > longest)
            longest = length;
    }
    return longest > 31;
}

static exr_result_t describe(const job *j)
{
    const rl_exr_image *im = j->image;
    int part = 0;
    exr_attr_box2i_t data = box_to(&im->data_window), display = box_to(&im->display_window);
    exr_attr_v2f_t center;
    center.x = im->screen_center[0];
    center.y = im->screen_center[1];
    exr_result_t rv = exr_set_longname_support(j->ctx, needs_long_names(im));
    if (!rv)
        rv = exr_add_part(j->ctx, NULL, EXR_STORAGE_SCANLINE, &part);
    if (!rv)
        rv = exr_initialize_required_attr(j->ctx, 0, &display, &data,
                                          im->pixel_aspect > 0 ? im->pixel_aspect : 1.0f, &center,
                                          im->screen_width > 0 ? im->screen_width : 1.0f,
                                          EXR_LINEORDER_INCREASING_Y, (exr_compression_t)im->compression);
    for (size_t c = 0; !rv && c < im->n_channels; c++)
        rv = exr_add_channel(j->ctx, 0, j->sorted[c].name, (exr_pixel_type_t)j->sorted[c].type,
                             EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1);
    return rv;
}

static rl_code start(job *j, rl_error *err)
{
    uint64_t bytes = 0;
    rl_code code = rl_file_temp(j->path, j->temp, sizeof j->temp, err);
    if (code) {
        j->temp[0] = 0;
        return code;
    }
    j->fd = open(j->temp, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (j->fd < 0) {
        j->temp[0] = 0;
        return rl_fail_file(err, RL_E_IO, j->path, "cannot be written: %s", strerror(errno));
    }
    exr_context_initializer_t init = rl_exr_core_init();
    init.user_data = j;
    init.write_fn = write_bytes;
    rl_exr_core_listen();
    exr_result_t rv = exr_start_write(&j->ctx, j->path, EXR_WRITE_FILE_DIRECTLY, &init);
    if (!rv)
        rv = describe(j);
    if (!rv && rl_exr_attrs_write(j->ctx, j->path, j->image, err))
        return err ? err->code : RL_E_FORMAT;
    if (!rv)
        rv = exr_write_header(j->ctx);
    if (!rv)
        rv = exr_get_chunk_count(j->ctx, 0, &j->chunks);
    if (!rv)
        rv = exr_get_scanlines_per_chunk(j->ctx, 0, &j->chunk_height);
    if (!rv)
        rv = exr_get_chunk_unpacked_size(j->ctx, 0, &bytes);
    if (!rv && bytes > INT32_MAX)
        return rl_fail_file(err, RL_E_USAGE, j->path, "%d rows of these channels exceed the format's 2 GiB",
                            j->chunk_height);
    return rv ? rl_exr_core_fail(err, j->path, rv, "the header cannot be written") : RL_OK;
}

/* ---- the chunks ---- */

static void stop(job *j, const rl_error *err)
{
    pthread_mutex_lock(&j->mutex);
    if (!j->failed)
        j->error = *err;
    j->failed = true;
    pthread_cond_broadcast(&j->turn);
    pthread_mutex_unlock(&j->mutex);
}

/* Waits for the chunk's turn and writes it. Chunks are handed out in order, so the one whose turn it is is
 * always in somebody's hands. False when another thread failed. */
static bool write_in_turn(job *j, int chunk, int y, const uint8_t *data, size_t size, uint64_t clamped)
{
    rl_error err = {0};
    pthread_mutex_lock(&j->mutex);
    while (!j->failed && j->written != chunk)
        pthread_cond_wait(&j->turn, &j->mutex);
    bool go = !j->failed;
    if (go) {
        rl_exr_core_listen();
        exr_result_t rv = exr_write_scanline_chunk(j->ctx, 0, y, data, size);
        if (rv) {
            rl_exr_core_fail(&err, j->path, rv, "cannot be written");
            j->error = err;
            j->failed = true;
        }
        j->written++;
        j->clamped += clamped;
        pthread_cond_broadcast(&j->turn);
    }
    pthread_mutex_unlock(&j->mutex);
    return go && !err.code;
}

static void work(void *ctx, int slot)
{
    (void)slot;
    job *j = ctx;
    rl_error err = {0};
    rl_exr_deflater *de = NULL;
    rl_code code = rl_exr_deflater_new(j->ctx, j->path, j->image, j->sorted, &de, &err);
    bool go = true;
    for (int i; !code && go && (i = atomic_fetch_add(&j->next, 1)) < j->chunks;) {
        exr_chunk_info_t chunk;
        const uint8_t *data;
        size_t size;
        uint64_t clamped = 0;
        int y = j->image->data_window.y0 + i * j->chunk_height;
        rl_exr_core_listen();
        exr_result_t rv = exr_write_scanline_chunk_info(j->ctx, 0, y, &chunk);
        code = rv ? rl_exr_core_fail(&err, j->path, rv, "cannot be written")
                  : rl_exr_deflate(de, &chunk, &data, &size, &clamped, &err);
        if (!code)
            go = write_in_turn(j, i, y, data, size, clamped);
    }
    if (code)
        stop(j, &err);
    rl_exr_deflater_free(&de);
}

static rl_code write_chunks(job *j, rl_pool *pool, rl_error *err)
{
    int slots = pool ? rl_pool_threads(pool) : 1;
    pthread_mutex_init(&j->mutex, NULL);
    pthread_cond_init(&j->turn, NULL);
    if (pool)
        rl_pool_for(pool, slots < j->chunks ? slots : j->chunks, work, j);
    else
        work(j, 0);
    pthread_cond_destroy(&j->turn);
    pthread_mutex_destroy(&j->mutex);
    if (j->failed)
        return rl_fail(err, j->error.code, (rl_where){j->error.file, 0, 0}, "%s", j->error.text);
    return RL_OK;
}

rl_code rl_exr_write(const char *path, const rl_exr_image *image, rl_pool *pool, uint64_t *clamped,
                     rl_error *err)
{
    job j = {.path = path, .image = image, .fd = -1};
    rl_code code = check_image(path, image, err);
    if (!code)
        code = sort_channels(&j, err);
    if (!code)
        code = start(&j, err);
    if (!code)
        code = write_chunks(&j, pool, err);
    rl_exr_core_listen();
    exr_result_t rv = j.ctx ? exr_finish(&j.ctx) : 0;
    if (!code && rv)
        code = rl_exr_core_fail(err, path, rv, "cannot be written");
    if (j.fd >= 0 && close(j.fd) && !code)
        code = rl_fail_file(err, RL_E_IO, path, "cannot be written: %s", strerror(errno));
    if (!code)
        code = rl_file_commit(j.temp, path, err);
    else if (j.temp[0])
        rl_file_discard(j.temp);
    if (clamped)
        *clamped = code ? 0 : j.clamped;
    rl_free(j.sorted);
    return code;
}
