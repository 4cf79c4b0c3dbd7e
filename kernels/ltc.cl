/* GGX as a linearly transformed cosine (Heitz et al. 2016; passes/ltc_table.h), and light from polygons under it. Behind
 * surface.cl, in front of area.cl and sky.cl. */

/* ---- the table -------------------------------------------------------------------------------------------- */

/* A pixel's lobe: the frame (view's part across the normal, across both, normal), M^-1 in it, the albedo. */
typedef struct ltc_t {
    floatv across[3], third[3];
    floatv m[4]; /* M^-1 = (m0 0 m1; 0 1 0; m2 0 m3) */
    floatv albedo, fresnel, share;
} ltc_t;

/* Bilinear in roughness and sqrt(1 - n.v). */
static inline void ltc_values(ltc_t *t, constant const float *table, floatv roughness, floatv nv)
{
    float row[RL_W], column[RL_W], v[RL_LTC_VALUES][RL_W];
    rl_vstore(clamp(roughness, 0.0f, 1.0f) * (float)(RL_LTC_SIDE - 1), 0, row);
    rl_vstore(sqrt(clamp(1.0f - nv, 0.0f, 1.0f)) * (float)(RL_LTC_SIDE - 1), 0, column);
    for (int i = 0; i < RL_W; i++) {
        int r = min((int)row[i], RL_LTC_SIDE - 2), c = min((int)column[i], RL_LTC_SIDE - 2);
        constant const float *at = table + (r * RL_LTC_SIDE + c) * RL_LTC_VALUES, *below = at + RL_LTC_SIDE * RL_LTC_VALUES;
        float8 a = mix(vload8(0, at), vload8(1, at), column[i] - (float)c);
        float8 b = mix(vload8(0, below), vload8(1, below), column[i] - (float)c);
        float values[RL_LTC_VALUES];
        vstore8(mix(a, b, row[i] - (float)r), 0, values);
        for (int k = 0; k < RL_LTC_VALUES; k++)
            v[k][i] = values[k];
    }
    floatv alpha = fmax(roughness * roughness, ALPHA_MIN);
    t->m[0] = rl_vload(0, v[0]);
    t->m[1] = rl_vload(0, v[1]);
    t->m[2] = rl_vload(0, v[2]) * alpha;
    t->m[3] = rl_vload(0, v[3]) * alpha;
    t->albedo = rl_vload(0, v[4]);
    t->fresnel = rl_vload(0, v[5]);
    t->share = rl_vload(0, v[6]);
}

/* The frame; where the view is along the normal any will do. */
static inline void ltc_frame(ltc_t *t, const surface_t *s)
{
    floatv along = dot3(s->v, s->n), length = 0.0f, other[3];
    intv steep = fabs(s->n[0]) > 0.5f;
    other[0] = rl_select(1.0f, 0.0f, steep);
    other[1] = rl_select(0.0f, 1.0f, steep);
    other[2] = 0.0f;
    floatv off = dot3(other, s->n);
    for (int i = 0; i < 3; i++)
        t->across[i] = fma(-along, s->n[i], s->v[i]);
    intv along_view = dot3(t->across, t->across) < 1e-8f;
    for (int i = 0; i < 3; i++)
        t->across[i] = rl_select(t->across[i], fma(-off, s->n[i], other[i]), along_view);
    length = rsqrt(fmax(dot3(t->across, t->across), 1e-12f));
    for (int i = 0; i < 3; i++)
        t->across[i] *= length;
    for (int i = 0; i < 3; i++)
        t->third[i] = s->n[(i + 1) % 3] * t->across[(i + 2) % 3] - s->n[(i + 2) % 3] * t->across[(i + 1) % 3];
}

#if LIGHTS_AREA

/* ---- polygons --------------------------------------------------------------------------------------------- */

/* A light in a pixel's frame, metres or any other length: its middle and two half axes; corners at c + p u + q v. */
typedef struct patch_t {
    floatv c[3], u[3], v[3];
    int corners;
} patch_t;

enum { RECT_CORNERS = 4, DISK_CORNERS = 16 };
constant float rect_corner[2 * (RECT_CORNERS + 1)] = {-1, -1, 1, -1, 1, 1, -1, 1, -1, -1};
/* A circle's area, pi: radius sqrt(2 pi / (n sin(2 pi / n))), n = 16. */
#define DISK_A 1.01300156f
#define DISK_B 0.93589140f
#define DISK_C 0.71630027f
#define DISK_D 0.38765891f
constant float disk_corner[2 * (DISK_CORNERS + 1)] = {
    DISK_A,  0,       DISK_B,  DISK_D,  DISK_C,  DISK_C,  DISK_D,  DISK_B,  0,       DISK_A,  -DISK_D, DISK_B,
    -DISK_C, DISK_C,  -DISK_B, DISK_D,  -DISK_A, 0,       -DISK_B, -DISK_D, -DISK_C, -DISK_C, -DISK_D, -DISK_B,
    0,       -DISK_A, DISK_D,  -DISK_B, DISK_C,  -DISK_C, DISK_B,  -DISK_D, DISK_A,  0};

/* An edge: both ends and what is between them, which would cancel in their difference. An end is computed as the next edge's
 * beginning is, so that both are the same bits and fall on the same side of a plane. */
typedef struct edge_t {
    floatv a[3], b[3], run[3];
} edge_t;

static inline void corner_edge(const patch_t *p, int i, float face, edge_t *e)
{
    constant const float *at = (p->corners == RECT_CORNERS ? rect_corner : disk_corner) + 2 * i;
    for (int k = 0; k < 3; k++) {
        float sign = k == 2 ? face : 1.0f;
        e->a[k] = sign * fma(at[0], p->u[k], fma(at[1], p->v[k], p->c[k]));
        e->b[k] = sign * fma(at[2], p->u[k], fma(at[3], p->v[k], p->c[k]));
        e->run[k] = sign * fma(at[2] - at[0], p->u[k], (at[3] - at[1]) * p->v[k]);
    }
}

/* Where a polygon goes below z = 0, and where it comes back. */
typedef struct horizon_t {
    floatv down[3], up[3];
} horizon_t;

static inline void clear_horizon(horizon_t *h)
{
    for (int i = 0; i < 3; i++)
        h->down[i] = h->up[i] = 0.0f;
}

/* Leaves of an edge what is above z = 0; of one below a point, which crosses nothing else. */
static inline void above(edge_t *e, horizon_t *h)
{
    intv out = e->a[2] < 0.0f, end = e->b[2] < 0.0f, crosses = out ^ end;
    floatv at = clamp(e->a[2] / rl_select(1.0f, e->a[2] - e->b[2], crosses), 0.0f, 1.0f);
    floatv part = rl_select(rl_select(1.0f, 0.0f, out & end), rl_select(at, 1.0f - at, out), crosses);
    for (int i = 0; i < 3; i++) {
        floatv place = i == 2 ? (floatv)0.0f : fma(at, e->run[i], e->a[i]);
        h->up[i] = rl_select(h->up[i], place, crosses & out);
        h->down[i] = rl_select(h->down[i], place, crosses & end);
        e->a[i] = rl_select(e->a[i], place, crosses & out);
        e->b[i] = rl_select(rl_select(e->b[i], place, crosses & end), e->a[i], out & end);
        e->run[i] *= part;
    }
}

/* The edge that closes it along the horizon; without length where nothing crossed. */
static inline void closing(const horizon_t *h, edge_t *e)
{
    intv crossed = (dot3(h->down, h->down) > 0.0f) & (dot3(h->up, h->up) > 0.0f);
    for (int i = 0; i < 3; i++) {
        e->a[i] = h->down[i];
        e->b[i] = h->up[i];
        e->run[i] = rl_select(0.0f, h->up[i] - h->down[i], crossed);
    }
}

/* M^-1 = (m0 0 m1; 0 1 0; m2 0 m3) */
static inline void bend(const floatv *m, floatv *v)
{
    floatv x = v[0];
    v[0] = fma(m[0], x, m[1] * v[2]);
    v[2] = fma(m[2], x, m[3] * v[2]);
}

/* acos(x) / sqrt(1 - x^2) for x = cos of an angle whose sine is given; relative error 1e-6. */
static inline floatv angle_over_sine(floatv x, floatv sine)
{
    floatv z = fmax(1.0f - fabs(x), 0.0f), p = 0.0273540326f;
    p = fma(p, z, -0.0529885922f);
    p = fma(p, z, 0.0709678831f);
    p = fma(p, z, -0.00589297864f);
    p = fma(p, z, 0.0657780209f);
    p = fma(p, z, 0.132187281f);
    p = fma(p, z, 0.3333905f);
    p = fma(p, z, 0.999999536f);
    return rl_select(p, RL_PI / fmax(sine, 1e-6f) - p, x < 0.0f);
}

/* An edge's part of twice the polygon's vector irradiance: its angle along the normal of its plane through the origin. */
static inline void edge_vector(const edge_t *e, floatv *out)
{
    floatv normal[3];
    for (int i = 0; i < 3; i++)
        normal[i] = e->a[(i + 1) % 3] * e->run[(i + 2) % 3] - e->a[(i + 2) % 3] * e->run[(i + 1) % 3];
    floatv inverse = rsqrt(fmax(dot3(e->a, e->a), 1e-18f)) * rsqrt(fmax(dot3(e->b, e->b), 1e-18f));
    floatv g = angle_over_sine(dot3(e->a, e->b) * inverse, sqrt(dot3(normal, normal)) * inverse) * inverse;
    for (int i = 0; i < 3; i++)
        out[i] = normal[i] * g;
}

/* Corners run clockwise as the surface sees the side that shines. */
static inline floatv sided(floatv sum, int two_sided)
{
    return 0.5f * (two_sided ? fabs(sum) : fmax(-sum, 0.0f));
}

/* Twice the vector irradiance under a transformed cosine of what is above the surface and above the cosine's own horizon, seen
 * from the side where z has the sign of `face`; its z is twice pi times the cosine's integral. */
static inline void polygon_sum(const patch_t *p, const floatv *m, float face, floatv *sum)
{
    floatv v[3];
    edge_t e;
    horizon_t h, inner;
    clear_horizon(&h);
    clear_horizon(&inner);
    sum[0] = sum[1] = sum[2] = 0.0f;
    for (int i = 0; i < p->corners + 2; i++) {
        if (i < p->corners) {
            corner_edge(p, i, face, &e);
            above(&e, &h);
        } else {
            closing(i == p->corners ? &h : &inner, &e);
        }
        if (i <= p->corners) {
            bend(m, e.a);
            bend(m, e.b);
            bend(m, e.run);
            above(&e, &inner);
        }
        edge_vector(&e, v);
        for (int k = 0; k < 3; k++)
            sum[k] = fma(face, v[k], sum[k]);
    }
}

/* Irradiance of a rect for a radiance of 1, from its middle: within 1e-5 of it where half axes are 1/300 of the distance. */
static inline floatv far_irradiance(const patch_t *p, float face, int two_sided)
{
    floatv inverse2 = 1.0f / fmax(dot3(p->c, p->c), 1e-18f);
    floatv facing = p->c[0] * (p->u[1] * p->v[2] - p->u[2] * p->v[1]) + p->c[1] * (p->u[2] * p->v[0] - p->u[0] * p->v[2]) +
                    p->c[2] * (p->u[0] * p->v[1] - p->u[1] * p->v[0]);
    return sided(8.0f * facing * fmax(face * p->c[2], 0.0f) * inverse2 * inverse2, two_sided);
}

/* Of a sphere whose middle is at n.l and which covers sin^2 of its half angle. */
static inline floatv sphere_irradiance(floatv nl, floatv sine2)
{
    floatv c = clamp(nl, -1.0f, 1.0f), s2 = fmax(1.0f - c * c, 1e-12f);
    floatv x = sqrt(fmax(1.0f / sine2 - 1.0f, 1e-12f)); /* cot of the half angle */
    floatv y = clamp(-x * c * rsqrt(s2), -1.0f, 1.0f), q = sqrt(s2 * fmax(1.0f - y * y, 0.0f)) / x, q2 = q * q;
    /* atan q - q, which cancels */
    floatv series = q * q2 * (-1.0f / 3 + q2 * (1.0f / 5 + q2 * (-1.0f / 7 + q2 * (1.0f / 9 - q2 * (1.0f / 11)))));
    floatv rest = rl_select(atan(q) - q, series, q < 0.3f);
    floatv part = fma(sine2, fma(c, acos(y), q), rest);
    return fmax(rl_select(part, RL_PI * sine2 * fmax(c, 0.0f), c * c > sine2), 0.0f);
}

/* Half axes over distance, squared, where a matrix takes the light: how large it is for a lobe. */
static inline floatv patch_size(const patch_t *p, const floatv *m)
{
    floatv sum[3];
    for (int k = 0; k < 3; k++) {
        floatv v[3];
        for (int i = 0; i < 3; i++)
            v[i] = k == 0 ? p->c[i] : k == 1 ? p->u[i] : p->v[i];
        bend(m, v);
        sum[k] = dot3(v, v);
    }
    return (sum[1] + sum[2]) / fmax(sum[0], 1e-18f);
}
#endif
