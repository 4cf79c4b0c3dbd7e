/* The ledger of energy in the report of `relit ab`: rows of metrics.json, and --fail-over energy=X. */
#ifndef RL_TOOL_AB_ENERGY_H
#define RL_TOOL_AB_ENERGY_H

#include "graph/tool/ab_fail.h"

/* Adds the rows of a frame's listed variants. RL_E_MEMORY. */
rl_code rl_ab_energy_add(rl_energy_ledger *ledger, const rl_ab_plan *plan, const rl_experiment_frame *frame,
                         rl_error *err);

/* Adds ` "energy": […],` and a line's end, a row a line; nothing without a ledger. Material null: all pixels.
 */
void rl_ab_energy_json(const rl_ab_report *report, rl_str *out);

/* A threshold of RL_THRESHOLD_ENERGY: over is every material in every frame where a pass that should conserve
 * energy (rl_pass.conserves) gives |in - out| / in beyond the limit in some channel. RL_E_DATA when there is
 * no such pass. */
rl_code rl_ab_energy_check(rl_arena *arena, const rl_ab_report *report, rl_ab_verdict *verdict,
                           rl_error *err);

#endif
