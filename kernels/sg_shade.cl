/* What a material with shading.diffuse: sg makes of its light, and of the sky's. Behind sg.cl and surface.cl. */

/* Whether light scatters on its way in, as spherical Gaussians; the graph's check saw to it that curvature is there. */
static inline int scatters(constant material_t *m)
{
    return HAS_curvature && m->has_profile && m->shading_diffuse == SG;
}

/* The level of detail of the other models (Golubev 2018; DESIGN 4.2): no scattering where the radius within which
 * 0.997 of Burley's light of that variance comes out, 16.5644 sqrt(v/7), is under half a pixel, blended over a tenth
 * around it. From afar all models are the unfiltered surface, and so is this one; without it a light stays blurred by
 * its Gaussian however small that is on screen: up to 1.2 % near the terminator. */
static inline floatv scatter_blurred(float variance_mm2, floatv pixel_mm)
{
    floatv rho = 6.26075f * sqrt(variance_mm2) / pixel_mm;
    return clamp((rho - 0.45f) * 10.0f, 0.0f, 1.0f);
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
        s->blurred[c] = scatter_blurred(v, pixel);
        for (int i = 0; i < 3; i++)
            s->bent[c][i] = s->n[i];
        if (!HAS_smooth_normal)
            continue;
        floatv keep = 1.0f - s->blurred[c] * (v / (u + v));
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
            floatv band1 = sg_band1(s->sharpness[c]), band2 = sg_band2(s->sharpness[c], band1);
            a1 = mix((floatv)1.0f, band1, s->blurred[c]);
            a2 = mix((floatv)1.0f, band2, s->blurred[c]);
        }
        sum[c] += entered * (sh_irradiance(ambient, c, n, a1, a2) + lobe_irradiance(ambient, c, n, scattered, a1));
    }
}
