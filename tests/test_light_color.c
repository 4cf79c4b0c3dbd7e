/* A light's temperature on its way to the picture, whichever colour space it is given in. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "graph/model/temperature.h"
#include "tests/capture_run.h"
#include "tests/tool_run.h"

static const capture_form plain = {.name = "plain", .compression = RL_EXR_ZIP};
static char *folder;

static int setup(void **state)
{
    (void)state;
    if (!capture_start())
        return -1;
    folder = capture_lit(&plain, 1);
    return 0;
}

static int teardown(void **state)
{
    (void)state;
    folder_remove(folder);
    capture_stop();
    return 0;
}

/* The picture by `lights` is the scene's, whose key light has 3, 2, 1 W/sr. */
static void expect(const char *lights)
{
    static const char *const color[] = {"c.color"};
    const rl_options options = {.dump = color, .n_dump = 1};
    char pipeline[4096];
    assert_true(strlen(capture_pipeline) + strlen(lights) < sizeof pipeline);
    strcat(strcpy(pipeline, capture_pipeline), lights);
    scene_camera c = scene_camera_default();
    scene s = scene_make(&c, SCENE_KEY, SCENE_KEY);
    rl_error err = {0};
    rl_session *r = capture_open(folder, pipeline, &options);
    if (rl_session_process(r, 0, 1, NULL, &err))
        fail_msg("%s: %s", err.file, err.text);
    rl_image_view view = capture_image(r, "c.color");
    double off = capture_error(&view, &s, SCENE_COLOR, 3, 0);
    if (!(off <= 4e-6))
        fail_msg("off by %g", off);
    rl_session_close(&r);
    scene_free(&s);
}

/* Amounts that the factors of the temperature bring back to 3, 2, 1 in linear Rec.709. */
static void test_rec709(void **state)
{
    (void)state;
    static const double same[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    double f[3];
    char lights[512];
    rl_kelvin_rgb(3000, 0.004, same, f);
    snprintf(
        lights, sizeof lights,
        "lights: {key: {type: point, position: [0.6, 1.2, -0.4], temperature: 3000, tint: 0.004, intensity: "
        "[%.12g, %.12g, %.12g]}}\n",
        3 / f[0], 2 / f[1], 1 / f[2]);
    expect(lights);
}

/* The same in ACEScg, with the ACES project's matrices between AP1 and Rec.709 (Bradford from D60 to D65). */
static void test_acescg(void **state)
{
    (void)state;
    static const double to_rec709[9] = {1.70505099,  -0.62179212, -0.08325887, -0.13025642, 1.14080474,
                                        -0.01054832, -0.02400336, -0.12896898, 1.15297233};
    static const double in_ap1[3] = {2.5657179502, 2.0567393227, 1.1508020121}; /* 3, 2, 1 in Rec.709 */
    double f[3];
    char lights[512];
    rl_kelvin_rgb(3000, 0, to_rec709, f);
    snprintf(lights, sizeof lights,
             "lights: {key: {type: point, position: [0.6, 1.2, -0.4], temperature: 3000, colorspace: ACEScg, "
             "intensity: [%.12g, %.12g, %.12g]}}\n",
             in_ap1[0] / f[0], in_ap1[1] / f[1], in_ap1[2] / f[2]);
    expect(lights);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_rec709), cmocka_unit_test(test_acescg)};
    return cmocka_run_group_tests(tests, setup, teardown);
}
