/* `relit diff`: what it prints, what it writes, its exit statuses, and what it refuses. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "graph/run/exr.h"
#include "graph/run/image_file.h"
#include "tests/tool_run.h"

enum { W = 40, H = 30, N = W * H };

#define DIFF(...) tool_run((const char *const[]){"diff", __VA_ARGS__, NULL})

static char *folder;
static float pixels[4][N];
static rl_exr_pixel exr_type = RL_EXR_FLOAT;

/* ---- files -----------------------------------------------------------------------------------------------
 */

/* A ramp with some structure; `change` moves every value. */
static void draw(float change)
{
    for (int c = 0; c < 4; c++)
        for (int i = 0; i < N; i++)
            pixels[c][i] = 0.1f + 0.7f * (float)(i % W) / W + 0.02f * (float)(c * (i / W % 4)) + change;
}

static char *write_png(const char *name, int channels, rl_image_type type)
{
    char *path = path_in(folder, name);
    rl_error err = {0};
    rl_image_planes image = {W, H, channels, {pixels[0], pixels[1], pixels[2], pixels[3]}, W};
    rl_image_options options = {.type = type};
    rl_image_file_write(path, &image, &options, NULL, NULL, &err);
    assert_string_equal(err.text, "");
    return path;
}

/* Channels in the order of `names`, each a plane of `pixels`. */
static char *write_exr(const char *name, const char *const *names, rl_exr_box window,
                       const rl_exr_attribute *attr)
{
    char *path = path_in(folder, name);
    rl_exr_source channels[8];
    size_t n = 0;
    for (; names[n]; n++)
        channels[n] = (rl_exr_source){names[n], exr_type, pixels[n % 4], NULL, W};
    rl_exr_image image = {.data_window = window,
                          .display_window = window,
                          .channels = channels,
                          .n_channels = n,
                          .compression = RL_EXR_ZIP,
                          .attrs = attr,
                          .n_attrs = attr != NULL};
    rl_error err = {0};
    rl_exr_write(path, &image, NULL, NULL, &err);
    assert_string_equal(err.text, "");
    return path;
}

static const rl_exr_box box = {0, 0, W - 1, H - 1};
static const char *const rgb[] = {"R", "G", "B", NULL}, *const rgba[] = {"R", "G", "B", "A", NULL};

/* ---- results ---------------------------------------------------------------------------------------------
 */

static void expect(const tool_result *r, int status, const char *err)
{
    if (r->status != status || (err ? !strstr(r->err, err) : *r->err != 0))
        print_error("status %d\n%s%s\n", r->status, r->out, r->err);
    assert_int_equal(r->status, status);
    if (err)
        assert_non_null(strstr(r->err, err));
    else
        assert_string_equal(r->err, "");
}

/* Refused: status 2, this text, and nothing on stdout. */
static void refuse(tool_result r, const char *text)
{
    expect(&r, 2, text);
    assert_string_equal(r.out, "");
    tool_result_free(&r);
}

/* A number of the one object that was printed; NAN for null. Frees r. */
static void expect_json(tool_result r, const char *metric, double out[4])
{
    static const char *const keys[] = {"mean", "median", "p95", "max"};
    json_error_t error;
    expect(&r, 0, NULL);
    json_t *object = json_loads(r.out, 0, &error);
    assert_non_null(object);
    assert_int_equal(json_object_size(object), 5);
    assert_string_equal(json_string_value(json_object_get(object, "metric")), metric);
    for (int i = 0; i < 4; i++) {
        json_t *v = json_object_get(object, keys[i]);
        assert_true(json_is_number(v) || json_is_null(v));
        out[i] = json_is_null(v) ? (double)NAN : json_number_value(v);
    }
    json_decref(object);
    tool_result_free(&r);
}

static void assert_close(double got, double want, double tolerance)
{
    if (!(fabs(got - want) <= tolerance))
        print_error("%.9g instead of %.9g\n", got, want);
    assert_true(fabs(got - want) <= tolerance);
}

/* ---- tests -----------------------------------------------------------------------------------------------
 */

static void test_equal_files(void **state)
{
    (void)state;
    static const char *const metrics[] = {"flip", "hdrflip", "psnr", "ssim", "rmse", "max"};
    double s[4];
    draw(0);
    char *png = write_png("a.png", 3, RL_IMAGE_U8), *exr = write_exr("a.exr", rgba, box, NULL);
    for (size_t m = 0; m < 6; m++) {
        for (int k = 0; k < 2; k++) {
            const char *path = k ? exr : png;
            expect_json(DIFF(path, path, "--json", "--metric", metrics[m]), metrics[m], s);
            if (!strcmp(metrics[m], "psnr"))
                assert_true(isnan(s[0]) && isnan(s[1]) && isnan(s[2]) && isnan(s[3]));
            else
                for (int i = 0; i < 4; i++)
                    assert_close(s[i], !strcmp(metrics[m], "ssim"), 0);
        }
    }
    /* Infinite, and so never under a limit. */
    tool_result r = DIFF(png, png, "--metric", "psnr", "--fail-over", "1000");
    expect(&r, 0, NULL);
    assert_non_null(strstr(r.out, "inf dB"));
    tool_result_free(&r);
    free(png);
    free(exr);
}

static void test_defaults(void **state)
{
    (void)state;
    double s[4];
    draw(0);
    char *a8 = write_png("a8.png", 3, RL_IMAGE_U8), *a = write_exr("a.exr", rgb, box, NULL);
    char *a16 = write_png("a16.png", 3, RL_IMAGE_U16), *tif = write_png("a.tif", 3, RL_IMAGE_FLOAT);
    draw(0.1f);
    char *b8 = write_png("b8.png", 3, RL_IMAGE_U8), *b = write_exr("b.exr", rgb, box, NULL);
    expect_json(DIFF(a8, b8, "--json"), "flip", s);
    assert_true(s[0] > 0.02 && s[0] < 0.5 && s[1] > 0 && s[2] >= s[1] && s[3] >= s[2] && s[3] <= 1);
    expect_json(DIFF(a8, a16, "--json"), "flip", s); /* rounding alone */
    assert_true(s[0] < 0.02);
    expect_json(DIFF(a, b, "--json"), "hdrflip", s);
    assert_true(s[0] > 0.02 && s[0] < 0.6);
    expect_json(DIFF(a, tif, "--json"), "hdrflip", s);
    assert_close(s[3], 0, 0);
    /* 0.1 everywhere. */
    expect_json(DIFF(a, b, "--json", "--metric", "rmse"), "rmse", s);
    for (int i = 0; i < 4; i++)
        assert_close(s[i], 0.1, 1e-6);
    expect_json(DIFF(a8, b8, "--json", "--metric", "psnr"), "psnr", s);
    assert_close(s[0], 20, 0.2);
    assert_true(isnan(s[1]) && isnan(s[2]) && isnan(s[3]));
    tool_result r = DIFF(a, b, "--metric", "max");
    expect(&r, 0, NULL);
    assert_true(strstr(r.out, "max of ") == r.out && strstr(r.out, "  p95     0.1\n"));
    tool_result_free(&r);
    char *all[] = {a8, a, a16, tif, b8, b};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++)
        free(all[i]);
}

static void test_fail_over(void **state)
{
    (void)state;
    draw(0);
    char *a = write_exr("a.exr", rgb, box, NULL);
    draw(0.1f);
    char *b = write_exr("b.exr", rgb, box, NULL);
    static const struct {
        const char *metric, *limit;
        int status;
        const char *text;
    } cases[] = {
        {"rmse", "0.11", 0, NULL},
        {"rmse", "0.09", 3, "rmse.mean is 0.1, over 0.09"},
        {"rmse", "max.p95=0.09", 3, "max.p95 is 0.1, over 0.09"},
        {"rmse", "max=0.11", 0, NULL},
        {"psnr", "18", 0, NULL}, /* the reference's largest value is 0.9025: 19.11 dB */
        {"psnr", "20", 3, "psnr.mean is 19.1"},
        {"rmse", "psnr.mean=20", 3, "under 20"},
        {"ssim", "0.1", 0, NULL},
        {"ssim", "0.9999", 3, "ssim.mean"},
        {"hdrflip", "flip.max=1", 0, NULL},
        {"rmse", "-1", 3, "over -1"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        tool_result r = DIFF(a, b, "--metric", cases[i].metric, "--fail-over", cases[i].limit, "--json");
        expect(&r, cases[i].status, cases[i].text);
        assert_true(strstr(r.out, "{\"metric\": \"") == r.out); /* the result is printed all the same */
        if (cases[i].status)
            assert_non_null(strstr(r.err, "b.exr: error: "));
        tool_result_free(&r);
    }
    tool_result r = DIFF(a, b, "--metric", "max", "--fail-over", "0.05", "--fail-over", "rmse.max=0.2",
                         "--fail-over", "rmse.p95=0.01");
    expect(&r, 3, "max.mean is 0.1, over 0.05; rmse.p95 is 0.1, over 0.01\n");
    tool_result_free(&r);
    refuse(DIFF(a, b, "--fail-over", "flop=1"), "did you mean 'flip'?");
    refuse(DIFF(a, b, "--fail-over", "flip.p59=1"), "there is no statistic 'p59'");
    refuse(DIFF(a, b, "--fail-over", "psnr.p95=1"), "psnr has a mean, no p95");
    refuse(DIFF(a, b, "--fail-over", "nan"), "takes [METRIC.STAT=]X");
    refuse(DIFF(a, b, "--fail-over", "flip.p95="), "takes [METRIC.STAT=]X");
    free(a);
    free(b);
}

static void test_not_finite(void **state)
{
    (void)state;
    draw(0);
    char *a = write_exr("a.exr", rgb, box, NULL);
    pixels[1][7 * W + 13] = (float)NAN;
    char *nan = write_exr("nan.exr", rgb, (rl_exr_box){0, 0, W - 1, H - 1}, NULL);
    exr_type = RL_EXR_HALF;
    char *half = write_exr("half.exr", rgb, box, NULL);
    exr_type = RL_EXR_FLOAT;
    char *tif = write_png("nan.tif", 3, RL_IMAGE_FLOAT);
    pixels[1][7 * W + 13] = -INFINITY;
    char *inf = write_exr("inf.exr", rgb, box, NULL);
    pixels[1][7 * W + 13] = 0;
    pixels[3][5] = (float)NAN;
    char *alpha = write_exr("alpha.exr", rgba, box, NULL);
    for (int m = 0; m < 2; m++) {
        const char *metric = m ? "max" : "hdrflip";
        refuse(DIFF(a, nan, "--metric", metric), "nan.exr: error: channel 'G' holds NaN at pixel (13, 7)");
        refuse(DIFF(half, a, "--metric", metric), "half.exr: error: channel 'G' holds NaN at pixel (13, 7)");
        refuse(DIFF(nan, nan, "--metric", metric), "holds NaN at pixel (13, 7)");
        refuse(DIFF(tif, a, "--metric", metric), "nan.tif: error: channel 'G' holds NaN at pixel (13, 7)");
        refuse(DIFF(a, inf, "--metric", metric), "holds -infinity at pixel (13, 7)");
    }
    tool_result r = DIFF(a, alpha); /* alpha is not compared */
    expect(&r, 0, NULL);
    tool_result_free(&r);
    char *all[] = {a, nan, half, tif, inf, alpha};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++)
        free(all[i]);
}

static void test_pairs_that_do_not_fit(void **state)
{
    (void)state;
    draw(0);
    char *a = write_exr("a.exr", rgb, box, NULL), *png = write_png("a.png", 3, RL_IMAGE_U8);
    char *small = write_exr("small.exr", rgb, (rl_exr_box){0, 0, W - 1, H - 2}, NULL);
    char *moved = write_exr("moved.exr", rgb, (rl_exr_box){2, 0, W + 1, H - 1}, NULL);
    char *grey = write_png("grey.png", 1, RL_IMAGE_U8);
    char *missing = path_in(folder, "missing.exr"), *text = path_in(folder, "text.png");
    file_write(folder, "text.png", "hello", 5);
    refuse(DIFF(a, small), "small.exr: error: is 40 x 29 pixels, '");
    refuse(DIFF(small, a), "is 40 x 30 pixels, '");
    refuse(DIFF(a, moved), "its data window begins at (2, 0)");
    refuse(DIFF(png, grey), "grey.png: error: has channels ");
    refuse(DIFF(a, png), "a.png: error: is display-encoded");
    refuse(DIFF(a, missing), "missing.exr: error: ");
    refuse(DIFF(text, png), "text.png: error: ");
    refuse(DIFF(a), "needs two files");
    refuse(DIFF("--metric", "max"), "needs two files");
    refuse(DIFF(a, a, a), "found a third");
    refuse(DIFF(a, a, "--metric", "flop"), "did you mean 'flip'?");
    refuse(DIFF(a, a, "--heatmap", "x.nothing"), "nothing");
    refuse(DIFF(a, a, "--frames", "1"), "option '--frames' does nothing here");
    char *all[] = {a, png, small, moved, grey, missing, text};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++)
        free(all[i]);
}

static void test_layers(void **state)
{
    (void)state;
    static const char *const one[] = {"sss.R", "sss.G", "sss.B", NULL};
    static const char *const two[] = {"sss.R", "sss.G", "sss.B", "lit.V", NULL};
    static const char *const more[] = {"R", "G", "B", "A", "Z", "n.X", "n.Y", "n.Z"};
    static const char *const normal[] = {"X", "Y", "Z", NULL}, *const single[] = {"V", NULL};
    static const char *const vector[] = {"motion.X", "motion.Y", NULL};
    const char *more_names[9] = {0};
    memcpy(more_names, more, sizeof more);
    double s[4];
    draw(0);
    char *plain = write_exr("plain.exr", rgb, box, NULL), *layer = write_exr("one.exr", one, box, NULL);
    char *both = write_exr("two.exr", two, box, NULL), *many = write_exr("many.exr", more_names, box, NULL);
    char *n = write_exr("normal.exr", normal, box, NULL), *v = write_exr("v.exr", single, box, NULL);
    char *motion = write_exr("motion.exr", vector, box, NULL);
    for (int i = 0; i < N; i++)
        pixels[2][i] += 0.5f;
    char *blue = write_exr("blue.exr", one, box, NULL),
         *motion2 = write_exr("motion2.exr", vector, box, NULL);
    expect_json(DIFF(plain, layer, "--json"), "hdrflip", s); /* the same colours, in order */
    assert_close(s[3], 0, 0);
    expect_json(DIFF(many, layer, "--json"), "hdrflip", s);
    assert_close(s[3], 0, 0);
    expect_json(DIFF(v, v, "--json"), "hdrflip", s);
    expect_json(DIFF(plain, blue, "--json", "--metric", "rmse"), "rmse", s);
    assert_close(s[0], sqrt(0.25 / 3), 1e-6);
    refuse(DIFF(both, plain), "has no channels R, G, B and more than one layer: lit sss");
    refuse(DIFF(n, n), "hdrflip compares colours, but the channels are X Y Z");
    refuse(DIFF(n, plain, "--metric", "max"), "has channels R G B");
    expect_json(DIFF(n, n, "--json", "--metric", "max"), "max", s);
    expect_json(DIFF(motion, motion2, "--json", "--metric", "rmse"), "rmse", s);
    assert_close(s[3], 0, 0);
    char *all[] = {plain, layer, both, many, n, v, blue, motion, motion2};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++)
        free(all[i]);
}

static void test_primaries(void **state)
{
    (void)state;
    const rl_exr_attribute ap1 = {
        "chromaticities",
        {.type = RL_EXR_T_CHROMATICITIES, .v = {0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.32168, 0.33767}}};
    const rl_exr_attribute srgb = {
        "chromaticities",
        {.type = RL_EXR_T_CHROMATICITIES, .v = {0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329}}};
    draw(0);
    char *wide = write_exr("wide.exr", rgb, box, &ap1), *plain = write_exr("plain.exr", rgb, box, &srgb);
    tool_result r = DIFF(wide, wide);
    expect(&r, 0, "wide.exr: note: its primaries are not those of Rec. 709");
    tool_result_free(&r);
    r = DIFF(wide, wide, "--quiet");
    expect(&r, 0, NULL);
    tool_result_free(&r);
    r = DIFF(plain, plain);
    expect(&r, 0, NULL);
    tool_result_free(&r);
    r = DIFF(wide, plain, "--metric", "max");
    expect(&r, 0, "plain.exr: warning: its primaries differ");
    tool_result_free(&r);
    free(wide);
    free(plain);
}

static void test_heatmap(void **state)
{
    (void)state;
    draw(0);
    char *a = write_png("a.png", 3, RL_IMAGE_U8);
    for (int i = 0; i < N; i++)
        pixels[0][i] = i % W < W / 2 ? pixels[0][i] : 0.9f;
    char *b = write_png("b.png", 3, RL_IMAGE_U8), *heat = path_in(folder, "heat.png");
    char *nowhere = path_in(folder, "no/heat.png");
    rl_image_file file;
    tool_result r = DIFF(a, b, "--heatmap", heat, "--metric", "max");
    expect(&r, 0, "heat.png: note: white is a difference of 0.45");
    tool_result_free(&r);
    assert_int_equal(rl_image_file_read(heat, &file, &(rl_error){0}), RL_OK);
    assert_true(file.width == W && file.height == H && file.channels == 3 && file.type == RL_IMAGE_U8);
    assert_close((double)file.planes[3 * W + 2], 0, 0); /* equal: black */
    assert_true((double)file.planes[N + 3 * W + W / 2] >
                (double)file.planes[N + 3 * W + W - 1]); /* most: brightest */
    rl_image_file_free(&file);
    refuse(DIFF(a, b, "--heatmap", nowhere), "heat.png: error: ");
    free(a);
    free(b);
    free(heat);
    free(nowhere);
}

static int setup(void **state)
{
    (void)state;
    folder = folder_new();
    return 0;
}

static int teardown(void **state)
{
    (void)state;
    folder_remove(folder);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_equal_files), cmocka_unit_test(test_defaults),
        cmocka_unit_test(test_fail_over),   cmocka_unit_test(test_not_finite),
        cmocka_unit_test(test_layers),      cmocka_unit_test(test_pairs_that_do_not_fit),
        cmocka_unit_test(test_primaries),   cmocka_unit_test(test_heatmap),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
