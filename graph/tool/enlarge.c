#include "graph/tool/enlarge.h"

#include <string.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/run/exr.h"

/* One channel at both sizes. */
typedef struct channel {
    void *from, *to; /* floats, or ids */
} channel;

static void stretch(const uint32_t *from, int w, int h, uint32_t *to, int width, int height)
{
    for (int y = 0; y < height; y++) {
        const uint32_t *row = from + (size_t)((long long)y * h / height) * (size_t)w;
        for (int x = 0; x < width; x++)
            to[(size_t)y * (size_t)width + (size_t)x] = row[(long long)x * w / width];
    }
}

/* The windows become (0, 0) - (width - 1, height - 1); attributes other than those of pixels stay. */
static rl_code write_frame(const rl_exr *file, const channel *channels, int width, int height,
                           const char *path, rl_pool *pool, rl_error *err)
{
    static const char *const all[] = {"*"};
    const rl_exr_part *part = rl_exr_part_at(file, 0);
    rl_exr_source *sources = rl_calloc(part->n_channels, sizeof *sources);
    if (!sources)
        return rl_fail_memory(err, part->n_channels * sizeof *sources);
    for (size_t c = 0; c < part->n_channels; c++) {
        bool ids = part->channels[c].type == RL_EXR_UINT;
        sources[c] = (rl_exr_source){.name = part->channels[c].name,
                                     .type = part->channels[c].type,
                                     .floats = ids ? NULL : channels[c].to,
                                     .ids = ids ? channels[c].to : NULL,
                                     .stride = (size_t)width};
    }
    rl_exr_box box = {0, 0, width - 1, height - 1};
    rl_exr_image image = {.data_window = box,
                          .display_window = box,
                          .channels = sources,
                          .n_channels = part->n_channels,
                          .compression = part->compression,
                          .pixel_aspect = part->pixel_aspect,
                          .screen_width = part->screen_width,
                          .screen_center = {part->screen_center[0], part->screen_center[1]},
                          .copy_from = file,
                          .copy = all,
                          .n_copy = 1};
    rl_code code = rl_exr_write(path, &image, pool, NULL, err);
    rl_free(sources);
    return code;
}

static rl_code read_channels(const rl_exr *file, channel *channels, rl_pool *pool, rl_error *err)
{
    const rl_exr_part *part = rl_exr_part_at(file, 0);
    rl_exr_plane *planes = rl_calloc(part->n_channels, sizeof *planes);
    if (!planes)
        return rl_fail_memory(err, part->n_channels * sizeof *planes);
    for (size_t c = 0; c < part->n_channels; c++) {
        bool ids = part->channels[c].type == RL_EXR_UINT;
        planes[c] = (rl_exr_plane){.channel = part->channels[c].name,
                                   .floats = ids ? NULL : channels[c].from,
                                   .ids = ids ? channels[c].from : NULL,
                                   .stride = (size_t)part->width,
                                   .replace_inf = true,
                                   .inf_value = 1e30f};
    }
    rl_code code = rl_exr_read(file, 0, planes, part->n_channels, NULL, pool, err);
    rl_free(planes);
    return code;
}

static rl_code enlarge_file(const char *from, const char *to, int width, int height, rl_pool *pool,
                            rl_error *err)
{
    rl_exr *file = NULL;
    channel *channels = NULL;
    size_t n = 0;
    rl_code code = rl_exr_open(from, 0, &file, err);
    if (!code && rl_exr_parts(file) != 1)
        code = rl_fail_file(err, RL_E_USAGE, from,
                            "has several parts: bench --size takes captures of one part a file");
    const rl_exr_part *part = code ? NULL : rl_exr_part_at(file, 0);
    if (!code) {
        n = part->n_channels;
        channels = rl_calloc(n, sizeof *channels);
        code = channels ? RL_OK : rl_fail_memory(err, n * sizeof *channels);
    }
    for (size_t c = 0; c < n && !code; c++) {
        channels[c].from = rl_malloc(4 * (size_t)part->width * (size_t)part->height);
        channels[c].to = rl_malloc(4 * (size_t)width * (size_t)height);
        if (!channels[c].from || !channels[c].to)
            code = rl_fail_memory(err, 4 * (size_t)width * (size_t)height);
    }
    if (!code)
        code = read_channels(file, channels, pool, err);
    for (size_t c = 0; c < n && !code; c++)
        stretch(channels[c].from, part->width, part->height, channels[c].to, width, height);
    if (!code)
        code = write_frame(file, channels, width, height, to, pool, err);
    for (size_t c = 0; c < n && channels; c++) {
        rl_free(channels[c].from);
        rl_free(channels[c].to);
    }
    rl_free(channels);
    rl_exr_close(&file);
    return code;
}

/* The same manifest, of other files. */
static rl_code write_manifest(rl_arena *arena, const rl_manifest *manifest, const char *folder, size_t frames,
                              const char **path, rl_error *err)
{
    rl_manifest m = *manifest;
    rl_pattern pattern = manifest->patterns[0];
    rl_str text = {0};
    pattern.path = "bench.####.exr";
    pattern.numbered = true;
    m.patterns = &pattern;
    m.frames.n = frames;
    rl_manifest_print(&m, &text);
    *path = rl_path_join(arena, folder, "capture.yaml");
    rl_code code = *path && !text.failed ? rl_file_write(*path, rl_str_text(&text), text.length, err)
                                         : rl_fail_memory(err, text.length);
    rl_str_free(&text);
    return code;
}

rl_code rl_enlarge_capture(rl_arena *arena, const rl_manifest *m, const char *folder, int width, int height,
                           size_t frames, rl_pool *pool, const char **path, rl_error *err)
{
    if (m->n_patterns != 1)
        return rl_fail(err, RL_E_USAGE, m->where,
                       "bench --size takes captures of one file a frame, '%s' has %d", m->name,
                       m->n_patterns);
    const rl_layer fake = {.pattern = 0};
    rl_code code = RL_OK;
    frames = frames < m->frames.n ? frames : m->frames.n;
    for (size_t i = 0; i < frames && !code; i++) {
        const char *from = rl_manifest_path(arena, m, &fake, m->frames.numbers[i]);
        char *name = rl_arena_printf(arena, "bench.%04d.exr", m->frames.numbers[i]);
        const char *to = name ? rl_path_join(arena, folder, name) : NULL;
        code = from && to ? enlarge_file(from, to, width, height, pool, err) : rl_fail_memory(err, 1);
    }
    return code ? code : write_manifest(arena, m, folder, frames, path, err);
}
