/* Frames through a session: in batches from files to files, or one at a time. */
#include <limits.h>
#include <string.h>
#include <time.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/run/batch.h"
#include "graph/run/camera.h"
#include "graph/run/session.h"

enum { MOST_IN_FLIGHT = 3 };

static double now_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Buffers follow the size of the frame that they hold. */
static rl_code fit_buffers(rl_sequence *q, rl_frame *f, rl_error *err)
{
    if (f->buffers && !memcmp(rl_frame_buffers_geometry(f->buffers), &f->geometry, sizeof f->geometry))
        return RL_OK;
    rl_frame_buffers_free(&f->buffers);
    return rl_frame_buffers_new(q->executor, &f->geometry, &f->buffers, err);
}

/* History ends where the manifest says, at a gap of the numbers, after a frame that failed, at a jump of the camera. */
static bool is_cut(const rl_sequence *q, const rl_frame *f)
{
    const rl_manifest *m = q->manifest;
    if (!q->has_last || rl_frames_find(&m->cuts, f->number) >= 0)
        return true;
    long here = rl_frames_find(&m->frames, f->number), last = rl_frames_find(&m->frames, q->last_number);
    bool gap = here >= 0 && last >= 0 ? here != last + 1 : f->number != q->last_number + 1;
    return gap || rl_camera_jumped(&q->last_camera, &f->camera, 10);
}

rl_code rl_session_execute(rl_session *s, rl_sequence *q, rl_frame *f, rl_error *err)
{
    rl_code code = rl_executor_resize(q->executor, &f->geometry, err);
    if (code)
        return code;
    if (is_cut(q, f))
        rl_executor_cut(q->executor);
    rl_session_light_values(q, &f->camera, q->light_values);
    rl_frame_values values = {
        .number = f->number, .camera = f->camera, .lights = q->light_values, .n_lights = (int)q->n_lights,
        .ambient = &s->ambient};
    code = rl_executor_run(q->executor, f->buffers, &values, NULL, err);
    q->has_last = !code;
    q->last_number = f->number;
    q->last_camera = f->camera;
    return code;
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
    out->plane = (size_t)g->plane;
    out->pixels =
        (const float *)p + RL_GUARD + (size_t)(g->y - g->origin_y) * (size_t)g->stride + (size_t)(g->x - g->origin_x);
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

static rl_code write_output(rl_session *s, rl_sequence *q, rl_frame *f, size_t output, const rl_sink_frame *frame,
                            const char *path, rl_arena *arena, rl_error *err)
{
    const rl_wanted *w = &s->wanted[output];
    writing wr = {.images = rl_arena_array(arena, w->n_layers, sizeof *wr.images),
                  .memory = rl_arena_array(arena, w->n_layers, sizeof(rl_memory *))};
    if (!wr.images || !wr.memory)
        return rl_fail_memory(err, w->n_layers * sizeof *wr.images);
    rl_code code = RL_OK;
    for (size_t i = 0; i < w->n_layers && !code; i++) {
        code = rl_session_map_image(q, f, q->plan->outputs[output][i], &wr.images[i], &wr.memory[i], err);
        wr.images[i].name = w->layers[i].name;
        if (!code)
            restore_ids(f, w->layers[i].image, &wr.images[i]);
    }
    if (!code)
        code = rl_sink_write(path, &s->outputs[output], wr.images, w->n_layers, frame, s->pool, &f->clipped, err);
    for (size_t i = 0; i < w->n_layers; i++) {
        rl_code unmapped = wr.memory[i] ? rl_memory_unmap(wr.memory[i], code ? NULL : err) : RL_OK;
        code = code ? code : unmapped;
    }
    return code;
}

static rl_code write_frame(rl_session *s, rl_sequence *q, rl_frame *f, rl_arena *arena, const char **files,
                           size_t *n_files, rl_error *err)
{
    const char *pipeline = rl_arena_printf(arena, "%s %016llx", s->pipeline->name, s->pipeline->hash);
    if (!pipeline || !files)
        return rl_fail_memory(err, s->n_outputs * sizeof *files);
    rl_sink_image stencil = {0};
    rl_memory *memory = NULL;
    rl_code code = rl_session_map_image(q, f, q->plan->outputs[s->n_outputs][1], &stencil, &memory, err);
    rl_sink_frame frame = {.data_window = f->data_window,
                           .display_window = f->display_window,
                           .crop = s->options.crop[2] > 0 ? s->options.crop : NULL,
                           .stencil = (const uint32_t *)(const void *)stencil.pixels,
                           .stencil_stride = stencil.stride,
                           .source = f->files[f->main_file],
                           .source_part = f->main_part,
                           .fps = q->manifest->fps,
                           .pipeline = pipeline};
    for (size_t i = 0; i < s->n_outputs && !code; i++) {
        const char *name = NULL;
        code = rl_output_path(arena, s->outputs[i].spec, q->manifest->name, f->number, NULL, &name, err);
        const char *path = code ? NULL : rl_path_join(arena, s->options.out ? s->options.out : "out", name);
        if (!code && !path)
            code = rl_fail_memory(err, 1);
        if (!code)
            code = write_output(s, q, f, i, &frame, path, arena, err);
        if (!code)
            files[(*n_files)++] = path;
    }
    if (memory)
        rl_memory_unmap(memory, NULL);
    return code;
}

/* ---- batches --------------------------------------------------------------------------------------------- */

typedef struct batch_state {
    rl_session *s;
    rl_sequence *q;
    rl_frame frames[MOST_IN_FLIGHT];
    bool skipped[MOST_IN_FLIGHT], held[MOST_IN_FLIGHT];
    bool has_good; /* the loader's: a frame was read, `good`; it is what --on-missing hold shows */
    int good;
    const rl_run_hooks *hooks;
    rl_run_summary *summary;
    size_t done_before, total;
} batch_state;

/* The frame of a number, under the files of another one when that is held. */
static rl_code load_frame(batch_state *b, rl_frame *f, int file_number, rl_error *err)
{
    f->nonfinite = f->clamped = 0;
    rl_code code = rl_reader_open(b->q->reader, file_number, f, err);
    if (!code)
        code = fit_buffers(b->q, f, err);
    return code ? code : rl_reader_pixels(b->q->reader, f, b->s->pool, err);
}

/* A frame whose files are missing or broken: what --on-missing says. */
static void miss_frame(batch_state *b, rl_frame *f, int slot)
{
    rl_on_missing how = b->s->options.on_missing;
    rl_error why = f->error;
    rl_where where = {.file = why.file};
    if (how == RL_MISSING_SKIP) {
        rl_report(b->s->log, RL_WARNING, where, "frame %d is skipped: %s", f->number, why.text);
        b->skipped[slot] = true;
    } else if (how == RL_MISSING_HOLD && b->has_good) {
        rl_report(b->s->log, RL_WARNING, where, "frame %d holds the layers of frame %d: %s", f->number, b->good, why.text);
        f->error = (rl_error){0};
        b->held[slot] = true;
        load_frame(b, f, b->good, &f->error);
    } else if (how == RL_MISSING_HOLD) {
        f->error = (rl_error){0};
        rl_fail(&f->error, why.code, where, "%s (there is no frame before it to hold)", why.text);
    }
}

static void batch_load(void *ctx, size_t item, int slot)
{
    batch_state *b = ctx;
    rl_frame *f = &b->frames[slot];
    double start = now_s();
    f->number = b->q->frames.numbers[item];
    f->error = (rl_error){0};
    f->run_s = f->write_s = 0;
    f->nonfinite = f->clamped = f->clipped = 0;
    b->skipped[slot] = b->held[slot] = false;
    load_frame(b, f, f->number, &f->error);
    if (rl_reader_missed(f->error.code)) {
        miss_frame(b, f, slot);
    } else if (!f->error.code) {
        b->has_good = true;
        b->good = f->number;
    }
    f->load_s = now_s() - start;
}

static void batch_run(void *ctx, size_t item, int slot)
{
    (void)item;
    batch_state *b = ctx;
    rl_frame *f = &b->frames[slot];
    double start = now_s();
    if (f->error.code || b->held[slot])
        b->q->has_last = false;
    if (!f->error.code)
        rl_session_execute(b->s, b->q, f, &f->error);
    if (f->error.code || b->held[slot])
        b->q->has_last = false; /* a held frame is no past of the next one */
    f->run_s = now_s() - start;
}

static void batch_write(void *ctx, size_t item, int slot)
{
    batch_state *b = ctx;
    rl_frame *f = &b->frames[slot];
    rl_arena arena = {0};
    const char **files = rl_arena_array(&arena, b->s->n_outputs, sizeof *files);
    size_t n_files = 0;
    double start = now_s();
    if (!f->error.code)
        write_frame(b->s, b->q, f, &arena, files, &n_files, &f->error);
    f->write_s = now_s() - start;
    rl_frame_release(f);
    if (b->skipped[slot])
        f->error = (rl_error){0};
    b->summary->frames++;
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
                              .done = b->done_before + item + 1,
                              .total = b->total};
    if (b->hooks && b->hooks->frame)
        b->hooks->frame(b->hooks->ctx, &result);
    rl_arena_free(&arena);
}

static int batch_stop(void *ctx)
{
    batch_state *b = ctx;
    return b->hooks && b->hooks->stop ? b->hooks->stop(b->hooks->ctx) : 0;
}

/* As many frames as overlap usefully and as the memory limit lets be in flight. */
static int in_flight(const rl_session *s, const rl_sequence *q)
{
    int n = MOST_IN_FLIGHT;
    while (n > 1 && s->options.memory_limit && rl_plan_bytes(q->plan, &q->geometry, n) > s->options.memory_limit)
        n--;
    return n;
}

static rl_code run_sequence(rl_session *s, rl_sequence *q, const rl_run_hooks *hooks, size_t done, size_t total,
                            rl_run_summary *summary, bool *stopped, rl_error *err)
{
    batch_state *b = rl_calloc(1, sizeof *b);
    if (!b)
        return rl_fail_memory(err, sizeof *b);
    b->s = s;
    b->q = q;
    b->hooks = hooks;
    b->summary = summary;
    b->done_before = done;
    b->total = total;
    q->has_last = false;
    rl_batch batch = {.items = q->frames.n,
                      .in_flight = in_flight(s, q),
                      .load = batch_load,
                      .run = batch_run,
                      .write = batch_write,
                      .stop = batch_stop,
                      .ctx = b};
    size_t finished = 0;
    rl_code code = rl_batch_run(&batch, &finished, err);
    *stopped = finished < q->frames.n;
    for (int i = 0; i < MOST_IN_FLIGHT; i++)
        rl_frame_free(&b->frames[i]);
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
    for (size_t i = 0; i < s->n_sequences; i++)
        total += s->sequences[i].frames.n;
    bool stopped = false;
    for (size_t i = 0; i < s->n_sequences && !code && !stopped; i++) {
        code = run_sequence(s, &s->sequences[i], hooks, done, total, summary, &stopped, err);
        done += s->sequences[i].frames.n;
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
        s->sequences[i].has_last = false;
}

rl_code rl_session_process(rl_session *s, size_t capture, long long number, const rl_frame_data *data, rl_error *err)
{
    rl_error local = {0};
    err = err ? err : &local;
    s->processed = false;
    if (capture >= s->n_sequences)
        return rl_fail(err, RL_E_USAGE, RL_NOWHERE, "there is no capture %zu", capture);
    if (number < INT_MIN || number > INT_MAX)
        return rl_fail(err, RL_E_USAGE, RL_NOWHERE, "frame %lld is not within %d … %d", number, INT_MIN, INT_MAX);
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
        code = fit_buffers(q, f, err);
    if (!code)
        code = data ? rl_reader_memory_pixels(q->reader, data, f, s->pool, err) : rl_reader_pixels(q->reader, f, s->pool, err);
    if (!code)
        code = rl_session_execute(s, q, f, err);
    s->processed = !code;
    q->has_last = q->has_last && !code;
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
    /* The view stays valid on host-memory devices; others keep the mapping until the next map of the same buffer. */
    return rl_memory_unmap(memory, err);
}
