/* The curvature kernel against its twin in double, and against surfaces whose curvature is known. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <cmocka.h>

#include "tests/twin_curvature.h"

/* Normals within 60 degrees of one another, so that a good part of the neighbours counts. */
static void tame_normals(bend_scene *t, uint64_t seed)
{
    const frame_t *f = &t->run.frame;
    for (int y = f->valid[1]; y < f->valid[3]; y++) {
        for (int x = f->valid[0]; x < f->valid[2]; x++) {
            double n[3] = {0.3 + shade_random(&seed), shade_random(&seed) - 0.5, 0.7};
            bend_normalize(n);
            for (int i = 0; i < 3; i++)
                *shade_at(t->run.images[NORMAL], f, i, x, y) = (float)n[i];
        }
    }
}

static void agrees_with_twin(void **state)
{
    static const int sizes[][4] = {{131, 37, 5, 3}, {1, 1, -70, -3}, {128, 16, 64, 0}, {40, 50, 63, -1}};
    static const float radii[] = {9, 3, 0.001f, 30};
    (void)state;
    for (size_t i = 0; i < 4; i++) {
        bend_scene t;
        double worst = 0, worst_normal = 0;
        int skipped = 0, seen = 0, bent = 0;
        bend_make(&t, sizes[i][0], sizes[i][1], sizes[i][2], sizes[i][3], i + 70);
        const frame_t *f = &t.run.frame;
        if (i % 2 == 0)
            tame_normals(&t, i);
        t.radius_mm = radii[i];
        assert_true(shade_execute(&t.run));
        for (int y = 0; y < f->rows; y++) {
            for (int x = 0; x < f->columns; x++) {
                double want = 0, smooth[3] = {0, 0, 0}, spread = 1, got = bend_get(&t, CURVATURE, 0, x, y);
                if (bend_id(&t, x, y) && !twin_bend(&t, x, y, &want, smooth, &spread)) {
                    skipped++;
                    continue;
                }
                seen += bend_id(&t, x, y) != 0;
                bent += want != 0;
                /* rounding of pp is divided by the spread, or by the ridge */
                worst =
                    fmax(worst, fabs(got - want) / fmax(fabs(want), 10) * fmin(spread + 1e-5, 1e-2) * 100);
                for (int c = 0; c < 3; c++)
                    worst_normal = fmax(worst_normal, fabs(bend_get(&t, SMOOTH, c, x, y) - smooth[c]));
            }
        }
        print_message("%dx%d, %d of %d bent: largest relative error (well spread) %.2g, of the normal %.2g "
                      "(%d pixels left out)\n",
                      sizes[i][0], sizes[i][1], bent, seen, worst, worst_normal, skipped);
        assert_true(worst < 1e-4);
        assert_true(worst_normal < 1e-5);
        assert_true(skipped * 50 <= seen + 50);
        bend_free(&t);
    }
}

/* ---- known surfaces ---------------------------------------------------------------------------------------
 */

/* A ball, or with an axis a cylinder, around `centre` (relative to the eye). */
typedef struct shape {
    double centre[3], axis[3], radius;
    bool hollow; /* the far side, seen from within or through the front: normals point to the centre */
} shape;

static double depth_of(const shape *s, const double *ray)
{
    double r[3], c[3], along_r = bend_dot(ray, s->axis), along_c = bend_dot(s->centre, s->axis);
    for (int i = 0; i < 3; i++) {
        r[i] = ray[i] - along_r * s->axis[i];
        c[i] = s->centre[i] - along_c * s->axis[i];
    }
    double a = bend_dot(r, r), b = bend_dot(r, c),
           root = b * b - a * (bend_dot(c, c) - s->radius * s->radius);
    return root <= 0 ? 0 : s->hollow ? (b + sqrt(root)) / a : (b - sqrt(root)) / a;
}

static void normal_of(const shape *s, const double *p, double *n)
{
    double along = bend_dot(p, s->axis) - bend_dot(s->centre, s->axis);
    for (int i = 0; i < 3; i++)
        n[i] = (p[i] - s->centre[i] - along * s->axis[i]) * (s->hollow ? -1 : 1);
    bend_normalize(n);
}

/* Draws a shape over what is there, if nearer; `bits` > 0 rounds normals to so many bits, as half files do
 * with 11. */
static void draw(bend_scene *t, const shape *s, uint32_t id, int bits)
{
    const frame_t *f = &t->run.frame;
    for (int y = f->valid[1]; y < f->valid[3]; y++) {
        for (int x = f->valid[0]; x < f->valid[2]; x++) {
            double view[3], ray[3], n[3], there = bend_id(t, x, y) ? bend_get(t, DEPTH, 0, x, y) : 1e30;
            twin_ray(f, &f->camera, x, y, view, ray);
            double z = depth_of(s, ray);
            if (z <= 0 || z >= there)
                continue;
            for (int i = 0; i < 3; i++)
                ray[i] *= z;
            normal_of(s, ray, n);
            for (int i = 0; i < 3; i++) {
                int exponent;
                double m = frexp(n[i], &exponent);
                n[i] = bits ? ldexp(round(ldexp(m, bits)), exponent - bits) : n[i];
                *shade_at(t->run.images[NORMAL], f, i, x, y) = (float)n[i];
            }
            *shade_at(t->run.images[DEPTH], f, 0, x, y) = (float)z;
            shade_set_id(t->run.images[STENCIL], f, x, y, id);
        }
    }
}

static void clear(bend_scene *t)
{
    const frame_t *f = &t->run.frame;
    for (int y = 0; y < f->rows; y++)
        for (int x = 0; x < f->columns; x++)
            shade_set_id(t->run.images[STENCIL], f, x, y, 0);
}

/* A point `z` metres away along the ray of a pixel. */
static void through_pixel(const bend_scene *t, double x, double y, double z, double *p)
{
    double view[3];
    twin_ray(&t->run.frame, &t->run.frame.camera, x, y, view, p);
    for (int i = 0; i < 3; i++)
        p[i] *= z;
}

static double seen_angle(const bend_scene *t, int x, int y)
{
    double n[3], p[3];
    bend_normal(t, x, y, n);
    bend_position(t, x, y, p);
    return -bend_dot(n, p) / sqrt(bend_dot(p, p));
}

/* Largest relative error of the curvature over the pixels of `id` that face the camera by at least `facing`.
 */
static double error_of(const bend_scene *t, uint32_t id, double want, double facing, int *seen)
{
    const frame_t *f = &t->run.frame;
    double worst = 0;
    *seen = 0;
    for (int y = f->valid[1]; y < f->valid[3]; y++) {
        for (int x = f->valid[0]; x < f->valid[2]; x++) {
            double got = bend_get(t, CURVATURE, 0, x, y);
            if (!bend_id(t, x, y))
                assert_true(got == 0);
            if (bend_id(t, x, y) != id || seen_angle(t, x, y) < facing)
                continue;
            assert_true(isfinite(got));
            worst = fmax(worst, fabs(got - want) / fmax(fabs(want), 1e-9));
            (*seen)++;
        }
    }
    return worst;
}

static void balls_and_cylinders_have_theirs(void **state)
{
    static const double radii[] = {0.004, 0.02, 0.15};
    bend_scene t;
    int seen;
    (void)state;
    bend_make(&t, 200, 120, 0, 0, 3);
    for (int kind = 0; kind < 6; kind++) {
        for (int i = 0; i < 3; i++) {
            shape s = {.radius = radii[i], .hollow = kind & 1};
            double scale = kind / 2 ? 0.5 : 1, want = (s.hollow ? -1 : 1) * scale / s.radius;
            if (kind / 2 == 1)
                s.axis[1] = 1;
            if (kind / 2 == 2)
                s.axis[0] = 0.6, s.axis[2] = 0.8;
            through_pixel(&t, 100, 60, radii[i] * 10, s.centre);
            clear(&t);
            draw(&t, &s, 2, 0);
            t.radius_mm = (float)(1000 * radii[i] / 4);
            assert_true(shade_execute(&t.run));
            double worst = error_of(&t, 2, want, 0.05, &seen);
            print_message("%s %s of radius %g m: largest error %.1g over %d pixels\n",
                          s.hollow ? "hollow" : "full", kind / 2 ? "cylinder" : "ball", radii[i], worst,
                          seen);
            assert_true(seen > 300);
            assert_true(worst < 5e-3); /* the ridge's weight, on cylinders seen along their axis */
        }
    }
    bend_free(&t);
}

/* One pixel wide: only the curvature along the strip can be known, and that is a ball's everywhere. */
static void a_strip_has_what_it_can_show(void **state)
{
    bend_scene t;
    int seen;
    shape s = {.radius = 0.02};
    (void)state;
    bend_make(&t, 200, 120, 0, 0, 3);
    through_pixel(&t, 100, 60, 0.2, s.centre);
    clear(&t);
    draw(&t, &s, 2, 0);
    for (int y = 0; y < 120; y++)
        for (int x = 0; x < 200; x++)
            if (y != 60)
                shade_set_id(t.run.images[STENCIL], &t.run.frame, x, y, 0);
    t.radius_mm = 2;
    assert_true(shade_execute(&t.run));
    assert_true(error_of(&t, 2, 50, 0.05, &seen) < 2e-3);
    assert_true(seen > 20);
    bend_free(&t);
}

static void planes_have_none(void **state)
{
    bend_scene t;
    int seen;
    shape far = {.radius = 1e7}; /* as flat as float can tell */
    (void)state;
    bend_make(&t, 200, 120, 0, 0, 3);
    through_pixel(&t, 100, 60, 1e7 + 0.5, far.centre);
    far.centre[0] += 2e6;
    far.centre[1] -= 3e6;
    far.radius = sqrt(bend_dot(far.centre, far.centre)) - 0.5;
    clear(&t);
    draw(&t, &far, 1, 0);
    assert_true(shade_execute(&t.run));
    double worst = error_of(&t, 1, 0, 0, &seen) * 1e-9;
    print_message("plane: largest curvature %.1g 1/m\n", worst);
    assert_int_equal(seen, 200 * 120);
    assert_true(worst < 0.01);
    bend_free(&t);
}

/* In front of a large ball floats a small one, of the same material or of another: neither sees the other's.
 */
static void borders_do_not_leak(void **state)
{
    (void)state;
    for (uint32_t other = 2; other <= 3; other++) {
        bend_scene t;
        int seen[2];
        shape large = {.radius = 0.2}, small = {.radius = 0.02};
        bend_make(&t, 200, 120, 0, 0, 3);
        through_pixel(&t, 100, 60, 0.9, large.centre);
        through_pixel(&t, 110, 55, 0.55, small.centre);
        clear(&t);
        draw(&t, &large, 2, 0);
        draw(&t, &small, other, 0);
        t.radius_mm = 6;
        assert_true(shade_execute(&t.run));
        /* With one material the two are told apart by curvature itself; the margin keeps them apart for the
         * test. */
        const frame_t *f = &t.run.frame;
        double worst = 0;
        seen[0] = seen[1] = 0;
        for (int y = f->valid[1]; y < f->valid[3]; y++) {
            for (int x = f->valid[0]; x < f->valid[2]; x++) {
                if (!bend_id(&t, x, y) || seen_angle(&t, x, y) < 0.15)
                    continue;
                double p[3], from[3];
                bend_position(&t, x, y, p);
                for (int i = 0; i < 3; i++)
                    from[i] = p[i] - small.centre[i];
                int is_small = fabs(sqrt(bend_dot(from, from)) - small.radius) < 1e-4;
                double want = is_small ? 50 : 5;
                worst = fmax(worst, fabs(bend_get(&t, CURVATURE, 0, x, y) / want - 1));
                seen[is_small]++;
            }
        }
        print_message("a ball before another, %s: largest error %.1g over %d and %d pixels\n",
                      other == 2 ? "one material" : "two materials", worst, seen[0], seen[1]);
        assert_true(seen[0] > 1000 && seen[1] > 300);
        assert_true(worst < 2e-3);
        bend_free(&t);
    }
}

/* Normals from a half file have 11 bits: what that does to the curvature, and how the window helps. */
static void half_normals_cost_little(void **state)
{
    bend_scene t;
    int seen;
    shape s = {.radius = 0.1};
    (void)state;
    bend_make(&t, 200, 120, 0, 0, 3);
    through_pixel(&t, 100, 60, 0.3, s.centre);
    clear(&t);
    draw(&t, &s, 2, 11);
    for (int i = 0; i < 2; i++) {
        t.radius_mm = i ? 3 : 0.1f;
        assert_true(shade_execute(&t.run));
        double worst = error_of(&t, 2, 10, 0.3, &seen);
        print_message("half normals, window %g mm: largest error %.2g over %d pixels\n", (double)t.radius_mm,
                      worst, seen);
        if (i)
            assert_true(worst < 0.03);
    }
    bend_free(&t);
}

/* Bumps as small as the window go, the ball's own normal stays. */
static void smooth_normal_loses_bumps(void **state)
{
    bend_scene t;
    uint64_t seed = 5;
    double before = 0, after = 0;
    int seen = 0;
    shape s = {.radius = 0.1};
    (void)state;
    bend_make(&t, 200, 120, 0, 0, 3);
    const frame_t *f = &t.run.frame;
    through_pixel(&t, 100, 60, 0.3, s.centre);
    clear(&t);
    draw(&t, &s, 2, 0);
    for (int y = 0; y < 120; y++) {
        for (int x = 0; x < 200; x++) {
            double n[3];
            bend_normal(&t, x, y, n);
            for (int i = 0; i < 3; i++)
                n[i] += 0.2 * (shade_random(&seed) - 0.5);
            bend_normalize(n);
            for (int i = 0; i < 3; i++)
                *shade_at(t.run.images[NORMAL], f, i, x, y) = (float)n[i];
        }
    }
    assert_true(shade_execute(&t.run));
    for (int y = 0; y < 120; y++) {
        for (int x = 0; x < 200; x++) {
            double p[3], n[3], view[3], ray[3];
            twin_ray(f, &f->camera, x, y, view, ray);
            if (!bend_id(&t, x, y))
                continue;
            bend_position(&t, x, y, p);
            normal_of(&s, p, n);
            if (-bend_dot(n, p) / sqrt(bend_dot(p, p)) < 0.5)
                continue;
            for (int i = 0; i < 3; i++) {
                before += pow(bend_get(&t, NORMAL, i, x, y) - n[i], 2);
                after += pow(bend_get(&t, SMOOTH, i, x, y) - n[i], 2);
            }
            seen++;
        }
    }
    print_message("bumps: %.3f before, %.3f after (rms)\n", sqrt(before / seen), sqrt(after / seen));
    assert_true(seen > 1000);
    assert_true(after < before / 10); /* 17 normals: 1/17 */
    bend_free(&t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(agrees_with_twin),
        cmocka_unit_test(balls_and_cylinders_have_theirs),
        cmocka_unit_test(a_strip_has_what_it_can_show),
        cmocka_unit_test(planes_have_none),
        cmocka_unit_test(borders_do_not_leak),
        cmocka_unit_test(half_normals_cost_little),
        cmocka_unit_test(smooth_normal_loses_bumps),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
