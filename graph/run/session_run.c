/* A frame through a session: its kernels, its files, and one at a time. */
#include <inttypes.h>
#include <limits.h>
#include <math.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/run/camera.h"
#include "graph/run/session_notes.h"
#include "graph/run/session_state.h"

rl_code rl_session_fit_buffers(rl_sequence *q, rl_frame *f, rl_error *err)
{
    if (f->buffers && !memcmp(rl_frame_buffers_geometry(f->buffers), &f->geometry, sizeof f->geometry))
        return RL_OK;
    rl_frame_buffers_free(&f->buffers);
    return rl_frame_buffers_new(q->executor, &f->geometry, &f->buffers, err);
}

/* A camera that goes away from more than this of what it sees has jumped. */
#define LEAST_SEEN 0.25
/* … and, in a graph without depth, one that moved by more metres. */
#define REACH 10

static int depth_buffer(const rl_plan *p)
{
    for (size_t i = 0; i < p->n_buffers; i++)
        if (p->buffers[i].kind == RL_BUFFER_SOURCE && !strcmp(p->buffers[i].name, "capture.depth"))
            return (int)i;
    return -1;
}

/* A jump is a matter of scale: ten metres are little from an aeroplane and much for a macro lens. */
static rl_code find_jump(const rl_sequence *q, const rl_frame *f, bool *jumped, rl_error *err)
{
    int buffer = depth_buffer(q->plan);
    rl_sink_image image;
    rl_memory *memory;
    *jumped = rl_camera_jumped(&q->last_camera, &f->camera, buffer >= 0 ? INFINITY : REACH);
    if (*jumped || buffer < 0 || !memcmp(q->last_camera.to_view, f->camera.to_view, sizeof f->camera.to_view))
        return RL_OK;
    rl_code code = rl_session_map_image(q, f, buffer, &image, &memory, err);
    if (code)
        return code;
    rl_depth_view view = {image.pixels,  image.stride,      f->geometry.x,
                          f->geometry.y, f->geometry.width, f->geometry.height};
    *jumped = rl_camera_share_seen(&f->camera, &q->last_camera, &view) < LEAST_SEEN;
    return rl_memory_unmap(memory, err);
}

/* History ends where the manifest says, at a gap of the numbers, after a frame that failed. */
static bool is_cut(const rl_sequence *q, const rl_frame *f)
{
    const rl_manifest *m = q->manifest;
    if (!q->has_last || rl_frames_find(&m->cuts, f->number) >= 0)
        return true;
    long here = rl_frames_find(&m->frames, f->number), last = rl_frames_find(&m->frames, q->last_number);
    return here >= 0 && last >= 0 ? here != last + 1 : f->number != q->last_number + 1;
}

rl_code rl_sequence_execute(rl_sequence *q, rl_frame *f, const rl_scene_values *scenes, rl_span *spans,
                            rl_error *err)
{
    rl_code code = rl_executor_resize(q->executor, &f->geometry, err);
    bool cut = is_cut(q, f);
    if (!code && !cut && rl_plan_has_history(q->plan))
        code = find_jump(q, f, &cut, err);
    if (code)
        return code;
    if (cut)
        rl_executor_cut(q->executor);
    rl_frame_values values = {.number = f->number, .camera = f->camera, .scenes = scenes};
    code = rl_executor_run(q->executor, f->buffers, &values, spans, err);
    q->has_last = !code;
    q->last_number = f->number;
    q->last_camera = f->camera;
    return code;
}

rl_code rl_session_execute(rl_session *s, rl_sequence *q, rl_frame *f, rl_span *spans, rl_error *err)
{
    rl_session_light_values(q, &f->camera, q->light_values);
    rl_scene_values scene = {q->light_values, (int)q->n_lights, &s->ambient};
    return rl_sequence_execute(q, f, &scene, spans, err);
}

/* ---- writing ---------------------------------------------------------------------------------------------
 */

rl_code rl_session_map_image(const rl_sequence *q, const rl_frame *f, int buffer, rl_sink_image *out,
                             rl_memory **memory, rl_error *err)
{
    const rl_buffer *b = &q->plan->buffers[buffer];
    const rl_geometry *g = &f->geometry;
    rl_memory *m = rl_frame_buffers_memory(f->buffers, buffer);
    void *p;
    *memory = NULL;
    rl_code code = m ? rl_memory_map(m, false, &p, err)
                     : rl_fail(err, RL_E_INTERNAL, RL_NOWHERE, "'%s' is not kept for reading", b->name);
    if (code)
        return code;
    *memory = m;
    out->planes = b->planes;
    out->format = b->image >= 0 ? q->graph->images[b->image].format : RL_SCALAR;
    if (out->format == RL_LIGHTS)
        out->lights = (strcmp(b->name, "capture.shadow") ? &q->thickness : &q->shadow)->names;
    out->stride = (size_t)g->stride;
    out->plane = (size_t)g->plane;
    out->pixels = (const float *)p + RL_GUARD + (size_t)(g->y - g->origin_y) * (size_t)g->stride +
                  (size_t)(g->x - g->origin_x);
    return RL_OK;
}

typedef struct writing {
    rl_sink_image *images;
    rl_memory **memory; /* mapped, or NULL */
} writing;

/* The stencil goes out as the ids of the capture, not as dense indices. */
static void restore_ids(const rl_frame *f, const char *name, rl_sink_image *image)
{
    if (strcmp(name, "capture.stencil") || !f->ids)
        return;
    image->pixels = (const float *)(const void *)f->ids;
    image->stride = (size_t)f->geometry.width;
}

static rl_code write_output(rl_session *s, rl_sequence *q, rl_frame *f, size_t output,
                            const rl_sink_frame *frame, const char *path, rl_arena *arena, rl_error *err)
{
    const rl_wanted *w = &s->wanted[output];
    writing wr = {.images = rl_arena_array(arena, w->n_layers, sizeof *wr.images),
                  .memory = rl_arena_array(arena, w->n_layers, sizeof(rl_memory *))};
    if (!wr.images || !wr.memory)
        return rl_fail_memory(err, w->n_layers * sizeof *wr.images);
    rl_code code = RL_OK;
    for (size_t i = 0; i < w->n_layers && !code; i++) {
        code = rl_session_map_image(q, f, q->plan->outputs[q->first_output + output][i], &wr.images[i],
                                    &wr.memory[i], err);
        wr.images[i].name = w->layers[i].name;
        if (!code)
            restore_ids(f, w->layers[i].image, &wr.images[i]);
    }
    if (!code)
        code = rl_sink_write(path, &s->outputs[output], wr.images, w->n_layers, frame, s->pool, &f->clipped,
                             err);
    for (size_t i = 0; i < w->n_layers; i++)
        if (wr.memory[i]) /* what was read has been read: a device that fails now is told of at its next call
                           */
            (void)rl_memory_unmap(wr.memory[i], NULL);
    return code;
}

rl_code rl_session_write_frame(rl_session *s, rl_sequence *q, rl_frame *f, const rl_run_hooks *hooks,
                               rl_arena *arena, const char **files, size_t *n_files, rl_error *err)
{
    const char *pipeline = rl_arena_printf(arena, "%s %016" PRIx64, s->pipeline->name, s->content);
    const char *capture = rl_arena_printf(arena, "%s %016" PRIx64, q->manifest->name, q->content);
    if (!pipeline || !capture || !files)
        return rl_fail_memory(err, s->n_outputs * sizeof *files);
    rl_sink_image stencil = {0};
    rl_memory *memory = NULL;
    rl_code code = rl_session_map_image(q, f, q->plan->outputs[q->first_output + s->n_outputs][1], &stencil,
                                        &memory, err);
    rl_sink_frame frame = {.data_window = f->data_window,
                           .display_window = f->display_window,
                           .crop = s->options.crop[2] > 0 ? s->options.crop : NULL,
                           .stencil = (const uint32_t *)(const void *)stencil.pixels,
                           .stencil_stride = stencil.stride,
                           .source = f->files[f->main_file],
                           .source_part = f->main_part,
                           .fps = q->manifest->fps,
                           .pipeline = pipeline,
                           .capture = capture};
    for (size_t i = 0; i < s->n_outputs && !code; i++) {
        const char *name = NULL;
        double start = rl_state_now();
        code =
            rl_output_path(arena, s->outputs[i].spec, q->manifest->name, f->number, s->variant, &name, err);
        const char *path = code ? NULL : rl_path_join(arena, s->options.out ? s->options.out : "out", name);
        if (!code && !path)
            code = rl_fail_memory(err, 1);
        if (!code)
            code = write_output(s, q, f, i, &frame, path, arena, err);
        if (!code)
            files[(*n_files)++] = path;
        const char *spec = s->outputs[i].spec->name,
                   *whole = s->variant ? rl_arena_printf(arena, "%s/%s", s->variant, spec) : spec;
        rl_session_span(hooks, q, f, RL_LANE_WRITE, "encode", whole ? whole : spec, start);
    }
    if (memory)
        (void)rl_memory_unmap(memory, NULL);
    return code;
}

/* ---- one frame -------------------------------------------------------------------------------------------
 */

void rl_session_cut(rl_session *s)
{
    for (size_t i = 0; i < s->n_sequences; i++)
        s->sequences[i].has_last = false;
}

rl_code rl_session_process(rl_session *s, size_t capture, long long number, const rl_frame_data *data,
                           rl_error *err)
{
    rl_error local = {0};
    err = err ? err : &local;
    s->processed = false;
    rl_session_end_views(s);
    if (capture >= s->n_sequences)
        return rl_fail(err, RL_E_USAGE, RL_NOWHERE, "there is no capture %zu", capture);
    if (number < INT_MIN || number > INT_MAX)
        return rl_fail(err, RL_E_USAGE, RL_NOWHERE, "frame %lld is not within %d … %d", number, INT_MIN,
                       INT_MAX);
    rl_sequence *q = &s->sequences[capture];
    rl_code code = rl_session_prepare(s, err);
    if (code)
        return code;
    rl_frame *f = &s->frame;
    if (s->frame_sequence != q)
        rl_frame_free(f);
    s->frame_sequence = q;
    f->number = (int)number;
    code = data ? rl_reader_memory(q->reader, data, f, err) : rl_reader_open(q->reader, f->number, f, err);
    if (!code)
        code = rl_session_fit_buffers(q, f, err);
    if (!code)
        code = data ? rl_reader_memory_pixels(q->reader, data, f, s->pool, err)
                    : rl_reader_pixels(q->reader, f, s->pool, err);
    if (!code)
        code = rl_session_execute(s, q, f, NULL, err);
    s->processed = !code;
    q->has_last = q->has_last && !code;
    return code;
}

/* The output layer that shows an image as it is, without a colour transform. */
static int find_kept(const rl_sequence *q, const char *image)
{
    int wanted = rl_graph_find(q->graph, image);
    for (size_t i = 0; wanted >= 0 && i < q->graph->n_outputs; i++)
        for (size_t k = 0; k < q->graph->outputs[i].n_images; k++)
            if (q->graph->outputs[i].images[k] == wanted)
                return q->plan->outputs[i][k];
    return -1;
}

void rl_session_end_views(rl_session *s)
{
    for (size_t i = 0; i < s->n_viewed; i++)
        rl_memory_unmap(s->viewed[i], NULL); /* what was read has been read */
    rl_free(s->viewed);
    s->viewed = NULL;
    s->n_viewed = 0;
}

/* A mapping must last as long as the view: only on host-memory devices is the pointer good without it. */
static rl_code keep_view(rl_session *s, rl_memory *memory, rl_error *err)
{
    rl_memory **grown = rl_realloc(s->viewed, (s->n_viewed + 1) * sizeof *grown);
    if (!grown) {
        rl_memory_unmap(memory, NULL);
        return rl_fail_memory(err, (s->n_viewed + 1) * sizeof *grown);
    }
    s->viewed = grown;
    s->viewed[s->n_viewed++] = memory;
    return RL_OK;
}

rl_code rl_session_image(rl_session *s, const char *image, rl_image_view *out, rl_error *err)
{
    *out = (rl_image_view){0};
    if (!s->processed)
        return rl_fail(err, RL_E_USAGE, RL_NOWHERE, "no frame was processed");
    const rl_sequence *q = s->frame_sequence;
    int buffer = find_kept(q, image);
    if (buffer < 0)
        return rl_fail(
            err, RL_E_USAGE, RL_NOWHERE,
            "image '%s' is not kept: name it in options.dump, or in an output without a colour transform",
            image);
    rl_sink_image view = {0};
    rl_memory *memory;
    rl_code code = rl_session_map_image(q, &s->frame, buffer, &view, &memory, err);
    if (code)
        return code;
    code = keep_view(s, memory, err);
    if (code)
        return code;
    restore_ids(&s->frame, image, &view);
    *out = (rl_image_view){.x = s->frame.geometry.x,
                           .y = s->frame.geometry.y,
                           .width = s->frame.geometry.width,
                           .height = s->frame.geometry.height,
                           .planes = view.planes,
                           .format = rl_format_name(view.format),
                           .stride = view.stride,
                           .plane_stride = view.plane};
    for (int i = 0; i < view.planes && i < (int)(sizeof out->plane / sizeof *out->plane); i++)
        out->plane[i] = view.pixels + (size_t)i * view.plane;
    return RL_OK;
}
