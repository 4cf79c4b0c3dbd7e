/* The translucency pass against numerical integrals over true back faces; what is not there. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "passes/burley.h"
#include "tests/back_scene.h"

static const double pi = 3.14159265358979323846;

/* ---- a slab ------------------------------------------------------------------------------------------- */

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Planes n.P = -front and n.P = -front - t (metres), seen where the ray meets them within 0.3 … 2 m; light on
 * the back is `light` of the point there. */
static void make_slab(back_scene *s, const double n[3], double front, double t,
                      double (*light)(const double p[3]))
{
    BACK_EACH_PIXEL(s, x, y, i)
    {
        double ray[3], p[3];
        back_ray(s, x, y, ray);
        if (dot(n, ray) > -0.05) /* far away or behind the camera */
            continue;
        s->stencil[i] = 1;
        s->depth[i] = (float)(-front / dot(n, ray));
        s->back_depth[i] = (float)(-(front + t) / dot(n, ray));
        for (int k = 0; k < 3; k++)
            p[k] = ray[k] * s->back_depth[i];
        for (size_t c = 0; c < 3; c++)
            s->back[c * s->n + i] = (float)light(p), s->back_normal[c * s->n + i] = (float)-n[c];
    }
}

static double even(const double p[3])
{
    (void)p;
    return 1;
}

static double half(const double p[3])
{
    return p[0] > 0 ? 1 : 0;
}

static double through_slab(double t, double d)
{
    return (exp(-t / d) + 3 * exp(-t / (3 * d))) / 4;
}

/* Golubev's slab comes out of the gather, whatever its slope, thickness and distance. */
static void even_slabs_are_exact(void **state)
{
    static const double normals[][3] = {{0, 0, 1}, {0.6, 0, 0.8}, {0, -0.8, 0.6}, {0.5, 0.5, 0.70710678}};
    static const double thick_mm[] = {0.2, 1, 4, 15}, focal[] = {40, 300, 1200};
    double worst = 0;
    (void)state;
    for (size_t k = 0; k < 4; k++)
        for (size_t j = 0; j < 4; j++)
            for (size_t i = 0; i < 3; i++) {
                back_scene s = back_scene_make(5, 3, 130, 70, (float)focal[i]);
                make_slab(&s, normals[k], 0.5, thick_mm[j] * 1e-3, even);
                for (int n = 0; n < 2; n++) {
                    back_scene_run(&s, (back_params){32, 3, n});
                    for (size_t c = 0; c < 3; c++) {
                        size_t at = 35u * (size_t)s.frame.columns + 70u;
                        double want =
                            through_slab(thick_mm[j], (double)back_materials[1].scatter_distance_mm[c]);
                        double off = (double)s.through[c * s.n + at] / want - 1;
                        if (fabs(off) > 0.01)
                            print_message("%zu %g mm %g px: %g %+.3f %%\n", k, thick_mm[j], focal[i], want,
                                          100 * off);
                        worst = fmax(worst, fabs(off));
                    }
                }
                back_scene_free(&s);
            }
    print_message("slabs: largest relative error %.2g %%\n", 100 * worst);
    assert_true(worst < 0.01);
}

/* ---- a ball ------------------------------------------------------------------------------------------- */

/* Light from direction `sun` on a ball, as 1/pi max(n.l, 0). */
typedef struct ball {
    double centre[3], radius, sun[3];
} ball;

static double ball_light(const ball *b, const double p[3])
{
    double nl = 0;
    for (int k = 0; k < 3; k++)
        nl += (p[k] - b->centre[k]) / b->radius * b->sun[k];
    return fmax(nl, 0) / pi;
}

static void make_ball(back_scene *s, const ball *b)
{
    BACK_EACH_PIXEL(s, x, y, i)
    {
        double ray[3], p[3];
        back_ray(s, x, y, ray);
        double a = dot(ray, ray), h = dot(ray, b->centre),
               c = dot(b->centre, b->centre) - b->radius * b->radius;
        double root = h * h - a * c;
        if (root <= 0)
            continue;
        s->stencil[i] = 1;
        s->depth[i] = (float)((h - sqrt(root)) / a);
        s->back_depth[i] = (float)((h + sqrt(root)) / a);
        for (int k = 0; k < 3; k++)
            p[k] = ray[k] * (h + sqrt(root)) / a;
        for (size_t k = 0; k < 3; k++)
            s->back[k * s->n + i] = (float)ball_light(b, p),
                               s->back_normal[k * s->n + i] = (float)((p[k] - b->centre[k]) / b->radius);
    }
}

/* The integral over the part of the ball that faces away from the camera: midpoint sums in polar
 * coordinates about the axis from the camera, equal areas. */
static void ball_truth(const ball *b, const double x[3], const float d_mm[3], double out[3])
{
    enum { BANDS = 240, TURNS = 480 };
    double distance = sqrt(dot(b->centre, b->centre)), axis[3], u[3], v[3];
    double first = -b->radius / distance; /* cosine of where the ball turns away */
    memset(out, 0, 3 * sizeof *out);
    for (int k = 0; k < 3; k++)
        axis[k] = b->centre[k] / distance;
    double side = hypot(axis[0], axis[2]);
    u[0] = axis[2] / side, u[1] = 0, u[2] = -axis[0] / side;
    v[0] = axis[1] * u[2], v[1] = axis[2] * u[0] - axis[0] * u[2], v[2] = -axis[1] * u[0];
    double area = 2 * pi * b->radius * b->radius * (1 - first) / (BANDS * TURNS);
    for (int i = 0; i < BANDS; i++)
        for (int j = 0; j < TURNS; j++) {
            double cosine = first + (1 - first) * (i + 0.5) / BANDS, sine = sqrt(1 - cosine * cosine);
            double turn = 2 * pi * (j + 0.5) / TURNS, p[3], r2 = 0;
            for (int k = 0; k < 3; k++) {
                p[k] = b->centre[k] +
                       b->radius * (cosine * axis[k] + sine * (cos(turn) * u[k] + sin(turn) * v[k]));
                r2 += (p[k] - x[k]) * (p[k] - x[k]);
            }
            double light = ball_light(b, p) * area;
            for (int c = 0; c < 3 && light > 0; c++)
                out[c] += light * rl_burley_profile(sqrt(r2), (double)d_mm[c] * 1e-3);
        }
}

typedef struct ball_error {
    double error[3], bias[3], mean[3];
} ball_error;

/* Pixels, a part of them, at least two from the silhouette. */
static ball_error compare_ball(const back_scene *s, const ball *b, const float *got)
{
    ball_error e = {0};
    BACK_EACH_PIXEL(s, x, y, i)
    {
        double ray[3], want[3];
        bool edge = !s->stencil[i] || (x * 7 + y * 3) % 47;
        for (int k = -2; k <= 2 && !edge; k++)
            edge =
                !s->stencil[(size_t)((long)i + k)] || !s->stencil[(size_t)((long)i + k * s->frame.columns)];
        if (edge)
            continue;
        back_ray(s, x, y, ray);
        for (int k = 0; k < 3; k++)
            ray[k] *= (double)s->depth[i];
        ball_truth(b, ray, s->materials[1].scatter_distance_mm, want);
        for (size_t c = 0; c < 3; c++) {
            e.error[c] += fabs((double)got[c * s->n + i] - want[c]);
            e.bias[c] += (double)got[c * s->n + i] - want[c];
            e.mean[c] += want[c];
        }
    }
    return e;
}

/* A ball of 9 mm, 48 pixels, in skin (d = 3, 1.2, 0.7 mm), lit from behind and aside. What is left with many
 * taps is the ring of the silhouette: 14 % of the back lies in its last half pixel. */
static void balls_match_the_integral(void **state)
{
    static const struct {
        int taps, frames;
        double most[3];
    } runs[] = {{64, 16, {0.11, 0.11, 0.13}}, {4096, 1, {0.045, 0.06, 0.085}}};
    const ball b = {{0.004, -0.0005, -0.3}, 0.009, {0.48, 0.36, -0.8}};
    (void)state;
    back_scene s = back_scene_make(0, 0, 160, 120, 1600);
    make_ball(&s, &b);
    float *sum = rl_calloc(3 * s.n, sizeof *sum);
    assert_non_null(sum);
    for (int k = 0; k < 2; k++) {
        memset(sum, 0, 3 * s.n * sizeof *sum);
        for (int frame = 0; frame < runs[k].frames; frame++) {
            s.frame.number = frame;
            back_scene_run(&s, (back_params){runs[k].taps, 3, 0});
            for (size_t i = 0; i < 3 * s.n; i++)
                sum[i] += s.through[i] / (float)runs[k].frames;
        }
        ball_error e = compare_ball(&s, &b, sum);
        print_message("ball, %d taps, %d frames:", runs[k].taps, runs[k].frames);
        for (int c = 0; c < 3; c++)
            print_message(" %.2f %% (%+.2f %%)", 100 * e.error[c] / e.mean[c], 100 * e.bias[c] / e.mean[c]);
        print_message("\n");
        for (int c = 0; c < 3; c++) {
            assert_true(e.error[c] < runs[k].most[c] * e.mean[c]);
            assert_true(fabs(e.bias[c]) < 0.07 * e.mean[c]);
        }
    }
    rl_free(sum);
    back_scene_free(&s);
}

/* ---- a slab that is lit in part ----------------------------------------------------------------------- */

/* Half a plane of light, `t` away, its edge `x` beside: the profile summed over the plane (lengths in d). */
static double through_half(double t, double x)
{
    double sum = 0;
    for (int i = 0; i < 4000; i++) { /* rings that hold equal shares of the light */
        double rho = rl_burley_inverse(1 - through_slab(t, 1) * (1 - (i + 0.5) / 4000)),
               r = sqrt(rho * rho - t * t);
        sum += (x >= r ? 0 : x <= -r ? 1 : acos(x / r) / pi) / 4000;
    }
    return sum * through_slab(t, 1);
}

static void edges_of_light_match_the_integral(void **state)
{
    static const double thick_mm[] = {1, 4, 10};
    const double facing[3] = {0, 0, 1};
    double worst = 0, dense = 0;
    (void)state;
    for (int k = 0; k < 3; k++) {
        back_scene s = back_scene_make(0, 0, 320, 160, 600);
        make_slab(&s, facing, 0.5, thick_mm[k] * 1e-3, half);
        back_scene_run(&s, (back_params){4096, 3, 0});
        for (int x = 120; x < 200; x += 3) {
            double ray[3], sum[3];
            size_t i = 80u * (size_t)s.frame.columns + (size_t)x;
            back_ray(&s, x, 80, ray);
            if (k == 1 && x % 4 == 0)
                back_dense(&s, x, 80, sum);
            for (size_t c = 0; c < 3; c++) {
                double d = (double)s.materials[1].scatter_distance_mm[c];
                double whole = through_slab(thick_mm[k], d),
                       want = through_half(thick_mm[k] / d, -500 * ray[0] / d),
                       off = (double)s.through[c * s.n + i] - want;
                worst = fmax(worst, fabs(off) / whole);
                if (k == 1 && x % 4 == 0 && c) /* red goes on beyond the image */
                    dense = fmax(dense, fabs(sum[c] - want) / whole);
            }
        }
        back_scene_free(&s);
    }
    print_message("edges: largest error %.2f %% of the lit slab (dense sum over the pixels: %.2f %%)\n",
                  100 * worst, 100 * dense);
    assert_true(worst < 0.02);
    assert_true(dense < 0.02);
}

/* ---- what is not there -------------------------------------------------------------------------------- */

/* In the middle of a slab of which `spoil` leaves pixels with x < 80, as share of the whole slab's light. */
static double left_of(void (*spoil)(back_scene *s, size_t i), size_t material)
{
    static back_material materials[BACK_MATERIALS];
    const double facing[3] = {0, 0, 1};
    back_scene s = back_scene_make(0, 0, 160, 120, 300);
    memcpy(materials, back_materials, sizeof materials);
    materials[1].border = (int)material;
    s.materials = materials;
    make_slab(&s, facing, 0.5, 2e-3, even);
    BACK_EACH_PIXEL(&s, x, y, i)
    {
        if (x >= 80)
            spoil(&s, i);
    }
    back_scene_run(&s, (back_params){512, 3, 0});
    double got = (double)s.through[s.n + 60u * (size_t)s.frame.columns + 79u] / through_slab(2, 1.2);
    back_scene_free(&s);
    return got;
}

static void spoil_with_foreign(back_scene *s, size_t i)
{
    s->stencil[i] = 4; /* at the same depth, brightly lit */
    for (size_t c = 0; c < 3; c++)
        s->back[c * s->n + i] = 1000;
}

static void spoil_with_wall(back_scene *s, size_t i)
{
    spoil_with_foreign(s, i);
    s->depth[i] = 0.8f;
    s->back_depth[i] = 0.9f;
}

static void spoil_with_nothing(back_scene *s, size_t i)
{
    s->stencil[i] = 0;
    s->depth[i] = s->back_depth[i] = 0;
}

static void spoil_with_no_back(back_scene *s, size_t i)
{
    s->back_depth[i] = 0;
    for (size_t c = 0; c < 3; c++)
        s->back[c * s->n + i] = 1000;
}

static void borders_do_not_leak(void **state)
{
    /* The pixel's middle is half a pixel, 0.83 mm, before the edge. */
    const double there = 1 - through_half(2 / 1.2, 0.8333 / 1.2) / through_slab(2 / 1.2, 1);
    (void)state;
    assert_true(fabs(left_of(spoil_with_foreign, 0) - 1) < 0.01);     /* renormalize */
    assert_true(fabs(left_of(spoil_with_foreign, 1) - there) < 0.02); /* occlude */
    assert_true(fabs(left_of(spoil_with_wall, 0) - there) < 0.02);    /* behind it: the slab has ended */
    assert_true(fabs(left_of(spoil_with_nothing, 0) - there) < 0.02);
    assert_true(fabs(left_of(spoil_with_no_back, 0) - there) < 0.02);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(even_slabs_are_exact),
        cmocka_unit_test(balls_match_the_integral),
        cmocka_unit_test(edges_of_light_match_the_integral),
        cmocka_unit_test(borders_do_not_leak),
    };
    return cmocka_run_group_tests(tests, back_open, back_close);
}
