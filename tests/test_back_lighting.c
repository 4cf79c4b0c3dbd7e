/* back_lighting against plain C in double on random scenes; whose shadow the back face is in. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <cmocka.h>

#include "tests/shade_scene.h"

extern const rl_pass rl_pass_back_lighting;

enum {
    BACK_ALBEDO_FRONT,
    BACK_ALBEDO,
    BACK_NORMAL,
    BACK_DEPTH,
    BACK_FRONT_DEPTH,
    BACK_STENCIL,
    BACK_SHADOW,
    BACK_SHADOW_THICKNESS,
    BACK_METALLIC,
    BACK_DIFFUSE,
    BACK_PORTS
};
enum { GATHER = 4, AWAY = 0, TOWARDS_CAMERA = 1 };

static const double pi = 3.14159265358979323846;

typedef struct back {
    shade_scene scene;
    shade_image albedo, normal, depth, diffuse;
    ambient_t ambient;
    int32_t facing;
    shade_run run;
} back;

static void back_make(back *b, int w, int h, int x0, int y0, uint64_t seed)
{
    assert_true(shade_scene_make(&b->scene, w, h, x0, y0, seed));
    const frame_t *f = &b->scene.frame;
    b->albedo = shade_image_new(f, 3);
    b->normal = shade_image_new(f, 3);
    b->depth = shade_image_new(f, 1);
    b->diffuse = shade_image_new(f, 3);
    assert_true(b->albedo.data && b->normal.data && b->depth.data && b->diffuse.data);
    for (size_t id = 1; id < b->scene.materials.n; id++) {
        double word = id % 5 == 1 ? 2 : GATHER, on = id % 7 != 5;
        assert_true(shade_material_set(&b->scene.materials, id, "profile", "transmission", &word));
        assert_true(shade_material_set(&b->scene.materials, id, "shading", "transmission", &on));
    }
    for (int y = f->valid[1]; y < f->valid[3]; y++)
        for (int x = f->valid[0]; x < f->valid[2]; x++) {
            float z = *shade_at(&b->scene.images[LIGHTING_DEPTH], f, 0, x, y);
            double thick = 0.02 * shade_random(&seed);
            *shade_at(&b->depth, f, 0, x, y) = shade_random(&seed) < 0.1 ? 0 : z + (float)thick;
            for (int c = 0; c < 3; c++) {
                *shade_at(&b->albedo, f, c, x, y) = (float)shade_random(&seed);
                *shade_at(&b->normal, f, c, x, y) =
                    *shade_at(&b->scene.images[LIGHTING_SMOOTH_NORMAL], f, c, x, y);
            }
        }
    b->ambient =
        (ambient_t){.on = (int)(seed & 1), .sh = {3.5449077f, 1.7724539f, 0}}; /* radiance 1, 1/2, 0 */
    b->facing = AWAY;
    shade_image *in = b->scene.images;
    b->run = (shade_run){.pass = &rl_pass_back_lighting,
                         .frame = *f,
                         .params = &b->facing,
                         .images = {&in[LIGHTING_ALBEDO], &b->albedo, &b->normal, &b->depth,
                                    &in[LIGHTING_DEPTH], &in[LIGHTING_STENCIL], &in[LIGHTING_SHADOW],
                                    &in[LIGHTING_SHADOW_THICKNESS], &in[LIGHTING_METALLIC], &b->diffuse},
                         .materials = &b->scene.materials,
                         .lights = b->scene.lights,
                         .ambient = &b->ambient};
}

static void back_free(back *b)
{
    shade_scene_free(&b->scene);
    shade_image_free(&b->albedo);
    shade_image_free(&b->normal);
    shade_image_free(&b->depth);
    shade_image_free(&b->diffuse);
}

/* ---- plain C ------------------------------------------------------------------------------------------ */

static double get(const shade_run *run, size_t id, const char *group, const char *key)
{
    double v[3] = {0};
    shade_material_get(run->materials, id, group, key, v);
    return v[0];
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double transmit(int diffuse, double c)
{
    return diffuse ? 1 : 1 - 0.5 * pow(1 - fmin(fabs(c), 1), 5);
}

/* Direction to the light from p, and E of a surface that faces it, without intensity. */
static double aim(const light_t *light, const double p[3], double l[3])
{
    double d2 = 0, along = 0;
    for (int i = 0; i < 3; i++) {
        l[i] = light->type == LIGHT_DIRECTIONAL ? -(double)light->direction[i]
                                                : (double)light->position[i] - p[i];
        d2 += l[i] * l[i];
    }
    if (light->type == LIGHT_DIRECTIONAL)
        return 1;
    for (int i = 0; i < 3; i++) {
        l[i] /= sqrt(d2);
        along -= l[i] * (double)light->direction[i];
    }
    double t = fmin(
        fmax((along - (double)light->cos_outer) / ((double)light->cos_inner - (double)light->cos_outer), 0),
        1);
    return (light->type == LIGHT_SPOT ? t * t * (3 - 2 * t) : 1) / d2;
}

static void twin(const shade_run *run, int x, int y, double out[3])
{
    const frame_t *f = &run->frame;
    const size_t id = shade_id(run->images[BACK_STENCIL], f, x, y);
    const double z = *shade_at(run->images[BACK_DEPTH], f, 0, x, y),
                 front = *shade_at(run->images[BACK_FRONT_DEPTH], f, 0, x, y);
    double view[3], w[3], p[3], n[3], sum[3] = {0};
    for (int c = 0; c < 3; c++)
        out[c] = 0;
    if (!id || z <= 0 || !run->materials->words[id][0] || get(run, id, "profile", "transmission") != GATHER ||
        get(run, id, "shading", "transmission") == 0)
        return;
    const int diffuse = (int)get(run, id, "shading", "diffuse");
    twin_ray(f, &f->camera, x, y, view, w);
    for (int i = 0; i < 3; i++) {
        p[i] = (double)f->camera.to_world[4 * i + 3] + z * w[i];
        n[i] = (double)*shade_at(run->images[BACK_NORMAL], f, i, x, y) *
               (*(const int32_t *)run->params ? -1 : 1);
    }
    for (int k = 0; k < f->lights; k++) {
        const light_t *light = &run->lights[k];
        double l[3], e = aim(light, p, l), nl = dot(n, l), visibility = 1;
        if (nl <= 0)
            continue;
        if (run->images[BACK_SHADOW] && light->shadow >= 0 && run->images[BACK_SHADOW_THICKNESS] &&
            light->shadow_thickness >= 0) {
            /* Where the light meets something first, above the plane of the back face. */
            double above = 0,
                   way = *shade_at(run->images[BACK_SHADOW_THICKNESS], f, light->shadow_thickness, x, y),
                   thick;
            for (int i = 0; i < 3; i++)
                above += ((front - z) * w[i] + way * l[i]) * n[i];
            thick = (z - front) * dot(w, n);
            if (thick <= 0)
                above = way * nl, thick = 0;
            if (above > thick + 1e-3)
                visibility = *shade_at(run->images[BACK_SHADOW], f, light->shadow, x, y);
        }
        for (int c = 0; c < 3; c++)
            sum[c] += (double)light->intensity[c] * e * nl * transmit(diffuse, nl) * visibility;
    }
    double metal = get(run, id, "material", "metallic"), length = sqrt(dot(w, w));
    if (metal < 0)
        metal = run->images[BACK_METALLIC] ? (double)*shade_at(run->images[BACK_METALLIC], f, 0, x, y) : 0;
    for (int c = 0; c < 3; c++) {
        const shade_image *albedo =
            run->images[BACK_ALBEDO] ? run->images[BACK_ALBEDO] : run->images[BACK_ALBEDO_FRONT];
        if (run->ambient->on)
            sum[c] += pi * (c == 0 ? 1 : c == 1 ? 0.5 : 0) * (diffuse ? 1 : 41.0 / 42);
        out[c] = sum[c] / pi * (1 - metal);
        out[c] *= get(run, id, "profile", "texturing") > 0 ? sqrt((double)*shade_at(albedo, f, c, x, y)) : 1;
        out[c] *=
            get(run, id, "shading", "exit_transmission") > 0 ? transmit(diffuse, dot(n, w) / length) : 1;
    }
}

static double against_twin(back *b, int *lit)
{
    const frame_t *f = &b->run.frame;
    double worst = 0;
    assert_true(shade_execute(&b->run));
    for (int y = f->valid[1]; y < f->valid[3]; y++)
        for (int x = f->valid[0]; x < f->valid[2]; x++) {
            double want[3];
            twin(&b->run, x, y, want);
            *lit += want[0] > 0;
            for (int c = 0; c < 3; c++)
                worst = fmax(worst, fabs((double)*shade_at(&b->diffuse, f, c, x, y) - want[c]) /
                                        fmax(want[c], 1e-3));
        }
    return worst;
}

static void agrees_with_twin(void **state)
{
    static const int sizes[][4] = {{131, 37, 5, 3}, {1, 1, -70, -3}, {257, 19, 63, -1}, {64, 4, 0, 0}};
    double worst = 0;
    int lit = 0;
    (void)state;
    for (size_t i = 0; i < 4; i++) {
        back b;
        back_make(&b, sizes[i][0], sizes[i][1], sizes[i][2], sizes[i][3], i + 3);
        b.facing = i == 2 ? TOWARDS_CAMERA : AWAY;
        b.run.lanes = i == 1 ? 4 : i == 2 ? 8 : 16;
        worst = fmax(worst, against_twin(&b, &lit));
        back_free(&b);
    }
    print_message("largest relative difference to plain C %.1e, %d pixels lit\n", worst, lit);
    assert_true(worst < 1e-5);
    assert_true(lit > 2000);
}

static void optional_layers_may_be_missing(void **state)
{
    static const int absent[] = {BACK_ALBEDO, BACK_SHADOW, BACK_SHADOW_THICKNESS, BACK_METALLIC};
    int lit = 0;
    (void)state;
    for (size_t i = 0; i < 4; i++) {
        back b;
        back_make(&b, 70, 11, 1, 2, 9 + i);
        b.run.images[absent[i]] = NULL;
        assert_true(against_twin(&b, &lit) < 1e-5);
        back_free(&b);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(agrees_with_twin),
        cmocka_unit_test(optional_layers_may_be_missing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
