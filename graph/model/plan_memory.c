/* Lives and slots. */
#include <limits.h>
#include <stdint.h>
#include <stdlib.h>

#include "graph/model/plan_build.h"
#include "kernels/shared.h"

/* ---- lives -----------------------------------------------------------------------------------------------
 */

/* A kernel gets all ports of its node in each of the node's steps, so a node's images live through all of
 * them. */
static void find_lives(rl_planner *p)
{
    for (size_t s = 0; s < p->n_steps; s++)
        for (int i = 0; i < p->steps[s].n_buffers; i++) {
            if (p->steps[s].buffers[i] < 0)
                continue;
            rl_buffer *b = &p->buffers[p->steps[s].buffers[i]];
            b->first = b->first < (int)s ? b->first : (int)s;
            b->last = b->last > (int)s ? b->last : (int)s;
        }
    for (size_t i = 0; i < p->n_buffers; i++) {
        rl_buffer *b = &p->buffers[i];
        if (b->kind == RL_BUFFER_SOURCE || b->kind == RL_BUFFER_HISTORY)
            b->first = -1;
        if (b->kind == RL_BUFFER_SINK || b->kind == RL_BUFFER_HISTORY)
            b->last = (int)p->n_steps;
    }
    for (size_t i = 0; i < p->graph->n_images; i++)
        if (p->images[i].sink >= 0)
            p->buffers[p->images[i].sink].last = (int)p->n_steps;
}

/* ---- slots -----------------------------------------------------------------------------------------------
 */

/* A slot's size before the size of a frame is known: RL_PHASE4 has margins and is a little larger than the
 * same planes in RL_LINEAR, one plane more is always larger than that. */
static int weight(const rl_buffer *b)
{
    return 2 * b->planes + (b->layout == RL_PHASE4);
}

typedef struct slot {
    int weight, planes;
    int last; /* the slot is taken until here: its life widens with each tenant */
} slot;

typedef struct tenant {
    int first, weight, buffer;
} tenant;

/* In the order of birth; of those born together the largest chooses first. */
static int by_birth(const void *a, const void *b)
{
    const tenant *x = a, *y = b;
    if (x->first != y->first)
        return x->first < y->first ? -1 : 1;
    if (x->weight != y->weight)
        return x->weight > y->weight ? -1 : 1;
    return (x->buffer > y->buffer) - (x->buffer < y->buffer);
}

/* Among the slots whose last use comes before `first`: the smallest that is large enough, else the largest,
 * which then grows by the least; -1 when all are taken. */
static int best_slot(const slot *slots, size_t n, int first, int need)
{
    int best = -1;
    for (size_t i = 0; i < n; i++) {
        if (slots[i].last >= first)
            continue;
        const bool fits = slots[i].weight >= need, best_fits = best >= 0 && slots[best].weight >= need;
        if (best < 0 || (fits && !best_fits) || (fits && slots[i].weight < slots[best].weight) ||
            (!fits && !best_fits && slots[i].weight > slots[best].weight))
            best = (int)i;
    }
    return best;
}

static rl_code assign_slots(rl_planner *p)
{
    tenant *tenants = rl_arena_array(p->arena, p->n_buffers, sizeof *tenants);
    slot *slots = rl_arena_array(p->arena, p->n_buffers, sizeof *slots);
    if (!tenants || !slots)
        return rl_fail_memory(p->err, p->n_buffers * (sizeof *tenants + sizeof *slots));
    size_t n = 0;
    for (size_t i = 0; i < p->n_buffers; i++)
        if (p->buffers[i].kind == RL_BUFFER_TRANSIENT)
            tenants[n++] = (tenant){p->buffers[i].first, weight(&p->buffers[i]), (int)i};
    qsort(tenants, n, sizeof *tenants, by_birth);
    for (size_t i = 0; i < n; i++) {
        rl_buffer *b = &p->buffers[tenants[i].buffer];
        int s = best_slot(slots, p->n_slots, b->first, tenants[i].weight);
        if (s < 0)
            s = (int)p->n_slots++;
        b->slot = s;
        slots[s].last = b->last;
        slots[s].weight = slots[s].weight > tenants[i].weight ? slots[s].weight : tenants[i].weight;
        slots[s].planes = slots[s].planes > b->planes ? slots[s].planes : b->planes;
    }
    p->slot_planes = rl_arena_array(p->arena, p->n_slots, sizeof *p->slot_planes);
    if (!p->slot_planes)
        return rl_fail_memory(p->err, p->n_slots * sizeof *p->slot_planes);
    for (size_t i = 0; i < p->n_slots; i++)
        p->slot_planes[i] = slots[i].planes;
    return RL_OK;
}

rl_code rl_plan_memory(rl_planner *p)
{
    find_lives(p);
    return assign_slots(p);
}

/* ---- bytes -----------------------------------------------------------------------------------------------
 */

static size_t add(size_t a, size_t b)
{
    return a > SIZE_MAX - b ? SIZE_MAX : a + b;
}

static size_t multiply(size_t a, size_t b)
{
    return b && a > SIZE_MAX / b ? SIZE_MAX : a * b;
}

/* Samples of a buffer without its guards; sums have no planes. */
static size_t samples(const rl_buffer *b, const rl_geometry *g)
{
    if (!b->planes)
        return RL_SUM_FLOATS;
    return multiply((size_t)b->planes, (size_t)(b->layout == RL_PHASE4 ? g->plane4 : g->plane));
}

rl_code rl_plan_fits(const rl_plan *plan, const rl_geometry *g, rl_error *err)
{
    for (size_t i = 0; i < plan->n_buffers; i++) {
        const rl_buffer *b = &plan->buffers[i];
        if (samples(b, g) > INT_MAX - 2 * RL_GUARD)
            return rl_fail(
                err, RL_E_MEMORY, RL_NOWHERE,
                "'%s' has %d planes of %d x %d pixels: more than the %d samples that a buffer can have",
                b->name, b->planes, g->columns, g->rows, INT_MAX - 2 * RL_GUARD);
    }
    return RL_OK;
}

size_t rl_buffer_bytes(const rl_buffer *buffer, const rl_geometry *g)
{
    return multiply(add(samples(buffer, g), 2 * RL_GUARD), sizeof(float));
}

size_t rl_slot_bytes(const rl_plan *plan, int slot_index, const rl_geometry *g)
{
    size_t most = 0;
    for (size_t i = 0; i < plan->n_buffers; i++) {
        size_t bytes = plan->buffers[i].slot == slot_index ? rl_buffer_bytes(&plan->buffers[i], g) : 0;
        most = bytes > most ? bytes : most;
    }
    return most;
}

size_t rl_buffer_copies(const rl_buffer *b, int in_flight)
{
    switch (b->kind) {
    case RL_BUFFER_SOURCE:
    case RL_BUFFER_SINK:
        return in_flight > 0 ? (size_t)in_flight : 1;
    case RL_BUFFER_HISTORY:
        return 2;
    case RL_BUFFER_TRANSIENT:
        return 1;
    }
    return 1;
}

size_t rl_plan_bytes(const rl_plan *plan, const rl_geometry *g, int in_flight)
{
    size_t sum = 0;
    for (size_t i = 0; i < plan->n_buffers; i++)
        if (plan->buffers[i].kind != RL_BUFFER_TRANSIENT)
            sum = add(sum, multiply(rl_buffer_bytes(&plan->buffers[i], g),
                                    rl_buffer_copies(&plan->buffers[i], in_flight)));
    for (size_t i = 0; i < plan->n_slots; i++)
        sum = add(sum, rl_slot_bytes(plan, (int)i, g));
    return sum;
}

size_t rl_plan_bytes_unshared(const rl_plan *plan, const rl_geometry *g, int in_flight)
{
    size_t sum = 0;
    for (size_t i = 0; i < plan->n_buffers; i++)
        sum = add(sum, multiply(rl_buffer_bytes(&plan->buffers[i], g),
                                rl_buffer_copies(&plan->buffers[i], in_flight)));
    return sum;
}
