#include "graph/tool/capture.h"

#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/run/data_files.h"
#include "graph/tool/cryptomatte.h"

static bool is_yaml(const char *path)
{
    const char *extension = rl_path_extension(path);
    return !strcmp(extension, ".yaml") || !strcmp(extension, ".yml");
}

char *rl_capture_first(rl_arena *arena, const rl_manifest *m, int pattern)
{
    const rl_layer any = {.pattern = pattern};
    return rl_manifest_path(arena, m, &any, m->frames.n ? m->frames.numbers[0] : 1);
}

rl_code rl_capture_channels(rl_arena *arena, const rl_exr *file, rl_channel **out, size_t *n, rl_error *err)
{
    size_t room = 0;
    *n = 0;
    for (int p = 0; p < rl_exr_parts(file); p++)
        room += rl_exr_part_at(file, p)->n_channels;
    *out = rl_arena_array(arena, room + 1, sizeof **out);
    if (!*out)
        return rl_fail_memory(err, room * sizeof **out);
    for (int p = 0; p < rl_exr_parts(file); p++) {
        const rl_exr_part *part = rl_exr_part_at(file, p);
        for (size_t i = 0; i < part->n_channels && !part->deep; i++)
            if (part->channels[i].x_sampling == 1 && part->channels[i].y_sampling == 1)
                (*out)[(*n)++] = (rl_channel){part->name, part->channels[i].name};
    }
    return RL_OK;
}

/* Without a manifest: the preset that fits the first file's channels. */
static rl_code find_bare(rl_arena *arena, const char *path, const char *presets, const rl_log *log,
                         rl_capture *out, rl_error *err)
{
    rl_exr *file = NULL;
    rl_channel *channels = NULL;
    size_t n = 0;
    rl_preset_match match = {0};
    char *first = NULL;
    rl_code code = rl_manifest_bare(arena, path, NULL, presets, NULL, &out->manifest, err);
    if (!code && !(first = rl_capture_first(arena, out->manifest, 0)))
        code = rl_fail_memory(err, strlen(path));
    if (!code)
        code = rl_exr_open(first, 0, &file, err);
    if (!code)
        code = rl_capture_channels(arena, file, &channels, &n, err);
    if (!code)
        code = rl_preset_find(arena, presets, channels, n, &match, err);
    if (code)
        goto done;
    out->preset = match.name;
    out->missing = !match.name ? "every layer" : match.missing_required ? match.missing : NULL;
    if (!out->missing)
        code = rl_manifest_bare(arena, path, match.name, presets, log, &out->manifest, err);
    if (!code && !out->missing)
        code = rl_manifest_bind(arena, out->manifest, 0, first, channels, n, err);
    if (!code && !out->missing)
        rl_capture_name_ids(arena, out->manifest,
                            &(rl_error){0}); /* names are no must: a run says what is wrong */
done:
    rl_exr_close(&file);
    return code;
}

rl_code rl_capture_find(rl_arena *arena, const char *path, const rl_log *log, rl_capture *out, rl_error *err)
{
    const char *presets = rl_data_path(arena, "presets");
    *out = (rl_capture){0};
    if (!rl_path_is_folder(path) && !is_yaml(path)) {
        if (!presets)
            return rl_fail_file(
                err, RL_E_IO, path,
                "a bare EXR needs relit's presets, which are not found; set $RELIT_DATA to the "
                "folder that holds presets/, or write a capture.yaml");
        return find_bare(arena, path, presets, log, out, err);
    }
    out->file = is_yaml(path) ? path : rl_path_join(arena, path, "capture.yaml");
    if (!out->file)
        return rl_fail_memory(err, strlen(path));
    return rl_manifest_load(arena, path, presets, log, &out->manifest, err);
}

/* ---- stencil ---------------------------------------------------------------------------------------------
 */

/* The part that holds a layer's first channel, or -1. */
static int part_of(const rl_exr *file, const rl_layer *layer)
{
    if (layer->part)
        return rl_exr_part_named(file, layer->part);
    for (int p = 0; p < rl_exr_parts(file); p++)
        if (rl_exr_channel_named(rl_exr_part_at(file, p), layer->channels[0]))
            return p;
    return -1;
}

static int by_id(const void *a, const void *b)
{
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

static rl_code read_ids(const rl_exr *file, const rl_layer *layer, uint32_t **out, size_t *pixels,
                        rl_error *err)
{
    int part = part_of(file, layer);
    if (part < 0)
        return rl_fail_file(err, RL_E_FORMAT, rl_exr_path(file), "layer 'stencil' needs channel '%s'",
                            layer->channels[0]);
    const rl_exr_part *p = rl_exr_part_at(file, part);
    *pixels = (size_t)p->width * (size_t)p->height;
    *out = rl_calloc(*pixels, sizeof **out);
    if (!*out)
        return rl_fail_memory(err, *pixels * sizeof **out);
    rl_exr_plane plane = {
        .channel = layer->channels[0], .ids = *out, .bits = layer->hashed, .stride = (size_t)p->width};
    return rl_exr_read(file, part, &plane, 1, NULL, NULL, err);
}

rl_code rl_capture_ids(rl_arena *arena, const rl_manifest *m, size_t most, uint32_t *out, size_t *n,
                       rl_error *err)
{
    const rl_layer *layer = rl_manifest_layer(m, "stencil");
    rl_exr *file = NULL;
    uint32_t *ids = NULL;
    size_t pixels = 0;
    *n = 0;
    if (!layer)
        return RL_OK;
    if (!layer->n_channels && most) {
        out[(*n)++] = layer->constant;
        return RL_OK;
    }
    char *path = rl_capture_first(arena, m, layer->pattern);
    rl_code code = path ? rl_exr_open(path, 0, &file, err) : rl_fail_memory(err, 1);
    if (!code)
        code = read_ids(file, layer, &ids, &pixels, err);
    if (!code)
        qsort(ids, pixels, sizeof *ids, by_id);
    for (size_t i = 0; !code && i < pixels && *n < most; i++)
        if (ids[i] && (!i || ids[i] != ids[i - 1]))
            out[(*n)++] = ids[i];
    rl_free(ids);
    rl_exr_close(&file);
    return code;
}

rl_code rl_capture_name_ids(rl_arena *arena, rl_manifest *m, rl_error *err)
{
    enum { MOST = 256 };
    const rl_layer *layer = rl_manifest_layer(m, "stencil");
    uint32_t ids[MOST];
    size_t n;
    rl_exr *file = NULL;
    if (!layer || !layer->hashed || m->n_stencil_names)
        return RL_OK;
    char *path = rl_capture_first(arena, m, layer->pattern);
    rl_code code = path ? rl_capture_ids(arena, m, MOST, ids, &n, err) : rl_fail_memory(err, 1);
    if (!code)
        code = rl_exr_open(path, 0, &file, err);
    if (!code)
        code = rl_cryptomatte_names(arena, file, layer->channels[0], ids, n, &m->stencil_names,
                                    &m->n_stencil_names, err);
    rl_exr_close(&file);
    return code;
}
