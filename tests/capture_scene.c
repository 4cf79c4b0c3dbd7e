#include "tests/capture_scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

scene_camera scene_camera_default(void)
{
    /* stands at (0.2, 0.3, 0.6), turned by 0.15 about y, then 0.2 about x, then 0.1 about the view axis */
    scene_camera c = {.data = {0, 0, 72, 48}, .display = {0, 0, 72, 48}, .fov_x = 0.8, .aspect = 1};
    const double at[3] = {0.2, 0.3, 0.6}, a = 0.15, b = 0.2, g = 0.1;
    const double ry[9] = {cos(a), 0, -sin(a), 0, 1, 0, sin(a), 0, cos(a)};
    const double rx[9] = {1, 0, 0, 0, cos(b), -sin(b), 0, sin(b), cos(b)};
    const double rz[9] = {cos(g), -sin(g), 0, sin(g), cos(g), 0, 0, 0, 1};
    double xy[9] = {0};
    for (int i = 0; i < 9; i++)
        for (int k = 0; k < 3; k++)
            xy[i] += rx[3 * (i / 3) + k] * ry[3 * k + i % 3];
    for (int i = 0; i < 9; i++)
        for (int k = 0; k < 3; k++)
            c.view[4 * (i / 3) + i % 3] += rz[3 * (i / 3) + k] * xy[3 * k + i % 3];
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            c.view[4 * i + 3] -= c.view[4 * i + k] * at[k];
    return c;
}

static double dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static const double spheres[2][4] = {{-0.25, 0, -2, 0.5}, {0.5, -0.2, -1.7, 0.3}};

/* The nearest hit of a ray; the parameter is the depth, since the ray advances 1 along the view axis. */
static double hit(const double *from, const double *ray, double *normal, uint32_t *id)
{
    double best = INFINITY;
    for (int s = 0; s < 2; s++) {
        double o[3];
        for (int i = 0; i < 3; i++)
            o[i] = from[i] - spheres[s][i];
        double a = dot(ray, ray), b = dot(o, ray), c = dot(o, o) - spheres[s][3] * spheres[s][3];
        double root = b * b - a * c, t = root > 0 ? (-b - sqrt(root)) / a : -1;
        if (!(t > 0 && t < best))
            continue;
        best = t;
        *id = s ? 3 : 1;
        for (int i = 0; i < 3; i++)
            normal[i] = (o[i] + t * ray[i]) / spheres[s][3];
    }
    double t = (-0.6 - from[1]) / ray[1];
    if (t > 0 && t < best && t < 5) {
        best = t;
        *id = 2;
        normal[0] = normal[2] = 0;
        normal[1] = 1;
    }
    return best;
}

uint32_t scene_first(const double *from, const double *ray, double end)
{
    double normal[3];
    uint32_t id = 0;
    return hit(from, ray, normal, &id) < end ? id : 0;
}

uint32_t scene_inside(const double *p)
{
    for (int s = 0; s < 2; s++) {
        double o[3];
        for (int i = 0; i < 3; i++)
            o[i] = p[i] - spheres[s][i];
        if (dot(o, o) < spheres[s][3] * spheres[s][3])
            return s ? 3 : 1;
    }
    return p[1] < -0.6 ? 2 : 0;
}

static void view_ray(const scene_camera *c, int x, int y, double *ray)
{
    const int *d = c->display;
    double width = 2 * tan(c->fov_x / 2), pixel = width / d[2];
    double sx = c->center[0] + (x + 0.5 + c->jitter[0] - d[0] - d[2] / 2.0) * pixel;
    double sy = c->center[1] - (y + 0.5 + c->jitter[1] - d[1] - d[3] / 2.0) * pixel / c->aspect;
    for (int i = 0; i < 3; i++)
        ray[i] = c->view[i] * sx + c->view[4 + i] * sy - c->view[8 + i];
}

static double cone(const double *l)
{
    static const double axis[3] = SCENE_RIM_DIRECTION;
    double outer = SCENE_RIM_ANGLE * pi / 360, inner = outer * (1 - SCENE_RIM_BLEND);
    double c = -dot(l, axis) / sqrt(dot(axis, axis));
    double t = (c - cos(outer)) / (cos(inner) - cos(outer));
    t = t < 0 ? 0 : t > 1 ? 1 : t;
    return t * t * (3 - 2 * t);
}

/* Irradiance of one light at a point. */
static void light(int which, const double *p, const double *n, double *e)
{
    static const double at[2][3] = {SCENE_KEY_POSITION, SCENE_RIM_POSITION}, sun[3] = SCENE_SUN_DIRECTION;
    static const double power[3][3] = {SCENE_KEY_INTENSITY, SCENE_RIM_INTENSITY, SCENE_SUN_IRRADIANCE};
    double l[3], d2 = which < 2 ? 0 : dot(sun, sun);
    for (int i = 0; i < 3; i++)
        l[i] = which < 2 ? at[which][i] - p[i] : -sun[i];
    d2 = dot(l, l);
    for (int i = 0; i < 3; i++)
        l[i] /= sqrt(d2);
    double nl = dot(n, l);
    double falloff = (nl > 0 ? nl : 0) / (which < 2 ? d2 : 1) * (which == 1 ? cone(l) : 1);
    for (int i = 0; i < 3; i++)
        e[i] = power[which][i] * falloff;
}

static void shade(scene *s, size_t i, unsigned lights, unsigned shadowed)
{
    double p[3], n[3], e[3];
    for (int c = 0; c < 3; c++) {
        p[c] = s->plane[SCENE_POSITION + c][i];
        n[c] = s->plane[SCENE_NORMAL + c][i];
    }
    for (int k = 0; k < 3; k++) {
        if (!(lights >> k & 1))
            continue;
        light(k, p, n, e);
        double visible = k < 2 && shadowed >> k & 1 ? s->plane[SCENE_SHADOW + k][i] : 1;
        for (int c = 0; c < 3; c++)
            s->plane[SCENE_COLOR + c][i] += s->plane[SCENE_ALBEDO + c][i] / pi * e[c] * visible;
    }
}

static void fill(scene *s, size_t i, const double *from, const double *ray)
{
    double n[3];
    uint32_t id = 0;
    double t = hit(from, ray, n, &id);
    s->plane[SCENE_RAY][i] = sqrt(dot(ray, ray));
    s->plane[SCENE_MOTION][i] = 1.5 + 0.01 * (double)(i % 31);
    s->plane[SCENE_MOTION + 1][i] = -0.75 + 0.02 * (double)(i % 17);
    s->id[i] = id;
    if (!id)
        return;
    s->plane[SCENE_DEPTH][i] = t;
    for (int c = 0; c < 3; c++) {
        double p = s->plane[SCENE_POSITION + c][i] = from[c] + t * ray[c];
        s->plane[SCENE_NORMAL + c][i] = n[c];
        s->plane[SCENE_ALBEDO + c][i] = 0.5 + 0.4 * sin(3 * p + id + c);
    }
    s->plane[SCENE_THICKNESS][i] = 0.02 + 0.01 * sin(5 * s->plane[SCENE_POSITION][i]);
    s->plane[SCENE_SHADOW][i] = 0.5 + 0.5 * sin(4 * s->plane[SCENE_POSITION][i]);
    s->plane[SCENE_SHADOW + 1][i] = 0.5 + 0.5 * cos(6 * s->plane[SCENE_POSITION + 2][i]);
}

scene scene_make(const scene_camera *camera, unsigned lights, unsigned shadowed)
{
    scene s = {.camera = *camera, .width = camera->data[2], .height = camera->data[3]};
    double from[3] = {0};
    s.n = (size_t)s.width * (size_t)s.height;
    s.id = calloc(s.n, sizeof *s.id);
    for (int i = 0; i < SCENE_PLANES; i++)
        s.plane[i] = calloc(s.n, sizeof *s.plane[i]);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            from[i] -= camera->view[4 * k + i] * camera->view[4 * k + 3];
    for (size_t i = 0; i < s.n; i++) {
        double ray[3];
        view_ray(camera, camera->data[0] + (int)i % s.width, camera->data[1] + (int)i / s.width, ray);
        fill(&s, i, from, ray);
        if (s.id[i])
            shade(&s, i, lights, shadowed);
    }
    return s;
}

void scene_free(scene *s)
{
    for (int i = 0; i < SCENE_PLANES; i++)
        free(s->plane[i]);
    free(s->id);
    memset(s, 0, sizeof *s);
}
