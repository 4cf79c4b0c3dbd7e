/* A variant's choices, applied to the tree of its pipeline. */
#include <string.h>

#include "graph/base/text.h"
#include "graph/model/params.h"
#include "graph/model/pipeline_parts.h"
#include "graph/model/vary.h"

typedef struct applier {
    rl_arena *arena;
    const rl_registry *registry;
    const rl_grid *grid;
    const char *pipeline, *name; /* the file; the variant's */
    rl_value **root;
    const rl_log *log;
    rl_change *changes;
    size_t n, room;
    rl_error *err;
} applier;

static rl_code note_change(applier *a, const char *path, const char *value)
{
    if (a->n == a->room) {
        size_t room = a->room ? 2 * a->room : 16;
        rl_change *grown = rl_arena_array(a->arena, room, sizeof *grown);
        if (!grown)
            return rl_fail_memory(a->err, room * sizeof *grown);
        if (a->n)
            memcpy(grown, a->changes, a->n * sizeof *grown);
        a->changes = grown;
        a->room = room;
    }
    a->changes[a->n++] = (rl_change){path, value};
    return RL_OK;
}

/* ---- where paths lead ---------------------------------------------------------------------------------- */

/* A path into a pass, a profile or an output that is not there would create one that lacks all the rest. */
static rl_code check_path(const applier *a, const rl_vary *vary)
{
    static const char *const sections[][2] = {
        {"graph", "pass in its graph called"}, {"profiles", "profile"}, {"outputs", "output"}};
    const char *dot = strchr(vary->path, '.'), *end = dot ? strchr(dot + 1, '.') : NULL;
    for (size_t i = 0; end && i < sizeof sections / sizeof *sections; i++) {
        size_t length = strlen(sections[i][0]);
        if ((size_t)(dot - vary->path) != length || strncmp(vary->path, sections[i][0], length))
            continue;
        const rl_value *section = rl_value_get(*a->root, sections[i][0]);
        const char *key = rl_arena_strndup(a->arena, dot + 1, (size_t)(end - dot - 1));
        size_t n = section && section->kind == RL_MAP ? section->n : 0;
        const char **known = rl_arena_array(a->arena, n + 1, sizeof *known);
        if (!key || !known)
            return rl_fail_memory(a->err, (n + 1) * sizeof *known);
        if (!*key || rl_value_get(section, key)) /* rl_value_set refuses "graph..taps" */
            return RL_OK;
        for (size_t k = 0; k < n; k++)
            known[k] = section->entries[k].key;
        return rl_fail_suggest(
            a->err, (rl_where){vary->option, 1, (int)(dot - vary->path) + 2},
            rl_arena_printf(a->arena, "%s has no %s '%s'", a->pipeline, sections[i][1], key), key, known, n);
    }
    return RL_OK;
}

/* ---- another pass -------------------------------------------------------------------------------------- */

/* "graph.NODE.pass": NODE in the arena, NULL otherwise. */
static rl_code switched_node(const applier *a, const rl_vary *vary, const char **node)
{
    size_t n = strlen(vary->path);
    *node = NULL;
    if (strncmp(vary->path, "graph.", 6) || n < 12 || strcmp(vary->path + n - 5, ".pass") ||
        strchr(vary->path + 6, '.') != vary->path + n - 5)
        return RL_OK;
    *node = rl_arena_strndup(a->arena, vary->path + 6, n - 11);
    return *node ? RL_OK : rl_fail_memory(a->err, n);
}

static bool is_kernel(const char *pass)
{
    return !strcmp(pass, "kernel"); /* the one `pass:` that is not in the registry */
}

/* Whether a pass has that parameter (what the map of a node may hold besides `pass` and `in`); a pass of the
 * user's own says it in the node itself. */
static bool has_parameter(const applier *a, const char *pass, const rl_value *node, const char *key)
{
    if (is_kernel(pass)) {
        for (size_t i = 0; i < rl_user_kernel_n_keys; i++)
            if (!strcmp(rl_user_kernel_keys[i], key))
                return true;
        return rl_value_get(rl_value_get(node, "params"), key) != NULL;
    }
    const rl_pass *p = rl_registry_find(a->registry, pass);
    for (size_t i = 0; p && i < p->params.n; i++)
        if (!strcmp(p->params.rows[i].name, key))
            return true;
    return false;
}

static bool has_input(const applier *a, const char *pass, const rl_value *node, const char *key)
{
    if (is_kernel(pass))
        return rl_value_get(rl_value_get(node, "ports"), key) != NULL;
    const rl_pass *p = rl_registry_find(a->registry, pass);
    for (size_t i = 0; p && i < p->ports.n; i++)
        if (p->ports.rows[i].role == RL_READ && !strcmp(p->ports.rows[i].name, key))
            return true;
    return false;
}

/* What is dropped of a node whose pass is varied: what the passes know together, and this one does not. A key
 * that none of them knows stays, for the error that it deserves. */
typedef struct switched {
    const char *node, *pass, *before; /* before: the pass that the pipeline says, or NULL */
    const rl_vary *vary;
    const rl_value *map, *before_map;
} switched;

typedef bool (*has_function)(const applier *a, const char *pass, const rl_value *node, const char *key);

static bool is_dropped(const applier *a, const switched *s, has_function has, const char *key)
{
    if (has(a, s->pass, s->map, key))
        return false;
    bool known = s->before && has(a, s->before, s->before_map, key);
    for (size_t i = 0; i < s->vary->n && !known; i++)
        known = s->vary->values[i]->kind == RL_TEXT && has(a, s->vary->values[i]->text, s->map, key);
    return known;
}

static rl_code drop_keys(applier *a, const switched *s, const rl_value *map, const char *below,
                         has_function has, rl_str *dropped)
{
    for (size_t i = 0; map && map->kind == RL_MAP && i < map->n; i++) {
        const char *key = map->entries[i].key;
        if (!*below && (!strcmp(key, "pass") || !strcmp(key, "in")))
            continue;
        if (!is_dropped(a, s, has, key))
            continue;
        const char *path = rl_arena_printf(a->arena, "graph.%s.%s%s", s->node, below, key);
        rl_value none = {.kind = RL_NULL, .where = {s->vary->option, 1, 1}};
        rl_code code =
            path ? rl_value_set(a->arena, a->root, path, &none, a->err) : rl_fail_memory(a->err, 64);
        if (!code)
            code = note_change(a, path, "null");
        if (code)
            return code;
        rl_str_printf(dropped, "%s%s%s", dropped->length ? ", " : "", *below ? "input " : "", key);
    }
    return RL_OK;
}

static rl_code drop_foreign(applier *a, const rl_vary *vary, const rl_value *before, size_t choice)
{
    switched s = {.vary = vary};
    rl_str dropped = {0};
    rl_code code = switched_node(a, vary, &s.node);
    if (code || !s.node || vary->values[choice]->kind != RL_TEXT)
        return code;
    const rl_value *nodes = rl_value_get(*a->root, "graph"), *old;
    s.pass = vary->values[choice]->text;
    s.map = rl_value_get(nodes, s.node);
    s.before_map = rl_value_get(rl_value_get(before, "graph"), s.node);
    old = rl_value_get(s.before_map, "pass");
    s.before = old && old->kind == RL_TEXT ? old->text : NULL;
    if (!is_kernel(s.pass) && !rl_registry_find(a->registry, s.pass))
        return RL_OK; /* the pipeline's own checks name the nearest */
    code = drop_keys(a, &s, s.map, "", has_parameter, &dropped);
    if (!code)
        code = drop_keys(a, &s, rl_value_get(s.map, "in"), "in.", has_input, &dropped);
    if (!code && dropped.failed)
        code = rl_fail_memory(a->err, dropped.length);
    if (!code && dropped.length)
        rl_report(a->log, RL_NOTE, RL_NOWHERE, "variant '%s': pass '%s' is %s, which has no %s: left out",
                  a->name, s.node, s.pass, rl_str_text(&dropped));
    rl_str_free(&dropped);
    return code;
}

/* ---- all of it ----------------------------------------------------------------------------------------- */

rl_code rl_grid_apply(rl_arena *arena, const rl_registry *registry, const rl_grid *grid, size_t variant,
                      const char *name, rl_value **root, const rl_log *log, const rl_change **changes,
                      size_t *n_changes, rl_error *err)
{
    applier a = {.arena = arena,
                 .registry = registry,
                 .grid = grid,
                 .pipeline = grid->pipelines[rl_grid_choice(grid, variant, 0)],
                 .name = name,
                 .root = root,
                 .log = log,
                 .err = err};
    const rl_value *before = *root; /* what is set copies what it changes */
    rl_code code = RL_OK;
    for (size_t i = 0; i < grid->n_varies && !code; i++) {
        const rl_vary *v = &grid->varies[i];
        size_t choice = rl_grid_choice(grid, variant, i + 1);
        code = check_path(&a, v);
        if (!code)
            code = rl_pipeline_set(arena, root, v->path, v->values[choice], NULL, err);
        if (!code)
            code = note_change(&a, v->path, v->texts[choice]);
    }
    for (size_t i = 0; i < grid->n_varies && !code; i++)
        code = drop_foreign(&a, &grid->varies[i], before, rl_grid_choice(grid, variant, i + 1));
    *changes = a.changes;
    *n_changes = a.n;
    return code;
}
