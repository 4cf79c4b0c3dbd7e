/* Motion that depth and cameras do not know of, where a capture has no motion layer. By tiles, and in a tile by materials:
 * has the surface moved by itself? It has where the depth that the history holds is not the one that was there if only the
 * camera moved, or where the colours are farther from the history's than slopes and jitter explain. Then the displacement
 * is searched that makes history and frame agree: whole pixels by trial, their parts by least squares (Lucas and Kanade
 * 1981). What moved and is not found has no history. Only green is compared. */

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

#define TILE_W       16
#define TILE_H       16
#define TILE_ACROSS  (TILE_W / RL_W)
#define TILE_N       (TILE_ACROSS * TILE_H) /* vectors */
#define EACH_VECTOR(v) _Pragma("unroll 1") for (int v = 0; v < TILE_N; v++)
#define EACH_LOOKED_AT(t, v) EACH_VECTOR(v) if (!(v / TILE_ACROSS & (t)->skip))
#define SKIP         3                      /* rows between those that tell whether a look at all of them is worth it */
#define REACH        8                      /* pixels that are searched, to each side */
#define LEAST_LANES  8                      /* of a material in a tile; fewer tell nothing */
#define FEW_LANES    32                     /* … and fewer, those of a tile around them tell more */
#define DEPTH_NOISE  2e-3f                  /* of the depth: what half floats round away, twice */
#define DEPTH_SLACK  0.25f                  /* pixels that a sample may lie beside where the jitter says */
#define MOVED_SHARE  0.125f                 /* of the lanes at a wrong depth: the surface has moved */
#define APART        2.0f                   /* pixels squared: mean error over mean squared slope of colours that have moved */
#define COLOUR_NOISE 0.01f                  /* of the value: a difference below it is none */
#define BETTER       0.5f                   /* of the error is left at most where a displacement is believed */
#define USUAL_BEND   0.3f                   /* pixels that the displacement changes from the middle of a tile to its side */
#define TERMS        4                      /* of a displacement along x, and along y */
#define UNKNOWNS     (2 * TERMS)
#define MOST_RELIEF  4.0f                   /* half tiles before or behind the middle */
#define TURNS        2                      /* of least squares */
#define FARTHEST     16384.0f               /* pixels that the camera may have displaced it */
#define NOWHERE      1e9f                   /* a displacement out of the image */

/* One material of a tile. */
typedef struct tile_t {
    constant frame_t *f;
    global const float *last_color, *last_depth; /* green */
    global const uint *last_stencil;
    int x, y, rows; /* its first pixel; rows of it in the buffer */
    int skip;       /* 0, or SKIP: only every fourth row is looked at */
    uint id;
    int bx, by;     /* where the camera alone leads the samples, whole pixels */
    float ox, oy;   /* … and the rest */
    intv inner[TILE_N];                              /* lanes of the material, as are the four pixels around */
    floatv dx[TILE_N], dy[TILE_N], then[TILE_N];     /* by the camera: displacement, previous depth */
    floatv green[TILE_N], gx[TILE_N], gy[TILE_N];    /* and its slopes, a pixel */
    float lanes, slopes;                             /* number of inner lanes, sum of their squared slopes */
    float middle, relief;                            /* their mean previous depth; pixels a unit of depth, / half a tile */
} tile_t;

static inline float sum_lanes(floatv v)
{
    float lanes[RL_W], sum = 0.0f;
    rl_vstore(v, 0, lanes);
    for (int i = 0; i < RL_W; i++)
        sum += lanes[i];
    return sum;
}

static inline int tile_x(const tile_t *t, int v)
{
    return t->x + v % TILE_ACROSS * RL_W;
}

static inline int tile_y(const tile_t *t, int v)
{
    return t->y + v / TILE_ACROSS;
}

/* Colour that the history should hold `d` beside the camera's displacement in whole pixels, if nothing else moved. */
static inline floatv expected(const tile_t *t, int v)
{
    constant float *jitter = t->f->camera.jitter;
    floatv ox = t->dx[v] + (jitter[0] - (float)t->bx), oy = t->dy[v] + (jitter[1] - (float)t->by);
    return fma(-t->gx[v], ox, fma(-t->gy[v], oy, t->green[v]));
}

/* Lanes of the tile whose history `d` pixels beside the camera's place is of the material, at about its depth. */
static inline intv of_material(const tile_t *t, int v, int dx, int dy)
{
    int x = tile_x(t, v) + t->bx + dx, y = tile_y(t, v) + t->by + dy;
    intv same = t->inner[v];
#if HAS_stencil
    same &= rl_load_id_edge(t->last_stencil, t->f, x, y) == t->id;
#endif
    return same & (fabs(far_if_empty(tap(t->last_depth, t->f, x, y)) - t->then[v]) <= 0.04f * t->then[v]);
}

static inline floatv history(const tile_t *t, int v, int dx, int dy)
{
    return tap(t->last_color, t->f, tile_x(t, v) + t->bx + dx, tile_y(t, v) + t->by + dy);
}

/* Sum of squared differences; lanes of something else, and such as differ more, count `most`. */
static inline float difference(const tile_t *t, const floatv *want, float most, int dx, int dy)
{
    floatv sum = 0.0f;
    EACH_VECTOR(v) {
        floatv off = want[v] - history(t, v, dx, dy);
        off = rl_select(most, fmin(off * off, most), of_material(t, v, dx, dy));
        sum += rl_select(0.0f, off, t->inner[v]);
    }
    return sum_lanes(sum);
}

/* Where a lane lies in the tile, -1 to 1. */
static inline void in_tile(int v, floatv *across, floatv *down)
{
    *across = (rl_to_floatv(RL_LANES + v % TILE_ACROSS * RL_W) + (0.5f - TILE_W / 2)) * (2.0f / TILE_W);
    *down = ((float)(v / TILE_ACROSS) + (0.5f - TILE_H / 2)) * (2.0f / TILE_H);
}

/* How far it lies behind the middle of the material, in the same unit. */
static inline floatv relief(const tile_t *t, floatv then)
{
    return clamp((then - t->middle) * t->relief, -MOST_RELIEF, MOST_RELIEF);
}

/* x and y of a displacement s: affine, and linear in depth, as what turns moves (Longuet-Higgins and Prazdny 1980). */
static inline void displace(const float *s, floatv across, floatv down, floatv behind, floatv *x, floatv *y)
{
    *x = fma(s[1], across, fma(s[2], down, fma(s[3], behind, (floatv)s[0])));
    *y = fma(s[TERMS + 1], across, fma(s[TERMS + 2], down, fma(s[TERMS + 3], behind, (floatv)s[TERMS])));
}

/* The same difference with the displacement s besides, by the history's slopes; in `normal`, the normal equations
 * for another step: the upper triangle and the right side. */
static inline float fine_difference(const tile_t *t, float most, int dx, int dy, const float *s,
                                    float normal[UNKNOWNS][UNKNOWNS + 1])
{
    floatv sum = 0.0f, a[UNKNOWNS][UNKNOWNS + 1];
    for (int i = 0; i < UNKNOWNS; i++)
        for (int j = i; j <= UNKNOWNS; j++)
            a[i][j] = 0.0f;
    EACH_VECTOR(v) {
        floatv across, down, px, py;
        in_tile(v, &across, &down);
        floatv behind = relief(t, t->then[v]);
        displace(s, across, down, behind, &px, &py);
        px += t->dx[v] + (t->f->camera.jitter[0] - (float)t->bx);
        py += t->dy[v] + (t->f->camera.jitter[1] - (float)t->by);
        intv same = of_material(t, v, dx, dy);
        floatv here = history(t, v, dx, dy), left = history(t, v, dx - 1, dy), right = history(t, v, dx + 1, dy);
        floatv above = history(t, v, dx, dy - 1), below = history(t, v, dx, dy + 1);
        floatv gx = 0.5f * (right - left), gy = 0.5f * (below - above);
        floatv bx = right + left - 2.0f * here, by = below + above - 2.0f * here;
        floatv off = t->green[v] - here - px * fma(0.5f * px, bx, gx) - py * fma(0.5f * py, by, gy);
        gx = fma(px, bx, gx);
        gy = fma(py, by, gy);
        intv use = same & (off * off < most);
        sum += rl_select(0.0f, rl_select(most, off * off, use), t->inner[v]);
        gx = rl_select(0.0f, gx, use);
        gy = rl_select(0.0f, gy, use);
        floatv row[UNKNOWNS + 1] = {gx, gx * across, gx * down, gx * behind, gy, gy * across, gy * down, gy * behind, off};
        for (int i = 0; i < UNKNOWNS; i++)
            for (int j = i; j <= UNKNOWNS; j++)
                a[i][j] = fma(row[i], row[j], a[i][j]);
    }
    for (int i = 0; i < UNKNOWNS; i++)
        for (int j = i; j <= UNKNOWNS; j++)
            normal[i][j] = sum_lanes(a[i][j]);
    return sum_lanes(sum);
}

/* Adds the solution of a symmetric, positive definite system to s; rounding must not make it singular. */
static inline void solve(float a[UNKNOWNS][UNKNOWNS + 1], float *s)
{
    float least[UNKNOWNS];
    for (int i = 0; i < UNKNOWNS; i++)
        least[i] = 1e-6f * a[i][i];
    for (int i = 0; i < UNKNOWNS; i++) {
        a[i][i] = fmax(a[i][i], least[i]);
        for (int k = i + 1; k < UNKNOWNS; k++)
            for (int j = UNKNOWNS; j >= k; j--)
                a[k][j] -= a[i][k] / a[i][i] * a[i][j];
    }
    for (int i = UNKNOWNS - 1; i >= 0; i--) {
        for (int j = i + 1; j < UNKNOWNS; j++)
            a[i][UNKNOWNS] -= a[i][j] * a[j][UNKNOWNS];
        a[i][UNKNOWNS] /= a[i][i];
        s[i] += a[i][UNKNOWNS];
    }
}

/* Finds the displacement s beside the camera's; the share of the difference that is left. */
static inline float search(const tile_t *t, float *s)
{
    floatv want[TILE_N];
    float most = 4.0f * t->slopes / t->lanes, normal[UNKNOWNS][UNKNOWNS + 1];
    EACH_VECTOR(v)
        want[v] = expected(t, v);
    int bx = 0, by = 0;
    float first = 0.0f, best = 0.0f;
    for (int step = 3; step; step--) { /* 3: none at all */
        int cx = bx, cy = by, reach = step == 3 ? 0 : step == 2 ? REACH : 1;
        for (int j = -reach; j <= reach; j += step) {
            for (int i = -reach; i <= reach; i += step) {
                float e = difference(t, want, most, cx + i, cy + j);
                if (step == 3)
                    first = best = e;
                bx = e < best ? cx + i : bx;
                by = e < best ? cy + j : by;
                best = fmin(best, e);
            }
        }
    }
    for (int i = 0; i < UNKNOWNS; i++)
        s[i] = 0.0f;
    _Pragma("unroll 1") for (int turn = 0;; turn++) {
        best = fine_difference(t, most, bx, by, s, normal);
        if (turn == TURNS)
            break;
        float noise = best / t->lanes + 1e-12f;
        for (int i = 0; i < UNKNOWNS; i++) {
            float usual = i % TERMS ? USUAL_BEND : 1.0f;
            normal[i][i] += noise / (usual * usual);
            normal[i][UNKNOWNS] -= i % TERMS ? noise / (usual * usual) * s[i] : 0.0f;
        }
        solve(normal, s);
        int sx = (int)clamp(floor(s[0] + t->ox + 0.5f), -1.0f, 1.0f), sy = (int)clamp(floor(s[TERMS] + t->oy + 0.5f), -1.0f, 1.0f);
        bx += sx;
        by += sy;
        s[0] = clamp(s[0] - (float)sx, -1.0f, 1.0f);
        s[TERMS] = clamp(s[TERMS] - (float)sy, -1.0f, 1.0f);
    }
    s[0] += (float)bx;
    s[TERMS] += (float)by;
    return best / fmax(first, 1e-30f);
}

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

/* Fills t for material `id`, whose lanes `mine` are. */
static inline void look_at(tile_t *t, global const float *green, global const uint *stencil, const intv *mine, uint id)
{
    floatv sum = 0.0f, slopes = 0.0f, dx = 0.0f, dy = 0.0f, then = 0.0f;
    t->id = id;
    EACH_LOOKED_AT(t, v) {
        int x = tile_x(t, v), y = tile_y(t, v);
        t->inner[v] = mine[v];
#if HAS_stencil
        for (int i = -1; i < 2; i += 2)
            t->inner[v] &=
                (rl_load_id_edge(stencil, t->f, x + i, y) == id) & (rl_load_id_edge(stencil, t->f, x, y + i) == id);
#endif
        t->green[v] = tap(green, t->f, x, y);
        t->gx[v] = 0.5f * (tap(green, t->f, x + 1, y) - tap(green, t->f, x - 1, y));
        t->gy[v] = 0.5f * (tap(green, t->f, x, y + 1) - tap(green, t->f, x, y - 1));
        floatv least = COLOUR_NOISE * t->green[v];
        slopes += rl_select(0.0f, fma(t->gx[v], t->gx[v], fma(t->gy[v], t->gy[v], least * least)), t->inner[v]);
        sum += rl_select(0.0f, 1.0f, t->inner[v]);
        dx += rl_select(0.0f, t->dx[v], t->inner[v]);
        dy += rl_select(0.0f, t->dy[v], t->inner[v]);
        then += rl_select(0.0f, t->then[v], t->inner[v]);
    }
    t->lanes = sum_lanes(sum);
    t->slopes = sum_lanes(slopes);
    t->middle = sum_lanes(then) / fmax(t->lanes, 1.0f);
    t->relief = t->f->previous.focal[0] * (2.0f / TILE_W) / fmax(t->middle, 1e-30f);
    t->ox = sum_lanes(dx) / fmax(t->lanes, 1.0f) + t->f->camera.jitter[0];
    t->oy = sum_lanes(dy) / fmax(t->lanes, 1.0f) + t->f->camera.jitter[1];
    t->bx = (int)floor(t->ox + 0.5f);
    t->by = (int)floor(t->oy + 0.5f);
    t->ox -= (float)t->bx;
    t->oy -= (float)t->by;
}

/* Fills in where the camera leads the pixels of t; in `left`, id + 1 of those that it leads somewhere. */
static inline void follow_camera(tile_t *t, global const float *depth, global const uint *stencil, uintv *left)
{
    constant frame_t *f = t->f;
    float m[12];
    int camera_moved = camera_change(f, m);
    EACH_VECTOR(v) {
        int x = tile_x(t, v), y = tile_y(t, v);
        floatv z = far_if_empty(tap(depth, f, x, y)), ratio = 1.0f;
        t->dx[v] = t->dy[v] = 0.0f;
        if (camera_moved)
            follow(f, m, rl_to_floatv(RL_LANES + x), (float)y, z, &t->dx[v], &t->dy[v], &ratio);
        t->then[v] = z * ratio;
        uintv id = 0;
#if HAS_stencil
        id = rl_load_id_edge(stencil, f, x, y);
#endif
        intv use = rl_insidev(f, x, y) & (z < FAR) & (fmax(fabs(t->dx[v]), fabs(t->dy[v])) < FARTHEST);
        left[v] = (id + 1u) & rl_as_uintv(use & (v / TILE_ACROSS < t->rows ? -1 : 0));
    }
}

/* The material's lanes among `left`, which they leave. */
static inline void take(uintv *left, uint next, intv *mine)
{
    EACH_VECTOR(v) {
        mine[v] = left[v] == next;
        left[v] = select(left[v], (uintv)0, mine[v]);
    }
}

/* A tile as large whose middle is that of the lanes `mine` of t. */
static inline void centre_on(tile_t *near, const tile_t *t, const intv *mine)
{
    floatv n = 0.0f, x = 0.0f, y = 0.0f;
    EACH_VECTOR(v) {
        floatv across, down;
        in_tile(v, &across, &down);
        n += rl_select(0.0f, 1.0f, mine[v]);
        x += rl_select(0.0f, across, mine[v]);
        y += rl_select(0.0f, down, mine[v]);
    }
    float lanes = sum_lanes(n);
    *near = (tile_t){.f = t->f, .last_color = t->last_color, .last_depth = t->last_depth, .last_stencil = t->last_stencil};
    near->x = t->x + (int)floor(sum_lanes(x) / lanes * (TILE_W / 2) + 0.5f);
    near->y = t->y + (int)floor(sum_lanes(y) / lanes * (TILE_H / 2) + 0.5f);
    near->rows = TILE_H;
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
