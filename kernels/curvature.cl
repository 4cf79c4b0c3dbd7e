/* Curvature from normals and depth. A surface turns its normal by dn = S dp when one walks dp along it; S is fitted to the
 * pixel's neighbours by least squares in the tangent plane, and half its trace is the mean curvature. On spheres, cylinders
 * and planes dn = S dp holds for chords of any length, so those are exact whatever the window; elsewhere the result is an
 * average over it. */

/* A neighbour counts when it is of the same material, its normal less than 90 degrees off, and the chord to it at most 30 degrees off
 * the mean of the two tangent planes. On a sphere every chord is parallel to that mean; a step in depth is not. */
#define CHORD_SINE 0.5f

/* Where all neighbours lie in one line, the fit knows the curvature along it only: this share of the trace decides what a line is. */
#define RIDGE 1e-5f

typedef struct fit_t {
    floatv n[3], t[3], b[3];     /* normal, tangents */
    floatv z, rx, per_radius;    /* depth; ray; 1/radius of the window, 1/m */
    float ry;
    floatv pp[3], np11, np, np22; /* sums of dp dp^T (11, 12, 22) and of dn dp^T (12 and 21 together) */
    floatv sum[3];               /* of normals */
} fit_t;

static inline floatv dot3(const floatv *a, const floatv *b)
{
    return fma(a[0], b[0], fma(a[1], b[1], a[2] * b[2]));
}

/* Tangents to a unit normal without a branch (Duff et al. 2017). */
static inline void make_frame(fit_t *s)
{
    floatv sign = copysign((floatv)1.0f, s->n[2]);
    floatv a = -1.0f / (sign + s->n[2]), c = s->n[0] * s->n[1] * a;
    s->t[0] = fma(sign * s->n[0], s->n[0] * a, 1.0f);
    s->t[1] = sign * c;
    s->t[2] = -sign * s->n[0];
    s->b[0] = c;
    s->b[1] = fma(s->n[1], s->n[1] * a, sign);
    s->b[2] = -s->n[1];
}

static inline void add_neighbour(fit_t *s, constant frame_t *f, global const float *normal, global const float *depth,
                                 global const uint *stencil, uintv id, int x, int y, int dx, int dy)
{
    int at = rl_index(f, x + dx, clamp(y + dy, 0, f->rows - 1));
    floatv there = rl_load(depth, at), n[3], dn[3], mean[3], dp[3];
    intv same = (rl_load_id(stencil, at) == id) & rl_insidev(f, x + dx, y + dy) & (there > 0.0f);
    if (!rl_any(same))
        return;
    for (int i = 0; i < 3; i++) {
        n[i] = rl_load(normal, at + i * f->plane);
        dn[i] = n[i] - s->n[i];
        mean[i] = n[i] + s->n[i];
    }
    /* P' - P = dz ray' + z (ray' - ray), in units of the window's radius */
    float step_x = (float)dx / f->camera.focal[0], step_y = (float)-dy / f->camera.focal[1];
    floatv dz = (there - s->z) * s->per_radius, z = s->z * s->per_radius;
    floatv vx = fma(dz, s->rx + step_x, z * step_x), vy = fma(dz, s->ry + step_y, z * step_y);
    for (int i = 0; i < 3; i++) {
        constant float *m = &f->camera.to_world[4 * i];
        dp[i] = fma(m[0], vx, fma(m[1], vy, -m[2] * dz));
    }
    floatv off = dot3(mean, dp);
    floatv turn = dot3(mean, mean); /* 2 + 2 n.n' */
    same &= (turn > 2.0f) & (off * off <= (CHORD_SINE * CHORD_SINE) * turn * dot3(dp, dp));
    floatv one = rl_select(0.0f, 1.0f, same);
    floatv p1 = one * dot3(s->t, dp), p2 = one * dot3(s->b, dp), n1 = dot3(s->t, dn), n2 = dot3(s->b, dn);
    s->pp[0] = fma(p1, p1, s->pp[0]);
    s->pp[1] = fma(p1, p2, s->pp[1]);
    s->pp[2] = fma(p2, p2, s->pp[2]);
    s->np11 = fma(n1, p1, s->np11);
    s->np = fma(n1, p2, fma(n2, p1, s->np));
    s->np22 = fma(n2, p2, s->np22);
    for (int i = 0; i < 3; i++)
        s->sum[i] = fma(one, n[i], s->sum[i]);
}

/* tr(N A) / tr(M A), A = (M + e)^-1: half the trace of S, where M has full rank; the curvature along the line where it has not. */
static inline floatv mean_curvature(const fit_t *s)
{
    floatv e = fma(RIDGE, s->pp[0] + s->pp[2], 1e-12f), a = s->pp[0] + e, c = s->pp[2] + e, b = s->pp[1];
    floatv over = fma(s->np11, c, fma(s->np22, a, -s->np * b));
    floatv under = fma(s->pp[0], c, fma(s->pp[2], a, -2.0f * b * b));
    intv known = under > 1e-9f;
    return rl_select(0.0f, over * s->per_radius / rl_select(1.0f, under, known), known);
}

/* Two rings of eight. */
static inline void gather(fit_t *s, constant frame_t *f, global const float *normal, global const float *depth,
                          global const uint *stencil, uintv id, int x, int y, int radius)
{
    for (int ring = 0; ring < 2; ring++) {
        int r = ring ? max(radius / 2, 1) : radius, d = max((int)(0.70710678f * (float)r + 0.5f), 1);
        for (int i = 0; i < 8; i++) {
            int dx = (i & 1 ? d : r) * ((i + 1 & 7) < 3 ? 1 : i == 2 || i == 6 ? 0 : -1);
            int dy = (i & 1 ? d : r) * (i == 0 || i == 4 ? 0 : i < 4 ? 1 : -1);
            add_neighbour(s, f, normal, depth, stencil, id, x, y, dx, dy);
        }
    }
}

kernel void curvature(global const float *normal, global const float *depth, global const uint *stencil,
                      global float *curvature, global float *smooth_normal, constant params_t *p, constant frame_t *f,
                      constant material_t *materials)
{
    int x = RL_W * (int)get_global_id(0), y = (int)get_global_id(1), at = rl_index(f, x, y);
    uintv id = rl_load_id(stencil, at);
    intv full = id != 0;
    floatv bent = 0.0f, out[3] = {0.0f, 0.0f, 0.0f};
    if (rl_any(full)) {
        fit_t s;
        s.z = rl_load(depth, at);
        float nearest = -rl_max_lane(rl_select(-1e30f, -s.z, full & (s.z > 0.0f)));
        s.z = rl_select(1.0f, s.z, full & (s.z > 0.0f));
        s.rx = rl_ray_x(f, &f->camera, rl_to_floatv(RL_LANES + x));
        s.ry = rl_ray_y(f, &f->camera, (float)y);
        float pixels = clamp(1e-3f * p->radius_mm * f->camera.focal[0] / nearest, 1.0f, 64.0f);
        int radius = (int)(pixels + 0.5f);
        s.per_radius = f->camera.focal[0] / ((float)radius * s.z);
        s.pp[0] = s.pp[1] = s.pp[2] = s.np11 = s.np = s.np22 = 0.0f;
        for (int i = 0; i < 3; i++)
            s.n[i] = s.sum[i] = rl_load(normal, at + i * f->plane);
        make_frame(&s);
        gather(&s, f, normal, depth, stencil, id, x, y, radius);
        bent = rl_select(0.0f, mean_curvature(&s), full);
        floatv scale = rsqrt(fmax(dot3(s.sum, s.sum), 1e-12f));
        for (int i = 0; i < 3; i++)
            out[i] = rl_select(0.0f, s.sum[i] * scale, full);
    }
    RL_STORE(curvature, 0, x, y, bent);
    for (int i = 0; i < 3; i++)
        RL_STORE(smooth_normal, i, x, y, out[i]);
}
