/* Lights as pipelines and manifests write them, and what they are in SI radiometry.
 *
 *     key: {type: point, position: [x, y, z], intensity: [r, g, b]}                       W/sr
 *     top: {type: spot, position: …, direction: […], angle: 40, blend: 0.2, candela: 900} full angle, degrees
 *     sun: {type: directional, direction: […], irradiance: 3, color: [1, 0.9, 0.8]}       W/m²
 *
 *     ball: {type: sphere, position: …, radius: 0.1, radiance: 40}                        W/(sr m²)
 *     box: {type: rect, position: …, direction: …, up: …, width: 1, height: 0.5, two_sided: false, power: 60}
 *
 * A rect shines along `direction`; its height lies along `up`, by default y of its space, z where the
 * direction is within 8 degrees of y. Lengths are in the capture's unit. All but directional lights take
 * `intensity` (W/sr; a rect's along its direction) or `power` (W), area lights `radiance` too.
 * Photometric keys, at `efficacy` lm/W (683 unless given): candela and lumen in place of intensity and power,
 * luminance (cd/m²) of radiance, lux of irradiance. Every amount is one number or three; `color` multiplies
 * it, `exposure` (stops) too.
 *
 *     lamp: {type: point, position: …, direction: [0, -1, 0], ies: lamp.ies, up: [1, 0, 0]}
 *
 * `ies` shapes a point or spot light: vertical angle 0 of the file is `direction`, horizontal angle 0 is
 * `up`. Without an amount the light has the file's candela (and `color`, `exposure`, `temperature`);
 * intensity and candela are those of the brightest direction, power and lumen the whole flux (a spot's, in
 * its cone).
 *
 *     bulb: {type: point, position: …, candela: 80, temperature: 2700, tint: 0.003}
 *
 * `temperature` in place of `color`: a black body's of 1000 … 40000 K, `tint` off its locus by -0.05 … 0.05
 * in CIE 1960 u, v (positive is greener; D65 is 6504 K with 0.0032). It leaves the luminance as it is
 * (temperature.h). */
#ifndef RL_MODEL_LIGHTS_H
#define RL_MODEL_LIGHTS_H

#include <stdbool.h>
#include <stddef.h>

#include "graph/base/arena.h"
#include "graph/base/error.h"
#include "graph/model/ies.h"
#include "graph/model/value.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum rl_light_type {
    RL_LIGHT_POINT,
    RL_LIGHT_SPOT,
    RL_LIGHT_DIRECTIONAL,
    RL_LIGHT_SPHERE,
    RL_LIGHT_RECT,
} rl_light_type;
/* Radiometric ones first. */
typedef enum rl_light_unit {
    RL_LIGHT_INTENSITY,  /* W/sr */
    RL_LIGHT_IRRADIANCE, /* W/m² on a surface that faces the light */
    RL_LIGHT_RADIANCE,   /* W/(sr m²) */
    RL_LIGHT_POWER,      /* W */
    RL_LIGHT_CANDELA,    /* lm/sr */
    RL_LIGHT_LUMEN,
    RL_LIGHT_LUX,       /* lm/m² */
    RL_LIGHT_LUMINANCE, /* cd/m² */
} rl_light_unit;
/* As in YAML, by type and by unit. */
extern const char *const rl_light_type_names[];
extern const char *const rl_light_unit_names[];
typedef enum rl_shadow { RL_SHADOW_LAYER, RL_SHADOW_SCREEN, RL_SHADOW_NONE } rl_shadow;

/* As written, with the defaults filled in. Texts live in the arena. */
typedef struct rl_light_spec {
    const char *name;
    rl_where where; /* of the name */
    rl_light_type type;
    bool enabled;             /* default true */
    bool in_camera_space;     /* position and direction: `space: camera`, else world */
    double position_m[3];     /* metres; of all but directional ones */
    double direction[3];      /* unit, the way the light travels; spot, directional, rect, with ies */
    double up[3];             /* unit, not along direction; rect, with ies */
    double radius_m;          /* sphere, > 0 */
    double width_m, height_m; /* rect, > 0 */
    bool two_sided;           /* rect: shines along -direction too */
    const char *ies;          /* path, NULL = none; point, spot */
    const rl_ies *profile;    /* what it says */
    double angle;             /* spot: full angle, radians, 0 < angle < pi */
    double blend;             /* spot: 0 hard … 1 soft from the axis on */
    rl_light_unit unit;
    double amount[3];       /* in `unit`, times color; r, g, b; >= 0 */
    double kelvin;          /* of the colour that the amounts have besides; 0 = none */
    double duv;             /* tint of that colour, see temperature.h */
    bool has_amount;        /* false: the profile's candela, and `amount` is the colour alone */
    double efficacy;        /* lm/W, > 0 */
    double exposure;        /* stops */
    const char *colorspace; /* of the amounts; default "lin_rec709" */
    rl_where colorspace_where, shadow_where; /* of these values, of the light where there are none */
    rl_shadow shadow;
    const char *shadow_layer; /* RL_SHADOW_LAYER: the L of shadow.L */
    bool shadow_named;        /* false: it is the default, the light's own name, and may be absent */
} rl_light_spec;

typedef struct rl_lights {
    rl_light_spec *light; /* in the order of the file */
    size_t n;
} rl_lights;

/* A map of lights. `metres` is the length of one unit of `position`. */
rl_code rl_lights_parse(rl_arena *arena, const rl_value *v, double metres, rl_lights *out, rl_error *err);

/* What the kernels see, but in the light's own colour space: W/sr (of a rect along its direction, with ies in
 * the brightest direction), W/m² for directional, exposure applied, the temperature's colour not:
 * rl_kelvin_rgb makes its factors for that space.
 *     candela: I = Iv/efficacy     lux: E = Ev/efficacy     power: as lumen, without efficacy
 *     lumen, point, sphere: I = F/(4·pi·efficacy)
 *     lumen, spot: I = F/(omega·efficacy), omega = 2·pi·(1 - cos(angle/2)): the flux that the cone would
 * send with a hard edge. With `blend` the soft rim lies inside the cone and the light sends less.
 *     lumen, rect: I = F/(pi·sides·efficacy)
 *     with ies: omega = the integral of the profile over all directions, of a spot over those in its cone
 *     radiance, luminance: I = L·area, area = pi·radius² or width·height */
void rl_light_resolve(const rl_light_spec *spec, double out[3]);

/* The area that an area light shows, m²: of a sphere from anywhere far off, of a rect from its direction. */
double rl_light_area(const rl_light_spec *spec);

/* Unit axes across `direction`, of lights that have `up`: `top` is up's part, side x top = direction. */
void rl_light_axes(const rl_light_spec *spec, double side[3], double top[3]);

/* Cosines of the half angles between which a spot falls from 1 to 0: the inner half angle is (1 - blend)
 * times the outer one. */
void rl_light_cone(const rl_light_spec *spec, double *cos_inner, double *cos_outer);

#ifdef __cplusplus
}
#endif
#endif
