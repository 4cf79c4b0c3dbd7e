/* Temporal anti-aliasing (DESIGN 4.6). A displacement leads from a pixel to where its surface was in the history, both
 * without jitter: a static camera gives exactly 0. Lanes whose displacement has the same whole part are done together,
 * so that every history load is contiguous. */

#define DEPTH_TOLERANCE 0.02f          /* of the depth: what is nearer or farther is something else */
#define SNAP            (1.0f / 1024)  /* pixels: displacements this close to a whole number are taken as whole */
#define SLIDES          0.25f          /* pixels a frame: an edge that moves faster over what is behind it leaves it behind */
#define MOST            5              /* of 9: a half plane that covers the middle leaves at most 4 */
#define EDGE_FRAMES     4.0f           /* what history is worth at a moving edge: that of what turns is not where its surface was */
#define RESAMPLED_FRAMES 6.0f          /* what history between pixels is worth: each frame resamples it again, and loses detail */
#define COUNT_MAX       65536.0f       /* a frame's weight in a plain mean never gets below 1/COUNT_MAX */
#define STILL           3.0f           /* the box is this much wider where nothing moves: jitter alone scatters colours */

/* ---- where it was ---------------------------------------------------------------------------------------------- */

typedef struct place_t {
    floatv dx, dy; /* displacement, pixels */
    floatv then;   /* depth that the pixel's own surface had, if only the camera moved */
    floatv low, high; /* … and the least and largest of its material in 3x3 */
    intv alone;    /* nothing but the pixel's own surface in 3x3 */
    intv edge;     /* another depth in 3x3 */
    intv behind;   /* a closer surface in 3x3 */
    intv follows;  /* … which moves otherwise than the pixel's own, and whose displacement this is */
} place_t;

static inline floatv snap(floatv d)
{
    floatv whole = floor(d + 0.5f);
    return rl_select(d, whole, fabs(d - whole) < SNAP);
}

/* The displacement of the pixel's own surface or, where another is in front of it in 3x3, of the closest (Karis 2014), so
 * that an edge moves as one. On one and the same surface a neighbour's displacement would be wrong by a little in the same
 * direction in every frame. */
COPIED void find_place(constant frame_t *f, global const float *depth, global const float *motion,
                       global const uint *stencil, int x, int y, uintv id, place_t *p, const int inside)
{
    float m[12];
    int moved = camera_change(f, m);
    floatv own = far_if_empty(rl_load(depth, rl_index(f, x, y))), best = own, last = own, ratio = 1.0f, ignored[2];
    p->alone = (intv)-1;
    p->low = p->high = own;
    floatv own_dx = tap(motion, f, x, y), own_dy = tap(motion + f->plane, f, x, y), near_dx = own_dx, near_dy = own_dy;
    RL_UNROLL
    for (int i = 0; i < 9; i++) {
        int nx = x + i % 3 - 1, ny = y + i / 3 - 1;
        if (i == 4)
            continue;
        floatv z = far_if_empty(tap_near(depth, f, nx, ny, inside));
        intv closer = z < best;
        best = fmin(best, z);
        last = fmax(last, z);
#if HAS_stencil
        intv mine = rl_as_uintv(tap_near((global const float *)stencil, f, nx, ny, inside)) == id;
        p->alone &= mine;
        p->low = rl_select(p->low, fmin(p->low, z), mine);
        p->high = rl_select(p->high, fmax(p->high, z), mine);
#endif
        near_dx = rl_select(near_dx, tap_near(motion, f, nx, ny, inside), closer);
        near_dy = rl_select(near_dy, tap_near(motion + f->plane, f, nx, ny, inside), closer);
    }
    p->edge = last > best * (1.0f + DEPTH_TOLERANCE);
    p->alone &= ~p->edge;
    p->behind = best < own * (1.0f - DEPTH_TOLERANCE);
    if (moved)
        follow(f, m, rl_to_floatv(RL_LANES + x), (float)y, own, &ignored[0], &ignored[1], &ratio);
    p->then = rl_select(FAR, own * ratio, own < FAR);
    p->low *= ratio;
    p->high *= ratio;
    p->follows = p->behind & (fmax(fabs(near_dx - own_dx), fabs(near_dy - own_dy)) > SLIDES);
    p->dx = snap(rl_select(own_dx, near_dx, p->behind));
    p->dy = snap(rl_select(own_dy, near_dy, p->behind));
}

/* ---- what was there -------------------------------------------------------------------------------------------- */

typedef struct history_t {
    global const float *color, *depth, *count;
    global const uint *stencil;
} history_t;

/* Lanes whose nearest history pixel is of their surface. */
static inline intv nearest_same(constant frame_t *f, const history_t *h, uintv id, floatv z, int x, int y, intv right,
                                intv below, int whole)
{
    intv same = 0;
    for (int i = 0; i < (whole ? 1 : 4); i++) {
        intv nearest = (i & 1 ? right : ~right) & (i & 2 ? below : ~below);
#if HAS_stencil
        nearest &= rl_load_id_edge(h->stencil, f, x + (i & 1), y + (i >> 1)) == id;
#endif
        floatv t = far_if_empty(tap(h->depth, f, x + (i & 1), y + (i >> 1)));
        same |= nearest & (fabs(t - z) <= 2 * DEPTH_TOLERANCE * z);
    }
    return same;
}

/* Lanes of `mask` whose surface was at the place. Where a pixel is alone now no straight edge goes through it, and the
 * nearest history pixel must be of its surface, or most of 3x3: what was there then is smaller than a pixel, and this
 * frame's jitter has missed it. Elsewhere, at edges, it is a matter of jitter anyway: the depths of its
 * material in 3x3 now and in 3x3 around each pixel between which the place lies must overlap. (Ranges, since towards its outline a surface falls off within a pixel.) */
static inline intv same_surface(constant frame_t *f, const history_t *h, uintv id, const place_t *p, intv mask, int x, int y,
                                intv right, intv below, int whole)
{
    intv across = p->dx != floor(p->dx), down = p->dy != floor(p->dy);
    floatv low = 2 * FAR, high = 0.0f, z = p->then;
    intv most = 0, same = p->alone & nearest_same(f, h, id, z, x, y, right, below, whole);
    if (!rl_any(mask & ~same))
        return same;
    for (int j = -1; j < 3 - whole; j++) {
        for (int i = -1; i < 3 - whole; i++) {
            intv near = (i == -1 ? ~right : i == 2 ? right : (intv)-1) & (j == -1 ? ~below : j == 2 ? below : (intv)-1);
            intv use = (i == 2 ? across : (intv)-1) & (j == 2 ? down : (intv)-1);
#if HAS_stencil
            use &= rl_load_id_edge(h->stencil, f, x + i, y + j) == id;
#endif
            floatv t = far_if_empty(tap(h->depth, f, x + i, y + j));
            low = rl_select(low, fmin(low, t), use);
            high = rl_select(high, fmax(high, t), use);
            most -= use & near & (fabs(t - z) <= 2 * DEPTH_TOLERANCE * z);
        }
    }
    same |= p->alone & (most >= MOST);
    return same |
           (~p->alone & (p->high >= low * (1.0f - DEPTH_TOLERANCE)) & (p->low <= high * (1.0f + DEPTH_TOLERANCE)));
}

/* The count is negative where a pixel followed the edge of another surface: what is there is not of its own surface's past,
 * and is of no use once the edge has left. */
static inline floatv nearest_count(constant frame_t *f, const history_t *h, int x, int y, intv right, intv below, int whole)
{
    floatv n = tap(h->count, f, x, y);
    if (whole)
        return n;
    n = rl_select(n, tap(h->count, f, x + 1, y), right & ~below);
    n = rl_select(n, tap(h->count, f, x, y + 1), below & ~right);
    return rl_select(n, tap(h->count, f, x + 1, y + 1), below & right);
}

/* Lanes whose material is in the set. */
static inline intv in_set(constant int *set, uintv id)
{
    intv in = 0;
    for (int i = 0; i < 8; i++)
        if (set[i])
            in |= (id >> 5 == (uint)i) & ((((uintv)(uint)set[i] >> (id & 31u)) & 1u) != 0u);
    return in;
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

#if WANTS_energy
#define TAA_PAST 6 /* the history's colour; for the ledger the same before it was clamped */
#else
#define TAA_PAST 3
#endif

kernel void taa(TAA_PORTS)
{
    int x = RL_W * (int)get_global_id(0), y = (int)get_global_id(1), at = rl_index(f, x, y);
    history_t h = {last_color, last_depth, last_count, last_stencil};
    floatv own[3], count = 1.0f;
    RL_UNROLL
    for (int c = 0; c < 3; c++)
        own[c] = rl_load(color, at + c * f->plane);
    floatv result[3] = {own[0], own[1], own[2]};
#if WANTS_energy
    floatv cut[3] = {0.0f, 0.0f, 0.0f}, brought[3] = {0.0f, 0.0f, 0.0f};
#endif
    if (f->history && rl_any(rl_insidev(f, x, y))) {
        place_t place;
        box_t box;
        uintv id = 0;
#if HAS_stencil
        id = rl_load_id(stencil, at);
#endif
        int inside = columns_inside(f, x);
        if (inside)
            find_place(f, depth, HAS_motion ? motion : moved, stencil, x, y, id, &place, 1);
        else
            find_place(f, depth, HAS_motion ? motion : moved, stencil, x, y, id, &place, 0);
        floatv dx = place.dx, dy = place.dy;
        intv still = (dx == 0.0f) & (dy == 0.0f);
        floatv gamma = rl_select(p->clip_gamma, STILL * p->clip_gamma, still);
        if (inside)
            colour_box(&box, f, color, own, x, y, gamma, 1);
        else
            colour_box(&box, f, color, own, x, y, gamma, 0);
        floatv tx = dx - floor(dx), ty = dy - floor(dy);
        intv right = tx > 0.5f, below = ty > 0.5f;
        uintv key = displacement_key(f, x, y, dx, dy) & ~rl_as_uintv(in_set(p->exclude, id));
        for (uint now = rl_max_id(key); now; now = rl_max_id(key)) {
            intv mask = key == now;
            key = select(key, (uintv)0, mask);
            int hx = x + (int)(now >> 16) - 32768, hy = y + (int)(now & 65535) - 32768;
            int whole = !rl_any(mask & ((tx != 0.0f) | (ty != 0.0f)));
            mask &= same_surface(f, &h, id, &place, mask, hx, hy, right, below, whole);
            floatv past[TAA_PAST], n = nearest_count(f, &h, hx, hy, right, below, whole);
            mask &= ~((n < 0.0f) & (place.alone | (place.behind & ~place.follows)));
            if (!rl_any(mask))
                continue;
            n = rl_select(fabs(n), fmin(fabs(n), RESAMPLED_FRAMES), (tx != 0.0f) | (ty != 0.0f));
            n = rl_select(n, fmin(n, EDGE_FRAMES), place.edge & ~still);
            if (whole)
                RL_UNROLL
                for (int c = 0; c < 3; c++)
                    past[c] = tap(h.color + c * f->plane, f, hx, hy);
            else
                resample(f, h.color, hx, hy, tx, ty, past);
#if WANTS_energy
            for (int c = 0; whole && c < 3; c++)
                past[3 + c] = past[c];
#endif
            clip_to_box(&box, own, past);
            floatv alpha = fmax(1.0f / (1.0f + n), p->blend);
            floatv w = alpha * firefly_weight(&box, own), w_past = (1.0f - alpha) * firefly_weight(&box, past);
            floatv share = w / (w + w_past);
            RL_UNROLL
            for (int c = 0; c < 3; c++)
                result[c] = rl_select(result[c], fma(own[c] - past[c], share, past[c]), mask);
#if WANTS_energy
            RL_UNROLL
            for (int c = 0; c < 3; c++) {
                cut[c] = rl_select(cut[c], (past[3 + c] - past[c]) * (1.0f - share), mask);
                brought[c] = rl_select(brought[c], (past[3 + c] - own[c]) * (1.0f - share), mask);
            }
#endif
            n = fmin(n + 1.0f, COUNT_MAX);
            count = rl_select(count, rl_select(n, -n, place.follows), mask);
        }
    }
    RL_UNROLL
    for (int c = 0; c < 3; c++)
        rl_store(result[c], out_color, at + c * f->plane);
    rl_store(count, out_count, at);
#if WANTS_energy
    RL_UNROLL
    for (int c = 0; c < 3; c++) {
        rl_store(cut[c], clamped, at + c * f->plane);
        rl_store(brought[c], redistributed, at + c * f->plane);
    }
#endif
}

#if WANTS_energy
kernel void taa_energy(TAA_PORTS)
{
    band_t band = energy_band(energy, f);
    ENERGY_EACH_VECTOR(f, band, x, y)
    {
        int at = rl_index(f, x, y);
        floatv values[ENERGY_PIXELS];
        uintv id = 0;
#if HAS_stencil
        id = rl_load_id(stencil, at);
#endif
        energy_clear(values);
        RL_UNROLL
        for (int c = 0; c < 3; c++) {
            values[ENERGY_IN + c] = rl_load(color, at + c * f->plane);
            values[ENERGY_OUT + c] = rl_load(out_color, at + c * f->plane);
            values[ENERGY_CLAMPED + c] = rl_load(clamped, at + c * f->plane);
            values[ENERGY_REDISTRIBUTED + c] = rl_load(redistributed, at + c * f->plane);
        }
        energy_post_all(&band, f, x, y, id, values);
    }
}
#endif
