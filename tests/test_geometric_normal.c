/* Normals from depth: against a twin in double on random depth, and against planes and spheres whose normal
 * is known. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <cmocka.h>

#include "tests/shade_scene.h"

extern const rl_pass rl_pass_geometric_normal;

enum { DEPTH, STENCIL, NORMAL };

static double dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void normalize(double *v)
{
    double length = sqrt(dot(v, v));
    for (int i = 0; i < 3; i++)
        v[i] /= length;
}

static shade_run normal_run(const shade_scene *s)
{
    shade_run run = {.pass = &rl_pass_geometric_normal, .frame = s->frame, .materials = &s->materials};
    run.images[DEPTH] = &s->images[LIGHTING_DEPTH];
    run.images[STENCIL] = &s->images[LIGHTING_STENCIL];
    run.images[NORMAL] = &s->color;
    return run;
}

/* ---- the twin
 * ------------------------------------------------------------------------------------------------ */

/* World position of a pixel's sample, of depth z. */
static void position(const frame_t *f, int x, int y, double z, double *p)
{
    double view[3];
    twin_ray(f, &f->camera, x, y, view, p);
    for (int i = 0; i < 3; i++)
        p[i] *= z;
}

/* Tangent on one axis, towards growing x or y. */
static void tangent(const shade_run *run, int x, int y, int ax, int ay, double *out)
{
    const frame_t *f = &run->frame;
    double z = *shade_at(run->images[DEPTH], f, 0, x, y), best = INFINITY, from[3], to[3];
    position(f, x, y, z, from);
    position(f, x + ax, y + ay, z, to);
    for (int i = 0; i < 3; i++)
        out[i] = to[i] - from[i];
    for (int sign = 1; sign >= -1; sign -= 2) {
        int nx = x + sign * ax, ny = y + sign * ay;
        if (nx < f->valid[0] || ny < f->valid[1] || nx >= f->valid[2] || ny >= f->valid[3] ||
            shade_id(run->images[STENCIL], f, nx, ny) != shade_id(run->images[STENCIL], f, x, y))
            continue;
        double there = *shade_at(run->images[DEPTH], f, 0, nx, ny), change = fabs(1 / there - 1 / z);
        if (change >= best)
            continue;
        best = change;
        position(f, nx, ny, there, to);
        for (int i = 0; i < 3; i++)
            out[i] = sign * (to[i] - from[i]);
    }
}

static void twin_normal(const shade_run *run, int x, int y, double *n)
{
    double right[3], down[3];
    tangent(run, x, y, 1, 0, right);
    tangent(run, x, y, 0, 1, down);
    for (int i = 0; i < 3; i++)
        n[i] = down[(i + 1) % 3] * right[(i + 2) % 3] - down[(i + 2) % 3] * right[(i + 1) % 3];
    normalize(n);
}

static void agrees_with_twin(void **state)
{
    static const int sizes[][4] = {{131, 37, 5, 3}, {1, 1, -70, -3}, {128, 16, 64, 0}, {3, 50, 63, -1}};
    (void)state;
    for (size_t i = 0; i < 4; i++) {
        shade_scene s;
        double worst = 0;
        assert_true(shade_scene_make(&s, sizes[i][0], sizes[i][1], sizes[i][2], sizes[i][3], i + 40));
        const frame_t *f = &s.frame;
        shade_run run = normal_run(&s);
        run.lanes = i == 2 ? 4 : i == 3 ? 8 : 16;
        assert_true(shade_execute(&run));
        for (int y = 0; y < f->rows; y++) {
            for (int x = 0; x < f->columns; x++) {
                double want[3] = {0, 0, 0};
                if (shade_id(run.images[STENCIL], f, x, y))
                    twin_normal(&run, x, y, want);
                for (int c = 0; c < 3; c++)
                    worst = fmax(worst, fabs(*shade_at(&s.color, f, c, x, y) - want[c]));
            }
        }
        print_message("%dx%d: largest error %.2g\n", sizes[i][0], sizes[i][1], worst);
        assert_true(worst <
                    2e-5); /* depths are random: steep tangents, whose error is relative to their length */
        shade_scene_free(&s);
    }
}

/* ---- known surfaces
 * ------------------------------------------------------------------------------------------ */

/* Depth along the pixel's ray of the plane n.P = d, or of the sphere around `centre`; 0 where it is missed.
 */
static double plane_depth(const frame_t *f, int x, int y, const double *n, double d)
{
    double view[3], ray[3], eye[3];
    twin_ray(f, &f->camera, x, y, view, ray);
    for (int i = 0; i < 3; i++)
        eye[i] = f->camera.to_world[4 * i + 3];
    return (d - dot(n, eye)) / dot(n, ray);
}

static double sphere_depth(const frame_t *f, int x, int y, const double *centre, double radius)
{
    double view[3], ray[3], from[3];
    twin_ray(f, &f->camera, x, y, view, ray);
    for (int i = 0; i < 3; i++)
        from[i] = f->camera.to_world[4 * i + 3] - centre[i];
    double a = dot(ray, ray), b = dot(ray, from), c = dot(from, from) - radius * radius, root = b * b - a * c;
    return root > 0 ? (-b - sqrt(root)) / a : 0;
}

static double error_at(const shade_scene *s, int x, int y, const double *want)
{
    double worst = 0;
    for (int c = 0; c < 3; c++)
        worst = fmax(worst, fabs(*shade_at(&s->color, &s->frame, c, x, y) - want[c]));
    return worst;
}

/* Two planes meet in a step; both have one material, so that only depth tells them apart. Away from the
 * fold's two columns every normal is exact, and within them no normal bridges the step. */
static void planes_are_exact_beside_a_step(void **state)
{
    shade_scene s;
    (void)state;
    assert_true(shade_scene_make(&s, 65, 33, 7, 2, 3));
    const frame_t *f = &s.frame;
    double n[2][3] = {{0.2, 0.5, 1}, {-0.6, 0.1, 1}}, d[2] = {-0.4, -0.6};
    normalize(n[0]);
    normalize(n[1]);
    int middle = f->valid[0] + 32;
    for (int y = f->valid[1]; y < f->valid[3]; y++) {
        for (int x = f->valid[0]; x < f->valid[2]; x++) {
            int side = x >= middle;
            *shade_at(&s.images[LIGHTING_DEPTH], f, 0, x, y) = (float)plane_depth(f, x, y, n[side], d[side]);
            shade_set_id(&s.images[LIGHTING_STENCIL], f, x, y, 1);
        }
    }
    shade_run run = normal_run(&s);
    assert_true(shade_execute(&run));
    for (int y = f->valid[1]; y < f->valid[3]; y++)
        for (int x = f->valid[0]; x < f->valid[2]; x++)
            assert_true(error_at(&s, x, y, n[x >= middle]) <
                        1e-4); /* what float depth allows at this focal length */
    shade_scene_free(&s);
}

static void sphere_faces_the_camera(void **state)
{
    shade_scene s;
    double worst = 0, centre[3], ray[3], view[3];
    int seen = 0;
    (void)state;
    assert_true(shade_scene_make(&s, 200, 120, 0, 0, 3));
    const frame_t *f = &s.frame;
    twin_ray(f, &f->camera, 100, 60, view, ray);
    for (int i = 0; i < 3; i++)
        centre[i] = f->camera.to_world[4 * i + 3] + ray[i];
    for (int y = 0; y < 120; y++) {
        for (int x = 0; x < 200; x++) {
            double z = sphere_depth(f, x, y, centre, 0.1);
            *shade_at(&s.images[LIGHTING_DEPTH], f, 0, x, y) = (float)z;
            shade_set_id(&s.images[LIGHTING_STENCIL], f, x, y, z > 0);
        }
    }
    shade_run run = normal_run(&s);
    assert_true(shade_execute(&run));
    for (int y = 0; y < 120; y++) {
        for (int x = 0; x < 200; x++) {
            double z = *shade_at(&s.images[LIGHTING_DEPTH], f, 0, x, y), p[3], n[3], got[3];
            for (int c = 0; c < 3; c++)
                got[c] = *shade_at(&s.color, f, c, x, y);
            if (z <= 0) {
                assert_true(dot(got, got) == 0);
                continue;
            }
            position(f, x, y, z, p);
            for (int i = 0; i < 3; i++)
                n[i] = p[i] + f->camera.to_world[4 * i + 3] - centre[i];
            normalize(n);
            assert_true(fabs(dot(got, got) - 1) < 1e-5);
            assert_true(dot(got, p) < 0);
            if (-dot(n, p) / sqrt(dot(p, p)) < 0.5)
                continue; /* near the silhouette one pixel turns by more */
            worst = fmax(worst, acos(fmin(dot(got, n), 1)));
            seen++;
        }
    }
    print_message("sphere of 34 pixels: largest error %.2f degrees over %d pixels\n", worst * 57.3, seen);
    assert_true(seen > 1000);
    assert_true(worst < 0.06); /* half a pixel's turn on both axes: 1/34 * 1/2 / cos 60 */
    shade_scene_free(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(agrees_with_twin),
        cmocka_unit_test(planes_are_exact_beside_a_step),
        cmocka_unit_test(sphere_faces_the_camera),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
