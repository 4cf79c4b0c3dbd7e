/* What sss_gaussian promises: shares, variances, energy, borders, detail, the same bits. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "tests/gaussian_run.h"

/* ---- shares and variances, from an impulse on a plane parallel to the screen ---- */

enum { SIZE = 192 };

/* One pixel in the middle of the image shines; a pixel is `mm` wide. */
static sss_scene impulse(float mm, size_t *middle)
{
    sss_scene s = sss_scene_make(0, 0, SIZE, SIZE, 1000 / mm);
    sss_scene_flat(&s, 1, 1, 0);
    *middle = SIZE / 2 * (size_t)s.twin.frame.columns + SIZE / 2;
    for (size_t c = 0; c < 3; c++)
        s.diffuse[c * s.n + *middle] = 1;
    return s;
}

/* Of a Gaussian that ends at k sigma: the share that is left, and the share of its variance that is left,
 * normalized. */
static double share_within(int separable, double k)
{
    double line = erf(k / sqrt(2.0));
    return separable ? line * line : 1 - exp(-k * k / 2);
}

static double variance_within(int separable, double k)
{
    if (separable)
        return 1 - 2 * k * exp(-k * k / 2) / sqrt(2 * 3.14159265358979) / erf(k / sqrt(2.0));
    return 1 - k * k / 2 * exp(-k * k / 2) / (1 - exp(-k * k / 2));
}

/* What stays at the pixel is the unblurred share and the peaks of the Gaussians, 1 / (2 pi sigma²) in pixels.
 */
static void unblurred_share(void **state)
{
    (void)state;
    static const double expected[3] = {0.2406, 0.4475, 0.6159}; /* 1 - the sums of the weights */
    const double mm = 0.05;
    for (int separable = 0; separable < 2; separable++) {
        size_t middle;
        sss_scene s = impulse((float)mm, &middle);
        gaussian_run_one(&s, separable, &gaussian_mixtures[1]);
        for (size_t c = 0; c < 3; c++) {
            double rest = (double)s.filtered[c * s.n + middle];
            for (int g = 0; g < 3; g++) {
                double variance = (double)gaussian_mixtures[1].variance_mm2[g] / (mm * mm);
                double share = share_within(separable, g == 2 ? 3 : 4.5);
                rest -= (double)gaussian_mixtures[1].weight[g][c] / (2 * 3.14159265358979 * variance * share);
            }
            assert_true(fabs(rest - expected[c]) < 2e-5);
        }
        sss_scene_free(&s);
    }
}

/* One Gaussian's variance, measured; beside a wider one without weight, which lets it end at 4.5 sigma. */
static void variance_is_kept(void **state)
{
    (void)state;
    const gaussian_material one = {1, 1, {2}, {{1, 1, 1}}, 0, 0, 0, 0},
                            beside = {1, 2, {2, 5}, {{1, 1, 1}, {0, 0, 0}}, 0, 0, 0, 0};
    const double mm =
        sqrt(2.0) * 3 / 24.5; /* 3 sigma end between two pixels; 4.5, twice, are inside of the image */
    for (int k = 0; k < 4; k++) {
        int separable = k & 1;
        size_t middle;
        sss_scene s = impulse((float)mm, &middle);
        gaussian_run_one(&s, separable, k < 2 ? &one : &beside);
        double sum = 0, second = 0;
        SSS_EACH_PIXEL(&s, x, y, i)
        {
            double dx = (x - SIZE / 2) * mm, dy = (y - SIZE / 2) * mm;
            sum += (double)s.filtered[i];
            second += (double)s.filtered[i] * (dx * dx + dy * dy) / 2;
        }
        double expected = 2 * variance_within(separable, k < 2 ? 3 : 4.5);
        assert_true(fabs(sum - 1) < 1e-5);
        if (!(fabs(second / sum / expected - 1) < 3e-3))
            fail_msg("variant %d: variance %.5f, not %.5f", k, second / sum, expected);
        sss_scene_free(&s);
    }
}

/* Rows and columns are the whole disk, up to the corners of the square: 0.57 % of the widest Gaussian's
 * light, 4e-5 of narrow ones'. */
static void separable_equals_full(void **state)
{
    (void)state;
    const gaussian_material wide = {1, 1, {4}, {{1, 1, 1}}, 0, 0, 0, 0},
                            narrow = {1, 2, {4, 16}, {{0.75f, 0.75f, 0.75f}, {0, 0, 0}}, 0, 0, 0, 0};
    for (int k = 0; k < 2; k++) {
        sss_scene s = sss_scene_make(3, 1, 150, 90, 3000);
        float *rows = sss_planes(3 * s.n);
        uint32_t seed = 5;
        sss_scene_flat(&s, 1, 1, 0);
        for (size_t i = 0; i < 3 * s.n; i++)
            s.diffuse[i] = sss_random(&seed) < 0.1f ? 10 : 0;
        gaussian_run_one(&s, SEPARABLE, k ? &narrow : &wide);
        memcpy(rows, s.filtered, 3 * s.n * sizeof *rows);
        gaussian_run_one(&s, FULL, k ? &narrow : &wide);
        double worst = 0;
        SSS_EACH_PIXEL(&s, x, y, i)
        {
            for (size_t c = 0; c < 3; c++)
                worst = fmax(worst, fabs((double)rows[c * s.n + i] - (double)s.filtered[c * s.n + i]));
        }
        if (!(worst < (k ? 4e-4 : 0.057)))
            fail_msg("%s: %.6f", k ? "narrow" : "wide", worst);
        rl_free(rows);
        sss_scene_free(&s);
    }
}

/* ---- energy, borders, detail ---- */

/* Flat and evenly lit: the filter changes nothing, and the way out is that of the unfiltered surface. */
static void energy_is_kept(void **state)
{
    (void)state;
    for (int separable = 0; separable < 2; separable++)
        for (uint32_t id = 1; id < 6; id++) {
            sss_scene s = sss_scene_make(3, 1, 180, 110, 300);
            sss_scene_flat(&s, id, 0.5f, gaussian_mixtures[id].has_profile ? 0.7f : 0);
            s.twin.area = id & 1;
            gaussian_run(&s, separable);
            SSS_EACH_PIXEL(&s, x, y, i)
            {
                double unfiltered[3] = {0.7f, 0.7f, 0.7f}, color[3];
                int edge = x < 40 || y < 40 || x > 140 || y > 70;
                if (gaussian_mixtures[id].border == 1 && edge)
                    continue;
                twin_resolve(&s.twin, x, y, unfiltered, color);
                for (size_t c = 0; c < 3; c++)
                    assert_true(fabs((double)s.color[c * s.n + i] - color[c]) <= 1e-5 * color[c]);
            }
            sss_scene_free(&s);
        }
}

/* An occluding border darkens: half of what is blurred at a straight edge. */
static void occlusion_is_black(void **state)
{
    (void)state;
    for (int separable = 0; separable < 2; separable++) {
        sss_scene s = sss_scene_make(0, 0, 192, 64, 600);
        sss_scene_flat(&s, 5, 0.3f, 1);
        SSS_EACH_PIXEL(&s, x, y, i)
        {
            s.stencil[i] = x < 96 ? 5 : 3;
        }
        gaussian_run(&s, separable);
        size_t edge = 32 * (size_t)s.twin.frame.columns + 95;
        double sigma = sqrt(12.0) * 2; /* pixels of 0.5 mm */
        for (size_t c = 0; c < 3; c++) {
            double blurred = (double)gaussian_mixtures[5].weight[0][c],
                   half = 0.5 + 0.5 / sqrt(2 * 3.14159265358979) / sigma;
            assert_true(fabs((double)s.filtered[c * s.n + edge] - (1 - blurred * (1 - half))) < 2e-3);
            assert_true(fabs((double)s.filtered[c * s.n + edge - 40] - 1) < 1e-5);
        }
        sss_scene_free(&s);
    }
}

/* Every material keeps its own light, whatever lies beside it: noisy borders, jumps in depth, nothing at all.
 */
static void materials_never_leak(void **state)
{
    (void)state;
    static const float light[SSS_MATERIALS] = {1e30f, 1, 1000, 1e30f, 1e-3f, 7};
    gaussian_material m[SSS_MATERIALS];
    memcpy(m, gaussian_mixtures, sizeof m);
    for (size_t id = 0; id < SSS_MATERIALS; id++)
        m[id].border = 0;
    for (int separable = 0; separable < 2; separable++) {
        sss_scene s = sss_scene_make(37, 11, 150, 61, 400);
        sss_scene_random(&s, 5);
        s.twin.area = true;
        SSS_EACH_PIXEL(&s, x, y, i)
        {
            for (size_t c = 0; c < 3; c++)
                s.diffuse[c * s.n + i] = light[s.stencil[i]];
        }
        gaussian_run_on(&s, separable, m, sizeof m, sss_session);
        SSS_EACH_PIXEL(&s, x, y, i)
        {
            for (size_t c = 0; c < 3 && m[s.stencil[i]].has_profile; c++)
                assert_true(fabsf(s.filtered[c * s.n + i] / light[s.stencil[i]] - 1) < 1e-5f);
        }
        sss_scene_free(&s);
    }
}

static void nothing_to_scatter(void **state)
{
    (void)state;
    for (int separable = 0; separable < 2; separable++) {
        sss_scene s = sss_scene_make(2, 2, 100, 30, 300);
        sss_scene_flat(&s, 3, 0.5f, 0);
        SSS_EACH_PIXEL(&s, x, y, i)
        {
            if (x < 50)
                s.stencil[i] = 0;
            s.lit[i] = (float)i;
        }
        gaussian_run(&s, separable);
        assert_memory_equal(s.color, s.lit, 3 * s.n * sizeof *s.lit);
        sss_scene_free(&s);
    }
}

/* The widest is 34.8 mm²: 3 sigma are 17.7 mm, and from where those are under half a pixel on, the light
 * stays. */
static void far_away_it_is_the_plain_surface(void **state)
{
    (void)state;
    for (int separable = 0; separable < 2; separable++) {
        sss_scene s = sss_scene_make(37, 11, 150, 61, 0.49f * 0.7f / 0.0177f);
        sss_scene_random(&s, 3);
        gaussian_run(&s, separable);
        SSS_EACH_PIXEL(&s, x, y, i)
        {
            double own[3], color[3];
            for (size_t c = 0; c < 3; c++)
                own[c] = (double)s.diffuse[c * s.n + i];
            twin_resolve(&s.twin, x, y, own, color);
            for (size_t c = 0; c < 3; c++)
                assert_true(fabs((double)s.color[c * s.n + i] - color[c]) <= 2e-6 * fmax(color[c], 1e-3));
        }
        sss_scene_free(&s);
    }
}

/* ---- the same bits ---- */

static void bits_do_not_depend_on_threads(void **state)
{
    (void)state;
    cl_session *one = cl_open(1);
    assert_non_null(one);
    for (int separable = 0; separable < 2; separable++) {
        sss_scene s = sss_scene_make(37, 11, 300, 161, 400);
        sss_scene_random(&s, 5);
        s.twin.area = true;
        size_t bytes = 3 * s.n * sizeof(float);
        float *first = sss_planes(3 * s.n);
        gaussian_run(&s, separable);
        memcpy(first, s.color, bytes);
        gaussian_run_on(&s, separable, gaussian_mixtures, sizeof gaussian_mixtures, one);
        assert_memory_equal(first, s.color, bytes);
        rl_free(first);
        sss_scene_free(&s);
    }
    cl_close(&one);
}

/* A pixel's bits depend on what is around it, not on where the data window starts. */
static void crop_gives_the_same_bits(void **state)
{
    (void)state;
    for (int separable = 0; separable < 2; separable++) {
        sss_scene whole = sss_scene_make(0, 0, 320, 96, 300), part = sss_scene_make(64, 8, 192, 72, 300);
        sss_scene_random(&whole, 12);
        whole.twin.area = part.twin.area = true;
        sss_scene_crop(&part, &whole);
        gaussian_run(&whole, separable);
        gaussian_run(&part, separable);
        sss_crop_is_same(&part, &whole, 64, 16);
        sss_scene_free(&whole);
        sss_scene_free(&part);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(unblurred_share),
        cmocka_unit_test(variance_is_kept),
        cmocka_unit_test(separable_equals_full),
        cmocka_unit_test(energy_is_kept),
        cmocka_unit_test(occlusion_is_black),
        cmocka_unit_test(materials_never_leak),
        cmocka_unit_test(nothing_to_scatter),
        cmocka_unit_test(far_away_it_is_the_plain_surface),
        cmocka_unit_test(bits_do_not_depend_on_threads),
        cmocka_unit_test(crop_gives_the_same_bits),
    };
    return cmocka_run_group_tests(tests, sss_open, sss_close);
}
