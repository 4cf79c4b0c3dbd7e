/* What is compared with what: pairs of the plan and of replicates, by their reference. */
#include "graph/base/alloc.h"
#include "graph/tool/ab_measure_parts.h"

static bool is_replicate(const rl_ab_plan *plan, int variant)
{
    return variant == 0 || (size_t)variant >= plan->n_listed;
}

/* The tests of a reference: the plan's pairs, then the replicates behind it. Writes to tests unless NULL. */
static size_t list_tests(const rl_ab_plan *plan, int reference, rl_ab_test *tests)
{
    size_t n = 0;
    for (size_t i = 0; i < plan->n_pairs; i++) {
        if (plan->pairs[i].reference != reference)
            continue;
        if (tests)
            tests[n] = (rl_ab_test){plan->pairs[i].test, (int)i};
        n++;
    }
    if (reference < 0 || !is_replicate(plan, reference))
        return n;
    for (size_t v = plan->n_listed; v < plan->n_variants; v++) {
        if ((int)v <= reference)
            continue;
        if (tests)
            tests[n] = (rl_ab_test){(int)v, -1};
        n++;
    }
    return n;
}

static rl_code make_groups(rl_ab_measure *m, rl_error *err)
{
    const rl_ab_plan *plan = m->plan;
    m->groups = rl_arena_array(&m->arena, plan->n_variants + 1, sizeof *m->groups);
    if (!m->groups)
        return rl_fail_memory(err, plan->n_variants * sizeof *m->groups);
    for (int r = RL_AB_AGAINST; r < (int)plan->n_variants; r++) {
        size_t n = list_tests(plan, r, NULL), replicates = 0;
        if (!n)
            continue;
        rl_ab_test *tests = rl_arena_array(&m->arena, n, sizeof *tests);
        if (!tests)
            return rl_fail_memory(err, n * sizeof *tests);
        list_tests(plan, r, tests);
        for (size_t i = 0; i < n; i++)
            replicates += tests[i].pair < 0;
        m->groups[m->n_groups++] = (rl_ab_group){r, tests, n};
        m->most_tests = n > m->most_tests ? n : m->most_tests;
        m->most_replicates = replicates > m->most_replicates ? replicates : m->most_replicates;
    }
    return RL_OK;
}

/* One for each capture, material and metric, when there are replicates. */
static rl_code make_nulls(rl_ab_measure *m, size_t n_captures, rl_error *err)
{
    size_t n = 0, materials;
    m->first_null = rl_arena_array(&m->arena, n_captures + 1, sizeof *m->first_null);
    if (!m->first_null)
        return rl_fail_memory(err, n_captures * sizeof *m->first_null);
    for (size_t c = 0; c < n_captures; c++) {
        m->first_null[c] = n;
        rl_experiment_materials(m->experiment, c, &materials);
        n += materials * RL_METRICS;
        if (materials > m->pixels.room_materials)
            m->pixels.room_materials = materials;
    }
    if (m->plan->n_variants == m->plan->n_listed)
        return RL_OK;
    m->n_nulls = n;
    m->nulls = rl_arena_array(&m->arena, n + 1, sizeof *m->nulls);
    m->nulls_before = rl_arena_array(&m->arena, n + 1, sizeof *m->nulls);
    if (!m->nulls || !m->nulls_before)
        return rl_fail_memory(err, n * sizeof *m->nulls);
    for (size_t c = 0; c < n_captures; c++) {
        rl_experiment_materials(m->experiment, c, &materials);
        for (size_t i = 0; i < materials * RL_METRICS; i++)
            m->nulls[m->first_null[c] + i] =
                (rl_ab_null){.capture = c,
                             .material = i < RL_METRICS ? RL_AB_WHOLE : (int)(i / RL_METRICS),
                             .metric = (rl_metric)(i % RL_METRICS)};
    }
    return RL_OK;
}

rl_code rl_ab_measure_new(const rl_ab_plan *plan, const rl_experiment *experiment, rl_pool *pool,
                          const rl_log *log, rl_ab_measure **out, rl_error *err)
{
    size_t n_captures = rl_session_captures(rl_experiment_session(experiment, 0));
    rl_ab_measure *m = rl_calloc(1, sizeof *m);
    *out = m;
    if (!m)
        return rl_fail_memory(err, sizeof *m);
    m->plan = plan;
    m->experiment = experiment;
    m->pool = pool;
    if (make_groups(m, err) || make_nulls(m, n_captures, err))
        goto done;
    m->measured = rl_arena_array(&m->arena, plan->n_pairs * RL_METRICS + 1, sizeof *m->measured);
    m->sizes = rl_arena_array(&m->arena, n_captures + 1, sizeof *m->sizes);
    m->pixels.begin = rl_arena_array(&m->arena, m->pixels.room_materials + 1, sizeof *m->pixels.begin);
    m->sums = rl_arena_array(&m->arena, m->most_tests * m->pixels.room_materials + 1, sizeof *m->sums);
    if (!m->measured || !m->sizes || !m->pixels.begin || !m->sums)
        rl_fail_memory(err, m->most_tests * m->pixels.room_materials * sizeof *m->sums);
    else if (plan->against)
        rl_ab_against_new(plan, experiment, pool, log, &m->against, err);
done:
    if (err->code)
        rl_ab_measure_free(out);
    return err->code;
}

void rl_ab_measure_empty(rl_ab_measure *m)
{
    rl_free(m->display);
    rl_free(m->rounded);
    rl_free(m->maps);
    rl_free(m->scratch);
    rl_free(m->pixels.order);
    m->display = m->rounded = m->maps = m->scratch = NULL;
    m->pixels.order = NULL;
    m->room = 0;
}

void rl_ab_measure_free(rl_ab_measure **measure)
{
    rl_ab_measure *m = *measure;
    *measure = NULL;
    if (!m)
        return;
    rl_ab_measure_empty(m);
    rl_ab_against_free(&m->against);
    rl_free(m->values);
    rl_arena_free(&m->arena);
    rl_free(m);
}
