/* From the command line to the variants and the pairs of them that are compared. */
#include <string.h>

#include "graph/model/vary.h"
#include "graph/tool/ab_plan_parts.h"

enum { DEFAULT_SEEDS = 3 };

/* What `relit ab` writes beside the folders of the variants. */
static const char *const taken[] = {"report.html", "metrics.json", "junit.xml", "sheet.png"};

typedef struct planner {
    rl_arena *arena;
    const rl_arguments *args;
    const rl_log *log;
    rl_grid grid;
    const char *const *names;
    rl_value **bases;              /* [n_pipelines]: with --set, nothing varied */
    const rl_value **roots;        /* [grid.n] */
    const rl_pipeline **pipelines; /* [grid.n] */
    rl_variant *variants;          /* room for the replicates too */
    size_t seeds;
    rl_ab_plan *plan;
    rl_error *err;
} planner;

/* ---- pipelines ----------------------------------------------------------------------------------------- */

static rl_code set_values(const planner *p, rl_value **root)
{
    const rl_options *run = &p->args->run;
    rl_code code = RL_OK;
    for (size_t i = 0; i < run->n_settings && !code; i++) {
        const rl_setting *set = &run->settings[i];
        const char *name = rl_arena_printf(p->arena, "--set %s=%s", set->path, set->value);
        rl_value *v = NULL;
        if (!name)
            return rl_fail_memory(p->err, strlen(set->path));
        code = rl_yaml_parse(p->arena, set->value, strlen(set->value), name, &v, p->err);
        if (!code)
            code = rl_pipeline_set(p->arena, root, set->path, v, p->log, p->err);
    }
    return code;
}

static rl_code load_pipelines(planner *p)
{
    const rl_grid *g = &p->grid;
    rl_code code = RL_OK;
    p->bases = rl_arena_array(p->arena, g->n_pipelines, sizeof(rl_value *));
    if (!p->bases)
        return rl_fail_memory(p->err, g->n_pipelines * sizeof(rl_value *));
    for (size_t i = 0; i < g->n_pipelines && !code; i++) {
        code = rl_config_load(p->arena, g->pipelines[i], &p->bases[i], p->err);
        if (!code)
            code = set_values(p, &p->bases[i]);
    }
    return code;
}

/* ---- variants ------------------------------------------------------------------------------------------ */

static rl_code make_grid(planner *p)
{
    const rl_arguments *a = p->args;
    rl_vary *varies = rl_arena_array(p->arena, a->n_vary, sizeof *varies);
    rl_code code = RL_OK;
    if (!varies)
        return rl_fail_memory(p->err, a->n_vary * sizeof *varies);
    for (size_t i = 0; i < a->n_vary && !code; i++)
        code = rl_vary_parse(p->arena, a->vary[i], &varies[i], p->err);
    p->grid = (rl_grid){
        .pipelines = a->operands, .n_pipelines = a->n_operands, .varies = varies, .n_varies = a->n_vary};
    return code ? code : rl_grid_count(&p->grid, p->err);
}

/* The pipeline is parsed here for its errors' sake: their place is then the --vary that is at fault. */
static rl_code make_variant(planner *p, size_t i)
{
    const rl_grid *g = &p->grid;
    size_t which = rl_grid_choice(g, i, 0), n = 0;
    rl_value *root = p->bases[which];
    const rl_change *changes = NULL;
    rl_code code =
        rl_grid_apply(p->arena, rl_registry_all(), g, i, p->names[i], &root, p->log, &changes, &n, p->err);
    if (!code)
        code = rl_pipeline_parse(p->arena, g->pipelines[which], root, NULL, &p->pipelines[i], p->err);
    rl_setting *settings = code ? NULL : rl_arena_array(p->arena, n, sizeof *settings);
    if (!settings)
        return code ? code : rl_fail_memory(p->err, n * sizeof *settings);
    for (size_t k = 0; k < n; k++)
        settings[k] = (rl_setting){changes[k].path, changes[k].value};
    p->roots[i] = root;
    p->variants[i] = (rl_variant){.name = p->names[i],
                                  .pipeline = g->pipelines[which],
                                  .settings = settings,
                                  .n_settings = n,
                                  .files = true};
    return RL_OK;
}

static rl_code make_variants(planner *p)
{
    size_t n = p->grid.n;
    rl_code code = rl_grid_names(p->arena, &p->grid, taken, sizeof taken / sizeof *taken, &p->names, p->err);
    if (code)
        return code;
    p->roots = rl_arena_array(p->arena, n, sizeof *p->roots);
    p->pipelines = rl_arena_array(p->arena, n, sizeof *p->pipelines);
    p->variants = rl_arena_array(p->arena, n + p->seeds, sizeof *p->variants);
    if (!p->roots || !p->pipelines || !p->variants)
        return rl_fail_memory(p->err, (n + p->seeds) * sizeof *p->variants);
    for (size_t i = 0; i < n && !code; i++)
        code = make_variant(p, i);
    p->plan->variants = p->variants;
    p->plan->n_variants = p->plan->n_listed = n;
    return code;
}

/* The first variant again, with other seeds, for the differences that are chance. No files. */
static rl_code add_replicates(planner *p)
{
    const rl_options *run = &p->args->run;
    rl_ab_plan *plan = p->plan;
    const rl_variant *first = &p->variants[0];
    const rl_setting **seeds = rl_arena_array(p->arena, p->seeds, sizeof *seeds);
    size_t n = 0;
    if (!seeds)
        return rl_fail_memory(p->err, p->seeds * sizeof *seeds);
    rl_code code = rl_ab_seeds(p->arena, p->pipelines[0], run->captures, run->n_captures, p->seeds - 1, seeds,
                               &n, p->err);
    plan->stochastic = n > 0;
    plan->seeds = n ? (int)p->seeds : 1;
    for (size_t i = 0; i + 1 < p->seeds && n && !code; i++) {
        rl_setting *settings = rl_arena_array(p->arena, first->n_settings + n, sizeof *settings);
        char *name = rl_arena_printf(p->arena, "%s.seed%zu", first->name, i + 2);
        if (!settings || !name)
            return rl_fail_memory(p->err, (first->n_settings + n) * sizeof *settings);
        memcpy(settings, first->settings, first->n_settings * sizeof *settings);
        memcpy(settings + first->n_settings, seeds[i], n * sizeof *settings);
        p->variants[plan->n_variants++] = (rl_variant){.name = name,
                                                       .pipeline = first->pipeline,
                                                       .settings = settings,
                                                       .n_settings = first->n_settings + n};
    }
    return code;
}

/* ---- pairs --------------------------------------------------------------------------------------------- */

static size_t find_pairs(const planner *p, rl_ab_pair *out)
{
    const rl_grid *g = &p->grid;
    size_t n = 0, before;
    for (size_t i = 0; i < g->n; i++) {
        if (p->args->against)
            out[n++] = (rl_ab_pair){RL_AB_AGAINST, (int)i};
        else if (!p->args->pairs && i)
            out[n++] = (rl_ab_pair){0, (int)i};
        for (size_t axis = 0; p->args->pairs && axis < rl_grid_axes(g); axis++)
            if (rl_grid_before(g, i, axis, &before))
                out[n++] = (rl_ab_pair){(int)before, (int)i};
    }
    return n;
}

static rl_code make_pairs(planner *p)
{
    const rl_grid *g = &p->grid;
    rl_ab_pair *pairs = rl_arena_array(p->arena, g->n * rl_grid_axes(g), sizeof *pairs);
    if (!pairs)
        return rl_fail_memory(p->err, g->n * rl_grid_axes(g) * sizeof *pairs);
    p->plan->pairs = pairs;
    p->plan->n_pairs = find_pairs(p, pairs);
    p->plan->against = p->args->against;
    return RL_OK;
}

static rl_code check_arguments(const planner *p)
{
    static const char place[] = "relit ab";
    if (p->args->pairs && p->args->against)
        return rl_fail_file(p->err, RL_E_USAGE, place,
                            "--pairs compares variants with each other, --against with a reference: choose "
                            "one");
    return RL_OK;
}

rl_code rl_ab_plan_make(rl_arena *arena, const rl_arguments *args, const rl_log *log, rl_ab_plan *out,
                        rl_error *err)
{
    *out = (rl_ab_plan){0};
    planner p = {.arena = arena,
                 .args = args,
                 .log = log,
                 .seeds = (size_t)(args->seeds ? args->seeds : DEFAULT_SEEDS),
                 .plan = out,
                 .err = err};
    rl_code code = check_arguments(&p);
    if (!code)
        code = make_grid(&p);
    if (!code)
        code = load_pipelines(&p);
    if (!code)
        code = make_variants(&p);
    if (!code)
        code = make_pairs(&p);
    if (!code)
        code = rl_ab_parameters(arena, p.roots, out->n_listed, out, err);
    return code ? code : add_replicates(&p);
}
