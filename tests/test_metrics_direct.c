/* FLIP, HDR-FLIP and SSIM against direct evaluations of their definitions. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>

#include "graph/tool/metric_color.h"
#include "tests/direct_metrics.h"
#include "tests/metric_pictures.h"

static picture a, b;
static float map[PICTURE_SIZE], other[PICTURE_SIZE];
static double linear[2][3 * PICTURE_SIZE];

/* ---- by definition ---------------------------------------------------------------------------------------
 */

static void linearize(const picture *p, double *out, double scale)
{
    for (int i = 0; i < PICTURE_SIZE; i++) {
        for (int c = 0; c < 3; c++) {
            double v = (double)p->plane[c][i / PICTURE_WIDTH * PICTURE_STRIDE + i % PICTURE_WIDTH];
            if (p->image.encoded)
                v = v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
            out[3 * i + c] = scale > 0 ? direct_tone(v * scale) : v;
        }
    }
}

/* Both corners, borders, band limits, and the middle. */
static const int probes[][2] = {{0, 0},   {PICTURE_WIDTH - 1, PICTURE_HEIGHT - 1},
                                {0, 40},  {PICTURE_WIDTH - 1, 3},
                                {22, 63}, {21, 64},
                                {20, 0},  {30, PICTURE_HEIGHT - 1},
                                {10, 9},  {11, 10},
                                {33, 31}, {5, 77}};

static void test_flip_directly(void **state)
{
    (void)state;
    picture_draw(&a, 1, true, 1);
    picture_draw(&b, 5, true, 1);
    picture_map(RL_METRIC_FLIP, &a, &b, NULL, map);
    linearize(&a, linear[0], 0);
    linearize(&b, linear[1], 0);
    for (size_t i = 0; i < sizeof probes / sizeof *probes; i++) {
        int x = probes[i][0], y = probes[i][1];
        double expected = direct_flip(linear[0], linear[1], PICTURE_WIDTH, PICTURE_HEIGHT, x, y);
        assert_true(expected > 0.01 && expected < 1);
        assert_close((double)map[y * PICTURE_WIDTH + x], expected, 2e-5);
    }
}

static void test_hdrflip_directly(void **state)
{
    (void)state;
    picture_draw(&a, 2, false, 6);
    picture_draw(&b, 7, false, 6);
    picture_map(RL_METRIC_HDRFLIP, &a, &b, NULL, map);
    /* Exposures by bisection of the curve and a count of ranks. */
    double y[PICTURE_SIZE], largest = 0, median = 0;
    for (int i = 0; i < PICTURE_SIZE; i++) {
        int at = i / PICTURE_WIDTH * PICTURE_STRIDE + i % PICTURE_WIDTH;
        y[i] = 0.2126 * (double)a.plane[0][at] + 0.7152 * (double)a.plane[1][at] +
               0.0722 * (double)a.plane[2][at];
        largest = fmax(largest, y[i]);
    }
    for (int i = 0; i < PICTURE_SIZE; i++) {
        int below = 0;
        for (int k = 0; k < PICTURE_SIZE; k++)
            below += y[k] < y[i];
        if (below == PICTURE_SIZE / 2)
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
            worst[i] = fmax(worst[i], direct_flip(linear[0], linear[1], PICTURE_WIDTH, PICTURE_HEIGHT,
                                                  probes[i][0], probes[i][1]));
    }
    for (size_t i = 0; i < sizeof probes / sizeof *probes; i++)
        assert_close((double)map[probes[i][1] * PICTURE_WIDTH + probes[i][0]], worst[i], 2e-5);
}

static void test_ssim_directly(void **state)
{
    (void)state;
    static double grey[2][PICTURE_SIZE];
    const picture *both[2] = {&a, &b};
    picture_draw(&a, 3, true, 1);
    picture_draw(&b, 4, true, 1);
    picture_map(RL_METRIC_SSIM, &a, &b, NULL, map);
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < PICTURE_SIZE; i++) {
            int at = i / PICTURE_WIDTH * PICTURE_STRIDE + i % PICTURE_WIDTH;
            grey[k][i] = 0.2126 * (double)both[k]->plane[0][at] + 0.7152 * (double)both[k]->plane[1][at] +
                         0.0722 * (double)both[k]->plane[2][at];
        }
    int valid = 0;
    for (int i = 0; i < PICTURE_SIZE; i++) {
        int x = i % PICTURE_WIDTH, y = i / PICTURE_WIDTH;
        if (x < 5 || y < 5 || x >= PICTURE_WIDTH - 5 || y >= PICTURE_HEIGHT - 5) {
            assert_true(isnan(map[i]));
        } else {
            assert_close((double)map[i], direct_ssim(grey[0], grey[1], PICTURE_WIDTH, x, y), 1e-6);
            valid++;
        }
    }
    assert_int_equal(valid, (PICTURE_WIDTH - 10) * (PICTURE_HEIGHT - 10));
}

/* A linear image is divided by its largest luminance and encoded; grey, so that luminance and curve commute.
 */
static void test_ssim_of_linear_images(void **state)
{
    (void)state;
    static picture encoded[2], bright[2];
    for (int k = 0; k < 2; k++) {
        picture_draw(&encoded[k], 3 + (uint32_t)k, true, 1);
        encoded[k].plane[0][0] = 1;
        for (int i = 0; i < PICTURE_HEIGHT * PICTURE_STRIDE; i++)
            for (int c = 0; c < 3; c++) {
                encoded[k].plane[c][i] = encoded[k].plane[0][i];
                bright[k].plane[c][i] = (float)(8 * rl_srgb_decode((double)encoded[k].plane[0][i]));
            }
        picture_describe(&bright[k], false);
    }
    picture_map(RL_METRIC_SSIM, &encoded[0], &encoded[1], NULL, map);
    picture_map(RL_METRIC_SSIM, &bright[0], &bright[1], NULL, other);
    for (int i = 0; i < PICTURE_SIZE; i++)
        if (!isnan(map[i]))
            assert_close((double)other[i], (double)map[i], 1e-5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_flip_directly),
        cmocka_unit_test(test_hdrflip_directly),
        cmocka_unit_test(test_ssim_directly),
        cmocka_unit_test(test_ssim_of_linear_images),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
