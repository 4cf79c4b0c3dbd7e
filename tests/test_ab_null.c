/* What chance makes: bounds of the null distribution from replicates, recomputed; marks; and how often a mark
 * comes without a cause. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "tests/fake_experiment.h"

static rl_experiment *e;
static fake_plan p;

static int set_up(void **state)
{
    (void)state;
    e = fake_experiment_new(1);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    fake_experiment_free(e);
    return 0;
}

static rl_ab_measure *measure_new(void)
{
    rl_ab_measure *m = NULL;
    rl_error err = {0};
    rl_ab_measure_new(&p.plan, e, NULL, NULL, &m, &err);
    assert_string_equal(err.text, "");
    return m;
}

static rl_ab_results measure(rl_ab_measure *m)
{
    rl_ab_results r;
    rl_error err = {0};
    rl_ab_measure_frame(m, &e->frame, &err);
    assert_string_equal(err.text, "");
    assert_int_equal(rl_ab_measure_results(m, &r, &err), RL_OK);
    return r;
}

/* Variants 0 and 1 listed, 2 and 3 replicates of 0: each with noise of its own. */
static void draw(size_t index, uint32_t seed)
{
    fake_frame_draw(e, 0, index);
    for (int v = 0; v < 4; v++)
        fake_frame_noise(e, v, seed + (uint32_t)(10 * index) + 1000u * (uint32_t)v, 0.02f);
}

/* RMSE of two variants in the linear image over a material. */
static double rmse(int a, int b, int material)
{
    double sum = 0;
    int n = 0;
    for (int i = 0; i < FAKE_HEIGHT * FAKE_STRIDE; i++) {
        if (i % FAKE_STRIDE >= FAKE_WIDTH || e->stencil[i] == 0 ||
            (material != RL_AB_WHOLE && e->stencil[i] != (uint32_t)material))
            continue;
        for (int c = 0; c < 3; c++) {
            double d = (double)e->pixels[a][RL_COMPARED_LINEAR][c][i] -
                       (double)e->pixels[b][RL_COMPARED_LINEAR][c][i];
            sum += d * d / 3;
        }
        n++;
    }
    return sqrt(sum / n);
}

static void test_bounds(void **state)
{
    (void)state;
    double most[FAKE_MATERIALS] = {0};
    rl_ab_results r = {0};
    fake_plan_make(&p, 4, 2);
    rl_ab_measure *m = measure_new();
    for (size_t i = 0; i < FAKE_FRAMES; i++) {
        draw(i, 1);
        static const int pairs[3][2] = {{0, 2}, {0, 3}, {2, 3}};
        for (int k = 0; k < 3; k++)
            for (int material = 0; material < FAKE_ABSENT; material++)
                most[material] =
                    fmax(most[material], rmse(pairs[k][0], pairs[k][1], material ? material : RL_AB_WHOLE));
        r = measure(m);
    }
    assert_int_equal(r.n_nulls, FAKE_MATERIALS * RL_METRICS);
    for (int material = 0; material < FAKE_MATERIALS; material++)
        for (int metric = 0; metric < RL_METRICS; metric++) {
            int which = material ? material : RL_AB_WHOLE;
            const rl_ab_null *null = rl_ab_null_of(&r, 0, which, (rl_metric)metric);
            assert_non_null(null);
            assert_int_equal(null->n, material == FAKE_ABSENT ? 0 : 3 * FAKE_FRAMES); /* pairs × frames */
            if (null->n && metric == RL_METRIC_RMSE)
                assert_true(fabs(null->bounds[RL_STAT_MEAN] - most[material]) < 1e-6);
            if (null->n && metric == RL_METRIC_PSNR) {
                assert_true(null->bounds[RL_STAT_MEAN] > 20 && null->bounds[RL_STAT_MEAN] < 60);
                assert_true(isnan(null->bounds[RL_STAT_P95]));
            }
            if (null->n && metric == RL_METRIC_SSIM)
                assert_true(null->bounds[RL_STAT_MEAN] < 1 && null->bounds[RL_STAT_MEAN] > 0.3);
        }
    assert_null(rl_ab_null_of(&r, 1, RL_AB_WHOLE, RL_METRIC_FLIP));
    /* Values are those of the plan's pair alone. */
    assert_int_equal(r.n_values, FAKE_FRAMES * 4 * RL_METRICS);
    for (size_t i = 0; i < r.n_values; i++)
        assert_int_equal(r.values[i].pair, 0);
    rl_ab_measure_free(&m);
}

/* The worst of psnr and ssim is the least. */
static void test_rising_metrics(void **state)
{
    (void)state;
    rl_ab_results r;
    fake_plan_make(&p, 4, 2);
    rl_ab_measure *m = measure_new();
    draw(0, 1);
    r = measure(m);
    double before = rl_ab_null_of(&r, 0, FAKE_SKIN, RL_METRIC_SSIM)->bounds[RL_STAT_MEAN];
    draw(1, 5);
    fake_frame_noise(e, 3, 77, 0.2f);
    r = measure(m);
    assert_true(rl_ab_null_of(&r, 0, FAKE_SKIN, RL_METRIC_SSIM)->bounds[RL_STAT_MEAN] < before - 0.01);
    double worse = rl_ab_null_of(&r, 0, FAKE_SKIN, RL_METRIC_PSNR)->bounds[RL_STAT_MEAN];
    draw(2, 9);
    r = measure(m);
    double after = rl_ab_null_of(&r, 0, FAKE_SKIN, RL_METRIC_PSNR)->bounds[RL_STAT_MEAN];
    assert_true(after <= worse && after >= worse);
    rl_ab_measure_free(&m);
}

/* A frame that fails half way leaves no trace in the bounds. */
static void test_failed_frame(void **state)
{
    (void)state;
    fake_plan_make(&p, 4, 2);
    rl_ab_measure *m = measure_new();
    draw(0, 1);
    rl_ab_results r = measure(m);
    rl_ab_null before = *rl_ab_null_of(&r, 0, FAKE_SKIN, RL_METRIC_FLIP);
    size_t n_values = r.n_values;
    int failures = 0;
    draw(1, 50);
    fake_frame_noise(e, 3, 99, 0.3f);
    for (unsigned long n = 1, done = 0; !done; n++) {
        rl_error err = {0};
        rl_alloc_fail_at(n, 0);
        rl_code code = rl_ab_measure_frame(m, &e->frame, &err);
        done = rl_alloc_fail_at(0, 0) > 0;
        assert_int_equal(code, done ? RL_OK : RL_E_MEMORY);
        rl_ab_measure_results(m, &r, &err);
        const rl_ab_null *null = rl_ab_null_of(&r, 0, FAKE_SKIN, RL_METRIC_FLIP);
        if (done)
            assert_true(null->n == 2 * before.n && null->bounds[0] > before.bounds[0]);
        else
            assert_memory_equal(null, &before, sizeof before);
        assert_int_equal(r.n_values, done ? 2 * n_values : n_values);
        failures += !done;
    }
    assert_true(failures > 20);
    rl_ab_measure_free(&m);
}

static int marked(const rl_ab_results *r, int material, rl_metric metric)
{
    for (size_t i = 0; i < r->n_values; i++)
        if (r->values[i].material == material && r->values[i].metric == metric)
            return rl_ab_beyond_chance(r, &r->values[i]);
    return -2;
}

static void test_marks(void **state)
{
    (void)state;
    fake_plan_make(&p, 4, 2);
    rl_ab_measure *m = measure_new();
    draw(0, 3);
    fake_frame_change(e, 1, FAKE_SKIN, 0.1f);
    rl_ab_results r = measure(m);
    for (int metric = 0; metric < RL_METRICS; metric++)
        assert_int_equal(marked(&r, FAKE_SKIN, (rl_metric)metric),
                         metric == RL_METRIC_SSIM ? marked(&r, FAKE_SKIN, RL_METRIC_SSIM) : 1);
    assert_int_equal(marked(&r, RL_AB_WHOLE, RL_METRIC_RMSE), 1);
    rl_ab_measure_free(&m);
    /* The same image is no difference, however small chance's are. */
    m = measure_new();
    draw(0, 3);
    memcpy(e->pixels[1], e->pixels[0], sizeof e->pixels[0]);
    r = measure(m);
    for (int metric = 0; metric < RL_METRICS; metric++)
        assert_int_equal(marked(&r, FAKE_SKIN, (rl_metric)metric), 0);
    rl_ab_measure_free(&m);
}

/* The promise of ab.h: a pair that differs in its random choices alone gets a mark of a material and metric
 * in at most 1 / (R + 1) of runs; here R = 2, 100 runs of two frames. */
static void test_false_positives(void **state)
{
    (void)state;
    enum { RUNS = 100 };
    int marks = 0;
    fake_plan_make(&p, 4, 2);
    for (uint32_t run = 0; run < RUNS; run++) {
        rl_ab_results r = {0};
        rl_ab_measure *m = measure_new();
        for (size_t i = 0; i < 2; i++) {
            draw(i, 7 * run);
            /* A small picture is enough. */
            e->frame.height = 8;
            for (int v = 0; v < 4; v++)
                for (int k = 0; k < RL_COMPARED; k++)
                    e->images[v][k].height = 8;
            for (int y = 0; y < 8; y++)
                for (int x = 0; x < FAKE_WIDTH; x++)
                    e->stencil[y * FAKE_STRIDE + x] = FAKE_PLASTER;
            r = measure(m);
        }
        bool any = false;
        for (size_t i = 0; i < r.n_values; i++)
            any = any || (r.values[i].material == FAKE_PLASTER && r.values[i].metric == RL_METRIC_RMSE &&
                          rl_ab_beyond_chance(&r, &r.values[i]) == 1);
        marks += any;
        rl_ab_measure_free(&m);
    }
    /* 1/3 is the bound; three standard deviations of 100 tosses are 0.14. It does happen. */
    assert_true(marks <= RUNS * 0.475);
    assert_true(marks > 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_bounds, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_rising_metrics, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_failed_frame, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_marks, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_false_positives, set_up, tear_down),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
