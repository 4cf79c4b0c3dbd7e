/* A reader of one capture, and the frames that it fills. */
#include "graph/run/reader.h"

#include <math.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/run/camera.h"
#include "graph/run/color.h"
#include "graph/run/reader_parts.h"

/* ---- frames ----------------------------------------------------------------------------------------------
 */

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

/* ---- making ----------------------------------------------------------------------------------------------
 */

static rl_code add_binding(rl_reader *r, const rl_layer *layer, int buffer, int plane, int n, rl_error *err)
{
    if (r->n_bindings == RL_MOST_BINDINGS)
        return rl_fail(err, RL_E_CONFIG, layer->where, "a capture can have at most %d layers",
                       RL_MOST_BINDINGS);
    rl_binding b = {.layer = layer, .buffer = buffer, .plane = plane, .n = n};
    b.is_depth = layer->id == RL_LAYER_DEPTH;
    b.is_stencil = layer->id == RL_LAYER_STENCIL;
    if (layer->colorspace && strcmp(layer->colorspace, r->setup.working)) {
        const char *from;
        rl_code code = rl_color_space(r->setup.ocio, layer->colorspace, layer->colorspace_where, &from, err);
        rl_ocio_request request = {.from = from, .to = r->setup.working};
        if (!code && strcmp(from, r->setup.working))
            code = rl_ocio_transform_new(r->setup.ocio, &request, &b.to_working, err);
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
