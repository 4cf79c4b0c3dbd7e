/* Spherical Gaussians: the irradiance fit against numerical integrals, and what lighting makes of a material
 * with diffuse: sg. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <cmocka.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/base/text.h"
#include "tests/shade_scene.h"

static const double pi = 3.14159265358979323846;

enum { SHARPNESSES = 32, ANGLES = 41, PAIRS = SHARPNESSES * ANGLES, STEPS = 240, TURNS = 48 };

static double sharpness(int i)
{
    return pow(10, -3 + 7.0 * i / (SHARPNESSES - 1)); /* 1e-3 … 1e4 */
}

static double cosine(int i)
{
    return cos(pi * i / (ANGLES - 1));
}

/* ---- the integral -----------------------------------------------------------------------------------------
 */

/* Light of direction l on a ball of radius r (mm), blurred by a Gaussian of the chord d with variance v an
 * axis, exp(-d^2/2v), normalized over the ball: what arrives at the point with normal n, mu = n.l. Midpoint
 * sums over polar angle (spaced so that each step carries the same part of the kernel) and azimuth. */
static double blurred(double r, double v, double mu)
{
    double k = 2 * r * r / v, sum = 0,
           side = sqrt(fmax(1 - mu * mu, 0)); /* kernel: exp(-k s), s = sin^2(theta/2) in 0…1 */
    for (int i = 0; i < STEPS; i++) {
        double part = (i + 0.5) / STEPS, s = -log1p(part * expm1(-k)) / k, c = 1 - 2 * s,
               sine = 2 * sqrt(s * (1 - s));
        for (int j = 0; j < TURNS; j++)
            sum += fmax(c * mu + sine * side * cos(pi * (j + 0.5) / TURNS), 0);
    }
    return sum / (STEPS * TURNS);
}

/* The kernel's functions at every pair of the tables: PAIRS irradiances, then PAIRS sharpnesses of curvature
 * lambda and variance 2. */
static void run_kernel(float *out)
{
    static const char entry[] =
        "kernel void fit(global const float *in, global float *out)\n"
        "{ int i = get_global_id(0), n = get_global_size(0) / 2;\n"
        "  floatv a = rl_load(in, RL_W * (i % n)), mu = rl_load(in, RL_W * (i % n + n));\n"
        "  sg_t s = sg_make(a);\n"
        "  rl_store(i < n ? sg_irradiance(&s, mu) : sg_sharpness(a, 2.0f), out, RL_W * i); }\n";
    static float in[2 * PAIRS];
    char *file = NULL;
    size_t size;
    rl_str text = {0};
    assert_int_equal(rl_file_read("kernels/sg.cl", &file, &size, NULL), RL_OK);
    rl_str_add(&text, file);
    rl_str_add(&text, entry);
    for (int i = 0; i < PAIRS; i++) {
        in[i] = (float)sharpness(i / ANGLES);
        in[PAIRS + i] = (float)cosine(i % ANGLES);
    }
    assert_true(shade_function(rl_str_text(&text), "fit", in, out, 2 * PAIRS));
    rl_str_free(&text);
    rl_free(file);
}

static void fit_is_near_the_integral(void **state)
{
    static float got[2 * PAIRS];
    double worst = 0, narrow = 0, wide = 0, worst_mean = 0;
    (void)state;
    run_kernel(got);
    for (int i = 0; i < SHARPNESSES; i++) {
        double lambda = sharpness(i), mean = 0, weight = 0;
        for (int j = 0; j < ANGLES; j++) {
            double mu = cosine(j), e = (double)got[i * ANGLES + j], want = blurred(sqrt(lambda), 1, mu),
                   w = sin(pi * j / (ANGLES - 1));
            worst = fmax(worst, fabs(e - want));
            if (lambda < 0.0999)
                wide = fmax(wide, fabs(e - want));
            double twin = twin_sg_irradiance((float)lambda, (float)mu);
            narrow = fmax(narrow, fabs(e - twin));
            mean += w * e;
            weight += w;
        }
        worst_mean = fmax(worst_mean,
                          fabs(mean / weight / 0.25 - 1)); /* a blur keeps the mean over all normals, 1/4 */
    }
    print_message("irradiance: largest error of the fit %.4f (below lambda 0.1: %.1g), of float %.1g; energy "
                  "within %.1f %%\n",
                  worst, wide, narrow, 100 * worst_mean);
    assert_true(worst < 0.020);
    assert_true(wide < 1e-4);
    assert_true(narrow < 3e-6);
    assert_true(worst_mean < 0.05);
}

static void sharp_is_lambert(void **state)
{
    double worst = 0, away = 0;
    (void)state;
    for (int j = 0; j < ANGLES; j++) {
        double mu = cosine(j), e = fabs(twin_sg_irradiance(1e4, mu) - fmax(mu, 0));
        worst = fmax(worst, e);
        if (fabs(mu) > 0.05)
            away = fmax(away, e);
    }
    print_message("lambda 1e4 against Lambert: %.4f, away from the terminator %.1g\n", worst, away);
    assert_true(worst < 0.005); /* the Gaussian's own width there: 0.01 / sqrt(2 pi) */
    assert_true(away < 2e-4);
}

static void sharpness_follows_radius_and_variance(void **state)
{
    static float got[2 * PAIRS];
    (void)state;
    run_kernel(got);
    for (int i = 0; i < PAIRS; i++) {
        double r = 1000 / (double)(float)sharpness(i / ANGLES), want = fmin(fmax(r * r / 2, 1e-3), 1e4);
        assert_true(fabs((double)got[PAIRS + i] / want - 1) < 1e-5);
    }
}

/* ---- through the pass -------------------------------------------------------------------------------------
 */

typedef struct ball {
    shade_scene scene;
    shade_run run;
    size_t material;
} ball;

/* Every pixel is a piece of a surface that faces +z, 2 m below a point light, albedo 0.5, radius 10 mm. */
static void make_ball(ball *b)
{
    assert_true(shade_scene_make(&b->scene, 33, 9, 0, 0, 1));
    frame_t *f = &b->scene.frame;
    shade_materials *m = &b->scene.materials;
    b->material = shade_material_add(m, true);
    f->lights = 1;
    f->materials = (int)m->n;
    shade_camera(&f->camera, (double[]){0, 0, 1}, 0, 0);
    f->camera.focal[0] = f->camera.focal[1] = 1000;
    f->camera.centre[0] = 16.5f;
    f->camera.centre[1] = 4.5f;
    f->camera.jitter[0] = f->camera.jitter[1] = 0;
    shade_material_set(m, b->material, "shading", "diffuse", (double[]){2});
    shade_material_set(m, b->material, "shading", "specular", (double[]){1});
    shade_material_set(m, b->material, "profile", "sg_variance_mm2", (double[]){100, 10, 1});
    for (int port = LIGHTING_THICKNESS; port < LIGHTING_DIFFUSE; port++)
        shade_fill(&b->scene.images[port], f, (double[]){0, 0, 0});
    shade_fill(&b->scene.images[LIGHTING_SHADOW], f, (double[]){1, 1, 1});
    shade_fill(&b->scene.images[LIGHTING_ALBEDO], f, (double[]){0.5, 0.5, 0.5});
    shade_fill(&b->scene.images[LIGHTING_NORMAL], f, (double[]){0, 0, 1});
    shade_fill(&b->scene.images[LIGHTING_DEPTH], f, (double[]){1});
    shade_fill(&b->scene.images[LIGHTING_CURVATURE], f, (double[]){100});
    for (int y = 0; y < 9; y++)
        for (int x = 0; x < 33; x++)
            shade_set_id(&b->scene.images[LIGHTING_STENCIL], f, x, y, (uint32_t)b->material);
    b->scene.lights[0] = (light_t){.type = LIGHT_POINT,
                                   .position = {0, 0, 2},
                                   .direction = {0, 0, -1},
                                   .intensity = {4, 4, 4},
                                   .shadow = 0,
                                   .shadow_thickness = 0};
    b->run = shade_scene_lighting(&b->scene);
    b->run.images[LIGHTING_SMOOTH_NORMAL] = NULL;
}

static void set_layer(ball *b, int port, double x, double y, double z)
{
    shade_fill(&b->scene.images[port], &b->scene.frame, (double[]){x, y, z});
}

/* `lit` in the middle; `diffuse` must be 0. */
static void shade_middle(ball *b, double *lit)
{
    const frame_t *f = &b->scene.frame;
    assert_true(shade_execute(&b->run));
    for (int c = 0; c < 3; c++) {
        lit[c] = *shade_at(&b->scene.images[LIGHTING_LIT], f, c, 16, 4);
        assert_true(*shade_at(&b->scene.images[LIGHTING_DIFFUSE], f, c, 16, 4) == 0);
    }
}

static void assert_near(double got, double want, double relative)
{
    if (fabs(got - want) > relative * fabs(want) + 1e-9)
        fail_msg("got %.9g, expected %.9g", got, want);
}

static const double unit = 0.5 / 3.14159265358979323846; /* albedo/pi, E = 4/2^2 */

static void irradiance_is_complete_in_lit(void **state)
{
    static const double lambda[] = {1, 10, 100};
    ball b;
    double lit[3];
    (void)state;
    make_ball(&b);
    for (int hollow = 0; hollow < 2; hollow++) {
        set_layer(&b, LIGHTING_CURVATURE, hollow ? -100 : 100, 0, 0);
        shade_middle(&b, lit);
        for (int c = 0; c < 3; c++) {
            assert_near(lit[c], unit * twin_sg_irradiance(lambda[c], 1), 1e-5);
            assert_true(fabs(lit[c] / unit - blurred(10, 100 / lambda[c], 1)) < 0.02);
        }
    }
    /* The albedo is applied once, whatever the texturing mode; visibility multiplies. */
    shade_material_set(&b.scene.materials, b.material, "profile", "texturing", (double[]){1});
    set_layer(&b, LIGHTING_SHADOW, 0.25, 0.25, 0.25);
    shade_middle(&b, lit);
    assert_near(lit[0], unit / 4 * twin_sg_irradiance(1, 1), 1e-5);
    /* On the far side, too: n.l = -1/2, no shadow thickness. */
    b.scene.lights[0].position[0] = 2 * sqrtf(0.75f);
    b.scene.lights[0].position[2] = -1;
    b.scene.lights[0].shadow_thickness = -1;
    shade_middle(&b, lit);
    for (int c = 0; c < 3; c++)
        assert_near(lit[c], unit / 4 * twin_sg_irradiance(lambda[c], -0.5), 1e-5);
    /* A plane is Lambert, and so is a material without a profile. */
    b.scene.lights[0].position[2] = 1;
    set_layer(&b, LIGHTING_CURVATURE, 0, 0, 0);
    shade_middle(&b, lit);
    assert_near(lit[1], unit / 4 * 0.5, 1e-4);
    b.scene.materials.words[b.material][0] = 0;
    set_layer(&b, LIGHTING_CURVATURE, 100, 0, 0);
    shade_middle(&b, lit);
    assert_near(lit[1], unit / 4 * 0.5, 1e-6);
    shade_scene_free(&b.scene);
}

static void variance_defaults_to_that_of_burley(void **state)
{
    ball b;
    double lit[3], second = 0;
    (void)state;
    /* Half of the second moment of s (e^-sr + e^-sr/3)/(8 pi r), d = 1, by quadrature. */
    for (int i = 0; i < 200000; i++) {
        double r = (i + 0.5) * 5e-4;
        second += 5e-4 * r * r * (exp(-r) + exp(-r / 3)) / 4 / 2;
    }
    assert_near(second, 7, 1e-4);
    make_ball(&b);
    shade_material_set(&b.scene.materials, b.material, "profile", "sg_variance_mm2", (double[]){-1, -1, -1});
    shade_material_set(&b.scene.materials, b.material, "profile", "scatter_distance_mm",
                       (double[]){3, 1.2, 0.7});
    shade_middle(&b, lit);
    assert_near(lit[0], unit * twin_sg_irradiance(100 / (7 * 9.0), 1), 1e-5);
    assert_near(lit[2], unit * twin_sg_irradiance(100 / (7 * 0.49), 1), 1e-5);
    shade_scene_free(&b.scene);
}

/* A bump of variance u blurred by v keeps u/(u+v) of its height: by quadrature at its top, in one dimension a
 * axis. So much of the tilt between smooth and shading normal must be left. */
static void normals_soften_a_channel_at_a_time(void **state)
{
    static const double v[] = {100, 10, 1};
    ball b;
    double lit[3], u = 4, tilt = 0.05;
    (void)state;
    make_ball(&b);
    b.run.images[LIGHTING_SMOOTH_NORMAL] = &b.scene.images[LIGHTING_SMOOTH_NORMAL];
    set_layer(&b, LIGHTING_SMOOTH_NORMAL, 0, 0, 1);
    set_layer(&b, LIGHTING_NORMAL, sin(tilt), 0, cos(tilt));
    set_layer(&b, LIGHTING_CURVATURE, 1e-3, 0, 0); /* flat: E = mu */
    shade_material_set(&b.scene.materials, b.material, "material", "normal_detail_mm", (double[]){sqrt(u)});
    b.scene.lights[0].position[0] = 2 * sqrtf(0.5f); /* 45 degrees off: E = (cos + sin tilt) / sqrt 2 */
    b.scene.lights[0].position[2] = 2 * sqrtf(0.5f);
    shade_middle(&b, lit);
    for (int c = 0; c < 3; c++) {
        double kept = 0, whole = 0;
        for (int i = -4000; i <= 4000; i++) {
            double x = i * 0.02;
            kept += exp(-x * x / 2 / u) * exp(-x * x / 2 / v[c]);
            whole += exp(-x * x / 2 / v[c]);
        }
        double keep = (kept / whole) * (kept / whole), got = lit[c] / unit * sqrt(2) - 1;
        assert_true(fabs(got - keep * tilt) < 0.02 * tilt + 0.5 * tilt * tilt);
    }
    shade_scene_free(&b.scene);
}

/* The far side of a ball is in the shadow of the ball itself, which must not cut the Gaussian off; a shadow
 * from afar does. */
static void own_shadow_is_none(void **state)
{
    ball b;
    double lit[3];
    (void)state;
    make_ball(&b);
    shade_material_set(&b.scene.materials, b.material, "shading", "transmission", (double[]){0});
    b.scene.lights[0].position[0] = 2 * sqrtf(0.75f);
    b.scene.lights[0].position[2] = -1;
    set_layer(&b, LIGHTING_SHADOW, 0, 0, 0);
    for (int i = 0; i < 3; i++) {
        static const double thickness[] = {0.010, 0.020,
                                           0.03}; /* the chord 2 r |n.l|; twice that and 1 mm is the limit */
        set_layer(&b, LIGHTING_SHADOW_THICKNESS, thickness[i], thickness[i], thickness[i]);
        shade_middle(&b, lit);
        if (i < 2)
            assert_near(lit[0], unit * twin_sg_irradiance(1, -0.5), 1e-5);
        else
            assert_true(lit[0] == 0);
    }
    shade_scene_free(&b.scene);
}

/* The ball with 33 normals, a column each; `lit` gets the middle row. */
static void shade_columns(ball *b, double px, bool scatters, double lit[3][33])
{
    const frame_t *f = &b->scene.frame;
    b->run.frame.camera.focal[0] = (float)px;
    b->scene.materials.words[b->material][0] = scatters;
    assert_true(shade_execute(&b->run));
    for (int c = 0; c < 3; c++)
        for (int x = 0; x < 33; x++)
            lit[c][x] = *shade_at(&b->scene.images[LIGHTING_LIT], f, c, x, 4);
}

/* From so far away that Burley's filter of that variance is under half a pixel nothing scatters, as with the
 * other models: what comes out is Lambert's, on any curvature, at the terminator and with bumps, from lights
 * and from the sky. A little nearer it is the Gaussian. */
static void far_away_is_the_unfiltered_surface(void **state)
{
    ball b;
    ambient_t sky = {.on = 1, .lobes = 1, .lobe = {{{0.6f, 0, 0.8f}, 30, {0.1f, 0.1f, 0.1f}}}};
    double bare[3][33], lit[3][33], worst = 0, near = 0;
    (void)state;
    make_ball(&b);
    for (int i = 0; i < 27; i++)
        sky.sh[i] = i < 3 ? 0.3f : 0.03f;
    shade_material_set(&b.scene.materials, b.material, "profile", "sg_variance_mm2",
                       (double[]){100, 100, 100});
    b.run.images[LIGHTING_SMOOTH_NORMAL] = &b.scene.images[LIGHTING_SMOOTH_NORMAL];
    b.run.ambient = &sky;
    set_layer(&b, LIGHTING_SMOOTH_NORMAL, 0, 0, 1);
    for (int x = 0; x < 33; x++)
        for (int i = 0; i < 3; i++) {
            double turn = (x - 16) * 0.15;
            *shade_at(&b.scene.images[LIGHTING_NORMAL], &b.scene.frame, i, x, 4) =
                (float)(i == 0   ? sin(turn)
                        : i == 1 ? 0
                                 : cos(turn));
        }
    /* 0.445 pixels, 1 m away, and 0.56 */
    double pixels = 1000 / (16.5644 * sqrt(100.0 / 7));
    shade_columns(&b, 0.445 * pixels, false, bare);
    shade_columns(&b, 0.445 * pixels, true, lit);
    for (int i = 0; i < 3 * 33; i++)
        worst = fmax(worst, fabs(lit[i / 33][i % 33] / bare[i / 33][i % 33] - 1));
    shade_columns(&b, 0.56 * pixels, false, bare);
    shade_columns(&b, 0.56 * pixels, true, lit);
    for (int i = 0; i < 3 * 33; i++)
        near = fmax(near, fabs(lit[i / 33][i % 33] / bare[i / 33][i % 33] - 1));
    print_message("far away: largest difference to no scattering %.2g %%, nearer %.0f %%\n", 100 * worst,
                  100 * near);
    assert_true(worst < 0.005);
    assert_true(near > 0.2);
    shade_scene_free(&b.scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(fit_is_near_the_integral),
        cmocka_unit_test(sharp_is_lambert),
        cmocka_unit_test(sharpness_follows_radius_and_variance),
        cmocka_unit_test(irradiance_is_complete_in_lit),
        cmocka_unit_test(variance_defaults_to_that_of_burley),
        cmocka_unit_test(normals_soften_a_channel_at_a_time),
        cmocka_unit_test(own_shadow_is_none),
        cmocka_unit_test(far_away_is_the_unfiltered_surface),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
