/* What `relit plan --vary` and `relit plan A B …` print: what the variants share, and what that saves. */
#ifndef RL_TOOL_PLAN_VARIANTS_H
#define RL_TOOL_PLAN_VARIANTS_H

#include "graph/tool/ab.h"

/* "4 variants = 1.6x one (4.0x one after the other)". */
void rl_cost_sentence(const rl_experiment_cost *cost, size_t variants, rl_str *out);

/* As `relit plan` prints one pipeline: text for all captures; one JSON object a capture, each on its line;
 * DOT and SVG of the first capture, the nodes that not all variants have marked (a group of variants that
 * reads the frames on its own is another drawing: RL_E_USAGE says so). */
rl_code rl_plan_variants_print(const rl_ab_plan *plan, const rl_experiment *experiment, rl_plan_word word,
                               rl_str *out, rl_error *err);

#endif
