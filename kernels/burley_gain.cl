/* weighting: surface (scatter_surface.cl) of sss_burley.cl, behind burley_taps.cl: gain, how much more or less light
 * than a flat surface a curved one sends out. It depends on the surface's shape alone, which changes less from pixel to
 * pixel than light and texture do: it is found for one pixel of 4x4, by twice as many taps as the filter has, and
 * interpolated between those of the same material. Where there is none within 4 pixels, it is taken for flat (`area`).
 *
 * How wrong: beside a gain for each pixel, in a dense sum, results differ by 0.04 to 0.08 % on average on a captured head,
 * and by 0.04 to 0.16 % on a ball of wax 92 pixels wide. Where one material folds over itself, an ear before a cheek, the
 * pixels within 4 of the fold mix the gains of both sides; those means have them in, but for 2 pixels at the fold. */

#if P_weighting == WEIGHTING_SURFACE
#define BEND(x) x

/* The pixel of 4x4 that has one, (1, 1). Its three channels are in the sub-images of its phase and the next two. */
#define GAIN_AT    1
#define GAIN_PHASE (4 * GAIN_AT + GAIN_AT)
#define GAIN_TAPS  2 /* times as many as the filter's, in patterns of their own behind the filter's */

static inline int gain_stride(constant frame_t *f)
{
    return (f->rows >> 2) * f->stride4;
}

/* gain[c] by n taps of the group. What counts as black is on the tangent plane here, so it makes no gain; where the
 * surface has turned away it has no weight. */
static inline void sum_shape(const inputs_t *in, const group_t *g, global const float *taps, int n,
                             floatv gain[3])
{
    floatv planar[3] = {0.0f, 0.0f, 0.0f}, more[3] = {0.0f, 0.0f, 0.0f};
    floatv per_own = 1.0f / rl_vload(0, in->area + g->v.at), per_z = 1.0f / g->z;
    floatv slope_x = g->plane.x * per_z, slope_y = g->plane.y * per_z;
    taps_t block;
    taps = pattern_of(g, taps, n);
    for (int first = 0; first < n; first += TAP_BLOCK) {
        int last = min(TAP_BLOCK, n - first);
        place_taps(in, g, taps, tap_stride(n), first, last, &block);
        for (int i = 0; i < AHEAD; i++)
            fetch_shape(in, block.at[i]);
        for (int i = 0; i < last; i++) {
            int a = block.at[i];
            fetch_shape(in, block.at[i + AHEAD]);
            intv id = rl_as_intv(rl_vload(0, in->stencil + a)), same = id == g->material;
            floatv other = rl_vload(0, in->depth + a), p[3], w[3];
            floatv f = fma(slope_x, (floatv)(float)block.dx[i], slope_y * (float)block.dy[i]);
            floatv k = scatter_plane_scale(f), deeper = f * k;
            intv away = 0;
            if (scatter_any(~same))
                away = scatter_turned_away(in, &g->v, block.dx[i], block.dy[i], id, other,
                                           fma(g->z, deeper, g->z));
            intv curved = same | (away & ~g->keep);
            weigh_tap(g, &block, i, g->z_u * deeper, block.weight[i] * (k * k * k), curved | g->keep, p);
            weigh_tap(g, &block, i, scatter_keep((other - g->z) * g->inv_d, same),
                      block.weight[i] * rl_vload(0, in->area + a) * per_own, same, w);
            for (int c = 0; c < 3; c++) {
                planar[c] += p[c];
                more[c] += w[c] - scatter_keep(p[c], curved);
            }
        }
    }
    for (int c = 0; c < 3; c++)
        gain[c] = scatter_keep(more[c] / planar[c], planar[c] > MIN_WEIGHT);
}

/* The gain of the pixels that have one, in `to`. */
static inline void find_gain(const inputs_t *in, constant params_t *p, constant material_t *materials,
                             global const float *tables, global float *to)
{
    if (get_global_id(0) != GAIN_PHASE)
        return;
    vector_t v = scatter_vector(in->f);
    intv id = rl_as_intv(rl_vload(0, in->stencil + v.at)), left = id != 0;
    floatv gain[3] = {0.0f, 0.0f, 0.0f};
    int n = min(GAIN_TAPS * (p->taps > 0 ? p->taps : TAPS_MANY), MOST_TAPS);
    int skip = p->taps > 0 ? patterns_floats(p->taps) : patterns_floats(TAPS_SOME) + patterns_floats(TAPS_MANY);
    while (scatter_any(left)) {
        int m = scatter_max_int(id & left);
        intv mine = left & (id == m);
        left &= ~mine;
        if (!materials[m].has_profile)
            continue;
        group_t g = group_of(in, &v, p, tables, m, &materials[m]);
        global const float *taps = tables + (int)tables[TABLE_PATTERNS + m] + skip;
        while (scatter_any(mine)) {
            intv now = take_group(in, &g, &mine);
            floatv found[3];
            sum_shape(in, &g, taps, n, found);
            for (int c = 0; c < 3; c++)
                gain[c] = rl_select(gain[c], found[c], now);
        }
    }
    for (int c = 0; c < 3; c++)
        rl_vstore(gain[c], 0, to + v.at + c * gain_stride(in->f));
}

/* 1 + cos * gain, interpolated. */
static inline void read_bend(const inputs_t *in, const group_t *g, global const float *gain, floatv bend[3])
{
    const vector_t *v = &g->v;
    int left = GAIN_AT - v->px, up = GAIN_AT - v->py, stride = gain_stride(in->f);
    left -= left > 0 ? 4 : 0;
    up -= up > 0 ? 4 : 0;
    floatv all = 0.0f, sum[3] = {0.0f, 0.0f, 0.0f};
    for (int j = 0; j < 2; j++)
        for (int i = 0; i < 2; i++) {
            float share = (1.0f - 0.25f * (float)abs(left + 4 * i)) * (1.0f - 0.25f * (float)abs(up + 4 * j));
            if (share <= 0.0f)
                continue;
            int at = scatter_at(in->f, v, left + 4 * i, up + 4 * j);
            intv same = rl_as_intv(rl_vload(0, in->stencil + at)) == g->material;
            all += scatter_keep((floatv)share, same);
            for (int c = 0; c < 3; c++)
                sum[c] += scatter_keep(share * rl_vload(0, gain + at + c * stride), same);
        }
    floatv cosine = scatter_cosine(g->z, g->rx, g->ry, rl_vload(0, in->area + v->at));
    floatv scale = scatter_keep(cosine / all, all > 0.0f);
    for (int c = 0; c < 3; c++)
        bend[c] = fma(scale, sum[c], (floatv)1.0f);
}
#else
#define BEND(x)
#endif
