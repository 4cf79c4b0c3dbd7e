/* Direct light. Everything is in world space and metres; `w` is the camera's ray per metre of depth, so the point is
 * P = C + z w and what matters, n.(L - P) = n.(L - C) - z n.w, needs n.w once a pixel. Near the terminator that
 * difference cancels: it is taken in double where the device has doubles (error of n.l 1e-8 against 1e-7 without). */
#ifdef cl_khr_fp64
#pragma OPENCL EXTENSION cl_khr_fp64 : enable
typedef double widest;
typedef RL_CAT(double, RL_W) widev;
#define to_widev(v)  RL_CAT(convert_double, RL_W)(v)
#define to_narrow(v) RL_CAT(convert_float, RL_W)(v)
#else
typedef float widest;
typedef floatv widev;
#define to_widev(v)  (v)
#define to_narrow(v) (v)
#endif

enum { POST, PRE_POST };
enum { DISNEY, LAMBERT, SG };
enum { GGX };
enum { EXIT_IN_SSS, EXIT_IN_LIGHTING };
enum { OPAQUE, THIN, THICK, BEER_LAMBERT };
enum { FROM_MAX, FROM_LAYER, FROM_SHADOW };

/* Below this alpha a highlight of a light without size would be narrower than a pixel's worth of normals. */
#define ALPHA_MIN 1e-3f

typedef struct surface_t {
    floatv n[3], w[3], v[3]; /* shading normal; ray per metre of depth; towards the camera, unit */
    widev wide_n[3], nw;     /* the normal again; z n.w */
    floatv z, nv;            /* depth; n.v */
    floatv albedo[3], thickness, roughness, specular, metallic;
    floatv radius;           /* of curvature, metres; at most 1e6 */
    floatv bent[3][3];       /* the normal that each channel's scattering sees */
    sg_t sg[3];              /* of a material with SG, and the sharpness */
    floatv sharpness[3];
} surface_t;

typedef struct ray_t {
    floatv l[3], nl, falloff; /* towards the light, unit; n.l; 1/d^2 and cone */
    floatv visibility, shadow_thickness;
    int has_thickness; /* shadow_thickness is known */
} ray_t;

/* F_dt(c) = 1 - (1 - |c|)^5 / 2, Golubev 2018 after Burley 2015. */
static inline floatv transmit(int diffuse, floatv c)
{
    if (diffuse != DISNEY)
        return 1.0f;
    floatv a = fmax(1.0f - fabs(c), 0.0f), a2 = a * a;
    return fma(-0.5f * a2 * a2, a, 1.0f);
}

static inline floatv dot3(const floatv *a, const floatv *b)
{
    return fma(a[0], b[0], fma(a[1], b[1], a[2] * b[2]));
}

static inline void view_surface(surface_t *s, constant frame_t *f, int x, int y)
{
    constant camera_t *c = &f->camera;
    widev px = to_widev(rl_to_floatv(RL_LANES + (x + f->origin[0])));
    widev rx = (px + ((widest)c->jitter[0] + 0.5f - c->centre[0])) / (widest)c->focal[0];
    widest py = (widest)(y + f->origin[1]) + 0.5f + c->jitter[1];
    widest ry = (c->centre[1] - py) / c->focal[1];
    widev nw = 0;
    for (int i = 0; i < 3; i++) {
        widev w = rx * c->to_world[4 * i] + (ry * c->to_world[4 * i + 1] - c->to_world[4 * i + 2]);
        s->wide_n[i] = to_widev(s->n[i]);
        s->w[i] = to_narrow(w);
        nw = s->wide_n[i] * w + nw;
    }
    s->nw = nw * to_widev(s->z);
    floatv inverse = rsqrt(dot3(s->w, s->w));
    for (int i = 0; i < 3; i++)
        s->v[i] = -s->w[i] * inverse;
    s->nv = to_narrow(-nw) * inverse;
}

/* Smooth between the cone's edges, t^2 (3 - 2t), the same at both. */
static inline floatv cone(constant light_t *light, const floatv *l)
{
    floatv c = -fma(l[0], light->direction[0], fma(l[1], light->direction[1], l[2] * light->direction[2]));
    float scale = 1.0f / fmax(light->cos_inner - light->cos_outer, 1e-6f);
    floatv t = clamp((c - light->cos_outer) * scale, 0.0f, 1.0f);
    return t * t * fma((floatv)-2.0f, t, 3.0f);
}

static inline void aim(ray_t *r, const surface_t *s, constant light_t *light, constant camera_t *c)
{
    widev nl = 0;
    if (light->type == LIGHT_DIRECTIONAL) {
        for (int i = 0; i < 3; i++) {
            r->l[i] = -light->direction[i];
            nl = s->wide_n[i] * -(widest)light->direction[i] + nl;
        }
        r->nl = to_narrow(nl);
        r->falloff = 1.0f;
        return;
    }
    nl = -s->nw;
    for (int i = 0; i < 3; i++) {
        widest from_camera = (widest)light->position[i] - c->to_world[4 * i + 3];
        r->l[i] = fma(-s->z, s->w[i], (floatv)(float)from_camera);
        nl = s->wide_n[i] * from_camera + nl;
    }
    floatv inverse = rsqrt(fmax(dot3(r->l, r->l), 1e-12f)); /* a light on the surface stays finite */
    for (int i = 0; i < 3; i++)
        r->l[i] *= inverse;
    r->nl = to_narrow(nl) * inverse;
    r->falloff = inverse * inverse;
    if (light->type == LIGHT_SPOT)
        r->falloff *= cone(light, r->l);
}

/* D V of GGX with the height-correlated Smith term (Heitz 2014), and Schlick's (1 - v.h)^5 in `fresnel`. 1 - (n.h)^2
 * comes from the cross product, since it cancels where a highlight is sharp. */
static inline floatv lobe(const surface_t *s, const ray_t *r, floatv roughness, floatv *fresnel)
{
    floatv alpha = fmax(roughness * roughness, ALPHA_MIN), a2 = alpha * alpha;
    floatv nl = fmax(r->nl, 0.0f), nv = fmax(s->nv, 0.0f);
    floatv h[3] = {r->l[0] + s->v[0], r->l[1] + s->v[1], r->l[2] + s->v[2]};
    floatv hh = fmax(dot3(h, h), 1e-12f), inverse = rsqrt(hh);
    floatv nh = fmax(r->nl + s->nv, 0.0f) * inverse;
    floatv cross[3] = {s->n[1] * h[2] - s->n[2] * h[1], s->n[2] * h[0] - s->n[0] * h[2],
                       s->n[0] * h[1] - s->n[1] * h[0]};
    floatv sine = dot3(cross, cross) * inverse * inverse;
    floatv denominator = fma(a2 * nh, nh, sine);
    floatv f = fmax(1.0f - 0.5f * hh * inverse, 0.0f), f2 = f * f;
    floatv smith = nl * sqrt(fma(nv * nv, 1.0f - a2, a2)) + nv * sqrt(fma(nl * nl, 1.0f - a2, a2));
    *fresnel = f2 * f2 * f;
    return a2 * (0.5f / RL_PI) / (denominator * denominator * fmax(smith, 1e-12f));
}

/* How much of the light on the back face comes through, without cosine, F_in and 1/pi (DESIGN 4.5): the slab of
 * Golubev 2018, (e^-st + 3 e^-st/3) / 4, or Helix's Beer-Lambert law. `back` is |n.l| there. */
static inline void through(constant material_t *m, const surface_t *s, const ray_t *r, floatv back, floatv *out)
{
    const float log2_e = 1.44269504f;
    int mode = m->profile_transmission;
    floatv along = r->shadow_thickness * back; /* from the light's ray to the normal */
    floatv known = rl_select(along, s->thickness, s->thickness > 0.0f);
    floatv t = known, visibility = 1.0f;
    if (mode == THIN) {
        visibility = r->visibility; /* of both faces; but the object itself is no shadow on its back */
        if (r->has_thickness)
            visibility = rl_select(visibility, 1.0f, along <= 2.0f * s->thickness + 1e-3f);
    } else if (m->profile_thickness_from == FROM_SHADOW) {
        t = along;
    } else if (m->profile_thickness_from == FROM_MAX) {
        t = fmax(s->thickness, along);
    }
    visibility = rl_select(0.0f, visibility, t > 0.0f); /* unknown: nothing */
    for (int i = 0; i < 3; i++) {
        if (mode == BEER_LAMBERT) {
            float k = log2(m->profile_transmittance_color[i]) / (1e-3f * m->profile_transmittance_distance_mm);
            out[i] = visibility * rl_exp2(t * k);
        } else {
            float k = -log2_e / (3e-3f * m->profile_scatter_distance_mm[i]);
            floatv q = rl_exp2(t * k);
            out[i] = visibility * 0.25f * q * fma(q, q, 3.0f);
        }
    }
}

/* Whether light scatters on its way in, as spherical Gaussians; the graph's check saw to it that curvature is there. */
static inline int scatters(constant material_t *m)
{
    return HAS_curvature && m->has_profile && m->shading_diffuse == SG;
}

/* Per channel the sharpness, and the normal: a bump of variance u keeps u/(u + v) of its height under a Gaussian of variance v, so
 * that is how far the normal stays the shading normal. u is the material's and the pixel's own. */
static inline void scatter_surface(constant material_t *m, surface_t *s, constant frame_t *f,
                                   global const float *curvature, global const float *smooth_normal, int at)
{
    floatv pixel = s->z * (1e3f / f->camera.focal[0]), bend = rl_load(curvature, at), smooth[3];
    floatv u = fma(pixel, pixel * (1.0f / 12.0f), m->material_normal_detail_mm * m->material_normal_detail_mm);
    for (int i = 0; i < 3 && HAS_smooth_normal; i++)
        smooth[i] = rl_load(smooth_normal, at + i * f->plane);
    s->radius = 1.0f / fmax(fabs(bend), 1e-6f);
    for (int c = 0; c < 3; c++) {
        float d = m->profile_scatter_distance_mm[c], v = m->profile_sg_variance_mm2[c];
        v = v >= 0.0f ? v : 7.0f * d * d; /* Burley's second moment an axis */
        s->sharpness[c] = sg_sharpness(bend, v);
        s->sg[c] = sg_make(s->sharpness[c]);
        for (int i = 0; i < 3; i++)
            s->bent[c][i] = s->n[i];
        if (!HAS_smooth_normal)
            continue;
        floatv keep = u / (u + v);
        for (int i = 0; i < 3; i++)
            s->bent[c][i] = mix(smooth[i], s->n[i], keep);
        floatv inverse = rsqrt(fmax(dot3(s->bent[c], s->bent[c]), 1e-12f));
        for (int i = 0; i < 3; i++)
            s->bent[c][i] *= inverse;
    }
}

/* Visibility for what scatters. The shadow that a ball casts on its own far side is in the Gaussian already, and would cut it off at
 * the terminator: where the light's way through the object is known, a shadow that is at most twice the chord 2 r |n.l|
 * (and 1 mm) long is taken for such a one. */
static inline floatv scatter_visibility(const surface_t *s, const ray_t *r)
{
    if (!r->has_thickness)
        return r->visibility;
    intv own = r->shadow_thickness <= fma(4.0f * s->radius, fmax(-r->nl, 0.0f), 1e-3f);
    return rl_select(r->visibility, 1.0f, own & (r->shadow_thickness > 0.0f));
}

/* Sums of one material over all lights: E F_in (with what comes through), and the specular radiance. */
static inline void sum_lights(constant material_t *m, const surface_t *s, constant frame_t *f, constant light_t *lights,
                              global const float *shadow, global const float *shadow_thickness, int at, floatv *diffuse,
                              floatv *specular)
{
    int transmits = m->has_profile && m->shading_transmission && m->profile_transmission != OPAQUE;
    int scattered = scatters(m);
    for (int i = 0; i < f->lights; i++) {
        constant light_t *light = &lights[i];
        ray_t r;
        aim(&r, s, light, &f->camera);
        if (!transmits && !scattered && !rl_any(r.nl > 0.0f))
            continue;
        r.visibility = 1.0f;
        r.shadow_thickness = 0.0f;
        r.has_thickness = 0;
        if (HAS_shadow && light->shadow >= 0)
            r.visibility = rl_load(shadow, light->shadow * f->plane + at);
        if (HAS_shadow_thickness && (transmits || scattered) && light->shadow_thickness >= 0) {
            r.shadow_thickness = rl_load(shadow_thickness, light->shadow_thickness * f->plane + at);
            r.has_thickness = 1;
        }
        floatv entered = r.falloff * transmit(m->shading_diffuse, r.nl);
        floatv lit = r.falloff * r.visibility * fmax(r.nl, 0.0f);
        floatv front = entered * r.visibility * fmax(r.nl, 0.0f);
        for (int c = 0; c < 3; c++) {
            if (scattered)
                front = r.falloff * scatter_visibility(s, &r) * sg_irradiance(&s->sg[c], dot3(s->bent[c], r.l));
            diffuse[c] += light->intensity[c] * front;
        }
        if (transmits && rl_any(r.nl < 0.0f)) {
            floatv back = fmax(-r.nl, 0.0f), t[3];
            through(m, s, &r, back, t);
            for (int c = 0; c < 3; c++)
                diffuse[c] += light->intensity[c] * (entered * back * t[c]);
        }
        if (m->shading_specular == GGX && rl_any(lit > 0.0f)) {
            floatv fresnel, dv = lit * lobe(s, &r, s->roughness, &fresnel);
            for (int c = 0; c < 3; c++) {
                floatv f0 = mix(s->specular, s->albedo[c], s->metallic);
                specular[c] += light->intensity[c] * dv * fma(1.0f - f0, fresnel, f0);
            }
        }
    }
}

/* Ambient irradiance times F_in: 1, or for Disney's the mean of F_dt over evenly bright sky, 41/42. There is no occlusion, and none
 * of it comes through from the back. */
static inline void add_ambient(constant material_t *m, const surface_t *s, constant ambient_t *ambient, floatv *sum)
{
    float entered = m->shading_diffuse == DISNEY ? 41.0f / 42.0f : 1.0f;
    int scattered = scatters(m);
    for (int c = 0; c < 3; c++) {
        const floatv *n = scattered ? s->bent[c] : s->n;
        floatv a1 = 1.0f, a2 = 1.0f;
        if (scattered) {
            a1 = sg_band1(s->sharpness[c]);
            a2 = sg_band2(s->sharpness[c], a1);
        }
        sum[c] += entered * (sh_irradiance(ambient, c, n, a1, a2) + lobe_irradiance(ambient, c, n, scattered, a1));
    }
}

/* What a material gives wins over the layer of that name, which wins over the default. */
static inline floatv given(float own, int has_layer, global const float *layer, int at, float otherwise)
{
    if (own >= 0.0f)
        return own;
    return has_layer ? rl_load(layer, at) : (floatv)otherwise;
}

/* One material for a whole vector: what enters (`diffuse`) and what is complete (`lit`). */
static inline void shade(constant material_t *m, surface_t *s, constant frame_t *f, constant light_t *lights,
                         constant ambient_t *ambient, global const float *shadow,
                         global const float *shadow_thickness, int at, floatv *diffuse, floatv *lit)
{
    floatv sum[3] = {0.0f, 0.0f, 0.0f};
    for (int c = 0; c < 3; c++)
        lit[c] = diffuse[c] = 0.0f;
    sum_lights(m, s, f, lights, shadow, shadow_thickness, at, sum, lit);
    if (ambient->on)
        add_ambient(m, s, ambient, sum);
    floatv scale = (1.0f / RL_PI) * (1.0f - s->metallic);
    if (!m->has_profile || m->shading_exit_transmission == EXIT_IN_LIGHTING)
        scale *= transmit(m->shading_diffuse, s->nv);
    for (int c = 0; c < 3; c++) {
        if (!m->has_profile || scatters(m))
            lit[c] = fma(sum[c] * scale, s->albedo[c], lit[c]);
        else
            diffuse[c] = sum[c] * scale * (m->profile_texturing == PRE_POST ? sqrt(s->albedo[c]) : 1.0f);
    }
}

kernel void lighting(global const float *albedo, global const float *normal, global const float *depth,
                     global const uint *stencil, global const float *thickness, global const float *shadow,
                     global const float *shadow_thickness, global const float *roughness, global const float *specular,
                     global const float *metallic, global const float *emission, global const float *curvature,
                     global const float *smooth_normal, global float *diffuse, global float *lit, constant frame_t *f, constant material_t *materials, constant light_t *lights,
                     constant ambient_t *ambient)
{
    int x = RL_W * (int)get_global_id(0), y = (int)get_global_id(1), at = rl_index(f, x, y);
    uintv id = rl_load_id(stencil, at);
    uint now = rl_max_id(id);
    floatv out_diffuse[3], out_lit[3];
    surface_t s;
    for (int c = 0; c < 3; c++)
        out_diffuse[c] = out_lit[c] = 0.0f;
    if (now) {
        s.z = rl_load(depth, at);
        for (int c = 0; c < 3; c++) {
            s.albedo[c] = rl_load(albedo, at + c * f->plane);
            s.n[c] = rl_load(normal, at + c * f->plane);
        }
        view_surface(&s, f, x, y);
        s.thickness = HAS_thickness ? rl_load(thickness, at) : (floatv)0.0f;
    }
    while (now) {
        constant material_t *m = &materials[now];
        intv mask = id == now;
        floatv d[3], l[3];
        s.roughness = given(m->material_roughness, HAS_roughness, roughness, at, 0.5f);
        s.specular = given(m->material_specular, HAS_specular, specular, at, 0.04f);
        s.metallic = given(m->material_metallic, HAS_metallic, metallic, at, 0.0f);
        if (scatters(m))
            scatter_surface(m, &s, f, curvature, smooth_normal, at);
        shade(m, &s, f, lights, ambient, shadow, shadow_thickness, at, d, l);
        for (int c = 0; c < 3; c++) {
            out_diffuse[c] = rl_select(out_diffuse[c], d[c], mask);
            if (HAS_emission)
                l[c] += rl_load(emission, at + c * f->plane);
            out_lit[c] = rl_select(out_lit[c], l[c], mask);
        }
        id = select(id, (uintv)0, mask);
        now = rl_max_id(id);
    }
    for (int c = 0; c < 3; c++) {
        RL_STORE(diffuse, c, x, y, out_diffuse[c]);
        rl_store(out_lit[c], lit, at + c * f->plane);
    }
}
