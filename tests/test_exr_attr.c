/* Attributes of EXR files: written, read back, printed, copied from file to file. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>
#include <openexr.h>

#include "tests/exr_make.h"

static const float pixel[4] = {1, 2, 3, 4};

static const rl_exr_source source = {"Y", RL_EXR_FLOAT, pixel, NULL, 2};

static rl_exr_image image_with(const rl_exr_attribute *attrs, size_t n)
{
    return (rl_exr_image){.data_window = {3, 4, 4, 5},
                          .display_window = {-1, 0, 99, 49},
                          .channels = &source,
                          .n_channels = 1,
                          .compression = RL_EXR_ZIP,
                          .pixel_aspect = 2,
                          .screen_width = 0.5f,
                          .screen_center = {0.25f, -0.125f},
                          .attrs = attrs,
                          .n_attrs = n};
}

static const rl_exr_attribute all[] = {
    {"owner", {RL_EXR_T_STRING, {0}, "relit\ttest"}},
    {"camera:fovx", {RL_EXR_T_FLOAT, {0.5}, NULL}},
    {"camera:jitter", {RL_EXR_T_V2F, {0.25, -0.125}, NULL}},
    {"count", {RL_EXR_T_INT, {-7}, NULL}},
    {"precise", {RL_EXR_T_DOUBLE, {0.1}, NULL}},
    {"corner", {RL_EXR_T_V2I, {-3, 2000000000}, NULL}},
    {"where", {RL_EXR_T_V3F, {1, 2, 3}, NULL}},
    {"worldToCamera", {RL_EXR_T_M44F, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16}, NULL}},
    {"exact", {RL_EXR_T_M44D, {0.1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, NULL}},
    {"turn", {RL_EXR_T_M33F, {1, 2, 3, 4, 5, 6, 7, 8, 9}, NULL}},
    {"chromaticities", {RL_EXR_T_CHROMATICITIES, {0.75, 0.25, 0.5, 0.5, 0.125, 0.0625, 0.25, 0.375}, NULL}},
    {"timeCode", {RL_EXR_T_TIMECODE, {0x01020304 + 64.0, 77}, NULL}}, /* 01:02:03, frame 4, drop frame */
    {"framesPerSecond", {RL_EXR_T_RATIONAL, {30000, 1001}, NULL}},
    {"region", {RL_EXR_T_BOX2I, {1, 2, 3, 4}, NULL}},
};
enum { ALL = sizeof all / sizeof *all };

static void same_value(const rl_exr_value *a, const rl_exr_value *b, const char *name)
{
    if (a->type != b->type)
        fail_msg("'%s' has type %d, not %d", name, (int)b->type, (int)a->type);
    for (int i = 0; i < rl_exr_type_numbers(a->type); i++)
        if (a->v[i] != b->v[i])
            fail_msg("'%s'[%d] is %.9g, not %.9g", name, i, b->v[i], a->v[i]);
    if (a->type == RL_EXR_T_STRING)
        assert_string_equal(a->text, b->text);
}

static rl_exr *open_file(const char *path)
{
    rl_exr *file;
    rl_error err = {0};
    made_good(rl_exr_open(path, 0, &file, &err), &err);
    return file;
}

static void round_trip(void **state)
{
    (void)state;
    rl_error err = {0};
    rl_exr_image image = image_with(all, ALL);
    made_good(rl_exr_write(made_path("attr.exr"), &image, NULL, NULL, &err), &err);
    rl_exr *file = open_file(made_path("attr.exr"));
    for (int i = 0; i < ALL; i++) {
        rl_exr_value v;
        assert_true(rl_exr_attr(file, 0, all[i].name, &v));
        same_value(&all[i].value, &v, all[i].name);
    }
    rl_exr_value v;
    assert_false(rl_exr_attr(file, 0, "nothing", &v));
    const rl_exr_part *part = rl_exr_part_at(file, 0);
    assert_string_equal(part->name, "");
    assert_true(part->pixel_aspect == 2 && part->screen_width == 0.5f && part->screen_center[0] == 0.25f &&
                part->screen_center[1] == -0.125f);
    assert_true(part->data_window.x0 == 3 && part->data_window.y0 == 4 && part->data_window.x1 == 4 &&
                part->data_window.y1 == 5 && part->display_window.x0 == -1 && part->display_window.x1 == 99);
    assert_int_equal(part->compression, RL_EXR_ZIP);
    rl_exr_close(&file);
    exr_context_t ctx; /* and the core agrees about the matrix */
    exr_attr_m44f_t m;
    assert_int_equal(exr_start_read(&ctx, made_path("attr.exr"), NULL), 0);
    assert_int_equal(exr_attr_get_m44f(ctx, 0, "worldToCamera", &m), 0);
    for (int i = 0; i < 16; i++)
        assert_true(m.m[i] == (float)(i + 1));
    exr_finish(&ctx);
}

static void printed(void **state)
{
    (void)state;
    static const char *const want[][3] = {{"owner", "string", "relit test"},
                                          {"camera:fovx", "float", "0.5"},
                                          {"camera:jitter", "v2f", "[0.25 -0.125]"},
                                          {"precise", "double", "0.1"},
                                          {"corner", "v2i", "[-3 2000000000]"},
                                          {"timeCode", "timecode", "01:02:03;04"},
                                          {"framesPerSecond", "rational", "30000/1001"},
                                          {"region", "box2i", "[1 2 3 4]"},
                                          {"channels", "chlist", "Y:float"},
                                          {"compression", "compression", "zip"},
                                          {"dataWindow", "box2i", "[3 4 4 5]"},
                                          {"lineOrder", "lineOrder", "increasing y"}};
    rl_error err = {0};
    rl_exr_image image = image_with(all, ALL);
    made_good(rl_exr_write(made_path("print.exr"), &image, NULL, NULL, &err), &err);
    rl_exr *file = open_file(made_path("print.exr"));
    size_t found = 0;
    for (size_t i = 0; i < rl_exr_part_at(file, 0)->n_attrs; i++) {
        const char *name, *type;
        rl_str s = {0};
        rl_exr_attr_at(file, 0, i, &name, &type, NULL);
        rl_exr_attr_print(file, 0, i, &s);
        assert_true(s.length > 0);
        for (size_t k = 0; k < sizeof want / sizeof *want; k++) {
            if (strcmp(want[k][0], name))
                continue;
            found++;
            assert_string_equal(type, want[k][1]);
            assert_string_equal(rl_str_text(&s), want[k][2]);
        }
        rl_str_free(&s);
    }
    assert_int_equal(found, sizeof want / sizeof *want);
    rl_exr_close(&file);
}

/* By name and by prefix; what the image gives wins; what describes the old pixels stays behind. */
static void copied(void **state)
{
    (void)state;
    rl_error err = {0};
    rl_exr_image image = image_with(all, ALL);
    made_good(rl_exr_write(made_path("from.exr"), &image, NULL, NULL, &err), &err);
    rl_exr *from = open_file(made_path("from.exr"));
    static const char *const names[] = {"camera:*", "worldToCamera", "timeCode", "owner",
                                        "missing",  "dataWindow",    "comp*",    "framesPerSecond"};
    const rl_exr_attribute own[] = {{"owner", {RL_EXR_T_STRING, {0}, "somebody else"}}};
    rl_exr_image copy = image_with(own, 1);
    copy.data_window = (rl_exr_box){0, 0, 1, 1};
    copy.compression = RL_EXR_RLE;
    copy.copy_from = from;
    copy.copy = names;
    copy.n_copy = sizeof names / sizeof *names;
    made_good(rl_exr_write(made_path("to.exr"), &copy, NULL, NULL, &err), &err);
    rl_exr *to = open_file(made_path("to.exr"));
    for (int i = 0; i < ALL; i++) {
        const char *name = all[i].name;
        bool wanted = !strncmp(name, "camera:", 7) || !strcmp(name, "worldToCamera") ||
                      !strcmp(name, "timeCode") || !strcmp(name, "framesPerSecond");
        rl_exr_value v;
        if (!strcmp(name, "owner"))
            continue;
        assert_int_equal(rl_exr_attr(to, 0, name, &v), wanted);
        if (wanted)
            same_value(&all[i].value, &v, name);
    }
    rl_exr_value v;
    assert_true(rl_exr_attr(to, 0, "owner", &v));
    assert_string_equal(v.text, "somebody else");
    assert_int_equal(rl_exr_part_at(to, 0)->data_window.x1, 1);
    assert_int_equal(rl_exr_part_at(to, 0)->compression, RL_EXR_RLE);
    rl_exr_close(&to);
    rl_exr_close(&from);
}

/* Types that relit has no numbers for survive a copy: vectors of text and of floats, key codes, unknown ones.
 */
static void copied_as_they_are(void **state)
{
    (void)state;
    static const char *const texts[] = {"left", "right"};
    static const float floats[] = {1, 2, 3};
    const exr_attr_keycode_t key = {1, 2, 3, 4, 5, 6, 64};
    exr_context_t ctx;
    int part;
    const char *path = made_path("odd.exr");
    assert_int_equal(exr_start_write(&ctx, path, EXR_WRITE_FILE_DIRECTLY, NULL), 0);
    assert_int_equal(exr_add_part(ctx, NULL, EXR_STORAGE_SCANLINE, &part), 0);
    assert_int_equal(exr_initialize_required_attr_simple(ctx, 0, 1, 1, EXR_COMPRESSION_NONE), 0);
    assert_int_equal(exr_add_channel(ctx, 0, "Y", EXR_PIXEL_FLOAT, EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1), 0);
    assert_int_equal(exr_attr_set_string_vector(ctx, 0, "multiView", 2, (const char **)(uintptr_t)texts), 0);
    assert_int_equal(exr_attr_set_float_vector(ctx, 0, "weights", 3, floats), 0);
    assert_int_equal(exr_attr_set_keycode(ctx, 0, "keyCode", &key), 0);
    assert_int_equal(exr_attr_set_user(ctx, 0, "secret", "vendor", 5, "12345"), 0);
    assert_int_equal(exr_write_header(ctx), 0);
    assert_int_equal(exr_write_scanline_chunk(ctx, 0, 0, pixel, 4), 0);
    assert_int_equal(exr_finish(&ctx), 0);

    rl_error err = {0};
    rl_exr *from = open_file(path);
    static const char *const every[] = {"*"};
    rl_exr_image image = image_with(NULL, 0);
    image.copy_from = from;
    image.copy = every;
    image.n_copy = 1;
    made_good(rl_exr_write(made_path("odd2.exr"), &image, NULL, NULL, &err), &err);
    rl_exr_close(&from);
    const char *strings[2], *type;
    const float *numbers;
    const void *bytes;
    int32_t n;
    exr_attr_keycode_t got;
    assert_int_equal(exr_start_read(&ctx, made_path("odd2.exr"), NULL), 0);
    n = 2;
    assert_int_equal(exr_attr_get_string_vector(ctx, 0, "multiView", &n, strings), 0);
    assert_string_equal(strings[1], "right");
    assert_int_equal(exr_attr_get_float_vector(ctx, 0, "weights", &n, &numbers), 0);
    assert_true(n == 3 && numbers[2] == 3);
    assert_int_equal(exr_attr_get_keycode(ctx, 0, "keyCode", &got), 0);
    assert_memory_equal(&got, &key, sizeof key);
    assert_int_equal(exr_attr_get_user(ctx, 0, "secret", &type, &n, &bytes), 0);
    assert_true(n == 5 && !memcmp(bytes, "12345", 5) && !strcmp(type, "vendor"));
    exr_finish(&ctx);
}

static void compression_names(void **state)
{
    (void)state;
    for (int c = 0; c < RL_EXR_COMPRESSIONS; c++)
        assert_int_equal(rl_exr_compression_named(rl_exr_compression_name((rl_exr_compression)c)), c);
    assert_int_equal(rl_exr_compression_named("DWAA"), RL_EXR_DWAA);
    assert_int_equal(rl_exr_compression_named("zipp"), -1);
}

static int teardown(void **state)
{
    (void)state;
    made_clean();
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(round_trip),         cmocka_unit_test(printed),           cmocka_unit_test(copied),
        cmocka_unit_test(copied_as_they_are), cmocka_unit_test(compression_names),
    };
    return cmocka_run_group_tests(tests, NULL, teardown);
}
