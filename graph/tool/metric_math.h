/* Powers for loops over pixels: straight-line code that the compiler turns into vectors, the same bits at
 * every vector width. Relative errors are measured in tests/test_metric_math.c: below 1e-14 for rl_fast_pow
 * of what the metrics feed it. No NaN, no infinities, no negative values in. */
#ifndef RL_TOOL_METRIC_MATH_H
#define RL_TOOL_METRIC_MATH_H

#include <stdint.h>
#include <string.h>

#define RL_MATH_INLINE static inline __attribute__((always_inline))

RL_MATH_INLINE uint64_t rl_bits_of(double v)
{
    uint64_t bits;
    memcpy(&bits, &v, sizeof bits);
    return bits;
}

RL_MATH_INLINE double rl_of_bits(uint64_t bits)
{
    double v;
    memcpy(&v, &bits, sizeof v);
    return v;
}

/* log2 of a normal number above 0; the others give something finite. m in [√½, √2), then the series of
 * artanh.
 */
RL_MATH_INLINE double rl_fast_log2(double x)
{
    const uint64_t root_half = 0x3fe6a09e667f3bcdu; /* √½ */
    /* The exponent as a double without an integer conversion, which AVX2 lacks: below 2^52 in its mantissa.
     */
    uint64_t bits = rl_bits_of(x), from = bits - root_half + ((uint64_t)1023 << 52);
    double exponent = rl_of_bits((from >> 52) | 0x4330000000000000u) - (4503599627370496.0 + 1023);
    double m = rl_of_bits((from & 0x000fffffffffffffu) + root_half);
    double s = (m - 1) / (m + 1), t = s * s;
    double t2 = t * t, t4 = t2 * t2, t8 = t4 * t4;
    double low = (1 + t * (1.0 / 3)) + (1.0 / 5 + t * (1.0 / 7)) * t2;
    double high = (1.0 / 9 + t * (1.0 / 11)) + (1.0 / 13 + t * (1.0 / 15)) * t2;
    double sum = (low + high * t4) + (1.0 / 17 + t * (1.0 / 19)) * t8;
    return exponent + 2.8853900817779268 * s * sum; /* 2 / ln 2 */
}

/* 2^t; t is taken as at least -1000 and at most 1000. Taylor's series on [-½, ½]. */
RL_MATH_INLINE double rl_fast_exp2(double t)
{
    const double magic = 6755399441055744.0; /* 1.5 · 2^52: adding it rounds to an integer */
    t = t < -1000 ? -1000 : t;
    t = t > 1000 ? 1000 : t;
    double rounded = t + magic, r = (t - (rounded - magic)) * 0.69314718055994530942;
    double r2 = r * r, r4 = r2 * r2, r8 = r4 * r4;
    double low = (1 + r) + (0.5 + r * (1.0 / 6)) * r2;
    double middle = (1.0 / 24 + r * (1.0 / 120)) + (1.0 / 720 + r * (1.0 / 5040)) * r2;
    double high = (1.0 / 40320 + r * (1.0 / 362880)) + (1.0 / 3628800 + r * (1.0 / 39916800)) * r2;
    double sum = (low + middle * r4) + (high + r4 * (1.0 / 479001600)) * r8;
    return rl_of_bits(rl_bits_of(sum) + (rl_bits_of(rounded) << 52));
}

/* x^y of x >= 0 and y > 0; below 1e-300 x counts as 0. */
RL_MATH_INLINE double rl_fast_pow(double x, double y)
{
    double v = rl_fast_exp2(y * rl_fast_log2(x));
    return x < 1e-300 ? 0 : v;
}

#endif
