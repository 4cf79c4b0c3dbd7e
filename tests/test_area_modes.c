/* Sphere and rectangle lights far off, across horizons, from behind, through slabs and under scattering. */
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

/* Everything a point light of the same intensity does, at a kilometre: rects face what is seen. */
static void far_lights_are_points(void **state)
{
    static float want[2][AREA_COLUMNS * AREA_ROWS];
    area_yard t;
    (void)state;
    area_make(&t);
    for (int type = LIGHT_SPHERE; type <= LIGHT_RECT; type++) {
        area_place(&t, type, 1000, 0.1, 0.2);
        area_aim(&t);
        light_t area = t.light;
        t.light.type = LIGHT_POINT;
        area_point p;
        const frame_t *f = &t.scene.frame;
        area_read(&t, f->valid[0], f->valid[1], &p);
        double from = 0, d2 = 0;
        for (int i = 0; i < 3; i++) {
            double to = (double)area.position[i] - p.p[i];
            d2 += to * to;
            from -= to * (double)area.direction[i];
        }
        double facing = type == LIGHT_RECT ? from / sqrt(d2) : 1, worst = 0;
        for (int kind = 0; kind < 2; kind++) {
            assert_true(shade_execute(&t.run));
            for (int port = 0; port < 2; port++)
                for (int i = 0; i < AREA_COLUMNS * AREA_ROWS; i++) {
                    int x = i % AREA_COLUMNS + f->valid[0], y = i / AREA_COLUMNS + f->valid[1];
                    double v = area_got(&t, LIGHTING_DIFFUSE + port, x, y);
                    if (!kind)
                        want[port][i] = (float)(v * facing);
                    else
                        worst =
                            fmax(worst, fabs(v - (double)want[port][i]) / fmax((double)want[port][i], 1e-9));
                }
            t.light = area;
        }
        print_message("at 1 km: largest relative difference from a point %.1g\n", worst);
        assert_true(worst < 1e-4);
    }
    shade_scene_free(&t.scene);
}

/* Many normals, most with the light across their horizon: nothing is brighter than the light can make it, and
 * what a polygon's edges leave open is nowhere closed wrongly. */
static void no_speckles(void **state)
{
    area_yard t;
    (void)state;
    area_make(&t);
    for (int round = 0; round < 60; round++) {
        const frame_t *f = &t.scene.frame;
        uint64_t seed = (uint64_t)round;
        area_place(&t, round & 1 ? LIGHT_SPHERE : LIGHT_RECT, 0.4 + 0.05 * round, 0.3, 0.2);
        for (int i = 0; i < AREA_COLUMNS * AREA_ROWS; i++) {
            double z = 2 * shade_random(&seed) - 1, turn = 6.3 * shade_random(&seed), r = sqrt(1 - z * z);
            area_set_normal(&t, i % AREA_COLUMNS + f->valid[0], i / AREA_COLUMNS + f->valid[1],
                            (double[]){r * cos(turn), r * sin(turn), z});
        }
        assert_true(shade_execute(&t.run));
        for (int i = 0; i < AREA_COLUMNS * AREA_ROWS; i++) {
            area_point p;
            int x = i % AREA_COLUMNS + f->valid[0], y = i / AREA_COLUMNS + f->valid[1];
            area_read(&t, x, y, &p);
            double e = area_got(&t, LIGHTING_DIFFUSE, x, y) * pi / (double)t.light.radiance;
            double r = area_got(&t, LIGHTING_LIT, x, y) / (double)t.light.radiance;
            area_sums s = area_integrate(&t.light, &p, 12);
            assert_true(fabs(e - s.lambert) < 0.02);
            assert_true(r >= 0 && r < (s.lambert > 0 ? 1.02 : 1e-3));
        }
    }
    shade_scene_free(&t.scene);
}

static void rects_shine_one_way(void **state)
{
    area_yard t;
    (void)state;
    area_make(&t);
    area_place(&t, LIGHT_RECT, 1, 0.4, 0.3);
    area_aim(&t);
    assert_true(shade_execute(&t.run));
    const frame_t *f = &t.scene.frame;
    double front[2] = {area_got(&t, LIGHTING_DIFFUSE, f->valid[0], f->valid[1]),
                       area_got(&t, LIGHTING_LIT, f->valid[0], f->valid[1])};
    assert_true(front[0] > 0 && front[1] > 0);
    for (int i = 0; i < 3; i++) {
        t.light.direction[i] = -t.light.direction[i];
        t.light.side[i] = -t.light.side[i];
    }
    for (int sides = 1; sides <= 2; sides++) {
        t.light.two_sided = sides == 2;
        assert_true(shade_execute(&t.run));
        for (int i = 0; i < 2; i++)
            assert_true(fabs(area_got(&t, LIGHTING_DIFFUSE + i, f->valid[0], f->valid[1]) -
                             (sides == 2 ? front[i] : 0)) <= 1e-6 * front[i]);
    }
    shade_scene_free(&t.scene);
}

/* What of the light on the back of 4 mm comes through, by mode; a shadow on the front lies on the back of
 * thin things alone. */
enum { THIN = 1, THICK, BEER_LAMBERT };
static const double front_visibility = 0.25;

static double comes_through(int mode)
{
    double slab = 0.25 * (exp(-4.0 / 3) + 3 * exp(-4.0 / 9));
    return mode == BEER_LAMBERT ? pow(0.3, 4.0 / 2.5) : mode == THIN ? slab * front_visibility : slab;
}

/* The largest difference from the integral over the light, of what all of the light would send. */
static double through_error(area_yard *t, int mode, int disney)
{
    const frame_t *f = &t->scene.frame;
    double worst = 0, through = comes_through(mode);
    area_aim(t);
    area_set(t, "profile", "transmission", mode);
    area_set(t, "shading", "diffuse", !disney);
    for (int i = 0; i < AREA_COLUMNS * AREA_ROWS; i += 3) {
        area_point p;
        int x = i % AREA_COLUMNS + f->valid[0], y = i / AREA_COLUMNS + f->valid[1];
        area_read(t, x, y, &p);
        area_set_normal(t, x, y, (double[]){-p.n[0], -p.n[1], -p.n[2]});
    }
    assert_true(shade_execute(&t->run));
    for (int i = 0; i < AREA_COLUMNS * AREA_ROWS; i++) {
        area_point p;
        int x = i % AREA_COLUMNS + f->valid[0], y = i / AREA_COLUMNS + f->valid[1];
        area_read(t, x, y, &p);
        area_sums s = area_integrate(&t->light, &p, 60);
        double want =
            front_visibility * (disney ? s.disney : s.lambert) + through * (disney ? s.back_disney : s.back);
        double got = area_got(t, LIGHTING_DIFFUSE, x, y) * pi / (double)t->light.radiance;
        worst = fmax(worst, fabs(got - want) / (s.lambert + s.back));
    }
    return worst;
}

/* Light on the back face through a slab of known thickness: the sums' other half. */
static void shines_through(void **state)
{
    area_yard t;
    (void)state;
    area_make(&t);
    area_set(&t, "profile", "thickness_from", 1);
    area_set(&t, "profile", "scatter_distance_mm", 3);
    area_set(&t, "profile", "transmittance_color", 0.3);
    area_set(&t, "profile", "transmittance_distance_mm", 2.5);
    area_set(&t, "shading", "transmission", 1);
    area_fill(&t, LIGHTING_THICKNESS, 0.004f);
    t.run.images[LIGHTING_SHADOW] = &t.scene.images[LIGHTING_SHADOW];
    area_fill(&t, LIGHTING_SHADOW, front_visibility);
    for (int mode = THIN; mode <= BEER_LAMBERT; mode++) {
        double worst[2] = {0, 0};
        for (int type = LIGHT_SPHERE; type <= LIGHT_RECT; type++)
            for (int disney = 0; disney < 2; disney++) {
                area_place(&t, type, 1, 0.4, 0.3);
                t.light.shadow = 0;
                worst[disney] = fmax(worst[disney], through_error(&t, mode, disney));
            }
        print_message("light from behind, mode %d: largest error %.1e, Disney %.1e\n", mode, worst[0],
                      worst[1]);
        assert_true(worst[0] < 1e-3);
        assert_true(worst[1] < 0.04);
    }
    shade_scene_free(&t.scene);
}

/* diffuse: sg: the sum of the Gaussian's irradiance over the light's directions. */
static double scattered(const light_t *light, const area_point *x, double lambda)
{
    enum { N = 40 };
    double sum = 0;
    area_point facing = *x;
    for (int i = 0; i < 3; i++)
        facing.n[i] = (double)light->position[i] - x->p[i];
    double d2 = area_dot(facing.n, facing.n), d = sqrt(d2), axis[3], a[3], b[3];
    memcpy(axis, facing.n, sizeof axis);
    area_normalize(axis);
    area_tangents(axis, a, b);
    for (int i = 0; i < N * N; i++) {
        double u = 2 * (i / N + 0.5) / N - 1, v = 2 * (i % N + 0.5) / N - 1, l[3], solid;
        if (light->type == LIGHT_RECT) {
            for (int k = 0; k < 3; k++)
                l[k] = facing.n[k] + u * (double)light->side[k] + v * (double)light->top[k];
            double l2 = area_dot(l, l), from = 0, area = 4 / (double)light->radiance / 4;
            for (int k = 0; k < 3; k++)
                from -= l[k] * (double)light->direction[k];
            solid = fmax(from, 0) / l2 / sqrt(l2) * area / N / N;
        } else {
            double share = 1 - sqrt(1 - (double)light->radius * (double)light->radius / d2),
                   z = 1 - share * (u + 1) / 2;
            for (int k = 0; k < 3; k++)
                l[k] = d * (z * axis[k] + sqrt(1 - z * z) * (cos(pi * v) * a[k] + sin(pi * v) * b[k]));
            solid = 2 * pi * share / N / N;
        }
        area_normalize(l);
        sum += solid * twin_sg_irradiance(lambda, area_dot(l, x->n));
    }
    return sum;
}

static void scatters_around(void **state)
{
    area_yard t;
    double worst = 0;
    (void)state;
    area_make(&t);
    t.run.images[LIGHTING_SMOOTH_NORMAL] = NULL;
    area_set(&t, "shading", "diffuse", 2);
    area_set(&t, "shading", "specular", 1);
    area_set(&t, "profile", "sg_variance_mm2", 30);
    area_fill(&t, LIGHTING_ALBEDO, 1);
    for (int type = LIGHT_SPHERE; type <= LIGHT_RECT; type++) {
        const frame_t *f = &t.scene.frame;
        area_place(&t, type, 0.6, 0.4, 0.3);
        area_aim(&t);
        for (int i = 0; i < AREA_COLUMNS * AREA_ROWS; i++) /* sharpness 0.1 to 1e4 */
            *shade_at(&t.scene.images[LIGHTING_CURVATURE], f, 0, i % AREA_COLUMNS + f->valid[0],
                      i / AREA_COLUMNS + f->valid[1]) =
                (float)(577 * pow(10, -2.5 * (i % AREA_COLUMNS) / (AREA_COLUMNS - 1)));
        assert_true(shade_execute(&t.run));
        for (int i = 0; i < AREA_COLUMNS * AREA_ROWS; i++) {
            area_point p;
            int x = i % AREA_COLUMNS + f->valid[0], y = i / AREA_COLUMNS + f->valid[1];
            area_read(&t, x, y, &p);
            double r = 1000 / (double)*shade_at(&t.scene.images[LIGHTING_CURVATURE], f, 0, x, y);
            double lambda = fmin(fmax(r * r / 30, 1e-3), 1e4), whole = 2 * pi;
            if (type == LIGHT_SPHERE)
                whole *= 1 - sqrt(1 - 0.16 / 0.36);
            else
                whole = 0.48 / 0.36;
            worst = fmax(worst, fabs(area_got(&t, LIGHTING_LIT, x, y) * pi / (double)t.light.radiance -
                                     scattered(&t.light, &p, lambda)) /
                                    whole);
        }
    }
    print_message("scattered: largest error %.3f of the light's solid angle\n", worst);
    assert_true(worst < 0.05);
    shade_scene_free(&t.scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(far_lights_are_points), cmocka_unit_test(no_speckles),
        cmocka_unit_test(rects_shine_one_way),   cmocka_unit_test(shines_through),
        cmocka_unit_test(scatters_around),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
