/* Sequences: frames that are missing, broken, of another size, of several captures; what is counted and what is refused. */
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

#include "tests/capture_run.h"
#include "tests/tool_run.h"

static int setup(void **state)
{
    (void)state;
    return capture_start() ? 0 : -1;
}

static int teardown(void **state)
{
    (void)state;
    capture_stop();
    return 0;
}

/* Scenes of frames 1…n, the camera a little further each time, and their files. */
static char *make_frames(const capture_form *f, scene *s, int n)
{
    char *folder = folder_new();
    for (int i = 0; i < n; i++) {
        scene_camera c = scene_camera_default();
        c.view[3] += 0.02 * i;
        s[i] = scene_make(&c, SCENE_LIGHTS, SCENE_KEY | SCENE_RIM);
        capture_write(folder, f, &s[i], i + 1);
    }
    capture_manifest(folder, f, s, n);
    return folder;
}

static void leave(char *folder, scene *s, int n)
{
    for (int i = 0; i < n; i++)
        scene_free(&s[i]);
    folder_remove(folder);
}

static void remove_frame(const char *folder, int frame)
{
    char path[512];
    snprintf(path, sizeof path, "%s/cap.%04d.exr", folder, frame);
    assert_int_equal(unlink(path), 0);
}

/* What became of frames 1…15 of a run. */
typedef struct outcome {
    rl_code code[16];
    int files[16];
    char text[16][1600];
    uint64_t nonfinite[16], clamped[16];
    rl_run_summary summary;
} outcome;

static void note(void *ctx, const rl_frame_result *r)
{
    outcome *o = ctx;
    o->code[r->frame] = r->error->code;
    o->files[r->frame] = (int)r->n_files;
    o->nonfinite[r->frame] = r->nonfinite;
    o->clamped[r->frame] = r->clamped;
    snprintf(o->text[r->frame], sizeof o->text[0], "%.500s: %.1000s", r->error->file, r->error->text);
}

/* Where a run writes unless told otherwise: outputs have the names of the capture's files. */
static const char *out_of(const char *folder)
{
    static char path[512];
    snprintf(path, sizeof path, "%s/out", folder);
    return path;
}

static void run(const char *folder, const char *pipeline, rl_options options, outcome *o)
{
    static const char *const none[] = {"c.color"};
    rl_error err = {0};
    rl_run_hooks hooks = {.frame = note, .ctx = o};
    memset(o, 0, sizeof *o);
    options.dump = none;
    options.out = options.out ? options.out : out_of(folder);
    rl_session *s = capture_open(folder, pipeline, &options);
    if (rl_session_run(s, &hooks, &o->summary, &err))
        fail_msg("%s", err.text);
    rl_session_close(&s);
}

/* The red plane of an output, malloc'ed. */
static float *red(const char *folder, const char *name, size_t pixels)
{
    char path[512];
    float *out = calloc(pixels, sizeof *out);
    snprintf(path, sizeof path, "%s/%s", folder, name);
    made_read(path, 0, "R", out);
    return out;
}

/* The largest difference from the truth, relative to its maximum. */
static double off(const char *folder, const char *name, const scene *truth)
{
    double worst = 0, most = 0;
    float *r = red(folder, name, truth->n);
    for (size_t i = 0; i < truth->n; i++) {
        double d = fabs((double)r[i] - truth->plane[SCENE_COLOR][i]);
        worst = d > worst || isnan(d) ? d : worst;
        most = fmax(most, truth->plane[SCENE_COLOR][i]);
    }
    free(r);
    return worst / most;
}

/* ---- cameras and frames ---------------------------------------------------------------------------------------------- */

static void test_a_camera_a_frame(void **state)
{
    static const capture_form forms[] = {
        {.name = "header", .compression = RL_EXR_ZIP},
        {.name = "list", .camera = CAMERA_LIST, .fov = FOV_LIST, .forward_z = true, .frames = "1-4"},
    };
    (void)state;
    for (int i = 0; i < 2; i++) {
        scene s[4];
        outcome o;
        char *folder = make_frames(&forms[i], s, 4);
        run(folder, capture_pipeline, (rl_options){0}, &o);
        assert_int_equal(o.summary.frames, 4);
        assert_true(off(out_of(folder), "cap.0001.exr", &s[0]) < 2e-6);
        assert_true(off(out_of(folder), "cap.0004.exr", &s[3]) < 2e-6);
        run(folder, capture_pipeline, (rl_options){.frames = "2,4"}, &o); /* the list goes by number */
        assert_int_equal(o.summary.frames, 2);
        assert_true(off(out_of(folder), "cap.0002.exr", &s[1]) < 2e-6);
        assert_true(off(out_of(folder), "cap.0004.exr", &s[3]) < 2e-6);
        leave(folder, s, 4);
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
    rl_options options = {.pipeline_text = capture_pipeline, .captures = &folder, .n_captures = 1, .frames = frames};
    expect_wrong(&options, text);
}

static void test_frames_option(void **state)
{
    (void)state;
    scene s[3];
    outcome o;
    capture_form f = {.name = "frames"};
    char *folder = make_frames(&f, s, 3);
    expect_refused(folder, "2-5", "4");
    expect_refused(folder, "3-1", "3-1");
    expect_refused(folder, "x", "x");
    expect_refused(folder, "", "");
    run(folder, capture_pipeline, (rl_options){.frames = "1-3x2"}, &o);
    assert_int_equal(o.summary.frames, 2);
    assert_int_equal(o.files[3], 1);
    leave(folder, s, 3);
}

/* ---- missing and broken ------------------------------------------------------------------------------------------------ */

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
    outcome o;
    capture_form f = {.name = "missing", .frames = "1-6", .compression = RL_EXR_ZIP};
    char *folder = make_frames(&f, s, 6), *out = folder_new();
    remove_frame(folder, 1);
    cut_file(folder, 3);
    remove_frame(folder, 4);

    run(folder, capture_pipeline, (rl_options){.out = out}, &o);
    assert_int_equal(o.summary.failed, 3);
    assert_int_equal(o.code[1], RL_E_IO);
    assert_non_null(strstr(o.text[1], "cap.0001.exr"));
    assert_non_null(strstr(o.text[3], "cap.0003.exr"));
    assert_int_equal(folder_files(out), 3); /* 2, 5 and 6 */
    folder_remove(out);

    out = folder_new();
    capture_log_clear();
    run(folder, capture_pipeline, (rl_options){.out = out, .on_missing = RL_MISSING_SKIP}, &o);
    assert_int_equal(o.summary.failed, 0);
    assert_int_equal(o.files[3], 0);
    assert_int_equal(folder_files(out), 3);
    assert_non_null(strstr(capture_log(), "frame 3 is skipped"));
    folder_remove(out);

    out = folder_new();
    capture_log_clear();
    run(folder, capture_pipeline, (rl_options){.out = out, .on_missing = RL_MISSING_HOLD}, &o);
    assert_int_equal(o.summary.failed, 1); /* nothing is in front of the first */
    assert_non_null(strstr(o.text[1], "no frame before it to hold"));
    assert_int_equal(folder_files(out), 5);
    assert_true(off(out, "cap.0003.exr", &s[1]) < 2e-6); /* 3 and 4 show the layers and the camera of 2 */
    assert_true(off(out, "cap.0004.exr", &s[1]) < 2e-6);
    assert_true(off(out, "cap.0005.exr", &s[4]) < 2e-6);
    assert_non_null(strstr(capture_log(), "frame 4 holds the layers of frame 2"));
    folder_remove(out);
    leave(folder, s, 6);
}

static const char with_taa[] = "relit: 1\n"
                               "shading: {diffuse: lambert, specular: none}\n"
                               "materials: {default: {}}\n"
                               "graph:\n"
                               "  light: {pass: lighting}\n"
                               "  c: {pass: combine, in: {diffuse: light.diffuse, lit: light.lit}}\n"
                               "  aa: {pass: taa, in: {color: c.color}, blend: 0.1}\n"
                               "outputs:\n"
                               "  o: {image: aa.color, file: \"{capture}.{frame:04}.exr\", type: float}\n";

/* A frame without history is its own picture; `held` and `skipped` frames give and take none. */
static void test_cuts(void **state)
{
    (void)state;
    scene s[4];
    outcome o;
    capture_form f = {.name = "cuts", .frames = "1-4"};
    char *folder = make_frames(&f, s, 4);
    run(folder, with_taa, (rl_options){0}, &o);
    assert_true(off(out_of(folder), "cap.0001.exr", &s[0]) < 2e-6);
    assert_true(off(out_of(folder), "cap.0003.exr", &s[2]) > 1e-4); /* mixed with its past */
    remove_frame(folder, 2);
    for (int how = RL_MISSING_ERROR; how <= (int)RL_MISSING_HOLD; how++) {
        run(folder, with_taa, (rl_options){.on_missing = (rl_on_missing)how}, &o);
        assert_true(off(out_of(folder), "cap.0003.exr", &s[2]) < 2e-6);
        assert_true(off(out_of(folder), "cap.0004.exr", &s[3]) > 1e-4);
    }
    assert_true(off(out_of(folder), "cap.0002.exr", &s[0]) < 2e-6); /* the held one */
    run(folder, with_taa, (rl_options){.frames = "1,3-4"}, &o); /* a gap in what is processed */
    assert_true(off(out_of(folder), "cap.0003.exr", &s[2]) < 2e-6);
    leave(folder, s, 4);
}

/* ---- sizes ----------------------------------------------------------------------------------------------------------------- */

static void test_sizes_in_a_sequence(void **state)
{
    (void)state;
    scene s[5];
    outcome o;
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
    run(folder, with_taa, (rl_options){0}, &o);
    assert_int_equal(o.summary.failed, 0);
    assert_true(off(out_of(folder), "cap.0001.exr", &s[0]) < 2e-6);
    assert_true(off(out_of(folder), "cap.0003.exr", &s[2]) < 2e-6); /* no history */
    assert_true(off(out_of(folder), "cap.0005.exr", &s[4]) < 2e-6);
    leave(folder, s, 5);
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
    leave(folder, s, 3);
}

static void test_sizes_in_a_frame(void **state)
{
    (void)state;
    scene s[3];
    outcome o;
    capture_form f = {.name = "layers", .files = FILES_LAYERS};
    char *folder = make_frames(&f, s, 3), *other = folder_new(), from[512], to[512];
    scene_camera c = scene_camera_default();
    c.data[2] = 40;
    scene narrow = scene_make(&c, 7, 3);
    capture_write(other, &f, &narrow, 2);
    snprintf(from, sizeof from, "%s/albedo.0002.exr", other);
    snprintf(to, sizeof to, "%s/albedo.0002.exr", folder);
    assert_int_equal(rename(from, to), 0);
    run(folder, capture_pipeline, (rl_options){0}, &o);
    assert_int_equal(o.summary.failed, 1);
    assert_non_null(strstr(o.text[2], "albedo.0002.exr: layer 'albedo' has the data window (0, 0) - (39, 47)"));
    assert_true(off(out_of(folder), "cap.0003.exr", &s[2]) < 2e-6);
    scene_free(&narrow);
    folder_remove(other);
    leave(folder, s, 3);
}

/* ---- what is counted, what is refused ---------------------------------------------------------------------------------- */

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
    outcome o;
    capture_form f = {.name = "spoiled", .spoil = spoil, .compression = RL_EXR_ZIP};
    for (int files = FILES_ONE; files <= (int)FILES_PARTS; files++) {
        f.files = (capture_files)files;
        char *folder = make_frames(&f, s, 2);
        for (int i = 0; i < 5; i++)
            assert_int_equal(s[0].id[i], 0);
        run(folder, capture_pipeline, (rl_options){0}, &o);
        assert_int_equal(o.summary.failed, 0);
        assert_int_equal(o.nonfinite[1], 5);
        assert_int_equal(o.clamped[1], 3);
        assert_int_equal(o.summary.nonfinite, 10);
        assert_int_equal(o.summary.clamped, 6);
        leave(folder, s, 2);
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
    outcome o;
    capture_form f = {.name = "half an id", .spoil = half_an_id, .stencil = RL_EXR_FLOAT};
    char *folder = make_frames(&f, s, 1);
    run(folder, capture_pipeline, (rl_options){0}, &o);
    assert_int_equal(o.code[1], RL_E_DATA);
    assert_non_null(strstr(o.text[1], "(9, 5)"));
    assert_non_null(strstr(o.text[1], "1.5"));
    leave(folder, s, 1);

    f = (capture_form){.name = "an id without material"};
    folder = make_frames(&f, s, 1);
    char *some = text_replace(capture_pipeline, "default: {}", "a: {stencil: [1, 2]}");
    run(folder, some, (rl_options){0}, &o);
    size_t n = 0;
    for (size_t i = 0; i < s[0].n; i++)
        n += s[0].id[i] == 3;
    char text[64];
    snprintf(text, sizeof text, "3 (%zu pixels)", n);
    assert_int_equal(o.code[1], RL_E_DATA);
    assert_non_null(strstr(o.text[1], text));
    assert_int_equal(folder_files(folder), 2); /* the capture alone */
    free(some);
    leave(folder, s, 1);
}

/* ---- several captures ------------------------------------------------------------------------------------------------------ */

static void test_two_captures(void **state)
{
    (void)state;
    scene a[2], b[2];
    outcome o;
    capture_form first = {.name = "one"}, second = {.name = "two", .title = "other", .forward_z = true, .unit = "cm",
                                                    .metres = 0.01, .files = FILES_PARTS};
    char *one = make_frames(&first, a, 2), *two = make_frames(&second, b, 2), *out = folder_new();
    const char *both[] = {one, two}, *twice[] = {one, one};
    run(one, with_taa, (rl_options){.captures = both, .n_captures = 2, .out = out}, &o);
    assert_int_equal(o.summary.frames, 4);
    assert_int_equal(folder_files(out), 4);
    assert_true(off(out, "cap.0001.exr", &a[0]) < 2e-6);
    assert_true(off(out, "other.0001.exr", &b[0]) < 2e-6); /* the other's history is not its own */

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
    options = (rl_options){.pipeline_text = same, .captures = both, .n_captures = 1, .dump = dump, .n_dump = 1};
    expect_wrong(&options, "would both write 'cap.c.color.0001.exr'");
    free(same);
    options = (rl_options){.pipeline_text = capture_pipeline, .captures = both, .n_captures = 2, .out = one};
    expect_wrong(&options, "is read as frame 1 of capture 'cap' and would be written over"); /* the capture's own files */
    folder_remove(out);
    leave(one, a, 2);
    leave(two, b, 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_camera_a_frame),
        cmocka_unit_test(test_frames_option),
        cmocka_unit_test(test_missing),
        cmocka_unit_test(test_cuts),
        cmocka_unit_test(test_sizes_in_a_sequence),
        cmocka_unit_test(test_size_of_a_failed_frame),
        cmocka_unit_test(test_sizes_in_a_frame),
        cmocka_unit_test(test_counts),
        cmocka_unit_test(test_ids_refused),
        cmocka_unit_test(test_two_captures),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
