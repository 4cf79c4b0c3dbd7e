/* The translucency pass against plain C on random scenes; the same bits from run to run. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "tests/back_scene.h"

static bool gathers(uint32_t id)
{
    const back_material *m = &back_materials[id];
    return m->has_profile && m->transmits && m->transmission == BACK_GATHER;
}

/* Windows that start anywhere and have odd sizes. */
static const struct {
    int x, y, width, height;
    float focal;
} windows[] = {{37, 11, 150, 61, 300},
               {-70, -5, 67, 33, 900},
               {0, 0, 64, 4, 60},
               {5, 2, 1, 1, 500},
               {63, 3, 3, 45, 250}};

/* The worst difference of light and picture, of a pixel in `step`. */
static double worst_of(const back_scene *s, back_params p, int step)
{
    double worst = 0;
    int count = 0;
    BACK_EACH_PIXEL(s, x, y, i)
    {
        double through[3] = {0}, out[3];
        if (count++ % step)
            continue;
        if (gathers(s->stencil[i]))
            back_twin(s, x, y, p, through);
        back_resolve(s, x, y, through, out);
        for (size_t c = 0; c < 3; c++) {
            double got = s->out[c * s->n + i], light = s->through[c * s->n + i];
            assert_true(isfinite(got));
            assert_true(light == 0 || gathers(s->stencil[i]));
            worst = fmax(worst, fabs(light - through[c]) / fmax(through[c], 1e-3));
            worst = fmax(worst, fabs(got - out[c]) / fmax(out[c], 1e-2));
        }
    }
    return worst;
}

static void kernel_equals_twin(void **state)
{
    static const int taps[] = {3, 32, 100};
    double most = 0;
    (void)state;
    for (size_t k = 0; k < sizeof windows / sizeof *windows; k++)
        for (int t = 0; t < 3; t++) {
            back_scene s = back_scene_make(windows[k].x, windows[k].y, windows[k].width, windows[k].height,
                                           windows[k].focal);
            back_params p = {taps[t], ((int)k + t) % 2 ? 3 : 0, 7};
            s.frame.camera.focal[1] *= 1.3f;
            s.frame.camera.jitter[0] = 0.3f;
            s.frame.number = (int)k * 37 - 40;
            back_scene_random(&s, (uint32_t)k + 1);
            back_scene_run(&s, p);
            most = fmax(most, worst_of(&s, p, t == 2 ? 3 : 1));
            back_scene_free(&s);
        }
    print_message("random scenes: largest relative difference to plain C %.1e\n", most);
    assert_true(most < 5e-5);
}

/* Patterns change with the frame and not from run to run; vectors of any width give the same. */
static void runs_are_repeatable(void **state)
{
    (void)state;
    back_scene s = back_scene_make(3, 1, 100, 40, 400);
    back_scene_random(&s, 5);
    float *first = rl_calloc(3 * s.n, sizeof *first);
    assert_non_null(first);
    s.frame.number = 0;
    back_scene_run(&s, (back_params){32, 3, 1});
    memcpy(first, s.through, 3 * s.n * sizeof *first);
    for (int k = 0; k < 4; k++) {
        s.frame.number = k == 1;
        back_scene_run(&s, (back_params){32, 3, k == 2 ? 2 : 1});
        bool same = !memcmp(first, s.through, 3 * s.n * sizeof *first);
        assert_true(same == (k == 0 || k == 3));
    }
    rl_free(first);
    back_scene_free(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(kernel_equals_twin),
        cmocka_unit_test(runs_are_repeatable),
    };
    return cmocka_run_group_tests(tests, back_open, back_close);
}
