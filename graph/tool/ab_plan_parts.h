/* The parts of rl_ab_plan_make that live in files of their own. Not for others. */
#ifndef RL_TOOL_AB_PLAN_PARTS_H
#define RL_TOOL_AB_PLAN_PARTS_H

#include "graph/model/pipeline.h"
#include "graph/tool/ab.h"

/* ab_parameters.c: the values that are not the same in all of n trees, in the order in which they come. Maps
 * are looked into, lists are values. */
rl_code rl_ab_parameters(rl_arena *arena, const rl_value *const *roots, size_t n, rl_ab_plan *plan,
                         rl_error *err);

/* ab_seeds.c: the settings for `n` replicates of a pipeline with other seeds, out[n] in the arena, each with
 * *n_settings of them: 0 when chance has no part in it. `captures` (n_captures of them) replace the
 * pipeline's own. RL_E_USAGE when a seed has fewer values than are needed. */
rl_code rl_ab_seeds(rl_arena *arena, const rl_pipeline *pipeline, const char *const *captures,
                    size_t n_captures, size_t n, const rl_setting **out, size_t *n_settings, rl_error *err);

#endif
