/* The pixels of what a run writes: every compression of EXR, and what displays show against OpenColorIO. */
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
#include "tests/output_run.h"
#include "tests/tool_run.h"

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
    char *out = output_run(text.text, NULL, NULL);
    for (int full = 0; full < 2; full++) {
        float *exact = NULL;
        double peak = 0;
        for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
            char name[32];
            snprintf(name, sizeof name, "%zu.%d.exr", i, full);
            rl_exr *f = output_open(out, name);
            assert_int_equal(rl_exr_part_at(f, 0)->compression, all[i].id);
            output_expect_coverage(f, "A");
            float *r = output_floats(f, "R");
            exact = exact ? exact : r;
            for (size_t k = 0; k < output_truth.n; k++)
                peak = fmax(peak, (double)exact[k]);
            for (size_t k = 0; k < output_truth.n; k++) {
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

/* ---- displays ---- */

/* OpenColorIO's own result for every pixel of c.color, as three planes. */
static void reference(const char *out, const rl_ocio_request *request, float stops, float *rgb[3])
{
    rl_ocio *config = NULL;
    rl_ocio_transform *t = NULL;
    rl_exr *f = output_open(out, "linear.exr");
    static const char *const names[] = {"R", "G", "B"};
    for (int c = 0; c < 3; c++) {
        rgb[c] = output_floats(f, names[c]);
        for (size_t i = 0; i < output_truth.n; i++)
            rgb[c][i] *= exp2f(stops);
    }
    assert_int_equal(rl_ocio_open("configs/color/relit.ocio", &config, NULL), RL_OK);
    assert_int_equal(rl_ocio_transform_new(config, request, &t, NULL), RL_OK);
    assert_int_equal(rl_ocio_apply(t, rgb[0], rgb[1], rgb[2], output_truth.n, NULL), RL_OK);
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
    char *out = output_run(
        "\n  l: {image: c.color, file: linear.exr, type: float}"
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
        cmocka_unit_test(test_compressions),
        cmocka_unit_test(test_displays),
    };
    return cmocka_run_group_tests(tests, output_setup, output_teardown);
}
