/* The plan as a graphviz graph: passes and capture layers as nodes, images as edges. */
#include <string.h>

#include "graph/base/text.h"
#include "graph/model/plan.h"

#define GREY  "#909090"
#define PHASE "#b05000" /* edges that carry the phase4 layout */

/* Text inside of a quoted DOT string. */
static void add_quoted(rl_str *out, const char *text)
{
    for (; *text; text++) {
        if (*text == '"' || *text == '\\')
            rl_str_add(out, "\\");
        rl_str_addn(out, text, 1);
    }
}

/* Where an image comes from, as the identifier of a DOT node. */
static void add_producer(const rl_graph *g, int image, rl_str *out)
{
    if (g->images[image].node >= 0)
        rl_str_printf(out, "n%d", g->images[image].node);
    else
        rl_str_printf(out, "c%d", image);
}

static const rl_buffer *made_buffer(const rl_plan *plan, int image)
{
    const rl_graph *g = plan->graph;
    for (size_t i = 0; i < plan->n_nodes; i++)
        if (plan->nodes[i].node == g->images[image].node)
            return &plan->buffers[plan->nodes[i].buffers[g->images[image].port]];
    return NULL;
}

/* The layout that the producer stores: capture layers come linear. */
static rl_layout made_layout(const rl_plan *plan, int image)
{
    const rl_buffer *b = plan->graph->images[image].node < 0 ? NULL : made_buffer(plan, image);
    return b ? b->layout : RL_LINEAR;
}

/* The target of an edge: 'n' and a node, or 'o' and an output. */
typedef struct target {
    char letter;
    int index;
    rl_role role;
    rl_layout layout; /* that it wants */
    bool culled;
} target;

static const char *edge_style(target to)
{
    if (to.culled)
        return ", style=dashed, color=\"" GREY "\", fontcolor=\"" GREY "\"";
    if (to.role == RL_HISTORY)
        return ", style=dotted, constraint=false";
    return to.layout == RL_PHASE4 ? ", color=\"" PHASE "\"" : "";
}

static void print_edge(const rl_plan *plan, int image, target to, rl_str *out)
{
    const rl_image *what = &plan->graph->images[image];
    rl_str_add(out, "  ");
    add_producer(plan->graph, image, out);
    rl_str_printf(out, " -> %c%d [label=\"", to.letter, to.index);
    add_quoted(out, what->node >= 0 ? plan->graph->nodes[what->node].pass->ports.rows[what->port].name : "");
    rl_str_printf(out, "%s%s", what->node >= 0 ? " " : "", rl_format_name(what->format));
    if (!to.culled && to.layout == RL_PHASE4)
        rl_str_add(out, ", phase4");
    if (!to.culled && to.layout != made_layout(plan, image))
        rl_str_add(out, "\\nconverted");
    if (to.role == RL_HISTORY)
        rl_str_add(out, "\\none frame before");
    rl_str_printf(out, "\"%s];\n", edge_style(to));
}

static void print_node(const rl_plan *plan, int index, int place, rl_str *out)
{
    const rl_graph_node *node = &plan->graph->nodes[index];
    rl_str_printf(out, "  n%d [shape=box, label=\"", index);
    if (place >= 0)
        rl_str_printf(out, "%d. ", place + 1);
    add_quoted(out, node->name);
    rl_str_add(out, "\\n");
    add_quoted(out, node->pass->name);
    if (place < 0)
        rl_str_add(out,
                   "\\nculled: no output needs it\", style=dashed, color=\"" GREY "\", fontcolor=\"" GREY);
    rl_str_add(out, "\"];\n");
    for (size_t p = 0; p < node->pass->ports.n; p++) {
        const rl_port *port = &node->pass->ports.rows[p];
        if (node->images[p] >= 0 && (port->role == RL_READ || port->role == RL_HISTORY))
            print_edge(plan, node->images[p], (target){'n', index, port->role, port->layout, place < 0}, out);
    }
}

/* A capture layer is drawn when anything is connected to it, culled nodes included. */
static bool is_connected(const rl_graph *g, int image)
{
    for (size_t n = 0; n < g->n_nodes; n++)
        for (size_t p = 0; p < g->nodes[n].pass->ports.n; p++)
            if (g->nodes[n].images[p] == image)
                return true;
    for (size_t o = 0; o < g->n_outputs; o++)
        for (size_t i = 0; i < g->outputs[o].n_images; i++)
            if (g->outputs[o].images[i] == image)
                return true;
    return false;
}

static void print_output(const rl_plan *plan, int index, rl_str *out)
{
    const rl_graph_output *output = &plan->graph->outputs[index];
    rl_str_printf(out, "  o%d [shape=note, label=\"", index);
    add_quoted(out, output->name);
    rl_str_add(out, "\"];\n");
    for (size_t i = 0; i < output->n_images; i++)
        print_edge(plan, output->images[i], (target){'o', index, RL_READ, RL_LINEAR, false}, out);
}

void rl_plan_print_dot(const rl_plan *plan, const rl_geometry *g, int in_flight, struct rl_str *out)
{
    const rl_graph *graph = plan->graph;
    rl_str_add(out, "digraph relit {\n  rankdir=LR;\n  node [fontname=\"sans-serif\", fontsize=11];\n"
                    "  edge [fontname=\"sans-serif\", fontsize=9];\n");
    if (g) {
        char with[32], without[32];
        rl_str_printf(out, "  label=\"%d x %d: %s with shared slots, %s without\";\n", g->width, g->height,
                      rl_format_bytes(rl_plan_bytes(plan, g, in_flight), with),
                      rl_format_bytes(rl_plan_bytes_unshared(plan, g, in_flight), without));
    }
    for (size_t i = 0; i < graph->n_images; i++) {
        if (graph->images[i].node >= 0 || !is_connected(graph, (int)i))
            continue;
        rl_str_printf(out, "  c%zu [shape=ellipse, label=\"", i);
        add_quoted(out, graph->images[i].name);
        rl_str_add(out, "\"];\n");
    }
    for (size_t i = 0; i < plan->n_nodes; i++)
        print_node(plan, plan->nodes[i].node, (int)i, out);
    for (size_t i = 0; i < plan->n_culled; i++)
        print_node(plan, plan->culled[i], -1, out);
    for (size_t o = 0; o < graph->n_outputs; o++)
        print_output(plan, (int)o, out);
    rl_str_add(out, "}\n");
}
