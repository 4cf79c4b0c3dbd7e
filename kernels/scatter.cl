/* What the scattering filters share, in front of their own text: neighbours in RL_PHASE4, vectors of one
 * material, and the way out of the surface. Distances are in metres unless a name ends in _u: those are in
 * units of the largest scattering distance of the material. */

#define WEIGHTING_AREA      0
#define WEIGHTING_PLAIN     1
#define WEIGHTING_SURFACE   2
#define ORIENTATION_SCREEN  0
#define ORIENTATION_TANGENT 1

enum { TEXTURING_POST = 0, TEXTURING_PRE_POST = 1 };
enum { BORDER_RENORMALIZE = 0, BORDER_OCCLUDE = 1 };
enum { DIFFUSE_DISNEY = 0, DIFFUSE_LAMBERT = 1 };
enum { EXIT_SSS = 0, EXIT_LIGHTING = 1 };

#define BURLEY_RADIUS 16.5644f /* in units of d: where P = 0.997 */

/* A filter's result: three channels of light and, when the ledger of energy (graph/run/energy.h) is asked for, as
 * many of what the pixel's own light loses at borders and off the screen, of what clamps cut off and of what
 * dividing by the weights that are left gives back. */
#if WANTS_energy
#define SCATTER_OUT 15
#define SCATTER_LEDGER                                                                                       \
    global float *border, global float *off_screen, global float *clamped, global float *redistributed,      \
        global float *energy,
#else
#define SCATTER_OUT 3
#define SCATTER_LEDGER
#endif

/* The ports of the passes that are built on this, in their order. */
#define SCATTER_PORTS                                                                                        \
    global const float *diffuse, global const float *lit, global const float *albedo,                        \
        global const float *normal, global const float *depth, global const uint *stencil,                   \
        global float *area, global float *filtered, global float *color, SCATTER_LEDGER                      \
        constant params_t *p, constant frame_t *f, constant material_t *materials

/* What the filters read: planes in RL_PHASE4. */
typedef struct inputs_t {
    global const float *diffuse, *depth, *area;
    global const uint *stencil;
    constant frame_t *f;
} inputs_t;

/* ---- one vector of a sub-image ------------------------------------------------------------------------ */

/* RL_W pixels of one sub-image: (4*(sx + lane) + px, 4*sy + py). */
typedef struct vector_t {
    int px, py, sx, sy;
    int at; /* index of lane 0 in a plane */
} vector_t;

static inline vector_t scatter_vector(constant frame_t *f)
{
    vector_t v;
    int phase = get_global_id(0);
    v.px = phase & 3;
    v.py = phase >> 2;
    v.sx = RL_W * (int)get_global_id(1);
    v.sy = get_global_id(2);
    v.at = (phase * (f->rows >> 2) + v.sy) * f->stride4 + RL_MARGIN4 + v.sx;
    return v;
}

/* Index of the vector (dx, dy) pixels away. It lies in the sub-image of another phase, but its lanes are
 * neighbours all the same. What lies beyond the image is led to a margin, where the stencil is 0. */
static inline int scatter_at(constant frame_t *f, const vector_t *v, int dx, int dy)
{
    int x = v->px + dx, y = v->py + dy, row = v->sy + (y >> 2);
    int column = clamp(v->sx + (x >> 2), -RL_MARGIN4, f->columns >> 2);
    int at = (((y & 3) * 4 + (x & 3)) * (f->rows >> 2) + row) * f->stride4 + RL_MARGIN4 + column;
    return row >= 0 && row < (f->rows >> 2) ? at : 0;
}

/* Fetches the lines of a vector that is loaded soon. Taps are far apart, which the hardware cannot foresee:
 * on CPUs this takes a sixth off the time. Elsewhere nothing happens. */
#if defined(__x86_64__) || defined(__aarch64__)
#define SCATTER_FETCH(p) __builtin_prefetch((const void *)(ulong)(p))
#else
#define SCATTER_FETCH(p) (void)(p)
#endif

static inline void scatter_fetch(global const float *p)
{
    SCATTER_FETCH(p);
    SCATTER_FETCH(p + RL_W - 1);
}

/* ---- masks and lanes ---------------------------------------------------------------------------------- */

static inline floatv scatter_keep(floatv v, intv mask)
{
    return rl_as_floatv(rl_as_intv(v) & mask);
}

#if RL_W == 16
static inline int8 scatter_max8(intv v)
{
    return max(v.lo, v.hi);
}

static inline int8 scatter_or8(intv v)
{
    return v.lo | v.hi;
}
#elif RL_W == 8
#define scatter_max8(v) (v)
#define scatter_or8(v)  (v)
#else
#define scatter_max8(v) ((int8)((v), (v)))
#define scatter_or8(v)  ((int8)((v), (v)))
#endif

static inline int scatter_max_int(intv v)
{
    int8 a = scatter_max8(v);
    int4 b = max(a.lo, a.hi);
    int2 c = max(b.lo, b.hi);
    return max(c.x, c.y);
}

/* any() by halves: PoCL tests lane after lane. */
static inline int scatter_any(intv mask)
{
    int8 a = scatter_or8(mask);
    int4 b = a.lo | a.hi;
    long2 c = as_long2(b);
    return (c.x | c.y) != 0;
}

/* The largest positive float of the lanes in the mask, 0 when there is none: as bits, positive floats sort
 * like integers. */
static inline float scatter_farthest(floatv v, intv mask)
{
    return as_float(max(0, scatter_max_int(rl_as_intv(v) & mask)));
}

static inline float scatter_nearest(floatv v, intv mask)
{
    const int big = 0x7f000000;
    return as_float(big - max(0, scatter_max_int((big - rl_as_intv(v)) & mask)));
}

/* 2^x for x <= 0, relative error below 3e-6; x below -125 counts as -125: nothing beside any other weight. */
static inline floatv weight_exp2(floatv x)
{
    const float magic = 12582912.0f;
    x = fmax(x, -125.0f);
    floatv r = x + magic, t = x - (r - magic);
    floatv p = 9.57010191e-3f; /* minimax, degree 4 */
    p = fma(p, t, 5.59178603e-2f);
    p = fma(p, t, 2.40247448e-1f);
    p = fma(p, t, 6.93121815e-1f);
    p = fma(p, t, 9.99999261e-1f);
    return rl_as_floatv(rl_as_intv(p) + (rl_as_intv(r) << 23)); /* magic's own low bits are 0 */
}

/* ---- the surface that a pixel sees -------------------------------------------------------------------- */

/* Slope of the depth along one axis, metres a pixel: the flatter of the two differences to neighbours of the
 * same material, so that a silhouette does not count as a slope; 0 when there are none. */
static inline floatv scatter_slope(global const float *depth, global const uint *stencil, constant frame_t *f,
                                   const vector_t *v, int dx, int dy)
{
    int i = scatter_at(f, v, dx, dy), j = scatter_at(f, v, -dx, -dy);
    intv id = rl_as_intv(rl_vload(0, stencil + v->at));
    floatv z = rl_vload(0, depth + v->at), a = rl_vload(0, depth + i) - z, b = z - rl_vload(0, depth + j);
    intv has_a = rl_as_intv(rl_vload(0, stencil + i)) == id,
         has_b = rl_as_intv(rl_vload(0, stencil + j)) == id;
    intv take_a = has_a & (~has_b | (fabs(a) <= fabs(b)));
    return rl_select(scatter_keep(b, has_b), a, take_a);
}

/* The same in metres of depth a metre of the screen's plane, at most MOST_TILT (84 degrees) either way. */
#define MOST_TILT 10.0f
static inline floatv scatter_tilt(const inputs_t *in, const vector_t *v, floatv z, int dx, int dy)
{
    float focal = dx ? in->f->camera.focal[0] : in->f->camera.focal[1];
    return clamp(scatter_slope(in->depth, in->stencil, in->f, v, dx, dy) * (focal / z), -MOST_TILT,
                 MOST_TILT);
}

#if P_weighting == WEIGHTING_SURFACE
/* Mean slope to both neighbours, of those that are of the same material and less steep than MOST_TILT: right
 * to second order on a curved surface, where the flatter one comes out too small. */
static inline floatv scatter_mean_slope(global const float *depth, global const uint *stencil,
                                        constant frame_t *f, const vector_t *v, int dx, int dy)
{
    int i = scatter_at(f, v, dx, dy), j = scatter_at(f, v, -dx, -dy);
    intv id = rl_as_intv(rl_vload(0, stencil + v->at));
    floatv z = rl_vload(0, depth + v->at), a = rl_vload(0, depth + i) - z, b = z - rl_vload(0, depth + j);
    floatv most = z * (MOST_TILT / (dx ? f->camera.focal[0] : f->camera.focal[1]));
    intv has_a = (rl_as_intv(rl_vload(0, stencil + i)) == id) & (fabs(a) <= most),
         has_b = (rl_as_intv(rl_vload(0, stencil + j)) == id) & (fabs(b) <= most);
    floatv sum = scatter_keep(a, has_a) + scatter_keep(b, has_b);
    return rl_select(sum, 0.5f * sum, has_a & has_b);
}
#define SCATTER_AREA_SLOPE scatter_mean_slope
#else
#define SCATTER_AREA_SLOPE scatter_slope
#endif

/* weighting: surface. The sum of R(|x - y|) E(y) dA over the surface, which is what the light that comes out
 * is (Christensen and Burley 2015), is not divided by its own weights: on a curved surface they do not add up
 * to one, less where it is convex and more where it is concave. It is divided by the weights that the same
 * samples have on the tangent plane, where they do; so what the samples miss of the core cancels. A sample of
 * another material is left out of both, unless the surface has turned away there: beyond its silhouette the
 * plane's weights count. Half or more of what lies beyond is hidden from a camera that looks along the
 * surface, so the correction fades with the cosine between the two:
 *
 *     sum(R E dA) * ((1 - cos) / sum(R dA) + cos / sum(R_plane dA_plane))
 *
 * What is hidden counts as no less and no more lit than what is seen. On a captured head, against a
 * path-traced truth, the error is 0.54 to 0.67 of that of `area`; on a ball of wax 0.39, 0.48 and 1.34 of it
 * (red, green, blue; `plain` has 4.5, 4.3 and 3.0 times as much). tests/test_sss_curved.c has other shapes:
 * 0.13 of it on a ball, 0.32 on waves, 1.26 on a cylinder. sss_burley takes 1.5 times the time, for two sets
 * of weights a tap; those of the plane for every third tap alone take 1.3 times, and double the noise of a
 * frame. */
typedef struct plane_t {
    floatv x, y; /* slopes, metres of depth a pixel */
    floatv cosine;
} plane_t;

#if P_weighting == WEIGHTING_SURFACE
static inline plane_t scatter_plane(const inputs_t *in, const vector_t *v, floatv z)
{
    plane_t p;
    constant float *focal = in->f->camera.focal;
    p.x = scatter_mean_slope(in->depth, in->stencil, in->f, v, 1, 0);
    p.y = scatter_mean_slope(in->depth, in->stencil, in->f, v, 0, 1);
    floatv x = p.x * focal[0] / z, y = p.y * focal[1] / z;
    p.cosine = rsqrt(fma(x, x, fma(y, y, (floatv)1.0f)));
    return p;
}

/* Lanes whose sample, (dx, dy) pixels away, shows that the surface has turned away before: inside of the
 * image, and empty or behind the plane by more than two pixels are wide. `id` and `far` are the sample's
 * material and depth, `at_plane` the depth of the plane there. */
static inline intv scatter_turned_away(const inputs_t *in, const vector_t *v, int dx, int dy, intv id,
                                       floatv far, floatv at_plane)
{
    constant frame_t *f = in->f;
    int y = 4 * v->sy + v->py + dy;
    intv x = (RL_LANES + v->sx) * 4 + (v->px + dx);
    intv inside = (x >= f->valid[0]) & (x < f->valid[2]);
    float pixel = 2.0f / fmin(f->camera.focal[0], f->camera.focal[1]);
    intv away = (id == 0) | (far > fma(at_plane, (floatv)pixel, at_plane));
    return y >= f->valid[1] && y < f->valid[3] ? inside & away : (intv)0;
}
#endif

/* Area of the surface that pixels (x, y) of depth z see, m² on the plane z = -1 times f_x·f_y: |dP/dx ×
 * dP/dy| of P = ((x - c_x)/f_x z, -(y - c_y)/f_y z, -z); zx and zy are the slopes, metres a pixel. */
static inline floatv scatter_area_at(constant frame_t *f, floatv x, int y, floatv z, floatv zx, floatv zy)
{
    constant camera_t *c = &f->camera;
    zx *= c->focal[0];
    zy *= c->focal[1];
    floatv rx = rl_ray_x(f, c, x);
    float ry = rl_ray_y(f, c, (float)y);
    /* The cross product of (z + rx zx, ry zx, -zx) and (rx zy, ry zy - z, -zy), divided by z. */
    floatv n = z + rx * zx - ry * zy;
    return z * sqrt(zx * zx + zy * zy + n * n);
}

/* The same for all vectors of RL_PHASE4 planes, with slopes from the neighbours. */
static inline void scatter_area(global const float *depth, global const uint *stencil, global float *area,
                                constant frame_t *f)
{
    vector_t v = scatter_vector(f);
    SCATTER_FETCH(depth + v.at + 2 * RL_W); /* of 48 streams the hardware loses track */
    SCATTER_FETCH(stencil + v.at + 2 * RL_W);
    SCATTER_FETCH(area + v.at + 2 * RL_W);
    floatv zx = SCATTER_AREA_SLOPE(depth, stencil, f, &v, 1, 0),
           zy = SCATTER_AREA_SLOPE(depth, stencil, f, &v, 0, 1);
    floatv x = rl_to_floatv((RL_LANES + v.sx) * 4 + v.px);
    rl_vstore(scatter_area_at(f, x, 4 * v.sy + v.py, rl_vload(0, depth + v.at), zx, zy), 0, area + v.at);
}

/* ---- the way out -------------------------------------------------------------------------------------- */

/* Burley's transmission 1 - (1 - |c|)^5 / 2, without the retro-reflection term. */
static inline floatv scatter_disney(floatv c)
{
    floatv q = 1.0f - fmin(fabs(c), 1.0f), q2 = q * q;
    return 1.0f - 0.5f * q2 * q2 * q;
}

/* n·v at pixels x…x+RL_W-1 of row y; v points to the camera. */
static inline floatv scatter_n_dot_v(constant frame_t *f, global const float *normal, int x, int y)
{
    constant camera_t *c = &f->camera;
    constant float *m = c->to_world;
    int at = rl_index(f, x, y);
    floatv nx = rl_load(normal, at), ny = rl_load(normal + f->plane, at),
           nz = rl_load(normal + 2 * f->plane, at);
    floatv rx = rl_ray_x(f, c, rl_to_floatv(RL_LANES + x));
    float ry = rl_ray_y(f, c, (float)y);
    floatv dot = nx * (m[0] * rx + (m[1] * ry - m[2])) + ny * (m[4] * rx + (m[5] * ry - m[6])) +
                 nz * (m[8] * rx + (m[9] * ry - m[10]));
    return -dot * rsqrt(rx * rx + (ry * ry + 1.0f));
}

static inline floatv scatter_load(int layout, global const float *p, constant frame_t *f, int plane, int x,
                                  int y)
{
    return layout == RL_LINEAR ? rl_load(p + plane * f->plane, rl_index(f, x, y))
                               : rl_load4(p + plane * f->plane4, f, x, y);
}

/* color = lit + filtered · exit(albedo) · F_out, for RL_W pixels of a row; `filtered` and `stencil` have the
 * layout that is given. */
static inline void scatter_resolve_from(int layout, global const float *filtered, global const float *lit,
                                        global const float *albedo, global const float *normal,
                                        global const uint *stencil, global float *color, constant frame_t *f,
                                        constant material_t *materials)
{
    int x = RL_W * (int)get_global_id(0), y = get_global_id(1);
    int at = rl_index(f, x, y);
    intv id = rl_as_intv(scatter_load(layout, (global const float *)stencil, f, 0, x, y));
    intv pre_post = 0, disney = 0, scatters = 0, left = id != 0;
    while (scatter_any(left)) {
        int m = scatter_max_int(id & left);
        intv mine = id == m;
        left &= ~mine;
        constant material_t *mat = &materials[m];
        if (!mat->has_profile)
            continue;
        scatters |= mine;
        pre_post |= mat->profile_texturing == TEXTURING_PRE_POST ? mine : 0;
        disney |=
            mat->shading_diffuse == DIFFUSE_DISNEY && mat->shading_exit_transmission == EXIT_SSS ? mine : 0;
    }
    floatv out = 1.0f;
    if (scatter_any(disney))
        out = rl_select(out, scatter_disney(scatter_n_dot_v(f, normal, x, y)), disney);
    RL_UNROLL
    for (int c = 0; c < 3; c++) {
        floatv sum = rl_load(lit + c * f->plane, at);
        if (scatter_any(scatters)) {
            floatv a = rl_load(albedo + c * f->plane, at);
            a = rl_select(a, sqrt(a), pre_post);
            floatv v = scatter_load(layout, filtered, f, c, x, y) * a * out;
            sum += scatter_keep(v, scatters);
        }
        rl_store(sum, color + c * f->plane, at);
    }
}

/* The same from RL_PHASE4. */
static inline void scatter_resolve(global const float *filtered, global const float *lit,
                                   global const float *albedo, global const float *normal,
                                   global const uint *stencil, global float *color, constant frame_t *f,
                                   constant material_t *materials)
{
    scatter_resolve_from(RL_PHASE4, filtered, lit, albedo, normal, stencil, color, f, materials);
}

/* ---- the ledger of energy ----------------------------------------------------------------------------- */

#if WANTS_energy
/* Weights of the samples that are none: of another material or of nothing, and beyond the image. */
typedef struct rejected_t {
    floatv border[3], off_screen[3];
} rejected_t;

/* Lanes whose sample (dx, dy) pixels away lies in the image. */
static inline intv scatter_inside(constant frame_t *f, const vector_t *v, int dx, int dy)
{
    int y = 4 * v->sy + v->py + dy;
    intv x = (RL_LANES + v->sx) * 4 + (v->px + dx);
    return (x >= f->valid[0]) & (x < f->valid[2]) & (intv)(y >= f->valid[1] && y < f->valid[3] ? -1 : 0);
}

static inline void scatter_reject(rejected_t *r, int c, floatv weight, intv inside)
{
    r->border[c] += scatter_keep(weight, inside);
    r->off_screen[c] += scatter_keep(weight, ~inside);
}

/* Channel c of a result: the pixel's own light, the share of the result that is not left to it, the weights w
 * of the samples that count and their light times weights, those that are rejected (`black`: they are in w),
 * and what the filter gives, before its clamps and after. */
static inline void scatter_account(floatv *out, int c, floatv own, float share, floatv w, floatv light,
                                   const rejected_t *r, intv black, floatv unclamped, floatv given, float least)
{
    floatv all = w + scatter_keep(r->border[c] + r->off_screen[c], ~black);
    intv any = all > least;
    floatv per = scatter_keep(1.0f / all, any);
    out[3 + c] = share * own * r->border[c] * per;
    out[6 + c] = share * own * r->off_screen[c] * per;
    out[9 + c] = unclamped - given;
    out[12 + c] = scatter_keep(unclamped - fma((floatv)share, light * per - own, own), any);
}

/* A result's part of the ledger, of the pixels at `at`; planes are `plane` floats apart. */
#define SCATTER_KEEP_LEDGER(out, plane, at)                                                                  \
    RL_UNROLL                                                                                                \
    for (int c = 0; c < 3; c++) {                                                                            \
        rl_vstore((out)[3 + c], 0, border + c * (plane) + (at));                                             \
        rl_vstore((out)[6 + c], 0, off_screen + c * (plane) + (at));                                         \
        rl_vstore((out)[9 + c], 0, clamped + c * (plane) + (at));                                            \
        rl_vstore((out)[12 + c], 0, redistributed + c * (plane) + (at));                                     \
    }

/* Sums of the light that goes through the filter, all of it on the way out: times exit(albedo) F_out of the
 * pixel that it belongs to. `parts`: diffuse, filtered, and the four of the ledger, in the layout given. */
static inline void scatter_energy(int layout, global const float *const *parts, global const float *albedo,
                                  global const float *normal, global const uint *stencil, global float *energy,
                                  constant frame_t *f, constant material_t *materials)
{
    band_t band = energy_band(energy, f);
    ENERGY_EACH_VECTOR(f, band, x, y)
    {
        int at = rl_index(f, x, y);
        intv id = rl_as_intv(scatter_load(layout, (global const float *)stencil, f, 0, x, y));
        intv left = rl_insidev(f, x, y) & (id != 0);
        while (scatter_any(left)) {
            int m = scatter_max_int(id & left);
            intv mine = left & (id == m);
            left &= ~mine;
            constant material_t *mat = &materials[m];
            if (!mat->has_profile)
                continue;
            floatv out = 1.0f, values[ENERGY_PIXELS];
            if (mat->shading_diffuse == DIFFUSE_DISNEY && mat->shading_exit_transmission == EXIT_SSS)
                out = scatter_disney(scatter_n_dot_v(f, normal, x, y));
            RL_UNROLL
            for (int c = 0; c < 3; c++) {
                floatv a = rl_load(albedo + c * f->plane, at);
                a = out * (mat->profile_texturing == TEXTURING_PRE_POST ? sqrt(a) : a);
                for (int i = 0; i < 6; i++)
                    values[3 * i + c] = a * scatter_load(layout, parts[i], f, c, x, y);
            }
            energy_post(&band, (uint)m, mine, values);
        }
    }
}
#define SCATTER_ENERGY(layout)                                                                               \
    global const float *parts[6] = {diffuse, filtered, border, off_screen, clamped, redistributed};          \
    scatter_energy(layout, parts, albedo, normal, stencil, energy, f, materials)
#endif
