/* Lights of a session: which are active, which planes of the shadow layers they use, and what the kernels see
 * of them. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "graph/model/temperature.h"
#include "graph/run/kernel_source.h"
#include "graph/run/session.h"

static const rl_light_spec *find_light(const rl_lights *lights, const char *name)
{
    for (size_t i = 0; i < lights->n; i++)
        if (!strcmp(lights->light[i].name, name))
            return &lights->light[i];
    return NULL;
}

/* A shadow layer belongs to a place: where its light stood when the capture was recorded. */
static void warn_stale(const rl_session *s, const rl_manifest *m, const rl_light_spec *light)
{
    const rl_light_spec *recorded = find_light(&m->lights, light->shadow_layer);
    if (!recorded || recorded == light || light->type == RL_LIGHT_DIRECTIONAL || light->in_camera_space ||
        recorded->type == RL_LIGHT_DIRECTIONAL || recorded->in_camera_space)
        return;
    double d2 = 0;
    for (int i = 0; i < 3; i++) {
        double d = light->position_m[i] - recorded->position_m[i];
        d2 += d * d;
    }
    if (sqrt(d2) > 1e-3)
        rl_report(
            s->log, RL_WARNING, light->where,
            "light '%s' stands %.3g m from where the layer 'shadow.%s' was recorded: its shadow is stale "
            "(shadow: none switches it off)",
            light->name, sqrt(d2), light->shadow_layer);
}

static const rl_layer *light_layer(const rl_manifest *m, const char *kind, const char *light)
{
    char name[256];
    snprintf(name, sizeof name, "%s.%s", kind, light);
    return rl_manifest_layer(m, name);
}

static rl_code no_such_shadow(const rl_manifest *m, const rl_light_spec *light, rl_error *err)
{
    rl_str text = {0};
    const char *names[64] = {"screen", "none"};
    size_t n = 2;
    for (int i = 0; i < m->n_layers && n < 64; i++)
        if (m->layers[i].id == RL_LAYER_SHADOW)
            names[n++] = m->layers[i].light;
    rl_suggest(&text, light->shadow_layer, names, n, "known");
    rl_code code = rl_fail(err, RL_E_CONFIG, light->shadow_where,
                           "light '%s': the capture '%s' has no layer 'shadow.%s'%s", light->name, m->name,
                           light->shadow_layer, rl_str_text(&text));
    rl_str_free(&text);
    return code;
}

static rl_code bind_shadow(const rl_session *s, const rl_manifest *m, rl_active_light *a, rl_error *err)
{
    const rl_light_spec *light = a->spec;
    if (light->shadow != RL_SHADOW_LAYER)
        return RL_OK;
    a->shadow = light_layer(m, "shadow", light->shadow_layer);
    a->thickness = light_layer(m, "shadow_thickness", light->shadow_layer);
    if (!a->shadow && light->shadow_named)
        return no_such_shadow(m, light, err);
    if (a->shadow)
        warn_stale(s, m, light);
    return RL_OK;
}

/* The matrix of the light's colour space, with the colour of its temperature in it: factors for the channels
 * of that space, which the working space tells from linear Rec.709. */
static rl_code light_color(const rl_session *s, const rl_light_spec *spec, float m[9], rl_error *err)
{
    rl_code code = rl_session_light_matrix(s, spec->colorspace, spec->colorspace_where, m, err);
    if (code || !(spec->kelvin > 0))
        return code;
    float rec709[9];
    double to_working[9], from_working[9], to_rec709[9] = {0}, factor[3];
    code = rl_session_light_matrix(s, "lin_rec709", spec->where, rec709, err);
    if (code)
        return code;
    for (int i = 0; i < 9; i++)
        to_working[i] = (double)rec709[i];
    if (!rl_invert3(to_working, from_working))
        return rl_fail(err, RL_E_CONFIG, spec->where,
                       "light '%s' has a temperature, whose colour the working space cannot tell apart",
                       spec->name);
    for (int i = 0; i < 9; i++)
        for (int k = 0; k < 3; k++)
            to_rec709[i] += from_working[i / 3 * 3 + k] * (double)m[3 * k + i % 3];
    rl_kelvin_rgb(spec->kelvin, spec->duv, to_rec709, factor);
    for (int i = 0; i < 9; i++)
        m[i] = (float)((double)m[i] * factor[i % 3]);
    return RL_OK;
}

/* The profiles of all lights, one after the other (kernels/shared.h). */
static rl_code lay_profiles(rl_session *s, rl_sequence *q, rl_error *err)
{
    size_t n = 1;
    for (size_t i = 0; i < q->n_lights; i++) {
        const rl_ies *ies = q->lights[i].spec->profile;
        q->lights[i].profile = ies ? (int)n : 0;
        n += ies ? 2 + (size_t)ies->vertical * (size_t)ies->horizontal : 0;
    }
    if (n == 1)
        return RL_OK;
    float *out = rl_arena_array(&s->arena, n, sizeof *out);
    if (!out)
        return rl_fail_memory(err, n * sizeof *out);
    for (size_t i = 0; i < q->n_lights; i++) {
        const rl_ies *ies = q->lights[i].spec->profile;
        float *at = out + q->lights[i].profile;
        if (!ies)
            continue;
        at[0] = (float)ies->vertical;
        at[1] = (float)ies->horizontal;
        memcpy(at + 2, ies->value, (size_t)ies->vertical * (size_t)ies->horizontal * sizeof *at);
    }
    q->setup.kinds |= RL_LIGHTS_PROFILE;
    q->setup.profiles = out;
    q->setup.n_profiles = n;
    return RL_OK;
}

/* rl_light_planes while they are filled. */
typedef struct planes {
    const rl_layer **layers;
    const char **names;
} planes;

static rl_code make_planes(rl_session *s, size_t most, planes *made, rl_light_planes *out, rl_error *err)
{
    *made = (planes){rl_arena_array(&s->arena, most + 1, sizeof *made->layers),
                     rl_arena_array(&s->arena, most + 1, sizeof *made->names)};
    *out = (rl_light_planes){.layers = made->layers, .names = made->names};
    return made->layers && made->names ? RL_OK : rl_fail_memory(err, most * sizeof *made->layers);
}

/* A light's layer becomes the next plane; its number, or -1 without a layer. */
static int add_plane(planes *made, rl_light_planes *out, const rl_layer *layer, const rl_light_spec *spec)
{
    if (!layer)
        return -1;
    made->layers[out->n] = layer;
    made->names[out->n] = spec->name;
    return out->n++;
}

/* Finds what an active light needs of the capture. */
static rl_code add_light(const rl_session *s, rl_sequence *q, const rl_light_spec *spec, planes *shadow,
                         planes *thickness, rl_error *err)
{
    rl_active_light *a = &q->lights[q->n_lights++];
    a->spec = spec;
    q->setup.kinds |= spec->shadow == RL_SHADOW_SCREEN ? RL_LIGHTS_MARCH : 0;
    q->setup.kinds |= spec->type == RL_LIGHT_SPHERE || spec->type == RL_LIGHT_RECT ? RL_LIGHTS_AREA : 0;
    rl_code code = bind_shadow(s, q->manifest, a, err);
    if (!code)
        code = light_color(s, spec, a->to_working, err);
    a->shadow_plane = add_plane(shadow, &q->shadow, a->shadow, spec);
    a->thickness_plane = add_plane(thickness, &q->thickness, a->thickness, spec);
    return code;
}

/* A null in changes to the capture's lights that finds none of its name there. */
static void warn_nothing(const rl_session *s, const rl_value *lights, const rl_manifest *m)
{
    const rl_value *written = m->lights_written;
    const char *names[64];
    size_t n = 0;
    for (; written && n < written->n && n < 64; n++)
        names[n] = written->entries[n].key;
    for (size_t i = 0; i < lights->n; i++) {
        const rl_entry *e = &lights->entries[i];
        rl_str text = {0};
        if (e->value->kind != RL_NULL || rl_value_get(written, e->key))
            continue;
        rl_suggest(&text, e->key, names, n, "known");
        rl_report(s->log, RL_WARNING, e->value->where,
                  "nothing is removed: the capture '%s' has no light '%s'%s", m->name, e->key,
                  rl_str_text(&text));
        rl_str_free(&text);
    }
}

/* The pipeline's lights, else the capture's. Paths into lights that no file of the pipeline lists
 * (`--set lights.key.exposure=1`) change the capture's. */
static rl_code choose_lights(rl_session *s, const rl_manifest *m, rl_lights *out, rl_error *err)
{
    const rl_value *lights = s->pipeline->lights;
    *out = m->lights;
    if (!lights)
        return RL_OK;
    if (lights->implied) { /* nulls in it remove */
        warn_nothing(s, lights, m);
        lights = rl_value_merge(&s->arena, m->lights_written, (rl_value *)lights);
        if (!lights)
            return rl_fail_memory(err, sizeof *lights);
    }
    return rl_lights_parse(&s->arena, lights, m->unit, out, err);
}

rl_code rl_session_lights(rl_session *s, rl_sequence *q, rl_error *err)
{
    const rl_manifest *m = q->manifest;
    rl_lights lights;
    rl_code code = choose_lights(s, m, &lights, err);
    q->lights = rl_arena_array(&s->arena, lights.n + 1, sizeof *q->lights);
    if (!code && !q->lights)
        code = rl_fail_memory(err, lights.n * sizeof *q->lights);
    planes shadow, thickness;
    q->light_values = rl_arena_array(&s->arena, lights.n + 1, sizeof *q->light_values);
    if (!code && !q->light_values)
        code = rl_fail_memory(err, lights.n * sizeof *q->light_values);
    if (!code)
        code = make_planes(s, lights.n, &shadow, &q->shadow, err);
    if (!code)
        code = make_planes(s, lights.n, &thickness, &q->thickness, err);
    for (size_t i = 0; i < lights.n && !code; i++)
        if (lights.light[i].enabled)
            code = add_light(s, q, &lights.light[i], &shadow, &thickness, err);
    if (s->n_sky) {
        q->setup.kinds |= RL_LIGHTS_SKY;
        q->setup.sky = s->sky;
        q->setup.n_sky = s->n_sky;
    }
    return code ? code : lay_profiles(s, q, err);
}

/* M * (p, w), M of 3 rows of 4. */
static void transform(const float m[12], const double p[3], double w, float out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = (float)((double)m[4 * i] * p[0] + (double)m[4 * i + 1] * p[1] + (double)m[4 * i + 2] * p[2] +
                         (double)m[4 * i + 3] * w);
}

/* Half axes of a rect, directions of a profile's table; zero for lights without either. */
static void light_axes(const rl_light_spec *spec, double side[3], double top[3])
{
    bool rect = spec->type == RL_LIGHT_RECT;
    if (!rect && !spec->profile)
        return;
    rl_light_axes(spec, side, top);
    for (int i = 0; i < 3; i++) {
        side[i] *= rect ? 0.5 * spec->width_m : 1;
        top[i] *= rect ? 0.5 * spec->height_m : 1;
    }
}

static void light_value(const rl_active_light *a, const camera_t *camera, light_t *out)
{
    static const int types[] = {[RL_LIGHT_POINT] = LIGHT_POINT,
                                [RL_LIGHT_SPOT] = LIGHT_SPOT,
                                [RL_LIGHT_DIRECTIONAL] = LIGHT_DIRECTIONAL,
                                [RL_LIGHT_SPHERE] = LIGHT_SPHERE,
                                [RL_LIGHT_RECT] = LIGHT_RECT};
    const rl_light_spec *spec = a->spec;
    light_t l = {.type = types[spec->type],
                 .shadow = spec->shadow == RL_SHADOW_SCREEN ? SHADOW_MARCH : a->shadow_plane,
                 .shadow_thickness = a->thickness_plane,
                 .two_sided = spec->two_sided,
                 .profile = a->profile};
    double radiometric[3], inner, outer, area = rl_light_area(spec), side[3] = {0}, top[3] = {0};
    rl_light_resolve(spec, radiometric);
    rl_light_cone(spec, &inner, &outer);
    light_axes(spec, side, top);
    for (int c = 0; c < 3; c++) {
        double v = 0;
        for (int k = 0; k < 3; k++)
            v += (double)a->to_working[3 * c + k] * radiometric[k];
        l.intensity[c] = (float)v;
        l.position[c] = (float)spec->position_m[c];
        l.direction[c] = (float)spec->direction[c];
        l.side[c] = (float)side[c];
        l.top[c] = (float)top[c];
    }
    l.cos_inner = (float)inner;
    l.cos_outer = (float)outer;
    l.radius =
        (float)(spec->type == RL_LIGHT_RECT ? 0.5 * hypot(spec->width_m, spec->height_m) : spec->radius_m);
    l.radiance = (float)(area > 0 ? 1 / area : 0);
    if (spec->in_camera_space) {
        transform(camera->to_world, spec->position_m, 1, l.position);
        transform(camera->to_world, spec->direction, 0, l.direction);
        transform(camera->to_world, side, 0, l.side);
        transform(camera->to_world, top, 0, l.top);
    }
    *out = l;
}

void rl_session_light_values(const rl_sequence *q, const camera_t *camera, light_t *out)
{
    for (size_t i = 0; i < q->n_lights; i++)
        light_value(&q->lights[i], camera, &out[i]);
}
