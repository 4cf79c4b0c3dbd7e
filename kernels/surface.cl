/* A pixel's surface and a light's ray to it. Everything is in world space and metres; `w` is the camera's ray per metre of depth, so the
 * point is P = C + z w and what matters, n.(L - P) = n.(L - C) - z n.w, needs n.w once a pixel. Near the terminator that
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
enum { OPAQUE, THIN, THICK, BEER_LAMBERT, GATHER }; /* GATHER: not in the lighting */
enum { FROM_MAX, FROM_LAYER, FROM_SHADOW };

/* Below this alpha a highlight of a light without size would be narrower than a pixel's worth of normals. */
#define ALPHA_MIN 1e-3f

typedef struct surface_t {
    floatv n[3], w[3], v[3]; /* shading normal; ray per metre of depth; towards the camera, unit */
    widev wide_n[3], nw;     /* the normal again; z n.w */
    floatv z, nv;            /* depth; n.v */
    intv here;               /* lanes of the material that is shaded */
    floatv albedo[3], thickness, roughness, specular, metallic;
    floatv radius;           /* of curvature, metres; at most 1e6 */
    floatv bent[3][3];       /* the normal that each channel's scattering sees */
    sg_t sg[3];              /* of a material with SG, and the sharpness */
    floatv sharpness[3], blurred[3]; /* blurred: how far scattering counts, 0 where it is under a pixel */
} surface_t;

typedef struct ray_t {
    floatv l[3], nl, falloff; /* towards the light, unit; n.l; 1/d^2 and cone; of area lights' middle */
    floatv inverse;           /* 1/d; not of directional lights */
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
    RL_UNROLL
    for (int i = 0; i < 3; i++) {
        widev w = rx * c->to_world[4 * i] + (ry * c->to_world[4 * i + 1] - c->to_world[4 * i + 2]);
        s->wide_n[i] = to_widev(s->n[i]);
        s->w[i] = to_narrow(w);
        nw = s->wide_n[i] * w + nw;
    }
    s->nw = nw * to_widev(s->z);
    floatv inverse = rsqrt(dot3(s->w, s->w));
    RL_UNROLL
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
        RL_UNROLL
        for (int i = 0; i < 3; i++) {
            r->l[i] = -light->direction[i];
            nl = s->wide_n[i] * -(widest)light->direction[i] + nl;
        }
        r->nl = to_narrow(nl);
        r->falloff = 1.0f;
        return;
    }
    nl = -s->nw;
    RL_UNROLL
    for (int i = 0; i < 3; i++) {
        widest from_camera = (widest)light->position[i] - c->to_world[4 * i + 3];
        r->l[i] = fma(-s->z, s->w[i], (floatv)(float)from_camera);
        nl = s->wide_n[i] * from_camera + nl;
    }
    floatv inverse = rsqrt(fmax(dot3(r->l, r->l), 1e-12f)); /* a light on the surface stays finite */
    RL_UNROLL
    for (int i = 0; i < 3; i++)
        r->l[i] *= inverse;
    r->nl = to_narrow(nl) * inverse;
    r->inverse = inverse;
    r->falloff = inverse * inverse;
    if (light->type == LIGHT_SPOT)
        r->falloff *= cone(light, r->l);
    if (light->type == LIGHT_RECT) { /* seen as a point, from far off */
        floatv c = -fma(r->l[0], light->direction[0], fma(r->l[1], light->direction[1], r->l[2] * light->direction[2]));
        r->falloff *= light->two_sided ? fabs(c) : fmax(c, 0.0f);
    }
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
