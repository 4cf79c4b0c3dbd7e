/* See sss_twin.h. */
#include "tests/sss_twin.h"

#include <math.h>

#include "passes/burley.h"
#include "tests/sss_patterns.h"
#include "tests/twin_hash.h"

static const double pi = 3.14159265358979323846;

static long at(const twin_scene *s, int x, int y)
{
    return (long)y * s->frame.columns + x;
}

static long plane(const twin_scene *s)
{
    return (long)s->frame.columns * s->frame.rows;
}

/* 0 outside of the image. */
static uint32_t material_at(const twin_scene *s, int x, int y)
{
    const int *v = s->frame.valid;
    return x < v[0] || y < v[1] || x >= v[2] || y >= v[3] ? 0 : s->stencil[at(s, x, y)];
}

/* ---- the way out ---- */

void twin_resolve(const twin_scene *s, int x, int y, const double filtered[3], double color[3])
{
    const frame_t *f = &s->frame;
    const camera_t *c = &f->camera;
    const twin_material *m = &s->materials[s->stencil[at(s, x, y)]];
    double ray[3] = {(x + f->origin[0] + 0.5 + c->jitter[0] - c->centre[0]) / c->focal[0],
                     -(y + f->origin[1] + 0.5 + c->jitter[1] - c->centre[1]) / c->focal[1], -1};
    double dot = 0, length = sqrt(ray[0] * ray[0] + ray[1] * ray[1] + 1);
    for (int i = 0; i < 3; i++) {
        const float *row = c->to_world + 4 * i;
        dot -= s->normal[i * plane(s) + at(s, x, y)] * (row[0] * ray[0] + row[1] * ray[1] + row[2] * ray[2]) /
               length;
    }
    double out = 1;
    if (m->diffuse == 0 && m->exit_transmission == 0)
        out = 1 - 0.5 * pow(1 - fmin(fabs(dot), 1), 5);
    for (int i = 0; i < 3; i++) {
        double a = s->albedo[i * plane(s) + at(s, x, y)];
        color[i] = s->lit[i * plane(s) + at(s, x, y)];
        if (m->has_profile)
            color[i] += filtered[i] * (m->texturing ? sqrt(a) : a) * out;
    }
}

/* ---- the surface that a pixel sees ---- */

static double slope(const twin_scene *s, int x, int y, int dx, int dy)
{
    uint32_t id = material_at(s, x, y);
    float z = s->depth[at(s, x, y)];
    double best = 0;
    bool have = false;
    for (int sign = 1; sign >= -1; sign -= 2) {
        int nx = x + sign * dx, ny = y + sign * dy;
        if (material_at(s, nx, ny) != id)
            continue;
        double d = (double)sign * (double)(s->depth[at(s, nx, ny)] - z);
        if (!have || fabs(d) < fabs(best))
            best = d;
        have = true;
    }
    return best;
}

/* Mean of the slopes to both neighbours, weighting: surface; metres of depth a pixel. In float: it decides
 * what is behind the plane. */
static float mean_slope(const twin_scene *s, int x, int y, int dx, int dy)
{
    const camera_t *c = &s->frame.camera;
    uint32_t id = s->stencil[at(s, x, y)];
    float z = s->depth[at(s, x, y)], most = z * (10 / c->focal[dx ? 0 : 1]), sum = 0;
    int n = 0;
    for (int sign = 1; sign >= -1; sign -= 2) {
        int nx = x + sign * dx, ny = y + sign * dy;
        if (material_at(s, nx, ny) != id)
            continue;
        float d = (float)sign * (s->depth[at(s, nx, ny)] - z);
        if (fabsf(d) > most)
            continue;
        sum += d;
        n++;
    }
    return n == 2 ? sum / 2 : sum;
}

/* Whether pixel (px, py) shows that the surface of (x, y) has turned away before; at_plane: the plane's
 * depth. */
static bool turned_away(const twin_scene *s, int px, int py, uint32_t id, float at_plane)
{
    const int *v = s->frame.valid;
    const float *focal = s->frame.camera.focal;
    if (px < v[0] || py < v[1] || px >= v[2] || py >= v[3] || material_at(s, px, py) == id)
        return false;
    return material_at(s, px, py) == 0 ||
           s->depth[at(s, px, py)] > fmaf(at_plane, 2 / fminf(focal[0], focal[1]), at_plane);
}

/* Slopes of the disk, depth a metre of the screen's plane. In float: they decide where taps land. */
static void tilt(const twin_scene *s, int x, int y, float t[2])
{
    const camera_t *c = &s->frame.camera;
    float z = s->depth[at(s, x, y)];
    for (int i = 0; i < 2; i++) {
        t[i] = (float)slope(s, x, y, i == 0, i == 1) * (c->focal[i] / z);
        t[i] = s->tangent ? fminf(fmaxf(t[i], -10), 10) : 0;
    }
}

/* |dP/dx × dP/dy| of the view-space point. */
double twin_area(const twin_scene *s, int x, int y)
{
    const frame_t *f = &s->frame;
    const camera_t *c = &f->camera;
    if (!s->area)
        return 1;
    double z = s->depth[at(s, x, y)], zx = s->surface ? mean_slope(s, x, y, 1, 0) : slope(s, x, y, 1, 0);
    double zy = s->surface ? mean_slope(s, x, y, 0, 1) : slope(s, x, y, 0, 1);
    double rx = (x + f->origin[0] + 0.5 + c->jitter[0] - c->centre[0]) / c->focal[0];
    double ry = -(y + f->origin[1] + 0.5 + c->jitter[1] - c->centre[1]) / c->focal[1];
    double a[3] = {z / c->focal[0] + rx * zx, ry * zx, -zx},
           b[3] = {rx * zy, -z / c->focal[1] + ry * zy, -zy};
    double n[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    return sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
}

/* weighting: surface. The plane's slopes, and the share of its weights in the result. */
typedef struct tangent_t {
    float x, y;
    double cosine;
} tangent_t;

static tangent_t tangent_of(const twin_scene *s, int x, int y)
{
    const camera_t *c = &s->frame.camera;
    tangent_t t = {mean_slope(s, x, y, 1, 0), mean_slope(s, x, y, 0, 1), 0};
    double z = s->depth[at(s, x, y)];
    if (s->surface)
        t.cosine = 1 / sqrt(1 + pow(t.x * c->focal[0] / z, 2) + pow(t.y * c->focal[1] / z, 2));
    return t;
}

/* ---- the dense sum ---- */

#define NODES 12

/* Gauss-Legendre on [-1/2, 1/2], by Newton's method on the Legendre polynomial. */
static void legendre(double x[NODES], double w[NODES])
{
    for (int i = 0; i < NODES; i++) {
        double t = cos(pi * (i + 0.75) / (NODES + 0.5)), slope_here = 1;
        for (int step = 0; step < 50; step++) {
            double p0 = 1, p1 = t;
            for (int k = 2; k <= NODES; k++) {
                double p2 = ((2 * k - 1) * t * p1 - (k - 1) * p0) / k;
                p0 = p1;
                p1 = p2;
            }
            slope_here = NODES * (t * p1 - p0) / (t * t - 1);
            t -= p1 / slope_here;
        }
        x[i] = t / 2;
        w[i] = 1 / ((1 - t * t) * slope_here * slope_here);
    }
}

/* The light that the pixel (dx, dy) away, of size hx × hy, sends here; dz: its difference in depth. */
static double pixel_weight(int dx, int dy, double hx, double hy, double dz, double d)
{
    static double x[NODES], w[NODES];
    if (w[0] == 0)
        legendre(x, w);
    if (dx == 0 && dy == 0)
        return rl_burley_cdf(sqrt(hx * hy / pi), d);
    if (dx < -2 || dx > 2 || dy < -2 || dy > 2)
        return rl_burley_profile(sqrt(dx * dx * hx * hx + dy * dy * hy * hy + dz * dz), d) * hx * hy;
    double sum = 0;
    for (int j = 0; j < NODES; j++)
        for (int i = 0; i < NODES; i++) {
            double u = (dx + x[i]) * hx, v = (dy + x[j]) * hy;
            sum += w[i] * w[j] * rl_burley_profile(sqrt(u * u + v * v + dz * dz), d);
        }
    return sum * hx * hy;
}

void twin_reference(const twin_scene *s, int x, int y, double filtered[3])
{
    const camera_t *c = &s->frame.camera;
    uint32_t id = s->stencil[at(s, x, y)];
    const twin_material *m = &s->materials[id];
    double z = s->depth[at(s, x, y)], hx = z / c->focal[0], hy = z / c->focal[1], d[3], most = 0;
    double own = twin_area(s, x, y), sum[3] = {0}, weights[3] = {0}, planar[3] = {0};
    tangent_t tangent = tangent_of(s, x, y);
    for (int i = 0; i < 3; i++) {
        d[i] = m->scatter_distance_mm[i] * 1e-3;
        most = fmax(most, d[i]);
    }
    double reach = RL_BURLEY_RADIUS * most;
    float t[2];
    tilt(s, x, y, t);
    int rx = (int)(reach / hx) + 1, ry = (int)(reach / hy) + 1;
    for (int dy = -ry; dy <= ry; dy++)
        for (int dx = -rx; dx <= rx; dx++) {
            if (hypot(hypot(dx * hx, dy * hy), (double)t[0] * dx * hx + (double)t[1] * dy * hy) > reach)
                continue;
            bool same = material_at(s, x + dx, y + dy) == id;
            double flat = s->surface ? tangent.x * (float)dx + tangent.y * (float)dy : 0;
            if (s->surface && (same || m->border || turned_away(s, x + dx, y + dy, id, (float)(z + flat))))
                for (int i = 0; i < 3; i++)
                    planar[i] += pixel_weight(dx, dy, hx, hy, flat, d[i]) * own;
            if (!same && m->border == 0)
                continue;
            double dz = same ? s->depth[at(s, x + dx, y + dy)] - z : flat;
            double area = same ? twin_area(s, x + dx, y + dy) : own;
            for (int i = 0; i < 3; i++) {
                double w = pixel_weight(dx, dy, hx, hy, dz, d[i]) * area;
                weights[i] += w;
                if (same)
                    sum[i] += w * s->diffuse[i * plane(s) + at(s, x + dx, y + dy)];
            }
        }
    for (int i = 0; i < 3; i++)
        filtered[i] =
            sum[i] * ((1 - tangent.cosine) / weights[i] + (s->surface ? tangent.cosine / planar[i] : 0));
}

/* ---- taps ---- */

/* The scale of the taps for pixel (x, y), a depth, and the mean slopes of their disk: of the lanes of its
 * vector (64 columns, one phase) with its material, groups are split off from the far end. In float, as the
 * scale decides where taps land. */
static float group_of(const twin_scene *s, int x, int y, float slopes[2])
{
    uint32_t id = s->stencil[at(s, x, y)];
    float z = s->depth[at(s, x, y)], beyond = INFINITY;
    for (;;) {
        float far = 0, near = INFINITY;
        for (int i = 0, px = (x & ~63) + (x & 3); i < 16; i++, px += 4)
            if (material_at(s, px, y) == id && s->depth[at(s, px, y)] < beyond)
                far = fmaxf(far, s->depth[at(s, px, y)]);
        float limit = 0.8f * far, t[2];
        long count = 0, sum[2] = {0};
        for (int i = 0, px = (x & ~63) + (x & 3); i < 16; i++, px += 4) {
            float pz = s->depth[at(s, px, y)];
            if (material_at(s, px, y) == id && pz < beyond && pz >= limit) {
                near = fminf(near, pz);
                tilt(s, px, y, t);
                sum[0] += lrint((double)t[0] * 1024);
                sum[1] += lrint((double)t[1] * 1024);
                count++;
            }
        }
        if (z >= limit) {
            slopes[0] = (float)sum[0] / (1024.0f * (float)count);
            slopes[1] = (float)sum[1] / (1024.0f * (float)count);
            return 0.5f * (far + near);
        }
        beyond = limit;
    }
}

static double fraction(double x)
{
    return x - floor(x);
}

/* The pattern of a pixel: its turn and the offset of its radii, 0 to 1. */
static void choice_of(const twin_scene *s, int x, int y, int seed, double choice[2])
{
    static const int order[4][4] = {{2, 3, 12, 6}, {14, 8, 4, 10}, {1, 11, 0, 5}, {15, 7, 13, 9}};
    int number = s->frame.number, px = x & 3, py = y & 3;
    double shift[2] = {ldexp(twin_hash((uint32_t)seed, 0, 0, 1), -32),
                       ldexp(twin_hash((uint32_t)seed, 0, 0, 2), -32)};
    for (int i = 0; i < 2; i++) {
        if (s->rotation == TWIN_WHITE) {
            uint32_t h =
                twin_hash((uint32_t)seed, (uint32_t)number, (uint32_t)(4 * py + px), (uint32_t)i + 1);
            choice[i] = ldexp(h, -32);
        } else if (s->rotation == TWIN_IGN) {
            double u = (i ? py : px) + 5.588238 * number, v = (i ? px : py) + 5.588238 * number;
            choice[i] = fraction(52.9829189 * fraction(0.06711056 * u + 0.00583715 * v) + shift[i]);
        } else if (s->rotation == TWIN_BLUE) {
            const double g = 1.32471795724474602596;
            choice[i] = fraction((number + 16.0 * order[py][px]) * (i ? 1 / g : 1 / (g * g)) + shift[i]);
        } else {
            choice[i] = i ? 0.5 : 0;
        }
    }
}

void twin_burley(const twin_scene *s, int x, int y, int n, int seed, double filtered[3])
{
    const camera_t *c = &s->frame.camera;
    uint32_t id = s->stencil[at(s, x, y)];
    const twin_material *m = &s->materials[id];
    const float *d = m->scatter_distance_mm;
    float t[2], most = fmaxf(d[0], fmaxf(d[1], d[2])), middle = group_of(s, x, y, t), inv_d = 1e3f / most;
    float slope2 = fmaf(t[0], t[0], t[1] * t[1]);
    float less = slope2 > 0 ? (1.0f / sqrtf(1.0f + slope2) - 1.0f) / slope2 : 0;
    float xx = less * t[0] * t[0], xy = less * t[0] * t[1], yy = less * t[1] * t[1];
    float kx = c->focal[0] / (middle * inv_d), ky = c->focal[1] / (middle * inv_d);
    double choice[2];
    choice_of(s, x, y, seed, choice);
    float co = (float)cos(2 * pi * floor(choice[0] * 256) / 256),
          si = (float)sin(2 * pi * floor(choice[0] * 256) / 256);
    double z = s->depth[at(s, x, y)], scale = z / middle, own = twin_area(s, x, y), sum[3] = {0},
           weights[3] = {0}, planar[3] = {0};
    tangent_t tangent = tangent_of(s, x, y);
    double proportions[3] = {(double)d[0] / most, (double)d[1] / most, (double)d[2] / most};
    const patterns_t *patterns = patterns_for(n, proportions);
    int pattern = (int)floor(choice[1] * patterns->count);
    const float *tx = patterns->x + pattern * n, *ty = patterns->y + pattern * n,
                *tw = patterns->weight + pattern * n;
    const double *share = patterns->share[pattern];
    for (int i = 0; i < n; i++) {
        float u = fmaf(tx[i], co, -(ty[i] * si)), v = fmaf(tx[i], si, ty[i] * co);
        float x_disk = u;
        u = fmaf(v, xy, fmaf(u, xx, u));
        v = fmaf(x_disk, xy, fmaf(v, yy, v));
        int px = x + (int)nearbyint((double)u * kx), py = y + (int)nearbyint((double)v * ky);
        bool same = material_at(s, px, py) == id;
        double flat = s->surface ? tangent.x * (float)(px - x) + tangent.y * (float)(py - y) : 0;
        double unit = most * 1e-3, r2 = ((double)u * u + (double)v * v) * scale * scale;
        if (s->surface && (same || m->border || turned_away(s, px, py, id, (float)(z + flat))))
            for (int k = 0; k < 3; k++)
                planar[k] += rl_burley_profile(sqrt(r2 + flat * flat / (unit * unit)), d[k] / most) * 8 * pi *
                             (d[k] / most) * tw[i];
        if (!same && m->border == 0)
            continue;
        double dz = (same ? s->depth[at(s, px, py)] - z : flat) / unit, r = sqrt(r2 + dz * dz);
        double area = same ? twin_area(s, px, py) / own : 1;
        for (int k = 0; k < 3; k++) {
            double w = rl_burley_profile(r, d[k] / most) * 8 * pi * (d[k] / most) * tw[i] * area;
            weights[k] += w;
            if (same)
                sum[k] += w * s->diffuse[k * plane(s) + at(s, px, py)];
        }
    }
    for (int k = 0; k < 3; k++) {
        double own_light = s->diffuse[k * plane(s) + at(s, x, y)], v = own_light;
        if (weights[k] > 1e-12) {
            v = fmax(v + share[k] * (sum[k] / weights[k] - v), fmin(v, 0));
            v *= s->surface ? 1 - tangent.cosine + tangent.cosine * weights[k] / planar[k] : 1;
        }
        filtered[k] = v;
    }
}
