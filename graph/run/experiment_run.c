/* The frames of an experiment: read once a group, run in one plan a group, written and handed out a variant.
 */
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/run/batch.h"
#include "graph/run/experiment_parts.h"
#include "graph/run/session_notes.h"

typedef struct slot {
    rl_frame *frames;  /* [groups] */
    rl_loaded *loaded; /* [groups] */
    rl_error error;    /* of any group */
    bool skipped;
} slot;

typedef struct run_state {
    rl_experiment *x;
    size_t capture;
    rl_experiment_capture *c;
    const rl_experiment_hooks *hooks;
    rl_run_hooks notes; /* its stage and span, as sessions take them */
    rl_run_summary *summary;
    slot slots[RL_MOST_IN_FLIGHT];
    rl_span **spans;          /* [groups][steps] */
    rl_scene_values **scenes; /* [groups][members] */
    size_t done, total;
    rl_arena arena;
} run_state;

static rl_sequence *leader_of(const run_state *r, size_t group, rl_session **session)
{
    size_t leader = r->c->groups[group].members[0];
    *session = r->x->sessions[leader];
    return rl_experiment_sequence(r->x, leader, r->capture);
}

/* ---- reading --------------------------------------------------------------------------------------------
 */

static void batch_load(void *ctx, size_t item, int index)
{
    run_state *r = ctx;
    slot *s = &r->slots[index];
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

static void run_group(run_state *r, size_t group, rl_frame *f, const rl_loaded *loaded)
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
    run_state *r = ctx;
    slot *s = &r->slots[index];
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

/* ---- writing, handing out -------------------------------------------------------------------------------
 */

/* What is handed out of a frame, and what has to be unmapped after it. */
typedef struct delivery {
    rl_experiment_frame frame;
    rl_compared_image (*images)[RL_COMPARED];
    const char ***files;
    size_t *n_files;
    rl_memory **mapped;
    size_t n_mapped;
    rl_energy_ledger energy;
    rl_arena arena;
} delivery;

static size_t group_of(const rl_experiment_capture *c, size_t variant)
{
    for (size_t g = 0; g < c->n_groups; g++)
        for (size_t i = 0; i < c->groups[g].n; i++)
            if (c->groups[g].members[i] == variant)
                return g;
    return 0;
}

static rl_code map_output(const run_state *r, delivery *d, const rl_frame *f, size_t variant, size_t hidden,
                          size_t layer, rl_sink_image *out, rl_error *err)
{
    const rl_session *s = r->x->sessions[variant];
    const rl_sequence *q = rl_experiment_sequence(r->x, variant, r->capture);
    rl_memory *memory = NULL;
    rl_code code = rl_session_map_image(
        q, f, q->plan->outputs[q->first_output + s->n_outputs + hidden][layer], out, &memory, err);
    if (memory)
        d->mapped[d->n_mapped++] = memory;
    return code;
}

static rl_code map_variant(const run_state *r, delivery *d, const rl_frame *f, size_t variant, rl_error *err)
{
    rl_code code = RL_OK;
    for (size_t k = 0; k < RL_COMPARED && !code; k++) {
        rl_sink_image image = {0};
        code = map_output(r, d, f, variant, RL_HIDDEN_COMPARED + k, 0, &image, err);
        if (code)
            break;
        d->images[variant][k] = (rl_compared_image){
            .width = f->geometry.width, .height = f->geometry.height, .stride = image.stride};
        for (size_t p = 0; p < 3; p++)
            d->images[variant][k].plane[p] = image.pixels + p * image.plane;
    }
    return code;
}

static rl_code write_variant(run_state *r, delivery *d, rl_frame *f, size_t variant, rl_error *err)
{
    rl_session *s = r->x->sessions[variant];
    rl_sequence *q = rl_experiment_sequence(r->x, variant, r->capture);
    d->files[variant] = rl_arena_array(&d->arena, s->n_outputs + 1, sizeof **d->files);
    if (!d->files[variant])
        return rl_fail_memory(err, s->n_outputs * sizeof **d->files);
    double start = rl_state_now();
    rl_code code = RL_OK;
    if (r->x->variants[variant].files)
        code = rl_session_write_frame(s, q, f, &r->notes, &d->arena, d->files[variant], &d->n_files[variant],
                                      err);
    r->c->write_ns[variant] += 1e9 * (rl_state_now() - start);
    return code;
}

static rl_code make_delivery(const run_state *r, delivery *d, rl_error *err)
{
    const size_t n = r->x->n;
    d->images = rl_arena_array(&d->arena, n, sizeof *d->images);
    d->files = rl_arena_array(&d->arena, n, sizeof *d->files);
    d->n_files = rl_arena_array(&d->arena, n, sizeof *d->n_files);
    d->mapped = rl_arena_array(&d->arena, RL_COMPARED * n + 1, sizeof(rl_memory *));
    bool good = d->images && d->files && d->n_files && d->mapped;
    return good ? RL_OK : rl_fail_memory(err, n * sizeof *d->images);
}

static rl_code deliver(run_state *r, slot *s, delivery *d, rl_error *err)
{
    rl_code code = s->error.code;
    if (r->c->write_frames == 1 && !r->c->write_warm) {
        memset(r->c->write_ns, 0, r->x->n * sizeof *r->c->write_ns);
        r->c->write_frames = 0;
        r->c->write_warm = true;
    }
    r->c->write_frames++;
    for (size_t v = 0; v < r->x->n && !code; v++) {
        rl_frame *f = &s->frames[group_of(r->c, v)];
        code = write_variant(r, d, f, v, err);
        if (!code)
            code = map_variant(r, d, f, v, err);
    }
    for (size_t g = 0; g < r->c->n_groups && !code; g++)
        code = rl_experiment_read_energy(r->x, r->capture, g, &s->frames[g], &d->energy, err);
    d->frame.energy = d->energy.rows;
    d->frame.n_energy = d->energy.n;
    rl_sink_image stencil = {0};
    if (!code)
        code =
            map_output(r, d, &s->frames[0], r->c->groups[0].members[0], RL_HIDDEN_REQUIRED, 1, &stencil, err);
    d->frame.stencil = (const uint32_t *)(const void *)stencil.pixels;
    d->frame.stencil_stride = stencil.stride;
    return code;
}

static void count(run_state *r, const slot *s)
{
    r->done++;
    r->summary->frames++;
    r->summary->failed += s->error.code != RL_OK;
    for (size_t g = 0; g < r->c->n_groups; g++) {
        r->summary->nonfinite += s->frames[g].nonfinite;
        r->summary->clamped += s->frames[g].clamped;
        r->summary->clipped += s->frames[g].clipped;
    }
}

static void batch_write(void *ctx, size_t item, int index)
{
    run_state *r = ctx;
    slot *s = &r->slots[index];
    const rl_frame *first = &s->frames[0];
    delivery d = {.frame = {.capture = r->capture, .index = item, .frame = first->number}};
    double start = rl_state_now();
    rl_session_stage(&r->notes, RL_LANE_WRITE, first);
    if (!s->error.code && !make_delivery(r, &d, &s->error))
        deliver(r, s, &d, &s->error);
    d.frame.error = &s->error;
    d.frame.x = first->geometry.x;
    d.frame.y = first->geometry.y;
    d.frame.width = first->geometry.width;
    d.frame.height = first->geometry.height;
    d.frame.images = (const rl_compared_image(*)[RL_COMPARED])d.images;
    d.frame.files = (const char *const *const *)d.files;
    d.frame.n_files = d.n_files;
    d.frame.done = r->done + 1;
    d.frame.total = r->total;
    if (s->skipped)
        s->error = (rl_error){0};
    else if (r->hooks && r->hooks->frame) {
        rl_error own = {0};
        double begin = rl_state_now();
        if (r->hooks->frame(r->hooks->ctx, &d.frame, &own) && !s->error.code)
            s->error = own;
        rl_session_span(&r->notes, rl_experiment_sequence(r->x, 0, r->capture), first, RL_LANE_WRITE,
                        "compare", "compare", begin);
    }
    for (size_t i = 0; i < d.n_mapped; i++)
        rl_memory_unmap(d.mapped[i], NULL); /* what was read has been read */
    rl_session_span(&r->notes, rl_experiment_sequence(r->x, 0, r->capture), first, RL_LANE_WRITE, "write",
                    "write", start);
    count(r, s);
    for (size_t g = 0; g < r->c->n_groups; g++)
        rl_frame_release(&s->frames[g]);
    rl_energy_ledger_free(&d.energy);
    rl_arena_free(&d.arena);
}

/* ---- a capture, all captures ----------------------------------------------------------------------------
 */

static int batch_stop(void *ctx)
{
    const run_state *r = ctx;
    return r->hooks && r->hooks->stop ? r->hooks->stop(r->hooks->ctx) : 0;
}

static rl_code make_room(run_state *r, rl_error *err)
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

static rl_code make_executors(run_state *r, rl_error *err)
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

static void free_frames(run_state *r)
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
    run_state *r = rl_calloc(1, sizeof *r);
    if (!r)
        return rl_fail_memory(err, sizeof *r);
    *r = (run_state){.x = x,
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
