/* metrics.json of `relit ab`: one object, described in configs/README.md. Numbers that do not exist, and
 * infinite ones, are null. Arrays are in the plan's order; `metrics` is in that of rl_ab_results. */
#ifndef RL_TOOL_AB_JSON_H
#define RL_TOOL_AB_JSON_H

#include "graph/tool/ab_report.h"

/* Adds the object and a line's end. RL_E_MEMORY. Write it with rl_file_write: whole or not at all. */
rl_code rl_ab_json(const rl_ab_report *report, rl_str *out, rl_error *err);

/* A string in quotes, escaped; bytes that are not UTF-8 become '?'. */
void rl_ab_json_text(rl_str *out, const char *text);
/* The shortest text that reads back as the number; null when it is not finite. */
void rl_ab_json_number(rl_str *out, double value);

#endif
