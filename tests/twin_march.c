#include "tests/twin_march.h"

#include <math.h>
#include <stdlib.h>

#include "tests/twin_hash.h"
#include "tests/twin_shading.h"

/* Point + t way, view space with depth instead of -z; t < end. */
typedef struct view_ray {
    double point[3], way[3], end;
} view_ray;

static view_ray ray_to(const frame_t *f, const light_t *light, double z, int x, int y)
{
    view_ray r = {.end = light->type == LIGHT_DIRECTIONAL ? INFINITY : 1};
    const camera_t *c = &f->camera;
    double view[3], world[3];
    twin_ray(f, c, x, y, view, world);
    for (int i = 0; i < 3; i++) {
        double sign = i == 2 ? -1 : 1, v = 0;
        r.point[i] = view[i] * z * sign;
        for (int k = 0; k < 3; k++)
            v += (double)c->to_view[4 * i + k] *
                 (light->type == LIGHT_DIRECTIONAL
                      ? -(double)light->direction[k]
                      : (double)light->position[k] - (double)c->to_world[4 * k + 3]);
        r.way[i] = sign * v - (light->type == LIGHT_DIRECTIONAL ? 0 : r.point[i]);
    }
    return r;
}

/* Buffer pixel of a point on an axis; y grows downwards. */
static double pixel(const frame_t *f, const double *p, int axis)
{
    const camera_t *c = &f->camera;
    double at = (axis ? -1 : 1) * p[axis] / p[2] * (double)c->focal[axis] + (double)c->centre[axis];
    return at - f->origin[axis] - 0.5 - (double)c->jitter[axis];
}

/* Where the ray meets a column or row: t, or -1 when never before its end. */
static double meet(const frame_t *f, const view_ray *r, int axis, int at)
{
    const camera_t *c = &f->camera;
    double slope = (axis ? -1 : 1) *
                   (at + f->origin[axis] + 0.5 + (double)c->jitter[axis] - (double)c->centre[axis]) /
                   (double)c->focal[axis];
    double t = (slope * r->point[2] - r->point[axis]) / (r->way[axis] - slope * r->way[2]);
    return t > 0 && t < r->end && r->point[2] + t * r->way[2] > 0 ? t : -1;
}

static double surface(const frame_t *f, const shade_image *depth, double x, double y, double *front)
{
    int left = (int)floor(x), top = (int)floor(y);
    int right = left + (x > left && left + 1 < f->valid[2]), below = top + (y > top && top + 1 < f->valid[3]);
    double a = (double)*shade_at(depth, f, 0, left, top), b = (double)*shade_at(depth, f, 0, right, below);
    double part = (x - left) + (y - top), k = (a > 0 ? (1 - part) / a : 0) + (b > 0 ? part / b : 0);
    *front = fmin(a > 0 ? a : INFINITY, b > 0 ? b : INFINITY);
    return k > 0 ? 1 / k : INFINITY;
}

static void consider(double distance, double *margin)
{
    *margin = fmin(*margin, fabs(distance));
}

/* Pixels of the major axis before the light or the border; `direction` +1 or -1. */
static int count_steps(const frame_t *f, const view_ray *r, int major, int direction, const int *from,
                       double *margin)
{
    int n = 0, other = 1 - major;
    for (;; n++) {
        int at = from[major] + direction * (n + 1);
        if (at < f->valid[major] || at >= f->valid[major + 2])
            return n;
        double t = meet(f, r, major, at);
        if (t < 0)
            return n;
        double p[3];
        for (int i = 0; i < 3; i++)
            p[i] = r->point[i] + t * r->way[i];
        double minor = pixel(f, p, other);
        consider((minor - f->valid[other]) / 100, margin);
        consider((minor - (f->valid[other + 2] - 1)) / 100, margin);
        if (minor < f->valid[other] || minor > f->valid[other + 2] - 1)
            return n;
        if (r->end < 2)
            consider(1 / t - 1, margin);
    }
}

static int first_step(const frame_t *f, const march_params *p, int stride, int which, int x, int y)
{
    uint32_t a = (uint32_t)p->seed + 0x632BE5ABu * (uint32_t)which, b = (uint32_t)f->number;
    uint32_t h = twin_hash(a, b, (uint32_t)(x + f->origin[0]), (uint32_t)(y + f->origin[1]));
    int first = (int)((double)(h >> 8) / 16777216 * stride);
    return 1 + first;
}

int twin_march(const frame_t *f, const march_params *p, const shade_image *depth, const light_t *light,
               int which, int x, int y, double *margin)
{
    double z = (double)*shade_at(depth, f, 0, x, y), before = z;
    view_ray r = ray_to(f, light, z, x, y);
    double flow[2]; /* of the pixel, to begin with, times the depth */
    for (int i = 0; i < 2; i++)
        flow[i] = (i ? -1 : 1) * (double)f->camera.focal[i] * (r.way[i] - r.point[i] / z * r.way[2]);
    *margin = fabs(fabs(flow[0]) - fabs(flow[1])) / fmax(fabs(flow[0]), fabs(flow[1]));
    int major = fabs(flow[1]) > fabs(flow[0]), direction = flow[major] > 0 ? 1 : -1, from[2] = {x, y};
    int n = count_steps(f, &r, major, direction, from, margin);
    int stride = n > p->steps ? (n + p->steps - 1) / p->steps : 1;
    for (int i = p->jitter && stride > 1 ? first_step(f, p, stride, which, x, y) : 1; i <= n; i += stride) {
        double t = meet(f, &r, major, from[major] + direction * i), at[3], xy[2];
        for (int k = 0; k < 3; k++)
            at[k] = r.point[k] + t * r.way[k];
        xy[major] = from[major] + direction * i;
        xy[1 - major] = pixel(f, at, 1 - major);
        double front, s = surface(f, depth, xy[0], xy[1], &front), near = fmin(at[2], before);
        before = at[2];
        consider(isinf(s) ? 1 : at[2] / (s + (double)p->bias) - 1, margin);
        if (at[2] > s + (double)p->bias)
            consider(near / (front + (double)p->thickness) - 1, margin);
        if (at[2] > s + (double)p->bias && near < front + (double)p->thickness)
            return 0;
    }
    return 1;
}
