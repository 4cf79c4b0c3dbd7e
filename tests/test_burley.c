/* Burley's profile on the host. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "passes/burley.h"

/* The xi of the tests: dense near both ends, 1e-9 … 1 - 1e-9. */
#define STEPS 4000
static double xi_at(int i)
{
    double t = (double)i / STEPS; /* 0…1 */
    return t < 0.5 ? pow(10, -9 + 2 * t * (9 + log10(0.5)))
                   : 1 - pow(10, -9 + 2 * (1 - t) * (9 + log10(0.5)));
}

/* Share beyond t, 1 - P, in long double: the scale on which xi near 1 is exact. */
static long double beyond(long double t)
{
    return 0.25L * expl(-t) + 0.75L * expl(-t / 3);
}

static long double within(long double t)
{
    return -0.25L * expm1l(-t) - 0.75L * expm1l(-t / 3);
}

static double by_bisection(double xi)
{
    long double low = 0, high = 200;
    for (int i = 0; i < 200; i++) {
        long double t = 0.5L * (low + high);
        bool more = xi < 0.5 ? within(t) < xi : beyond(t) > 1 - (long double)xi;
        if (more)
            low = t;
        else
            high = t;
    }
    return (double)(0.5L * (low + high));
}

/* The talk's way. */
static double by_halley(double xi)
{
    long double t = xi < 0.5 ? 2.0L * xi : -3 * logl((1 - (long double)xi) / 0.75L);
    for (int i = 0; i < 60; i++) {
        long double f = xi < 0.5 ? within(t) - xi : 1 - (long double)xi - beyond(t);
        long double f1 = 0.25L * (expl(-t) + expl(-t / 3)), f2 = -0.25L * (expl(-t) + expl(-t / 3) / 3);
        t -= 2 * f * f1 / (2 * f1 * f1 - f * f2);
    }
    return (double)t;
}

static void inverse_equals(double (*other)(double), const char *name)
{
    double worst = 0;
    for (int i = 0; i <= STEPS; i++) {
        double xi = xi_at(i), a = rl_burley_inverse(xi), b = other(xi);
        worst = fmax(worst, fabs(a - b) / b);
    }
    print_message("inverse CDF against %s: %.2e\n", name, worst);
    assert_true(worst <= 1e-12);
}

static void inverse_equals_bisection(void **state)
{
    (void)state;
    inverse_equals(by_bisection, "bisection");
}

static void inverse_equals_halley(void **state)
{
    (void)state;
    inverse_equals(by_halley, "Halley");
}

static void inverse_has_ends(void **state)
{
    (void)state;
    assert_true(rl_burley_inverse(0) == 0);
    assert_true(isinf(rl_burley_inverse(1)));
    assert_true(fabs(rl_burley_inverse(RL_BURLEY_REACH) - RL_BURLEY_RADIUS) < 5e-5);
    assert_true(fabs(rl_burley_cdf(RL_BURLEY_RADIUS * 0.003, 0.003) - RL_BURLEY_REACH) < 1e-7);
}

/* The profile's integral over a disk is the CDF, whatever d is. */
static void cdf_integrates_profile(void **state)
{
    (void)state;
    for (double d = 0.0007; d < 10; d *= 7) {
        double sum = 0;
        const int n = 20000;
        for (int i = 0; i < n; i++) {
            double r = (i + 0.5) / n * 5 * d;
            sum += 2 * 3.14159265358979323846 * r * rl_burley_profile(r, d) * (5 * d / n);
        }
        assert_true(fabs(sum - rl_burley_cdf(5 * d, d)) < 1e-8);
    }
}

/* As many taps within a radius as the CDF says, and 1/density as the weight. */
static void taps_follow_profile(void **state)
{
    (void)state;
    enum { N = 1000 };
    static float x[N], y[N], w[N];
    rl_burley_taps(N, 0.5, x, y, w);
    double mean_x = 0, mean_y = 0;
    for (int i = 0; i < N; i++) {
        double r = hypot(x[i], y[i]);
        assert_true(fabs(rl_burley_cdf(r, 1) - 0.997 * (i + 0.5) / N) < 1e-6);
        assert_true(fabs(w[i] * rl_burley_profile(r, 1) * 8 * 3.14159265358979323846 - 1) < 1e-5);
        mean_x += x[i] / N;
        mean_y += y[i] / N;
    }
    assert_true(hypot(mean_x, mean_y) < 0.02); /* no side is preferred */
}

/* Of three channels: the radii fill the mixture evenly, weights are 1/density, and sums what they say. All
 * offsets together have the integral of each channel's profile. */
static void mixed_taps_follow_mixture(void **state)
{
    (void)state;
    enum { N = 200, OFFSETS = 40 };
    static const double sets[][3] = {{1, 0.4, 0.23}, {0.03, 1, 0.03}, {1, 1, 0.001}, {1, 1, 1}};
    static float x[N], y[N], w[N];
    for (size_t k = 0; k < 4; k++) {
        const double *d = sets[k];
        double share[3], all = 0, mean[3] = {0}, sum[3], narrow = 0;
        for (int c = 0; c < 3; c++)
            narrow += d[c] < 1 ? RL_BURLEY_NARROW : 0;
        for (int c = 0; c < 3; c++)
            share[c] = d[c] < 1 ? RL_BURLEY_NARROW : (1 - narrow) / ((d[0] == 1) + (d[1] == 1) + (d[2] == 1));
        for (int c = 0; c < 3; c++)
            all += share[c] * rl_burley_cdf(RL_BURLEY_RADIUS, d[c]);
        for (int j = 0; j < OFFSETS; j++) {
            double want[3] = {0};
            rl_burley_mixture_taps(N, (j + 0.5) / OFFSETS, d, x, y, w, sum);
            for (int i = 0; i < N; i++) {
                double r = hypot(x[i], y[i]), within = 0, density = 0;
                for (int c = 0; c < 3; c++) {
                    within += share[c] * rl_burley_cdf(r, d[c]);
                    density += share[c] * rl_burley_profile(r, d[c]) * 8 * 3.14159265358979323846;
                }
                assert_true(fabs(within - all * (i + (j + 0.5) / OFFSETS) / N) < 1e-6);
                assert_true(fabs(w[i] * density - 1) < 1e-5);
                for (int c = 0; c < 3; c++)
                    want[c] += rl_burley_profile(r, d[c]) * 8 * 3.14159265358979323846 * d[c] * w[i];
            }
            for (int c = 0; c < 3; c++) {
                assert_true(fabs(sum[c] / want[c] - 1) < 1e-4);
                mean[c] += sum[c] * all / (d[c] * N * OFFSETS);
            }
        }
        for (int c = 0; c < 3; c++)
            assert_true(fabs(mean[c] - rl_burley_cdf(RL_BURLEY_RADIUS, d[c])) < 1e-4);
    }
}

static void rows_are_usable(void **state)
{
    (void)state;
    assert_string_equal(rl_scatter_profile_rows[0].name, "scatter_distance_mm");
    assert_true(rl_scatter_profile_rows[0].required);
    for (int i = 0; i < RL_SCATTER_PROFILE_ROWS; i++)
        assert_non_null(rl_scatter_profile_rows[i].help);
    for (int i = 0; i < RL_SCATTER_SHADING_ROWS; i++)
        assert_non_null(rl_scatter_shading_rows[i].words);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(inverse_equals_bisection),  cmocka_unit_test(inverse_equals_halley),
        cmocka_unit_test(inverse_has_ends),          cmocka_unit_test(cdf_integrates_profile),
        cmocka_unit_test(mixed_taps_follow_mixture), cmocka_unit_test(taps_follow_profile),
        cmocka_unit_test(rows_are_usable),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
