/* More layers, lights and odder names than anyone expects: nothing is dropped without a word. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "graph/run/exr.h"
#include "tests/small_capture.h"
#include "tests/tool_run.h"

/* small_pipe, as it is now. */
static void run_fine(void)
{
    rl_error err = {0};
    rl_session *session = NULL;
    rl_run_summary summary = {0};
    rl_options options = {.pipeline = small_pipe, .out = small_out, .frames = "1", .threads = 2};
    if (rl_session_open(&options, &session, &err) || rl_session_run(session, NULL, &summary, &err))
        fail_msg("%s:%d: %s", err.file, err.line, err.text);
    assert_int_equal(summary.failed, 0);
    rl_session_close(&session);
}

/* folder/pipe.yaml of this text, and what the output file out/o.exr holds. */
static rl_exr *run_text(const char *text)
{
    rl_error err = {0};
    rl_exr *file = NULL;
    file_write(small_folder, "pipe.yaml", text, strlen(text));
    char *out = path_in(small_out, "o.exr");
    run_fine();
    if (rl_exr_open(out, 0, &file, &err))
        fail_msg("%s: %s", err.file, err.text);
    free(out);
    return file;
}

static void test_many_layers(void **state)
{
    (void)state;
    char text[32768];
    int n = snprintf(text, sizeof text,
                     "relit: 1\ncapture: capture.yaml\nmaterials: {default: {}}\noutputs:\n  o:\n    file: "
                     "o.exr\n    layers:\n");
    for (int i = 0; i < 300; i++)
        n += snprintf(text + n, sizeof text - (size_t)n, "      l%d: %s\n", i,
                      i % 2 ? "capture.depth" : "capture.albedo");
    rl_exr *file = run_text(text);
    assert_int_equal(rl_exr_part_at(file, 0)->n_channels, 150 * 4 + 150); /* R G B A, and V */
    rl_exr_close(&file);
}

/* A plane a light: more than the sixteen that an rl_image_view lists by itself. */
static void test_many_lights(void **state)
{
    (void)state;
    enum { LIGHTS = 21 };
    char shadows[1024] = "shadow: {", lights[4096] = "lights:\n";
    for (int i = 0; i < LIGHTS; i++) {
        snprintf(shadows + strlen(shadows), sizeof shadows - strlen(shadows), "x%d: shadow.key, ", i);
        snprintf(lights + strlen(lights), sizeof lights - strlen(lights),
                 "  x%d: {type: point, position: [0, 0, %d], intensity: 1}\n", i, i);
    }
    char *some = text_replace(small_manifest, "shadow: {", shadows),
         *all = text_replace(some, "lights:\n", lights);
    file_write(small_folder, "lights.yaml", all, strlen(all));
    rl_exr *file =
        run_text("relit: 1\ncapture: lights.yaml\nmaterials: {default: {}}\n"
                 "graph: {l: {pass: lighting}, c: {pass: combine, in: {diffuse: l.diffuse, lit: l.lit}}}\n"
                 "outputs: {o: {layers: {s: capture.shadow, c: c.color}, file: o.exr}}\n");
    assert_int_equal(rl_exr_part_at(file, 0)->n_channels, LIGHTS + 1 + 4); /* and `key` itself */
    float first[SMALL_WIDTH * SMALL_HEIGHT], last[SMALL_WIDTH * SMALL_HEIGHT];
    rl_error err = {0};
    rl_exr_plane planes[] = {{.channel = "s.x0", .floats = first, .stride = SMALL_WIDTH},
                             {.channel = "s.key", .floats = last, .stride = SMALL_WIDTH}};
    assert_int_equal(rl_exr_read(file, 0, planes, 2, NULL, NULL, &err), RL_OK);
    assert_memory_equal(first, last, sizeof first);
    assert_true(first[SMALL_WIDTH - 1] == 1 && first[0] == 0); /* as small_capture.c made it */
    rl_exr_close(&file);
    free(some);
    free(all);
}

/* Quotes and line ends in a file's name: the kernel compiles, and its error has a place. */
static void test_odd_file_names(void **state)
{
    (void)state;
    static const char kernel[] = "kernel void run(global const float *a, global float *b, constant frame_t "
                                 "*f, constant material_t *m)\n"
                                 "{\n    b[get_global_id(0)] = a[get_global_id(0)];\n}\n";
    static const char pipeline[] =
        "relit: 1\ncapture: capture.yaml\nmaterials: {default: {}}\n"
        "graph: {k: {pass: kernel, file: \"od\\\"d \\\\n\\n: 1.cl\", entry: run, in: {a: capture.depth}, "
        "ports: {a: {role: read, type: scalar}, b: {role: write, type: scalar}}}}\n"
        "outputs: {o: {image: k.b, file: o.exr}}\n";
    static const char name[] = "od\"d \\n\n: 1.cl";
    file_write(small_folder, name, kernel, strlen(kernel));
    rl_exr *file = run_text(pipeline);
    assert_int_equal(rl_exr_part_at(file, 0)->n_channels, 1);
    rl_exr_close(&file);
    char *bad = text_replace(kernel, "= a[", "= q[");
    file_write(small_folder, name, bad, strlen(bad));
    rl_options options = {.pipeline = small_pipe, .out = small_folder, .frames = "1"};
    rl_session *session = NULL;
    rl_error err = {0};
    assert_int_equal(rl_session_open(&options, &session, &err), RL_OK);
    assert_int_equal(rl_session_prepare(session, &err), RL_E_BUILD);
    assert_non_null(strstr(err.file, "od\"d \\n"));
    assert_int_equal(err.line, 3);
    assert_non_null(strstr(err.text, "'q'"));
    rl_session_close(&session);
    free(bad);
}

/* A graph without a pass: only what the capture has goes out. */
static void test_no_pass(void **state)
{
    (void)state;
    rl_exr *file = run_text("relit: 1\ncapture: capture.yaml\nmaterials: {default: {}}\n"
                            "outputs: {o: {layers: {z: capture.depth, id: capture.stencil}, file: o.exr}}\n");
    assert_int_equal(rl_exr_part_at(file, 0)->n_channels, 2);
    rl_exr_close(&file);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_many_layers),
        cmocka_unit_test(test_many_lights),
        cmocka_unit_test(test_odd_file_names),
        cmocka_unit_test(test_no_pass),
    };
    return cmocka_run_group_tests(tests, small_setup, small_teardown);
}
