#include "graph/model/plan.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

#include "graph/model/graph_build.h"
#include "graph/model/params.h"
#include "graph/model/plan_build.h"

/* ---- what runs, in which order ---------------------------------------------------------------------------
 */

/* Depth-first from the outputs: what nobody needs is never met, and a node runs close before its first
 * consumer, which keeps lives short. */
static rl_code order_nodes(rl_planner *p)
{
    const rl_graph *g = p->graph;
    size_t n_roots = 0, most = 0;
    bool cycle = false;
    for (size_t o = 0; o < g->n_outputs; o++)
        most += g->outputs[o].n_images;
    int *roots = rl_arena_array(p->arena, most, sizeof *roots);
    p->order = rl_arena_array(p->arena, g->n_nodes, sizeof *p->order);
    p->place = rl_arena_array(p->arena, g->n_nodes, sizeof *p->place);
    if (!roots || !p->order || !p->place)
        return rl_fail_memory(p->err, (most + 2 * g->n_nodes) * sizeof(int));
    for (size_t o = 0; o < g->n_outputs; o++)
        for (size_t i = 0; i < g->outputs[o].n_images; i++)
            roots[n_roots++] = g->images[g->outputs[o].images[i]].node;
    rl_code code = rl_graph_walk(p->arena, g->images, g->nodes, g->n_nodes, roots, n_roots, p->order,
                                 &p->n_live, &cycle, p->err);
    if (code == RL_OK && cycle)
        code = rl_fail(p->err, RL_E_INTERNAL, RL_NOWHERE, "a graph with a cycle cannot be planned");
    for (size_t i = 0; i < g->n_nodes; i++)
        p->place[i] = -1;
    for (size_t i = 0; i < p->n_live && code == RL_OK; i++)
        p->place[p->order[i]] = (int)i;
    return code;
}

/* ---- what is wanted of each image ------------------------------------------------------------------------
 */

static void want_ports(rl_planner *p, int place)
{
    const rl_graph_node *node = &p->graph->nodes[p->order[place]];
    for (size_t i = 0; i < node->pass->ports.n; i++) {
        const rl_port *port = &node->pass->ports.rows[i];
        if (node->images[i] < 0)
            continue;
        rl_image_plan *image = &p->images[node->images[i]];
        image->live = image->live || port->role != RL_REDUCTION;
        if (port->role == RL_HISTORY)
            image->past[port->layout] = true;
        if (port->role == RL_READ) {
            image->read[port->layout] = true;
            if (image->reader[port->layout] > place)
                image->reader[port->layout] = place;
        }
    }
}

/* A port that can store either layout follows its consumers; when they disagree it stores linear. */
static rl_layout choose_layout(const rl_graph *g, const rl_image *image, const rl_image_plan *want)
{
    if (image->node < 0)
        return RL_LINEAR;
    const rl_port *port = &g->nodes[image->node].pass->ports.rows[image->port];
    const bool linear = want->read[RL_LINEAR] || want->past[RL_LINEAR] || want->output;
    const bool phase4 = want->read[RL_PHASE4] || want->past[RL_PHASE4];
    if (!port->any_layout || (!linear && !phase4))
        return port->layout;
    return linear ? RL_LINEAR : RL_PHASE4;
}

static rl_code want_images(rl_planner *p)
{
    const rl_graph *g = p->graph;
    p->images = rl_arena_array(p->arena, g->n_images, sizeof *p->images);
    if (!p->images)
        return rl_fail_memory(p->err, g->n_images * sizeof *p->images);
    for (size_t i = 0; i < g->n_images; i++)
        p->images[i] =
            (rl_image_plan){.reader = {INT_MAX, INT_MAX}, .now = {-1, -1}, .before = {-1, -1}, .sink = -1};
    for (size_t o = 0; o < g->n_outputs; o++)
        for (size_t i = 0; i < g->outputs[o].n_images; i++) {
            rl_image_plan *image = &p->images[g->outputs[o].images[i]];
            image->live = image->output = true;
        }
    for (size_t i = 0; i < p->n_live; i++)
        want_ports(p, (int)i);
    for (size_t i = 0; i < g->n_images; i++)
        p->images[i].made = choose_layout(g, &g->images[i], &p->images[i]);
    return RL_OK;
}

/* ---- buffers ---------------------------------------------------------------------------------------------
 */

static int add_buffer(rl_planner *p, int image, const char *name, rl_layout layout, int planes,
                      rl_buffer_class kind)
{
    p->buffers[p->n_buffers] = (rl_buffer){image, name, layout, planes, kind, -1, INT_MAX, -1};
    return (int)p->n_buffers++;
}

static void buffer_image(rl_planner *p, int index)
{
    const rl_image *image = &p->graph->images[index];
    rl_image_plan *plan = &p->images[index];
    for (int l = 0; l < RL_LAYOUTS; l++) {
        const rl_layout layout = (rl_layout)l;
        const bool source = image->node < 0 && layout == RL_LINEAR;
        rl_buffer_class kind = RL_BUFFER_TRANSIENT;
        if (layout != plan->made && !plan->read[l] && !plan->past[l] &&
            !(plan->output && layout == RL_LINEAR))
            continue;
        if (source)
            kind = RL_BUFFER_SOURCE;
        else if (plan->past[l])
            kind = RL_BUFFER_HISTORY;
        else if (plan->output && layout == RL_LINEAR)
            kind = RL_BUFFER_SINK;
        plan->now[l] = add_buffer(p, index, image->name, layout, image->planes, kind);
        if (plan->past[l])
            plan->before[l] =
                source ? add_buffer(p, index, image->name, layout, image->planes, RL_BUFFER_HISTORY)
                       : plan->now[l];
    }
    if (plan->output)
        plan->sink = p->buffers[plan->now[RL_LINEAR]].kind == RL_BUFFER_HISTORY
                         ? add_buffer(p, index, image->name, RL_LINEAR, image->planes, RL_BUFFER_SINK)
                         : plan->now[RL_LINEAR];
}

/* Whether an output asks for the REDUCTION port that something exists for. */
static bool wants(const rl_planner *p, const rl_graph_node *node, const char *with)
{
    for (size_t i = 0; with && i < node->pass->ports.n; i++)
        if (node->pass->ports.rows[i].role == RL_REDUCTION && !strcmp(node->pass->ports.rows[i].name, with))
            return p->images[node->images[i]].output;
    return !with;
}

/* Whether nothing feeds the port that `without` names; NULL: no such condition. */
static bool is_without(const rl_graph_node *node, const char *without)
{
    for (size_t i = 0; without && i < node->pass->ports.n; i++)
        if (node->pass->ports.rows[i].role == RL_READ && !strcmp(node->pass->ports.rows[i].name, without))
            return node->images[i] < 0;
    return true;
}

/* The buffers of a live node's ports; its scratch comes into being here. */
static rl_code buffer_node(rl_planner *p, size_t place)
{
    const int index = p->order[place];
    const rl_graph_node *node = &p->graph->nodes[index];
    const size_t n = node->pass->ports.n;
    int *bound = rl_arena_array(p->arena, n, sizeof *bound);
    if (!bound)
        return rl_fail_memory(p->err, n * sizeof *bound);
    p->nodes[place] = (rl_plan_node){index, bound};
    for (size_t i = 0; i < n; i++) {
        const rl_port *port = &node->pass->ports.rows[i];
        const rl_image_plan *image = node->images[i] >= 0 ? &p->images[node->images[i]] : NULL;
        bound[i] = -1;
        if (port->role == RL_SCRATCH) {
            if (!wants(p, node, port->with) || !is_without(node, port->without) ||
                !rl_port_exists(node->pass, port, node->params))
                continue;
            const char *name = rl_arena_printf(p->arena, "%s.%s", node->name, port->name);
            if (!name)
                return rl_fail_memory(p->err, 64);
            bound[i] =
                add_buffer(p, -1, name, port->layout, rl_format_planes(port->format), RL_BUFFER_TRANSIENT);
        } else if (image) {
            bound[i] = port->role == RL_READ      ? image->now[port->layout]
                       : port->role == RL_HISTORY ? image->before[port->layout]
                                                  : image->now[image->made];
        }
    }
    return RL_OK;
}

static rl_code make_buffers(rl_planner *p)
{
    size_t most = (RL_LAYOUTS + 2) * p->graph->n_images; /* + a capture layer's pair + a sink beside a pair */
    for (size_t i = 0; i < p->n_live; i++)
        most += p->graph->nodes[p->order[i]].pass->ports.n;
    p->buffers = rl_arena_array(p->arena, most, sizeof *p->buffers);
    p->nodes = rl_arena_array(p->arena, p->n_live, sizeof *p->nodes);
    if (!p->buffers || !p->nodes)
        return rl_fail_memory(p->err, most * sizeof *p->buffers + p->n_live * sizeof *p->nodes);
    for (size_t i = 0; i < p->graph->n_images; i++)
        if (p->images[i].live)
            buffer_image(p, (int)i);
    rl_code code = RL_OK;
    for (size_t i = 0; i < p->n_live && code == RL_OK; i++)
        code = buffer_node(p, i);
    return code;
}

/* ---- steps -----------------------------------------------------------------------------------------------
 */

/* A conversion that runs before the node at `place` (n_live: at the end). */
typedef struct conversion {
    int place, image;
} conversion;

static int by_place(const void *a, const void *b)
{
    const conversion *x = a, *y = b;
    return x->place != y->place ? (x->place > y->place) - (x->place < y->place)
                                : (x->image > y->image) - (x->image < y->image);
}

/* Where the second layout is made. It costs one buffer from there to its last reader, and the first layout
 * lives on until there: right before the first reader is never worse, unless the second layout has memory of
 * its own anyway. Then right behind the producer is best, while the image is still in the cache. */
static int convert_place(const rl_planner *p, int index, rl_layout to)
{
    const rl_image_plan *image = &p->images[index];
    const int producer = p->graph->images[index].node;
    if (p->buffers[image->now[to]].kind != RL_BUFFER_TRANSIENT && producer >= 0)
        return p->place[producer] + 1;
    return image->reader[to] < (int)p->n_live ? image->reader[to] : (int)p->n_live;
}

static rl_code list_conversions(rl_planner *p, conversion **out, size_t *n)
{
    *n = 0;
    *out = rl_arena_array(p->arena, p->graph->n_images, sizeof **out);
    if (!*out)
        return rl_fail_memory(p->err, p->graph->n_images * sizeof **out);
    for (size_t i = 0; i < p->graph->n_images; i++) {
        const rl_layout to = p->images[i].made == RL_LINEAR ? RL_PHASE4 : RL_LINEAR;
        if (p->images[i].live && p->images[i].now[to] >= 0)
            (*out)[(*n)++] = (conversion){convert_place(p, (int)i, to), (int)i};
    }
    qsort(*out, *n, sizeof **out, by_place);
    return RL_OK;
}

static rl_code add_transfer(rl_planner *p, rl_step_kind kind, int source, int destination)
{
    int *pair = rl_arena_array(p->arena, 2, sizeof *pair);
    if (!pair)
        return rl_fail_memory(p->err, 2 * sizeof *pair);
    pair[0] = source;
    pair[1] = destination;
    p->steps[p->n_steps++] = (rl_plan_step){kind, -1, 0, pair, 2};
    return RL_OK;
}

static rl_code add_conversion(rl_planner *p, int index)
{
    const rl_image_plan *image = &p->images[index];
    const rl_layout to = image->made == RL_LINEAR ? RL_PHASE4 : RL_LINEAR;
    return add_transfer(p, RL_STEP_CONVERT, image->now[image->made], image->now[to]);
}

/* What must outlive the frame beside its image: the past of capture layers, outputs whose image is a pair. */
static rl_code add_copies(rl_planner *p)
{
    rl_code code = RL_OK;
    for (size_t i = 0; i < p->graph->n_images && code == RL_OK; i++) {
        const rl_image_plan *image = &p->images[i];
        for (int l = 0; l < RL_LAYOUTS && code == RL_OK; l++)
            if (image->before[l] >= 0 && image->before[l] != image->now[l])
                code = add_transfer(p, RL_STEP_COPY, image->now[l], image->before[l]);
        if (code == RL_OK && image->sink >= 0 && image->sink != image->now[RL_LINEAR])
            code = add_transfer(p, RL_STEP_COPY, image->now[RL_LINEAR], image->sink);
    }
    return code;
}

static rl_code make_steps(rl_planner *p)
{
    size_t most = (RL_LAYOUTS + 1 + 1) * p->graph->n_images, n = 0,
           next = 0; /* a copy a layout, a sink, a conversion */
    for (size_t i = 0; i < p->n_live; i++)
        most += p->graph->nodes[p->order[i]].pass->steps.n;
    p->steps = rl_arena_array(p->arena, most, sizeof *p->steps);
    if (!p->steps)
        return rl_fail_memory(p->err, most * sizeof *p->steps);
    conversion *list;
    rl_code code = list_conversions(p, &list, &n);
    for (size_t i = 0; i <= p->n_live && code == RL_OK; i++) {
        for (; code == RL_OK && next < n && list[next].place == (int)i; next++)
            code = add_conversion(p, list[next].image);
        if (i == p->n_live)
            break;
        const rl_graph_node *node = &p->graph->nodes[p->order[i]];
        const rl_pass *pass = node->pass;
        for (size_t s = 0; s < pass->steps.n; s++) {
            if (!rl_step_runs(pass, &pass->steps.rows[s], node->params) ||
                !wants(p, node, pass->steps.rows[s].with) || !is_without(node, pass->steps.rows[s].without))
                continue;
            p->steps[p->n_steps++] =
                (rl_plan_step){RL_STEP_KERNEL, p->order[i], (int)s, p->nodes[i].buffers, (int)pass->ports.n};
        }
    }
    return code == RL_OK ? add_copies(p) : code;
}

/* ---- all of it -------------------------------------------------------------------------------------------
 */

static rl_code list_outputs(rl_planner *p, const int *const **out)
{
    const rl_graph *g = p->graph;
    const int **outputs = rl_arena_array(p->arena, g->n_outputs, sizeof *outputs);
    if (!outputs)
        return rl_fail_memory(p->err, g->n_outputs * sizeof *outputs);
    for (size_t o = 0; o < g->n_outputs; o++) {
        int *list = rl_arena_array(p->arena, g->outputs[o].n_images, sizeof *list);
        if (!list)
            return rl_fail_memory(p->err, g->outputs[o].n_images * sizeof *list);
        for (size_t i = 0; i < g->outputs[o].n_images; i++)
            list[i] = p->images[g->outputs[o].images[i]].sink;
        outputs[o] = list;
    }
    *out = outputs;
    return RL_OK;
}

static rl_code list_culled(rl_planner *p, const int **out, size_t *n)
{
    int *culled = rl_arena_array(p->arena, p->graph->n_nodes, sizeof *culled);
    *n = 0;
    if (!culled)
        return rl_fail_memory(p->err, p->graph->n_nodes * sizeof *culled);
    for (size_t i = 0; i < p->graph->n_nodes; i++)
        if (p->place[i] < 0)
            culled[(*n)++] = (int)i;
    *out = culled;
    return RL_OK;
}

rl_code rl_plan_make(rl_arena *arena, const rl_graph *graph, const rl_plan **out, rl_error *err)
{
    rl_planner p = {.arena = arena, .err = err, .graph = graph};
    rl_plan *plan = rl_arena_alloc(arena, sizeof *plan);
    *out = NULL;
    if (!plan)
        return rl_fail_memory(err, sizeof *plan);
    rl_code (*const stages[])(rl_planner *) = {order_nodes, want_images, make_buffers, make_steps,
                                               rl_plan_memory};
    for (size_t i = 0; i < RL_ARRAY_LENGTH(stages); i++) {
        rl_code code = stages[i](&p);
        if (code != RL_OK)
            return code;
    }
    rl_code code = list_outputs(&p, &plan->outputs);
    if (code == RL_OK)
        code = list_culled(&p, &plan->culled, &plan->n_culled);
    if (code != RL_OK)
        return code;
    plan->graph = graph;
    plan->buffers = p.buffers;
    plan->n_buffers = p.n_buffers;
    plan->steps = p.steps;
    plan->n_steps = p.n_steps;
    plan->nodes = p.nodes;
    plan->n_nodes = p.n_live;
    plan->slot_planes = p.slot_planes;
    plan->n_slots = p.n_slots;
    *out = plan;
    return RL_OK;
}
