/* Opening EXR files: the file beneath the core, its messages, the parts. */
#include "graph/run/exr_core.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#include "graph/base/alloc.h"

/* ---- the core ---- */

/* The core hands its messages out on the thread that fails, the most telling one first. */
static _Thread_local char said[512];
/* Where a read ran into the end of the file; that is no error while the core looks ahead. */
static _Thread_local char short_read[128];
static _Thread_local bool starved; /* the core asked for memory and got none */

static void keep_message(exr_const_context_t ctx, exr_result_t code, const char *message)
{
    (void)ctx;
    (void)code;
    if (said[0])
        return;
    snprintf(said, sizeof said, "%s", message);
    for (char *c = said; *c; c++) /* names out of broken files may hold anything */
        if ((unsigned char)*c < 32 || (unsigned char)*c >= 127)
            *c = '?';
}

void rl_exr_core_listen(void)
{
    said[0] = short_read[0] = 0;
    starved = false;
}

static void *core_alloc(size_t bytes)
{
    void *p = rl_malloc(bytes);
    starved |= !p;
    return p;
}

exr_context_initializer_t rl_exr_core_init(void)
{
    exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
    init.error_handler_fn = keep_message;
    init.alloc_fn = core_alloc;
    init.free_fn = rl_free;
    /* A table of chunks with holes is a file whose writer died: refuse it, rather than guess where chunks
     * are. */
    init.flags = EXR_CONTEXT_FLAG_DISABLE_CHUNK_RECONSTRUCTION;
    return init;
}

rl_code rl_exr_core_fail(rl_error *err, const char *path, exr_result_t result, const char *doing)
{
    rl_code code = RL_E_FORMAT;
    if (result == EXR_ERR_OUT_OF_MEMORY)
        code = RL_E_MEMORY;
    else if (result == EXR_ERR_FILE_ACCESS || result == EXR_ERR_WRITE_IO)
        code = RL_E_IO;
    const char *why = said[0] ? said : exr_get_default_error_message(result);
    if (result == EXR_ERR_READ_IO && short_read[0])
        why = short_read;
    return rl_fail_file(err, code, path, "%s: %s", doing, why);
}

/* ---- the file ---- */

static int64_t read_bytes(exr_const_context_t ctx, void *user, void *buffer, uint64_t size, uint64_t offset,
                          exr_stream_error_func_ptr_t report)
{
    const rl_exr *file = user;
    uint64_t done = 0;
    while (done < size) {
        ssize_t n = pread(file->fd, (char *)buffer + done, size - done, (off_t)(offset + done));
        if (n < 0 && errno == EINTR)
            continue;
        if (n < 0) {
            report(ctx, EXR_ERR_READ_IO, "%s", strerror(errno));
            return -1;
        }
        if (n == 0) {
            snprintf(short_read, sizeof short_read,
                     "the file ends at byte %llu, where %llu more are expected",
                     (unsigned long long)(offset + done), (unsigned long long)(size - done));
            break;
        }
        done += (uint64_t)n;
    }
    return (int64_t)done;
}

static int64_t query_size(exr_const_context_t ctx, void *user)
{
    (void)ctx;
    const rl_exr *file = user;
    struct stat st;
    return fstat(file->fd, &st) ? -1 : (int64_t)st.st_size;
}

static rl_code open_file(rl_exr *file, rl_error *err)
{
    unsigned char magic[4] = {0};
    struct stat st;
    file->fd = open(file->path, O_RDONLY | O_CLOEXEC | O_NONBLOCK); /* a pipe would wait for its writer */
    if (file->fd < 0 || fstat(file->fd, &st))
        return rl_fail_file(err, RL_E_IO, file->path, "cannot be opened: %s", strerror(errno));
    if (!S_ISREG(st.st_mode))
        return rl_fail_file(err, RL_E_IO, file->path, "cannot be opened: not a regular file");
    if (st.st_size == 0)
        return rl_fail_file(err, RL_E_FORMAT, file->path, "the file is empty");
    if (pread(file->fd, magic, 4, 0) < 4 || memcmp(magic, "\x76\x2f\x31\x01", 4))
        return rl_fail_file(err, RL_E_FORMAT, file->path, "not an OpenEXR file");
    exr_context_initializer_t init = rl_exr_core_init();
    init.user_data = file;
    init.read_fn = read_bytes;
    init.size_fn = query_size;
    rl_exr_core_listen();
    exr_result_t rv = exr_start_read(&file->ctx, file->path, &init);
    /* The core reads on when there is no memory for an attribute, and takes its default: another display
     * window. */
    if (!rv && starved)
        rv = EXR_ERR_OUT_OF_MEMORY;
    if (rv)
        return rl_exr_core_fail(err, file->path, rv, "the header is broken");
    return RL_OK;
}

/* ---- parts ---- */

static rl_exr_box box_from(exr_attr_box2i_t b)
{
    return (rl_exr_box){b.min.x, b.min.y, b.max.x, b.max.y};
}

static exr_result_t read_channels(rl_exr *file, int i, rl_exr_part *part)
{
    const exr_attr_chlist_t *list;
    exr_result_t rv = exr_get_channels(file->ctx, i, &list);
    if (rv)
        return rv;
    rl_exr_channel *channels = rl_arena_array(&file->arena, (size_t)list->num_channels, sizeof *channels);
    if (!channels)
        return EXR_ERR_OUT_OF_MEMORY;
    for (int c = 0; c < list->num_channels; c++) {
        const exr_attr_chlist_entry_t *e = &list->entries[c];
        channels[c].name = e->name.str;
        channels[c].type = (rl_exr_pixel)e->pixel_type;
        channels[c].x_sampling = e->x_sampling;
        channels[c].y_sampling = e->y_sampling;
    }
    part->channels = channels;
    part->n_channels = (size_t)list->num_channels;
    return 0;
}

static exr_result_t read_tiling(rl_exr *file, int i, rl_exr_part *part)
{
    int32_t w, h;
    exr_result_t rv = exr_get_tile_sizes(file->ctx, i, 0, 0, &w, &h);
    if (!rv) {
        part->tile_width = w;
        part->tile_height = h;
    }
    return rv;
}

static exr_result_t read_part(rl_exr *file, int i, rl_exr_part *part)
{
    exr_const_context_t ctx = file->ctx;
    exr_storage_t storage = EXR_STORAGE_SCANLINE;
    exr_compression_t compression = EXR_COMPRESSION_NONE;
    exr_attr_box2i_t data = {0}, display = {0};
    exr_attr_v2f_t center = {0};
    const char *name = NULL;
    int32_t n_attrs = 0;
    exr_result_t rv = exr_get_storage(ctx, i, &storage);
    if (!rv)
        rv = exr_get_compression(ctx, i, &compression);
    if (!rv)
        rv = exr_get_data_window(ctx, i, &data);
    if (!rv)
        rv = exr_get_display_window(ctx, i, &display);
    if (!rv)
        rv = exr_get_pixel_aspect_ratio(ctx, i, &part->pixel_aspect);
    if (!rv)
        rv = exr_get_screen_window_center(ctx, i, &center);
    if (!rv)
        rv = exr_get_screen_window_width(ctx, i, &part->screen_width);
    if (!rv)
        rv = exr_get_attribute_count(ctx, i, &n_attrs);
    if (!rv)
        rv = read_channels(file, i, part);
    part->deep = storage == EXR_STORAGE_DEEP_SCANLINE || storage == EXR_STORAGE_DEEP_TILED;
    part->tiled = storage == EXR_STORAGE_TILED || storage == EXR_STORAGE_DEEP_TILED;
    if (!rv && part->tiled)
        rv = read_tiling(file, i, part);
    part->name = exr_get_name(ctx, i, &name) == EXR_ERR_SUCCESS && name ? name : "";
    part->compression = (rl_exr_compression)compression;
    part->data_window = box_from(data);
    part->display_window = box_from(display);
    part->width = data.max.x - data.min.x + 1; /* the core refuses coordinates beyond ±2^30 */
    part->height = data.max.y - data.min.y + 1;
    part->screen_center[0] = center.x;
    part->screen_center[1] = center.y;
    part->n_attrs = (size_t)n_attrs;
    return rv;
}

static rl_code check_size(const rl_exr *file, const rl_exr_part *part, rl_error *err)
{
    char size[32], limit[32];
    uint64_t bytes = (uint64_t)part->width * (uint64_t)part->height * sizeof(float);
    if (!file->limit || bytes <= file->limit)
        return RL_OK;
    return rl_fail_file(err, RL_E_MEMORY, file->path, "%d x %d pixels take %s a channel, the limit is %s",
                        part->width, part->height, rl_format_bytes(bytes, size),
                        rl_format_bytes(file->limit, limit));
}

static rl_code read_parts(rl_exr *file, rl_error *err)
{
    rl_exr_core_listen();
    exr_result_t rv = exr_get_count(file->ctx, &file->n_parts);
    if (!rv) {
        file->parts = rl_arena_array(&file->arena, (size_t)file->n_parts, sizeof *file->parts);
        if (!file->parts)
            rv = EXR_ERR_OUT_OF_MEMORY;
    }
    for (int i = 0; !rv && i < file->n_parts; i++) {
        rv = read_part(file, i, &file->parts[i]);
        if (!rv && check_size(file, &file->parts[i], err))
            return RL_E_MEMORY;
    }
    return rv ? rl_exr_core_fail(err, file->path, rv, "the header is broken") : RL_OK;
}

rl_code rl_exr_open(const char *path, uint64_t limit, rl_exr **out, rl_error *err)
{
    *out = NULL;
    rl_exr *file = rl_calloc(1, sizeof *file);
    if (!file)
        return rl_fail_memory(err, sizeof *file);
    file->fd = -1;
    file->limit = limit;
    file->path = rl_arena_strdup(&file->arena, path);
    rl_code code = file->path ? RL_OK : rl_fail_memory(err, strlen(path));
    if (!code)
        code = open_file(file, err);
    if (!code)
        code = read_parts(file, err);
    if (code)
        rl_exr_close(&file);
    *out = file;
    return code;
}

void rl_exr_close(rl_exr **file)
{
    rl_exr *f = *file;
    *file = NULL;
    if (!f)
        return;
    if (f->ctx)
        exr_finish(&f->ctx);
    if (f->fd >= 0)
        close(f->fd);
    rl_arena_free(&f->arena);
    rl_free(f);
}

const char *rl_exr_path(const rl_exr *file)
{
    return file->path;
}

int rl_exr_parts(const rl_exr *file)
{
    return file->n_parts;
}

const rl_exr_part *rl_exr_part_at(const rl_exr *file, int part)
{
    return &file->parts[part];
}

int rl_exr_part_named(const rl_exr *file, const char *name)
{
    for (int i = 0; i < file->n_parts; i++)
        if (!strcmp(file->parts[i].name, name))
            return i;
    return -1;
}

const rl_exr_channel *rl_exr_channel_named(const rl_exr_part *part, const char *name)
{
    for (size_t i = 0; i < part->n_channels; i++)
        if (!strcmp(part->channels[i].name, name))
            return &part->channels[i];
    return NULL;
}

static const char *const compression_names[RL_EXR_COMPRESSIONS] = {"none",  "rle", "zips", "zip",  "piz",
                                                                   "pxr24", "b44", "b44a", "dwaa", "dwab"};

const char *rl_exr_compression_name(rl_exr_compression compression)
{
    return (unsigned)compression < RL_EXR_COMPRESSIONS ? compression_names[compression] : "unknown";
}

int rl_exr_compression_named(const char *name)
{
    for (int i = 0; i < RL_EXR_COMPRESSIONS; i++)
        if (!strcasecmp(compression_names[i], name))
            return i;
    return -1;
}

const char *rl_exr_pixel_name(rl_exr_pixel type)
{
    static const char *const names[] = {"uint", "half", "float"};
    return (unsigned)type < 3 ? names[type] : "unknown";
}
