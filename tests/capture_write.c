#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/capture_parts.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define V "ViewLayer."
const layer_names capture_layers[LAYERS] = {
    {"albedo",
     SCENE_ALBEDO,
     3,
     {"albedo.R", "albedo.G", "albedo.B"},
     {"R", "G", "B"},
     {V "DiffCol.R", V "DiffCol.G", V "DiffCol.B"}},
    {"normal",
     SCENE_NORMAL,
     3,
     {"normal.X", "normal.Y", "normal.Z"},
     {"X", "Y", "Z"},
     {V "Normal.X", V "Normal.Y", V "Normal.Z"}},
    {"depth", SCENE_DEPTH, 1, {"depth.Z"}, {"Z"}, {V "Depth.Z"}},
    {"stencil", -1, 1, {"stencil.ID"}, {"ID"}, {V "IndexMA.X"}},
    {"thickness", SCENE_THICKNESS, 1, {"thickness.T"}, {"T"}, {0}},
    {"motion", SCENE_MOTION, 2, {"motion.X", "motion.Y"}, {"X", "Y"}, {V "Vector.X", V "Vector.Y"}},
    {"shadow.key", SCENE_SHADOW, 1, {"shadow.key"}, {"V"}, {0}},
    {"shadow.rim", SCENE_SHADOW + 1, 1, {"shadow.rim"}, {"V"}, {0}},
};
#undef V

double capture_metres(const capture_form *f)
{
    return f->metres > 0 ? f->metres : 1;
}

int capture_channels(const capture_form *f, int layer)
{
    return layer == 1 && f->normal == NORMAL_OCTAHEDRAL ? 2 : capture_layers[layer].n;
}

/* ---- from the scene to the file's numbers ---- */

static void encode_normal(const capture_form *f, const scene *s, const double *n, double *out)
{
    double v[3];
    for (int i = 0; i < 3; i++) {
        const double *row = s->camera.view + 4 * i;
        v[i] = f->normal_camera ? row[0] * n[0] + row[1] * n[1] + row[2] * n[2] : n[i];
    }
    if (f->normal_camera && f->forward_z)
        v[2] = -v[2];
    if (f->normal == NORMAL_OCTAHEDRAL) { /* Cigolle et al. 2014 */
        double l1 = fabs(v[0]) + fabs(v[1]) + fabs(v[2]);
        double x = l1 > 0 ? v[0] / l1 : 0, y = l1 > 0 ? v[1] / l1 : 0;
        out[0] = v[2] < 0 ? (1 - fabs(y)) * (x < 0 ? -1 : 1) : x;
        out[1] = v[2] < 0 ? (1 - fabs(x)) * (y < 0 ? -1 : 1) : y;
        return;
    }
    for (int i = 0; i < 3; i++)
        out[i] = f->normal == NORMAL_UNSIGNED ? v[i] * 0.5 + 0.5 : v[i];
}

static double encode_depth(const capture_form *f, double z, double ray)
{
    if (f->depth == DEPTH_PLANAR)
        return z / capture_metres(f);
    if (f->depth == DEPTH_RADIAL)
        return z * ray / capture_metres(f);
    double d = (1 / f->near - 1 / z) / (1 / f->near - 1 / f->far);
    return f->reversed ? 1 - d : d;
}

static void encode_motion(const capture_form *f, const scene *s, const double *m, double *out)
{
    for (int i = 0; i < 2; i++) {
        double size = s->camera.display[2 + i];
        out[i] = m[i] * (f->motion_next ? -1 : 1) * (i && f->motion_up ? -1 : 1);
        out[i] *= f->motion == MOTION_UV ? 1 / size : f->motion == MOTION_NDC ? 2 / size : 1;
    }
}

static void encode_pixel(const capture_form *f, const scene *s, int layer, size_t i, double *out)
{
    double in[MOST] = {0};
    for (int c = 0; c < capture_layers[layer].n && capture_layers[layer].plane >= 0; c++)
        in[c] = s->plane[capture_layers[layer].plane + c][i];
    memcpy(out, in, sizeof in);
    switch (layer) {
    case 0:
        if (f->encode)
            f->encode(in, out);
        break;
    case 1:
        encode_normal(f, s, in, out);
        break;
    case 2:
        out[0] = s->id[i] ? encode_depth(f, in[0], s->plane[SCENE_RAY][i]) : f->empty;
        break;
    case 3:
        out[0] =
            f->ids ? f->stencil == RL_EXR_UINT ? (double)f->ids[s->id[i]] : (double)(int32_t)f->ids[s->id[i]]
                   : (double)s->id[i];
        break;
    case 4:
        out[0] = in[0] / capture_metres(f);
        if (f->remap[1] > 0)
            out[0] = (out[0] - f->remap[0]) / (f->remap[1] - f->remap[0]);
        break;
    case 5:
        encode_motion(f, s, in, out);
        break;
    default:
        break;
    }
}

/* ---- to the file's types ---- */

static rl_exr_pixel type_of(const capture_form *f, int layer)
{
    if (layer == 3)
        return f->stencil;
    if (layer == 2 && f->depth_uint)
        return RL_EXR_UINT;
    return f->pixel == RL_EXR_HALF ? RL_EXR_HALF : RL_EXR_FLOAT;
}

static void *narrow(const double *in, size_t n, rl_exr_pixel type)
{
    void *out = calloc(n, 4);
    for (size_t i = 0; i < n; i++) {
        if (type == RL_EXR_UINT)
            ((uint32_t *)out)[i] = (uint32_t)(in[i] + 0.5);
        else if (type == RL_EXR_HALF)
            ((uint16_t *)out)[i] = made_half((float)in[i]);
        else
            ((float *)out)[i] = (float)in[i];
    }
    return out;
}

typedef struct drawn {
    made_channel channel[LAYERS * MOST];
    int n;
} drawn;

/* `bare`: the letter alone, since the layer has a file or part for itself. */
static void draw(const capture_form *f, const scene *s, int layer, bool bare, drawn *d)
{
    int n = capture_channels(f, layer);
    const char *const *names = f->blender ? capture_layers[layer].blender
                               : bare     ? capture_layers[layer].bare
                                          : capture_layers[layer].full;
    double *plane[MOST];
    if (!names[0])
        return;
    for (int c = 0; c < MOST; c++)
        plane[c] = calloc(s->n, sizeof **plane);
    for (size_t i = 0; i < s->n; i++) {
        double out[MOST];
        encode_pixel(f, s, layer, i, out);
        for (int c = 0; c < n; c++)
            plane[c][i] = out[c];
    }
    if (f->spoil)
        f->spoil(capture_layers[layer].name, plane, n, s->n);
    for (int c = 0; c < n; c++, d->n++) {
        rl_exr_pixel type = type_of(f, layer);
        d->channel[d->n] =
            (made_channel){.name = names[c], .type = type, .pixels = narrow(plane[c], s->n, type)};
    }
    for (int c = 0; c < MOST; c++)
        free(plane[c]);
}

static int by_name(const void *a, const void *b)
{
    return strcmp(((const made_channel *)a)->name, ((const made_channel *)b)->name);
}

static made_part part_of(const capture_form *f, const scene *s, drawn *d, const made_header *header)
{
    const int *w = s->camera.data;
    qsort(d->channel, (size_t)d->n, sizeof *d->channel, by_name);
    return (made_part){.x0 = w[0],
                       .y0 = w[1],
                       .width = w[2],
                       .height = w[3],
                       .compression = f->compression,
                       .tile = f->tile,
                       .header = header,
                       .channels = d->channel,
                       .n_channels = d->n};
}

static void release(drawn *d)
{
    for (int i = 0; i < d->n; i++)
        free((void *)d->channel[i].pixels);
    d->n = 0;
}

/* ---- files ---- */

void capture_matrix(const capture_form *f, const scene_camera *c, double m[16])
{
    for (int i = 0; i < 12; i++)
        m[i] = c->view[i] * (i % 4 == 3 ? 1 / capture_metres(f) : 1) * (i >= 8 && f->forward_z ? -1 : 1);
    m[12] = m[13] = m[14] = 0;
    m[15] = 1;
}

static void fill_header(const capture_form *f, const scene_camera *c, float matrix[16], float jitter[2],
                        made_header *h)
{
    double m[16];
    capture_matrix(f, c, m);
    for (int i = 0; i < 16; i++)
        matrix[i] = (float)m[4 * (i % 4) + i / 4];
    jitter[0] = (float)c->jitter[0];
    jitter[1] = (float)c->jitter[1];
    *h = (made_header){.aspect = (float)c->aspect,
                       .screen_width = (float)(2 * tan(c->fov_x / 2)),
                       .screen_center = {(float)c->center[0], (float)c->center[1]},
                       .matrix = f->camera == CAMERA_HEADER && !f->no_matrix ? matrix : NULL,
                       .fov_x = f->fov == FOV_HEADER ? (float)c->fov_x : 0,
                       .jitter = f->jitter_in_manifest ? NULL : jitter,
                       .fps = {f->fps[0], f->fps[1]},
                       .owner = f->owner};
    memcpy(h->display, c->display, sizeof h->display);
    if (f->time_code)
        memcpy(h->time_code, f->time_code, sizeof h->time_code);
}

void capture_write(const char *folder, const capture_form *f, const scene *s, int frame)
{
    static drawn d[LAYERS];
    float matrix[16], jitter[2];
    made_header header;
    made_part parts[LAYERS];
    char path[512];
    fill_header(f, &s->camera, matrix, jitter, &header);
    for (int i = 0; i < LAYERS; i++) {
        draw(f, s, i, f->files != FILES_ONE, &d[f->files == FILES_ONE ? 0 : i]);
        snprintf(path, sizeof path, "%s/%s.%04d.exr", folder, capture_layers[i].name, frame);
        parts[i] = part_of(f, s, &d[i], &header);
        parts[i].name = capture_layers[i].name;
        if (f->files == FILES_LAYERS) {
            parts[i].name = NULL;
            made_write(path, &parts[i], 1);
        }
    }
    snprintf(path, sizeof path, "%s/cap.%04d.exr", folder, frame);
    if (f->files == FILES_ONE) {
        parts[0] = part_of(f, s, &d[0], &header);
        made_write(path, parts, 1);
    } else if (f->files == FILES_PARTS) {
        made_write(path, parts, LAYERS);
    }
    for (int i = 0; i < LAYERS; i++)
        release(&d[i]);
}
