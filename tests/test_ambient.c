/* Ambient light in the lighting pass: harmonics and lobes against numerical integrals. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/base/text.h"
#include "graph/model/ambient.h"
#include "tests/shade_scene.h"

static const double pi = 3.14159265358979323846;

static void assert_near(double got, double want, double relative)
{
    if (fabs(got - want) > relative * fabs(want) + 1e-9)
        fail_msg("got %.9g, expected %.9g", got, want);
}

static double dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void random_unit(uint64_t *seed, double *v)
{
    double z = 2 * shade_random(seed) - 1, phi = 2 * pi * shade_random(seed), r = sqrt(1 - z * z);
    v[0] = r * cos(phi);
    v[1] = r * sin(phi);
    v[2] = z;
}

/* ---- integrals -------------------------------------------------------------------------------------------
 */

/* Two tangents of a unit vector. */
static void tangents(const double *n, double *t, double *b)
{
    double other[3] = {fabs(n[0]) < 0.5, fabs(n[0]) >= 0.5, 0}, along = dot(other, n);
    for (int i = 0; i < 3; i++)
        t[i] = other[i] - along * n[i];
    double length = sqrt(dot(t, t));
    for (int i = 0; i < 3; i++)
        t[i] /= length;
    for (int i = 0; i < 3; i++)
        b[i] = n[(i + 1) % 3] * t[(i + 2) % 3] - n[(i + 2) % 3] * t[(i + 1) % 3];
}

static void around(const double *n, double cosine, double turn, double *out)
{
    double t[3], b[3], sine = sqrt(fmax(1 - cosine * cosine, 0));
    tangents(n, t, b);
    for (int i = 0; i < 3; i++)
        out[i] = cosine * n[i] + sine * (cos(turn) * t[i] + sin(turn) * b[i]);
}

/* Midpoint sum over directions, spaced evenly in a Gaussian's own share: f(v) averaged with the normalized
 * Gaussian around n. */
static double gaussian_mean(double sharpness, const double *n, double (*f)(const void *, const double *),
                            const void *ctx, int steps, int turns)
{
    double sum = 0;
    for (int i = 0; i < steps; i++) {
        double c = 1 + log1p((i + 0.5) / steps * expm1(-2 * sharpness)) / sharpness;
        for (int j = 0; j < turns; j++) {
            double v[3];
            around(n, c, 2 * pi * (j + 0.5) / turns, v);
            sum += f(ctx, v);
        }
    }
    return sum / (steps * turns);
}

static double radiance(const void *ctx, const double *v)
{
    const double *sh = ctx;
    double basis[RL_AMBIENT_BANDS], sum = 0;
    rl_ambient_basis(v, basis);
    for (int i = 0; i < RL_AMBIENT_BANDS; i++)
        sum += sh[i] * basis[i];
    return sum;
}

/* Irradiance of the harmonics at a normal: the cosine-weighted sum over its hemisphere, spaced evenly in
 * cos^2. */
static double sky(const void *ctx, const double *n)
{
    double sum = 0;
    for (int i = 0; i < 40; i++) {
        for (int j = 0; j < 16; j++) {
            double v[3];
            around(n, sqrt((i + 0.5) / 40), 2 * pi * (j + 0.5) / 16, v);
            sum += radiance(ctx, v);
        }
    }
    return pi * sum / (40 * 16);
}

/* ---- through the pass ------------------------------------------------------------------------------------
 */

typedef struct yard {
    shade_scene scene;
    shade_run run;
    ambient_t ambient;
    double sh[3][RL_AMBIENT_BANDS]; /* channel by channel */
} yard;

enum { WIDE = 64, HIGH = 20 };

/* Without lights, one material (index 1); each row of pixels has its own curvature. */
static void make_yard(yard *t, uint64_t seed)
{
    assert_true(shade_scene_make(&t->scene, WIDE, HIGH, 0, 0, seed));
    const frame_t *f = &t->scene.frame;
    shade_materials *m = &t->scene.materials;
    memset(&t->ambient, 0, sizeof t->ambient);
    t->ambient.on = 1;
    for (int i = 0; i < 27; i++)
        t->ambient.sh[i] = (float)(i < 3 ? 3 : 0.5 * (shade_random(&seed) - 0.5));
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < RL_AMBIENT_BANDS; i++)
            t->sh[c][i] = (double)t->ambient.sh[3 * i + c];
    shade_material_set(m, 1, "shading", "specular", (double[]){1});
    shade_material_set(m, 1, "shading", "exit_transmission", (double[]){0});
    shade_material_set(m, 1, "profile", "texturing", (double[]){0});
    shade_material_set(m, 1, "profile", "sg_variance_mm2", (double[]){100, 10, 1});
    shade_fill(&t->scene.images[LIGHTING_EMISSION], f, (double[]){0, 0, 0});
    shade_fill(&t->scene.images[LIGHTING_METALLIC], f, (double[]){0});
    for (int y = 0; y < HIGH; y++) {
        for (int x = 0; x < WIDE; x++) {
            shade_set_id(&t->scene.images[LIGHTING_STENCIL], f, x, y, 1);
            *shade_at(&t->scene.images[LIGHTING_CURVATURE], f, 0, x, y) = (float)(5 * pow(2, 0.5 * y));
        }
    }
    t->scene.frame.lights = 0;
    t->scene.frame.camera.focal[0] = 5000; /* a pixel of 0.3 mm: nothing is too small to scatter */
    t->run = shade_scene_lighting(&t->scene);
    t->run.images[LIGHTING_SMOOTH_NORMAL] = NULL;
    t->run.ambient = &t->ambient;
}

static void set_diffuse(yard *t, double word)
{
    assert_true(shade_material_set(&t->scene.materials, 1, "shading", "diffuse", &word));
}

static double pixel(const yard *t, int port, int c, int x, int y)
{
    return *shade_at(&t->scene.images[port], &t->scene.frame, c, x, y);
}

static void normal_at(const yard *t, int x, int y, double *n)
{
    for (int i = 0; i < 3; i++)
        n[i] = pixel(t, LIGHTING_NORMAL, i, x, y);
}

static double sharpness_at(const yard *t, int c, int x, int y)
{
    static const double v[] = {100, 10, 1};
    double r = 1000 / pixel(t, LIGHTING_CURVATURE, 0, x, y);
    return fmin(fmax(r * r / v[c], 1e-3), 1e4);
}

static void sky_lights_matte_and_burley(void **state)
{
    yard t;
    (void)state;
    make_yard(&t, 11);
    for (int disney = 0; disney < 2; disney++) {
        double mean = 0; /* of F_dt, over directions with equal light: 2 int F(c) c dc */
        for (int i = 0; i < 1000; i++)
            mean += 2e-3 * (1 - 0.5 * pow(1 - (i + 0.5) / 1000, 5)) * (i + 0.5) / 1000;
        set_diffuse(&t, disney ? 0 : 1);
        assert_true(shade_execute(&t.run));
        for (int x = 0; x < WIDE; x += 7) {
            double n[3];
            normal_at(&t, x, 3, n);
            for (int c = 0; c < 3; c++) {
                assert_near(pixel(&t, LIGHTING_DIFFUSE, c, x, 3), sky(t.sh[c], n) / pi * (disney ? mean : 1),
                            2e-3);
                assert_true(pixel(&t, LIGHTING_LIT, c, x, 3) == 0);
            }
        }
    }
    /* Without a profile it is in `lit`, with the albedo. */
    t.scene.materials.words[1][0] = 0;
    set_diffuse(&t, 1);
    assert_true(shade_execute(&t.run));
    double n[3];
    normal_at(&t, 9, 3, n);
    assert_near(pixel(&t, LIGHTING_LIT, 1, 9, 3), sky(t.sh[1], n) / pi * pixel(&t, LIGHTING_ALBEDO, 1, 9, 3),
                2e-3);
    shade_scene_free(&t.scene);
}

/* The irradiance of the sky, averaged with the normalized Gaussian around the normal: sharpness from 1e-3 to
 * 1e4 a row. */
static void sky_scatters_a_band_at_a_time(void **state)
{
    yard t;
    double worst = 0, least = 1e9, most = 0;
    (void)state;
    make_yard(&t, 12);
    set_diffuse(&t, 2);
    assert_true(shade_execute(&t.run));
    for (int y = 0; y < HIGH; y++) {
        double n[3];
        normal_at(&t, 5, y, n);
        for (int c = 0; c < 3; c++) {
            double lambda = sharpness_at(&t, c, 5, y),
                   want = gaussian_mean(lambda, n, sky, t.sh[c], 80, 16) / pi;
            double got = pixel(&t, LIGHTING_LIT, c, 5, y) / pixel(&t, LIGHTING_ALBEDO, c, 5, y);
            worst = fmax(worst, fabs(got / want - 1));
            least = fmin(least, lambda);
            most = fmax(most, lambda);
            assert_true(pixel(&t, LIGHTING_DIFFUSE, c, 5, y) == 0);
        }
    }
    print_message("harmonics, sharpness %.2g to %.2g: largest relative error %.1g\n", least, most, worst);
    assert_true(worst < 2e-3); /* the quadrature's own */
    shade_scene_free(&t.scene);
}

static double first(const void *ctx, const double *v)
{
    (void)ctx;
    return v[2];
}

static double second(const void *ctx, const double *v)
{
    (void)ctx;
    return 1.5 * v[2] * v[2] - 0.5;
}

/* The kernel's a1, a2 and the inverse of a1, against the means of P_1 and P_2. Small means cancel in the
 * quadrature, which is why its own error is absolute. */
static void bands_are_means(void **state)
{
    enum { N = 64 };
    static const char entry[] =
        "kernel void bands(global const float *in, global float *out)\n"
        "{ int i = get_global_id(0), n = get_global_size(0) / 4; floatv l = rl_load(in, RL_W * i), a = "
        "sg_band1(l);\n"
        "  rl_store(i < n ? a : i < 2 * n ? sg_band2(l, a) : sg_convolved(a), out, RL_W * i); }\n";
    static float in[4 * N], out[4 * N];
    const double up[3] = {0, 0, 1};
    double worst = 0, close[2] = {0, 0}, inverse = 0;
    char *file = NULL;
    size_t size;
    rl_str text = {0};
    (void)state;
    assert_int_equal(rl_file_read("kernels/sg.cl", &file, &size, NULL), RL_OK);
    rl_str_add(&text, file);
    rl_str_add(&text, entry);
    for (int i = 0; i < 4 * N; i++)
        in[i] = (float)pow(10, -2.5 + 6.0 * (i % N) / (N - 1));
    assert_true(shade_function(rl_str_text(&text), "bands", in, out, 4 * N));
    rl_str_free(&text);
    rl_free(file);
    for (int i = 0; i < N; i++) {
        double l = (double)in[i], a1 = (double)out[i], a2 = (double)out[N + i], back = (double)out[2 * N + i];
        worst = fmax(worst, fabs(a1 - gaussian_mean(l, up, first, NULL, 20000, 1)));
        worst = fmax(worst, fabs(a2 - gaussian_mean(l, up, second, NULL, 20000, 1)));
        long double x = l, exact = 1 / tanhl(x) - 1 / x; /* cancels to 1e-7 of a2 at worst, with 64 bits */
        close[0] = fmax(close[0], fabs(a1 / (double)exact - 1));
        close[1] = fmax(close[1], fabs(a2 / (double)(1 - 3 * exact / x) - 1));
        inverse = fmax(inverse, l < 1e3 ? fabs(back / l - 1) : 0);
    }
    print_message("bands: largest error %.1g, relative %.1g, %.1g; sharpness from a band: within %.2f\n",
                  worst, close[0], close[1], inverse);
    assert_true(worst < 1e-5);
    assert_true(close[0] < 2e-6);
    assert_true(close[1] < 4e-5); /* right above 0.5, where the closed form begins */
    assert_true(inverse < 0.06);  /* Banerjee's approximation, worst near 3 */
}

/* ---- lobes -----------------------------------------------------------------------------------------------
 */

typedef struct lobe_light {
    double axis[3], table[501]; /* irradiance of a flux of 1, over axis.n from -1 to 1 */
} lobe_light;

static double facing(const void *ctx, const double *v)
{
    return fmax(dot(ctx, v), 0);
}

static double from_table(const void *ctx, const double *n)
{
    const lobe_light *l = ctx;
    double at = (dot(l->axis, n) + 1) * 250;
    int i = at >= 500 ? 499 : at < 0 ? 0 : (int)at;
    return l->table[i] + (at - i) * (l->table[i + 1] - l->table[i]);
}

static void make_table(lobe_light *l, double sharpness)
{
    for (int i = 0; i <= 500; i++) {
        double c = i / 250.0 - 1, n[3] = {sqrt(fmax(1 - c * c, 0)), 0, c};
        l->table[i] = gaussian_mean(sharpness, (double[]){0, 0, 1}, facing, n, 100, 32);
    }
}

/* Light of a lobe behind the Gaussian of the material, for all pairs: against the integral of both. */
static void lobes_convolve(void **state)
{
    static const double sharpness[] = {0.05, 0.5, 2, 8, 40, 300};
    yard t;
    double worst = 0, plain = 0, product = 0;
    (void)state;
    make_yard(&t, 13);
    memset(t.ambient.sh, 0, sizeof t.ambient.sh);
    t.ambient.lobes = 1;
    for (size_t s = 0; s < 6; s++) {
        lobe_light light;
        uint64_t seed = s;
        random_unit(&seed, light.axis);
        make_table(&light, sharpness[s]);
        for (int i = 0; i < 3; i++) {
            t.ambient.lobe[0].axis[i] = (float)light.axis[i];
            t.ambient.lobe[0].flux[i] = (float)(i + 1);
        }
        t.ambient.lobe[0].sharpness = (float)sharpness[s];
        for (int scattered = 0; scattered < 2; scattered++) {
            set_diffuse(&t, scattered ? 2 : 1);
            assert_true(shade_execute(&t.run));
            for (int y = 0; y < HIGH; y += 2) {
                for (int c = 0; c < 3; c++) {
                    double n[3], lambda = sharpness_at(&t, c, 5, y);
                    normal_at(&t, 5, y, n);
                    double want = scattered ? gaussian_mean(lambda, n, from_table, &light, 60, 24)
                                            : from_table(&light, n);
                    double a = pixel(&t, LIGHTING_ALBEDO, c, 5, y), flux = c + 1;
                    double got = scattered ? pixel(&t, LIGHTING_LIT, c, 5, y) / a
                                           : pixel(&t, LIGHTING_DIFFUSE, c, 5, y);
                    double error = fabs(got * pi / flux - want);
                    worst = fmax(worst, scattered ? error : 0);
                    plain = fmax(plain, scattered ? 0 : error);
                    /* the product rule, with its amplitude, for comparison */
                    double l = lambda * sharpness[s] / (lambda + sharpness[s]);
                    double energy = expm1(-2 * l) / (expm1(-2 * lambda) * -expm1(-2 * sharpness[s]));
                    if (scattered)
                        product =
                            fmax(product, fabs(energy * twin_sg_irradiance(l, dot(light.axis, n)) - want));
                }
            }
        }
    }
    print_message(
        "lobes: largest error %.3f of the flux behind a Gaussian, %.3f without (product rule %.2f)\n", worst,
        plain, product);
    assert_true(plain < 0.020);
    assert_true(worst < 0.030); /* 0.015 of the convolution, 0.020 of the fit */
    assert_true(product > 3 * worst);
    shade_scene_free(&t.scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sky_lights_matte_and_burley),
        cmocka_unit_test(sky_scatters_a_band_at_a_time),
        cmocka_unit_test(bands_are_means),
        cmocka_unit_test(lobes_convolve),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
