/* color = lit + diffuse exit(albedo) F_out (DESIGN 4.1), the end of every subsurface filter without the filter. */

static inline floatv exit_transmission(floatv c)
{
    floatv a = fmax(1.0f - fabs(c), 0.0f), a2 = a * a;
    return fma(-0.5f * a2 * a2, a, 1.0f); /* F_dt, Golubev 2018 */
}

/* n.v, the normal in world space, the ray through the pixel's sample. */
static inline floatv normal_view(constant frame_t *f, global const float *normal, int x, int y)
{
    constant float *m = f->camera.to_world;
    int at = rl_index(f, x, y);
    floatv rx = rl_ray_x(f, &f->camera, rl_to_floatv(RL_LANES + x)), nw = 0.0f, ww = 0.0f;
    float ry = rl_ray_y(f, &f->camera, (float)y);
    for (int i = 0; i < 3; i++) {
        floatv w = fma(rx, m[4 * i], m[4 * i + 1] * ry - m[4 * i + 2]);
        nw = fma(rl_load(normal, at + i * f->plane), w, nw);
        ww = fma(w, w, ww);
    }
    return -nw * rsqrt(ww);
}

#define COMBINE_PORTS                                                                                        \
    global const float *diffuse, global const float *lit, global const float *albedo,                        \
        global const float *normal, global const float *depth, global const uint *stencil,                   \
        global float *color, ENERGY_PORT constant frame_t *f, constant material_t *materials

kernel void combine(COMBINE_PORTS)
{
    int x = RL_W * (int)get_global_id(0), y = (int)get_global_id(1), at = rl_index(f, x, y);
    uintv id = rl_load_id(stencil, at);
    uint now = rl_max_id(id);
    floatv out[3];
    for (int c = 0; c < 3; c++)
        out[c] = rl_load(lit, at + c * f->plane);
    while (now) {
        constant material_t *m = &materials[now];
        intv mask = id == now;
        id = select(id, (uintv)0, mask);
        now = rl_max_id(id);
        if (!m->has_profile)
            continue;
        floatv f_out = 1.0f;
        if (m->shading_diffuse == 0 && m->shading_exit_transmission == 0) /* disney, sss */
            f_out = exit_transmission(normal_view(f, normal, x, y));
        for (int c = 0; c < 3; c++) {
            floatv a = rl_load(albedo, at + c * f->plane);
            floatv leaves = m->profile_texturing == 0 ? a : sqrt(a); /* post; pre_post */
            floatv d = rl_load(diffuse, at + c * f->plane) * leaves * f_out;
            out[c] += rl_select(0.0f, d, mask);
        }
    }
    for (int c = 0; c < 3; c++)
        RL_STORE(color, c, x, y, out[c]);
}

#if WANTS_energy
kernel void combine_energy(COMBINE_PORTS)
{
    band_t band = energy_band(energy, f);
    ENERGY_EACH_VECTOR(f, band, x, y)
    {
        int at = rl_index(f, x, y);
        uintv id = rl_load_id(stencil, at) & rl_as_uintv(rl_insidev(f, x, y));
        for (uint now = rl_max_id(id); now; now = rl_max_id(id)) {
            constant material_t *m = &materials[now];
            intv mask = id == now;
            id = select(id, (uintv)0, mask);
            if (!m->has_profile)
                continue;
            floatv f_out = 1.0f, values[ENERGY_PIXELS];
            energy_clear(values);
            if (m->shading_diffuse == 0 && m->shading_exit_transmission == 0) /* disney, sss */
                f_out = exit_transmission(normal_view(f, normal, x, y));
            for (int c = 0; c < 3; c++) {
                floatv a = rl_load(albedo, at + c * f->plane);
                floatv leaves = m->profile_texturing == 0 ? a : sqrt(a); /* post; pre_post */
                values[ENERGY_IN + c] = rl_load(diffuse, at + c * f->plane) * leaves * f_out;
                values[ENERGY_OUT + c] = RL_LOAD(color, c, x, y) - rl_load(lit, at + c * f->plane);
            }
            energy_post(&band, now, mask, values);
        }
    }
}
#endif
