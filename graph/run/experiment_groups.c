/* Which variants read frames alike, and their merged graphs. */
#include <string.h>
#include <xxhash.h>

#include "graph/run/experiment_parts.h"

/* ---- groups ---------------------------------------------------------------------------------------------
 */

static bool same_planes(const rl_light_planes *a, const rl_light_planes *b)
{
    if (a->n != b->n)
        return false;
    for (int i = 0; i < a->n; i++)
        if (strcmp(a->layers[i]->name, b->layers[i]->name))
            return false;
    return true;
}

/* Dense indices are what the stencil's plane holds. */
static bool same_ids(const rl_materials *a, const rl_materials *b)
{
    if (a->n_ids != b->n_ids || a->other != b->other)
        return false;
    for (size_t i = 0; i < a->n_ids; i++)
        if (a->ids[i].id != b->ids[i].id || a->ids[i].dense != b->ids[i].dense)
            return false;
    return true;
}

/* Why the frames of one cannot be read for the other; NULL: they can. */
static const char *difference(const rl_session *a, const rl_session *b, size_t capture)
{
    const rl_sequence *p = &a->sequences[capture], *q = &b->sequences[capture];
    if (a->colors != b->colors)
        return "the colour configuration differs";
    if (strcmp(a->working, b->working))
        return "the working space differs";
    if (!same_ids(p->materials, q->materials))
        return "other stencil ids have materials";
    if (!same_planes(&p->shadow, &q->shadow) || !same_planes(&p->thickness, &q->thickness))
        return "the lights use other shadow layers";
    return rl_graph_same_layers(p->graph, q->graph) ? NULL : "other layers of the capture are there";
}

static rl_code find_groups(rl_experiment *x, size_t capture, rl_error *err)
{
    rl_experiment_capture *c = &x->captures[capture];
    c->groups = rl_arena_array(&x->arena, x->n, sizeof *c->groups);
    c->write_ns = rl_arena_array(&x->arena, x->n, sizeof *c->write_ns);
    if (!c->groups || !c->write_ns)
        return rl_fail_memory(err, x->n * sizeof *c->groups);
    for (size_t i = 0; i < x->n; i++) {
        const char *reason = NULL;
        rl_group *g = NULL;
        for (size_t k = 0; k < c->n_groups && !g; k++) {
            const char *why = difference(x->sessions[c->groups[k].members[0]], x->sessions[i], capture);
            reason = reason ? reason : why;
            g = why ? NULL : &c->groups[k];
        }
        if (!g) {
            g = &c->groups[c->n_groups++];
            g->reason = c->n_groups > 1 ? reason : NULL;
            g->members = rl_arena_array(&x->arena, x->n, sizeof *g->members);
            if (!g->members)
                return rl_fail_memory(err, x->n * sizeof *g->members);
            if (g->reason)
                rl_report(x->log, RL_NOTE, RL_NOWHERE, "variant '%s' reads the frames of '%s' on its own: %s",
                          x->variants[i].name, x->sessions[0]->sequences[capture].manifest->name, g->reason);
        }
        g->members[g->n++] = i;
    }
    return RL_OK;
}

/* ---- merging --------------------------------------------------------------------------------------------
 */

/* Two cameras that tell every light that follows the camera from one that stands. */
static uint64_t hash_lights(const rl_sequence *q)
{
    static const camera_t cameras[2] = {{.to_world = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}},
                                        {.to_world = {0, -1, 0, 3, 1, 0, 0, 5, 0, 0, 1, 7}}};
    const rl_light_setup *l = &q->setup;
    uint64_t h = l->kinds;
    if (l->n_profiles)
        h = XXH3_64bits_withSeed(l->profiles, l->n_profiles * sizeof *l->profiles, h + 1);
    if (l->n_sky)
        h = XXH3_64bits_withSeed(l->sky, l->n_sky * sizeof *l->sky, h + 1);
    for (int i = 0; i < 2; i++) {
        rl_session_light_values(q, &cameras[i], q->light_values);
        h = XXH3_64bits_withSeed(q->light_values, q->n_lights * sizeof *q->light_values, h + 1);
    }
    return h;
}

static rl_code merge_group(rl_experiment *x, size_t capture, rl_group *g, rl_error *err)
{
    rl_merge_input *inputs = rl_arena_array(&x->arena, g->n, sizeof *inputs);
    if (!inputs)
        return rl_fail_memory(err, g->n * sizeof *inputs);
    bool keep_ids = false;
    for (size_t i = 0; i < g->n; i++) {
        const rl_session *s = x->sessions[g->members[i]];
        const rl_sequence *q = &s->sequences[capture];
        inputs[i] = (rl_merge_input){.graph = q->graph,
                                     .materials = q->materials,
                                     .lights = hash_lights(q),
                                     .ambient = XXH3_64bits(&s->ambient, sizeof s->ambient)};
        keep_ids |= rl_session_keeps_ids(s);
    }
    rl_code code = rl_graph_merge(&x->arena, inputs, g->n, &g->merged, err);
    const rl_graph *graph = NULL;
    if (!code)
        code = rl_experiment_want_energy(x, g, &graph, err);
    if (!code)
        code = rl_plan_make(&x->arena, graph, &g->plan, err);
    for (size_t i = 0; i < g->n && !code; i++) {
        rl_sequence *q = rl_experiment_sequence(x, g->members[i], capture);
        q->graph = graph;
        q->plan = g->plan;
        q->first_output = g->merged->first_output[i];
    }
    rl_sequence *leader = rl_experiment_sequence(x, g->members[0], capture);
    if (!code)
        code = rl_sequence_read_for(x->sessions[g->members[0]], leader, g->plan, keep_ids, err);
    return code;
}

/* Nodes that the outputs from `first` on need, n of them. */
static void mark(const rl_graph *graph, size_t first, size_t n, bool *const *marks, size_t variant)
{
    for (size_t o = first; o < first + n; o++)
        for (size_t i = 0; i < graph->outputs[o].n_images; i++) {
            int node = graph->images[graph->outputs[o].images[i]].node;
            if (node >= 0)
                marks[node][variant] = true;
        }
    /* Producers come before their consumers in a merged graph: one way back marks all. */
    for (size_t k = graph->n_nodes; k-- > 0;)
        for (size_t p = 0; marks[k][variant] && p < graph->nodes[k].pass->ports.n; p++) {
            int image = graph->nodes[k].images[p];
            if (graph->nodes[k].pass->ports.rows[p].role == RL_READ && image >= 0 &&
                graph->images[image].node >= 0)
                marks[graph->images[image].node][variant] = true;
        }
}

static rl_code mark_nodes(rl_experiment *x, rl_group *g, rl_error *err)
{
    const rl_graph *graph = g->merged->graph;
    g->used = rl_arena_array(&x->arena, graph->n_nodes + 1, sizeof *g->used);
    g->wanted = rl_arena_array(&x->arena, graph->n_nodes + 1, sizeof *g->wanted);
    g->node_ns = rl_arena_array(&x->arena, graph->n_nodes + 1, sizeof *g->node_ns);
    bool good = g->used && g->wanted && g->node_ns;
    for (size_t k = 0; k < graph->n_nodes && good; k++) {
        g->used[k] = rl_arena_array(&x->arena, x->n, sizeof **g->used);
        g->wanted[k] = rl_arena_array(&x->arena, x->n, sizeof **g->wanted);
        good = g->used[k] && g->wanted[k];
    }
    if (!good)
        return rl_fail_memory(err, graph->n_nodes * 2 * x->n);
    for (size_t i = 0; i < g->n; i++) {
        const rl_session *s = x->sessions[g->members[i]];
        const size_t first = g->merged->first_output[i];
        mark(graph, first, s->n_outputs + s->n_hidden, g->used, g->members[i]);
        mark(graph, first, s->n_outputs, g->wanted, g->members[i]);
    }
    return RL_OK;
}

/* As many frames as overlap usefully and as the limit lets be in flight, all groups together. */
static rl_code fit_memory(rl_experiment *x, size_t capture, rl_error *err)
{
    rl_experiment_capture *c = &x->captures[capture];
    const uint64_t limit = x->options.memory_limit;
    for (c->in_flight = RL_MOST_IN_FLIGHT; c->in_flight > 0; c->in_flight--) {
        uint64_t sum = 0;
        for (size_t i = 0; i < c->n_groups; i++) {
            rl_memory_need need;
            size_t leader = c->groups[i].members[0];
            rl_session_need(x->sessions[leader], rl_experiment_sequence(x, leader, capture), c->in_flight,
                            &need);
            sum = need.total > UINT64_MAX - sum ? UINT64_MAX : sum + need.total;
        }
        if (!limit || sum <= limit)
            return RL_OK;
        if (c->in_flight == 1) {
            char a[32], b[32];
            return rl_fail(err, RL_E_MEMORY, RL_NOWHERE,
                           "one frame of '%s' in %zu variants needs %s, more than --memory-limit %s",
                           rl_experiment_sequence(x, 0, capture)->manifest->name, x->n,
                           rl_format_bytes(sum, a), rl_format_bytes(limit, b));
        }
    }
    return RL_OK;
}

rl_code rl_experiment_merge(rl_experiment *x, size_t capture, rl_error *err)
{
    rl_experiment_capture *c = &x->captures[capture];
    rl_code code = find_groups(x, capture, err);
    for (size_t i = 0; i < c->n_groups && !code; i++) {
        rl_group *g = &c->groups[i];
        const rl_sequence *leader = rl_experiment_sequence(x, g->members[0], capture);
        code = merge_group(x, capture, g, err);
        if (!code)
            code = mark_nodes(x, g, err);
        if (!code && leader->geometry.columns)
            code = rl_plan_fits(g->plan, &leader->geometry, err);
    }
    return code ? code : fit_memory(x, capture, err);
}
