/* Fits linearly transformed cosines (Heitz, Dupuy, Hill, Neubelt 2016) to the GGX lobe of kernels/surface.cl
 * and writes passes/ltc_table.h: `fit_ltc > passes/ltc_table.h`, 20 s. Everything in double, no random
 * numbers, so that the same compiler writes the same file.
 *
 * The lobe is f cos = D V n.l: isotropic GGX, alpha = roughness^2, height-correlated Smith, without Fresnel.
 * A cosine over pi, of a direction that M^-1 took away, has D(w) = max(p.z, 0) |M^-1| / (pi |p|^4), p = M^-1
 * w. M = [X Y Z] of the lobe's mean direction Z times (m11 0 m13; 0 m22 0; 0 0 1); three numbers are fitted a
 * lobe, by Nelder and Mead's simplex, to the least sum of |f cos - D|^3, each sampled half by the lobe
 * (visible normals, Heitz 2018) and half by D. Scale does not matter, so M^-1 is divided by its middle
 * element. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "kernels/shared.h"

enum {
    VALUES = RL_LTC_VALUES,
    ROUGH = RL_LTC_SIDE,
    ANGLES = RL_LTC_SIDE,
    SIDE = 32,
    SAMPLES = SIDE * SIDE,
    FINE = 256
};

static const double pi = 3.14159265358979323846;

typedef struct lobe {
    double alpha, v[3]; /* towards the camera, y = 0 */
    double norm, fresnel, mean[3];
    double w[SAMPLES][3], f[SAMPLES], pdf[SAMPLES]; /* samples of its own */
} lobe;

typedef struct transform {
    double m[3][3], inverse[3][3], det; /* det of the inverse */
    double above;                       /* share of it above the surface */
} transform;

enum { UNKNOWNS = 4, CORNERS = UNKNOWNS + 1 };

static double dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void normalize(double *a)
{
    double length = sqrt(dot(a, a));
    for (int i = 0; i < 3; i++)
        a[i] /= length;
}

static void cross(const double *a, const double *b, double *out)
{
    for (int i = 0; i < 3; i++)
        out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

/* ---- the lobe --------------------------------------------------------------------------------------------
 */

/* f cos, and the density of visible normals as one of directions. */
static double lobe_at(const lobe *g, const double *l, double *pdf)
{
    double a2 = g->alpha * g->alpha, h[3], nv = g->v[2], nl = l[2];
    for (int i = 0; i < 3; i++)
        h[i] = l[i] + g->v[i];
    double hh = dot(h, h), sine = (h[0] * h[0] + h[1] * h[1]) / hh, cosine = h[2] * h[2] / hh;
    double base = a2 * cosine + sine, d = a2 / (pi * base * base);
    double sv = sqrt(nv * nv * (1 - a2) + a2);
    *pdf = hh > 1e-300 && h[2] > 0 ? d / (2 * (nv + sv)) : 0;
    if (nl <= 0)
        return 0;
    return d * nl * 0.5 / (nl * sv + nv * sqrt(nl * nl * (1 - a2) + a2));
}

/* A direction for (a, b) of the unit square, and (1 - v.h)^5. */
static void lobe_sample(const lobe *g, double a, double b, double *l, double *fresnel)
{
    double s[3] = {g->alpha * g->v[0], g->alpha * g->v[1], g->v[2]}, t[3] = {0, 1, 0}, u[3], h[3];
    normalize(s);
    cross(t, s, u); /* v has y = 0, so t is across it */
    double r = sqrt(a), x = r * cos(2 * pi * b), y = r * sin(2 * pi * b), k = 0.5 * (1 + s[2]);
    y = (1 - k) * sqrt(1 - x * x) + k * y;
    double z = sqrt(fmax(1 - x * x - y * y, 0));
    /* across and along: (t, s x t) with s x t in the half of the disk that is cut */
    for (int i = 0; i < 3; i++)
        h[i] = x * t[i] - y * u[i] + z * s[i];
    h[0] *= g->alpha;
    h[1] *= g->alpha;
    h[2] = fmax(h[2], 1e-12);
    normalize(h);
    double vh = dot(g->v, h);
    for (int i = 0; i < 3; i++)
        l[i] = 2 * vh * h[i] - g->v[i];
    *fresnel = pow(1 - fmin(fmax(vh, 0), 1), 5);
}

static void lobe_make(lobe *g, double alpha, double nv)
{
    double l[3], fresnel, pdf;
    memset(g, 0, sizeof *g);
    g->alpha = alpha;
    g->v[0] = sqrt(1 - nv * nv);
    g->v[2] = nv;
    for (int i = 0; i < FINE * FINE; i++) {
        lobe_sample(g, (i / FINE + 0.5) / FINE, (i % FINE + 0.5) / FINE, l, &fresnel);
        double weight = lobe_at(g, l, &pdf);
        weight /= pdf * FINE * FINE;
        g->norm += weight;
        g->fresnel += weight * fresnel;
        for (int k = 0; k < 3; k++)
            g->mean[k] += weight * l[k];
    }
    g->mean[1] = 0;
    normalize(g->mean);
    for (int i = 0; i < SAMPLES; i++) {
        lobe_sample(g, (i / SIDE + 0.5) / SIDE, (i % SIDE + 0.5) / SIDE, g->w[i], &fresnel);
        g->f[i] = lobe_at(g, g->w[i], &g->pdf[i]) / g->norm;
    }
}

/* ---- the transformed cosine ------------------------------------------------------------------------------
 */

/* x: log m11, log m22, m13/m11, and the angle from the lobe's mean direction to Z; at normal incidence m11 =
 * m22 and the others are 0. The surface's half-space becomes one around M^T z, and a cosine has (1 + cos)/2
 * of itself in a half-space that is tilted by that. */
static void transform_make(transform *t, const lobe *g, const double *x, int isotropic)
{
    double a = exp(x[0]), b = exp(isotropic ? x[0] : x[1]), c = isotropic ? 0 : x[2] * a;
    double angle = atan2(g->mean[0], g->mean[2]) + (isotropic ? 0 : x[3]), z[2] = {sin(angle), cos(angle)};
    const double shape[3][3] = {{a, 0, c}, {0, b, 0}, {0, 0, 1}},
                 back[3][3] = {{1 / a, 0, -c / a}, {0, 1 / b, 0}, {0, 0, 1}};
    const double frame[3][3] = {{z[1], 0, z[0]}, {0, 1, 0}, {-z[0], 0, z[1]}};
    memset(t, 0, sizeof *t);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++) {
                t->m[i][j] += frame[i][k] * shape[k][j];
                t->inverse[i][j] += back[i][k] * frame[j][k];
            }
    t->det = 1 / (a * b);
    t->above = 0.5 * (1 + t->m[2][2] / sqrt(dot(t->m[2], t->m[2])));
}

/* Above the surface, with an integral of 1 there; `whole`, the density of transform_sample, has one with what
 * is below. */
static double transform_at(const transform *t, const double *w, double *whole)
{
    double p[3];
    for (int i = 0; i < 3; i++)
        p[i] = dot(t->inverse[i], w);
    double pp = dot(p, p);
    *whole = p[2] <= 0 ? 0 : p[2] * t->det / (pi * pp * pp);
    return w[2] > 0 ? *whole / t->above : 0;
}

static void transform_sample(const transform *t, double a, double b, double *w)
{
    double r = sqrt(a), p[3] = {r * cos(2 * pi * b), r * sin(2 * pi * b), sqrt(1 - a)};
    for (int i = 0; i < 3; i++)
        w[i] = dot(t->m[i], p);
    normalize(w);
}

static double cubed(double a)
{
    return fabs(a) * a * a;
}

static double misfit(const lobe *g, const double *x, int isotropic)
{
    transform t;
    double sum = 0, w[3], pdf, whole;
    transform_make(&t, g, x, isotropic);
    for (int i = 0; i < SAMPLES; i++) {
        double d = transform_at(&t, g->w[i], &whole);
        sum += cubed(g->f[i] - d) / (g->pdf[i] + whole);
        transform_sample(&t, (i / SIDE + 0.5) / SIDE, (i % SIDE + 0.5) / SIDE, w);
        d = transform_at(&t, w, &whole);
        double f = lobe_at(g, w, &pdf) / g->norm;
        sum += cubed(f - d) / (pdf + whole);
    }
    return sum;
}

/* ---- the fit ---------------------------------------------------------------------------------------------
 */

typedef struct corner {
    double x[UNKNOWNS], error;
} corner;

static void try_point(const lobe *g, const double *middle, const corner *worst, double way, int isotropic,
                      corner *out)
{
    for (int i = 0; i < UNKNOWNS; i++)
        out->x[i] = middle[i] + way * (middle[i] - worst->x[i]);
    out->error = misfit(g, out->x, isotropic);
}

static void sort(corner *c)
{
    for (int i = 1; i < CORNERS; i++)
        for (int k = i; k > 0 && c[k].error < c[k - 1].error; k--) {
            corner swap = c[k];
            c[k] = c[k - 1];
            c[k - 1] = swap;
        }
}

static void shrink(const lobe *g, corner *c, int isotropic)
{
    for (int i = 1; i < CORNERS; i++) {
        for (int k = 0; k < UNKNOWNS; k++)
            c[i].x[k] = 0.5 * (c[i].x[k] + c[0].x[k]);
        c[i].error = misfit(g, c[i].x, isotropic);
    }
}

/* Nelder and Mead 1965. */
static void fit(const lobe *g, double *x, int isotropic)
{
    corner c[CORNERS], a, b;
    for (int i = 0; i < CORNERS; i++) {
        memcpy(c[i].x, x, sizeof c[i].x);
        if (i)
            c[i].x[i - 1] += 0.15;
        c[i].error = misfit(g, c[i].x, isotropic);
    }
    for (int step = 0; step < 200; step++) {
        sort(c);
        if (c[UNKNOWNS].error - c[0].error < 1e-7 * c[0].error)
            break;
        double middle[UNKNOWNS] = {0};
        for (int i = 0; i < UNKNOWNS * UNKNOWNS; i++)
            middle[i % UNKNOWNS] += c[i / UNKNOWNS].x[i % UNKNOWNS] / UNKNOWNS;
        try_point(g, middle, &c[UNKNOWNS], 1, isotropic, &a);
        if (a.error < c[0].error) {
            try_point(g, middle, &c[UNKNOWNS], 2, isotropic, &b);
            c[UNKNOWNS] = b.error < a.error ? b : a;
        } else if (a.error < c[UNKNOWNS - 1].error) {
            c[UNKNOWNS] = a;
        } else {
            try_point(g, middle, &c[UNKNOWNS], a.error < c[UNKNOWNS].error ? 0.5 : -0.5, isotropic, &b);
            if (b.error < fmin(a.error, c[UNKNOWNS].error))
                c[UNKNOWNS] = b;
            else
                shrink(g, c, isotropic);
        }
    }
    sort(c);
    memcpy(x, c[0].x, sizeof c[0].x);
}

/* ---- the table -------------------------------------------------------------------------------------------
 */

typedef struct entry {
    double value[VALUES];
    double peak, misplaced; /* largest error over the lobe's peak; share of the light in a wrong direction */
} entry;

static void measure(const lobe *g, const transform *t, entry *e)
{
    double most = 0, worst = 0, sum = 0, w[3], pdf, whole;
    for (int i = 0; i < SAMPLES; i++) {
        double d = transform_at(t, g->w[i], &whole);
        most = fmax(most, g->f[i]);
        worst = fmax(worst, fabs(g->f[i] - d));
        sum += fabs(g->f[i] - d) / (g->pdf[i] + whole);
        transform_sample(t, (i / SIDE + 0.5) / SIDE, (i % SIDE + 0.5) / SIDE, w);
        d = transform_at(t, w, &whole);
        double f = lobe_at(g, w, &pdf) / g->norm;
        most = fmax(most, f);
        worst = fmax(worst, fabs(f - d));
        sum += fabs(f - d) / (pdf + whole);
    }
    e->peak = worst / most;
    e->misplaced = 0.5 * sum / SAMPLES;
}

/* What depends on alpha as a factor is stored without it, so that linear interpolation is good at low
 * roughness. */
static void store(const lobe *g, const transform *t, entry *e)
{
    double per = 1 / t->inverse[1][1];
    e->value[0] = t->inverse[0][0] * per;
    e->value[1] = t->inverse[0][2] * per;
    e->value[2] = t->inverse[2][0] * per / g->alpha;
    e->value[3] = t->inverse[2][2] * per / g->alpha;
    e->value[4] = g->norm;
    e->value[5] = g->fresnel;
    e->value[6] = 1 / t->above;
    measure(g, t, e);
}

static entry table[ROUGH][ANGLES];

static void fit_all(void)
{
    double across[UNKNOWNS] = {0}; /* at normal incidence, of the roughness above */
    for (int r = ROUGH - 1; r >= 0; r--) {
        double roughness = (double)r / (ROUGH - 1), alpha = fmax(roughness * roughness, 1e-3),
               x[UNKNOWNS] = {0};
        for (int a = 0; a < ANGLES; a++) {
            static lobe g;
            transform t;
            double s = (double)a / (ANGLES - 1);
            lobe_make(&g, alpha, fmax(1 - s * s, 1e-3));
            if (a == 0)
                memcpy(x, across, sizeof x);
            fit(&g, x, a == 0);
            if (a == 0) {
                x[1] = x[0];
                x[2] = x[3] = 0;
                memcpy(across, x, sizeof x);
            }
            transform_make(&t, &g, x, a == 0);
            store(&g, &t, &table[r][a]);
        }
        fprintf(stderr,
                "roughness %.3f: error %.3f of the peak, %.3f misplaced at 0; %.3f, %.3f at 60 degrees\n",
                roughness, table[r][0].peak, table[r][0].misplaced, table[r][ANGLES * 7 / 10].peak,
                table[r][ANGLES * 7 / 10].misplaced);
    }
}

/* Means over what is seen often: 0 to 75 degrees, and all angles. */
static void print_errors(void)
{
    for (int from = 0; from < ROUGH; from += 8) {
        double peak[2] = {0, 0}, misplaced[2] = {0, 0};
        int n[2] = {0, 0};
        for (int r = from; r < from + 8; r++)
            for (int a = 0; a < ANGLES; a++) {
                int grazing = a > 0.86 * (ANGLES - 1);
                peak[grazing] += table[r][a].peak;
                misplaced[grazing] += table[r][a].misplaced;
                n[grazing]++;
            }
        printf(" *     %.2f to %.2f: %.3f, %.3f; %.3f, %.3f\n", (double)from / (ROUGH - 1),
               (double)(from + 7) / (ROUGH - 1), peak[0] / n[0], misplaced[0] / n[0], peak[1] / n[1],
               misplaced[1] / n[1]);
    }
}

int main(void)
{
    fit_all();
    printf("/* clang-format off */\n/* Generated by tests/fit_ltc.c; do not edit. GGX of kernels/surface.cl "
           "as linearly transformed "
           "cosines (Heitz\n"
           " * et al. 2016), and its albedo.\n *\n"
           " * Entry (r, a): perceptual roughness r/%d, n.v = 1 - (a/%d)^2. M^-1 = (m0 0 m1; 0 1 0; alpha m2 "
           "0 alpha m3) in\n"
           " * the frame (view's part across the normal, its cross product with the normal, normal); then "
           "the albedo without\n"
           " * Fresnel, and weighted with (1 - v.h)^5; the albedo is shared out above the surface, so that "
           "the cosine is\n"
           " * multiplied by the next number there and by 0 below; the last is unused.\n *\n"
           " * Error of the fit, mean of entries: largest difference over the lobe's peak, share of the "
           "light that goes in a\n"
           " * wrong direction; for views up to 75 degrees off the normal; for others. Roughness\n",
           ROUGH - 1, ANGLES - 1);
    print_errors();
    printf(" */\n#ifndef RL_PASSES_LTC_TABLE_H\n#define RL_PASSES_LTC_TABLE_H\n\n"
           "enum { RL_LTC_FLOATS = %d };\n\n"
           "static const float rl_ltc_table[RL_LTC_FLOATS] = {\n",
           ROUGH * ANGLES * VALUES);
    for (int r = 0; r < ROUGH; r++)
        for (int a = 0; a < ANGLES; a++) {
            printf("   ");
            for (int k = 0; k < VALUES; k++)
                printf(" %#.6gf,", table[r][a].value[k]);
            printf("\n");
        }
    printf("};\n/* clang-format on */\n\n#endif\n");
    return 0;
}
