#include "graph/tool/ab_fail.h"

#include <math.h>

#include "graph/tool/ab_energy.h"

enum { SHOWN = 5 }; /* offenders of a threshold that are printed */

/* ---- what is over -------------------------------------------------------------------------------------- */

static rl_code check_one(rl_arena *arena, const rl_ab_results *r, rl_ab_verdict *verdict, rl_error *err)
{
    const rl_threshold *t = &verdict->threshold;
    rl_ab_offender *over = NULL;
    size_t n = 0;
    for (int pass = 0; pass < 2; pass++) { /* counts, then fills */
        if (pass && n) {
            over = rl_arena_array(arena, n, sizeof *over);
            if (!over)
                return rl_fail_memory(err, n * sizeof *over);
        }
        n = verdict->n_checked = 0;
        for (size_t i = 0; i < r->n_values; i++) {
            const rl_ab_value *v = &r->values[i];
            if ((int)v->metric != t->metric || isnan(v->stats[t->stat]))
                continue;
            verdict->n_checked++;
            if (!rl_threshold_is_over(v->metric, t->limit, v->stats[t->stat]))
                continue;
            if (over)
                over[n] = (rl_ab_offender){.capture = v->capture,
                                           .frame = v->frame,
                                           .material = v->material,
                                           .pair = (int)v->pair,
                                           .variant = -1,
                                           .value = v->stats[t->stat]};
            n++;
        }
    }
    verdict->over = over;
    verdict->n_over = n;
    return RL_OK;
}

rl_code rl_ab_fail_check(rl_arena *arena, const rl_ab_report *report, const rl_threshold *thresholds,
                         size_t n, rl_ab_verdict **out, rl_error *err)
{
    rl_ab_verdict *verdicts = *out = rl_arena_array(arena, n + 1, sizeof *verdicts);
    char name[32];
    if (!verdicts)
        return rl_fail_memory(err, n * sizeof *verdicts);
    for (size_t i = 0; i < n; i++) {
        rl_threshold *t = &verdicts[i].threshold;
        *t = thresholds[i];
        if (t->metric == RL_THRESHOLD_SHOWN)
            t->metric = RL_METRIC_FLIP;
        if (t->metric == RL_THRESHOLD_ENERGY) {
            if (rl_ab_energy_check(arena, report, &verdicts[i], err))
                return err->code;
            continue;
        }
        if (check_one(arena, report->results, &verdicts[i], err))
            return err->code;
        if (!verdicts[i].n_checked)
            return rl_fail_file(err, RL_E_DATA, "--fail-over", "there is no %s to check%s",
                                rl_threshold_name(t, name),
                                !report->results->n_values ? ": no frame was compared"
                                : report->plan->against    ? ": the files of --against do not give its image"
                                                           : "");
    }
    return RL_OK;
}

size_t rl_ab_fail_count(const rl_ab_report *report)
{
    size_t n = 0;
    for (size_t i = 0; i < report->n_verdicts; i++)
        n += report->verdicts[i].n_over > 0;
    return n;
}

/* ---- what is printed ----------------------------------------------------------------------------------- */

void rl_ab_fail_offender(const rl_ab_report *report, const rl_ab_offender *o, rl_str *out)
{
    const char *material = rl_ab_material_name(report, o->capture, o->material);
    const rl_session *session = rl_experiment_session(report->experiment, 0);
    if (o->pair >= 0)
        rl_str_printf(out, "%s against %s", rl_ab_test_name(report, (size_t)o->pair),
                      rl_ab_reference_name(report, (size_t)o->pair));
    else
        rl_str_printf(out, "%s, pass '%s'", report->plan->variants[o->variant].name, o->node);
    rl_str_printf(out, ", %s", material ? material : "all materials");
    if (rl_session_captures(session) > 1)
        rl_str_printf(out, ", capture '%s'", rl_ab_capture_name(report, o->capture));
    rl_str_printf(out, ", frame %lld: %.4g", o->frame, o->value);
}

/* The worst of those behind `taken`, by how far they are over: a few passes over the list instead of a sorted
 * copy of it. */
static const rl_ab_offender *next_worst(const rl_ab_verdict *v, const rl_ab_offender *last)
{
    bool rises = v->threshold.metric >= 0 && rl_metric_rises((rl_metric)v->threshold.metric);
    const rl_ab_offender *best = NULL;
    for (size_t i = 0; i < v->n_over; i++) {
        const rl_ab_offender *o = &v->over[i];
        double sign = rises ? -1 : 1, value = sign * o->value;
        if (last && (value > sign * last->value || (value >= sign * last->value && o <= last)))
            continue;
        if (!best || value > sign * best->value)
            best = o;
    }
    return best;
}

void rl_ab_fail_print(const rl_ab_report *report, rl_str *out)
{
    char name[32];
    for (size_t i = 0; i < report->n_verdicts; i++) {
        const rl_ab_verdict *v = &report->verdicts[i];
        if (!v->n_over)
            continue;
        bool under = v->threshold.metric >= 0 && rl_metric_rises((rl_metric)v->threshold.metric);
        rl_str_printf(out, "%s is %s %g in %zu place%s:\n", rl_threshold_name(&v->threshold, name),
                      under ? "under" : "over", v->threshold.limit, v->n_over, v->n_over == 1 ? "" : "s");
        const rl_ab_offender *o = NULL;
        for (size_t k = 0; k < SHOWN && (o = next_worst(v, o)); k++) {
            rl_str_add(out, "  ");
            rl_ab_fail_offender(report, o, out);
            rl_str_add(out, "\n");
        }
        if (v->n_over > SHOWN)
            rl_str_printf(out, "  and %zu more\n", v->n_over - SHOWN);
    }
}
