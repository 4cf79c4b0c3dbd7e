#include "graph/model/materials_ids.h"

#include <stdlib.h>
#include <string.h>

static rl_code add_id(rl_id_list *list, int64_t id, unsigned dense, rl_where where, rl_error *err)
{
    if (list->n == list->room) {
        size_t room = list->room ? list->room * 2 : 32;
        rl_id_use *grown = rl_arena_array(list->arena, room, sizeof *grown);
        if (!grown)
            return rl_fail_memory(err, room * sizeof *grown);
        if (list->n)
            memcpy(grown, list->uses, list->n * sizeof *grown);
        list->uses = grown;
        list->room = room;
    }
    list->uses[list->n++] = (rl_id_use){id, dense, where};
    return RL_OK;
}

/* Adds every id of that name; *found says whether there was one. */
static rl_code add_named(rl_id_list *list, const char *name, unsigned dense, rl_where where, bool *found,
                         rl_error *err)
{
    rl_code code = RL_OK;
    *found = false;
    for (size_t i = 0; !code && i < list->n_names; i++) {
        if (!strcmp(list->names[i].name, name)) {
            code = add_id(list, list->names[i].id, dense, where, err);
            *found = true;
        }
    }
    return code;
}

static rl_code unknown_name(rl_id_list *list, rl_where where, const char *text, const char *name,
                            rl_error *err)
{
    const char **known = rl_arena_array(list->arena, list->n_names, sizeof *known);
    if (!known)
        return rl_fail_memory(err, list->n_names * sizeof *known);
    size_t n = 0;
    for (size_t i = 0; i < list->n_names; i++) { /* several ids may have one name */
        size_t k = 0;
        while (k < n && strcmp(known[k], list->names[i].name) != 0)
            k++;
        if (k == n)
            known[n++] = list->names[i].name;
    }
    return rl_fail_suggest(err, where, text, name, known, n);
}

static rl_code read_id(rl_id_list *list, unsigned dense, const rl_value *v, rl_error *err)
{
    if (v->kind == RL_NUMBER && v->integral && v->integer >= INT32_MIN && v->integer <= UINT32_MAX)
        return add_id(list, v->integer, dense, v->where, err);
    if (v->kind != RL_TEXT)
        return rl_value_wrong(v, "stencil", "a 32-bit integer, a name of stencil_names, or a list of them",
                              err);
    bool found;
    rl_code code = add_named(list, v->text, dense, v->where, &found, err);
    if (code || found)
        return code;
    char *text = list->n_names
                     ? rl_arena_printf(list->arena, "the capture's stencil_names have no '%s'", v->text)
                     : rl_arena_printf(list->arena,
                                       "stencil '%s' is a name, but the capture has no stencil_names: "
                                       "write the id",
                                       v->text);
    return unknown_name(list, v->where, text, v->text, err);
}

static rl_code read_stencil(rl_id_list *list, unsigned dense, const rl_value *v, rl_error *err)
{
    if (v->kind != RL_LIST)
        return read_id(list, dense, v, err);
    if (!v->n)
        return rl_value_wrong(v, "stencil", "at least one id", err);
    rl_code code = RL_OK;
    for (size_t i = 0; !code && i < v->n; i++)
        code = read_id(list, dense, v->items[i], err);
    return code;
}

static bool looks_like_one(const rl_id_list *list, const char *name)
{
    for (size_t i = 0; i < list->n_names; i++)
        if (rl_nearest(name, &list->names[i].name, 1))
            return true;
    return false;
}

rl_code rl_ids_read(rl_id_list *list, rl_materials *m, unsigned dense, const rl_entry *entry, rl_error *err)
{
    const rl_value *stencil = rl_value_get(entry->value, "stencil");
    if (!strcmp(entry->key, "default")) {
        m->other = dense;
        if (stencil)
            return rl_fail(
                err, RL_E_CONFIG, stencil->where,
                "material 'default' is for every id that no other material covers: it takes no 'stencil'");
        return RL_OK;
    }
    if (stencil)
        return read_stencil(list, dense, stencil, err);
    bool found;
    rl_code code = add_named(list, entry->key, dense, entry->where, &found, err);
    if (code || found)
        return code;
    if (list->n_names && !looks_like_one(list, entry->key)) {
        rl_report(list->log, RL_WARNING, entry->where,
                  "material '%s' is not in this capture: none of its %zu named ids is "
                  "called so",
                  entry->key, list->n_names);
        return RL_OK;
    }
    char *text = rl_arena_printf(list->arena, "material '%s' needs 'stencil' (an id): the capture %s",
                                 entry->key, list->n_names ? "names no id like it" : "has no stencil_names");
    return unknown_name(list, entry->where, text, entry->key, err);
}

static int by_id(const void *a, const void *b)
{
    const rl_id_use *x = a, *y = b;
    if (x->id != y->id)
        return x->id < y->id ? -1 : 1;
    return x->dense < y->dense ? -1 : x->dense > y->dense;
}

rl_code rl_ids_finish(rl_id_list *list, rl_materials *m, rl_error *err)
{
    rl_stencil_id *ids = rl_arena_array(list->arena, list->n, sizeof *ids);
    if (!ids)
        return rl_fail_memory(err, list->n * sizeof *ids);
    if (list->n)
        qsort(list->uses, list->n, sizeof *list->uses, by_id);
    for (size_t i = 0; i < list->n; i++) {
        const rl_id_use *use = &list->uses[i], *last = i ? use - 1 : NULL;
        if (last && last->id == use->id && last->dense == use->dense)
            return rl_fail(err, RL_E_CONFIG, use->where, "material '%s' lists stencil id %lld twice",
                           m->names[use->dense], (long long)use->id);
        if (last && last->id == use->id)
            return rl_fail(err, RL_E_CONFIG, use->where, "materials '%s' and '%s' both cover stencil id %lld",
                           m->names[last->dense], m->names[use->dense], (long long)use->id);
        ids[i] = (rl_stencil_id){use->id, use->dense};
    }
    m->ids = ids;
    m->n_ids = list->n;
    return RL_OK;
}
