/* The translucency pass against numerical integrals over true back faces, and against plain C. */
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

static void balls_match_the_integral(void **state)
{
    const ball b = {{0.004, -0.0005, -0.3}, 0.009, {0.48, 0.36, -0.8}};
    (void)state;
    back_scene s = back_scene_make(0, 0, 160, 120, 1600);
    s.frame.camera.centre[0] = 80;
    s.frame.camera.centre[1] = 60;
    make_ball(&s, &b);
    for (int many = 0; many < 3; many++) {
        double error[3] = {0}, bias[3] = {0}, mean[3] = {0};
        int frames = many == 1 ? 16 : 1, taps = many == 2 ? 4096 : 32;
        float *sum = rl_calloc(3 * s.n, sizeof *sum);
        for (int k = 0; k < frames; k++) {
            s.frame.number = k;
            back_scene_run(&s, (back_params){taps, 3, 0});
            for (size_t i = 0; i < 3 * s.n; i++)
                sum[i] += s.through[i] / (float)frames;
        }
        BACK_EACH_PIXEL(&s, x, y, i)
        {
            double ray[3], want[3];
            if (!s.stencil[i] || (x * 7 + y * 3) % 61)
                continue;
            bool edge = false;
            for (int k = -2; k <= 2; k++)
                edge |= !s.stencil[i + (size_t)k] || !s.stencil[(size_t)((long)i + k * s.frame.columns)];
            if (edge)
                continue;
            back_ray(&s, x, y, ray);
            for (int k = 0; k < 3; k++)
                ray[k] *= (double)s.depth[i];
            ball_truth(&b, ray, back_materials[1].scatter_distance_mm, want);
            if (y == 60 || x == 101)
                print_message("%d,%d: %g %g  t %g\n", x, y, sum[i], want[0], s.back_depth[i] - s.depth[i]);
            for (size_t c = 0; c < 3; c++) {
                error[c] += fabs((double)sum[c * s.n + i] - want[c]);
                bias[c] += (double)sum[c * s.n + i] - want[c];
                mean[c] += want[c];
            }
        }
        for (int c = 0; c < 3; c++)
            print_message("ball, %d taps, %d frames, channel %d: %.2f %% (%+.2f %%)\n", taps, frames, c,
                          100 * error[c] / mean[c], 100 * bias[c] / mean[c]);
        rl_free(sum);
    }
    back_scene_free(&s);
}

/* ---- plain C ------------------------------------------------------------------------------------------ */

static bool gathers(uint32_t id)
{
    const back_material *m = &back_materials[id];
    return m->has_profile && m->transmits && m->transmission == BACK_GATHER;
}

/* Windows that start anywhere and have odd sizes. */
static const struct {
    int x, y, width, height;
    float focal;
} windows[] = {{37, 11, 150, 61, 300}, {-70, -5, 67, 33, 900}, {0, 0, 64, 4, 60}, {5, 2, 1, 1, 500}, {63, 3, 3, 45, 250}};

static void kernel_equals_twin(void **state)
{
    static const int taps[] = {3, 32, 100};
    (void)state;
    for (size_t k = 0; k < sizeof windows / sizeof *windows; k++)
        for (int t = 0; t < 3; t++) {
            back_scene s = back_scene_make(windows[k].x, windows[k].y, windows[k].width, windows[k].height, windows[k].focal);
            back_params p = {taps[t], ((int)k + t) % 2 ? 3 : 0, 7};
            double worst = 0;
            s.frame.camera.focal[1] *= 1.3f;
            s.frame.camera.jitter[0] = 0.3f;
            s.frame.number = (int)k * 37 - 40;
            back_scene_random(&s, (uint32_t)k + 1);
            back_scene_run(&s, p);
            BACK_EACH_PIXEL(&s, x, y, i)
            {
                double through[3] = {0}, out[3];
                if (t == 2 && i % 3)
                    continue;
                if (gathers(s.stencil[i]))
                    back_twin(&s, x, y, p, through);
                back_resolve(&s, x, y, through, out);
                for (size_t c = 0; c < 3; c++) {
                    double got = s.out[c * s.n + i], light = s.through[c * s.n + i];
                    assert_true(isfinite(got));
                    if (!gathers(s.stencil[i]))
                        assert_true(light == 0);
                    double off = fmax(fabs(light - through[c]) / fmax(through[c], 1e-3), fabs(got - out[c]) / fmax(out[c], 1e-2));
                    if (off > 1e-4 && worst <= 1e-4)
                        print_message("window %zu, %d taps, (%d, %d) channel %zu: %.6g, expected %.6g\n", k, taps[t], x, y, c, light, through[c]);
                    worst = fmax(worst, off);
                }
            }
            print_message("window %zu, %d taps: %.1e\n", k, taps[t], worst);
            assert_true(worst < 1e-4);
            back_scene_free(&s);
        }
}

int main(void)
{
    (void)half;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(even_slabs_are_exact),
        cmocka_unit_test(kernel_equals_twin),
        cmocka_unit_test(balls_match_the_integral),
    };
    return cmocka_run_group_tests(tests, back_open, back_close);
}
