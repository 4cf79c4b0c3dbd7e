/* Reading and writing EXR files: every type, compression, window and layout, against OpenEXR's own pipelines.
 */
#include <math.h>
#include <pthread.h>
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

static rl_pool *pools[3]; /* 1, 2, 4 threads */

static void good(rl_code code, const rl_error *err)
{
    if (code)
        fail_msg("%s: %s: %s", rl_code_name(code), err->file, err->text);
}

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
    rl_exr_image image = {
        .data_window = data,
        .display_window = {0, 0, 99, 49},
        .channels = sources,
        .n_channels = CHANNELS,
        .compression = compression,
        .level = level
    };
    good(rl_exr_write(path, &image, pool, &clamped, &err), &err);
    assert_int_equal(clamped, 0);
}

static void picture_read(picture *p, const char *path, rl_pool *pool)
{
    rl_exr_plane planes[CHANNELS];
    rl_error err = {0};
    rl_exr *file;
    good(rl_exr_open(path, 0, &file, &err), &err);
    for (int c = 0; c < CHANNELS; c++)
        planes[c] = (rl_exr_plane){.channel = names[c],
                                   .floats = c == ID ? NULL : p->floats[c],
                                   .ids = c == ID ? p->ids : NULL,
                                   .stride = p->stride};
    good(rl_exr_read(file, 0, planes, CHANNELS, NULL, pool, &err), &err);
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
    static const int sizes[][2] = {
        {1,   1 },
        {3,   5 },
        {17,  33},
        {64,  48},
        {131, 70}
    };
    static const int corners[][2] = {
        {0,  0  },
        {-7, -13},
        {20, 5  }
    };
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
            picture_write(&out, made_path("trip.exr"), data, (rl_exr_compression)c, 0, pools[1]);
            picture_read(&in, made_path("trip.exr"), pools[1]);
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
                      c > RL_EXR_B44A ? 1 + 8 * (c & 1) : 0, pools[1]);
        picture_read(&in, path, pools[1]);
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
                          (rl_exr_compression)c, 0, pools[t]);
            good(rl_file_read(made_path("threads.exr"), &bytes, &n, &err), &err);
            if (first) {
                assert_int_equal(n, size);
                assert_memory_equal(bytes, first, size);
                rl_free(bytes);
            } else {
                first = bytes;
                size = n;
            }
            in[t] = picture_make(w, h);
            picture_read(&in[t], made_path("threads.exr"), pools[t]);
            for (int k = 0; k < CHANNELS; k++)
                assert_memory_equal(in[t].floats[k], in[0].floats[k], in[t].stride * (size_t)h * 4);
        }
        for (int t = 0; t < 3; t++)
            picture_free(&in[t]);
        rl_free(first);
    }
    picture_free(&out);
}

/* ---- layouts that we do not write ---- */

typedef struct seen {
    const rl_exr_plane *plane;
    int width;
    pthread_mutex_t mutex;
    int rows[64];
    double sum;
} seen;

static void count_rows(void *ctx, int part, int y0, int y1)
{
    seen *s = ctx;
    double sum = 0;
    assert_int_equal(part, 1);
    for (int y = y0; y < y1; y++)
        for (int x = 0; x < s->width; x++)
            sum += (double)s->plane->floats[(size_t)y * s->plane->stride + (size_t)x];
    pthread_mutex_lock(&s->mutex);
    s->sum += sum;
    for (int y = y0; y < y1; y++)
        s->rows[y]++;
    pthread_mutex_unlock(&s->mutex);
}

/* Two parts, the second tiled, with levels, at a negative corner; every compression that the core can write.
 */
static void tiled_and_multipart(void **state)
{
    (void)state;
    enum { W = 45, H = 37 };
    static float a[H][W];
    static uint16_t b[H][W];
    static uint32_t id[H][W];
    double sum = 0;
    for (int y = 0; y < H; y++) {
        for (int x = 0; x < W; x++) {
            a[y][x] = (float)(x * 100 + y);
            b[y][x] = made_half((float)(x - y));
            id[y][x] = (uint32_t)(x / 4 + 1000000 * (y / 4));
            sum += (double)a[y][x];
        }
    }
    const made_channel channels[] = {
        {"a",  RL_EXR_FLOAT, 0, a },
        {"b",  RL_EXR_HALF,  0, b },
        {"id", RL_EXR_UINT,  0, id}
    };
    for (int c = 0; c <= RL_EXR_PIZ; c++) {
        const made_part parts[] = {
            {"beauty", 0,   0,  W, H, RL_EXR_ZIP,            0,  false, false, channels, 3},
            {"data",   -11, -3, W, H, (rl_exr_compression)c, 16, true,  false, channels, 3},
        };
        made_write(made_path("parts.exr"), parts, 2);
        rl_exr *file;
        rl_error err = {0};
        good(rl_exr_open(made_path("parts.exr"), 1 << 20, &file, &err), &err);
        assert_int_equal(rl_exr_parts(file), 2);
        assert_int_equal(rl_exr_part_named(file, "data"), 1);
        assert_int_equal(rl_exr_part_named(file, "nothing"), -1);
        const rl_exr_part *part = rl_exr_part_at(file, 1);
        assert_true(part->tiled && !part->deep && part->tile_width == 16 && part->width == W &&
                    part->height == H);
        assert_true(part->data_window.x0 == -11 && part->data_window.y1 == -3 + H - 1);
        assert_int_equal(part->n_channels, 3);
        assert_int_equal(rl_exr_channel_named(part, "b")->type, RL_EXR_HALF);
        assert_null(rl_exr_channel_named(part, "c"));
        for (int t = 0; t < 3; t++) {
            static float fa[H][W], fb[H][W];
            static uint32_t ids[H][W];
            memset(fa, 0, sizeof fa);
            rl_exr_plane planes[] = {
                {.channel = "id", .ids = &ids[0][0],   .stride = W},
                {.channel = "b",  .floats = &fb[0][0], .stride = W},
                {.channel = "a",  .floats = &fa[0][0], .stride = W}
            };
            seen s = {.plane = &planes[2], .width = W, .mutex = PTHREAD_MUTEX_INITIALIZER};
            good(rl_exr_read(file, 1, planes, 3, &(rl_exr_rows){count_rows, &s}, pools[t], &err), &err);
            assert_memory_equal(fa, a, sizeof a);
            assert_memory_equal(ids, id, sizeof id);
            for (int y = 0; y < H; y++) {
                assert_int_equal(s.rows[y], 1);
                for (int x = 0; x < W; x++)
                    assert_true(fb[y][x] == (float)(x - y));
            }
            assert_true(s.sum == sum); /* the rows were there when they were announced */
        }
        rl_exr_close(&file);
    }
}

/* Levels above 0 are not looked at, a channel can be asked for twice, and the others are skipped. */
static void one_channel_twice(void **state)
{
    (void)state;
    enum { W = 33, H = 21 };
    static uint32_t id[H * W];
    static uint16_t b[H * W];
    for (int i = 0; i < W * H; i++) {
        id[i] = (uint32_t)i * 7;
        b[i] = made_half((float)(i % 100));
    }
    const made_channel channels[] = {
        {"b",  RL_EXR_HALF, 0, b },
        {"id", RL_EXR_UINT, 0, id}
    };
    for (int c = RL_EXR_NONE; c <= RL_EXR_ZIP; c++) {
        const made_part part = {NULL, 0, 0, W, H, (rl_exr_compression)c, 0, false, false, channels, 2};
        made_write(made_path("twice.exr"), &part, 1);
        rl_exr *file;
        rl_error err = {0};
        static uint32_t ids[H * W];
        static float floats[H * W];
        good(rl_exr_open(made_path("twice.exr"), 0, &file, &err), &err);
        rl_exr_plane planes[] = {
            {.channel = "id", .ids = ids,       .stride = W},
            {.channel = "id", .floats = floats, .stride = W}
        };
        good(rl_exr_read(file, 0, planes, 2, NULL, NULL, &err), &err);
        assert_memory_equal(ids, id, sizeof id);
        for (int i = 0; i < W * H; i++)
            assert_true(floats[i] == (float)(i * 7));
        rl_exr_close(&file);
    }
}

/* ---- values ---- */

static void nonfinite_values(void **state)
{
    (void)state;
    enum { W = 20, H = 40 };
    static float f[H * W];
    static uint16_t h[H * W];
    for (int i = 0; i < W * H; i++) {
        f[i] = i % 7 == 0 ? NAN : i % 11 == 0 ? INFINITY : i % 13 == 0 ? -INFINITY : 1.0f;
        h[i] = i % 7 == 0 ? 0x7e01 : i % 11 == 0 ? 0x7c00 : i % 13 == 0 ? 0xfc00 : 0x3c00;
    }
    const made_channel channels[] = {
        {"f", RL_EXR_FLOAT, 0, f},
        {"h", RL_EXR_HALF,  0, h}
    };
    const made_part part = {NULL, 0, 0, W, H, RL_EXR_ZIPS, 0, false, false, channels, 2};
    made_write(made_path("nan.exr"), &part, 1);
    unsigned bad = 0, inf = 0;
    for (int i = 0; i < W * H; i++) {
        inf += i % 7 && i % 11 == 0;
        bad += i % 7 == 0 || i % 11 == 0 || i % 13 == 0;
    }
    rl_exr *file;
    rl_error err = {0};
    good(rl_exr_open(made_path("nan.exr"), 0, &file, &err), &err);
    for (int t = 0; t < 3; t++) {
        static float out[3][H * W];
        rl_exr_plane planes[] = {
            {.channel = "f",      .floats = out[0], .stride = W  },
            {                 .channel = "h",               .floats = out[1],                        .stride = W},
            { .channel = "h", .floats = out[2],                 .stride = W,                               .replace_inf = true, .inf_value = 1e10f}
        };
        good(rl_exr_read(file, 0, planes, 3, NULL, pools[t], &err), &err);
        assert_int_equal(planes[0].nonfinite, bad);
        assert_int_equal(planes[1].nonfinite, bad);
        assert_int_equal(planes[2].nonfinite, bad - inf);
        for (int i = 0; i < W * H; i++) {
            bool ok = i % 7 && i % 11 && i % 13;
            assert_true(out[0][i] == (ok ? 1.0f : 0.0f) && out[1][i] == out[0][i]);
            assert_true(out[2][i] == (ok ? 1.0f : i % 7 && i % 11 == 0 ? 1e10f : 0.0f));
        }
    }
    rl_exr_close(&file);
}

/* Writes one value at pixel (2, 1) of a 4 x 3 file with its corner at (10, 20) and reads it as an id or a
 * float. */
static rl_code read_value(rl_exr_pixel type, const void *value, bool as_id, uint32_t *id, float *number,
                          rl_error *err)
{
    uint32_t pixels[12] = {0}, ids[12] = {0};
    float floats[12] = {0};
    memcpy((char *)pixels + 6 * (type == RL_EXR_HALF ? 2 : 4), value, type == RL_EXR_HALF ? 2 : 4);
    const made_channel channel = {"v", type, 0, pixels};
    const made_part part = {NULL, 10, 20, 4, 3, RL_EXR_ZIP, 0, false, false, &channel, 1};
    made_write(made_path("value.exr"), &part, 1);
    rl_exr *file;
    *err = (rl_error){0};
    good(rl_exr_open(made_path("value.exr"), 0, &file, err), err);
    rl_exr_plane plane = {
        .channel = "v", .floats = as_id ? NULL : floats, .ids = as_id ? ids : NULL, .stride = 4};
    rl_code code = rl_exr_read(file, 0, &plane, 1, NULL, pools[1], err);
    rl_exr_close(&file);
    *id = ids[6];
    *number = floats[6];
    return code;
}

static void ids_are_integers(void **state)
{
    (void)state;
    const struct {
        float value;
        bool ok;
        uint32_t id;
    } cases[] = {
        {3,              true,  3          },
        {16777216,       true,  16777216   },
        {-1,             true,  0xffffffff },
        {3e9f,           true,  3000000000u},
        {-2147483648.0f, true,  0x80000000 },
        {4294967040.0f,  true,  4294967040u},
        {4294967296.0f,  false, 0          },
        {2.5f,           false, 0          },
        {NAN,            false, 0          },
        {INFINITY,       false, 0          },
        {-3e9f,          false, 0          }
    };
    rl_error err;
    uint32_t id;
    float number;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        rl_code code = read_value(RL_EXR_FLOAT, &cases[i].value, true, &id, &number, &err);
        assert_int_equal(code, cases[i].ok ? RL_OK : RL_E_DATA);
        if (cases[i].ok)
            assert_int_equal(id, cases[i].id);
        else
            assert_non_null(strstr(err.text, "'v'"));
    }
    uint16_t half = made_half(2048), bad = made_half(0.5f);
    good(read_value(RL_EXR_HALF, &half, true, &id, &number, &err), &err);
    assert_int_equal(id, 2048);
    assert_int_equal(read_value(RL_EXR_HALF, &bad, true, &id, &number, &err), RL_E_DATA);
    assert_non_null(strstr(err.text, "0.5 at pixel (12, 21)"));
    assert_non_null(strstr(err.file, "value.exr"));
    uint32_t exact = 0x01000000, odd = 0x01000001, most = 0xffffffff;
    good(read_value(RL_EXR_UINT, &most, true, &id, &number, &err), &err);
    assert_int_equal(id, 0xffffffff);
    good(read_value(RL_EXR_UINT, &exact, false, &id, &number, &err), &err);
    assert_true(number == 16777216.0f);
    assert_int_equal(read_value(RL_EXR_UINT, &odd, false, &id, &number, &err), RL_E_DATA);
    assert_non_null(strstr(err.text, "16777217 at pixel (12, 21)"));
}

static void clamping_is_counted(void **state)
{
    (void)state;
    float pixels[40 * 2], back[40 * 2];
    for (int i = 0; i < 80; i++)
        pixels[i] = i % 10 == 0 ? 1e6f : i % 10 == 5 ? -INFINITY : 1.0f;
    const rl_exr_source source = {"Y", RL_EXR_HALF, pixels, NULL, 2};
    for (int c = 0; c <= RL_EXR_ZIP; c++) {
        const rl_exr_image image = {
            .data_window = {0, 0, 1, 39},
            .display_window = {0, 0, 1, 39},
            .channels = &source,
            .n_channels = 1,
            .compression = (rl_exr_compression)c
        };
        rl_error err = {0};
        uint64_t clamped = 0;
        rl_exr *file;
        good(rl_exr_write(made_path("clamp.exr"), &image, pools[2], &clamped, &err), &err);
        assert_int_equal(clamped, 16);
        good(rl_exr_open(made_path("clamp.exr"), 0, &file, &err), &err);
        rl_exr_plane plane = {.channel = "Y", .floats = back, .stride = 2};
        good(rl_exr_read(file, 0, &plane, 1, NULL, NULL, &err), &err);
        rl_exr_close(&file);
        assert_int_equal(plane.nonfinite, 0);
        for (int i = 0; i < 80; i++)
            assert_true(back[i] == (i % 10 == 0 ? 65504.0f : i % 10 == 5 ? -65504.0f : 1.0f));
    }
}

static int setup(void **state)
{
    (void)state;
    rl_error err = {0};
    for (int i = 0; i < 3; i++)
        good(rl_pool_new(1 << i, &pools[i], &err), &err);
    return 0;
}

static int teardown(void **state)
{
    (void)state;
    for (int i = 0; i < 3; i++)
        rl_pool_free(&pools[i]);
    made_clean();
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(round_trips),
        cmocka_unit_test(core_reads_the_same),
        cmocka_unit_test(threads_change_nothing),
        cmocka_unit_test(tiled_and_multipart),
        cmocka_unit_test(one_channel_twice),
        cmocka_unit_test(nonfinite_values),
        cmocka_unit_test(ids_are_integers),
        cmocka_unit_test(clamping_is_counted),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
