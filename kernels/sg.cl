/* Spherical Gaussians: G(v) = a e^(lambda (axis.v - 1)), a = lambda / (2 pi (1 - e^-2 lambda)), whose integral is 1. A light that
 * scatters in a surface of radius r with variance v a axis is blurred by one of sharpness r^2/v (MJP). */

/* What the irradiance of a normalized SG needs that does not depend on its axis; mu = axis.n:
 * E = scale y + bias + slope mu, y = |c0 mu| <= ramp ? (c0 mu + ramp)^2 per_x : saturate(mu). */
typedef struct sg_t {
    floatv scale, bias, slope, ramp, per_x;
} sg_t;

#define SG_SHARPEST 1e4f
#define SG_WIDEST   1e-3f
#define SG_C0       0.36f

/* Hill's fit, corrected for small sharpness (below 0.1: the first two terms of the series in lambda). Within 0.020 of the integral
 * for lambda from 0.01 to 1e4, within 1e-4 below 0.1 (tests/test_sg.c). */
static inline sg_t sg_make(floatv lambda)
{
    const float log2_e = 1.44269504f;
    sg_t s;
    floatv safe = fmax(lambda, 0.05f), per = 1.0f / safe;
    floatv e = rl_exp2(-log2_e * safe), e2 = e * e, whole = 1.0f / (1.0f - e2), left = (1.0f - e2) * per;
    floatv x = sqrt(left - e2);
    intv wide = lambda < 0.1f;
    s.scale = rl_select((1.0f + e2 - left) * whole, 0.0f, wide);
    s.bias = rl_select(((e - e2) * per - e2) * whole, 0.25f, wide);
    s.slope = rl_select(0.0f, lambda * (1.0f / 6.0f), wide);
    s.ramp = x * (0.25f / SG_C0);
    s.per_x = 1.0f / x;
    return s;
}

static inline floatv sg_irradiance(const sg_t *s, floatv mu)
{
    floatv c = SG_C0 * mu, t = c + s->ramp;
    floatv y = rl_select(clamp(mu, 0.0f, 1.0f), t * t * s->per_x, fabs(c) <= s->ramp);
    return fma(s->scale, y, fma(s->slope, mu, s->bias));
}

/* lambda = r^2/v, both in mm; the sign of the curvature (1/m) does not matter: a hollow spreads light as far as a hill. */
static inline floatv sg_sharpness(floatv curvature, float variance_mm2)
{
    return clamp(1e6f / fmax(curvature * curvature * variance_mm2, 1e-30f), SG_WIDEST, SG_SHARPEST);
}
