/* Sequences: cameras and frames, frames that are missing or broken, several captures, names that collide. */
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

/* ---- cameras and frames ---- */

static void test_a_camera_a_frame(void **state)
{
    static const capture_form forms[] = {
        {.name = "header", .compression = RL_EXR_ZIP},
        {.name = "list", .camera = CAMERA_LIST, .fov = FOV_LIST, .forward_z = true, .frames = "1-4"},
    };
    (void)state;
    for (int i = 0; i < 2; i++) {
        scene s[4];
        sequence_outcome o;
        char *folder = sequence_make(&forms[i], s, 4);
        sequence_run(folder, capture_pipeline, (rl_options){0}, &o);
        assert_int_equal(o.summary.frames, 4);
        assert_true(sequence_off(sequence_out(folder), "cap.0001.exr", &s[0]) < 2e-6);
        assert_true(sequence_off(sequence_out(folder), "cap.0004.exr", &s[3]) < 2e-6);
        sequence_run(folder, capture_pipeline, (rl_options){.frames = "2,4"},
                     &o); /* the list goes by number */
        assert_int_equal(o.summary.frames, 2);
        assert_true(sequence_off(sequence_out(folder), "cap.0002.exr", &s[1]) < 2e-6);
        assert_true(sequence_off(sequence_out(folder), "cap.0004.exr", &s[3]) < 2e-6);
        sequence_leave(folder, s, 4);
    }
}

static void expect_wrong(const rl_options *options, const char *text)
{
    rl_session *s = NULL;
    rl_error err = {0};
    assert_int_not_equal(rl_session_open(options, &s, &err), RL_OK);
    assert_null(s);
    if (!strstr(err.text, text))
        fail_msg("\"%s\" is not in \"%s\"", text, err.text);
}

static void expect_refused(const char *folder, const char *frames, const char *text)
{
    rl_options options = {
        .pipeline_text = capture_pipeline, .captures = &folder, .n_captures = 1, .frames = frames};
    expect_wrong(&options, text);
}

static void test_frames_option(void **state)
{
    (void)state;
    scene s[3];
    sequence_outcome o;
    capture_form f = {.name = "frames"};
    char *folder = sequence_make(&f, s, 3);
    expect_refused(folder, "2-5", "4");
    expect_refused(folder, "3-1", "3-1");
    expect_refused(folder, "x", "x");
    expect_refused(folder, "", "");
    sequence_run(folder, capture_pipeline, (rl_options){.frames = "1-3x2"}, &o);
    assert_int_equal(o.summary.frames, 2);
    assert_int_equal(o.files[3], 1);
    sequence_leave(folder, s, 3);
}

/* Numbers below zero; a file without a number, which is every frame; layers of which some stand still. */
static void test_numbers(void **state)
{
    (void)state;
    rl_error err = {0};
    static const capture_form
        below = {.name = "below zero"},
        still = {.name = "still", .pattern = "cap.0002.exr", .frames = "1-3"},
        mixed = {.name = "mixed",
                 .files = FILES_LAYERS,
                 .frames = "1-2",
                 .pattern = "{albedo: albedo.0001.exr, default: stencil.####.exr, normal: normal.%04d.exr,"
                            " depth: depth.%d.exr, thickness: thickness.####.exr, motion: motion.####.exr,"
                            " shadow.key: shadow.key.####.exr, shadow: shadow.rim.####.exr}"};
    scene s[2];
    sequence_outcome o;
    char *folder = sequence_make(&below, s, 2), *out = path_in(folder, "out"), from[512], to[512];
    for (int i = 1; i <= 2; i++) {
        snprintf(from, sizeof from, "%s/cap.%04d.exr", folder, i);
        snprintf(to, sizeof to, "%s/cap.%04d.exr", folder, i - 10);
        assert_int_equal(rename(from, to), 0);
    }
    rl_session *r = capture_open(folder, capture_pipeline, &(rl_options){.frames = "-9--8"});
    assert_int_equal(rl_session_frame(r, 0, 0), -9);
    assert_int_equal(rl_session_process(r, 0, -8, NULL, &err), RL_OK);
    rl_image_view view = capture_image(r, "c.color");
    assert_true(capture_error(&view, &s[1], SCENE_COLOR, 3, 0) < 2e-6);
    rl_session_close(&r);
    free(out);
    sequence_leave(folder, s, 2);

    folder = sequence_make(&still, s, 2);
    out = path_in(folder, "out");
    sequence_run(folder, capture_pipeline, (rl_options){0}, &o);
    assert_int_equal(o.summary.frames, 3);
    assert_true(sequence_off(out, "cap.0003.exr", &s[1]) < 2e-6);
    free(out);
    sequence_leave(folder, s, 2);

    folder = sequence_make(&mixed, s, 2); /* depth.%d has no leading zeros */
    out = path_in(folder, "out");
    for (int i = 1; i <= 2; i++) {
        snprintf(from, sizeof from, "%s/depth.%04d.exr", folder, i);
        snprintf(to, sizeof to, "%s/depth.%d.exr", folder, i);
        assert_int_equal(rename(from, to), 0);
    }
    sequence_run(folder, capture_pipeline, (rl_options){0}, &o);
    assert_int_equal(o.summary.failed, 0);
    assert_true(sequence_off(out, "cap.0001.exr", &s[0]) < 2e-6);
    free(out);
    sequence_leave(folder, s, 2);
}

/* ---- missing and broken ---- */

static void cut_file(const char *folder, int frame)
{
    char path[512];
    snprintf(path, sizeof path, "%s/cap.%04d.exr", folder, frame);
    assert_int_equal(truncate(path, 9000), 0);
}

static void test_missing(void **state)
{
    (void)state;
    scene s[6];
    sequence_outcome o;
    capture_form f = {.name = "missing", .frames = "1-6", .compression = RL_EXR_ZIP};
    char *folder = sequence_make(&f, s, 6), *out = folder_new();
    sequence_remove(folder, 1);
    cut_file(folder, 3);
    sequence_remove(folder, 4);

    sequence_run(folder, capture_pipeline, (rl_options){.out = out}, &o);
    assert_int_equal(o.summary.failed, 3);
    assert_int_equal(o.code[1], RL_E_IO);
    assert_non_null(strstr(o.text[1], "cap.0001.exr"));
    assert_non_null(strstr(o.text[3], "cap.0003.exr"));
    assert_int_equal(folder_files(out), 3); /* 2, 5 and 6 */
    folder_remove(out);

    out = folder_new();
    capture_log_clear();
    sequence_run(folder, capture_pipeline, (rl_options){.out = out, .on_missing = RL_MISSING_SKIP}, &o);
    assert_int_equal(o.summary.failed, 0);
    assert_int_equal(o.files[3], 0);
    assert_int_equal(folder_files(out), 3);
    assert_non_null(strstr(capture_log(), "frame 3 is skipped"));
    folder_remove(out);

    out = folder_new();
    capture_log_clear();
    sequence_run(folder, capture_pipeline, (rl_options){.out = out, .on_missing = RL_MISSING_HOLD}, &o);
    assert_int_equal(o.summary.failed, 1); /* nothing is in front of the first */
    assert_non_null(strstr(o.text[1], "no frame before it to hold"));
    assert_int_equal(folder_files(out), 5);
    assert_true(sequence_off(out, "cap.0003.exr", &s[1]) <
                2e-6); /* 3 and 4 show the layers and the camera of 2 */
    assert_true(sequence_off(out, "cap.0004.exr", &s[1]) < 2e-6);
    assert_true(sequence_off(out, "cap.0005.exr", &s[4]) < 2e-6);
    assert_non_null(strstr(capture_log(), "frame 4 holds the layers of frame 2"));
    folder_remove(out);
    sequence_leave(folder, s, 6);
}

/* A frame without history is its own picture; held and skipped frames give and take none. */
static void test_cuts(void **state)
{
    (void)state;
    scene s[5];
    sequence_outcome o;
    capture_form f = {.name = "cuts", .frames = "1-5"};
    char *folder = sequence_make(&f, s, 5), *out = path_in(folder, "out");
    sequence_run(folder, sequence_with_taa, (rl_options){0}, &o);
    assert_true(sequence_off(out, "cap.0001.exr", &s[0]) < 2e-6);
    assert_true(sequence_off(out, "cap.0004.exr", &s[3]) > 1e-4); /* mixed with its past */
    sequence_remove(folder, 3);
    for (int how = RL_MISSING_ERROR; how <= (int)RL_MISSING_HOLD; how++) {
        sequence_run(folder, sequence_with_taa, (rl_options){.on_missing = (rl_on_missing)how}, &o);
        assert_true(sequence_off(out, "cap.0004.exr", &s[3]) < 2e-6);
        assert_true(sequence_off(out, "cap.0005.exr", &s[4]) > 1e-4);
    }
    assert_true(sequence_off(out, "cap.0002.exr", &s[1]) > 1e-4);
    assert_true(sequence_off(out, "cap.0003.exr", &s[1]) < 2e-6); /* the held one: frame 2 without its past */
    sequence_run(folder, sequence_with_taa, (rl_options){.frames = "1-2,4-5"},
                 &o); /* a gap in what is processed */
    assert_true(sequence_off(out, "cap.0004.exr", &s[3]) < 2e-6);
    capture_form cut = {.name = "cut", .frames = "1-5", .extra = "cuts: [4]\n"};
    capture_manifest(folder, &cut, s, 5);
    capture_write(folder, &cut, &s[2], 3);
    sequence_run(folder, sequence_with_taa, (rl_options){0}, &o);
    assert_true(sequence_off(out, "cap.0003.exr", &s[2]) > 1e-4);
    assert_true(sequence_off(out, "cap.0004.exr", &s[3]) < 2e-6);
    free(out);
    sequence_leave(folder, s, 5);
}

/* The same from the command line, with its exit statuses. */
static void test_command_line(void **state)
{
    (void)state;
    static const struct {
        const char *how;
        int status, files;
    } all[] = {
        {"error", 1, 2},
        {"skip", 0, 2},
        {"hold", 0, 3},
    };
    scene s[3];
    capture_form f = {.name = "cli", .frames = "1-3"};
    char *folder = sequence_make(&f, s, 3), *pipeline = path_in(folder, "p.yaml");
    file_write(folder, "p.yaml", capture_pipeline, strlen(capture_pipeline));
    sequence_remove(folder, 2);
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
        char *out = folder_new();
        const char *run[] = {"run", pipeline,       "--capture", folder, "--out",
                             out,   "--on-missing", all[i].how,  NULL};
        const char *check[] = {"check", pipeline, "--capture", folder, "--on-missing", all[i].how, NULL};
        tool_result r = tool_run(run), c = tool_run(check);
        assert_int_equal(r.status, all[i].status);
        assert_int_equal(c.status, all[i].status ? 2 : 0);
        assert_non_null(strstr(r.err, "cap.0002.exr"));
        assert_non_null(strstr(c.err, "cap.0002.exr"));
        assert_int_equal(folder_files(out), all[i].files);
        tool_result_free(&r);
        tool_result_free(&c);
        folder_remove(out);
    }
    free(pipeline);
    sequence_leave(folder, s, 3);
}

/* ---- several captures ---- */

static void test_two_captures(void **state)
{
    (void)state;
    scene a[2], b[2];
    sequence_outcome o;
    capture_form first = {.name = "one"}, second = {.name = "two",
                                                    .title = "other",
                                                    .forward_z = true,
                                                    .unit = "cm",
                                                    .metres = 0.01,
                                                    .files = FILES_PARTS};
    char *one = sequence_make(&first, a, 2), *two = sequence_make(&second, b, 2), *out = folder_new();
    const char *both[] = {one, two}, *twice[] = {one, one};
    sequence_run(one, sequence_with_taa, (rl_options){.captures = both, .n_captures = 2, .out = out}, &o);
    assert_int_equal(o.summary.frames, 4);
    assert_int_equal(folder_files(out), 4);
    assert_true(sequence_off(out, "cap.0001.exr", &a[0]) < 2e-6);
    assert_true(sequence_off(out, "other.0001.exr", &b[0]) < 2e-6); /* the other's history is not its own */

    rl_options options = {.pipeline_text = capture_pipeline, .captures = twice, .n_captures = 2};
    expect_wrong(&options, "give one another 'name'");
    char *nameless = text_replace(capture_pipeline, "{capture}.", "");
    options = (rl_options){.pipeline_text = nameless, .captures = both, .n_captures = 2};
    expect_wrong(&options, "put {capture} into 'file'");
    free(nameless);
    char *still = text_replace(capture_pipeline, ".{frame:04}", "");
    options = (rl_options){.pipeline_text = still, .captures = both, .n_captures = 1};
    expect_wrong(&options, "put {frame:04} into 'file'");
    free(still);
    const char *dump[] = {"c.color"};
    char *same = text_replace(capture_pipeline, "{capture}.{frame", "{capture}.c.color.{frame");
    options =
        (rl_options){.pipeline_text = same, .captures = both, .n_captures = 1, .dump = dump, .n_dump = 1};
    expect_wrong(&options, "would both write 'out/cap.c.color.0001.exr'");
    free(same);
    options = (rl_options){.pipeline_text = capture_pipeline, .captures = both, .n_captures = 2, .out = one};
    expect_wrong(
        &options,
        "is read as frame 1 of capture 'cap' and would be written over"); /* the capture's own files */
    folder_remove(out);
    sequence_leave(one, a, 2);
    sequence_leave(two, b, 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_camera_a_frame),
        cmocka_unit_test(test_frames_option),
        cmocka_unit_test(test_numbers),
        cmocka_unit_test(test_missing),
        cmocka_unit_test(test_cuts),
        cmocka_unit_test(test_command_line),
        cmocka_unit_test(test_two_captures),
    };
    return cmocka_run_group_tests(tests, capture_setup, capture_teardown);
}
