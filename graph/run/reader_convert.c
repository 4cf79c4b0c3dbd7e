/* Layers from the file's conventions to relit's, rows at a time. */
#include <string.h>

#include "graph/run/reader_parts.h"

static void convert_colour(rl_frame_maps *maps, const rl_binding *b, float *const p[3], rl_rows rows)
{
    for (int y = rows.y0; y < rows.y1 && b->to_working; y++) {
        size_t at = (size_t)y * rows.stride;
        rl_error err = {0};
        if (rl_ocio_apply(b->to_working, p[0] + at, p[1] + at, p[2] + at, (size_t)rows.width, &err)) {
            pthread_mutex_lock(&maps->mutex);
            if (!maps->error.code)
                maps->error = err;
            pthread_mutex_unlock(&maps->mutex);
            return;
        }
    }
}

static uint64_t clamp_planes(float *const p[3], int n, rl_rows rows, float low, float high)
{
    uint64_t clamped = 0;
    for (int i = 0; i < n; i++)
        clamped += rl_ingest_scalar(p[i], rows, 1, 0, low, high);
    return clamped;
}

static void convert_depth(const rl_frame *f, const rl_layer *layer, float *p, rl_rows rows)
{
    rl_ingest_depth how = {
        .layer = layer, .camera = &f->camera, .x = f->data_window.x0, .y = f->data_window.y0};
    rl_ingest_depth_rows(p, rows, &how);
}

static void convert_normal(const rl_reader *r, const rl_frame *f, const rl_layer *layer, float *const p[3],
                           rl_rows rows)
{
    float m[9];
    bool forward_z = r->setup.manifest->camera.forward_z;
    rl_ingest_normal how = {.encoding = layer->encoding,
                            .rotate = rl_ingest_normal_matrix(layer, &f->camera, forward_z, m)};
    rl_ingest_normal_rows(p, rows, &how);
}

static void convert_stencil(const rl_reader *r, rl_frame *f, rl_frame_maps *maps, uint32_t *p, rl_rows rows)
{
    rl_unknown_ids unknown = {0};
    const rl_layer *layer = r->bindings[r->stencil].layer;
    for (int y = rows.y0; y < rows.y1 && !layer->n_channels; y++)
        for (int x = 0; x < rows.width; x++)
            p[(size_t)y * rows.stride + (size_t)x] = layer->constant;
    for (int y = rows.y0; y < rows.y1 && f->ids; y++)
        memcpy(f->ids + (size_t)y * (size_t)rows.width, p + (size_t)y * rows.stride,
               (size_t)rows.width * sizeof *p);
    rl_ingest_stencil_rows(p, maps->base[r->depth][0], rows, r->setup.materials, &unknown);
    if (unknown.pixels) {
        pthread_mutex_lock(&maps->mutex);
        rl_unknown_ids_add(&maps->unknown, &unknown);
        pthread_mutex_unlock(&maps->mutex);
    }
}

/* Lengths and curvature: the file's unit, or 0…1 remapped to a range of it. */
static void convert_length(const rl_layer *layer, float *p, rl_rows rows, float low)
{
    double span = layer->remapped ? layer->remap[1] - layer->remap[0] : 1;
    double start = layer->remapped ? layer->remap[0] : 0;
    rl_ingest_scalar(p, rows, (float)(span * layer->scale), (float)(start * layer->scale), low, 3.4e38f);
}

void rl_reader_convert(rl_reader *r, rl_frame *f, rl_frame_maps *maps, int binding, int y0, int y1)
{
    const rl_binding *b = &r->bindings[binding];
    float *const *p = maps->base[binding];
    rl_rows rows = {.width = f->geometry.width, .y0 = y0, .y1 = y1, .stride = (size_t)f->geometry.stride};
    int w = f->display_window.x1 - f->display_window.x0 + 1,
        h = f->display_window.y1 - f->display_window.y0 + 1;
    uint64_t clamped = 0;
    switch (b->layer->id) {
    case RL_LAYER_ALBEDO:
    case RL_LAYER_BACK_ALBEDO:
        convert_colour(maps, b, p, rows);
        clamped = clamp_planes(p, 3, rows, 0, 1);
        break;
    case RL_LAYER_EMISSION:
        convert_colour(maps, b, p, rows);
        break;
    case RL_LAYER_NORMAL:
    case RL_LAYER_BACK_NORMAL:
        convert_normal(r, f, b->layer, p, rows);
        break;
    case RL_LAYER_DEPTH:
    case RL_LAYER_BACK_DEPTH:
        convert_depth(f, b->layer, p[0], rows);
        break;
    case RL_LAYER_STENCIL:
        convert_stencil(r, f, maps, (uint32_t *)(void *)p[0], rows);
        break;
    case RL_LAYER_THICKNESS:
    case RL_LAYER_SHADOW_THICKNESS:
        convert_length(b->layer, p[0], rows, 0);
        break;
    case RL_LAYER_CURVATURE:
        convert_length(b->layer, p[0], rows, -3.4e38f);
        break;
    case RL_LAYER_MOTION:
        rl_ingest_motion_rows(p, rows, b->layer, w, h);
        break;
    case RL_LAYER_SHADOW:
    case RL_LAYER_ROUGHNESS:
    case RL_LAYER_SPECULAR:
    case RL_LAYER_METALLIC:
        clamped = clamp_planes(p, 1, rows, 0, 1);
        break;
    case RL_LAYER_COUNT:
        break;
    }
    if (clamped) {
        pthread_mutex_lock(&maps->mutex);
        maps->clamped += clamped;
        pthread_mutex_unlock(&maps->mutex);
    }
}

rl_code rl_reader_check_ids(const rl_reader *r, const rl_frame *f, const rl_frame_maps *maps, rl_error *err)
{
    const rl_unknown_ids *u = &maps->unknown;
    if (!u->pixels)
        return RL_OK;
    rl_str text = {0};
    for (size_t i = 0; i < u->n; i++) {
        const char *name = rl_manifest_stencil_name(r->setup.manifest, u->ids[i].id);
        rl_str_printf(&text, "%s%u%s%s%s (%llu pixel%s)", i ? ", " : "", u->ids[i].id, name ? " '" : "",
                      name ? name : "", name ? "'" : "", (unsigned long long)u->ids[i].pixels,
                      u->ids[i].pixels == 1 ? "" : "s");
    }
    rl_code code =
        rl_fail_file(err, RL_E_DATA, f->files[f->main_file] ? rl_exr_path(f->files[f->main_file]) : "memory",
                     "frame %d: no material covers stencil id %s; add a material with 'stencil:', or "
                     "'default: {}' for the rest",
                     f->number, rl_str_text(&text));
    rl_str_free(&text);
    return code;
}
