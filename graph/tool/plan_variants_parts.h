/* Inside of rl_plan_variants_print: plan_variants.c and plan_variants_json.c. */
#ifndef RL_TOOL_PLAN_VARIANTS_PARTS_H
#define RL_TOOL_PLAN_VARIANTS_PARTS_H

#include "graph/tool/plan_variants.h"

/* Whether all variants need the node. */
bool rl_variants_share(const rl_ab_plan *plan, const rl_merged_node *node);
/* The names of those that do. */
void rl_variants_users(const rl_ab_plan *plan, const rl_merged_node *node, const char *between, rl_str *out);
/* The merged plan of a group, as rl_session_plan prints one. */
rl_code rl_variants_group_plan(const rl_ab_plan *plan, const rl_experiment *experiment, size_t capture,
                               size_t group, rl_plan_format format, rl_str *out, rl_error *err);

/* What rl_ab_measure takes for a frame: clamped pictures, and maps of all metrics (ab.h). */
size_t rl_variants_compare_bytes(const rl_ab_plan *plan, const rl_experiment *experiment, size_t capture);

rl_code rl_plan_variants_json(const rl_ab_plan *plan, const rl_experiment *experiment, rl_str *out,
                              rl_error *err);

#endif
