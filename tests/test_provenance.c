/* What pictures say of where they come from: hashes of the pipeline, of the capture's manifest and of every
 * file that they name; by content, wherever it lies. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "graph/run/session.h"
#include "tests/exr_make.h"
#include "tests/tool_run.h"

static const char
    lamp[] = "IESNA91\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 9\n0 90\n0\n100 10\n",
    curve[] = "Version 1\nFrom 0.0 1.0\nLength 2\nComponents 1\n{\n0.0\n1.0\n}\n",
    kernel[] = "kernel void copy(global const float *a, global float *b, constant frame_t *f,\n"
               "                 constant material_t *m)\n"
               "{\n"
               "    int i = rl_index(f, get_global_id(0), get_global_id(1));\n"
               "    b[i] = a[i];\n"
               "}\n",
    manifest[] =
        "relit_capture: 1\npreset: relit\nfiles: memory\nframes: 1-4\n"
        "lights:\n"
        "  own: {type: point, position: [0, 0, 1], direction: [0, 0, -1], intensity: 1, ies: own.ies}\n";

static const char colors[] = "ocio_profile_version: 2.1\nsearch_path: .\n"
                             "roles: {default: lin_rec709, scene_linear: lin_rec709}\n"
                             "displays:\n  d:\n    - !<View> {name: v, colorspace: b}\n"
                             "file_rules:\n  - !<Rule> {name: Default, colorspace: lin_rec709}\n"
                             "colorspaces:\n  - !<ColorSpace>\n    name: lin_rec709\n"
                             "  - !<ColorSpace>\n    name: b\n"
                             "    from_scene_reference: !<GroupTransform> {children: ["
                             "!<FileTransform> {src: curve.spi1d}]}\n";

static const char pipeline[] =
    "relit: 1\ncapture: capture.yaml\ncolor: {config: colors.ocio}\n"
    "materials: {default: {}}\n"
    "ambient: {hdri: sky.exr, up: y, specular: false}\n"
    "lights:\n  a: {type: point, position: [0, 0, 1], direction: [0, 0, -1], intensity: 1, ies: lamp.ies}\n"
    "graph:\n  light: {pass: lighting}\n"
    "  copy: {pass: kernel, file: copy.cl, entry: copy, ports: {a: {role: read, type: scalar}, b: {role: "
    "write, type: "
    "scalar}}, in: {a: capture.depth}}\n"
    "outputs:\n  lit: {image: light.lit, file: 'o.{frame}.exr'}\n"
    "  copy: {image: copy.b, file: 'c.{frame}.exr'}\n";

static const struct {
    const char *name, *text;
    bool of_pipeline, of_capture;
} files[] = {
    {"lamp.ies", lamp, true, false},         {"colors.ocio", colors, true, false},
    {"curve.spi1d", curve, true, false},     {"copy.cl", kernel, true, false},
    {"capture.yaml", manifest, false, true}, {"own.ies", lamp, false, true},
    {"p.yaml", pipeline, true, false},
};
enum { FILES = sizeof files / sizeof *files };

static void write_sky(const char *folder, float value)
{
    static float sky[64 * 32];
    for (size_t i = 0; i < sizeof sky / sizeof *sky; i++)
        sky[i] = value;
    const made_channel channels[] = {
        {"B", RL_EXR_FLOAT, 0, sky}, {"G", RL_EXR_FLOAT, 0, sky}, {"R", RL_EXR_FLOAT, 0, sky}};
    const made_part part = {.width = 64, .height = 32, .channels = channels, .n_channels = 3};
    char *path = path_in(folder, "sky.exr");
    made_write(path, &part, 1);
    free(path);
}

static char *new_place(void)
{
    char *folder = folder_new();
    for (size_t i = 0; i < FILES; i++)
        file_write(folder, files[i].name, files[i].text, strlen(files[i].text));
    write_sky(folder, 0.5f);
    return folder;
}

typedef struct hashes {
    uint64_t pipeline, capture;
} hashes;

static hashes open_in(const char *folder, const rl_options *more)
{
    rl_session *s = NULL;
    rl_error err = {0};
    rl_options options = *more;
    char *pipe = path_in(folder, "p.yaml");
    options.pipeline = pipe;
    if (rl_session_open(&options, &s, &err))
        fail_msg("%s:%d: %s", err.file, err.line, err.text);
    hashes h = {s->content, s->sequences[0].content};
    rl_session_close(&s);
    free(pipe);
    return h;
}

static void expect_changed(hashes before, hashes after, bool pipe, bool capture, const char *what)
{
    if ((before.pipeline != after.pipeline) != pipe)
        fail_msg("%s: the pipeline's hash %s", what, pipe ? "stays" : "changes");
    if ((before.capture != after.capture) != capture)
        fail_msg("%s: the capture's hash %s", what, capture ? "stays" : "changes");
}

/* Other bytes under the same name (here: a number or two) are another hash; the old ones are the old one. */
static void test_files(void **state)
{
    static const char *const change[FILES][2] = {
        {"100 10", "100 20"}, {"{name: v,", "{name: w,"}, {"1.0\n}", "0.9\n}"}, {"= a[i]", "= 2 * a[i]"},
        {"0, 1]", "0, 2]"},   {"100 10", "100 30"},       {"0, 1]", "0, 3]"},
    };
    (void)state;
    const rl_options none = {0};
    char *folder = new_place();
    hashes first = open_in(folder, &none);
    for (size_t i = 0; i < FILES; i++) {
        char *text = text_replace(files[i].text, change[i][0], change[i][1]);
        file_write(folder, files[i].name, text, strlen(text));
        expect_changed(first, open_in(folder, &none), files[i].of_pipeline, files[i].of_capture,
                       files[i].name);
        file_write(folder, files[i].name, files[i].text, strlen(files[i].text));
        expect_changed(first, open_in(folder, &none), false, false, files[i].name);
        free(text);
    }
    write_sky(folder, 0.25f);
    expect_changed(first, open_in(folder, &none), true, false, "sky.exr");
    folder_remove(folder);
}

/* The same files elsewhere; more frames; comments: the same. Another working folder's options: not. */
static void test_places(void **state)
{
    static const rl_setting set = {"shading.diffuse", "lambert"};
    (void)state;
    const rl_options none = {0}, other = {.settings = &set, .n_settings = 1};
    char *a = new_place(), *b = new_place(), *longer = text_replace(manifest, "1-4", "1-9"),
         *said = text_replace(pipeline, "graph:", "# what runs\ngraph:");
    hashes first = open_in(a, &none);
    file_write(b, "capture.yaml", longer, strlen(longer));
    file_write(b, "p.yaml", said, strlen(said));
    expect_changed(first, open_in(b, &none), false, false, "another folder");
    expect_changed(first, open_in(a, &other), true, false, "--set");
    setenv("RELIT_KERNELS", "kernels", 1); /* files in the place of those that the version stands for */
    expect_changed(first, open_in(a, &none), true, false, "$RELIT_KERNELS");
    unsetenv("RELIT_KERNELS");
    char *plain = path_in(b, "other.ocio"), *text = text_replace(colors, "name: v", "name: u");
    file_write(b, "other.ocio", text, strlen(text));
    expect_changed(first, open_in(b, &(rl_options){.ocio = plain}), true, false, "--ocio");
    free(text);
    free(plain);
    free(said);
    free(longer);
    folder_remove(a);
    folder_remove(b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_files), cmocka_unit_test(test_places)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
