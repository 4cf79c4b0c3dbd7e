/* What must hold for every plan, on random graphs: each read finds what it should over three frames, no two
 * lives in one slot, nothing needed is culled, nothing is made for nobody, planning twice gives the same. */
#include <limits.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

#include "graph/base/alloc.h"
#include "graph/model/plan.h"
#include "kernels/shared.h"
#include "plan_simulator.h"
#include "random_graph.h"

enum { RANDOM_GRAPHS = 20000 };

/* ---- what must hold for every plan ------------------------------------------------------------------------
 */

/* Which nodes the outputs need, found without the planner: until nothing changes. */
static void find_needed(const rl_graph *g, bool *needed)
{
    memset(needed, 0, g->n_nodes * sizeof *needed);
    for (size_t o = 0; o < g->n_outputs; o++)
        for (size_t i = 0; i < g->outputs[o].n_images; i++)
            if (g->images[g->outputs[o].images[i]].node >= 0)
                needed[g->images[g->outputs[o].images[i]].node] = true;
    for (bool changed = true; changed;) {
        changed = false;
        for (size_t n = 0; n < g->n_nodes; n++)
            for (size_t p = 0; needed[n] && p < g->nodes[n].pass->ports.n; p++) {
                int image = g->nodes[n].images[p];
                int producer = image >= 0 ? g->images[image].node : -1;
                if (producer >= 0 && !needed[producer])
                    changed = needed[producer] = true;
            }
    }
}

static const char *check_nodes(const rl_plan *plan)
{
    const rl_graph *g = plan->graph;
    bool needed[64], seen[64] = {false};
    find_needed(g, needed);
    for (size_t i = 0; i < plan->n_nodes; i++) {
        if (!needed[plan->nodes[i].node] || seen[plan->nodes[i].node])
            return "a node runs that is not needed, or twice";
        seen[plan->nodes[i].node] = true;
    }
    for (size_t i = 0; i < plan->n_culled; i++) {
        if (needed[plan->culled[i]] || seen[plan->culled[i]])
            return "a node is culled that is needed, or twice";
        seen[plan->culled[i]] = true;
    }
    return plan->n_nodes + plan->n_culled == g->n_nodes ? NULL : "a node is lost";
}

/* How often a buffer is the target of a transfer, and whether anybody reads it. */
static void find_uses(const rl_plan *plan, int buffer, int *filled, bool *read, bool *written)
{
    *filled = 0;
    *read = *written = false;
    for (size_t s = 0; s < plan->n_steps; s++) {
        const rl_plan_step *step = &plan->steps[s];
        for (int i = 0; i < step->n_buffers; i++) {
            if (step->buffers[i] != buffer)
                continue;
            rl_role role = step->kind == RL_STEP_KERNEL
                               ? plan->graph->nodes[step->node].pass->ports.rows[i].role
                               : (i ? RL_WRITE : RL_READ);
            *read |= role == RL_READ || role == RL_HISTORY;
            *written |= role == RL_WRITE && step->kind == RL_STEP_KERNEL;
            *filled += role == RL_WRITE && step->kind != RL_STEP_KERNEL;
        }
    }
    for (size_t o = 0; o < plan->graph->n_outputs; o++)
        for (size_t i = 0; i < plan->graph->outputs[o].n_images; i++)
            *read |= plan->outputs[o][i] == buffer;
}

/* Nothing is made that nobody uses, and nothing is made twice. */
static const char *check_economy(const rl_plan *plan)
{
    for (size_t i = 0; i < plan->n_buffers; i++) {
        const rl_buffer *b = &plan->buffers[i];
        int filled;
        bool read, written;
        find_uses(plan, (int)i, &filled, &read, &written);
        if (b->image >= 0 && !read && !written)
            return "a buffer that nobody reads";
        if (filled > 1 || (filled && written))
            return "a buffer is filled twice";
        const int producer = b->image >= 0 ? plan->graph->images[b->image].node : -1;
        if (!filled || producer < 0)
            continue;
        const rl_port *port =
            &plan->graph->nodes[producer].pass->ports.rows[plan->graph->images[b->image].port];
        for (size_t j = 0; j < plan->n_buffers && port->any_layout; j++) {
            int other_filled;
            bool other_read, other_written;
            if (plan->buffers[j].image != b->image || plan->buffers[j].layout == b->layout)
                continue;
            find_uses(plan, (int)j, &other_filled, &other_read, &other_written);
            /* the conversion itself is one reader: somebody else must want that layout too */
            int ports = 0;
            for (size_t s = 0; s < plan->n_steps; s++)
                for (int k = 0; k < plan->steps[s].n_buffers; k++)
                    ports += plan->steps[s].buffers[k] == (int)j && plan->steps[s].kind == RL_STEP_KERNEL &&
                             plan->graph->nodes[plan->steps[s].node].pass->ports.rows[k].role != RL_WRITE;
            for (size_t o = 0; o < plan->graph->n_outputs; o++)
                for (size_t k = 0; k < plan->graph->outputs[o].n_images; k++)
                    ports +=
                        plan->graph->outputs[o].images[k] == b->image && plan->buffers[j].layout == RL_LINEAR;
            if (!ports)
                return "a conversion where the producer could have stored that layout";
        }
    }
    return NULL;
}

static const char *check_lives(const rl_plan *plan)
{
    for (size_t i = 0; i < plan->n_buffers; i++) {
        const rl_buffer *a = &plan->buffers[i];
        if ((a->kind == RL_BUFFER_TRANSIENT) != (a->slot >= 0) || a->slot >= (int)plan->n_slots)
            return "a slot where none belongs, or none";
        if (a->first > a->last || a->last > (int)plan->n_steps)
            return "a life that is none";
        for (size_t j = 0; j < i; j++) {
            const rl_buffer *b = &plan->buffers[j];
            if (a->slot >= 0 && a->slot == b->slot && a->first <= b->last && b->first <= a->last)
                return "two lives overlap in one slot";
        }
        for (size_t s = 0; s < plan->n_steps; s++)
            for (int k = 0; k < plan->steps[s].n_buffers; k++)
                if (plan->steps[s].buffers[k] == (int)i && ((int)s < a->first || (int)s > a->last))
                    return "a use outside of a life";
    }
    return NULL;
}

static const char *check_bytes(const rl_plan *plan)
{
    rl_geometry g;
    if (rl_geometry_make(-3, 5, 500, 300, &g, NULL) != RL_OK)
        return "no geometry";
    size_t slots = 0, transient = 0;
    for (size_t i = 0; i < plan->n_slots; i++)
        slots += rl_slot_bytes(plan, (int)i, &g);
    for (size_t i = 0; i < plan->n_buffers; i++) {
        size_t bytes = rl_buffer_bytes(&plan->buffers[i], &g);
        transient += plan->buffers[i].kind == RL_BUFFER_TRANSIENT ? bytes : 0;
        if (plan->buffers[i].slot >= 0 && rl_slot_bytes(plan, plan->buffers[i].slot, &g) < bytes)
            return "a slot smaller than its tenant";
    }
    size_t with = rl_plan_bytes(plan, &g, 2), without = rl_plan_bytes_unshared(plan, &g, 2);
    return with <= without && without - with == transient - slots ? NULL : "the sums do not add up";
}

static bool same_plan(const rl_plan *a, const rl_plan *b)
{
    bool same = a->n_buffers == b->n_buffers && a->n_steps == b->n_steps && a->n_nodes == b->n_nodes &&
                a->n_slots == b->n_slots && a->n_culled == b->n_culled;
    for (size_t i = 0; same && i < a->n_buffers; i++) {
        const rl_buffer *x = &a->buffers[i], *y = &b->buffers[i];
        same = x->image == y->image && x->layout == y->layout && x->planes == y->planes &&
               x->kind == y->kind && x->slot == y->slot && x->first == y->first && x->last == y->last &&
               !strcmp(x->name, y->name);
    }
    for (size_t i = 0; same && i < a->n_steps; i++) {
        const rl_plan_step *x = &a->steps[i], *y = &b->steps[i];
        same = x->kind == y->kind && x->node == y->node && x->step == y->step &&
               x->n_buffers == y->n_buffers &&
               !memcmp(x->buffers, y->buffers, (size_t)x->n_buffers * sizeof *x->buffers);
    }
    for (size_t i = 0; same && i < a->n_nodes; i++)
        same = a->nodes[i].node == b->nodes[i].node;
    return same;
}

static void holds_for_random_graphs(void **state)
{
    (void)state;
    size_t shared = 0, converts = 0, copies = 0, culled = 0, pairs = 0, sinks = 0;
    for (unsigned long long seed = 1; seed <= RANDOM_GRAPHS; seed++) {
        rl_arena arena = {0};
        const rl_graph *graph = random_graph(&arena, seed);
        const rl_plan *plan = NULL, *again = NULL;
        assert_int_equal(rl_plan_make(&arena, graph, &plan, NULL), RL_OK);
        assert_int_equal(rl_plan_make(&arena, graph, &again, NULL), RL_OK);
        const char *fault = simulate_plan(plan, 3);
        const char *(*const checks[])(const rl_plan *) = {check_nodes, check_economy, check_lives,
                                                          check_bytes};
        for (size_t i = 0; i < RL_ARRAY_LENGTH(checks) && !fault; i++)
            fault = checks[i](plan);
        if (!fault && !same_plan(plan, again))
            fault = "planned twice, planned differently";
        if (fault)
            fail_msg("graph %llu: %s", seed, fault);
        for (size_t i = 0; i < plan->n_buffers; i++) {
            shared += plan->buffers[i].kind == RL_BUFFER_TRANSIENT;
            pairs += plan->buffers[i].kind == RL_BUFFER_HISTORY;
            sinks += plan->buffers[i].kind == RL_BUFFER_SINK;
        }
        for (size_t i = 0; i < plan->n_steps; i++) {
            converts += plan->steps[i].kind == RL_STEP_CONVERT;
            copies += plan->steps[i].kind == RL_STEP_COPY;
        }
        shared -= plan->n_slots;
        culled += plan->n_culled;
        rl_arena_free(&arena);
    }
    /* the graphs are not so tame that nothing happens in them */
    assert_true(shared > RANDOM_GRAPHS && converts > RANDOM_GRAPHS && copies > RANDOM_GRAPHS / 10);
    assert_true(culled > RANDOM_GRAPHS && pairs > RANDOM_GRAPHS / 2 && sinks > RANDOM_GRAPHS / 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(holds_for_random_graphs),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
