/* Parts of metrics.json, each with the comma behind it. */
#ifndef RL_TOOL_AB_JSON_PARTS_H
#define RL_TOOL_AB_JSON_PARTS_H

#include "graph/tool/ab_json.h"

/* ab_json_graph.c: "graph", the merged graphs; "cost". */
void rl_ab_json_graph(const rl_ab_report *report, rl_str *out);
void rl_ab_json_cost(const rl_ab_report *report, rl_str *out);

#endif
