/* The ledger of energy of an experiment (energy.h): asked for as one more output of a group's merged graph.
 */
#include <string.h>

#include "graph/run/experiment_parts.h"
#include "kernels/shared.h"

rl_code rl_experiment_want_energy(rl_experiment *x, const rl_group *g, const rl_graph **out, rl_error *err)
{
    const rl_graph *graph = *out = g->merged->graph;
    if (!x->options.energy)
        return RL_OK;
    rl_graph *with = rl_arena_alloc(&x->arena, sizeof *with);
    rl_graph_output *outputs = rl_arena_array(&x->arena, graph->n_outputs + 1, sizeof *outputs);
    int *images = rl_arena_array(&x->arena, graph->n_nodes + 1, sizeof *images);
    size_t n = 0;
    if (!with || !outputs || !images)
        return rl_fail_memory(err, graph->n_outputs * sizeof *outputs);
    memcpy(outputs, graph->outputs, graph->n_outputs * sizeof *outputs);
    for (size_t i = 0; i < graph->n_nodes; i++) /* all of them are live */
        if (rl_energy_image(graph, i) >= 0)
            images[n++] = rl_energy_image(graph, i);
    outputs[graph->n_outputs] = (rl_graph_output){"the ledger of energy", images, n};
    *with = *graph;
    with->outputs = outputs;
    with->n_outputs++;
    *out = with;
    return RL_OK;
}

/* "sss" for a node that the merged graph calls "sss@2" because another variant has an "sss" too. Lives as
 * long as the graph. */
static const char *own_name(rl_arena *arena, const rl_graph *graph, const char *name)
{
    const char *at = strrchr(name, '@');
    const char *plain = at ? rl_arena_strndup(arena, name, (size_t)(at - name)) : NULL;
    for (size_t i = 0; plain && i < graph->n_nodes; i++)
        if (!strcmp(graph->nodes[i].name, plain))
            return graph->nodes[i].name;
    return name;
}

/* Dense indices of another group's materials are not those of the first: rows get those, or go when there is
 * no such material. The whole keeps their light. */
static void rename_materials(const rl_experiment *x, size_t capture, const rl_materials *own,
                             rl_energy_ledger *ledger, size_t from)
{
    size_t known, to = from;
    const char *const *names = rl_experiment_materials(x, capture, &known);
    for (size_t i = from; i < ledger->n; i++) {
        rl_energy_row row = ledger->rows[i];
        size_t k = 0;
        while (row.material >= 0 && k < known && strcmp(names[k], own->names[row.material]))
            k++;
        if (k == known)
            continue;
        if (row.material >= 0)
            row.material = (int)k;
        ledger->rows[to++] = row;
    }
    ledger->n = to;
}

/* The sums of node `node`, for each variant that needs it. */
static rl_code add_node(const rl_experiment *x, const rl_group *g, rl_arena *arena, int node,
                        const rl_energy_row *about, const float *sums, rl_energy_ledger *out, rl_error *err)
{
    const rl_graph_node *n = &g->plan->graph->nodes[node];
    const rl_materials *materials =
        rl_experiment_sequence(x, g->members[n->scene], about->capture)->materials;
    rl_energy_row row = *about;
    rl_code code = RL_OK;
    row.node = own_name(arena, g->plan->graph, n->name);
    row.pass = n->pass;
    for (size_t v = 0; v < x->n && !code; v++) {
        size_t before = out->n;
        row.variant = v;
        if (!g->used[node][v])
            continue;
        code = rl_energy_ledger_add(out, &row, sums, materials->count, err);
        if (!code && g != x->captures[about->capture].groups)
            rename_materials(x, about->capture, materials, out, before);
    }
    return code;
}

rl_code rl_experiment_read_energy(const rl_experiment *x, size_t capture, size_t group, const rl_frame *frame,
                                  rl_energy_ledger *out, rl_error *err)
{
    const rl_group *g = &x->captures[capture].groups[group];
    const rl_graph *graph = g->plan->graph;
    const rl_graph_output *wanted = &graph->outputs[graph->n_outputs - 1];
    const rl_energy_row about = {.capture = capture, .frame = frame->number};
    rl_arena arena = {0};
    rl_code code = RL_OK;
    for (size_t i = 0; x->options.energy && i < wanted->n_images && !code; i++) {
        rl_memory *memory =
            rl_frame_buffers_memory(frame->buffers, g->plan->outputs[graph->n_outputs - 1][i]);
        void *p = NULL;
        code = rl_memory_map(memory, false, &p, err);
        if (code)
            break;
        code = add_node(x, g, &arena, graph->images[wanted->images[i]].node, &about,
                        (const float *)p + RL_GUARD, out, err);
        rl_code unmapped = rl_memory_unmap(memory, code ? NULL : err);
        code = code ? code : unmapped;
    }
    rl_arena_free(&arena);
    return code;
}
