/* Lights in the units of the kernels: amounts, areas, axes. */
#include <math.h>

#include "graph/model/lights.h"

static const double pi = 3.14159265358979323846;

double rl_light_area(const rl_light_spec *spec)
{
    return spec->type == RL_LIGHT_SPHERE ? pi * spec->radius_m * spec->radius_m
                                         : spec->width_m * spec->height_m;
}

/* Directions that a light of an intensity of 1 would have to fill evenly for its flux. */
static double solid_angle(const rl_light_spec *spec)
{
    double s = sin(spec->angle / 4);
    if (spec->profile)
        return rl_ies_integral(spec->profile, spec->type == RL_LIGHT_SPOT ? spec->angle / 2 : pi);
    if (spec->type == RL_LIGHT_RECT)
        return spec->two_sided ? 2 * pi : pi;
    /* 1 - cos(a/2) = 2 sin²(a/4), which does not cancel for narrow cones */
    return spec->type == RL_LIGHT_SPOT ? 4 * pi * s * s : 4 * pi;
}

void rl_light_resolve(const rl_light_spec *spec, double out[3])
{
    double scale = exp2(spec->exposure);
    if (!spec->has_amount)
        scale *= spec->profile->candela / spec->efficacy;
    else if (spec->unit >= RL_LIGHT_CANDELA)
        scale /= spec->efficacy;
    if (spec->unit == RL_LIGHT_POWER || spec->unit == RL_LIGHT_LUMEN)
        scale /= solid_angle(spec);
    if (spec->unit == RL_LIGHT_RADIANCE || spec->unit == RL_LIGHT_LUMINANCE)
        scale *= rl_light_area(spec);
    for (int c = 0; c < 3; c++)
        out[c] = spec->amount[c] * scale;
}

void rl_light_axes(const rl_light_spec *spec, double side[3], double top[3])
{
    const double *d = spec->direction, *up = spec->up;
    double along = up[0] * d[0] + up[1] * d[1] + up[2] * d[2], length = 0;
    for (int i = 0; i < 3; i++) {
        top[i] = up[i] - along * d[i];
        length += top[i] * top[i];
    }
    for (int i = 0; i < 3; i++)
        top[i] /= sqrt(length);
    for (int i = 0; i < 3; i++)
        side[i] = top[(i + 1) % 3] * d[(i + 2) % 3] - top[(i + 2) % 3] * d[(i + 1) % 3];
}

void rl_light_cone(const rl_light_spec *spec, double *cos_inner, double *cos_outer)
{
    *cos_outer = cos(spec->angle / 2);
    *cos_inner = cos(spec->angle / 2 * (1 - spec->blend));
}
