/* sss_burley and sss_reference against plain C in double, and against each other. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "tests/sss_scene.h"

/* Windows that start anywhere and have odd sizes; filters from a few pixels to beyond the image. */
static const struct {
    int x, y, width, height;
    float focal;
} windows[] = {{37, 11, 150, 61, 300},
               {-70, -5, 67, 33, 900},
               {0, 0, 64, 4, 100},
               {5, 2, 1, 1, 500},
               {63, 3, 3, 45, 250}};

static void burley_equals_twin(void **state)
{
    (void)state;
    for (int variant = 0; variant < 6; variant++)
        for (size_t k = 0; k < sizeof windows / sizeof *windows; k++) {
            static const int taps[] = {1, 21, 55, 130};
            sss_scene s = sss_scene_make(windows[k].x, windows[k].y, windows[k].width, windows[k].height,
                                         windows[k].focal);
            s.twin.frame.camera.focal[1] *= 1.3f;
            s.twin.frame.camera.jitter[0] = 0.3f;
            int weighting = variant % 3;
            s.twin.tangent = variant / 3;
            sss_scene_random(&s, (uint32_t)k + 1);
            for (size_t t = 0; t < 4; t++) {
                s.twin.rotation = (int)(t + k) % 4;
                s.twin.frame.number = (int)k * 37 - 40;
                sss_run_burley(&s, taps[t], weighting);
                double worst = sss_worst(&s, taps[t], weighting, 2);
                if (worst > 5e-5)
                    print_message("window %zu, %d taps, variant %d: %.2e\n", k, taps[t], variant, worst);
                assert_true(worst <= 5e-5);
            }
            sss_scene_free(&s);
        }
}

static void burley_equals_twin_4096(void **state)
{
    (void)state;
    sss_scene s = sss_scene_make(37, 11, 150, 61, 600);
    sss_scene_random(&s, 9);
    sss_run_burley(&s, 4096, PLAIN);
    assert_true(sss_worst(&s, 4096, PLAIN, 41) <= 1e-4);
    sss_scene_free(&s);
}

static void reference_equals_twin(void **state)
{
    (void)state;
    double most = 0;
    for (int variant = 0; variant < 6; variant++)
        for (size_t k = 0; k < sizeof windows / sizeof *windows; k++) {
            sss_scene s = sss_scene_make(windows[k].x, windows[k].y, windows[k].width, windows[k].height,
                                         windows[k].focal);
            s.twin.frame.camera.focal[1] *= 1.3f;
            int weighting = variant % 3;
            s.twin.tangent = variant / 3;
            sss_scene_random(&s, (uint32_t)k + 31);
            sss_run_reference(&s, weighting);
            double worst = sss_worst(&s, 0, weighting, 13);
            if (worst > 2e-5)
                print_message("reference, window %zu, variant %d: %.2e\n", k, variant, worst);
            assert_true(worst <= 1e-4);
            most = worst > most ? worst : most;
            sss_scene_free(&s);
        }
    print_message("sss_reference against a sum in double: %.2e\n", most);
}

/* From pixels much larger than d to much smaller: the numerical integral near the centre holds. */
static void reference_equals_twin_at_any_size(void **state)
{
    (void)state;
    for (float focal = 1; focal < 2000; focal *= 4) {
        sss_scene s = sss_scene_make(0, 0, 40, 24, focal);
        sss_scene_random(&s, 77);
        sss_run_reference(&s, PLAIN);
        assert_true(sss_worst(&s, 0, PLAIN, 3) <= 1e-4);
        sss_scene_free(&s);
    }
}

static double median_of(double *v, size_t n, double share)
{
    for (size_t i = 1; i < n; i++) /* few hundred values */
        for (size_t j = i; j > 0 && v[j - 1] > v[j]; j--) {
            double t = v[j];
            v[j] = v[j - 1];
            v[j - 1] = t;
        }
    return v[(size_t)(share * (double)(n - 1))];
}

/* With many taps the estimate tends to the dense sum. Smooth light with an edge, on a wavy surface. */
static void burley_tends_to_reference(void **state)
{
    (void)state;
    for (int variant = 0; variant < 6; variant++) {
        sss_scene s = sss_scene_make(10, 6, 128, 72, 500);
        int weighting = variant % 3;
        s.twin.tangent = variant / 3;
        double differences[3 * 18 * 10];
        size_t n = 0;
        sss_scene_flat(&s, 1, 0.7f, 1);
        SSS_EACH_PIXEL(&s, x, y, i)
        {
            s.depth[i] += 0.01f * sinf(0.1f * (float)x) * cosf(0.13f * (float)y);
            for (size_t c = 0; c < 3; c++)
                s.diffuse[c * s.n + i] = (x > 60 ? 1.0f : 0.2f) + 0.2f * sinf(0.2f * (float)y);
        }
        sss_run_reference(&s, weighting);
        float *reference = sss_planes(3 * s.n);
        memcpy(reference, s.color, 3 * s.n * sizeof *reference);
        sss_run_burley(&s, 1024, weighting);
        SSS_EACH_PIXEL(&s, x, y, i)
        {
            for (size_t c = 0; c < 3 && x % 7 == 0 && y % 7 == 0 && n < 540; c++)
                differences[n++] =
                    fabs(s.color[c * s.n + i] - reference[c * s.n + i]) / reference[c * s.n + i];
        }
        assert_true(n > 500);
        assert_true(median_of(differences, n, 0.5) <= 0.003);
        assert_true(median_of(differences, n, 0.95) <= 0.015);
        rl_free(reference);
        sss_scene_free(&s);
    }
}

/* Narrower vectors, for devices that want them. Of a flat surface: groups of lanes are others there. */
static void width_does_not_matter(void **state)
{
    (void)state;
    sss_scene s = sss_scene_make(37, 11, 150, 61, 400);
    sss_scene_flat(&s, 1, 0.4f, 1);
    uint32_t seed = 4;
    for (size_t i = 0; i < 3 * s.n; i++)
        s.diffuse[i] = sss_random(&seed);
    float *want = sss_planes(6 * s.n);
    for (sss_width = 16; sss_width >= 4; sss_width /= 2) {
        sss_run_burley(&s, 21, AREA);
        for (size_t i = 0; i < 3 * s.n; i++)
            assert_true(sss_width == 16 || fabsf(s.color[i] - want[i]) < 1e-5f);
        memcpy(want, s.color, 3 * s.n * sizeof *want);
        sss_run_reference(&s, AREA);
        for (size_t i = 0; i < 3 * s.n; i++)
            assert_true(sss_width == 16 || fabsf(s.color[i] - want[3 * s.n + i]) < 1e-5f);
        memcpy(want + 3 * s.n, s.color, 3 * s.n * sizeof *want);
    }
    sss_width = 0;
    rl_free(want);
    sss_scene_free(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(burley_equals_twin),        cmocka_unit_test(burley_equals_twin_4096),
        cmocka_unit_test(reference_equals_twin),     cmocka_unit_test(reference_equals_twin_at_any_size),
        cmocka_unit_test(burley_tends_to_reference), cmocka_unit_test(width_does_not_matter),
    };
    return cmocka_run_group_tests(tests, sss_open, sss_close);
}
