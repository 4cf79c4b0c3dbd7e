#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/capture_run.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/tool_run.h"

const char capture_pipeline[] = "relit: 1\n"
                                "shading: {diffuse: lambert, specular: none}\n"
                                "materials: {default: {}}\n"
                                "graph:\n"
                                "  light: {pass: lighting}\n"
                                "  c: {pass: combine, in: {diffuse: light.diffuse, lit: light.lit}}\n"
                                "outputs:\n"
                                "  o: {image: c.color, file: \"{capture}.{frame:04}.exr\", type: float}\n";

static char *cache;
static rl_str said;

static void hear(void *ctx, rl_severity severity, rl_where where, const char *text)
{
    (void)ctx;
    if (severity == RL_WARNING)
        rl_str_printf(&said, "%s: %s\n", where.file ? where.file : "", text);
}

const rl_log capture_logger = {.sink = hear};

bool capture_start(void)
{
    cache = folder_new();
    return cache && !setenv("RELIT_CACHE", cache, 1);
}

void capture_stop(void)
{
    folder_remove(cache);
    rl_str_free(&said);
}

int capture_setup(void **state)
{
    (void)state;
    return capture_start() ? 0 : -1;
}

int capture_teardown(void **state)
{
    (void)state;
    capture_stop();
    return 0;
}

char *capture_lit(const capture_form *form, int frames)
{
    scene_camera c = scene_camera_default();
    scene s = scene_make(&c, SCENE_LIGHTS, SCENE_KEY | SCENE_RIM);
    char *folder = folder_new();
    for (int i = 1; i <= frames; i++)
        capture_write(folder, form, &s, i);
    capture_manifest(folder, form, &s, 1);
    scene_free(&s);
    return folder;
}

const char *capture_log(void)
{
    return rl_str_text(&said);
}

void capture_log_clear(void)
{
    rl_str_free(&said);
}

rl_session *capture_open(const char *path, const char *pipeline, const rl_options *more)
{
    static const char *const dump[] = {"c.color",          "capture.depth",  "capture.normal",
                                       "capture.stencil",  "capture.albedo", "capture.motion",
                                       "capture.thickness"};
    rl_options options = more ? *more : (rl_options){0};
    rl_session *s = NULL;
    rl_error err = {0};
    if (!options.n_captures) {
        options.captures = &path;
        options.n_captures = 1;
    }
    if (!options.dump) {
        options.dump = dump;
        options.n_dump = 7;
    }
    options.pipeline_text = pipeline;
    options.threads = options.threads ? options.threads : 2;
    options.log = &capture_logger;
    if (rl_session_open(&options, &s, &err))
        print_error("%s:%d:%d: %s\n", err.file, err.line, err.column, err.text);
    assert_non_null(s);
    return s;
}

rl_image_view capture_image(rl_session *s, const char *name)
{
    rl_image_view view;
    rl_error err = {0};
    if (rl_session_image(s, name, &view, &err))
        print_error("%s\n", err.text);
    assert_int_equal(err.code, RL_OK);
    return view;
}

double capture_error(const rl_image_view *image, const scene *truth, int plane, int planes, double scale)
{
    double worst = 0, most = 0;
    assert_int_equal(image->width, truth->width);
    assert_int_equal(image->height, truth->height);
    assert_int_equal(image->x, truth->camera.data[0]);
    assert_int_equal(image->y, truth->camera.data[1]);
    for (int c = 0; c < planes; c++) {
        for (size_t i = 0; i < truth->n; i++) {
            double t = truth->plane[plane + c][i];
            double v =
                (double)image->plane[c][i / (size_t)truth->width * image->stride + i % (size_t)truth->width];
            if (plane == SCENE_NORMAL && !truth->id[i])
                continue;
            double d = fabs(v - t);
            worst = d > worst || isnan(d) ? d : worst;
            most = fabs(t) > most ? fabs(t) : most;
        }
    }
    return worst / (scale > 0 ? scale : most);
}
