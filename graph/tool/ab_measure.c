/* How much variants differ: maps and statistics of every pair and metric, a frame at a time. */
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/tool/ab_measure_parts.h"
#include "graph/tool/metric_filter.h"

enum { SSIM_LEAST = 11 }; /* pixels each way; see metrics.h */

/* Which image a metric looks at. */
static rl_compared compared_of(rl_metric metric)
{
    return metric == RL_METRIC_FLIP || metric == RL_METRIC_PSNR || metric == RL_METRIC_SSIM
               ? RL_COMPARED_DISPLAY
               : RL_COMPARED_LINEAR;
}

static rl_code fit_buffers(rl_ab_measure *m, size_t n, rl_error *err)
{
    const rl_ab_plan *plan = m->plan;
    if (n <= m->room)
        return RL_OK;
    rl_ab_measure_empty(m);
    m->display = rl_calloc(n, 3 * plan->n_variants * sizeof *m->display);
    m->rounded = rl_calloc(plan->against ? n : 0, 3 * m->most_tests * sizeof *m->rounded);
    m->maps = rl_calloc(n, plan->n_pairs * RL_METRICS * sizeof *m->maps);
    m->scratch = rl_calloc(n, m->most_replicates * sizeof *m->scratch);
    m->pixels.order = rl_calloc(n, sizeof *m->pixels.order);
    if (!m->display || !m->rounded || !m->maps || !m->scratch || !m->pixels.order) {
        rl_ab_measure_empty(m);
        return rl_fail_memory(
            err,
            n * sizeof(float) * (3 * plan->n_variants + plan->n_pairs * RL_METRICS + m->most_replicates + 1));
    }
    m->room = n;
    return RL_OK;
}

/* ---- a group ------------------------------------------------------------------------------------------- */

/* One metric of one group. */
typedef struct job {
    rl_ab_measure *m;
    const rl_ab_group *group;
    rl_metric metric;
    float *const *maps; /* [n_tests] */
    double peak;
    atomic_bool failed;
} job;

static void stats_task(void *ctx, int i)
{
    job *j = ctx;
    rl_error err = {0};
    size_t test = (size_t)i / 2;
    if (rl_ab_pixels_stats(&j->m->pixels, j->metric, j->maps[test], j->peak, i % 2,
                           j->m->sums + test * j->m->pixels.room_materials, &err))
        atomic_store(&j->failed, true);
}

static rl_code add_value(rl_ab_measure *m, const rl_ab_value *value, rl_error *err)
{
    if (m->n_values == m->room_values) {
        size_t room = m->room_values ? 2 * m->room_values : 256;
        rl_ab_value *values = rl_realloc(m->values, room * sizeof *values);
        if (!values)
            return rl_fail_memory(err, room * sizeof *values);
        m->values = values;
        m->room_values = room;
    }
    m->values[m->n_values++] = *value;
    return RL_OK;
}

static rl_code keep_sums(rl_ab_measure *m, const rl_experiment_frame *frame, const rl_ab_test *test,
                         rl_metric metric, const rl_ab_sums *sums, rl_error *err)
{
    size_t n = m->pixels.n_materials;
    m->measured[(size_t)test->pair * RL_METRICS + metric] = true;
    for (size_t i = 0; i < n; i++) {
        size_t present = i ? m->pixels.begin[i + 1] - m->pixels.begin[i] : m->pixels.n_pixels;
        rl_ab_value value = {.pair = (size_t)test->pair,
                             .capture = frame->capture,
                             .index = frame->index,
                             .frame = frame->frame,
                             .material = i ? (int)i : RL_AB_WHOLE,
                             .metric = metric,
                             .pixels = sums[i].pixels};
        memcpy(value.stats, sums[i].stats, sizeof value.stats);
        if ((present || !i) && add_value(m, &value, err))
            return err->code;
    }
    return RL_OK;
}

static void add_null(rl_ab_measure *m, size_t capture, rl_metric metric, const rl_ab_sums *sums)
{
    rl_ab_null *nulls = m->nulls + m->first_null[capture] + metric;
    for (size_t i = 0; i < m->pixels.n_materials; i++)
        rl_ab_null_add(&nulls[i * RL_METRICS], &sums[i]);
}

static rl_metric_image view_of_test(const rl_ab_measure *m, const rl_experiment_frame *frame,
                                    const rl_ab_group *group, size_t i, rl_compared which)
{
    size_t n = (size_t)frame->width * (size_t)frame->height;
    const float *planes = m->rounded + i * 3 * n;
    const rl_compared_image rounded = {
        frame->width, frame->height, {planes, planes + n, planes + 2 * n}, (size_t)frame->width};
    return group->reference == RL_AB_AGAINST && which == RL_COMPARED_DISPLAY
               ? rl_ab_view(&rounded, true)
               : rl_ab_measure_view(m, frame, group->tests[i].variant, which);
}

/* Maps and statistics of one metric. */
static rl_code measure_metric(rl_ab_measure *m, const rl_experiment_frame *frame, const rl_ab_group *group,
                              const rl_metric_image *reference, rl_metric metric, rl_error *err)
{
    rl_arena arena = {0};
    rl_metric_image *views = rl_arena_array(&arena, group->n_tests, sizeof *views);
    float **maps = rl_arena_array(&arena, group->n_tests, sizeof *maps);
    size_t replicates = 0;
    job j = {.m = m, .group = group, .metric = metric, .maps = maps};
    if (!views || !maps) {
        rl_fail_memory(err, group->n_tests * sizeof *views);
        goto done;
    }
    for (size_t i = 0; i < group->n_tests; i++) {
        const rl_ab_test *test = &group->tests[i];
        views[i] = view_of_test(m, frame, group, i, compared_of(metric));
        maps[i] = test->pair < 0 ? m->scratch + replicates++ * m->room
                                 : m->maps + ((size_t)test->pair * RL_METRICS + metric) * m->room;
    }
    if (rl_metric_maps(metric, reference, views, group->n_tests, m->pool, maps, err))
        goto done;
    j.peak = metric == RL_METRIC_PSNR ? rl_metric_peak(reference) : 1;
    rl_filter_bands(m->pool, 2 * (int)group->n_tests, stats_task, &j);
    if (atomic_load(&j.failed)) {
        rl_fail_memory(err, m->pixels.n_pixels * sizeof(float));
        goto done;
    }
    for (size_t i = 0; i < group->n_tests && !err->code; i++) {
        const rl_ab_sums *sums = m->sums + i * m->pixels.room_materials;
        if (group->tests[i].pair >= 0)
            keep_sums(m, frame, &group->tests[i], metric, sums, err);
        else
            add_null(m, frame->capture, metric, sums);
    }
done:
    rl_arena_free(&arena);
    return err->code;
}

/* All metrics of a group for which there are images. */
static rl_code measure_images(rl_ab_measure *m, const rl_experiment_frame *frame, const rl_ab_group *group,
                              const rl_metric_image reference[RL_COMPARED], rl_error *err)
{
    bool small = frame->width < SSIM_LEAST || frame->height < SSIM_LEAST;
    for (int i = 0; i < RL_METRICS; i++) {
        const rl_metric_image *image = &reference[compared_of((rl_metric)i)];
        if (!image->plane[0] || (i == RL_METRIC_SSIM && small))
            continue;
        if (measure_metric(m, frame, group, image, (rl_metric)i, err))
            return err->code;
    }
    return RL_OK;
}

/* Tests that are compared with the same files go together. The images for the display are rounded as the file
 * is: what a run wrote is then equal to itself. */
static rl_code measure_against(rl_ab_measure *m, const rl_experiment_frame *frame, const rl_ab_group *group,
                               rl_error *err)
{
    size_t pixels = 3 * (size_t)frame->width * (size_t)frame->height;
    for (size_t i = 0, n; i < group->n_tests; i += n) {
        int levels;
        bool same = true;
        int variant = group->tests[i].variant;
        for (n = 1; i + n < group->n_tests && same; n += same)
            if (rl_ab_against_same(m->against, frame, variant, group->tests[i + n].variant, &same, err))
                return err->code;
        if (rl_ab_against_read(m->against, frame, variant, m->files, &levels, err))
            return err->code;
        for (size_t k = 0; k < n && m->files[RL_COMPARED_DISPLAY].plane[0]; k++)
            rl_ab_round(m->display + (size_t)group->tests[i + k].variant * pixels, pixels, levels,
                        m->rounded + k * pixels);
        rl_ab_group part = {RL_AB_AGAINST, group->tests + i, n};
        const rl_metric_image views[RL_COMPARED] = {rl_ab_view(&m->files[RL_COMPARED_LINEAR], false),
                                                    rl_ab_view(&m->files[RL_COMPARED_DISPLAY], true)};
        if (measure_images(m, frame, &part, views, err))
            return err->code;
    }
    return RL_OK;
}

static rl_code measure_group(rl_ab_measure *m, const rl_experiment_frame *frame, const rl_ab_group *group,
                             rl_error *err)
{
    rl_metric_image views[RL_COMPARED];
    if (group->reference == RL_AB_AGAINST)
        return measure_against(m, frame, group, err);
    for (int i = 0; i < RL_COMPARED; i++)
        views[i] = rl_ab_measure_view(m, frame, group->reference, (rl_compared)i);
    return measure_images(m, frame, group, views, err);
}

/* ---- a frame ------------------------------------------------------------------------------------------- */

static int compare_values(const void *a, const void *b)
{
    const rl_ab_value *u = a, *v = b;
    long long keys[5][2] = {{(long long)u->capture, (long long)v->capture},
                            {(long long)u->index, (long long)v->index},
                            {(long long)u->pair, (long long)v->pair},
                            {u->material, v->material},
                            {(long long)u->metric, (long long)v->metric}};
    for (int i = 0; i < 5; i++)
        if (keys[i][0] != keys[i][1])
            return keys[i][0] < keys[i][1] ? -1 : 1;
    return 0;
}

/* Groups leave a frame's values by reference. Frames come in order, as a rule. */
static void sort_values(rl_ab_measure *m, size_t before)
{
    bool in_order = !before || compare_values(&m->values[before - 1], &m->values[before]) < 0;
    size_t first = in_order ? before : 0;
    qsort(m->values + first, m->n_values - first, sizeof *m->values, compare_values);
}

rl_code rl_ab_measure_frame(rl_ab_measure *m, const rl_experiment_frame *frame, rl_error *err)
{
    size_t before = m->n_values;
    memset(m->measured, 0, m->plan->n_pairs * RL_METRICS * sizeof *m->measured);
    if (m->n_nulls)
        memcpy(m->nulls_before, m->nulls, m->n_nulls * sizeof *m->nulls);
    rl_experiment_materials(m->experiment, frame->capture, &m->pixels.n_materials);
    rl_code code = fit_buffers(m, (size_t)frame->width * (size_t)frame->height, err);
    if (!code)
        code = rl_ab_pixels_sort(&m->pixels, frame, err);
    for (size_t v = 0; !code && v < m->plan->n_variants; v++)
        code = rl_ab_measure_check(m, frame, v, err);
    for (size_t i = 0; !code && i < m->n_groups; i++)
        code = measure_group(m, frame, &m->groups[i], err);
    if (code) { /* as if the frame had not been */
        m->n_values = before;
        memset(m->measured, 0, m->plan->n_pairs * RL_METRICS * sizeof *m->measured);
        if (m->n_nulls)
            memcpy(m->nulls, m->nulls_before, m->n_nulls * sizeof *m->nulls);
        return code;
    }
    if (m->n_values > before)
        sort_values(m, before);
    rl_ab_size *size = &m->sizes[frame->capture];
    size->width = frame->width > size->width ? frame->width : size->width;
    size->height = frame->height > size->height ? frame->height : size->height;
    return RL_OK;
}

const float *rl_ab_measure_map(const rl_ab_measure *m, size_t pair, rl_metric metric)
{
    size_t i = pair * RL_METRICS + metric;
    return pair < m->plan->n_pairs && m->measured[i] ? m->maps + i * m->room : NULL;
}

const rl_compared_image *rl_ab_measure_reference(const rl_ab_measure *m)
{
    return m->against ? m->files : NULL;
}

rl_code rl_ab_measure_results(rl_ab_measure *m, rl_ab_results *out, rl_error *err)
{
    (void)err;
    *out = (rl_ab_results){.values = m->values,
                           .n_values = m->n_values,
                           .nulls = m->nulls,
                           .n_nulls = m->n_nulls,
                           .sizes = m->sizes};
    return RL_OK;
}
