/* In front of every kernel, behind the generated part (params_t, material_t, HAS_*, LAYOUT_*, P_*) and shared.h:
 * vectors, loads and stores in both layouts, edge rules, the camera, fast functions with stated errors. */

#ifndef RL_W
#define RL_W 16
#endif
#define RL_CAT_(a, b) a##b
#define RL_CAT(a, b)  RL_CAT_(a, b)
typedef RL_CAT(float, RL_W) floatv;
typedef RL_CAT(int, RL_W) intv;
typedef RL_CAT(uint, RL_W) uintv;
#define rl_as_floatv RL_CAT(as_float, RL_W)
#define rl_as_intv   RL_CAT(as_int, RL_W)
#define rl_as_uintv  RL_CAT(as_uint, RL_W)
#define rl_to_floatv RL_CAT(convert_float, RL_W)
#define rl_to_intv   RL_CAT(convert_int, RL_W)
#define rl_vload     RL_CAT(vload, RL_W)
#define rl_vstore    RL_CAT(vstore, RL_W)

#if RL_W == 16
#define RL_LANES ((intv)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15))
#elif RL_W == 8
#define RL_LANES ((intv)(0, 1, 2, 3, 4, 5, 6, 7))
#else
#define RL_LANES ((intv)(0, 1, 2, 3))
#endif

/* In front of a loop over channels: PoCL leaves it a loop otherwise, and the vectors it runs over in memory. */
#define RL_UNROLL _Pragma("unroll")

#define RL_LINEAR 0
#define RL_PHASE4 1
#define RL_PI     3.14159265358979f

/* ---- places ---------------------------------------------------------------------------------------------- */

static inline int rl_index(constant frame_t *f, int x, int y)
{
    return y * f->stride + x;
}

static inline int rl_index4(constant frame_t *f, int x, int y)
{
    int s = (y & 3) * 4 + (x & 3);
    return (s * (f->rows >> 2) + (y >> 2)) * f->stride4 + RL_MARGIN4 + (x >> 2);
}

static inline int rl_inside(constant frame_t *f, int x, int y)
{
    return x >= f->valid[0] && y >= f->valid[1] && x < f->valid[2] && y < f->valid[3];
}

/* All bits set in lanes x…x+RL_W-1 of row y that are inside of the valid rectangle. */
static inline intv rl_insidev(constant frame_t *f, int x, int y)
{
    intv xs = RL_LANES + x;
    return (xs >= f->valid[0]) & (xs < f->valid[2]) & (intv)(y >= f->valid[1] && y < f->valid[3] ? -1 : 0);
}

/* ---- linear loads and stores ------------------------------------------------------------------------------ */

static inline floatv rl_load(global const float *p, int i)
{
    return rl_vload(0, p + i);
}

static inline uintv rl_load_id(global const uint *p, int i)
{
    return rl_vload(0, p + i);
}

static inline void rl_store(floatv v, global float *p, int i)
{
    rl_vstore(v, 0, p + i);
}

/* RL_W pixels from (x, y) on, where x and y may be outside: the nearest pixel inside is taken. */
static inline floatv rl_load_edge(global const float *p, constant frame_t *f, int x, int y)
{
    int row = clamp(y, f->valid[1], f->valid[3] - 1) * f->stride;
    if (x >= f->valid[0] && x + RL_W <= f->valid[2])
        return rl_vload(0, p + row + x);
    float lanes[RL_W];
    for (int i = 0; i < RL_W; i++)
        lanes[i] = p[row + clamp(x + i, f->valid[0], f->valid[2] - 1)];
    return rl_vload(0, lanes);
}

static inline uintv rl_load_id_edge(global const uint *p, constant frame_t *f, int x, int y)
{
    return rl_as_uintv(rl_load_edge((global const float *)p, f, x, y));
}

/* ---- stores in the layout that the plan chose ------------------------------------------------------------- */

/* RL_STORE(diffuse, plane, x, y, v): v goes to `plane` of port `diffuse` at pixels x…x+RL_W-1 of row y, x a multiple
 * of RL_W. For ports with .any_layout. */
#define RL_STORE(port, plane_, x, y, v) rl_store_as(RL_CAT(LAYOUT_, port), port, f, plane_, x, y, v)

static inline void rl_store_as(int layout, global float *p, constant frame_t *f, int plane, int x, int y, floatv v)
{
    if (layout == RL_LINEAR) {
        rl_vstore(v, 0, p + plane * f->plane + rl_index(f, x, y));
        return;
    }
    global float *q = p + plane * f->plane4 + rl_index4(f, x, y);
    int step = (f->rows >> 2) * f->stride4; /* to the next x-phase: sub-images of a row follow each other */
#if RL_W == 16
    vstore4(v.s048c, 0, q);
    vstore4(v.s159d, 0, q + step);
    vstore4(v.s26ae, 0, q + 2 * step);
    vstore4(v.s37bf, 0, q + 3 * step);
#elif RL_W == 8
    vstore2(v.s04, 0, q);
    vstore2(v.s15, 0, q + step);
    vstore2(v.s26, 0, q + 2 * step);
    vstore2(v.s37, 0, q + 3 * step);
#else
    q[0] = v.s0;
    q[step] = v.s1;
    q[2 * step] = v.s2;
    q[3 * step] = v.s3;
#endif
}

/* RL_W pixels x…x+RL_W-1 of row y out of an RL_PHASE4 plane, x a multiple of RL_W. */
static inline floatv rl_load4(global const float *p, constant frame_t *f, int x, int y)
{
    global const float *q = p + rl_index4(f, x, y);
    int step = (f->rows >> 2) * f->stride4;
#if RL_W == 16
    float4 a = vload4(0, q), b = vload4(0, q + step), c = vload4(0, q + 2 * step), d = vload4(0, q + 3 * step);
    return (floatv)(a.x, b.x, c.x, d.x, a.y, b.y, c.y, d.y, a.z, b.z, c.z, d.z, a.w, b.w, c.w, d.w);
#elif RL_W == 8
    float2 a = vload2(0, q), b = vload2(0, q + step), c = vload2(0, q + 2 * step), d = vload2(0, q + 3 * step);
    return (floatv)(a.x, b.x, c.x, d.x, a.y, b.y, c.y, d.y);
#else
    return (floatv)(q[0], q[step], q[2 * step], q[3 * step]);
#endif
}

/* What RL_STORE has stored. */
#define RL_LOAD(port, plane_, x, y)                                                                          \
    (RL_CAT(LAYOUT_, port) == RL_LINEAR ? rl_load(port + (plane_) * f->plane, rl_index(f, x, y))             \
                                        : rl_load4(port + (plane_) * f->plane4, f, x, y))

/* ---- masks ------------------------------------------------------------------------------------------------ */

/* A mask has all bits of a lane set or none. */
static inline floatv rl_select(floatv no, floatv yes, intv mask)
{
    return select(no, yes, mask);
}

static inline float rl_max_lane(floatv v)
{
    float m = v.s0;
    float lanes[RL_W];
    rl_vstore(v, 0, lanes);
    for (int i = 1; i < RL_W; i++)
        m = fmax(m, lanes[i]);
    return m;
}

/* Whether any lane is set; a uniform answer, cheap enough to leave a branch early. */
static inline int rl_any(intv mask)
{
#if RL_W == 16
    int8 a = mask.lo | mask.hi;
    int4 b = a.lo | a.hi;
#elif RL_W == 8
    int4 b = mask.lo | mask.hi;
#else
    int4 b = mask;
#endif
    int2 c = b.lo | b.hi;
    return (c.x | c.y) != 0;
}

/* The largest id of a vector. */
static inline uint rl_max_id(uintv v)
{
#if RL_W == 16
    uint8 a = max(v.lo, v.hi);
    uint4 b = max(a.lo, a.hi);
#elif RL_W == 8
    uint4 b = max(v.lo, v.hi);
#else
    uint4 b = v;
#endif
    uint2 c = max(b.lo, b.hi);
    return max(c.x, c.y);
}

/* ---- camera ----------------------------------------------------------------------------------------------- */

/* Metres on the plane z = -1 for pixel x (buffer coordinates), jitter included; y alike, up positive. */
static inline floatv rl_ray_x(constant frame_t *f, constant camera_t *c, floatv x)
{
    return (x + ((float)f->origin[0] + 0.5f + c->jitter[0] - c->centre[0])) * (1.0f / c->focal[0]);
}

static inline float rl_ray_y(constant frame_t *f, constant camera_t *c, float y)
{
    return -(y + ((float)f->origin[1] + 0.5f + c->jitter[1] - c->centre[1])) * (1.0f / c->focal[1]);
}

/* ---- functions ---------------------------------------------------------------------------------------------- */

/* 2^x for x in [-126, 126]; smaller x give 0 (below -126). Relative error below 1e-7 (tests/test_kernel_math.c). Not
 * for -cl-fast-relaxed-math, which deletes the rounding. */
static inline floatv rl_exp2(floatv x)
{
    const float magic = 12582912.0f; /* 1.5 * 2^23: adding it rounds to the nearest integer */
    intv under = x < -126.0f;
    x = fmax(x, -126.0f);
    floatv r = x + magic;
    floatv i = r - magic;
    floatv t = x - i; /* -0.5 … 0.5 */
    /* minimax, degree 6, p(0) = 1: error 2e-9, then rounding */
    floatv p = 1.5353371e-4f;
    p = fma(p, t, 1.3398878e-3f);
    p = fma(p, t, 9.6184374e-3f);
    p = fma(p, t, 5.5503325e-2f);
    p = fma(p, t, 2.4022648e-1f);
    p = fma(p, t, 6.9314720e-1f);
    p = fma(p, t, 1.0f);
    intv e = (rl_as_intv(r) - rl_as_intv((floatv)magic)) << 23;
    floatv y = rl_as_floatv(rl_as_intv(p) + e);
    return select(y, (floatv)0.0f, under);
}

/* A hash of four words (PCG style): the only source of randomness in kernels. */
static inline uint rl_hash(uint a, uint b, uint c, uint d)
{
    uint h = a * 0x9E3779B1u ^ b * 0x85EBCA77u ^ c * 0xC2B2AE3Du ^ d * 0x27D4EB2Fu;
    h ^= h >> 15;
    h *= 0x2C1B3C6Du;
    h ^= h >> 12;
    h *= 0x297A2D39u;
    h ^= h >> 15;
    return h;
}
