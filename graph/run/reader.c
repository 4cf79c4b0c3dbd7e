#include "graph/run/reader.h"

#include <math.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/run/camera.h"
#include "graph/run/reader_parts.h"

/* ---- frames ---------------------------------------------------------------------------------------------- */

void rl_frame_release(rl_frame *f)
{
    for (int i = 0; i < RL_MOST_FILES; i++)
        rl_exr_close(&f->files[i]);
}

void rl_frame_free(rl_frame *f)
{
    rl_frame_release(f);
    rl_frame_buffers_free(&f->buffers);
    rl_free(f->ids);
    *f = (rl_frame){0};
}

/* ---- making ---------------------------------------------------------------------------------------------- */

static rl_code add_binding(rl_reader *r, const rl_layer *layer, int buffer, int plane, int n, rl_error *err)
{
    if (r->n_bindings == RL_MOST_BINDINGS)
        return rl_fail(err, RL_E_CONFIG, layer->where, "a capture can have at most %d layers", RL_MOST_BINDINGS);
    rl_binding b = {.layer = layer, .buffer = buffer, .plane = plane, .n = n};
    b.is_depth = layer->id == RL_LAYER_DEPTH;
    b.is_stencil = layer->id == RL_LAYER_STENCIL;
    if (layer->colorspace && strcmp(layer->colorspace, r->setup.working)) {
        const char *from = rl_ocio_space(r->setup.ocio, layer->colorspace);
        rl_ocio_request request = {.from = layer->colorspace, .to = r->setup.working};
        rl_code code = from && !strcmp(from, r->setup.working)
                           ? RL_OK
                           : rl_ocio_transform_new(r->setup.ocio, &request, &b.to_working, err);
        if (code)
            return code;
    }
    r->bindings[r->n_bindings++] = b;
    return RL_OK;
}

/* The layers behind a SOURCE buffer: one, or one a light. */
static rl_code bind_buffer(rl_reader *r, int buffer, rl_error *err)
{
    const rl_image *image = &r->setup.plan->graph->images[r->setup.plan->buffers[buffer].image];
    const char *name = image->name + strlen("capture.");
    if (image->format == RL_LIGHTS) {
        const rl_light_planes *p = !strcmp(name, "shadow") ? &r->setup.shadow : &r->setup.shadow_thickness;
        rl_code code = RL_OK;
        for (int i = 0; i < p->n && !code; i++)
            code = add_binding(r, p->layers[i], buffer, i, 1, err);
        return code;
    }
    const rl_layer *layer = rl_manifest_layer(r->setup.manifest, name);
    if (!layer)
        return rl_fail(err, RL_E_INTERNAL, RL_NOWHERE, "the capture has no layer '%s'", name);
    return add_binding(r, layer, buffer, 0, image->planes, err);
}

rl_code rl_reader_new(const rl_reader_setup *setup, rl_reader **out, rl_error *err)
{
    *out = NULL;
    rl_reader *r = rl_calloc(1, sizeof *r);
    if (!r)
        return rl_fail_memory(err, sizeof *r);
    r->setup = *setup;
    r->depth = r->stencil = -1;
    rl_code code = RL_OK;
    for (int pass = 0; pass < 2; pass++) { /* depth before all others */
        for (size_t i = 0; i < setup->plan->n_buffers && !code; i++) {
            const rl_buffer *b = &setup->plan->buffers[i];
            bool depth = b->image >= 0 && !strcmp(b->name, "capture.depth");
            if (b->kind == RL_BUFFER_SOURCE && depth == (pass == 0))
                code = bind_buffer(r, (int)i, err);
        }
    }
    for (int i = 0; i < r->n_bindings; i++) {
        r->depth = r->bindings[i].is_depth ? i : r->depth;
        r->stencil = r->bindings[i].is_stencil ? i : r->stencil;
    }
    if (!code && (r->depth < 0 || r->stencil < 0))
        code = rl_fail(err, RL_E_INTERNAL, RL_NOWHERE, "depth and stencil must always be read");
    if (code)
        rl_reader_free(&r);
    *out = r;
    return code;
}

void rl_reader_free(rl_reader **reader)
{
    rl_reader *r = *reader;
    *reader = NULL;
    for (int i = 0; r && i < r->n_bindings; i++)
        rl_ocio_transform_free(&r->bindings[i].to_working);
    rl_free(r);
}

/* ---- finding channels ------------------------------------------------------------------------------------ */

static rl_code missing_channel(const rl_layer *layer, const rl_exr *file, const char *channel, rl_error *err)
{
    rl_str text = {0};
    for (int p = 0; p < rl_exr_parts(file); p++) {
        const rl_exr_part *part = rl_exr_part_at(file, p);
        for (size_t i = 0; i < part->n_channels && text.length < 600; i++)
            rl_str_printf(&text, " %s%s%s", rl_exr_parts(file) > 1 ? part->name : "",
                          rl_exr_parts(file) > 1 ? ":" : "", part->channels[i].name);
    }
    rl_code code = rl_fail_file(err, RL_E_FORMAT, rl_exr_path(file),
                                "layer '%s' needs channel '%s'; the file has:%s (set layers.%s in capture.yaml)",
                                layer->name, channel, rl_str_text(&text), layer->name);
    rl_str_free(&text);
    return code;
}

/* The part that holds all channels of a layer. */
static rl_code find_part(const rl_layer *layer, const rl_exr *file, int *out, rl_error *err)
{
    int first = layer->part ? rl_exr_part_named(file, layer->part) : 0;
    if (first < 0)
        return rl_fail_file(err, RL_E_FORMAT, rl_exr_path(file), "layer '%s' needs part '%s', which the file does not have",
                            layer->name, layer->part);
    const char *missing = layer->channels[0];
    for (int p = first; p < (layer->part ? first + 1 : rl_exr_parts(file)); p++) {
        int have = 0;
        for (; have < layer->n_channels; have++)
            if (!rl_exr_channel_named(rl_exr_part_at(file, p), layer->channels[have]))
                break;
        if (have == layer->n_channels) {
            *out = p;
            return RL_OK;
        }
        missing = have > 0 ? layer->channels[have] : missing;
    }
    return missing_channel(layer, file, missing, err);
}

/* ---- headers --------------------------------------------------------------------------------------------- */

static bool number_attr(const rl_exr *file, int part, const char *name, int n, double *out)
{
    rl_exr_value v;
    if (!rl_exr_attr(file, part, name, &v) || rl_exr_type_numbers(v.type) != n)
        return false;
    memcpy(out, v.v, (size_t)n * sizeof *out);
    return true;
}

static void read_lens(rl_reader *r, const rl_frame *f, int file_number, rl_camera_info *c)
{
    const rl_exr *file = f->files[f->main_file];
    const rl_exr_part *part = rl_exr_part_at(file, f->main_part);
    const double *fov = rl_manifest_fov_x(r->setup.manifest, file_number);
    const double *jitter = rl_manifest_jitter(r->setup.manifest, file_number);
    c->screen_width = (double)part->screen_width;
    c->screen_center[0] = (double)part->screen_center[0];
    c->screen_center[1] = (double)part->screen_center[1];
    c->pixel_aspect = (double)part->pixel_aspect;
    if (fov) {
        c->fov_x = *fov;
    } else if (!number_attr(file, f->main_part, "camera:fovx", 1, &c->fov_x) && !r->said_window) {
        r->said_window = true;
        rl_report(r->setup.log, c->screen_width == 1 ? RL_WARNING : RL_VERBOSE, (rl_where){.file = rl_exr_path(file)},
                  "no attribute camera:fovx: the field of view is taken from screenWindowWidth %g%s", c->screen_width,
                  c->screen_width == 1 ? ", which writers leave at 1 when they do not know it (set camera.fov_x in the manifest)"
                                       : "");
    }
    if (jitter) {
        memcpy(c->jitter, jitter, sizeof c->jitter);
    } else if (!number_attr(file, f->main_part, "camera:jitter", 2, c->jitter) && !r->said_jitter) {
        r->said_jitter = true;
        rl_report(r->setup.log, RL_VERBOSE, (rl_where){.file = rl_exr_path(file)},
                  "no attribute camera:jitter: samples lie at the pixels' centres");
    }
}

static rl_code read_camera(rl_reader *r, rl_frame *f, int file_number, rl_error *err)
{
    const rl_exr *file = f->files[f->main_file];
    double header[16];
    float header_f[16];
    bool has = number_attr(file, f->main_part, "worldToCamera", 16, header);
    for (int i = 0; i < 16 && has; i++)
        header_f[i] = (float)header[i];
    rl_camera_info c = {.display = {f->display_window.x0, f->display_window.y0,
                                    f->display_window.x1 - f->display_window.x0 + 1,
                                    f->display_window.y1 - f->display_window.y0 + 1}};
    rl_error inner = {0};
    rl_code code = rl_manifest_view(r->setup.manifest, file_number, has ? header_f : NULL, c.view, &inner);
    if (!code) {
        read_lens(r, f, file_number, &c);
        code = rl_camera_make(&c, &f->camera, &inner);
    }
    if (code)
        return rl_fail(err, code, (rl_where){inner.file[0] ? inner.file : rl_exr_path(file), inner.line, inner.column}, "%s",
                       inner.text);
    return RL_OK;
}

static bool same_box(rl_exr_box a, rl_exr_box b)
{
    return a.x0 == b.x0 && a.y0 == b.y0 && a.x1 == b.x1 && a.y1 == b.y1;
}

/* Every wanted layer has its channels, and all have one size. */
static rl_code check_layers(rl_reader *r, rl_frame *f, rl_error *err)
{
    rl_exr_box window = f->data_window;
    for (int i = 0; i < r->n_bindings; i++) {
        const rl_layer *layer = r->bindings[i].layer;
        const rl_exr *file = f->files[layer->pattern];
        int part = 0;
        rl_code code = find_part(layer, file, &part, err);
        if (code)
            return code;
        rl_exr_box w = rl_exr_part_at(file, part)->data_window;
        if (!same_box(w, window))
            return rl_fail_file(err, RL_E_FORMAT, rl_exr_path(file),
                                "layer '%s' has the data window (%d, %d) - (%d, %d), layer 'depth' (%d, %d) - (%d, %d): all "
                                "layers of a frame must have one size",
                                layer->name, w.x0, w.y0, w.x1, w.y1, window.x0, window.y0, window.x1, window.y1);
    }
    return RL_OK;
}

static rl_code open_files(rl_reader *r, int file_number, rl_frame *f, rl_error *err)
{
    rl_code code = RL_OK;
    rl_arena arena = {0};
    for (int i = 0; i < r->n_bindings && !code; i++) {
        const rl_layer *layer = r->bindings[i].layer;
        if (layer->pattern >= RL_MOST_FILES)
            code = rl_fail(err, RL_E_CONFIG, layer->where, "a capture can have at most %d files a frame", RL_MOST_FILES);
        else if (!f->files[layer->pattern]) {
            const char *path = rl_manifest_path(&arena, r->setup.manifest, layer, file_number);
            code = path ? rl_exr_open(path, r->setup.limit, &f->files[layer->pattern], err) : rl_fail_memory(err, 1);
        }
    }
    rl_arena_free(&arena);
    return code;
}

rl_code rl_reader_open(rl_reader *r, int file_number, rl_frame *f, rl_error *err)
{
    rl_frame_release(f);
    if (r->setup.manifest->n_patterns == 0)
        return rl_fail(err, RL_E_CONFIG, r->setup.manifest->where,
                       "capture '%s' has 'files: memory': its frames must come through the C API",
                       r->setup.manifest->name);
    rl_code code = open_files(r, file_number, f, err);
    const rl_layer *depth = r->bindings[r->depth].layer;
    f->main_file = depth->pattern;
    if (!code)
        code = find_part(depth, f->files[f->main_file], &f->main_part, err);
    if (code)
        return code;
    const rl_exr_part *part = rl_exr_part_at(f->files[f->main_file], f->main_part);
    f->data_window = part->data_window;
    f->display_window = part->display_window;
    code = check_layers(r, f, err);
    if (!code)
        code = rl_geometry_make(f->data_window.x0, f->data_window.y0, part->width, part->height, &f->geometry, err);
    if (!code)
        code = read_camera(r, f, file_number, err);
    return code;
}

bool rl_reader_missed(rl_code code)
{
    return code == RL_E_IO || code == RL_E_FORMAT;
}

/* ---- pixels ---------------------------------------------------------------------------------------------- */

static rl_code map_planes(rl_reader *r, rl_frame *f, rl_frame_maps *maps, rl_error *err)
{
    const rl_geometry *g = &f->geometry;
    size_t first = RL_GUARD + (size_t)(g->y - g->origin_y) * (size_t)g->stride + (size_t)(g->x - g->origin_x);
    for (int i = 0; i < r->n_bindings; i++) {
        const rl_binding *b = &r->bindings[i];
        void *p;
        rl_code code = rl_memory_map(rl_frame_buffers_memory(f->buffers, b->buffer), true, &p, err);
        if (code)
            return code;
        for (int k = 0; k < 3; k++)
            maps->base[i][k] = k < b->n ? (float *)p + first + (size_t)(b->plane + k) * (size_t)g->plane : NULL;
    }
    return RL_OK;
}

static rl_code unmap_planes(rl_reader *r, rl_frame *f, const rl_frame_maps *maps, rl_error *err)
{
    rl_code code = RL_OK;
    for (int i = 0; i < r->n_bindings; i++) {
        if (!maps->base[i][0])
            continue;
        rl_code one = rl_memory_unmap(rl_frame_buffers_memory(f->buffers, r->bindings[i].buffer), code ? NULL : err);
        code = code ? code : one;
    }
    return code;
}

static rl_code prepare_ids(rl_reader *r, rl_frame *f, rl_error *err)
{
    size_t pixels = (size_t)f->geometry.width * (size_t)f->geometry.height;
    if (!r->setup.keep_ids || pixels <= f->ids_room)
        return RL_OK;
    rl_free(f->ids);
    f->ids = rl_malloc(pixels * sizeof *f->ids);
    f->ids_room = f->ids ? pixels : 0;
    return f->ids ? RL_OK : rl_fail_memory(err, pixels * sizeof *f->ids);
}

/* One call of rl_exr_read: the layers of one part of one file. */
typedef struct group {
    rl_reader *r;
    rl_frame *f;
    rl_frame_maps *maps;
    int file, part;
    bool stencil_too; /* depth is here as well, so that the stencil can be converted at once */
    int members[RL_MOST_BINDINGS], n;
} group;

static void convert_group(void *ctx, int part, int y0, int y1)
{
    const group *g = ctx;
    (void)part;
    for (int i = 0; i < g->n; i++)
        if (!g->r->bindings[g->members[i]].is_stencil || g->stencil_too)
            rl_reader_convert(g->r, g->f, g->maps, g->members[i], y0, y1);
}

static rl_code read_group(group *g, rl_pool *pool, rl_error *err)
{
    rl_exr_plane planes[RL_MOST_BINDINGS * 3];
    size_t n = 0;
    for (int i = 0; i < g->n; i++) {
        const rl_binding *b = &g->r->bindings[g->members[i]];
        bool depth = b->layer->id == RL_LAYER_DEPTH || b->layer->id == RL_LAYER_BACK_DEPTH;
        for (int k = 0; k < b->layer->n_channels; k++) {
            float *p = g->maps->base[g->members[i]][k];
            rl_exr_plane plane = {.channel = b->layer->channels[k], .stride = (size_t)g->f->geometry.stride};
            if (b->is_stencil)
                plane.ids = (uint32_t *)(void *)p;
            else
                plane.floats = p;
            plane.replace_inf = depth; /* renderers write infinity where nothing is hit */
            planes[n++] = plane;
        }
    }
    rl_exr_rows rows = {convert_group, g};
    rl_code code = rl_exr_read(g->f->files[g->file], g->part, planes, n, &rows, pool, err);
    for (size_t i = 0; i < n; i++)
        g->f->nonfinite += planes[i].nonfinite;
    return code;
}

static rl_code collect_group(rl_reader *r, rl_frame *f, bool *done, int first, group *g, rl_error *err)
{
    g->n = 0;
    g->stencil_too = false;
    g->file = r->bindings[first].layer->pattern;
    rl_code code = find_part(r->bindings[first].layer, f->files[g->file], &g->part, err);
    for (int i = first; i < r->n_bindings && !code; i++) {
        int part = -1;
        if (done[i] || r->bindings[i].layer->pattern != g->file)
            continue;
        code = find_part(r->bindings[i].layer, f->files[g->file], &part, err);
        if (code || part != g->part)
            continue;
        done[i] = true;
        g->members[g->n++] = i;
        g->stencil_too |= r->bindings[i].is_depth;
    }
    return code;
}

static rl_code finish_pixels(rl_reader *r, rl_frame *f, rl_frame_maps *maps, rl_code code, rl_error *err)
{
    rl_code unmapped = unmap_planes(r, f, maps, code ? NULL : err);
    code = code ? code : unmapped;
    f->clamped = maps->clamped;
    pthread_mutex_destroy(&maps->mutex);
    if (!code && maps->error.code) {
        code = maps->error.code;
        *err = maps->error;
    }
    return code ? code : rl_reader_check_ids(r, f, maps, err);
}

typedef struct row_job {
    rl_reader *r;
    rl_frame *f;
    rl_frame_maps *maps;
    int binding, band;
} row_job;

static void convert_band(void *ctx, int i)
{
    const row_job *j = ctx;
    int y0 = i * j->band, y1 = y0 + j->band < j->f->geometry.height ? y0 + j->band : j->f->geometry.height;
    rl_reader_convert(j->r, j->f, j->maps, j->binding, y0, y1);
}

static void convert_whole(rl_reader *r, rl_frame *f, rl_frame_maps *maps, int binding, rl_pool *pool)
{
    row_job job = {r, f, maps, binding, 32};
    rl_pool_for(pool, (f->geometry.height + job.band - 1) / job.band, convert_band, &job);
}

rl_code rl_reader_pixels(rl_reader *r, rl_frame *f, rl_pool *pool, rl_error *err)
{
    rl_frame_maps maps = {0};
    bool done[RL_MOST_BINDINGS] = {0};
    pthread_mutex_init(&maps.mutex, NULL);
    f->nonfinite = 0;
    rl_code code = prepare_ids(r, f, err);
    if (!code)
        code = map_planes(r, f, &maps, err);
    bool stencil_done = false;
    for (int i = 0; i < r->n_bindings && !code; i++) {
        group g = {.r = r, .f = f, .maps = &maps};
        if (done[i])
            continue;
        code = collect_group(r, f, done, i, &g, err);
        if (!code)
            code = read_group(&g, pool, err);
        for (int k = 0; k < g.n; k++)
            stencil_done |= g.stencil_too && r->bindings[g.members[k]].is_stencil;
    }
    if (!code && !stencil_done)
        convert_whole(r, f, &maps, r->stencil, pool);
    return finish_pixels(r, f, &maps, code, err);
}

/* ---- frames in memory ------------------------------------------------------------------------------------ */

rl_code rl_reader_memory(rl_reader *r, const rl_frame_data *d, rl_frame *f, rl_error *err)
{
    rl_frame_release(f);
    rl_code code = rl_geometry_make(d->x, d->y, d->width, d->height, &f->geometry, err);
    if (code)
        return code;
    f->data_window = (rl_exr_box){d->x, d->y, d->x + d->width - 1, d->y + d->height - 1};
    f->display_window = d->display[2] > 0 ? (rl_exr_box){d->display[0], d->display[1], d->display[0] + d->display[2] - 1,
                                                         d->display[1] + d->display[3] - 1}
                                          : f->data_window;
    float header[16];
    for (int i = 0; i < 16; i++) /* as a file would have it: for row vectors */
        header[i] = (float)d->world_to_camera[4 * (i % 4) + i / 4];
    rl_camera_info c = {.fov_x = d->fov_x,
                        .screen_width = 1,
                        .pixel_aspect = 1,
                        .jitter = {d->jitter[0], d->jitter[1]},
                        .display = {f->display_window.x0, f->display_window.y0,
                                    f->display_window.x1 - f->display_window.x0 + 1,
                                    f->display_window.y1 - f->display_window.y0 + 1}};
    code = rl_manifest_view(r->setup.manifest, f->number, header, c.view, err);
    const double *fov = code ? NULL : rl_manifest_fov_x(r->setup.manifest, f->number);
    const double *jitter = code ? NULL : rl_manifest_jitter(r->setup.manifest, f->number);
    if (fov)
        c.fov_x = *fov;
    if (jitter)
        memcpy(c.jitter, jitter, sizeof c.jitter);
    return code ? code : rl_camera_make(&c, &f->camera, err);
}

static const rl_channel_data *find_channel(const rl_frame_data *d, const char *name)
{
    for (size_t i = 0; i < d->n_channels; i++)
        if (!strcmp(d->channels[i].name, name))
            return &d->channels[i];
    return NULL;
}

static void copy_channel(const rl_channel_data *c, rl_frame *f, float *to, bool depth)
{
    for (int y = 0; y < f->geometry.height; y++) {
        const float *in = c->floats + (size_t)y * c->stride;
        float *out = to + (size_t)y * (size_t)f->geometry.stride;
        for (int x = 0; x < f->geometry.width; x++) {
            bool fine = isfinite(in[x]);
            f->nonfinite += !fine && !(depth && isinf(in[x]));
            out[x] = fine ? in[x] : 0.0f;
        }
    }
}

static rl_code copy_layer(const rl_reader *r, int binding, const rl_frame_data *d, rl_frame *f, rl_frame_maps *maps,
                          rl_error *err)
{
    const rl_binding *b = &r->bindings[binding];
    for (int k = 0; k < b->layer->n_channels; k++) {
        const rl_channel_data *c = find_channel(d, b->layer->channels[k]);
        if (!c || (b->is_stencil ? !c->ids : !c->floats))
            return rl_fail(err, RL_E_DATA, RL_NOWHERE, "layer '%s' needs channel '%s' as %s, which the frame in memory does not have",
                           b->layer->name, b->layer->channels[k], b->is_stencil ? "ids" : "floats");
        if (!b->is_stencil) {
            copy_channel(c, f, maps->base[binding][k], b->is_depth);
            continue;
        }
        for (int y = 0; y < f->geometry.height; y++)
            memcpy(maps->base[binding][k] + (size_t)y * (size_t)f->geometry.stride, c->ids + (size_t)y * c->stride,
                   (size_t)f->geometry.width * sizeof *c->ids);
    }
    return RL_OK;
}

rl_code rl_reader_memory_pixels(rl_reader *r, const rl_frame_data *d, rl_frame *f, rl_pool *pool, rl_error *err)
{
    rl_frame_maps maps = {0};
    pthread_mutex_init(&maps.mutex, NULL);
    f->nonfinite = 0;
    rl_code code = prepare_ids(r, f, err);
    if (!code)
        code = map_planes(r, f, &maps, err);
    for (int i = 0; i < r->n_bindings && !code; i++) {
        code = copy_layer(r, i, d, f, &maps, err);
        if (!code)
            convert_whole(r, f, &maps, i, pool);
    }
    return finish_pixels(r, f, &maps, code, err);
}
