#include "graph/model/ambient.h"

#include <float.h>
#include <math.h>

static const double pi = 3.14159265358979323846;

/* ---- reading ---------------------------------------------------------------------------------------------
 */

/* One number, or three. */
static rl_code read_rgb(const rl_value *v, const char *name, double min, double out[3], rl_error *err)
{
    bool list = v->kind == RL_LIST;
    if (v->kind != RL_NUMBER && (!list || v->n != 3))
        return rl_value_wrong(v, name, "a number or a list of 3 numbers", err);
    rl_code code = RL_OK;
    for (size_t i = 0; i < 3 && !code; i++)
        code = rl_value_number(list ? v->items[i] : v, name, min, FLT_MAX, &out[i], err);
    return code;
}

static rl_code read_sh(const rl_value *v, rl_ambient *a, rl_error *err)
{
    if (v->kind != RL_LIST || v->n != RL_AMBIENT_BANDS)
        return rl_value_wrong(v, "sh", "a list of 9 coefficients", err);
    rl_code code = RL_OK;
    for (size_t i = 0; i < RL_AMBIENT_BANDS && !code; i++)
        code = read_rgb(v->items[i], "sh", -FLT_MAX, a->sh[i], err);
    return code;
}

static rl_code read_lobe(const rl_value *v, rl_ambient_lobe *lobe, rl_error *err)
{
    static const char *const keys[] = {"axis", "sharpness", "amplitude"};
    rl_code code = rl_value_keys(v, "a lobe", keys, 3, err);
    for (size_t i = 0; i < 3 && !code; i++)
        if (!rl_value_get(v, keys[i]))
            code = rl_fail(err, RL_E_CONFIG, v->where, "a lobe needs '%s'", keys[i]);
    if (!code)
        code = rl_value_numbers(rl_value_get(v, "axis"), "axis", 3, lobe->axis, err);
    if (!code)
        code = rl_value_number(rl_value_get(v, "sharpness"), "sharpness", 1e-3, 1e4, &lobe->sharpness, err);
    if (!code)
        code = read_rgb(rl_value_get(v, "amplitude"), "amplitude", 0, lobe->amplitude, err);
    double length = hypot(hypot(lobe->axis[0], lobe->axis[1]), lobe->axis[2]);
    if (!code && !(length > 1e-12 && length < 1e150))
        code = rl_fail(err, RL_E_CONFIG, rl_value_get(v, "axis")->where, "'axis' has no usable length");
    for (int i = 0; i < 3; i++)
        lobe->axis[i] /= length;
    return code;
}

static rl_code read_lobes(const rl_value *v, rl_ambient *a, rl_error *err)
{
    if (v->kind != RL_LIST || v->n > RL_AMBIENT_LOBES)
        return rl_value_wrong(v, "lobes", "a list of at most 16 lobes", err);
    rl_code code = RL_OK;
    for (size_t i = 0; i < v->n && !code; i++)
        code = read_lobe(v->items[i], &a->lobes[i], err);
    a->n_lobes = v->n;
    return code;
}

/* Keys that only an HDRI has. */
static rl_code read_hdri(rl_arena *arena, const rl_value *v, rl_ambient *a, rl_error *err)
{
    const rl_value *hdri = rl_value_get(v, "hdri"), *up = rl_value_get(v, "up"),
                   *turn = rl_value_get(v, "rotation"), *specular = rl_value_get(v, "specular");
    const rl_value *stray = up ? up : turn ? turn : specular;
    const char *text;
    int axis = 0;
    double degrees = 0;
    if (!hdri)
        return stray ? rl_fail(err, RL_E_CONFIG, stray->where, "'%s' is of an hdri, and there is none",
                               up     ? "up"
                               : turn ? "rotation"
                                      : "specular")
                     : RL_OK;
    a->hdri_where = hdri->where;
    if (!up)
        return rl_fail(err, RL_E_CONFIG, hdri->where,
                       "an hdri needs 'up', the world axis that points up: y or z");
    rl_code code = rl_value_text(hdri, "hdri", &text, err);
    if (!code)
        code = rl_value_word(up, "up", "y|z", &axis, err);
    if (!code && turn)
        code = rl_value_number(turn, "rotation", -36000, 36000, &degrees, err);
    if (!code && specular)
        code = rl_value_truth(specular, "specular", &a->specular, err);
    if (!code && !(a->hdri = rl_value_path(arena, hdri)))
        code = rl_fail_memory(err, 0);
    a->z_up = axis == 1;
    a->rotation = degrees * pi / 180;
    return code;
}

rl_code rl_ambient_parse(rl_arena *arena, const rl_value *v, rl_ambient *out, rl_error *err)
{
    static const char *const keys[] = {"sh",       "lobes",    "hdri",      "up",
                                       "rotation", "specular", "intensity", "colorspace"};
    const rl_value *x;
    *out = (rl_ambient){
        .intensity = {1, 1, 1}, .specular = true, .colorspace = "lin_rec709", .colorspace_where = v->where};
    rl_code code = rl_value_keys(v, "ambient", keys, sizeof keys / sizeof *keys, err);
    if (!code && (x = rl_value_get(v, "sh")))
        code = read_sh(x, out, err);
    if (!code && (x = rl_value_get(v, "lobes")))
        code = read_lobes(x, out, err);
    if (!code)
        code = read_hdri(arena, v, out, err);
    if (!code && (x = rl_value_get(v, "intensity")))
        code = read_rgb(x, "intensity", 0, out->intensity, err);
    if (!code && (x = rl_value_get(v, "colorspace"))) {
        out->colorspace_where = x->where;
        code = rl_value_text(x, "colorspace", &out->colorspace, err);
    }
    return code;
}

/* ---- harmonics -------------------------------------------------------------------------------------------
 */

void rl_ambient_basis(const double d[3], double out[RL_AMBIENT_BANDS])
{
    double c0 = sqrt(1 / (4 * pi)), c1 = sqrt(3 / (4 * pi)), c2 = sqrt(15 / (4 * pi)), x = d[0], y = d[1],
           z = d[2];
    const double values[RL_AMBIENT_BANDS] = {c0,
                                             c1 * y,
                                             c1 * z,
                                             c1 * x,
                                             c2 * x * y,
                                             c2 * y * z,
                                             c2 / sqrt(12) * (3 * z * z - 1),
                                             c2 * x * z,
                                             c2 / 2 * (x * x - y * y)};
    for (int i = 0; i < RL_AMBIENT_BANDS; i++)
        out[i] = values[i];
}

void rl_ambient_direction(const rl_ambient *a, double u, double v, double out[3])
{
    double longitude = a->rotation - 2 * pi * (u - 0.5), latitude = pi * (0.5 - v);
    double front = cos(latitude) * cos(longitude), left = cos(latitude) * sin(longitude), up = sin(latitude);
    out[0] = a->z_up ? front : left;
    out[1] = a->z_up ? left : up;
    out[2] = a->z_up ? up : front;
}

void rl_ambient_place(const rl_ambient *a, const double d[3], double *u, double *v)
{
    double front = d[a->z_up ? 0 : 2], left = d[a->z_up ? 1 : 0], up = d[a->z_up ? 2 : 1];
    double turns = (a->rotation - atan2(left, front)) / (2 * pi) + 0.5;
    *u = turns - floor(turns);
    *v = 0.5 - asin(fmin(fmax(up, -1), 1)) / pi;
}

/* Pixels of a coarse map are summed in so many parts: one direction for each would tint even light, by 5e-4
 * at 64 x 32 pixels. */
static int parts(int pixels, int wanted)
{
    return pixels < wanted ? (wanted + pixels - 1) / pixels : 1;
}

unsigned long long rl_ambient_project(const rl_ambient *a, const float *const plane[3], int width, int height,
                                      double sh[RL_AMBIENT_BANDS][3])
{
    unsigned long long bad = 0;
    int across = parts(width, 512), down = parts(height, 256), columns = across * width, rows = down * height;
    for (int y = 0; y < rows; y++) {
        double top = cos(pi * y / rows), bottom = cos(pi * (y + 1) / rows),
               solid = 2 * pi / columns * (top - bottom);
        for (int x = 0; x < columns; x++) {
            double d[3], basis[RL_AMBIENT_BANDS];
            rl_ambient_direction(a, (x + 0.5) / columns, (y + 0.5) / rows, d);
            rl_ambient_basis(d, basis);
            for (int c = 0; c < 3; c++) {
                double l = (double)plane[c][(size_t)(y / down) * (size_t)width + (size_t)(x / across)];
                bad += isfinite(l) || x % across || y % down ? 0 : 1;
                for (int i = 0; i < RL_AMBIENT_BANDS && isfinite(l); i++)
                    sh[i][c] += l * basis[i] * solid;
            }
        }
    }
    return bad;
}

double rl_ambient_lobe_flux(double sharpness)
{
    return -2 * pi * expm1(-2 * sharpness) / sharpness;
}
