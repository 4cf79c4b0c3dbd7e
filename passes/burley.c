/* See burley.h. */
#include "passes/burley.h"

#include <math.h>

#include "passes/shading_rows.h"

static const double pi = 3.14159265358979323846;

double rl_burley_profile(double r, double d)
{
    double t = r / d;
    return (exp(-t) + exp(-t / 3)) / (8 * pi * d * r);
}

double rl_burley_cdf(double r, double d)
{
    double t = r / d;
    return -0.25 * expm1(-t) - 0.75 * expm1(-t / 3);
}

/* With w = e^{-t/3} and u = 1 - xi: w³ + 3w = 4u, whose real root is 2 sinh(asinh(2u)/3). Near xi = 0 the
 * root is near 1 and its logarithm cancels, so there q = 1 - w is solved for: q³ - 3q² + 6q = 4 xi. */
double rl_burley_inverse(double xi)
{
    if (xi >= 0.5)
        return -3 * log(2 * sinh(asinh(2 * (1 - xi)) / 3));
    double q = 2.0 / 3.0 * xi * (1 + xi / 3);
    for (int i = 0; i < 3; i++) /* two steps leave 1e-11 at xi = ½, three leave rounding */
        q -= (((q - 3) * q + 6) * q - 4 * xi) / ((3 * q - 6) * q + 6);
    return -3 * log1p(-q);
}

void rl_burley_taps(size_t n, double offset, float *x, float *y, float *weight)
{
    const double golden = pi * (3 - sqrt(5.0)); /* radians from tap to tap */
    for (size_t i = 0; i < n; i++) {
        double r = rl_burley_inverse(RL_BURLEY_REACH * ((double)i + offset) / (double)n);
        x[i] = (float)(r * cos((double)i * golden));
        y[i] = (float)(r * sin((double)i * golden));
        weight[i] = (float)(r / (exp(-r) + exp(-r / 3)));
    }
}

/* Shares of the mixture, a channel. Channels as wide as the widest share what the narrow ones leave. */
static void mixture_of(const double d[3], double share[3])
{
    int wide = 0, narrow = 0;
    for (int c = 0; c < 3; c++)
        narrow += d[c] < 1;
    wide = 3 - narrow;
    for (int c = 0; c < 3; c++)
        share[c] = d[c] < 1 ? RL_BURLEY_NARROW : (1 - RL_BURLEY_NARROW * narrow) / wide;
}

static double mixture_cdf(double r, const double d[3], const double share[3])
{
    return share[0] * rl_burley_cdf(r, d[0]) + share[1] * rl_burley_cdf(r, d[1]) +
           share[2] * rl_burley_cdf(r, d[2]);
}

/* R(r) r, times a factor that is the same for all d: finite at r = 0. */
static double falloff(double r, double d)
{
    return (exp(-r / d) + exp(-r / (3 * d))) / d;
}

/* The radius in low … RL_BURLEY_RADIUS within which the mixture has xi: Newton's method, by halves where that
 * leaves the bracket. */
static double mixture_inverse(double xi, double low, const double d[3], const double share[3])
{
    double high = RL_BURLEY_RADIUS, r = low;
    for (int i = 0; i < 100 && high - low > 1e-14 * high; i++) {
        double miss = mixture_cdf(r, d, share) - xi, slope = 0;
        *(miss < 0 ? &low : &high) = r;
        for (int c = 0; c < 3; c++)
            slope += 0.25 * share[c] * falloff(r, d[c]);
        double next = r - miss / slope;
        next = next > low && next < high ? next : 0.5 * (low + high);
        if (fabs(next - r) <= 1e-14 * r)
            break;
        r = next;
    }
    return r;
}

void rl_burley_mixture_taps(size_t n, double offset, const double d[3], float *x, float *y, float *weight,
                            double sum[3])
{
    const double golden = pi * (3 - sqrt(5.0));
    double share[3], r = 0;
    mixture_of(d, share);
    double all = mixture_cdf(RL_BURLEY_RADIUS, d, share);
    sum[0] = sum[1] = sum[2] = 0;
    for (size_t i = 0; i < n; i++) {
        double density = 0;
        r = mixture_inverse(all * ((double)i + offset) / (double)n, r, d, share);
        for (int c = 0; c < 3; c++)
            density += share[c] * falloff(r, d[c]);
        x[i] = (float)(r * cos((double)i * golden));
        y[i] = (float)(r * sin((double)i * golden));
        weight[i] = (float)(r / density);
        for (int c = 0; c < 3; c++)
            sum[c] += d[c] * falloff(r, d[c]) / density;
    }
}

double rl_burley_scale(rl_burley_fit fit, double albedo)
{
    double t = fit == RL_BURLEY_DMFP ? albedo - 0.33 : fabs(albedo - 0.8);
    switch (fit) {
    case RL_BURLEY_SEARCHLIGHT:
        return 1.85 - albedo + 7 * t * t * t;
    case RL_BURLEY_DIFFUSE:
        return 1.9 - albedo + 3.5 * t * t;
    case RL_BURLEY_DMFP:
        return 3.5 + 100 * t * t * t * t;
    }
    return NAN;
}

static double from_mean_free_path(const double from[2])
{
    return from[0] / rl_burley_scale(RL_BURLEY_SEARCHLIGHT, from[1]);
}

static double from_mean_free_path_diffuse(const double from[2])
{
    return from[0] / rl_burley_scale(RL_BURLEY_DIFFUSE, from[1]);
}

/* The quarter of 1/pi makes Cycles' radius look as wide as that of its older cubic and Gaussian profiles. */
static double from_cycles_radius(const double from[2])
{
    return from[0] / (4 * pi * rl_burley_scale(RL_BURLEY_DIFFUSE, from[1]));
}

/* Unreal's d, in its own words: l_d is Mean Free Path Color times Distance times World Unit Scale. Profiles
 * that it has moved to Enable Mean Free Path tell l instead, with l_d = l s_8/(0.6 s_5): that is
 * mean_free_path with l/0.6. In those that it has not, World Unit Scale counts 10/3. */
static double from_unreal_dmfp(const double from[2])
{
    return from[0] / rl_burley_scale(RL_BURLEY_DMFP, from[1]);
}

#define PAPER "Christensen and Burley 2015, "
const rl_form rl_scatter_forms[RL_SCATTER_FORMS] = {
    {"scatter_distance", {"scatter_distance_mm"}, NULL, "d as given", PAPER "eq. 3 with A = 1"},
    {"mean_free_path",
     {"mean_free_path_mm", "albedo"},
     from_mean_free_path,
     "d = l/s, s = 1.85 - A + 7 |A - 0.8|^3",
     PAPER "eq. 5: light that comes in along the normal"},
    {"mean_free_path_diffuse",
     {"mean_free_path_mm", "albedo"},
     from_mean_free_path_diffuse,
     "d = l/s, s = 1.9 - A + 3.5 (A - 0.8)^2",
     PAPER "eq. 6: light that a diffuse surface lets in"},
    {"cycles_radius",
     {"cycles_radius_mm", "albedo"},
     from_cycles_radius,
     "d = radius/(4 pi s), s = 1.9 - A + 3.5 (A - 0.8)^2",
     "Cycles, kernel/closure/bssrdf.h; " PAPER "eq. 6"},
    {"unreal_dmfp",
     {"diffuse_mean_free_path_mm", "albedo"},
     from_unreal_dmfp,
     "d = l_d/s, s = 3.5 + 100 (A - 0.33)^4",
     "Unreal, BurleyNormalizedSSSCommon.ush (with its Enable Mean Free Path: mean_free_path, of "
     "l/0.6); " PAPER "eq. 8"},
};

const rl_port rl_scatter_ports[RL_SCATTER_PORTS] = {
    RL_ROWS_SCATTER_PORTS,
    RL_SCATTER_LEDGER(RL_PHASE4),
};

const rl_param rl_scatter_profile_rows[RL_SCATTER_PROFILE_ROWS] = {
    RL_ROW_SCATTER_DISTANCE(.required = true),
    RL_ROW_TEXTURING,
    RL_ROW_BORDER,
    RL_ROWS_SCATTER_PARAM,
};

const rl_param rl_scatter_shading_rows[RL_SCATTER_SHADING_ROWS] = {
    RL_ROW_DIFFUSE,
    RL_ROW_EXIT_TRANSMISSION,
};
