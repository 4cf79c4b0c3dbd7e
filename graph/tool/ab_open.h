/* What `relit ab` and `relit plan --vary` begin with. */
#ifndef RL_TOOL_AB_OPEN_H
#define RL_TOOL_AB_OPEN_H

#include "graph/tool/ab.h"

/* The experiment of a plan. Errors about a varied value give "--vary PATH=VALUE" as their place. */
rl_code rl_ab_open(const rl_ab_plan *plan, const rl_options *options, rl_experiment **out, rl_error *err);

#endif
