/* Temporal anti-aliasing against its twin, and on sequences whose result is known. */
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
#include "tests/twin_taa.h"

extern const rl_pass rl_pass_taa;

typedef struct taa_case {
    shade_image images[TAA_PORTS];
    shade_materials materials;
    twin_taa_params params;
    shade_run run;
} taa_case;

static void make_case(taa_case *t, int w, int h, int x0, int y0)
{
    static const int planes[TAA_PORTS] = {3, 1, 2, 1, 3, 1, 1, 1, 2, 3, 1};
    memset(t, 0, sizeof *t);
    t->run = (shade_run){.pass = &rl_pass_taa, .frame = shade_frame(w, h, x0, y0)};
    shade_params_default(&rl_pass_taa, &t->params);
    camera_t *c = &t->run.frame.camera;
    shade_camera(c, (double[]){0.1, 0.2, 1}, 0.3, -0.2);
    c->focal[0] = c->focal[1] = 2 * (float)w;
    c->centre[0] = (float)x0 + 0.5f * (float)w;
    c->centre[1] = (float)y0 + 0.5f * (float)h;
    t->run.frame.previous = *c;
    t->run.frame.history = 1;
    for (int i = 0; i < TAA_PORTS; i++) {
        t->images[i] = shade_image_new(&t->run.frame, planes[i]);
        assert_non_null(t->images[i].data);
        t->run.images[i] = &t->images[i];
    }
}

static void free_case(taa_case *t)
{
    for (int i = 0; i < TAA_PORTS; i++)
        shade_image_free(&t->images[i]);
}

static void execute(taa_case *t)
{
    t->run.params = &t->params;
    t->run.materials = &t->materials;
    assert_true(shade_execute(&t->run));
}

static float *at(taa_case *t, int port, int plane, int x, int y)
{
    return shade_at(&t->images[port], &t->run.frame, plane, x, y);
}

static void fill(taa_case *t, int port, double value)
{
    shade_fill(&t->images[port], &t->run.frame, (double[]){value, value, value});
}

static void fill_ids(taa_case *t, int port, uint32_t id)
{
    const frame_t *f = &t->run.frame;
    for (int y = f->valid[1]; y < f->valid[3]; y++)
        for (int x = f->valid[0]; x < f->valid[2]; x++)
            shade_set_id(&t->images[port], f, x, y, id);
}

/* ---- against the twin
 * ------------------------------------------------------------------------------------------ */

static void random_pixel(taa_case *t, int x, int y, uint64_t *seed)
{
    int patch = x / 9 * 7 + y / 6 * 5;
    double z = patch % 7 == 0 ? 0 : 0.5 + 0.1 * (patch % 5) + 0.002 * x;
    uint32_t id = z > 0 ? 1 + (uint32_t)(patch % 3) : 0;
    *at(t, TAA_DEPTH, 0, x, y) = (float)z;
    *at(t, TAA_LAST_DEPTH, 0, x, y) = (float)(z * (0.9 + 0.2 * shade_random(seed)));
    shade_set_id(&t->images[TAA_STENCIL], &t->run.frame, x, y, id);
    shade_set_id(&t->images[TAA_LAST_STENCIL], &t->run.frame, x, y, shade_random(seed) < 0.6 ? id : 2);
    *at(t, TAA_LAST_COUNT, 0, x, y) =
        (float)(floor(1 + 30 * shade_random(seed)) * (shade_random(seed) < 0.1 ? -1 : 1));
    for (int c = 0; c < 3; c++) {
        double bright = shade_random(seed) < 0.02 ? 300 : 1;
        *at(t, TAA_COLOR, c, x, y) = (float)(bright * shade_random(seed));
        *at(t, TAA_LAST_COLOR, c, x, y) = (float)(2 * shade_random(seed));
    }
    for (int c = 0; c < 2; c++) {
        double d = 6 * sin(patch * (c + 1.3)) + 0.3 * shade_random(seed);
        *at(t, TAA_MOTION, c, x, y) = (float)(patch % 4 == 0 ? floor(d) : patch % 11 == 3 ? 1e9 * d : d);
    }
}

/* Largest relative error; at most one pixel in a thousand may decide otherwise (which history is rejected
 * hangs on a threshold, and twins round differently there). */
static double against_twin(taa_case *t, int *otherwise, int *rejected)
{
    const frame_t *f = &t->run.frame;
    double worst = 0;
    *otherwise = *rejected = 0;
    for (int y = f->valid[1]; y < f->valid[3]; y++) {
        for (int x = f->valid[0]; x < f->valid[2]; x++) {
            double want[4];
            twin_taa(&t->run, x, y, want);
            *rejected += want[3] == 1;
            if (*at(t, TAA_OUT_COUNT, 0, x, y) != (float)want[3]) {
                ++*otherwise;
                continue;
            }
            for (int c = 0; c < 3; c++)
                worst =
                    fmax(worst, fabs(*at(t, TAA_OUT_COLOR, c, x, y) - want[c]) / fmax(fabs(want[c]), 0.1));
        }
    }
    return worst;
}

static void agrees_with_twin(void **state)
{
    static const int sizes[][4] = {{131, 67, 5, 3}, {1, 1, -70, -3}, {128, 16, 64, 0}, {30, 40, 63, -1}};
    (void)state;
    for (int i = 0; i < 24; i++) {
        taa_case t;
        uint64_t seed = (uint64_t)i + 1;
        const int *size = sizes[i & 3];
        make_case(&t, size[0], size[1], size[2], size[3]);
        frame_t *f = &t.run.frame;
        for (int y = f->valid[1]; y < f->valid[3]; y++)
            for (int x = f->valid[0]; x < f->valid[2]; x++)
                random_pixel(&t, x, y, &seed);
        if (i & 4)
            t.run.images[TAA_MOTION] = NULL;
        if (i & 8)
            t.run.images[TAA_STENCIL] = t.run.images[TAA_LAST_STENCIL] = NULL;
        if (i == 4)
            t.params.exclude[0] = 1u << 2;
        if (i < 16)
            shade_camera(&f->previous, (double[]){0.104, 0.203, 1.01}, 0.302, -0.199);
        t.run.lanes = i % 4 == 2 ? 8 : i % 4 == 3 ? 4 : 16;
        f->camera.jitter[0] = 0.3f;
        f->previous.jitter[1] = -0.4f;
        execute(&t);
        int otherwise, rejected, pixels = size[0] * size[1];
        double worst = against_twin(&t, &otherwise, &rejected);
        print_message("case %d: largest relative error %.2g, %d of %d decided otherwise, %d rejected\n", i,
                      worst, otherwise, pixels, rejected);
        assert_true(worst < 3e-3); /* 1e-4 pixels of reprojection, on noise that changes by 2 a pixel */
        assert_true(otherwise * 1000 <= pixels);
        assert_true(pixels == 1 || (rejected > 0 && rejected < pixels));
        free_case(&t);
    }
}

/* ---- sequences whose result is known
 * --------------------------------------------------------------------------- */

/* A flat wall of one material, seen by a camera that stands still; colours are given later. */
static void make_still(taa_case *t, int w, int h)
{
    make_case(t, w, h, 3, 5);
    fill(t, TAA_DEPTH, 0.8);
    fill(t, TAA_LAST_DEPTH, 0.8);
    fill_ids(t, TAA_STENCIL, 1);
    fill_ids(t, TAA_LAST_STENCIL, 1);
    fill(t, TAA_LAST_COUNT, 4);
    t->run.images[TAA_MOTION] = NULL;
}

/* The result becomes the history. */
static void next_frame(taa_case *t)
{
    size_t bytes = (size_t)t->run.frame.plane * sizeof(float);
    memcpy(t->images[TAA_LAST_COLOR].data, t->images[TAA_OUT_COLOR].data, 3 * bytes);
    memcpy(t->images[TAA_LAST_COUNT].data, t->images[TAA_OUT_COUNT].data, bytes);
    t->run.frame.previous = t->run.frame.camera;
    t->run.frame.history = 1;
}

/* A texture with an edge, details of two pixels, and 2 % of noise. */
static double textured(double x, double y, uint64_t *seed)
{
    double detail = 0.5 + 0.2 * sin(1.6 * x) * cos(1.1 * y) + 0.15 * tanh(4 * (x + 0.3 * y - 30));
    return detail * (1 + 0.04 * (shade_random(seed) - 0.5));
}

/* PSNR of the eighth result against the plain mean of eight jittered frames. */
static double still_sequence(taa_case *t, double gamma)
{
    const frame_t *f = &t->run.frame;
    double *mean = calloc((size_t)f->plane * 3, sizeof *mean), error = 0, peak = 0;
    uint64_t seed = 5;
    assert_non_null(mean);
    t->params = (twin_taa_params){.clip_gamma = (float)gamma};
    t->run.frame.history = 0;
    for (int n = 0; n < 8; n++) {
        t->run.frame.camera.jitter[0] = (float)n / 8 - 0.4375f;
        t->run.frame.camera.jitter[1] = (float)(n * 5 % 8) / 8 - 0.4375f;
        for (int y = f->valid[1]; y < f->valid[3]; y++)
            for (int x = f->valid[0]; x < f->valid[2]; x++)
                for (int c = 0; c < 3; c++)
                    *at(t, TAA_COLOR, c, x, y) = (float)textured((double)x + f->camera.jitter[0],
                                                                 (double)y + f->camera.jitter[1] + c, &seed);
        for (int i = 0; i < 3 * f->plane; i++)
            mean[i] += t->images[TAA_COLOR].data[i] / 8;
        execute(t);
        next_frame(t);
    }
    for (int i = 0; i < 3 * f->plane; i++) {
        error += pow(t->images[TAA_OUT_COLOR].data[i] - mean[i], 2);
        peak = fmax(peak, mean[i]);
    }
    error /= 3.0 * (f->valid[2] - f->valid[0]) * (f->valid[3] - f->valid[1]);
    free(mean);
    return 10 * log10(peak * peak / error);
}

static void still_frames_give_their_mean(void **state)
{
    taa_case t;
    (void)state;
    make_still(&t, 70, 40);
    double wide = still_sequence(&t, 8), clipped = still_sequence(&t, 1);
    print_message("PSNR against the plain mean: %.1f dB, with clip_gamma 8 %.1f dB\n", clipped, wide);
    assert_true(wide > 120); /* nothing is clipped: the mean but for rounding */
    assert_true(clipped > 45);
    assert_true(*at(&t, TAA_OUT_COUNT, 0, 20, 20) == 8);
    free_case(&t);
}

static void first_frame_is_the_input(void **state)
{
    taa_case t;
    (void)state;
    make_still(&t, 20, 9);
    fill(&t, TAA_COLOR, 0.7);
    fill(&t, TAA_LAST_COLOR, 0.2);
    t.run.frame.history = 0;
    execute(&t);
    const frame_t *f = &t.run.frame;
    for (int y = f->valid[1]; y < f->valid[3]; y++) {
        for (int x = f->valid[0]; x < f->valid[2]; x++) {
            assert_true(*at(&t, TAA_OUT_COLOR, 1, x, y) == 0.7f);
            assert_true(*at(&t, TAA_OUT_COUNT, 0, x, y) == 1);
        }
    }
    free_case(&t);
}

/* Motion by whole pixels: the history arrives unfiltered, with the weight of its count. What comes from
 * outside of the image has none. */
static void whole_pixels_move_exactly(void **state)
{
    taa_case t;
    uint64_t seed = 8;
    (void)state;
    make_still(&t, 77, 31);
    const frame_t *f = &t.run.frame;
    t.run.images[TAA_MOTION] = &t.images[TAA_MOTION];
    t.params = (twin_taa_params){.blend = 0.05f, .clip_gamma = 8};
    for (int y = f->valid[1]; y < f->valid[3]; y++) {
        for (int x = f->valid[0]; x < f->valid[2]; x++) {
            *at(&t, TAA_MOTION, 0, x, y) =
                3.0002f; /* a displacement that rounding has touched is whole, too */
            *at(&t, TAA_MOTION, 1, x, y) = -2;
            *at(&t, TAA_COLOR, 0, x, y) = (float)(1 + shade_random(&seed));
            *at(&t, TAA_LAST_COLOR, 0, x, y) = (float)(1 + shade_random(&seed));
        }
    }
    execute(&t);
    for (int y = f->valid[1]; y < f->valid[3]; y++) {
        for (int x = f->valid[0]; x < f->valid[2]; x++) {
            double own = *at(&t, TAA_COLOR, 0, x, y), got = *at(&t, TAA_OUT_COLOR, 0, x, y);
            bool inside = x + 3 < f->valid[2] && y - 2 >= f->valid[1];
            double past = inside ? *at(&t, TAA_LAST_COLOR, 0, x + 3, y - 2) : own;
            assert_true(fabs(got - (own + 4 * past) / 5) < 1e-6);
            assert_true(*at(&t, TAA_OUT_COUNT, 0, x, y) == (inside ? 5 : 1));
        }
    }
    free_case(&t);
}

/* A strip that another surface covered one frame before starts afresh; all else keeps its history. */
static void disoccluded(bool by_stencil)
{
    taa_case t;
    make_still(&t, 60, 20);
    const frame_t *f = &t.run.frame;
    int left = f->valid[0] + 20, right = f->valid[0] + 40;
    for (int y = f->valid[1]; y < f->valid[3]; y++) {
        for (int x = left; x < right; x++) {
            if (by_stencil)
                shade_set_id(&t.images[TAA_LAST_STENCIL], f, x, y, 2);
            else
                *at(&t, TAA_LAST_DEPTH, 0, x, y) = 0.75f;
        }
    }
    if (!by_stencil)
        t.run.images[TAA_STENCIL] = t.run.images[TAA_LAST_STENCIL] = NULL;
    fill(&t, TAA_COLOR, 0.5);
    fill(&t, TAA_LAST_COLOR, 0.4);
    execute(&t);
    for (int y = f->valid[1]; y < f->valid[3]; y++)
        for (int x = f->valid[0]; x < f->valid[2]; x++)
            assert_true(*at(&t, TAA_OUT_COUNT, 0, x, y) == (x >= left && x < right ? 1 : 5));
    assert_true(*at(&t, TAA_OUT_COLOR, 0, left + 9, f->valid[1] + 9) == 0.5f);
    free_case(&t);
}

static void another_surface_has_no_history(void **state)
{
    (void)state;
    disoccluded(true);
    disoccluded(false);
}

/* The light changed: history far outside of the colours around the pixel is pulled to them. */
static void stale_light_is_clipped(void **state)
{
    taa_case t;
    (void)state;
    make_still(&t, 20, 9);
    fill(&t, TAA_COLOR, 0.5);
    fill(&t, TAA_LAST_COLOR, 4);
    execute(&t);
    assert_true(fabs(*at(&t, TAA_OUT_COLOR, 0, 10, 9) - 0.5) < 1e-5);
    free_case(&t);
}

static void fireflies_are_damped(void **state)
{
    taa_case t;
    (void)state;
    make_still(&t, 20, 9);
    t.params.blend = 0;
    fill(&t, TAA_COLOR, 0.5);
    fill(&t, TAA_LAST_COLOR, 0.5);
    for (int c = 0; c < 3; c++)
        *at(&t, TAA_COLOR, c, 10, 6) = 1000;
    execute(&t);
    assert_true(*at(&t, TAA_OUT_COLOR, 0, 10, 6) < 1.0f); /* a plain mean gives 200 */
    free_case(&t);
}

/* Whatever comes in that is finite, nothing else goes out; the count stops growing. */
static void extremes_stay_finite(void **state)
{
    static const float values[] = {0, -1, 1e-30f, 1e8f, 3, 1e-3f};
    taa_case t;
    uint64_t seed = 77;
    (void)state;
    make_still(&t, 90, 30);
    const frame_t *f = &t.run.frame;
    fill(&t, TAA_LAST_COUNT, 65536);
    for (int turn = 0; turn < 2; turn++) {
        t.run.images[TAA_MOTION] = turn ? &t.images[TAA_MOTION] : NULL;
        shade_camera(&t.run.frame.previous, (double[]){0.1, 0.2, turn ? 1 : -5}, 3, 0);
        t.params.clip_gamma = turn ? 0 : 8;
        for (int y = f->valid[1]; y < f->valid[3]; y++) {
            for (int x = f->valid[0]; x < f->valid[2]; x++) {
                for (int c = 0; c < 3; c++) {
                    *at(&t, TAA_COLOR, c, x, y) = values[(int)(6 * shade_random(&seed))];
                    *at(&t, TAA_LAST_COLOR, c, x, y) = values[(int)(6 * shade_random(&seed))];
                }
                *at(&t, TAA_DEPTH, 0, x, y) = shade_random(&seed) < 0.5 ? 0 : 0.8f;
                *at(&t, TAA_MOTION, 0, x, y) = shade_random(&seed) < 0.1 ? -1e30f : 0.5f;
            }
        }
        execute(&t);
        for (int y = 0; y < f->rows; y++) {
            for (int x = 0; x < f->columns; x++) {
                for (int c = 0; c < 3; c++)
                    assert_true(isfinite(*at(&t, TAA_OUT_COLOR, c, x, y)));
                assert_in_range((uintmax_t)fabsf(*at(&t, TAA_OUT_COUNT, 0, x, y)), 1, 65536);
            }
        }
    }
    free_case(&t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(agrees_with_twin),
        cmocka_unit_test(still_frames_give_their_mean),
        cmocka_unit_test(first_frame_is_the_input),
        cmocka_unit_test(whole_pixels_move_exactly),
        cmocka_unit_test(another_surface_has_no_history),
        cmocka_unit_test(stale_light_is_clipped),
        cmocka_unit_test(fireflies_are_damped),
        cmocka_unit_test(extremes_stay_finite),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
