/* What a run writes (DESIGN 3): channels, types, colours, windows and headers, read back from the files. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "graph/run/image_file.h"
#include "tests/capture_run.h"
#include "tests/output_run.h"
#include "tests/tool_run.h"

static void expect_channels(const rl_exr *file, const char *names)
{
    rl_str s = {0};
    const rl_exr_part *p = rl_exr_part_at(file, 0);
    for (size_t i = 0; i < p->n_channels; i++)
        rl_str_printf(&s, "%s%s:%s", i ? " " : "", p->channels[i].name,
                      rl_exr_pixel_name(p->channels[i].type));
    assert_string_equal(rl_str_text(&s), names);
    rl_str_free(&s);
}

static void expect_plane(const rl_exr *file, const char *channel, int plane, double tolerance)
{
    float *p = output_floats(file, channel);
    for (size_t i = 0; i < output_truth.n; i++)
        if (!(fabs((double)p[i] - output_truth.plane[plane][i]) <= tolerance) &&
            (plane / 3 != SCENE_NORMAL / 3 || output_truth.id[i]))
            fail_msg("%s of pixel %zu is %g, not %g", channel, i, (double)p[i], output_truth.plane[plane][i]);
    free(p);
}

static void expect_ids(const rl_exr *file, const char *channel)
{
    uint32_t *p = calloc(output_truth.n, sizeof *p);
    rl_exr_plane plane = {.channel = channel, .ids = p, .stride = (size_t)output_truth.width};
    assert_int_equal(rl_exr_read(file, 0, &plane, 1, NULL, NULL, NULL), RL_OK);
    for (size_t i = 0; i < output_truth.n; i++)
        assert_int_equal(p[i], output_ids[output_truth.id[i]]);
    free(p);
}

/* ---- channels ---- */

static void test_letters(void **state)
{
    (void)state;
    char *out = output_run(
        "\n  all: {file: all.exr, type: float, colorspace: ACEScg, layers: {lit: c.color, n: capture.normal,"
        " m: capture.motion, z: capture.depth, s: capture.stencil, key: capture.shadow.key, al: "
        "capture.albedo}}",
        NULL, NULL);
    rl_exr *f = output_open(out, "all.exr");
    expect_channels(
        f, "al.A:float al.B:float al.G:float al.R:float key.V:float lit.A:float lit.B:float lit.G:float "
           "lit.R:float m.X:float m.Y:float n.X:float n.Y:float n.Z:float s.ID:uint z.V:float");
    output_expect_coverage(f, "lit.A");
    output_expect_coverage(f, "al.A");
    expect_ids(f, "s.ID");
    expect_plane(f, "n.X", SCENE_NORMAL, 4e-7); /* data is not converted to ACEScg */
    expect_plane(f, "n.Z", SCENE_NORMAL + 2, 4e-7);
    expect_plane(f, "m.Y", SCENE_MOTION + 1, 1e-6);
    expect_plane(f, "z.V", SCENE_DEPTH, 1e-6);
    expect_plane(f, "key.V", SCENE_SHADOW, 1e-6);
    float *r = output_floats(f, "lit.R"); /* colours are */
    for (size_t i = 0; i < output_truth.n; i++) {
        double want = 0.6130974024 * output_truth.plane[SCENE_COLOR][i] +
                      0.3395231462 * output_truth.plane[SCENE_COLOR + 1][i] +
                      0.0473794514 * output_truth.plane[SCENE_COLOR + 2][i];
        assert_true(fabs((double)r[i] - want) <= 4e-6);
    }
    free(r);
    rl_exr_close(&f);
    folder_remove(out);
}

static void test_single_letters(void **state)
{
    static const struct {
        const char *image, *channels;
    } all[] = {
        {"c.color", "A:half B:half G:half R:half"}, {"capture.normal", "X:half Y:half Z:half"},
        {"capture.motion", "X:half Y:half"},        {"capture.depth", "V:half"},
        {"capture.shadow.rim", "V:half"},           {"capture.stencil", "ID:uint"},
        {"capture.shadow", "key:half rim:half"}, /* a plane a light, which have names */
    };
    (void)state;
    rl_str text = {0};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++)
        rl_str_printf(&text, "\n  o%zu: {image: %s, file: \"sub/%zu.EXR\"}", i, all[i].image, i);
    char *out = output_run(text.text, NULL, NULL);
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
        char name[32];
        rl_exr_value v;
        snprintf(name, sizeof name, "sub/%zu.EXR", i);
        rl_exr *f = output_open(out, name);
        expect_channels(f, all[i].channels);
        assert_true(rl_exr_attr(f, 0, "chromaticities", &v) == (i == 0)); /* only colours have primaries */
        if (i == 5)
            expect_ids(f, "ID");
        rl_exr_close(&f);
    }
    rl_str_free(&text);
    folder_remove(out);
}

static void expect_refused(const char *outputs, const char *text)
{
    const char *before = strstr(capture_pipeline, "outputs:");
    rl_str p = {0};
    rl_session *s = NULL;
    rl_error err = {0};
    rl_str_printf(&p, "%.*soutputs: {o: {%s}}\ncapture: {files: memory, preset: relit}\nlights: {}\n",
                  (int)(before - capture_pipeline), capture_pipeline, outputs);
    rl_options options = {.pipeline_text = p.text};
    assert_int_equal(rl_session_open(&options, &s, &err), RL_E_CONFIG);
    if (!strstr(err.text, text))
        fail_msg("\"%s\" is not in \"%s\"", text, err.text);
    rl_str_free(&p);
}

static void test_refused(void **state)
{
    (void)state;
    expect_refused("image: capture.stencil, file: a.png",
                   "a .png file cannot hold 'capture.stencil' (id, 1 plane); write .exr");
    expect_refused("image: capture.motion, file: a.TIF",
                   "a .TIF file cannot hold 'capture.motion' (vec2, 2 planes)");
    expect_refused("image: capture.depth, file: a.exr, display: sRGB",
                   "only rgb images are colour-converted, 'capture.depth' is scalar");
    expect_refused("image: capture.normal, file: a.exr, exposure: 1",
                   "leave out colorspace, display, view, look and exposure");
    expect_refused("layers: {a: c.color, b: c.color}, file: a.png", "a .png file holds one image");
}

/* ---- headers ---- */

static void expect_numbers(const rl_exr *f, const char *name, const double *want, int n, double tolerance)
{
    rl_exr_value v = {0};
    if (!rl_exr_attr(f, 0, name, &v))
        fail_msg("there is no attribute %s", name);
    assert_int_equal(rl_exr_type_numbers(v.type), n);
    for (int i = 0; i < n; i++)
        assert_true(fabs(v.v[i] - want[i]) <= tolerance);
}

static void test_header(void **state)
{
    static const double ap1[8] = {0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767},
                        rec709[8] = {0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290},
                        fps[2] = {24000, 1001}, code[2] = {0x01020304, 77}, fov = 0.8;
    (void)state;
    char *out = output_run("\n  cg: {image: c.color, file: cg.exr, colorspace: ACEScg}"
                           "\n  own: {image: c.color, file: own.exr}"
                           "\n  view: {image: c.color, file: view.exr, display: sRGB, view: ACES}"
                           "\n  log: {image: c.color, file: log.exr, colorspace: ACEScct}",
                           NULL, NULL);
    static const char *const names[] = {"cg.exr", "own.exr", "view.exr", "log.exr"};
    for (int i = 0; i < 4; i++) {
        rl_exr *f = output_open(out, names[i]);
        const rl_exr_part *p = rl_exr_part_at(f, 0);
        rl_exr_value v = {0};
        double matrix[16];
        if (i < 2)
            expect_numbers(f, "chromaticities", i ? rec709 : ap1, 8, 1e-6);
        else
            assert_false(rl_exr_attr(f, 0, "chromaticities", &v));
        for (int k = 0; k < 16; k++)
            matrix[k] = k % 4 < 3 ? output_truth.camera.view[4 * (k % 4) + k / 4] : k == 15;
        expect_numbers(f, "worldToCamera", matrix, 16, 1e-6);
        expect_numbers(f, "camera:fovx", &fov, 1, 1e-7);
        expect_numbers(f, "timeCode", code, 2, 0);
        expect_numbers(f, "framesPerSecond", fps, 2, 0);
        assert_true(rl_exr_attr(f, 0, "owner", &v) && !strcmp(v.text, "the test"));
        assert_true(rl_exr_attr(f, 0, "relit:version", &v) && !strcmp(v.text, RL_VERSION));
        assert_true(rl_exr_attr(f, 0, "relit:pipeline", &v) && strlen(v.text) > 17);
        assert_true(rl_exr_attr(f, 0, "relit:capture", &v) && strlen(v.text) > 17);
        assert_true(p->data_window.x0 == -9 && p->data_window.y0 == 5 && p->data_window.x1 == 40 &&
                    p->data_window.y1 == 34);
        assert_true(p->display_window.x0 == 0 && p->display_window.x1 == 71 && p->display_window.y1 == 47);
        assert_true(p->pixel_aspect == 1.25f && p->screen_center[0] == 0.125f);
        assert_true(fabs((double)p->screen_width - 2 * tan(0.4)) < 1e-6);
        rl_exr_close(&f);
    }
    folder_remove(out);
}

/* ---- regions ---- */

static void test_crop(void **state)
{
    static const int crop[4] = {-20, 8, 40, 12}, beside[4] = {41, 5, 10, 10};
    (void)state;
    const char *outputs =
        "\n  e: {image: c.color, file: e.exr, type: float}\n  p: {image: c.color, file: p.png, display: sRGB}"
        "\n  s: {image: capture.stencil, file: s.exr}";
    rl_run_summary summary;
    char *whole = output_run(outputs, NULL, NULL), *part = output_run(outputs, crop, NULL),
         *none = output_run(outputs, beside, &summary);
    rl_exr *a = output_open(whole, "e.exr"), *b = output_open(part, "e.exr"), *s = output_open(part, "s.exr");
    const rl_exr_part *p = rl_exr_part_at(b, 0);
    assert_true(p->data_window.x0 == -9 && p->data_window.y0 == 8 && p->data_window.x1 == 19 &&
                p->data_window.y1 == 19);
    assert_true(p->display_window.x0 == 0 && p->display_window.x1 == 71);
    float *x = output_floats(a, "G"), *y = output_floats(b, "G"), *cover = output_floats(b, "A");
    uint32_t id[29 * 12];
    rl_exr_plane plane = {.channel = "ID", .ids = id, .stride = 29};
    assert_int_equal(rl_exr_read(s, 0, &plane, 1, NULL, NULL, NULL), RL_OK);
    for (int i = 0; i < 29 * 12; i++) {
        int k = (i / 29 + 3) * 50 + i % 29;
        assert_true(y[i] == x[k]);
        assert_true(cover[i] == (output_truth.id[k] ? 1 : 0));
        assert_int_equal(id[i], output_ids[output_truth.id[k]]);
    }
    char *png = path_in(part, "p.png");
    rl_image_file file;
    assert_int_equal(rl_image_file_read(png, &file, NULL), RL_OK);
    assert_int_equal(file.width, 29);
    assert_int_equal(file.height, 12);
    rl_image_file_free(&file);
    assert_int_equal(summary.failed, 1);
    assert_int_equal(folder_files(none), 0);
    free(png);
    free(x);
    free(y);
    free(cover);
    rl_exr_close(&a);
    rl_exr_close(&b);
    rl_exr_close(&s);
    folder_remove(whole);
    folder_remove(part);
    folder_remove(none);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_letters), cmocka_unit_test(test_single_letters), cmocka_unit_test(test_refused),
        cmocka_unit_test(test_header),  cmocka_unit_test(test_crop),
    };
    return cmocka_run_group_tests(tests, output_setup, output_teardown);
}
