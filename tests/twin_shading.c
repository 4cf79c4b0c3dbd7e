#include <math.h>
#include <string.h>

#include "tests/twin_shading.h"

static const double pi = 3.14159265358979323846;

typedef struct twin_material {
    bool has_profile;
    int texturing, transmission, thickness_from, diffuse, specular_lobe, transmits, exit_transmission;
    double distance_mm[3], color[3], color_mm, roughness, specular, metallic;
    double variance_mm2[3], detail_mm;
} twin_material;

typedef struct twin_pixel {
    double albedo[3], n[3], w[3], v[3], z, thickness, roughness, specular, metallic;
    double curvature, smooth[3], pixel_mm;
    bool has_smooth;
} twin_pixel;

static double get(const shade_materials *m, size_t id, const char *group, const char *key)
{
    double v[3] = {0, 0, 0};
    shade_material_get(m, id, group, key, v);
    return v[0];
}

static twin_material load_material(const shade_materials *m, size_t id)
{
    twin_material t = {.has_profile = m->words[id][0] != 0};
    t.texturing = (int)get(m, id, "profile", "texturing");
    t.transmission = (int)get(m, id, "profile", "transmission");
    t.thickness_from = (int)get(m, id, "profile", "thickness_from");
    t.diffuse = (int)get(m, id, "shading", "diffuse");
    t.specular_lobe = (int)get(m, id, "shading", "specular");
    t.transmits = (int)get(m, id, "shading", "transmission");
    t.exit_transmission = (int)get(m, id, "shading", "exit_transmission");
    shade_material_get(m, id, "profile", "scatter_distance_mm", t.distance_mm);
    shade_material_get(m, id, "profile", "transmittance_color", t.color);
    t.color_mm = get(m, id, "profile", "transmittance_distance_mm");
    t.roughness = get(m, id, "material", "roughness");
    t.specular = get(m, id, "material", "specular");
    t.metallic = get(m, id, "material", "metallic");
    t.detail_mm = get(m, id, "material", "normal_detail_mm");
    shade_material_get(m, id, "profile", "sg_variance_mm2", t.variance_mm2);
    for (int c = 0; c < 3; c++)
        if (t.variance_mm2[c] < 0)
            t.variance_mm2[c] = 7 * t.distance_mm[c] * t.distance_mm[c];
    return t;
}

static double dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double saturate(double x)
{
    return x < 0 ? 0 : x > 1 ? 1 : x;
}

static double transmit(int diffuse, double c)
{
    return diffuse >= 1 ? 1 : 1 - 0.5 * pow(fmax(1 - fabs(c), 0), 5);
}

void twin_ray(const frame_t *f, const camera_t *c, double x, double y, double *view, double *world)
{
    view[0] = (x + f->origin[0] + 0.5 + c->jitter[0] - c->centre[0]) / c->focal[0];
    view[1] = -(y + f->origin[1] + 0.5 + c->jitter[1] - c->centre[1]) / c->focal[1];
    view[2] = -1;
    for (int i = 0; i < 3; i++)
        world[i] = c->to_world[4 * i] * view[0] + c->to_world[4 * i + 1] * view[1] - c->to_world[4 * i + 2];
}

static double sample(const shade_run *run, int port, int plane, int x, int y, double absent)
{
    return run->images[port] ? (double)*shade_at(run->images[port], &run->frame, plane, x, y) : absent;
}

static twin_pixel load_pixel(const shade_run *run, int x, int y)
{
    twin_pixel p;
    double view[3];
    twin_ray(&run->frame, &run->frame.camera, x, y, view, p.w);
    for (int c = 0; c < 3; c++) {
        p.albedo[c] = sample(run, LIGHTING_ALBEDO, c, x, y, 0);
        p.n[c] = sample(run, LIGHTING_NORMAL, c, x, y, 0);
        p.v[c] = -p.w[c] / sqrt(dot(p.w, p.w));
        p.smooth[c] = sample(run, LIGHTING_SMOOTH_NORMAL, c, x, y, 0);
    }
    p.has_smooth = run->images[LIGHTING_SMOOTH_NORMAL] != NULL;
    p.curvature = sample(run, LIGHTING_CURVATURE, 0, x, y, 0);
    p.z = sample(run, LIGHTING_DEPTH, 0, x, y, 0);
    p.pixel_mm = 1000 * p.z / run->frame.camera.focal[0];
    p.thickness = sample(run, LIGHTING_THICKNESS, 0, x, y, 0);
    p.roughness = sample(run, LIGHTING_ROUGHNESS, 0, x, y, 0.5);
    p.specular = sample(run, LIGHTING_SPECULAR, 0, x, y, 0.04f);
    p.metallic = sample(run, LIGHTING_METALLIC, 0, x, y, 0);
    return p;
}

/* Unit direction to the light; returns 1/d^2 times the cone. */
static double aim(const light_t *light, const camera_t *c, const twin_pixel *p, double *l)
{
    double d2 = 1, to_light[3];
    for (int i = 0; i < 3; i++)
        l[i] = -light->direction[i];
    if (light->type == LIGHT_DIRECTIONAL)
        return 1;
    for (int i = 0; i < 3; i++)
        to_light[i] = light->position[i] - (c->to_world[4 * i + 3] + p->z * p->w[i]);
    d2 = fmax(dot(to_light, to_light), 1e-12);
    double along = 0;
    for (int i = 0; i < 3; i++) {
        l[i] = to_light[i] / sqrt(d2);
        along -= l[i] * light->direction[i];
    }
    if (light->type == LIGHT_POINT)
        return 1 / d2;
    double t = saturate((along - light->cos_outer) / fmax((double)light->cos_inner - light->cos_outer, 1e-6));
    return t * t * (3 - 2 * t) / d2;
}

/* D V F with F of channel c. */
static double lobe(const twin_pixel *p, const double *l, double roughness, double f0)
{
    double alpha = fmax(roughness * roughness, 1e-3), a2 = alpha * alpha, h[3];
    for (int i = 0; i < 3; i++)
        h[i] = l[i] + p->v[i];
    double length = fmax(sqrt(dot(h, h)), 1e-6);
    double nl = fmax(dot(p->n, l), 0), nv = fmax(dot(p->n, p->v), 0), nh = fmax(dot(p->n, h) / length, 0);
    double cross[3] = {p->n[1] * h[2] - p->n[2] * h[1], p->n[2] * h[0] - p->n[0] * h[2],
                       p->n[0] * h[1] - p->n[1] * h[0]};
    double base = nh * nh * a2 + dot(cross, cross) / (length * length);
    double d = a2 / (pi * base * base);
    double v = 0.5 / fmax(nl * sqrt(nv * nv * (1 - a2) + a2) + nv * sqrt(nl * nl * (1 - a2) + a2), 1e-12);
    return d * v * (f0 + (1 - f0) * pow(fmax(1 - length / 2, 0), 5));
}

static double through(const twin_material *m, const twin_pixel *p, int channel, double back, double shadow,
                      const float *shadow_thickness)
{
    enum { THIN = 1, BEER_LAMBERT = 3, FROM_LAYER = 1, FROM_SHADOW = 2 };
    double along = shadow_thickness ? *shadow_thickness * back : 0, visibility = 1, t;
    double known = p->thickness > 0 ? p->thickness : along;
    if (m->transmission == THIN || m->thickness_from == FROM_LAYER)
        t = known;
    else
        t = m->thickness_from == FROM_SHADOW ? along : fmax(p->thickness, along);
    if (m->transmission == THIN)
        visibility = shadow_thickness && along <= 2 * p->thickness + 1e-3 ? 1 : shadow;
    if (t <= 0)
        return 0;
    if (m->transmission == BEER_LAMBERT)
        return visibility * exp(log(m->color[channel]) / (m->color_mm * 1e-3) * t);
    double s = 1 / (m->distance_mm[channel] * 1e-3);
    return visibility * 0.25 * (exp(-s * t) + 3 * exp(-s * t / 3));
}

double twin_sg_irradiance(double lambda, double mu)
{
    double e = exp(-lambda), c0 = 0.36, c1 = 1 / (4 * c0);
    if (lambda < 0.1)
        return 0.25 + lambda * mu / 6;
    double scale = 1 + e * e - (1 - e * e) / lambda, bias = (e - e * e) / lambda - e * e;
    double x = sqrt((1 - e * e) / lambda - e * e);
    double y = fabs(c0 * mu) <= c1 * x ? (c0 * mu + c1 * x) * (c0 * mu + c1 * x) / x : saturate(mu);
    return (scale * y + bias) / (1 - e * e);
}

static bool is_sg(const shade_run *run, const twin_material *m)
{
    return m->diffuse == 2 && m->has_profile && run->images[LIGHTING_CURVATURE];
}

/* Irradiance of a unit light of direction l, per channel, with visibility. */
static double scattered(const twin_material *m, const twin_pixel *p, int channel, const double *l, double nl,
                        double shadow, const float *shadow_thickness)
{
    double v = m->variance_mm2[channel], n[3],
           u = m->detail_mm * m->detail_mm + p->pixel_mm * p->pixel_mm / 12;
    double blurred = fmin(fmax(10 * (16.5644 * sqrt(v / 7) / p->pixel_mm - 0.45), 0), 1);
    double keep = p->has_smooth ? 1 - blurred * v / (u + v) : 1, r_mm = 1000 / fmax(fabs(p->curvature), 1e-6);
    for (int i = 0; i < 3; i++)
        n[i] = p->smooth[i] + keep * (p->n[i] - p->smooth[i]);
    double bare = shadow * fmax(nl, 0), length = fmax(sqrt(dot(n, n)), 1e-6),
           lambda = fmin(fmax(r_mm * r_mm / v, 1e-3), 1e4);
    if (shadow_thickness && *shadow_thickness > 0 && *shadow_thickness <= 4e-3 * r_mm * fmax(-nl, 0) + 1e-3)
        shadow = 1;
    return (1 - blurred) * bare + blurred * shadow * twin_sg_irradiance(lambda, dot(n, l) / length);
}

static void add_light(const shade_run *run, const light_t *light, const twin_material *m, const twin_pixel *p,
                      int x, int y, double *sum, double *specular)
{
    double l[3], falloff = aim(light, &run->frame.camera, p, l), nl = dot(p->n, l), shadow = 1;
    const float *st = NULL;
    if (run->images[LIGHTING_SHADOW] && light->shadow >= 0)
        shadow = sample(run, LIGHTING_SHADOW, light->shadow, x, y, 1);
    if (run->images[LIGHTING_SHADOW_THICKNESS] && light->shadow_thickness >= 0)
        st = shade_at(run->images[LIGHTING_SHADOW_THICKNESS], &run->frame, light->shadow_thickness, x, y);
    for (int c = 0; c < 3; c++) {
        double e = light->intensity[c] * falloff,
               f0 = p->specular + p->metallic * (p->albedo[c] - p->specular);
        if (is_sg(run, m))
            sum[c] += e * scattered(m, p, c, l, nl, shadow, st);
        else if (nl > 0)
            sum[c] += e * nl * shadow * transmit(m->diffuse, nl);
        if (nl > 0) {
            if (m->specular_lobe == 0)
                specular[c] += e * nl * shadow * lobe(p, l, p->roughness, f0);
        } else if (m->has_profile && m->transmits && m->transmission) {
            sum[c] += e * -nl * transmit(m->diffuse, nl) * through(m, p, c, -nl, shadow, st);
        }
    }
}

void twin_lighting(const shade_run *run, int x, int y, double *diffuse, double *lit)
{
    memset(diffuse, 0, 3 * sizeof *diffuse);
    memset(lit, 0, 3 * sizeof *lit);
    uint32_t id = shade_id(run->images[LIGHTING_STENCIL], &run->frame, x, y);
    if (!id)
        return;
    twin_material m = load_material(run->materials, id);
    twin_pixel p = load_pixel(run, x, y);
    p.roughness = m.roughness >= 0 ? m.roughness : p.roughness;
    p.specular = m.specular >= 0 ? m.specular : p.specular;
    p.metallic = m.metallic >= 0 ? m.metallic : p.metallic;
    double sum[3] = {0, 0, 0};
    for (int i = 0; i < run->frame.lights; i++)
        add_light(run, &run->lights[i], &m, &p, x, y, sum, lit);
    for (int c = 0; c < 3; c++) {
        double value = sum[c] / pi * (1 - p.metallic), f_out = transmit(m.diffuse, dot(p.n, p.v));
        if (!m.has_profile || is_sg(run, &m))
            lit[c] += value * p.albedo[c] * f_out;
        else
            diffuse[c] = value * (m.texturing ? sqrt(p.albedo[c]) : 1) * (m.exit_transmission ? f_out : 1);
        lit[c] += sample(run, LIGHTING_EMISSION, c, x, y, 0);
    }
}

void twin_combine(const shade_run *inputs, int x, int y, const double *diffuse, const double *lit,
                  double *color)
{
    memcpy(color, lit, 3 * sizeof *color);
    uint32_t id = shade_id(inputs->images[COMBINE_STENCIL], &inputs->frame, x, y);
    twin_material m = load_material(inputs->materials, id);
    if (!id || !m.has_profile)
        return;
    double view[3], w[3], n[3];
    twin_ray(&inputs->frame, &inputs->frame.camera, x, y, view, w);
    for (int c = 0; c < 3; c++)
        n[c] = sample(inputs, COMBINE_NORMAL, c, x, y, 0);
    double f_out = m.exit_transmission ? 1 : transmit(m.diffuse, dot(n, w) / sqrt(dot(w, w)));
    for (int c = 0; c < 3; c++) {
        double a = sample(inputs, COMBINE_ALBEDO, c, x, y, 0);
        color[c] += diffuse[c] * (m.texturing ? sqrt(a) : a) * f_out;
    }
}
