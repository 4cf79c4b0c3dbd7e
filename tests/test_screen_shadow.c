/* shadow: screen. The march against its twin in double on random depth. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "tests/shade_scene.h"
#include "tests/twin_march.h"

extern const rl_pass rl_pass_lighting;

typedef struct setup {
    frame_t frame;
    shade_image images[LIGHTING_PORTS];
    shade_materials materials;
} setup;

static const rl_pass *const passes[] = {&rl_pass_lighting};

/* Waves, with boxes in front of them and holes in them. */
static void make_depth(setup *s, uint64_t *seed)
{
    const frame_t *f = &s->frame;
    int boxes[12][4];
    double nearer[12];
    for (int i = 0; i < 12; i++) {
        nearer[i] = i < 9 ? 0.05 + 0.4 * shade_random(seed) : -1;
        for (int k = 0; k < 2; k++) {
            boxes[i][k] = f->valid[k] + (int)(shade_random(seed) * (f->valid[k + 2] - f->valid[k]));
            boxes[i][k + 2] = boxes[i][k] + 1 + (int)(shade_random(seed) * 14);
        }
    }
    for (int y = f->valid[1]; y < f->valid[3]; y++)
        for (int x = f->valid[0]; x < f->valid[2]; x++) {
            double z = 1.2 + 0.1 * sin(x / 9.0) + 0.1 * cos(y / 7.0) + 0.002 * y;
            for (int i = 0; i < 12; i++)
                if (x >= boxes[i][0] && x < boxes[i][2] && y >= boxes[i][1] && y < boxes[i][3])
                    z = nearer[i] < 0 || z == 0 ? 0 : z - nearer[i] * 0.5;
            *shade_at(&s->images[LIGHTING_DEPTH], f, 0, x, y) = (float)z;
            shade_set_id(&s->images[LIGHTING_STENCIL], f, x, y, z > 0);
        }
}

static setup make(int w, int h, int x0, int y0, uint64_t *seed)
{
    static const int planes[LIGHTING_PORTS] = {
        [LIGHTING_ALBEDO] = 3,  [LIGHTING_NORMAL] = 3,  [LIGHTING_DEPTH] = 1,
        [LIGHTING_STENCIL] = 1, [LIGHTING_DIFFUSE] = 3, [LIGHTING_LIT] = 3};
    setup s = {.frame = shade_frame(w, h, x0, y0), .materials = {.passes = passes, .n_passes = 1}};
    camera_t *c = &s.frame.camera;
    *c = (camera_t){.focal = {1.7f * (float)w, 1.5f * (float)w},
                    .jitter = {0.25f, -0.375f},
                    .centre = {(float)x0 + 0.45f * (float)w, (float)y0 + 0.6f * (float)h}};
    shade_camera(c, (double[]){0.3, -0.2, 0.9}, 0.4, -0.3);
    s.frame.number = 7;
    s.frame.lights = 2;
    for (int i = 0; i < 2; i++) {
        size_t m = shade_material_add(&s.materials, false);
        assert_true(shade_material_set(&s.materials, m, "shading", "diffuse", (double[]){1}));
        assert_true(shade_material_set(&s.materials, m, "shading", "specular", (double[]){1}));
    }
    s.frame.materials = 2;
    for (int i = 0; i < LIGHTING_PORTS; i++)
        if (planes[i]) {
            s.images[i] = shade_image_new(&s.frame, planes[i]);
            assert_non_null(s.images[i].data);
        }
    make_depth(&s, seed);
    return s;
}

static void free_setup(setup *s)
{
    for (int i = 0; i < LIGHTING_PORTS; i++)
        shade_image_free(&s->images[i]);
}

/* Before the camera, behind it, or far away. */
static light_t random_light(const setup *s, uint64_t *seed)
{
    light_t l = {.type = shade_random(seed) < 0.3 ? LIGHT_DIRECTIONAL : LIGHT_POINT,
                 .shadow = SHADOW_MARCH,
                 .shadow_thickness = -1,
                 .intensity = {1, 1, 1}};
    double view[3] = {shade_random(seed) * 2 - 1, shade_random(seed) * 2 - 1, 0.6 - 1.6 * shade_random(seed)},
           length = 0;
    const camera_t *c = &s->frame.camera;
    for (int i = 0; i < 3; i++) {
        double p = 0;
        for (int k = 0; k < 3; k++)
            p += (double)c->to_world[4 * i + k] * view[k];
        length += p * p;
        l.position[i] = (float)(p + (double)c->to_world[4 * i + 3]);
        l.direction[i] = (float)-p;
    }
    for (int i = 0; i < 3; i++)
        l.direction[i] /= (float)sqrt(length);
    return l;
}

/* Every surface faces the light, so that each is lit unless shadowed. */
static void face(setup *s, const light_t *l)
{
    const frame_t *f = &s->frame;
    for (int y = f->valid[1]; y < f->valid[3]; y++)
        for (int x = f->valid[0]; x < f->valid[2]; x++) {
            double view[3], w[3], n[3], z = (double)*shade_at(&s->images[LIGHTING_DEPTH], f, 0, x, y);
            twin_ray(f, &f->camera, x, y, view, w);
            for (int i = 0; i < 3; i++)
                n[i] = l->type == LIGHT_DIRECTIONAL
                           ? -(double)l->direction[i]
                           : (double)l->position[i] - (double)f->camera.to_world[4 * i + 3] - z * w[i];
            double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
            for (int i = 0; i < 3; i++) {
                *shade_at(&s->images[LIGHTING_NORMAL], f, i, x, y) = (float)(n[i] / length);
                *shade_at(&s->images[LIGHTING_ALBEDO], f, i, x, y) = 1;
            }
        }
}

/* Counts what differs where the twin is sure, what is shadowed, and all. */
typedef struct tally {
    size_t wrong, shadowed, unsure, all;
} tally;

static void compare(const setup *s, const march_params *p, const light_t *light, int which, tally *t)
{
    const frame_t *f = &s->frame;
    for (int y = f->valid[1]; y < f->valid[3]; y++)
        for (int x = f->valid[0]; x < f->valid[2]; x++) {
            float lit = *shade_at(&s->images[LIGHTING_LIT], f, 0, x, y);
            if (!shade_id(&s->images[LIGHTING_STENCIL], f, x, y)) {
                assert_true(lit == 0);
                continue;
            }
            double margin;
            int visible = twin_march(f, p, &s->images[LIGHTING_DEPTH], light, which, x, y, &margin);
            t->all++;
            t->shadowed += !visible;
            t->unsure += margin < 2e-6;
            t->wrong += margin >= 2e-6 && visible != (lit > 0);
        }
}

static void test_twin(void **state)
{
    (void)state;
    uint64_t seed = 5;
    tally t = {0};
    static const march_params params[] = {
        {4096, 0.2f, 0.001f, 1, 0}, {9, 0.1f, 0.003f, 1, 77}, {13, 1e3f, 0, 0, 3}};
    for (int i = 0; i < 18; i++) {
        setup s = make(70 + 5 * (i % 4), 41, i % 5 * 37, i % 3 * 10, &seed);
        light_t lights[2] = {random_light(&s, &seed), random_light(&s, &seed)};
        int which = i % 2;
        memset(lights[!which].intensity, 0, sizeof lights->intensity);
        face(&s, &lights[which]);
        shade_run run = {.pass = &rl_pass_lighting,
                         .frame = s.frame,
                         .params = &params[i % 3],
                         .materials = &s.materials,
                         .lights = lights,
                         .lanes = (int[]){16, 8, 4}[i % 3]};
        for (int k = 0; k < LIGHTING_PORTS; k++)
            run.images[k] = s.images[k].data ? &s.images[k] : NULL;
        assert_true(shade_execute(&run));
        compare(&s, &params[i % 3], &lights[which], which, &t);
        free_setup(&s);
    }
    printf("twin: %zu of %zu pixels differ, %zu shadowed, %zu too near to call\n", t.wrong, t.all, t.shadowed,
           t.unsure);
    assert_int_equal(t.wrong, 0);
    assert_true(t.shadowed > t.all / 20 && t.shadowed < t.all * 3 / 4);
    assert_true(t.unsure < t.all / 200);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_twin)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
