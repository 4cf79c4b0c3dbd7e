/* The taps of sss_twin.h. */
#include <math.h>
#include <stdlib.h>

#include "passes/burley.h"
#include "tests/sss_patterns.h"
#include "tests/sss_twin_parts.h"
#include "tests/twin_hash.h"

static const double pi = 3.14159265358979323846;

/* The scale of the taps for pixel (x, y), a depth, and the mean slopes of their disk: of the lanes of its
 * vector (64 columns, one phase) with its material, groups are split off from the far end. In float, as the
 * scale decides where taps land. */
static float group_of(const twin_scene *s, int x, int y, float slopes[2])
{
    uint32_t id = s->stencil[twin_at(s, x, y)];
    float z = s->depth[twin_at(s, x, y)], beyond = INFINITY;
    for (;;) {
        float far = 0, near = INFINITY;
        for (int i = 0, px = (x & ~63) + (x & 3); i < 16; i++, px += 4)
            if (twin_material_at(s, px, y) == id && s->depth[twin_at(s, px, y)] < beyond)
                far = fmaxf(far, s->depth[twin_at(s, px, y)]);
        float limit = 0.8f * far, t[2];
        long count = 0, sum[2] = {0};
        for (int i = 0, px = (x & ~63) + (x & 3); i < 16; i++, px += 4) {
            float pz = s->depth[twin_at(s, px, y)];
            if (twin_material_at(s, px, y) == id && pz < beyond && pz >= limit) {
                near = fminf(near, pz);
                twin_tilt(s, px, y, t);
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

/* Where taps lie: the vector's group and its pattern's turn. In float, as they decide what is hit. */
typedef struct placing {
    float kx, ky;     /* pixels a d */
    float xx, xy, yy; /* from the disk to the screen's plane, less the identity */
    float co, si, middle, inv_d;
    double offset; /* which pattern, 0 to 1 */
} placing;

static placing placing_of(const twin_scene *s, int x, int y, int seed)
{
    const camera_t *c = &s->frame.camera;
    const float *d = s->materials[s->stencil[twin_at(s, x, y)]].scatter_distance_mm;
    placing p = {.inv_d = 1e3f / fmaxf(d[0], fmaxf(d[1], d[2]))};
    float t[2];
    p.middle = group_of(s, x, y, t);
    float slope2 = fmaf(t[0], t[0], t[1] * t[1]);
    float less = slope2 > 0 ? (1.0f / sqrtf(1.0f + slope2) - 1.0f) / slope2 : 0;
    p.xx = less * t[0] * t[0];
    p.xy = less * t[0] * t[1];
    p.yy = less * t[1] * t[1];
    p.kx = c->focal[0] / (p.middle * p.inv_d);
    p.ky = c->focal[1] / (p.middle * p.inv_d);
    double choice[2];
    choice_of(s, x, y, seed, choice);
    p.co = (float)cos(2 * pi * floor(choice[0] * 256) / 256);
    p.si = (float)sin(2 * pi * floor(choice[0] * 256) / 256);
    p.offset = choice[1];
    return p;
}

/* A tap: pixels away, and on the plane z = -1. */
typedef struct tap {
    int dx, dy;
    double u, v;
} tap;

static tap place(const placing *p, float x, float y)
{
    float u = fmaf(x, p->co, -(y * p->si)), v = fmaf(x, p->si, y * p->co), flat = u;
    u = fmaf(v, p->xy, fmaf(u, p->xx, u));
    v = fmaf(flat, p->xy, fmaf(v, p->yy, v));
    double per = 1 / ((double)p->middle * p->inv_d);
    return (tap){(int)nearbyint((double)u * p->kx), (int)nearbyint((double)v * p->ky), u * per, v * per};
}

/* Channel k's R, dz deeper, without its constant factors, in units of the largest d. */
static double tap_weight(const twin_scene *s, int x, int y, const tap *t, double dz, int k)
{
    const float *d = s->materials[s->stencil[twin_at(s, x, y)]].scatter_distance_mm;
    double most = fmax(d[0], fmax(d[1], d[2])), r = twin_distance_to(s, x, y, t->u, t->v, dz) / (most * 1e-3);
    return rl_burley_profile(r, d[k] / most) * 8 * pi * (d[k] / most);
}

static const patterns_t *patterns_of(const twin_scene *s, int x, int y, int n)
{
    const float *d = s->materials[s->stencil[twin_at(s, x, y)]].scatter_distance_mm;
    double most = fmax(d[0], fmax(d[1], d[2])), proportions[3] = {d[0] / most, d[1] / most, d[2] / most};
    return patterns_for(n, proportions);
}

/* The gain of a pixel that has one, by n taps. */
static void shape_of(const twin_scene *s, int x, int y, int n, int seed, double gain[3])
{
    uint32_t id = s->stencil[twin_at(s, x, y)];
    bool black = s->materials[id].border;
    placing p = placing_of(s, x, y, seed);
    tangent_t tangent = twin_tangent_of(s, x, y);
    const patterns_t *patterns = patterns_of(s, x, y, n);
    int first = n * (int)floor(p.offset * patterns->count);
    double z = s->depth[twin_at(s, x, y)], own = twin_area(s, x, y), planar[3] = {0}, more[3] = {0};
    for (int i = first; i < first + n; i++) {
        tap t = place(&p, patterns->x[i], patterns->y[i]);
        int px = x + t.dx, py = y + t.dy;
        bool same = twin_material_at(s, px, py) == id;
        double area, flat = twin_plane_dz(s, &tangent, x, y, t.dx, t.dy, &area);
        bool away = twin_turned_away(s, px, py, id, (float)(z + flat));
        for (int k = 0; k < 3 && (same || away || black); k++) {
            double w = tap_weight(s, x, y, &t, flat, k) * patterns->weight[i] * area;
            planar[k] += w;
            more[k] -= same || !black ? w : 0;
            if (same)
                more[k] += tap_weight(s, x, y, &t, s->depth[twin_at(s, px, py)] - z, k) *
                           patterns->weight[i] * twin_area(s, px, py) / own;
        }
    }
    for (int k = 0; k < 3; k++)
        gain[k] = planar[k] > 1e-12 ? more[k] / planar[k] : 0;
}

/* 1 + cos * gain, interpolated between the pixels (1, 1) of 4x4 that are of the same material. */
static void bend_of(const twin_scene *s, int x, int y, int n, int seed, double bend[3])
{
    double all = 0, sum[3] = {0}, gain[3], cosine = twin_cosine_of(s, x, y);
    for (int gy = y - 3; gy <= y + 3; gy++)
        for (int gx = x - 3; gx <= x + 3; gx++) {
            if ((gx & 3) != 1 || (gy & 3) != 1 || twin_material_at(s, gx, gy) != s->stencil[twin_at(s, x, y)])
                continue;
            double share = (1 - 0.25 * abs(gx - x)) * (1 - 0.25 * abs(gy - y));
            shape_of(s, gx, gy, n, seed, gain);
            all += share;
            for (int k = 0; k < 3; k++)
                sum[k] += share * gain[k];
        }
    for (int k = 0; k < 3; k++)
        bend[k] = all > 0 ? 1 + cosine * sum[k] / all : 1;
}

void twin_burley(const twin_scene *s, int x, int y, int n, int seed, double filtered[3])
{
    uint32_t id = s->stencil[twin_at(s, x, y)];
    const twin_material *m = &s->materials[id];
    placing p = placing_of(s, x, y, seed);
    const patterns_t *patterns = patterns_of(s, x, y, n);
    int pattern = (int)floor(p.offset * patterns->count);
    const double *share = patterns->share[pattern];
    double z = s->depth[twin_at(s, x, y)], own = twin_area(s, x, y), bend[3] = {1, 1, 1};
    twin_sums total = {0};
    for (int i = n * pattern; i < n * pattern + n; i++) {
        tap t = place(&p, patterns->x[i], patterns->y[i]);
        int px = x + t.dx, py = y + t.dy;
        bool same = twin_material_at(s, px, py) == id;
        if (!same && m->border == 0)
            continue;
        double dz = same ? s->depth[twin_at(s, px, py)] - z : 0, area = same ? twin_area(s, px, py) / own : 1;
        for (int k = 0; k < 3; k++) {
            double w = tap_weight(s, x, y, &t, dz, k) * patterns->weight[i] * area;
            total.w[k] += w;
            if (same)
                total.light[k] += w * s->diffuse[k * twin_plane(s) + twin_at(s, px, py)];
        }
    }
    if (s->surface)
        bend_of(s, x, y, 2 * n < 4096 ? 2 * n : 4096, seed, bend);
    for (int k = 0; k < 3; k++) {
        double own_light = s->diffuse[k * twin_plane(s) + twin_at(s, x, y)], v = own_light;
        if (total.w[k] > 1e-12)
            v = fmax(v + share[k] * (total.light[k] / total.w[k] - v), fmin(v, 0));
        filtered[k] = v * bend[k];
    }
}
