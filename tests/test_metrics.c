/* The metrics: against their definitions evaluated directly, in cases that can be solved by hand, and for the
 * properties that they promise. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/tool/heatmap.h"
#include "graph/tool/metric_color.h"
#include "graph/tool/metrics.h"
#include "graph/tool/select.h"
#include "tests/direct_metrics.h"

enum { W = 45, H = 83, STRIDE = 47, N = W * H }; /* more than one band of rows, no whole block of columns */

typedef struct picture {
    float plane[3][H * STRIDE];
    rl_metric_image image;
} picture;

static void assert_close(double got, double want, double tolerance)
{
    if (!(fabs(got - want) <= tolerance))
        print_error("%.9g instead of %.9g\n", got, want);
    assert_true(fabs(got - want) <= tolerance);
}

static uint32_t random_state;

static double random_unit(void)
{
    random_state = random_state * 1664525u + 1013904223u;
    return (random_state >> 8) / 16777216.0;
}

static void describe(picture *p, bool encoded)
{
    p->image = (rl_metric_image){W, H, 3, {p->plane[0], p->plane[1], p->plane[2], NULL}, STRIDE, encoded};
}

/* Smooth shapes, an edge, points and noise, 0 … most. */
static void draw(picture *p, uint32_t seed, bool encoded, double most)
{
    random_state = seed;
    describe(p, encoded);
    memset(p->plane, 0x7f, sizeof p->plane); /* what is behind the rows must not count */
    for (int y = 0; y < H; y++) {
        for (int x = 0; x < W; x++) {
            for (int c = 0; c < 3; c++) {
                double v = 0.5 + 0.3 * sin(x * 0.11 * (c + 1) + y * 0.07) + 0.15 * (random_unit() - 0.5);
                v += x > 20 + (int)(seed % 3) ? 0.2 : -0.2;
                v = random_unit() < 0.01 ? 1 : v;
                p->plane[c][y * STRIDE + x] = (float)(most * fmin(fmax(v, 0), 1));
            }
        }
    }
}

static void fill(picture *p, bool encoded, double r, double g, double b)
{
    describe(p, encoded);
    for (int i = 0; i < H * STRIDE; i++) {
        p->plane[0][i] = (float)r;
        p->plane[1][i] = (float)g;
        p->plane[2][i] = (float)b;
    }
}

static void map_of(rl_metric metric, const picture *a, const picture *b, rl_pool *pool, float *map)
{
    rl_error err = {0};
    if (rl_metric_map(metric, &a->image, &b->image, pool, map, &err))
        print_error("%s\n", err.text);
    assert_int_equal(err.code, RL_OK);
}

static void stats_of(rl_metric metric, const picture *a, const float *map, double out[RL_STATS])
{
    assert_int_equal(rl_metric_stats(metric, map, NULL, N, rl_metric_peak(&a->image), out, &(rl_error){0}),
                     RL_OK);
}

static picture a, b;
static float map[N], other[N];
static double linear[2][3 * N];

/* ---- by definition ---------------------------------------------------------------------------------------
 */

static void linearize(const picture *p, double *out, double scale)
{
    for (int i = 0; i < N; i++) {
        for (int c = 0; c < 3; c++) {
            double v = (double)p->plane[c][i / W * STRIDE + i % W];
            if (p->image.encoded)
                v = v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
            out[3 * i + c] = scale > 0 ? direct_tone(v * scale) : v;
        }
    }
}

/* Both corners, borders, band limits, and the middle. */
static const int probes[][2] = {{0, 0},  {W - 1, H - 1}, {0, 40}, {W - 1, 3}, {22, 63}, {21, 64},
                                {20, 0}, {30, H - 1},    {10, 9}, {11, 10},   {33, 31}, {5, 77}};

static void test_flip_directly(void **state)
{
    (void)state;
    draw(&a, 1, true, 1);
    draw(&b, 5, true, 1);
    map_of(RL_METRIC_FLIP, &a, &b, NULL, map);
    linearize(&a, linear[0], 0);
    linearize(&b, linear[1], 0);
    for (size_t i = 0; i < sizeof probes / sizeof *probes; i++) {
        int x = probes[i][0], y = probes[i][1];
        double expected = direct_flip(linear[0], linear[1], W, H, x, y);
        assert_true(expected > 0.01 && expected < 1);
        assert_close((double)map[y * W + x], expected, 2e-5);
    }
}

static void test_hdrflip_directly(void **state)
{
    (void)state;
    draw(&a, 2, false, 6);
    draw(&b, 7, false, 6);
    map_of(RL_METRIC_HDRFLIP, &a, &b, NULL, map);
    /* Exposures by bisection of the curve and a count of ranks. */
    double y[N], largest = 0, median = 0;
    for (int i = 0; i < N; i++) {
        int at = i / W * STRIDE + i % W;
        y[i] = 0.2126 * (double)a.plane[0][at] + 0.7152 * (double)a.plane[1][at] +
               0.0722 * (double)a.plane[2][at];
        largest = fmax(largest, y[i]);
    }
    for (int i = 0; i < N; i++) {
        int below = 0;
        for (int k = 0; k < N; k++)
            below += y[k] < y[i];
        if (below == N / 2)
            median = y[i];
    }
    assert_true(median > 0);
    double low = 0, high = 100;
    for (int i = 0; i < 100; i++)
        *(direct_tone((low + high) / 2) < 0.85 ? &low : &high) = (low + high) / 2;
    double first = log2(low / largest), last = log2(low / median);
    int n = (int)fmax(2, ceil(last - first));

    rl_exposures e;
    assert_int_equal(rl_metric_exposures(&a.image, &e, &(rl_error){0}), RL_OK);
    assert_close(e.first, first, 1e-6);
    assert_close(e.last, last, 1e-6);
    assert_int_equal(e.n, n);

    double worst[sizeof probes / sizeof *probes] = {0};
    for (int k = 0; k < n; k++) {
        double scale = exp2(first + k * (last - first) / (n - 1));
        linearize(&a, linear[0], scale);
        linearize(&b, linear[1], scale);
        for (size_t i = 0; i < sizeof probes / sizeof *probes; i++)
            worst[i] = fmax(worst[i], direct_flip(linear[0], linear[1], W, H, probes[i][0], probes[i][1]));
    }
    for (size_t i = 0; i < sizeof probes / sizeof *probes; i++)
        assert_close((double)map[probes[i][1] * W + probes[i][0]], worst[i], 2e-5);
}

static void test_ssim_directly(void **state)
{
    (void)state;
    static double grey[2][N];
    const picture *both[2] = {&a, &b};
    draw(&a, 3, true, 1);
    draw(&b, 4, true, 1);
    map_of(RL_METRIC_SSIM, &a, &b, NULL, map);
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < N; i++) {
            int at = i / W * STRIDE + i % W;
            grey[k][i] = 0.2126 * (double)both[k]->plane[0][at] + 0.7152 * (double)both[k]->plane[1][at] +
                         0.0722 * (double)both[k]->plane[2][at];
        }
    int valid = 0;
    for (int i = 0; i < N; i++) {
        int x = i % W, y = i / W;
        if (x < 5 || y < 5 || x >= W - 5 || y >= H - 5) {
            assert_true(isnan(map[i]));
        } else {
            assert_close((double)map[i], direct_ssim(grey[0], grey[1], W, x, y), 1e-6);
            valid++;
        }
    }
    assert_int_equal(valid, (W - 10) * (H - 10));
    /* A linear image is encoded first: the same values, decoded, with a largest luminance of 1. */
    static picture c, d;
    c = a;
    d = b;
    for (int k = 0; k < 3; k++)
        c.plane[k][0] = 1;
    map_of(RL_METRIC_SSIM, &c, &d, NULL, map);
    for (int i = 0; i < H * STRIDE; i++)
        for (int k = 0; k < 3; k++) { /* grey, so that luminance and curve change places */
            c.plane[k][i] = (float)(8 * rl_srgb_decode((double)c.plane[0][i]));
            d.plane[k][i] = (float)(8 * rl_srgb_decode((double)d.plane[0][i]));
            if (k == 0)
                continue;
            c.plane[k][i] = c.plane[0][i];
            d.plane[k][i] = d.plane[0][i];
        }
    describe(&c, false);
    describe(&d, false);
    map_of(RL_METRIC_SSIM, &c, &d, NULL, other);
    static picture e, f;
    e = c;
    f = d;
    for (int i = 0; i < H * STRIDE; i++)
        for (int k = 0; k < 3; k++) {
            e.plane[k][i] = (float)rl_srgb_encode((double)c.plane[k][i] / 8);
            f.plane[k][i] = (float)rl_srgb_encode((double)d.plane[k][i] / 8);
        }
    describe(&e, true);
    describe(&f, true);
    map_of(RL_METRIC_SSIM, &e, &f, NULL, map);
    for (int i = 0; i < N; i++)
        if (!isnan(map[i]))
            assert_close((double)map[i], (double)other[i], 1e-5);
}

/* ---- by hand ---------------------------------------------------------------------------------------------
 */

static void test_equal_images(void **state)
{
    (void)state;
    for (int encoded = 0; encoded < 2; encoded++) {
        draw(&a, 9, encoded, 1);
        for (int m = 0; m < RL_METRICS; m++) {
            double s[RL_STATS];
            map_of((rl_metric)m, &a, &a, NULL, map);
            stats_of((rl_metric)m, &a, map, s);
            if (m == RL_METRIC_PSNR) {
                assert_true(isinf(s[RL_STAT_MEAN]) && s[RL_STAT_MEAN] > 0);
                assert_true(isnan(s[RL_STAT_P95]));
                continue;
            }
            for (int i = 0; i < RL_STATS; i++)
                assert_true(s[i] == (m == RL_METRIC_SSIM ? 1 : 0));
        }
    }
}

static void test_constants(void **state)
{
    (void)state;
    double s[RL_STATS];
    /* Green and blue are as far apart as colours get, and nothing has an edge. */
    fill(&a, true, 0, 1, 0);
    fill(&b, true, 0, 0, 1);
    map_of(RL_METRIC_FLIP, &a, &b, NULL, map);
    for (int i = 0; i < N; i++)
        assert_close((double)map[i], 1, 1e-6);
    /* Black and white: L* differs by 100, so (100^0.7 · 0.95 / (0.4 · largest)) or beyond its bend. */
    fill(&a, true, 0, 0, 0);
    fill(&b, true, 1, 1, 1);
    map_of(RL_METRIC_FLIP, &a, &b, NULL, map);
    /* Green is L*a*b* 87.73, -86.18, 83.18, blue 32.30, 79.19, -107.86; a and b are scaled by L / 100. */
    double largest_hyab =
        87.73 - 32.30 + hypot(0.8773 * 86.18 + 0.3230 * 79.19, 0.8773 * 83.18 + 0.3230 * 107.86);
    double largest = pow(largest_hyab, 0.7), bend = 0.4 * largest, error = pow(100, 0.7);
    assert_true(error > bend);
    assert_close((double)map[N / 2], 0.95 + 0.05 * (error - bend) / (largest - bend), 1e-4);

    fill(&a, false, 1, 2, 4);
    fill(&b, false, 1.5, 2, 3);
    map_of(RL_METRIC_RMSE, &a, &b, NULL, map);
    stats_of(RL_METRIC_RMSE, &a, map, s);
    for (int i = 0; i < RL_STATS; i++)
        assert_close(s[i], sqrt(1.25 / 3), 1e-6);
    map_of(RL_METRIC_MAX, &a, &b, NULL, map);
    stats_of(RL_METRIC_MAX, &a, map, s);
    for (int i = 0; i < RL_STATS; i++)
        assert_close(s[i], 1, 0);
    map_of(RL_METRIC_PSNR, &a, &b, NULL, map);
    stats_of(RL_METRIC_PSNR, &a, map, s);
    assert_close(s[RL_STAT_MEAN], 10 * log10(16 / (1.25 / 3)), 1e-5); /* the reference's peak is 4 */
    assert_close(rl_metric_peak(&b.image), 3, 0);
    describe(&a, true);
    assert_close(rl_metric_peak(&a.image), 1, 0);

    /* SSIM of two flat images is their luminance term. */
    fill(&a, true, 0.2, 0.2, 0.2);
    fill(&b, true, 0.6, 0.6, 0.6);
    map_of(RL_METRIC_SSIM, &a, &b, NULL, map);
    stats_of(RL_METRIC_SSIM, &a, map, s);
    assert_close(s[RL_STAT_MEAN], (2 * 0.12 + 1e-4) / (0.04 + 0.36 + 1e-4), 1e-6);
}

static void test_statistics(void **state)
{
    (void)state;
    float values[101];
    uint8_t mask[101] = {0};
    double s[RL_STATS];
    for (int i = 0; i <= 100; i++)
        values[i * 37 % 101] = (float)i;
    rl_metric_stats(RL_METRIC_FLIP, values, NULL, 101, 1, s, &(rl_error){0});
    assert_close(s[RL_STAT_MEAN], 50, 0);
    assert_close(s[RL_STAT_MEDIAN], 50, 0);
    assert_close(s[RL_STAT_P95], 95, 1e-9);
    assert_close(s[RL_STAT_MAX], 100, 0);
    for (int i = 0; i <= 100; i++)
        mask[i] = values[i] < 10; /* 0 … 9: the median lies between 4 and 5, the p95 at rank 8.55 */
    rl_metric_stats(RL_METRIC_MAX, values, mask, 101, 1, s, &(rl_error){0});
    assert_close(s[RL_STAT_MEDIAN], 4.5, 0);
    assert_close(s[RL_STAT_P95], 8.55, 1e-9);
    rl_metric_stats(RL_METRIC_RMSE, values, mask, 101, 1, s, &(rl_error){0});
    assert_close(s[RL_STAT_MEAN], sqrt(28.5), 1e-9);
    memset(mask, 0, sizeof mask);
    rl_metric_stats(RL_METRIC_SSIM, values, mask, 101, 1, s, &(rl_error){0});
    for (int i = 0; i < RL_STATS; i++)
        assert_true(isnan(s[i]));
    /* Many equal values, and every rank of a few. */
    random_state = 3;
    for (int k = 0; k < 60; k++) {
        float v[60], sorted;
        for (int i = 0; i < 60; i++)
            v[i] = (float)(int)(random_unit() * (1 + k));
        int below = 0, equal = 0;
        float copy[60];
        memcpy(copy, v, sizeof v);
        sorted = rl_select(v, 60, (size_t)k);
        for (int i = 0; i < 60; i++) {
            below += copy[i] < sorted;
            equal += copy[i] == sorted;
        }
        assert_true(below <= k && k < below + equal);
    }
}

/* ---- promises --------------------------------------------------------------------------------------------
 */

static void test_symmetry_and_order(void **state)
{
    (void)state;
    static const rl_metric symmetric[] = {RL_METRIC_FLIP, RL_METRIC_SSIM, RL_METRIC_RMSE, RL_METRIC_MAX};
    draw(&a, 11, true, 1);
    draw(&b, 12, true, 1);
    for (size_t i = 0; i < sizeof symmetric / sizeof *symmetric; i++) {
        map_of(symmetric[i], &a, &b, NULL, map);
        map_of(symmetric[i], &b, &a, NULL, other);
        for (int k = 0; k < N; k++)
            assert_true(isnan(map[k]) ? isnan(other[k]) : map[k] == other[k]);
    }
    /* Further from the reference is worse, for all of them. */
    static picture c;
    for (int m = 0; m < RL_METRICS; m++) {
        double last = 0;
        for (int step = 1; step <= 4; step++) {
            double s[RL_STATS];
            c = b;
            for (int k = 0; k < 3; k++)
                for (int i = 0; i < H * STRIDE; i++)
                    c.plane[k][i] = a.plane[k][i] + (float)step * 0.2f * (b.plane[k][i] - a.plane[k][i]);
            describe(&c, true);
            map_of((rl_metric)m, &a, &c, NULL, map);
            stats_of((rl_metric)m, &a, map, s);
            double worse = rl_metric_rises((rl_metric)m) ? -s[RL_STAT_MEAN] : s[RL_STAT_MEAN];
            assert_true(step == 1 || worse > last);
            last = worse;
        }
    }
}

static void test_threads(void **state)
{
    (void)state;
    for (int m = 0; m < RL_METRICS; m++) {
        draw(&a, 21, m != RL_METRIC_HDRFLIP, 1);
        draw(&b, 22, m != RL_METRIC_HDRFLIP, 1);
        map_of((rl_metric)m, &a, &b, NULL, map);
        for (int threads = 1; threads <= 3; threads++) {
            rl_pool *pool = NULL;
            assert_int_equal(rl_pool_new(threads, &pool, &(rl_error){0}), RL_OK);
            map_of((rl_metric)m, &a, &b, pool, other);
            rl_pool_free(&pool);
            assert_memory_equal(map, other, sizeof map);
        }
    }
}

static void test_exposures_of_dark_images(void **state)
{
    (void)state;
    rl_exposures e;
    fill(&a, false, 0, 0, 0);
    fill(&b, false, 0.5, 0.5, 0.5);
    assert_int_equal(rl_metric_exposures(&a.image, &e, &(rl_error){0}), RL_OK);
    assert_true(e.first == 0 && e.last == 0);
    map_of(RL_METRIC_HDRFLIP, &a, &b, NULL, map);
    assert_true(map[0] > 0.1 && map[0] <= 1);
    /* An object before black: the median is that of the object. */
    for (int i = 0; i < 10; i++)
        for (int c = 0; c < 3; c++)
            a.plane[c][i] = i < 3 ? 8.0f : 2.0f;
    assert_int_equal(rl_metric_exposures(&a.image, &e, &(rl_error){0}), RL_OK);
    assert_close(e.last - e.first, 2, 1e-6);
    assert_int_equal(e.n, 2);
    /* Huge and negative values have exposures too. */
    a.plane[0][0] = 3e38f;
    a.plane[1][1] = -3e38f;
    map_of(RL_METRIC_HDRFLIP, &a, &b, NULL, map);
    for (int i = 0; i < N; i++)
        assert_true(map[i] >= 0 && map[i] <= 1);
}

static void test_refusals(void **state)
{
    (void)state;
    draw(&a, 1, true, 1);
    draw(&b, 2, true, 1);
    for (int m = 0; m < RL_METRICS; m++) {
        picture c = b;
        describe(&c, true);
        c.image.width--;
        assert_int_equal(rl_metric_map((rl_metric)m, &a.image, &c.image, NULL, map, &(rl_error){0}),
                         RL_E_USAGE);
        c.image.width++;
        c.image.channels = 1;
        assert_int_equal(rl_metric_map((rl_metric)m, &a.image, &c.image, NULL, map, &(rl_error){0}),
                         RL_E_USAGE);
        c.image.channels = 3;
        c.image.encoded = false;
        assert_int_equal(rl_metric_map((rl_metric)m, &a.image, &c.image, NULL, map, &(rl_error){0}),
                         RL_E_USAGE);
    }
    a.image.channels = b.image.channels = 2;
    assert_int_equal(rl_metric_map(RL_METRIC_FLIP, &a.image, &b.image, NULL, map, &(rl_error){0}),
                     RL_E_USAGE);
    assert_int_equal(rl_metric_map(RL_METRIC_MAX, &a.image, &b.image, NULL, map, &(rl_error){0}), RL_OK);
    a.image.channels = b.image.channels = 3;
    a.image.height = b.image.height = 10;
    assert_int_equal(rl_metric_map(RL_METRIC_SSIM, &a.image, &b.image, NULL, map, &(rl_error){0}),
                     RL_E_USAGE);
    assert_int_equal(rl_metric_map(RL_METRIC_FLIP, &a.image, &b.image, NULL, map, &(rl_error){0}), RL_OK);
}

static void test_memory(void **state)
{
    (void)state;
    draw(&a, 1, false, 1);
    draw(&b, 2, false, 1);
    for (int m = 0; m < RL_METRICS; m++) {
        int failures = 0;
        for (unsigned long n = 1;; n++) {
            rl_error err = {0};
            double s[RL_STATS];
            size_t live = rl_alloc_live();
            rl_alloc_fail_at(n, 0);
            rl_code code = rl_metric_map((rl_metric)m, &a.image, &b.image, NULL, map, &err);
            if (!code)
                code = rl_metric_stats((rl_metric)m, map, NULL, N, 1, s, &err);
            bool untouched = rl_alloc_fail_at(0, 0) > 0;
            assert_int_equal(rl_alloc_live(), live);
            if (untouched)
                break;
            assert_int_equal(code, RL_E_MEMORY);
            failures++;
        }
        assert_true(failures >= 1);
    }
}

static void test_heat_colors(void **state)
{
    (void)state;
    float rgb[3];
    double last = -1;
    for (int i = 0; i <= 255; i++) {
        double linear_rgb[3], lab[3];
        rl_heat_color(i / 255.0, rgb);
        for (int c = 0; c < 3; c++)
            linear_rgb[c] = rl_srgb_decode((double)rgb[c]);
        rl_lab_from_rgb(linear_rgb, lab);
        assert_true(lab[0] > last);
        assert_close(lab[0], 97 * i / 255.0, 4); /* clipping to the display moves it a little */
        last = lab[0];
    }
    rl_heat_color(0, rgb);
    assert_true(rgb[0] < 0.01 && rgb[1] < 0.01 && rgb[2] < 0.01);
    const float in[3] = {0, 1, 4};
    float out[3];
    double white;
    rl_heat_scale(RL_METRIC_MAX, in, 3, out, &white);
    assert_true(white == 4 && out[1] == 0.25f && out[2] == 1);
    rl_heat_scale(RL_METRIC_PSNR, in, 3, out, &white);
    assert_true(white == 2 && out[1] == 0.5f);
    rl_heat_scale(RL_METRIC_SSIM, in, 3, out, &white);
    assert_true(white == 1 && out[0] == 1 && out[1] == 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_flip_directly),
        cmocka_unit_test(test_hdrflip_directly),
        cmocka_unit_test(test_ssim_directly),
        cmocka_unit_test(test_equal_images),
        cmocka_unit_test(test_constants),
        cmocka_unit_test(test_statistics),
        cmocka_unit_test(test_symmetry_and_order),
        cmocka_unit_test(test_threads),
        cmocka_unit_test(test_exposures_of_dark_images),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_memory),
        cmocka_unit_test(test_heat_colors),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
