/* Fits sums of Gaussians to Burley's profile, as configs/common/profiles.yaml has them. Not a test; run it:
 *
 *     make build/tests/fit_gaussians && build/tests/fit_gaussians 8.5 5.6 4.0
 *
 * prints the `gaussians:` of a profile with these d (mm; red, green, blue) and how well they fit.
 *
 * What is fitted is the light at each distance, f(r) = 2 pi r R(r), whose integral is 1: a Gaussian of
 * variance v gives g(r) = r/v e^{-r²/2v}. Minimized is the integral of (sum w g - f)² dr over all three
 * channels, each in units of its own d, as all channels share the four variances. The weights add up to 1:
 * left free they would leave out a seventh of the light, for a gain of a tenth of the error. For given
 * variances the best ones that are not negative come from active sets (four unknowns: all fifteen are tried)
 * and a Lagrange multiplier. The variances are found by Nelder and Mead's simplex in their logarithms. */
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "passes/burley.h"

enum { GAUSSIANS = 4, STEPS = 4000 };

static const double pi = 3.14159265358979323846;

typedef struct fit {
    double d[3];
    double weight[3][GAUSSIANS];
    double error[3]; /* sqrt of the integral of squares over that of f² */
    double moved[3]; /* half the integral of |sum - f|: the share of the light at a wrong distance */
} fit;

/* Distances in units of d, fine near 0 where f is steep; dr is the width of a step. */
static double radius_of(int i, double *dr)
{
    const double most = 30, a = 6; /* sinh spacing */
    double t = (i + 0.5) / STEPS;
    *dr = most * a * cosh(a * t) / sinh(a) / STEPS;
    return most * sinh(a * t) / sinh(a);
}

static double gaussian_at(double r, double variance)
{
    return r / variance * exp(-r * r / (2 * variance));
}

/* Solves the n x n system in place; false when it is singular. */
static bool solve(size_t n, double a[GAUSSIANS + 1][GAUSSIANS + 2])
{
    for (size_t i = 0; i < n; i++) {
        size_t best = i;
        for (size_t k = i + 1; k < n; k++)
            best = fabs(a[k][i]) > fabs(a[best][i]) ? k : best;
        if (fabs(a[best][i]) < 1e-14)
            return false;
        for (size_t c = 0; c <= n; c++) {
            double t = a[i][c];
            a[i][c] = a[best][c];
            a[best][c] = t;
        }
        for (size_t k = 0; k < n; k++) {
            double q = k == i ? 0 : a[k][i] / a[i][i];
            for (size_t c = i; c <= n; c++)
                a[k][c] -= q * a[i][c];
        }
    }
    for (size_t i = 0; i < n; i++)
        a[i][n] /= a[i][i];
    return true;
}

/* The weights of one set of Gaussians. Returns what it costs, w'Gw - 2 h'w, or infinity when one is negative.
 */
static double try_set(unsigned set, double g[GAUSSIANS][GAUSSIANS], const double *h, double *weight)
{
    double a[GAUSSIANS + 1][GAUSSIANS + 2] = {{0}}, cost = 0;
    size_t index[GAUSSIANS], n = 0;
    for (size_t i = 0; i < GAUSSIANS; i++)
        if (set >> i & 1)
            index[n++] = i;
    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < n; k++)
            a[i][k] = g[index[i]][index[k]];
        a[i][n] = a[n][i] = 1;
        a[i][n + 1] = h[index[i]];
    }
    a[n][n + 1] = 1;
    if (!solve(n + 1, a))
        return INFINITY;
    memset(weight, 0, GAUSSIANS * sizeof *weight);
    for (size_t i = 0; i < n; i++) {
        weight[index[i]] = a[i][n + 1];
        if (a[i][n + 1] < 0)
            return INFINITY;
    }
    for (size_t i = 0; i < GAUSSIANS; i++)
        for (size_t k = 0; k < GAUSSIANS; k++)
            cost += weight[i] * g[i][k] * weight[k] - (k ? 0 : 2 * h[i] * weight[i]);
    return cost;
}

/* One channel: variances in units of d². */
static double best_weights(const double *variance, double *weight)
{
    double g[GAUSSIANS][GAUSSIANS] = {{0}}, h[GAUSSIANS] = {0}, ff = 0, least = INFINITY, w[GAUSSIANS];
    for (int i = 0; i < STEPS; i++) {
        double dr, r = radius_of(i, &dr), f = 2 * pi * r * rl_burley_profile(r, 1), at[GAUSSIANS];
        ff += f * f * dr;
        for (size_t k = 0; k < GAUSSIANS; k++) {
            at[k] = gaussian_at(r, variance[k]);
            h[k] += at[k] * f * dr;
            for (size_t m = 0; m <= k; m++)
                g[k][m] = g[m][k] += at[k] * at[m] * dr;
        }
    }
    for (unsigned set = 1; set < 1u << GAUSSIANS; set++) {
        double cost = try_set(set, g, h, w);
        if (cost < least) {
            least = cost;
            memcpy(weight, w, sizeof w);
        }
    }
    return (least + ff) / ff;
}

static double cost_of(fit *f, const double *log_variance)
{
    double sum = 0;
    for (size_t c = 0; c < 3; c++) {
        double variance[GAUSSIANS];
        for (size_t k = 0; k < GAUSSIANS; k++)
            variance[k] = exp(log_variance[k]) / (f->d[c] * f->d[c]);
        double cost = best_weights(variance, f->weight[c]);
        f->error[c] = sqrt(fmax(cost, 0));
        f->moved[c] = 0;
        for (int i = 0; i < STEPS; i++) {
            double dr, r = radius_of(i, &dr), at = -2 * pi * r * rl_burley_profile(r, 1);
            for (size_t k = 0; k < GAUSSIANS; k++)
                at += f->weight[c][k] * gaussian_at(r, variance[k]);
            f->moved[c] += 0.5 * fabs(at) * dr;
        }
        sum += cost;
    }
    return sum;
}

/* Nelder and Mead 1965. */
enum { CORNERS = GAUSSIANS + 1 };

static void sort_corners(double p[CORNERS][GAUSSIANS], double *cost)
{
    for (size_t i = 1; i < CORNERS; i++)
        for (size_t k = i; k > 0 && cost[k - 1] > cost[k]; k--) {
            double t = cost[k], q[GAUSSIANS];
            cost[k] = cost[k - 1];
            cost[k - 1] = t;
            memcpy(q, p[k], sizeof q);
            memcpy(p[k], p[k - 1], sizeof q);
            memcpy(p[k - 1], q, sizeof q);
        }
}

/* A point on the line from the worst corner through the middle of the others, at `t` of the way; its cost. */
static double probe(fit *f, double p[CORNERS][GAUSSIANS], double t, double *at)
{
    for (size_t k = 0; k < GAUSSIANS; k++) {
        double middle = 0;
        for (size_t i = 0; i + 1 < CORNERS; i++)
            middle += p[i][k] / (CORNERS - 1);
        at[k] = p[CORNERS - 1][k] + t * (middle - p[CORNERS - 1][k]);
    }
    return cost_of(f, at);
}

static double minimize(fit *f, double *best)
{
    double p[CORNERS][GAUSSIANS], cost[CORNERS], at[GAUSSIANS], other[GAUSSIANS];
    for (size_t i = 0; i < CORNERS; i++) {
        memcpy(p[i], best, sizeof p[i]);
        if (i)
            p[i][i - 1] += 0.7;
        cost[i] = cost_of(f, p[i]);
    }
    for (int step = 0; step < 250; step++) {
        sort_corners(p, cost);
        double *last = p[CORNERS - 1], c = probe(f, p, 2, at), c2;
        if (c < cost[0] && (c2 = probe(f, p, 3, other)) < c) {
            memcpy(at, other, sizeof at);
            c = c2;
        } else if (c >= cost[CORNERS - 2]) {
            c = probe(f, p, c < cost[CORNERS - 1] ? 1.5 : 0.5, at);
        }
        if (c < cost[CORNERS - 1]) {
            memcpy(last, at, sizeof at);
            cost[CORNERS - 1] = c;
            continue;
        }
        for (size_t i = 1; i < CORNERS; i++) {
            for (size_t k = 0; k < GAUSSIANS; k++)
                p[i][k] = 0.5 * (p[i][k] + p[0][k]);
            cost[i] = cost_of(f, p[i]);
        }
    }
    sort_corners(p, cost);
    memcpy(best, p[0], sizeof p[0]);
    return cost_of(f, best);
}

static void sort_logs(double *v)
{
    for (size_t i = 1; i < GAUSSIANS; i++)
        for (size_t k = i; k > 0 && v[k - 1] > v[k]; k--) {
            double t = v[k];
            v[k] = v[k - 1];
            v[k - 1] = t;
        }
}

/* To four digits; weights are rounded down so that they cannot add up to more than 1. */
static void print_fit(fit *f, const double *log_variance)
{
    printf("    gaussians: # fitted to d: error %.1f, %.1f, %.1f %%; %.1f, %.1f, %.1f %% of the light "
           "misplaced\n",
           100 * f->error[0], 100 * f->error[1], 100 * f->error[2], 100 * f->moved[0], 100 * f->moved[1],
           100 * f->moved[2]);
    for (size_t k = 0; k < GAUSSIANS; k++) {
        printf("      - {variance_mm2: %.4g, weight: [", exp(log_variance[k]));
        for (size_t c = 0; c < 3; c++)
            printf("%s%.4g", c ? ", " : "", floor(f->weight[c][k] * 1e4) * 1e-4);
        printf("]}\n");
    }
}

int main(int argc, char **argv)
{
    fit f = {{8.5, 5.6, 4.0}, {{0}}, {0}, {0}};
    double start[GAUSSIANS], mean;
    for (int i = 0; i < 3 && argc == 4; i++)
        f.d[i] = atof(argv[i + 1]);
    if (!(f.d[0] > 0 && f.d[1] > 0 && f.d[2] > 0)) {
        fprintf(stderr, "three distances in mm, above 0\n");
        return 2;
    }
    mean = cbrt(f.d[0] * f.d[1] * f.d[2]);
    for (size_t k = 0; k < GAUSSIANS; k++)
        start[k] = log(mean * mean * 0.08 * pow(8, (double)k));
    for (int again = 0; again < 3; again++)
        minimize(&f, start);
    sort_logs(start);
    cost_of(&f, start);
    print_fit(&f, start);
    return 0;
}
