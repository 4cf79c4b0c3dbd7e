/* The plain sentences at the top of the report and of what `relit ab` prints: what differs most, where, and
 * whether chance could have done it. */
#ifndef RL_TOOL_AB_WORDS_H
#define RL_TOOL_AB_WORDS_H

#include "graph/tool/ab_report.h"

/* Adds one to four sentences on one line, without a line's end. report->summary is not looked at.
 * RL_E_MEMORY. */
rl_code rl_ab_words(const rl_ab_report *report, rl_str *out, rl_error *err);

#endif
