/* The dense sum that the filters approximate: every pixel of the material within r_max of the pixel, weighted
 * with the light that its square sends here, R(sqrt(r² + dz²)). Within two pixels the weight is integrated
 * over the square (Gauss-Legendre), beyond it is taken at its middle; the pixel's own is P(pixel/sqrt(pi)),
 * that of the disk of its area. The largest d of the material sets r_max for the three channels. */

typedef struct sums_t {
    floatv w[3], c[3]; /* weights; weights times light */
    floatv p[3], more[3]; /* weighting: surface: weights on the tangent plane, and how much more those of the surface are */
#if WANTS_energy
    rejected_t rejected;
#endif
} sums_t;

#define NO_LIGHT {0.0f, 0.0f, 0.0f}
#if WANTS_energy
#define NO_SUMS {NO_LIGHT, NO_LIGHT, NO_LIGHT, NO_LIGHT, {NO_LIGHT, NO_LIGHT}}
#else
#define NO_SUMS {NO_LIGHT, NO_LIGHT, NO_LIGHT, NO_LIGHT}
#endif

/* What is constant for the pixels of one vector and one material. */
typedef struct centre_t {
    vector_t v;
    floatv z, ray_x; /* depth; the ray on the plane z = -1 */
    float ray_y;
    floatv tilt_x, tilt_y; /* of the disk, depth a metre of the screen's plane */
#if P_weighting == WEIGHTING_SURFACE
    plane_t plane; /* tangent */
#endif
    float d[3];
    float reach;
    float px, py; /* a pixel's size on the plane z = -1 */
    int material;
    intv keep; /* all bits: samples that are none count as black */
} centre_t;

/* R(sqrt(r2)) for the three channels, without the factor 1/(8 pi). */
static inline void burley(floatv r2, const float *d, floatv w[3])
{
    floatv r = sqrt(r2), ir = 1.0f / r;
    for (int c = 0; c < 3; c++) {
        floatv e = rl_exp2(r * (-0.480898347f / d[c])); /* e^{-r/(3d)} */
        w[c] = (e * e * e + e) * ir * (1.0f / d[c]);
    }
}

/* Distance², dz deeper and (x, y) away on the plane z = -1, right and down. */
static inline floatv far2_of(const centre_t *at, float x, float y, floatv dz)
{
#if TRUE_DISTANCES
    return scatter_far2(at->z, at->ray_x, at->ray_y, x, -y, dz);
#else
    return fma(at->z * at->z, (floatv)(x * x + y * y), dz * dz);
#endif
}

/* Mean of R over the square of the pixel (dx, dy) away, n² nodes. Six nodes for the eight neighbours and
 * three for the sixteen around them leave 1e-5. */
static inline void burley_square(const centre_t *at, int dx, int dy, floatv dz, int n, floatv w[3])
{
    const float x6[6] = {-0.466234757f, -0.330604693f, -0.119309593f,
                         0.119309593f,  0.330604693f,  0.466234757f};
    const float w6[6] = {0.0856622462f, 0.180380787f, 0.233956967f,
                         0.233956967f,  0.180380787f, 0.0856622462f};
    const float x3[3] = {-0.387298335f, 0.0f, 0.387298335f},
                w3[3] = {0.277777778f, 0.444444444f, 0.277777778f};
    w[0] = w[1] = w[2] = 0.0f;
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++) {
            float x = ((float)dx + (n == 6 ? x6[i] : x3[i])) * at->px;
            float y = ((float)dy + (n == 6 ? x6[j] : x3[j])) * at->py;
            float weight = n == 6 ? w6[i] * w6[j] : w3[i] * w3[j];
            floatv v[3];
            burley(far2_of(at, x, y, dz), at->d, v);
            for (int c = 0; c < 3; c++)
                w[c] = fma(v[c], (floatv)weight, w[c]);
        }
}

/* P(pixel/sqrt(pi)) over the pixel's area, in the units of burley(). */
static inline void burley_own(const centre_t *at, floatv w[3])
{
    floatv area = at->z * at->z * (at->px * at->py);
    floatv r = sqrt(area * (1.0f / RL_PI));
    for (int c = 0; c < 3; c++) {
        floatv e = rl_exp2(r * (-0.480898347f / at->d[c]));
        w[c] = (1.0f - 0.25f * e * e * e - 0.75f * e) / area * (8.0f * RL_PI);
    }
}

/* The weights of the pixels (dx, dy) away and dz deeper. */
static inline void weigh(const centre_t *at, int dx, int dy, floatv dz, floatv w[3])
{
    int ring = max(abs(dx), abs(dy));
    if (ring == 0)
        burley_own(at, w);
    else if (ring <= 2)
        burley_square(at, dx, dy, dz, ring == 1 ? 6 : 3, w);
    else
        burley(far2_of(at, (float)dx * at->px, (float)dy * at->py, dz), at->d, w);
}

/* The weights that samples would have which are none, for the ledger. */
static inline void reject(const inputs_t *in, const centre_t *at, int dx, int dy, intv none, sums_t *s)
{
#if WANTS_energy
    floatv w[3], area = 1.0f;
    if (!scatter_any(none))
        return;
#if P_weighting != WEIGHTING_PLAIN
    area = rl_vload(0, in->area + at->v.at);
#endif
    weigh(at, dx, dy, 0.0f, w);
    intv inside = scatter_inside(in->f, &at->v, dx, dy);
    for (int c = 0; c < 3; c++)
        scatter_reject(&s->rejected, c, scatter_keep(w[c] * area, none), inside);
#endif
}

#if P_weighting == WEIGHTING_SURFACE
/* The same pixels on the tangent plane, for the gain: `w` are the weights of those in `same`. What counts as black is on
 * the plane, so it makes no gain; where the surface has turned away it has no weight. */
static inline void gather_plane(const inputs_t *in, const centre_t *at, int dx, int dy, intv near, intv same,
                                intv id, floatv other, const floatv w[3], sums_t *s)
{
    floatv f = (at->plane.x * (float)dx + at->plane.y * (float)dy) / at->z, k = scatter_plane_scale(f);
    floatv flat = at->z * f * k;
    intv away = near & scatter_turned_away(in, &at->v, dx, dy, id, other, at->z + flat);
    intv counts = same | away | (near & at->keep);
    if (!scatter_any(counts))
        return;
    floatv p[3], stands = rl_vload(0, in->area + at->v.at) * k * k * k;
    weigh(at, dx, dy, flat, p);
    for (int c = 0; c < 3; c++) {
        p[c] = scatter_keep(p[c] * stands, counts);
        s->p[c] += p[c];
        s->more[c] += scatter_keep(w[c], same) - scatter_keep(p[c], same | (away & ~at->keep));
    }
}
#endif

/* The pixels (dx, dy) away join the sums of the lanes in `mine`. */
static inline void gather(const inputs_t *in, const centre_t *at, int dx, int dy, intv mine, sums_t *s)
{
    floatv rise = 0.0f; /* how much deeper the disk is */
    float x = (float)dx * at->px, y = (float)dy * at->py;
#if P_orientation == ORIENTATION_TANGENT
    rise = at->tilt_x * x + at->tilt_y * y;
    rise *= at->z * scatter_plane_scale(rise);
#endif
    int i = scatter_at(in->f, &at->v, dx, dy);
    intv near = mine & (far2_of(at, x, y, rise) <= at->reach * at->reach);
    intv id = rl_as_intv(rl_vload(0, in->stencil + i)), same = near & (id == at->material);
    intv counts = near & (same | at->keep);
    floatv other = rl_vload(0, in->depth + i), w[3] = NO_LIGHT;
    reject(in, at, dx, dy, near & ~same, s);
    if (scatter_any(counts)) {
        weigh(at, dx, dy, scatter_keep(other - at->z, same), w);
#if P_weighting != WEIGHTING_PLAIN
        floatv stands = rl_vload(0, in->area + at->v.at);
        stands = rl_select(stands, rl_vload(0, in->area + i), same);
        for (int c = 0; c < 3; c++)
            w[c] *= stands;
#endif
        for (int c = 0; c < 3; c++) {
            w[c] = scatter_keep(w[c], counts);
            s->w[c] += w[c];
            s->c[c] = fma(w[c], scatter_keep(rl_vload(0, in->diffuse + c * in->f->plane4 + i), same), s->c[c]);
        }
    }
#if P_weighting == WEIGHTING_SURFACE
    gather_plane(in, at, dx, dy, near, same, id, other, w, s);
#endif
}

static inline void filter_material(const inputs_t *in, const vector_t *v, int material,
                                   constant material_t *mat, intv mine, floatv *out)
{
    centre_t at;
    at.v = *v;
    at.z = rl_vload(0, in->depth + v->at);
    at.ray_x = rl_ray_x(in->f, &in->f->camera, rl_to_floatv((RL_LANES + v->sx) * 4 + v->px));
    at.ray_y = rl_ray_y(in->f, &in->f->camera, (float)(4 * v->sy + v->py));
#if P_orientation == ORIENTATION_TANGENT
    at.tilt_x = scatter_tilt(in, v, at.z, 1, 0);
    at.tilt_y = scatter_tilt(in, v, at.z, 0, 1);
#endif
    at.px = 1.0f / in->f->camera.focal[0];
    at.py = 1.0f / in->f->camera.focal[1];
    for (int c = 0; c < 3; c++)
        at.d[c] = mat->profile_scatter_distance_mm[c] * 1e-3f;
    at.material = material;
    at.keep = mat->profile_border == BORDER_OCCLUDE ? -1 : 0;
    at.reach = BURLEY_RADIUS * fmax(at.d[0], fmax(at.d[1], at.d[2]));
    float nearest = scatter_nearest(at.z, mine), reach = at.reach;
#if P_orientation == ORIENTATION_TANGENT /* what stands nearer to the camera is farther apart, and more so off the axis */
    reach *= sqrt(1.0f + at.ray_y * at.ray_y + scatter_farthest(at.ray_x * at.ray_x, mine));
    nearest = fmax(nearest - at.reach, 0.5f * nearest);
#endif
    int ry = (int)fmin(reach / (nearest * at.py), 16384.0f);
#if P_weighting == WEIGHTING_SURFACE
    at.plane = scatter_plane(in, v);
    floatv cosine = scatter_cosine(at.z, at.ray_x, at.ray_y, rl_vload(0, in->area + v->at));
#endif
    sums_t total = NO_SUMS;
    for (int dy = -ry; dy <= ry; dy++) {
        float y = (float)dy * at.py * nearest;
        int rx = (int)fmin(sqrt(fmax(reach * reach - y * y, 0.0f)) / (nearest * at.px), 16384.0f) + 1;
        sums_t row = NO_SUMS; /* rows first: less is lost to rounding */
        for (int dx = -rx; dx <= rx; dx++)
            gather(in, &at, dx, dy, mine, &row);
        for (int c = 0; c < 3; c++) {
            total.w[c] += row.w[c];
            total.c[c] += row.c[c];
            total.p[c] += row.p[c];
            total.more[c] += row.more[c];
#if WANTS_energy
            total.rejected.border[c] += row.rejected.border[c];
            total.rejected.off_screen[c] += row.rejected.off_screen[c];
#endif
        }
    }
    for (int c = 0; c < 3; c++) {
        floatv over = 1.0f / total.w[c];
#if P_weighting == WEIGHTING_SURFACE
        over *= fma(cosine, total.more[c] / total.p[c], (floatv)1.0f);
#endif
#if WANTS_energy
        floatv all[SCATTER_OUT], own = out[c];
#endif
        out[c] = rl_select(out[c], total.c[c] * over, mine & (total.w[c] > 0.0f));
#if WANTS_energy
        scatter_account(all, c, own, 1.0f, total.w[c], total.c[c], &total.rejected, at.keep, out[c], out[c], 0.0f);
        for (int i = 3 + c; i < SCATTER_OUT; i += 3)
            out[i] = rl_select(out[i], all[i], mine);
#endif
    }
}

kernel void sss_reference_filter(SCATTER_PORTS)
{
    inputs_t in = {diffuse, depth, area, stencil, f};
    vector_t v = scatter_vector(f);
    intv id = rl_as_intv(rl_vload(0, stencil + v.at)), left = id != 0;
    floatv out[SCATTER_OUT];
    for (int c = 0; c < SCATTER_OUT; c++)
        out[c] = c < 3 ? rl_vload(0, diffuse + c * f->plane4 + v.at) : (floatv)0.0f;
    while (scatter_any(left)) {
        int m = scatter_max_int(id & left);
        intv mine = id == m;
        left &= ~mine;
        if (materials[m].has_profile)
            filter_material(&in, &v, m, &materials[m], mine, out);
    }
    for (int c = 0; c < 3; c++)
        rl_vstore(out[c], 0, filtered + c * f->plane4 + v.at);
#if WANTS_energy
    SCATTER_KEEP_LEDGER(out, f->plane4, v.at)
#endif
}

kernel void sss_reference_area(SCATTER_PORTS)
{
#if P_weighting != WEIGHTING_PLAIN
    scatter_area(depth, stencil, area, f);
#endif
}

kernel void sss_reference_resolve(SCATTER_PORTS)
{
    scatter_resolve(filtered, lit, albedo, normal, stencil, color, f, materials);
}

#if WANTS_energy
kernel void sss_reference_energy(SCATTER_PORTS)
{
    SCATTER_ENERGY(RL_PHASE4);
}
#endif
