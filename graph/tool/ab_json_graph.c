/* The merged graphs of the captures, and what the run cost. */
#include <string.h>

#include "graph/tool/ab_json_parts.h"

/* Of a group, one after the other, from `at` on in the capture's list; false behind the last. */
static bool next_node(const rl_experiment *e, size_t capture, size_t group, size_t *at, rl_merged_node *out)
{
    while (rl_experiment_node(e, capture, *at, out)) {
        ++*at;
        if (out->group == group)
            return true;
    }
    return false;
}

/* The name of a node of the group's graph; "" when it is none that runs. */
static const char *node_name(const rl_experiment *e, size_t capture, size_t group, int node)
{
    rl_merged_node m;
    for (size_t at = 0; next_node(e, capture, group, &at, &m);)
        if (m.node == node)
            return m.name;
    return "";
}

/* Which of the listed variants need the node; returns how many. */
static size_t print_variants(const rl_ab_report *r, const rl_merged_node *m, rl_str *out)
{
    size_t n = 0;
    for (size_t v = 0; v < r->plan->n_listed; v++)
        if (m->used[v])
            rl_str_printf(out, "%s%zu", n++ ? ", " : "", v);
    return n;
}

static bool is_listed(const rl_ab_report *r, const rl_merged_node *m)
{
    for (size_t v = 0; v < r->plan->n_listed; v++)
        if (m->used[v])
            return true;
    return false;
}

/* Replicates are no part of what was asked: nodes of theirs alone are left out. */
static void nodes_json(const rl_ab_report *r, size_t capture, size_t group, rl_str *out)
{
    rl_merged_node m;
    size_t count = 0;
    rl_str_add(out, "\"nodes\": [");
    for (size_t at = 0; next_node(r->experiment, capture, group, &at, &m);) {
        if (!is_listed(r, &m))
            continue;
        rl_str_add(out, count++ ? ",\n    {\"name\": " : "\n    {\"name\": ");
        rl_ab_json_text(out, m.name);
        rl_str_add(out, ", \"pass\": ");
        rl_ab_json_text(out, m.pass->name);
        rl_str_add(out, ", \"variants\": [");
        size_t n = print_variants(r, &m, out);
        rl_str_printf(out, "], \"varied\": %s, \"ms\": ", n < r->plan->n_listed ? "true" : "false");
        if (m.ms >= 0)
            rl_ab_json_number(out, m.ms);
        else
            rl_str_add(out, "null");
        rl_str_add(out, "}");
    }
    rl_str_add(out, "]");
}

static void edges_json(const rl_ab_report *r, size_t capture, size_t group, rl_str *out)
{
    const rl_graph *graph = rl_experiment_plan(r->experiment, capture, group)->graph;
    rl_merged_node m;
    size_t count = 0;
    rl_str_add(out, ",\n   \"edges\": [");
    for (size_t at = 0; next_node(r->experiment, capture, group, &at, &m);) {
        const rl_graph_node *node = &graph->nodes[m.node];
        for (size_t p = 0; is_listed(r, &m) && p < m.pass->ports.n; p++) {
            const rl_port *port = &m.pass->ports.rows[p];
            if (node->images[p] < 0 || (port->role != RL_READ && port->role != RL_HISTORY))
                continue;
            const rl_image *image = &graph->images[node->images[p]];
            rl_str_add(out, count++ ? ",\n    {\"from\": " : "\n    {\"from\": ");
            rl_ab_json_text(out, image->node < 0 ? "capture"
                                                 : node_name(r->experiment, capture, group, image->node));
            rl_str_add(out, ", \"to\": ");
            rl_ab_json_text(out, m.name);
            rl_str_add(out, ", \"image\": ");
            rl_ab_json_text(out, image->name);
            rl_str_add(out, ", \"port\": ");
            rl_ab_json_text(out, port->name);
            rl_str_printf(out, ", \"history\": %s}", port->role == RL_HISTORY ? "true" : "false");
        }
    }
    rl_str_add(out, "]");
}

void rl_ab_json_graph(const rl_ab_report *r, rl_str *out)
{
    size_t captures = rl_session_captures(rl_experiment_session(r->experiment, 0)), count = 0;
    rl_str_add(out, " \"graph\": [");
    for (size_t c = 0; c < captures; c++) {
        for (size_t g = 0; g < rl_experiment_groups(r->experiment, c); g++) {
            const char *reason = rl_experiment_group_reason(r->experiment, c, g);
            rl_str_printf(
                out, "%s{\"capture\": %zu, \"group\": %zu, \"reason\": ", count++ ? ",\n  " : "\n  ", c, g);
            if (reason)
                rl_ab_json_text(out, reason);
            else
                rl_str_add(out, "null");
            rl_str_add(out, ",\n   ");
            nodes_json(r, c, g, out);
            edges_json(r, c, g, out);
            rl_str_add(out, "}");
        }
    }
    rl_str_add(out, "],\n");
}

void rl_ab_json_cost(const rl_ab_report *r, rl_str *out)
{
    rl_experiment_cost cost = {0};
    rl_experiment_cost_of(r->experiment, &cost);
    rl_str_add(out, " \"cost\": {\"factor\": ");
    rl_ab_json_number(out, cost.factor);
    rl_str_add(out, ", \"sum\": ");
    rl_ab_json_number(out, cost.sum);
    rl_str_printf(out, ", \"measured\": %s, \"frames\": %zu, \"seconds\": ", cost.measured ? "true" : "false",
                  r->frames);
    rl_ab_json_number(out, r->seconds);
    rl_str_printf(out, ", \"variants\": %zu},\n", r->plan->n_variants);
}
