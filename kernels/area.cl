/* Spheres and rectangles that shine evenly. Behind ltc.cl and sg_shade.cl, in front of lighting.cl.
 *
 * Diffuse: the exact irradiance above the horizon, of a sphere by Snyder 1996, of a polygon by Lambert's sum over edges
 * (Baum et al. 1989). Specular: GGX as a linearly transformed cosine (Heitz et al. 2016; passes/ltc_table.h), whose
 * integral over a polygon is that of the cosine over the transformed one; a sphere is the disk that it shows, as a polygon
 * of 16 edges and the same area (Heitz and Hill 2017 have an ellipse there). Light that seems small to the lobe is taken
 * from its middle with the lobe itself, so that far off it is a point light's.
 *
 * Errors against integrals over the light in double (tests/test_area_lights.c): Lambert 1e-4 of the light's own when it
 * faces the surface; F_in of Disney's diffuse, a mean over 7 or 9 points, 0.01; GGX 0.06 of the brightest reflection, 0.01
 * on average. At 10 cm from a panel of 80 x 60 cm the last two are 0.09 and 0.12. Visibility is that of the light's middle. */

#if LIGHTS_AREA

/* ---- the light -------------------------------------------------------------------------------------------- */

static inline void to_frame(const floatv *world, const surface_t *s, const ltc_t *t, floatv *out)
{
    out[0] = dot3(world, t->across);
    out[1] = dot3(world, t->third);
    out[2] = dot3(world, s->n);
}

/* sin^2 of the half angle of a sphere; a surface inside sees half of everything, one on it too. */
static inline floatv sphere_sine2(constant light_t *light, const ray_t *r)
{
    return fmin(light->radius * light->radius * r->inverse * r->inverse, 0.9999f);
}

/* A rect in metres, a sphere as the disk that it shows, at a distance of 1. */
static inline void make_patch(patch_t *p, constant light_t *light, const surface_t *s, const ray_t *r, const ltc_t *t)
{
    floatv u[3], v[3], c[3];
    if (light->type == LIGHT_RECT) {
        floatv distance = 1.0f / r->inverse;
        p->corners = RECT_CORNERS;
        for (int i = 0; i < 3; i++) {
            u[i] = light->side[i];
            v[i] = light->top[i];
            c[i] = r->l[i] * distance;
        }
        to_frame(c, s, t, p->c);
        p->c[2] = r->nl * distance;
    } else {
        floatv sine2 = sphere_sine2(light, r), sine = sqrt(sine2), cosine = sqrt(1.0f - sine2);
        intv steep = fabs(r->l[0]) > 0.5f;
        floatv other[3] = {rl_select(1.0f, 0.0f, steep), rl_select(0.0f, 1.0f, steep), 0.0f};
        floatv off = dot3(other, r->l), length = sine * rsqrt(1.0f - off * off);
        p->corners = DISK_CORNERS;
        for (int i = 0; i < 3; i++) {
            u[i] = fma(-off, r->l[i], other[i]) * length;
            c[i] = r->l[i] * cosine;
        }
        for (int i = 0; i < 3; i++) /* u x v along -l: clockwise, as of a rect that faces the surface */
            v[i] = u[(i + 1) % 3] * r->l[(i + 2) % 3] - u[(i + 2) % 3] * r->l[(i + 1) % 3];
        to_frame(c, s, t, p->c);
        p->c[2] = r->nl * cosine;
    }
    to_frame(u, s, t, p->u);
    to_frame(v, s, t, p->v);
}

/* Points on the light and weights: Gauss's 3 x 3 on a rect, seven of degree 5 on a disk. */
constant float rect_points[27] = {0, 0, 64, 0.77459667f, 0, 40, -0.77459667f, 0, 40, 0, 0.77459667f, 40, 0, -0.77459667f, 40,
                                  0.77459667f, 0.77459667f, 25, -0.77459667f, 0.77459667f, 25,
                                  0.77459667f, -0.77459667f, 25, -0.77459667f, -0.77459667f, 25};
constant float disk_points[21] = {0, 0, 2, 0.81649658f, 0, 1, -0.81649658f, 0, 1, 0.40824829f, 0.70710678f, 1,
                                  -0.40824829f, 0.70710678f, 1, 0.40824829f, -0.70710678f, 1, -0.40824829f, -0.70710678f, 1};

/* Means over the irradiance from those points on one face: of F_in, and of the cosine; those of a grazing ray where none
 * shines. */
static inline void entry_means(const patch_t *p, int diffuse, float face, int two_sided, floatv *entered, floatv *cosine)
{
    int n = p->corners == RECT_CORNERS ? 9 : 7;
    constant const float *at = n == 9 ? rect_points : disk_points;
    floatv sum = 0.0f, f = 0.0f, c2 = 0.0f, normal[3];
    for (int i = 0; i < 3; i++)
        normal[i] = p->u[(i + 1) % 3] * p->v[(i + 2) % 3] - p->u[(i + 2) % 3] * p->v[(i + 1) % 3];
    for (int i = 0; i < n; i++, at += 3) {
        floatv x[3];
        for (int k = 0; k < 3; k++)
            x[k] = fma(at[0], p->u[k], fma(at[1], p->v[k], p->c[k]));
        floatv inverse = rsqrt(fmax(dot3(x, x), 1e-18f)), c = fmax(face * x[2] * inverse, 0.0f), from = dot3(x, normal);
        floatv w = at[2] * c * inverse * inverse * inverse * (two_sided ? fabs(from) : fmax(-from, 0.0f));
        sum += w;
        f = fma(w, transmit(diffuse, c), f);
        c2 = fma(w, c, c2);
    }
    *entered = rl_select(transmit(diffuse, 0.0f), f / sum, sum > 0.0f);
    *cosine = rl_select(0.0f, c2 / sum, sum > 0.0f);
}

/* What the light is as a lobe, for spherical Gaussians: its direction, the mean cosine around it, its solid angle. */
typedef struct cone_t {
    floatv axis[3], band1, solid;
} cone_t;

/* tan(solid / 2) of a triangle, Van Oosterom and Strackee 1983. */
static inline floatv triangle_solid(const floatv *a, const floatv *b, const floatv *c)
{
    floatv la = sqrt(dot3(a, a)), lb = sqrt(dot3(b, b)), lc = sqrt(dot3(c, c));
    floatv det = a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
    return 2.0f * atan2(det, la * lb * lc + dot3(a, b) * lc + dot3(b, c) * la + dot3(c, a) * lb);
}

static inline void make_cone(cone_t *k, const patch_t *p, constant light_t *light, const surface_t *s, const ray_t *r,
                             const ltc_t *t)
{
    floatv sum[3] = {0.0f, 0.0f, 0.0f}, part[3];
    edge_t e[4];
    if (light->type == LIGHT_SPHERE) {
        floatv cosine = sqrt(1.0f - sphere_sine2(light, r));
        k->band1 = 0.5f * (1.0f + cosine);
        k->solid = 2.0f * RL_PI * sphere_sine2(light, r) / (1.0f + cosine);
        for (int i = 0; i < 3; i++)
            k->axis[i] = r->l[i];
        return;
    }
    for (int i = 0; i < 4; i++) {
        corner_edge(p, i, 1.0f, &e[i]);
        edge_vector(&e[i], part);
        for (int c = 0; c < 3; c++)
            sum[c] -= 0.5f * part[c];
    }
    floatv solid = -(triangle_solid(e[0].a, e[1].a, e[2].a) + triangle_solid(e[0].a, e[2].a, e[3].a));
    floatv length = sqrt(dot3(sum, sum)), sign = light->two_sided ? copysign((floatv)1.0f, solid) : (floatv)1.0f;
    k->solid = fmax(solid * sign, 0.0f);
    k->band1 = clamp(length / fmax(k->solid, 1e-18f), 0.0f, 0.99995f);
    for (int i = 0; i < 3; i++)
        k->axis[i] = (sum[0] * t->across[i] + sum[1] * t->third[i] + sum[2] * s->n[i]) * sign / fmax(length, 1e-18f);
}

/* (1 - v.h)^5 for the middle of what the light meets of the lobe, a direction under the transformed cosine. */
static inline floatv middle_fresnel(const floatv *bent, const surface_t *s, const ltc_t *t)
{
    const floatv *m = t->m;
    floatv inverse = 1.0f / (m[0] * m[3] - m[1] * m[2]);
    floatv l[3] = {(m[3] * bent[0] - m[1] * bent[2]) * inverse, bent[1], (m[0] * bent[2] - m[2] * bent[0]) * inverse};
    floatv vl = (dot3(s->v, t->across) * l[0] + s->nv * l[2]) * rsqrt(fmax(dot3(l, l), 1e-18f));
    floatv f = 1.0f - sqrt(clamp(fma(0.5f, vl, 0.5f), 0.0f, 1.0f)), f2 = f * f; /* v.h = cos of half the angle */
    return f2 * f2 * f;
}

/* Irradiance on the front, what of the lobe's albedo the light meets, irradiance on the back: for a radiance of 1; and the
 * Fresnel factor of that part of the lobe. One loop, since programs take long to compile where it is written out. */
enum { FRONT, LOBE, BACK, FACES };
static inline floatv area_sums(const patch_t *p, const surface_t *s, constant light_t *light, const ray_t *r, const ltc_t *t,
                               int shines, int transmits, floatv *out)
{
    int sphere = light->type == LIGHT_SPHERE, both = sphere || light->two_sided, faces = transmits ? FACES : BACK;
    floatv fresnel = 0.0f;
    for (int i = 0; i < faces; i++) {
        float face = i == BACK ? -1.0f : 1.0f;
        floatv m[4] = {1.0f, 0.0f, 0.0f, 1.0f}, sum[3];
        for (int k = 0; k < 4 && i == LOBE; k++)
            m[k] = t->m[k];
        if (i == LOBE ? !shines : sphere) {
            out[i] = sphere ? sphere_irradiance(face * r->nl, sphere_sine2(light, r)) : (floatv)0.0f;
            continue;
        }
        polygon_sum(p, m, face, sum);
        out[i] = sided(sum[2], both);
        if (i == LOBE) {
            floatv sign = copysign((floatv)1.0f, sum[2]), met = clamp(out[i] * t->share * (1.0f / RL_PI), 0.0f, 1.0f);
            for (int k = 0; k < 3; k++)
                sum[k] *= sign;
            fresnel = mix(middle_fresnel(sum, s, t), t->fresnel / t->albedo, met * met);
            out[i] = met;
        } else {
            out[i] = rl_select(out[i], far_irradiance(p, face, both), patch_size(p, m) < 1e-5f);
        }
    }
    return fresnel;
}

/* Solid angle of a light that is far for its size. */
static inline floatv small_solid(const patch_t *p)
{
    floatv facing = 0.0f, inverse = rsqrt(fmax(dot3(p->c, p->c), 1e-18f));
    for (int i = 0; i < 3; i++)
        facing += p->c[i] * (p->u[(i + 1) % 3] * p->v[(i + 2) % 3] - p->u[(i + 2) % 3] * p->v[(i + 1) % 3]);
    return (p->corners == RECT_CORNERS ? 4.0f : RL_PI) * fabs(facing) * inverse * inverse * inverse;
}

/* Adds what one light sends: E F_in (with what comes through), and the specular radiance. */
static inline void add_area(constant material_t *m, const surface_t *s, constant light_t *light, ray_t *r, const ltc_t *t,
                            int transmits, int scattered, floatv *diffuse, floatv *specular)
{
    patch_t p;
    cone_t k;
    floatv sum[FACES], entered[2] = {1.0f, 1.0f}, back = 0.0f, through_it[3];
    int both = light->type == LIGHT_SPHERE || light->two_sided, shines = m->shading_specular == GGX;
    make_patch(&p, light, s, r, t);
    floatv wide_fresnel = area_sums(&p, s, light, r, t, shines, transmits, sum);
    for (int i = 0; i < 1 + transmits && (transmits || m->shading_diffuse == DISNEY); i++)
        entry_means(&p, m->shading_diffuse, i ? -1.0f : 1.0f, both, &entered[i], &back);
    if (scattered)
        make_cone(&k, &p, light, s, r, t);
    if (transmits)
        through(m, s, r, back, through_it);
    for (int c = 0; c < 3; c++) {
        floatv front = sum[FRONT] * entered[0] * r->visibility;
        if (scattered) {
            sg_t sg = sg_make(sg_convolved(k.band1 * sg_band1(s->sharpness[c])));
            front = mix(front, k.solid * scatter_visibility(s, r) * sg_irradiance(&sg, dot3(s->bent[c], k.axis)), s->blurred[c]);
        }
        if (transmits)
            front = fma(sum[BACK] * entered[1], through_it[c], front);
        diffuse[c] += light->intensity[c] * light->radiance * front;
    }
    if (!shines)
        return;
    floatv size = patch_size(&p, t->m), seen = clamp((size - 1e-3f) * (1.0f / 9e-3f), 0.0f, 1.0f), fresnel;
    ray_t middle = *r; /* of what is above the horizon: the lobe goes as 1/n.l there */
    middle.nl = fmax(r->nl, sum[FRONT] / fmax(small_solid(&p), 1e-30f));
    floatv point = sum[FRONT] * r->visibility * lobe(s, &middle, s->roughness, &fresnel), wide = sum[LOBE] * t->albedo * r->visibility;
    for (int c = 0; c < 3; c++) {
        floatv f0 = mix(s->specular, s->albedo[c], s->metallic);
        floatv small = point * fma(1.0f - f0, fresnel, f0);
        floatv large = wide * fma(1.0f - f0, wide_fresnel, f0);
        specular[c] += light->intensity[c] * light->radiance * mix(small, large, seen);
    }
}
#endif
