/* Frames through a session: in batches from files to files, or one at a time. */
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/run/batch.h"
#include "graph/run/camera.h"
#include "graph/run/session_notes.h"

enum { MOST_OUTPUT_FILES = 64 };

/* Buffers follow the size of the frame that they hold. */
static rl_code fit_buffers(rl_sequence *q, rl_frame *f, const rl_geometry *before, rl_error *err)
{
    if (f->buffers && !memcmp(before, &f->geometry, sizeof *before))
        return RL_OK;
    rl_frame_buffers_free(&f->buffers);
    return rl_frame_buffers_new(q->executor, &f->geometry, &f->buffers, err);
}

rl_code rl_session_execute(rl_session *s, rl_sequence *q, rl_frame *f, bool cut, rl_span *spans,
                           rl_error *err)
{
    (void)s;
    rl_code code = rl_executor_resize(q->executor, &f->geometry, err);
    if (code)
        return code;
    if (cut)
        rl_executor_cut(q->executor);
    rl_session_light_values(q, &f->camera, q->light_values);
    rl_frame_values values = {
        .number = f->number, .camera = f->camera, .lights = q->light_values, .n_lights = (int)q->n_lights};
    return rl_executor_run(q->executor, f->buffers, &values, spans, err);
}

/* ---- writing --------------------------------------------------------------------------------------------- */

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
    out->stride = (size_t)g->stride;
    const float *base =
        (const float *)p + RL_GUARD + (size_t)(g->y - g->origin_y) * (size_t)g->stride + (size_t)(g->x - g->origin_x);
    for (int i = 0; i < b->planes && i < 16; i++)
        out->plane[i] = base + (size_t)i * (size_t)g->plane;
    return RL_OK;
}

typedef struct writing {
    rl_sink_image images[MOST_OUTPUT_FILES];
    rl_memory *memory[MOST_OUTPUT_FILES];
    size_t n;
} writing;

/* The stencil goes out as the ids of the capture, not as dense indices. */
static void restore_ids(const rl_frame *f, const rl_wanted *w, size_t layer, rl_sink_image *image)
{
    if (strcmp(w->layers[layer].image, "capture.stencil") || !f->ids)
        return;
    image->plane[0] = (const float *)(const void *)f->ids;
    image->stride = (size_t)f->geometry.width;
}

static rl_code write_output(rl_session *s, rl_sequence *q, rl_frame *f, size_t output, const rl_sink_frame *frame,
                            const char *path, rl_error *err)
{
    const rl_wanted *w = &s->wanted[output];
    writing wr = {0};
    rl_code code = RL_OK;
    for (size_t i = 0; i < w->n_layers && i < MOST_OUTPUT_FILES && !code; i++) {
        code = rl_session_map_image(q, f, q->plan->outputs[output][i], &wr.images[i], &wr.memory[i], err);
        wr.images[i].name = w->layers[i].name;
        if (!code)
            restore_ids(f, w, i, &wr.images[i]);
        wr.n = i + 1;
    }
    if (!code)
        code = rl_sink_write(path, &s->outputs[output], wr.images, wr.n, frame, s->pool, &f->clipped, err);
    for (size_t i = 0; i < wr.n; i++) {
        rl_code unmapped = wr.memory[i] ? rl_memory_unmap(wr.memory[i], code ? NULL : err) : RL_OK;
        code = code ? code : unmapped;
    }
    return code;
}

static rl_code write_frame(rl_session *s, rl_sequence *q, rl_frame *f, const rl_run_hooks *hooks, rl_arena *arena,
                           const char **files, size_t *n_files, rl_error *err)
{
    rl_sink_image stencil = {0};
    rl_memory *memory = NULL;
    rl_code code = rl_session_map_image(q, f, q->plan->outputs[s->n_outputs][1], &stencil, &memory, err);
    rl_sink_frame frame = {.data_window = f->data_window,
                           .display_window = f->display_window,
                           .crop = s->options.crop[2] > 0 ? s->options.crop : NULL,
                           .stencil = (const uint32_t *)(const void *)stencil.plane[0],
                           .stencil_stride = stencil.stride,
                           .source = f->files[f->main_file],
                           .source_part = f->main_part,
                           .fps = q->manifest->fps,
                           .pipeline = rl_arena_printf(arena, "%s %016llx", s->pipeline->name, s->pipeline->hash)};
    for (size_t i = 0; i < s->n_outputs && !code; i++) {
        const char *name = NULL;
        double start = rl_state_now();
        code = rl_output_path(arena, s->outputs[i].spec, q->manifest->name, f->number, NULL, &name, err);
        const char *path = code ? NULL : rl_path_join(arena, s->options.out ? s->options.out : "out", name);
        if (!code && !path)
            code = rl_fail_memory(err, 1);
        if (!code)
            code = write_output(s, q, f, i, &frame, path, err);
        if (!code && *n_files < MOST_OUTPUT_FILES)
            files[(*n_files)++] = path;
        rl_session_span(hooks, q, f, RL_LANE_WRITE, "encode", s->outputs[i].spec->name, start);
    }
    if (memory)
        rl_memory_unmap(memory, NULL);
    return code;
}

/* ---- batches --------------------------------------------------------------------------------------------- */

typedef struct batch_state {
    rl_session *s;
    rl_sequence *q;
    rl_frame frames[RL_MOST_IN_FLIGHT];
    bool skipped[RL_MOST_IN_FLIGHT];
    const rl_run_hooks *hooks;
    rl_run_summary *summary;
    size_t done, total; /* frames of all captures that this run writes */
    rl_sequence_state state;
    rl_span *spans; /* [plan->n_steps] when somebody wants to know */
    bool history; /* the frame before this one ran, without a gap */
    int previous;
    camera_t camera;
} batch_state;

static void batch_load(void *ctx, size_t item, int slot)
{
    batch_state *b = ctx;
    rl_frame *f = &b->frames[slot];
    rl_geometry before = f->geometry;
    double start = rl_state_now();
    f->number = b->q->frames.numbers[b->state.work[item].frame];
    f->error = (rl_error){0};
    f->run_s = f->write_s = 0;
    f->clipped = 0;
    b->skipped[slot] = false;
    b->state.slots[slot].inputs = (rl_inputs){.missing = true};
    rl_session_stage(b->hooks, RL_LANE_READ, f);
    if (!rl_reader_open(b->q->reader, f->number, f, &f->error) && !fit_buffers(b->q, f, &before, &f->error))
        rl_reader_pixels(b->q->reader, f, b->s->pool, &f->error);
    if (f->error.code == RL_E_IO && b->s->options.on_missing == RL_MISSING_SKIP) {
        rl_report(b->s->log, RL_WARNING, (rl_where){.file = f->error.file}, "frame %d is skipped: %s", f->number,
                  f->error.text);
        b->skipped[slot] = true;
    }
    if (!f->error.code)
        rl_state_loaded(&b->state, slot, f);
    f->load_s = rl_state_now() - start;
    rl_session_span(b->hooks, b->q, f, RL_LANE_READ, "read", "decode", start);
}

/* History ends where the manifest says, at a gap of the numbers, after a frame that failed, at a jump of the camera. */
static bool is_cut(const batch_state *b, const rl_frame *f)
{
    const rl_manifest *m = b->q->manifest;
    if (!b->history || rl_frames_find(&m->cuts, f->number) >= 0)
        return true;
    long here = rl_frames_find(&m->frames, f->number), last = rl_frames_find(&m->frames, b->previous);
    return here != last + 1 || rl_camera_jumped(&b->camera, &f->camera, 10);
}

static void batch_run(void *ctx, size_t item, int slot)
{
    batch_state *b = ctx;
    rl_frame *f = &b->frames[slot];
    const rl_work *work = &b->state.work[item];
    double start = rl_state_now();
    bool restored = false;
    rl_session_stage(b->hooks, RL_LANE_RUN, f);
    if (!f->error.code)
        rl_state_ready(&b->state, work, slot, f->number, &restored, &b->previous, &b->camera, &f->error);
    b->history = restored || (b->history && work->start == RL_START_ON);
    bool cut = f->error.code || is_cut(b, f);
    if (!f->error.code)
        rl_session_execute(b->s, b->q, f, cut, b->spans, &f->error);
    if (!f->error.code)
        rl_session_step_spans(b->hooks, b->s, b->q, f, b->spans);
    rl_state_ran(&b->state, work, slot, f, !f->error.code);
    b->history = !f->error.code;
    b->previous = f->number;
    b->camera = f->camera;
    f->run_s = rl_state_now() - start;
    rl_session_span(b->hooks, b->q, f, RL_LANE_RUN, "run", "kernels", start);
}

static void batch_write(void *ctx, size_t item, int slot)
{
    batch_state *b = ctx;
    rl_frame *f = &b->frames[slot];
    rl_arena arena = {0};
    const char *files[MOST_OUTPUT_FILES];
    size_t n_files = 0;
    double start = rl_state_now();
    const rl_work *work = &b->state.work[item];
    rl_session_stage(b->hooks, RL_LANE_WRITE, f);
    if (!f->error.code && work->write && !rl_state_writing(&b->state, slot, f->number, &f->error))
        write_frame(b->s, b->q, f, b->hooks, &arena, files, &n_files, &f->error);
    rl_state_written(&b->state, work, slot, f);
    f->write_s = rl_state_now() - start;
    rl_session_span(b->hooks, b->q, f, RL_LANE_WRITE, "write", "write", start);
    rl_frame_release(f);
    if (b->skipped[slot])
        f->error = (rl_error){0};
    bool shown = work->write || f->error.code; /* warm-up is nobody's business unless it fails */
    b->done += work->write;
    b->summary->frames += shown;
    b->summary->failed += f->error.code != RL_OK;
    b->summary->nonfinite += f->nonfinite;
    b->summary->clamped += f->clamped;
    b->summary->clipped += f->clipped;
    rl_frame_result result = {.capture = b->q->manifest->name,
                              .frame = f->number,
                              .error = &f->error,
                              .n_files = n_files,
                              .files = files,
                              .nonfinite = f->nonfinite,
                              .clamped = f->clamped,
                              .clipped = f->clipped,
                              .load_s = f->load_s,
                              .run_s = f->run_s,
                              .write_s = f->write_s,
                              .done = b->done,
                              .total = b->total};
    if (shown && b->hooks && b->hooks->frame)
        b->hooks->frame(b->hooks->ctx, &result);
    rl_arena_free(&arena);
}

static int batch_stop(void *ctx)
{
    batch_state *b = ctx;
    return b->hooks && b->hooks->stop ? b->hooks->stop(b->hooks->ctx) : 0;
}

static rl_code run_frames(batch_state *b, bool *stopped, rl_error *err)
{
    rl_batch batch = {.items = b->state.n_work,
                      .in_flight = rl_session_in_flight(b->s, b->q),
                      .load = batch_load,
                      .run = batch_run,
                      .write = batch_write,
                      .stop = batch_stop,
                      .ctx = b};
    size_t finished = 0;
    rl_state_announce(&b->state);
    if (b->hooks && b->hooks->span)
        b->spans = rl_arena_array(&b->state.arena, b->q->plan->n_steps + 1, sizeof *b->spans);
    rl_code code = rl_batch_run(&batch, &finished, err);
    *stopped = finished < b->state.n_work;
    if (!code)
        rl_state_finish(&b->state, *stopped);
    for (int i = 0; i < RL_MOST_IN_FLIGHT; i++)
        rl_frame_free(&b->frames[i]);
    return code;
}

static rl_code run_sequence(rl_session *s, size_t sequence, const rl_run_hooks *hooks, size_t *done, size_t total,
                            rl_run_summary *summary, bool *stopped, rl_error *err)
{
    batch_state *b = rl_calloc(1, sizeof *b);
    if (!b)
        return rl_fail_memory(err, sizeof *b);
    b->s = s;
    b->q = &s->sequences[sequence];
    b->hooks = hooks;
    b->summary = summary;
    b->total = total;
    rl_code code = rl_sequence_state_begin(&b->state, s, sequence, err);
    summary->skipped += b->state.n_there;
    b->done = *done + b->state.n_there;
    if (!code && b->state.lacking) {
        summary->lacking = true;
        code = rl_state_lacks(&b->state, err);
    }
    if (!code)
        code = run_frames(b, stopped, err);
    *done = b->done;
    rl_sequence_state_end(&b->state);
    rl_free(b);
    return code;
}

rl_code rl_session_run(rl_session *s, const rl_run_hooks *hooks, rl_run_summary *summary, rl_error *err)
{
    rl_run_summary own = {0};
    summary = summary ? summary : &own;
    *summary = (rl_run_summary){0};
    rl_code code = rl_folder_make(s->options.out ? s->options.out : "out", err);
    if (!code)
        code = rl_session_prepare(s, err);
    size_t total = 0, done = 0;
    rl_part part;
    for (size_t i = 0; i < s->n_sequences; i++) {
        rl_session_part(s, i, &part);
        total += part.last - part.first - part.warm;
    }
    bool stopped = false;
    for (size_t i = 0; i < s->n_sequences && !code && !stopped; i++) {
        rl_session_part(s, i, &part);
        if (part.last > part.first)
            code = run_sequence(s, i, hooks, &done, total, summary, &stopped, err);
    }
    summary->peak_bytes = rl_alloc_peak();
    if (!code && stopped)
        code = rl_fail(err, RL_E_CANCELLED, RL_NOWHERE, "stopped after %zu of %zu frames", summary->frames, total);
    return code;
}

/* ---- one frame ------------------------------------------------------------------------------------------- */

void rl_session_cut(rl_session *s)
{
    for (size_t i = 0; i < s->n_sequences; i++)
        if (s->sequences[i].executor)
            rl_executor_cut(s->sequences[i].executor);
}

rl_code rl_session_process(rl_session *s, size_t capture, long long number, const rl_frame_data *data, rl_error *err)
{
    rl_error local = {0};
    err = err ? err : &local;
    s->processed = false;
    if (capture >= s->n_sequences)
        return rl_fail(err, RL_E_USAGE, RL_NOWHERE, "there is no capture %zu", capture);
    rl_sequence *q = &s->sequences[capture];
    rl_code code = rl_session_prepare(s, err);
    if (code)
        return code;
    rl_frame *f = &s->frame;
    if (s->frame_sequence != q)
        rl_frame_free(f);
    rl_geometry before = f->geometry;
    s->frame_sequence = q;
    f->number = (int)number;
    code = data ? rl_reader_memory(q->reader, data, f, err) : rl_reader_open(q->reader, f->number, f, err);
    if (!code)
        code = fit_buffers(q, f, &before, err);
    if (!code)
        code = data ? rl_reader_memory_pixels(q->reader, data, f, s->pool, err) : rl_reader_pixels(q->reader, f, s->pool, err);
    if (!code)
        code = rl_session_execute(s, q, f, false, NULL, err);
    s->processed = !code;
    return code;
}

/* The output layer that shows an image as it is, without a colour transform. */
static int find_kept(const rl_session *s, const rl_sequence *q, const char *image)
{
    int wanted = rl_graph_find(q->graph, image);
    for (size_t i = 0; wanted >= 0 && i < q->graph->n_outputs; i++)
        for (size_t k = 0; k < q->graph->outputs[i].n_images; k++)
            if (q->graph->outputs[i].images[k] == wanted)
                return q->plan->outputs[i][k];
    (void)s;
    return -1;
}

rl_code rl_session_image(rl_session *s, const char *image, rl_image_view *out, rl_error *err)
{
    *out = (rl_image_view){0};
    if (!s->processed)
        return rl_fail(err, RL_E_USAGE, RL_NOWHERE, "no frame was processed");
    const rl_sequence *q = s->frame_sequence;
    int buffer = find_kept(s, q, image);
    if (buffer < 0)
        return rl_fail(err, RL_E_USAGE, RL_NOWHERE,
                       "image '%s' is not kept: name it in options.dump, or in an output without a colour transform", image);
    rl_sink_image view = {0};
    rl_memory *memory;
    rl_code code = rl_session_map_image(q, &s->frame, buffer, &view, &memory, err);
    if (code)
        return code;
    *out = (rl_image_view){.x = s->frame.geometry.x,
                           .y = s->frame.geometry.y,
                           .width = s->frame.geometry.width,
                           .height = s->frame.geometry.height,
                           .planes = view.planes,
                           .format = rl_format_name(view.format),
                           .stride = view.stride};
    memcpy(out->plane, view.plane, sizeof out->plane);
    /* The view stays valid on host-memory devices; others keep the mapping until the next map of the same buffer. */
    return rl_memory_unmap(memory, err);
}
