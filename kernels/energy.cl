/* The ledger of energy (graph/run/energy.h), behind common.cl: what a pass adds up when somebody asks for its sums.
 * Nothing of it is in the program otherwise. A step over RL_EVERY_BAND goes through the vectors of a band in order and
 * posts what their lanes have, a material at a time. Lanes are added up for as long as the material stays the same, a row
 * at most; then they join sums of two floats (Knuth's two-sum), 48 bits together. */
#ifndef WANTS_energy
#define WANTS_energy 0
#endif

#if WANTS_energy
#define ENERGY_PORT global float *energy,
#else
#define ENERGY_PORT
#endif

#if WANTS_energy

typedef struct band_t {
    global float *sums; /* of material 0 */
    int first, last;    /* rows */
    uint material;      /* that `lanes` are of */
    floatv lanes[RL_SUM_VALUES];
} band_t;

/* The band of a work-item, with empty sums. */
static inline band_t energy_band(global float *energy, constant frame_t *f)
{
    int i = get_global_id(0), n = 2 * RL_SUM_VALUES * min(f->materials, RL_SUM_MATERIALS);
    int rows = (f->rows + RL_BANDS - 1) / RL_BANDS;
    band_t b;
    b.sums = energy + 2 * RL_SUM_VALUES * RL_SUM_MATERIALS * i;
    b.first = max(f->valid[1], i * rows);
    b.last = min(f->valid[3], (i + 1) * rows);
    for (int k = 0; k < n; k++)
        b.sums[k] = 0.0f;
    b.material = 0;
    for (int k = 0; k < RL_SUM_VALUES; k++)
        b.lanes[k] = 0.0f;
    return b;
}

static inline float energy_lanes(floatv v)
{
#if RL_W == 16
    float8 h = v.lo + v.hi;
    float4 q = h.lo + h.hi;
#elif RL_W == 8
    float4 q = v.lo + v.hi;
#else
    float4 q = v;
#endif
    float2 p = q.lo + q.hi;
    return p.x + p.y;
}

static inline void energy_add(global float *sum, float v)
{
    float s = sum[0], t = s + v, b = t - s;
    sum[1] += (s - (t - b)) + (v - b);
    sum[0] = t;
}

static inline void energy_flush(band_t *b)
{
    global float *sum = b->sums + 2 * RL_SUM_VALUES * min(b->material, (uint)RL_SUM_MATERIALS - 1);
    for (int i = 0; i < RL_SUM_VALUES; i++) {
        energy_add(sum + 2 * i, energy_lanes(b->lanes[i]));
        b->lanes[i] = 0.0f;
    }
}

/* The vectors of a band that have pixels of the image. */
#define ENERGY_EACH_VECTOR(f, b, x, y)                                                                       \
    for (int y = (b).first; y < (b).last; energy_flush(&(b)), y++)                                           \
        for (int x = (f)->valid[0] / RL_W * RL_W; x < (f)->valid[2]; x += RL_W)

/* The lanes of one material: the values in their order, and how many lanes there are. */
static inline void energy_post(band_t *b, uint material, intv lanes, const floatv *values)
{
    if (material != b->material) {
        energy_flush(b);
        b->material = material;
    }
    for (int i = 0; i < ENERGY_PIXELS; i++)
        b->lanes[i] += rl_as_floatv(rl_as_intv(values[i]) & lanes);
    b->lanes[ENERGY_PIXELS] += rl_select((floatv)0.0f, (floatv)1.0f, lanes);
}

/* The same for all materials that a vector has, without one included. */
static inline void energy_post_all(band_t *b, constant frame_t *f, int x, int y, uintv id, const floatv *values)
{
    intv left = rl_insidev(f, x, y);
    while (rl_any(left)) {
        uint now = rl_max_id(select((uintv)0, id, left));
        intv mine = left & (id == now);
        left &= ~mine;
        energy_post(b, now, mine, values);
    }
}

static inline void energy_clear(floatv *values)
{
    for (int i = 0; i < ENERGY_PIXELS; i++)
        values[i] = 0.0f;
}
#endif
