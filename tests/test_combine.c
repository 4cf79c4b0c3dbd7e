/* The combine kernel against its twin, and lighting + combine against the BRDF without scattering. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <stdio.h>
#include <cmocka.h>

#include "tests/shade_scene.h"

static double color_at(const shade_scene *s, int c, int x, int y)
{
    return *shade_at(&s->color, &s->frame, c, x, y);
}

static void agrees_with_twin(void **state)
{
    static const int sizes[][4] = {{131, 37, 5, 3}, {1, 1, -70, -3}, {257, 19, 63, -1}};
    (void)state;
    for (size_t i = 0; i < 3; i++) {
        shade_scene s;
        assert_true(shade_scene_make(&s, sizes[i][0], sizes[i][1], sizes[i][2], sizes[i][3], i + 20));
        shade_run light = shade_scene_lighting(&s), run = shade_scene_combine(&s);
        run.lanes = i == 1 ? 4 : i == 2 ? 8 : 16;
        assert_true(shade_execute(&light));
        assert_true(shade_execute(&run));
        const frame_t *f = &s.frame;
        double worst = 0;
        for (int y = 0; y < f->rows; y++) {
            for (int x = 0; x < f->columns; x++) {
                double want[3], diffuse[3], lit[3];
                for (int c = 0; c < 3; c++) {
                    diffuse[c] = *shade_at(&s.images[LIGHTING_DIFFUSE], f, c, x, y);
                    lit[c] = *shade_at(&s.images[LIGHTING_LIT], f, c, x, y);
                }
                twin_combine(&run, x, y, diffuse, lit, want);
                for (int c = 0; c < 3; c++)
                    worst = fmax(worst, fabs(color_at(&s, c, x, y) - want[c]) / fmax(want[c], 1e-4));
            }
        }
        print_message("%dx%d: largest relative error %.2g\n", sizes[i][0], sizes[i][1], worst);
        assert_true(worst < 2e-6);
        shade_scene_free(&s);
    }
}

/* entry * exit * F_in * F_out is the BRDF, whichever way they are dealt out: a material with a profile, not
 * filtered, looks as the same material without one (DESIGN 4.1). */
static void profile_without_filter_is_the_brdf(void **state)
{
    shade_scene s;
    (void)state;
    assert_true(shade_scene_make(&s, 67, 21, 3, 1, 5));
    const frame_t *f = &s.frame;
    size_t plain = shade_material_add(&s.materials, false), scatters = shade_material_add(&s.materials, true);
    s.frame.materials = (int)s.materials.n;
    shade_run light = shade_scene_lighting(&s), run = shade_scene_combine(&s);
    for (int mode = 0; mode < 8; mode++) {
        for (size_t id = plain; id <= scatters; id++) {
            shade_material_set(&s.materials, id, "profile", "texturing", (double[]){mode & 1});
            shade_material_set(&s.materials, id, "shading", "diffuse", (double[]){mode >> 1 & 1});
            shade_material_set(&s.materials, id, "shading", "exit_transmission", (double[]){mode >> 2});
        }
        double worst = 0, *want = calloc((size_t)f->plane * 3, sizeof *want);
        assert_non_null(want);
        for (size_t id = plain; id <= scatters; id++) {
            for (int y = f->valid[1]; y < f->valid[3]; y++)
                for (int x = f->valid[0]; x < f->valid[2]; x++)
                    shade_set_id(&s.images[LIGHTING_STENCIL], f, x, y, (uint32_t)id);
            assert_true(shade_execute(&light));
            assert_true(shade_execute(&run));
            for (int i = 0; i < 3 * f->plane; i++) {
                double got = s.color.data[i];
                if (id == plain)
                    want[i] = got;
                else
                    worst = fmax(worst, fabs(got - want[i]) / fmax(want[i], 1e-4));
            }
        }
        free(want);
        assert_true(worst < 1e-6);
    }
    shade_scene_free(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(agrees_with_twin),
        cmocka_unit_test(profile_without_filter_is_the_brdf),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
