/* The contact sheet of `relit ab --sheet`, from frames made by hand. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/run/image_file.h"
#include "graph/run/image_text.h"
#include "graph/tool/ab_sheet_parts.h"
#include "tests/tool_run.h"

enum { W = 320, H = 180, MOST = 64 };

static char names[MOST][16];
static const char *values[MOST];
static rl_variant variants[MOST];
static rl_ab_parameter parameter = {"graph.sss.taps", values};
static rl_error err;

static rl_ab_plan plan_of(size_t n)
{
    for (size_t i = 0; i < n; i++) {
        snprintf(names[i], sizeof names[i], "%zu", 8 * (i + 1));
        values[i] = names[i];
        variants[i].name = names[i];
    }
    return (rl_ab_plan){
        .variants = variants, .n_variants = n, .n_listed = n, .parameters = &parameter, .n_parameters = 1};
}

/* A frame whose variant i is a ramp, redder with i; the left half has no material. */
typedef struct scene {
    float *pixels;
    uint32_t *stencil;
    rl_compared_image (*images)[RL_COMPARED];
    rl_error fine;
    rl_experiment_frame frame;
} scene;

static void scene_make(scene *s, size_t n, int width, int height)
{
    size_t pixels = (size_t)width * (size_t)height;
    *s = (scene){.pixels = calloc(3 * pixels * n, sizeof(float)),
                 .stencil = calloc(pixels, sizeof(uint32_t)),
                 .images = calloc(n, sizeof *s->images)};
    assert_true(s->pixels && s->stencil && s->images);
    for (size_t v = 0; v < n; v++)
        for (int c = 0; c < 3; c++) {
            float *plane = s->pixels + (3 * v + (size_t)c) * pixels;
            for (size_t i = 0; i < pixels; i++)
                plane[i] = 0.2f + 0.6f * (float)(i % (size_t)width) / (float)width +
                           (c == 0 ? 0.02f * (float)v : 0.0f);
            s->images[v][RL_COMPARED_DISPLAY].plane[c] = plane;
            s->images[v][RL_COMPARED_DISPLAY].width = width;
            s->images[v][RL_COMPARED_DISPLAY].height = height;
            s->images[v][RL_COMPARED_DISPLAY].stride = (size_t)width;
        }
    for (size_t i = 0; i < pixels; i++)
        s->stencil[i] = i % (size_t)width >= (size_t)width / 2;
    s->frame = (rl_experiment_frame){.index = 2,
                                     .frame = 3,
                                     .error = &s->fine,
                                     .width = width,
                                     .height = height,
                                     .stencil = s->stencil,
                                     .stencil_stride = (size_t)width,
                                     .images = (const rl_compared_image(*)[RL_COMPARED])s->images};
}

static void scene_free(scene *s)
{
    free(s->pixels);
    free(s->stencil);
    free(s->images);
}

/* The sheet of n variants, written and read again. */
static rl_ab_layout write_sheet(size_t n, int width, int height, const char *path, rl_image_file *out)
{
    rl_ab_plan plan = plan_of(n);
    rl_ab_sheet *sheet;
    scene s;
    scene_make(&s, n, width, height);
    assert_int_equal(rl_ab_sheet_new(&plan, 2, "monkey frame 3, sRGB / ACES", NULL, &sheet, &err), RL_OK);
    assert_int_equal(rl_ab_sheet_frame(sheet, &s.frame, &err), RL_OK);
    if (rl_ab_sheet_write(sheet, path, &err) || rl_image_file_read(path, out, &err))
        fail_msg("%s: %s", path, err.text);
    rl_ab_layout l = sheet->layout;
    rl_ab_sheet_free(&sheet);
    scene_free(&s);
    return l;
}

static float at(const rl_image_file *f, int c, int x, int y)
{
    return f->planes[((size_t)c * (size_t)f->height + (size_t)y) * (size_t)f->width + (size_t)x];
}

/* How many pixels of a rectangle differ from the paper. */
static int inked(const rl_image_file *f, int x, int y, int width, int height)
{
    int n = 0;
    for (int j = y; j < y + height; j++)
        for (int i = x; i < x + width; i++)
            n += fabsf(at(f, 1, i, j) - at(f, 1, 2, 2)) > 0.02f;
    return n;
}

static void test_pixels(void **state)
{
    (void)state;
    char *folder = folder_new(), *path = path_in(folder, "sheet.png");
    rl_image_file f;
    rl_ab_layout l = write_sheet(4, W, H, path, &f);
    assert_int_equal(f.width, l.width);
    assert_int_equal(f.height, l.height);
    assert_int_equal(f.channels, 3);
    assert_int_equal(l.tile_width, W); /* small enough: as they are */
    int top = f.height - l.rows * l.cell_height;
    for (int i = 0; i < 4; i++) {
        int x = 16 + i % l.columns * l.cell_width, y = top + i / l.columns * l.cell_height;
        float expected = 0.2f + 0.6f * 100 / W;
        assert_true(fabsf(at(&f, 0, x + 100, y + 40) - expected - 0.02f * (float)i) < 0.003f);
        assert_true(fabsf(at(&f, 2, x + 100, y + 40) - expected) < 0.003f);
        assert_true(inked(&f, x, y + H, W, l.cell_height - H - 16) > 200);      /* the label, */
        assert_int_equal(inked(&f, x, y + H + l.cell_height - H - 4, W, 4), 0); /* which ends */
    }
    assert_true(inked(&f, 16, 16, 200, 30) > 100); /* the title */
    rl_image_file_free(&f);
    free(path);
    folder_remove(folder);
}

/* FLIP of the pixels that have a material, against the last. */
static void test_numbers(void **state)
{
    (void)state;
    enum { N = 3 };
    rl_ab_plan plan = plan_of(N);
    rl_ab_sheet *sheet;
    scene s;
    scene_make(&s, N, W, H);
    assert_int_equal(rl_ab_sheet_new(&plan, 2, "t", NULL, &sheet, &err), RL_OK);
    assert_int_equal(rl_ab_sheet_frame(sheet, &s.frame, &err), RL_OK);
    double first = sheet->tiles[0].flip[RL_STAT_MEAN], second = sheet->tiles[1].flip[RL_STAT_MEAN];
    assert_true(first > 1.2 * second && second > 0.001);
    /* What is outside of materials does not count. */
    for (size_t i = 0; i < (size_t)W * H; i++)
        if (i % W < W / 2 - 40) /* FLIP looks a little around */
            s.pixels[i] = 1;
    assert_int_equal(rl_ab_sheet_frame(sheet, &s.frame, &err), RL_OK);
    assert_true(fabs(sheet->tiles[0].flip[RL_STAT_MEAN] - first) < 1e-6);
    rl_ab_sheet_free(&sheet);
    scene_free(&s);
}

/* Only its own frame; without it there is no sheet. */
static void test_frames(void **state)
{
    (void)state;
    rl_ab_plan plan = plan_of(2);
    rl_ab_sheet *sheet;
    scene s;
    rl_error bad = {.code = RL_E_DATA};
    scene_make(&s, 2, W, H);
    assert_int_equal(rl_ab_sheet_new(&plan, 2, "t", NULL, &sheet, &err), RL_OK);
    s.frame.index = 1;
    assert_int_equal(rl_ab_sheet_frame(sheet, &s.frame, &err), RL_OK);
    s.frame.index = 2;
    s.frame.capture = 1;
    assert_int_equal(rl_ab_sheet_frame(sheet, &s.frame, &err), RL_OK);
    s.frame.capture = 0;
    s.frame.error = &bad;
    assert_int_equal(rl_ab_sheet_frame(sheet, &s.frame, &err), RL_OK);
    err = (rl_error){0};
    assert_int_equal(rl_ab_sheet_write(sheet, "/nowhere/sheet.png", &err), RL_E_DATA);
    assert_non_null(strstr(err.text, "its frame has failed"));
    err = (rl_error){0};
    rl_ab_sheet_free(&sheet);
    scene_free(&s);
    static const long long numbers[] = {5, 7, 9};
    assert_int_equal(rl_ab_sheet_choose(NULL, numbers, 3), 2);
    assert_int_equal(rl_ab_sheet_choose("first,last", numbers, 3), 0);
    assert_int_equal(rl_ab_sheet_choose("worst,first", numbers, 3), 2);
    assert_int_equal(rl_ab_sheet_choose("7", numbers, 3), 1);
    assert_int_equal(rl_ab_sheet_choose("7-9,5", numbers, 3), 1);
    assert_int_equal(rl_ab_sheet_choose("8", numbers, 3), 2);
    assert_int_equal(rl_ab_sheet_choose("all", numbers, 3), 2);
}

/* Any number of tiles of any shape: inside of the sheet, which is inside of its bounds. */
static void test_layouts(void **state)
{
    (void)state;
    static const int sizes[][2] = {{1920, 1080}, {64, 48}, {8192, 64}, {64, 8192}, {1, 1}, {480, 270}};
    for (size_t n = 1; n <= 256; n = n * 3 / 2 + 1)
        for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
            rl_ab_layout l;
            rl_ab_layout_make(n, sizes[i][0], sizes[i][1], &l);
            assert_true((size_t)l.columns * (size_t)l.rows >= n);
            assert_true((size_t)l.columns * (size_t)(l.rows - 1) < n);
            assert_true(l.width <= RL_AB_SHEET_MOST && l.height <= RL_AB_SHEET_MOST);
            assert_true(l.tile_width >= 1 && l.tile_width <= sizes[i][0] && l.tile_width <= 960);
            assert_true(l.tile_height >= 1 && l.tile_height <= sizes[i][1]);
            assert_true(l.tile_width < l.cell_width && l.columns * l.cell_width <= l.width);
            assert_true(l.tile_height < l.cell_height && l.rows * l.cell_height <= l.height);
            assert_true(l.text >= 9);
        }
}

/* A tile is the mean of the light: half black, half white is not half grey. */
static void test_shrink(void **state)
{
    (void)state;
    float pixels[3 * 6 * 4];
    for (int i = 0; i < 3 * 24; i++)
        pixels[i] = i % 2 ? 1.0f : 0.0f;
    rl_metric_image image = {.width = 6, .height = 4, .channels = 3, .stride = 6, .encoded = true};
    for (int c = 0; c < 3; c++)
        image.plane[c] = pixels + 24 * c;
    rl_ab_layout l = {.tile_width = 3, .tile_height = 2};
    rl_ab_tile tile = {0};
    assert_int_equal(rl_ab_tile_shrink(&image, &l, NULL, &tile, &err), RL_OK);
    for (int i = 0; i < 18; i++)
        assert_true(fabsf(tile.pixels[i] - 0.7353570f) < 1e-5f); /* sRGB of 0.5 */
    rl_free(tile.pixels);
}

static void test_text(void **state)
{
    (void)state;
    const rl_text_style small = {16, false, {1, 0.5f, 0}}, large = {32, true, {1, 1, 1}};
    int a, b, c;
    assert_int_equal(rl_image_text_width("taps 21", &small, &a, &err), RL_OK);
    assert_int_equal(rl_image_text_width("taps 21", &large, &b, &err), RL_OK);
    assert_int_equal(rl_image_text_width("", &large, &c, &err), RL_OK);
    assert_true(a > 30 && a < 90 && b > 3 * a / 2 && c == 0);
    static float planes[3][40 * 100];
    float *const plane[3] = {planes[0], planes[1], planes[2]};
    assert_int_equal(rl_image_text(plane, 100, 40, 100, 5, 30, "taps 21", &small, &err), RL_OK);
    float brightest = 0;
    for (int i = 0; i < 40 * 100; i++) {
        assert_true(fabsf(planes[1][i] - 0.5f * planes[0][i]) < 1e-6f && planes[2][i] == 0);
        brightest = planes[0][i] > brightest ? planes[0][i] : brightest;
        if (i % 100 < 4 || i % 100 > 5 + a || i / 100 < 30 - 16)
            assert_true(planes[0][i] == 0);
    }
    assert_true(brightest > 0.9f && brightest <= 1);
    assert_int_equal(rl_image_text(plane, 100, 40, 100, 90, -3, "beyond the edges", &large, &err), RL_OK);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pixels),  cmocka_unit_test(test_numbers), cmocka_unit_test(test_frames),
        cmocka_unit_test(test_layouts), cmocka_unit_test(test_shrink),  cmocka_unit_test(test_text),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
