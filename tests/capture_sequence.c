#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/capture_sequence.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "tests/tool_run.h"

const char sequence_with_taa[] = "relit: 1\n"
                                 "shading: {diffuse: lambert, specular: none}\n"
                                 "materials: {default: {}}\n"
                                 "graph:\n"
                                 "  light: {pass: lighting}\n"
                                 "  c: {pass: combine, in: {diffuse: light.diffuse, lit: light.lit}}\n"
                                 "  aa: {pass: taa, in: {color: c.color}, blend: 0.1}\n"
                                 "outputs:\n"
                                 "  o: {image: aa.color, file: \"{capture}.{frame:04}.exr\", type: float}\n";

/* Scenes of frames 1…n, the camera a little further each time, and their files. */
char *sequence_make(const capture_form *f, scene *s, int n)
{
    char *folder = folder_new();
    for (int i = 0; i < n; i++) {
        scene_camera c = scene_camera_default();
        c.view[3] += 0.02 * i;
        s[i] = scene_make(&c, SCENE_LIGHTS, SCENE_KEY | SCENE_RIM);
        capture_write(folder, f, &s[i], i + 1);
    }
    capture_manifest(folder, f, s, n);
    return folder;
}

void sequence_leave(char *folder, scene *s, int n)
{
    for (int i = 0; i < n; i++)
        scene_free(&s[i]);
    folder_remove(folder);
}

void sequence_remove(const char *folder, int frame)
{
    char path[512];
    snprintf(path, sizeof path, "%s/cap.%04d.exr", folder, frame);
    assert_int_equal(unlink(path), 0);
}

static void note(void *ctx, const rl_frame_result *r)
{
    sequence_outcome *o = ctx;
    o->code[r->frame] = r->error->code;
    o->files[r->frame] = (int)r->n_files;
    o->nonfinite[r->frame] = r->nonfinite;
    o->clamped[r->frame] = r->clamped;
    snprintf(o->text[r->frame], sizeof o->text[0], "%.500s: %.1000s", r->error->file, r->error->text);
}

/* Where a run writes unless told otherwise: outputs have the names of the capture's files. */
const char *sequence_out(const char *folder)
{
    static char path[512];
    snprintf(path, sizeof path, "%s/out", folder);
    return path;
}

void sequence_run(const char *folder, const char *pipeline, rl_options options, sequence_outcome *o)
{
    static const char *const none[] = {"c.color"};
    rl_error err = {0};
    rl_run_hooks hooks = {.frame = note, .ctx = o};
    memset(o, 0, sizeof *o);
    options.dump = none;
    options.out = options.out ? options.out : sequence_out(folder);
    rl_session *s = capture_open(folder, pipeline, &options);
    if (rl_session_run(s, &hooks, &o->summary, &err))
        fail_msg("%s", err.text);
    rl_session_close(&s);
}

/* The red plane of an output, malloc'ed. */
static float *red(const char *folder, const char *name, size_t pixels)
{
    char path[512];
    float *out = calloc(pixels, sizeof *out);
    snprintf(path, sizeof path, "%s/%s", folder, name);
    made_read(path, 0, "R", out);
    return out;
}

/* The largest difference from the truth, relative to its maximum. */
double sequence_off(const char *folder, const char *name, const scene *truth)
{
    double worst = 0, most = 0;
    float *r = red(folder, name, truth->n);
    for (size_t i = 0; i < truth->n; i++) {
        double d = fabs((double)r[i] - truth->plane[SCENE_COLOR][i]);
        worst = d > worst || isnan(d) ? d : worst;
        most = fmax(most, truth->plane[SCENE_COLOR][i]);
    }
    free(r);
    return worst / most;
}
