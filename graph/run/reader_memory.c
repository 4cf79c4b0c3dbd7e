/* Frames that were never a file. */
#include <math.h>
#include <string.h>

#include "graph/run/camera.h"
#include "graph/run/reader_parts.h"

rl_code rl_reader_memory(rl_reader *r, const rl_frame_data *d, rl_frame *f, rl_error *err)
{
    rl_frame_release(f);
    rl_code code = rl_geometry_make(d->x, d->y, d->width, d->height, &f->geometry, err);
    if (code)
        return code;
    f->data_window = (rl_exr_box){d->x, d->y, d->x + d->width - 1, d->y + d->height - 1};
    f->display_window = d->display[2] > 0
                            ? (rl_exr_box){d->display[0], d->display[1], d->display[0] + d->display[2] - 1,
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
    for (int i = 0; i < 2 && r->setup.manifest->camera.has_shift; i++)
        c.screen_center[i] = r->setup.manifest->camera.shift[i] * c.screen_width;
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

/* Returns how many samples are NaN or, but for those of depths, infinite. */
static uint64_t copy_channel(const rl_channel_data *c, const rl_frame *f, float *to, bool depth)
{
    uint64_t nonfinite = 0;
    for (int y = 0; y < f->geometry.height; y++) {
        const float *in = c->floats + (size_t)y * c->stride;
        float *out = to + (size_t)y * (size_t)f->geometry.stride;
        for (int x = 0; x < f->geometry.width; x++) {
            bool fine = isfinite(in[x]);
            nonfinite += !fine && !(depth && isinf(in[x]));
            out[x] = fine ? in[x] : 0.0f;
        }
    }
    return nonfinite;
}

static rl_code copy_layer(rl_reader *r, int binding, const rl_frame_data *d, rl_frame *f, rl_frame_maps *maps,
                          rl_error *err)
{
    const rl_binding *b = &r->bindings[binding];
    const bool depth = b->layer->id == RL_LAYER_DEPTH || b->layer->id == RL_LAYER_BACK_DEPTH;
    uint64_t nonfinite = 0;
    for (int k = 0; k < b->layer->n_channels; k++) {
        const rl_channel_data *c = find_channel(d, b->layer->channels[k]);
        if (!c || (b->is_stencil ? !c->ids : !c->floats))
            return rl_fail(err, RL_E_DATA, RL_NOWHERE,
                           "layer '%s' needs channel '%s' as %s, which the frame in memory does not have",
                           b->layer->name, b->layer->channels[k], b->is_stencil ? "ids" : "floats");
        if (!b->is_stencil) {
            nonfinite += copy_channel(c, f, maps->base[binding][k], depth);
            continue;
        }
        for (int y = 0; y < f->geometry.height; y++)
            memcpy(maps->base[binding][k] + (size_t)y * (size_t)f->geometry.stride,
                   c->ids + (size_t)y * c->stride, (size_t)f->geometry.width * sizeof *c->ids);
    }
    rl_reader_count_nonfinite(r, f, binding, nonfinite, "memory");
    return RL_OK;
}

rl_code rl_reader_memory_pixels(rl_reader *r, const rl_frame_data *d, rl_frame *f, rl_pool *pool,
                                rl_error *err)
{
    rl_frame_maps maps = {0};
    pthread_mutex_init(&maps.mutex, NULL);
    f->nonfinite = 0;
    rl_code code = rl_reader_prepare_ids(r, f, err);
    if (!code)
        code = rl_reader_map(r, f, &maps, err);
    for (int i = 0; i < r->n_bindings && !code; i++) {
        code = copy_layer(r, i, d, f, &maps, err);
        if (!code)
            rl_reader_convert_all(r, f, &maps, i, pool);
    }
    return rl_reader_finish(r, f, &maps, code, err);
}
