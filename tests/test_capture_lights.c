/* Lights, colour spaces and presets over one capture: whoever says it, and in whichever unit, the picture is
 * the same. */
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

static const capture_form plain = {.name = "plain", .compression = RL_EXR_ZIP};
static char *folder; /* frames 1 to 2 of `plain` */

static int setup(void **state)
{
    (void)state;
    if (!capture_start())
        return -1;
    folder = capture_lit(&plain, 2);
    return 0;
}

static int teardown(void **state)
{
    (void)state;
    folder_remove(folder);
    capture_stop();
    return 0;
}

static scene truth(unsigned lights, unsigned shadowed)
{
    scene_camera c = scene_camera_default();
    return scene_make(&c, lights, shadowed);
}

/* Processes frame 1 and compares; frees the scene. */
static void expect(const char *capture, const char *pipeline, scene s)
{
    static const char *const color[] = {"c.color"};
    const rl_options options = {.dump = color, .n_dump = 1};
    rl_error err = {0};
    rl_session *r = capture_open(capture, pipeline, &options);
    if (rl_session_process(r, 0, 1, NULL, &err))
        fail_msg("%s: %s", err.file, err.text);
    rl_image_view view = capture_image(r, "c.color");
    double off = capture_error(&view, &s, SCENE_COLOR, 3, 0);
    if (!(off <= 4e-6))
        print_error("off by %g\n", off);
    assert_true(off <= 4e-6);
    rl_session_close(&r);
    scene_free(&s);
}

/* The common pipeline with lines added to it. */
static char *with(const char *lines)
{
    char *text = malloc(strlen(capture_pipeline) + strlen(lines) + 1);
    strcpy(text, capture_pipeline);
    strcat(text, lines);
    return text;
}

static void expect_lights(const char *lights, scene s)
{
    char *pipeline = with(lights);
    expect(folder, pipeline, s);
    free(pipeline);
}

/* ---- the capture's ---- */

/* Paths of --set into lights that the pipeline does not list change the capture's; what is written replaces
 * them. */
static void test_paths(void **state)
{
    (void)state;
    static const struct {
        rl_setting settings[2];
        size_t n;
        unsigned lights;
    } rows[] = {
        {{{"lights.rim.enabled", "false"}, {"lights.key.efficacy", "100"}}, 2, SCENE_LIGHTS & ~SCENE_RIM},
        {{{"lights.rim.enabled", "true"}}, 1, SCENE_LIGHTS},
        {{{"lights.rim", "null"}}, 1, SCENE_LIGHTS & ~SCENE_RIM},
        {{{"lights.key.efficacy", "100"}, {"lights.rim", "null"}}, 2, SCENE_LIGHTS & ~SCENE_RIM},
        {{{"lights.rim.exposure", "1"}, {"lights.rim", "null"}}, 2, SCENE_LIGHTS & ~SCENE_RIM},
        {{{"lights.rim.efficacy", "null"}}, 1, SCENE_LIGHTS},
        {{{"lights", "{}"}}, 1, 0}};
    static const char *const color[] = {"c.color"};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const rl_options options = {
            .dump = color, .n_dump = 1, .settings = rows[i].settings, .n_settings = rows[i].n};
        rl_error err = {0};
        rl_session *r = capture_open(folder, capture_pipeline, &options);
        scene s = truth(rows[i].lights, SCENE_KEY | SCENE_RIM);
        assert_int_equal(rl_session_process(r, 0, 1, NULL, &err), RL_OK);
        rl_image_view view = capture_image(r, "c.color");
        assert_true(capture_error(&view, &s, SCENE_COLOR, 3, rows[i].lights ? 0 : 1) <= 4e-6);
        rl_session_close(&r);
        scene_free(&s);
    }
}

/* Removing what is not there is a slip as a rule, and no more than a slip. */
static void test_removing_nothing(void **state)
{
    (void)state;
    static const struct {
        rl_setting setting;
        const char *says;
    } rows[] = {
        {{"lights.rm", "null"},
         "nothing is removed: the capture 'cap' has no light 'rm'; did you mean 'rim'?"},
        {{"graph.lihgt", "null"},
         "nothing is removed: there is no 'graph.lihgt'; did you mean 'light'? known: c, "
         "light"},
        {{"graph.light.shadow_steps", "null"}, "there is no 'graph.light.shadow_steps'; known: pass"},
        {{"nothing.at.all", "null"}, "there is no 'nothing.at.all'; known: graph"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const rl_options options = {.settings = &rows[i].setting, .n_settings = 1};
        capture_log_clear();
        rl_session *r = capture_open(folder, capture_pipeline, &options);
        if (!strstr(capture_log(), rows[i].says))
            print_error("%s\ninstead of\n%s\n", capture_log(), rows[i].says);
        assert_non_null(strstr(capture_log(), rows[i].says));
        rl_session_close(&r);
    }
    capture_log_clear();
}

/* Neither has any: a black picture is not what was meant. An empty map says that it is. */
static void test_no_light(void **state)
{
    (void)state;
    static const rl_setting none = {"lights", "{}"};
    const capture_form f = {.name = "no lights", .no_lights = true};
    scene s = truth(0, 0);
    char *own = folder_new();
    capture_write(own, &f, &s, 1);
    capture_manifest(own, &f, &s, 1);
    for (int i = 0; i < 2; i++) {
        const rl_options options = {.settings = &none, .n_settings = (size_t)i};
        capture_log_clear();
        rl_session *r = capture_open(own, capture_pipeline, &options);
        const char *said = strstr(capture_log(), "pass 'light' (lighting): there is no light: neither the "
                                                 "pipeline nor the capture 'cap' has `lights:`");
        assert_int_equal(said != NULL, i == 0);
        rl_session_close(&r);
    }
    capture_log_clear();
    scene_free(&s);
    folder_remove(own);
}

/* ---- units ---- */

static void test_photometric(void **state)
{
    (void)state;
    /* 683 lm/W; lumen of a point: 4 pi candela; of a spot: its cone's solid angle, 2 pi (1 - cos 30°) */
    expect_lights("lights:\n"
                  "  key: {type: point, position: [0.6, 1.2, -0.4], candela: [2049, 1366, 683]}\n"
                  "  rim: {type: spot, position: [-1.2, 0.9, -1.2], direction: [0.74, -0.74, -0.3], angle: "
                  "60, blend: 0.4,\n"
                  "        lumen: [287.470334, 862.411001, 1437.351669]}\n"
                  "  sun: {type: directional, direction: [-0.3, -0.9, -0.4], lux: [273.2, 204.9, 136.6]}\n",
                  truth(SCENE_LIGHTS, SCENE_KEY | SCENE_RIM));
    expect_lights("lights:\n"
                  "  key: {type: point, position: [0.6, 1.2, -0.4], lumen: 3769.911184, efficacy: 100, "
                  "color: [1, 0.6666666667, 0.3333333333]}\n",
                  truth(SCENE_KEY, SCENE_KEY));
    expect_lights(
        "lights:\n"
        "  key: {type: point, position: [0.6, 1.2, -0.4], intensity: [0.75, 0.5, 0.25], exposure: 2}\n",
        truth(SCENE_KEY, SCENE_KEY));
}

/* Above the horizon a sphere lights as a point does; its sizes are in the capture's unit, its place in either
 * space. */
static void test_sphere(void **state)
{
    (void)state;
    expect_lights("lights:\n"
                  "  key: {type: sphere, position: [0.6, 1.2, -0.4], radius: 0.0005, intensity: [3, 2, 1], "
                  "shadow: none}\n",
                  truth(SCENE_KEY, 0));
    expect_lights("lights:\n"
                  "  key: {type: sphere, position: [0.6, 1.2, -0.4], radius: 0.0005, shadow: none,\n"
                  "        power: [37.69911184, 25.13274123, 12.56637061]}\n",
                  truth(SCENE_KEY, 0));
}

/* ---- shadows ---- */

#define KEY "type: point, position: [0.6, 1.2, -0.4], intensity: [3, 2, 1]"
#define RIM                                                                                                  \
    "type: spot, position: [-1.2, 0.9, -1.2], direction: [0.74, -0.74, -0.3], angle: 60, blend: 0.4, "       \
    "intensity: [0.5, 1.5, 2.5]"

/* The rim light behind the key's shadow, alone or with others. */
static scene rim_in_key(unsigned others)
{
    scene rim = truth(SCENE_RIM, 0), s = truth(others, others);
    for (int c = 0; c < 3; c++)
        for (size_t i = 0; i < s.n; i++)
            s.plane[SCENE_COLOR + c][i] += rim.plane[SCENE_COLOR + c][i] * rim.plane[SCENE_SHADOW][i];
    scene_free(&rim);
    return s;
}

static void test_shadows(void **state)
{
    (void)state;
    expect_lights("lights: {rim: {" RIM "}, key: {" KEY "}}\n",
                  truth(SCENE_KEY | SCENE_RIM, 3)); /* another order */
    expect_lights("lights: {key: {" KEY ", enabled: false}, rim: {" RIM "}}\n", truth(SCENE_RIM, 3));
    expect_lights("lights: {key: {" KEY ", shadow: none}, rim: {" RIM "}}\n",
                  truth(SCENE_KEY | SCENE_RIM, SCENE_RIM));
    expect_lights("lights: {lamp: {" KEY "}}\n", truth(SCENE_KEY, 0)); /* no layer of that name */
    expect_lights("lights: {lamp: {" KEY ", shadow: key}}\n", truth(SCENE_KEY, SCENE_KEY));
    capture_log_clear();
    expect_lights("lights: {rim: {" RIM ", shadow: key}}\n", rim_in_key(0));
    assert_non_null(strstr(capture_log(), "its shadow is stale")); /* it is the key's, 1.6 m away */
    expect_lights("lights: {rim: {" RIM ", shadow: key}, key: {" KEY "}}\n",
                  rim_in_key(SCENE_KEY)); /* a layer twice */
}

static void test_no_such_shadow(void **state)
{
    (void)state;
    char *pipeline = with("lights: {lamp: {" KEY ", shadow: kay}}\n");
    const char *capture = folder;
    rl_options options = {.pipeline_text = pipeline, .captures = &capture, .n_captures = 1};
    rl_session *s = NULL;
    rl_error err = {0};
    assert_int_equal(rl_session_open(&options, &s, &err), RL_E_CONFIG);
    assert_non_null(
        strstr(err.text, "light 'lamp': the capture 'cap' has no layer 'shadow.kay'; did you mean 'key'?"));
    free(pipeline);
}

static void test_renamed_layers(void **state)
{
    (void)state;
    static const capture_form renamed = {.name = "renamed",
                                         .shadows = "{two: shadow.rim, one: {channels: [shadow.key]}}",
                                         .lights = "lights: {one: {" KEY "}, two: {" RIM "}}\n"};
    scene s = truth(SCENE_KEY | SCENE_RIM, 3);
    char *own = folder_new();
    capture_write(own, &renamed, &s, 1);
    capture_manifest(own, &renamed, &s, 1);
    expect(own, capture_pipeline, s);
    folder_remove(own);
}

/* ---- camera space ---- */

static void test_camera_space(void **state)
{
    (void)state;
    static const double key[3] = SCENE_KEY_POSITION, sun[3] = SCENE_SUN_DIRECTION;
    scene_camera c = scene_camera_default();
    double p[3], d[3];
    char lights[512];
    for (int i = 0; i < 3; i++) {
        const double *row = c.view + 4 * i;
        p[i] = row[0] * key[0] + row[1] * key[1] + row[2] * key[2] + row[3];
        d[i] = row[0] * sun[0] + row[1] * sun[1] + row[2] * sun[2];
    }
    snprintf(lights, sizeof lights,
             "lights:\n"
             "  key: {type: point, space: camera, position: [%.9g, %.9g, %.9g], intensity: [3, 2, 1]}\n"
             "  sun: {type: directional, space: camera, direction: [%.9g, %.9g, %.9g], irradiance: [0.4, "
             "0.3, 0.2]}\n",
             p[0], p[1], p[2], d[0], d[1], d[2]);
    expect_lights(lights, truth(SCENE_KEY | SCENE_SUN, SCENE_KEY));
}

/* ---- working space ---- */

/* Linear Rec.709 to AP1 by Bradford's adaptation (S-2014-004 and ITU-R BT.709, ten digits). */
static const double to_ap1[9] = {0.6130974024, 0.3395231462, 0.0473794514, 0.0701937225, 0.9163538791,
                                 0.0134523985, 0.0206155929, 0.1095697729, 0.8698146342};

static double row(const double *m, const double *v)
{
    return m[0] * v[0] + m[1] * v[1] + m[2] * v[2];
}

/* Albedo and light are converted each, and multiplied in AP1. */
static scene truth_in_ap1(void)
{
    scene s = truth(SCENE_LIGHTS, 3);
    for (size_t i = 0; i < s.n; i++) {
        double a[3], e[3];
        if (!s.id[i])
            continue;
        for (int c = 0; c < 3; c++) {
            a[c] = s.plane[SCENE_ALBEDO + c][i];
            e[c] = s.plane[SCENE_COLOR + c][i] / a[c];
        }
        for (int c = 0; c < 3; c++)
            s.plane[SCENE_COLOR + c][i] = row(to_ap1 + 3 * c, a) * row(to_ap1 + 3 * c, e);
    }
    return s;
}

static void test_working_space(void **state)
{
    (void)state;
    char *pipeline = with("color: {working: ACEScg}\n");
    expect(folder, pipeline, truth_in_ap1());
    free(pipeline);
    /* a light given in ACEScg, in a graph in linear Rec.709 */
    expect_lights(
        "lights:\n  key: {type: point, position: [0.6, 1.2, -0.4], shadow: none, colorspace: ACEScg,\n"
        "        intensity: [2.5657179502, 2.0567393227, 1.1508020121]}\n",
        truth(SCENE_KEY, 0));
    /* neutral light: then the picture in AP1, taken back, is the picture in Rec.709; here in the output file
     */
    char *neutral = with(
        "color: {working: ACEScg}\nlights: {key: {type: point, position: [0.6, 1.2, -0.4], intensity: 2}}\n");
    char *output = text_replace(neutral, "type: float}", "type: float, colorspace: lin_rec709}");
    char *same = with("lights: {key: {type: point, position: [0.6, 1.2, -0.4], intensity: 2}}\n");
    float *red[2];
    for (int i = 0; i < 2; i++) {
        const char *capture = folder;
        char *out = folder_new(), *path = path_in(out, "cap.0001.exr");
        rl_options options = {.out = out, .captures = &capture, .n_captures = 1, .frames = "1"};
        static const char *const none[] = {NULL};
        options.dump = none;
        rl_error err = {0};
        rl_session *s = capture_open(folder, i ? same : output, &options);
        assert_int_equal(rl_session_run(s, NULL, NULL, &err), RL_OK);
        rl_session_close(&s);
        red[i] = calloc(72 * 48, sizeof *red[i]);
        made_read(path, 0, "R", red[i]);
        free(path);
        folder_remove(out);
    }
    for (int i = 0; i < 72 * 48; i++)
        assert_true(fabsf(red[0][i] - red[1][i]) <= 2e-6f * (1 + red[1][i]));
    free(red[0]);
    free(red[1]);
    free(neutral);
    free(output);
    free(same);
}

/* ---- without a manifest, and with half of one ---- */

#define SUN        "type: directional, direction: [-0.3, -0.9, -0.4], irradiance: [0.4, 0.3, 0.2]"
#define ALL_LIGHTS "lights: {key: {" KEY "}, rim: {" RIM "}, sun: {" SUN "}}\n"

static void test_bare(void **state)
{
    (void)state;
    static const char *const names[] = {"cap.0001.exr", "cap.####.exr", "cap.%04d.exr", "capture.yaml", ""};
    char *pipeline = with(ALL_LIGHTS);
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        char *path = path_in(folder, names[i]);
        expect(path, pipeline, truth(SCENE_LIGHTS, 3));
        free(path);
    }
    const char *two = path_in(folder, "cap.####.exr");
    rl_options options = {.pipeline_text = pipeline, .captures = &two, .n_captures = 1};
    rl_session *s = NULL;
    assert_int_equal(rl_session_open(&options, &s, NULL), RL_OK);
    assert_int_equal(rl_session_frames(s, 0), 2);
    assert_string_equal(rl_session_capture_name(s, 0), "cap");
    rl_session_close(&s);
    free((char *)two);
    free(pipeline);
}

/* A session on a capture written in the pipeline; processes frame 2 and compares; frees the scene. */
static void expect_inline(const char *lines, scene s)
{
    static const char *const images[] = {"c.color", "capture.motion"};
    char *pipeline = with(lines);
    rl_options options = {.pipeline_text = pipeline, .dump = images, .n_dump = 2};
    rl_session *r = NULL;
    rl_error err = {0};
    if (rl_session_open(&options, &r, &err) || rl_session_process(r, 0, 2, NULL, &err))
        fail_msg("%s:%d: %s", err.file, err.line, err.text);
    rl_image_view color = capture_image(r, "c.color"), motion = capture_image(r, "capture.motion");
    assert_true(capture_error(&color, &s, SCENE_COLOR, 3, 0) <= 4e-6);
    assert_true(capture_error(&motion, &s, SCENE_MOTION, 2, 0) <= 1e-6);
    rl_session_close(&r);
    scene_free(&s);
    free(pipeline);
}

#define DEGREES "45.8366236105"

/* As DESIGN 3 has it: a preset, and what it leaves open. */
static void test_preset_inline(void **state)
{
    (void)state;
    rl_str lines = {0};
    rl_str_printf(
        &lines,
        "capture: {files: \"%s/cap.####.exr\", preset: relit, name: cap, fps: 25, camera: {fov_x: " DEGREES
        "}}\n",
        folder);
    rl_str_add(&lines, ALL_LIGHTS);
    expect_inline(lines.text, truth(SCENE_LIGHTS, 3));
    rl_str_free(&lines);
}

static void test_preset_blender(void **state)
{
    (void)state;
    static const capture_form blender = {.name = "blender",
                                         .blender = true,
                                         .stencil = RL_EXR_FLOAT,
                                         .empty = 1e10,
                                         .motion_up = true,
                                         .camera = CAMERA_MANIFEST};
    scene s = truth(SCENE_LIGHTS, 0);
    const double *v = s.camera.view;
    rl_str lines = {0};
    char *own = folder_new();
    capture_write(own, &blender, &s, 2);
    rl_str_printf(
        &lines, "capture: {files: %s/cap.%%04d.exr, preset: blender, camera: {fov_x: " DEGREES ", matrix: [",
        own);
    for (int i = 0; i < 12; i++)
        rl_str_printf(&lines, "%.12g, ", v[i]);
    rl_str_add(&lines, "0, 0, 0, 1]}}\n" ALL_LIGHTS);
    expect_inline(lines.text, s);
    rl_str_free(&lines);
    folder_remove(own);
}

static void test_memory_without_name(void **state)
{
    (void)state;
    char *pipeline = with("capture: {files: memory, preset: relit}\nlights: {sun: {" SUN "}}\n");
    rl_options options = {.pipeline_text = pipeline};
    rl_session *r = NULL;
    rl_error err = {0};
    if (rl_session_open(&options, &r, &err))
        fail_msg("%s:%d: %s", err.file, err.line, err.text);
    assert_string_equal(rl_session_capture_name(r, 0), "memory");
    rl_session_close(&r);
    free(pipeline);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_paths),          cmocka_unit_test(test_removing_nothing),
        cmocka_unit_test(test_no_light),       cmocka_unit_test(test_photometric),
        cmocka_unit_test(test_sphere),         cmocka_unit_test(test_shadows),
        cmocka_unit_test(test_no_such_shadow), cmocka_unit_test(test_renamed_layers),
        cmocka_unit_test(test_camera_space),   cmocka_unit_test(test_working_space),
        cmocka_unit_test(test_bare),           cmocka_unit_test(test_preset_inline),
        cmocka_unit_test(test_preset_blender), cmocka_unit_test(test_memory_without_name),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
