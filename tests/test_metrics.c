/* The metrics: in cases that can be solved by hand, and for the properties that they promise. */
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
#include "tests/metric_pictures.h"

static void stats_of(rl_metric metric, const picture *a, const float *map, double out[RL_STATS])
{
    assert_int_equal(
        rl_metric_stats(metric, map, NULL, PICTURE_SIZE, rl_metric_peak(&a->image), out, &(rl_error){0}),
        RL_OK);
}

static picture a, b;
static float map[PICTURE_SIZE], other[PICTURE_SIZE];
/* ---- by hand ---------------------------------------------------------------------------------------------
 */

static void test_equal_images(void **state)
{
    (void)state;
    for (int encoded = 0; encoded < 2; encoded++) {
        picture_draw(&a, 9, encoded, 1);
        for (int m = 0; m < RL_METRICS; m++) {
            double s[RL_STATS];
            picture_map((rl_metric)m, &a, &a, NULL, map);
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
    picture_fill(&a, true, 0, 1, 0);
    picture_fill(&b, true, 0, 0, 1);
    picture_map(RL_METRIC_FLIP, &a, &b, NULL, map);
    for (int i = 0; i < PICTURE_SIZE; i++)
        assert_close((double)map[i], 1, 1e-6);
    /* Black and white: L* differs by 100, so (100^0.7 · 0.95 / (0.4 · largest)) or beyond its bend. */
    picture_fill(&a, true, 0, 0, 0);
    picture_fill(&b, true, 1, 1, 1);
    picture_map(RL_METRIC_FLIP, &a, &b, NULL, map);
    /* Green is L*a*b* 87.73, -86.18, 83.18, blue 32.30, 79.19, -107.86; a and b are scaled by L / 100. */
    double largest_hyab =
        87.73 - 32.30 + hypot(0.8773 * 86.18 + 0.3230 * 79.19, 0.8773 * 83.18 + 0.3230 * 107.86);
    double largest = pow(largest_hyab, 0.7), bend = 0.4 * largest, error = pow(100, 0.7);
    assert_true(error > bend);
    assert_close((double)map[PICTURE_SIZE / 2], 0.95 + 0.05 * (error - bend) / (largest - bend), 1e-4);

    picture_fill(&a, false, 1, 2, 4);
    picture_fill(&b, false, 1.5, 2, 3);
    picture_map(RL_METRIC_RMSE, &a, &b, NULL, map);
    stats_of(RL_METRIC_RMSE, &a, map, s);
    for (int i = 0; i < RL_STATS; i++)
        assert_close(s[i], sqrt(1.25 / 3), 1e-6);
    picture_map(RL_METRIC_MAX, &a, &b, NULL, map);
    stats_of(RL_METRIC_MAX, &a, map, s);
    for (int i = 0; i < RL_STATS; i++)
        assert_close(s[i], 1, 0);
    picture_map(RL_METRIC_PSNR, &a, &b, NULL, map);
    stats_of(RL_METRIC_PSNR, &a, map, s);
    assert_close(s[RL_STAT_MEAN], 10 * log10(16 / (1.25 / 3)), 1e-5); /* the reference's peak is 4 */
    assert_close(rl_metric_peak(&b.image), 3, 0);
    picture_describe(&a, true);
    assert_close(rl_metric_peak(&a.image), 1, 0);

    /* SSIM of two flat images is their luminance term. */
    picture_fill(&a, true, 0.2, 0.2, 0.2);
    picture_fill(&b, true, 0.6, 0.6, 0.6);
    picture_map(RL_METRIC_SSIM, &a, &b, NULL, map);
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
    uint32_t random = 3;
    for (int k = 0; k < 60; k++) {
        float v[60], sorted;
        for (int i = 0; i < 60; i++)
            v[i] = (float)(int)(picture_random(&random) * (1 + k));
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
    picture_draw(&a, 11, true, 1);
    picture_draw(&b, 12, true, 1);
    for (size_t i = 0; i < sizeof symmetric / sizeof *symmetric; i++) {
        picture_map(symmetric[i], &a, &b, NULL, map);
        picture_map(symmetric[i], &b, &a, NULL, other);
        for (int k = 0; k < PICTURE_SIZE; k++)
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
                for (int i = 0; i < PICTURE_HEIGHT * PICTURE_STRIDE; i++)
                    c.plane[k][i] = a.plane[k][i] + (float)step * 0.2f * (b.plane[k][i] - a.plane[k][i]);
            picture_describe(&c, true);
            picture_map((rl_metric)m, &a, &c, NULL, map);
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
        picture_draw(&a, 21, m != RL_METRIC_HDRFLIP, 1);
        picture_draw(&b, 22, m != RL_METRIC_HDRFLIP, 1);
        picture_map((rl_metric)m, &a, &b, NULL, map);
        for (int threads = 1; threads <= 3; threads++) {
            rl_pool *pool = NULL;
            assert_int_equal(rl_pool_new(threads, &pool, &(rl_error){0}), RL_OK);
            picture_map((rl_metric)m, &a, &b, pool, other);
            rl_pool_free(&pool);
            assert_memory_equal(map, other, sizeof map);
        }
    }
}

static void test_exposures_of_dark_images(void **state)
{
    (void)state;
    rl_exposures e;
    picture_fill(&a, false, 0, 0, 0);
    picture_fill(&b, false, 0.5, 0.5, 0.5);
    assert_int_equal(rl_metric_exposures(&a.image, &e, &(rl_error){0}), RL_OK);
    assert_true(e.first == 0 && e.last == 0);
    picture_map(RL_METRIC_HDRFLIP, &a, &b, NULL, map);
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
    picture_map(RL_METRIC_HDRFLIP, &a, &b, NULL, map);
    for (int i = 0; i < PICTURE_SIZE; i++)
        assert_true(map[i] >= 0 && map[i] <= 1);
}

static void test_refusals(void **state)
{
    (void)state;
    picture_draw(&a, 1, true, 1);
    picture_draw(&b, 2, true, 1);
    for (int m = 0; m < RL_METRICS; m++) {
        picture c = b;
        picture_describe(&c, true);
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
    picture_draw(&a, 1, false, 1);
    picture_draw(&b, 2, false, 1);
    for (int m = 0; m < RL_METRICS; m++) {
        int failures = 0;
        for (unsigned long n = 1;; n++) {
            rl_error err = {0};
            double s[RL_STATS];
            size_t live = rl_alloc_live();
            rl_alloc_fail_at(n, 0);
            rl_code code = rl_metric_map((rl_metric)m, &a.image, &b.image, NULL, map, &err);
            if (!code)
                code = rl_metric_stats((rl_metric)m, map, NULL, PICTURE_SIZE, 1, s, &err);
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
        cmocka_unit_test(test_equal_images), cmocka_unit_test(test_constants),
        cmocka_unit_test(test_statistics),   cmocka_unit_test(test_symmetry_and_order),
        cmocka_unit_test(test_threads),      cmocka_unit_test(test_exposures_of_dark_images),
        cmocka_unit_test(test_refusals),     cmocka_unit_test(test_memory),
        cmocka_unit_test(test_heat_colors),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
