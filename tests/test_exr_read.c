/* Reading what relit does not write itself (tiles, levels, parts), and which values come through. */
#include <math.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <openexr.h>

#include "graph/run/shim_exr.h"
#include "tests/exr_make.h"

/* ---- layouts that we do not write ---- */

typedef struct seen {
    const rl_exr_plane *plane;
    int part, width;
    pthread_mutex_t mutex;
    int rows[64];
    double sum;
} seen;

static void count_rows(void *ctx, int part, int y0, int y1)
{
    seen *s = ctx;
    double sum = 0;
    assert_int_equal(part, s->part);
    for (int y = y0; y < y1; y++)
        for (int x = 0; x < s->width; x++)
            sum += (double)s->plane->floats[(size_t)y * s->plane->stride + (size_t)x];
    pthread_mutex_lock(&s->mutex);
    s->sum += sum;
    for (int y = y0; y < y1; y++)
        s->rows[y]++;
    pthread_mutex_unlock(&s->mutex);
}

enum { TILES_W = 45, TILES_H = 37, TILE = 16 };
static float tiles_a[TILES_H][TILES_W];
static uint16_t tiles_b[TILES_H][TILES_W];
static uint32_t tiles_id[TILES_H][TILES_W];
static double tiles_sum; /* of a */

static const made_channel tile_channels[] = {
    {"a", RL_EXR_FLOAT, 0, tiles_a}, {"b", RL_EXR_HALF, 0, tiles_b}, {"id", RL_EXR_UINT, 0, tiles_id}};

static void fill_tiles(void)
{
    tiles_sum = 0;
    for (int y = 0; y < TILES_H; y++) {
        for (int x = 0; x < TILES_W; x++) {
            tiles_a[y][x] = (float)(x * 100 + y);
            tiles_b[y][x] = made_half((float)(x - y));
            tiles_id[y][x] = (uint32_t)(x / 4 + 1000000 * (y / 4));
            tiles_sum += (double)tiles_a[y][x];
        }
    }
}

/* Reads the part with each pool: values, and every row announced once and not too early. */
static void read_tiles(const rl_exr *file, int part)
{
    rl_error err = {0};
    for (int t = 0; t < 3; t++) {
        static float a[TILES_H][TILES_W], b[TILES_H][TILES_W];
        static uint32_t ids[TILES_H][TILES_W];
        memset(a, 0, sizeof a);
        rl_exr_plane planes[] = {{.channel = "id", .ids = &ids[0][0], .stride = TILES_W},
                                 {.channel = "b", .floats = &b[0][0], .stride = TILES_W},
                                 {.channel = "a", .floats = &a[0][0], .stride = TILES_W}};
        seen s = {.plane = &planes[2], .part = part, .width = TILES_W, .mutex = PTHREAD_MUTEX_INITIALIZER};
        made_good(rl_exr_read(file, part, planes, 3, &(rl_exr_rows){count_rows, &s}, made_pools[t], &err),
                  &err);
        assert_memory_equal(a, tiles_a, sizeof a);
        assert_memory_equal(ids, tiles_id, sizeof ids);
        for (int y = 0; y < TILES_H; y++) {
            assert_int_equal(s.rows[y], 1);
            for (int x = 0; x < TILES_W; x++)
                assert_true(b[y][x] == (float)(x - y));
        }
        assert_true(s.sum == tiles_sum);
    }
}

/* Two parts, the second tiled, with levels, at a negative corner; every compression that the core can write.
 */
static void tiled_and_multipart(void **state)
{
    (void)state;
    fill_tiles();
    for (int c = 0; c <= RL_EXR_PIZ; c++) {
        const made_part parts[] = {
            {"beauty", 0, 0, TILES_W, TILES_H, RL_EXR_ZIP, 0, false, false, tile_channels, 3, NULL},
            {"data", -11, -3, TILES_W, TILES_H, (rl_exr_compression)c, TILE, true, false, tile_channels, 3,
             NULL},
        };
        made_write(made_path("parts.exr"), parts, 2);
        rl_exr *file;
        rl_error err = {0};
        made_good(rl_exr_open(made_path("parts.exr"), 1 << 20, &file, &err), &err);
        assert_int_equal(rl_exr_parts(file), 2);
        assert_int_equal(rl_exr_part_named(file, "data"), 1);
        assert_int_equal(rl_exr_part_named(file, "nothing"), -1);
        const rl_exr_part *part = rl_exr_part_at(file, 1);
        assert_true(part->tiled && !part->deep && part->tile_width == TILE);
        assert_true(part->width == TILES_W && part->height == TILES_H);
        assert_true(part->data_window.x0 == -11 && part->data_window.y1 == -3 + TILES_H - 1);
        assert_int_equal(part->n_channels, 3);
        assert_int_equal(rl_exr_channel_named(part, "b")->type, RL_EXR_HALF);
        assert_null(rl_exr_channel_named(part, "c"));
        read_tiles(file, 0);
        read_tiles(file, 1);
        rl_exr_close(&file);
    }
}

/* Rows of channels of one tile, compressed by the C++ library; returns the size. */
static size_t pack_dwa_tile(int tx, int ty, int w, int h, uint8_t *packed, size_t room)
{
    static const rl_exr_layout layout[] = {{"a", RL_EXR_FLOAT}, {"b", RL_EXR_HALF}, {"id", RL_EXR_UINT}};
    const rl_shim_exr_block block = {.layout = layout, .n_channels = 3, .width = w, .height = h};
    uint8_t plain[TILE * TILE * 10], *to = plain;
    char message[200];
    size_t size;
    for (int y = ty * TILE; y < ty * TILE + h; y++) {
        int x = tx * TILE;
        memcpy(to, &tiles_a[y][x], 4 * (size_t)w);
        memcpy(to + 4 * w, &tiles_b[y][x], 2 * (size_t)w);
        memcpy(to + 6 * w, &tiles_id[y][x], 4 * (size_t)w);
        to += 10 * w;
    }
    if (rl_shim_exr_compress(&block, plain, packed, room, &size, message, sizeof message))
        fail_msg("%s", message);
    if (size >= (size_t)(to - plain)) { /* stored as it is */
        size = (size_t)(to - plain);
        memcpy(packed, plain, size);
    }
    return size;
}

/* The core has no DWA, but it writes tiles that somebody else has packed. None of the channels is R, G or B:
 * no loss. */
static void tiled_dwa(void **state)
{
    (void)state;
    exr_context_t ctx;
    int part, packed_tiles = 0;
    fill_tiles();
    assert_int_equal(exr_start_write(&ctx, made_path("dwa.exr"), EXR_WRITE_FILE_DIRECTLY, NULL), 0);
    assert_int_equal(exr_add_part(ctx, NULL, EXR_STORAGE_TILED, &part), 0);
    assert_int_equal(exr_initialize_required_attr_simple(ctx, 0, TILES_W, TILES_H, EXR_COMPRESSION_DWAA), 0);
    assert_int_equal(exr_set_tile_descriptor(ctx, 0, TILE, TILE, EXR_TILE_ONE_LEVEL, EXR_TILE_ROUND_DOWN), 0);
    for (int c = 0; c < 3; c++)
        assert_int_equal(exr_add_channel(ctx, 0, tile_channels[c].name,
                                         (exr_pixel_type_t)tile_channels[c].type,
                                         EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1),
                         0);
    assert_int_equal(exr_write_header(ctx), 0);
    for (int ty = 0; ty * TILE < TILES_H; ty++) {
        for (int tx = 0; tx * TILE < TILES_W; tx++) {
            uint8_t packed[TILE * TILE * 10];
            int w = TILES_W - tx * TILE < TILE ? TILES_W - tx * TILE : TILE,
                h = TILES_H - ty * TILE < TILE ? TILES_H - ty * TILE : TILE;
            size_t size = pack_dwa_tile(tx, ty, w, h, packed, sizeof packed);
            packed_tiles += size < (size_t)(w * h * 10);
            assert_int_equal(exr_write_tile_chunk(ctx, 0, tx, ty, 0, 0, packed, size), 0);
        }
    }
    assert_int_equal(exr_finish(&ctx), 0);
    assert_true(packed_tiles > 4);
    rl_exr *file;
    rl_error err = {0};
    made_good(rl_exr_open(made_path("dwa.exr"), 1 << 20, &file, &err), &err);
    read_tiles(file, 0);
    rl_exr_close(&file);
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
    const made_channel channels[] = {{"b", RL_EXR_HALF, 0, b}, {"id", RL_EXR_UINT, 0, id}};
    for (int c = RL_EXR_NONE; c <= RL_EXR_ZIP; c++) {
        const made_part part = {NULL, 0, 0, W, H, (rl_exr_compression)c, 0, false, false, channels, 2, NULL};
        made_write(made_path("twice.exr"), &part, 1);
        rl_exr *file;
        rl_error err = {0};
        static uint32_t ids[H * W];
        static float floats[H * W];
        made_good(rl_exr_open(made_path("twice.exr"), 0, &file, &err), &err);
        rl_exr_plane planes[] = {{.channel = "id", .ids = ids, .stride = W},
                                 {.channel = "id", .floats = floats, .stride = W}};
        made_good(rl_exr_read(file, 0, planes, 2, NULL, NULL, &err), &err);
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
    const made_channel channels[] = {{"f", RL_EXR_FLOAT, 0, f}, {"h", RL_EXR_HALF, 0, h}};
    const made_part part = {NULL, 0, 0, W, H, RL_EXR_ZIPS, 0, false, false, channels, 2, NULL};
    made_write(made_path("nan.exr"), &part, 1);
    unsigned bad = 0, inf = 0;
    for (int i = 0; i < W * H; i++) {
        inf += i % 7 && i % 11 == 0;
        bad += i % 7 == 0 || i % 11 == 0 || i % 13 == 0;
    }
    rl_exr *file;
    rl_error err = {0};
    made_good(rl_exr_open(made_path("nan.exr"), 0, &file, &err), &err);
    for (int t = 0; t < 3; t++) {
        static float out[3][H * W];
        rl_exr_plane planes[] = {{.channel = "f", .floats = out[0], .stride = W},
                                 {.channel = "h", .floats = out[1], .stride = W},
                                 {.channel = "h", .floats = out[2], .stride = W}};
        planes[2].replace_inf = true;
        planes[2].inf_value = 1e10f;
        made_good(rl_exr_read(file, 0, planes, 3, NULL, made_pools[t], &err), &err);
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
    const made_part part = {NULL, 10, 20, 4, 3, RL_EXR_ZIP, 0, false, false, &channel, 1, NULL};
    made_write(made_path("value.exr"), &part, 1);
    rl_exr *file;
    *err = (rl_error){0};
    made_good(rl_exr_open(made_path("value.exr"), 0, &file, err), err);
    rl_exr_plane plane = {
        .channel = "v", .floats = as_id ? NULL : floats, .ids = as_id ? ids : NULL, .stride = 4};
    rl_code code = rl_exr_read(file, 0, &plane, 1, NULL, made_pools[1], err);
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
    } cases[] = {{3, true, 3},
                 {16777216, true, 16777216},
                 {-1, true, 0xffffffff},
                 {3e9f, true, 3000000000u},
                 {-2147483648.0f, true, 0x80000000},
                 {4294967040.0f, true, 4294967040u},
                 {4294967296.0f, false, 0},
                 {2.5f, false, 0},
                 {NAN, false, 0},
                 {INFINITY, false, 0},
                 {-3e9f, false, 0}};
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
    made_good(read_value(RL_EXR_HALF, &half, true, &id, &number, &err), &err);
    assert_int_equal(id, 2048);
    assert_int_equal(read_value(RL_EXR_HALF, &bad, true, &id, &number, &err), RL_E_DATA);
    assert_non_null(strstr(err.text, "0.5 at pixel (12, 21)"));
    assert_non_null(strstr(err.file, "value.exr"));
    uint32_t exact = 0x01000000, odd = 0x01000001, most = 0xffffffff;
    made_good(read_value(RL_EXR_UINT, &most, true, &id, &number, &err), &err);
    assert_int_equal(id, 0xffffffff);
    made_good(read_value(RL_EXR_UINT, &exact, false, &id, &number, &err), &err);
    assert_true(number == 16777216.0f);
    assert_int_equal(read_value(RL_EXR_UINT, &odd, false, &id, &number, &err), RL_E_DATA);
    assert_non_null(strstr(err.text, "16777217 at pixel (12, 21)"));
}

/* The limit holds for one channel when a file is opened, and for all that are read together. */
static void limits(void **state)
{
    (void)state;
    fill_tiles();
    const made_part part = {NULL, 0,     0,     TILES_W,       TILES_H, RL_EXR_ZIP,
                            0,    false, false, tile_channels, 3,       NULL};
    const uint64_t plane = sizeof tiles_a;
    made_write(made_path("limit.exr"), &part, 1);
    rl_exr *file;
    rl_error err = {0};
    assert_int_equal(rl_exr_open(made_path("limit.exr"), plane - 1, &file, &err), RL_E_MEMORY);
    assert_null(file);
    err = (rl_error){0};
    made_good(rl_exr_open(made_path("limit.exr"), plane, &file, &err), &err);
    static float a[TILES_H][TILES_W];
    rl_exr_plane one = {.channel = "a", .floats = &a[0][0], .stride = TILES_W};
    assert_int_equal(rl_exr_read(file, 0, &one, 1, NULL, NULL, &err), RL_E_MEMORY);
    assert_non_null(strstr(err.text, "limit"));
    rl_exr_close(&file);
    err = (rl_error){0};
    made_good(rl_exr_open(made_path("limit.exr"), plane * 6, &file, &err), &err);
    made_good(rl_exr_read(file, 0, &one, 1, NULL, NULL, &err), &err);
    assert_memory_equal(a, tiles_a, sizeof a);
    rl_exr_close(&file);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tiled_and_multipart), cmocka_unit_test(tiled_dwa),
        cmocka_unit_test(one_channel_twice),   cmocka_unit_test(nonfinite_values),
        cmocka_unit_test(ids_are_integers),    cmocka_unit_test(limits),
    };
    return cmocka_run_group_tests(tests, made_setup, made_teardown);
}
