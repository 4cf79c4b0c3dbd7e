#include "graph/model/materials_sets.h"

#include <string.h>

typedef struct filler {
    rl_arena *arena;
    const rl_materials *m;
    const rl_stencil_name *names;
    size_t n_names;
    rl_error *err;
} filler;

static unsigned find_id(const rl_materials *m, int64_t id)
{
    for (size_t i = 0; i < m->n_ids; i++)
        if (m->ids[i].id == id)
            return m->ids[i].dense;
    return 0;
}

/* The stencil name or id is the capture's, but no material covers it alone. */
static rl_code fail_default(const filler *f, const rl_node *node, const rl_value *v)
{
    return rl_fail(f->err, RL_E_CONFIG, v->where,
                   "pass '%s' (%s): '%s' has no material of its own%s; add one for it to 'materials'",
                   node->name, node->pass->name, v->text,
                   f->m->other ? ", 'default' covers it with others" : "");
}

static rl_code fail_name(const filler *f, const rl_node *node, const rl_value *v)
{
    const char **known = rl_arena_array(f->arena, f->m->count + f->n_names, sizeof *known);
    size_t n = 0;
    if (!known)
        return rl_fail_memory(f->err, f->m->count * sizeof *known);
    for (size_t i = 1; i < f->m->count; i++)
        known[n++] = f->m->names[i];
    char *text = rl_arena_printf(f->arena, "pass '%s' (%s): there is no material '%s'", node->name,
                                 node->pass->name, v->text);
    return rl_fail_suggest(f->err, v->where, text, v->text, known, n);
}

static void add(unsigned dense, void *set)
{
    uint32_t words[RL_SET_WORDS];
    memcpy(words, set, sizeof words);
    words[dense / 32] |= 1u << dense % 32;
    memcpy(set, words, sizeof words);
}

static rl_code add_one(const filler *f, const rl_node *node, const rl_value *v, void *set)
{
    bool known = false, added = false;
    unsigned dense = 0;
    if (v->kind == RL_NUMBER) {
        known = true;
        dense = find_id(f->m, v->integer);
    }
    for (size_t i = 1; i < f->m->count && v->kind == RL_TEXT && !dense; i++)
        dense = strcmp(f->m->names[i], v->text) ? 0 : (unsigned)i;
    if (dense) {
        add(dense, set);
        return RL_OK;
    }
    for (size_t i = 0; i < f->n_names && v->kind == RL_TEXT; i++) { /* several ids may have one name */
        if (strcmp(f->names[i].name, v->text))
            continue;
        known = true;
        dense = find_id(f->m, f->names[i].id);
        added |= dense > 0;
        if (dense)
            add(dense, set);
    }
    if (added)
        return RL_OK;
    return known ? fail_default(f, node, v) : fail_name(f, node, v);
}

static rl_code fill_row(const filler *f, const rl_node *node, const rl_param *row, void *params)
{
    const rl_value *v = rl_value_get(node->map, row->name);
    char *set = (char *)params + row->offset;
    if (!v || (v->kind == RL_LIST && !v->n))
        return RL_OK;
    if (f->m->count > 32 * RL_SET_WORDS)
        return rl_fail(f->err, RL_E_CONFIG, v->where, "'%s' works with up to %u materials, there are %zu",
                       row->name, 32 * RL_SET_WORDS - 1, f->m->count - 1);
    if (v->kind != RL_LIST)
        return add_one(f, node, v, set);
    rl_code code = RL_OK;
    for (size_t i = 0; i < v->n && !code; i++)
        code = add_one(f, node, v->items[i], set);
    return code;
}

static rl_code fill_node(const filler *f, rl_node *node)
{
    rl_params rows = node->pass->params;
    char *own = NULL;
    rl_code code = RL_OK;
    for (size_t i = 0; i < rows.n && !code && node->map; i++) {
        if (rows.rows[i].type != RL_MATERIALS)
            continue;
        if (!own) {
            own = rl_arena_alloc(f->arena, node->pass->params_size);
            if (!own)
                return rl_fail_memory(f->err, node->pass->params_size);
            memcpy(own, node->params, node->pass->params_size);
            node->params = own;
        }
        code = fill_row(f, node, &rows.rows[i], own);
    }
    return code;
}

rl_code rl_material_sets_fill(rl_arena *arena, const rl_node *nodes, size_t n_nodes, const rl_materials *m,
                              const rl_stencil_name *names, size_t n_names, const rl_node **out,
                              rl_error *err)
{
    filler f = {arena, m, names, n_names, err};
    rl_node *copy = rl_arena_array(arena, n_nodes + 1, sizeof *copy);
    rl_code code = RL_OK;
    if (!copy)
        return rl_fail_memory(err, n_nodes * sizeof *copy);
    for (size_t i = 0; i < n_nodes && !code; i++) {
        copy[i] = nodes[i];
        code = fill_node(&f, &copy[i]);
    }
    *out = copy;
    return code;
}
