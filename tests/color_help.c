#include "tests/color_help.h"

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
#include "tests/cl_harness.h"

static cl_harness *device;

bool color_help_start(void)
{
    device = cl_harness_new();
    return device != NULL;
}

void color_help_stop(void)
{
    cl_harness_free(&device);
}

/* ---- running a pass ---------------------------------------------------------------------------------- */

/* Colours between low and high: most of them dark, a tenth below 0 if low is, channels independent so that
 * saturated colours are frequent; the first ones are exact greys and primaries. */
void color_fill(float *planes, double low, double high)
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

void color_run(const rl_pass *pass, float exposure, const float *in, float *out)
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
    cl_buffer args[] = {{source, bytes},
                        {result, bytes},
                        {&params, sizeof params},
                        {&frame, sizeof frame},
                        {&material, sizeof material},
                        {tables.data, tables.n * sizeof(float)}};
    if (!cl_harness_run(kernel, args, tables.n ? 6 : 5, global, NULL))
        fail_msg("%s", cl_harness_error(device));
    memcpy(out, result, bytes);
    rl_free(source);
    rl_free(result);
    cl_harness_release(&kernel);
    rl_arena_free(&arena);
}

rl_color_pass color_make_pass(const rl_ocio *ocio, const rl_ocio_request *request, rl_arena *arena,
                              const rl_log *log)
{
    rl_error err = {0};
    rl_color_pass pass;
    if (rl_color_pass_new(ocio, request, false, RL_NOWHERE, arena, log, &pass, &err) != RL_OK)
        fail_msg("%s", err.text);
    return pass;
}

difference color_compare(const rl_ocio *ocio, const rl_ocio_request *request, const rl_pass *pass, double low,
                         double high)
{
    float *in = rl_malloc(9 * N * sizeof *in), *got = in + 3 * N, *want = got + 3 * N;
    rl_ocio_transform *transform = NULL;
    difference d = {0};
    assert_non_null(in);
    color_fill(in, low, high);
    color_run(pass, 0, in, got);
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

rl_ocio *color_config(const char *folder, const char *transform)
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

void color_remove_folder(const char *folder)
{
    static const char *const names[] = {"config.ocio", "curve.spi1d", "cube.cube"};
    char path[256];
    for (size_t i = 0; i < 3; i++) {
        snprintf(path, sizeof path, "%s/%s", folder, names[i]);
        remove(path);
    }
    rmdir(folder);
}
