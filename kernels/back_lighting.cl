/* Light that enters the closest back face (Golubev 2018, future work: "diffuse shading of the closest back
 * face"), behind sg.cl and surface.cl. The same radiometry as lighting.cl: the radiance that would be sent
 * back at the same place, without exit(albedo) and F_out. */

enum { AWAY, TOWARDS_CAMERA }; /* params_t.facing */

/* Shadows are recorded for what the camera sees: the light that goes to the front point meets something
 * first, at front + l shadow_thickness. When that lies above the plane of the back face by no more than the
 * object is thick there (and 1 mm), it is taken for the back of the object, which is lit then: the rule of
 * `transmission: thin`. Otherwise the front's visibility counts. Where the way through is not known there is
 * no telling the object itself from what shades it: lit. */
static inline floatv back_visibility(const surface_t *s, const ray_t *r, floatv thickness)
{
    if (!r->has_thickness)
        return 1.0f;
    return rl_select(r->visibility, 1.0f, r->shadow_thickness * r->nl <= fma(2.0f, thickness, 1e-3f));
}

/* E F_in of all lights, a channel. `thickness` is the way from front to back along the back's normal. */
static inline void sum_back_lights(constant material_t *m, const surface_t *s, constant frame_t *f,
                                   constant light_t *lights, global const float *shadow,
                                   global const float *shadow_thickness, floatv thickness, int at,
                                   floatv *sum)
{
    for (int i = 0; i < f->lights; i++) {
        constant light_t *light = &lights[i];
        ray_t r;
        aim(&r, s, light, &f->camera);
        if (!rl_any(r.nl > 0.0f))
            continue;
        r.has_thickness =
            HAS_shadow && light->shadow >= 0 && HAS_shadow_thickness && light->shadow_thickness >= 0;
        if (r.has_thickness) {
            r.visibility = rl_load(shadow, light->shadow * f->plane + at);
            r.shadow_thickness = rl_load(shadow_thickness, light->shadow_thickness * f->plane + at);
        }
        floatv e = r.falloff * fmax(r.nl, 0.0f) * transmit(m->shading_diffuse, r.nl) *
                   back_visibility(s, &r, thickness);
        for (int c = 0; c < 3; c++)
            sum[c] = fma((floatv)light->intensity[c], e, sum[c]);
    }
}

/* Ambient irradiance times F_in as on a front that does not scatter in the lighting; nothing shades it. */
static inline void add_sky(constant material_t *m, const surface_t *s, constant ambient_t *ambient,
                           floatv *sum)
{
    float entered = m->shading_diffuse == DISNEY ? 41.0f / 42.0f : 1.0f;
    for (int c = 0; c < 3; c++)
        sum[c] += entered *
                  (sh_irradiance(ambient, c, s->n, 1.0f, 1.0f) + lobe_irradiance(ambient, c, s->n, 0, 1.0f));
}

kernel void back_lighting(global const float *albedo, global const float *back_albedo,
                          global const float *back_normal, global const float *back_depth,
                          global const float *depth, global const uint *stencil, global const float *shadow,
                          global const float *shadow_thickness, global const float *metallic,
                          global float *diffuse, constant params_t *p, constant frame_t *f,
                          constant material_t *materials, constant light_t *lights,
                          constant ambient_t *ambient)
{
    int x = RL_W * (int)get_global_id(0), y = (int)get_global_id(1), at = rl_index(f, x, y);
    intv left = rl_as_intv(rl_load_id(stencil, at)), id = left;
    floatv out[3] = {0.0f, 0.0f, 0.0f}, thickness = 0.0f;
    surface_t s;
    s.z = rl_load(back_depth, at);
    left &= s.z > 0.0f;
    if (rl_any(left)) {
        float sign = p->facing == TOWARDS_CAMERA ? -1.0f : 1.0f;
        for (int c = 0; c < 3; c++) {
            s.albedo[c] = rl_load(HAS_back_albedo ? back_albedo : albedo, at + c * f->plane);
            s.n[c] = sign * rl_load(back_normal, at + c * f->plane);
        }
        view_surface(&s, f, x, y);
        thickness = fmax((s.z - rl_load(depth, at)) * dot3(s.n, s.w), 0.0f);
    }
    while (rl_any(left)) {
        uint now = rl_max_id(rl_as_uintv(left));
        constant material_t *m = &materials[now];
        intv mine = id == (int)now;
        floatv sum[3] = {0.0f, 0.0f, 0.0f};
        left &= ~mine;
        if (!m->has_profile || !m->shading_transmission || m->profile_transmission != GATHER)
            continue;
        sum_back_lights(m, &s, f, lights, shadow, shadow_thickness, thickness, at, sum);
        if (ambient->on)
            add_sky(m, &s, ambient, sum);
        floatv metal = HAS_metallic ? rl_load(metallic, at) : (floatv)0.0f;
        if (m->material_metallic >= 0.0f)
            metal = m->material_metallic;
        floatv scale = (1.0f / RL_PI) * (1.0f - metal);
        if (m->shading_exit_transmission == EXIT_IN_LIGHTING)
            scale *= transmit(m->shading_diffuse, s.nv);
        for (int c = 0; c < 3; c++) {
            floatv entered = sum[c] * scale * (m->profile_texturing == PRE_POST ? sqrt(s.albedo[c]) : 1.0f);
            out[c] = rl_select(out[c], entered, mine & (s.z > 0.0f));
        }
    }
    for (int c = 0; c < 3; c++)
        RL_STORE(diffuse, c, x, y, out[c]);
}
