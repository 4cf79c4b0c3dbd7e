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
#include "graph/run/shim_ocio.h"
#include "tests/capture_run.h"
#include "tests/tool_run.h"

static const uint32_t ids[4] = {0, 4294967295u, 5, 70000}, time_code[2] = {0x01020304, 77};
static const capture_form form = {.name = "outputs",
                                  .compression = RL_EXR_ZIP,
                                  .ids = ids,
                                  .time_code = time_code,
                                  .fps = {24000, 1001},
                                  .owner = "the test",
                                  .empty = 1e10,
                                  .empty_key = "1e10"};
static scene truth;   /* data window -9,5 50x30 of the display window 0,0 72x48, shifted lens, wide pixels */
static char *capture; /* its folder */

static int setup(void **state)
{
    (void)state;
    scene_camera c = scene_camera_default();
    const int window[4] = {-9, 5, 50, 30};
    memcpy(c.data, window, sizeof window);
    c.center[0] = 0.125;
    c.aspect = 1.25;
    if (!capture_start())
        return -1;
    truth = scene_make(&c, SCENE_LIGHTS, SCENE_KEY | SCENE_RIM);
    capture = folder_new();
    capture_write(capture, &form, &truth, 7);
    capture_manifest(capture, &form, &truth, 1);
    return 0;
}

static int teardown(void **state)
{
    (void)state;
    scene_free(&truth);
    folder_remove(capture);
    capture_stop();
    return 0;
}

/* Runs the common pipeline with these outputs (a YAML map); the folder they are in. */
static char *run(const char *outputs, const int *crop, rl_run_summary *summary)
{
    static const char *const none[] = {NULL};
    const char *before = strstr(capture_pipeline, "outputs:");
    rl_run_summary own;
    rl_error err = {0};
    rl_str text = {0};
    char *out = folder_new();
    const char *path = capture;
    rl_options options = {.out = out, .captures = &path, .n_captures = 1, .dump = none};
    rl_str_printf(&text, "%.*soutputs: %s\n", (int)(before - capture_pipeline), capture_pipeline, outputs);
    for (int i = 0; crop && i < 4; i++)
        options.crop[i] = crop[i];
    capture_log_clear();
    rl_session *s = capture_open(capture, text.text, &options);
    summary = summary ? summary : &own;
    if (rl_session_run(s, NULL, summary, &err))
        fail_msg("%s", err.text);
    rl_session_close(&s);
    rl_str_free(&text);
    return out;
}

static rl_exr *open_exr(const char *folder, const char *name)
{
    rl_exr *file = NULL;
    rl_error err = {0};
    char *path = path_in(folder, name);
    if (rl_exr_open(path, 0, &file, &err))
        fail_msg("%s: %s", path, err.text);
    free(path);
    return file;
}

/* One channel, malloc'ed, rows without gaps. */
static float *floats(const rl_exr *file, const char *channel)
{
    const rl_exr_part *p = rl_exr_part_at(file, 0);
    float *out = calloc((size_t)p->width * (size_t)p->height, sizeof *out);
    rl_exr_plane plane = {.channel = channel, .floats = out, .stride = (size_t)p->width};
    rl_error err = {0};
    if (rl_exr_read(file, 0, &plane, 1, NULL, NULL, &err))
        fail_msg("%s: %s", channel, err.text);
    return out;
}

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
    float *p = floats(file, channel);
    for (size_t i = 0; i < truth.n; i++)
        if (!(fabs((double)p[i] - truth.plane[plane][i]) <= tolerance) &&
            (plane / 3 != SCENE_NORMAL / 3 || truth.id[i]))
            fail_msg("%s of pixel %zu is %g, not %g", channel, i, (double)p[i], truth.plane[plane][i]);
    free(p);
}

static void expect_coverage(const rl_exr *file, const char *channel)
{
    float *p = floats(file, channel);
    for (size_t i = 0; i < truth.n; i++)
        assert_true(p[i] == (truth.id[i] ? 1 : 0));
    free(p);
}

static void expect_ids(const rl_exr *file, const char *channel)
{
    uint32_t *p = calloc(truth.n, sizeof *p);
    rl_exr_plane plane = {.channel = channel, .ids = p, .stride = (size_t)truth.width};
    assert_int_equal(rl_exr_read(file, 0, &plane, 1, NULL, NULL, NULL), RL_OK);
    for (size_t i = 0; i < truth.n; i++)
        assert_int_equal(p[i], ids[truth.id[i]]);
    free(p);
}

/* ---- channels
 * ------------------------------------------------------------------------------------------------------------
 */

static void test_letters(void **state)
{
    (void)state;
    char *out = run(
        "\n  all: {file: all.exr, type: float, colorspace: ACEScg, layers: {lit: c.color, n: capture.normal,"
        " m: capture.motion, z: capture.depth, s: capture.stencil, key: capture.shadow.key, al: "
        "capture.albedo}}",
        NULL, NULL);
    rl_exr *f = open_exr(out, "all.exr");
    expect_channels(
        f, "al.A:float al.B:float al.G:float al.R:float key.V:float lit.A:float lit.B:float lit.G:float "
           "lit.R:float m.X:float m.Y:float n.X:float n.Y:float n.Z:float s.ID:uint z.V:float");
    expect_coverage(f, "lit.A");
    expect_coverage(f, "al.A");
    expect_ids(f, "s.ID");
    expect_plane(f, "n.X", SCENE_NORMAL, 4e-7); /* data is not converted to ACEScg */
    expect_plane(f, "n.Z", SCENE_NORMAL + 2, 4e-7);
    expect_plane(f, "m.Y", SCENE_MOTION + 1, 1e-6);
    expect_plane(f, "z.V", SCENE_DEPTH, 1e-6);
    expect_plane(f, "key.V", SCENE_SHADOW, 1e-6);
    float *r = floats(f, "lit.R"); /* colours are */
    for (size_t i = 0; i < truth.n; i++) {
        double want = 0.6130974024 * truth.plane[SCENE_COLOR][i] +
                      0.3395231462 * truth.plane[SCENE_COLOR + 1][i] +
                      0.0473794514 * truth.plane[SCENE_COLOR + 2][i];
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
    };
    (void)state;
    rl_str text = {0};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++)
        rl_str_printf(&text, "\n  o%zu: {image: %s, file: \"sub/%zu.exr\"}", i, all[i].image, i);
    char *out = run(text.text, NULL, NULL);
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
        char name[32];
        rl_exr_value v;
        snprintf(name, sizeof name, "sub/%zu.exr", i);
        rl_exr *f = open_exr(out, name);
        expect_channels(f, all[i].channels);
        assert_true(rl_exr_attr(f, 0, "chromaticities", &v) == (i == 0)); /* only colours have primaries */
        if (i == 5)
            expect_ids(f, "ID");
        rl_exr_close(&f);
    }
    rl_str_free(&text);
    folder_remove(out);
}

static void test_compressions(void **state)
{
    /* the largest error that each may make in half and float, relative to the peak; B44 leaves float alone */
    static const struct {
        const char *name;
        rl_exr_compression id;
        double half, full;
    } all[] = {
        {"none", RL_EXR_NONE, 0, 0},       {"rle", RL_EXR_RLE, 0, 0},     {"zips", RL_EXR_ZIPS, 0, 0},
        {"zip", RL_EXR_ZIP, 0, 0},         {"piz", RL_EXR_PIZ, 0, 0},     {"pxr24", RL_EXR_PXR24, 0, 2e-5},
        {"b44", RL_EXR_B44, 0.2, 0},       {"b44a", RL_EXR_B44A, 0.2, 0}, {"dwaa", RL_EXR_DWAA, 0.05, 0.05},
        {"DWAB", RL_EXR_DWAB, 0.05, 0.05},
    };
    (void)state;
    rl_str text = {0};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++)
        for (int full = 0; full < 2; full++)
            rl_str_printf(&text, "\n  o%zu%d: {image: c.color, file: %zu.%d.exr, compression: %s, type: %s}",
                          i, full, i, full, all[i].name, full ? "float" : "half");
    char *out = run(text.text, NULL, NULL);
    for (int full = 0; full < 2; full++) {
        float *exact = NULL;
        double peak = 0;
        for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
            char name[32];
            snprintf(name, sizeof name, "%zu.%d.exr", i, full);
            rl_exr *f = open_exr(out, name);
            assert_int_equal(rl_exr_part_at(f, 0)->compression, all[i].id);
            expect_coverage(f, "A");
            float *r = floats(f, "R");
            exact = exact ? exact : r;
            for (size_t k = 0; k < truth.n; k++)
                peak = fmax(peak, (double)exact[k]);
            for (size_t k = 0; k < truth.n; k++) {
                double most = (full ? all[i].full : all[i].half) * peak;
                if (!(fabs((double)r[k] - (double)exact[k]) <= most))
                    fail_msg("%s %d: %g instead of %g", all[i].name, full, (double)r[k], (double)exact[k]);
            }
            if (r != exact)
                free(r);
            rl_exr_close(&f);
        }
        free(exact);
    }
    rl_str_free(&text);
    folder_remove(out);
}

/* ---- headers
 * -------------------------------------------------------------------------------------------------------------
 */

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
    char *out = run("\n  cg: {image: c.color, file: cg.exr, colorspace: ACEScg}"
                    "\n  own: {image: c.color, file: own.exr}"
                    "\n  view: {image: c.color, file: view.exr, display: sRGB, view: ACES}"
                    "\n  log: {image: c.color, file: log.exr, colorspace: ACEScct}",
                    NULL, NULL);
    static const char *const names[] = {"cg.exr", "own.exr", "view.exr", "log.exr"};
    for (int i = 0; i < 4; i++) {
        rl_exr *f = open_exr(out, names[i]);
        const rl_exr_part *p = rl_exr_part_at(f, 0);
        rl_exr_value v = {0};
        double matrix[16];
        if (i < 2)
            expect_numbers(f, "chromaticities", i ? rec709 : ap1, 8, 1e-6);
        else
            assert_false(rl_exr_attr(f, 0, "chromaticities", &v));
        for (int k = 0; k < 16; k++)
            matrix[k] = k % 4 < 3 ? truth.camera.view[4 * (k % 4) + k / 4] : k == 15;
        expect_numbers(f, "worldToCamera", matrix, 16, 1e-6);
        expect_numbers(f, "camera:fovx", &fov, 1, 1e-7);
        expect_numbers(f, "timeCode", code, 2, 0);
        expect_numbers(f, "framesPerSecond", fps, 2, 0);
        assert_true(rl_exr_attr(f, 0, "owner", &v) && !strcmp(v.text, "the test"));
        assert_true(rl_exr_attr(f, 0, "relit:version", &v) && !strcmp(v.text, RL_VERSION));
        assert_true(rl_exr_attr(f, 0, "relit:pipeline", &v) && strlen(v.text) > 17);
        assert_true(p->data_window.x0 == -9 && p->data_window.y0 == 5 && p->data_window.x1 == 40 &&
                    p->data_window.y1 == 34);
        assert_true(p->display_window.x0 == 0 && p->display_window.x1 == 71 && p->display_window.y1 == 47);
        assert_true(p->pixel_aspect == 1.25f && p->screen_center[0] == 0.125f);
        assert_true(fabs((double)p->screen_width - 2 * tan(0.4)) < 1e-6);
        rl_exr_close(&f);
    }
    folder_remove(out);
}

/* ---- regions
 * --------------------------------------------------------------------------------------------------------------
 */

static void test_crop(void **state)
{
    static const int crop[4] = {-20, 8, 40, 12}, beside[4] = {41, 5, 10, 10};
    (void)state;
    const char *outputs =
        "\n  e: {image: c.color, file: e.exr, type: float}\n  p: {image: c.color, file: p.png, display: sRGB}"
        "\n  s: {image: capture.stencil, file: s.exr}";
    rl_run_summary summary;
    char *whole = run(outputs, NULL, NULL), *part = run(outputs, crop, NULL),
         *none = run(outputs, beside, &summary);
    rl_exr *a = open_exr(whole, "e.exr"), *b = open_exr(part, "e.exr"), *s = open_exr(part, "s.exr");
    const rl_exr_part *p = rl_exr_part_at(b, 0);
    assert_true(p->data_window.x0 == -9 && p->data_window.y0 == 8 && p->data_window.x1 == 19 &&
                p->data_window.y1 == 19);
    assert_true(p->display_window.x0 == 0 && p->display_window.x1 == 71);
    float *x = floats(a, "G"), *y = floats(b, "G"), *cover = floats(b, "A");
    uint32_t id[29 * 12];
    rl_exr_plane plane = {.channel = "ID", .ids = id, .stride = 29};
    assert_int_equal(rl_exr_read(s, 0, &plane, 1, NULL, NULL, NULL), RL_OK);
    for (int i = 0; i < 29 * 12; i++) {
        int k = (i / 29 + 3) * 50 + i % 29;
        assert_true(y[i] == x[k]);
        assert_true(cover[i] == (truth.id[k] ? 1 : 0));
        assert_int_equal(id[i], ids[truth.id[k]]);
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

/* ---- displays
 * -------------------------------------------------------------------------------------------------------------
 */

/* OpenColorIO's own result for every pixel of c.color, as three planes. */
static void reference(const char *out, const rl_ocio_request *request, float stops, float *rgb[3])
{
    rl_ocio *config = NULL;
    rl_ocio_transform *t = NULL;
    rl_exr *f = open_exr(out, "linear.exr");
    static const char *const names[] = {"R", "G", "B"};
    for (int c = 0; c < 3; c++) {
        rgb[c] = floats(f, names[c]);
        for (size_t i = 0; i < truth.n; i++)
            rgb[c][i] *= exp2f(stops);
    }
    assert_int_equal(rl_ocio_open("configs/color/relit.ocio", &config, NULL), RL_OK);
    assert_int_equal(rl_ocio_transform_new(config, request, &t, NULL), RL_OK);
    assert_int_equal(rl_ocio_apply(t, rgb[0], rgb[1], rgb[2], truth.n, NULL), RL_OK);
    rl_ocio_transform_free(&t);
    rl_ocio_free(&config);
    rl_exr_close(&f);
}

/* The largest difference in codes of `levels`, over the display window; pixels without data must be black. */
static double codes_off(const char *out, const char *name, float *const rgb[3], double levels)
{
    char *path = path_in(out, name);
    rl_image_file f;
    rl_error err = {0};
    double worst = 0;
    if (rl_image_file_read(path, &f, &err))
        fail_msg("%s: %s", name, err.text);
    assert_int_equal(f.width, 72);
    assert_int_equal(f.height, 48);
    for (int i = 0; i < 72 * 48; i++) {
        int x = i % 72 + 9, y = i / 72 - 5;
        for (int c = 0; c < 3; c++) {
            double want = 0, have = (double)f.planes[c * 72 * 48 + i];
            if (x >= 0 && x < 50 && y >= 0 && y < 30)
                want = fmin(fmax((double)rgb[c][y * 50 + x], 0), 1);
            worst = fmax(worst, fabs(have - want) * levels);
        }
    }
    rl_image_file_free(&f);
    free(path);
    return worst;
}

static void test_displays(void **state)
{
    (void)state;
    char *out =
        run("\n  l: {image: c.color, file: linear.exr, type: float}"
            "\n  a: {image: c.color, file: a.png, display: sRGB, view: ACES, exposure: 0.5}"
            "\n  b: {image: c.color, file: b.png, display: sRGB, view: ACES, exposure: 0.5, type: uint16}"
            "\n  c: {image: c.color, file: c.tif, display: Rec.709, view: Un-tone-mapped}"
            "\n  d: {image: c.color, file: d.tiff, display: sRGB, view: ACES, exposure: 0.5, type: uint8, "
            "compression: lzw}"
            "\n  j: {image: c.color, file: j.jpg, display: sRGB, view: ACES, exposure: 0.5, quality: 98}",
            NULL, NULL);
    rl_ocio_request aces = {.from = "lin_rec709", .display = "sRGB", .view = "ACES"};
    rl_ocio_request plain = {.from = "lin_rec709", .display = "Rec.709", .view = "Un-tone-mapped"};
    float *a[3], *c[3];
    reference(out, &aces, 0.5f, a);
    reference(out, &plain, 0, c);
    double png = codes_off(out, "a.png", a, 255), deep = codes_off(out, "b.png", a, 65535),
           tiff = codes_off(out, "c.tif", c, 65535), small = codes_off(out, "d.tiff", a, 255),
           jpeg = codes_off(out, "j.jpg", a, 255);
    print_message("# codes off: PNG %.3f (16 bit %.2f), TIFF %.2f (8 bit %.3f), JPEG %.1f\n", png, deep, tiff,
                  small, jpeg);
    assert_true(png <= 0.501 && small <= 0.501); /* half a code is the rounding */
    assert_true(deep <= 1 && tiff <= 1);
    assert_true(jpeg <= 12); /* an edge of the window through a DCT */
    for (int i = 0; i < 3; i++) {
        free(a[i]);
        free(c[i]);
    }
    folder_remove(out);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_letters),      cmocka_unit_test(test_single_letters),
        cmocka_unit_test(test_compressions), cmocka_unit_test(test_header),
        cmocka_unit_test(test_crop),         cmocka_unit_test(test_displays),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
