/* Colour: every generator, one operation at a time, against OpenColorIO's CPU path. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/base/text.h"
#include "graph/run/color_emit.h"
#include "tests/color_help.h"

static int setup(void **state)
{
    (void)state;
    return color_help_start() ? 0 : -1;
}

static int teardown(void **state)
{
    (void)state;
    color_help_stop();
    return 0;
}

/* ---- every generator --------------------------------------------------------------------------------- */

typedef struct op_case {
    const char *transform; /* YAML, as from_scene_reference */
    double low, high;      /* of the input */
    double bound;          /* relative to max(1, |x|) */
} op_case;

#define POINTS "{control_points: [-6, -5, -2, -1.5, 0, 0.2, 3, 2, 6, 5]}"
#define GRADE  "{style: log, red: " POINTS ", blue: {control_points: [-6, -6, 0, 1, 6, 5.5]}"

/* clang-format off: version 14 crashes on this table */
static const op_case ops[] = {
    {"!<MatrixTransform> {matrix: [0.5, 0.2, 0, 0, 0, 1, 0, 0, 0.1, 0, 0.9, 0, 0, 0, 0, 1], offset: [0.1, 0, "
     "-1, 0]}",
     -1, 20, 1e-6},
    {"!<MatrixTransform> {matrix: [0.5, 0.2, 0, 0, 0, 1, 0, 0, 0.1, 0, 0.9, 0, 0, 0, 0, 1], offset: [0.1, 0, "
     "-1, 0], "
     "direction: inverse}",
     -1, 20, 1e-6},
    {"!<RangeTransform> {min_in_value: 0.1, max_in_value: 4, min_out_value: 0, max_out_value: 1}", -1, 20,
     1e-6},
    {"!<LogTransform> {base: 10}", -0.1, 20, 1e-6},
    {"!<LogTransform> {base: 2, direction: inverse}", -4, 8, 1e-6},
    {"!<LogAffineTransform> {base: 10, log_side_slope: 0.3, log_side_offset: 0.6, lin_side_slope: [1.1, 1, "
     "0.9], "
     "lin_side_offset: 0.01}",
     -0.1, 20, 3e-6},
    {"!<LogCameraTransform> {base: 10, log_side_slope: 0.25, log_side_offset: 0.4, lin_side_slope: 5, "
     "lin_side_offset: 0.05, lin_side_break: 0.01}",
     -0.1, 20, 1e-6},
    {"!<LogCameraTransform> {base: 10, log_side_slope: 0.25, log_side_offset: 0.4, lin_side_slope: 5, "
     "lin_side_offset: 0.05, lin_side_break: 0.01, linear_slope: 4, direction: inverse}",
     -0.1, 1.1, 3e-6},
    {"!<ExponentTransform> {value: 2.2}", -0.1, 4, 1e-6},
    {"!<ExponentTransform> {value: [2.2, 1, 1.8, 1], style: mirror, direction: inverse}", -1, 4, 1e-6},
    {"!<ExponentTransform> {value: [0.4, 2, 1.5, 1], style: pass_thru}", -1, 4, 1e-6},
    {"!<ExponentWithLinearTransform> {gamma: 2.4, offset: 0.055}", -0.1, 2, 1e-6},
    {"!<ExponentWithLinearTransform> {gamma: 2.4, offset: 0.055, style: mirror, direction: inverse}", -1, 4,
     1e-6},
    {"!<CDLTransform> {slope: [1.1, 1, 0.9], offset: [0.01, -0.02, 0], power: [1.2, 1, 0.8], saturation: "
     "0.8}",
     -0.1, 4, 3e-6},
    {"!<CDLTransform> {slope: [1.1, 1, 0.9], offset: [0.01, -0.02, 0], power: [1.2, 1, 0.8], sat: 1.2, "
     "style: asc, "
     "direction: inverse}",
     -0.1, 1.5, 3e-6},
    {"!<ExposureContrastTransform> {style: linear, exposure: 0.5, contrast: 1.3, gamma: 1, pivot: 0.18}",
     -0.1, 4, 1e-5},
    {"!<ExposureContrastTransform> {style: video, exposure: -1, contrast: 0.7, gamma: 1.1, pivot: 0.18, "
     "direction: inverse}",
     -0.1, 1.5, 1e-5},
    {"!<ExposureContrastTransform> {style: log, exposure: 1, contrast: 0.7, gamma: 1.1, pivot: 0.18}", -0.1,
     1.5, 1e-6},
    {"!<GradingRGBCurveTransform> " GRADE ", master: " POINTS "}", -10, 10, 3e-6},
    {"!<GradingRGBCurveTransform> " GRADE ", direction: inverse}", -5, 5, 3e-5},
    {"!<GradingRGBCurveTransform> {style: linear, master: " POINTS "}", -0.1, 20, 3e-5},
    {"!<GradingPrimaryTransform> {style: log, brightness: {rgb: [10, 0, -5], master: 2}, contrast: {rgb: "
     "[1.1, 1, 0.9], master: 1.1}, "
     "gamma: {rgb: [1.2, 1, 0.9], master: 1}, saturation: 0.9, pivot: {contrast: -0.1, black: 0.02, white: "
     "0.95}, clamp: {black: 0, white: 1}}",
     -0.1, 1.2, 3e-6},
    {"!<GradingPrimaryTransform> {style: linear, offset: {rgb: [0.1, 0, -0.1], master: 0}, exposure: {rgb: "
     "[0.2, 0, -0.5], master: 0.5}, "
     "contrast: {rgb: [1.1, 1.2, 0.9], master: 1.1}, saturation: 1.1, pivot: {contrast: 0.2}}",
     -0.1, 4, 1e-5},
    {"!<GradingPrimaryTransform> {style: video, lift: {rgb: [0.01, 0, 0.02], master: 0}, gain: {rgb: [1.1, "
     "1, 0.9], master: 1}, "
     "gamma: {rgb: [1.1, 1.2, 0.9], master: 1.05}, saturation: 0.8, direction: inverse}",
     -0.1, 1.2, 1e-5},
    {"!<FixedFunctionTransform> {style: ACES_Glow03}", -0.1, 4, 1e-6},
    {"!<FixedFunctionTransform> {style: ACES_Glow10, direction: inverse}", -0.1, 4, 1e-6},
    {"!<FixedFunctionTransform> {style: ACES_RedMod03}", -0.1, 4, 1e-5},
    {"!<FixedFunctionTransform> {style: ACES_RedMod03, direction: inverse}", 0, 4, 1e-5},
    {"!<FixedFunctionTransform> {style: ACES_RedMod10, direction: inverse}", 0, 4, 1e-5},
    {"!<FixedFunctionTransform> {style: ACES_DarkToDim10, direction: inverse}", -0.1, 4, 1e-6},
    {"!<FixedFunctionTransform> {style: REC2100_Surround, params: [0.78]}", -0.1, 4, 1e-6},
    {"!<FixedFunctionTransform> {style: RGB_TO_HSV}", -0.5, 4, 3e-6},
    {"!<FixedFunctionTransform> {style: RGB_TO_HSV, direction: inverse}", -0.5, 1.5, 1e-5},
    {"!<FixedFunctionTransform> {style: XYZ_TO_xyY}", 0, 4, 1e-6},
    {"!<FixedFunctionTransform> {style: XYZ_TO_xyY, direction: inverse}", 0, 1, 1e-6},
    {"!<FixedFunctionTransform> {style: XYZ_TO_uvY}", 0, 4, 1e-6},
    {"!<FixedFunctionTransform> {style: XYZ_TO_uvY, direction: inverse}", 0, 1, 3e-6},
    {"!<FixedFunctionTransform> {style: XYZ_TO_LUV}", 0, 4, 3e-6},
    {"!<FixedFunctionTransform> {style: XYZ_TO_LUV, direction: inverse}", 0.001, 1, 1e-5},
    {"!<BuiltinTransform> {style: ACES-LMT - ACES 1.3 Reference Gamut Compression}", -0.1, 20, 3e-5},
    {"!<BuiltinTransform> {style: ACES-LMT - ACES 1.3 Reference Gamut Compression, direction: inverse}", 0, 2,
     3e-3}, /* has a pole */
    {"!<BuiltinTransform> {style: CURVE - LINEAR_to_ST-2084}", -0.1, 100, 1e-5},
    {"!<BuiltinTransform> {style: ADX10_to_ACES2065-1}", 0, 1, 1e-4},
    {"!<FileTransform> {src: curve.spi1d}", -0.1, 2, 1e-6},
    {"!<FileTransform> {src: curve.spi1d, direction: inverse}", 0.01, 1, 1e-6},
    {"!<FileTransform> {src: cube.cube, interpolation: tetrahedral, direction: inverse}", 0, 1, 3e-6},
    {"!<FileTransform> {src: cube.cube, interpolation: tetrahedral}", -0.1, 1.2, 1e-6},
    {"!<FileTransform> {src: cube.cube, interpolation: linear}", -0.1, 1.2, 1e-6},
};
/* clang-format on */

static void write_tables(const char *folder)
{
    char path[256];
    rl_str s = {0};
    rl_str_add(&s, "Version 1\nFrom 0 1\nLength 9\nComponents 3\n{\n");
    for (int i = 0; i < 9; i++)
        rl_str_printf(&s, "%.6f %.6f %.6f\n", sqrt(i / 8.0), i / 8.0, i * i / 64.0);
    rl_str_add(&s, "}\n");
    snprintf(path, sizeof path, "%s/curve.spi1d", folder);
    assert_int_equal(rl_file_write(path, s.text, s.length, NULL), RL_OK);
    rl_str_free(&s);
    rl_str_add(&s, "LUT_3D_SIZE 5\n");
    for (int i = 0; i < 125; i++)
        rl_str_printf(&s, "%.6f %.6f %.6f\n", (i * 37 % 125) / 124.0, (i * 53 % 125) / 124.0, i / 124.0);
    snprintf(path, sizeof path, "%s/cube.cube", folder);
    assert_int_equal(rl_file_write(path, s.text, s.length, NULL), RL_OK);
    rl_str_free(&s);
}

static void test_every_operation(void **state)
{
    static const rl_ocio_request request = {.from = "a", .to = "b"};
    char folder[] = "/tmp/relit_color_XXXXXX";
    int bad = 0;
    (void)state;
    assert_non_null(mkdtemp(folder));
    write_tables(folder);
    for (size_t i = 0; i < sizeof ops / sizeof *ops; i++) {
        rl_arena arena = {0};
        rl_ocio *ocio = color_config(folder, ops[i].transform);
        rl_color_pass pass = color_make_pass(ocio, &request, &arena, NULL);
        assert_non_null(pass.pass);
        difference d = color_compare(ocio, &request, pass.pass, ops[i].low, ops[i].high);
        if (pass.baked || !(d.relative <= ops[i].bound)) {
            print_message("# %s: %s, off by %g (bound %g)\n", ops[i].transform,
                          pass.baked ? "baked" : "exact", d.relative, ops[i].bound);
            bad++;
        }
        rl_arena_free(&arena);
        rl_ocio_free(&ocio);
    }
    color_remove_folder(folder);
    assert_int_equal(bad, 0);
}

/* ---- what has no generator --------------------------------------------------------------------------- */

static void count_warning(void *ctx, rl_severity severity, rl_where where, const char *text)
{
    (void)where;
    if (severity == RL_WARNING && strstr(text, "grading tone"))
        ++*(int *)ctx;
}

static void test_bakes_and_says_so(void **state)
{
    static const rl_ocio_request request = {.from = "a", .to = "b"};
    char folder[] = "/tmp/relit_color_XXXXXX";
    int warnings = 0;
    rl_log log = {count_warning, &warnings};
    rl_arena arena = {0};
    (void)state;
    assert_non_null(mkdtemp(folder));
    rl_ocio *ocio = color_config(folder, "!<GradingToneTransform> {style: video, s_contrast: 1.4}");
    rl_color_pass pass = color_make_pass(ocio, &request, &arena, &log);
    assert_true(pass.baked);
    assert_int_equal(warnings, 1);
    assert_true(pass.error > 0);
    difference d = color_compare(ocio, &request, pass.pass, -0.1, 20);
    print_message("# baked: said to be off by %.3g, is off by %.3g\n", pass.error, d.absolute);
    assert_true(d.absolute < 1.2 * pass.error + 1e-5);
    assert_true(d.absolute > 0.5 * pass.error);
    rl_arena_free(&arena);
    rl_ocio_free(&ocio);
    color_remove_folder(folder);
}

/* ---- the vector functions ---------------------------------------------------------------------------- */

/* Three planes of results from one of arguments: log2, exp2, the hue's weight with red = 1 and green =
 * tangent. */
static const char functions_kernel[] =
    "kernel void functions(global const float *in, global float *out, constant params_t *p, constant frame_t "
    "*f,\n"
    "                      constant material_t *m)\n"
    "{\n"
    "    int i = rl_index(f, RL_W * (int)get_global_id(0), (int)get_global_id(1));\n"
    "    rl_store(rl_c_log2(rl_load(in, i)), out, i);\n"
    "    rl_store(rl_c_exp2(rl_load(in, i + f->plane)), out, i + f->plane);\n"
    "    floatv t = rl_load(in, i + 2 * f->plane);\n"
    "    rl_store(rl_c_hue_weight(K(1.0f), t, K(0.0f), 1.69765273f), out, i + 2 * f->plane);\n"
    "}\n";

static double hue_weight(double g)
{
    double angle = fabs(atan2(sqrt(3) * g, 2 - g)), k = fmax(2 - angle * (4 / (135 * acos(-1) / 180)), 0);
    return k < 1 ? k * k * k / 4 : k * k * k / 4 - pow(k - 1, 3);
}

static void test_functions(void **state)
{
    rl_str text = {0};
    float *in = rl_malloc(6 * N * sizeof *in), *out = in + 3 * N;
    static const rl_param params[] = {P(rl_color_params, RL_F32, exposure, -64, 64, 0, "stops", "unused")};
    static const rl_step steps[] = {{"functions", .domain = RL_EVERY_VECTOR}};
    double log_error = 0, exp_error = 0, hue_error = 0;
    (void)state;
    for (const char *const *piece = rl_color_prelude; *piece; piece++)
        rl_str_add(&text, *piece);
    rl_str_add(&text, functions_kernel);
    rl_pass pass = {.name = "functions",
                    .kernel_text = text.text,
                    .kernel_file = "test",
                    .params = RL_ARRAY(params),
                    .steps = RL_ARRAY(steps)};
    for (int i = 0; i < N; i++) {
        in[i] = (float)exp2(-126 + 253.0 * i / N);
        in[N + i] = (float)(-125.9 + 251.8 * i / N);
        in[2 * N + i] = (float)(3.0 * i / N);
    }
    color_run(&pass, 0, in, out);
    for (int i = 0; i < N; i++) {
        double want = log2(in[i]);
        log_error = fmax(log_error, fabs(out[i] - want) / fmax(1, fabs(want)));
        want = exp2(in[N + i]);
        exp_error = fmax(exp_error, fabs(out[N + i] - want) / want);
        hue_error = fmax(hue_error, fabs(out[2 * N + i] - hue_weight(in[2 * N + i])));
    }
    print_message("# log2 %.2g, exp2 %.2g, hue weight %.2g\n", log_error, exp_error, hue_error);
    assert_true(log_error <= 3e-7);
    assert_true(exp_error <= 3e-7);
    assert_true(hue_error <= 1e-5);
    rl_str_free(&text);
    rl_free(in);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_operation),
        cmocka_unit_test(test_bakes_and_says_so),
        cmocka_unit_test(test_functions),
    };
    return cmocka_run_group_tests_name("color_ops", tests, setup, teardown);
}
