/* Motion that depth and cameras do not know of, where a capture has no motion layer. By tiles, and in a tile by materials:
 * has the surface moved by itself? It has where the depth that the history holds is not the one that was there if only the
 * camera moved, or where the colours are farther from the history's than slopes and jitter explain. Then the displacement
 * is searched that makes history and frame agree (taa_search.cl). What moved and is not found has no history. */

/* The arguments of the pass: its ports, those of the ledger when it is asked for, and what every kernel gets. */
#if WANTS_energy
#define TAA_LEDGER global float *clamped, global float *redistributed, global float *energy,
#else
#define TAA_LEDGER
#endif

#define TAA_PORTS                                                                                            \
    global const float *color, global const float *depth, global const float *motion,                        \
        global const uint *stencil, global const float *last_color, global const float *last_depth,          \
        global const uint *last_stencil, global const float *last_count, global float *moved,                \
        global float *out_color, global float *out_count, TAA_LEDGER constant params_t *p,                   \
        constant frame_t *f, constant material_t *materials

#if !HAS_motion

#define DEPTH_NOISE  2e-3f                  /* of the depth: what half floats round away, twice */
#define DEPTH_SLACK  0.25f                  /* pixels that a sample may lie beside where the jitter says */
#define MOVED_SHARE  0.125f                 /* of the lanes at a wrong depth: the surface has moved */
#define APART        2.0f                   /* pixels squared: mean error over mean squared slope of colours that have moved */
#define BETTER       0.5f                   /* of the error is left at most where a displacement is believed */
#define NOWHERE      1e9f                   /* a displacement out of the image */

/* The smaller of the differences to both sides; how unlike they are is added to bend. */
static inline floatv slope(floatv before, floatv here, floatv behind, floatv *bend)
{
    floatv a = here - before, b = behind - here;
    *bend += fabs(b - a);
    return rl_select(a, b, fabs(b) < fabs(a));
}

/* Lanes at whose place the history shows that the surface was not there: another depth of the material than the slope
 * allows between the two samples, or something behind it. Something in front has merely uncovered it. */
static inline intv was_elsewhere(const tile_t *t, global const float *depth, int v)
{
    constant frame_t *f = t->f;
    int x = tile_x(t, v), y = tile_y(t, v);
    floatv bend = 0.0f, z = tap(depth, f, x, y), then = t->then[v];
    floatv gx = slope(tap(depth, f, x - 1, y), z, tap(depth, f, x + 1, y), &bend);
    floatv gy = slope(tap(depth, f, x, y - 1), z, tap(depth, f, x, y + 1), &bend);
    floatv ox = (float)t->bx + (f->previous.jitter[0] - f->camera.jitter[0]) - t->dx[v];
    floatv oy = (float)t->by + (f->previous.jitter[1] - f->camera.jitter[1]) - t->dy[v];
    floatv off = far_if_empty(tap(t->last_depth, f, x + t->bx, y + t->by)) - fma(gx, ox, fma(gy, oy, then));
    floatv most = fma((floatv)DEPTH_SLACK, fabs(gx) + fabs(gy), fma((floatv)DEPTH_NOISE, then, bend));
    intv other = off < -0.04f * then;
#if HAS_stencil
    other |= rl_load_id_edge(t->last_stencil, f, x + t->bx, y + t->by) != t->id;
#endif
    return t->inner[v] & ((off > most) | (~other & (off < -most)));
}

/* Sum of squared differences at the camera's place; with `apart`, of lanes only around which the history shows nothing
 * else: an edge has moved into the colours of the others. */
static inline float still_difference(const tile_t *t, int apart)
{
    floatv sum = 0.0f;
    EACH_LOOKED_AT(t, v) {
        floatv off = expected(t, v) - history(t, v, 0, 0);
        intv same = of_material(t, v, 0, 0);
        for (int i = 0; i < 4 && apart; i++)
            same &= of_material(t, v, (i & 1) * (i - 2), (~i & 1) * (i - 1));
        sum += rl_select(0.0f, off * off, same);
    }
    return sum_lanes(sum);
}

/* 0: it stood still or followed the camera; 1: its colours have moved; 2: it has. */
static inline int has_moved(const tile_t *t, global const float *depth)
{
    floatv elsewhere = 0.0f;
    EACH_LOOKED_AT(t, v)
        elsewhere += rl_select(0.0f, 1.0f, was_elsewhere(t, depth, v));
    if (sum_lanes(elsewhere) > MOVED_SHARE * t->lanes)
        return 2;
    int apart = 0;
    while (apart < 2 && still_difference(t, apart) > APART * t->slopes)
        apart++;
    return apart == 2;
}

/* Adds to the displacements of the lanes `mine` of t what has been found for the tile `of`. */
static inline void add_displacement(tile_t *t, const tile_t *of, const float *s, const intv *mine)
{
    EACH_VECTOR(v) {
        floatv across, down, dx, dy;
        in_tile(v, &across, &down);
        across += (float)(t->x - of->x) * (2.0f / TILE_W);
        down += (float)(t->y - of->y) * (2.0f / TILE_H);
        displace(s, across, down, relief(of, t->then[v]), &dx, &dy);
        t->dx[v] += rl_select(0.0f, dx, mine[v]);
        t->dy[v] += rl_select(0.0f, dy, mine[v]);
    }
}

kernel void taa_motion(TAA_PORTS)
{
    tile_t t = {.f = f, .x = RL_W * (int)get_global_id(0), .y = (int)get_global_id(1)}, near;
    int down = (t.y + f->origin[1]) & (TILE_H - 1);
    if (!f->history || t.x & (TILE_W - 1) || (down && t.y))
        return;
    t.rows = min(TILE_H - down, f->rows - t.y);
    t.last_color = last_color + f->plane;
    t.last_depth = last_depth;
    t.last_stencil = last_stencil;
    uintv left[TILE_N], around[TILE_N]; /* id + 1 of lanes that are not done */
    intv mine[TILE_N], more[TILE_N];
    follow_camera(&t, depth, stencil, left);
    for (;;) {
        uint next = 0;
        EACH_VECTOR(v)
            next = max(next, rl_max_id(left[v]));
        if (!next)
            break;
        take(left, next, mine);
        int what = 0;
        for (t.skip = SKIP;; t.skip = 0) {
            look_at(&t, color + f->plane, stencil, mine, next - 1);
            what = t.lanes < LEAST_LANES ? 0 : has_moved(&t, depth);
            if (!t.skip || (!what && t.lanes >= LEAST_LANES))
                break;
        }
        tile_t *of = &t;
        if (!t.skip && t.lanes < FEW_LANES && (what || t.lanes < LEAST_LANES)) {
            centre_on(&near, &t, mine);
            follow_camera(&near, depth, stencil, around);
            take(around, next, more);
            look_at(&near, color + f->plane, stencil, more, next - 1);
            if (near.lanes > t.lanes) {
                of = &near;
                what = near.lanes < LEAST_LANES ? 0 : has_moved(&near, depth);
            }
        }
        if (!what)
            continue;
        float s[UNKNOWNS];
        if (search(of, s) > BETTER) {
            if (what == 1)
                continue;
            s[0] = NOWHERE;
        }
        add_displacement(&t, of, s, mine);
    }
    EACH_VECTOR(v) {
        if (v / TILE_ACROSS >= t.rows)
            break;
        int at = rl_index(f, tile_x(&t, v), tile_y(&t, v));
        rl_store(t.dx[v], moved, at);
        rl_store(t.dy[v], moved + f->plane, at);
    }
}

#endif
