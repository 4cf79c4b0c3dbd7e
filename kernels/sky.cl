/* The sky's mirror images. Behind ltc.cl, in front of lighting.cl. */

#if LIGHTS_SKY
/* Bilinear in one image: x and y from -1 to 1. */
static inline float4 sky_texel(global const float *image, int side, float x, float y)
{
    float u = (x * 0.5f + 0.5f) * (float)side + 0.5f, v = (y * 0.5f + 0.5f) * (float)side + 0.5f;
    int i = clamp((int)u, 0, side), j = clamp((int)v, 0, side), row = side + 2;
    global const float *at = image + 4 * (j * row + i);
    float4 above = mix(vload4(0, at), vload4(1, at), u - (float)i);
    return mix(above, mix(vload4(row, at), vload4(row + 1, at), u - (float)i), v - (float)j);
}

/* What comes from around a direction, for a roughness; between two of the images. */
static inline void sky_at(constant ambient_t *a, global const float *sky, const floatv *d, floatv roughness, floatv *out)
{
    floatv sum = 1.0f / fmax(fabs(d[0]) + fabs(d[1]) + fabs(d[2]), 1e-12f), px = d[0] * sum, py = d[1] * sum;
    intv below = d[2] < 0.0f;
    float x[RL_W], y[RL_W], level[RL_W], c[3][RL_W];
    rl_vstore(rl_select(px, copysign(1.0f - fabs(py), px), below), 0, x);
    rl_vstore(rl_select(py, copysign(1.0f - fabs(px), py), below), 0, y);
    rl_vstore(clamp(roughness, 0.0f, 1.0f) * (float)(a->sky_levels - 1), 0, level);
    for (int i = 0; i < RL_W; i++) {
        int l = min((int)level[i], a->sky_levels - 2);
        float4 v = mix(sky_texel(sky + a->sky_at[l], a->sky_side[l], x[i], y[i]),
                       sky_texel(sky + a->sky_at[l + 1], a->sky_side[l + 1], x[i], y[i]), level[i] - (float)l);
        c[0][i] = v.x;
        c[1][i] = v.y;
        c[2][i] = v.z;
    }
    for (int k = 0; k < 3; k++)
        out[k] = rl_vload(0, c[k]);
}

/* Karis 2013: the mean radiance around the lobe's direction times its albedo. The direction is that of the transformed cosine,
 * which leaves the mirror's where surfaces are rough. Errors: tests/test_sky.c. */
static inline void add_sky(const surface_t *s, constant ambient_t *a, global const float *sky, const ltc_t *t, floatv *specular)
{
    floatv r[3], light[3], inverse = rsqrt(fma(t->m[0], t->m[0], t->m[1] * t->m[1]));
    for (int i = 0; i < 3; i++)
        r[i] = fma(t->m[0], s->n[i], -t->m[1] * t->across[i]) * inverse;
    sky_at(a, sky, r, s->roughness, light);
    for (int c = 0; c < 3; c++) {
        floatv f0 = mix(s->specular, s->albedo[c], s->metallic);
        specular[c] = fma(light[c], fma(f0, t->albedo, (1.0f - f0) * t->fresnel), specular[c]);
    }
}
#endif
