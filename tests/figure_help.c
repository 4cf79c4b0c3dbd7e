#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "graph/run/exr.h"
#include "tests/figure_help.h"

extern const rl_pass rl_pass_lighting, rl_pass_combine;

/* ---- a frame ----------------------------------------------------------------------------------------------
 */

/* Channels of the capture by port and plane. */
static const struct {
    const char *channel;
    int port, plane;
} channels[] = {{"albedo.R", LIGHTING_ALBEDO, 0},
                {"albedo.G", LIGHTING_ALBEDO, 1},
                {"albedo.B", LIGHTING_ALBEDO, 2},
                {"normal.X", LIGHTING_NORMAL, 0},
                {"normal.Y", LIGHTING_NORMAL, 1},
                {"normal.Z", LIGHTING_NORMAL, 2},
                {"depth.Z", LIGHTING_DEPTH, 0},
                {"thickness.T", LIGHTING_THICKNESS, 0},
                {"shadow.key", LIGHTING_SHADOW, 0},
                {"shadow.rim", LIGHTING_SHADOW, 1},
                {"shadow.fill", LIGHTING_SHADOW, 2},
                {"shadow_thickness.key", LIGHTING_SHADOW_THICKNESS, 0},
                {"shadow_thickness.rim", LIGHTING_SHADOW_THICKNESS, 1},
                {"shadow_thickness.fill", LIGHTING_SHADOW_THICKNESS, 2},
                {"roughness.R", LIGHTING_ROUGHNESS, 0},
                {"stencil.ID", LIGHTING_STENCIL, 0}};
enum { CHANNELS = sizeof channels / sizeof *channels };

static void read_channels(figure_frame *f, const rl_exr *file)
{
    rl_exr_plane planes[CHANNELS] = {0};
    rl_error err = {0};
    for (size_t i = 0; i < CHANNELS; i++) {
        shade_image *image = &f->images[channels[i].port];
        if (!image->data)
            *image = shade_image_new(&f->frame, 3);
        assert_non_null(image->data);
        float *at = shade_at(image, &f->frame, channels[i].plane, f->frame.valid[0], f->frame.valid[1]);
        planes[i].channel = channels[i].channel;
        planes[i].stride = (size_t)f->frame.stride;
        if (channels[i].port == LIGHTING_STENCIL)
            planes[i].ids = (uint32_t *)(void *)at;
        else
            planes[i].floats = at;
    }
    if (rl_exr_read(file, 0, planes, CHANNELS, NULL, NULL, &err))
        fail_msg("%s", err.text);
}

/* Empty pixels have no material; normals are of unit length. */
static void clean(figure_frame *f)
{
    for (int y = f->frame.valid[1]; y < f->frame.valid[3]; y++) {
        for (int x = f->frame.valid[0]; x < f->frame.valid[2]; x++) {
            float *z = shade_at(&f->images[LIGHTING_DEPTH], &f->frame, 0, x, y), *n[3];
            if (!(*z > 0 && *z < 1e10f)) {
                *z = 0;
                shade_set_id(&f->images[LIGHTING_STENCIL], &f->frame, x, y, 0);
            }
            double length = 0;
            for (int c = 0; c < 3; c++) {
                n[c] = shade_at(&f->images[LIGHTING_NORMAL], &f->frame, c, x, y);
                length += (double)*n[c] * (double)*n[c];
            }
            for (int c = 0; c < 3 && length > 0; c++)
                *n[c] = (float)((double)*n[c] / sqrt(length));
        }
    }
}

/* Camera to world by cofactors: the header's floats are not quite a rotation. */
static void invert(const double m[16], camera_t *c)
{
    double cofactor[3][3], det = 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            int a = (i + 1) % 3, b = (i + 2) % 3, p = (j + 1) % 3, q = (j + 2) % 3;
            cofactor[i][j] = m[4 * a + p] * m[4 * b + q] - m[4 * a + q] * m[4 * b + p];
        }
    for (int j = 0; j < 3; j++)
        det += m[j] * cofactor[0][j];
    for (int i = 0; i < 3; i++) {
        double back = 0;
        for (int j = 0; j < 3; j++) {
            c->to_world[4 * i + j] = (float)(cofactor[i][j] / det);
            back -= cofactor[i][j] / det * m[12 + j];
        }
        c->to_world[4 * i + 3] = (float)back;
    }
}

/* worldToCamera is for row vectors: its upper three columns give view space, its last row the way there. */
static void set_camera(camera_t *c, const rl_exr *file, int width, int height)
{
    rl_exr_value m, fov, jitter;
    assert_true(rl_exr_attr(file, 0, "worldToCamera", &m) && m.type == RL_EXR_T_M44F);
    assert_true(rl_exr_attr(file, 0, "camera:fovx", &fov) && rl_exr_attr(file, 0, "camera:jitter", &jitter));
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++)
            c->to_view[4 * i + j] = (float)m.v[4 * j + i];
    invert(m.v, c);
    c->focal[0] = c->focal[1] = (float)(0.5 * width / tan(0.5 * fov.v[0]));
    c->centre[0] = 0.5f * (float)width;
    c->centre[1] = 0.5f * (float)height;
    c->jitter[0] = (float)jitter.v[0];
    c->jitter[1] = (float)jitter.v[1];
}

/* As captures/monkey/capture.yaml has them. */
static const light_t lights[3] = {
    {.type = LIGHT_POINT, .position = {-0.5f, -0.52f, 0.47f}, .intensity = {2.2f, 2.024f, 1.804f}},
    {.type = LIGHT_POINT, .position = {0.165f, 0.12f, 0.055f}, .intensity = {0.28f, 0.2716f, 0.2604f}},
    {.type = LIGHT_POINT, .position = {0.7f, -0.75f, 0.18f}, .intensity = {0.2016f, 0.238f, 0.28f}}};

void figure_frame_read(figure_frame *f, int number)
{
    static const rl_pass *const passes[] = {&rl_pass_lighting, &rl_pass_combine};
    static const bool scatters[7] = {false, true, false, true, true, false, true};
    char path[256];
    rl_exr *file = NULL;
    rl_error err = {0};
    memset(f, 0, sizeof *f);
    snprintf(path, sizeof path, FIGURE_CAPTURE "/monkey.%04d.exr", number);
    if (rl_exr_open(path, 0, &file, &err))
        fail_msg("%s: %s", path, err.text);
    const rl_exr_part *part = rl_exr_part_at(file, 0);
    assert_true(part->data_window.x0 == 0 && part->data_window.y0 == 0);
    f->frame = shade_frame(part->width, part->height, 0, 0);
    read_channels(f, file);
    set_camera(&f->frame.camera, file, part->width, part->height);
    rl_exr_close(&file);
    clean(f);
    memcpy(f->lights, lights, sizeof lights);
    for (int i = 0; i < 3; i++)
        f->lights[i].shadow = f->lights[i].shadow_thickness = i;
    f->frame.lights = 3;
    f->materials.passes = passes;
    f->materials.n_passes = 2;
    for (int i = 1; i <= 6; i++)
        assert_int_equal(shade_material_add(&f->materials, scatters[i]), i);
    f->frame.materials = (int)f->materials.n;
}

void figure_frame_free(figure_frame *f)
{
    for (int i = 0; i < LIGHTING_PORTS; i++)
        shade_image_free(&f->images[i]);
}

shade_run figure_lighting(const figure_frame *f)
{
    shade_run run = {
        .pass = &rl_pass_lighting, .frame = f->frame, .materials = &f->materials, .lights = f->lights};
    for (int i = 0; i < LIGHTING_PORTS; i++)
        run.images[i] = f->images[i].data ? &f->images[i] : NULL;
    return run;
}

shade_run figure_combine(const figure_frame *f)
{
    shade_run run = {.pass = &rl_pass_combine, .frame = f->frame, .materials = &f->materials};
    run.images[COMBINE_ALBEDO] = &f->images[LIGHTING_ALBEDO];
    run.images[COMBINE_NORMAL] = &f->images[LIGHTING_NORMAL];
    run.images[COMBINE_DEPTH] = &f->images[LIGHTING_DEPTH];
    run.images[COMBINE_STENCIL] = &f->images[LIGHTING_STENCIL];
    return run;
}

/* ---- the engine -------------------------------------------------------------------------------------------
 */

rl_session *figure_open(const char *pipeline, rl_setting set)
{
    static rl_setting kept; /* lives as long as the session */
    kept = set;
    rl_options options = {.pipeline_text = pipeline, .settings = &kept, .n_settings = kept.path ? 1 : 0};
    rl_session *s = NULL;
    rl_error err = {0};
    if (rl_session_open(&options, &s, &err))
        fail_msg("%s:%d: %s", err.file, err.line, err.text);
    return s;
}

void figure_process(rl_session *s, long long frame, const rl_frame_data *data)
{
    rl_error err = {0};
    if (rl_session_process(s, 0, frame, data, &err))
        fail_msg("%s:%d: %s", err.file, err.line, err.text);
}

rl_image_view figure_image(rl_session *s, const char *name)
{
    rl_image_view view;
    rl_error err = {0};
    if (rl_session_image(s, name, &view, &err))
        fail_msg("%s", err.text);
    return view;
}

/* ---- statistics
 * -------------------------------------------------------------------------------------------- */

void figure_add(figure_errors *e, double value)
{
    assert_true(isfinite(value));
    if (e->n == e->room) {
        e->room = e->room ? 2 * e->room : 1 << 16;
        e->values = realloc(e->values, e->room * sizeof *e->values);
        assert_non_null(e->values);
    }
    e->values[e->n++] = value;
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

double figure_percentile(figure_errors *e, double p)
{
    assert_true(e->n > 0);
    qsort(e->values, e->n, sizeof *e->values, by_size);
    return e->values[(size_t)(p * (double)(e->n - 1) + 0.5)];
}

void figure_errors_free(figure_errors *e)
{
    free(e->values);
    *e = (figure_errors){0};
}
