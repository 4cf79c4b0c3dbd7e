#include "graph/model/lights.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "graph/base/text.h"
#include "graph/model/temperature.h"

static const double pi = 3.14159265358979323846;

#define RL_LIGHT_FARTHEST  1e12 /* m, along an axis */
#define RL_LIGHT_BRIGHTEST 1e30 /* of what kernels are told; floats end at 3e38 */

const char *const rl_light_unit_names[] = {"intensity", "irradiance", "radiance", "power",
                                           "candela",   "lumen",      "lux",      "luminance"};
const char *const rl_light_type_names[] = {"point", "spot", "directional", "sphere", "rect"};

#define BIT(unit) (1u << (unit))
#define POINT_UNITS                                                                                          \
    (BIT(RL_LIGHT_INTENSITY) | BIT(RL_LIGHT_POWER) | BIT(RL_LIGHT_CANDELA) | BIT(RL_LIGHT_LUMEN))
#define AREA_UNITS  (POINT_UNITS | BIT(RL_LIGHT_RADIANCE) | BIT(RL_LIGHT_LUMINANCE))
#define SUN_UNITS   (BIT(RL_LIGHT_IRRADIANCE) | BIT(RL_LIGHT_LUX))
#define POINT_WORDS "intensity, power, candela or lumen"
#define AREA_WORDS  "radiance, intensity, power, luminance, candela or lumen"

static const struct {
    bool positioned, directed, shaped; /* shaped: may have ies */
    unsigned units;
    const char *wanted;
} types[] = {
    [RL_LIGHT_POINT] = {true, false, true, POINT_UNITS, POINT_WORDS},
    [RL_LIGHT_SPOT] = {true, true, true, POINT_UNITS, POINT_WORDS},
    [RL_LIGHT_DIRECTIONAL] = {false, true, false, SUN_UNITS, "irradiance or lux"},
    [RL_LIGHT_SPHERE] = {true, false, false, AREA_UNITS, AREA_WORDS},
    [RL_LIGHT_RECT] = {true, true, false, AREA_UNITS, AREA_WORDS},
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
    for (int u = 0; u <= RL_LIGHT_LUMINANCE; u++) {
        const rl_value *amount = rl_value_get(v, rl_light_unit_names[u]);
        if (!amount)
            continue;
        if (!(types[l->type].units & 1u << u))
            return rl_fail(err, RL_E_CONFIG, amount->where, "light '%s': a %s light takes %s, not %s",
                           l->name, rl_light_type_names[l->type], types[l->type].wanted,
                           rl_light_unit_names[u]);
        if (given)
            return rl_fail(err, RL_E_CONFIG, amount->where, "light '%s' has both %s and %s; give one",
                           l->name, rl_light_unit_names[l->unit], rl_light_unit_names[u]);
        given = amount;
        l->unit = (rl_light_unit)u;
    }
    if (!given && !l->ies)
        return rl_fail(err, RL_E_CONFIG, v->where, "light '%s' needs %s", l->name, types[l->type].wanted);
    l->has_amount = given != NULL;
    l->amount[0] = l->amount[1] = l->amount[2] = 1;
    rl_code code = given ? read_rgb(given, rl_light_unit_names[l->unit], l->amount, err) : RL_OK;
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

/* Three numbers as a unit vector. */
static rl_code read_direction(const rl_value *v, const char *key, const rl_light_spec *l, double out[3],
                              rl_error *err)
{
    rl_code code = rl_value_numbers(v, key, 3, out, err);
    double length = hypot(hypot(out[0], out[1]), out[2]);
    if (!code && !(length > 1e-12 && length < 1e150))
        return rl_fail(err, RL_E_CONFIG, v->where, "light '%s': '%s' has no usable length", l->name, key);
    for (int i = 0; i < 3 && !code; i++)
        out[i] /= length;
    return code;
}

/* Of lights that look different from around their direction. */
static rl_code read_up(const rl_value *v, rl_light_spec *l, rl_error *err)
{
    const rl_value *up = rl_value_get(v, "up");
    const double *d = l->direction;
    rl_code code = up ? read_direction(up, "up", l, l->up, err) : RL_OK;
    if (!up)
        l->up[fabs(d[1]) > 0.99 ? 2 : 1] = 1;
    double along = l->up[0] * d[0] + l->up[1] * d[1] + l->up[2] * d[2];
    if (!code && fabs(along) > 1 - 1e-6)
        code = rl_fail(err, RL_E_CONFIG, up->where, "light '%s': 'up' lies along the direction", l->name);
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
                       rl_light_type_names[l->type], missing);
    if (rl_value_get(v, "ies") && !direction)
        return rl_fail(
            err, RL_E_CONFIG, v->where,
            "light '%s': with 'ies' it needs 'direction', where the file's vertical angle 0 points", l->name);
    rl_code code = position ? rl_value_numbers(position, "position", 3, l->position_m, err) : RL_OK;
    for (int i = 0; i < 3 && !code; i++)
        if (fabs(l->position_m[i] * metres) > RL_LIGHT_FARTHEST)
            code = rl_fail(err, RL_E_CONFIG, position->where,
                           "light '%s': the position is more than %g m away; a directional light is as far "
                           "as one likes",
                           l->name, RL_LIGHT_FARTHEST);
    if (!code && direction)
        code = read_direction(direction, "direction", l, l->direction, err);
    if (!code && (l->type == RL_LIGHT_RECT || rl_value_get(v, "ies")))
        code = read_up(v, l, err);
    for (int i = 0; i < 3; i++)
        l->position_m[i] *= metres;
    return code;
}

static rl_code read_length(const rl_value *v, const char *key, double metres, const rl_light_spec *l,
                           double *out, rl_error *err)
{
    const rl_value *x = rl_value_get(v, key);
    if (!x)
        return rl_fail(err, RL_E_CONFIG, v->where, "light '%s': a %s light needs '%s'", l->name,
                       rl_light_type_names[l->type], key);
    rl_code code = rl_value_number(x, key, 0, 1e12, out, err);
    *out *= metres;
    if (!code && !(*out >= 1e-9))
        code =
            rl_fail(err, RL_E_CONFIG, x->where,
                    "light '%s': the %s is below a nanometre; a light without size is a point", l->name, key);
    return code;
}

static rl_code read_area(const rl_value *v, double metres, rl_light_spec *l, rl_error *err)
{
    const rl_value *two_sided = rl_value_get(v, "two_sided");
    if (l->type == RL_LIGHT_SPHERE)
        return read_length(v, "radius", metres, l, &l->radius_m, err);
    rl_code code = read_length(v, "width", metres, l, &l->width_m, err);
    if (!code)
        code = read_length(v, "height", metres, l, &l->height_m, err);
    if (!code && two_sided)
        code = rl_value_truth(two_sided, "two_sided", &l->two_sided, err);
    return code;
}

static rl_code read_ies(rl_arena *arena, const rl_value *v, rl_light_spec *l, rl_error *err)
{
    const rl_value *ies = rl_value_get(v, "ies");
    const char *text;
    rl_code code = ies ? rl_value_text(ies, "ies", &text, err) : RL_OK;
    if (!ies || code)
        return code;
    l->ies = rl_value_path(arena, ies);
    if (!l->ies)
        return rl_fail_memory(err, 0);
    rl_error why = {0}; /* what is in the file has its own place; that it cannot be read is said here */
    code = rl_ies_load(arena, l->ies, &l->profile, &why);
    if (code == RL_E_IO)
        rl_fail(err, code, ies->where, "light '%s': the ies file '%s' %s", l->name, l->ies, why.text);
    else if (code && err && !err->code)
        *err = why;
    return code;
}

/* Kernels compute with floats: what would not fit would be NaN in the picture. */
static rl_code check_brightness(const rl_value *v, const rl_light_spec *l, rl_error *err)
{
    double rgb[3], area = rl_light_area(l);
    rl_light_resolve(l, rgb);
    for (int c = 0; c < 3; c++)
        if (!(rgb[c] <= RL_LIGHT_BRIGHTEST && (!(area > 0) || rgb[c] / area <= RL_LIGHT_BRIGHTEST)))
            return rl_fail(err, RL_E_CONFIG, v->where,
                           "light '%s' is too bright: %g %s, at most %g can be computed with", l->name,
                           area > 0 ? rgb[c] / area : rgb[c],
                           area > 0                          ? "W/(sr m2)"
                           : l->type == RL_LIGHT_DIRECTIONAL ? "W/m2"
                                                             : "W/sr",
                           RL_LIGHT_BRIGHTEST);
    return RL_OK;
}

static rl_code read_spot(const rl_value *v, rl_light_spec *l, rl_error *err)
{
    const rl_value *angle = rl_value_get(v, "angle"), *blend = rl_value_get(v, "blend");
    if (!angle)
        return rl_fail(err, RL_E_CONFIG, v->where, "light '%s': a spot light needs 'angle' (full, degrees)",
                       l->name);
    double degrees = 0;
    rl_code code = rl_value_number(angle, "angle", 0.01, 180, &degrees, err);
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
    l->shadow_where = shadow ? shadow->where : l->where;
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
    l->colorspace_where = l->where;
    if ((x = rl_value_get(v, "enabled")))
        code = rl_value_truth(x, "enabled", &l->enabled, err);
    if (!code && (x = rl_value_get(v, "exposure")))
        code = rl_value_number(x, "exposure", -64, 64, &l->exposure, err);
    if (!code && (x = rl_value_get(v, "efficacy")))
        code = rl_value_number(x, "efficacy", DBL_MIN, 1e6, &l->efficacy, err);
    if (!code && (x = rl_value_get(v, "colorspace"))) {
        l->colorspace_where = x->where;
        code = rl_value_text(x, "colorspace", &l->colorspace, err);
    }
    if (!code && (x = rl_value_get(v, "space")))
        code = rl_value_word(x, "space", "world|camera", &space, err);
    l->in_camera_space = space == 1;
    return code;
}

/* A key that the light's type cannot use is a mistake, not decoration. */
static rl_code check_keys(const rl_value *v, const rl_light_spec *l, rl_error *err)
{
    bool shaped = types[l->type].shaped && rl_value_get(v, "ies"), rect = l->type == RL_LIGHT_RECT;
    const struct {
        const char *key;
        bool used;
    } keys[] = {
        {"position", types[l->type].positioned},
        {"direction", types[l->type].directed || shaped},
        {"angle", l->type == RL_LIGHT_SPOT},
        {"blend", l->type == RL_LIGHT_SPOT},
        {"radius", l->type == RL_LIGHT_SPHERE},
        {"width", rect},
        {"height", rect},
        {"two_sided", rect},
        {"up", rect || shaped},
        {"ies", types[l->type].shaped},
    };
    for (size_t i = 0; i < sizeof keys / sizeof *keys; i++) {
        const rl_value *x = rl_value_get(v, keys[i].key);
        if (x && !keys[i].used)
            return rl_fail(err, RL_E_CONFIG, x->where, "light '%s': a %s light has no '%s'%s", l->name,
                           rl_light_type_names[l->type], keys[i].key,
                           types[l->type].shaped &&
                                   (!strcmp(keys[i].key, "up") || !strcmp(keys[i].key, "direction"))
                               ? " without 'ies'"
                               : "");
    }
    return RL_OK;
}

/* A path into a light that is not there would make one that lacks all the rest. */
static rl_code no_such_light(const rl_value *all, const rl_entry *e, rl_error *err)
{
    const char *known[64];
    size_t n = 0;
    rl_str text = {0};
    for (size_t i = 0; i < all->n && n < sizeof known / sizeof *known; i++)
        if (&all->entries[i] != e)
            known[n++] = all->entries[i].key;
    rl_suggest(&text, e->key, known, n, "known");
    rl_code code = rl_fail(err, RL_E_CONFIG, e->value->where,
                           "there is no light '%s'%s (a new one needs 'type' and 'position' or 'direction')",
                           e->key, rl_str_text(&text));
    rl_str_free(&text);
    return code;
}

static rl_code read_type(const rl_value *all, const rl_entry *e, rl_light_spec *l, rl_error *err)
{
    static const char *const known[] = {
        "type",     "position", "direction", "up",    "angle",     "blend",       "radius",
        "width",    "height",   "two_sided", "ies",   "intensity", "power",       "irradiance",
        "radiance", "candela",  "lumen",     "lux",   "luminance", "color",       "colorspace",
        "efficacy", "exposure", "enabled",   "space", "shadow",    "temperature", "tint"};
    const rl_value *v = e->value, *type = rl_value_get(v, "type");
    int t = 0;
    rl_str what = {0};
    rl_str_printf(&what, "light '%s'", e->key);
    rl_code code = what.failed ? rl_fail_memory(err, what.room)
                               : rl_value_keys(v, what.text, known, sizeof known / sizeof *known, err);
    rl_str_free(&what);
    if (code)
        return code;
    if (!type && v->implied)
        return no_such_light(all, e, err);
    if (!type)
        return rl_fail(err, RL_E_CONFIG, v->where,
                       "light '%s' needs 'type': point, spot, directional, sphere or rect", e->key);
    code = rl_value_word(type, "type", "point|spot|directional|sphere|rect", &t, err);
    l->name = e->key;
    l->where = e->where;
    l->type = (rl_light_type)t;
    return code;
}

static rl_code read_light(rl_arena *arena, const rl_value *all, const rl_entry *e, double metres,
                          rl_light_spec *l, rl_error *err)
{
    const rl_value *v = e->value;
    rl_code code = read_type(all, e, l, err);
    if (!code)
        code = check_keys(v, l, err);
    if (!code)
        code = read_common(v, l, err);
    if (!code)
        code = read_placement(v, metres, l, err);
    if (!code && l->type == RL_LIGHT_SPOT)
        code = read_spot(v, l, err);
    if (!code && (l->type == RL_LIGHT_SPHERE || l->type == RL_LIGHT_RECT))
        code = read_area(v, metres, l, err);
    if (!code)
        code = read_ies(arena, v, l, err);
    if (!code)
        code = read_amount(v, l, err);
    if (!code)
        code = check_brightness(v, l, err);
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
        code = read_light(arena, v, &v->entries[i], metres, &out->light[i], err);
    out->n = code ? 0 : v->n;
    return code;
}
