/* Captures of other renderers: what inspect proposes for them is saved and run as it is, and has to give the
 * picture that relit's own capture of the same scene gives. */
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
#include "graph/run/camera_header.h"
#include "graph/tool/camera_solve.h"
#include "graph/tool/guess.h"
#include "tests/foreign_scene.h"
#include "tests/tool_run.h"

#define RUN(...) tool_run((const char *const[]){__VA_ARGS__, NULL})

static void expect(const tool_result *r, int status)
{
    if (r->status != status)
        print_error("status %d instead of %d\n%s%s\n", r->status, status, r->out, r->err);
    assert_int_equal(r->status, status);
}

static void has(const char *text, const char *what)
{
    if (!strstr(text, what))
        print_error("no '%s' in:\n%s\n", what, text);
    assert_non_null(strstr(text, what));
}

/* A folder with one frame, and what inspect makes of it in its capture.yaml. */
static char *make_at(foreign_kind kind, double shift, int x, char **manifest)
{
    char *folder = folder_new(), *file = path_in(folder, "shot.0007.exr");
    foreign_scene *s = foreign_scene_new(shift);
    s->x = s->y = x;
    foreign_write(file, s, kind);
    tool_result r = RUN("inspect", folder);
    expect(&r, 0);
    file_write(folder, "capture.yaml", r.out, strlen(r.out)); /* `relit inspect DIR > DIR/capture.yaml` */
    *manifest = strdup(r.out);
    tool_result_free(&r);
    free(file);
    free(s);
    return folder;
}

static char *make(foreign_kind kind, double shift, char **manifest)
{
    return make_at(kind, shift, 0, manifest);
}

/* Relights it with one lamp and reads R, G, B. Any warning fails. */
static float *relight(const char *folder, foreign_kind kind)
{
    const double lamp[3] = {-1.2, -1.5, 1.9};
    double at[3];
    char text[640];
    foreign_point(kind, lamp, at);
    snprintf(text, sizeof text,
             "relit: 1\ncapture: capture.yaml\nshading: {diffuse: lambert, specular: none}\nmaterials: "
             "{default: {}}\n"
             "lights: {lamp: {type: point, position: [%.9g, %.9g, %.9g], intensity: 5, shadow: none}}\n"
             "graph:\n  light: {pass: lighting}\n"
             "  c: {pass: combine, in: {diffuse: light.diffuse, lit: light.lit}}\n"
             "outputs: {p: {image: c.color, file: p.exr, type: float}}\n",
             at[0], at[1], at[2]);
    file_write(folder, "p.yaml", text, strlen(text));
    char *pipe = path_in(folder, "p.yaml"), *out = path_in(folder, "out"), *picture = path_in(out, "p.exr");
    tool_result r = RUN("run", pipe, "--out", out, "--quiet");
    expect(&r, 0);
    assert_string_equal(r.err, "");
    tool_result_free(&r);
    float *pixels = calloc(3 * FOREIGN_PIXELS, sizeof *pixels);
    rl_exr *file = NULL;
    rl_error err = {0};
    assert_non_null(pixels);
    assert_int_equal(rl_exr_open(picture, 0, &file, &err), RL_OK);
    rl_exr_plane planes[3];
    for (int i = 0; i < 3; i++)
        planes[i] = (rl_exr_plane){.channel = (const char *[]){"R", "G", "B"}[i],
                                   .floats = pixels + i * FOREIGN_PIXELS,
                                   .stride = FOREIGN_WIDTH};
    assert_int_equal(rl_exr_read(file, 0, planes, 3, NULL, NULL, &err), RL_OK);
    rl_exr_close(&file);
    free(pipe);
    free(picture);
    free(out);
    return pixels;
}

static void expect_same(const float *a, const float *b, double tolerance)
{
    double worst = 0, most = 0;
    for (int k = 0; k < 3 * FOREIGN_PIXELS; k++) {
        worst = fmax(worst, fabs((double)a[k] - (double)b[k]));
        most = fmax(most, (double)b[k]);
    }
    assert_true(most > 0.05);
    if (worst > tolerance * most)
        fail_msg("the pictures differ by %g of %g", worst, most);
}

static float *truth(void)
{
    char *manifest, *folder = make(FOREIGN_RELIT, 0, &manifest);
    has(manifest, "# guessed by preset 'relit'");
    float *pixels = relight(folder, FOREIGN_RELIT);
    free(manifest);
    folder_remove(folder);
    return pixels;
}

/* The proposal is right as it is, and says `words` (ending with NULL). */
static void expect_right(foreign_kind kind, const char *const *words)
{
    char *manifest, *folder = make(kind, 0, &manifest);
    for (; *words; words++)
        has(manifest, *words);
    float *want = truth(), *got = relight(folder, kind);
    expect_same(got, want, 2e-4);
    free(want);
    free(got);
    free(manifest);
    folder_remove(folder);
}

static void test_blender(void **state)
{
    (void)state;
    expect_right(FOREIGN_BLENDER,
                 (const char *[]){"# guessed by preset 'blender_cryptomatte'",
                                  "camera: found from depth and L.Position.X", "fov_x: 45.83662",
                                  "normal: fits depth and camera", "encoding: cryptomatte",
                                  "stencil_names: {317341308: \"red ball\", 3410176152: floor}", NULL});
}

static void test_arnold(void **state)
{
    (void)state;
    expect_right(FOREIGN_ARNOLD,
                 (const char *[]){"# guessed by preset 'arnold'",
                                  "camera.matrix: the header has worldToCamera",
                                  "camera.fov_x: the header has worldToNDC", "forward: +z", NULL});
}

static void test_unreal(void **state)
{
    (void)state;
    expect_right(FOREIGN_UNREAL,
                 (const char *[]){"# guessed by preset 'unreal'", "unit: 0.01", "encoding: unsigned",
                                  "camera.matrix: the header has unreal/",
                                  "stencil_names: {317341308: \"red ball\"", NULL});
}

static void test_pbrt(void **state)
{
    (void)state;
    expect_right(FOREIGN_PBRT, (const char *[]){"# guessed by preset 'pbrt'", "stencil: {constant: 1}",
                                                "depth: {channels: [P.Z]", "space: camera", NULL});
}

static void test_vray(void **state)
{
    (void)state;
    expect_right(FOREIGN_VRAY,
                 (const char *[]){"# guessed by preset 'vray'",
                                  "camera.matrix: the header has cameraTransform",
                                  "camera.fov_x: the header has cameraFov", "normal: V-Ray's Normals", NULL});
}

static void test_unknown(void **state)
{
    (void)state;
    expect_right(FOREIGN_UNKNOWN,
                 (const char *[]){"# no preset fits this file; guessed by names", "albedo: by its name alone",
                                  "stencil: no channel is named like an id", "forward: +z", "[zdepth]",
                                  NULL});
}

/* Depth as view space has it in OpenGL: -z. */
static void test_negated(void **state)
{
    (void)state;
    char *folder = folder_new(), *file = path_in(folder, "shot.0007.exr");
    foreign_scene *s = foreign_scene_new(0);
    for (int k = 0; k < FOREIGN_PIXELS; k++)
        s->depth[k] = -s->depth[k];
    foreign_write(file, s, FOREIGN_RELIT);
    tool_result r = RUN("inspect", folder);
    expect(&r, 0);
    has(r.out, "depth: no pixel shows a surface: the channel goes from -1e+10 to -");
    has(r.out, "; with layers.depth.negated: true, -z becomes z");
    char *right = text_replace(r.out, "kind: planar", "kind: planar, negated: true");
    file_write(folder, "capture.yaml", right, strlen(right));
    tool_result_free(&r);
    r = RUN("inspect", folder);
    expect(&r, 0);
    has(r.out, "kind: planar, negated: true, empty: 1e10");
    has(r.out, "normal: fits depth and camera");
    tool_result_free(&r);
    float *want = truth(), *got = relight(folder, FOREIGN_RELIT);
    expect_same(got, want, 2e-4);
    free(want);
    free(got);
    free(right);
    free(s);
    free(file);
    folder_remove(folder);
}

/* A name that no material can have stays beside its id. */
static void test_init_names(void **state)
{
    (void)state;
    char *manifest, *folder = make(FOREIGN_BLENDER, 0, &manifest);
    tool_result r = RUN("init", folder);
    expect(&r, 0);
    has(r.out, "  id-317341308: {stencil: 317341308}    # \"red ball\"\n  floor: {stencil: 3410176152}\n");
    tool_result_free(&r);
    free(manifest);
    folder_remove(folder);
}

/* The lens's shift is in Arnold's worldToNDC, and in what Blender's positions tell. */
static void test_shift(void **state)
{
    (void)state;
    char *manifest, *arnold = make(FOREIGN_ARNOLD, 0.06, &manifest);
    free(manifest);
    char *blender = make(FOREIGN_BLENDER, 0.06, &manifest);
    has(manifest, "shift: [0.06, 0]");
    free(manifest);
    char *moved = make_at(FOREIGN_BLENDER, 0.06, 17, &manifest); /* windows that do not begin at 0 */
    has(manifest, "shift: [0.06, 0]");
    has(manifest, "normal: fits depth and camera");
    free(manifest);
    folder_remove(moved);
    float *a = relight(arnold, FOREIGN_ARNOLD), *b = relight(blender, FOREIGN_BLENDER), *straight = truth();
    expect_same(a, b, 2e-4);
    double differ = 0;
    for (int k = 0; k < 3 * FOREIGN_PIXELS; k++)
        differ = fmax(differ, fabs((double)a[k] - (double)straight[k]));
    assert_true(differ > 0.01);
    free(a);
    free(b);
    free(straight);
    folder_remove(arnold);
    folder_remove(blender);
}

/* A file a layer: one manifest for all. */
static void test_torn(void **state)
{
    (void)state;
    char *folder = folder_new();
    foreign_scene *s = foreign_scene_new(0);
    foreign_write_torn(folder, s);
    tool_result r = RUN("inspect", folder);
    expect(&r, 0);
    has(r.out,
        "\nname: my_shot\nfiles:\n  albedo: my_shot_diffuse_albedo.####.exr\n  normal: my_shot_N.####.exr\n"
        "  depth: my_shot_depth.####.exr\nframes: 7\n");
    has(r.out, "camera: found from depth and my_shot_P.####.exr");
    file_write(folder, "capture.yaml", r.out, strlen(r.out));
    tool_result_free(&r);
    float *want = truth(), *got = relight(folder, FOREIGN_BLENDER);
    expect_same(got, want, 2e-4);
    free(want);
    free(got);
    free(s);
    folder_remove(folder);
}

/* ---- what is wrong is said --------------------------------------------------------------------------------
 */

/* The manifest of relit's own capture with one thing changed; the run warns with these words. */
static void expect_warning(foreign_kind kind, const char *find, const char *put, const char *words)
{
    char *manifest, *folder = make(kind, 0, &manifest), *wrong = text_replace(manifest, find, put);
    file_write(folder, "capture.yaml", wrong, strlen(wrong));
    static const char text[] = "relit: 1\ncapture: capture.yaml\nmaterials: {default: {}}\n"
                               "lights: {l: {type: point, position: [0, 0, 1], intensity: 1, shadow: none}}\n"
                               "graph:\n  light: {pass: lighting}\n"
                               "  c: {pass: combine, in: {diffuse: light.diffuse, lit: light.lit}}\n"
                               "outputs: {p: {image: c.color, file: p.exr}}\n";
    file_write(folder, "p.yaml", text, strlen(text));
    char *pipe = path_in(folder, "p.yaml"), *out = path_in(folder, "out");
    tool_result r = RUN("run", pipe, "--out", out, "--quiet");
    expect(&r, 0);
    if (words)
        has(r.err, words);
    else
        assert_string_equal(r.err, "");
    tool_result_free(&r);
    r = RUN("inspect", folder); /* the manifest is looked at in the same way */
    expect(&r, 0);
    has(r.out, words ? words : "normal: fits depth and camera");
    tool_result_free(&r);
    free(pipe);
    free(out);
    free(wrong);
    free(manifest);
    folder_remove(folder);
}

static void test_conventions(void **state)
{
    (void)state;
    expect_warning(FOREIGN_RELIT, NULL, "", NULL);
    char *manifest, *folder = make(FOREIGN_RELIT, 0, &manifest);
    has(manifest, "albedo: mean 0.5, greatest 0.7\n");
    free(manifest);
    folder_remove(folder);
    expect_warning(FOREIGN_RELIT, "kind: planar", "kind: planar, negated: true", "no pixel shows a surface");
    expect_warning(FOREIGN_RELIT, "space: world", "space: camera",
                   "with layers.normal.space: world in the manifest");
    expect_warning(FOREIGN_RELIT, "forward: -z", "forward: +z", "with camera.forward: -z in the manifest");
    expect_warning(FOREIGN_RELIT, "encoding: signed", "encoding: signed, axes: [x, z, -y]",
                   "with layers.normal.axes: [x, y, z] in the manifest");
    expect_warning(FOREIGN_RELIT, "kind: planar", "kind: radial",
                   "with layers.depth.kind: planar in the manifest");
    expect_warning(FOREIGN_RELIT, "[normal.X, normal.Y, normal.Z]", "[normal.X, normal.X, normal.X]",
                   "check layers.normal (space, encoding, axes), layers.depth (kind;");
    expect_warning(FOREIGN_PBRT, "space: camera", "space: world",
                   "with layers.normal.space: camera in the manifest");
    expect_warning(FOREIGN_PBRT, "encoding: signed", "encoding: signed, axes: [x, -y, z]",
                   "with layers.normal.axes: [x, y, z] in the manifest");
    expect_warning(FOREIGN_UNREAL, "encoding: unsigned", "encoding: signed",
                   "layers.normal.encoding: unsigned in the manifest?");
}

static void expect_failure(const char *find, const char *put, int status, const char *words)
{
    char *manifest, *folder = make(FOREIGN_BLENDER, 0, &manifest), *wrong = text_replace(manifest, find, put);
    file_write(folder, "capture.yaml", wrong, strlen(wrong));
    char *out = path_in(folder, "out"), *pipe = path_in(folder, "p.yaml");
    tool_result r = RUN("init", folder);
    if (!r.status) {
        file_write(folder, "p.yaml", r.out, strlen(r.out));
        char *path = text_replace(r.out, folder, "capture.yaml");
        file_write(folder, "p.yaml", path, strlen(path));
        free(path);
        tool_result_free(&r);
        r = RUN("run", pipe, "--out", out, "--quiet");
    }
    expect(&r, status);
    has(r.err, words);
    tool_result_free(&r);
    free(out);
    free(pipe);
    free(wrong);
    free(manifest);
    folder_remove(folder);
}

static void test_messages(void **state)
{
    (void)state;
    expect_failure(", encoding: cryptomatte", "", 1, "Cryptomatte needs encoding: cryptomatte");
    expect_failure("encoding: cryptomatte", "encoding: cryptomatt", 2, "known: cryptomatte, integer");
    expect_failure("{channels: [L.CryptoMaterial00.r], encoding", "{constant: 1, encoding", 2,
                   "'constant' is the id of every pixel, instead of channels");
    expect_failure("encoding: signed", "encoding: signed, axes: [x, y, y]", 2,
                   "'axes': expected three of x, y, z");
    expect_failure("encoding: signed", "encoding: signed, axes: [x, y]", 2,
                   "'axes': expected three of x, y, z");
}

/* ---- names -----------------------------------------------------------------------------------------------
 */

/* Channels of a file, and what albedo, normal, depth, stencil and position are taken for ("" = nothing is
 * like it). */
static const struct names {
    const char *channels[48];
    const char *found[5];
} names[] = {
    /* Redshift */
    {{"A",
      "B",
      "Cryptomatte00.A",
      "Cryptomatte00.B",
      "Cryptomatte00.G",
      "Cryptomatte00.R",
      "Cryptomatte01.R",
      "DiffuseFilter.B",
      "DiffuseFilter.G",
      "DiffuseFilter.R",
      "DiffuseLighting.B",
      "DiffuseLighting.G",
      "DiffuseLighting.R",
      "G",
      "N.B",
      "N.G",
      "N.R",
      "P.B",
      "P.G",
      "P.R",
      "R",
      "Z",
      NULL},
     {"DiffuseFilter.R", "N.R", "Z", "Cryptomatte00.R", "P.R"}},
    /* LuxCore */
    {{"ALBEDO.B", "ALBEDO.G", "ALBEDO.R", "DEPTH.Z", "GEOMETRY_NORMAL.X", "GEOMETRY_NORMAL.Y",
      "GEOMETRY_NORMAL.Z", "MATERIAL_ID.V", "POSITION.X", "POSITION.Y", "POSITION.Z", NULL},
     {"ALBEDO.R", "GEOMETRY_NORMAL.X", "DEPTH.Z", "MATERIAL_ID.V", "POSITION.X"}},
    /* RenderMan: lower case */
    {{"a", "albedo.b", "albedo.g", "albedo.r", "b", "g", "__Nworld.b", "__Nworld.g", "__Nworld.r",
      "__Pworld.b", "__Pworld.g", "__Pworld.r", "r", "z", NULL},
     {"albedo.r", "__Nworld.r", "z", "", "__Pworld.r"}},
    /* Karma */
    {{"A", "B", "CryptoMaterial00.A", "CryptoMaterial00.B", "CryptoMaterial00.G", "CryptoMaterial00.R", "G",
      "N.x", "N.y", "N.z", "P.x", "P.y", "P.z", "R", "albedo.B", "albedo.G", "albedo.R", "depth.Z", NULL},
     {"albedo.R", "N.x", "depth.Z", "CryptoMaterial00.R", "P.x"}},
    /* lit layers, an id as colours, a matte: nothing that is of use */
    {{"diffuse_direct.B", "diffuse_direct.G", "diffuse_direct.R", "MultiMatte.B", "MultiMatte.G",
      "MultiMatte.R", "alpha.A", "lens.Y", NULL},
     {"", "", "", "", ""}},
};

static void test_names(void **state)
{
    (void)state;
    static const rl_layer_id ids[] = {RL_LAYER_ALBEDO, RL_LAYER_NORMAL, RL_LAYER_DEPTH, RL_LAYER_STENCIL,
                                      RL_LAYER_COUNT};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        rl_channel channels[48];
        size_t n = 0;
        for (; names[i].channels[n]; n++)
            channels[n] = (rl_channel){NULL, names[i].channels[n]};
        for (int k = 0; k < 5; k++) {
            rl_guess guess;
            const char *got = rl_guess_layer(ids[k], channels, n, &guess) ? guess.names[0] : "";
            if (strcmp(got, names[i].found[k]))
                fail_msg("list %zu, layer %d: '%s' instead of '%s'", i, k, got, names[i].found[k]);
        }
    }
}

/* ---- cameras ---------------------------------------------------------------------------------------------
 */

/* Every `step`-th pixel that shows something. */
static size_t see(const foreign_scene *s, double unit, rl_seen *out)
{
    size_t n = 0;
    for (int k = 0; k < FOREIGN_PIXELS; k += 3)
        if (s->id[k]) {
            out[n] = (rl_seen){
                .x = k % FOREIGN_WIDTH + 0.5, .y = k / FOREIGN_WIDTH + 0.5, .depth = (double)s->depth[k]};
            for (int i = 0; i < 3; i++)
                out[n].world[i] = (double)s->world[i][k] * unit;
            n++;
        }
    return n;
}

static void test_solve(void **state)
{
    (void)state;
    foreign_scene *s = foreign_scene_new(0.06);
    rl_seen *seen = calloc(FOREIGN_PIXELS, sizeof *seen);
    rl_solved_camera c;
    double want[16];
    assert_non_null(seen);
    size_t n = see(s, 1, seen);
    for (size_t i = 0; i < n; i += 9) /* edges: a mean of what lies before and behind */
        seen[i].world[1] += 0.4;
    assert_true(rl_camera_solve(seen, n, &c));
    foreign_matrix(s, -1, want);
    for (int i = 0; i < 16; i++)
        assert_true(fabs(c.matrix[i] - want[4 * (i % 4) + i / 4]) < 2e-3);
    assert_true(fabs(c.focal - 48 / tan(0.4)) < 0.2 && fabs(c.aspect - 1) < 2e-3);
    assert_true(fabs(c.centre[0] - (48 - 0.06 * 96)) < 0.2 && fabs(c.centre[1] - 36) < 0.2);
    n = see(s, 1, seen);
    assert_true(rl_camera_solve(seen, n, &c) && c.error < 1e-3);
    assert_false(rl_camera_solve(seen, see(s, 100, seen), &c)); /* positions in cm, depth in m */
    n = see(s, 1, seen);
    for (size_t i = 0; i < n; i++) /* radial depth */
        seen[i].depth *= 1 + 1e-4 * (pow(seen[i].x - 42, 2) + pow(seen[i].y - 36, 2));
    assert_true(!rl_camera_solve(seen, n, &c) || c.error > 0.5);
    n = see(s, 1, seen);
    for (size_t i = 0; i < n; i++) /* a plane alone does not tell */
        seen[i].world[2] = 0;
    assert_false(rl_camera_solve(seen, n, &c));
    assert_false(rl_camera_solve(seen, 15, &c));
    free(seen);
    free(s);
}

/* What the headers of real files hold: Arnold 5.1.0.0 (Houdini, 45 degrees, worldToNDC from -1 to 1),
 * V-Ray 3.60 (Maya, 35 mm on 36 mm), and captures/monkey (worldToNDC from 0 to 1, as OpenEXR's standard
 * attributes say). */
static const struct header {
    const char *matrix_name, *lens_name;
    bool forward_z;
    double matrix[16], lens[16], camera[16], fov_x; /* `camera`: what relit makes of `matrix`; degrees */
} headers[] = {
    {.matrix_name = "worldToCamera",
     .lens_name = "worldToNDC",
     .forward_z = true,
     .matrix = {0.70710677, -0.33927497, -0.6203971, 0, 0, 0.87737405, -0.47980732, 0, -0.7071069,
                -0.33927497, -0.6203971, 0, 2.6822093e-7, 0.1647007, 3.0775151, 1.0000001},
     .camera = {0.70710677, -0.33927497, -0.6203971, 0, 0, 0.87737405, -0.47980732, 0, -0.7071069,
                -0.33927497, -0.6203971, 0, 2.6822093e-7, 0.1647007, 3.0775151, 1.0000001},
     .lens = {1.7071049, -0.81908137, -0.62041306, -0.6203971, 0, 2.1181662, -0.4798197, -0.47980732,
              -1.7071053, -0.81908137, -0.62041306, -0.6203971, 6.475419e-7, 0.39762226, 2.9775918,
              3.0775151},
     .fov_x = 45},
    {.matrix_name = "cameraTransform",
     .lens_name = "cameraFov",
     .matrix = {1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 5, 20, 1},
     .camera = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -5, -20, 1}, /* at (0, 5, 20), looks along -z */
     .lens = {54.43222},
     .fov_x = 54.43222},
    {.matrix_name = "worldToCamera",
     .lens_name = "worldToNDC",
     .matrix = {0.99449074, -0.010928339, 0.10425348, 0, 0.1048247, 0.10367912, -0.9890715, 0, 0, 0.99455076,
                0.10425348, 0, -0.0019889814, 0.007978262, -0.7475509, 1},
     .camera = {0.99449074, -0.010928339, 0.10425348, 0, 0.1048247, 0.10367912, -0.9890715, 0, 0, 0.99455076,
                0.10425348, 0, -0.0019889814, 0.007978262, -0.7475509, 1},
     .lens = {2.0595987, -0.01087252, -0.10425348, -0.10425348, 0.71712303, 0.10314954, 0.9890715, 0.9890715,
              -0.05212674, -3.8065321, -0.10425348, -0.10425348, 0.36955202, 0.3436577, 0.7475509, 0.7475509},
     .fov_x = 26.5},
};

static void expect_header(const char *path, const struct header *h)
{
    const float pixel = 1;
    bool one = !strcmp(h->lens_name, "cameraFov");
    rl_exr_source channel = {.name = "Z", .type = RL_EXR_FLOAT, .floats = &pixel, .stride = 1};
    rl_exr_attribute attrs[2] = {{h->matrix_name, {.type = RL_EXR_T_M44F}},
                                 {h->lens_name, {.type = one ? RL_EXR_T_FLOAT : RL_EXR_T_M44F}}};
    memcpy(attrs[0].value.v, h->matrix, sizeof h->matrix);
    memcpy(attrs[1].value.v, h->lens, sizeof h->lens);
    rl_exr_image image = {.channels = &channel, .n_channels = 1, .attrs = attrs, .n_attrs = 2};
    rl_exr *file = NULL;
    rl_error err = {0};
    double m[16];
    rl_camera_lens lens;
    assert_int_equal(rl_exr_write(path, &image, NULL, NULL, &err), RL_OK);
    assert_int_equal(rl_exr_open(path, 0, &file, &err), RL_OK);
    assert_string_equal(rl_camera_header_matrix(file, 0, h->forward_z, m), h->matrix_name);
    rl_camera_header_lens(file, 0, h->forward_z, &lens);
    assert_string_equal(lens.source, h->lens_name);
    for (int i = 0; i < 16; i++)
        assert_true(fabs(m[i] - h->camera[i]) < 1e-6);
    double fov = lens.fov_x > 0 ? lens.fov_x : 2 * atan(lens.width / 2);
    assert_true(fabs(fov * 180 / 3.14159265358979 - h->fov_x) < 1e-3);
    assert_true(fabs(lens.centre[0]) < 1e-3 && fabs(lens.centre[1]) < 1e-3);
    rl_exr_close(&file);
}

static void test_headers(void **state)
{
    (void)state;
    char *folder = folder_new(), *path = path_in(folder, "h.exr");
    for (size_t i = 0; i < sizeof headers / sizeof *headers; i++)
        expect_header(path, &headers[i]);
    free(path);
    folder_remove(folder);
}

/* Memory that runs out anywhere is an error, or what is not said. */
static void test_failing_memory(void **state)
{
    (void)state;
    char *folder = folder_new(), *file = path_in(folder, "shot.0007.exr");
    foreign_scene *s = foreign_scene_new(0);
    foreign_write(file, s, FOREIGN_BLENDER);
    bool failed = true;
    for (int n = 1; n < 4000 && failed; n += n < 60 ? 1 : 7) {
        rl_alloc_fail_at((unsigned long)n, 0);
        tool_result r = RUN("inspect", folder);
        bool done = rl_alloc_fail_at(0, 0) > 0;
        failed = !done;
        assert_true(r.status == 0 || r.err[0]);
        tool_result_free(&r);
    }
    free(s);
    free(file);
    folder_remove(folder);
}

/* Steps that a newcomer takes before there is a manifest. */
static void test_first_steps(void **state)
{
    (void)state;
    char *folder = folder_new(), *file = path_in(folder, "shot.0007.exr");
    foreign_scene *s = foreign_scene_new(0);
    foreign_write(file, s, FOREIGN_BLENDER);
    tool_result r = RUN("init", folder);
    expect(&r, 2);
    has(r.err, "the folder holds no capture.yaml; `relit inspect ");
    tool_result_free(&r);
    r = RUN("init", file);
    expect(&r, 2);
    has(r.err, "the file does not say where its camera is; `relit inspect ");
    tool_result_free(&r);
    const char *const captures[] = {file, folder};
    for (int i = 0; i < 2; i++) {
        r = RUN("run", captures[i]);
        expect(&r, 2);
        has(r.err, "this is a capture, not a pipeline: `relit init ");
        tool_result_free(&r);
    }
    free(s);
    free(file);
    folder_remove(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_blender),        cmocka_unit_test(test_arnold),
        cmocka_unit_test(test_unreal),         cmocka_unit_test(test_pbrt),
        cmocka_unit_test(test_vray),           cmocka_unit_test(test_unknown),
        cmocka_unit_test(test_shift),          cmocka_unit_test(test_conventions),
        cmocka_unit_test(test_messages),       cmocka_unit_test(test_first_steps),
        cmocka_unit_test(test_torn),           cmocka_unit_test(test_names),
        cmocka_unit_test(test_negated),        cmocka_unit_test(test_init_names),
        cmocka_unit_test(test_solve),          cmocka_unit_test(test_headers),
        cmocka_unit_test(test_failing_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
