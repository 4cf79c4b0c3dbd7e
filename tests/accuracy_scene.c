/* See accuracy_scene.h. */
#include "tests/accuracy_scene.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/base/text.h"
#include "graph/model/pass.h"
#include "graph/run/exr.h"

static bool failed(const rl_error *err)
{
    char text[4096];
    rl_error_format(err, text, sizeof text);
    fprintf(stderr, "%s\n", text);
    return false;
}

/* ---- capture.json ---- */

static void read_three(const json_t *list, double scale, double out[3])
{
    for (size_t i = 0; i < 3; i++)
        out[i] = scale * json_number_value(json_array_get(list, i));
}

static bool read_notes(accuracy_scene *s)
{
    json_error_t error;
    const char *path = rl_path_join(&s->arena, s->folder, "capture.json");
    json_t *root = json_load_file(path, 0, &error), *item;
    size_t i;
    if (!root) {
        fprintf(stderr, "%s:%d: error: %s\n", path, error.line, error.text);
        return false;
    }
    json_array_foreach(json_object_get(root, "lights"), i, item) if (s->n_lights < ACCURACY_LIGHTS)
    {
        accuracy_light *l = &s->lights[s->n_lights++];
        l->name = rl_arena_strdup(&s->arena, json_string_value(json_object_get(item, "name")));
        read_three(json_object_get(item, "position"), 1, l->position);
        read_three(json_object_get(item, "radiant_intensity_W_per_sr"), 1, l->intensity);
    }
    json_array_foreach(json_object_get(root, "materials"), i, item) if (s->n_materials < ACCURACY_MATERIALS)
    {
        accuracy_material *m = &s->materials[s->n_materials];
        m->id = (int)json_integer_value(json_object_get(item, "id"));
        m->name = rl_arena_strdup(&s->arena, json_string_value(json_object_get(item, "name")));
        read_three(json_object_get(item, "burley_d_m"), 1e3, m->d_mm);
        s->n_materials += m->id != 0; /* 0: nothing */
    }
    item = json_array_get(json_object_get(root, "per_frame"), 0);
    const char *file = json_string_value(json_object_get(item, "file"));
    char full[4096];
    if (file && realpath(rl_path_join(&s->arena, s->folder, file), full))
        s->frame = rl_arena_strdup(&s->arena, full);
    for (size_t row = 0; row < 3; row++) {
        const json_t *from = json_array_get(json_object_get(item, "camera_to_world"), row);
        read_three(from, 1, s->to_world[row]);
        s->to_world[row][3] = json_number_value(json_array_get(from, 3));
    }
    item = json_object_get(root, "camera");
    s->focal = json_number_value(json_object_get(item, "focal_length_px"));
    json_decref(root);
    if (!s->frame || !s->n_lights || !s->n_materials)
        fprintf(stderr, "%s: error: no frame, lights or materials that can be used\n", path);
    return s->frame && s->n_lights && s->n_materials;
}

/* ---- runs ---- */

static bool in_use(const accuracy_light *l, accuracy_lit lit)
{
    return (strcmp(l->name, "rim") == 0) == (lit == ACCURACY_RIM);
}

static const char manifest_head[] =
    "relit_capture: 1\nname: truth\nfps: 24\n"
    "camera: {matrix: header, forward: -z, fov_x: header, jitter: header}\n"
    "layers:\n"
    "  albedo: {channels: [albedo.R, albedo.G, albedo.B], colorspace: lin_rec709}\n"
    "  normal: {channels: [normal.X, normal.Y, normal.Z], space: world, encoding: signed}\n"
    "  depth: {channels: [depth.Z], kind: planar, empty: 1e10}\n"
    "  stencil: {channels: [stencil.ID]}\n"
    "  thickness: {channels: [thickness.T]}\n";

static const char manifest_back[] = "  back_depth: {channels: [back_depth.Z], kind: planar, empty: 1e10}\n"
                                    "  back_normal: {channels: [back_normal.X, back_normal.Y, "
                                    "back_normal.Z], space: world, encoding: signed}\n";

/* A manifest that shows the one frame under ACCURACY_FRAMES numbers; NULL when it cannot be written. */
static const char *write_manifest(accuracy_scene *s, accuracy_lit lit, double unit)
{
    static const char *const layers[] = {"shadow", "shadow_thickness"};
    rl_str text = {0}, lights = {0};
    rl_error err = {0};
    const char *path = rl_arena_printf(&s->arena, "%s/%s.yaml", s->out, lit ? "rim" : "main");
    rl_str_add(&text, manifest_head);
    if (s->has_back)
        rl_str_add(&text, manifest_back);
    for (size_t k = 0; path && k < 2; k++) {
        const char *comma = "";
        rl_str_printf(&text, "  %s: {", layers[k]);
        for (const accuracy_light *l = s->lights; l < s->lights + s->n_lights; l++) {
            if (!in_use(l, lit))
                continue;
            rl_str_printf(&text, "%s%s: %s.%s", comma, l->name, layers[k], l->name);
            comma = ", ";
            if (k == 0)
                rl_str_printf(
                    &lights,
                    "  %s: {type: point, position: [%.9g, %.9g, %.9g], intensity: [%.9g, %.9g, %.9g]}\n",
                    l->name, l->position[0], l->position[1], l->position[2], l->intensity[0], l->intensity[1],
                    l->intensity[2]);
        }
        rl_str_add(&text, "}\n");
    }
    rl_str_printf(&text, "files: \"%s\"\nframes: 1-%d\nunit: %.9g\nlights:\n%sstencil_names: {", s->frame,
                  ACCURACY_FRAMES, unit > 0 ? unit : 1.0, rl_str_text(&lights));
    for (size_t i = 0; i < s->n_materials; i++)
        rl_str_printf(&text, "%s%d: %s", i ? ", " : "", s->materials[i].id, s->materials[i].name);
    rl_str_add(&text, "}\n");
    rl_code code =
        path ? rl_file_write(path, rl_str_text(&text), strlen(rl_str_text(&text)), &err) : RL_E_MEMORY;
    rl_str_free(&text);
    rl_str_free(&lights);
    if (code)
        failed(&err);
    return code ? NULL : path;
}

enum { SETTINGS = 7 + 4 * ACCURACY_MATERIALS };

/* What the model changes in configs/accuracy.yaml. Returns the number of settings. */
static size_t choose(accuracy_scene *s, const accuracy_model *model, rl_setting *to)
{
    rl_arena *a = &s->arena;
    const bool gather = !strcmp(model->thickness, ACCURACY_GATHER);
    size_t n = 0;
    to[n++] = (rl_setting){"graph.sss", rl_arena_printf(a, "{%s, in: {diffuse: light.diffuse, lit: %s.lit}}",
                                                        model->sss, gather ? "through" : "light")};
    if (gather) {
        to[n++] = (rl_setting){"graph.behind", "{pass: back_lighting}"};
        to[n++] =
            (rl_setting){"graph.through", "{pass: translucency, in: {back: behind.diffuse, lit: light.lit}}"};
    }
    to[n++] = (rl_setting){"shading.diffuse", model->shading[0] ? model->shading : "lambert"};
    to[n++] = (rl_setting){"shading.transmission", model->thickness[0] ? "true" : "false"};
    if (!strcmp(model->shading, "sg")) {
        to[n++] = (rl_setting){"graph.bend", "{pass: curvature}"};
        to[n++] =
            (rl_setting){"graph.light.in", "{curvature: bend.curvature, smooth_normal: bend.smooth_normal}"};
    }
    for (const accuracy_material *m = s->materials; m < s->materials + s->n_materials; m++) {
        if (m->d_mm[0] <= 0)
            continue;
        const char *profile =
            rl_arena_printf(a, "%s%s%s", m->name, model->set ? "_" : "", model->set ? model->set : "");
        to[n++] = (rl_setting){rl_arena_printf(a, "materials.%s", m->name),
                               rl_arena_printf(a, "{profile: %s}", profile)};
        to[n++] = (rl_setting){rl_arena_printf(a, "profiles.%s.scatter_distance_mm", profile),
                               rl_arena_printf(a, "[%.9g, %.9g, %.9g]", m->d_mm[0], m->d_mm[1], m->d_mm[2])};
        if (model->thickness[0])
            to[n++] = (rl_setting){rl_arena_printf(a, "profiles.%s.transmission", profile),
                                   gather ? "gather" : "thick"};
        if (model->thickness[0] && !gather) {
            to[n++] =
                (rl_setting){rl_arena_printf(a, "profiles.%s.thickness_from", profile), model->thickness};
        }
    }
    return n;
}

static bool copy_image(rl_session *session, const char *image, int planes, float *out)
{
    rl_error err = {0};
    rl_image_view v;
    if (rl_session_image(session, image, &v, &err))
        return failed(&err);
    for (int p = 0; p < planes; p++)
        for (int y = 0; y < v.height; y++)
            memcpy(out + ((size_t)p * (size_t)v.height + (size_t)y) * (size_t)v.width,
                   v.plane[p] + (size_t)y * v.stride, (size_t)v.width * sizeof *out);
    return true;
}

/* A session for the model, its frames processed; NULL after a failure. */
static rl_session *run(accuracy_scene *s, const accuracy_model *model, accuracy_lit lit)
{
    rl_setting settings[SETTINGS];
    const char *manifest = write_manifest(s, lit, model->unit), *only = model->settled ? "settled" : "still";
    rl_options options = {.pipeline = "configs/accuracy.yaml",
                          .captures = &manifest,
                          .n_captures = 1,
                          .settings = settings,
                          .n_settings = choose(s, model, settings),
                          .out = s->out,
                          .only = &only,
                          .n_only = 1};
    rl_error err = {0};
    rl_session *session = NULL;
    if (!manifest || rl_session_open(&options, &session, &err))
        return failed(&err), NULL;
    for (int frame = 1; frame <= (model->settled ? ACCURACY_FRAMES : 1); frame++)
        if (rl_session_process(session, 0, frame, NULL, &err)) {
            failed(&err);
            rl_session_close(&session);
            return NULL;
        }
    return session;
}

bool accuracy_render(accuracy_scene *s, const accuracy_model *model, accuracy_lit lit, float *color)
{
    rl_session *session = run(s, model, lit);
    bool ok = session && copy_image(session, model->settled ? "aa.color" : "sss.color", 3, color);
    rl_session_close(&session);
    return ok;
}

/* ---- masks ---- */

/* Whether the depth jumps between a pixel and its right or lower neighbour: by more than five pixels are
 * wide, which is a fold of the surface before itself. */
static bool jumps(const accuracy_scene *s, const float *depth, int x, int y)
{
    size_t at = (size_t)y * (size_t)s->width + (size_t)x;
    float most = 5 * depth[at] / (float)s->focal;
    return (x + 1 < s->width && fabsf(depth[at] - depth[at + 1]) > most) ||
           (y + 1 < s->height && fabsf(depth[at] - depth[at + (size_t)s->width]) > most);
}

/* `shadows`: n planes. */
static bool near_edge(const accuracy_scene *s, const float *depth, const float *shadows, size_t n, int x,
                      int y)
{
    size_t at = (size_t)y * (size_t)s->width + (size_t)x;
    for (int dy = -ACCURACY_APART; dy <= ACCURACY_APART; dy++)
        for (int dx = -ACCURACY_APART; dx <= ACCURACY_APART; dx++) {
            int nx = x + dx, ny = y + dy;
            if (dx * dx + dy * dy > ACCURACY_APART * ACCURACY_APART)
                continue;
            if (nx < 0 || ny < 0 || nx >= s->width || ny >= s->height)
                return true;
            size_t to = (size_t)ny * (size_t)s->width + (size_t)nx;
            if (s->id[to] != s->id[at] || jumps(s, depth, nx, ny))
                return true;
            for (size_t k = 0; k < n; k++)
                if (shadows[k * s->n + to] != shadows[k * s->n + at])
                    return true;
        }
    return false;
}

/* Pixels that face away from the rim light; what it lights nevertheless is seen in its renders. */
static bool behind_rim(const accuracy_scene *s, const float *normal, const float *depth, size_t at)
{
    double z = depth[at], dot = 0;
    double view[3] = {((double)(at % (size_t)s->width) + 0.5 - s->width / 2.0) / s->focal * z,
                      -((double)(at / (size_t)s->width) + 0.5 - s->height / 2.0) / s->focal * z, -z};
    for (const accuracy_light *l = s->lights; l < s->lights + s->n_lights; l++)
        for (size_t i = 0; i < 3 && in_use(l, ACCURACY_RIM); i++) {
            double p = s->to_world[i][3];
            for (size_t k = 0; k < 3; k++)
                p += s->to_world[i][k] * view[k];
            dot += (double)normal[i * s->n + at] * (l->position[i] - p);
        }
    return dot < 0;
}

static bool make_masks(accuracy_scene *s)
{
    rl_exr_plane planes[5 + ACCURACY_LIGHTS] = {{.channel = "depth.Z"},
                                                {.channel = "normal.X"},
                                                {.channel = "normal.Y"},
                                                {.channel = "normal.Z"},
                                                {.channel = "stencil.ID"}};
    size_t n = 5;
    for (const accuracy_light *l = s->lights; l < s->lights + s->n_lights; l++)
        if (in_use(l, ACCURACY_MAIN))
            planes[n++].channel = rl_arena_printf(&s->arena, "shadow.%s", l->name);
    float *gbuffer = rl_arena_array(&s->arena, s->n * RL_ARRAY_LENGTH(planes), sizeof *gbuffer);
    s->clear = rl_arena_alloc(&s->arena, s->n);
    s->ear = rl_arena_alloc(&s->arena, s->n);
    s->id = rl_arena_array(&s->arena, s->n, sizeof *s->id);
    rl_error err = {0};
    rl_exr *file = NULL;
    if (!gbuffer || !s->clear || !s->ear || !s->id)
        return failed((rl_fail_memory(&err, s->n), &err));
    for (size_t i = 0; i < n; i++) {
        planes[i].stride = (size_t)s->width;
        planes[i].floats = i == 4 ? NULL : gbuffer + i * s->n;
        planes[i].ids = i == 4 ? (uint32_t *)s->id : NULL;
    }
    rl_code code = rl_exr_open(s->frame, 0, &file, &err);
    const rl_exr_part *part = code ? NULL : rl_exr_part_at(file, 0);
    if (part && (part->width != s->width || part->height != s->height))
        code = rl_fail_file(&err, RL_E_DATA, s->frame, "another size than the truth's");
    if (!code)
        code = rl_exr_read(file, 0, planes, n, NULL, NULL, &err);
    rl_exr_close(&file);
    for (size_t at = 0; !code && at < s->n; at++) {
        int x = (int)(at % (size_t)s->width), y = (int)(at / (size_t)s->width);
        s->clear[at] = s->id[at] && !near_edge(s, gbuffer, gbuffer + 5 * s->n, n - 5, x, y);
        if (s->rim_truth.planes && s->rim_lambert.planes)
            s->ear[at] = s->rim_lambert.planes[at] < 1e-4f && s->rim_truth.planes[at] > 0.01f &&
                         behind_rim(s, gbuffer + s->n, gbuffer, at);
    }
    return code ? failed(&err) : true;
}

/* ---- all of it ---- */

static bool read_render(accuracy_scene *s, const char *name, bool required, rl_image_file *out)
{
    rl_error err = {0};
    const char *path = rl_path_join(&s->arena, s->folder, name);
    if (!path || (!required && !rl_path_exists(path)))
        return true;
    if (rl_image_file_read(path, out, &err))
        return failed(&err);
    if (s->n && (out->width != s->width || out->height != s->height)) {
        fprintf(stderr, "%s: error: another size than the truth's\n", path);
        return false;
    }
    if (out->channels < 3) {
        fprintf(stderr, "%s: error: needs R, G, B\n", path);
        return false;
    }
    s->width = out->width;
    s->height = out->height;
    s->n = (size_t)out->width * (size_t)out->height;
    return true;
}

/* Whether the G-buffer has back faces. */
static bool find_back(accuracy_scene *s)
{
    rl_image_file file = {0};
    rl_error err = {0};
    if (rl_image_file_read(s->frame, &file, &err))
        return failed(&err);
    s->has_back = strstr(file.names, "back_depth.Z") && strstr(file.names, "back_normal.X");
    rl_image_file_free(&file);
    return true;
}

bool accuracy_scene_open(accuracy_scene *s, const char *folder, const char *out)
{
    rl_error err = {0};
    memset(s, 0, sizeof *s);
    s->folder = folder;
    s->out = out;
    if (rl_folder_make(out, &err))
        return failed(&err);
    return read_notes(s) && find_back(s) && read_render(s, "ref_clay_burley.exr", true, &s->truth) &&
           read_render(s, "ref_clay_burley_rim.exr", false, &s->rim_truth) &&
           read_render(s, "gt_clay_lambert_rim.exr", false, &s->rim_lambert) && make_masks(s);
}

void accuracy_scene_close(accuracy_scene *s)
{
    rl_image_file_free(&s->truth);
    rl_image_file_free(&s->rim_truth);
    rl_image_file_free(&s->rim_lambert);
    rl_arena_free(&s->arena);
}

size_t accuracy_error(const accuracy_scene *s, const float *color, const float *truth, const uint8_t *mask,
                      int id, double error[3], double bias[3])
{
    size_t n = 0;
    for (size_t c = 0; c < 3; c++) {
        double wrong = 0, more = 0, all = 0;
        n = 0;
        for (size_t i = 0; i < s->n; i++)
            if (mask[i] && (id < 0 || s->id[i] == id)) {
                double t = truth[c * s->n + i], d = color[c * s->n + i] - t;
                wrong += fabs(d);
                more += d;
                all += t;
                n++;
            }
        error[c] = wrong / all;
        bias[c] = more / all;
    }
    return n;
}
