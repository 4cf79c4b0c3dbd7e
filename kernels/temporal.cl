/* What temporal filters share: taps, the colour box around a pixel, the way back through two cameras, and history between
 * pixels. Kernels that use it have the ports of taa. */

#define FAR     1e18f /* depth where there is nothing */
#define BOX_MIN 1e-6f /* least half width of the colour box, radiance */

static inline floatv tap(global const float *p, constant frame_t *f, int x, int y)
{
    return rl_load_edge(p, f, x, y);
}

#define COPIED static inline __attribute__((always_inline)) /* a copy for each value of a constant argument */

/* Apart: the few vectors at the edges are not worth compiling it once a load. */
static __attribute__((noinline)) floatv tap_apart(global const float *p, constant frame_t *f, int x, int y)
{
    return tap(p, f, x, y);
}

/* A tap where it is known whether the vector and its neighbours to the left and right lie in the image's columns: as a
 * constant, so that no load asks again, which keeps what surrounds the loads in one piece. */
COPIED floatv tap_near(global const float *p, constant frame_t *f, int x, int y, const int inside)
{
    return inside ? rl_load(p, rl_index(f, x, clamp(y, f->valid[1], f->valid[3] - 1))) : tap_apart(p, f, x, y);
}

static inline int columns_inside(constant frame_t *f, int x)
{
    return x > f->valid[0] && x + RL_W < f->valid[2];
}

static inline floatv far_if_empty(floatv z)
{
    return rl_select(FAR, z, z > 0.0f);
}

/* ---- the colours around the pixel ----------------------------------------------------------------------------- */

static inline void to_ycocg(const floatv *rgb, floatv *out)
{
    floatv t = 0.25f * (rgb[0] + rgb[2]);
    out[0] = fma(0.5f, rgb[1], t);
    out[1] = 0.5f * (rgb[0] - rgb[2]);
    out[2] = fma(0.5f, rgb[1], -t);
}

static inline void from_ycocg(const floatv *v, floatv *rgb)
{
    floatv t = v[0] - v[2];
    rgb[0] = t + v[1];
    rgb[1] = v[0] + v[2];
    rgb[2] = t - v[1];
}

typedef struct box_t {
    floatv middle[3], half_width[3]; /* YCoCg, relative to the pixel's own colour */
    floatv brightest;                /* largest Y of the eight neighbours */
} box_t;

/* Mean and deviation of the 3x3 neighbourhood (Salvi 2016), around the pixel's own colour, which keeps the variance from
 * cancelling. The box is grown to contain that colour: a detail as small as a pixel would else be clipped away. */
COPIED void colour_box(box_t *b, constant frame_t *f, global const float *color, const floatv *own, int x, int y,
                              floatv gamma, const int inside)
{
    floatv sum[3] = {0.0f, 0.0f, 0.0f}, squares[3] = {0.0f, 0.0f, 0.0f}, brightest = 0.0f, own_y[3];
    to_ycocg(own, own_y);
#pragma unroll
    for (int i = 0; i < 9; i++) {
        if (i == 4)
            continue;
        floatv d[3], v[3];
        RL_UNROLL
        for (int c = 0; c < 3; c++)
            d[c] = tap_near(color + c * f->plane, f, x + i % 3 - 1, y + i / 3 - 1, inside) - own[c];
        to_ycocg(d, v);
        brightest = fmax(brightest, v[0] + own_y[0]);
        RL_UNROLL
        for (int c = 0; c < 3; c++) {
            sum[c] += v[c];
            squares[c] = fma(v[c], v[c], squares[c]);
        }
    }
    RL_UNROLL
    for (int c = 0; c < 3; c++) {
        floatv mean = sum[c] * (1.0f / 9);
        floatv reach = gamma * sqrt(fmax(fma(-mean, mean, squares[c] * (1.0f / 9)), 0.0f));
        floatv low = fmin(mean - reach, 0.0f), high = fmax(mean + reach, 0.0f);
        b->middle[c] = 0.5f * (low + high);
        b->half_width[c] = fmax(0.5f * (high - low), BOX_MIN);
    }
    b->brightest = brightest;
}

/* Moves the history towards the middle of the box until it is inside. */
static inline void clip_to_box(const box_t *b, const floatv *own, floatv *history)
{
    floatv d[3], v[3], out = 1.0f;
    RL_UNROLL
    for (int c = 0; c < 3; c++)
        d[c] = history[c] - own[c];
    to_ycocg(d, v);
    RL_UNROLL
    for (int c = 0; c < 3; c++) {
        v[c] -= b->middle[c];
        out = fmax(out, fabs(v[c]) / b->half_width[c]);
    }
    intv outside = out > 1.0f;
    RL_UNROLL
    for (int c = 0; c < 3; c++)
        v[c] = v[c] / out + b->middle[c];
    from_ycocg(v, d);
    RL_UNROLL
    for (int c = 0; c < 3; c++)
        history[c] = rl_select(history[c], own[c] + d[c], outside); /* inside: untouched */
}

/* Karis' 1 / (1 + luminance), of what exceeds twice the brightest neighbour: 1 but for fireflies. */
static inline floatv firefly_weight(const box_t *b, const floatv *rgb)
{
    floatv luminance = fma(0.25f, rgb[0] + rgb[2], 0.5f * rgb[1]);
    return 1.0f / (1.0f + fmax(luminance - 2.0f * b->brightest, 0.0f));
}

/* ---- the way back ------------------------------------------------------------------------------------------------ */

/* previous view = m (3 rows of 3) * ray * depth + m[9…11], from this frame's view. Returns 0 when nothing changed. */
static inline int camera_change(constant frame_t *f, float *m)
{
    constant camera_t *a = &f->camera, *b = &f->previous;
    int4 other = (vload4(0, a->focal) != vload4(0, b->focal)) | /* and the centres behind */
                 (vload4(0, a->to_view) != vload4(0, b->to_view)) |
                 (vload4(1, a->to_view) != vload4(1, b->to_view)) |
                 (vload4(2, a->to_view) != vload4(2, b->to_view));
    if (!(other.x | other.y | other.z | other.w))
        return 0;
    for (int i = 0; i < 3; i++) {
        constant float *row = &b->to_view[4 * i];
        for (int j = 0; j < 3; j++)
            m[3 * i + j] = row[0] * a->to_world[j] + row[1] * a->to_world[4 + j] + row[2] * a->to_world[8 + j];
        m[9 + i] = row[0] * a->to_world[3] + row[1] * a->to_world[7] + row[2] * a->to_world[11] + row[3];
    }
    return 1;
}

/* Displacement of what is seen at (x, y) at depth z, by the cameras alone; `closer` is previous depth / z. */
static inline void follow(constant frame_t *f, const float *m, floatv x, floatv y, floatv z, floatv *dx, floatv *dy,
                          floatv *closer)
{
    constant camera_t *a = &f->camera, *b = &f->previous;
    float ox = (float)f->origin[0] + 0.5f + a->jitter[0], oy = (float)f->origin[1] + 0.5f + a->jitter[1];
    floatv rx = (x + (ox - a->centre[0])) / a->focal[0], ry = -(y + (oy - a->centre[1])) / a->focal[1];
    floatv near = 1.0f / z;
    floatv vx = fma(m[0], rx, fma(m[1], ry, fma(m[9], near, (floatv)-m[2])));
    floatv vy = fma(m[3], rx, fma(m[4], ry, fma(m[10], near, (floatv)-m[5])));
    floatv vz = -fma(m[6], rx, fma(m[7], ry, fma(m[11], near, (floatv)-m[8])));
    intv front = vz > 1e-6f; /* behind the previous camera: leads out of the image */
    floatv scale = 1.0f / rl_select(1.0f, vz, front);
    *dx = rl_select(1e9f, b->focal[0] * vx * scale - (x + (ox - b->centre[0])), front);
    *dy = rl_select(1e9f, -b->focal[1] * vy * scale - (y + (oy - b->centre[1])), front);
    *closer = vz;
}

/* ---- history between pixels ------------------------------------------------------------------------------------- */

/* Weights of the six samples around t in 0…1 between the third and the fourth: a cubic spline through 36 samples in the
 * plane (Dersch's "Spline36"). A history is resampled again in every frame, so what a kernel loses is lost many times:
 * Catmull-Rom keeps 91 % of a wave of 4.3 pixels at half a pixel, this 99.5 %. */
static inline void spline36(floatv t, floatv *w)
{
    floatv u = 1.0f - t;
    w[0] = t * fma(t, fma(t, (floatv)(1.0f / 11), -45.0f / 209), 26.0f / 209);
    w[1] = t * fma(t, fma(t, (floatv)(-6.0f / 11), 270.0f / 209), -156.0f / 209);
    w[2] = fma(t, fma(t, fma(t, (floatv)(13.0f / 11), -453.0f / 209), -3.0f / 209), 1.0f);
    w[3] = fma(u, fma(u, fma(u, (floatv)(13.0f / 11), -453.0f / 209), -3.0f / 209), 1.0f);
    w[4] = u * fma(u, fma(u, (floatv)(-6.0f / 11), 270.0f / 209), -156.0f / 209);
    w[5] = u * fma(u, fma(u, (floatv)(1.0f / 11), -45.0f / 209), 26.0f / 209);
}

/* History colour between pixels, 36 loads a channel. Ringing must not make light negative. For the ledger `out` has three
 * channels more: the same with it. */
static inline void resample(constant frame_t *f, global const float *color, int x, int y, floatv tx, floatv ty,
                            floatv *out)
{
    floatv wx[6], wy[6];
    spline36(tx, wx);
    spline36(ty, wy);
    RL_UNROLL
    for (int c = 0; c < 3; c++) {
        floatv sum = 0.0f, least = 0.0f;
#pragma unroll
        for (int j = 0; j < 6; j++) {
            floatv row = 0.0f;
#pragma unroll
            for (int i = 0; i < 6; i++) {
                floatv v = tap(color + c * f->plane, f, x + i - 2, y + j - 2);
                row = fma(wx[i], v, row);
                least = fmin(least, v);
            }
            sum = fma(wy[j], row, sum);
        }
        out[c] = fmax(sum, least);
#if WANTS_energy
        out[3 + c] = sum;
#endif
    }
}
