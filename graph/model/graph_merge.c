#include "graph/model/graph_merge.h"

#include <string.h>
#include <xxhash.h>

#include "graph/model/graph_build.h"
#include "graph/model/params.h"

/* ---- content --------------------------------------------------------------------------------------------
 */

static rl_content mix(rl_content h, const void *data, size_t n)
{
    XXH128_hash_t d = XXH3_128bits(n ? data : "", n);
    const uint64_t both[] = {h.low, h.high, d.low64, d.high64, n};
    XXH128_hash_t sum = XXH3_128bits(both, sizeof both);
    return (rl_content){sum.low64, sum.high64};
}

static rl_content mix_text(rl_content h, const char *text)
{
    return mix(h, text ? text : "", text ? strlen(text) + 1 : 0);
}

static rl_content mix_int(rl_content h, int64_t v)
{
    return mix(h, &v, sizeof v);
}

/* A pass of the registry is what its name says in this build; one that was made at run time is its text, its
 * ports and its steps. */
static rl_content mix_pass(rl_content h, const rl_pass *pass)
{
    h = mix_text(h, pass->name);
    if (pass == rl_pass_find(pass->name))
        return h;
    h = mix_text(mix_text(mix_text(h, pass->kernel), pass->kernel_prelude), pass->kernel_text);
    for (size_t i = 0; i < pass->ports.n; i++) {
        const rl_port *p = &pass->ports.rows[i];
        const int64_t facts[] = {p->role, p->format, p->optional, p->layout, p->any_layout};
        h = mix(mix_text(mix_text(h, p->name), p->of), facts, sizeof facts);
    }
    for (size_t i = 0; i < pass->params.n; i++) {
        const rl_param *p = &pass->params.rows[i];
        h = mix_int(mix_int(mix_text(h, p->name), p->type), p->structural);
    }
    for (size_t i = 0; i < pass->steps.n; i++) {
        const rl_step *s = &pass->steps.rows[i];
        h = mix_int(mix_int(mix_text(mix_text(h, s->entry), s->when), s->domain), s->is);
    }
    return h;
}

static bool declares(rl_params rows, const char *name)
{
    for (size_t i = 0; i < rows.n; i++)
        if (!strcmp(rows.rows[i].name, name))
            return true;
    return false;
}

static bool reads_row(const rl_pass *pass, const rl_material_row *row)
{
    rl_params group = !strcmp(row->group, "profile")    ? pass->profile_keys
                      : !strcmp(row->group, "material") ? pass->material_keys
                                                        : pass->shading_keys;
    return declares(group, row->param->name);
}

static rl_content mix_materials(rl_content h, const rl_pass *pass, const rl_materials *m)
{
    bool all = pass->kernel_text && strstr(pass->kernel_text, "material");
    bool any = pass->profile_keys.n + pass->material_keys.n + pass->shading_keys.n > 0;
    if (!all && !any)
        return h;
    h = mix_int(h, (int64_t)m->count);
    for (size_t i = 0; i < m->count; i++) {
        const char *entry = (const char *)m->data + i * m->entry_bytes;
        h = mix(h, entry, sizeof(int32_t)); /* has_profile */
        for (size_t k = 0; k < m->n_rows; k++)
            if (all || reads_row(pass, &m->rows[k]))
                h = mix(h, entry + m->rows[k].offset, rl_param_bytes(m->rows[k].param));
    }
    return h;
}

static rl_code mix_tables(rl_content *h, const rl_graph_node *node, const rl_materials *materials,
                          rl_error *err)
{
    if (!node->pass->tables)
        return RL_OK;
    rl_arena arena = {0};
    rl_tables t = {0};
    rl_pass_input in = {.pass = node->pass, .params = node->params, .materials = materials};
    rl_code code = node->pass->tables(&in, &arena, &t, err);
    if (!code)
        *h = mix(*h, t.data, t.n * sizeof *t.data);
    rl_arena_free(&arena);
    return code;
}

/* ---- merging --------------------------------------------------------------------------------------------
 */

typedef struct merger {
    rl_arena *arena;
    rl_error *err;
    const rl_merge_input *inputs;
    size_t n;
    rl_image *images;
    size_t n_images;
    rl_graph_node *nodes;
    rl_merged_from *from;
    bool **used; /* from[i].used, while it may be written */
    size_t n_nodes;
    rl_graph_output *outputs;
    size_t n_outputs;
} merger;

/* An image of a merged graph as an input: its producer's content and port, or the layer. */
static rl_content mix_image(const merger *m, rl_content h, int image)
{
    if (image < 0)
        return mix_int(h, -1);
    const rl_image *i = &m->images[image];
    if (i->node < 0)
        return mix_text(h, i->name);
    return mix_int(mix(h, &m->from[i->node].content, sizeof m->from[i->node].content), i->port);
}

/* `images`: the merged image of each of the variant's that is made so far. The past of an own output is known
 * by the port alone, since the rest of it is this very content. */
static rl_code content_of(const merger *m, size_t variant, int index, const int *images, rl_content *out)
{
    const rl_merge_input *in = &m->inputs[variant];
    const rl_graph_node *node = &in->graph->nodes[index];
    const rl_pass *pass = node->pass;
    rl_content h = mix_pass((rl_content){0}, pass);
    h = mix(h, node->params, pass->params.n ? pass->params_size : 0);
    h = mix_materials(h, pass, in->materials);
    h = mix_int(h, pass->lights ? (int64_t)in->lights : 0);
    h = mix_int(h, pass->ambient ? (int64_t)in->ambient : 0);
    for (size_t p = 0; p < pass->ports.n; p++) {
        int image = node->images[p];
        const rl_role role = pass->ports.rows[p].role;
        if (role == RL_READ)
            h = mix_image(m, h, image < 0 ? -1 : images[image]);
        else if (role == RL_HISTORY && image >= 0 && in->graph->images[image].node == index)
            h = mix_int(h, in->graph->images[image].port);
        else if (role == RL_HISTORY)
            h = mix_image(m, h, image < 0 ? -1 : images[image]);
    }
    *out = h;
    return mix_tables(out, node, in->materials, m->err);
}

static int find_content(const merger *m, rl_content content)
{
    for (size_t i = 0; i < m->n_nodes; i++)
        if (m->from[i].content.low == content.low && m->from[i].content.high == content.high)
            return (int)i;
    return -1;
}

static bool node_named(const merger *m, const char *name)
{
    for (size_t i = 0; i < m->n_nodes; i++)
        if (!strcmp(m->nodes[i].name, name))
            return true;
    return false;
}

/* "sss", or "sss@2" of the second variant where another node is "sss". */
static const char *name_node(const merger *m, const char *name, size_t variant)
{
    const char *chosen = name;
    for (size_t k = variant + 1; chosen && node_named(m, chosen); k += m->n)
        chosen = rl_arena_printf(m->arena, "%s@%zu", name, k);
    return chosen;
}

/* The part of an image's name behind the node's. */
static const char *port_of(const char *image, const char *node)
{
    return image + strlen(node) + 1;
}

static rl_code add_node(merger *m, size_t variant, int index, rl_content content, const int *images)
{
    const rl_graph *g = m->inputs[variant].graph;
    const rl_graph_node *node = &g->nodes[index];
    const size_t n_ports = node->pass->ports.n;
    int *bound = rl_arena_array(m->arena, n_ports + 1, sizeof *bound);
    bool *used = rl_arena_array(m->arena, m->n, sizeof *used);
    const char *name = name_node(m, node->name, variant);
    if (!bound || !used || !name)
        return rl_fail_memory(m->err, n_ports * sizeof *bound);
    const int first = (int)m->n_images;
    for (size_t p = 0; p < n_ports; p++) {
        bound[p] = -1;
        if (!rl_port_makes(&node->pass->ports.rows[p]) || node->images[p] < 0)
            continue;
        const rl_image *from = &g->images[node->images[p]];
        rl_image image = *from;
        image.node = (int)m->n_nodes;
        image.name = rl_arena_printf(m->arena, "%s.%s", name, port_of(from->name, node->name));
        if (!image.name)
            return rl_fail_memory(m->err, strlen(name) + 16);
        bound[p] = (int)m->n_images;
        m->images[m->n_images++] = image;
    }
    for (size_t p = 0; p < n_ports; p++) {
        const rl_role role = node->pass->ports.rows[p].role;
        int image = node->images[p];
        if ((role != RL_READ && role != RL_HISTORY) || image < 0)
            continue;
        bound[p] = images[image];
        if (g->images[image].node == index) /* an own output's past */
            for (int k = first; k < (int)m->n_images; k++)
                bound[p] = m->images[k].port == g->images[image].port ? k : bound[p];
    }
    m->nodes[m->n_nodes] = *node;
    m->nodes[m->n_nodes].name = name;
    m->nodes[m->n_nodes].images = bound;
    m->nodes[m->n_nodes].scene = (int)variant;
    m->used[m->n_nodes] = used;
    m->from[m->n_nodes++] = (rl_merged_from){.content = content, .used = used};
    return RL_OK;
}

/* A node of a variant whose inputs are merged: finds it, or adds it; then its images are known. */
static rl_code merge_node(merger *m, size_t variant, int index, int *images)
{
    const rl_graph *g = m->inputs[variant].graph;
    const rl_graph_node *node = &g->nodes[index];
    rl_content content;
    rl_code code = content_of(m, variant, index, images, &content);
    if (code)
        return code;
    int merged = find_content(m, content);
    if (merged < 0) {
        code = add_node(m, variant, index, content, images);
        if (code)
            return code;
        merged = (int)m->n_nodes - 1;
    }
    m->used[merged][variant] = true;
    m->from[merged].n_used++;
    for (size_t p = 0; p < node->pass->ports.n; p++)
        if (rl_port_makes(&node->pass->ports.rows[p]) && node->images[p] >= 0)
            images[node->images[p]] = m->nodes[merged].images[p];
    return RL_OK;
}

static rl_code add_outputs(merger *m, size_t variant, const int *images)
{
    const rl_graph *g = m->inputs[variant].graph;
    for (size_t o = 0; o < g->n_outputs; o++) {
        const rl_graph_output *from = &g->outputs[o];
        int *list = rl_arena_array(m->arena, from->n_images + 1, sizeof *list);
        const char *name =
            variant ? rl_arena_printf(m->arena, "%s@%zu", from->name, variant + 1) : from->name;
        if (!list || !name)
            return rl_fail_memory(m->err, from->n_images * sizeof *list);
        for (size_t i = 0; i < from->n_images; i++)
            list[i] = images[from->images[i]];
        m->outputs[m->n_outputs++] = (rl_graph_output){name, list, from->n_images};
    }
    return RL_OK;
}

static rl_code merge_variant(merger *m, size_t variant)
{
    const rl_graph *g = m->inputs[variant].graph;
    rl_arena scratch = {0};
    size_t n_roots = 0, n_order = 0, most = 0;
    bool cycle = false;
    for (size_t o = 0; o < g->n_outputs; o++)
        most += g->outputs[o].n_images;
    int *roots = rl_arena_array(&scratch, most + 1, sizeof *roots);
    int *order = rl_arena_array(&scratch, g->n_nodes + 1, sizeof *order);
    int *images = rl_arena_array(&scratch, g->n_images + 1, sizeof *images);
    rl_code code = roots && order && images ? RL_OK : rl_fail_memory(m->err, most * sizeof *roots);
    for (size_t o = 0; o < g->n_outputs && !code; o++)
        for (size_t i = 0; i < g->outputs[o].n_images; i++)
            roots[n_roots++] = g->images[g->outputs[o].images[i]].node;
    for (size_t i = 0; i < g->n_images && !code; i++)
        images[i] = g->images[i].node < 0 ? (int)i : -1;
    if (!code)
        code = rl_graph_walk(&scratch, g->images, g->nodes, g->n_nodes, roots, n_roots, order, &n_order,
                             &cycle, m->err);
    if (!code && cycle)
        code = rl_fail(m->err, RL_E_INTERNAL, RL_NOWHERE, "a graph with a cycle cannot be merged");
    for (size_t i = 0; i < n_order && !code; i++)
        code = merge_node(m, variant, order[i], images);
    if (!code)
        code = add_outputs(m, variant, images);
    rl_arena_free(&scratch);
    return code;
}

/* Layers come first among a graph's images, and are the same for all. */
static size_t count_layers(const rl_graph *g)
{
    size_t n = 0;
    while (n < g->n_images && g->images[n].node < 0)
        n++;
    return n;
}

bool rl_graph_same_layers(const rl_graph *a, const rl_graph *b)
{
    size_t n = count_layers(a);
    if (count_layers(b) != n)
        return false;
    for (size_t i = 0; i < n; i++)
        if (strcmp(a->images[i].name, b->images[i].name) || a->images[i].format != b->images[i].format ||
            a->images[i].planes != b->images[i].planes || a->images[i].port != b->images[i].port)
            return false;
    return true;
}

static rl_code make_room(merger *m)
{
    size_t images = count_layers(m->inputs[0].graph), nodes = 0, outputs = 0;
    for (size_t i = 0; i < m->n; i++) {
        images += m->inputs[i].graph->n_images;
        nodes += m->inputs[i].graph->n_nodes;
        outputs += m->inputs[i].graph->n_outputs;
    }
    m->images = rl_arena_array(m->arena, images + 1, sizeof *m->images);
    m->nodes = rl_arena_array(m->arena, nodes + 1, sizeof *m->nodes);
    m->from = rl_arena_array(m->arena, nodes + 1, sizeof *m->from);
    m->used = rl_arena_array(m->arena, nodes + 1, sizeof *m->used);
    m->outputs = rl_arena_array(m->arena, outputs + 1, sizeof *m->outputs);
    if (!m->images || !m->nodes || !m->from || !m->used || !m->outputs)
        return rl_fail_memory(m->err, images * sizeof *m->images + nodes * sizeof *m->nodes);
    m->n_images = count_layers(m->inputs[0].graph);
    memcpy(m->images, m->inputs[0].graph->images, m->n_images * sizeof *m->images);
    return RL_OK;
}

rl_code rl_graph_merge(rl_arena *arena, const rl_merge_input *inputs, size_t n, const rl_merged **out,
                       rl_error *err)
{
    merger m = {.arena = arena, .err = err, .inputs = inputs, .n = n};
    rl_merged *merged = rl_arena_alloc(arena, sizeof *merged);
    rl_graph *graph = rl_arena_alloc(arena, sizeof *graph);
    size_t *first = rl_arena_array(arena, n + 1, sizeof *first);
    *out = NULL;
    if (!merged || !graph || !first)
        return rl_fail_memory(err, sizeof *merged + sizeof *graph + n * sizeof *first);
    rl_code code = make_room(&m);
    for (size_t i = 0; i < n && !code; i++) {
        first[i] = m.n_outputs;
        code = merge_variant(&m, i);
    }
    if (code)
        return code;
    *graph = (rl_graph){m.images, m.n_images, m.nodes, m.n_nodes, m.outputs, m.n_outputs};
    *merged = (rl_merged){graph, m.from, first};
    *out = merged;
    return RL_OK;
}
