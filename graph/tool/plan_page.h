/* `relit plan --format html`: one page that needs nothing else. */
#ifndef RL_TOOL_PLAN_PAGE_H
#define RL_TOOL_PLAN_PAGE_H

#include "graph/base/error.h"
#include "graph/base/text.h"

/* `plans`: what --format json prints, an object a line. `trace`: a file that `relit run --trace` wrote, or
 * NULL: its mean times a frame are shown. RL_E_FORMAT when it is no such file. */
rl_code rl_plan_page(const char *title, const char *plans, const char *trace, rl_str *out, rl_error *err);

#endif
