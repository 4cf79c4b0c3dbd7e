/* What a run of a sequence tells: before it begins, and what took which time. */
#include "graph/run/session_notes.h"

/* What a sequence's state says before its frames run. */
void rl_state_announce(const rl_sequence_state *st)
{
    const rl_session *s = st->session;
    const char *name = st->sequence->manifest->name;
    if (s->options.resume && st->n_there)
        rl_report(s->log, RL_NOTE, RL_NOWHERE, "'%s': %zu frames are there already", name, st->n_there);
    if (st->n_work && st->work[0].start == RL_START_CHECKPOINT)
        rl_report(s->log, RL_NOTE, RL_NOWHERE, "'%s': going on from the checkpoint after frame %d", name,
                  st->sequence->frames.numbers[st->work[0].frame - 1]);
    if (st->n_work > st->n_write)
        rl_report(s->log, RL_NOTE, RL_NOWHERE, "'%s': %zu frames are processed for their history only", name,
                  st->n_work - st->n_write);
}

rl_code rl_state_lacks(const rl_sequence_state *st, rl_error *err)
{
    const int *shard = st->session->options.shard;
    return rl_fail_file(
        err, RL_E_IO, st->folder,
        "'%s': shard %d/%d needs the checkpoint after frame %d, which shard %d/%d writes at its end; run "
        "it again when that is done, or give --preroll K for K frames of warm-up instead",
        st->sequence->manifest->name, shard[0], shard[1], st->sequence->frames.numbers[st->first - 1],
        shard[0] - 1, shard[1]);
}

void rl_session_stage(const rl_run_hooks *hooks, rl_lane lane, const rl_frame *f)
{
    if (hooks && hooks->stage)
        hooks->stage(hooks->ctx, lane, f->number);
}

void rl_session_span(const rl_run_hooks *hooks, const rl_sequence *q, const rl_frame *f, rl_lane lane,
                     const char *category, const char *name, double start_s)
{
    if (!hooks || !hooks->span)
        return;
    rl_run_span span = {.lane = lane,
                        .category = category,
                        .name = name,
                        .capture = q->manifest->name,
                        .frame = f->number,
                        .start = (uint64_t)(start_s * 1e9),
                        .end = (uint64_t)(rl_state_now() * 1e9)};
    hooks->span(hooks->ctx, &span);
}

/* Nodes that no file has were added for the outputs: colour transforms. */
static const char *category(const rl_graph *graph, const rl_plan_step *step)
{
    static const char *const others[] = {[RL_STEP_CONVERT] = "convert", [RL_STEP_COPY] = "copy"};
    if (step->kind != RL_STEP_KERNEL)
        return others[step->kind];
    return graph->nodes[step->node].where.file ? "kernel" : "colour";
}

void rl_session_step_spans(const rl_run_hooks *hooks, const rl_sequence *q, const rl_frame *f,
                           const rl_span *spans)
{
    for (size_t i = 0; spans && hooks && hooks->span && i < q->plan->n_steps; i++) {
        const rl_plan_step *step = &q->plan->steps[i];
        rl_arena arena = {0};
        const char *name = q->plan->buffers[step->buffers[0] < 0 ? 0 : step->buffers[0]].name;
        if (step->kind == RL_STEP_KERNEL) {
            const rl_graph_node *node = &q->graph->nodes[step->node];
            name = rl_arena_printf(&arena, "%s: %s", node->name, node->pass->steps.rows[step->step].entry);
        }
        rl_run_span span = {.lane = RL_LANE_DEVICE,
                            .category = category(q->graph, step),
                            .name = name ? name : "",
                            .capture = q->manifest->name,
                            .frame = f->number,
                            .start = spans[i].start,
                            .end = spans[i].end};
        if (span.end > 0) /* a copy is not timed, and a step behind one that failed did not run */
            hooks->span(hooks->ctx, &span);
        rl_arena_free(&arena);
    }
}
