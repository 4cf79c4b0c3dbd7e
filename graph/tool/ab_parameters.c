/* Where the variants' pipelines differ, includes and settings applied. */
#include <string.h>

#include "graph/tool/ab_plan_parts.h"

/* The trees, side by side, at one path. */
typedef struct walker {
    rl_arena *arena;
    size_t n; /* trees */
    rl_ab_parameter *found;
    size_t n_found, room;
    rl_error *err;
} walker;

static rl_code print_one(const walker *w, const rl_value *v, const char **out)
{
    rl_str text = {0};
    *out = NULL;
    if (!v)
        return RL_OK;
    rl_value_print(v, &text);
    *out = text.failed ? NULL : rl_arena_strdup(w->arena, rl_str_text(&text));
    rl_str_free(&text);
    return *out ? RL_OK : rl_fail_memory(w->err, 64);
}

static rl_code add_found(walker *w, const char *path, const char *const *values)
{
    if (w->n_found == w->room) {
        size_t room = w->room ? 2 * w->room : 16;
        rl_ab_parameter *grown = rl_arena_array(w->arena, room, sizeof *grown);
        if (!grown)
            return rl_fail_memory(w->err, room * sizeof *grown);
        if (w->n_found)
            memcpy(grown, w->found, w->n_found * sizeof *grown);
        w->found = grown;
        w->room = room;
    }
    w->found[w->n_found++] = (rl_ab_parameter){path, values};
    return RL_OK;
}

static bool same(const char *a, const char *b)
{
    return a == b || (a && b && !strcmp(a, b));
}

static rl_code compare_leaf(walker *w, const rl_value *const *at, const char *path)
{
    const char **values = rl_arena_array(w->arena, w->n, sizeof *values);
    bool equal = true;
    if (!values)
        return rl_fail_memory(w->err, w->n * sizeof *values);
    for (size_t i = 0; i < w->n; i++) {
        rl_code code = print_one(w, at[i], &values[i]);
        if (code)
            return code;
        equal = equal && same(values[0], values[i]);
    }
    return equal ? RL_OK : add_found(w, path, values);
}

static bool all_maps(const walker *w, const rl_value *const *at)
{
    bool any = false;
    for (size_t i = 0; i < w->n; i++) {
        if (at[i] && (at[i]->kind != RL_MAP || !at[i]->n))
            return false;
        any |= at[i] != NULL;
    }
    return any;
}

static bool all_equal(const walker *w, const rl_value *const *at)
{
    for (size_t i = 1; i < w->n; i++)
        if (at[i] != at[0])
            return false;
    return true; /* the same node of one tree: nothing below was set */
}

/* Whether an earlier tree has the key too: then it was compared with that one's keys. */
static bool seen_before(const rl_value *const *at, size_t tree, const char *key)
{
    for (size_t i = 0; i < tree; i++)
        if (rl_value_get(at[i], key))
            return true;
    return false;
}

static rl_code compare(walker *w, const rl_value *const *at, const char *path)
{
    if (all_equal(w, at))
        return RL_OK;
    if (!all_maps(w, at))
        return compare_leaf(w, at, path);
    const rl_value **below = rl_arena_array(w->arena, w->n, sizeof *below);
    if (!below)
        return rl_fail_memory(w->err, w->n * sizeof *below);
    for (size_t tree = 0; tree < w->n; tree++) {
        for (size_t k = 0; at[tree] && k < at[tree]->n; k++) {
            const char *key = at[tree]->entries[k].key;
            if (seen_before(at, tree, key))
                continue;
            for (size_t i = 0; i < w->n; i++)
                below[i] = rl_value_get(at[i], key);
            const char *deeper = *path ? rl_arena_printf(w->arena, "%s.%s", path, key) : key;
            rl_code code = deeper ? compare(w, below, deeper) : rl_fail_memory(w->err, strlen(key));
            if (code)
                return code;
        }
    }
    return RL_OK;
}

rl_code rl_ab_parameters(rl_arena *arena, const rl_value *const *roots, size_t n, rl_ab_plan *plan,
                         rl_error *err)
{
    walker w = {.arena = arena, .n = n, .err = err};
    rl_code code = compare(&w, roots, "");
    plan->parameters = w.found;
    plan->n_parameters = w.n_found;
    return code;
}
