/* A frame of an experiment that ran: written a variant, handed out with its pictures and energy, counted. */
#include <string.h>

#include "graph/run/experiment_parts.h"
#include "graph/run/session_notes.h"

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

static rl_code map_output(const rl_capture_run *r, delivery *d, const rl_frame *f, size_t variant,
                          size_t hidden, size_t layer, rl_sink_image *out, rl_error *err)
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

static rl_code map_variant(const rl_capture_run *r, delivery *d, const rl_frame *f, size_t variant,
                           rl_error *err)
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

static rl_code write_variant(rl_capture_run *r, delivery *d, rl_frame *f, size_t variant, rl_error *err)
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

static rl_code make_delivery(const rl_capture_run *r, delivery *d, rl_error *err)
{
    const size_t n = r->x->n;
    d->images = rl_arena_array(&d->arena, n, sizeof *d->images);
    d->files = rl_arena_array(&d->arena, n, sizeof *d->files);
    d->n_files = rl_arena_array(&d->arena, n, sizeof *d->n_files);
    d->mapped = rl_arena_array(&d->arena, RL_COMPARED * n + 1, sizeof(rl_memory *));
    bool good = d->images && d->files && d->n_files && d->mapped;
    return good ? RL_OK : rl_fail_memory(err, n * sizeof *d->images);
}

static rl_code deliver(rl_capture_run *r, rl_run_slot *s, delivery *d, rl_error *err)
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

static void count(rl_capture_run *r, const rl_run_slot *s)
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

void rl_experiment_write(rl_capture_run *r, size_t item, rl_run_slot *s)
{
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
