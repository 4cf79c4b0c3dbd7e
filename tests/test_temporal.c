/* Temporal anti-aliasing through a session, on sequences whose box-filtered truth is known; and where history
 * ends. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "graph/run/camera.h"
#include "tests/temporal_run.h"

static void run_on(const temporal_scene *scene, bool motion, int frames, int compared, temporal_report *r)
{
    temporal_session t;
    if (!temporal_open(&t, motion, "", NULL, NULL) || !temporal_sequence(&t, scene, frames, compared, 6, r))
        fail_msg("%s", t.err.text);
    temporal_close(&t);
}

/* ---- against the truth
 * -------------------------------------------------------------------------------------------- */

/* 64 jittered frames of what stands still, blend 0: as good as their plain mean. */
static void still_frames_reach_the_truth(void **state)
{
    enum { FRAMES = 64 };
    const temporal_scene scene = {.width = 128, .height = 72};
    temporal_session t;
    temporal_report r;
    (void)state;
    size_t n = (size_t)scene.width * (size_t)scene.height;
    float *mean[3] = {calloc(3 * n, sizeof(float))};
    assert_non_null(mean[0]);
    mean[1] = mean[0] + n;
    mean[2] = mean[1] + n;
    for (int i = 0; i < FRAMES; i++) {
        temporal_frame f;
        double jitter[2];
        assert_true(temporal_frame_new(&f, scene.width, scene.height));
        temporal_jitter(i, jitter);
        temporal_render(&scene, i, jitter, &f);
        for (size_t k = 0; k < 3 * n; k++)
            mean[0][k] += f.color[0][k] / FRAMES;
        temporal_frame_free(&f);
    }
    for (int motion = 0; motion < 2; motion++) {
        assert_true(temporal_open(&t, motion, ", blend: 0", NULL, NULL));
        assert_true(temporal_sequence(&t, &scene, FRAMES, 1, 16, &r));
        double plain = temporal_psnr(&r.frame, mean, r.truth);
        print_message("motion %s: PSNR %.2f dB, of the plain mean %.2f dB, of a sample %.2f dB\n",
                      motion ? "given" : "withheld", r.psnr, plain, r.raw_psnr);
        assert_true(r.psnr >= plain - 0.5);
        temporal_report_free(&r);
        temporal_close(&t);
    }
    free(mean[0]);
}

static void print(const char *what, const temporal_report *r)
{
    print_message("%-32s PSNR %.2f -> %.2f dB, p95 %.4f, %ld disoccluded pixels differ by up to %g\n", what,
                  r->raw_psnr, r->psnr, r->p95, r->disoccluded, r->disoccluded_difference);
}

/* With exact motion, and with motion withheld, where that of the object has to be found. */
static void moving_frames_approach_the_truth(void **state)
{
    static const struct {
        const char *name;
        bool camera, object, motion;
        double p95;
    } cases[] = {{"camera moves", true, false, true, 0.03},
                 {"camera moves, no motion layer", true, false, false, 0.03},
                 {"object moves", false, true, true, 0.03},
                 {"object moves, no motion layer", false, true, false, 0.03},
                 {"both move", true, true, true, 0.03},
                 {"both move, no motion layer", true, true, false, 0.03}};
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        temporal_report r;
        const temporal_scene scene = {
            .width = 192, .height = 108, .camera_moves = cases[i].camera, .object_moves = cases[i].object};
        run_on(&scene, cases[i].motion, 16, 2, &r);
        print(cases[i].name, &r);
        assert_true(r.psnr >= r.raw_psnr + 5);
        assert_true(r.p95 <= cases[i].p95);
        assert_true(!cases[i].object || r.disoccluded > 0);
        assert_true(r.disoccluded_difference == 0);
        temporal_report_free(&r);
    }
}

/* Textures whose shortest wave is 3 pixels: what resampling loses adds up, unless history counts for less. */
static void fine_detail_survives_motion(void **state)
{
    temporal_report r;
    const temporal_scene scene = {.width = 192, .height = 108, .camera_moves = true, .density = 1.3};
    (void)state;
    run_on(&scene, true, 16, 1, &r);
    print("fine detail, camera moves", &r);
    assert_true(r.psnr >= r.raw_psnr + 8);
    assert_true(r.p95 <= 0.031); /* 0.034 without the cap */
    temporal_report_free(&r);
}

/* In front of a plain wall every trail would show: with exact motion, and where it has to be found, right at
 * the outline too, of which many tiles hold little. */
static void no_trail_behind_an_edge(void **state)
{
    temporal_report r;
    const temporal_scene scene = {.width = 192, .height = 108, .object_moves = true, .plain = true};
    (void)state;
    run_on(&scene, true, 16, 4, &r);
    print_message("1 to 8 pixels behind %.5f, in front %.5f\n", r.behind, r.ahead);
    assert_true(r.behind <= r.ahead);
    temporal_report_free(&r);
    run_on(&scene, false, 16, 4, &r);
    print_message(
        "no motion layer: 1 to 8 pixels behind %.5f, in front %.5f; 3 to 8 behind %.5f, a sample %.5f\n",
        r.behind, r.ahead, r.far_behind, r.far_behind_raw);
    assert_true(r.behind <= r.ahead);
    assert_true(r.far_behind <= r.far_behind_raw);
    assert_true(r.psnr > r.raw_psnr + 3);
    temporal_report_free(&r);
}

/* ---- where history ends
 * ------------------------------------------------------------------------------------------- */

typedef struct shot {
    temporal_session t;
    temporal_scene scene;
    temporal_frame frame;
    float *rgb[3], *count;
} shot;

static void begin(shot *s, int width, int height, const char *taa, const char *more, const rl_log *log)
{
    memset(s, 0, sizeof *s);
    s->scene = (temporal_scene){.width = width, .height = height};
    size_t n = (size_t)width * (size_t)height;
    float *all = calloc(4 * n, sizeof *all);
    assert_true(all && temporal_frame_new(&s->frame, width, height));
    for (size_t c = 0; c < 3; c++)
        s->rgb[c] = all + c * n;
    s->count = all + 3 * n;
    if (!temporal_open(&s->t, false, taa, more, log))
        fail_msg("%s", s->t.err.text);
}

static void end(shot *s)
{
    temporal_close(&s->t);
    temporal_frame_free(&s->frame);
    free(s->rgb[0]);
}

/* Frames in the middle pixel after one more frame; the camera is `x` metres to the right and turned by
 * `turn`. */
static int step(shot *s, long long number, double x, double turn)
{
    double jitter[2] = {0, 0}, c = cos(turn), n = sin(turn);
    temporal_render(&s->scene, 0, jitter, &s->frame);
    const double view[16] = {c, 0, -n, -x * c, 0, 1, 0, 0, n, 0, c, -x * n, 0, 0, 0, 1};
    memcpy(s->frame.to_camera, view, sizeof view);
    if (!temporal_step(&s->t, number, &s->frame, s->rgb, s->count))
        fail_msg("%s", s->t.err.text);
    return (int)fabsf(s->count[(s->scene.height / 8) * s->scene.width + s->scene.width / 2]);
}

static void gaps_and_cuts_end_history(void **state)
{
    shot s;
    (void)state;
    begin(&s, 70, 40, "", "  cuts: [5]\n", NULL);
    assert_int_equal(step(&s, 1, 0, 0), 1);
    assert_int_equal(step(&s, 2, 0, 0), 2);
    assert_int_equal(step(&s, 4, 0, 0), 1); /* 3 is missing */
    assert_int_equal(step(&s, 5, 0, 0), 1); /* a cut of the manifest */
    assert_int_equal(step(&s, 6, 0, 0), 2);
    rl_session_cut(s.t.session);
    assert_int_equal(step(&s, 7, 0, 0), 1);
    assert_int_equal(step(&s, 8, 0, 0), 2);
    end(&s);
}

static void camera_jumps_end_history(void **state)
{
    shot s;
    (void)state;
    begin(&s, 70, 40, "", NULL, NULL);
    assert_int_equal(step(&s, 1, 0, 0), 1);
    assert_int_equal(step(&s, 2, 0.001, 0), 2); /* a drift is none */
    assert_int_equal(step(&s, 3, 0.001, 0.001), 3);
    assert_int_equal(step(&s, 4, 0.001, 0.601), 1); /* 34 degrees */
    assert_int_equal(step(&s, 5, 0.001, 0.601), 2);
    assert_int_equal(step(&s, 6, 3, 0.601), 1); /* 3 metres, past all that is seen, 2 metres away */
    end(&s);
}

/* How far a jump is depends on how far away things are. */
static void jumps_are_a_matter_of_scale(void **state)
{
    float depth[32 * 32];
    const rl_depth_view view = {depth, 32, 0, 0, 32, 32};
    camera_t a = {.to_view = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0},
                  .to_world = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0},
                  .focal = {32, 32},
                  .centre = {16, 16}};
    camera_t b = a;
    (void)state;
    b.to_view[3] = -0.5f; /* half a metre to the right */
    b.to_world[3] = 0.5f;
    for (int scale = 0; scale < 3; scale++) {
        for (int i = 0; i < 32 * 32; i++)
            depth[i] = (float[]){0.4f, 1, 100}[scale];
        double seen = rl_camera_share_seen(&b, &a, &view);
        assert_true(fabs(seen - (double[]){0, 0.5, 1}[scale]) < 0.07);
        assert_true(rl_camera_share_seen(&a, &a, &view) == 1);
    }
    memset(depth, 0, sizeof depth);
    assert_true(rl_camera_share_seen(&b, &a, &view) == 1);
}

/* Another size: history is empty, and works again from there. */
static void another_size_ends_history(void **state)
{
    shot s;
    (void)state;
    begin(&s, 70, 40, "", NULL, NULL);
    assert_int_equal(step(&s, 1, 0, 0), 1);
    assert_int_equal(step(&s, 2, 0, 0), 2);
    temporal_frame whole = s.frame;
    s.scene.width = 60;
    s.frame.width = 60;
    assert_int_equal(step(&s, 3, 0, 0), 1);
    assert_int_equal(step(&s, 4, 0, 0), 2);
    s.frame = whole;
    end(&s);
}

static void excluded_materials_stay_current(void **state)
{
    static const char *const spellings[] = {", exclude: [sphere]", ", exclude: [2]", ", exclude: sphere"};
    (void)state;
    for (size_t k = 0; k < sizeof spellings / sizeof *spellings; k++) {
        shot s;
        begin(&s, 96, 54, spellings[k], NULL, NULL);
        step(&s, 1, 0, 0);
        step(&s, 2, 0, 0);
        long spheres = 0;
        for (int i = 0; i < 96 * 54; i++) {
            bool sphere = s.frame.id[i] == SCENE_SPHERE;
            spheres += sphere;
            assert_true(s.count[i] == (sphere ? 1 : 2));
        }
        assert_true(spheres > 100);
        end(&s);
    }
}

static void fails_with(const char *taa, const char *text)
{
    temporal_session t;
    assert_false(temporal_open(&t, true, taa, NULL, NULL));
    if (!strstr(t.err.text, text))
        fail_msg("%s", t.err.text);
    temporal_close(&t);
}

static void unknown_materials_are_errors(void **state)
{
    (void)state;
    fails_with(", exclude: [sphare]",
               "pass 'aa' (taa): there is no material 'sphare'; did you mean 'sphere'?");
    fails_with(", exclude: [7]", "pass 'aa' (taa): '7' has no material of its own");
    fails_with(", exclude: [1.5]",
               "'exclude': expected materials: names, stencil names or ids, or a list of them");
}

/* ---- the log
 * ------------------------------------------------------------------------------------------------------ */

static void count_notes(void *ctx, rl_severity severity, rl_where where, const char *text)
{
    (void)where;
    if (severity == RL_NOTE && strstr(text, "no layer 'motion': motion comes from depth and the cameras"))
        ++*(int *)ctx;
}

static void missing_motion_is_said_once(void **state)
{
    int notes = 0;
    rl_log log = {.sink = count_notes, .ctx = &notes};
    temporal_session t;
    shot s;
    (void)state;
    assert_true(temporal_open(&t, true, "", NULL, &log));
    temporal_close(&t);
    assert_int_equal(notes, 0);
    begin(&s, 70, 40, "", NULL, &log);
    step(&s, 1, 0, 0);
    step(&s, 2, 0, 0);
    end(&s);
    assert_int_equal(notes, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(still_frames_reach_the_truth),    cmocka_unit_test(moving_frames_approach_the_truth),
        cmocka_unit_test(fine_detail_survives_motion),     cmocka_unit_test(no_trail_behind_an_edge),
        cmocka_unit_test(gaps_and_cuts_end_history),       cmocka_unit_test(camera_jumps_end_history),
        cmocka_unit_test(jumps_are_a_matter_of_scale),     cmocka_unit_test(another_size_ends_history),
        cmocka_unit_test(excluded_materials_stay_current), cmocka_unit_test(unknown_materials_are_errors),
        cmocka_unit_test(missing_motion_is_said_once),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
