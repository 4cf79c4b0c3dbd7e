/* Each frame of `relit ab`: measured, kept for the page and the sheet, reported. */
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/tool/ab_energy.h"
#include "graph/tool/ab_run.h"
#include "graph/tool/signals.h"

static rl_code note_failure(rl_ab_run *r, const rl_experiment_frame *f, const rl_error *why, rl_error *err)
{
    if (r->n_failures == r->room_failures) {
        size_t room = r->room_failures ? 2 * r->room_failures : 16;
        rl_ab_failure *grown = rl_realloc(r->failures, room * sizeof *grown);
        if (!grown)
            return rl_fail_memory(err, room * sizeof *grown);
        r->failures = grown;
        r->room_failures = room;
    }
    char *text = rl_arena_strdup(r->tool->arena, why->text);
    if (!text)
        return rl_fail_memory(err, strlen(why->text));
    r->failures[r->n_failures++] = (rl_ab_failure){f->capture, f->frame, text};
    return RL_OK;
}

/* All that was written of the frame, by all variants. */
static const char **list_files(const rl_ab_run *r, const rl_experiment_frame *f, size_t *n)
{
    size_t count = 0;
    for (size_t v = 0; f->n_files && v < r->plan.n_variants; v++)
        count += f->n_files[v];
    const char **list = rl_calloc(count, sizeof *list);
    *n = 0;
    for (size_t v = 0; list && f->n_files && v < r->plan.n_variants; v++)
        for (size_t i = 0; i < f->n_files[v]; i++)
            list[(*n)++] = f->files[v][i];
    return list;
}

static void report_frame(const rl_ab_run *r, const rl_experiment_frame *f, const rl_error *error)
{
    rl_frame_result result = {
        .capture = rl_session_capture_name(rl_experiment_session(r->experiment, 0), f->capture),
        .frame = f->frame,
        .error = error,
        .load_s = -1, /* the variants share stages: no times of one frame */
        .done = f->done,
        .total = f->total};
    const char **files = list_files(r, f, &result.n_files);
    result.files = files;
    rl_report_frame(r->tool->report, &result);
    rl_free(files);
}

static rl_code compare(rl_ab_run *r, const rl_experiment_frame *f, rl_error *err)
{
    rl_code code = rl_ab_measure_frame(r->measure, f, err);
    if (!code)
        code = rl_ab_page_measured(r->page, f, r->measure, rl_ab_measure_reference(r->measure), err);
    if (!code && r->sheet)
        code = rl_ab_sheet_frame(r->sheet, f, err);
    if (!code)
        code = rl_ab_energy_add(&r->energy, &r->plan, f, err);
    r->frames += !code;
    r->incomparable |= code == RL_E_DATA;
    return code;
}

static rl_code on_frame(void *ctx, const rl_experiment_frame *f, rl_error *err)
{
    rl_ab_run *r = ctx;
    rl_error error = *f->error;
    rl_code code = error.code ? RL_OK : compare(r, f, &error), noted = RL_OK;
    if (error.code)
        noted = note_failure(r, f, &error, err);
    report_frame(r, f, &error);
    return code ? rl_fail(err, code, RL_NOWHERE, "%s", error.text) : noted;
}

static void on_stage(void *ctx, rl_lane lane, long long frame)
{
    rl_report_stage(((rl_ab_run *)ctx)->tool->report, lane, frame);
}

static void on_span(void *ctx, const rl_run_span *span)
{
    rl_trace_add(((rl_ab_run *)ctx)->trace, span);
}

static int on_stop(void *ctx)
{
    (void)ctx;
    return rl_signals_caught();
}

void rl_ab_run_hooks(rl_ab_run *r, rl_experiment_hooks *out)
{
    *out = (rl_experiment_hooks){
        .frame = on_frame, .stop = on_stop, .ctx = r, .stage = on_stage, .span = r->trace ? on_span : NULL};
}
