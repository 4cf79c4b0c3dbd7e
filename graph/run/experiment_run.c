/* The frames of an experiment: read once a group, run in one plan a group; experiment_write.c ends them. */
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/run/batch.h"
#include "graph/run/experiment_parts.h"
#include "graph/run/session_notes.h"

static rl_sequence *leader_of(const rl_capture_run *r, size_t group, rl_session **session)
{
    size_t leader = r->c->groups[group].members[0];
    *session = r->x->sessions[leader];
    return rl_experiment_sequence(r->x, leader, r->capture);
}

/* ---- reading --------------------------------------------------------------------------------------------
 */

static void batch_load(void *ctx, size_t item, int index)
{
    rl_capture_run *r = ctx;
    rl_run_slot *s = &r->slots[index];
    s->error = (rl_error){0};
    s->skipped = false;
    for (size_t g = 0; g < r->c->n_groups; g++) {
        rl_session *session;
        rl_sequence *q = leader_of(r, g, &session);
        rl_frame *f = &s->frames[g];
        double start = rl_state_now();
        f->number = q->frames.numbers[item];
        rl_session_stage(&r->notes, RL_LANE_READ, f);
        rl_session_load(session, q, item, f, &s->loaded[g]);
        f->load_s = rl_state_now() - start;
        rl_session_span(&r->notes, q, f, RL_LANE_READ, "read", "decode", start);
        s->skipped |= s->loaded[g].skipped;
        if (f->error.code && !s->error.code)
            s->error = f->error;
    }
}

/* ---- kernels --------------------------------------------------------------------------------------------
 */

static void add_times(rl_group *g, const rl_frame *f, const rl_span *spans)
{
    if (g->frames == 1 && !g->warm) {
        memset(g->node_ns, 0, g->merged->graph->n_nodes * sizeof *g->node_ns);
        g->step_ns = g->load_ns = 0;
        g->frames = 0;
        g->warm = true;
    }
    for (size_t i = 0; i < g->plan->n_steps; i++) {
        const rl_plan_step *step = &g->plan->steps[i];
        double ns = (double)(spans[i].end - spans[i].start);
        if (step->node >= 0)
            g->node_ns[step->node] += ns;
        else
            g->step_ns += ns;
    }
    g->load_ns += 1e9 * f->load_s;
    g->frames++;
}

static void run_group(rl_capture_run *r, size_t group, rl_frame *f, const rl_loaded *loaded)
{
    rl_group *g = &r->c->groups[group];
    rl_session *session;
    rl_sequence *q = leader_of(r, group, &session);
    for (size_t i = 0; i < g->n; i++) {
        const rl_session *s = r->x->sessions[g->members[i]];
        const rl_sequence *own = rl_experiment_sequence(r->x, g->members[i], r->capture);
        rl_session_light_values(own, &f->camera, own->light_values);
        r->scenes[group][i] = (rl_scene_values){own->light_values, (int)own->n_lights, &s->ambient};
    }
    if (loaded->held)
        q->has_last = false;
    memset(r->spans[group], 0, g->plan->n_steps * sizeof **r->spans);
    if (!rl_sequence_execute(q, f, r->scenes[group], r->spans[group], &f->error)) {
        rl_session_step_spans(&r->notes, q, f, r->spans[group]);
        add_times(g, f, r->spans[group]);
    }
    q->has_last = !f->error.code && !loaded->held; /* a held frame is no past of the next one */
}

static void batch_run(void *ctx, size_t item, int index)
{
    rl_capture_run *r = ctx;
    rl_run_slot *s = &r->slots[index];
    (void)item;
    for (size_t g = 0; g < r->c->n_groups; g++) {
        rl_session *session;
        rl_sequence *q = leader_of(r, g, &session);
        rl_frame *f = &s->frames[g];
        double start = rl_state_now();
        rl_session_stage(&r->notes, RL_LANE_RUN, f);
        if (s->error.code)
            q->has_last = false;
        else
            run_group(r, g, f, &s->loaded[g]);
        if (f->error.code && !s->error.code)
            s->error = f->error;
        f->run_s = rl_state_now() - start;
        rl_session_span(&r->notes, q, f, RL_LANE_RUN, "run", "kernels", start);
    }
}

/* ---- a capture, all captures ----------------------------------------------------------------------------
 */

static void batch_write(void *ctx, size_t item, int index)
{
    rl_capture_run *r = ctx;
    rl_experiment_write(r, item, &r->slots[index]);
}

static int batch_stop(void *ctx)
{
    const rl_capture_run *r = ctx;
    return r->hooks && r->hooks->stop ? r->hooks->stop(r->hooks->ctx) : 0;
}

static rl_code make_room(rl_capture_run *r, rl_error *err)
{
    const size_t n = r->c->n_groups;
    r->spans = rl_arena_array(&r->arena, n, sizeof *r->spans);
    r->scenes = rl_arena_array(&r->arena, n, sizeof *r->scenes);
    bool good = r->spans && r->scenes;
    for (size_t g = 0; g < n && good; g++) {
        r->spans[g] = rl_arena_array(&r->arena, r->c->groups[g].plan->n_steps + 1, sizeof **r->spans);
        r->scenes[g] = rl_arena_array(&r->arena, r->c->groups[g].n, sizeof **r->scenes);
        good = r->spans[g] && r->scenes[g];
    }
    for (int i = 0; i < RL_MOST_IN_FLIGHT && good; i++) {
        r->slots[i].frames = rl_arena_array(&r->arena, n, sizeof *r->slots[i].frames);
        r->slots[i].loaded = rl_arena_array(&r->arena, n, sizeof *r->slots[i].loaded);
        good = r->slots[i].frames && r->slots[i].loaded;
    }
    return good ? RL_OK : rl_fail_memory(err, n * sizeof(rl_frame));
}

static rl_code make_executors(rl_capture_run *r, rl_error *err)
{
    rl_experiment *x = r->x;
    rl_code code = RL_OK;
    for (size_t g = 0; g < r->c->n_groups && !code; g++) {
        rl_group *group = &r->c->groups[g];
        rl_session *session;
        rl_sequence *q = leader_of(r, g, &session);
        rl_scene *scenes = rl_arena_array(&r->arena, group->n, sizeof *scenes);
        if (!scenes)
            return rl_fail_memory(err, group->n * sizeof *scenes);
        for (size_t i = 0; i < group->n; i++) {
            const rl_sequence *own = rl_experiment_sequence(x, group->members[i], r->capture);
            scenes[i] = (rl_scene){own->materials, own->setup};
        }
        q->has_last = false;
        code = rl_executor_new(x->device, group->plan, scenes, group->n, session->threads, x->log,
                               &q->executor, err);
    }
    return code;
}

static void free_frames(rl_capture_run *r)
{
    for (int i = 0; i < RL_MOST_IN_FLIGHT; i++)
        for (size_t g = 0; r->slots[i].frames && g < r->c->n_groups; g++)
            rl_frame_free(&r->slots[i].frames[g]);
    for (size_t g = 0; g < r->c->n_groups; g++) {
        rl_session *session;
        rl_executor_free(&leader_of(r, g, &session)->executor);
    }
}

static rl_code run_capture(rl_experiment *x, size_t capture, const rl_experiment_hooks *hooks,
                           rl_run_summary *summary, size_t *done, size_t total, bool *stopped, rl_error *err)
{
    rl_capture_run *r = rl_calloc(1, sizeof *r);
    if (!r)
        return rl_fail_memory(err, sizeof *r);
    *r = (rl_capture_run){.x = x,
                          .capture = capture,
                          .c = &x->captures[capture],
                          .hooks = hooks,
                          .summary = summary,
                          .done = *done,
                          .total = total};
    if (hooks)
        r->notes = (rl_run_hooks){.stage = hooks->stage, .span = hooks->span, .ctx = hooks->ctx};
    const size_t n = rl_experiment_sequence(x, 0, capture)->frames.n;
    rl_batch batch = {.items = n,
                      .in_flight = r->c->in_flight,
                      .load = batch_load,
                      .run = batch_run,
                      .write = batch_write,
                      .stop = batch_stop,
                      .ctx = r};
    size_t finished = 0;
    rl_code code = make_room(r, err);
    if (!code)
        code = make_executors(r, err);
    if (!code)
        code = rl_batch_run(&batch, &finished, err);
    *stopped = !code && finished < n;
    *done = r->done;
    free_frames(r);
    rl_arena_free(&r->arena);
    rl_free(r);
    return code;
}

rl_code rl_experiment_run(rl_experiment *x, const rl_experiment_hooks *hooks, rl_run_summary *summary,
                          rl_error *err)
{
    rl_run_summary own;
    summary = summary ? summary : &own;
    *summary = (rl_run_summary){0};
    size_t total = 0, done = 0;
    bool stopped = false;
    for (size_t k = 0; k < x->n_captures; k++)
        total += rl_experiment_sequence(x, 0, k)->frames.n;
    rl_code code = rl_folder_make(x->options.out ? x->options.out : "out", err);
    if (!code && !x->device)
        code = rl_device_open(x->options.device, x->options.threads, x->log, &x->device, err);
    for (size_t i = 0; i < x->n && !code; i++)
        if (x->variants[i].files)
            rl_session_clean(x->sessions[i]);
    for (size_t k = 0; k < x->n_captures && !code && !stopped; k++)
        code = run_capture(x, k, hooks, summary, &done, total, &stopped, err);
    summary->peak_bytes = rl_alloc_peak();
    if (!code && stopped)
        code = rl_fail(err, RL_E_CANCELLED, RL_NOWHERE, "stopped after %zu of %zu frames", summary->frames,
                       total);
    return code;
}
