/* Light that comes through from the back face, behind scatter.cl and pattern.cl: a screen-space pass that is
 * "essentially the same as the SSS pass, except we accumulate the contribution of the back face to the front
 * face" (Golubev 2018, future work).
 *
 * For a front point x:  T(x) = sum over pixels y of R(|x - b(y)|) L(y) A(y),  b the point of the closest back
 * face in pixel y, L the light that entered there (back_lighting), A the area of the back face that the pixel
 * sees; R is Burley's profile of the true distance. Unlike in the filters of the front, weights are not
 * normalized: what the slab lets through is less than all.
 *
 * Taps. Seen from x, a plane t away has R(sqrt(r² + t²)): with rho² = r² + t² it is 2 pi rho R(rho) d rho, so
 * the radius for a share xi of the light is that where P(rho) = P(t) + (1 - P(t)) xi. Each channel has its
 * own d, and a third of the taps; every tap is weighed with the mean of the three densities, so that all
 * three are unbiased. t serves a group of lanes: half of the least among them.
 *
 * Control. The same taps also sum R over the tangent plane of the pixel's own back face, whose integral is
 * known (the slab's e^-st/4 + 3/4 e^-st/3): the sum is divided by how far that one is off. So an even slab of
 * any slope comes out exact, and taps that fall on another material in front, or outside of the image where
 * the object goes on to its border, are made up for (border: renormalize) or black (occlude). From where the
 * object has ended, or has no back face, no light comes.
 *
 * How wrong: what the closest back face hides, and what lies beyond the image, is missing. */

#define TAP_BLOCK 64
#define AHEAD     8 /* taps from fetching to loading */
#define TURNS     256
#define NEAR      0.8f /* lanes share a scale from here to 1 times the farthest */

/* Host tables, as passes/translucency.c makes them: directions (cos, sin); then for every depth of plane, 0
 * and 1/4 2^k d, the patterns: x, y in units of d, each padded to TAP_BLOCK. */
#define DEPTHS        8
#define MOST_PATTERNS 15
#define PATTERN_TAPS  4096
#define TABLE_TAPS    (2 * TURNS)

enum { TRANSMISSION_GATHER = 4 };

#define TRANSLUCENCY_PORTS                                                                                   \
    global const float *back, global const float *lit, global const float *albedo,                           \
        global const float *normal, global const float *depth, global const float *back_depth,               \
        global const float *back_normal, global const uint *stencil, global float *area,                     \
        global float *slope, global float *through, global float *out, constant params_t *p,                 \
        constant frame_t *f, constant material_t *materials, constant float *tables

typedef struct planes_t { /* RL_PHASE4 */
    global const float *back, *depth, *back_depth, *area, *slope;
    global const uint *stencil;
    constant frame_t *f;
} planes_t;

/* What is constant for some lanes of a vector, one material. */
typedef struct lanes_t {
    vector_t v;
    floatv z, far; /* depth of the front; of the back face, or the front where there is none */
    floatv t;      /* from the one to the other along the view axis */
    floatv rx;     /* rays, on the plane z = -1 */
    float ry;
    floatv slope[2]; /* of the back face, metres a pixel */
    floatv area;
    intv has;         /* lanes of the group with a back face */
    float inv_d;      /* 1 / the largest d, 1/m; lengths below are in units of that d, "_u" */
    float s[3];       /* d_max / d */
    float k[2];       /* pixels a d at the middle depth */
    float per_middle; /* 1 / middle depth² */
    float thin_u;     /* the plane's distance that the taps are made for */
    float turn[2];
    uint spread, shift; /* which pattern; which channel the first tap belongs to, as shares of 2³² */
    int material;
    intv keep; /* all bits: samples that are none count as black */
} lanes_t;

/* Taps of a block, the same for all lanes. */
typedef struct taps_t {
    int at[TAP_BLOCK];                /* index of the vector */
    int dx[TAP_BLOCK], dy[TAP_BLOCK]; /* pixels */
    float x[TAP_BLOCK], y[TAP_BLOCK]; /* the same before rounding */
    float weight[TAP_BLOCK];          /* 1/(8 pi n density), in d² */
} taps_t;

/* ---- the back face ----------------------------------------------------------------------------------------
 */

/* Slope of the back face along an axis, metres a pixel: the mean of the differences to both neighbours, at
 * most twice the flatter one (van Leer 1977), so that it is right to second order on curved faces and does
 * not take a step for a slope. Where a neighbour is missing, at silhouettes, one difference would be far too
 * flat: there the normal tells (`other`). On a ball of 48 pixels radius the outermost half pixel has 14 % of
 * the back face. */
#define MOST_BACK_TILT 20.0f
static inline floatv back_slope(global const float *back_depth, global const uint *stencil,
                                constant frame_t *f, const vector_t *v, int dx, int dy, floatv other)
{
    int i = scatter_at(f, v, dx, dy), j = scatter_at(f, v, -dx, -dy);
    intv id = rl_as_intv(rl_vload(0, stencil + v->at));
    floatv z = rl_vload(0, back_depth + v->at), za = rl_vload(0, back_depth + i),
           zb = rl_vload(0, back_depth + j);
    floatv a = za - z, b = z - zb,
           most = z * (MOST_BACK_TILT / (dx ? f->camera.focal[0] : f->camera.focal[1]));
    intv has = (rl_as_intv(rl_vload(0, stencil + i)) == id) & (za > 0.0f) &
               (rl_as_intv(rl_vload(0, stencil + j)) == id) & (zb > 0.0f);
    floatv limit = 2.0f * fmin(fabs(a), fabs(b)), mean = clamp(0.5f * (a + b), -limit, limit);
    mean = scatter_keep(mean, a * b > 0.0f);
    return clamp(rl_select(other, mean, has), -most, most);
}

kernel void translucency_area(TRANSLUCENCY_PORTS)
{
    constant camera_t *c = &f->camera;
    vector_t v = scatter_vector(f);
    floatv n[3], z = rl_vload(0, back_depth + v.at), x = rl_to_floatv((RL_LANES + v.sx) * 4 + v.px);
    for (int i = 0; i < 3; i++) /* to view space */
        n[i] = c->to_view[4 * i] * rl_vload(0, back_normal + v.at) +
               c->to_view[4 * i + 1] * rl_vload(0, back_normal + f->plane4 + v.at) +
               c->to_view[4 * i + 2] * rl_vload(0, back_normal + 2 * f->plane4 + v.at);
    floatv nw = fma(n[0], rl_ray_x(f, c, x), n[1] * rl_ray_y(f, c, (float)(4 * v.sy + v.py)) - n[2]);
    floatv per = z / copysign(fmax(fabs(nw), 1e-4f), nw);
    floatv sx = back_slope(back_depth, stencil, f, &v, 1, 0, n[0] * per * (-1.0f / c->focal[0]));
    floatv sy = back_slope(back_depth, stencil, f, &v, 0, 1, n[1] * per * (1.0f / c->focal[1]));
    rl_vstore(sx, 0, slope + v.at);
    rl_vstore(sy, 0, slope + f->plane4 + v.at);
    rl_vstore(scatter_area_at(f, x, 4 * v.sy + v.py, z, sx, sy), 0, area + v.at);
}

/* ---- taps -------------------------------------------------------------------------------------------------
 */

static inline int tap_stride(int n)
{
    return (n + TAP_BLOCK - 1) / TAP_BLOCK * TAP_BLOCK;
}

static inline int pattern_count(int n)
{
    int fit = PATTERN_TAPS / tap_stride(n);
    return fit > MOST_PATTERNS ? MOST_PATTERNS : (fit - 1) | 1;
}

/* Which of the table's depths: the last that is not beyond `t`, in units of the channel's d. */
static inline int depth_index(float t)
{
    int i = 0;
    for (float next = 0.5f; i < DEPTHS - 1 && t >= next; next *= 2.0f)
        i++;
    return i;
}

static inline float depth_of(int index)
{
    return index ? 0.25f * (float)(1 << index) : 0.0f;
}

/* 8 pi times the density of a channel's taps, radius² r2; lengths in units of its d. */
static inline floatv tap_density(floatv r2, float t)
{
    floatv rho2 = fmax(r2 + t * t, 1e-20f), ir = rsqrt(rho2), rho = rho2 * ir;
    floatv e = weight_exp2((rho - t) * -0.480898347f), q = weight_exp2(rho * -0.961796694f);
    float whole = 0.75f + 0.25f * exp2(t * -0.961796694f); /* e^{-2t/3} */
    return ir * e * (1.0f + q) * (1.0f / whole);
}

/* Taps first … first+n-1 of `all`, n <= TAP_BLOCK. */
static inline void place_taps(constant frame_t *f, const lanes_t *g, constant float *tables, int all,
                              int first, int n, taps_t *taps)
{
    const float magic = 12582912.0f;
    int rows4 = f->rows >> 2, stride = tap_stride(all), patterns = pattern_count(all);
    int pattern = (int)mul_hi(g->spread, (uint)patterns), shift = (int)mul_hi(g->shift, 3u);
    for (int i = 0; i < n; i += RL_W) {
        intv channel = (RL_LANES + (first + i + shift)) % 3;
        floatv u = 0.0f, v = 0.0f, density = 0.0f;
        for (int c = 0; c < 3; c++) {
            int index = depth_index(g->thin_u * g->s[c]);
            constant float *from =
                tables + TABLE_TAPS + 2 * stride * (index * patterns + pattern) + first + i;
            u = rl_select(u, rl_vload(0, from) * (1.0f / g->s[c]), channel == c);
            v = rl_select(v, rl_vload(0, from + stride) * (1.0f / g->s[c]), channel == c);
        }
        floatv r2 = fma(u, u, v * v);
        for (int c = 0; c < 3; c++) {
            float s2 = g->s[c] * g->s[c];
            density =
                fma(tap_density(r2 * s2, depth_of(depth_index(g->thin_u * g->s[c]))), (floatv)s2, density);
        }
        floatv x = fma(u, (floatv)g->turn[0], -(v * g->turn[1])) * g->k[0];
        floatv y = fma(u, (floatv)g->turn[1], v * g->turn[0]) * g->k[1];
        intv dx = rl_as_intv(x + magic) - as_int(magic), dy = rl_as_intv(y + magic) - as_int(magic);
        rl_vstore(x, 0, taps->x + i);
        rl_vstore(y, 0, taps->y + i);
        rl_vstore(dx, 0, taps->dx + i);
        rl_vstore(dy, 0, taps->dy + i);
        rl_vstore(3.0f / ((float)all * density), 0, taps->weight + i);
        dx += g->v.px;
        dy += g->v.py;
        intv row = (dy >> 2) + g->v.sy;
        intv column = clamp((dx >> 2) + g->v.sx, -RL_MARGIN4, f->columns >> 2);
        intv a = (((dy & 3) * 4 + (dx & 3)) * rows4 + row) * f->stride4 + RL_MARGIN4 + column;
        rl_vstore(a & ((row >= 0) & (row < rows4)), 0, taps->at + i); /* index 0 is a margin: no material */
    }
}

/* Weights of the three channels for a point `behind` the front's depth and pixels (x, y) away: R of the
 * distance from the lane's front point, times `share`. */
static inline void weigh(const planes_t *in, const lanes_t *g, float x, float y, floatv behind, floatv share,
                         intv counts, floatv w[3])
{
    constant float *focal = in->f->camera.focal;
    floatv less = -behind, z = g->z + behind;
    floatv dx = fma(g->rx, less, z * (-x / focal[0])), dy = fma((floatv)g->ry, less, z * (y / focal[1]));
    floatv q = fmax(fma(dx, dx, fma(dy, dy, less * less)) * (g->inv_d * g->inv_d), 1e-12f);
    floatv ir = rsqrt(q), r = q * ir, common = scatter_keep(ir * share, counts);
    for (int c = 0; c < 3; c++) {
        floatv e = weight_exp2(r * (-0.480898347f * g->s[c]));
        w[c] = fma(e, e, (floatv)1.0f) * (e * common * g->s[c]);
    }
}

/* Lanes that are inside of the image, (dx, dy) pixels away. */
static inline intv lanes_inside(constant frame_t *f, const vector_t *v, int dx, int dy)
{
    int y = 4 * v->sy + v->py + dy;
    intv x = (RL_LANES + v->sx) * 4 + (v->px + dx);
    intv inside = (x >= f->valid[0]) & (x < f->valid[2]);
    return y >= f->valid[1] && y < f->valid[3] ? inside : (intv)0;
}

/* Material at the image's border next to the pixels (dx, dy) away, which lie outside: what is seen there goes
 * on. */
static inline intv ids_at_border(const planes_t *in, const vector_t *v, int dx, int dy)
{
    constant frame_t *f = in->f;
    int ids[RL_W], y = clamp(4 * v->sy + v->py + dy, f->valid[1], f->valid[3] - 1);
    for (int i = 0; i < RL_W; i++) {
        int x = clamp(4 * (v->sx + i) + v->px + dx, f->valid[0], f->valid[2] - 1);
        ids[i] = (int)in->stencil[rl_index4(f, x, y)];
    }
    return rl_vload(0, ids);
}

typedef struct sums_t {
    floatv light[3];
    floatv plane[3], known[3]; /* weights on the tangent plane: of all taps; of those that are samples */
} sums_t;

static inline void add_tap(const planes_t *in, const lanes_t *g, const taps_t *taps, int i, sums_t *sum)
{
    int a = taps->at[i], plane4 = in->f->plane4;
    float x = taps->x[i], y = taps->y[i], weight = taps->weight[i] * g->per_middle;
    float from_x = x - (float)taps->dx[i], from_y = y - (float)taps->dy[i]; /* the pixel's middle */
    intv id = rl_as_intv(rl_vload(0, in->stencil + a)), same = id == g->material;
    floatv z = rl_vload(0, in->back_depth + a), per = 1.0f / g->far, w[3];
    intv sample = same & (z > 0.0f);
    if (scatter_any(sample)) {
        /* To the tap's place in the pixel, on its tangent plane: depth times 1/(1 - e), area times the cube.
         */
        floatv e =
            fma(rl_vload(0, in->slope + a), (floatv)from_x, rl_vload(0, in->slope + plane4 + a) * from_y) / z;
        floatv share = weight * rl_vload(0, in->area + a) * fma(e, (floatv)3.0f, (floatv)1.0f);
        floatv behind = fma(z, fma(e, e, e), z - g->z);
        weigh(in, g, x, y, rl_select((floatv)0.0f, behind, sample), share, sample, w);
        for (int c = 0; c < 3; c++) /* no point sends more than all of its light */
            sum->light[c] = fma(fmin(w[c], 1.0f),
                                scatter_keep(rl_vload(0, in->back + c * plane4 + a), sample), sum->light[c]);
    }
    if (!scatter_any(g->has))
        return;
    intv inside = lanes_inside(in->f, &g->v, taps->dx[i], taps->dy[i]);
    intv ends = inside & ((id == 0) | (rl_vload(0, in->depth + a) > g->far));
    if (scatter_any(g->has & ~inside))
        ends |= ~inside & (ids_at_border(in, &g->v, taps->dx[i], taps->dy[i]) != g->material);
    intv counts = same | g->keep | ends;
    /* The plane's depth is 1/(1 - a x - b y) of the pixel's, the area that a pixel sees goes with its cube.
     */
    floatv tilt = fma(g->slope[0] * per, (floatv)x, g->slope[1] * per * y);
    tilt = fmin(tilt, 0.95f);
    floatv more = 1.0f / (1.0f - tilt), share = weight * g->area * more * more * more;
    weigh(in, g, x, y, fma(g->far * tilt, more, g->t), share, g->has, w);
    for (int c = 0; c < 3; c++) {
        sum->plane[c] += w[c];
        sum->known[c] += scatter_keep(w[c], counts);
    }
}

/* The planes of a tap that comes soon. */
static inline void fetch_tap(const planes_t *in, int at)
{
    int plane = in->f->plane4;
    scatter_fetch((global const float *)in->stencil + at);
    scatter_fetch(in->depth + at);
    scatter_fetch(in->back_depth + at);
    scatter_fetch(in->area + at);
    scatter_fetch(in->slope + at);
    scatter_fetch(in->slope + plane + at);
    for (int c = 0; c < 3; c++)
        scatter_fetch(in->back + c * plane + at);
}

/* Light from the back, of the lanes in `now`. */
static inline void sum_taps(const planes_t *in, const lanes_t *g, constant float *tables, int n, intv now,
                            floatv out[3])
{
    sums_t sum = {{0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.0f}};
    taps_t taps;
    for (int first = 0; first < n; first += TAP_BLOCK) {
        int count = min(TAP_BLOCK, n - first);
        place_taps(in->f, g, tables, n, first, count, &taps);
        for (int i = 0; i < count; i++) {
            fetch_tap(in, taps.at[min(i + AHEAD, count - 1)]);
            add_tap(in, g, &taps, i, &sum);
        }
    }
    floatv t = g->t * g->inv_d * (g->far * g->far / fmax(g->area, 1e-30f)); /* along the back's normal */
    for (int c = 0; c < 3; c++) {
        floatv e = weight_exp2(t * (-0.480898347f * g->s[c]));
        floatv whole = 0.25f * e * fma(e, e, (floatv)3.0f);
        /* What the taps miss of the plane is at most a factor 2 either way; what the border hides may be
         * nearly all. */
        floatv off = clamp(whole / fmax(sum.plane[c], 1e-30f), 0.5f, 2.0f);
        floatv hidden = rl_select((floatv)0.0f, sum.plane[c] / fmax(sum.known[c], 1e-30f),
                                  sum.known[c] > 1e-3f * sum.plane[c]);
        floatv light = sum.light[c] * rl_select((floatv)1.0f, off * hidden, g->has);
        out[c] = rl_select(out[c], light, now);
    }
}

/* ---- materials --------------------------------------------------------------------------------------------
 */

/* Lanes of `mine` that are about as far away and about as thick, and what they share. */
static inline intv next_group(const planes_t *in, lanes_t *g, intv mine)
{
    floatv back = rl_vload(0, in->back_depth + g->v.at);
    intv now = mine & (g->far >= NEAR * scatter_farthest(g->far, mine));
    float thin = scatter_nearest(g->t, now);
    now &= g->t <= fma(3.0f, thin, 1.0f / g->inv_d);
    now = scatter_any(now) ? now : mine;
    g->has = now & (back > 0.0f);
    float middle = 0.5f * (scatter_farthest(g->far, now) + scatter_nearest(g->far, now));
    g->thin_u =
        0.5f * thin * g->inv_d; /* half: a face that is turned away is nearer than along the view axis */
    g->per_middle = 1.0f / (middle * middle);
    g->k[0] = in->f->camera.focal[0] / (middle * g->inv_d);
    g->k[1] = in->f->camera.focal[1] / (middle * g->inv_d);
    return now;
}

static inline void gather_material(const planes_t *in, const vector_t *v, constant params_t *p,
                                   constant float *tables, int material, constant material_t *m, intv mine,
                                   floatv out[3])
{
    constant frame_t *f = in->f;
    constant float *d = m->profile_scatter_distance_mm;
    lanes_t g;
    float most = fmax(d[0], fmax(d[1], d[2]));
    g.v = *v;
    g.z = rl_vload(0, in->depth + v->at);
    floatv back = rl_vload(0, in->back_depth + v->at);
    g.far = rl_select(g.z, back, back > 0.0f);
    g.t = fmax(g.far - g.z, 0.0f);
    g.rx = rl_ray_x(f, &f->camera, rl_to_floatv((RL_LANES + v->sx) * 4 + v->px));
    g.ry = rl_ray_y(f, &f->camera, (float)(4 * v->sy + v->py));
    g.slope[0] = rl_vload(0, in->slope + v->at);
    g.slope[1] = rl_vload(0, in->slope + f->plane4 + v->at);
    g.area = rl_vload(0, in->area + v->at);
    g.inv_d = 1e3f / most;
    for (int c = 0; c < 3; c++)
        g.s[c] = most / d[c];
    uint2 choice = pattern_choice(p->rotation, p->seed, f->number, v->px, v->py);
    g.turn[0] = tables[2 * (choice.x >> 24)];
    g.turn[1] = tables[2 * (choice.x >> 24) + 1];
    g.spread = choice.y;
    g.shift = choice.x << 8;
    g.material = material;
    g.keep = m->profile_border == BORDER_OCCLUDE ? -1 : 0;
    while (scatter_any(mine)) {
        intv now = next_group(in, &g, mine);
        mine &= ~now;
        sum_taps(in, &g, tables, p->taps, now, out);
    }
}

kernel void translucency_gather(TRANSLUCENCY_PORTS)
{
    planes_t in = {back, depth, back_depth, area, slope, stencil, f};
    vector_t v = scatter_vector(f);
    intv id = rl_as_intv(rl_vload(0, stencil + v.at)), left = id != 0;
    floatv sum[3] = {0.0f, 0.0f, 0.0f};
    while (scatter_any(left)) {
        int now = scatter_max_int(id & left);
        intv mine = left & (id == now);
        constant material_t *m = &materials[now];
        left &= ~mine;
        if (m->has_profile && m->shading_transmission && m->profile_transmission == TRANSMISSION_GATHER)
            gather_material(&in, &v, p, tables, now, m, mine, sum);
    }
    for (int c = 0; c < 3; c++)
        rl_vstore(sum[c], 0, through + c * f->plane4 + v.at);
}

kernel void translucency_resolve(TRANSLUCENCY_PORTS)
{
    scatter_resolve(through, lit, albedo, normal, stencil, out, f, materials);
}
