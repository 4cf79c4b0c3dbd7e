/* With the depth known, every row of the projection is linear in the position p: depth = b.p + b4, and
 * x depth = a.p + a4 with a = f r + cx b, where b is the view axis, r the camera's x axis, f the focal length
 * and cx the centre. r and b are perpendicular, so cx = a.b and f = |a - cx b|. */
#include "graph/tool/camera_solve.h"

#include <math.h>
#include <stdlib.h>

#include "graph/base/alloc.h"

/* Solves the 4 x 4 system in place; false when it is nearly singular. */
static bool eliminate(double m[4][5])
{
    for (int i = 0; i < 4; i++) {
        int best = i;
        for (int k = i + 1; k < 4; k++)
            best = fabs(m[k][i]) > fabs(m[best][i]) ? k : best;
        for (int j = 0; j < 5; j++) {
            double swap = m[i][j];
            m[i][j] = m[best][j];
            m[best][j] = swap;
        }
        if (!(fabs(m[i][i]) > 1e-9))
            return false;
        for (int k = 0; k < 4; k++)
            for (int j = 4; j >= i && k != i; j--)
                m[k][j] -= m[i][j] * m[k][i] / m[i][i];
    }
    for (int i = 0; i < 4; i++)
        m[i][4] /= m[i][i];
    return true;
}

/* Positions are moved to their mean and scaled by their spread for the sake of the numbers. */
typedef struct frame {
    double mean[3], spread;
} frame;

static double value_of(const rl_seen *s, int which)
{
    return which == 0 ? s->depth : which == 1 ? s->x * s->depth : s->y * s->depth;
}

/* out.p + out[3] nearest to the values. */
static bool fit(const rl_seen *seen, size_t n, const frame *at, int which, double out[4])
{
    double m[4][5] = {{0}};
    for (size_t k = 0; k < n; k++) {
        double p[5] = {0, 0, 0, 1, value_of(&seen[k], which)};
        for (int i = 0; i < 3; i++)
            p[i] = (seen[k].world[i] - at->mean[i]) / at->spread;
        for (int i = 0; i < 4; i++)
            for (int j = 0; j < 5; j++)
                m[i][j] += p[i] * p[j] / (double)n;
    }
    if (!eliminate(m))
        return false;
    out[3] = m[3][4];
    for (int i = 0; i < 3; i++) {
        out[i] = m[i][4] / at->spread;
        out[3] -= out[i] * at->mean[i];
    }
    return true;
}

static double dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Camera axes, focal lengths and centre from the three rows. */
static bool split(double rows[3][4], rl_solved_camera *out)
{
    const double *b = rows[0];
    double focal[2], length = sqrt(dot(b, b));
    if (!(fabs(length - 1) < 0.02)) /* another unit, or no planar depth */
        return false;
    for (int k = 0; k < 2; k++) {
        const double *a = rows[1 + k];
        double *row = out->matrix + 4 * k, sign = k ? -1 : 1; /* y of pixels is down */
        out->centre[k] = dot(a, b) / (length * length);
        for (int i = 0; i < 4; i++)
            row[i] = sign * (a[i] - out->centre[k] * b[i]);
        focal[k] = sqrt(dot(row, row));
        if (!(focal[k] > 1e-6))
            return false;
        for (int i = 0; i < 4; i++)
            row[i] /= focal[k];
    }
    for (int i = 0; i < 4; i++) {
        out->matrix[8 + i] = -b[i] / length;
        out->matrix[12 + i] = i == 3;
    }
    out->focal = focal[0];
    out->aspect = focal[1] / focal[0];
    if (!(fabs(dot(out->matrix, out->matrix + 4)) < 0.02))
        return false;
    /* x and y are perpendicular to the view axis already; what is left of noise is y's */
    double along = dot(out->matrix, out->matrix + 4), rest = sqrt(1 - along * along);
    for (int i = 0; i < 4; i++)
        out->matrix[4 + i] = (out->matrix[4 + i] - along * out->matrix[i]) / rest;
    return true;
}

static double distance(const rl_solved_camera *c, const rl_seen *s)
{
    double view[3];
    for (int i = 0; i < 3; i++)
        view[i] = dot(c->matrix + 4 * i, s->world) + c->matrix[4 * i + 3];
    if (!(view[2] < 0))
        return 1e30;
    return hypot(c->centre[0] - c->focal * view[0] / view[2] - s->x,
                 c->centre[1] + c->focal * c->aspect * view[1] / view[2] - s->y);
}

typedef struct ranked {
    double error;
    rl_seen seen;
} ranked;

static int by_error(const void *a, const void *b)
{
    double x = ((const ranked *)a)->error, y = ((const ranked *)b)->error;
    return (x > y) - (x < y);
}

static bool solve_once(const rl_seen *seen, size_t n, rl_solved_camera *out)
{
    frame at = {{0}, 0};
    double rows[3][4];
    for (size_t k = 0; k < n; k++)
        for (int i = 0; i < 3; i++)
            at.mean[i] += seen[k].world[i] / (double)n;
    for (size_t k = 0; k < n; k++)
        for (int i = 0; i < 3; i++)
            at.spread += fabs(seen[k].world[i] - at.mean[i]) / (double)n;
    if (!(at.spread > 0))
        return false;
    for (int which = 0; which < 3; which++)
        if (!fit(seen, n, &at, which, rows[which]))
            return false;
    return split(rows, out);
}

/* Sorts by distance; *inliers: how many are as near as exact pixels with noise would be. */
static bool rank(rl_seen *seen, size_t n, rl_solved_camera *c, size_t *inliers)
{
    ranked *all = rl_malloc(n * sizeof *all);
    if (!all)
        return false;
    for (size_t k = 0; k < n; k++)
        all[k] = (ranked){distance(c, &seen[k]), seen[k]};
    qsort(all, n, sizeof *all, by_error);
    c->error = all[n / 2].error;
    *inliers = 0;
    for (size_t k = 0; k < n; k++) {
        seen[k] = all[k].seen;
        *inliers += all[k].error < 4 * c->error + 1e-3;
    }
    rl_free(all);
    return true;
}

/* Least trimmed squares by concentration steps (Rousseeuw and Van Driessen 1999): fit the three quarters that
 * fit best, again and again; each step is no worse than the one before. At last, all that fit. */
bool rl_camera_solve(rl_seen *seen, size_t n, rl_solved_camera *out)
{
    size_t inliers;
    if (n < 16 || !solve_once(seen, n, out) || !rank(seen, n, out, &inliers))
        return false;
    for (int i = 0; i < 8; i++)
        if (!solve_once(seen, n - n / 4, out) || !rank(seen, n, out, &inliers))
            return false;
    return solve_once(seen, inliers < 16 ? n : inliers, out) && rank(seen, n, out, &inliers);
}
