/* sss_gaussian against plain C in double. */
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

static void compare(sss_scene *s, int separable)
{
    double *filtered = rl_calloc(3 * s->n, sizeof *filtered);
    char *doubt = rl_calloc(s->n, 1);
    size_t doubts = 0, pixels = 0;
    assert_non_null(filtered);
    assert_non_null(doubt);
    assert_true(twin_gaussian(&s->twin, gaussian_mixtures, separable, filtered, doubt));
    gaussian_run(s, separable);
    SSS_EACH_PIXEL(s, x, y, i)
    {
        double light[3] = {filtered[i], filtered[s->n + i], filtered[2 * s->n + i]}, color[3];
        twin_resolve(&s->twin, x, y, light, color);
        pixels++;
        doubts += doubt[i] != 0;
        for (size_t c = 0; c < 3 && !doubt[i]; c++) {
            double got = (double)s->color[c * s->n + i];
            if (!(fabs(got - color[c]) <= 5e-5 * fmax(color[c], 0.01)))
                fail_msg("separable %d, pixel %d %d, channel %zu: %.9g, not %.9g", separable, x, y, c, got,
                         color[c]);
        }
    }
    assert_true(doubts <= pixels / 20);
    rl_free(filtered);
    rl_free(doubt);
}

/* Windows that start anywhere and have odd sizes; filters from a pixel to beyond the image. */
static void equals_twin(void **state)
{
    (void)state;
    static const struct {
        int x, y, width, height;
        float focal;
    } windows[] = {{37, 11, 150, 61, 300},
                   {-70, -5, 67, 33, 900},
                   {0, 0, 64, 4, 400},
                   {5, 2, 1, 1, 500},
                   {63, 3, 3, 45, 250}};
    for (size_t k = 0; k < sizeof windows / sizeof *windows; k++) {
        sss_scene s =
            sss_scene_make(windows[k].x, windows[k].y, windows[k].width, windows[k].height, windows[k].focal);
        s.twin.frame.camera.focal[1] *= 1.3f;
        s.twin.frame.camera.jitter[0] = 0.3f;
        sss_scene_random(&s, (uint32_t)k + 1);
        compare(&s, SEPARABLE);
        compare(&s, FULL);
        s.twin.area = true;
        compare(&s, SEPARABLE);
        compare(&s, FULL);
        sss_scene_free(&s);
    }
}

/* Narrower vectors are the same filter. */
static void equals_twin_at_any_width(void **state)
{
    (void)state;
    for (sss_width = 4; sss_width <= 8; sss_width *= 2) {
        sss_scene s = sss_scene_make(37, 11, 90, 31, 400);
        sss_scene_random(&s, 8);
        compare(&s, SEPARABLE);
        compare(&s, FULL);
        sss_scene_free(&s);
    }
    sss_width = 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(equals_twin),
        cmocka_unit_test(equals_twin_at_any_width),
    };
    return cmocka_run_group_tests(tests, sss_open, sss_close);
}
