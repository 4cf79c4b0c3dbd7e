/* Other seeds for the passes in which chance has a part. */
#include <stdint.h>
#include <string.h>

#include "graph/base/file.h"
#include "graph/tool/ab_plan_parts.h"

/* ---- lights whose shadows are marched ------------------------------------------------------------------ */

static bool any_marches(const rl_value *lights)
{
    for (size_t i = 0; lights && lights->kind == RL_MAP && i < lights->n; i++) {
        const rl_value *shadow = rl_value_get(lights->entries[i].value, "shadow");
        if (shadow && shadow->kind == RL_TEXT && !strcmp(shadow->text, "screen"))
            return true;
    }
    return false;
}

/* A capture's own lights, when it has a manifest; what is wrong with it is said when it is opened. */
static bool manifest_marches(rl_arena *arena, const char *path)
{
    rl_value *root = NULL;
    rl_error unsaid = {0};
    if (path && rl_path_is_folder(path))
        path = rl_path_join(arena, path, "capture.yaml");
    const char *end = path ? rl_path_extension(path) : "";
    if (strcmp(end, ".yaml") && strcmp(end, ".yml"))
        return false;
    return !rl_yaml_load(arena, path, &root, &unsaid) && any_marches(rl_value_get(root, "lights"));
}

static bool some_light_marches(rl_arena *arena, const rl_pipeline *p, const char *const *captures, size_t n)
{
    if (any_marches(p->lights))
        return true;
    if (p->lights && !p->lights->implied)
        return false; /* implied ones change the capture's: a march that they switch off costs seeds only */
    for (size_t i = 0; i < n; i++)
        if (manifest_marches(arena, captures[i]))
            return true;
    if (n || !p->capture)
        return false;
    return p->capture->kind == RL_MAP ? any_marches(rl_value_get(p->capture, "lights"))
                                      : manifest_marches(arena, rl_value_path(arena, p->capture));
}

/* ---- seeds --------------------------------------------------------------------------------------------- */

static const rl_param *seed_of(const rl_node *node, bool march)
{
    const rl_pass *pass = node->pass;
    for (size_t i = 0; i < pass->params.n; i++) {
        const rl_param *row = &pass->params.rows[i];
        if (!strcmp(row->name, "seed") && (row->type == RL_I32 || row->type == RL_F32))
            return !pass->stochastic || pass->stochastic(node->params, march) ? row : NULL;
    }
    return NULL;
}

/* The k-th other value: far apart, so that a pass that counts up from its seed does not meet the next one. */
static rl_code other_seed(rl_arena *arena, const rl_node *node, const rl_param *row, size_t k, size_t n,
                          const char **out, rl_error *err)
{
    enum { APART = 104729 };
    const char *at = (const char *)node->params + row->offset;
    /* what holds every integer */
    double bound = row->type == RL_I32 ? 2147483647.0 : 16777216.0;
    double least = row->min > -bound ? row->min : -bound, most = row->max < bound ? row->max : bound;
    int32_t integer = 0;
    float number = 0;
    memcpy(&integer, at, sizeof integer);
    memcpy(&number, at, sizeof number);
    double was = row->type == RL_I32 ? (double)integer : (double)number;
    uint64_t room = (uint64_t)(most - least) + 1;
    if (room < n + 1)
        return rl_fail(err, RL_E_USAGE, node->where,
                       "pass '%s' takes %llu values of 'seed' only: too few for %zu runs; give --seeds",
                       node->name, (unsigned long long)room, n + 1);
    /* A step that is prime to the number of values never comes back early; small ranges are walked one by
     * one. */
    uint64_t step = room > (uint64_t)APART * (n + 1) ? APART : 1;
    uint64_t index = ((uint64_t)(was > least ? was - least : 0) + step * (k + 1)) % room;
    *out = rl_arena_printf(arena, "%lld", (long long)least + (long long)index);
    return *out ? RL_OK : rl_fail_memory(err, 16);
}

rl_code rl_ab_seeds(rl_arena *arena, const rl_pipeline *pipeline, const char *const *captures,
                    size_t n_captures, size_t n, const rl_setting **out, size_t *n_settings, rl_error *err)
{
    bool march = some_light_marches(arena, pipeline, captures, n_captures);
    rl_code code = RL_OK;
    for (size_t k = 0; k < n || !k; k++) {
        rl_setting *settings = rl_arena_array(arena, pipeline->n_nodes, sizeof *settings);
        if (!settings)
            return rl_fail_memory(err, pipeline->n_nodes * sizeof *settings);
        *n_settings = 0;
        for (size_t i = 0; i < pipeline->n_nodes && !code; i++) {
            const rl_node *node = &pipeline->nodes[i];
            const rl_param *row = seed_of(node, march);
            rl_setting *s = &settings[*n_settings];
            if (!row)
                continue;
            s->path = rl_arena_printf(arena, "graph.%s.seed", node->name);
            code = s->path ? other_seed(arena, node, row, k, n, &s->value, err) : rl_fail_memory(err, 64);
            ++*n_settings;
        }
        out[k] = settings;
        if (code)
            return code;
    }
    return code;
}
