/* The lighting kernel against its twin in double, and against photometry that can be worked out by hand. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <cmocka.h>

#include "tests/shade_scene.h"

static const double pi = 3.14159265358979323846;

/* Largest error of diffuse and lit over the buffer, relative to values above 1e-4 of a unit. Outside of the
 * valid rectangle and without a material both must be exactly 0. */
static double against_twin(const shade_run *run)
{
    double worst = 0;
    const frame_t *f = &run->frame;
    for (int y = 0; y < f->rows; y++) {
        for (int x = 0; x < f->columns; x++) {
            double want[6];
            twin_lighting(run, x, y, want, want + 3);
            bool empty = shade_id(run->images[LIGHTING_STENCIL], f, x, y) == 0;
            for (int c = 0; c < 6; c++) {
                double got = *shade_at(run->images[c < 3 ? LIGHTING_DIFFUSE : LIGHTING_LIT], f, c % 3, x, y);
                if (empty)
                    assert_true(got == 0);
                assert_true(isfinite(got));
                worst = fmax(worst, fabs(got - want[c]) / fmax(fabs(want[c]), 1e-4));
            }
        }
    }
    return worst;
}

static void agrees_with_twin(void **state)
{
    static const int sizes[][4] = {{131, 37, 5, 3}, {1, 1, -70, -3}, {257, 19, 63, -1}, {64, 4, 0, 0}};
    (void)state;
    for (size_t i = 0; i < 4; i++) {
        shade_scene s;
        assert_true(shade_scene_make(&s, sizes[i][0], sizes[i][1], sizes[i][2], sizes[i][3], i + 1));
        shade_run run = shade_scene_lighting(&s);
        run.lanes = i == 1 ? 4 : i == 2 ? 8 : 16;
        assert_true(shade_execute(&run));
        double worst = against_twin(&run);
        print_message("%dx%d: largest relative error %.2g\n", sizes[i][0], sizes[i][1], worst);
        assert_true(worst < 1e-5);
        shade_scene_free(&s);
    }
}

static void optional_layers_may_be_missing(void **state)
{
    shade_scene s;
    (void)state;
    assert_true(shade_scene_make(&s, 70, 11, 1, 2, 9));
    for (int absent = LIGHTING_THICKNESS; absent <= LIGHTING_EMISSION + 1; absent++) {
        shade_run run = shade_scene_lighting(&s);
        for (int port = LIGHTING_THICKNESS; port <= LIGHTING_EMISSION; port++)
            if (port == absent || absent > LIGHTING_EMISSION)
                run.images[port] = NULL;
        assert_true(shade_execute(&run));
        double worst = against_twin(&run);
        assert_true(worst <
                    2e-5); /* where scattering fades out, ten times what its radius in pixels is off */
    }
    shade_scene_free(&s);
}

static void phase_layout_holds_the_same_bits(void **state)
{
    shade_scene s;
    (void)state;
    assert_true(shade_scene_make(&s, 131, 37, 5, 3, 4));
    shade_image phased = shade_image_new(&s.frame, 3);
    shade_run run = shade_scene_lighting(&s);
    assert_true(shade_execute(&run));
    run.images[LIGHTING_DIFFUSE] = &phased;
    run.phase4[LIGHTING_DIFFUSE] = true;
    assert_true(shade_execute(&run));
    const frame_t *f = &s.frame;
    for (int y = 0; y < f->rows; y++) {
        for (int x = 0; x < f->columns; x++) {
            int row = ((y & 3) * 4 + (x & 3)) * (f->rows / 4) + y / 4;
            for (int c = 0; c < 3; c++) {
                float got = phased.data[c * f->plane4 + row * f->stride4 + RL_MARGIN4 + x / 4];
                assert_true(got == *shade_at(&s.images[LIGHTING_DIFFUSE], f, c, x, y));
            }
        }
    }
    shade_image_free(&phased);
    shade_scene_free(&s);
}

/* ---- one light, a wall that faces the camera
 * ----------------------------------------------------------------- */

typedef struct wall {
    shade_scene scene;
    shade_run run;
    size_t material;
} wall;

/* A white Lambertian wall with a subsurface material, facing +z at z = 0; the camera stands at z = 1. Light 0
 * is a point at (0, 0, 2). Specular is off. */
static void make_wall(wall *w)
{
    assert_true(shade_scene_make(&w->scene, 33, 9, 0, 0, 1));
    frame_t *f = &w->scene.frame;
    shade_materials *m = &w->scene.materials;
    w->material = shade_material_add(m, true);
    f->lights = 1;
    f->materials = (int)m->n;
    shade_camera(&f->camera, (double[]){0, 0, 1}, 0, 0);
    f->camera.centre[0] = 16.5f;
    f->camera.centre[1] = 4.5f;
    f->camera.jitter[0] = f->camera.jitter[1] = 0;
    shade_material_set(m, w->material, "shading", "diffuse", (double[]){1});
    shade_material_set(m, w->material, "shading", "specular", (double[]){1});
    for (int port = LIGHTING_THICKNESS; port < LIGHTING_DIFFUSE; port++)
        shade_fill(&w->scene.images[port], f, (double[]){0, 0, 0});
    shade_fill(&w->scene.images[LIGHTING_SHADOW], f, (double[]){1, 1, 1});
    shade_fill(&w->scene.images[LIGHTING_ALBEDO], f, (double[]){1, 1, 1});
    shade_fill(&w->scene.images[LIGHTING_NORMAL], f, (double[]){0, 0, 1});
    shade_fill(&w->scene.images[LIGHTING_DEPTH], f, (double[]){1});
    for (int y = 0; y < 9; y++)
        for (int x = 0; x < 33; x++)
            shade_set_id(&w->scene.images[LIGHTING_STENCIL], f, x, y, (uint32_t)w->material);
    w->scene.lights[0] = (light_t){.type = LIGHT_POINT,
                                   .position = {0, 0, 2},
                                   .direction = {0, 0, -1},
                                   .intensity = {4, 2, 1},
                                   .shadow = 0,
                                   .shadow_thickness = 0};
    w->run = shade_scene_lighting(&w->scene);
}

static void set_row(wall *w, const char *group, const char *key, double a, double b, double c)
{
    assert_true(shade_material_set(&w->scene.materials, w->material, group, key, (double[]){a, b, c}));
}

static void set_layer(wall *w, int port, double a)
{
    shade_fill(&w->scene.images[port], &w->scene.frame, (double[]){a, a, a});
}

/* Diffuse at a pixel; the middle (16, 4) is the point (0, 0, 0). */
static double diffuse_at(wall *w, int channel, int x, int y)
{
    assert_true(shade_execute(&w->run));
    return *shade_at(&w->scene.images[LIGHTING_DIFFUSE], &w->scene.frame, channel, x, y);
}

static void assert_near(double got, double want, double relative)
{
    if (fabs(got - want) > relative * fabs(want))
        fail_msg("got %.9g, expected %.9g", got, want);
}

static void point_light_follows_the_inverse_square(void **state)
{
    wall w;
    (void)state;
    make_wall(&w);
    assert_near(diffuse_at(&w, 0, 16, 4), 4 / pi / 4, 1e-6);
    assert_near(diffuse_at(&w, 2, 16, 4), 1 / pi / 4, 1e-6);
    w.scene.lights[0].position[2] = 4;
    assert_near(diffuse_at(&w, 0, 16, 4), 4 / pi / 16, 1e-6);
    /* 60 degrees off: cos / d^2 = 0.5 / 4^2 */
    w.scene.lights[0].position[0] = 2 * sqrtf(3);
    w.scene.lights[0].position[2] = 2;
    assert_near(diffuse_at(&w, 0, 16, 4), 4 / pi * 0.5 / 16, 1e-6);
    set_layer(&w, LIGHTING_SHADOW, 0.25);
    assert_near(diffuse_at(&w, 0, 16, 4), 4 / pi * 0.5 / 16 / 4, 1e-6);
    w.scene.lights[0].shadow = -1;
    assert_near(diffuse_at(&w, 0, 16, 4), 4 / pi * 0.5 / 16, 1e-6);
    w.scene.lights[0].type = LIGHT_DIRECTIONAL;
    w.scene.lights[0].direction[0] = -0.6f;
    w.scene.lights[0].direction[2] = -0.8f;
    assert_near(diffuse_at(&w, 0, 16, 4), 4 / pi * 0.8, 1e-6);
    shade_scene_free(&w.scene);
}

static void spot_cone_has_its_edges(void **state)
{
    wall w;
    (void)state;
    make_wall(&w);
    light_t *l = &w.scene.lights[0];
    double full = 4 / pi / 4, angle = 0.3;
    l->type = LIGHT_SPOT;
    l->cos_inner = cosf(0.25f);
    l->cos_outer = cosf(0.35f);
    assert_near(diffuse_at(&w, 0, 16, 4), full, 1e-6);
    /* The spot turns away from the middle of the wall: inside, between, outside. */
    for (int i = 0; i < 3; i++) {
        double turned = 0.2 + 0.1 * i, t;
        l->direction[0] = (float)sin(turned);
        l->direction[2] = (float)-cos(turned);
        t = (cos(turned) - l->cos_outer) / ((double)l->cos_inner - l->cos_outer);
        t = fmin(fmax(t, 0), 1);
        assert_near(diffuse_at(&w, 0, 16, 4), full * t * t * (3 - 2 * t), 2e-6);
    }
    /* No blend: a hard edge. */
    l->cos_inner = l->cos_outer = (float)cos(angle);
    for (int i = 0; i < 2; i++) {
        l->direction[0] = (float)sin(angle + (i ? 0.01 : -0.01));
        l->direction[2] = (float)-cos(angle + (i ? 0.01 : -0.01));
        assert_near(diffuse_at(&w, 0, 16, 4), i ? 0 : full, 1e-6);
    }
    shade_scene_free(&w.scene);
}

/* ---- light from behind
 * -------------------------------------------------------------------------------------- */

/* Golubev 2018: (e^-st + 3 e^-st/3) / 4, t in metres, d in mm. */
static double slab(double t, double d)
{
    double s = 1000 / d;
    return 0.25 * (exp(-s * t) + 3 * exp(-s * t / 3));
}

/* The light stands behind the wall, 2 m away, 60 degrees off: |n.l| = 0.5, E = 4 * 0.5 / 16. */
static void make_backlit(wall *w, double mode)
{
    make_wall(w);
    w->scene.lights[0].position[0] = 2 * sqrtf(3);
    w->scene.lights[0].position[2] = -2;
    set_row(w, "profile", "transmission", mode, 0, 0);
    set_row(w, "profile", "scatter_distance_mm", 3, 2, 1);
    set_layer(w, LIGHTING_SHADOW, 0);
}

static const double backlit = 4 * 0.5 / 16 / 3.14159265358979323846;

static void thick_takes_the_larger_thickness(void **state)
{
    wall w;
    (void)state;
    make_backlit(&w, 2);
    assert_true(diffuse_at(&w, 0, 16, 4) == 0); /* nothing known: nothing comes through */
    set_layer(&w, LIGHTING_THICKNESS, 0.002);
    assert_near(diffuse_at(&w, 0, 16, 4), backlit * slab(0.002, 3), 2e-6);
    assert_near(diffuse_at(&w, 2, 16, 4), backlit / 4 * slab(0.002, 1), 2e-6);
    set_layer(&w, LIGHTING_SHADOW_THICKNESS, 0.01); /* along the ray: 0.005 along the normal */
    assert_near(diffuse_at(&w, 0, 16, 4), backlit * slab(0.005, 3), 2e-6);
    set_row(&w, "profile", "thickness_from", 1, 0, 0);
    assert_near(diffuse_at(&w, 0, 16, 4), backlit * slab(0.002, 3), 2e-6);
    set_layer(&w, LIGHTING_THICKNESS, 0); /* unknown: the shadow's */
    assert_near(diffuse_at(&w, 0, 16, 4), backlit * slab(0.005, 3), 2e-6);
    set_row(&w, "profile", "thickness_from", 2, 0, 0);
    set_layer(&w, LIGHTING_THICKNESS, 0.02);
    assert_near(diffuse_at(&w, 0, 16, 4), backlit * slab(0.005, 3), 2e-6);
    set_row(&w, "shading", "transmission", 0, 0, 0);
    assert_true(diffuse_at(&w, 0, 16, 4) == 0);
    shade_scene_free(&w.scene);
}

static void thin_shares_one_visibility(void **state)
{
    wall w;
    (void)state;
    make_backlit(&w, 1);
    set_layer(&w, LIGHTING_THICKNESS, 0.002);
    set_layer(&w, LIGHTING_SHADOW_THICKNESS,
              0.0098); /* 4.9 mm along the normal: below 2 * 2 + 1, the leaf itself */
    assert_near(diffuse_at(&w, 0, 16, 4), backlit * slab(0.002, 3), 2e-6);
    set_layer(&w, LIGHTING_SHADOW_THICKNESS, 0.0102); /* something else is in front of it */
    assert_true(diffuse_at(&w, 0, 16, 4) == 0);
    set_layer(&w, LIGHTING_SHADOW, 0.5);
    assert_near(diffuse_at(&w, 0, 16, 4), backlit * slab(0.002, 3) / 2, 2e-6);
    w.scene.lights[0].shadow_thickness = -1; /* not known: the visibility counts */
    set_layer(&w, LIGHTING_SHADOW, 0.25);
    assert_near(diffuse_at(&w, 0, 16, 4), backlit * slab(0.002, 3) / 4, 2e-6);
    set_layer(&w, LIGHTING_THICKNESS, 0);
    assert_true(diffuse_at(&w, 0, 16, 4) == 0);
    shade_scene_free(&w.scene);
}

static void beer_lambert_decays_to_its_colour(void **state)
{
    wall w;
    (void)state;
    make_backlit(&w, 3);
    set_row(&w, "profile", "transmittance_color", 0.5, 0.25, 0.125);
    set_row(&w, "profile", "transmittance_distance_mm", 4, 0, 0);
    set_layer(&w, LIGHTING_THICKNESS, 0.004);
    assert_near(diffuse_at(&w, 0, 16, 4), backlit * 0.5, 2e-6);
    assert_near(diffuse_at(&w, 2, 16, 4), backlit / 4 * 0.125, 2e-6);
    set_layer(&w, LIGHTING_THICKNESS, 0.008);
    assert_near(diffuse_at(&w, 0, 16, 4), backlit * 0.25, 2e-6);
    shade_scene_free(&w.scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(agrees_with_twin),
        cmocka_unit_test(optional_layers_may_be_missing),
        cmocka_unit_test(phase_layout_holds_the_same_bits),
        cmocka_unit_test(point_light_follows_the_inverse_square),
        cmocka_unit_test(spot_cone_has_its_edges),
        cmocka_unit_test(thick_takes_the_larger_thickness),
        cmocka_unit_test(thin_shares_one_visibility),
        cmocka_unit_test(beer_lambert_decays_to_its_colour),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
