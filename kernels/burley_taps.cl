/* Where the taps of sss_burley.cl lie and what they weigh, behind scatter_surface.cl and pattern.cl. */

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
#define MOST_TAPS     4096

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
    floatv z_u;       /* the same in units of the largest d */
    floatv scale2;    /* (depth / middle depth)²: from the taps' radii to the lane's true ones, squared */
    floatv rx;        /* the ray on the plane z = -1 */
    float ry;
    float inv_d;      /* 1 / the largest scattering distance, 1/m */
    float k[2];       /* pixels a d at the middle depth */
    float fall[3];    /* exponents of 2 a unit of r_u: -d_max / (3 d ln 2) */
    float turn[2];    /* cos, sin of the pattern's turn */
    uint spread;      /* which pattern: share of 2³² of the patterns there are */
#if P_weighting == WEIGHTING_SURFACE
    plane_t plane; /* tangent to each lane's surface */
#endif
    float squeeze[3]; /* xx, xy, yy: from the disk to the screen's plane, less the identity */
    int material;
    intv keep;        /* all bits: samples that are none count as black */
} group_t;

/* TAP_BLOCK taps of a group, or fewer. */
typedef struct taps_t {
    int at[TAP_BLOCK + RL_W]; /* index of the vector; more behind the last, for looking ahead */
    float weight[TAP_BLOCK];
#if TRUE_DISTANCES
    float u[TAP_BLOCK], v[TAP_BLOCK]; /* place on the plane z = -1, beside the pixel */
#else
    float r2[TAP_BLOCK]; /* radius² at the middle depth, in units of d */
#endif
#if P_weighting == WEIGHTING_SURFACE || WANTS_energy
    int dx[TAP_BLOCK], dy[TAP_BLOCK]; /* pixels */
#endif
} taps_t;

/* Taps first…first+n-1 of a pattern, n <= TAP_BLOCK. */
static inline void place_taps(const inputs_t *in, const group_t *g, global const float *taps, int stride,
                              int first, int n, taps_t *to)
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
        rl_vstore(dx, 0, to->dx + i);
        rl_vstore(dy, 0, to->dy + i);
#endif
        dx += g->v.px;
        dy += g->v.py;
        intv row = (dy >> 2) + g->v.sy;
        intv column = clamp((dx >> 2) + g->v.sx, -RL_MARGIN4, f->columns >> 2);
        intv a = (((dy & 3) * 4 + (dx & 3)) * rows4 + row) * f->stride4 + RL_MARGIN4 + column;
        intv inside = (row >= 0) & (row < rows4);
        rl_vstore(a & inside, 0, to->at + i); /* index 0 is a margin: no material */
#if TRUE_DISTANCES
        rl_vstore(u * (g->k[0] / f->camera.focal[0]), 0, to->u + i);
        rl_vstore(v * (-g->k[1] / f->camera.focal[1]), 0, to->v + i);
#else
        rl_vstore(fma(u, u, v * v), 0, to->r2 + i);
#endif
        rl_vstore(rl_vload(0, taps + 2 * stride + first + i), 0, to->weight + i);
    }
    rl_vstore((intv)g->v.at, 0, to->at + i);
}

/* The planes of a tap that comes soon: those of the surface, and all. */
static inline void fetch_shape(const inputs_t *in, int at)
{
    scatter_fetch((global const float *)in->stencil + at);
    scatter_fetch(in->depth + at);
    AREA(scatter_fetch(in->area + at);)
}

static inline void fetch_tap(const inputs_t *in, int at)
{
    int plane = in->f->plane4;
    fetch_shape(in, at);
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

/* A tap's weights for the three channels, of the lanes in `counts`: `share` times R without its constant factors, at
 * the distance of tap i when it is dz deeper, in units of the largest d. */
static inline void weigh_tap(const group_t *g, const taps_t *taps, int i, floatv dz, floatv share, intv counts,
                             floatv w[3])
{
#if TRUE_DISTANCES
    floatv q = scatter_far2(g->z_u, g->rx, g->ry, taps->u[i], taps->v[i], dz);
#else
    floatv q = fma(dz, dz, g->scale2 * taps->r2[i]);
#endif
    floatv ir = rsqrt(q), r = q * ir;
    floatv common = scatter_keep(ir * share, counts);
    w[0] = weigh_channel(r * g->fall[0], common); /* a loop is not unrolled, and goes through memory */
    w[1] = weigh_channel(r * g->fall[1], common);
    w[2] = weigh_channel(r * g->fall[2], common);
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

/* What is common to the lanes of one material. */
static inline group_t group_of(const inputs_t *in, const vector_t *v, constant params_t *p,
                               global const float *tables, int material, constant material_t *mat)
{
    group_t g;
    constant float *d = mat->profile_scatter_distance_mm;
    float most = fmax(d[0], fmax(d[1], d[2]));
    g.v = *v;
    g.z = rl_vload(0, in->depth + v->at);
    g.inv_d = 1e3f / most;
    g.z_u = g.z * g.inv_d;
    g.rx = rl_ray_x(in->f, &in->f->camera, rl_to_floatv((RL_LANES + v->sx) * 4 + v->px));
    g.ry = rl_ray_y(in->f, &in->f->camera, (float)(4 * v->sy + v->py));
    for (int c = 0; c < 3; c++)
        g.fall[c] = -0.480898347f * (most / d[c]);
    uint2 choice = pattern_choice(p->rotation, p->seed, in->f->number, v->px, v->py);
    int turn = choice.x >> 24;
    g.turn[0] = tables[TABLE_TURNS + 2 * turn];
    g.turn[1] = tables[TABLE_TURNS + 2 * turn + 1];
    g.spread = choice.y;
#if P_weighting == WEIGHTING_SURFACE
    g.plane = scatter_plane(in, v);
#endif
    g.material = material;
    g.keep = mat->profile_border == BORDER_OCCLUDE ? -1 : 0;
    return g;
}

/* The lanes of `left` that are about as far away as the farthest, taken out of it; their common scale. All of them as a
 * rule, fewer at silhouettes. */
static inline intv take_group(const inputs_t *in, group_t *g, intv *left)
{
    float far = scatter_farthest(g->z, *left);
    intv now = *left & (g->z >= NEAR * far);
    now = scatter_any(now) ? now : *left;
    *left &= ~now;
    float middle = 0.5f * (far + scatter_nearest(g->z, now));
    floatv s = g->z / middle;
    g->scale2 = s * s;
    g->k[0] = in->f->camera.focal[0] / (middle * g->inv_d);
    g->k[1] = in->f->camera.focal[1] / (middle * g->inv_d);
#if P_orientation == ORIENTATION_TANGENT
    lay_disk(in, g, now);
#endif
    return now;
}

/* Where the pattern of n taps starts that the group takes, of those that start at `taps`. */
static inline global const float *pattern_of(const group_t *g, global const float *taps, int n)
{
    return taps + (3 * tap_stride(n) + 3) * (int)mul_hi(g->spread, (uint)pattern_count(n));
}

/* What the patterns for n taps take. */
static inline int patterns_floats(int n)
{
    return (3 * tap_stride(n) + 3) * pattern_count(n);
}
