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

const rl_param rl_scatter_profile_rows[RL_SCATTER_PROFILE_ROWS] = {
    RL_ROW_SCATTER_DISTANCE(.required = true),
    RL_ROW_TEXTURING,
    RL_ROW_BORDER,
};

const rl_param rl_scatter_shading_rows[RL_SCATTER_SHADING_ROWS] = {
    RL_ROW_DIFFUSE,
    RL_ROW_EXIT_TRANSMISSION,
};
