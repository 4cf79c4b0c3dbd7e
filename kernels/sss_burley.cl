/* Importance-sampled subsurface scattering with Burley's profile (Golubev 2018), in the form that suits wide
 * vectors: the pattern is turned a phase at a time, so that a tap is one offset for a whole vector and every
 * load contiguous; one scale serves the lanes of a vector that are about equally far away, and each lane's
 * weights use its own.
 *
 * Tap i stands for the light of 1/n of a profile at its exact place, and reads the pixel that this place is
 * in: of the mixture of the channels' profiles, so that narrow ones have taps too (passes/burley.h). So the
 * sum over taps tends to the sum over pixels of the profile's integral over the pixel's square:
 * sss_reference. On a plane that faces the camera the mean over patterns is that sum, whatever n is (settle()
 * below).
 *
 * How wrong: the common scale is off by up to 11 % for a lane, so its filter ends between 0.89 and 1.11
 * r_max, where 0.25 % of the light is (its weights are exact). Laid into the tangent plane (`orientation:
 * tangent`) taps follow the mean plane of their lanes; a lane that is turned away from the others gets none
 * from the ends of its own disk. */

#define TAP_BLOCK  64     /* taps that are turned and rounded at a time */
#define AHEAD      8      /* taps from fetching to loading */
#define TURNS      256    /* directions in the table */
#define NEAR       0.8f   /* lanes share a scale from here to 1 times the farthest */
#define MIN_WEIGHT 1e-12f /* less in all than a sample 80 d away has: the pixel keeps its own light */

/* Level of detail, by the filter's radius in pixels: from which radius on there is a filter, and the taps of
 * the small and of the large one. passes/sss_burley.c makes the patterns. */
#define LOD_SOME  0.5f
#define LOD_MANY  2.0f
#define TAPS_SOME 21
#define TAPS_MANY 55

/* Patterns for a number of taps: as passes/sss_burley.c makes them. */
#define MOST_PATTERNS 15
#define PATTERN_TAPS  4096

#if P_weighting != WEIGHTING_PLAIN
#define AREA(x) x
#else
#define AREA(x)
#endif

/* Host tables, passes/sss_burley.c: directions (cos, sin), where a material's patterns start, and for each
 * pattern its x, y, weights, padded to TAP_BLOCK, and a channel's sum of weights beside the patterns' mean.
 */
#define TABLE_TURNS    0
#define TABLE_PATTERNS (2 * TURNS)

/* What is constant for some lanes of a vector. */
typedef struct group_t {
    vector_t v;
    floatv z;         /* depth */
    floatv scale2;    /* (depth / middle depth)²: from the taps' radii to the lane's true ones, squared */
    float inv_d;      /* 1 / the largest scattering distance, 1/m */
    float k[2];       /* pixels a d at the middle depth */
    float fall[3];    /* exponents of 2 a unit of r_u: -d_max / (3 d ln 2) */
    float turn[2];    /* cos, sin of the pattern's turn */
    uint spread;      /* which pattern: share of 2³² of the patterns there are */
    plane_t plane;    /* tangent to each lane's surface */
    float squeeze[3]; /* xx, xy, yy: from the disk to the screen's plane, less the identity */
    int material;
    intv keep; /* all bits: samples that are none count as black */
} group_t;

/* Taps first…first+n-1, n <= TAP_BLOCK: index of the vector, radius² in units of d, weight, and for
 * weighting: surface and for the ledger how many pixels away, x before y. There are RL_W more indices behind
 * the last, for looking ahead. */
static inline void place_taps(const inputs_t *in, const group_t *g, global const float *taps, int stride,
                              int first, int n, int *at, float *r2, float *weight, int *shift)
{
    const float magic = 12582912.0f;
    constant frame_t *f = in->f;
    int rows4 = f->rows >> 2;
    int i = 0;
    for (; i < n; i += RL_W) {
        floatv x = rl_vload(0, taps + first + i), y = rl_vload(0, taps + stride + first + i);
        floatv u = fma(x, (floatv)g->turn[0], -(y * g->turn[1])),
               v = fma(x, (floatv)g->turn[1], y * g->turn[0]);
#if P_orientation == ORIENTATION_TANGENT
        floatv flat = u;
        u = fma(v, (floatv)g->squeeze[1], fma(u, (floatv)g->squeeze[0], u));
        v = fma(flat, (floatv)g->squeeze[1], fma(v, (floatv)g->squeeze[2], v));
#endif
        intv dx = rl_as_intv(fma(u, (floatv)g->k[0], (floatv)magic)) - as_int(magic);
        intv dy = rl_as_intv(fma(v, (floatv)g->k[1], (floatv)magic)) - as_int(magic);
#if P_weighting == WEIGHTING_SURFACE || WANTS_energy
        rl_vstore(dx, 0, shift + i);
        rl_vstore(dy, 0, shift + TAP_BLOCK + i);
#endif
        dx += g->v.px;
        dy += g->v.py;
        intv row = (dy >> 2) + g->v.sy;
        intv column = clamp((dx >> 2) + g->v.sx, -RL_MARGIN4, f->columns >> 2);
        intv a = (((dy & 3) * 4 + (dx & 3)) * rows4 + row) * f->stride4 + RL_MARGIN4 + column;
        intv inside = (row >= 0) & (row < rows4);
        rl_vstore(a & inside, 0, at + i); /* index 0 is a margin: no material */
        rl_vstore(fma(u, u, v * v), 0, r2 + i);
        rl_vstore(rl_vload(0, taps + 2 * stride + first + i), 0, weight + i);
    }
    rl_vstore((intv)g->v.at, 0, at + i);
}

/* The planes of a tap that comes soon. */
static inline void fetch_tap(const inputs_t *in, int at)
{
    int plane = in->f->plane4;
    scatter_fetch((global const float *)in->stencil + at);
    scatter_fetch(in->depth + at);
    AREA(scatter_fetch(in->area + at);)
    scatter_fetch(in->diffuse + at);
    scatter_fetch(in->diffuse + plane + at);
    scatter_fetch(in->diffuse + 2 * plane + at);
}

static inline int tap_stride(int n)
{
    return (n + TAP_BLOCK - 1) / TAP_BLOCK * TAP_BLOCK;
}

static inline int pattern_count(int n)
{
    int fit = PATTERN_TAPS / tap_stride(n);
    return fit > MOST_PATTERNS ? MOST_PATTERNS : (fit - 1) | 1;
}

static inline floatv weigh_channel(floatv exponent, floatv common)
{
    floatv e = weight_exp2(exponent);
    return fma(e, e, (floatv)1.0f) * (e * common);
}

/* A tap's weights for the three channels, of the lanes in `counts`: `share` times R(sqrt(r2 + dz²)) without
 * its constant factors; lengths in units of the largest d. */
static inline void weigh_tap(const group_t *g, floatv r2, floatv dz, floatv share, intv counts, floatv w[3])
{
    floatv q = fma(dz, dz, r2), ir = rsqrt(q), r = q * ir;
    floatv common = scatter_keep(ir * share, counts);
    w[0] = weigh_channel(r * g->fall[0], common); /* a loop is not unrolled, and goes through memory */
    w[1] = weigh_channel(r * g->fall[1], common);
    w[2] = weigh_channel(r * g->fall[2], common);
}

/* From weights w and weighted light c to what one channel sends out, a pixel's `own` light given. Weights add
 * up to another sum with each pattern; `share` is that sum beside the mean of all patterns, on a plane. The
 * mean c/w leans to the own light of pixels, since c counts for more where w is small: with 21 taps of the
 * widest profile alone, one thirty times narrower is off by 0.018 of stripes and 0.034 of grain; with those
 * of the mixture by 0.003. Counting c/w for `share` and the own light for the rest, the quotient cancels on a
 * plane: unbiased, and even light stays even everywhere. */
static inline floatv settle(floatv own, floatv c, floatv w, float share)
{
    floatv v = fma((floatv)share, c / w - own, own);
    return rl_select(own, fmax(v, fmin(own, 0.0f)), w > MIN_WEIGHT);
}

#if P_weighting == WEIGHTING_SURFACE
/* What a curved surface sends out beside a flat one: of the weights there and on the tangent plane. */
static inline floatv curve(const group_t *g, floatv w, floatv planar)
{
    return rl_select((floatv)1.0f, fma(g->plane.cosine, w / planar - 1.0f, (floatv)1.0f), w > MIN_WEIGHT);
}
#endif

/* What n taps say, whose patterns start at `taps`, of the pixels' own light in `out`; lanes without a sample
 * keep it. */
static inline void sum_taps(const inputs_t *in, const group_t *g, global const float *taps, int n,
                            floatv *out)
{
    int stride = tap_stride(n), plane = in->f->plane4;
    taps += (3 * stride + 3) * (int)mul_hi(g->spread, (uint)pattern_count(n));
    global const float *share = taps + 3 * stride;
    floatv w0 = 0.0f, w1 = 0.0f, w2 = 0.0f, c0 = 0.0f, c1 = 0.0f, c2 = 0.0f;
    int at[TAP_BLOCK + RL_W];
    float r2[TAP_BLOCK], weight[TAP_BLOCK];
    int shift[2 * TAP_BLOCK];
#if P_weighting == WEIGHTING_SURFACE
    floatv p0 = 0.0f, p1 = 0.0f, p2 = 0.0f;
#endif
#if WANTS_energy
    rejected_t rejected = {{0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.0f}};
    const floatv own[3] = {out[0], out[1], out[2]};
#endif
    AREA(floatv per_own = 1.0f / rl_vload(0, in->area + g->v.at);)
    for (int first = 0; first < n; first += TAP_BLOCK) {
        int last = min(TAP_BLOCK, n - first);
        place_taps(in, g, taps, stride, first, last, at, r2, weight, shift);
        for (int i = 0; i < AHEAD; i++)
            fetch_tap(in, at[i]);
        for (int i = 0; i < last; i++) {
            int a = at[i];
            fetch_tap(in, at[i + AHEAD]);
            intv id = rl_as_intv(rl_vload(0, in->stencil + a)), same = id == g->material;
            floatv other = rl_vload(0, in->depth + a), dz = scatter_keep((other - g->z) * g->inv_d, same);
            floatv stands = weight[i], e[3];
#if P_weighting == WEIGHTING_SURFACE
            int x = shift[i], y = shift[TAP_BLOCK + i];
            floatv flat = g->plane.x * (float)x + g->plane.y * (float)y, plane_dz = flat * g->inv_d, p[3];
            intv away = scatter_turned_away(in, &g->v, x, y, id, other, g->z + flat);
            dz = rl_select(plane_dz, dz, same);
            weigh_tap(g, g->scale2 * r2[i], plane_dz, weight[i], same | away | g->keep, p);
            p0 += p[0];
            p1 += p[1];
            p2 += p[2];
#endif
            AREA(stands *= rl_select((floatv)1.0f, rl_vload(0, in->area + a) * per_own, same);)
            weigh_tap(g, g->scale2 * r2[i], dz, stands, same | g->keep, e);
            w0 += e[0];
            w1 += e[1];
            w2 += e[2];
            c0 = fma(e[0], scatter_keep(rl_vload(0, in->diffuse + a), same), c0);
            c1 = fma(e[1], scatter_keep(rl_vload(0, in->diffuse + plane + a), same), c1);
            c2 = fma(e[2], scatter_keep(rl_vload(0, in->diffuse + 2 * plane + a), same), c2);
#if WANTS_energy
            weigh_tap(g, g->scale2 * r2[i], dz, weight[i], ~same, e);
            for (int c = 0; c < 3; c++)
                scatter_reject(&rejected, c, e[c],
                               scatter_inside(in->f, &g->v, shift[i], shift[TAP_BLOCK + i]));
#endif
        }
    }
#if WANTS_energy
    const floatv w[3] = {w0, w1, w2}, light[3] = {c0, c1, c2};
#endif
    out[0] = settle(out[0], c0, w0, share[0]);
    out[1] = settle(out[1], c1, w1, share[1]);
    out[2] = settle(out[2], c2, w2, share[2]);
#if P_weighting == WEIGHTING_SURFACE
    out[0] *= curve(g, w0, p0);
    out[1] *= curve(g, w1, p1);
    out[2] *= curve(g, w2, p2);
#endif
#if WANTS_energy
    for (int c = 0; c < 3; c++) {
        floatv raw = fma((floatv)share[c], light[c] / w[c] - own[c], own[c]); /* as settle() has it */
#if P_weighting == WEIGHTING_SURFACE
        raw *= fma(g->plane.cosine, w[c] / (c == 0 ? p0 : c == 1 ? p1 : p2) - 1.0f, (floatv)1.0f);
#endif
        raw = rl_select(out[c], raw, w[c] > MIN_WEIGHT);
        scatter_account(out, c, own[c], share[c], w[c], light[c], &rejected, g->keep, raw, out[c], MIN_WEIGHT);
    }
#endif
}

/* 0 below 0.9 of the threshold, 1 above 1.1 of it. */
static inline floatv beyond(floatv rho, float threshold)
{
    return clamp((rho - 0.9f * threshold) * (5.0f / threshold), 0.0f, 1.0f);
}

#if P_orientation == ORIENTATION_TANGENT
static inline int sum_lanes(intv v)
{
    int lanes[RL_W], sum = 0;
    rl_vstore(v, 0, lanes);
    for (int i = 0; i < RL_W; i++)
        sum += lanes[i];
    return sum;
}

/* Lays the disk into the mean tangent plane of the lanes `now`. Seen along the view axis it is squeezed by
 * the cosine in the direction t of the slope: I + (cos - 1) t t'. Tilts are rounded to 1/1024, so that their
 * sum is exact. */
static inline void lay_disk(const inputs_t *in, group_t *g, intv now)
{
    const float magic = 12582912.0f;
    floatv tx = scatter_tilt(in, &g->v, g->z, 1, 0), ty = scatter_tilt(in, &g->v, g->z, 0, 1);
    intv ix = rl_as_intv(fma(tx, (floatv)1024.0f, (floatv)magic)) - as_int(magic);
    intv iy = rl_as_intv(fma(ty, (floatv)1024.0f, (floatv)magic)) - as_int(magic);
    float count = 1024.0f * (float)sum_lanes(now & 1);
    float x = (float)sum_lanes(ix & now) / count, y = (float)sum_lanes(iy & now) / count;
    float slope2 = fma(x, x, y * y), cosine = 1.0f / sqrt(1.0f + slope2);
    float less = slope2 > 0.0f ? (cosine - 1.0f) / slope2 : 0.0f;
    g->squeeze[0] = less * x * x;
    g->squeeze[1] = less * x * y;
    g->squeeze[2] = less * y * y;
}
#endif

/* The lanes `now` of the group, with the pattern that their size on screen asks for. */
static inline void filter_group(const inputs_t *in, const group_t *g, constant params_t *p,
                                global const float *taps, intv now, floatv *out)
{
    floatv sum[SCATTER_OUT];
    for (int c = 0; c < SCATTER_OUT; c++)
        sum[c] = out[c];
    if (p->taps > 0) {
        sum_taps(in, g, taps, p->taps, sum);
    } else {
        float focal = fmax(in->f->camera.focal[0], in->f->camera.focal[1]);
        floatv rho = BURLEY_RADIUS * focal / (g->inv_d * g->z);
        floatv some = beyond(rho, LOD_SOME), many = beyond(rho, LOD_MANY);
        if (!scatter_any(now & (some > 0.0f)))
            return;
        floatv fine[SCATTER_OUT];
        for (int c = 0; c < SCATTER_OUT; c++)
            fine[c] = out[c];
        if (scatter_any(now & (many < 1.0f)))
            sum_taps(in, g, taps, TAPS_SOME, sum);
        if (scatter_any(now & (many > 0.0f)))
            sum_taps(in, g, taps + (3 * TAP_BLOCK + 3) * MOST_PATTERNS, TAPS_MANY, fine);
        for (int c = 0; c < SCATTER_OUT; c++) {
            sum[c] = fma(many, fine[c] - sum[c], sum[c]);
            sum[c] = fma(some, sum[c] - out[c], out[c]);
        }
    }
    for (int c = 0; c < SCATTER_OUT; c++)
        out[c] = rl_select(out[c], sum[c], now);
}

static inline void filter_material(const inputs_t *in, const vector_t *v, constant params_t *p,
                                   global const float *tables, int material, constant material_t *mat,
                                   intv mine, floatv *out)
{
    group_t g;
    int start = (int)tables[TABLE_PATTERNS + material];
    constant float *d = mat->profile_scatter_distance_mm;
    float most = fmax(d[0], fmax(d[1], d[2]));
    g.v = *v;
    g.z = rl_vload(0, in->depth + v->at);
    g.inv_d = 1e3f / most;
    for (int c = 0; c < 3; c++)
        g.fall[c] = -0.480898347f * (most / d[c]);
    uint2 choice = pattern_choice(p->rotation, p->seed, in->f->number, v->px, v->py);
    int turn = choice.x >> 24;
    g.turn[0] = tables[TABLE_TURNS + 2 * turn];
    g.turn[1] = tables[TABLE_TURNS + 2 * turn + 1];
    g.spread = choice.y;
#if P_weighting == WEIGHTING_SURFACE
    g.plane = scatter_plane(in, v, g.z);
#endif
    g.material = material;
    g.keep = mat->profile_border == BORDER_OCCLUDE ? -1 : 0;
    while (scatter_any(mine)) { /* once as a rule, more at silhouettes */
        float far = scatter_farthest(g.z, mine);
        intv now = mine & (g.z >= NEAR * far);
        now = scatter_any(now) ? now : mine;
        mine &= ~now;
        float middle = 0.5f * (far + scatter_nearest(g.z, now));
        floatv s = g.z / middle;
        g.scale2 = s * s;
        g.k[0] = in->f->camera.focal[0] / (middle * g.inv_d);
        g.k[1] = in->f->camera.focal[1] / (middle * g.inv_d);
#if P_orientation == ORIENTATION_TANGENT
        lay_disk(in, &g, now);
#endif
        filter_group(in, &g, p, tables + start, now, out);
    }
}

kernel void sss_burley_filter(SCATTER_PORTS, global const float *tables)
{
    inputs_t in = {diffuse, depth, area, stencil, f};
    vector_t v = scatter_vector(f);
    intv id = rl_as_intv(rl_vload(0, stencil + v.at)), left = id != 0;
    if (!scatter_any(left))
        return;
    floatv out[SCATTER_OUT];
    for (int c = 0; c < SCATTER_OUT; c++)
        out[c] = c < 3 ? rl_vload(0, diffuse + c * f->plane4 + v.at) : (floatv)0.0f;
    while (scatter_any(left)) {
        int m = scatter_max_int(id & left);
        intv mine = left & (id == m);
        left &= ~mine;
        if (materials[m].has_profile)
            filter_material(&in, &v, p, tables, m, &materials[m], mine, out);
    }
    for (int c = 0; c < 3; c++)
        rl_vstore(out[c], 0, filtered + c * f->plane4 + v.at);
#if WANTS_energy
    SCATTER_KEEP_LEDGER(out, f->plane4, v.at)
#endif
}

kernel void sss_burley_area(SCATTER_PORTS, global const float *tables)
{
    AREA(scatter_area(depth, stencil, area, f);)
}

kernel void sss_burley_resolve(SCATTER_PORTS, global const float *tables)
{
    scatter_resolve(filtered, lit, albedo, normal, stencil, color, f, materials);
}

#if WANTS_energy
kernel void sss_burley_energy(SCATTER_PORTS, global const float *tables)
{
    SCATTER_ENERGY(RL_PHASE4);
}
#endif
