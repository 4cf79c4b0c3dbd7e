/* Powers in vectors against the C library, and FLIP of many tests at once: the bits of one at a time. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/tool/metric_math.h"
#include "graph/tool/metrics.h"

static void test_pow(void **state)
{
    (void)state;
    static const double exponents[] = {1.0 / 3, 0.7, 2.4, 0.01, 1, 0.35};
    double worst = 0;
    for (size_t e = 0; e < sizeof exponents / sizeof *exponents; e++)
        for (int i = 1; i < 40000; i++) {
            double x = exp2(-60 + i * 70.0 / 40000), want = pow(x, exponents[e]);
            worst = fmax(worst, fabs(rl_fast_pow(x, exponents[e]) - want) / want);
        }
    assert_true(worst < 1e-14);
    assert_true(worst > 0);          /* something was compared */
    for (int i = 0; i < 1000; i++) { /* powers of two, and where the mantissa wraps */
        double x = 0.7071067811865475 + (i - 500) * 1e-16;
        assert_true(fabs(rl_fast_log2(x) - log2(x)) < 1e-15);
    }
    for (int k = -300; k <= 300; k++) {
        assert_true(rl_fast_log2(ldexp(1, k)) >= k && rl_fast_log2(ldexp(1, k)) <= k);
        assert_true(rl_fast_exp2(k) >= ldexp(1, k) && rl_fast_exp2(k) <= ldexp(1, k));
    }
    assert_true(rl_fast_pow(0, 0.7) >= 0 && rl_fast_pow(0, 0.7) <= 0);
    assert_true(rl_fast_pow(1e-310, 1e-3) <= 0);
    assert_true(rl_fast_exp2(-5000) > 0 && rl_fast_exp2(-5000) < 1e-300);
}

/* More than two tiles each way, not a whole number of them. */
enum { W = 290, H = 150, N = W * H, TESTS = 5 };
static float planes[1 + TESTS][3][N], maps[TESTS][N], one[N];

static rl_metric_image view(int k, bool encoded)
{
    return (rl_metric_image){.width = W,
                             .height = H,
                             .channels = 3,
                             .plane = {planes[k][0], planes[k][1], planes[k][2]},
                             .stride = W,
                             .encoded = encoded};
}

/* Test 0 is equal; 1 differs in one pixel, on the corner of four tiles; 2 at the lower right; 3 everywhere.
 */
static void draw(void)
{
    for (int k = 0; k <= TESTS; k++)
        for (int c = 0; c < 3; c++)
            for (int i = 0; i < N; i++)
                planes[k][c][i] = (float)(0.5 + 0.3 * sin(i % W * 0.11 + c) * cos(i / W * 0.07));
    planes[2][1][64 * W + 128] += 0.3f;
    planes[3][0][N - 1] = 0;
    planes[5][1][63 * W + 127] += 0.3f;
    for (int i = 0; i < N; i++)
        planes[4][2][i] += (float)(i % 7) * 0.01f;
}

static void check(rl_metric metric, rl_pool *pool)
{
    rl_metric_image tests[TESTS], reference = view(0, metric == RL_METRIC_FLIP);
    float *to[TESTS];
    rl_error err = {0};
    for (int i = 0; i < TESTS; i++) {
        tests[i] = view(i + 1, metric == RL_METRIC_FLIP);
        to[i] = maps[i];
    }
    assert_int_equal(rl_metric_maps(metric, &reference, tests, TESTS, pool, to, &err), RL_OK);
    for (int i = 0; i < TESTS; i++) {
        assert_int_equal(rl_metric_map(metric, &reference, &tests[i], NULL, one, &err), RL_OK);
        assert_memory_equal(one, maps[i], sizeof one);
    }
    for (int i = 0; i < N; i++)
        assert_true(maps[0][i] <= 0 && maps[0][i] >= 0);
    /* As far as the filters reach, 10 pixels, and no farther. */
    for (int i = 0; i < N; i++) {
        int x = i % W - 128, y = i / W - 64;
        bool reached = abs(x) <= 10 && abs(y) <= 10;
        if (!reached)
            assert_true(maps[1][i] <= 1e-6f);
    }
    assert_true(maps[1][64 * W + 128] > 0.01f);
    assert_true(maps[1][63 * W + 127] > 0.01f && maps[1][64 * W + 127] > 0.01f);
    assert_true(maps[4][64 * W + 128] > 0.01f && maps[4][63 * W + 128] > 0.01f);
    assert_true(maps[2][N - 1] > 0.01f);
    assert_true(maps[3][5] > 0);
}

static void test_many(void **state)
{
    (void)state;
    rl_pool *pool = NULL;
    rl_error err = {0};
    assert_int_equal(rl_pool_new(3, &pool, &err), RL_OK);
    draw();
    check(RL_METRIC_FLIP, NULL);
    check(RL_METRIC_FLIP, pool);
    check(RL_METRIC_HDRFLIP, pool);
    check(RL_METRIC_HDRFLIP, NULL);
    rl_pool_free(&pool);
}

/* Without the shortcut for equal tiles: the other corner differs a little, so no tile is skipped for it. */
static void test_skipped_tiles(void **state)
{
    (void)state;
    rl_error err = {0};
    draw();
    rl_metric_image reference = view(0, true), test = view(2, true);
    assert_int_equal(rl_metric_map(RL_METRIC_FLIP, &reference, &test, NULL, one, &err), RL_OK);
    /* One unit in the last place everywhere else: invisible, but not equal. */
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < N; i++)
            if (i != 64 * W + 128)
                planes[2][c][i] = nextafterf(planes[2][c][i], 2);
    assert_int_equal(rl_metric_map(RL_METRIC_FLIP, &reference, &test, NULL, maps[0], &err), RL_OK);
    for (int i = 0; i < N; i++)
        assert_true(fabs((double)one[i] - (double)maps[0][i]) < 2e-3);
}

static void test_memory(void **state)
{
    (void)state;
    rl_metric_image reference = view(0, true), test = view(4, true);
    float *to[1] = {one};
    draw();
    size_t before = rl_alloc_live();
    for (unsigned long n = 1, done = 0; !done; n++) {
        rl_error err = {0};
        rl_alloc_fail_at(n, 0);
        rl_code code = rl_metric_maps(RL_METRIC_HDRFLIP, &reference, &test, 1, NULL, to, &err);
        done = rl_alloc_fail_at(0, 0) > 0;
        assert_int_equal(code, done ? RL_OK : RL_E_MEMORY);
        assert_int_equal(rl_alloc_live(), before);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_pow), cmocka_unit_test(test_many),
                                       cmocka_unit_test(test_skipped_tiles), cmocka_unit_test(test_memory)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
