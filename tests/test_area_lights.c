/* Sphere and rectangle lights in the lighting pass against sums over the light in double. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>

#include "tests/area_scene.h"

static const double pi = 3.14159265358979323846;

typedef struct errors {
    double lambert, disney, specular, mean;
} errors;

/* Largest errors: diffuse over the light's irradiance on a surface that faces its middle, specular over the
 * brightest reflection of that roughness. */
static errors compare(area_yard *t, bool disney)
{
    const frame_t *f = &t->scene.frame;
    errors w = {0};
    area_set(t, "shading", "diffuse", disney ? 0 : 1);
    assert_true(shade_execute(&t->run));
    double unit = (double)t->light.radiance;
    for (int x = f->valid[0]; x < f->valid[2]; x++) {
        double peak = 0, error[AREA_ROWS];
        for (int y = f->valid[1]; y < f->valid[3]; y++) {
            area_point p;
            area_read(t, x, y, &p);
            area_sums s = area_integrate(&t->light, &p,
                                         p.roughness < 0.15   ? 400
                                         : p.roughness < 0.35 ? 200
                                                              : 80);
            area_point facing = p;
            for (int i = 0; i < 3; i++)
                facing.n[i] = (double)t->light.position[i] - p.p[i];
            area_normalize(facing.n);
            double full = area_integrate(&t->light, &facing, 50).lambert;
            double e = area_got(t, LIGHTING_DIFFUSE, x, y) * pi / unit,
                   r = area_got(t, LIGHTING_LIT, x, y) / unit;
            w.lambert = fmax(w.lambert, disney ? 0 : fabs(e - s.lambert) / full);
            w.disney = fmax(w.disney, disney ? fabs(e - s.disney) / full : 0);
            peak = fmax(peak, s.specular);
            error[y - f->valid[1]] = fabs(r - s.specular);
        }
        for (int y = 0; y < AREA_ROWS; y++) {
            w.specular = fmax(w.specular, error[y] / peak);
            w.mean += error[y] / peak / (AREA_ROWS * AREA_COLUMNS);
        }
    }
    return w;
}

/* Bars: what is measured, rounded up. A rect of 80 x 60 cm at 10 cm is as near as this goes; the sum has
 * errors there too. */
static void agrees_with_sums(void **state)
{
    static const struct {
        int type;
        double distance, a, b;
        int two_sided;
        errors most;
    } forms[] = {
        {LIGHT_RECT, 0.5, 0.4, 0.3, 0, {1e-4, 0.01, 0.05, 0.006}},
        {LIGHT_RECT, 1, 0.4, 0.3, 1, {1e-4, 0.005, 0.05, 0.008}},
        {LIGHT_RECT, 3, 0.4, 0.02, 0, {1e-4, 0.001, 0.06, 0.01}},
        {LIGHT_RECT, 0.1, 0.4, 0.3, 1, {5e-4, 0.09, 0.12, 0.009}},
        {LIGHT_RECT, 10, 0.2, 0.2, 0, {1e-4, 1e-4, 0.004, 5e-4}},
        {LIGHT_SPHERE, 0.5, 0.3, 0, 0, {1e-4, 0.008, 0.06, 0.008}},
        {LIGHT_SPHERE, 1, 0.1, 0, 0, {1e-4, 2e-4, 0.07, 0.01}},
        {LIGHT_SPHERE, 0.4, 0.25, 0, 0, {1e-4, 0.01, 0.06, 0.008}},
        {LIGHT_SPHERE, 5, 0.1, 0, 0, {1e-4, 1e-4, 0.004, 5e-4}},
    };
    area_yard t;
    (void)state;
    area_make(&t);
    for (size_t i = 0; i < sizeof forms / sizeof *forms; i++) {
        const errors *most = &forms[i].most;
        area_place(&t, forms[i].type, forms[i].distance, forms[i].a, forms[i].b);
        t.light.two_sided = forms[i].two_sided;
        area_aim(&t);
        errors w = compare(&t, false), d = compare(&t, true);
        print_message("%s %g at %g m: Lambert %.1e, Disney %.1e, specular %.3f, mean %.4f\n",
                      forms[i].type == LIGHT_RECT ? "rect  " : "sphere", forms[i].a, forms[i].distance,
                      w.lambert, d.disney, w.specular, w.mean);
        assert_true(w.lambert < most->lambert);
        assert_true(d.disney < most->disney);
        assert_true(w.specular < most->specular);
        assert_true(w.mean < most->mean);
    }
    shade_scene_free(&t.scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(agrees_with_sums),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
