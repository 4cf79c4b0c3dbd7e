/* Capture manifests, lights and presets. */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/model/manifest.h"

#define PRESETS "configs/presets"

static rl_arena arena;
static rl_error err;
static char message[2300], notes[2000];

static void note(void *ctx, rl_severity severity, rl_where where, const char *text)
{
    (void)ctx;
    (void)where;
    size_t n = strlen(notes);
    snprintf(notes + n, sizeof notes - n, "%d %s\n", severity, text);
}
static const rl_log log_ = {.sink = note};

static int reset(void **state)
{
    (void)state;
    rl_arena_free(&arena);
    rl_alloc_fail_at(0, 0);
    err = (rl_error){0};
    notes[0] = 0;
    return 0;
}

static rl_code try_parse(const char *text, rl_manifest **m)
{
    rl_value *v;
    *m = NULL;
    err = (rl_error){0};
    rl_code code = rl_yaml_parse(&arena, text, strlen(text), "shots/capture.yaml", &v, &err);
    return code ? code : rl_manifest_parse(&arena, v, PRESETS, &log_, m, &err);
}

static rl_manifest *parse(const char *text)
{
    rl_manifest *m;
    if (try_parse(text, &m)) {
        rl_error_format(&err, message, sizeof message);
        fail_msg("%s\n%s", message, text);
    }
    return m;
}

static void assert_message(const char *expected)
{
    rl_error_format(&err, message, sizeof message);
    assert_string_equal(message, expected);
    err = (rl_error){0};
}

static const char whole[] =
    "relit_capture: 1\n"
    "name: monkey\n"
    "description: 'a head'\n"
    "license: CC0-1.0\n"
    "files: monkey.####.exr\n"
    "frames: 1-8\n"
    "fps: 24000/1001\n"
    "unit: cm\n"
    "camera:\n"
    "  matrix: header\n"
    "  forward: -z\n"
    "  fov_x: header\n"
    "  jitter: header\n"
    "layers:\n"
    "  albedo:    {channels: [albedo.R, albedo.G, albedo.B], colorspace: ACEScg}\n"
    "  normal:    {channels: [normal.X, normal.Y], space: camera, encoding: octahedral, part: geo}\n"
    "  depth:     {channels: depth.Z, kind: planar, empty: 1e10, unit: m}\n"
    "  stencil:   {channels: [stencil.ID]}\n"
    "  thickness: {channels: [thickness.T], remap: [0, 5], unit: mm}\n"
    "  roughness: roughness.R\n"
    "  curvature: {channels: [curvature.V]}\n"
    "  motion:    {channels: [motion.X, motion.Y], unit: ndc, points: next, y: up}\n"
    "  shadow:           {key: shadow.key, rim: {channels: [s.rim], part: lights}}\n"
    "  shadow_thickness: {key: shadow_thickness.key, rim: {channels: t.rim, unit: 0.5}}\n"
    "lights:\n"
    "  key: {type: point, position: [-50, -52, 47], intensity: [2.2, 2.024, 1.804]}\n"
    "  rim: {type: spot, position: [1, 2, 3], direction: [0, 0, -2], angle: 40, blend: 0.25, lumen: 800,\n"
    "        color: [1, 0.5, 0.25], exposure: -1, space: camera, shadow: none, enabled: false, efficacy: "
    "100}\n"
    "  sun: {type: directional, direction: [0, 3, 4], lux: 683, colorspace: ACEScg, shadow: key}\n"
    "stencil_names: {1: skin, 0xfffffffe: wax, -3: leaf, 010: ten}\n"
    "cuts: [5, 3]\n";

static void test_whole(void **state)
{
    (void)state;
    const rl_manifest *m = parse(whole);
    assert_string_equal(notes, "");
    assert_string_equal(m->name, "monkey");
    assert_string_equal(m->license, "CC0-1.0");
    assert_true(m->unit == 0.01 && fabs(m->fps - 23.976023976) < 1e-8);
    assert_int_equal(m->frames.n, 8);
    assert_int_equal(m->n_layers, 12);
    assert_int_equal(m->cuts.n, 2);
    assert_int_equal(m->cuts.numbers[0], 3);
    const rl_layer *l = rl_manifest_layer(m, "normal");
    assert_true(l->n_channels == 2 && l->space == RL_SPACE_CAMERA && l->encoding == RL_ENCODING_OCTAHEDRAL);
    assert_string_equal(l->part, "geo");
    l = rl_manifest_layer(m, "albedo");
    assert_true(l->n_channels == 3 && l->n_alternatives == 1);
    assert_string_equal(l->channels[2], "albedo.B");
    assert_string_equal(l->colorspace, "ACEScg");
    l = rl_manifest_layer(m, "depth");
    assert_true(l->kind == RL_DEPTH_PLANAR && l->empty == 1e10 && l->scale == 1);
    l = rl_manifest_layer(m, "thickness");
    assert_true(l->remapped && l->remap[1] == 5 && l->scale == 0.001);
    assert_true(rl_manifest_layer(m, "curvature")->scale == 100); /* 1/cm is 100/m */
    l = rl_manifest_layer(m, "motion");
    assert_true(l->motion_unit == RL_MOTION_NDC && l->points_next && l->y_up);
    l = rl_manifest_layer(m, "shadow.rim");
    assert_string_equal(l->light, "rim");
    assert_string_equal(l->channels[0], "s.rim");
    assert_string_equal(l->part, "lights");
    assert_true(rl_manifest_layer(m, "shadow_thickness.rim")->scale == 0.5);
    assert_true(rl_manifest_layer(m, "shadow_thickness.key")->scale == 0.01);
    assert_null(rl_manifest_layer(m, "shadow.fill"));
    assert_string_equal(rl_manifest_stencil_name(m, 0xfffffffeu), "wax");
    assert_string_equal(rl_manifest_stencil_name(m, (uint32_t)-3), "leaf");
    assert_string_equal(rl_manifest_stencil_name(m, 10), "ten");
    assert_null(rl_manifest_stencil_name(m, 2));
    uint32_t id = 0;
    assert_true(rl_manifest_stencil_id(m, "skin", &id) && id == 1);
    assert_false(rl_manifest_stencil_id(m, "skim", &id));
    assert_string_equal(rl_manifest_path(&arena, m, l, 7), "shots/monkey.0007.exr");
}

static void test_print_reads_back(void **state)
{
    (void)state;
    rl_manifest *m = parse(whole);
    rl_str once = {0}, twice = {0};
    rl_manifest_print(m, &once);
    rl_manifest *back;
    rl_value *v;
    assert_int_equal(rl_yaml_parse(&arena, rl_str_text(&once), once.length, "x.yaml", &v, &err), RL_OK);
    if (rl_manifest_parse(&arena, v, NULL, &log_, &back, &err))
        fail_msg("%d: %s\n%s", err.line, err.text, rl_str_text(&once));
    assert_string_equal(notes, "");
    rl_manifest_print(back, &twice);
    assert_string_equal(rl_str_text(&once), rl_str_text(&twice));
    assert_non_null(strstr(once.text, "thickness: {channels: [thickness.T], unit: 0.001, remap: [0, 5]}"));
    assert_non_null(strstr(once.text, "    key: shadow.key\n"));
    assert_non_null(strstr(once.text,
                           "angle: 40, blend: 0.25, lumen: [800, 400, 200], efficacy: 100, exposure: -1, "
                           "space: camera, enabled: false, shadow: none}"));
    assert_non_null(strstr(once.text, "position: [-50, -52, 47]"));
    for (int i = 0; i < m->n_layers; i++) {
        const rl_layer *a = &m->layers[i], *b = rl_manifest_layer(back, a->name);
        assert_true(a->scale == b->scale && a->kind == b->kind && a->n_channels == b->n_channels);
    }
    rl_str_free(&once);
    rl_str_free(&twice);
}

/* The least that a capture needs, with what is wrong or new in it. */
static const char layers[] = "layers:\n"
                             "  albedo: {channels: [R, G, B], colorspace: lin_rec709}\n"
                             "  normal: {channels: [N.X, N.Y, N.Z], space: world, encoding: signed}\n"
                             "  depth: {channels: [Z], kind: planar}\n"
                             "  stencil: {channels: [ID]}\n";

static char *with(const char *format, ...)
{
    char *text = rl_arena_alloc(&arena, 4096);
    va_list args;
    va_start(args, format);
    vsnprintf(text, 4096, format, args);
    va_end(args);
    return text;
}

static void refuse(const char *text, const char *expected)
{
    rl_manifest *m;
    assert_int_equal(try_parse(text, &m), RL_E_CONFIG);
    assert_null(m);
    assert_message(expected);
}

static void test_defaults_are_noted(void **state)
{
    (void)state;
    const rl_manifest *m =
        parse("{files: a_0003.exr, layers: {albedo: [R, G, B], normal: [X, Y, Z], depth: Z, "
              "stencil: I, motion: [u, v]}}");
    assert_string_equal(m->name, "a");
    assert_int_equal(m->frames.n, 1);
    assert_int_equal(m->frames.numbers[0], 1);
    assert_true(m->unit == 1 && m->fps == 0);
    assert_true(isinf(rl_manifest_layer(m, "depth")->empty));
    assert_string_equal(notes, "0 the capture's 'unit' is not given; assuming metres\n"
                               "0 camera: 'forward' is not given; assuming -z\n"
                               "0 layer 'albedo': 'colorspace' is not given; assuming lin_rec709\n"
                               "0 layer 'normal': 'space' is not given; assuming world\n"
                               "0 layer 'normal': 'encoding' is not given; assuming signed\n"
                               "0 layer 'depth': 'kind' is not given; assuming planar\n"
                               "0 layer 'motion': 'unit' is not given; assuming pixels\n"
                               "0 layer 'motion': 'points' is not given; assuming previous\n"
                               "0 layer 'motion': 'y' is not given; assuming down\n");
}

static void test_bad(void **state)
{
    (void)state;
    static const struct {
        const char *text, *expected;
    } rows[] = {
        {"relit_capture: 2\n", "1:16: error: relit_capture: 2 is not known here; this relit reads 1"},
        {"layer: {}\n",
         "1:1: error: a capture has no key 'layer'; did you mean 'layers'? known: camera, cuts, "
         "description, files, fps, frames, layers, license, lights, name, preset, relit_capture, "
         "stencil_names, unit"},
        {"files: []\n", "1:8: error: 'files': expected a path, such as shot.####.exr, found an empty list"},
        {"fps: 24fps\nfiles: a.exr\n",
         "1:6: error: 'fps': expected frames a second, such as 24 or 24000/1001, found the text '24fps'"},
        {"fps: 0\n", "1:6: error: 'fps' is 0: out of range, above 0 and at most 1e6"},
        {"unit: inch\n", "1:7: error: 'unit' cannot be 'inch'; known: cm, m, mm"},
        {"unit: -1\n", "1:7: error: 'unit' is -1: out of range, above 0"},
        {"camera: {forwards: -z}\n",
         "1:10: error: camera has no key 'forwards'; did you mean 'forward'? known: "
         "forward, fov_x, jitter, matrix, shift"},
        {"camera: {forward: z}\n", "1:19: error: 'forward' cannot be 'z'; did you mean '-z'? known: "
                                   "+z, -z"},
        {"camera: {fov_x: 180}\n", "1:17: error: 'fov_x' is 180: out of range, 0.001 to 179.9"},
        {"camera: {fov_x: wide}\n",
         "1:17: error: 'fov_x': expected header, degrees, or a list of degrees, found the text 'wide'"},
        {"camera: {matrix: [1, 2]}\n",
         "1:18: error: 'matrix': expected a list of 16 numbers, found a list of 2"},
        {"camera: {matrix: [1,0,0,0, 0,1,0,0, 0,0,1,0, 3,4,5,1]}\n",
         "1:18: error: 'matrix': the last row must be 0, 0, 0, 1 (rows listed, for column vectors; a matrix "
         "for row "
         "vectors is the transpose)"},
        {"camera: {matrix: [1,0,0,0, 0,2,0,0, 0,0,1,0, 0,0,0,1]}\n",
         "1:18: error: 'matrix' must rotate and shift only: rows 2 and 2 of its 3x3 have the dot product 4"},
        {"camera: {jitter: 0.5}\n",
         "1:18: error: 'jitter': expected header, [x, y], or a list of such pairs, found the number '0.5'"},
        {"files: a.exr\nframes: 8-1\n", "2:9: error: frames '8-1': 8-1 runs backwards"},
        {"files: a.exr\nframes: {}\n",
         "2:9: error: 'frames': expected frames, such as 1-24 or [1, 5, 9], found an empty map"},
        {"files: a.exr\nframes: []\n", "1:1: error: the capture has no frames"},
        {"files: a.exr\nname: a/b\n", "2:7: error: 'name' becomes part of file names: no '/', not empty"},
        {"files: {albedo: a.exr}\n",
         "1:8: error: files: no file is given for layer 'normal' (nor a default)"},
        {"files: {default: a.exr, depht: b.exr}\n", "1:25: error: files: the capture has no layer 'depht'; "
                                                    "did you mean 'depth'? known: albedo, default, depth, "
                                                    "normal, stencil"},
        {"files: a.exr\nframes: 1-3\ncamera: {fov_x: [30, 40]}\n",
         "3:9: error: camera: 'fov_x' lists 2, but the capture has 3 frames"},
        {"files: a.exr\nstencil_names: {x: skin}\n", "2:17: error: stencil_names: 'x' is no 32-bit integer"},
        {"files: a.exr\nstencil_names: {4294967296: skin}\n",
         "2:17: error: stencil_names: '4294967296' is no 32-bit integer"},
        {"files: a.exr\nstencil_names: {1: skin, 0x1: wax}\n",
         "2:26: error: stencil_names: the id 0x1 is named twice"},
        {"preset: blander\n",
         "1:9: error: there is no preset 'blander'; did you mean 'blender'? known: arnold, "
         "arnold_cryptomatte, blender, blender_cryptomatte, pbrt, relit, unreal, vray"},
        {"preset: ../presets/blender\n",
         "1:9: error: there is no preset '../presets/blender'; known: arnold, arnold_cryptomatte, blender, "
         "blender_cryptomatte, pbrt, relit, unreal, vray"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        refuse(with("%s%s", rows[i].text, layers), with("shots/capture.yaml:%s", rows[i].expected));
    refuse("files: a.exr\n", "shots/capture.yaml:1:1: error: a capture needs 'layers' (or a 'preset')");
    refuse(layers, "shots/capture.yaml:1:1: error: a capture needs 'files', such as shot.####.exr");
    refuse("files: a.exr\nlayers: {albedo: [R, G, B]}\n",
           "shots/capture.yaml:1:1: error: a capture needs the layer 'normal' (unit shading normal)");
    refuse("[1]", "shots/capture.yaml:1:1: error: a capture: expected a map, found a list of 1");
}

static void test_bad_layers(void **state)
{
    (void)state;
    static const struct {
        const char *text, *expected;
    } rows[] = {
        {"thicknes: T",
         "there is no layer 'thicknes'; did you mean 'thickness'? known: albedo, back_albedo, "
         "back_depth, back_normal, curvature, depth, emission, metallic, motion, normal, roughness, "
         "shadow, shadow_thickness, specular, stencil, thickness"},
        {"thickness: {chanels: [T]}",
         "layer 'thickness' has no key 'chanels'; did you mean 'channels'? known: "
         "channels, part, remap, unit"},
        {"thickness: {unit: m}", "layer 'thickness' needs 'channels'"},
        {"thickness: [a, b]", "layer 'thickness': expected a list of 1 channel name"},
        {"thickness: {channels: T, remap: [5, 1]}", "'remap' must be [min, max] with 0 <= min < max"},
        {"emission: [a, b]", "layer 'emission': expected a list of 3 channel names"},
        {"emission: [a, [b], c]", "'channels': expected the name of a channel, found a list of 1"},
        {"back_depth: {channels: D, kind: z}", "'kind' cannot be 'z'; known: device, planar, radial"},
        {"back_depth: {channels: D, kind: device, near: 1}",
         "layer 'back_depth': device depth needs 'near' and 'far'"},
        {"back_depth: {channels: D, kind: device, near: 2, far: 2}",
         "'far' is 2, but must be beyond 'near', which is 2"},
        {"back_depth: {channels: D, kind: device, near: 0, far: 2}", "'near' is 0: out of range, above 0"},
        {"back_depth: {channels: D, kind: radial, near: 2}",
         "layer 'back_depth': 'near' belongs to `kind: device`"},
        {"back_depth: {channels: D, empty: .nan}", "'empty' is .nan: a number is needed"},
        {"back_normal: {channels: [a, b, c], space: view}", "'space' cannot be 'view'; known: camera, world"},
        {"back_normal: {channels: [a, b, c], encoding: octahedral}",
         "layer 'back_normal': expected a list of 2 channel names"},
        {"motion: {channels: [a, b], unit: metres}", "'unit' cannot be 'metres'; known: ndc, pixels, uv"},
        {"shadow: shadow.key", "'shadow': expected a map, light: channel, found the text 'shadow.key'"},
        {"shadow: {key: [a, b]}", "layer 'shadow.key': expected a list of 1 channel name"},
        {"roughness: {channels: R, unit: m}", "layer 'roughness' has no key 'unit'; known: channels, part"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        rl_manifest *m;
        assert_int_equal(try_parse(with("files: a.exr\n%s  %s\n", layers, rows[i].text), &m), RL_E_CONFIG);
        assert_string_equal(err.text, rows[i].expected);
        assert_int_equal(err.line, 7);
        assert_true(err.column > 2);
    }
}

/* ---- depth, camera ---- */

static void test_depth(void **state)
{
    (void)state;
    rl_layer l = {.kind = RL_DEPTH_RADIAL, .scale = 0.01, .empty = 1e4};
    assert_true(fabs(rl_layer_depth(&l, 250, 1.25) - 2) < 1e-15);
    assert_true(rl_layer_is_empty(&l, 1e4) && rl_layer_is_empty(&l, 0) && rl_layer_is_empty(&l, -1));
    assert_true(rl_layer_is_empty(&l, NAN) && rl_layer_is_empty(&l, INFINITY) &&
                !rl_layer_is_empty(&l, 9999));
    const rl_manifest *m =
        parse(with("files: a.exr\nunit: cm\n%s  back_depth: {channels: D, kind: device, near: 10, "
                   "far: 1000, reversed: true}\n",
                   layers));
    l = *rl_manifest_layer(m, "back_depth");
    /* a projection matrix of near n, far f maps z to f(z - n)/(z(f - n)) */
    for (double z = 0.1; z < 10; z *= 1.3) {
        double d = 10 * (z - 0.1) / (z * 9.9);
        assert_true(fabs(rl_layer_depth(&l, 1 - d, 1) / z - 1) < 1e-12);
        l.reversed = false;
        assert_true(fabs(rl_layer_depth(&l, d, 1) / z - 1) < 1e-12);
        l.reversed = true;
    }
    assert_true(rl_layer_is_empty(&l, 0) && !rl_layer_is_empty(&l, 1e-6) && !rl_layer_is_empty(&l, 1));
    m = parse(
        with("files: a.exr\n%s  back_depth: {channels: D, kind: device, near: 0.5, far: .inf}\n", layers));
    l = *rl_manifest_layer(m, "back_depth");
    assert_true(fabs(rl_layer_depth(&l, 0.75, 1) - 2) < 1e-12 && rl_layer_is_empty(&l, 1));
}

static void test_camera(void **state)
{
    (void)state;
    double out[12];
    /* header: row vectors, so the shift is the last row; in cm; looking down +z */
    const float header[16] = {0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 10, 20, 30, 1};
    const rl_manifest *m =
        parse(with("files: a.exr\nframes: 1-2\nunit: cm\ncamera: {forward: +z, fov_x: [60, 90], "
                   "jitter: [[0.25, -0.5], [0, 0]]}\n%s",
                   layers));
    assert_int_equal(rl_manifest_view(m, 1, header, out, &err), RL_OK);
    static const double expected[12] = {0, 1, 0, 0.1, 0, 0, 1, 0.2, -1, 0, 0, -0.3};
    for (int i = 0; i < 12; i++)
        assert_true(fabs(out[i] - expected[i]) < 1e-15);
    assert_true(fabs(*rl_manifest_fov_x(m, 2) - 1.5707963267948966) < 1e-15);
    assert_true(rl_manifest_jitter(m, 1)[1] == -0.5 && rl_manifest_jitter(m, 2)[0] == 0);
    assert_int_equal(rl_manifest_view(m, 1, NULL, out, &err), RL_E_FORMAT);
    assert_message("shots/capture.yaml:4:9: error: frame 1: the file has no attribute worldToCamera; give "
                   "camera.matrix: 16 numbers, world to camera, rows listed, for column vectors (how to get "
                   "them: configs/captures.md)");
    float scaled[16], transposed[16];
    for (int i = 0; i < 16; i++) {
        scaled[i] = i < 12 ? header[i] * 0.01f : header[i];
        transposed[i] = header[4 * (i % 4) + i / 4];
    }
    assert_int_equal(rl_manifest_view(m, 2, scaled, out, &err), RL_E_FORMAT);
    assert_non_null(
        strstr(err.text, "frame 2: worldToCamera (as column vectors) must rotate and shift only"));
    err = (rl_error){0};
    assert_int_equal(rl_manifest_view(m, 2, transposed, out, &err), RL_E_FORMAT);
    assert_non_null(strstr(err.text, "the last row must be 0, 0, 0, 1"));
    err = (rl_error){0};
    scaled[0] = NAN;
    assert_int_equal(rl_manifest_view(m, 2, scaled, out, &err), RL_E_FORMAT);
    err = (rl_error){0};
    m = parse(with("files: a.exr\nframes: 10,20\ncamera: {forward: -z, matrix: "
                   "[[1,0,0,1, 0,1,0,2, 0,0,1,3, 0,0,0,1], [1,0,0,4, 0,0,1,5, 0,-1,0,6, 0,0,0,1]]}\n%s",
                   layers));
    assert_int_equal(rl_manifest_view(m, 20, NULL, out, &err), RL_OK);
    static const double second[12] = {1, 0, 0, 4, 0, 0, 1, 5, 0, -1, 0, 6};
    assert_memory_equal(out, second, sizeof second);
    assert_null(rl_manifest_fov_x(m, 10));
    assert_null(rl_manifest_jitter(m, 10));
}

/* ---- files ---- */

static char folder[64];

static int make_folder(void **state)
{
    strcpy(folder, "/tmp/relit-test-XXXXXX");
    return reset(state) || !mkdtemp(folder);
}

static int drop_folder(void **state)
{
    char command[96];
    snprintf(command, sizeof command, "rm -r %s", folder);
    return reset(state) || system(command);
}

static void put(const char *name, const char *text)
{
    char path[128];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    assert_int_equal(rl_file_write(path, text, strlen(text), &err), RL_OK);
}

static void assert_frames(const rl_manifest *m, const char *expected)
{
    rl_str s = {0};
    rl_frames_print(&m->frames, &s);
    assert_string_equal(rl_str_text(&s), expected);
    rl_str_free(&s);
}

static void test_found_frames(void **state)
{
    (void)state;
    rl_manifest *m;
    static const char *const names[] = {"a.0001.exr", "a.0002.exr",     "a.0004.exr",  "a.10000.exr",
                                        "a.-001.exr", "a.1.exr",        "a.00003.exr", "a.x.exr",
                                        "b.0009.exr", "a.0007.exr.tmp", "z.5.exr",     "a..exr",
                                        "a.0x12.exr", "a.+005.exr"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        put(names[i], "");
    put("capture.yaml", with("files: a.####.exr\n%s", layers));
    assert_int_equal(rl_manifest_load(&arena, folder, NULL, NULL, &m, &err), RL_OK);
    assert_frames(m, "-1,1,2,4,10000");
    assert_string_equal(rl_path_name(rl_manifest_path(&arena, m, m->layers, -1)), "a.-001.exr");
    assert_string_equal(rl_path_name(rl_manifest_path(&arena, m, m->layers, 12345)), "a.12345.exr");
    assert_string_equal(m->name, "a");
    assert_true(m->frames_found);
    put("capture.yaml",
        with("files: {default: a.%%04d.exr, depth: z.%%d.exr, stencil: b.####.exr}\n%s", layers));
    assert_int_equal(rl_manifest_load(&arena, folder, NULL, NULL, &m, &err), RL_OK);
    assert_frames(m, "-1,1,2,4,5,9,10000");
    const char *path = rl_manifest_path(&arena, m, rl_manifest_layer(m, "depth"), 5);
    assert_string_equal(rl_path_name(path), "z.5.exr");
    assert_true(rl_path_exists(path));
    assert_string_equal(rl_path_name(rl_manifest_path(&arena, m, rl_manifest_layer(m, "normal"), 5)),
                        "a.0005.exr");
    put("capture.yaml", with("files: c.####.exr\n%s", layers));
    assert_int_equal(rl_manifest_load(&arena, folder, NULL, NULL, &m, &err), RL_E_CONFIG);
    assert_string_equal(err.text, with("no file matches '%s/c.####.exr'", folder));
    put("capture.yaml", with("files: no/c.####.exr\n%s", layers));
    err = (rl_error){0};
    assert_int_equal(rl_manifest_load(&arena, folder, NULL, NULL, &m, &err), RL_E_CONFIG);
    assert_string_equal(err.text,
                        with("the folder '%s/no' cannot be read: No such file or directory", folder));
    put("capture.yaml", with("files: d.####/c.####.exr\n%s", layers));
    err = (rl_error){0};
    assert_int_equal(rl_manifest_load(&arena, folder, NULL, NULL, &m, &err), RL_E_CONFIG);
    assert_string_equal(err.text, "frame numbers in the folder's name: give 'frames' too");
    put("capture.yaml", with("files: d.##/c.####.exr\nframes: 3\n%s", layers));
    assert_int_equal(rl_manifest_load(&arena, folder, NULL, NULL, &m, &err), RL_OK);
    assert_string_equal(rl_manifest_path(&arena, m, m->layers, 3), with("%s/d.03/c.0003.exr", folder));
}

static void test_names_from_files(void **state)
{
    (void)state;
    static const char *const rows[][2] = {
        {"monkey.####.exr", "monkey"}, {"shots/a_%04d.exr", "a"}, {"x.exr", "x"},
        {"monkey.0001.exr", "monkey"}, {"take2.exr", "take2"},    {"####.exr", "capture"},
        {"a.b-####.left.exr", "a.b"},  {"/abs/q####.exr", "q"},   {"100%d.exr", "100"},
        {"100%.exr", "100%"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        assert_string_equal(parse(with("files: '%s'\nframes: 1\n%s", rows[i][0], layers))->name, rows[i][1]);
    const rl_manifest *m = parse(with("files: {default: /abs/a.exr}\n%s", layers));
    assert_string_equal(rl_manifest_path(&arena, m, m->layers, 99), "/abs/a.exr");
}

/* ---- lights ---- */

static void test_lights(void **state)
{
    (void)state;
    double i[3], inner, outer;
    const double pi = 3.14159265358979323846;
    const rl_manifest *m = parse(whole);
    const rl_light_spec *key = &m->lights.light[0], *rim = key + 1, *sun = key + 2;
    assert_int_equal(m->lights.n, 3);
    assert_true(key->type == RL_LIGHT_POINT && key->enabled && key->shadow == RL_SHADOW_LAYER &&
                !key->shadow_named);
    assert_string_equal(key->shadow_layer, "key");
    assert_true(fabs(key->position_m[0] + 0.5) < 1e-15 && fabs(key->position_m[2] - 0.47) < 1e-15);
    rl_light_resolve(key, i);
    assert_true(i[0] == 2.2 && i[1] == 2.024 && i[2] == 1.804);
    assert_true(!rim->enabled && rim->in_camera_space && rim->shadow == RL_SHADOW_NONE &&
                rim->direction[2] == -1);
    rl_light_resolve(rim, i);
    double omega = 2 * pi * (1 - cos(20 * pi / 180));
    assert_true(fabs(i[0] / (800 / omega / 100 / 2) - 1) < 1e-12 && fabs(i[2] / i[0] - 0.25) < 1e-15);
    rl_light_cone(rim, &inner, &outer);
    assert_true(fabs(acos(outer) * 180 / pi - 20) < 1e-9 && fabs(acos(inner) * 180 / pi - 15) < 1e-9);
    rl_light_resolve(sun, i);
    assert_true(fabs(i[1] - 1) < 1e-15 && sun->direction[1] == 0.6 && sun->shadow_named);
    m = parse(
        with("files: a.exr\n%slights: {a: {type: point, position: [0, 0, 1], lumen: 8583}, b: {type: spot, "
             "position: [0, 0, 1], direction: [1, 0, 0], angle: 90, candela: 1366, shadow: screen}}\n",
             layers));
    rl_light_resolve(&m->lights.light[0], i);
    assert_true(fabs(i[0] - 8583 / (4 * pi * 683)) < 1e-12);
    rl_light_resolve(&m->lights.light[1], i);
    assert_true(fabs(i[0] - 2) < 1e-12 && m->lights.light[1].shadow == RL_SHADOW_SCREEN);
}

/* What area lights have comes back as it was, in the capture's unit. */
static void test_print_shapes(void **state)
{
    (void)state;
    rl_manifest *m =
        parse(with("files: a.exr\nunit: cm\n%slights: {"
                   "a: {type: sphere, position: [0, 0, 1], radius: 3, radiance: 2}, b: {type: rect, "
                   "position: [0, 0, 1], direction: [0, 1, 0], width: 4, height: 5, two_sided: true, "
                   "lumen: 7}}\n",
                   layers));
    rl_str text = {0};
    rl_manifest_print(m, &text);
    assert_non_null(
        strstr(text.text, "a: {type: sphere, position: [0, 0, 1], radius: 3, radiance: [2, 2, 2]}"));
    assert_non_null(strstr(text.text,
                           "b: {type: rect, position: [0, 0, 1], direction: [0, 1, 0], width: 4, height: 5, "
                           "up: [0, 0, 1], two_sided: true, lumen: [7, 7, 7]}"));
    rl_str_free(&text);
}

static void test_bad_lights(void **state)
{
    (void)state;
    static const char *const rows[][2] = {
        {"{position: [0, 0, 0]}", "light 'k' needs 'type': point, spot, directional, sphere or rect"},
        {"{type: disk}", "'type' cannot be 'disk'; known: directional, point, rect, sphere, spot"},
        {"{type: point, intensity: 1}", "light 'k': a point light needs 'position'"},
        {"{type: point, position: [0, 0, 0]}", "light 'k' needs intensity, power, candela or lumen"},
        {"{type: point, position: [0, 0, 0], lux: 3}",
         "light 'k': a point light takes intensity, power, candela or lumen, not lux"},
        {"{type: point, position: [0, 0, 0], lumen: 3, candela: 2}",
         "light 'k' has both candela and lumen; give one"},
        {"{type: point, position: [0, 0, 0], intensity: -1}", "'intensity' is -1: out of range, at least 0"},
        {"{type: point, position: [0, 0, 0], intensity: [1, 2]}",
         "'intensity': expected a number or a list of 3 numbers, found a list of 2"},
        {"{type: point, position: [0, 0, 0], intensity: .inf}",
         "'intensity' is .inf: a finite number is needed"},
        {"{type: point, position: [0, 0, 0], intensity: 1, angle: 3}",
         "light 'k': a point light has no 'angle'"},
        {"{type: point, position: [0, 0, 0], intensity: 1, direction: [0, 0, 1]}",
         "light 'k': a point light has no 'direction' without 'ies'"},
        {"{type: directional, direction: [0, 0, 0], lux: 1}", "light 'k': 'direction' has no usable length"},
        {"{type: spot, position: [0, 0, 0], direction: [0, 0, 1], intensity: 1}",
         "light 'k': a spot light needs 'angle' (full, degrees)"},
        {"{type: spot, position: [0, 0, 0], direction: [0, 0, 1], angle: 180.5, intensity: 1}",
         "'angle' is 180.5: out of range, 0.01 to 180"},
        {"{type: point, positon: [0, 0, 0]}",
         "light 'k' has no key 'positon'; did you mean 'position'? "
         "known: angle, blend, candela, color, colorspace, "
         "direction, efficacy, enabled, exposure, height, ies, intensity, "
         "irradiance, lumen, luminance, lux, position, power, radiance, radius, shadow, space, "
         "temperature, tint, two_sided, type, up, width"},
        {"bright", "light 'k': expected a map, found the text 'bright'"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        rl_manifest *m;
        assert_int_equal(try_parse(with("files: a.exr\n%slights: {k: %s}\n", layers, rows[i][0]), &m),
                         RL_E_CONFIG);
        assert_string_equal(err.text, rows[i][1]);
        assert_int_equal(err.line, 7);
    }
}

/* ---- presets ---- */

static const rl_channel blender[] = {
    {NULL, "Back.Depth.Z"},
    {NULL, "Face.Combined.R"},
    {NULL, "Face.Depth.Z"},
    {NULL, "Face.DiffCol.B"},
    {NULL, "Face.DiffCol.G"},
    {NULL, "Face.DiffCol.R"},
    {NULL, "Face.Denoising Albedo.R"},
    {NULL, "Face.IndexMA.X"},
    {NULL, "Face.Normal.X"},
    {NULL, "Face.Normal.Y"},
    {NULL, "Face.Normal.Z"},
    {NULL, "Face.Vector.X"},
    {NULL, "Face.Vector.Y"},
    {NULL, "Face.Vector.Z"},
};
#define N(a) (sizeof(a) / sizeof *(a))

static void test_preset_binds(void **state)
{
    (void)state;
    rl_preset_match match;
    assert_int_equal(rl_preset_find(&arena, PRESETS, blender, N(blender), &match, &err), RL_OK);
    assert_string_equal(match.name, "blender");
    assert_int_equal(match.missing_required, 0);
    assert_int_equal(match.layers, 5);
    rl_manifest *m =
        parse("{files: shot.####.exr, frames: 1-3, preset: blender, layers: {depth: {kind: radial}}, "
              "camera: {fov_x: 36, matrix: [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]}}");
    assert_string_equal(notes, "");
    assert_int_equal(rl_manifest_bind(&arena, m, 0, "f.exr", blender, N(blender), &err), RL_OK);
    assert_string_equal(rl_manifest_layer(m, "albedo")->channels[0], "Face.DiffCol.R");
    assert_string_equal(rl_manifest_layer(m, "motion")->channels[1], "Face.Vector.Y");
    assert_string_equal(rl_manifest_layer(m, "depth")->channels[0], "Face.Depth.Z");
    assert_true(rl_manifest_layer(m, "motion")->y_up && rl_manifest_layer(m, "depth")->empty == 1e10);
    assert_int_equal(rl_manifest_layer(m, "depth")->kind, RL_DEPTH_RADIAL);
    assert_string_equal(rl_manifest_layer(m, "stencil")->channels[0], "Face.IndexMA.X");
    /* without a normal: a required layer of the preset is missed by name */
    m = parse("{files: shot.####.exr, frames: 1-3, preset: blender}");
    assert_int_equal(rl_manifest_bind(&arena, m, 0, "f.exr", blender, 8, &err), RL_E_FORMAT);
    assert_string_equal(err.file, "f.exr");
    assert_non_null(strstr(err.text,
                           "layer 'normal' needs channels '*.Normal.X', '*.Normal.Y', '*.Normal.Z'; the file "
                           "has: Back.Depth.Z Face.Combined.R"));
    assert_non_null(strstr(err.text, "(set layers.normal in capture.yaml)"));
    err = (rl_error){0};
    assert_int_equal(rl_preset_find(&arena, PRESETS, blender, 8, &match, &err), RL_OK);
    assert_string_equal(match.name, "blender");
    assert_string_equal(match.missing, "normal");
    assert_int_equal(rl_preset_find(&arena, PRESETS, blender + 1, 1, &match, &err), RL_OK);
    assert_null(match.name);
    assert_int_equal(rl_preset_find(&arena, "no/such", blender, 1, &match, &err), RL_E_IO);
}

static void test_bare_file(void **state)
{
    (void)state;
    static const rl_channel names[] = {
        {"geo", "albedo.B"},
        {"geo", "albedo.G"},
        {"geo", "albedo.R"},
        {"geo", "depth.Z"},
        {"geo", "normal.X"},
        {"geo", "normal.Y"},
        {"geo", "normal.Z"},
        {"ids", "stencil.ID"},
        {"sh", "shadow.key"},
        {"sh", "shadow.rim"},
        {"sh", "shadow_thickness.key"},
        {"x", "motion.X"},
        {"y", "motion.Y"},
    };
    rl_preset_match match;
    assert_int_equal(rl_preset_find(&arena, PRESETS, names, N(names), &match, &err), RL_OK);
    assert_string_equal(match.name, "relit");
    rl_manifest *m;
    assert_int_equal(rl_manifest_bare(&arena, "in/a.0012.exr", "relit", PRESETS, &log_, &m, &err), RL_OK);
    assert_int_equal(rl_manifest_bind(&arena, m, 0, "in/a.0012.exr", names, N(names), &err), RL_OK);
    assert_int_equal(m->n_layers, 7); /* motion is torn over two parts */
    assert_frames(m, "12");
    assert_string_equal(m->name, "a");
    assert_string_equal(rl_manifest_path(&arena, m, m->layers, 12), "in/a.0012.exr");
    assert_string_equal(rl_manifest_layer(m, "shadow.rim")->channels[0], "shadow.rim");
    assert_string_equal(rl_manifest_layer(m, "shadow_thickness.key")->light, "key");
    assert_string_equal(rl_manifest_layer(m, "stencil")->part, "ids");
    assert_string_equal(notes, "");
    /* binding is over: a second file with other channels changes nothing of the user's own layers */
    rl_manifest *own = parse(with("files: a.exr\n%s", layers));
    assert_int_equal(rl_manifest_bind(&arena, own, 0, "a.exr", names, N(names), &err), RL_OK);
    assert_string_equal(rl_manifest_layer(own, "depth")->channels[0], "Z");
    assert_int_equal(rl_layer_missing(rl_manifest_layer(own, "normal"), "a.exr", names, 2, &err),
                     RL_E_FORMAT);
    assert_message(
        "a.exr: error: layer 'normal' needs channels 'N.X', 'N.Y', 'N.Z'; the file has: geo:albedo.B "
        "geo:albedo.G (set layers.normal in capture.yaml)");
}

/* Damaged manifests give an error or a manifest, and never a crash (run under ASan). */
static void test_damage(void **state)
{
    (void)state;
    static const char alphabet[] = " \n:,-[]{}#\"'*&!0123456789.eabcxyz_~";
    unsigned random = 7;
    int good = 0;
    for (int i = 0; i < 4000; i++) {
        char text[sizeof whole];
        rl_manifest *m;
        memcpy(text, whole, sizeof whole);
        for (int k = 0; k < 1 + i % 3; k++) {
            random = random * 1664525u + 1013904223u;
            text[(random >> 8) % (sizeof whole - 1)] = alphabet[(random >> 3) % (sizeof alphabet - 1)];
        }
        rl_code code = try_parse(text, &m);
        assert_int_equal(code, err.code);
        assert_true((code == RL_OK) == (m != NULL));
        if (m) {
            rl_str s = {0};
            rl_manifest_print(m, &s);
            rl_str_free(&s);
            good++;
        } else {
            assert_true(err.line > 0 && err.text[0]);
        }
        rl_arena_free(&arena);
    }
    assert_true(good > 100);
}

static void test_failing_memory(void **state)
{
    (void)state;
    size_t before = rl_alloc_live();
    unsigned long n = 1;
    for (bool done = false; !done; n++) {
        rl_value *v;
        rl_manifest *m;
        rl_str s = {0};
        static const char text[] =
            "{files: s.####.exr, frames: 1-3, preset: blender, stencil_names: {1: a}, lights: "
            "{k: {type: point, position: [0, 0, 0], intensity: 1}}}";
        err = (rl_error){0};
        rl_alloc_fail_at(n, n % 2);
        rl_code code = rl_yaml_parse(&arena, text, sizeof text - 1, "t", &v, &err);
        if (!code)
            code = rl_manifest_parse(&arena, v, PRESETS, NULL, &m, &err);
        if (!code)
            code = rl_manifest_bind(&arena, m, 0, "f", blender, N(blender), &err);
        if (!code)
            rl_manifest_print(m, &s);
        if (!code)
            code = s.failed ? RL_E_MEMORY : RL_OK;
        rl_preset_match match;
        if (!code)
            code = rl_preset_find(&arena, PRESETS, blender, N(blender), &match, &err);
        rl_alloc_fail_at(0, 0);
        if (code && code != RL_E_MEMORY)
            fail_msg("allocation %lu: %s", n, err.text);
        done = !code;
        rl_str_free(&s);
        rl_arena_free(&arena);
        assert_int_equal(rl_alloc_live(), before);
    }
    assert_true(n > 20);
}

int main(void)
{
#define T(f) cmocka_unit_test_setup_teardown(f, reset, reset)
#define F(f) cmocka_unit_test_setup_teardown(f, make_folder, drop_folder)
    const struct CMUnitTest tests[] = {
        T(test_whole),        T(test_print_reads_back), T(test_print_shapes), T(test_defaults_are_noted),
        T(test_bad),          T(test_bad_layers),       T(test_depth),        T(test_camera),
        F(test_found_frames), T(test_names_from_files), T(test_lights),       T(test_bad_lights),
        T(test_preset_binds), T(test_bare_file),        T(test_damage),       T(test_failing_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
