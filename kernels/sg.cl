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

/* ---- ambient light ---------------------------------------------------------------------------------------- */

/* Mean of P_1 and P_2 over a normalized Gaussian: what is left of bands 1 and 2 of the light behind it. coth(lambda) - 1/lambda and
 * 1 - 3 a1/lambda; where those cancel, their series. Relative errors 1e-6 of a1, 3e-5 of a2. */
static inline floatv sg_band1(floatv lambda)
{
    floatv safe = fmax(lambda, 0.5f), e = rl_exp2(-2.0f * 1.44269504f * safe), q = lambda * lambda;
    floatv closed = (1.0f + e) / (1.0f - e) - 1.0f / safe;
    floatv series = lambda * (1.0f / 3 + q * (-1.0f / 45 + q * (2.0f / 945 + q * (-1.0f / 4725 + q * (2.0f / 93555)))));
    return rl_select(closed, series, lambda < 0.5f);
}

static inline floatv sg_band2(floatv lambda, floatv band1)
{
    floatv q = lambda * lambda, series = q * (1.0f / 15 + q * (-2.0f / 315 + q * (1.0f / 1575 + q * (-2.0f / 31185))));
    return rl_select(1.0f - 3.0f * band1 / fmax(lambda, 0.5f), series, lambda < 0.5f);
}

/* Irradiance of 9 coefficients (Ramamoorthi and Hanrahan 2001: pi, 2 pi/3, pi/4), bands 1 and 2 times a1 and a2. What rings below
 * nothing is nothing. */
static inline floatv sh_irradiance(constant ambient_t *a, int c, const floatv *n, floatv a1, floatv a2)
{
    constant const float *l = a->sh + c;
    floatv band1 = fma(l[3], n[1], fma(l[6], n[2], l[9] * n[0]));
    floatv band2 = 1.092548431f * (fma(l[12] * n[0], n[1], fma(l[15] * n[1], n[2], l[21] * n[0] * n[2])));
    band2 += 0.315391565f * l[18] * fma(3.0f * n[2], n[2], -1.0f) + 0.546274215f * l[24] * fma(n[0], n[0], -n[1] * n[1]);
    floatv e = fma(a1 * (2.0f * RL_PI / 3.0f * 0.488602512f), band1, a2 * (RL_PI / 4.0f) * band2);
    return fmax(fma(RL_PI * 0.282094792f, l[0], e), 0.0f);
}

/* Two Gaussians convolved are nearly one: it keeps the flux and the first band, a1 = a1' a1'' (Mardia and Jupp 2000), with the inverse
 * of Banerjee et al. 2005. Irradiance within 0.015 of the flux; the product rule l'l''/(l' + l'') is off by up to 0.5 where lobes
 * are wide (tests/test_ambient.c). */
static inline floatv sg_convolved(floatv band1)
{
    floatv q = band1 * band1;
    return clamp(band1 * (3.0f - q) / fmax(1.0f - q, 1e-7f), SG_WIDEST, SG_SHARPEST);
}

/* Adds irradiance per unit of flux of all lobes, weighted with channel c's flux. `scattered`: behind a Gaussian with that band1. */
static inline floatv lobe_irradiance(constant ambient_t *a, int c, const floatv *n, int scattered, floatv band1)
{
    floatv sum = 0.0f;
    for (int i = 0; i < a->lobes; i++) {
        constant lobe_t *lobe = &a->lobe[i];
        floatv lambda = lobe->sharpness, mu = fma(n[0], lobe->axis[0], fma(n[1], lobe->axis[1], n[2] * lobe->axis[2]));
        if (scattered)
            lambda = rl_select(sg_convolved(band1 * sg_band1(lambda)), lambda, band1 >= 1.0f);
        sg_t s = sg_make(lambda);
        sum = fma(lobe->flux[c], sg_irradiance(&s, mu), sum);
    }
    return sum;
}
