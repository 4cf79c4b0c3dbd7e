/* In which part of a file a layer is, and what cannot be read: known from headers, said by `relit check`. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/exr_make.h"
#include "tests/tool_run.h"

enum { W = 8, H = 4 };

static const char pipeline[] = "relit: 1\n"
                               "capture: capture.yaml\n"
                               "materials: {default: {}}\n"
                               "lights: {sun: {type: directional, direction: [0, 0, -1], irradiance: 1}}\n"
                               "graph:\n"
                               "  light: {pass: lighting}\n"
                               "outputs: {o: {image: light.lit, file: o.exr, type: float}}\n";

static const char manifest[] =
    "relit_capture: 1\n"
    "files: c.exr\n"
    "unit: m\n"
    "camera: {matrix: header, forward: -z, fov_x: header, jitter: [0, 0]}\n"
    "layers:\n"
    "  albedo: {part: color, channels: [R, G, B], colorspace: lin_rec709}\n"
    "  normal: {part: normal, channels: [X, Y, Z], space: world, encoding: signed}\n"
    "  depth: {part: depth, channels: [Z], kind: planar, empty: 1e10}\n"
    "  stencil: {part: id, channels: [ID]}\n"
    "  roughness: {part: rough, channels: [R]}\n";

static float half_grey[W * H], zero[W * H], one[W * H];
static uint32_t ids[W * H];

/* `placed`: how many of the parts, from the first, say where the camera is. */
static void write_parts(const char *folder, bool subsampled, int placed)
{
    static const float matrix[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    static const made_header with = {.matrix = matrix, .fov_x = 0.6f}, without = {.fov_x = 0.6f};
    const made_channel color[] = {{"B", RL_EXR_FLOAT, 0, half_grey},
                                  {"G", RL_EXR_FLOAT, 0, half_grey},
                                  {"R", RL_EXR_FLOAT, 0, half_grey}},
                       normal[] = {{"X", RL_EXR_FLOAT, 0, zero},
                                   {"Y", RL_EXR_FLOAT, 0, zero},
                                   {"Z", RL_EXR_FLOAT, 0, one}},
                       depth[] = {{"Z", RL_EXR_FLOAT, 0, one}}, id[] = {{"ID", RL_EXR_UINT, 0, ids}},
                       rough[] = {{"R", RL_EXR_FLOAT, subsampled ? 2 : 0, zero}};
    made_part parts[] = {{.name = "color", .channels = color, .n_channels = 3},
                         {.name = "normal", .channels = normal, .n_channels = 3, .tile = 16},
                         {.name = "depth", .channels = depth, .n_channels = 1},
                         {.name = "id", .channels = id, .n_channels = 1},
                         {.name = "rough", .channels = rough, .n_channels = 1}};
    for (int i = 0; i < 5; i++) {
        parts[i].width = W;
        parts[i].height = H;
        parts[i].header = i < placed ? &with : &without;
    }
    for (int i = 0; i < W * H; i++) {
        half_grey[i] = 0.5f;
        one[i] = 1;
        ids[i] = 1;
    }
    char *path = path_in(folder, "c.exr");
    made_write(path, parts, 5);
    free(path);
}

/* ---- deep data, which OpenEXR's core 3.1 cannot write: a header and a table of chunks ---- */

typedef struct bytes {
    unsigned char data[2048];
    size_t n;
} bytes;

static void add(bytes *b, const void *data, size_t n)
{
    assert_true(b->n + n <= sizeof b->data);
    memcpy(b->data + b->n, data, n);
    b->n += n;
}

static void add_int(bytes *b, int32_t v) /* little-endian hosts only, as all that relit runs on */
{
    add(b, &v, sizeof v);
}

static void add_attribute(bytes *b, const char *name, const char *type, const void *value, size_t n)
{
    add(b, name, strlen(name) + 1);
    add(b, type, strlen(type) + 1);
    add_int(b, (int32_t)n);
    add(b, value, n);
}

static void write_deep(const char *folder)
{
    static const char *const names[] = {"B", "G", "ID", "N", "R", "X", "Y", "Z"};
    static const float unit[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, none[2], fov = 0.6f;
    static const int32_t window[4] = {0, 0, W - 1, H - 1}, version = 1, chunks = H;
    static const uint64_t table[H];
    bytes file = {0}, channels = {0};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        add(&channels, names[i], strlen(names[i]) + 1);
        add_int(&channels, names[i][0] == 'I' ? 0 : 2); /* uint, float */
        add_int(&channels, 0);
        add_int(&channels, 1);
        add_int(&channels, 1);
    }
    add(&channels, "", 1);
    add_int(&file, 20000630);
    add_int(&file, 2 | 0x800); /* version 2, not an image */
    add_attribute(&file, "camera:fovx", "float", &fov, sizeof fov);
    add_attribute(&file, "channels", "chlist", channels.data, channels.n);
    add_attribute(&file, "chunkCount", "int", &chunks, sizeof chunks);
    add_attribute(&file, "compression", "compression", "", 1);
    add_attribute(&file, "dataWindow", "box2i", window, sizeof window);
    add_attribute(&file, "displayWindow", "box2i", window, sizeof window);
    add_attribute(&file, "lineOrder", "lineOrder", "", 1);
    add_attribute(&file, "name", "string", "c", 1);
    add_attribute(&file, "pixelAspectRatio", "float", unit, sizeof *unit);
    add_attribute(&file, "screenWindowCenter", "v2f", none, sizeof none);
    add_attribute(&file, "screenWindowWidth", "float", unit, sizeof *unit);
    add_attribute(&file, "type", "string", "deepscanline", 12);
    add_attribute(&file, "version", "int", &version, sizeof version);
    add_attribute(&file, "worldToCamera", "m44f", unit, sizeof unit);
    add(&file, "", 1);
    add(&file, table, sizeof table);
    file_write(folder, "c.exr", file.data, file.n);
}

static const char deep_manifest[] = "relit_capture: 1\n"
                                    "files: c.exr\n"
                                    "layers:\n"
                                    "  albedo: {channels: [R, G, B]}\n"
                                    "  normal: {channels: [X, Y, N]}\n"
                                    "  depth: {channels: [Z]}\n"
                                    "  stencil: {channels: [ID]}\n";

/* ---- looking at them ---- */

/* `relit COMMAND` on what is in the folder, which then goes. */
static tool_result look(const char *command, char *folder, const char *text)
{
    char *pipe = path_in(folder, "p.yaml"), *out = path_in(folder, "out");
    file_write(folder, "capture.yaml", text, strlen(text));
    file_write(folder, "p.yaml", pipeline, strlen(pipeline));
    tool_result r = tool_run((const char *const[]){command, pipe, "--out", out, "--quiet", NULL});
    free(pipe);
    free(out);
    folder_remove(folder);
    return r;
}

/* The file of five parts under the manifest with `find` replaced. */
static tool_result look_at_parts(const char *command, const char *find, const char *put)
{
    char *folder = folder_new(), *text = text_replace(manifest, find, put);
    write_parts(folder, false, 5);
    tool_result r = look(command, folder, text);
    free(text);
    return r;
}

static void expect_refusal(tool_result r, const char *says)
{
    if (r.status != 2 || !strstr(r.err, says))
        print_error("status %d: %s instead of %s\n", r.status, r.err, says);
    assert_int_equal(r.status, 2);
    assert_non_null(strstr(r.err, says));
    assert_non_null(strstr(r.err, "c.exr: error: "));
    tool_result_free(&r);
}

static void test_by_name(void **state)
{
    (void)state;
    tool_result r = look_at_parts("run", NULL, "");
    assert_string_equal(r.err, "");
    assert_int_equal(r.status, 0);
    tool_result_free(&r);
    r = look_at_parts("run", "{part: id, ", "{"); /* only one part has an ID */
    assert_int_equal(r.status, 0);
    tool_result_free(&r);
}

static void test_which_part(void **state)
{
    (void)state;
    expect_refusal(
        look_at_parts("check", "part: depth", "part: deph"),
        "layer 'depth' needs part 'deph'; did you mean 'depth'? the file has: color, depth, id, normal, "
        "rough (set layers.depth in capture.yaml)");
    /* a roughness that is the red of the albedo would be a picture without a complaint */
    expect_refusal(look_at_parts("check", "{part: rough, ", "{"),
                   "layer 'roughness': channel 'R' is in the parts 'color' and 'rough' (set "
                   "layers.roughness.part in capture.yaml)");
    expect_refusal(look_at_parts("check", "{part: depth, ", "{"),
                   "channel 'Z' is in the parts 'normal' and 'depth'");
    expect_refusal(look_at_parts("check", "part: depth, channels: [Z]", "part: rough, channels: [Z]"),
                   "layer 'depth' needs channel 'Z'");
}

static void test_unreadable_pixels(void **state)
{
    (void)state;
    char *folder = folder_new();
    write_deep(folder);
    expect_refusal(look("check", folder, deep_manifest),
                   "is in deep data, which relit does not read: flatten it first");
    folder = folder_new();
    write_parts(folder, true, 5);
    expect_refusal(look("check", folder, manifest),
                   "layer 'roughness': channel 'R' has a sample every 2 x 2 pixels");
}

/* The manifest (or a preset) leaves the camera to the header, which has none: it is the file that lacks it.
 */
static void test_no_camera(void **state)
{
    (void)state;
    char *folder = folder_new();
    write_parts(folder, false, 0);
    expect_refusal(
        look("check", folder, manifest),
        "c.exr: error: frame 1: the file has no attribute worldToCamera; give camera.matrix: 16 numbers");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_by_name),
        cmocka_unit_test(test_which_part),
        cmocka_unit_test(test_unreadable_pixels),
        cmocka_unit_test(test_no_camera),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
