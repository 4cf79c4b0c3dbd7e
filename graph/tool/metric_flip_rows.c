#include "graph/tool/metric_flip_rows.h"

#include <math.h>

#include "graph/tool/metric_math.h"

/* The paper's constants. */
static const double qc = 0.7, pc = 0.4,
                    pt = 0.95; /* 4.1.3: exponent, and where the error's remapping bends */

/* Narkowicz 2015: a fit of the ACES tone curve, (k0 x² + k1 x) / (k3 x² + k4 x + k5); its exposure of 0.6 is
 * folded into the factors. */
static const double k0 = 0.6 * 0.6 * 2.51, k1 = 0.6 * 0.03, k3 = 0.6 * 0.6 * 2.43, k4 = 0.6 * 0.59, k5 = 0.14;

/* Where the cube root of L*a*b* gives way to a line. */
#define LAB_DELTA (6.0 / 29)

double rl_flip_tone_inverse(double target)
{
    double a = k0 - target * k3, b = k1 - target * k4, c = -target * k5;
    return (-b + sqrt(b * b - 4 * a * c)) / (2 * a);
}

/* ---- bodies: loops without branches -------------------------------------------------------------------- */

RL_MATH_INLINE double clamp(double v)
{
    v = v > 0 ? v : 0;
    return v < 1 ? v : 1;
}

RL_MATH_INLINE void clamp_body(double *v, int n)
{
    for (int i = 0; i < n; i++)
        v[i] = clamp(v[i]);
}

RL_MATH_INLINE void srgb_body(double *v, int n)
{
    for (int i = 0; i < n; i++) {
        double x = clamp(v[i]), power = rl_fast_pow((x + 0.055) / 1.055, 2.4);
        v[i] = x <= 0.04045 ? x / 12.92 : power;
    }
}

/* Divided by x, so that no square overflows; the curve tends to k0 / k3, which is above 1. */
RL_MATH_INLINE void tone_body(double *v, double scale, int n)
{
    for (int i = 0; i < n; i++) {
        double x = v[i] * scale;
        double positive = x > 1e-300 ? x : 1e-300;
        double y = (k0 * positive + k1) / (k3 * positive + k4 + k5 / positive);
        v[i] = clamp(x > 1e-300 ? y : 0);
    }
}

RL_MATH_INLINE void opponent_body(double *r, double *g, double *b, int n)
{
    for (int i = 0; i < n; i++) {
        double rgb[3] = {r[i], g[i], b[i]}, xyz[3];
        for (int k = 0; k < 3; k++)
            xyz[k] = rl_xyz_from_rgb[k][0] * rgb[0] + rl_xyz_from_rgb[k][1] * rgb[1] +
                     rl_xyz_from_rgb[k][2] * rgb[2];
        r[i] = 116 * xyz[1] - 16;
        g[i] = 500 * (xyz[0] - xyz[1]);
        b[i] = 200 * (xyz[1] - xyz[2]);
    }
}

RL_MATH_INLINE double lab_root(double v)
{
    double root = rl_fast_pow(v, 1.0 / 3), line = v / (3 * LAB_DELTA * LAB_DELTA) + 4.0 / 29;
    return v > LAB_DELTA * LAB_DELTA * LAB_DELTA ? root : line;
}

RL_MATH_INLINE double dot(const double m[3], double x, double y, double z)
{
    return m[0] * x + m[1] * y + m[2] * z;
}

/* From YCxCz back to colours that a display can show. Several loops: of one the compiler makes no
 * vectors. */
RL_MATH_INLINE void shown_body(const rl_matrix *m, double *const f[RL_FLIP_FILTERED], double *const out[3],
                               int n)
{
    const double *fy = f[RL_FLIP_Y], *fx = f[RL_FLIP_CX], *f1 = f[RL_FLIP_CZ1], *f2 = f[RL_FLIP_CZ2];
    double *restrict r = out[0], *restrict g = out[1], *restrict b = out[2];
    for (int i = 0; i < n; i++)
        g[i] = (fy[i] + 16) * (1.0 / 116);
    for (int i = 0; i < n; i++)
        r[i] = g[i] + fx[i] * (1.0 / 500);
    for (int i = 0; i < n; i++)
        b[i] = g[i] - (f1[i] + f2[i]) * (1.0 / 200);
    for (int i = 0; i < n; i++) {
        double x = r[i], y = g[i], z = b[i];
        r[i] = clamp(dot(m->m[0], x, y, z));
        g[i] = clamp(dot(m->m[1], x, y, z));
        b[i] = clamp(dot(m->m[2], x, y, z));
    }
}

/* L*a*b* whose chroma is scaled by lightness, in place. */
RL_MATH_INLINE void lab_body(double *const rgb[3], int n)
{
    double *r = rgb[0], *g = rgb[1], *b = rgb[2];
    for (int i = 0; i < n; i++) {
        double x = lab_root(dot(rl_xyz_from_rgb[0], r[i], g[i], b[i]));
        double y = lab_root(dot(rl_xyz_from_rgb[1], r[i], g[i], b[i]));
        double z = lab_root(dot(rl_xyz_from_rgb[2], r[i], g[i], b[i]));
        double l = 116 * y - 16;
        r[i] = l;
        g[i] = 0.01 * l * (500 * (x - y));
        b[i] = 0.01 * l * (200 * (y - z));
    }
}

/* Filters that sum to zero: of (Y + 16) / 116, which is 0 … 1, only the factor is left. */
RL_MATH_INLINE void strength_body(const double *x, const double *y, double *out, int n)
{
    for (int i = 0; i < n; i++)
        out[i] = sqrt(x[i] * x[i] + y[i] * y[i]) / 116;
}

/* City block in lightness, Euclid in chroma; remapped; amplified by what features differ. */
RL_MATH_INLINE void compare_body(double *const a[RL_FLIP_FEATURES], double *const b[RL_FLIP_FEATURES],
                                 double largest, double *out, int n)
{
    const double *al = a[RL_FLIP_L], *aa = a[RL_FLIP_A], *ab = a[RL_FLIP_B], *ae = a[RL_FLIP_EDGE],
                 *ap = a[RL_FLIP_POINT];
    const double *bl = b[RL_FLIP_L], *ba = b[RL_FLIP_A], *bb = b[RL_FLIP_B], *be = b[RL_FLIP_EDGE],
                 *bp = b[RL_FLIP_POINT];
    double bend = pc * largest;
    for (int i = 0; i < n; i++) {
        double da = aa[i] - ba[i], db = ab[i] - bb[i];
        double error = rl_fast_pow(fabs(al[i] - bl[i]) + sqrt(da * da + db * db), qc);
        double below = pt / bend * error, above = pt + (error - bend) / (largest - bend) * (1 - pt);
        double color = error < bend ? below : above;
        double edge = fabs(ae[i] - be[i]), point = fabs(ap[i] - bp[i]), most = edge > point ? edge : point;
        double feature = sqrt(most / 1.4142135623730951); /* qf = 0.5 */
        out[i] = rl_fast_pow(color, 1 - feature);
    }
}

RL_MATH_INLINE void curve_body(rl_flip_curve curve, double scale, double *v, int n)
{
    if (curve == RL_FLIP_SRGB)
        srgb_body(v, n);
    else if (curve == RL_FLIP_TONE)
        tone_body(v, scale, n);
    else
        clamp_body(v, n);
}

RL_MATH_INLINE void features_body(const rl_matrix *m, double *const f[RL_FLIP_FILTERED],
                                  double *const out[RL_FLIP_FEATURES], int n)
{
    shown_body(m, f, out, n);
    lab_body(out, n);
    strength_body(f[RL_FLIP_EDGE_X], f[RL_FLIP_EDGE_Y], out[RL_FLIP_EDGE], n);
    strength_body(f[RL_FLIP_POINT_X], f[RL_FLIP_POINT_Y], out[RL_FLIP_POINT], n);
}

/* ---- widths of vectors --------------------------------------------------------------------------------- */

/* Wider vectors, same order, no fused operations: same bits. */
#if defined(__x86_64__) && defined(__GNUC__)
#define WIDE __attribute__((target("avx2")))
static void WIDE curve_avx2(rl_flip_curve curve, double scale, double *v, int n)
{
    curve_body(curve, scale, v, n);
}
static void WIDE opponent_avx2(double *r, double *g, double *b, int n)
{
    opponent_body(r, g, b, n);
}
static void WIDE features_avx2(const rl_matrix *m, double *const f[RL_FLIP_FILTERED],
                               double *const out[RL_FLIP_FEATURES], int n)
{
    features_body(m, f, out, n);
}
static void WIDE compare_avx2(double *const a[RL_FLIP_FEATURES], double *const b[RL_FLIP_FEATURES],
                              double largest, double *out, int n)
{
    compare_body(a, b, largest, out, n);
}
#define CALL(name, ...)                                                                                      \
    do {                                                                                                     \
        if (__builtin_cpu_supports("avx2"))                                                                  \
            name##_avx2(__VA_ARGS__);                                                                        \
        else                                                                                                 \
            name##_body(__VA_ARGS__);                                                                        \
    } while (0)
#else
#define CALL(name, ...) name##_body(__VA_ARGS__)
#endif

void rl_flip_curve_row(rl_flip_curve curve, double scale, double *values, int n)
{
    CALL(curve, curve, scale, values, n);
}

void rl_flip_opponent_row(double *const rgb[3], int n)
{
    CALL(opponent, rgb[0], rgb[1], rgb[2], n);
}

void rl_flip_features_row(const rl_matrix *rgb_from_xyz, double *const filtered[RL_FLIP_FILTERED],
                          double *const features[RL_FLIP_FEATURES], int n)
{
    CALL(features, rgb_from_xyz, filtered, features, n);
}

void rl_flip_compare_row(double *const a[RL_FLIP_FEATURES], double *const b[RL_FLIP_FEATURES], double largest,
                         double *errors, int n, float *map, int width)
{
    CALL(compare, a, b, largest, errors, n);
    for (int i = 0; i < width; i++)
        map[i] = (float)errors[i] > map[i] ? (float)errors[i] : map[i];
}
