/* Temporal anti-aliasing (DESIGN 4.6). A displacement leads from a pixel to where its surface was in the history, both
 * without jitter: a static camera gives exactly 0. Lanes whose displacement has the same whole part are done together,
 * so that every history load is contiguous. */

#define FAR             1e18f          /* depth where there is nothing */
#define DEPTH_TOLERANCE 0.02f          /* of the depth: history nearer or farther shows something else */
#define SNAP            (1.0f / 1024)  /* pixels: displacements this close to a whole number are taken as whole */
#define COUNT_MAX       65536.0f       /* a frame's weight in a plain mean never gets below 1/COUNT_MAX */
#define STILL           2.0f           /* the box is this much wider where nothing moves: jitter alone scatters colours */
#define BOX_MIN         1e-6f          /* least half width of the colour box, radiance */

static inline floatv tap(global const float *p, constant frame_t *f, int x, int y)
{
    return rl_load_edge(p, f, x, y);
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
static inline void colour_box(box_t *b, constant frame_t *f, global const float *color, const floatv *own, int x, int y,
                              floatv gamma)
{
    floatv sum[3] = {0.0f, 0.0f, 0.0f}, squares[3] = {0.0f, 0.0f, 0.0f}, brightest = 0.0f, own_y[3];
    to_ycocg(own, own_y);
#pragma unroll
    for (int i = 0; i < 9; i++) {
        if (i == 4)
            continue;
        floatv d[3], v[3];
        for (int c = 0; c < 3; c++)
            d[c] = tap(color + c * f->plane, f, x + i % 3 - 1, y + i / 3 - 1) - own[c];
        to_ycocg(d, v);
        brightest = fmax(brightest, v[0] + own_y[0]);
        for (int c = 0; c < 3; c++) {
            sum[c] += v[c];
            squares[c] = fma(v[c], v[c], squares[c]);
        }
    }
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
    for (int c = 0; c < 3; c++)
        d[c] = history[c] - own[c];
    to_ycocg(d, v);
    for (int c = 0; c < 3; c++) {
        v[c] -= b->middle[c];
        out = fmax(out, fabs(v[c]) / b->half_width[c]);
    }
    intv outside = out > 1.0f;
    for (int c = 0; c < 3; c++)
        v[c] = v[c] / out + b->middle[c];
    from_ycocg(v, d);
    for (int c = 0; c < 3; c++)
        history[c] = rl_select(history[c], own[c] + d[c], outside); /* inside: untouched */
}

/* Karis' 1 / (1 + luminance), of what exceeds twice the brightest neighbour: 1 but for fireflies. */
static inline floatv firefly_weight(const box_t *b, const floatv *rgb)
{
    floatv luminance = fma(0.25f, rgb[0] + rgb[2], 0.5f * rgb[1]);
    return 1.0f / (1.0f + fmax(luminance - 2.0f * b->brightest, 0.0f));
}

/* ---- where it was ---------------------------------------------------------------------------------------------- */

/* previous view = m (3 rows of 3) * ray * depth + m[9…11], from this frame's view. Returns 0 when nothing changed. */
static inline int camera_change(constant frame_t *f, float *m)
{
    constant camera_t *a = &f->camera, *b = &f->previous;
    int same = a->focal[0] == b->focal[0] && a->focal[1] == b->focal[1] && a->centre[0] == b->centre[0] &&
               a->centre[1] == b->centre[1];
    for (int i = 0; i < 12; i++)
        same = same && a->to_view[i] == b->to_view[i];
    for (int i = 0; i < 3; i++) {
        constant float *row = &b->to_view[4 * i];
        for (int j = 0; j < 3; j++)
            m[3 * i + j] = row[0] * a->to_world[j] + row[1] * a->to_world[4 + j] + row[2] * a->to_world[8 + j];
        m[9 + i] = row[0] * a->to_world[3] + row[1] * a->to_world[7] + row[2] * a->to_world[11] + row[3];
    }
    return !same;
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

static inline floatv snap(floatv d)
{
    floatv whole = floor(d + 0.5f);
    return rl_select(d, whole, fabs(d - whole) < SNAP);
}

/* Displacement of the closest surface in 3x3 (Karis 2014), so that an edge moves as one; the depth that the pixel's own
 * surface had then, if only the camera moved. */
static inline void find_displacement(constant frame_t *f, global const float *depth, global const float *motion, int x,
                                     int y, floatv *dx, floatv *dy, floatv *then)
{
    float m[12];
    floatv own = far_if_empty(rl_load(depth, rl_index(f, x, y))), best = own, ox = 0.0f, oy = 0.0f;
    int moved = camera_change(f, m);
    *then = own;
    *dx = *dy = 0.0f;
#if HAS_motion
    *dx = tap(motion, f, x, y);
    *dy = tap(motion + f->plane, f, x, y);
#else
    if (!moved)
        return;
#endif
    for (int i = 0; i < 9; i++) {
        int nx = x + i % 3 - 1, ny = y + i / 3 - 1;
        floatv z = far_if_empty(tap(depth, f, nx, ny));
        intv closer = z < best;
        best = rl_select(best, z, closer);
#if HAS_motion
        *dx = rl_select(*dx, tap(motion, f, nx, ny), closer);
        *dy = rl_select(*dy, tap(motion + f->plane, f, nx, ny), closer);
#else
        ox = rl_select(ox, (floatv)(float)(i % 3 - 1), closer);
        oy = rl_select(oy, (floatv)(float)(i / 3 - 1), closer);
#endif
    }
    floatv px = rl_to_floatv(RL_LANES + x), py = (float)y, ratio, ignored_x, ignored_y;
#if !HAS_motion
    follow(f, m, px + ox, py + oy, best, dx, dy, &ratio);
#endif
    if (moved) {
        follow(f, m, px, py, own, &ignored_x, &ignored_y, &ratio);
        *then = rl_select(FAR, own * ratio, own < FAR);
    }
    *dx = snap(*dx);
    *dy = snap(*dy);
}

/* ---- what was there -------------------------------------------------------------------------------------------- */

typedef struct history_t {
    global const float *color, *depth, *count;
    global const uint *stencil;
} history_t;

/* Lanes whose surface is among those of the 3x3 history pixels around the place: the same material, and a depth between
 * the least and the largest that it has there. Bracketing makes slopes and jitter agree, but not another surface. */
static inline intv same_surface(constant frame_t *f, const history_t *h, uintv id, floatv z, int x, int y, intv right,
                                intv below, int whole)
{
    floatv low = 2 * FAR, high = 0.0f;
    for (int j = -1; j < 3 - whole; j++) {
        for (int i = -1; i < 3 - whole; i++) {
            intv use = (i == -1 ? ~right : i == 2 ? right : (intv)-1) & (j == -1 ? ~below : j == 2 ? below : (intv)-1);
#if HAS_stencil
            use &= rl_load_id_edge(h->stencil, f, x + i, y + j) == id;
#endif
            floatv t = far_if_empty(tap(h->depth, f, x + i, y + j));
            low = rl_select(low, fmin(low, t), use);
            high = rl_select(high, fmax(high, t), use);
        }
    }
    return (z >= low * (1.0f - DEPTH_TOLERANCE)) & (z <= high * (1.0f + DEPTH_TOLERANCE));
}

/* Catmull-Rom weights for t in 0…1 between the second and the third sample. */
static inline void catmull_rom(floatv t, floatv *w)
{
    w[0] = t * fma(t, fma(t, (floatv)-0.5f, 1.0f), -0.5f);
    w[1] = fma(t * t, fma(t, (floatv)1.5f, -2.5f), 1.0f);
    w[2] = t * fma(t, fma(t, (floatv)-1.5f, 2.0f), 0.5f);
    w[3] = t * t * fma(t, (floatv)0.5f, -0.5f);
}

/* History colour between pixels, 16 loads a channel. Ringing must not make light negative. */
static inline void resample(constant frame_t *f, global const float *color, int x, int y, floatv tx, floatv ty,
                            floatv *out)
{
    floatv wx[4], wy[4];
    catmull_rom(tx, wx);
    catmull_rom(ty, wy);
    for (int c = 0; c < 3; c++) {
        floatv sum = 0.0f, least = 0.0f;
#pragma unroll
        for (int j = 0; j < 4; j++) {
            floatv row = 0.0f;
#pragma unroll
            for (int i = 0; i < 4; i++) {
                floatv v = tap(color + c * f->plane, f, x + i - 1, y + j - 1);
                row = fma(wx[i], v, row);
                least = fmin(least, v);
            }
            sum = fma(wy[j], row, sum);
        }
        out[c] = fmax(sum, least);
    }
}

/* Lanes whose displacement leads into the image, and its whole part as one word that is never 0. */
static inline uintv displacement_key(constant frame_t *f, int x, int y, floatv dx, floatv dy)
{
    floatv px = rl_to_floatv(RL_LANES + x) + dx, py = (float)y + dy;
    intv inside = (px >= f->valid[0] - 0.5f) & (px < f->valid[2] - 0.5f) & (py >= f->valid[1] - 0.5f) &
                  (py < f->valid[3] - 0.5f) & rl_insidev(f, x, y);
    intv ix = rl_to_intv(floor(rl_select(0.0f, dx, inside))), iy = rl_to_intv(floor(rl_select(0.0f, dy, inside)));
    return rl_as_uintv(((ix + 32768) << 16 | (iy + 32768)) & inside);
}

kernel void taa(global const float *color, global const float *depth, global const float *motion,
                global const uint *stencil, global const float *last_color, global const float *last_depth,
                global const uint *last_stencil, global const float *last_count, global float *out_color,
                global float *out_count, constant params_t *p, constant frame_t *f, constant material_t *materials)
{
    int x = RL_W * (int)get_global_id(0), y = (int)get_global_id(1), at = rl_index(f, x, y);
    history_t h = {last_color, last_depth, last_count, last_stencil};
    floatv own[3], count = 1.0f;
    for (int c = 0; c < 3; c++)
        own[c] = rl_load(color, at + c * f->plane);
    floatv result[3] = {own[0], own[1], own[2]};
    if (f->history && rl_any(rl_insidev(f, x, y))) {
        floatv dx, dy, then;
        box_t box;
        find_displacement(f, depth, motion, x, y, &dx, &dy, &then);
        colour_box(&box, f, color, own, x, y, rl_select(p->clip_gamma, STILL * p->clip_gamma, (dx == 0.0f) & (dy == 0.0f)));
        floatv tx = dx - floor(dx), ty = dy - floor(dy);
        intv right = tx > 0.5f, below = ty > 0.5f;
        uintv id = 0, key = displacement_key(f, x, y, dx, dy);
#if HAS_stencil
        id = rl_load_id(stencil, at);
#endif
        for (uint now = rl_max_id(key); now; now = rl_max_id(key)) {
            intv mask = key == now;
            key = select(key, (uintv)0, mask);
            int hx = x + (int)(now >> 16) - 32768, hy = y + (int)(now & 65535) - 32768;
            int whole = !rl_any(mask & ((tx != 0.0f) | (ty != 0.0f)));
            mask &= same_surface(f, &h, id, then, hx, hy, right, below, whole);
            if (!rl_any(mask))
                continue;
            floatv past[3], n = tap(h.count, f, hx, hy);
            if (whole) {
                for (int c = 0; c < 3; c++)
                    past[c] = tap(h.color + c * f->plane, f, hx, hy);
            } else {
                floatv n_right = tap(h.count, f, hx + 1, hy), n_below = tap(h.count, f, hx, hy + 1);
                n = rl_select(rl_select(n, n_right, right),
                              rl_select(n_below, tap(h.count, f, hx + 1, hy + 1), right), below);
                resample(f, h.color, hx, hy, tx, ty, past);
            }
            clip_to_box(&box, own, past);
            floatv alpha = fmax(1.0f / (1.0f + n), p->blend);
            floatv w = alpha * firefly_weight(&box, own), w_past = (1.0f - alpha) * firefly_weight(&box, past);
            floatv share = w / (w + w_past);
            for (int c = 0; c < 3; c++)
                result[c] = rl_select(result[c], fma(own[c] - past[c], share, past[c]), mask);
            count = rl_select(count, fmin(n + 1.0f, COUNT_MAX), mask);
        }
    }
    for (int c = 0; c < 3; c++)
        rl_store(result[c], out_color, at + c * f->plane);
    rl_store(count, out_count, at);
}
