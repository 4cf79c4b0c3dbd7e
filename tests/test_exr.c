/* EXR files that relit writes, of every type, compression, size and window: there and back, and through
 * OpenEXR's own pipeline. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "tests/exr_make.h"

/* ---- round trips ---- */

enum { RED, GREEN, BLUE, ALPHA, DEPTH, NOISE, ID, CHANNELS };

static const char *const names[CHANNELS] = {"diffuse.R", "diffuse.G", "diffuse.B", "A",
                                            "depth.Z",   "noise",     "stencil.ID"};
static const rl_exr_pixel types[CHANNELS] = {RL_EXR_HALF,  RL_EXR_HALF,  RL_EXR_HALF, RL_EXR_HALF,
                                             RL_EXR_FLOAT, RL_EXR_FLOAT, RL_EXR_UINT};

typedef struct picture {
    int width, height;
    size_t stride;
    float *floats[CHANNELS];
    uint32_t *ids;
} picture;

static picture picture_make(int width, int height)
{
    picture p = {.width = width, .height = height, .stride = (size_t)width + 3};
    uint32_t seed = 11;
    for (int c = 0; c < CHANNELS; c++)
        p.floats[c] = calloc(p.stride * (size_t)height, 4);
    p.ids = calloc(p.stride * (size_t)height, 4);
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) {
            size_t i = (size_t)y * p.stride + (size_t)x;
            for (int c = 0; c < 4; c++) /* smooth, and a half exactly */
                p.floats[c][i] = (float)((x * (c + 1) + y * 3) % 256) / 128.0f;
            p.floats[DEPTH][i] = 1.0f + 0.001f * (float)x + 0.0003f * (float)y;
            uint32_t noise = made_random(&seed) & 0xbfffffff; /* finite */
            memcpy(&p.floats[NOISE][i], &noise, 4);
            p.ids[i] = (uint32_t)(x / 5 + y / 7) * 0x01010101u;
        }
    }
    return p;
}

static void picture_free(picture *p)
{
    for (int c = 0; c < CHANNELS; c++)
        free(p->floats[c]);
    free(p->ids);
}

static void picture_write(const picture *p, const char *path, rl_exr_box data, rl_exr_compression compression,
                          int level, rl_pool *pool)
{
    rl_exr_source sources[CHANNELS];
    rl_error err = {0};
    uint64_t clamped = 99;
    for (int c = 0; c < CHANNELS; c++)
        sources[c] = (rl_exr_source){names[c], types[c], c == ID ? NULL : p->floats[c],
                                     c == ID ? p->ids : NULL, p->stride};
    rl_exr_image image = {.data_window = data,
                          .display_window = {0, 0, 99, 49},
                          .channels = sources,
                          .n_channels = CHANNELS,
                          .compression = compression,
                          .level = level};
    made_good(rl_exr_write(path, &image, pool, &clamped, &err), &err);
    assert_int_equal(clamped, 0);
}

static void picture_read(picture *p, const char *path, rl_pool *pool)
{
    rl_exr_plane planes[CHANNELS];
    rl_error err = {0};
    rl_exr *file;
    made_good(rl_exr_open(path, 0, &file, &err), &err);
    for (int c = 0; c < CHANNELS; c++)
        planes[c] = (rl_exr_plane){.channel = names[c],
                                   .floats = c == ID ? NULL : p->floats[c],
                                   .ids = c == ID ? p->ids : NULL,
                                   .stride = p->stride};
    made_good(rl_exr_read(file, 0, planes, CHANNELS, NULL, pool, &err), &err);
    for (int c = 0; c < CHANNELS; c++)
        assert_int_equal(planes[c].nonfinite, 0);
    rl_exr_close(&file);
}

/* The largest difference that a compression may make to a value of a channel. PXR24 keeps 16 bits of a
 * float's 24. B44 and DWA lose what the eye does not see: the bounds are generous for these ramps of 0…2 that
 * wrap around (in B44 a block that holds such a step keeps 6 bits of it). DWA touches R, G and B only. */
static double tolerance(rl_exr_compression compression, int c, double value)
{
    bool rgb = c <= BLUE, half = c <= ALPHA, number = c == DEPTH || c == NOISE;
    switch (compression) {
    case RL_EXR_PXR24:
        return number ? fabs(value) * 0x1p-16 + 0x1p-133 : 0;
    case RL_EXR_B44:
    case RL_EXR_B44A:
        return half ? 0.06 + 0.1 * fabs(value) : 0;
    case RL_EXR_DWAA:
    case RL_EXR_DWAB:
        return rgb ? 0.2 : 0;
    default:
        return 0;
    }
}

static void same_pictures(const picture *want, const picture *got, rl_exr_compression compression)
{
    for (int y = 0; y < want->height; y++) {
        for (int x = 0; x < want->width; x++) {
            size_t i = (size_t)y * want->stride + (size_t)x;
            assert_int_equal(want->ids[i], got->ids[i]);
            for (int c = 0; c < ID; c++) {
                double a = (double)want->floats[c][i], b = (double)got->floats[c][i];
                if (!(fabs(a - b) <= tolerance(compression, c, a)))
                    fail_msg("%s, %d x %d, %s at (%d, %d): %.9g became %.9g",
                             rl_exr_compression_name(compression), want->width, want->height, names[c], x, y,
                             a, b);
            }
        }
        for (size_t x = (size_t)want->width; x < want->stride; x++) /* nothing is written behind a row */
            assert_int_equal(got->ids[(size_t)y * got->stride + x], 0);
    }
}

static void round_trips(void **state)
{
    (void)state;
    static const int sizes[][2] = {{1, 1}, {3, 5}, {17, 33}, {64, 48}, {131, 70}};
    static const int corners[][2] = {{0, 0}, {-7, -13}, {20, 5}};
    for (int c = 0; c < RL_EXR_COMPRESSIONS; c++) {
        for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
            int w = sizes[s][0], h = sizes[s][1];
            int x0 = corners[s % 3][0], y0 = corners[s % 3][1];
            rl_exr_box data = {x0, y0, x0 + w - 1, y0 + h - 1};
            picture out = picture_make(w, h), in = picture_make(w, h);
            for (int k = 0; k < CHANNELS; k++)
                memset(in.floats[k], 0, in.stride * (size_t)h * 4);
            memset(in.ids, 0, in.stride * (size_t)h * 4);
            for (size_t y = 0; y < (size_t)h; y++) /* a pad that is 0 in both */
                memset(out.ids + y * out.stride + (size_t)w, 0, 4 * (out.stride - (size_t)w));
            picture_write(&out, made_path("trip.exr"), data, (rl_exr_compression)c, 0, made_pools[1]);
            picture_read(&in, made_path("trip.exr"), made_pools[1]);
            same_pictures(&out, &in, (rl_exr_compression)c);
            picture_free(&out);
            picture_free(&in);
        }
    }
}

/* What we write, the core's own pipeline decodes to what we decode, bit for bit. (Not B44 in tiny files: the
 * core of 3.1 mistakes a plain chunk for a packed one. Not DWA: it has none.) */
static void core_reads_the_same(void **state)
{
    (void)state;
    const int w = 131, h = 70;
    picture out = picture_make(w, h), in = picture_make(w, h);
    uint32_t *raw = calloc((size_t)w * (size_t)h, 4);
    for (int c = 0; c <= RL_EXR_B44A + 2; c++) {
        /* the last two: libdeflate */
        rl_exr_compression compression = c > RL_EXR_B44A ? RL_EXR_ZIP : (rl_exr_compression)c;
        const char *path = made_path("core.exr");
        picture_write(&out, path, (rl_exr_box){-5, 9, w - 6, h + 8}, compression,
                      c > RL_EXR_B44A ? 1 + 8 * (c & 1) : 0, made_pools[1]);
        picture_read(&in, path, made_pools[1]);
        for (int k = 0; k < CHANNELS; k++) {
            made_read(path, 0, names[k], raw);
            for (int y = 0; y < h; y++) {
                for (int x = 0; x < w; x++) {
                    size_t i = (size_t)y * in.stride + (size_t)x, r = (size_t)(y * w + x);
                    float f = in.floats[k][i];
                    if (types[k] == RL_EXR_HALF)
                        assert_int_equal(made_half(f), ((uint16_t *)raw)[r]);
                    else
                        assert_memory_equal(k == ID ? (void *)&in.ids[i] : (void *)&f, &raw[r], 4);
                }
            }
        }
    }
    free(raw);
    picture_free(&out);
    picture_free(&in);
}

static void threads_change_nothing(void **state)
{
    (void)state;
    const int w = 200, h = 300;
    picture out = picture_make(w, h), in[3];
    for (int c = 0; c < RL_EXR_COMPRESSIONS; c++) {
        char *first = NULL;
        size_t size = 0;
        for (int t = 0; t < 3; t++) {
            char *bytes;
            size_t n;
            rl_error err = {0};
            picture_write(&out, made_path("threads.exr"), (rl_exr_box){0, 0, w - 1, h - 1},
                          (rl_exr_compression)c, 0, made_pools[t]);
            made_good(rl_file_read(made_path("threads.exr"), &bytes, &n, &err), &err);
            if (first) {
                assert_int_equal(n, size);
                assert_memory_equal(bytes, first, size);
                rl_free(bytes);
            } else {
                first = bytes;
                size = n;
            }
            in[t] = picture_make(w, h);
            picture_read(&in[t], made_path("threads.exr"), made_pools[t]);
            for (int k = 0; k < CHANNELS; k++)
                assert_memory_equal(in[t].floats[k], in[0].floats[k], in[t].stride * (size_t)h * 4);
        }
        for (int t = 0; t < 3; t++)
            picture_free(&in[t]);
        rl_free(first);
    }
    picture_free(&out);
}

static void clamping_is_counted(void **state)
{
    (void)state;
    float pixels[40 * 2], back[40 * 2];
    for (int i = 0; i < 80; i++)
        pixels[i] = i % 10 == 0 ? 1e6f : i % 10 == 5 ? -INFINITY : 1.0f;
    const rl_exr_source source = {"Y", RL_EXR_HALF, pixels, NULL, 2};
    for (int c = 0; c <= RL_EXR_ZIP; c++) {
        const rl_exr_image image = {.data_window = {0, 0, 1, 39},
                                    .display_window = {0, 0, 1, 39},
                                    .channels = &source,
                                    .n_channels = 1,
                                    .compression = (rl_exr_compression)c};
        rl_error err = {0};
        uint64_t clamped = 0;
        rl_exr *file;
        made_good(rl_exr_write(made_path("clamp.exr"), &image, made_pools[2], &clamped, &err), &err);
        assert_int_equal(clamped, 16);
        made_good(rl_exr_open(made_path("clamp.exr"), 0, &file, &err), &err);
        rl_exr_plane plane = {.channel = "Y", .floats = back, .stride = 2};
        made_good(rl_exr_read(file, 0, &plane, 1, NULL, NULL, &err), &err);
        rl_exr_close(&file);
        assert_int_equal(plane.nonfinite, 0);
        for (int i = 0; i < 80; i++)
            assert_true(back[i] == (i % 10 == 0 ? 65504.0f : i % 10 == 5 ? -65504.0f : 1.0f));
    }
}

/* What does not compress is stored as it is, by every method, and the core takes it for that. */
static void noise_is_stored_plain(void **state)
{
    (void)state;
    enum { W = 50, H = 90 };
    static uint32_t noise[W * H], back[W * H];
    uint32_t seed = 9;
    for (int i = 0; i < W * H; i++)
        noise[i] = made_random(&seed);
    const rl_exr_source source = {"id", RL_EXR_UINT, NULL, noise, W};
    for (int c = 0; c < RL_EXR_COMPRESSIONS; c++) {
        for (int level = 0; level <= 1; level++) {
            const rl_exr_image image = {.data_window = {0, 0, W - 1, H - 1},
                                        .display_window = {0, 0, W - 1, H - 1},
                                        .channels = &source,
                                        .n_channels = 1,
                                        .compression = (rl_exr_compression)c,
                                        .level = level};
            rl_error err = {0};
            rl_exr *file;
            char *bytes;
            size_t size;
            made_good(rl_exr_write(made_path("noise.exr"), &image, made_pools[1], NULL, &err), &err);
            made_good(rl_file_read(made_path("noise.exr"), &bytes, &size, &err), &err);
            rl_free(bytes);
            assert_in_range(size, sizeof noise, sizeof noise + 400 + 16 * H);
            made_good(rl_exr_open(made_path("noise.exr"), 0, &file, &err), &err);
            memset(back, 0, sizeof back);
            rl_exr_plane plane = {.channel = "id", .ids = back, .stride = W};
            made_good(rl_exr_read(file, 0, &plane, 1, NULL, made_pools[1], &err), &err);
            rl_exr_close(&file);
            assert_memory_equal(back, noise, sizeof noise);
            if (c == RL_EXR_B44 ||
                c == RL_EXR_B44A) /* the core of 3.1 takes a plain chunk for a packed one */
                continue;
            memset(back, 0, sizeof back);
            made_read(made_path("noise.exr"), 0, "id", back);
            assert_memory_equal(back, noise, sizeof noise);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(round_trips),
        cmocka_unit_test(core_reads_the_same),
        cmocka_unit_test(threads_change_nothing),
        cmocka_unit_test(clamping_is_counted),
        cmocka_unit_test(noise_is_stored_plain),
    };
    return cmocka_run_group_tests(tests, made_setup, made_teardown);
}
