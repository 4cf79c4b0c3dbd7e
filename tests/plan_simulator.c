#include "plan_simulator.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum { MOST = 512 };

/* What a piece of memory holds. Scratch: image = -2 - port, with its node. */
typedef struct token {
    int image, node, layout, frame;
} token;

typedef struct machine {
    const rl_plan *plan;
    int frame;
    token slots[MOST], own[MOST]; /* own: SOURCE and SINK; younger half of HISTORY */
    token older[MOST];
    int next_step[MOST]; /* of each node, this frame */
    char fault[512];
} machine;

static bool fail(machine *m, const char *fmt, ...) RL_PRINTF(2, 3);
static bool fail(machine *m, const char *fmt, ...)
{
    va_list args;
    va_start(args, fmt);
    int n = snprintf(m->fault, sizeof m->fault, "frame %d: ", m->frame);
    vsnprintf(m->fault + n, sizeof m->fault - (size_t)n, fmt, args);
    va_end(args);
    return false;
}

static bool same(token a, token b)
{
    return a.image == b.image && a.node == b.node && a.layout == b.layout && a.frame == b.frame;
}

static token *memory(machine *m, int buffer)
{
    const rl_buffer *b = &m->plan->buffers[buffer];
    return b->kind == RL_BUFFER_TRANSIENT ? &m->slots[b->slot] : &m->own[buffer];
}

static token image_token(const machine *m, int image, rl_layout layout, int frame)
{
    (void)m;
    return (token){image, -1, (int)layout, frame};
}

static bool expect(machine *m, int buffer, token found, token wanted, const char *who)
{
    return same(found, wanted) ||
           fail(m,
                "%s finds image %d layout %d frame %d in buffer %d (%s), wants image %d layout %d frame %d",
                who, found.image, found.layout, found.frame, buffer, m->plan->buffers[buffer].name,
                wanted.image, wanted.layout, wanted.frame);
}

/* What a port must find (READ), leaves behind (WRITE, SCRATCH). */
static token port_token(const machine *m, const rl_graph_node *node, int index, size_t p, int buffer)
{
    const rl_port *port = &node->pass->ports.rows[p];
    const rl_layout layout = m->plan->buffers[buffer].layout;
    if (port->role == RL_SCRATCH)
        return (token){-2 - (int)p, index, (int)layout, m->frame};
    return image_token(m, node->images[p], port->role == RL_WRITE ? layout : port->layout, m->frame);
}

static bool check_shape(machine *m, const rl_graph_node *node, size_t p, int buffer)
{
    static const int planes[] = {
        [RL_RGB] = 3, [RL_NORMAL] = 3, [RL_VEC2] = 2, [RL_SCALAR] = 1, [RL_ID] = 1, [RL_SUMS] = 0};
    const rl_port *port = &node->pass->ports.rows[p];
    if (buffer < 0 && rl_port_on_request(port))
        return true;
    const bool absent = port->role != RL_SCRATCH && node->images[p] < 0;
    if (absent || buffer < 0)
        return absent == (buffer < 0) || fail(m, "%s.%s: buffer %d", node->name, port->name, buffer);
    const rl_buffer *b = &m->plan->buffers[buffer];
    const int wanted =
        port->role == RL_SCRATCH ? planes[port->format] : m->plan->graph->images[node->images[p]].planes;
    if (b->planes != wanted)
        return fail(m, "%s.%s: %d planes", node->name, port->name, b->planes);
    if (b->layout != port->layout && !(port->role == RL_WRITE && port->any_layout))
        return fail(m, "%s.%s: layout %d", node->name, port->name, b->layout);
    if (b->kind == RL_BUFFER_TRANSIENT && (b->slot < 0 || m->plan->slot_planes[b->slot] < b->planes))
        return fail(m, "%s.%s: slot %d is too small", node->name, port->name, b->slot);
    return b->kind == RL_BUFFER_HISTORY || port->role != RL_HISTORY ||
           fail(m, "%s.%s: the past is not in a pair", node->name, port->name);
}

static bool run_kernel(machine *m, const rl_plan_step *step)
{
    const rl_graph_node *node = &m->plan->graph->nodes[step->node];
    const size_t n = node->pass->ports.n;
    if ((size_t)step->n_buffers != n || step->step != m->next_step[step->node]++)
        return fail(m, "%s: step %d out of turn", node->name, step->step);
    /* before: inputs are there, what earlier steps of the node left is still there */
    for (size_t p = 0; p < n; p++) {
        const rl_role role = node->pass->ports.rows[p].role;
        const int b = step->buffers[p];
        if (!check_shape(m, node, p, b))
            return false;
        if (b < 0)
            continue;
        if (role == RL_HISTORY && m->frame > 0 &&
            !expect(m, b, m->older[b],
                    image_token(m, node->images[p], node->pass->ports.rows[p].layout, m->frame - 1),
                    node->name))
            return false;
        if ((role == RL_READ || (step->step > 0 && role != RL_HISTORY)) &&
            !expect(m, b, *memory(m, b), port_token(m, node, step->node, p, b), node->name))
            return false;
    }
    for (size_t p = 0; p < n; p++)
        if (step->buffers[p] >= 0 &&
            (rl_port_makes(&node->pass->ports.rows[p]) || node->pass->ports.rows[p].role == RL_SCRATCH))
            *memory(m, step->buffers[p]) = port_token(m, node, step->node, p, step->buffers[p]);
    /* after: no write landed on another port's memory */
    for (size_t p = 0; p < n; p++)
        if (node->pass->ports.rows[p].role != RL_HISTORY && step->buffers[p] >= 0 &&
            !expect(m, step->buffers[p], *memory(m, step->buffers[p]),
                    port_token(m, node, step->node, p, step->buffers[p]), node->name))
            return false;
    return true;
}

static bool run_transfer(machine *m, const rl_plan_step *step)
{
    const rl_buffer *from = &m->plan->buffers[step->buffers[0]], *to = &m->plan->buffers[step->buffers[1]];
    if (step->n_buffers != 2 || from->image != to->image || from->planes != to->planes || from->image < 0 ||
        (from->layout == to->layout) != (step->kind == RL_STEP_COPY))
        return fail(m, "a transfer of %s to %s", from->name, to->name);
    if (to->kind == RL_BUFFER_TRANSIENT && m->plan->slot_planes[to->slot] < to->planes)
        return fail(m, "%s: slot %d is too small", to->name, to->slot);
    if (!expect(m, step->buffers[0], *memory(m, step->buffers[0]),
                image_token(m, from->image, from->layout, m->frame), "a transfer"))
        return false;
    *memory(m, step->buffers[1]) = image_token(m, to->image, to->layout, m->frame);
    return true;
}

static void start_frame(machine *m)
{
    for (size_t i = 0; i < m->plan->n_buffers; i++) {
        const rl_buffer *b = &m->plan->buffers[i];
        if (b->kind == RL_BUFFER_SOURCE)
            m->own[i] = image_token(m, b->image, b->layout, m->frame);
        if (b->kind == RL_BUFFER_SINK)
            m->own[i] = (token){.image = -1000};
    }
    memset(m->next_step, 0, sizeof m->next_step);
}

/* How many steps of a node run: those for sums come last, and only when the sums have a buffer. */
static size_t steps_of(const rl_graph *g, const rl_plan_node *n)
{
    const rl_pass *pass = g->nodes[n->node].pass;
    size_t count = 0;
    for (size_t s = 0; s < pass->steps.n; s++) {
        bool runs = !pass->steps.rows[s].with;
        for (size_t p = 0; p < pass->ports.n; p++)
            runs |= pass->ports.rows[p].role == RL_REDUCTION && n->buffers[p] >= 0;
        count += runs;
    }
    return count;
}

static bool end_frame(machine *m)
{
    const rl_graph *g = m->plan->graph;
    for (size_t i = 0; i < m->plan->n_nodes; i++)
        if ((size_t)m->next_step[m->plan->nodes[i].node] != steps_of(g, &m->plan->nodes[i]))
            return fail(m, "%s did not finish", g->nodes[m->plan->nodes[i].node].name);
    for (size_t o = 0; o < g->n_outputs; o++)
        for (size_t i = 0; i < g->outputs[o].n_images; i++) {
            const int b = m->plan->outputs[o][i];
            if (b < 0 ||
                (m->plan->buffers[b].kind != RL_BUFFER_SOURCE && m->plan->buffers[b].kind != RL_BUFFER_SINK))
                return fail(m, "the writer cannot read buffer %d", b);
            if (!expect(m, b, m->own[b], image_token(m, g->outputs[o].images[i], RL_LINEAR, m->frame),
                        "the writer"))
                return false;
        }
    for (size_t i = 0; i < m->plan->n_buffers; i++) {
        if (m->plan->buffers[i].kind != RL_BUFFER_HISTORY)
            continue;
        token swap = m->older[i];
        m->older[i] = m->own[i];
        m->own[i] = swap;
    }
    return true;
}

const char *simulate_plan(const rl_plan *plan, int frames)
{
    static machine m;
    memset(&m, 0xff, sizeof m);
    m.plan = plan;
    if (plan->n_buffers > MOST || plan->graph->n_nodes > MOST)
        return "the simulator is too small";
    for (m.frame = 0; m.frame < frames; m.frame++) {
        start_frame(&m);
        for (size_t s = 0; s < plan->n_steps; s++)
            if (!(plan->steps[s].kind == RL_STEP_KERNEL ? run_kernel : run_transfer)(&m, &plan->steps[s]))
                return m.fault;
        if (!end_frame(&m))
            return m.fault;
    }
    return NULL;
}
