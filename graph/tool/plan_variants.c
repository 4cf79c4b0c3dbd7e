#include "graph/tool/plan_variants.h"

#include <string.h>

#include "graph/run/session.h"
#include "graph/tool/plan_variants_parts.h"
#include "graph/tool/svg.h"

void rl_cost_sentence(const rl_experiment_cost *cost, size_t variants, rl_str *out)
{
    rl_str_printf(out, "%zu %s = %.2fx one (%.2fx one after the other)", variants,
                  variants == 1 ? "variant" : "variants", cost->factor, cost->sum);
}

bool rl_variants_share(const rl_ab_plan *plan, const rl_merged_node *node)
{
    return node->n_used == plan->n_variants;
}

void rl_variants_users(const rl_ab_plan *plan, const rl_merged_node *node, const char *between, rl_str *out)
{
    bool any = false;
    for (size_t v = 0; v < plan->n_variants; v++) {
        if (!node->used[v])
            continue;
        rl_str_printf(out, "%s%s", any ? between : "", plan->variants[v].name);
        any = true;
    }
}

/* A variant of the group, whose session prints the group's plan; false when no node of it runs. */
static bool session_of(const rl_ab_plan *plan, const rl_experiment *e, size_t capture, size_t group,
                       const rl_session **out)
{
    rl_merged_node node;
    for (size_t i = 0; rl_experiment_node(e, capture, i, &node); i++)
        for (size_t v = 0; node.group == group && v < plan->n_variants; v++)
            if (node.used[v]) {
                *out = rl_experiment_session(e, v);
                return true;
            }
    return false;
}

rl_code rl_variants_group_plan(const rl_ab_plan *plan, const rl_experiment *e, size_t capture, size_t group,
                               rl_plan_format format, rl_str *out, rl_error *err)
{
    const rl_session *session = NULL;
    char *text = NULL;
    rl_code code = RL_OK;
    if (session_of(plan, e, capture, group, &session)) {
        code = rl_session_plan(session, capture, format, &text, err);
        if (!code)
            rl_str_add(out, text);
        rl_text_free(text);
        return code;
    }
    const rl_plan *merged = rl_experiment_plan(e, capture, group);
    if (format == RL_PLAN_TEXT)
        rl_plan_print_text(merged, NULL, 1, out);
    else if (format == RL_PLAN_DOT)
        rl_plan_print_dot(merged, NULL, 1, out);
    else
        code = rl_plan_print_json(merged, NULL, 1, out, err);
    return code;
}

size_t rl_variants_compare_bytes(const rl_ab_plan *plan, const rl_experiment *e, size_t capture)
{
    const rl_geometry *g = &rl_experiment_session(e, 0)->sequences[capture].geometry;
    size_t planes = 3 * plan->n_variants + (size_t)RL_METRICS * plan->n_pairs;
    return planes * (size_t)g->width * (size_t)g->height * sizeof(float);
}

/* ---- text ---------------------------------------------------------------------------------------------- */

static void print_variants(const rl_ab_plan *plan, const rl_experiment *e, rl_str *out)
{
    rl_experiment_cost cost;
    int width = 0;
    for (size_t v = 0; v < plan->n_variants; v++)
        width = (int)strlen(plan->variants[v].name) > width ? (int)strlen(plan->variants[v].name) : width;
    rl_str_add(out, "variants\n");
    for (size_t v = 0; v < plan->n_variants; v++) {
        const rl_variant *variant = &plan->variants[v];
        rl_str_printf(out, "  %-*s  %s", width, variant->name, variant->pipeline);
        for (size_t i = 0; i < variant->n_settings; i++)
            rl_str_printf(out, "  %s=%s", variant->settings[i].path, variant->settings[i].value);
        rl_str_add(out, "\n");
    }
    rl_experiment_cost_of(e, &cost);
    rl_str_add(out, "\npredicted cost\n  ");
    rl_cost_sentence(&cost, plan->n_variants, out);
    rl_str_add(out, "\n");
}

static void node_width(size_t *width, const char *text)
{
    size_t n = strlen(text);
    *width = n > *width ? n : *width;
}

static void print_nodes(const rl_ab_plan *plan, const rl_experiment *e, size_t capture, size_t group,
                        rl_str *out)
{
    rl_merged_node node;
    size_t name = 0, pass = 0;
    for (size_t i = 0; rl_experiment_node(e, capture, i, &node); i++) {
        node_width(&name, node.name);
        node_width(&pass, node.pass->name);
    }
    rl_str_add(out, "\nwho needs what\n");
    for (size_t i = 0; rl_experiment_node(e, capture, i, &node); i++) {
        if (node.group != group)
            continue;
        rl_str_printf(out, "  %-*s  %-*s  ", (int)name, node.name, (int)pass, node.pass->name);
        if (rl_variants_share(plan, &node))
            rl_str_add(out, "all");
        else
            rl_variants_users(plan, &node, ", ", out);
        rl_str_add(out, "\n");
    }
    rl_str_add(out, "\n");
}

static rl_code print_text(const rl_ab_plan *plan, const rl_experiment *e, rl_str *out, rl_error *err)
{
    const rl_session *first = rl_experiment_session(e, 0);
    size_t captures = rl_session_captures(first);
    rl_code code = RL_OK;
    print_variants(plan, e, out);
    for (size_t c = 0; c < captures && !code; c++) {
        size_t groups = rl_experiment_groups(e, c);
        if (captures > 1)
            rl_str_printf(out, "\ncapture '%s'\n", rl_session_capture_name(first, c));
        for (size_t g = 0; g < groups && !code; g++) {
            const char *reason = rl_experiment_group_reason(e, c, g);
            if (reason)
                rl_str_printf(out, "\nthese read the frames on their own: %s\n", reason);
            print_nodes(plan, e, c, g, out);
            code = rl_variants_group_plan(plan, e, c, g, RL_PLAN_TEXT, out, err);
        }
        char bytes[32];
        rl_str_printf(out, "  and to compare the pictures, in `relit ab`: %s\n",
                      rl_format_bytes(rl_variants_compare_bytes(plan, e, c), bytes));
    }
    return code;
}

/* ---- drawn --------------------------------------------------------------------------------------------- */

/* DOT lets a node be told about again: what is said later is added. */
static rl_code print_dot(const rl_ab_plan *plan, const rl_experiment *e, rl_str *out, rl_error *err)
{
    rl_merged_node node;
    if (rl_experiment_groups(e, 0) > 1)
        return rl_fail_file(err, RL_E_USAGE, "relit plan",
                            "these variants do not read the frames in the same way (%s), so they are no one "
                            "graph to draw; --format text shows all",
                            rl_experiment_group_reason(e, 0, 1));
    rl_code code = rl_variants_group_plan(plan, e, 0, 0, RL_PLAN_DOT, out, err);
    while (!code && out->length && (out->text[out->length - 1] == '\n' || out->text[out->length - 1] == '}'))
        out->text[--out->length] = 0;
    rl_str_add(out, "\n");
    for (size_t i = 0; !code && rl_experiment_node(e, 0, i, &node); i++) {
        if (rl_variants_share(plan, &node))
            continue;
        rl_str_printf(out, "  n%d [style=filled, fillcolor=\"#ffe2b8\", label=\"%zu. %s\\n%s\\n", node.node,
                      i + 1, node.name, node.pass->name);
        rl_variants_users(plan, &node, ", ", out); /* names of variants hold no quotes */
        rl_str_add(out, "\"];\n");
    }
    rl_str_add(out, "}\n");
    return code;
}

static rl_code print_svg(const rl_ab_plan *plan, const rl_experiment *e, rl_str *out, rl_error *err)
{
    rl_str dot = {0};
    rl_code code = print_dot(plan, e, &dot, err);
    if (!code && dot.failed)
        code = rl_fail_memory(err, dot.length);
    if (!code)
        code = rl_svg_from_dot(rl_str_text(&dot), out, err);
    rl_str_free(&dot);
    return code;
}

rl_code rl_plan_variants_print(const rl_ab_plan *plan, const rl_experiment *e, rl_plan_word word, rl_str *out,
                               rl_error *err)
{
    switch (word) {
    case RL_WORD_JSON:
        return rl_plan_variants_json(plan, e, out, err);
    case RL_WORD_DOT:
        return print_dot(plan, e, out, err);
    case RL_WORD_SVG:
        return print_svg(plan, e, out, err);
    default:
        return print_text(plan, e, out, err);
    }
}
