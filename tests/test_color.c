/* Colour: the programs that relit generates against OpenColorIO's own CPU path. */
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
#include "graph/run/color.h"
#include "graph/run/color_emit.h"
#include "tests/cl_harness.h"

#define CONFIG  "configs/color/relit.ocio"
#define COLUMNS 256
#define ROWS    64
#define N       (COLUMNS * ROWS)

static cl_harness *device;
static rl_ocio *config;

static int setup(void **state)
{
    (void)state;
    device = cl_harness_new();
    return device && rl_ocio_open(CONFIG, &config, NULL) == RL_OK ? 0 : -1;
}

static int teardown(void **state)
{
    (void)state;
    rl_ocio_free(&config);
    cl_harness_free(&device);
    return 0;
}

/* ---- running a pass ---------------------------------------------------------------------------------- */

/* Colours between low and high: most of them dark, a tenth below 0 if low is, channels independent so that
 * saturated colours are frequent; the first ones are exact greys and primaries. */
static void fill_colours(float *planes, double low, double high)
{
    uint32_t state = 12345;
    for (int i = 0; i < 3 * N; i++) {
        state = state * 1664525u + 1013904223u;
        double u = (state >> 8) / 16777216.0;
        planes[i] = (float)(u < 0.1 ? low * (1 - 10 * u) : high * pow((u - 0.1) / 0.9, 3));
    }
    for (int i = 0; i < 64; i++)
        for (int c = 0; c < 3; c++)
            planes[c * N + i] = i < 32 || i % 3 == c ? (float)(high * (i % 32) / 31) : 0;
}

static void run(const rl_pass *pass, float exposure, const float *in, float *out)
{
    rl_arena arena = {0};
    rl_color_params params = {exposure};
    rl_tables tables = {0};
    frame_t frame = cl_harness_frame(COLUMNS, ROWS);
    int material = 0;
    size_t global[2] = {COLUMNS / 16, ROWS}, bytes = 3 * N * sizeof(float);
    cl_kernel_of_pass *kernel = cl_harness_build(device, pass, NULL, 0);
    if (!kernel)
        fail_msg("%s", cl_harness_error(device));
    if (pass->tables)
        assert_int_equal(
            pass->tables(&(rl_pass_input){.pass = pass, .params = &params}, &arena, &tables, NULL), RL_OK);
    float *source = rl_aligned(bytes), *result = rl_aligned(bytes);
    memcpy(source, in, bytes);
    cl_buffer args[] = {
        {source,      bytes                   },
        {result,      bytes                   },
        {&params,     sizeof params           },
        {&frame,      sizeof frame            },
        {&material,   sizeof material         },
        {tables.data, tables.n * sizeof(float)}
    };
    if (!cl_harness_run(kernel, args, tables.n ? 6 : 5, global, NULL))
        fail_msg("%s", cl_harness_error(device));
    memcpy(out, result, bytes);
    rl_free(source);
    rl_free(result);
    cl_harness_release(&kernel);
    rl_arena_free(&arena);
}

static rl_color_pass make_pass(const rl_ocio *ocio, const rl_ocio_request *request, rl_arena *arena,
                               const rl_log *log)
{
    rl_error err = {0};
    rl_color_pass pass;
    if (rl_color_pass_new(ocio, request, false, RL_NOWHERE, arena, log, &pass, &err) != RL_OK)
        fail_msg("%s", err.text);
    return pass;
}

typedef struct difference {
    double absolute, clipped,
        relative; /* the largest; clipped: both sides brought to 0..1; relative to max(1, |x|) */
} difference;

static difference compare(const rl_ocio *ocio, const rl_ocio_request *request, const rl_pass *pass,
                          double low, double high)
{
    float *in = rl_malloc(9 * N * sizeof *in), *got = in + 3 * N, *want = got + 3 * N;
    rl_ocio_transform *transform = NULL;
    difference d = {0};
    assert_non_null(in);
    fill_colours(in, low, high);
    run(pass, 0, in, got);
    assert_int_equal(rl_ocio_transform_new(ocio, request, &transform, NULL), RL_OK);
    memcpy(want, in, 3 * N * sizeof *in);
    assert_int_equal(rl_ocio_apply(transform, want, want + N, want + 2 * N, N, NULL), RL_OK);
    for (int i = 0; i < 3 * N; i++) {
        double off = fabs((double)got[i] - want[i]);
        assert_true(isfinite(got[i]));
        d.absolute = fmax(d.absolute, off);
        d.relative = fmax(d.relative, off / fmax(1, fabs(want[i])));
        d.clipped = fmax(d.clipped, fabs(fmin(fmax(got[i], 0), 1) - fmin(fmax(want[i], 0), 1)));
    }
    rl_ocio_transform_free(&transform);
    rl_free(in);
    return d;
}

/* ---- the configuration that ships -------------------------------------------------------------------- */

static void test_views_match(void **state)
{
    static const rl_ocio_request requests[] = {
        {.from = "ACEScg",     .display = "sRGB",    .view = "ACES"          },
        {.from = "lin_rec709", .display = "sRGB",    .view = "ACES"          },
        {.from = "lin_rec709", .display = "Rec.709", .view = "ACES"          },
        {.from = "ACES2065-1", .display = "Rec.709", .view = "Un-tone-mapped"},
    };
    (void)state;
    for (size_t i = 0; i < sizeof requests / sizeof *requests; i++) {
        rl_arena arena = {0};
        rl_color_pass pass = make_pass(config, &requests[i], &arena, NULL);
        assert_non_null(pass.pass);
        assert_false(pass.baked);
        difference d = compare(config, &requests[i], pass.pass, -0.1, 20);
        print_message("# %s to %s, %s: off by at most %.2g (%.2g where a display clips)\n", requests[i].from,
                      requests[i].display, requests[i].view, d.absolute, d.clipped);
        assert_true(d.absolute <= 1e-4);
        assert_true(d.clipped * 255 <= 0.5);
        rl_arena_free(&arena);
    }
}

static void test_spaces_match(void **state)
{
    static const rl_ocio_request requests[] = {
        {.from = "lin_rec709",   .to = "ACEScg"    },
        {.from = "lin_rec709",   .to = "ACEScct"   },
        {.from = "srgb_texture", .to = "lin_rec709"},
    };
    (void)state;
    for (size_t i = 0; i < sizeof requests / sizeof *requests; i++) {
        rl_arena arena = {0};
        rl_color_pass pass = make_pass(config, &requests[i], &arena, NULL);
        difference d = compare(config, &requests[i], pass.pass, -0.1, 20);
        print_message("# %s to %s: off by at most %.2g relative\n", requests[i].from, requests[i].to,
                      d.relative);
        assert_true(d.relative <= 3e-6);
        rl_arena_free(&arena);
    }
}

/* No transform that the shipped config can be asked for needs a table. */
static void test_config_is_whole(void **state)
{
    rl_arena arena = {0};
    rl_ocio_names spaces, displays, views;
    (void)state;
    assert_int_equal(rl_ocio_validate(config, NULL), RL_OK);
    assert_int_equal(rl_ocio_list_names(config, RL_OCIO_SPACES, NULL, &arena, &spaces, NULL), RL_OK);
    assert_int_equal(rl_ocio_list_names(config, RL_OCIO_DISPLAYS, NULL, &arena, &displays, NULL), RL_OK);
    assert_int_equal(spaces.n, 9);
    assert_int_equal(displays.n, 2);
    for (size_t i = 0; i < spaces.n; i++) {
        for (size_t k = 0; k < spaces.n; k++)
            assert_false(make_pass(config, &(rl_ocio_request){.from = spaces.names[i], .to = spaces.names[k]},
                                   &arena, NULL)
                             .baked);
        for (size_t d = 0; d < displays.n; d++) {
            assert_int_equal(
                rl_ocio_list_names(config, RL_OCIO_VIEWS, displays.names[d], &arena, &views, NULL), RL_OK);
            assert_int_equal(views.n, 3);
            for (size_t v = 0; v < views.n; v++) {
                rl_ocio_request request = {
                    .from = spaces.names[i], .display = displays.names[d], .view = views.names[v]};
                assert_false(make_pass(config, &request, &arena, NULL).baked);
            }
        }
    }
    rl_arena_free(&arena);
}

/* Every allocation fails once: an error or, where it was not needed, the same program; no crash, no leak. */
static void test_out_of_memory(void **state)
{
    static const rl_ocio_request request = {.from = "ACEScg", .display = "sRGB", .view = "ACES"};
    rl_arena kept = {0};
    rl_color_pass want = make_pass(config, &request, &kept, NULL);
    int failures = 0;
    (void)state;
    for (unsigned long n = 1; n < 300; n++) {
        rl_arena arena = {0};
        rl_color_pass pass;
        rl_alloc_fail_at(n, 0);
        rl_code code = rl_color_pass_new(config, &request, false, RL_NOWHERE, &arena, NULL, &pass, NULL);
        rl_alloc_fail_at(0, 0);
        if (code == RL_OK)
            assert_string_equal(pass.pass->kernel_text, want.pass->kernel_text);
        else
            assert_int_equal(code, RL_E_MEMORY);
        failures += code != RL_OK;
        rl_arena_free(&arena);
    }
    print_message("# %d allocations\n", failures);
    assert_true(failures > 20);
    rl_arena_free(&kept);
}

static void test_no_change_no_pass(void **state)
{
    static const rl_ocio_request raw = {.from = "lin_rec709", .display = "sRGB", .view = "Raw"};
    static const rl_ocio_request same = {.from = "lin_rec709", .to = "linear"};
    rl_arena arena = {0};
    (void)state;
    assert_null(make_pass(config, &raw, &arena, NULL).pass);
    rl_color_pass pass = make_pass(config, &same, &arena, NULL);
    assert_null(pass.pass);
    assert_string_equal(pass.note, "the transform changes nothing");
    rl_arena_free(&arena);
}

static void test_exposure(void **state)
{
    static const rl_ocio_request same = {.from = "lin_rec709", .to = "lin_rec709"};
    float *in = rl_malloc(6 * N * sizeof *in), *out = in + 3 * N;
    rl_arena arena = {0};
    rl_color_pass pass;
    (void)state;
    assert_int_equal(rl_color_pass_new(config, &same, true, RL_NOWHERE, &arena, NULL, &pass, NULL), RL_OK);
    assert_non_null(pass.pass);
    fill_colours(in, -0.1, 20);
    static const float stops[] = {-2, 0, 1, 0.5f};
    for (size_t s = 0; s < sizeof stops / sizeof *stops; s++) {
        run(pass.pass, stops[s], in, out);
        for (int i = 0; i < 3 * N; i++)
            assert_true(fabs(out[i] - in[i] * exp2(stops[s])) <= 4e-7 * fabs(out[i]));
    }
    rl_free(in);
    rl_arena_free(&arena);
}

static void test_same_bits(void **state)
{
    static const rl_ocio_request request = {.from = "ACEScg", .display = "sRGB", .view = "ACES"};
    float *in = rl_malloc(9 * N * sizeof *in), *a = in + 3 * N, *b = a + 3 * N;
    rl_arena arena = {0};
    (void)state;
    fill_colours(in, -0.1, 20);
    rl_color_pass first = make_pass(config, &request, &arena, NULL);
    rl_color_pass second = make_pass(config, &request, &arena, NULL);
    assert_string_equal(first.pass->kernel_text, second.pass->kernel_text);
    run(first.pass, 0, in, a);
    run(second.pass, 0, in, b);
    assert_memory_equal(a, b, 3 * N * sizeof *a);
    rl_free(in);
    rl_arena_free(&arena);
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
     "-1, 0]}",                                                                                      -1,    20,  1e-6},
    {"!<MatrixTransform> {matrix: [0.5, 0.2, 0, 0, 0, 1, 0, 0, 0.1, 0, 0.9, 0, 0, 0, 0, 1], offset: [0.1, 0, "
     "-1, 0], "
     "direction: inverse}",                                                                          -1,    20,  1e-6},
    {"!<RangeTransform> {min_in_value: 0.1, max_in_value: 4, min_out_value: 0, max_out_value: 1}",        -1,    20,
     1e-6                                                                                                                 },
    {"!<LogTransform> {base: 10}",                                                                        -0.1,  20,  1e-6},
    {"!<LogTransform> {base: 2, direction: inverse}",                                                     -4,    8,   1e-6},
    {"!<LogAffineTransform> {base: 10, log_side_slope: 0.3, log_side_offset: 0.6, lin_side_slope: [1.1, 1, "
     "0.9], "
     "lin_side_offset: 0.01}",                                                                       -0.1,  20,  3e-6},
    {"!<LogCameraTransform> {base: 10, log_side_slope: 0.25, log_side_offset: 0.4, lin_side_slope: 5, "
     "lin_side_offset: 0.05, lin_side_break: 0.01}",                                                 -0.1,  20,  1e-6},
    {"!<LogCameraTransform> {base: 10, log_side_slope: 0.25, log_side_offset: 0.4, lin_side_slope: 5, "
     "lin_side_offset: 0.05, lin_side_break: 0.01, linear_slope: 4, direction: inverse}",            -0.1,  1.1, 3e-6},
    {"!<ExponentTransform> {value: 2.2}",                                                                 -0.1,  4,   1e-6},
    {"!<ExponentTransform> {value: [2.2, 1, 1.8, 1], style: mirror, direction: inverse}",                 -1,    4,   1e-6},
    {"!<ExponentTransform> {value: [0.4, 2, 1.5, 1], style: pass_thru}",                                  -1,    4,   1e-6},
    {"!<ExponentWithLinearTransform> {gamma: 2.4, offset: 0.055}",                                        -0.1,  2,   1e-6},
    {"!<ExponentWithLinearTransform> {gamma: 2.4, offset: 0.055, style: mirror, direction: inverse}",     -1,    4,
     1e-6                                                                                                                 },
    {"!<CDLTransform> {slope: [1.1, 1, 0.9], offset: [0.01, -0.02, 0], power: [1.2, 1, 0.8], saturation: "
     "0.8}",                                                                                         -0.1,  4,   3e-6},
    {"!<CDLTransform> {slope: [1.1, 1, 0.9], offset: [0.01, -0.02, 0], power: [1.2, 1, 0.8], sat: 1.2, "
     "style: asc, "
     "direction: inverse}",                                                                          -0.1,  1.5, 3e-6},
    {"!<ExposureContrastTransform> {style: linear, exposure: 0.5, contrast: 1.3, gamma: 1, pivot: 0.18}",
     -0.1,                                                                                                       4,   1e-5},
    {"!<ExposureContrastTransform> {style: video, exposure: -1, contrast: 0.7, gamma: 1.1, pivot: 0.18, "
     "direction: inverse}",                                                                          -0.1,  1.5, 1e-5},
    {"!<ExposureContrastTransform> {style: log, exposure: 1, contrast: 0.7, gamma: 1.1, pivot: 0.18}",    -0.1,
     1.5,                                                                                                             1e-6},
    {"!<GradingRGBCurveTransform> " GRADE ", master: " POINTS "}",                                        -10,   10,  3e-6},
    {"!<GradingRGBCurveTransform> " GRADE ", direction: inverse}",                                        -5,    5,   3e-5},
    {"!<GradingRGBCurveTransform> {style: linear, master: " POINTS "}",                                   -0.1,  20,  3e-5},
    {"!<GradingPrimaryTransform> {style: log, brightness: {rgb: [10, 0, -5], master: 2}, contrast: {rgb: "
     "[1.1, 1, 0.9], master: 1.1}, "
     "gamma: {rgb: [1.2, 1, 0.9], master: 1}, saturation: 0.9, pivot: {contrast: -0.1, black: 0.02, white: "
     "0.95}, clamp: {black: 0, white: 1}}",                                                          -0.1,  1.2, 3e-6},
    {"!<GradingPrimaryTransform> {style: linear, offset: {rgb: [0.1, 0, -0.1], master: 0}, exposure: {rgb: "
     "[0.2, 0, -0.5], master: 0.5}, "
     "contrast: {rgb: [1.1, 1.2, 0.9], master: 1.1}, saturation: 1.1, pivot: {contrast: 0.2}}",      -0.1,  4,   1e-5},
    {"!<GradingPrimaryTransform> {style: video, lift: {rgb: [0.01, 0, 0.02], master: 0}, gain: {rgb: [1.1, "
     "1, 0.9], master: 1}, "
     "gamma: {rgb: [1.1, 1.2, 0.9], master: 1.05}, saturation: 0.8, direction: inverse}",            -0.1,  1.2, 1e-5},
    {"!<FixedFunctionTransform> {style: ACES_Glow03}",                                                    -0.1,  4,   1e-6},
    {"!<FixedFunctionTransform> {style: ACES_Glow10, direction: inverse}",                                -0.1,  4,   1e-6},
    {"!<FixedFunctionTransform> {style: ACES_RedMod03}",                                                  -0.1,  4,   1e-5},
    {"!<FixedFunctionTransform> {style: ACES_RedMod03, direction: inverse}",                              0,     4,   1e-5},
    {"!<FixedFunctionTransform> {style: ACES_RedMod10, direction: inverse}",                              0,     4,   1e-5},
    {"!<FixedFunctionTransform> {style: ACES_DarkToDim10, direction: inverse}",                           -0.1,  4,   1e-6},
    {"!<FixedFunctionTransform> {style: REC2100_Surround, params: [0.78]}",                               -0.1,  4,   1e-6},
    {"!<FixedFunctionTransform> {style: RGB_TO_HSV}",                                                     -0.5,  4,   3e-6},
    {"!<FixedFunctionTransform> {style: RGB_TO_HSV, direction: inverse}",                                 -0.5,  1.5, 1e-5},
    {"!<FixedFunctionTransform> {style: XYZ_TO_xyY}",                                                     0,     4,   1e-6},
    {"!<FixedFunctionTransform> {style: XYZ_TO_xyY, direction: inverse}",                                 0,     1,   1e-6},
    {"!<FixedFunctionTransform> {style: XYZ_TO_uvY}",                                                     0,     4,   1e-6},
    {"!<FixedFunctionTransform> {style: XYZ_TO_uvY, direction: inverse}",                                 0,     1,   3e-6},
    {"!<FixedFunctionTransform> {style: XYZ_TO_LUV}",                                                     0,     4,   3e-6},
    {"!<FixedFunctionTransform> {style: XYZ_TO_LUV, direction: inverse}",                                 0.001, 1,   1e-5},
    {"!<BuiltinTransform> {style: ACES-LMT - ACES 1.3 Reference Gamut Compression}",                      -0.1,  20,  3e-5},
    {"!<BuiltinTransform> {style: ACES-LMT - ACES 1.3 Reference Gamut Compression, direction: inverse}",  0,     2,
     3e-3                                                                                                                 }, /* has a pole */
    {"!<BuiltinTransform> {style: CURVE - LINEAR_to_ST-2084}",                                            -0.1,  100, 1e-5},
    {"!<BuiltinTransform> {style: ADX10_to_ACES2065-1}",                                                  0,     1,   1e-4},
    {"!<FileTransform> {src: curve.spi1d}",                                                               -0.1,  2,   1e-6},
    {"!<FileTransform> {src: curve.spi1d, direction: inverse}",                                           0.01,  1,   1e-6},
    {"!<FileTransform> {src: cube.cube, interpolation: tetrahedral, direction: inverse}",                 0,     1,   3e-6},
    {"!<FileTransform> {src: cube.cube, interpolation: tetrahedral}",                                     -0.1,  1.2, 1e-6},
    {"!<FileTransform> {src: cube.cube, interpolation: linear}",                                          -0.1,  1.2, 1e-6},
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

static rl_ocio *config_with(const char *folder, const char *transform)
{
    char path[256];
    rl_error err = {0};
    rl_ocio *ocio = NULL;
    rl_str s = {0};
    rl_str_printf(
        &s,
        "ocio_profile_version: 2.1\nsearch_path: .\nroles: {default: a}\ndisplays:\n  d:\n"
        "    - !<View> {name: v, colorspace: b}\nfile_rules:\n  - !<Rule> {name: Default, colorspace: a}\n"
        "colorspaces:\n  - !<ColorSpace>\n    name: a\n  - !<ColorSpace>\n    name: b\n"
        "    from_scene_reference: %s\n",
        transform);
    snprintf(path, sizeof path, "%s/config.ocio", folder);
    assert_int_equal(rl_file_write(path, s.text, s.length, NULL), RL_OK);
    if (rl_ocio_open(path, &ocio, &err) != RL_OK)
        fail_msg("%s", err.text);
    rl_str_free(&s);
    return ocio;
}

static void remove_folder(const char *folder)
{
    static const char *const names[] = {"config.ocio", "curve.spi1d", "cube.cube"};
    char path[256];
    for (size_t i = 0; i < 3; i++) {
        snprintf(path, sizeof path, "%s/%s", folder, names[i]);
        remove(path);
    }
    rmdir(folder);
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
        rl_ocio *ocio = config_with(folder, ops[i].transform);
        rl_color_pass pass = make_pass(ocio, &request, &arena, NULL);
        assert_non_null(pass.pass);
        difference d = compare(ocio, &request, pass.pass, ops[i].low, ops[i].high);
        if (pass.baked || !(d.relative <= ops[i].bound)) {
            print_message("# %s: %s, off by %g (bound %g)\n", ops[i].transform,
                          pass.baked ? "baked" : "exact", d.relative, ops[i].bound);
            bad++;
        }
        rl_arena_free(&arena);
        rl_ocio_free(&ocio);
    }
    remove_folder(folder);
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
    rl_ocio *ocio = config_with(folder, "!<GradingToneTransform> {style: video, s_contrast: 1.4}");
    rl_color_pass pass = make_pass(ocio, &request, &arena, &log);
    assert_true(pass.baked);
    assert_int_equal(warnings, 1);
    assert_true(pass.error > 0);
    difference d = compare(ocio, &request, pass.pass, -0.1, 20);
    print_message("# baked: said to be off by %.3g, is off by %.3g\n", pass.error, d.absolute);
    assert_true(d.absolute < 1.2 * pass.error + 1e-5);
    assert_true(d.absolute > 0.5 * pass.error);
    rl_arena_free(&arena);
    rl_ocio_free(&ocio);
    remove_folder(folder);
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
    static const rl_step steps[] = {
        {"functions", RL_EVERY_VECTOR}
    };
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
    run(&pass, 0, in, out);
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

/* ---- names and primaries ----------------------------------------------------------------------------- */

static void test_names(void **state)
{
    const char *space;
    (void)state;
    static const char *const aliases[] = {
        "lin_srgb",
        "lin_rec709",
        "sRGB",
        "srgb_texture",
        "acescg",
        "ACEScg",
        "aces",
        "ACES2065-1",
        "data",
        "raw",
        "ap1",
        "ACEScg",
        "scene_linear",
        "lin_rec709",
        "linear",
        "lin_rec709",
        "ap0",
        "ACES2065-1",
        "default",
        "lin_rec709",
        "aces_interchange",
        "ACES2065-1",
        "cie_xyz_d65_interchange",
        "CIE-XYZ-D65",
    };
    for (size_t i = 0; i < sizeof aliases / sizeof *aliases; i += 2) {
        assert_int_equal(rl_color_space(config, aliases[i], RL_NOWHERE, &space, NULL), RL_OK);
        assert_string_equal(space, aliases[i + 1]);
    }
    assert_int_equal(rl_color_working(config, RL_NOWHERE, &space, NULL), RL_OK);
    assert_string_equal(space, "lin_rec709");
    assert_int_equal(rl_color_view(config, "Rec.709", "Un-tone-mapped", NULL, RL_NOWHERE, NULL), RL_OK);
}

static void test_unknown_names(void **state)
{
    static const rl_where where = {"p.yaml", 3, 7};
    const char *space;
    rl_error err = {0};
    (void)state;
    assert_int_equal(rl_color_space(config, "ACESgc", where, &space, &err), RL_E_CONFIG);
    assert_non_null(strstr(err.text, "did you mean 'ACEScg'?"));
    assert_int_equal(err.line, 3);
    err = (rl_error){0};
    assert_int_equal(rl_color_view(config, "srgb", "ACES", NULL, where, &err), RL_E_CONFIG);
    assert_non_null(strstr(err.text, "no display 'srgb'; did you mean 'sRGB'? known: Rec.709, sRGB"));
    err = (rl_error){0};
    assert_int_equal(rl_color_view(config, "sRGB", "Un-tonemapped", NULL, where, &err), RL_E_CONFIG);
    assert_non_null(strstr(err.text, "no view 'Un-tonemapped'; did you mean 'Un-tone-mapped'?"));
    err = (rl_error){0};
    assert_int_equal(rl_color_view(config, "sRGB", "ACES", "film", where, &err), RL_E_CONFIG);
    assert_non_null(strstr(err.text, "no look 'film'"));
    rl_ocio *none = NULL;
    err = (rl_error){0};
    assert_int_equal(rl_ocio_open("no/such.ocio", &none, &err), RL_E_COLOR);
    assert_null(none);
    assert_string_equal(err.file, "no/such.ocio");
}

static void test_primaries(void **state)
{
    static const double rec709[8] = {0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290};
    rl_primaries p;
    (void)state;
    assert_int_equal(rl_color_primaries(config, "linear", RL_NOWHERE, &p, NULL), RL_OK);
    assert_true(p.known);
    assert_string_equal(p.name, "Rec.709");
    assert_memory_equal(p.xy, rec709, sizeof rec709);
    assert_int_equal(rl_color_primaries(config, "ACEScg", RL_NOWHERE, &p, NULL), RL_OK);
    assert_string_equal(p.name, "ACES AP1");
    static const char *const others[] = {"sRGB", "raw", "ACEScct", "srgb_display"};
    for (size_t i = 0; i < sizeof others / sizeof *others; i++) {
        assert_int_equal(rl_color_primaries(config, others[i], RL_NOWHERE, &p, NULL), RL_OK);
        assert_false(p.known);
    }
}

static void test_unnamed_primaries(void **state)
{
    char folder[] = "/tmp/relit_color_XXXXXX";
    rl_primaries p;
    (void)state;
    assert_non_null(mkdtemp(folder));
    /* Red and green are swapped against AP0, which no well known set does. */
    rl_ocio *ocio =
        config_with(folder, "!<MatrixTransform> {matrix: [0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}");
    assert_int_equal(rl_color_primaries(ocio, "b", RL_NOWHERE, &p, NULL), RL_OK);
    assert_false(p.known); /* no role aces_interchange */
    rl_ocio_free(&ocio);
    remove_folder(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_views_match),
        cmocka_unit_test(test_spaces_match),
        cmocka_unit_test(test_config_is_whole),
        cmocka_unit_test(test_out_of_memory),
        cmocka_unit_test(test_no_change_no_pass),
        cmocka_unit_test(test_exposure),
        cmocka_unit_test(test_same_bits),
        cmocka_unit_test(test_every_operation),
        cmocka_unit_test(test_bakes_and_says_so),
        cmocka_unit_test(test_functions),
        cmocka_unit_test(test_names),
        cmocka_unit_test(test_unknown_names),
        cmocka_unit_test(test_primaries),
        cmocka_unit_test(test_unnamed_primaries),
    };
    return cmocka_run_group_tests_name("color", tests, setup, teardown);
}
