#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/output_run.h"

#include <stdlib.h>
#include <string.h>

#include "tests/capture_run.h"
#include "tests/tool_run.h"

const uint32_t output_ids[4] = {0, 4294967295u, 5, 70000};
static const uint32_t time_code[2] = {0x01020304, 77};
static const capture_form form = {.name = "outputs",
                                  .compression = RL_EXR_ZIP,
                                  .ids = output_ids,
                                  .time_code = time_code,
                                  .fps = {24000, 1001},
                                  .owner = "the test",
                                  .empty = 1e10,
                                  .empty_key = "1e10"};
scene output_truth;   /* data window -9,5 50x30 of the display window 0,0 72x48, shifted lens, wide pixels */
static char *capture; /* its folder */

int output_setup(void **state)
{
    (void)state;
    scene_camera c = scene_camera_default();
    const int window[4] = {-9, 5, 50, 30};
    memcpy(c.data, window, sizeof window);
    c.center[0] = 0.125;
    c.aspect = 1.25;
    if (!capture_start())
        return -1;
    output_truth = scene_make(&c, SCENE_LIGHTS, SCENE_KEY | SCENE_RIM);
    capture = folder_new();
    capture_write(capture, &form, &output_truth, 7);
    capture_manifest(capture, &form, &output_truth, 1);
    return 0;
}

int output_teardown(void **state)
{
    (void)state;
    scene_free(&output_truth);
    folder_remove(capture);
    capture_stop();
    return 0;
}

/* Runs the common pipeline with these outputs (a YAML map); the folder they are in. */
char *output_run(const char *outputs, const int *crop, rl_run_summary *summary)
{
    static const char *const none[] = {NULL};
    const char *before = strstr(capture_pipeline, "outputs:");
    rl_run_summary own;
    rl_error err = {0};
    rl_str text = {0};
    char *out = folder_new();
    const char *path = capture;
    rl_options options = {.out = out, .captures = &path, .n_captures = 1, .dump = none};
    rl_str_printf(&text, "%.*soutputs: %s\n", (int)(before - capture_pipeline), capture_pipeline, outputs);
    for (int i = 0; crop && i < 4; i++)
        options.crop[i] = crop[i];
    capture_log_clear();
    rl_session *s = capture_open(capture, text.text, &options);
    summary = summary ? summary : &own;
    if (rl_session_run(s, NULL, summary, &err))
        fail_msg("%s", err.text);
    rl_session_close(&s);
    rl_str_free(&text);
    return out;
}

rl_exr *output_open(const char *folder, const char *name)
{
    rl_exr *file = NULL;
    rl_error err = {0};
    char *path = path_in(folder, name);
    if (rl_exr_open(path, 0, &file, &err))
        fail_msg("%s: %s", path, err.text);
    free(path);
    return file;
}

/* One channel, malloc'ed, rows without gaps. */
float *output_floats(const rl_exr *file, const char *channel)
{
    const rl_exr_part *p = rl_exr_part_at(file, 0);
    float *out = calloc((size_t)p->width * (size_t)p->height, sizeof *out);
    rl_exr_plane plane = {.channel = channel, .floats = out, .stride = (size_t)p->width};
    rl_error err = {0};
    if (rl_exr_read(file, 0, &plane, 1, NULL, NULL, &err))
        fail_msg("%s: %s", channel, err.text);
    return out;
}

void output_expect_coverage(const rl_exr *file, const char *channel)
{
    float *p = output_floats(file, channel);
    for (size_t i = 0; i < output_truth.n; i++)
        assert_true(p[i] == (output_truth.id[i] ? 1 : 0));
    free(p);
}
