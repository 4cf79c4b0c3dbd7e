/* Frames of files through a session, in batches: reading, kernels and writing overlap. */
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/run/batch.h"
#include "graph/run/camera.h"
#include "graph/run/session_notes.h"

typedef struct batch_state {
    rl_session *s;
    rl_sequence *q;
    rl_frame frames[RL_MOST_IN_FLIGHT];
    rl_loaded loaded[RL_MOST_IN_FLIGHT];
    const rl_run_hooks *hooks;
    rl_run_summary *summary;
    size_t done, total; /* frames of all captures that this run writes */
    rl_sequence_state state;
    rl_span *spans; /* [plan->n_steps] when somebody wants to know */
} batch_state;

static void batch_load(void *ctx, size_t item, int slot)
{
    batch_state *b = ctx;
    rl_frame *f = &b->frames[slot];
    size_t index = b->state.work[item].frame;
    double start = rl_state_now();
    f->number = b->q->frames.numbers[index];
    rl_session_stage(b->hooks, RL_LANE_READ, f);
    rl_session_load(b->s, b->q, index, f, &b->loaded[slot]);
    rl_state_loaded(&b->state, slot, index, &b->loaded[slot]);
    f->load_s = rl_state_now() - start;
    rl_session_span(b->hooks, b->q, f, RL_LANE_READ, "read", "decode", start);
}

static void batch_run(void *ctx, size_t item, int slot)
{
    batch_state *b = ctx;
    rl_frame *f = &b->frames[slot];
    const rl_work *work = &b->state.work[item];
    double start = rl_state_now();
    bool restored = false;
    rl_session_stage(b->hooks, RL_LANE_RUN, f);
    rl_sequence *q = b->q;
    rl_state_ready(&b->state, work, slot, &restored, &q->last_number, &q->last_camera, &f->error);
    q->has_last =
        !f->error.code && !b->loaded[slot].held && (restored || (q->has_last && work->start == RL_START_ON));
    if (!f->error.code)
        rl_session_execute(b->s, q, f, b->spans, &f->error);
    if (!f->error.code)
        rl_session_step_spans(b->hooks, b->q, f, b->spans);
    q->has_last = !f->error.code && !b->loaded[slot].held; /* a held frame is no past of the next one */
    rl_state_ran(&b->state, slot, f, q->has_last);
    f->run_s = rl_state_now() - start;
    rl_session_span(b->hooks, b->q, f, RL_LANE_RUN, "run", "kernels", start);
}

static void batch_write(void *ctx, size_t item, int slot)
{
    batch_state *b = ctx;
    rl_frame *f = &b->frames[slot];
    rl_arena arena = {0};
    const char **files = rl_arena_array(&arena, b->s->n_outputs, sizeof *files);
    size_t n_files = 0;
    double start = rl_state_now();
    const rl_work *work = &b->state.work[item];
    rl_session_stage(b->hooks, RL_LANE_WRITE, f);
    if (!f->error.code && work->write && !rl_state_writing(&b->state, slot, f->number, &f->error))
        rl_session_write_frame(b->s, b->q, f, b->hooks, &arena, files, &n_files, &f->error);
    bool saves = b->state.slots[slot].saved.history != NULL;
    double pictures = rl_state_now();
    rl_state_written(&b->state, work, slot, f);
    if (saves)
        rl_session_span(b->hooks, b->q, f, RL_LANE_WRITE, "checkpoint", "checkpoint", pictures);
    f->write_s = rl_state_now() - start;
    rl_session_span(b->hooks, b->q, f, RL_LANE_WRITE, "write", "write", start);
    rl_frame_release(f);
    if (b->loaded[slot].skipped)
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
    b->q->has_last = false;
    rl_code code = rl_batch_run(&batch, &finished, err);
    *stopped = finished < b->state.n_work;
    if (!code)
        b->summary->stuck = (code = rl_state_finish(&b->state, *stopped, err)) != RL_OK;
    for (int i = 0; i < RL_MOST_IN_FLIGHT; i++)
        rl_frame_free(&b->frames[i]);
    return code;
}

static rl_code run_sequence(rl_session *s, size_t sequence, const rl_run_hooks *hooks, size_t *done,
                            size_t total, rl_run_summary *summary, bool *stopped, rl_error *err)
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
        code = rl_fail(err, RL_E_CANCELLED, RL_NOWHERE, "stopped after %zu of %zu frames", summary->frames,
                       total);
    return code;
}
