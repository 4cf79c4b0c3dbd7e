/* Measuring: every value against a recomputation from the images alone, maps, what is left out, and what is
 * refused. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "tests/fake_experiment.h"

static rl_experiment *e;
static fake_plan p;
static rl_pool *pool;

static int set_up(void **state)
{
    (void)state;
    e = fake_experiment_new(1);
    return rl_pool_new(3, &pool, &(rl_error){0});
}

static int tear_down(void **state)
{
    (void)state;
    fake_experiment_free(e);
    rl_pool_free(&pool);
    return 0;
}

static rl_ab_measure *measure_new(void)
{
    rl_ab_measure *m = NULL;
    rl_error err = {0};
    rl_ab_measure_new(&p.plan, e, pool, NULL, &m, &err);
    assert_string_equal(err.text, "");
    return m;
}

static void measure_frame(rl_ab_measure *m)
{
    rl_error err = {0};
    rl_ab_measure_frame(m, &e->frame, &err);
    assert_string_equal(err.text, "");
}

static rl_ab_results results_of(rl_ab_measure *m)
{
    rl_ab_results r;
    rl_error err = {0};
    assert_int_equal(rl_ab_measure_results(m, &r, &err), RL_OK);
    return r;
}

static const rl_ab_value *value_of(const rl_ab_results *r, size_t pair, long long frame, int material,
                                   rl_metric metric)
{
    for (size_t i = 0; i < r->n_values; i++) {
        const rl_ab_value *v = &r->values[i];
        if (v->pair == pair && v->frame == frame && v->material == material && v->metric == metric)
            return v;
    }
    return NULL;
}

/* ---- recomputed ---------------------------------------------------------------------------------------- */

static bool counts(int material, int i)
{
    uint32_t id = e->stencil[i / FAKE_WIDTH * FAKE_STRIDE + i % FAKE_WIDTH];
    return material == RL_AB_WHOLE ? id != 0 : id == (uint32_t)material;
}

static double value_at(int variant, rl_compared which, int c, int i)
{
    double v = (double)e->pixels[variant][which][c][i / FAKE_WIDTH * FAKE_STRIDE + i % FAKE_WIDTH];
    return which == RL_COMPARED_DISPLAY ? fmin(fmax(v, 0), 1) : v;
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double rank(const double *sorted, size_t n, double share)
{
    double at = share * (double)(n - 1);
    size_t k = (size_t)at;
    return k + 1 < n ? sorted[k] + (at - (double)k) * (sorted[k + 1] - sorted[k]) : sorted[k];
}

/* Of one material: the plain sums for psnr, rmse and max, else the statistics of the published map. */
static size_t recompute(rl_metric metric, int reference, int test, int material, const float *map,
                        double out[RL_STATS])
{
    static double values[FAKE_PIXELS];
    double sum = 0;
    size_t n = 0;
    for (int i = 0; i < FAKE_PIXELS; i++) {
        double squares = 0, most = 0, v;
        if (!counts(material, i) || isnan(map[i]))
            continue;
        rl_compared which = metric == RL_METRIC_PSNR ? RL_COMPARED_DISPLAY : RL_COMPARED_LINEAR;
        for (int c = 0; c < 3; c++) {
            double d = value_at(test, which, c, i) - value_at(reference, which, c, i);
            squares += d * d / 3;
            most = fmax(most, fabs(d));
        }
        v = metric == RL_METRIC_PSNR   ? squares
            : metric == RL_METRIC_RMSE ? sqrt(squares)
            : metric == RL_METRIC_MAX  ? most
                                       : (double)map[i];
        sum += metric == RL_METRIC_RMSE ? v * v : v;
        values[n++] = v;
    }
    for (int i = 0; i < RL_STATS; i++)
        out[i] = NAN;
    if (!n)
        return 0;
    qsort(values, n, sizeof *values, ascending);
    sum /= (double)n;
    out[RL_STAT_MEAN] = metric == RL_METRIC_RMSE   ? sqrt(sum)
                        : metric == RL_METRIC_PSNR ? -10 * log10(sum)
                                                   : sum;
    if (metric != RL_METRIC_PSNR) {
        out[RL_STAT_MEDIAN] = rank(values, n, 0.5);
        out[RL_STAT_P95] = rank(values, n, 0.95);
        out[RL_STAT_MAX] = values[n - 1];
    }
    return n;
}

static void draw(size_t index)
{
    fake_frame_draw(e, 0, index);
    fake_frame_change(e, 1, FAKE_SKIN, 0.05f);
    fake_frame_noise(e, 2, (uint32_t)index + 1, 0.1f);
    fake_frame_change(e, 2, FAKE_DOT, 0.6f);
}

static void check_frame(rl_ab_measure *m)
{
    rl_ab_results r = results_of(m);
    for (size_t pair = 0; pair < 2; pair++)
        for (int metric = 0; metric < RL_METRICS; metric++) {
            const float *map = rl_ab_measure_map(m, pair, (rl_metric)metric);
            assert_non_null(map);
            for (int material = RL_AB_WHOLE; material < FAKE_MATERIALS; material++) {
                double want[RL_STATS];
                const rl_ab_value *v = value_of(&r, pair, e->frame.frame, material, (rl_metric)metric);
                if (material == 0 || material == FAKE_ABSENT) {
                    assert_null(v);
                    continue;
                }
                assert_non_null(v);
                size_t n = recompute((rl_metric)metric, 0, (int)pair + 1, material, map, want);
                assert_int_equal(v->pixels, n);
                assert_int_equal(v->index, e->frame.index);
                for (int s = 0; s < RL_STATS; s++) {
                    if (isnan(want[s]) || isinf(want[s]))
                        assert_true(isnan(want[s]) ? isnan(v->stats[s]) : isinf(v->stats[s]));
                    else
                        assert_true(fabs(v->stats[s] - want[s]) <= 2e-6 * fmax(1, fabs(want[s])));
                }
            }
        }
}

static void test_values(void **state)
{
    (void)state;
    fake_plan_make(&p, 3, 3);
    rl_ab_measure *m = measure_new();
    for (size_t i = 0; i < FAKE_FRAMES; i++) {
        draw(i);
        measure_frame(m);
        check_frame(m);
    }
    rl_ab_results r = results_of(m);
    /* 3 frames, 2 pairs, 3 materials and the whole, 6 metrics. */
    assert_int_equal(r.n_values, 3 * 2 * 4 * RL_METRICS);
    assert_int_equal(r.n_nulls, 0);
    assert_int_equal(r.sizes[0].width, FAKE_WIDTH);
    assert_int_equal(r.sizes[0].height, FAKE_HEIGHT);
    assert_int_equal(rl_ab_beyond_chance(&r, &r.values[0]), -1);
    const rl_ab_value *flat = value_of(&r, 0, 5, FAKE_PLASTER, RL_METRIC_MAX);
    assert_true(flat->stats[RL_STAT_MAX] <= 0 && flat->stats[RL_STAT_MAX] >= 0);
    assert_true(isinf(value_of(&r, 0, 5, FAKE_PLASTER, RL_METRIC_PSNR)->stats[RL_STAT_MEAN]));
    rl_ab_measure_free(&m);
}

/* The maps are those of the images alone, through the public functions. */
static void test_maps(void **state)
{
    (void)state;
    static float display[2][3][FAKE_PIXELS], map[FAKE_PIXELS];
    fake_plan_make(&p, 3, 3);
    rl_ab_measure *m = measure_new();
    draw(1);
    measure_frame(m);
    for (int test = 1; test < 3; test++)
        for (int metric = 0; metric < RL_METRICS; metric++) {
            bool encoded = metric == RL_METRIC_FLIP || metric == RL_METRIC_PSNR || metric == RL_METRIC_SSIM;
            rl_metric_image image[2];
            for (int k = 0; k < 2; k++) {
                for (int c = 0; c < 3; c++)
                    for (int i = 0; i < FAKE_PIXELS; i++)
                        display[k][c][i] = (float)value_at(
                            k ? test : 0, encoded ? RL_COMPARED_DISPLAY : RL_COMPARED_LINEAR, c, i);
                image[k] = (rl_metric_image){.width = FAKE_WIDTH,
                                             .height = FAKE_HEIGHT,
                                             .channels = 3,
                                             .plane = {display[k][0], display[k][1], display[k][2]},
                                             .stride = FAKE_WIDTH,
                                             .encoded = encoded};
            }
            rl_error err = {0};
            rl_metric_map((rl_metric)metric, &image[0], &image[1], NULL, map, &err);
            assert_string_equal(err.text, "");
            assert_memory_equal(map, rl_ab_measure_map(m, (size_t)test - 1, (rl_metric)metric), sizeof map);
        }
    assert_null(rl_ab_measure_map(m, 2, RL_METRIC_FLIP));
    rl_ab_measure_free(&m);
}

static void test_order(void **state)
{
    (void)state;
    /* Pairs of two references, in an order that is not that of the references. */
    fake_plan_make(&p, 3, 3);
    p.pairs[0] = (rl_ab_pair){1, 2};
    p.pairs[1] = (rl_ab_pair){0, 1};
    rl_ab_measure *m = measure_new();
    size_t frames[] = {0, 2, 1}; /* the last two in the wrong order */
    for (int i = 0; i < 3; i++) {
        draw(frames[i]);
        measure_frame(m);
    }
    rl_ab_results r = results_of(m);
    assert_int_equal(r.n_values, 3 * 2 * 4 * RL_METRICS);
    for (size_t i = 0; i < r.n_values; i++) {
        const rl_ab_value *v = &r.values[i];
        assert_int_equal(v->metric, i % 6);
        assert_int_equal(v->material, ((int[]){RL_AB_WHOLE, 1, 2, 3})[i / 6 % 4]);
        assert_int_equal(v->pair, i / 24 % 2);
        assert_int_equal(v->index, i / 48);
    }
    draw(2);
    const rl_ab_value *v = value_of(&r, 0, 5, FAKE_SKIN, RL_METRIC_MAX);
    static float zeros[FAKE_PIXELS];
    double want[RL_STATS];
    recompute(RL_METRIC_MAX, 1, 2, FAKE_SKIN, zeros, want);
    assert_true(fabs(v->stats[RL_STAT_MAX] - want[RL_STAT_MAX]) < 1e-6);
    rl_ab_measure_free(&m);
}

/* ---- what is refused ----------------------------------------------------------------------------------- */

static void test_nan(void **state)
{
    (void)state;
    fake_plan_make(&p, 3, 3);
    rl_ab_measure *m = measure_new();
    draw(0);
    measure_frame(m);
    size_t before = results_of(m).n_values;
    static const struct {
        float value;
        rl_compared which;
        const char *says;
    } cases[] = {{NAN, RL_COMPARED_LINEAR, "holds NaN in green"},
                 {INFINITY, RL_COMPARED_DISPLAY, "holds infinity in green"},
                 {-INFINITY, RL_COMPARED_LINEAR, "holds -infinity in green"}};
    for (size_t i = 0; i < 3; i++) {
        rl_error err = {0};
        draw(1);
        /* An empty pixel counts too, and the first one is named: row 2 before row 30. */
        e->pixels[1][cases[i].which][1][30 * FAKE_STRIDE + 4] = cases[i].value;
        e->pixels[1][cases[i].which][1][2 * FAKE_STRIDE + 7] = cases[i].value;
        assert_int_equal(rl_ab_measure_frame(m, &e->frame, &err), RL_E_DATA);
        assert_non_null(strstr(err.text, cases[i].says));
        assert_non_null(strstr(err.text, "variant 'pre_post'"));
        assert_non_null(strstr(err.text, "capture 'monkey', frame 2"));
        assert_non_null(strstr(err.text, "pixel (10, 0)")); /* of the display window */
        assert_int_equal(results_of(m).n_values, before);
        assert_null(rl_ab_measure_map(m, 0, RL_METRIC_FLIP));
    }
    draw(2);
    measure_frame(m);
    assert_int_equal(results_of(m).n_values, 2 * before);
    rl_ab_measure_free(&m);
}

static void test_small(void **state)
{
    (void)state;
    fake_plan_make(&p, 2, 2);
    rl_ab_measure *m = measure_new();
    draw(0);
    e->frame.height = 10; /* no window of ssim fits */
    for (int v = 0; v < 2; v++)
        for (int k = 0; k < RL_COMPARED; k++)
            e->images[v][k].height = 10;
    measure_frame(m);
    rl_ab_results r = results_of(m);
    assert_null(value_of(&r, 0, 1, RL_AB_WHOLE, RL_METRIC_SSIM));
    assert_null(rl_ab_measure_map(m, 0, RL_METRIC_SSIM));
    assert_non_null(value_of(&r, 0, 1, RL_AB_WHOLE, RL_METRIC_FLIP));
    /* A larger frame afterwards, and one that shows nothing. */
    draw(1);
    measure_frame(m);
    draw(2);
    memset(e->stencil, 0, sizeof e->stencil);
    measure_frame(m);
    r = results_of(m);
    const rl_ab_value *v = value_of(&r, 0, 5, RL_AB_WHOLE, RL_METRIC_FLIP);
    assert_int_equal(v->pixels, 0);
    assert_true(isnan(v->stats[RL_STAT_MEAN]));
    e->stencil[5] = FAKE_MATERIALS;
    rl_error err = {0};
    assert_int_equal(rl_ab_measure_frame(m, &e->frame, &err), RL_E_INTERNAL);
    rl_ab_measure_free(&m);
}

static void test_memory(void **state)
{
    (void)state;
    fake_plan_make(&p, 4, 2);
    draw(0);
    size_t before = rl_alloc_live();
    unsigned long n = 1;
    for (int done = 0; !done; n++) {
        rl_ab_measure *m = NULL;
        rl_error err = {0};
        rl_alloc_fail_at(n, 0);
        rl_code code = rl_ab_measure_new(&p.plan, e, pool, NULL, &m, &err);
        if (!code)
            code = rl_ab_measure_frame(m, &e->frame, &err);
        done = rl_alloc_fail_at(0, 0) > 0;
        assert_int_equal(code, done ? RL_OK : RL_E_MEMORY);
        rl_ab_measure_free(&m);
        assert_int_equal(rl_alloc_live(), before);
    }
    assert_true(n > 20);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_values, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_maps, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_order, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_nan, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_small, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_memory, set_up, tear_down),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
