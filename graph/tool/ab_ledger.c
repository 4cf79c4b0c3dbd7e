/* The ledger of energy of `relit ab` where no limit asks for that of every frame: of each capture's last one.
 * Keeping it takes a filter twice the time, so that it has a run of its own, without pictures and outside of
 * the times that the report gives. The frame before it is run too, for its history. */
#include <stdio.h>
#include <string.h>

#include "graph/tool/ab_open.h"
#include "graph/tool/ab_run.h"
#include "graph/tool/signals.h"

typedef struct ledger_run {
    rl_ab_run *r;
    size_t capture, last; /* the frame's index in its run */
    rl_error failed;      /* of a frame: the run itself goes on */
} ledger_run;

static rl_code on_frame(void *ctx, const rl_experiment_frame *f, rl_error *err)
{
    ledger_run *l = ctx;
    rl_code code = f->error->code;
    if (code && !l->failed.code)
        l->failed = *f->error;
    for (size_t i = 0; i < f->n_energy && f->index == l->last && !code; i++) {
        rl_energy_row row = f->energy[i];
        row.capture = l->capture;
        code = rl_energy_ledger_push(&l->r->energy, &row, err);
    }
    return code;
}

static int on_stop(void *ctx)
{
    (void)ctx;
    return rl_signals_caught();
}

/* The rows name nodes of the experiment: it stays open until the report is written. */
static rl_code run_capture(rl_ab_run *r, size_t capture, const rl_ab_plan *plan, rl_error *err)
{
    const rl_session *first = rl_experiment_session(r->experiment, 0);
    const size_t n = rl_session_frames(first, capture);
    rl_options options = r->tool->args.run;
    char frames[64];
    if (!n)
        return RL_OK;
    snprintf(frames, sizeof frames, n > 1 ? "%lld,%lld" : "%lld",
             rl_session_frame(first, capture, n > 1 ? n - 2 : 0), rl_session_frame(first, capture, n - 1));
    options.frames = frames;
    options.energy = true;
    if (options.n_captures) {
        options.captures = &options.captures[capture];
        options.n_captures = 1;
    }
    rl_experiment **x = &r->ledgers[r->n_ledgers++];
    ledger_run l = {.r = r, .capture = capture, .last = n > 1};
    rl_experiment_hooks hooks = {.frame = on_frame, .stop = on_stop, .ctx = &l};
    rl_run_summary summary;
    rl_code code = rl_ab_open(plan, &options, x, err);
    if (!code)
        code = rl_experiment_run(*x, &hooks, &summary, err);
    if (!code && l.failed.code)
        *err = l.failed;
    return code ? code : l.failed.code;
}

rl_code rl_ab_ledger(rl_ab_run *r, rl_error *err)
{
    rl_ab_plan plan = r->plan;
    const size_t n = rl_session_captures(rl_experiment_session(r->experiment, 0));
    rl_variant *variants = rl_arena_array(r->tool->arena, plan.n_listed, sizeof *variants);
    r->ledgers = rl_arena_array(r->tool->arena, n, sizeof(rl_experiment *));
    if (!variants || !r->ledgers)
        return rl_fail_memory(err, plan.n_listed * sizeof *variants);
    for (size_t i = 0; i < plan.n_listed; i++) {
        variants[i] = plan.variants[i];
        variants[i].files = false;
    }
    plan.variants = variants;
    plan.n_variants = plan.n_listed;
    rl_code code = RL_OK;
    for (size_t i = 0; i < n && !code; i++)
        code = run_capture(r, i, &plan, err);
    return code;
}
