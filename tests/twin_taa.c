#include <math.h>
#include <string.h>

#include "tests/twin_shading.h"
#include "tests/twin_taa.h"

static const double far_depth = 1e18;

static int clamp_to(int x, int low, int high)
{
    return x < low ? low : x > high ? high : x;
}

double twin_tap(const shade_run *run, int port, int plane, int x, int y)
{
    const frame_t *f = &run->frame;
    return *shade_at(run->images[port], f, plane, clamp_to(x, f->valid[0], f->valid[2] - 1),
                     clamp_to(y, f->valid[1], f->valid[3] - 1));
}

uint32_t twin_tap_id(const shade_run *run, int port, int x, int y)
{
    const frame_t *f = &run->frame;
    return shade_id(run->images[port], f, clamp_to(x, f->valid[0], f->valid[2] - 1),
                    clamp_to(y, f->valid[1], f->valid[3] - 1));
}

double twin_depth(const shade_run *run, int port, int x, int y)
{
    double z = twin_tap(run, port, 0, x, y);
    return z > 0 ? z : far_depth;
}

static void to_ycocg(const double *rgb, double *v)
{
    v[0] = rgb[0] / 4 + rgb[1] / 2 + rgb[2] / 4;
    v[1] = rgb[0] / 2 - rgb[2] / 2;
    v[2] = -rgb[0] / 4 + rgb[1] / 2 - rgb[2] / 4;
}

/* Clips `past` to mean +- gamma deviations of the 3x3 neighbourhood, grown to contain the pixel's own colour;
 * returns the largest luminance of the neighbours. */
static double clip(const shade_run *run, int x, int y, bool still, double *past)
{
    double v[9][3], brightest = 0, low[3], high[3], p[3], out = 1;
    double gamma = ((const twin_taa_params *)run->params)->clip_gamma * (still ? 3 : 1);
    for (int i = 0; i < 9; i++) {
        double rgb[3];
        for (int c = 0; c < 3; c++)
            rgb[c] = twin_tap(run, TAA_COLOR, c, x + i % 3 - 1, y + i / 3 - 1);
        to_ycocg(rgb, v[i]);
        brightest = i == 4 ? brightest : fmax(brightest, v[i][0]);
    }
    to_ycocg(past, p);
    for (int c = 0; c < 3; c++) {
        double mean = 0, variance = 0, own_value;
        for (int i = 0; i < 9; i++)
            mean += v[i][c] / 9;
        for (int i = 0; i < 9; i++)
            variance += (v[i][c] - mean) * (v[i][c] - mean) / 9;
        own_value = v[4][c];
        low[c] = fmin(mean - gamma * sqrt(variance), own_value);
        high[c] = fmax(mean + gamma * sqrt(variance), own_value);
        out = fmax(out, fabs(p[c] - (low[c] + high[c]) / 2) / fmax((high[c] - low[c]) / 2, 1e-6));
    }
    for (int c = 0; c < 3; c++)
        p[c] = (low[c] + high[c]) / 2 + (p[c] - (low[c] + high[c]) / 2) / out;
    past[0] = p[0] - p[2] + p[1];
    past[1] = p[0] + p[2];
    past[2] = p[0] - p[2] - p[1];
    return brightest;
}

static double weight(const double *rgb, double brightest)
{
    double v[3];
    to_ycocg(rgb, v);
    return 1 / (1 + fmax(v[0] - 2 * brightest, 0));
}

void twin_follow(const frame_t *f, int x, int y, double z, double *d, double *then)
{
    const camera_t *a = &f->camera, *b = &f->previous;
    double view[3], world[3], p[3];
    bool same = memcmp(a->to_view, b->to_view, sizeof a->to_view) == 0 &&
                memcmp(a->focal, b->focal, sizeof a->focal) == 0 &&
                memcmp(a->centre, b->centre, sizeof a->centre) == 0;
    twin_ray(f, a, x, y, view, world);
    for (int i = 0; i < 3; i++)
        world[i] = world[i] * z + a->to_world[4 * i + 3];
    for (int i = 0; i < 3; i++)
        p[i] = b->to_view[4 * i] * world[0] + b->to_view[4 * i + 1] * world[1] +
               b->to_view[4 * i + 2] * world[2] + b->to_view[4 * i + 3];
    *then = same || z >= far_depth ? z : -p[2];
    d[0] = b->centre[0] + b->focal[0] * p[0] / -p[2] - (x + f->origin[0] + 0.5 + a->jitter[0]);
    d[1] = b->centre[1] - b->focal[1] * p[1] / -p[2] - (y + f->origin[1] + 0.5 + a->jitter[1]);
    if (same || -p[2] <= 0)
        d[0] = d[1] = same ? 0 : 1e9;
}

typedef struct place {
    double d[2], then, low, high;
    bool alone, edge, behind, follows, still;
} place;

/* A displacement that rounding has touched is whole. */
static double snap(double d)
{
    return fabs(d - floor(d + 0.5)) < 1.0 / 1024 ? floor(d + 0.5) : d;
}

static place find_place(const shade_run *run, int x, int y)
{
    double own = twin_depth(run, TAA_DEPTH, x, y);
    place p = {.alone = true, .low = own, .high = own};
    double best = own, last = own, mine[2], front[2];
    int motion = run->images[TAA_MOTION] ? TAA_MOTION : TAA_MOVED;
    int at = 4;
    for (int i = 0; i < 9; i++) {
        int nx = x + i % 3 - 1, ny = y + i / 3 - 1;
        double z = twin_depth(run, TAA_DEPTH, nx, ny);
        at = z < best ? i : at;
        best = fmin(best, z);
        last = fmax(last, z);
        if (!run->images[TAA_STENCIL])
            continue;
        bool same = twin_tap_id(run, TAA_STENCIL, nx, ny) == twin_tap_id(run, TAA_STENCIL, x, y);
        p.alone = p.alone && same;
        p.low = same ? fmin(p.low, z) : p.low;
        p.high = same ? fmax(p.high, z) : p.high;
    }
    p.edge = last > best * 1.02;
    p.alone = p.alone && !p.edge;
    p.behind = best < own * 0.98;
    int nx = x + at % 3 - 1, ny = y + at / 3 - 1;
    twin_follow(&run->frame, x, y, own, mine, &p.then);
    p.low *= p.then / own;
    p.high *= p.then / own;
    for (int i = 0; i < 2; i++) {
        mine[i] = twin_tap(run, motion, i, x, y);
        front[i] = twin_tap(run, motion, i, nx, ny);
    }
    p.follows = p.behind && fmax(fabs(front[0] - mine[0]), fabs(front[1] - mine[1])) > 0.25;
    for (int i = 0; i < 2; i++)
        p.d[i] = snap(p.behind ? front[i] : mine[i]);
    p.still = p.d[0] == 0 && p.d[1] == 0;
    return p;
}

/* Whether history pixel (x, y) or most of 3x3 around it show the surface of p or, where p is not alone, the
 * 3x3 around each pixel around (px, py) show its material at depths around p's. */
static bool shows(const shade_run *run, int x, int y, double px, double py, uint32_t id, const place *p)
{
    double low = 2 * far_depth, high = 0, z = p->then;
    int same = 0;
    for (int i = 0; i < 9; i++) {
        int nx = x + i % 3 - 1, ny = y + i / 3 - 1;
        double t = twin_depth(run, TAA_LAST_DEPTH, nx, ny);
        if (run->images[TAA_STENCIL] && twin_tap_id(run, TAA_LAST_STENCIL, nx, ny) != id)
            continue;
        same += fabs(t - z) <= 0.04 * z;
        if (p->alone && i == 4 && fabs(t - z) <= 0.04 * z)
            return true;
    }
    for (int j = (int)floor(py) - 1; j <= (int)ceil(py) + 1; j++) {
        for (int i = (int)floor(px) - 1; i <= (int)ceil(px) + 1; i++) {
            double t = twin_depth(run, TAA_LAST_DEPTH, i, j);
            if (run->images[TAA_STENCIL] && twin_tap_id(run, TAA_LAST_STENCIL, i, j) != id)
                continue;
            low = fmin(low, t);
            high = fmax(high, t);
        }
    }
    return p->alone ? same >= 5 : p->high >= low * 0.98 && p->low <= high * 1.02;
}

/* Weights of the samples at -2 … 3 for a place t in 0…1 ("Spline36"). */
static double kernel_weight(double d)
{
    d = fabs(d);
    if (d < 1)
        return ((13.0 / 11 * d - 453.0 / 209) * d - 3.0 / 209) * d + 1;
    if (d < 2)
        return ((-6.0 / 11 * (d - 1) + 270.0 / 209) * (d - 1) - 156.0 / 209) * (d - 1);
    return d < 3 ? ((1.0 / 11 * (d - 2) - 45.0 / 209) * (d - 2) + 26.0 / 209) * (d - 2) : 0;
}

static double resample(const shade_run *run, int plane, double x, double y)
{
    int ix = (int)floor(x), iy = (int)floor(y);
    double sum = 0, least = 0;
    if (x == ix && y == iy)
        return twin_tap(run, TAA_LAST_COLOR, plane, ix, iy);
    for (int j = iy - 2; j <= iy + 3; j++) {
        for (int i = ix - 2; i <= ix + 3; i++) {
            double v = twin_tap(run, TAA_LAST_COLOR, plane, i, j);
            sum += v * kernel_weight(x - i) * kernel_weight(y - j);
            least = fmin(least, v);
        }
    }
    return fmax(sum, least);
}

void twin_taa(const shade_run *run, int x, int y, double *out)
{
    const frame_t *f = &run->frame;
    const twin_taa_params *p = run->params;
    double own[3], past[3];
    for (int c = 0; c < 3; c++)
        out[c] = own[c] = *shade_at(run->images[TAA_COLOR], f, c, x, y);
    out[3] = 1;
    if (!f->history || x < f->valid[0] || y < f->valid[1] || x >= f->valid[2] || y >= f->valid[3])
        return;
    place at = find_place(run, x, y);
    double px = x + at.d[0], py = y + at.d[1];
    if (px < f->valid[0] - 0.5 || py < f->valid[1] - 0.5 || px >= f->valid[2] - 0.5 ||
        py >= f->valid[3] - 0.5)
        return;
    int nx = (int)ceil(px - 0.5), ny = (int)ceil(py - 0.5); /* nearest, halves down */
    uint32_t id = run->images[TAA_STENCIL] ? shade_id(run->images[TAA_STENCIL], f, x, y) : 0;
    if (p->exclude[id / 32] >> id % 32 & 1)
        return;
    double n = twin_tap(run, TAA_LAST_COUNT, 0, nx, ny);
    if (!shows(run, nx, ny, px, py, id, &at) || (n < 0 && (at.alone || (at.behind && !at.follows))))
        return;
    n = at.d[0] != floor(at.d[0]) || at.d[1] != floor(at.d[1]) ? fmin(fabs(n), 6) : fabs(n);
    n = at.edge && !at.still ? fmin(n, 4) : n;
    for (int c = 0; c < 3; c++)
        past[c] = resample(run, c, px, py);
    double alpha = fmax(1 / (1 + n), p->blend), brightest = clip(run, x, y, at.still, past);
    double w = alpha * weight(own, brightest), w_past = (1 - alpha) * weight(past, brightest);
    for (int c = 0; c < 3; c++)
        out[c] = (own[c] * w + past[c] * w_past) / (w + w_past);
    out[3] = fmin(n + 1, 65536) * (at.follows ? -1 : 1);
}
