/* The plan as text: what runs, how long each image lives and where, what it costs, what was left out. */
#include <limits.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/base/text.h"
#include "graph/model/plan.h"

enum { BAR_COLUMNS = 48, MOST_NAME = 40 };

const char *rl_layout_name(rl_layout layout)
{
    return layout == RL_PHASE4 ? "phase4" : "linear";
}

const char *rl_buffer_class_name(rl_buffer_class kind)
{
    static const char *const names[] = {
        [RL_BUFFER_SOURCE] = "source",
        [RL_BUFFER_TRANSIENT] = "transient",
        [RL_BUFFER_SINK] = "sink",
        [RL_BUFFER_HISTORY] = "history",
    };
    return (unsigned)kind < RL_ARRAY_LENGTH(names) ? names[kind] : "unknown";
}

/* ---- steps -----------------------------------------------------------------------------------------------
 */

static void print_bindings(const rl_plan *plan, const rl_plan_step *step, rl_str *out)
{
    static const rl_role roles[] = {RL_READ, RL_HISTORY, RL_WRITE, RL_REDUCTION};
    const rl_graph_node *node = &plan->graph->nodes[step->node];
    const char *between = " ";
    for (size_t r = 0; r < RL_ARRAY_LENGTH(roles); r++) {
        if (roles[r] == RL_WRITE)
            between = " -> ";
        for (size_t p = 0; p < node->pass->ports.n; p++) {
            if (node->pass->ports.rows[p].role != roles[r] || step->buffers[p] < 0)
                continue;
            const rl_buffer *b = &plan->buffers[step->buffers[p]];
            rl_str_printf(out, "%s%s%s%s", between, roles[r] == RL_HISTORY ? "past " : "", b->name,
                          b->layout == RL_PHASE4 ? "'" : "");
            between = ", ";
        }
    }
}

static void print_step(const rl_plan *plan, size_t index, int width, rl_str *out)
{
    const rl_plan_step *step = &plan->steps[index];
    rl_str_printf(out, "  %3zu  ", index);
    if (step->kind == RL_STEP_KERNEL) {
        const rl_graph_node *node = &plan->graph->nodes[step->node];
        rl_str_printf(out, "%-*s  %s %s:", width, node->name, node->pass->name,
                      node->pass->steps.rows[step->step].entry);
        print_bindings(plan, step, out);
    } else {
        const rl_buffer *from = &plan->buffers[step->buffers[0]], *to = &plan->buffers[step->buffers[1]];
        if (step->kind == RL_STEP_CONVERT)
            rl_str_printf(out, "%-*s  %s from %s to %s", width, "(convert)", from->name,
                          rl_layout_name(from->layout), rl_layout_name(to->layout));
        else
            rl_str_printf(out, "%-*s  %s to its %s", width, "(copy)", from->name,
                          to->kind == RL_BUFFER_SINK ? "output" : "history");
    }
    rl_str_add(out, "\n");
}

static void print_steps(const rl_plan *plan, rl_str *out)
{
    int width = (int)strlen("(convert)");
    for (size_t i = 0; i < plan->n_nodes; i++) {
        int length = (int)strnlen(plan->graph->nodes[plan->nodes[i].node].name, MOST_NAME);
        width = length > width ? length : width;
    }
    rl_str_printf(out, "order (' marks the phase4 layout)\n");
    for (size_t i = 0; i < plan->n_steps; i++)
        print_step(plan, i, width, out);
}

/* ---- images ----------------------------------------------------------------------------------------------
 */

/* Lives as a bar, a column a step, or several steps a column when there are many. */
static void print_bar(const rl_plan *plan, const rl_buffer *b, rl_str *out)
{
    const long long n = (long long)plan->n_steps, columns = n < BAR_COLUMNS ? n : BAR_COLUMNS;
    for (long long c = 0; c < columns; c++) {
        const long long from = c * n / columns, to = (c + 1) * n / columns - 1;
        rl_str_add(out, b->first <= to && b->last >= from ? "#" : ".");
    }
}

static void print_buffer(const rl_plan *plan, const rl_buffer *b, int width, const rl_geometry *g,
                         int in_flight, rl_str *out)
{
    char bytes[32];
    rl_str_printf(out, "  %-*s  %2d x %s  ", width, b->name, b->planes, rl_layout_name(b->layout));
    print_bar(plan, b, out);
    if (b->slot >= 0)
        rl_str_printf(out, "  slot %-3d", b->slot);
    else
        rl_str_printf(out, "  %-8s", rl_buffer_class_name(b->kind));
    if (g) {
        const size_t copies = rl_buffer_copies(b, in_flight);
        rl_str_printf(out, "  %10s", rl_format_bytes(rl_buffer_bytes(b, g), bytes));
        if (copies > 1)
            rl_str_printf(out, " x %zu", copies);
    }
    if (b->image < 0)
        rl_str_add(out, "  scratch");
    rl_str_add(out, "\n");
}

static void print_buffers(const rl_plan *plan, const rl_geometry *g, int in_flight, rl_str *out)
{
    static const rl_buffer_class kinds[] = {RL_BUFFER_SOURCE, RL_BUFFER_TRANSIENT, RL_BUFFER_SINK,
                                            RL_BUFFER_HISTORY};
    int width = 0;
    for (size_t i = 0; i < plan->n_buffers; i++) {
        int length = (int)strnlen(plan->buffers[i].name, MOST_NAME);
        width = length > width ? length : width;
    }
    rl_str_printf(out, "\nimages (each from the step that fills it to the last that reads it)\n");
    for (size_t k = 0; k < RL_ARRAY_LENGTH(kinds); k++)
        for (int first = -1; first <= (int)plan->n_steps; first++) /* by birth */
            for (size_t i = 0; i < plan->n_buffers; i++)
                if (plan->buffers[i].kind == kinds[k] && plan->buffers[i].first == first)
                    print_buffer(plan, &plan->buffers[i], width, g, in_flight, out);
}

static void print_slots(const rl_plan *plan, const rl_geometry *g, rl_str *out)
{
    char bytes[32];
    if (plan->n_slots)
        rl_str_add(out, "\nslots\n");
    for (size_t s = 0; s < plan->n_slots; s++) {
        rl_str_printf(out, "  %3zu  %2d plane%s", s, plan->slot_planes[s],
                      plan->slot_planes[s] == 1 ? " " : "s");
        if (g)
            rl_str_printf(out, "  %10s", rl_format_bytes(rl_slot_bytes(plan, (int)s, g), bytes));
        const char *between = "  ";
        for (int first = 0; first < (int)plan->n_steps; first++)
            for (size_t i = 0; i < plan->n_buffers; i++)
                if (plan->buffers[i].slot == (int)s && plan->buffers[i].first == first) {
                    const rl_buffer *b = &plan->buffers[i];
                    rl_str_printf(out, "%s%s%s %d-%d", between, b->name, b->layout == RL_PHASE4 ? "'" : "",
                                  b->first, b->last);
                    between = ", ";
                }
        rl_str_add(out, "\n");
    }
}

/* ---- memory, outputs, what was left out -------------------------------------------------------------------
 */

static void print_memory(const rl_plan *plan, const rl_geometry *g, int in_flight, rl_str *out)
{
    static const char *const words[] = {
        [RL_BUFFER_SOURCE] = "sources",
        [RL_BUFFER_TRANSIENT] = "images between passes",
        [RL_BUFFER_SINK] = "outputs",
        [RL_BUFFER_HISTORY] = "history",
    };
    size_t sums[RL_ARRAY_LENGTH(words)] = {0}, slots = 0;
    char with[32], without[32];
    for (size_t i = 0; i < plan->n_buffers; i++)
        sums[plan->buffers[i].kind] +=
            rl_buffer_bytes(&plan->buffers[i], g) * rl_buffer_copies(&plan->buffers[i], in_flight);
    for (size_t i = 0; i < plan->n_slots; i++)
        slots += rl_slot_bytes(plan, (int)i, g);
    rl_str_printf(out, "\nmemory (%d x %d pixels at (%d, %d) in buffers of %d x %d, %d frame%s in flight)\n",
                  g->width, g->height, g->x, g->y, g->columns, g->rows, in_flight, in_flight == 1 ? "" : "s");
    for (size_t k = 0; k < RL_ARRAY_LENGTH(words); k++) {
        rl_str_printf(out, "  %-22s %10s", words[k],
                      rl_format_bytes(k == RL_BUFFER_TRANSIENT ? slots : sums[k], with));
        if (k == RL_BUFFER_TRANSIENT && slots < sums[k])
            rl_str_printf(out, "  (%s if none shared a slot)", rl_format_bytes(sums[k], without));
        rl_str_add(out, "\n");
    }
    const size_t all = rl_plan_bytes(plan, g, in_flight),
                 unshared = rl_plan_bytes_unshared(plan, g, in_flight);
    rl_str_printf(out, "  %-22s %10s  with reuse, %s without (%.0f %% saved)\n", "total",
                  rl_format_bytes(all, with), rl_format_bytes(unshared, without),
                  unshared ? 100.0 * (double)(unshared - all) / (double)unshared : 0.0);
}

static void print_outputs(const rl_plan *plan, rl_str *out)
{
    const rl_graph *graph = plan->graph;
    rl_str_add(out, "\noutputs\n");
    for (size_t o = 0; o < graph->n_outputs; o++) {
        rl_str_printf(out, "  %s:", graph->outputs[o].name);
        for (size_t i = 0; i < graph->outputs[o].n_images; i++)
            rl_str_printf(out, "%s %s", i ? "," : "", graph->images[graph->outputs[o].images[i]].name);
        rl_str_add(out, "\n");
    }
    if (plan->n_culled)
        rl_str_add(out, "\nculled\n");
    for (size_t i = 0; i < plan->n_culled; i++) {
        const rl_graph_node *node = &graph->nodes[plan->culled[i]];
        rl_str_printf(out, "  %s (%s): no output needs it\n", node->name, node->pass->name);
    }
}

void rl_plan_print_text(const rl_plan *plan, const rl_geometry *g, int in_flight, struct rl_str *out)
{
    print_steps(plan, out);
    print_buffers(plan, g, in_flight, out);
    print_slots(plan, g, out);
    if (g)
        print_memory(plan, g, in_flight, out);
    print_outputs(plan, out);
}
