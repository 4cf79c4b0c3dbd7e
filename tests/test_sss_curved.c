/* What the weightings are worth: against the integral of R(|x - y|) E(y) over the whole of known surfaces,
 * their backs included, in double precision. A ball, a cylinder and a wavy wall are lit from one side, half
 * of them in the dark. None of them is the scene that the weightings were chosen on. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "passes/burley.h"
#include "tests/sss_scene.h"

enum { SIZE = 128, STEP = 4, FRAMES = 16 };
#define FOCAL 5000.0f /* pixels: as good as parallel */
#define DEPTH 2.0f    /* metres, so that a pixel is 0.4 mm */
#define PIXEL 0.4     /* mm */

#define SLACK 2e-4 /* what pixels and the quadrature leave */

static const double pi = 3.14159265358979323846;
static const double distance_mm[3] = {2, 1, 0.5};
static const double to_light[3] = {0.8, 0.2, 0.5656854249492381};

typedef enum shape { BALL, CYLINDER, WAVES } shape;
static const char *const words[] = {"area", "plain", "surface"};
static const char *const shape_names[] = {"ball", "cylinder", "waves"};
static const double radius = 14; /* mm, of ball and cylinder */

/* A point of a curve in the plane y = 0, mm, and its normal. */
typedef struct point {
    double x, z, nx, nz;
} point;

/* Waves 16 mm long and 2 mm high. */
static point wave_at(double x)
{
    const double k = 2 * pi / 16, height = 1;
    double slope = -height * k * sin(k * x), length = sqrt(1 + slope * slope);
    return (point){x, height * cos(k * x), -slope / length, 1 / length};
}

static point circle_at(double angle)
{
    return (point){radius * sin(angle), radius * cos(angle), sin(angle), cos(angle)};
}

static double lit(double nx, double ny, double nz)
{
    return fmax(0, nx * to_light[0] + ny * to_light[1] + nz * to_light[2]);
}

/* Waves are lit on the left only: a shadow's edge. */
static double lit_point(shape s, point p)
{
    return s == WAVES && p.x > PIXEL / 2 ? 0 : lit(p.nx, 0, p.nz);
}

/* What is seen at pixel (x, y): false where there is nothing. */
static bool seen(shape s, int x, int y, double *height, double *light)
{
    double u = (x - SIZE / 2) * PIXEL, v = s == BALL ? (y - SIZE / 2) * PIXEL : 0;
    if (s == WAVES) {
        point p = wave_at(u);
        *height = p.z;
        *light = lit_point(s, p);
        return true;
    }
    double w = radius * radius - u * u - v * v;
    if (w <= 0)
        return false;
    *height = sqrt(w);
    *light = lit(u / radius, -v / radius, *height / radius);
    return true;
}

/* ---- the truth ---- */

/* At the ball's point with normal n. By Archimedes the ring of the ball at chords r … r+dr has the area 2 pi
 * r dr; E over it, by its angle. */
static double ball_integral(const double n[3], double d)
{
    const int rings = 300, turns = 96;
    double sum = 0, flat = sqrt(n[0] * n[0] + n[1] * n[1]) + 1e-12, a[3] = {-n[1] / flat, n[0] / flat, 0};
    double b[3] = {n[1] * a[2] - n[2] * a[1], n[2] * a[0] - n[0] * a[2], n[0] * a[1] - n[1] * a[0]};
    double all = rl_burley_cdf(2 * radius, d);
    for (int i = 0; i < rings; i++) {
        double r = d * rl_burley_inverse(all * (i + 0.5) / rings), mean = 0;
        double cosine = 1 - r * r / (2 * radius * radius), sine = sqrt(fmax(0, 1 - cosine * cosine));
        for (int k = 0; k < turns; k++) {
            double t = 2 * pi * (k + 0.5) / turns, m[3];
            for (int c = 0; c < 3; c++)
                m[c] = cosine * n[c] + sine * (cos(t) * a[c] + sin(t) * b[c]);
            mean += lit(m[0], m[1], m[2]) / turns;
        }
        sum += mean * all / rings;
    }
    return sum;
}

/* R over a line at distance a: z = a sinh t. */
static double line_integral(double a, double d)
{
    const int n = 60;
    double most = asinh(40 * d / a), sum = 0;
    for (int i = 0; i < n; i++) {
        double r = a * cosh(most * (i + 0.5) / n);
        sum += 2 * rl_burley_profile(r, d) * r * most / n;
    }
    return sum;
}

/* Over a curve that is drawn along y, from its point at `at`; steps are finer near it. */
static double curve_integral(shape s, double at, double d)
{
    const int n = 400;
    double reach = s == CYLINDER ? pi : 40 * d, sum = 0;
    point here = s == CYLINDER ? circle_at(at) : wave_at(at);
    for (int i = -n; i < n; i++) {
        double t = (i + 0.5) / n, offset = reach * t * t * t, step = 3 * reach * t * t / n;
        point p = s == CYLINDER ? circle_at(at + offset) : wave_at(at + offset);
        double length = s == CYLINDER ? radius : 1 / p.nz;
        sum += line_integral(hypot(p.x - here.x, p.z - here.z), d) * lit_point(s, p) * length * step;
    }
    return sum;
}

static double truth_at(shape s, int x, int y, double d)
{
    double u = (x - SIZE / 2) * PIXEL, v = (y - SIZE / 2) * PIXEL;
    double n[3] = {u / radius, -v / radius, sqrt(fmax(0, 1 - (u * u + v * v) / (radius * radius)))};
    double all = s == BALL       ? ball_integral(n, d)
                 : s == CYLINDER ? curve_integral(s, asin(u / radius), d)
                                 : curve_integral(s, u, d);
    return all;
}

/* ---- the passes ---- */

static sss_scene scene_of(shape s)
{
    sss_scene scene = sss_scene_make(0, 0, SIZE, SIZE, FOCAL);
    SSS_EACH_PIXEL(&scene, x, y, i)
    {
        double height, light;
        if (!seen(s, x, y, &height, &light))
            continue;
        scene.stencil[i] = 1;
        scene.depth[i] = DEPTH - (float)(height * 1e-3);
        for (size_t c = 0; c < 3; c++)
            scene.diffuse[c * scene.n + i] = (float)light;
    }
    return scene;
}

/* Mean |result - truth| / mean truth, a channel, where there is a truth. */
static void errors(const sss_scene *s, const double *truth, double error[3])
{
    for (size_t c = 0; c < 3; c++) {
        double sum = 0, all = 0;
        for (int y = STEP; y < SIZE - STEP; y += STEP)
            for (int x = STEP; x < SIZE - STEP; x += STEP) {
                size_t i = (size_t)(y * s->twin.frame.columns + x);
                if (truth[c * s->n + i] < 0)
                    continue;
                sum += fabs((double)s->filtered[c * s->n + i] - truth[c * s->n + i]);
                all += truth[c * s->n + i];
            }
        error[c] = sum / all;
    }
}

/* -1 within 3 pixels of a silhouette or the shadow's edge, near the image's edge, and between the pixels that
 * are looked at. */
static double *truths(const sss_scene *s, shape kind)
{
    double *truth = rl_calloc(3 * s->n, sizeof *truth);
    assert_non_null(truth);
    for (size_t c = 0; c < 3; c++)
        for (int y = STEP; y < SIZE - STEP; y += STEP)
            for (int x = STEP; x < SIZE - STEP; x += STEP) {
                size_t i = c * s->n + (size_t)(y * s->twin.frame.columns + x), above = i;
                double u = (x - SIZE / 2) * PIXEL, v = kind == BALL ? (y - SIZE / 2) * PIXEL : 0;
                above -= (size_t)(STEP * s->twin.frame.columns);
                bool off =
                    kind == WAVES ? fabs(u) > 10 || fabs(u) < 3 * PIXEL : hypot(u, v) > radius - 3 * PIXEL;
                if (off || (kind != BALL && abs(y - SIZE / 2) > SIZE / 4))
                    truth[i] = -1;
                else if (kind != BALL && truth[above] > 0) /* the same along y */
                    truth[i] = truth[above];
                else
                    truth[i] = truth_at(kind, x, y, distance_mm[c]);
            }
    return truth;
}

static void measure(shape kind, double dense[3][3], double taps[3][3])
{
    sss_scene s = scene_of(kind);
    double *truth = truths(&s, kind);
    float *mean = sss_planes(3 * s.n);
    for (int weighting = 0; weighting < 3; weighting++) {
        sss_run_reference(&s, weighting);
        errors(&s, truth, dense[weighting]);
        memset(mean, 0, 3 * s.n * sizeof *mean);
        for (int frame = 0; frame < FRAMES; frame++) {
            s.twin.frame.number = frame;
            sss_run_burley(&s, 55, weighting);
            for (size_t i = 0; i < 3 * s.n; i++)
                mean[i] += s.filtered[i] / FRAMES;
        }
        memcpy(s.filtered, mean, 3 * s.n * sizeof *mean);
        errors(&s, truth, taps[weighting]);
    }
    rl_free(truth);
    rl_free(mean);
    sss_scene_free(&s);
}

/* `surface` beside `area`, the mean of the channels' errors. On the cylinder it is farther off in the widest
 * channel. The ball has room around it: beyond the image nothing tells that a surface has turned away, and
 * `surface` is no better than `area` at an image's edge. */
static void surface_is_nearest(void **state)
{
    (void)state;
    static const double most[] = {0.25, 1.4, 0.45}; /* measured 0.14, 1.27, 0.29 */
    double all[3] = {0};
    for (shape kind = BALL; kind <= WAVES; kind++) {
        double dense[3][3], taps[3][3], of_dense[3] = {0}, of_taps[3] = {0};
        measure(kind, dense, taps);
        for (int w = 0; w < 3; w++) {
            for (int c = 0; c < 3; c++) {
                of_dense[w] += dense[w][c] / 3;
                of_taps[w] += taps[w][c] / 3;
            }
            all[w] += of_taps[w] / 3;
            print_message("%s, %s: dense %.2f %.2f %.2f %%, 55 taps and 16 frames %.2f %.2f %.2f %%\n",
                          shape_names[kind], words[w], 100 * dense[w][0], 100 * dense[w][1],
                          100 * dense[w][2], 100 * taps[w][0], 100 * taps[w][1], 100 * taps[w][2]);
        }
        assert_true(of_dense[SURFACE] < most[kind] * of_dense[AREA]);
        assert_true(of_taps[SURFACE] < (most[kind] + 0.1) * of_taps[AREA]);
    }
    assert_true(all[SURFACE] < 0.5 * all[AREA] && all[AREA] < 0.8 * all[PLAIN]);
}

/* ---- off the axis ---- */

/* What pixel (x, y) sees of the ball at `middle`, mm in view space: false where there is nothing. */
static bool seen_at(const camera_t *c, const double middle[3], int x, int y, double *depth, double n[3])
{
    double ray[3] = {(x + 0.5 - c->centre[0]) / c->focal[0], -(y + 0.5 - c->centre[1]) / c->focal[1], -1};
    double rr = 0, rm = 0, mm = 0;
    for (int i = 0; i < 3; i++) {
        rr += ray[i] * ray[i];
        rm += ray[i] * middle[i];
        mm += middle[i] * middle[i];
    }
    double root = rm * rm - rr * (mm - radius * radius);
    if (root <= 0)
        return false;
    *depth = (rm - sqrt(root)) / rr;
    for (int i = 0; i < 3; i++)
        n[i] = (*depth * ray[i] - middle[i]) / radius;
    return true;
}

/* The mean of a channel's errors beside the mean of the truth, of pixels that see the ball less than 65
 * degrees from its middle. */
static double error_at(const sss_scene *s, const double middle[3], size_t c, double *bias)
{
    double sum = 0, more = 0, all = 0,
           length = sqrt(middle[0] * middle[0] + middle[1] * middle[1] + middle[2] * middle[2]);
    for (int y = 2; y < SIZE; y += STEP)
        for (int x = 2; x < SIZE; x += STEP) {
            double depth, n[3], facing = 0;
            if (!seen_at(&s->twin.frame.camera, middle, x, y, &depth, n))
                continue;
            for (int i = 0; i < 3; i++)
                facing -= n[i] * middle[i] / length;
            if (facing < cos(65 * pi / 180))
                continue;
            double truth = ball_integral(n, distance_mm[c]);
            double got = (double)s->filtered[c * s->n + (size_t)(y * s->twin.frame.columns + x)];
            sum += fabs(got - truth);
            more += got - truth;
            all += truth;
        }
    *bias = more / all;
    return sum / all;
}

/* A ball 31 degrees off the axis of a wide lens. `surface` is off by 2.1, 0.5 and 0.1 %; with distances of
 * the screen's plane it would be by 8.0, 4.5 and 1.9 %. The others take those: `area` is off by 7.5, 3.3
 * and 1.3 %. */
static void surface_holds_off_the_axis(void **state)
{
    (void)state;
    const double middle[3] = {50, 30, -97};
    sss_scene s = sss_scene_make(0, 0, SIZE, SIZE, 330);
    camera_t *c = &s.twin.frame.camera;
    c->centre[0] -= c->focal[0] * (float)(middle[0] / -middle[2]);
    c->centre[1] += c->focal[1] * (float)(middle[1] / -middle[2]);
    SSS_EACH_PIXEL(&s, x, y, i)
    {
        double depth, n[3];
        if (!seen_at(c, middle, x, y, &depth, n))
            continue;
        s.stencil[i] = 1;
        s.depth[i] = (float)(depth * 1e-3);
        for (size_t k = 0; k < 3; k++)
            s.diffuse[k * s.n + i] = (float)lit(n[0], n[1], n[2]);
    }
    for (int pass = 0; pass < 2; pass++) {
        double all[3] = {0}, bias;
        for (int w = 0; w < 3; w++) {
            if (pass == 0)
                sss_run_reference(&s, w);
            else
                sss_run_burley(&s, 1024, w);
            for (size_t k = 0; k < 3; k++) {
                double error = error_at(&s, middle, k, &bias);
                print_message("off the axis, %s, %s: channel %zu off by %.2f %% (%+.2f)\n", words[w],
                              pass ? "1024 taps" : "dense", k, 100 * error, 100 * bias);
                all[w] += error / 3;
            }
        }
        assert_true(all[SURFACE] < 0.012 && all[SURFACE] < 0.3 * all[AREA]);
    }
    sss_scene_free(&s);
}

static int open_three(void **state)
{
    for (int c = 0; c < 3; c++)
        sss_materials[1].scatter_distance_mm[c] = (float)distance_mm[c];
    return sss_open(state);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(surface_is_nearest),
                                       cmocka_unit_test(surface_holds_off_the_axis)};
    return cmocka_run_group_tests(tests, open_three, sss_close);
}
