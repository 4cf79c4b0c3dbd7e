/* The pixels of a frame from its files: a group of layers is one part of one file, read together. */
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/run/normal_check.h"
#include "graph/run/reader_parts.h"

rl_code rl_reader_map(rl_reader *r, rl_frame *f, rl_frame_maps *maps, rl_error *err)
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
            maps->base[i][k] =
                k < b->n ? (float *)p + first + (size_t)(b->plane + k) * (size_t)g->plane : NULL;
    }
    return RL_OK;
}

static rl_code unmap_planes(rl_reader *r, rl_frame *f, const rl_frame_maps *maps, rl_error *err)
{
    rl_code code = RL_OK;
    for (int i = 0; i < r->n_bindings; i++) {
        if (!maps->base[i][0])
            continue;
        rl_code one =
            rl_memory_unmap(rl_frame_buffers_memory(f->buffers, r->bindings[i].buffer), code ? NULL : err);
        code = code ? code : one;
    }
    return code;
}

rl_code rl_reader_prepare_ids(rl_reader *r, rl_frame *f, rl_error *err)
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

/* Where to look: a layer's first frame that has any. The run's end says how many there were. */
void rl_reader_count_nonfinite(rl_reader *r, rl_frame *f, int binding, uint64_t count, const char *file)
{
    rl_binding *b = &r->bindings[binding];
    f->nonfinite += count;
    if (!count || b->said_nonfinite)
        return;
    b->said_nonfinite = true;
    rl_report(
        r->setup.log, RL_WARNING, (rl_where){.file = file},
        "layer '%s': %llu NaN or infinite sample%s in frame %d, taken for 0; later frames are only counted",
        b->layer->name, (unsigned long long)count, count == 1 ? "" : "s", f->number);
}

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
            plane.bits = b->layer->hashed;
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
    n = 0;
    for (int i = 0; i < g->n; i++) {
        uint64_t count = 0;
        for (int k = 0; k < g->r->bindings[g->members[i]].layer->n_channels; k++)
            count += planes[n++].nonfinite;
        rl_reader_count_nonfinite(g->r, g->f, g->members[i], count, rl_exr_path(g->f->files[g->file]));
    }
    return code;
}

static rl_code collect_group(rl_reader *r, rl_frame *f, bool *done, int first, group *g, rl_error *err)
{
    g->n = 0;
    g->stencil_too = false;
    g->file = r->bindings[first].layer->pattern;
    rl_code code = rl_reader_find_part(r->bindings[first].layer, f->files[g->file], &g->part, err);
    for (int i = first; i < r->n_bindings && !code; i++) {
        int part = -1;
        if (done[i] || r->bindings[i].layer->pattern != g->file || !r->bindings[i].layer->n_channels)
            continue;
        code = rl_reader_find_part(r->bindings[i].layer, f->files[g->file], &part, err);
        if (code || part != g->part)
            continue;
        done[i] = true;
        g->members[g->n++] = i;
        g->stencil_too |= r->bindings[i].is_depth;
    }
    return code;
}

/* A picture of nothing is a wrong layer as a rule. */
static bool is_empty(const rl_frame *f, const float *depth)
{
    for (int y = 0; y < f->geometry.height; y++)
        for (int x = 0; x < f->geometry.width; x++)
            if (depth[(size_t)y * (size_t)f->geometry.stride + (size_t)x] > 0)
                return false;
    return true;
}

/* Whether the capture's conventions can be right, in the first frame that is read. */
static void check_normals(rl_reader *r, const rl_frame *f, const rl_frame_maps *maps)
{
    int normal = -1;
    for (int i = 0; i < r->n_bindings; i++)
        normal = r->bindings[i].layer->id == RL_LAYER_NORMAL ? i : normal;
    if (r->said_normals)
        return;
    if (is_empty(f, maps->base[r->depth][0])) { /* the next frame may tell more */
        if (!r->said_empty)
            rl_report(
                r->setup.log, RL_WARNING, r->bindings[r->depth].layer->where,
                "frame %d: no pixel shows a surface: the depth is nowhere above 0 and below `empty` (where a "
                "file has -z, write layers.depth.negated: true)",
                f->number);
        r->said_empty = true;
        return;
    }
    r->said_normals = true;
    if (normal < 0)
        return;
    rl_normal_view view = {.depth = maps->base[r->depth][0],
                           .stride = (size_t)f->geometry.stride,
                           .width = f->geometry.width,
                           .height = f->geometry.height,
                           .x = f->data_window.x0,
                           .y = f->data_window.y0,
                           .camera = &f->camera};
    const rl_layer *n = r->bindings[normal].layer, *d = r->bindings[r->depth].layer;
    bool forward_z = r->setup.manifest->camera.forward_z;
    rl_normal_check check;
    rl_str text = {0};
    for (int i = 0; i < 3; i++)
        view.normal[i] = maps->base[normal][i];
    rl_normal_check_run(&view, n, d, forward_z, &check);
    if (rl_normal_check_advice(&check, n, d, forward_z, &text) && !text.failed)
        rl_report(r->setup.log, RL_WARNING, n->where, "frame %d: %s", f->number, rl_str_text(&text));
    rl_str_free(&text);
}

rl_code rl_reader_finish(rl_reader *r, rl_frame *f, rl_frame_maps *maps, rl_code code, rl_error *err)
{
    if (!code && !maps->error.code)
        check_normals(r, f, maps);
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

void rl_reader_convert_all(rl_reader *r, rl_frame *f, rl_frame_maps *maps, int binding, rl_pool *pool)
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
    rl_code code = rl_reader_prepare_ids(r, f, err);
    if (!code)
        code = rl_reader_map(r, f, &maps, err);
    bool stencil_done = false;
    for (int i = 0; i < r->n_bindings && !code; i++) {
        group g = {.r = r, .f = f, .maps = &maps};
        if (done[i] || !r->bindings[i].layer->n_channels) /* a constant stencil follows */
            continue;
        code = collect_group(r, f, done, i, &g, err);
        if (!code)
            code = read_group(&g, pool, err);
        for (int k = 0; k < g.n; k++)
            stencil_done |= g.stencil_too && r->bindings[g.members[k]].is_stencil;
    }
    if (!code && !stencil_done)
        rl_reader_convert_all(r, f, &maps, r->stencil, pool);
    return rl_reader_finish(r, f, &maps, code, err);
}
