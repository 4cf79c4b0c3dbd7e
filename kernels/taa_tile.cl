/* What a tile shows of one material, now and in the history: the search of taa_search.cl and taa_motion.cl looks at it. Only
 * green is compared. */

#if !HAS_motion

#define TILE_W       16
#define TILE_H       16
#define TILE_ACROSS  (TILE_W / RL_W)
#define TILE_N       (TILE_ACROSS * TILE_H) /* vectors */
#define EACH_VECTOR(v) _Pragma("unroll 1") for (int v = 0; v < TILE_N; v++)
#define EACH_LOOKED_AT(t, v) EACH_VECTOR(v) if (!(v / TILE_ACROSS & (t)->skip))
#define SKIP         3                      /* rows between those that tell whether a look at all of them is worth it */
#define LEAST_LANES  8                      /* of a material in a tile; fewer tell nothing */
#define FEW_LANES    32                     /* … and fewer, those of a tile around them tell more */
#define COLOUR_NOISE 0.01f                  /* of the value: a difference below it is none */
#define MOST_RELIEF  4.0f                   /* half tiles before or behind the middle */
#define FARTHEST     16384.0f               /* pixels that the camera may have displaced it */

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
    float middle, relief;                            /* their mean previous depth; half tiles a unit of depth */
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

/* Where a lane lies in the tile, -1 to 1. */
static inline void in_tile(int v, floatv *across, floatv *down)
{
    *across = (rl_to_floatv(RL_LANES + v % TILE_ACROSS * RL_W) + (0.5f - TILE_W / 2)) * (2.0f / TILE_W);
    *down = ((float)(v / TILE_ACROSS) + (0.5f - TILE_H / 2)) * (2.0f / TILE_H);
}

/* How far what was at depth `then` lies behind the middle of the material, in half tiles, as places in the tile. */
static inline floatv relief(const tile_t *t, floatv then)
{
    return clamp((then - t->middle) * t->relief, -MOST_RELIEF, MOST_RELIEF);
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

#endif
