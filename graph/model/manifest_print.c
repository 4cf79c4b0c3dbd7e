/* A manifest as YAML, for `relit inspect` and `relit init`. */
#include "graph/model/manifest_parts.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

static void print_text(rl_str *s, const char *text)
{
    rl_value_print(&(rl_value){.kind = RL_TEXT, .text = text}, s);
}

/* 15 digits: what unit conversions add at the end of a double is not what the user wrote. */
static void print_number(rl_str *s, double x)
{
    char buf[40];
    double rounded = x;
    snprintf(buf, sizeof buf, "%.14e", x);
    rl_parse_double(buf, &rounded);
    if (isinf(x))
        rl_str_add(s, x < 0 ? "-.inf" : ".inf");
    else
        rl_str_add(s, rl_format_double(rounded, buf));
}

static void print_numbers(rl_str *s, const double *x, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        rl_str_add(s, i ? ", " : "[");
        print_number(s, x[i]);
    }
    rl_str_add(s, "]");
}

/* header, one value, or one a frame; each number divided by `unit` */
static void print_source(rl_str *s, const char *key, rl_source source, const double *x, size_t width,
                         size_t n, double unit)
{
    rl_str_printf(s, "  %s: ", key);
    if (source == RL_SOURCE_HEADER)
        rl_str_add(s, "header");
    else if (source == RL_SOURCE_LIST)
        for (size_t i = 0; i < n; i++) {
            rl_str_add(s, i ? ", " : "[");
            if (width == 1)
                print_number(s, x[i] / unit);
            else
                print_numbers(s, x + i * width, width);
        }
    else if (width == 1)
        print_number(s, x[0] / unit);
    else
        print_numbers(s, x, width);
    rl_str_add(s, source == RL_SOURCE_LIST ? "]\n" : "\n");
}

static void print_camera(const rl_camera_spec *c, rl_str *s)
{
    rl_str_add(s, "camera:\n");
    print_source(s, "matrix", c->matrix_source, c->matrix ? c->matrix[0] : NULL, 16, c->n_matrix, 1);
    rl_str_printf(s, "  forward: %s\n", c->forward_z ? "+z" : "-z");
    print_source(s, "fov_x", c->fov_source, c->fov_x, 1, c->n_fov, pi / 180); /* degrees */
    if (c->has_shift) {
        rl_str_add(s, "  shift: ");
        print_numbers(s, c->shift, 2);
        rl_str_add(s, "\n");
    }
    print_source(s, "jitter", c->jitter_source, c->jitter ? c->jitter[0] : NULL, 2, c->n_jitter, 1);
}

static void print_depth(const rl_layer *l, rl_str *s)
{
    static const char *const kinds[] = {"planar", "radial", "device"};
    rl_str_printf(s, ", kind: %s", kinds[l->kind]);
    if (l->kind == RL_DEPTH_DEVICE) {
        rl_str_add(s, ", near: ");
        print_number(s, l->near_m / l->scale);
        rl_str_add(s, ", far: ");
        print_number(s, l->far_m / l->scale);
        rl_str_printf(s, ", reversed: %s", l->reversed ? "true" : "false");
    }
    if (l->negated)
        rl_str_add(s, ", negated: true");
    if (isfinite(l->empty)) {
        rl_str_add(s, ", empty: ");
        print_number(s, l->empty);
    }
}

static void print_channels(const rl_layer *l, rl_str *s)
{
    if (l->n_alternatives > 1)
        rl_str_add(s, "[");
    for (int i = 0; i < l->n_alternatives * l->n_channels; i++) {
        rl_str_add(s, i % l->n_channels ? ", " : i ? "], [" : "[");
        print_text(s, l->channels[i]);
    }
    rl_str_add(s, l->n_alternatives > 1 ? "]]" : "]");
}

/* Lengths may have a unit of their own. */
static bool has_unit(rl_layer_id id)
{
    for (const char *const *key = rl_layer_types[id].keys; *key; key++)
        if (!strcmp(*key, "unit"))
            return true;
    return false;
}

static void print_layer(const rl_manifest *m, const rl_layer *l, rl_str *s)
{
    static const char *const encodings[] = {"signed", "unsigned", "octahedral"};
    static const char *const motions[] = {"pixels", "uv", "ndc"};
    const rl_format format = rl_layer_types[l->id].format;
    double scale = l->id == RL_LAYER_CURVATURE ? 1 / l->scale : l->scale;
    if (l->light && l->n_alternatives == 1 && !l->part && !l->remapped &&
        (l->id == RL_LAYER_SHADOW || scale == m->unit)) {
        print_text(s, l->channels[0]);
        return;
    }
    if (!l->n_channels) {
        rl_str_printf(s, "{constant: %u}", (unsigned)l->constant);
        return;
    }
    rl_str_add(s, "{channels: ");
    print_channels(l, s);
    if (l->part) {
        rl_str_add(s, ", part: ");
        print_text(s, l->part);
    }
    if (l->colorspace) {
        rl_str_add(s, ", colorspace: ");
        print_text(s, l->colorspace);
    }
    if (l->hashed)
        rl_str_add(s, ", encoding: cryptomatte");
    if (format == RL_NORMAL)
        rl_str_printf(s, ", space: %s, encoding: %s", l->space == RL_SPACE_CAMERA ? "camera" : "world",
                      encodings[l->encoding]);
    if (format == RL_NORMAL && (l->axes[0] != 1 || l->axes[1] != 2 || l->axes[2] != 3))
        for (int i = 0; i < 3; i++)
            rl_str_printf(s, "%s%s%c%s", i ? ", " : ", axes: [", l->axes[i] < 0 ? "-" : "",
                          "xyz"[abs(l->axes[i]) - 1], i == 2 ? "]" : "");
    if (l->id == RL_LAYER_DEPTH || l->id == RL_LAYER_BACK_DEPTH)
        print_depth(l, s);
    if (l->id == RL_LAYER_MOTION)
        rl_str_printf(s, ", unit: %s, points: %s, y: %s", motions[l->motion_unit],
                      l->points_next ? "next" : "previous", l->y_up ? "up" : "down");
    else if (has_unit(l->id) && scale != m->unit) {
        rl_str_add(s, ", unit: ");
        print_number(s, scale);
    }
    if (l->remapped) {
        rl_str_add(s, ", remap: ");
        print_numbers(s, l->remap, 2);
    }
    rl_str_add(s, "}");
}

static void print_layers(const rl_manifest *m, rl_str *s)
{
    rl_str_add(s, "layers:\n");
    for (int id = 0; id < RL_LAYER_COUNT; id++) {
        int before = 0;
        for (int i = 0; i < m->n_layers; i++) {
            const rl_layer *l = &m->layers[i];
            if ((int)l->id != id)
                continue;
            if (!before++ || !l->light)
                rl_str_printf(s, "  %s:%s", rl_layer_types[id].name, l->light ? "\n" : " ");
            if (l->light) {
                rl_str_add(s, "    ");
                print_text(s, l->light);
                rl_str_add(s, ": ");
            }
            print_layer(m, l, s);
            rl_str_add(s, "\n");
        }
    }
}

/* What area lights and lights with ies have besides. */
static void print_shape(const rl_light_spec *l, double unit, rl_str *s)
{
    const struct {
        const char *key;
        double metres;
    } lengths[] = {{"radius", l->radius_m}, {"width", l->width_m}, {"height", l->height_m}};
    for (size_t i = 0; i < sizeof lengths / sizeof *lengths; i++)
        if (lengths[i].metres > 0) {
            rl_str_printf(s, ", %s: ", lengths[i].key);
            print_number(s, lengths[i].metres / unit);
        }
    if (l->type == RL_LIGHT_RECT || l->ies) {
        rl_str_add(s, ", up: ");
        print_numbers(s, l->up, 3);
    }
    if (l->two_sided)
        rl_str_add(s, ", two_sided: true");
    if (l->ies) {
        rl_str_add(s, ", ies: ");
        print_text(s, l->ies);
    }
}

static void print_light(const rl_light_spec *l, double unit, rl_str *s)
{
    double position[3] = {l->position_m[0] / unit, l->position_m[1] / unit, l->position_m[2] / unit};
    rl_str_add(s, "  ");
    print_text(s, l->name);
    rl_str_printf(s, ": {type: %s", rl_light_type_names[l->type]);
    if (l->type != RL_LIGHT_DIRECTIONAL) {
        rl_str_add(s, ", position: ");
        print_numbers(s, position, 3);
    }
    if (l->direction[0] != 0 || l->direction[1] != 0 || l->direction[2] != 0) {
        rl_str_add(s, ", direction: ");
        print_numbers(s, l->direction, 3);
    }
    print_shape(l, unit, s);
    if (l->type == RL_LIGHT_SPOT) {
        rl_str_add(s, ", angle: ");
        print_number(s, l->angle * 180 / pi);
        rl_str_add(s, ", blend: ");
        print_number(s, l->blend);
    }
    if (l->has_amount || l->amount[0] != 1 || l->amount[1] != 1 || l->amount[2] != 1) {
        rl_str_printf(s, ", %s: ", l->has_amount ? rl_light_unit_names[l->unit] : "color");
        print_numbers(s, l->amount, 3);
    }
    const struct {
        const char *key;
        double value, usual;
    } numbers[] = {
        {"efficacy", l->efficacy, 683},
        {"exposure", l->exposure, 0},
        {"temperature", l->kelvin, 0},
        {"tint", l->duv, 0},
    };
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++)
        if (numbers[i].value != numbers[i].usual) {
            rl_str_printf(s, ", %s: ", numbers[i].key);
            print_number(s, numbers[i].value);
        }
    if (strcmp(l->colorspace, "lin_rec709")) {
        rl_str_add(s, ", colorspace: ");
        print_text(s, l->colorspace);
    }
    if (l->in_camera_space)
        rl_str_add(s, ", space: camera");
    if (!l->enabled)
        rl_str_add(s, ", enabled: false");
    if (l->shadow_named) {
        rl_str_add(s, ", shadow: ");
        print_text(s, l->shadow == RL_SHADOW_LAYER  ? l->shadow_layer
                      : l->shadow == RL_SHADOW_NONE ? "none"
                                                    : "screen");
    }
    rl_str_add(s, "}\n");
}

static void print_files(const rl_manifest *m, rl_str *s)
{
    if (m->n_patterns == 0) {
        rl_str_add(s, "files: memory\n");
        return;
    }
    if (m->n_patterns == 1) {
        rl_str_add(s, "files: ");
        print_text(s, m->patterns[0].path);
        rl_str_add(s, "\n");
        return;
    }
    rl_str_add(s, "files:\n");
    for (int i = 0; i < m->n_layers; i++) {
        if (!m->layers[i].n_channels) /* a constant is in no file */
            continue;
        rl_str_add(s, "  ");
        print_text(s, m->layers[i].name);
        rl_str_add(s, ": ");
        print_text(s, m->patterns[m->layers[i].pattern].path);
        rl_str_add(s, "\n");
    }
}

static void print_frames(rl_str *s, const char *key, const rl_frames *frames)
{
    if (!frames->n)
        return;
    rl_str_printf(s, "%s: ", key);
    rl_frames_print(frames, s);
    rl_str_add(s, "\n");
}

static void print_optional(rl_str *s, const char *key, const char *text)
{
    if (!text)
        return;
    rl_str_printf(s, "%s: ", key);
    print_text(s, text);
    rl_str_add(s, "\n");
}

void rl_manifest_print(const rl_manifest *m, rl_str *out)
{
    rl_str_add(out, "relit_capture: 1\n");
    print_optional(out, "name", m->name);
    print_optional(out, "description", m->description);
    print_optional(out, "license", m->license);
    print_files(m, out);
    print_frames(out, "frames", &m->frames);
    if (m->fps > 0) {
        rl_str_add(out, "fps: ");
        print_number(out, m->fps);
        rl_str_add(out, "\n");
    }
    rl_str_add(out, "unit: ");
    if (m->unit == 1)
        rl_str_add(out, "m");
    else
        print_number(out, m->unit);
    rl_str_add(out, "\n");
    print_camera(&m->camera, out);
    print_layers(m, out);
    if (m->lights.n)
        rl_str_add(out, "lights:\n");
    for (size_t i = 0; i < m->lights.n; i++)
        print_light(&m->lights.light[i], m->unit, out);
    for (size_t i = 0; i < m->n_stencil_names; i++) {
        rl_str_printf(out, "%s%u: ", i ? ", " : "stencil_names: {", (unsigned)m->stencil_names[i].id);
        print_text(out, m->stencil_names[i].name);
    }
    rl_str_add(out, m->n_stencil_names ? "}\n" : "");
    print_frames(out, "cuts", &m->cuts);
}
