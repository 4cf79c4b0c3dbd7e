/* The motion that temporal anti-aliasing finds without a motion layer: against its twin, and against the
 * truth. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "tests/shade_scene.h"
#include "tests/temporal_scene.h"
#include "tests/twin_motion.h"

extern const rl_pass rl_pass_taa;

typedef struct pair {
    shade_image images[TAA_PORTS];
    shade_materials materials;
    twin_taa_params params;
    shade_run run;
    temporal_frame before, now;
} pair;

static void set_camera(camera_t *c, const temporal_frame *f, int x0, int y0)
{
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 4; j++)
            c->to_view[4 * i + j] = (float)f->to_camera[4 * i + j];
        double back = 0;
        for (int j = 0; j < 3; j++) {
            c->to_world[4 * i + j] = (float)f->to_camera[4 * j + i];
            back -= f->to_camera[4 * j + i] * f->to_camera[4 * j + 3];
        }
        c->to_world[4 * i + 3] = (float)back;
    }
    c->focal[0] = c->focal[1] = (float)(0.5 * f->width / tan(0.5 * f->fov_x));
    c->centre[0] = (float)(x0 + 0.5 * f->width);
    c->centre[1] = (float)(y0 + 0.5 * f->height);
    c->jitter[0] = (float)f->jitter[0];
    c->jitter[1] = (float)f->jitter[1];
}

static void put_frame(pair *p, const temporal_frame *from, int color, int depth, int stencil)
{
    const frame_t *f = &p->run.frame;
    for (int y = 0; y < from->height; y++) {
        for (int x = 0; x < from->width; x++) {
            size_t i = (size_t)(y * from->width + x);
            int bx = x + f->valid[0], by = y + f->valid[1];
            for (int c = 0; c < 3; c++)
                *shade_at(&p->images[color], f, c, bx, by) = from->color[c][i];
            *shade_at(&p->images[depth], f, 0, bx, by) = from->depth[i];
            shade_set_id(&p->images[stencil], f, bx, by, from->id[i]);
        }
    }
}

/* Frames `number` - 1 and `number` of a scene, whose data window begins at (x0, y0); the motion is found. */
static void find(pair *p, const temporal_scene *s, int number, int x0, int y0, int lanes)
{
    static const int planes[TAA_PORTS] = {3, 1, 2, 1, 3, 1, 1, 1, 2, 3, 1};
    double jitter[2];
    memset(p, 0, sizeof *p);
    p->run =
        (shade_run){.pass = &rl_pass_taa, .frame = shade_frame(s->width, s->height, x0, y0), .lanes = lanes};
    shade_params_default(&rl_pass_taa, &p->params);
    for (int i = 0; i < TAA_PORTS; i++) {
        p->images[i] = shade_image_new(&p->run.frame, planes[i]);
        assert_non_null(p->images[i].data);
        p->run.images[i] = i == TAA_MOTION ? NULL : &p->images[i];
    }
    assert_true(temporal_frame_new(&p->before, s->width, s->height));
    assert_true(temporal_frame_new(&p->now, s->width, s->height));
    temporal_jitter(number - 1, jitter);
    temporal_render(s, number - 1, jitter, &p->before);
    temporal_jitter(number, jitter);
    temporal_render(s, number, jitter, &p->now);
    put_frame(p, &p->before, TAA_LAST_COLOR, TAA_LAST_DEPTH, TAA_LAST_STENCIL);
    put_frame(p, &p->now, TAA_COLOR, TAA_DEPTH, TAA_STENCIL);
    set_camera(&p->run.frame.previous, &p->before, x0, y0);
    set_camera(&p->run.frame.camera, &p->now, x0, y0);
    p->run.frame.history = 1;
    p->run.params = &p->params;
    p->run.materials = &p->materials;
    assert_true(shade_execute(&p->run));
}

static void release(pair *p)
{
    for (int i = 0; i < TAA_PORTS; i++)
        shade_image_free(&p->images[i]);
    temporal_frame_free(&p->before);
    temporal_frame_free(&p->now);
}

static void agrees_with_twin(void **state)
{
    static const struct {
        int x0, y0, lanes;
        bool camera, object, plain;
    } cases[] = {{3, 5, 16, true, true, false},
                 {-70, 12, 16, false, true, true},
                 {64, 3, 8, false, true, false},
                 {1, -9, 4, true, true, false},
                 {0, 0, 16, true, false, false}};
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        pair p;
        const temporal_scene s = {.width = 131,
                                  .height = 74,
                                  .camera_moves = cases[i].camera,
                                  .object_moves = cases[i].object,
                                  .plain = cases[i].plain};
        find(&p, &s, 7, cases[i].x0, cases[i].y0, cases[i].lanes);
        const frame_t *f = &p.run.frame;
        int n = 0, otherwise = 0, moved = 0;
        double worst = 0, want[2], camera[2], then;
        for (int y = f->valid[1]; y < f->valid[3]; y += 3) {
            for (int x = f->valid[0]; x < f->valid[2]; x += 3) {
                twin_motion(&p.run, x, y, want);
                twin_follow(f, x, y, twin_depth(&p.run, TAA_DEPTH, x, y), camera, &then);
                double off = fmax(fabs(*shade_at(&p.images[TAA_MOVED], f, 0, x, y) - want[0]),
                                  fabs(*shade_at(&p.images[TAA_MOVED], f, 1, x, y) - want[1]));
                n++;
                moved += fabs(want[0] - camera[0]) > 0.05;
                otherwise += off > 0.02;
                worst = fmax(worst, off > 0.02 ? 0 : off);
            }
        }
        print_message("case %zu: %d pixels, %d moved by themselves, largest difference %.2g, %d otherwise\n",
                      i, n, moved, worst, otherwise);
        assert_true(otherwise * 100 <= n); /* what hangs on a threshold may fall on its other side */
        assert_true(cases[i].object ? moved * 50 > n : moved == 0);
        release(&p);
    }
}

/* The sphere goes right and spins; what stands still stays exactly where it is. */
static void what_moves_is_followed(void **state)
{
    const temporal_scene s = {.width = 192, .height = 108, .object_moves = true};
    pair p;
    (void)state;
    find(&p, &s, 7, 0, 0, 16);
    double sum = 0;
    int n = 0, wall = 0, wrong = 0;
    for (int y = 0; y < s.height; y++) {
        for (int x = 0; x < s.width; x++) {
            size_t i = (size_t)(y * s.width + x);
            double dx = *shade_at(&p.images[TAA_MOVED], &p.run.frame, 0, x, y);
            double dy = *shade_at(&p.images[TAA_MOVED], &p.run.frame, 1, x, y);
            if (p.now.id[i] == SCENE_PLANE) {
                wall++;
                wrong += dx != 0 || dy != 0;
                continue;
            }
            if (fabs(temporal_beside_sphere(&s, 7, x, y)) > 0 || dx > 1e6)
                continue;
            sum += fmin(hypot(dx - (double)p.now.motion[0][i], dy - (double)p.now.motion[1][i]), 2);
            n++;
        }
    }
    print_message(
        "the sphere's motion is off by %.2f pixels in the mean; %d of %d pixels of the wall moved\n", sum / n,
        wrong, wall);
    assert_true(sum / n < 0.6); /* it moves by 2.3 to 2.9; both frames are point samples */
    assert_int_equal(wrong, 0);
    release(&p);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(agrees_with_twin),
        cmocka_unit_test(what_moves_is_followed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
