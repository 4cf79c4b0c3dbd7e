#include "graph/model/lights.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "graph/base/text.h"
#include "graph/model/temperature.h"

static const double pi = 3.14159265358979323846;

static const char *const unit_keys[] = {"intensity", "irradiance", "candela", "lumen", "lux"};
#define POINT_UNITS (1u << RL_LIGHT_INTENSITY | 1u << RL_LIGHT_CANDELA | 1u << RL_LIGHT_LUMEN)
#define SUN_UNITS   (1u << RL_LIGHT_IRRADIANCE | 1u << RL_LIGHT_LUX)

static const struct {
    const char *name;
    bool positioned, directed;
    unsigned units;
    const char *wanted;
} types[] = {
    {"point", true, false, POINT_UNITS, "intensity, candela or lumen"},
    {"spot", true, true, POINT_UNITS, "intensity, candela or lumen"},
    {"directional", false, true, SUN_UNITS, "irradiance or lux"},
};

/* One number, or three. */
static rl_code read_rgb(const rl_value *v, const char *name, double out[3], rl_error *err)
{
    bool list = v->kind == RL_LIST;
    if (v->kind != RL_NUMBER && (!list || v->n != 3))
        return rl_value_wrong(v, name, "a number or a list of 3 numbers", err);
    rl_code code = RL_OK;
    for (size_t i = 0; i < 3 && !code; i++)
        code = rl_value_number(list ? v->items[i] : v, name, 0, DBL_MAX, &out[i], err);
    return code;
}

static rl_code read_amount(const rl_value *v, rl_light_spec *l, rl_error *err)
{
    const rl_value *given = NULL;
    for (int u = 0; u <= RL_LIGHT_LUX; u++) {
        const rl_value *amount = rl_value_get(v, unit_keys[u]);
        if (!amount)
            continue;
        if (!(types[l->type].units & 1u << u))
            return rl_fail(err, RL_E_CONFIG, amount->where, "light '%s': a %s light takes %s, not %s",
                           l->name, types[l->type].name, types[l->type].wanted, unit_keys[u]);
        if (given)
            return rl_fail(err, RL_E_CONFIG, amount->where, "light '%s' has both %s and %s; give one",
                           l->name, unit_keys[l->unit], unit_keys[u]);
        given = amount;
        l->unit = (rl_light_unit)u;
    }
    if (!given)
        return rl_fail(err, RL_E_CONFIG, v->where, "light '%s' needs %s", l->name, types[l->type].wanted);
    rl_code code = read_rgb(given, unit_keys[l->unit], l->amount, err);
    const rl_value *color = rl_value_get(v, "color");
    double tint[3] = {1, 1, 1};
    if (!code && color)
        code = read_rgb(color, "color", tint, err);
    for (int c = 0; c < 3; c++)
        l->amount[c] *= tint[c];
    return code;
}

static rl_code read_temperature(const rl_value *v, rl_light_spec *l, rl_error *err)
{
    const rl_value *temperature = rl_value_get(v, "temperature"), *tint = rl_value_get(v, "tint");
    if (tint && !temperature)
        return rl_fail(err, RL_E_CONFIG, tint->where,
                       "light '%s': 'tint' is off the locus of a 'temperature'; give one", l->name);
    if (!temperature)
        return RL_OK;
    if (rl_value_get(v, "color"))
        return rl_fail(err, RL_E_CONFIG, temperature->where,
                       "light '%s' has both color and temperature; give one", l->name);
    rl_code code =
        rl_value_number(temperature, "temperature", RL_KELVIN_LEAST, RL_KELVIN_MOST, &l->kelvin, err);
    if (!code && tint)
        code = rl_value_number(tint, "tint", -RL_DUV_MOST, RL_DUV_MOST, &l->duv, err);
    return code;
}

static rl_code read_placement(const rl_value *v, double metres, rl_light_spec *l, rl_error *err)
{
    const rl_value *position = rl_value_get(v, "position"), *direction = rl_value_get(v, "direction");
    const char *missing = types[l->type].positioned && !position  ? "position"
                          : types[l->type].directed && !direction ? "direction"
                                                                  : NULL;
    if (missing)
        return rl_fail(err, RL_E_CONFIG, v->where, "light '%s': a %s light needs '%s'", l->name,
                       types[l->type].name, missing);
    rl_code code = position ? rl_value_numbers(position, "position", 3, l->position_m, err) : RL_OK;
    if (!code && direction)
        code = rl_value_numbers(direction, "direction", 3, l->direction, err);
    if (code)
        return code;
    double length = hypot(hypot(l->direction[0], l->direction[1]), l->direction[2]);
    if (direction && !(length > 1e-12 && length < 1e150))
        return rl_fail(err, RL_E_CONFIG, direction->where, "light '%s': the direction has no usable length",
                       l->name);
    for (int i = 0; i < 3; i++) {
        l->position_m[i] *= metres;
        l->direction[i] /= direction ? length : 1;
    }
    return RL_OK;
}

static rl_code read_spot(const rl_value *v, rl_light_spec *l, rl_error *err)
{
    const rl_value *angle = rl_value_get(v, "angle"), *blend = rl_value_get(v, "blend");
    if (!angle)
        return rl_fail(err, RL_E_CONFIG, v->where, "light '%s': a spot light needs 'angle' (full, degrees)",
                       l->name);
    double degrees = 0;
    rl_code code = rl_value_number(angle, "angle", 0.01, 179.9, &degrees, err);
    if (!code && blend)
        code = rl_value_number(blend, "blend", 0, 1, &l->blend, err);
    l->angle = degrees * pi / 180;
    return code;
}

static rl_code read_shadow(const rl_value *v, rl_light_spec *l, rl_error *err)
{
    const rl_value *shadow = rl_value_get(v, "shadow");
    const char *word = l->name;
    rl_code code = shadow ? rl_value_text(shadow, "shadow", &word, err) : RL_OK;
    if (code)
        return code;
    l->shadow_named = shadow != NULL;
    l->shadow = !shadow || (strcmp(word, "none") && strcmp(word, "screen")) ? RL_SHADOW_LAYER
                : word[0] == 's'                                            ? RL_SHADOW_SCREEN
                                                                            : RL_SHADOW_NONE;
    l->shadow_layer = l->shadow == RL_SHADOW_LAYER ? word : NULL;
    return RL_OK;
}

/* Scalars that every type of light has. */
static rl_code read_common(const rl_value *v, rl_light_spec *l, rl_error *err)
{
    const rl_value *x;
    rl_code code = RL_OK;
    int space = 0;
    l->enabled = true;
    l->efficacy = 683;
    l->colorspace = "lin_rec709";
    if ((x = rl_value_get(v, "enabled")))
        code = rl_value_truth(x, "enabled", &l->enabled, err);
    if (!code && (x = rl_value_get(v, "exposure")))
        code = rl_value_number(x, "exposure", -64, 64, &l->exposure, err);
    if (!code && (x = rl_value_get(v, "efficacy")))
        code = rl_value_number(x, "efficacy", DBL_MIN, 1e6, &l->efficacy, err);
    if (!code && (x = rl_value_get(v, "colorspace")))
        code = rl_value_text(x, "colorspace", &l->colorspace, err);
    if (!code && (x = rl_value_get(v, "space")))
        code = rl_value_word(x, "space", "world|camera", &space, err);
    l->in_camera_space = space == 1;
    return code;
}

/* A key that the light's type cannot use is a mistake, not decoration. */
static rl_code check_keys(const rl_value *v, const rl_light_spec *l, rl_error *err)
{
    const struct {
        const char *key;
        bool used;
    } keys[] = {
        {"position", types[l->type].positioned},
        {"direction", types[l->type].directed},
        {"angle", l->type == RL_LIGHT_SPOT},
        {"blend", l->type == RL_LIGHT_SPOT},
    };
    for (size_t i = 0; i < sizeof keys / sizeof *keys; i++) {
        const rl_value *x = rl_value_get(v, keys[i].key);
        if (x && !keys[i].used)
            return rl_fail(err, RL_E_CONFIG, x->where, "light '%s': a %s light has no '%s'", l->name,
                           types[l->type].name, keys[i].key);
    }
    return RL_OK;
}

static rl_code read_light(const rl_entry *e, double metres, rl_light_spec *l, rl_error *err)
{
    static const char *const known[] = {"type",      "position",   "direction",   "angle",    "blend",
                                        "intensity", "irradiance", "candela",     "lumen",    "lux",
                                        "color",     "colorspace", "efficacy",    "exposure", "enabled",
                                        "space",     "shadow",     "temperature", "tint"};
    const rl_value *v = e->value, *type = rl_value_get(v, "type");
    int t = 0;
    rl_str what = {0};
    rl_str_printf(&what, "light '%s'", e->key);
    rl_code code = what.failed ? rl_fail_memory(err, what.room)
                               : rl_value_keys(v, what.text, known, sizeof known / sizeof *known, err);
    rl_str_free(&what);
    if (code)
        return code;
    if (!type)
        return rl_fail(err, RL_E_CONFIG, v->where, "light '%s' needs 'type': point, spot or directional",
                       e->key);
    code = rl_value_word(type, "type", "point|spot|directional", &t, err);
    if (code)
        return code;
    l->name = e->key;
    l->where = e->where;
    l->type = (rl_light_type)t;
    code = check_keys(v, l, err);
    if (!code)
        code = read_common(v, l, err);
    if (!code)
        code = read_placement(v, metres, l, err);
    if (!code && l->type == RL_LIGHT_SPOT)
        code = read_spot(v, l, err);
    if (!code)
        code = read_amount(v, l, err);
    if (!code)
        code = read_temperature(v, l, err);
    return code ? code : read_shadow(v, l, err);
}

rl_code rl_lights_parse(rl_arena *arena, const rl_value *v, double metres, rl_lights *out, rl_error *err)
{
    *out = (rl_lights){0};
    if (v->kind != RL_MAP)
        return rl_value_wrong(v, "lights", "a map of lights", err);
    out->light = rl_arena_array(arena, v->n, sizeof *out->light);
    if (!out->light)
        return rl_fail_memory(err, v->n * sizeof *out->light);
    rl_code code = RL_OK;
    for (size_t i = 0; i < v->n && !code; i++)
        code = read_light(&v->entries[i], metres, &out->light[i], err);
    out->n = code ? 0 : v->n;
    return code;
}

void rl_light_resolve(const rl_light_spec *spec, double out[3])
{
    double scale = exp2(spec->exposure);
    if (spec->unit == RL_LIGHT_CANDELA || spec->unit == RL_LIGHT_LUX)
        scale /= spec->efficacy;
    if (spec->unit == RL_LIGHT_LUMEN) {
        /* 1 - cos(a/2) = 2 sin²(a/4), which does not cancel for narrow cones */
        double s = sin(spec->angle / 4), omega = spec->type == RL_LIGHT_SPOT ? 4 * pi * s * s : 4 * pi;
        scale /= omega * spec->efficacy;
    }
    for (int c = 0; c < 3; c++)
        out[c] = spec->amount[c] * scale;
}

void rl_light_cone(const rl_light_spec *spec, double *cos_inner, double *cos_outer)
{
    *cos_outer = cos(spec->angle / 2);
    *cos_inner = cos(spec->angle / 2 * (1 - spec->blend));
}
