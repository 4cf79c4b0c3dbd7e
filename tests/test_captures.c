/* One analytic scene under many conventions: whatever a renderer wrote, the picture is the same (DESIGN 2).
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/capture_run.h"
#include "tests/tool_run.h"

/* How far off a form may be: what its numbers lose, relative to the largest value of the image (normals:
 * absolute). */
typedef struct allowed {
    double color, depth, normal;
} allowed;

static const allowed full = {2e-6, 2e-7, 4e-7}; /* 32-bit floats throughout */

static void expect_ids(const rl_image_view *image, const scene *truth, const uint32_t *ids)
{
    for (size_t i = 0; i < truth->n; i++) {
        uint32_t id, want = ids ? ids[truth->id[i]] : truth->id[i];
        memcpy(&id, image->plane[0] + i / (size_t)truth->width * image->stride + i % (size_t)truth->width,
               sizeof id);
        if (id != want)
            fail_msg("pixel %zu has id %u instead of %u", i, id, want);
    }
}

/* Two pictures with the same sum are the same bits, as far as chance goes (FNV-1a). */
static uint64_t sum_of(const rl_image_view *image)
{
    uint64_t sum = 14695981039346656037u;
    for (int c = 0; c < image->planes; c++)
        for (int i = 0; i < image->width * image->height; i++) {
            uint32_t bits;
            memcpy(&bits, image->plane[c] + (size_t)(i / image->width) * image->stride + i % image->width,
                   sizeof bits);
            sum = (sum ^ bits) * 1099511628211u;
        }
    return sum;
}

/* Writes the scene, reads it back and compares; the sum of the picture. */
static uint64_t expect_scene(const capture_form *f, const scene_camera *camera, allowed most)
{
    char *folder = folder_new();
    scene s = scene_make(camera, SCENE_LIGHTS, SCENE_KEY | SCENE_RIM);
    rl_error err = {0};
    capture_write(folder, f, &s, 1);
    capture_manifest(folder, f, &s, 1);
    capture_log_clear();
    rl_session *r = capture_open(folder, capture_pipeline, NULL);
    if (rl_session_process(r, 0, 1, NULL, &err))
        fail_msg("%s: %s: %s", f->name, err.file, err.text);
    rl_image_view color = capture_image(r, "c.color"), depth = capture_image(r, "capture.depth");
    rl_image_view normal = capture_image(r, "capture.normal"), id = capture_image(r, "capture.stencil");
    rl_image_view albedo = capture_image(r, "capture.albedo");
    rl_image_view motion = capture_image(r, "capture.motion"),
                  thickness = capture_image(r, "capture.thickness");
    double off_color = capture_error(&color, &s, SCENE_COLOR, 3, 0);
    double off_depth = capture_error(&depth, &s, SCENE_DEPTH, 1, 0);
    double off_normal = capture_error(&normal, &s, SCENE_NORMAL, 3, 1);
    double off_motion = capture_error(&motion, &s, SCENE_MOTION, 2, 0);
    double off_thickness = capture_error(&thickness, &s, SCENE_THICKNESS, 1, 0);
    print_message("# %-28s color %.2g, depth %.2g, normal %.2g, motion %.2g, thickness %.2g\n", f->name,
                  off_color, off_depth, off_normal, off_motion, off_thickness);
    assert_string_equal(capture_log(), "");
    expect_ids(&id, &s, f->ids);
    assert_true(off_color <= most.color);
    assert_true(off_depth <= most.depth);
    assert_true(off_normal <= most.normal);
    assert_true(capture_error(&albedo, &s, SCENE_ALBEDO, 3, 1) <= (f->pixel == RL_EXR_HALF ? 5e-4 : 1e-6));
    assert_true(off_motion <= (f->pixel == RL_EXR_HALF ? 1e-3 : 1e-6));
    assert_true(off_thickness <= (f->pixel == RL_EXR_HALF ? 1e-3 : 1e-6));
    uint64_t sum = sum_of(&color);
    rl_session_close(&r);
    scene_free(&s);
    folder_remove(folder);
    return sum;
}

static uint64_t expect_default(const capture_form *f, allowed most)
{
    scene_camera camera = scene_camera_default();
    return expect_scene(f, &camera, most);
}

/* ---- channels, chunks, files ---- */

static void test_storage(void **state)
{
    static const allowed half = {2e-3, 5e-4, 5e-4}; /* 11 bits of depth and normal */
    static const capture_form forms[] = {
        {.name = "scanlines, raw"},
        {.name = "scanlines, ZIP", .compression = RL_EXR_ZIP},
        {.name = "scanlines, PIZ", .compression = RL_EXR_PIZ},
        {.name = "tiles of 16, ZIP", .tile = 16, .compression = RL_EXR_ZIP},
        {.name = "tiles of 32, raw", .tile = 32},
        {.name = "a file a layer", .files = FILES_LAYERS, .compression = RL_EXR_ZIPS},
        {.name = "parts by name", .files = FILES_PARTS, .compression = RL_EXR_ZIP},
        {.name = "tiled parts by name", .files = FILES_PARTS, .tile = 16, .compression = RL_EXR_RLE},
        {.name = "half", .pixel = RL_EXR_HALF, .compression = RL_EXR_ZIP},
        {.name = "half tiles, half stencil", .pixel = RL_EXR_HALF, .stencil = RL_EXR_HALF, .tile = 24},
        {.name = "float stencil", .stencil = RL_EXR_FLOAT},
    };
    (void)state;
    uint64_t first = 0;
    for (size_t i = 0; i < sizeof forms / sizeof *forms; i++) {
        bool exact = forms[i].pixel != RL_EXR_HALF;
        uint64_t sum = expect_default(&forms[i], exact ? full : half);
        first = i ? first : sum;
        assert_true(!exact || sum == first); /* nothing is lost: the same bits */
    }
}

static void test_windows(void **state)
{
    static const int windows[][8] = {
        {-9, -5, 61, 40, 0, 0, 72, 48},     /* beyond the upper left */
        {7, 11, 53, 31, 0, 0, 72, 48},      /* inside */
        {100, 50, 72, 48, 100, 50, 72, 48}, /* both off the origin */
        {-40, -30, 90, 70, -20, -10, 72, 48},
    };
    (void)state;
    for (size_t i = 0; i < sizeof windows / sizeof *windows; i++) {
        scene_camera c = scene_camera_default();
        memcpy(c.data, windows[i], sizeof c.data);
        memcpy(c.display, windows[i] + 4, sizeof c.display);
        char name[64];
        snprintf(name, sizeof name, "data window %d,%d %dx%d", c.data[0], c.data[1], c.data[2], c.data[3]);
        capture_form f = {.name = name, .compression = RL_EXR_ZIP, .tile = i == 1 ? 16 : 0};
        expect_scene(&f, &c, full);
        f.files = FILES_PARTS;
        f.depth = DEPTH_RADIAL; /* the ray of a pixel depends on the window */
        expect_scene(&f, &c, full);
    }
}

/* ---- depth and units ---- */

static void test_depth(void **state)
{
    static const allowed device = {8e-6, 4e-6, 4e-7};   /* 1/z from 24 bits near 1 */
    static const allowed reversed = {2e-6, 4e-7, 4e-7}; /* the float's exponent follows 1/z */
    static const allowed millimetre = {2e-3, 2e-4, 4e-7};
    const struct {
        capture_form form;
        allowed most;
    } all[] = {
        {{.name = "planar, empty 1e10", .empty = 1e10, .empty_key = "1e10"}, full},
        {{.name = "planar, empty inf", .empty = INFINITY}, full},
        {{.name = "planar, empty 0"}, full},
        {{.name = "planar, empty -1", .empty = -1}, full},
        {{.name = "planar, empty 1000, said 500", .empty = 1000, .empty_key = "500"}, full},
        {{.name = "radial, empty inf", .depth = DEPTH_RADIAL, .empty = INFINITY}, full},
        {{.name = "radial, empty 1e10", .depth = DEPTH_RADIAL, .empty = 1e10, .empty_key = "1e10"}, full},
        {{.name = "device", .depth = DEPTH_DEVICE, .near = 0.1, .far = 50, .empty = 1}, device},
        {{.name = "device, far at infinity", .depth = DEPTH_DEVICE, .near = 0.1, .far = INFINITY, .empty = 1},
         device},
        {{.name = "device, reversed", .depth = DEPTH_DEVICE, .near = 0.1, .far = 50, .reversed = true},
         reversed},
        {{.name = "device, reversed, infinite",
          .depth = DEPTH_DEVICE,
          .near = 0.1,
          .far = INFINITY,
          .reversed = true},
         reversed},
        {{.name = "device in cm",
          .depth = DEPTH_DEVICE,
          .near = 0.1,
          .far = 50,
          .reversed = true,
          .unit = "cm",
          .metres = 0.01},
         reversed},
        {{.name = "uint millimetres", .depth_uint = true, .unit = "mm", .metres = 0.001}, millimetre},
    };
    (void)state;
    for (size_t i = 0; i < sizeof all / sizeof *all; i++)
        expect_default(&all[i].form, all[i].most);
}

static void test_units(void **state)
{
    static const capture_form forms[] = {
        {.name = "centimetres", .unit = "cm", .metres = 0.01},
        {.name = "millimetres", .unit = "mm", .metres = 0.001, .depth = DEPTH_RADIAL},
        {.name = "feet",
         .unit = "0.3048",
         .metres = 0.3048,
         .camera = CAMERA_MANIFEST,
         .empty = 1e10,
         .empty_key = "1e10"},
        {.name = "centimetres, forward +z", .unit = "cm", .metres = 0.01, .forward_z = true},
        {.name = "thickness as a texture", .remap = {0.005, 0.05}},
        {.name = "the same in millimetres", .unit = "mm", .metres = 0.001, .remap = {5, 50}},
    };
    (void)state;
    for (size_t i = 0; i < sizeof forms / sizeof *forms; i++)
        expect_default(&forms[i], full);
}

/* ---- normals and cameras ---- */

static void test_normals(void **state)
{
    static const char *const words[] = {"signed", "unsigned", "octahedral"};
    (void)state;
    for (int i = 0; i < 12; i++) {
        char name[64];
        capture_form f = {.name = name,
                          .normal = (capture_normal)(i % 3),
                          .normal_camera = i / 3 % 2,
                          .forward_z = i / 6,
                          .files = i % 2 ? FILES_LAYERS : FILES_ONE};
        snprintf(name, sizeof name, "%s %s, forward %s", f.normal_camera ? "camera" : "world", words[i % 3],
                 f.forward_z ? "+z" : "-z");
        expect_default(&f, full);
    }
}

static void test_cameras(void **state)
{
    static const capture_form forms[] = {
        {.name = "matrix and fov in the header"},
        {.name = "screen window", .fov = FOV_WINDOW},
        {.name = "matrix in the manifest", .camera = CAMERA_MANIFEST},
        {.name = "fov in the manifest", .fov = FOV_MANIFEST},
        {.name = "all in the manifest",
         .camera = CAMERA_MANIFEST,
         .fov = FOV_MANIFEST,
         .jitter_in_manifest = true},
        {.name = "lists of one", .camera = CAMERA_LIST, .fov = FOV_LIST, .forward_z = true},
    };
    (void)state;
    for (size_t i = 0; i < sizeof forms / sizeof *forms; i++) {
        for (int lens = 0; lens < 5; lens++) {
            char name[64];
            scene_camera c = scene_camera_default();
            capture_form f = forms[i];
            snprintf(name, sizeof name, "%.34s, lens %d", f.name, lens);
            f.name = name;
            f.depth = lens % 2 ? DEPTH_RADIAL : DEPTH_PLANAR;
            if (lens == 1 || lens == 4) { /* shift */
                c.center[0] = 0.21;
                c.center[1] = -0.13;
            }
            if (lens == 2 || lens == 4)
                c.aspect = 1.5;
            if (lens == 3 || lens == 4) {
                c.jitter[0] = 0.3125;
                c.jitter[1] = -0.4375;
            }
            expect_scene(&f, &c, full);
        }
    }
}

/* ---- motion, ids, colours ---- */

static void test_motion(void **state)
{
    static const char *const words[] = {"pixels", "uv", "ndc"};
    (void)state;
    for (int i = 0; i < 12; i++) {
        char name[64];
        scene_camera c = scene_camera_default();
        const int window[4] = {-9, 5, 50, 30}; /* uv and ndc are fractions of the display window */
        memcpy(c.data, window, sizeof window);
        capture_form f = {
            .name = name, .motion = (capture_motion)(i % 3), .motion_next = i / 3 % 2, .motion_up = i / 6};
        snprintf(name, sizeof name, "motion %s %s %s", words[i % 3], f.motion_next ? "next" : "previous",
                 f.motion_up ? "up" : "down");
        expect_scene(&f, &c, full);
    }
}

static void test_ids(void **state)
{
    static const uint32_t big[4] = {0, 4294967295u, 2147483648u, 4026531841u},
                          negative[4] = {0, (uint32_t)-1, (uint32_t)-300, 70000},
                          small[4] = {7, 7, 2048, 0}; /* an id of empty pixels, shared; id 0 as a material */
    const capture_form forms[] = {
        {.name = "32-bit ids", .ids = big},
        {.name = "negative float ids", .ids = negative, .stencil = RL_EXR_FLOAT},
        {.name = "half ids", .ids = small, .stencil = RL_EXR_HALF},
        {.name = "uint ids, 0 a material", .ids = small},
    };
    (void)state;
    for (size_t i = 0; i < sizeof forms / sizeof *forms; i++)
        expect_default(&forms[i], full);
}

static void encode_srgb(const double in[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = in[i] <= 0.0031308 ? 12.92 * in[i] : 1.055 * pow(in[i], 1 / 2.4) - 0.055;
}

/* Linear Rec.709 to AP1, Bradford from D65 to the white of ACES (S-2014-004 and the CIE's Rec.709, to 10
 * digits). */
static const double to_ap1[9] = {0.6130974024, 0.3395231462, 0.0473794514, 0.0701937225, 0.9163538791,
                                 0.0134523985, 0.0206155929, 0.1095697729, 0.8698146342};

static void encode_acescg(const double in[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = to_ap1[3 * i] * in[0] + to_ap1[3 * i + 1] * in[1] + to_ap1[3 * i + 2] * in[2];
}

static void test_albedo_spaces(void **state)
{
    static const allowed matrix = {4e-6, 2e-7, 4e-7};
    static const capture_form forms[] = {
        {.name = "albedo in ACEScg", .colorspace = "ACEScg", .encode = encode_acescg},
        {.name = "albedo as sRGB texture", .colorspace = "srgb_texture", .encode = encode_srgb},
        {.name = "by an alias, tiled parts",
         .colorspace = "sRGB",
         .encode = encode_srgb,
         .files = FILES_PARTS,
         .tile = 16},
    };
    (void)state;
    for (size_t i = 0; i < sizeof forms / sizeof *forms; i++)
        expect_default(&forms[i], matrix);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_storage), cmocka_unit_test(test_windows), cmocka_unit_test(test_depth),
        cmocka_unit_test(test_units),   cmocka_unit_test(test_normals), cmocka_unit_test(test_cameras),
        cmocka_unit_test(test_motion),  cmocka_unit_test(test_ids),     cmocka_unit_test(test_albedo_spaces),
    };
    return cmocka_run_group_tests(tests, capture_setup, capture_teardown);
}
