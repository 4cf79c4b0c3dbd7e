/* What the scattering filters share, in front of their own text: neighbours in RL_PHASE4, vectors of one
 * material, and the way out of the surface. (scatter_surface.cl: areas, distances, curved surfaces.
 * scatter_ledger.cl: what becomes of the energy.) Distances are in metres unless a name ends in _u: those are in
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
