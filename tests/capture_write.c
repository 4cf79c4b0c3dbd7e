#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "tests/capture_write.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/tool_run.h"

enum { MOST = 3, LAYERS = 8 };

static const struct {
    const char *name;
    int plane, n;
    const char *full[MOST], *bare[MOST]; /* channels where layers share a file, and where each has its own */
} layers[LAYERS] = {
    {"albedo", SCENE_ALBEDO, 3, {"albedo.R", "albedo.G", "albedo.B"}, {"R", "G", "B"}},
    {"normal", SCENE_NORMAL, 3, {"normal.X", "normal.Y", "normal.Z"}, {"X", "Y", "Z"}},
    {"depth", SCENE_DEPTH, 1, {"depth.Z"}, {"Z"}},
    {"stencil", -1, 1, {"stencil.ID"}, {"ID"}},
    {"thickness", SCENE_THICKNESS, 1, {"thickness.T"}, {"T"}},
    {"motion", SCENE_MOTION, 2, {"motion.X", "motion.Y"}, {"X", "Y"}},
    {"shadow.key", SCENE_SHADOW, 1, {"shadow.key"}, {"V"}},
    {"shadow.rim", SCENE_SHADOW + 1, 1, {"shadow.rim"}, {"V"}},
};

static double metres(const capture_form *f)
{
    return f->metres > 0 ? f->metres : 1;
}

static int channels_of(const capture_form *f, int layer)
{
    return layer == 1 && f->normal == NORMAL_OCTAHEDRAL ? 2 : layers[layer].n;
}

/* ---- from the scene to the file's numbers -------------------------------------------------------------------- */

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
        return z / metres(f);
    if (f->depth == DEPTH_RADIAL)
        return z * ray / metres(f);
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
    for (int c = 0; c < layers[layer].n && layers[layer].plane >= 0; c++)
        in[c] = s->plane[layers[layer].plane + c][i];
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
        out[0] = f->ids ? f->stencil == RL_EXR_UINT ? (double)f->ids[s->id[i]] : (double)(int32_t)f->ids[s->id[i]]
                        : (double)s->id[i];
        break;
    case 4:
        out[0] = in[0] / metres(f);
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

/* ---- to the file's types --------------------------------------------------------------------------------------- */

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
    int n = channels_of(f, layer);
    double *plane[MOST];
    for (int c = 0; c < MOST; c++)
        plane[c] = calloc(s->n, sizeof **plane);
    for (size_t i = 0; i < s->n; i++) {
        double out[MOST];
        encode_pixel(f, s, layer, i, out);
        for (int c = 0; c < n; c++)
            plane[c][i] = out[c];
    }
    if (f->spoil)
        f->spoil(layers[layer].name, plane, n, s->n);
    for (int c = 0; c < n; c++, d->n++) {
        rl_exr_pixel type = type_of(f, layer);
        d->channel[d->n] = (made_channel){.name = bare ? layers[layer].bare[c] : layers[layer].full[c],
                                          .type = type,
                                          .pixels = narrow(plane[c], s->n, type)};
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

/* ---- files ------------------------------------------------------------------------------------------------------- */

/* World to camera in the file's convention and unit, rows listed, column vectors. */
static void file_matrix(const capture_form *f, const scene_camera *c, double m[16])
{
    for (int i = 0; i < 12; i++)
        m[i] = c->view[i] * (i % 4 == 3 ? 1 / metres(f) : 1) * (i >= 8 && f->forward_z ? -1 : 1);
    m[12] = m[13] = m[14] = 0;
    m[15] = 1;
}

static void fill_header(const capture_form *f, const scene_camera *c, float matrix[16], float jitter[2], made_header *h)
{
    double m[16];
    file_matrix(f, c, m);
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
        snprintf(path, sizeof path, "%s/%s.%04d.exr", folder, layers[i].name, frame);
        parts[i] = part_of(f, s, &d[i], &header);
        parts[i].name = layers[i].name;
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

/* ---- the manifest -------------------------------------------------------------------------------------------------- */

static void print_numbers(rl_str *y, const double *v, int n)
{
    for (int i = 0; i < n; i++)
        rl_str_printf(y, "%s%.17g", i ? ", " : "[", v[i]);
    rl_str_add(y, "]");
}

static void print_camera(rl_str *y, const capture_form *f, const scene *s, int n)
{
    rl_str_printf(y, "camera:\n  forward: %s\n  matrix: %s", f->forward_z ? "+z" : "-z",
                  f->camera == CAMERA_HEADER ? "header" : f->camera == CAMERA_LIST ? "[" : "");
    for (int i = 0; i < (f->camera == CAMERA_HEADER ? 0 : f->camera == CAMERA_LIST ? n : 1); i++) {
        double m[16];
        file_matrix(f, &s[i].camera, m);
        rl_str_add(y, i ? ", " : "");
        print_numbers(y, m, 16);
    }
    rl_str_printf(y, "%s\n  fov_x: %s", f->camera == CAMERA_LIST ? "]" : "",
                  f->fov <= FOV_WINDOW ? "header" : f->fov == FOV_LIST ? "[" : "");
    for (int i = 0; i < (f->fov == FOV_LIST ? n : f->fov == FOV_MANIFEST); i++)
        rl_str_printf(y, "%s%.17g", i ? ", " : "", s[i].camera.fov_x * 180 / 3.14159265358979323846);
    rl_str_printf(y, "%s\n  jitter: ", f->fov == FOV_LIST ? "]" : "");
    if (f->jitter_in_manifest)
        print_numbers(y, s->camera.jitter, 2);
    else
        rl_str_add(y, "header");
    rl_str_add(y, "\n");
}

static void print_keys(rl_str *y, const capture_form *f, int layer)
{
    static const char *const encodings[] = {"signed", "unsigned", "octahedral"}, *const kinds[] = {"planar", "radial", "device"},
                             *const units[] = {"pixels", "uv", "ndc"};
    switch (layer) {
    case 0:
        rl_str_printf(y, ", colorspace: %s", f->colorspace ? f->colorspace : "lin_rec709");
        break;
    case 1:
        rl_str_printf(y, ", space: %s, encoding: %s", f->normal_camera ? "camera" : "world", encodings[f->normal]);
        break;
    case 2:
        rl_str_printf(y, ", kind: %s", kinds[f->depth]);
        if (f->depth == DEPTH_DEVICE && isinf(f->far))
            rl_str_printf(y, ", near: %.17g, far: .inf, reversed: %s", f->near / metres(f), f->reversed ? "true" : "false");
        else if (f->depth == DEPTH_DEVICE)
            rl_str_printf(y, ", near: %.17g, far: %.17g, reversed: %s", f->near / metres(f), f->far / metres(f),
                          f->reversed ? "true" : "false");
        if (f->empty_key)
            rl_str_printf(y, ", empty: %s", f->empty_key);
        break;
    case 4:
        if (f->remap[1] > 0) {
            rl_str_add(y, ", remap: ");
            print_numbers(y, f->remap, 2);
        }
        break;
    case 5:
        rl_str_printf(y, ", unit: %s, points: %s, y: %s", units[f->motion], f->motion_next ? "next" : "previous",
                      f->motion_up ? "up" : "down");
        break;
    default:
        break;
    }
}

static void print_layers(rl_str *y, const capture_form *f)
{
    rl_str_add(y, "layers:\n");
    for (int i = 0; i < LAYERS; i++) {
        if (i >= 6 && f->shadows)
            continue;
        if (i == 6)
            rl_str_add(y, "  shadow:\n");
        rl_str_printf(y, i < 6 ? "  %s: {channels: [" : "    %.3s: {channels: [", layers[i].name + (i < 6 ? 0 : 7));
        for (int c = 0; c < channels_of(f, i); c++)
            rl_str_printf(y, "%s\"%s\"", c ? ", " : "", f->files == FILES_ONE ? layers[i].full[c] : layers[i].bare[c]);
        rl_str_add(y, "]");
        print_keys(y, f, i);
        if (f->files == FILES_PARTS)
            rl_str_printf(y, ", part: %s", layers[i].name);
        rl_str_add(y, "}\n");
    }
    rl_str_printf(y, f->shadows ? "  shadow: %s\n" : "%s", f->shadows ? f->shadows : "");
}

static void print_files(rl_str *y, const capture_form *f)
{
    if (f->files != FILES_LAYERS) {
        rl_str_add(y, "files: cap.####.exr\n");
        return;
    }
    rl_str_add(y, "files:\n");
    for (int i = 0; i < LAYERS; i++)
        rl_str_printf(y, "  %s: %s.%%04d.exr\n", layers[i].name, layers[i].name);
}

static void print_lights(rl_str *y, const capture_form *f)
{
    static const double key[] = SCENE_KEY_POSITION, rim[] = SCENE_RIM_POSITION, axis[] = SCENE_RIM_DIRECTION,
                        sun[] = SCENE_SUN_DIRECTION;
    static const double power[3][3] = {SCENE_KEY_INTENSITY, SCENE_RIM_INTENSITY, SCENE_SUN_IRRADIANCE};
    double p[3];
    if (f->no_lights || f->lights) {
        rl_str_add(y, f->lights ? f->lights : "");
        return;
    }
    for (int i = 0; i < 3; i++)
        p[i] = key[i] / metres(f);
    rl_str_add(y, "lights:\n  key: {type: point, position: ");
    print_numbers(y, p, 3);
    rl_str_add(y, ", intensity: ");
    print_numbers(y, power[0], 3);
    for (int i = 0; i < 3; i++)
        p[i] = rim[i] / metres(f);
    rl_str_add(y, "}\n  rim: {type: spot, position: ");
    print_numbers(y, p, 3);
    rl_str_add(y, ", direction: ");
    print_numbers(y, axis, 3);
    rl_str_printf(y, ", angle: %g, blend: %g, intensity: ", SCENE_RIM_ANGLE, SCENE_RIM_BLEND);
    print_numbers(y, power[1], 3);
    rl_str_add(y, "}\n  sun: {type: directional, direction: ");
    print_numbers(y, sun, 3);
    rl_str_add(y, ", irradiance: ");
    print_numbers(y, power[2], 3);
    rl_str_add(y, "}\n");
}

void capture_manifest(const char *folder, const capture_form *f, const scene *s, int n)
{
    rl_str y = {0};
    rl_str_printf(&y, "relit_capture: 1\nname: %s\nunit: %s\n", f->title ? f->title : "cap", f->unit ? f->unit : "m");
    print_files(&y, f);
    print_camera(&y, f, s, n);
    print_layers(&y, f);
    print_lights(&y, f);
    rl_str_printf(&y, f->frames ? "frames: %s\n" : "%s", f->frames ? f->frames : "");
    rl_str_printf(&y, f->stencil_names ? "stencil_names: %s\n" : "%s", f->stencil_names ? f->stencil_names : "");
    rl_str_add(&y, f->extra ? f->extra : "");
    assert_false(y.failed);
    file_write(folder, "capture.yaml", y.text, y.length);
    rl_str_free(&y);
}
