/* The translucency pass in plain C, one pixel at a time; in double but for what decides where taps land. */
#include <math.h>

#include "passes/burley.h"
#include "tests/back_scene.h"
#include "tests/twin_hash.h"

static const double pi = 3.14159265358979323846;

static size_t at(const back_scene *s, int x, int y)
{
    return (size_t)y * (size_t)s->frame.columns + (size_t)x;
}

static bool inside(const back_scene *s, int x, int y)
{
    const int *v = s->frame.valid;
    return x >= v[0] && y >= v[1] && x < v[2] && y < v[3];
}

/* 0 outside of the image. */
static uint32_t material_at(const back_scene *s, int x, int y)
{
    return inside(s, x, y) ? s->stencil[at(s, x, y)] : 0;
}

/* ---- the back face ---- */

typedef struct face {
    double z, slope[2], area; /* of the plane z = -1 that a pixel covers, times its focal lengths */
} face;

static double slope_of(const back_scene *s, int x, int y, int axis, double other)
{
    const int dx = axis == 0, dy = axis == 1;
    const uint32_t id = s->stencil[at(s, x, y)];
    double z = s->back_depth[at(s, x, y)], most = z * 20 / (double)s->frame.camera.focal[axis], slope = other;
    if (material_at(s, x + dx, y + dy) == id && material_at(s, x - dx, y - dy) == id) {
        float za = s->back_depth[at(s, x + dx, y + dy)], zb = s->back_depth[at(s, x - dx, y - dy)];
        float a = za - (float)z, b = (float)z - zb;
        if (za > 0 && zb > 0) {
            double limit = 2 * fmin(fabs((double)a), fabs((double)b));
            slope = a * b > 0 ? fmin(fmax(((double)a + (double)b) / 2, -limit), limit) : 0;
        }
    }
    return fmin(fmax(slope, -most), most);
}

static face face_of(const back_scene *s, int x, int y)
{
    const camera_t *c = &s->frame.camera;
    face f = {.z = s->back_depth[at(s, x, y)]};
    double ray[3], n[3] = {0}, nw = 0;
    back_ray(s, x, y, ray);
    for (int i = 0; i < 3; i++) {
        for (size_t k = 0; k < 3; k++)
            n[i] += (double)c->to_view[4 * i + (int)k] * (double)s->back_normal[k * s->n + at(s, x, y)];
        nw += n[i] * ray[i];
    }
    nw = copysign(fmax(fabs(nw), 1e-4), nw);
    f.slope[0] = slope_of(s, x, y, 0, -n[0] * f.z / nw / (double)c->focal[0]);
    f.slope[1] = slope_of(s, x, y, 1, n[1] * f.z / nw / (double)c->focal[1]);
    /* |dP/dx x dP/dy| of P = z ray, both in units of a pixel on the plane */
    double zx = f.slope[0] * (double)c->focal[0], zy = f.slope[1] * (double)c->focal[1];
    double a[3] = {f.z + ray[0] * zx, ray[1] * zx, -zx}, b[3] = {ray[0] * zy, ray[1] * zy - f.z, -zy};
    double cross[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    f.area = sqrt(cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]);
    return f;
}

/* ---- groups and patterns ---- */

typedef struct group {
    float thin, middle; /* least thickness, middle depth */
} group;

/* The lanes of a vector (64 columns, one phase) that go together with pixel (x, y). */
static group group_of(const back_scene *s, int x, int y, float d_max)
{
    enum { LANES = 16 };
    const uint32_t id = s->stencil[at(s, x, y)];
    float far[LANES], t[LANES];
    bool left[LANES];
    int own = (x & 63) / 4;
    for (int i = 0; i < LANES; i++) {
        int px = (x & ~63) + (x & 3) + 4 * i;
        left[i] = material_at(s, px, y) == id;
        if (!left[i])
            continue;
        float z = s->depth[at(s, px, y)], back = s->back_depth[at(s, px, y)];
        far[i] = back > 0 ? back : z;
        t[i] = fmaxf(far[i] - z, 0);
    }
    for (;;) {
        group g = {INFINITY, 0};
        float most = 0, front = 0, near = INFINITY;
        bool now[LANES];
        for (int i = 0; i < LANES; i++)
            if (left[i])
                most = fmaxf(most, far[i]);
        for (int i = 0; i < LANES; i++)
            if (left[i] && far[i] >= 0.8f * most)
                g.thin = fminf(g.thin, t[i]);
        for (int i = 0; i < LANES; i++) {
            now[i] = left[i] && far[i] >= 0.8f * most && t[i] <= fmaf(3, g.thin, d_max);
            if (now[i]) {
                front = fmaxf(front, far[i]);
                near = fminf(near, far[i]);
            }
        }
        g.middle = 0.5f * (front + near);
        if (now[own])
            return g;
        for (int i = 0; i < LANES; i++)
            left[i] = left[i] && !now[i];
    }
}

/* Rotation none or blue: turn and offset as shares of 1. */
static void choice_of(const back_scene *s, int x, int y, back_params p, double choice[2])
{
    static const int order[4][4] = {{2, 3, 12, 6}, {14, 8, 4, 10}, {1, 11, 0, 5}, {15, 7, 13, 9}};
    const double g = 1.32471795724474602596;
    for (int i = 0; i < 2; i++) {
        double shift = ldexp(twin_hash((uint32_t)p.seed, 0, 0, (uint32_t)i + 1), -32);
        double r2 = (s->frame.number + 16.0 * order[y & 3][x & 3]) * (i ? 1 / g : 1 / (g * g)) + shift;
        choice[i] = p.rotation == 0 ? (i ? 0.5 : 0) : r2 - floor(r2);
    }
}

static int patterns_of(int n)
{
    int most = 4096 / ((n + 63) / 64 * 64);
    most = most > 15 ? 15 : most;
    return most % 2 ? most : most - 1;
}

/* The plane that a channel's taps are made for, in units of its d. */
static double plane_of(double thin)
{
    double t = 0;
    for (double next = 0.5; next <= 32 && thin >= next; next *= 2)
        t = next;
    return t;
}

/* ---- taps ---- */

typedef struct tap {
    float x, y;   /* pixels */
    double share; /* 1/(n density), m² at the middle depth */
} tap;

static tap place(const back_scene *s, int x, int y, back_params p, int i, const group *g, const float *d_mm)
{
    const float *focal = s->frame.camera.focal;
    const double golden = pi * (3 - sqrt(5));
    double choice[2], density = 0;
    choice_of(s, x, y, p, choice);
    double offset = (floor(choice[1] * patterns_of(p.taps)) + 0.5) / patterns_of(p.taps);
    double turn = floor(choice[0] * 256), shift = floor(3 * (choice[0] * 256 - turn));
    int channel = (i + (int)shift) % 3;
    float most = fmaxf(d_mm[0], fmaxf(d_mm[1], d_mm[2])), inv_d = 1e3f / most;
    double d = d_mm[channel] * 1e-3, thin = 0.5 * (double)g->thin;
    double t = plane_of(thin / d), left = 1 - rl_burley_cdf(t, 1);
    double rho = rl_burley_inverse(1 - left * (1 - (i + offset) / p.taps)), r = sqrt((rho - t) * (rho + t));
    float per_s = 1.0f / (most / d_mm[channel]);
    float u = (float)(r * cos(i * golden)) * per_s, v = (float)(r * sin(i * golden)) * per_s;
    float cosine = (float)cos(2 * pi * turn / 256), sine = (float)sin(2 * pi * turn / 256);
    for (int c = 0; c < 3; c++) {
        double dc = d_mm[c] * 1e-3, plane = plane_of(thin / dc);
        double at_r = sqrt(r * r * d * d + plane * plane * dc * dc);
        density += rl_burley_profile(at_r, dc) / (1 - rl_burley_cdf(plane, 1)) / 3;
    }
    return (tap){fmaf(u, cosine, -(v * sine)) * (focal[0] / (g->middle * inv_d)),
                 fmaf(u, sine, v * cosine) * (focal[1] / (g->middle * inv_d)), 1 / (p.taps * density)};
}

/* R of the distance from the front of pixel (x, y) to depth z, (dx, dy) pixels away. */
static double weight(const back_scene *s, int x, int y, double dx, double dy, double z, double d)
{
    double from[3], to[3], r2 = 0;
    back_ray(s, x, y, from);
    back_ray(s, x + dx, y + dy, to);
    for (int k = 0; k < 3; k++)
        r2 += pow(to[k] * z - from[k] * (double)s->depth[at(s, x, y)], 2);
    return rl_burley_profile(sqrt(r2), d);
}

/* Whether the object is not hidden at a pixel where there is none of it: it has ended. */
static bool ended(const back_scene *s, int px, int py, uint32_t id, float far)
{
    const int *v = s->frame.valid;
    if (inside(s, px, py))
        return s->stencil[at(s, px, py)] == 0 || s->depth[at(s, px, py)] > far;
    px = px < v[0] ? v[0] : px >= v[2] ? v[2] - 1 : px;
    py = py < v[1] ? v[1] : py >= v[3] ? v[3] - 1 : py;
    return s->stencil[at(s, px, py)] != id;
}

void back_twin(const back_scene *s, int x, int y, back_params p, double through[3])
{
    const uint32_t id = s->stencil[at(s, x, y)];
    const back_material *m = &s->materials[id];
    const float *d_mm = m->scatter_distance_mm;
    const face own = face_of(s, x, y);
    const group g = group_of(s, x, y, 1 / (1e3f / fmaxf(d_mm[0], fmaxf(d_mm[1], d_mm[2]))));
    double light[3] = {0}, plane[3] = {0}, known[3] = {0}, middle2 = (double)g.middle * (double)g.middle;
    for (int i = 0; i < p.taps; i++) {
        tap t = place(s, x, y, p, i, &g, d_mm);
        int dx = (int)lrintf(t.x), dy = (int)lrintf(t.y), px = x + dx, py = y + dy;
        bool same = material_at(s, px, py) == id;
        if (same && s->back_depth[at(s, px, py)] > 0) {
            face f = face_of(s, px, py);
            double e = (f.slope[0] * (t.x - (double)dx) + f.slope[1] * (t.y - (double)dy)) / f.z;
            for (size_t c = 0; c < 3; c++) {
                double w = weight(s, x, y, t.x, t.y, f.z * (1 + e + e * e), d_mm[c] * 1e-3) * f.area *
                           (1 + 3 * e) / middle2 * t.share;
                light[c] += fmin(w, 1) * (double)s->back[c * s->n + at(s, px, py)];
            }
        }
        bool counts =
            same || m->border || ended(s, px, py, id, own.z > 0 ? (float)own.z : s->depth[at(s, x, y)]);
        double more = 1 / fmax(1 - (own.slope[0] * t.x + own.slope[1] * t.y) / own.z, 0.05);
        for (int c = 0; c < 3 && own.z > 0; c++) {
            double w = weight(s, x, y, t.x, t.y, own.z * more, d_mm[c] * 1e-3) * own.area * pow(more, 3) /
                       middle2 * t.share;
            plane[c] += w;
            known[c] += counts ? w : 0;
        }
    }
    for (int c = 0; c < 3; c++) {
        double along = fmax(own.z - (double)s->depth[at(s, x, y)], 0) * own.z * own.z / own.area;
        double off = fmin(fmax((1 - rl_burley_cdf(along, d_mm[c] * 1e-3)) / plane[c], 0.5), 2);
        through[c] = own.z <= 0                   ? light[c]
                     : known[c] > 1e-3 * plane[c] ? light[c] * off * plane[c] / known[c]
                                                  : 0;
    }
}

/* ---- the dense sum, the way out ---- */

void back_dense(const back_scene *s, int x, int y, double through[3])
{
    const uint32_t id = s->stencil[at(s, x, y)];
    const float *focal = s->frame.camera.focal;
    for (int c = 0; c < 3; c++)
        through[c] = 0;
    BACK_EACH_PIXEL(s, px, py, i)
    {
        if (s->stencil[i] != id || s->back_depth[i] <= 0)
            continue;
        face f = face_of(s, px, py);
        for (size_t c = 0; c < 3; c++)
            through[c] +=
                weight(s, x, y, px - x, py - y, f.z, s->materials[id].scatter_distance_mm[c] * 1e-3) *
                f.area / ((double)focal[0] * (double)focal[1]) * (double)s->back[c * s->n + i];
    }
}

void back_resolve(const back_scene *s, int x, int y, const double through[3], double out[3])
{
    const back_material *m = &s->materials[s->stencil[at(s, x, y)]];
    double ray[3], dot = 0, length = 0, way_out = 1;
    back_ray(s, x, y, ray); /* camera and world are the same */
    for (size_t k = 0; k < 3; k++) {
        dot += ray[k] * (double)s->normal[k * s->n + at(s, x, y)];
        length += ray[k] * ray[k];
    }
    if (m->diffuse == 0 && m->exit_transmission == 0)
        way_out = 1 - 0.5 * pow(1 - fmin(fabs(dot) / sqrt(length), 1), 5);
    for (size_t c = 0; c < 3; c++) {
        double a = s->albedo[c * s->n + at(s, x, y)];
        out[c] = s->lit[c * s->n + at(s, x, y)];
        if (m->has_profile)
            out[c] += through[c] * (m->texturing ? sqrt(a) : a) * way_out;
    }
}
