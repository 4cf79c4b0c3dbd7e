/* Frames and layers of other sizes; samples that are counted, ids that are refused. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "tests/capture_sequence.h"
#include "tests/tool_run.h"

/* ---- sizes ---- */

static void test_sizes_in_a_sequence(void **state)
{
    (void)state;
    scene s[5];
    sequence_outcome o;
    capture_form f = {.name = "sizes", .compression = RL_EXR_ZIP};
    char *folder = folder_new();
    for (int i = 0; i < 5; i++) {
        static const int window[5][4] = {
            {0, 0, 72, 48}, {0, 0, 72, 48}, {-20, -10, 130, 90}, {-20, -10, 130, 90}, {5, 5, 20, 10}};
        scene_camera c = scene_camera_default();
        memcpy(c.data, window[i], sizeof c.data);
        s[i] = scene_make(&c, SCENE_LIGHTS, SCENE_KEY | SCENE_RIM);
        capture_write(folder, &f, &s[i], i + 1);
    }
    capture_manifest(folder, &f, s, 5);
    sequence_run(folder, sequence_with_taa, (rl_options){0}, &o);
    assert_int_equal(o.summary.failed, 0);
    assert_true(sequence_off(sequence_out(folder), "cap.0001.exr", &s[0]) < 2e-6);
    assert_true(sequence_off(sequence_out(folder), "cap.0003.exr", &s[2]) < 2e-6); /* no history */
    assert_true(sequence_off(sequence_out(folder), "cap.0005.exr", &s[4]) < 2e-6);
    sequence_leave(folder, s, 5);
}

/* A frame that fails after its size is known leaves buffers of the size before. */
static void test_size_of_a_failed_frame(void **state)
{
    (void)state;
    scene_camera small = scene_camera_default(), large = small;
    const int window[4] = {-20, -10, 130, 90};
    memcpy(large.data, window, sizeof window);
    scene s[3] = {scene_make(&small, 7, 3), scene_make(&large, 7, 3), scene_make(&large, 7, 3)};
    capture_form f = {.name = "failed"}, bad = {.name = "no matrix", .no_matrix = true};
    char *folder = folder_new();
    capture_write(folder, &f, &s[0], 1);
    capture_write(folder, &bad, &s[1], 2);
    capture_write(folder, &f, &s[2], 3);
    capture_manifest(folder, &f, s, 3);
    rl_session *r = capture_open(folder, capture_pipeline, NULL);
    rl_error err = {0};
    assert_int_equal(rl_session_process(r, 0, 1, NULL, &err), RL_OK);
    assert_int_equal(rl_session_process(r, 0, 2, NULL, &err), RL_E_FORMAT);
    assert_non_null(strstr(err.text, "worldToCamera"));
    err = (rl_error){0};
    assert_int_equal(rl_session_process(r, 0, 3, NULL, &err), RL_OK);
    rl_image_view color = capture_image(r, "c.color");
    assert_true(capture_error(&color, &s[2], SCENE_COLOR, 3, 0) < 2e-6);
    rl_session_close(&r);
    sequence_leave(folder, s, 3);
}

static void test_sizes_in_a_frame(void **state)
{
    (void)state;
    scene s[3];
    sequence_outcome o;
    capture_form f = {.name = "layers", .files = FILES_LAYERS};
    char *folder = sequence_make(&f, s, 3), *other = folder_new(), from[512], to[512];
    scene_camera c = scene_camera_default();
    c.data[2] = 40;
    scene narrow = scene_make(&c, 7, 3);
    capture_write(other, &f, &narrow, 2);
    snprintf(from, sizeof from, "%s/albedo.0002.exr", other);
    snprintf(to, sizeof to, "%s/albedo.0002.exr", folder);
    assert_int_equal(rename(from, to), 0);
    sequence_run(folder, capture_pipeline, (rl_options){0}, &o);
    assert_int_equal(o.summary.failed, 1);
    assert_non_null(
        strstr(o.text[2], "albedo.0002.exr: layer 'albedo' has the data window (0, 0) - (39, 47)"));
    assert_true(sequence_off(sequence_out(folder), "cap.0003.exr", &s[2]) < 2e-6);
    scene_free(&narrow);
    folder_remove(other);
    sequence_leave(folder, s, 3);
}

/* ---- what is counted, what is refused ---- */

static void spoil(const char *layer, double **c, int n, size_t pixels)
{
    (void)n;
    if (!strcmp(layer, "albedo")) {
        c[0][0] = NAN; /* empty pixels: the picture stays as it is */
        c[1][1] = INFINITY;
        c[2][2] = -INFINITY;
        c[0][3] = 1.5;
        c[1][4] = -0.25;
    } else if (!strcmp(layer, "normal")) {
        c[2][0] = NAN;
    } else if (!strcmp(layer, "depth")) {
        c[0][0] = NAN;
        c[0][1] = INFINITY; /* means empty, and is not counted */
    } else if (!strcmp(layer, "shadow.key")) {
        c[0][pixels - 1] = 2.0;
    }
}

static void test_counts(void **state)
{
    (void)state;
    scene s[2];
    sequence_outcome o;
    capture_form f = {.name = "spoiled", .spoil = spoil, .compression = RL_EXR_ZIP};
    for (int files = FILES_ONE; files <= (int)FILES_PARTS; files++) {
        f.files = (capture_files)files;
        char *folder = sequence_make(&f, s, 2);
        for (int i = 0; i < 5; i++)
            assert_int_equal(s[0].id[i], 0);
        capture_log_clear();
        sequence_run(folder, capture_pipeline, (rl_options){.log = &capture_logger}, &o);
        assert_int_equal(o.summary.failed, 0);
        assert_int_equal(o.nonfinite[1], 5);
        assert_int_equal(o.clamped[1], 3);
        assert_int_equal(o.summary.nonfinite, 10);
        assert_int_equal(o.summary.clamped, 6);
        /* which layer it was, once */
        const char *said = strstr(capture_log(), "layer 'albedo': 3 NaN or infinite samples in frame 1");
        assert_non_null(said);
        assert_null(strstr(said + 1, "layer 'albedo'"));
        assert_non_null(strstr(capture_log(), "layer 'normal': 1 NaN or infinite sample in frame 1"));
        assert_non_null(strstr(capture_log(), "layer 'depth': 1 NaN or infinite sample in frame 1"));
        sequence_leave(folder, s, 2);
    }
}

static void half_an_id(const char *layer, double **c, int n, size_t pixels)
{
    (void)n;
    (void)pixels;
    if (!strcmp(layer, "stencil"))
        c[0][72 * 5 + 9] = 1.5;
}

static void test_ids_refused(void **state)
{
    (void)state;
    scene s[1];
    sequence_outcome o;
    capture_form f = {.name = "half an id", .spoil = half_an_id, .stencil = RL_EXR_FLOAT};
    char *folder = sequence_make(&f, s, 1);
    sequence_run(folder, capture_pipeline, (rl_options){0}, &o);
    assert_int_equal(o.code[1], RL_E_DATA);
    assert_non_null(strstr(o.text[1], "(9, 5)"));
    assert_non_null(strstr(o.text[1], "1.5"));
    sequence_leave(folder, s, 1);

    f = (capture_form){.name = "an id without material"};
    folder = sequence_make(&f, s, 1);
    char *some = text_replace(capture_pipeline, "default: {}", "a: {stencil: [1, 2]}");
    sequence_run(folder, some, (rl_options){0}, &o);
    size_t n = 0;
    for (size_t i = 0; i < s[0].n; i++)
        n += s[0].id[i] == 3;
    char text[64];
    snprintf(text, sizeof text, "3 (%zu pixels)", n);
    assert_int_equal(o.code[1], RL_E_DATA);
    assert_non_null(strstr(o.text[1], text));
    assert_int_equal(folder_files(folder), 2); /* the capture alone */
    free(some);
    sequence_leave(folder, s, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sizes_in_a_sequence), cmocka_unit_test(test_size_of_a_failed_frame),
        cmocka_unit_test(test_sizes_in_a_frame),    cmocka_unit_test(test_counts),
        cmocka_unit_test(test_ids_refused),
    };
    return cmocka_run_group_tests(tests, capture_setup, capture_teardown);
}
