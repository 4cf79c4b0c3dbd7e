/* See sss_twin.h. */
#include "tests/sss_twin_parts.h"

#include <math.h>

#include "passes/burley.h"

static const double pi = 3.14159265358979323846;

long twin_at(const twin_scene *s, int x, int y)
{
    return (long)y * s->frame.columns + x;
}

long twin_plane(const twin_scene *s)
{
    return (long)s->frame.columns * s->frame.rows;
}

/* 0 outside of the image. */
uint32_t twin_material_at(const twin_scene *s, int x, int y)
{
    const int *v = s->frame.valid;
    return x < v[0] || y < v[1] || x >= v[2] || y >= v[3] ? 0 : s->stencil[twin_at(s, x, y)];
}

/* ---- the way out ---- */

void twin_resolve(const twin_scene *s, int x, int y, const double filtered[3], double color[3])
{
    const frame_t *f = &s->frame;
    const camera_t *c = &f->camera;
    const twin_material *m = &s->materials[s->stencil[twin_at(s, x, y)]];
    double ray[3] = {(x + f->origin[0] + 0.5 + c->jitter[0] - c->centre[0]) / c->focal[0],
                     -(y + f->origin[1] + 0.5 + c->jitter[1] - c->centre[1]) / c->focal[1], -1};
    double dot = 0, length = sqrt(ray[0] * ray[0] + ray[1] * ray[1] + 1);
    for (int i = 0; i < 3; i++) {
        const float *row = c->to_world + 4 * i;
        dot -= s->normal[i * twin_plane(s) + twin_at(s, x, y)] *
               (row[0] * ray[0] + row[1] * ray[1] + row[2] * ray[2]) / length;
    }
    double out = 1;
    if (m->diffuse == 0 && m->exit_transmission == 0)
        out = 1 - 0.5 * pow(1 - fmin(fabs(dot), 1), 5);
    for (int i = 0; i < 3; i++) {
        double a = s->albedo[i * twin_plane(s) + twin_at(s, x, y)];
        color[i] = s->lit[i * twin_plane(s) + twin_at(s, x, y)];
        if (m->has_profile)
            color[i] += filtered[i] * (m->texturing ? sqrt(a) : a) * out;
    }
}

/* ---- the surface that a pixel sees ---- */

static double slope(const twin_scene *s, int x, int y, int dx, int dy)
{
    uint32_t id = twin_material_at(s, x, y);
    float z = s->depth[twin_at(s, x, y)];
    double best = 0;
    bool have = false;
    for (int sign = 1; sign >= -1; sign -= 2) {
        int nx = x + sign * dx, ny = y + sign * dy;
        if (twin_material_at(s, nx, ny) != id)
            continue;
        double d = (double)sign * (double)(s->depth[twin_at(s, nx, ny)] - z);
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
    uint32_t id = s->stencil[twin_at(s, x, y)];
    float z = s->depth[twin_at(s, x, y)], most = z * (10 / c->focal[dx ? 0 : 1]), sum = 0;
    int n = 0;
    for (int sign = 1; sign >= -1; sign -= 2) {
        int nx = x + sign * dx, ny = y + sign * dy;
        if (twin_material_at(s, nx, ny) != id)
            continue;
        float d = (float)sign * (s->depth[twin_at(s, nx, ny)] - z);
        if (fabsf(d) > most)
            continue;
        sum += d;
        n++;
    }
    return n == 2 ? sum / 2 : sum;
}

/* Whether pixel (px, py) shows that the surface of (x, y) has turned away before; at_plane: the plane's
 * depth. */
bool twin_turned_away(const twin_scene *s, int px, int py, uint32_t id, float at_plane)
{
    const int *v = s->frame.valid;
    const float *focal = s->frame.camera.focal;
    if (px < v[0] || py < v[1] || px >= v[2] || py >= v[3] || twin_material_at(s, px, py) == id)
        return false;
    return twin_material_at(s, px, py) == 0 ||
           s->depth[twin_at(s, px, py)] > fmaf(at_plane, 2 / fminf(focal[0], focal[1]), at_plane);
}

/* Slopes of the disk, depth a metre of the screen's plane. In float: they decide where taps land. */
void twin_tilt(const twin_scene *s, int x, int y, float t[2])
{
    const camera_t *c = &s->frame.camera;
    float z = s->depth[twin_at(s, x, y)];
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
    double z = s->depth[twin_at(s, x, y)], zx = s->surface ? mean_slope(s, x, y, 1, 0) : slope(s, x, y, 1, 0);
    double zy = s->surface ? mean_slope(s, x, y, 0, 1) : slope(s, x, y, 0, 1);
    double rx = (x + f->origin[0] + 0.5 + c->jitter[0] - c->centre[0]) / c->focal[0];
    double ry = -(y + f->origin[1] + 0.5 + c->jitter[1] - c->centre[1]) / c->focal[1];
    double a[3] = {z / c->focal[0] + rx * zx, ry * zx, -zx},
           b[3] = {rx * zy, -z / c->focal[1] + ry * zy, -zy};
    double n[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    return sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
}

/* ---- distances ---- */

/* The ray (x, y) on the plane z = -1, right and down. */
static void ray_of(const twin_scene *s, int x, int y, double ray[2])
{
    const frame_t *f = &s->frame;
    const camera_t *c = &f->camera;
    ray[0] = (x + f->origin[0] + 0.5 + c->jitter[0] - c->centre[0]) / c->focal[0];
    ray[1] = (y + f->origin[1] + 0.5 + c->jitter[1] - c->centre[1]) / c->focal[1];
}

/* From pixel (x, y) to what is (u, v) away on the plane z = -1 and dz deeper, m: in space with orientation:
 * tangent and weighting: surface, else r on the screen's plane and the depth beside it. */
double twin_distance_to(const twin_scene *s, int x, int y, double u, double v, double dz)
{
    double z = s->depth[twin_at(s, x, y)], ray[2];
    if (!s->surface && !s->tangent)
        return sqrt(z * z * (u * u + v * v) + dz * dz);
    ray_of(s, x, y, ray);
    double from[3] = {z * ray[0], z * ray[1], z}, far = z + dz;
    double to[3] = {far * (ray[0] + u), far * (ray[1] + v), far};
    return sqrt(pow(to[0] - from[0], 2) + pow(to[1] - from[1], 2) + dz * dz);
}

/* How many times as deep a plane is that would be 1 + f times as deep, were depth linear on screen. */
static double plane_scale(double f)
{
    return 1 / fmax(1 - f, 0.02);
}

/* ---- weighting: surface ---- */

/* Slopes of the plane. */
tangent_t twin_tangent_of(const twin_scene *s, int x, int y)
{
    return (tangent_t){mean_slope(s, x, y, 1, 0), mean_slope(s, x, y, 0, 1)};
}

/* How much deeper it is (dx, dy) pixels away, and the area that is seen of it there beside the area here. */
double twin_plane_dz(const twin_scene *s, const tangent_t *t, int x, int y, int dx, int dy, double *area)
{
    double z = s->depth[twin_at(s, x, y)], f = ((double)t->x * dx + (double)t->y * dy) / z,
           k = plane_scale(f);
    *area = k * k * k;
    return z * f * k;
}

/* Between the surface and the ray. */
double twin_cosine_of(const twin_scene *s, int x, int y)
{
    const camera_t *c = &s->frame.camera;
    double z = s->depth[twin_at(s, x, y)], ray[2];
    ray_of(s, x, y, ray);
    double facing = z * z / ((double)c->focal[0] * c->focal[1] * sqrt(1 + ray[0] * ray[0] + ray[1] * ray[1]));
    return fmin(facing / twin_area(s, x, y), 1);
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

/* The light that the pixel (dx, dy) away sends here; dz: how much deeper it is. */
static double pixel_weight(const twin_scene *s, int px, int py, int dx, int dy, double dz, double d)
{
    static double x[NODES], w[NODES];
    const camera_t *c = &s->frame.camera;
    double z = s->depth[twin_at(s, px, py)], fx = c->focal[0], fy = c->focal[1], area = z * z / (fx * fy);
    if (w[0] == 0)
        legendre(x, w);
    if (dx == 0 && dy == 0)
        return rl_burley_cdf(sqrt(area / pi), d);
    if (dx < -2 || dx > 2 || dy < -2 || dy > 2)
        return rl_burley_profile(twin_distance_to(s, px, py, dx / fx, dy / fy, dz), d) * area;
    double sum = 0;
    for (int j = 0; j < NODES; j++)
        for (int i = 0; i < NODES; i++) {
            double far = twin_distance_to(s, px, py, (dx + x[i]) / fx, (dy + x[j]) / fy, dz);
            sum += w[i] * w[j] * rl_burley_profile(far, d);
        }
    return sum * area;
}

/* Pixel (x + dx, y + dy) joins the sums of (x, y). */
static void add_pixel(const twin_scene *s, int x, int y, int dx, int dy, const double d[3], twin_sums *to)
{
    uint32_t id = s->stencil[twin_at(s, x, y)];
    const twin_material *m = &s->materials[id];
    double z = s->depth[twin_at(s, x, y)], own = twin_area(s, x, y), plane_area;
    bool same = twin_material_at(s, x + dx, y + dy) == id;
    double dz = same ? s->depth[twin_at(s, x + dx, y + dy)] - z : 0,
           area = same ? twin_area(s, x + dx, y + dy) : own;
    for (int i = 0; i < 3 && (same || m->border); i++) {
        double w = pixel_weight(s, x, y, dx, dy, dz, d[i]) * area;
        to->w[i] += w;
        to->more[i] += same ? w : 0;
        if (same)
            to->light[i] += w * s->diffuse[i * twin_plane(s) + twin_at(s, x + dx, y + dy)];
    }
    if (!s->surface)
        return;
    tangent_t t = twin_tangent_of(s, x, y);
    double flat = twin_plane_dz(s, &t, x, y, dx, dy, &plane_area);
    bool away = twin_turned_away(s, x + dx, y + dy, id, (float)(z + flat));
    for (int i = 0; i < 3 && (same || m->border || away); i++) {
        double p = pixel_weight(s, x, y, dx, dy, flat, d[i]) * own * plane_area;
        to->planar[i] += p;
        to->more[i] -= same || !m->border ? p : 0;
    }
}

void twin_reference(const twin_scene *s, int x, int y, double filtered[3])
{
    const camera_t *c = &s->frame.camera;
    const twin_material *m = &s->materials[s->stencil[twin_at(s, x, y)]];
    double z = s->depth[twin_at(s, x, y)], d[3], most = 0, cosine = s->surface ? twin_cosine_of(s, x, y) : 0;
    twin_sums total = {0};
    for (int i = 0; i < 3; i++) {
        d[i] = m->scatter_distance_mm[i] * 1e-3;
        most = fmax(most, d[i]);
    }
    double reach = RL_BURLEY_RADIUS * most;
    float t[2];
    twin_tilt(s, x, y, t);
    int rx = (int)(3 * reach / z * c->focal[0]) + 1, ry = (int)(3 * reach / z * c->focal[1]) + 1;
    for (int dy = -ry; dy <= ry; dy++)
        for (int dx = -rx; dx <= rx; dx++) {
            double u = dx / (double)c->focal[0], v = dy / (double)c->focal[1];
            double rise = (double)t[0] * u + (double)t[1] * v;
            rise *= z * plane_scale(rise);
            if (twin_distance_to(s, x, y, u, v, rise) <= reach)
                add_pixel(s, x, y, dx, dy, d, &total);
        }
    for (int i = 0; i < 3; i++) {
        double bend = s->surface ? 1 + cosine * total.more[i] / total.planar[i] : 1;
        filtered[i] = total.light[i] / total.w[i] * bend;
    }
}
