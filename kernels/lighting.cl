/* Light on the G-buffer, behind what passes/lighting.c names. */

/* What a pixel's light is computed from, besides its surface and material. */
typedef struct source_t {
    constant params_t *p;
    constant frame_t *f;
    constant light_t *lights;
    constant ambient_t *ambient;
    global const float *depth, *shadow, *shadow_thickness, *profiles, *sky;
    constant const float *tables;
} source_t;

/* Visibility of light i, and what is known of the way through the object. `inside` is wanted too. */
static inline void look(ray_t *r, const surface_t *s, const source_t *from, constant light_t *light, int i, int inside, int x,
                        int y)
{
    int at = rl_index(from->f, x, y);
    r->visibility = 1.0f;
    r->shadow_thickness = 0.0f;
    r->has_thickness = 0;
    if (HAS_shadow && light->shadow >= 0)
        r->visibility = rl_load(from->shadow, light->shadow * from->f->plane + at);
    if (LIGHTS_MARCH && light->shadow == SHADOW_MARCH)
        r->visibility = march(from->depth, from->p, from->f, light, s->z, s->here & (r->nl > 0.0f) & (r->falloff > 0.0f), i, x, y);
    if (HAS_shadow_thickness && inside && light->shadow_thickness >= 0) {
        r->shadow_thickness = rl_load(from->shadow_thickness, light->shadow_thickness * from->f->plane + at);
        r->has_thickness = 1;
    }
}

/* A light without size. */
static inline void add_point(constant material_t *m, const surface_t *s, constant light_t *light, const ray_t *r, int transmits,
                             int scattered, floatv *diffuse, floatv *specular)
{
    floatv entered = r->falloff * transmit(m->shading_diffuse, r->nl);
    floatv lit = r->falloff * r->visibility * fmax(r->nl, 0.0f);
    floatv front = entered * r->visibility * fmax(r->nl, 0.0f);
    RL_UNROLL
    for (int c = 0; c < 3; c++) {
        floatv e = front;
        if (scattered)
            e = mix(front, r->falloff * scatter_visibility(s, r) * sg_irradiance(&s->sg[c], dot3(s->bent[c], r->l)), s->blurred[c]);
        diffuse[c] += light->intensity[c] * e;
    }
    if (transmits && rl_any(r->nl < 0.0f)) {
        floatv back = fmax(-r->nl, 0.0f), t[3];
        through(m, s, r, back, t);
        RL_UNROLL
        for (int c = 0; c < 3; c++)
            diffuse[c] += light->intensity[c] * (entered * back * t[c]);
    }
    if (m->shading_specular == GGX && rl_any(lit > 0.0f)) {
        floatv fresnel, dv = lit * lobe(s, r, s->roughness, &fresnel);
        RL_UNROLL
        for (int c = 0; c < 3; c++) {
            floatv f0 = mix(s->specular, s->albedo[c], s->metallic);
            specular[c] += light->intensity[c] * dv * fma(1.0f - f0, fresnel, f0);
        }
    }
}

/* Sums of one material over all lights: E F_in (with what comes through), and the specular radiance. */
static inline void sum_lights(constant material_t *m, const surface_t *s, const source_t *from, int x, int y, floatv *diffuse,
                              floatv *specular)
{
    int transmits = m->has_profile && m->shading_transmission && m->profile_transmission != OPAQUE &&
                    m->profile_transmission != GATHER;
    int scattered = scatters(m);
    ltc_t ltc;
#if LIGHTS_AREA || LIGHTS_SKY
    ltc_frame(&ltc, s);
    if (m->shading_specular == GGX)
        ltc_values(&ltc, from->tables, s->roughness, fmax(s->nv, 0.0f));
#endif
    for (int i = 0; i < from->f->lights; i++) {
        constant light_t *light = &from->lights[i];
        ray_t r;
        aim(&r, s, light, &from->f->camera);
        int area = LIGHTS_AREA && light->type >= LIGHT_SPHERE;
        if (!transmits && !scattered && !rl_any(r.nl > (area ? -light->radius * r.inverse : (floatv)0.0f)))
            continue;
        look(&r, s, from, light, i, transmits || scattered, x, y);
#if LIGHTS_PROFILE
        if (light->profile)
            r.falloff *= profile_at(from->profiles, light, r.l);
#endif
#if LIGHTS_AREA
        if (area) {
            add_area(m, s, light, &r, &ltc, transmits, scattered, diffuse, specular);
            continue;
        }
#endif
        add_point(m, s, light, &r, transmits, scattered, diffuse, specular);
    }
#if LIGHTS_SKY
    if (from->ambient->sky_levels && m->shading_specular == GGX)
        add_sky(s, from->ambient, from->sky, &ltc, specular);
#endif
}

/* What a material gives wins over the layer of that name, which wins over the default. */
static inline floatv given(float own, int has_layer, global const float *layer, int at, float otherwise)
{
    if (own >= 0.0f)
        return own;
    return has_layer ? rl_load(layer, at) : (floatv)otherwise;
}

/* One material for a whole vector: what enters (`diffuse`) and what is complete (`lit`). */
static inline void shade(constant material_t *m, surface_t *s, const source_t *from, int x, int y, floatv *diffuse, floatv *lit)
{
    floatv sum[3] = {0.0f, 0.0f, 0.0f};
    RL_UNROLL
    for (int c = 0; c < 3; c++)
        lit[c] = diffuse[c] = 0.0f;
    sum_lights(m, s, from, x, y, sum, lit);
    if (from->ambient->on)
        add_ambient(m, s, from->ambient, sum);
    floatv scale = (1.0f / RL_PI) * (1.0f - s->metallic);
    if (!m->has_profile || m->shading_exit_transmission == EXIT_IN_LIGHTING)
        scale *= transmit(m->shading_diffuse, s->nv);
    RL_UNROLL
    for (int c = 0; c < 3; c++) {
        if (!m->has_profile || scatters(m))
            lit[c] = fma(sum[c] * scale, s->albedo[c], lit[c]);
        else
            diffuse[c] = sum[c] * scale * (m->profile_texturing == PRE_POST ? sqrt(s->albedo[c]) : 1.0f);
    }
}

#define LIGHTING_PORTS                                                                                       \
    global const float *albedo, global const float *normal, global const float *depth,                       \
        global const uint *stencil, global const float *thickness, global const float *shadow,               \
        global const float *shadow_thickness, global const float *roughness,                                 \
        global const float *specular, global const float *metallic, global const float *emission,            \
        global const float *curvature, global const float *smooth_normal, global float *diffuse,             \
        global float *lit, ENERGY_PORT constant params_t *p, constant frame_t *f,                            \
        constant material_t *materials, constant light_t *lights, constant ambient_t *ambient,               \
        global const float *profiles, global const float *sky, constant const float *tables

kernel void lighting(LIGHTING_PORTS)
{
    const source_t from = {p, f, lights, ambient, depth, shadow, shadow_thickness, profiles, sky, tables};
    int x = RL_W * (int)get_global_id(0), y = (int)get_global_id(1), at = rl_index(f, x, y);
    uintv id = rl_load_id(stencil, at);
    uint now = rl_max_id(id);
    floatv out_diffuse[3], out_lit[3];
    surface_t s;
    RL_UNROLL
    for (int c = 0; c < 3; c++)
        out_diffuse[c] = out_lit[c] = 0.0f;
    if (now) {
        s.z = rl_load(depth, at);
        RL_UNROLL
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
        s.here = mask;
        shade(m, &s, &from, x, y, d, l);
        RL_UNROLL
        for (int c = 0; c < 3; c++) {
            out_diffuse[c] = rl_select(out_diffuse[c], d[c], mask);
            if (HAS_emission)
                l[c] += rl_load(emission, at + c * f->plane);
            out_lit[c] = rl_select(out_lit[c], l[c], mask);
        }
        id = select(id, (uintv)0, mask);
        now = rl_max_id(id);
    }
    RL_UNROLL
    for (int c = 0; c < 3; c++) {
        RL_STORE(diffuse, c, x, y, out_diffuse[c]);
        rl_store(out_lit[c], lit, at + c * f->plane);
    }
}

#if WANTS_energy
kernel void lighting_energy(LIGHTING_PORTS)
{
    band_t band = energy_band(energy, f);
    ENERGY_EACH_VECTOR(f, band, x, y)
    {
        int at = rl_index(f, x, y);
        floatv values[ENERGY_PIXELS];
        energy_clear(values);
        RL_UNROLL
        for (int c = 0; c < 3; c++) {
            if (HAS_emission)
                values[ENERGY_IN + c] = rl_load(emission, at + c * f->plane);
            values[ENERGY_OUT + c] = RL_LOAD(diffuse, c, x, y) + rl_load(lit, at + c * f->plane);
        }
        energy_post_all(&band, f, x, y, rl_load_id(stencil, at), values);
    }
}
#endif
