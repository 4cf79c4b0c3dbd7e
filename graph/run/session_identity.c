/* What decides the bits of a run's pictures besides its inputs, as hashes. */
#include <string.h>
#include <xxhash.h>

#include "graph/run/kernel_source.h"
#include "graph/run/session_state.h"

static uint64_t add_text(uint64_t hash, const char *text)
{
    return XXH3_64bits_withSeed(text ? text : "", text ? strlen(text) : 0, hash + 1);
}

static uint64_t add_bytes(uint64_t hash, const void *data, size_t n)
{
    return XXH3_64bits_withSeed(n ? data : "", n, hash + 1);
}

static uint64_t hash_pipeline(const rl_session *s)
{
    const rl_options *o = &s->options;
    uint64_t h = add_bytes(0, &s->content, sizeof s->content);
    h = add_text(h, s->pipeline->name);
    for (size_t i = 0; i < s->n_outputs; i++) /* --only and --dump choose them */
        h = add_text(h, s->outputs[i].spec->name);
    return add_bytes(h, o->crop, sizeof o->crop);
}

/* How its layers become what kernels get is said by the manifest and the colour configuration. */
static uint64_t hash_capture(const rl_session *s, const rl_sequence *q)
{
    uint64_t h = add_bytes(0, &q->content, sizeof q->content);
    return add_text(add_bytes(h, &s->colors, sizeof s->colors), s->working);
}

static rl_code hash_plan(const rl_sequence *q, uint64_t *out, rl_error *err)
{
    rl_str text = {0};
    rl_code code = rl_plan_print_json(q->plan, NULL, 1, &text, err);
    if (!code && text.failed)
        code = rl_fail_memory(err, text.length);
    *out = add_text(0, rl_str_text(&text));
    rl_str_free(&text);
    return code;
}

/* Texts, parameters and tables of all that runs, the materials, and what files of lights hold. */
static rl_code hash_kernels(const rl_session *s, const rl_sequence *q, uint64_t *out, rl_error *err)
{
    const rl_materials *m = q->materials;
    rl_arena arena = {0};
    rl_code code = RL_OK;
    uint64_t h = add_bytes(0, m->data, m->count * m->entry_bytes);
    h = add_bytes(h, &s->ambient, sizeof s->ambient);
    h = add_bytes(h, q->setup.profiles, q->setup.n_profiles * sizeof *q->setup.profiles);
    h = add_bytes(h, q->setup.sky, q->setup.n_sky * sizeof *q->setup.sky);
    for (size_t i = 0; i < m->n_ids; i++) {
        h = add_bytes(h, &m->ids[i].id, sizeof m->ids[i].id);
        h = add_bytes(h, &m->ids[i].dense, sizeof m->ids[i].dense);
    }
    for (size_t i = 0; i < q->plan->n_nodes && !code; i++) {
        const rl_graph_node *g = &q->graph->nodes[q->plan->nodes[i].node];
        rl_pass_input in = {.pass = g->pass, .params = g->params, .materials = m};
        rl_tables tables = {0};
        rl_str text = {0};
        code = rl_kernel_text(&arena, q->plan, &q->plan->nodes[i], q->setup.kinds, &text, err);
        if (!code && g->pass->tables)
            code = g->pass->tables(&in, &arena, &tables, err);
        h = add_bytes(add_text(h, rl_str_text(&text)), g->params, g->pass->params_size);
        h = add_bytes(h, tables.data, tables.n * sizeof *tables.data);
        rl_str_free(&text);
    }
    rl_arena_free(&arena);
    *out = h;
    return code;
}

rl_code rl_session_identity(const rl_session *s, const rl_sequence *q, rl_identity *out, rl_error *err)
{
    const rl_device_info *d = rl_device_about(s->device);
    *out = (rl_identity){0};
    out->part[RL_ID_VERSION] = add_text(0, RL_VERSION);
    out->part[RL_ID_PIPELINE] = hash_pipeline(s);
    out->part[RL_ID_DEVICE] =
        add_text(add_text(add_text(add_text(0, d->name), d->platform), d->version), d->driver);
    out->part[RL_ID_CAPTURE] = hash_capture(s, q);
    rl_code code = hash_plan(q, &out->part[RL_ID_PLAN], err);
    if (!code)
        code = hash_kernels(s, q, &out->part[RL_ID_KERNELS], err);
    return code;
}
