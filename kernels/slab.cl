/* Light through a slab. Behind surface.cl, in front of lighting.cl. */

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
