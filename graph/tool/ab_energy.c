#include "graph/tool/ab_energy.h"

#include <math.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/tool/ab_json.h"

_Static_assert((int)RL_ENERGY_ALL == (int)RL_AB_WHOLE, "no material is one index");

rl_code rl_ab_energy_add(rl_energy_ledger *ledger, const rl_ab_plan *plan, const rl_experiment_frame *frame,
                         rl_error *err)
{
    for (size_t i = 0; i < frame->n_energy; i++) {
        if (frame->energy[i].variant >= plan->n_listed)
            continue;
        rl_code code = rl_energy_ledger_push(ledger, &frame->energy[i], err);
        if (code)
            return code;
    }
    return RL_OK;
}

/* ---- metrics.json -------------------------------------------------------------------------------------- */

/* Sums of floats: more digits would not mean anything. */
static void rgb_json(rl_str *out, const char *name, const double v[3])
{
    rl_str_printf(out, ", \"%s\": [", name);
    for (int c = 0; c < 3; c++)
        rl_str_printf(out, isfinite(v[c]) ? "%s%.8g" : "%snull", c ? ", " : "", v[c]);
    rl_str_add(out, "]");
}

static void row_json(const rl_ab_report *r, const rl_energy_row *row, rl_str *out)
{
    const rl_energy *e = &row->energy;
    const char *material = rl_ab_material_name(r, row->capture, row->material);
    rl_str_printf(out, "{\"capture\": %zu, \"variant\": %zu, \"node\": ", row->capture, row->variant);
    rl_ab_json_text(out, row->node);
    rl_str_add(out, ", \"pass\": ");
    rl_ab_json_text(out, row->pass->name);
    rl_str_printf(out, ", \"frame\": %lld, \"material\": ", row->frame);
    if (material)
        rl_ab_json_text(out, material);
    else
        rl_str_add(out, "null");
    rl_str_printf(out, ", \"pixels\": %.0f", e->pixels);
    rgb_json(out, "in", e->in);
    rgb_json(out, "out", e->out);
    rgb_json(out, "border", e->border);
    rgb_json(out, "off_screen", e->off_screen);
    rgb_json(out, "clamped", e->clamped);
    rgb_json(out, "redistributed", e->redistributed);
    rl_str_add(out, "}");
}

void rl_ab_energy_json(const rl_ab_report *r, rl_str *out)
{
    if (!r->energy || !r->energy->n)
        return;
    rl_str_add(out, " \"energy\": [");
    for (size_t i = 0; i < r->energy->n && !out->failed; i++) {
        rl_str_add(out, i ? ",\n  " : "\n  ");
        row_json(r, &r->energy->rows[i], out);
    }
    rl_str_add(out, "],\n");
}

/* ---- --fail-over energy=X ------------------------------------------------------------------------------ */

rl_code rl_ab_energy_check(rl_arena *arena, const rl_ab_report *r, rl_ab_verdict *verdict, rl_error *err)
{
    const rl_energy_ledger none = {0}, *ledger = r->energy ? r->energy : &none;
    rl_ab_offender *over = rl_arena_array(arena, ledger->n + 1, sizeof *over);
    verdict->over = over;
    verdict->n_over = verdict->n_checked = 0;
    if (!over)
        return rl_fail_memory(err, ledger->n * sizeof *over);
    for (size_t i = 0; i < ledger->n; i++) {
        const rl_energy_row *row = &ledger->rows[i];
        if (!row->pass->conserves || row->material == RL_ENERGY_ALL)
            continue;
        double value = rl_energy_imbalance(&row->energy);
        verdict->n_checked++;
        if (value <= verdict->threshold.limit)
            continue;
        over[verdict->n_over++] = (rl_ab_offender){.capture = row->capture,
                                                   .frame = row->frame,
                                                   .material = row->material,
                                                   .pair = -1,
                                                   .variant = (int)row->variant,
                                                   .node = row->node,
                                                   .value = value};
    }
    if (verdict->n_checked)
        return RL_OK;
    return rl_fail_file(
        err, RL_E_DATA, "--fail-over",
        "there is no energy to check: no pass that scatters or combines has seen a material with a profile");
}
