#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>

#include "tests/area_scene.h"

static const double pi = 3.14159265358979323846;

double area_dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

void area_normalize(double *a)
{
    double length = sqrt(area_dot(a, a));
    for (int i = 0; i < 3; i++)
        a[i] /= length;
}

static void cross(const double *a, const double *b, double *out)
{
    for (int i = 0; i < 3; i++)
        out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

void area_tangents(const double *n, double *t, double *b)
{
    double other[3] = {fabs(n[0]) < 0.5, fabs(n[0]) >= 0.5, 0};
    cross(n, other, t);
    area_normalize(t);
    cross(n, t, b);
}

/* ---- the truth -------------------------------------------------------------------------------------------
 */

/* GGX with the height-correlated Smith term and Schlick's Fresnel, without the cosine; as Walter 2007 and
 * Heitz 2014 print it. */
static double ggx(const area_point *x, const double *l)
{
    double h[3], a = fmax(x->roughness * x->roughness, 1e-3), a2 = a * a;
    for (int i = 0; i < 3; i++)
        h[i] = l[i] + x->v[i];
    area_normalize(h);
    double nl = area_dot(x->n, l), nv = area_dot(x->n, x->v), nh = area_dot(x->n, h), c[3];
    if (nl <= 0 || nv <= 0)
        return 0;
    cross(x->n, h, c);
    double base = nh * nh * a2 + area_dot(c, c), d = a2 / (pi * base * base);
    double lambda_l = 0.5 * (sqrt(1 + a2 * (1 - nl * nl) / (nl * nl)) - 1);
    double lambda_v = 0.5 * (sqrt(1 + a2 * (1 - nv * nv) / (nv * nv)) - 1);
    double f = x->f0 + (1 - x->f0) * pow(1 - area_dot(h, x->v), 5);
    return d * f / (1 + lambda_l + lambda_v) / (4 * nl * nv);
}

static double entry(double c)
{
    return 1 - 0.5 * pow(1 - fabs(c), 5);
}

/* Adds a direction of weight `solid`. */
static void add_direction(const area_point *x, const double *l, double solid, area_sums *s)
{
    double c = area_dot(x->n, l);
    if (c < 0) {
        s->back -= c * solid;
        s->back_disney -= c * entry(c) * solid;
        return;
    }
    s->lambert += c * solid;
    s->disney += c * entry(c) * solid;
    s->specular += c * ggx(x, l) * solid;
}

static void sum_rect(const light_t *light, const area_point *x, int n, area_sums *s)
{
    double side[3], top[3], normal[3], to[3];
    for (int i = 0; i < 3; i++) {
        side[i] = (double)light->side[i];
        top[i] = (double)light->top[i];
        to[i] = (double)light->position[i] - x->p[i];
    }
    cross(side, top, normal); /* a quarter of the area long */
    for (int i = 0; i < n * n; i++) {
        double a = 2 * (i / n + 0.5) / n - 1, b = 2 * (i % n + 0.5) / n - 1, l[3];
        for (int k = 0; k < 3; k++)
            l[k] = to[k] + a * side[k] + b * top[k];
        double d2 = area_dot(l, l), from = -area_dot(l, normal) / sqrt(d2);
        area_normalize(l);
        from = light->two_sided ? fabs(from) : fmax(from, 0);
        add_direction(x, l, 4.0 / n / n * from / d2, s);
    }
}

static void sum_sphere(const light_t *light, const area_point *x, int n, area_sums *s)
{
    double axis[3], t[3], b[3], r = (double)light->radius;
    for (int i = 0; i < 3; i++)
        axis[i] = (double)light->position[i] - x->p[i];
    double d2 = area_dot(axis, axis), sine2 = r * r / d2, share = sine2 / (1 + sqrt(1 - sine2)); /* 1 - cos */
    area_normalize(axis);
    area_tangents(axis, t, b);
    for (int i = 0; i < n * n; i++) {
        double u = (i / n + 0.5) / n, z = share * u * u, phi = 2 * pi * (i % n + 0.5) / n, l[3];
        double sine = sqrt(z * (2 - z));
        for (int k = 0; k < 3; k++)
            l[k] = (1 - z) * axis[k] + sine * (cos(phi) * t[k] + sin(phi) * b[k]);
        add_direction(x, l, 4 * pi * share * u / n / n, s);
    }
}

/* For a radiance of 1. */
area_sums area_integrate(const light_t *light, const area_point *x, int n)
{
    area_sums s = {0};
    (light->type == LIGHT_RECT ? sum_rect : sum_sphere)(light, x, n, &s);
    return s;
}

/* ---- through the pass ------------------------------------------------------------------------------------
 */

void area_set(area_yard *t, const char *group, const char *key, double a)
{
    assert_true(shade_material_set(&t->scene.materials, MATERIAL, group, key, (double[]){a, a, a}));
}

void area_fill(area_yard *t, int port, double a)
{
    shade_fill(&t->scene.images[port], &t->scene.frame, (double[]){a, a, a});
}

void area_read(const area_yard *t, int x, int y, area_point *out)
{
    const frame_t *f = &t->scene.frame;
    double view[3], w[3];
    double z = (double)*shade_at(&t->scene.images[LIGHTING_DEPTH], f, 0, x, y);
    twin_ray(f, &f->camera, x, y, view, w);
    for (int i = 0; i < 3; i++) {
        out->p[i] = (double)f->camera.to_world[4 * i + 3] + z * w[i];
        out->v[i] = -w[i];
        out->n[i] = (double)*shade_at(&t->scene.images[LIGHTING_NORMAL], f, i, x, y);
    }
    area_normalize(out->v);
    out->roughness = (double)*shade_at(&t->scene.images[LIGHTING_ROUGHNESS], f, 0, x, y);
    out->f0 = (double)*shade_at(&t->scene.images[LIGHTING_SPECULAR], f, 0, x, y);
}

void area_set_normal(area_yard *t, int x, int y, const double *n)
{
    for (int i = 0; i < 3; i++)
        *shade_at(&t->scene.images[LIGHTING_NORMAL], &t->scene.frame, i, x, y) = (float)n[i];
}

/* Roughness 0.1 to 1 along a row, depth 1; a scattering material, so that `diffuse` is E F_in / pi and `lit`
 * the specular part alone. */
void area_make(area_yard *t)
{
    assert_true(shade_scene_make(&t->scene, AREA_COLUMNS, AREA_ROWS, 3, 1, 7));
    const frame_t *f = &t->scene.frame;
    area_set(t, "shading", "diffuse", 1);
    area_set(t, "shading", "specular", 0);
    area_set(t, "shading", "exit_transmission", 0);
    area_set(t, "profile", "texturing", 0);
    area_set(t, "profile", "transmission", 0);
    area_set(t, "material", "roughness", -1);
    area_set(t, "material", "specular", -1);
    area_set(t, "material", "metallic", -1);
    area_fill(t, LIGHTING_EMISSION, 0);
    area_fill(t, LIGHTING_METALLIC, 0);
    area_fill(t, LIGHTING_SPECULAR, 0.04f);
    area_fill(t, LIGHTING_DEPTH, 1);
    t->scene.frame.camera.focal[0] = t->scene.frame.camera.focal[1] = 100; /* 10 x 12 cm are seen */
    for (int y = f->valid[1]; y < f->valid[3]; y++)
        for (int x = f->valid[0]; x < f->valid[2]; x++) {
            shade_set_id(&t->scene.images[LIGHTING_STENCIL], f, x, y, MATERIAL);
            *shade_at(&t->scene.images[LIGHTING_ROUGHNESS], f, 0, x, y) = 0.1f * (float)(x - f->valid[0] + 1);
        }
    t->scene.frame.lights = 1;
    t->run = shade_scene_lighting(&t->scene);
    t->run.lights = &t->light;
    for (int port = LIGHTING_SHADOW; port <= LIGHTING_SHADOW_THICKNESS; port++)
        t->run.images[port] = NULL;
}

/* A light at `distance` from the middle of what is seen, on the camera's side and to its right; tilted. An
 * intensity of 1 along the direction. */
void area_place(area_yard *t, int type, double distance, double a, double b)
{
    area_point middle;
    double way[3], side[3], top[3], d[3], tilted[3];
    const frame_t *f = &t->scene.frame;
    area_read(t, (f->valid[0] + f->valid[2]) / 2, (f->valid[1] + f->valid[3]) / 2, &middle);
    area_tangents(middle.v, side, top);
    for (int i = 0; i < 3; i++)
        way[i] = 0.6 * middle.v[i] + 0.7 * side[i] + 0.39 * top[i];
    area_normalize(way);
    for (int i = 0; i < 3; i++)
        tilted[i] = -way[i] + 0.3 * top[i];
    area_normalize(tilted);
    memcpy(d, tilted, sizeof d);
    area_tangents(d, side, top); /* side x top = d */
    memset(&t->light, 0, sizeof t->light);
    t->light = (light_t){.type = type, .shadow = -1, .shadow_thickness = -1};
    t->light.radius = (float)(type == LIGHT_RECT ? hypot(a, b) : a);
    t->light.radiance = (float)(type == LIGHT_RECT ? 1 / (4 * a * b) : 1 / (pi * a * a));
    for (int i = 0; i < 3; i++) {
        t->light.position[i] = (float)(middle.p[i] + distance * way[i]);
        t->light.direction[i] = (float)d[i];
        t->light.side[i] = (float)(a * side[i]);
        t->light.top[i] = (float)(b * top[i]);
        t->light.intensity[i] = 1;
    }
}

/* Row 0: where the light's middle is mirrored. The next ones: further and further from that, around different
 * axes, the last ones until half of the light is below the horizon. */
void area_aim(area_yard *t)
{
    const frame_t *f = &t->scene.frame;
    uint64_t seed = 5;
    for (int y = 0; y < AREA_ROWS; y++)
        for (int x = 0; x < AREA_COLUMNS; x++) {
            area_point p;
            double h[3], l[3], s[3], b[3], turn = 6.3 * shade_random(&seed), n[3];
            area_read(t, x + f->valid[0], y + f->valid[1], &p);
            for (int i = 0; i < 3; i++)
                l[i] = (double)t->light.position[i] - p.p[i];
            area_normalize(l);
            for (int i = 0; i < 3; i++)
                h[i] = l[i] + p.v[i];
            area_normalize(h);
            area_tangents(y < 8 ? h : l, s, b);
            double tilt = y < 8 ? 0.12 * y : 1.35 + 0.12 * (y - 8);
            for (int k = 0; k < 20; k++, turn += 1) { /* of the last, one that the camera sees */
                for (int i = 0; i < 3; i++)
                    n[i] = cos(tilt) * (y < 8 ? h : l)[i] + sin(tilt) * (cos(turn) * s[i] + sin(turn) * b[i]);
                if (area_dot(n, p.v) > 0.2)
                    break;
            }
            area_normalize(n);
            area_set_normal(t, x + f->valid[0], y + f->valid[1], n);
        }
}

double area_got(const area_yard *t, int port, int x, int y)
{
    return (double)*shade_at(&t->scene.images[port], &t->scene.frame, 0, x, y);
}
