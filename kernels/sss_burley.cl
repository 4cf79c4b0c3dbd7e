/* Importance-sampled subsurface scattering with Burley's profile (Golubev 2018), in the form that suits wide
 * vectors: the pattern is turned a phase at a time, so that a tap is one offset for a whole vector and every
 * load contiguous; one scale serves the lanes of a vector that are about equally far away, and each lane's
 * weights use its own.
 *
 * Tap i stands for the light of 1/n of a profile at its exact place, and reads the pixel that this place is
 * in: of the mixture of the channels' profiles, so that narrow ones have taps too (passes/burley.h). So the
 * sum over taps tends to the sum over pixels of the profile's integral over the pixel's square:
 * sss_reference. On a plane that faces the camera the mean over patterns is that sum, whatever n is (settle()
 * below).
 *
 * How wrong: the common scale is off by up to 11 % for a lane, so its filter ends between 0.89 and 1.11
 * r_max, where 0.25 % of the light is (its weights are exact). Laid into the tangent plane (`orientation:
 * tangent`) taps follow the mean plane of their lanes; a lane that is turned away from the others gets none
 * from the ends of its own disk. */

/* The ports of the pass, in their order. */
#define BURLEY_PORTS                                                                                         \
    global const float *diffuse, global const float *lit, global const float *albedo,                        \
        global const float *normal, global const float *depth, global const uint *stencil,                   \
        global float *area, global float *filtered, global float *color, global float *gain, SCATTER_LEDGER  \
        constant params_t *p, constant frame_t *f, constant material_t *materials, global const float *tables

/* From weights w and weighted light c to what one channel sends out, a pixel's `own` light given. Weights add
 * up to another sum with each pattern; `share` is that sum beside the mean of all patterns, on a plane. The
 * mean c/w leans to the own light of pixels, since c counts for more where w is small: with 21 taps of the
 * widest profile alone, one thirty times narrower is off by 0.018 of stripes and 0.034 of grain; with those
 * of the mixture by 0.003. Counting c/w for `share` and the own light for the rest, the quotient cancels on a
 * plane: unbiased, and even light stays even everywhere. */
static inline floatv settle(floatv own, floatv c, floatv w, float share)
{
    floatv v = fma((floatv)share, c / w - own, own);
    return rl_select(own, fmax(v, fmin(own, 0.0f)), w > MIN_WEIGHT);
}

/* What n taps say, whose patterns start at `taps`, of the pixels' own light in `out`, times `bend`
 * (weighting: surface); lanes without a sample keep their own light. */
static inline void sum_taps(const inputs_t *in, const group_t *g, global const float *taps, int n,
                            const floatv *bend, floatv *out)
{
    int stride = tap_stride(n), plane = in->f->plane4;
    taps = pattern_of(g, taps, n);
    global const float *share = taps + 3 * stride;
    floatv w0 = 0.0f, w1 = 0.0f, w2 = 0.0f, c0 = 0.0f, c1 = 0.0f, c2 = 0.0f;
    taps_t block;
#if WANTS_energy
    rejected_t rejected = {{0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.0f}};
    const floatv own[3] = {out[0], out[1], out[2]};
#endif
    AREA(floatv per_own = 1.0f / rl_vload(0, in->area + g->v.at);)
    for (int first = 0; first < n; first += TAP_BLOCK) {
        int last = min(TAP_BLOCK, n - first);
        place_taps(in, g, taps, stride, first, last, &block);
        for (int i = 0; i < AHEAD; i++)
            fetch_tap(in, block.at[i]);
        for (int i = 0; i < last; i++) {
            int a = block.at[i];
            fetch_tap(in, block.at[i + AHEAD]);
            intv same = rl_as_intv(rl_vload(0, in->stencil + a)) == g->material;
            floatv dz = scatter_keep((rl_vload(0, in->depth + a) - g->z) * g->inv_d, same);
            floatv stands = block.weight[i], e[3];
            AREA(stands *= rl_select((floatv)1.0f, rl_vload(0, in->area + a) * per_own, same);)
            weigh_tap(g, &block, i, dz, stands, same | g->keep, e);
            w0 += e[0];
            w1 += e[1];
            w2 += e[2];
            c0 = fma(e[0], scatter_keep(rl_vload(0, in->diffuse + a), same), c0);
            c1 = fma(e[1], scatter_keep(rl_vload(0, in->diffuse + plane + a), same), c1);
            c2 = fma(e[2], scatter_keep(rl_vload(0, in->diffuse + 2 * plane + a), same), c2);
#if WANTS_energy
            weigh_tap(g, &block, i, dz, block.weight[i], ~same, e);
            for (int c = 0; c < 3; c++)
                scatter_reject(&rejected, c, e[c], scatter_inside(in->f, &g->v, block.dx[i], block.dy[i]));
#endif
        }
    }
#if WANTS_energy
    const floatv w[3] = {w0, w1, w2}, light[3] = {c0, c1, c2};
#endif
    out[0] = settle(out[0], c0, w0, share[0]) BEND(*bend[0]);
    out[1] = settle(out[1], c1, w1, share[1]) BEND(*bend[1]);
    out[2] = settle(out[2], c2, w2, share[2]) BEND(*bend[2]);
#if WANTS_energy
    for (int c = 0; c < 3; c++) {
        floatv raw = fma((floatv)share[c], light[c] / w[c] - own[c], own[c]) BEND(*bend[c]); /* as settle() has it */
        raw = rl_select(out[c], raw, w[c] > MIN_WEIGHT);
        scatter_account(out, c, own[c], share[c], w[c], light[c], &rejected, g->keep, raw, out[c], MIN_WEIGHT);
    }
#endif
}

/* 0 below 0.9 of the threshold, 1 above 1.1 of it. */
static inline floatv beyond(floatv rho, float threshold)
{
    return clamp((rho - 0.9f * threshold) * (5.0f / threshold), 0.0f, 1.0f);
}

/* The lanes `now` of the group, with the pattern that their size on screen asks for. */
static inline void filter_group(const inputs_t *in, const group_t *g, constant params_t *p,
                                global const float *taps, const floatv *bend, intv now, floatv *out)
{
    floatv sum[SCATTER_OUT];
    for (int c = 0; c < SCATTER_OUT; c++)
        sum[c] = out[c];
    if (p->taps > 0) {
        sum_taps(in, g, taps, p->taps, bend, sum);
    } else {
        float focal = fmax(in->f->camera.focal[0], in->f->camera.focal[1]);
        floatv rho = BURLEY_RADIUS * focal / (g->inv_d * g->z);
        floatv some = beyond(rho, LOD_SOME), many = beyond(rho, LOD_MANY);
        if (!scatter_any(now & (some > 0.0f)))
            return;
        floatv fine[SCATTER_OUT];
        for (int c = 0; c < SCATTER_OUT; c++)
            fine[c] = out[c];
        if (scatter_any(now & (many < 1.0f)))
            sum_taps(in, g, taps, TAPS_SOME, bend, sum);
        if (scatter_any(now & (many > 0.0f)))
            sum_taps(in, g, taps + patterns_floats(TAPS_SOME), TAPS_MANY, bend, fine);
        for (int c = 0; c < SCATTER_OUT; c++) {
            sum[c] = fma(many, fine[c] - sum[c], sum[c]);
            sum[c] = fma(some, sum[c] - out[c], out[c]);
        }
    }
    for (int c = 0; c < SCATTER_OUT; c++)
        out[c] = rl_select(out[c], sum[c], now);
}

static inline void filter_material(const inputs_t *in, const vector_t *v, constant params_t *p,
                                   global const float *tables, global const float *gain, int material,
                                   constant material_t *mat, intv mine, floatv *out)
{
    group_t g = group_of(in, v, p, tables, material, mat);
    global const float *taps = tables + (int)tables[TABLE_PATTERNS + material];
    floatv bend[3];
    BEND(read_bend(in, &g, gain, bend);)
    while (scatter_any(mine)) {
        intv now = take_group(in, &g, &mine);
        filter_group(in, &g, p, taps, bend, now, out);
    }
}

kernel void sss_burley_filter(BURLEY_PORTS)
{
    inputs_t in = {diffuse, depth, area, stencil, f};
    vector_t v = scatter_vector(f);
    intv id = rl_as_intv(rl_vload(0, stencil + v.at)), left = id != 0;
    if (!scatter_any(left))
        return;
    floatv out[SCATTER_OUT];
    for (int c = 0; c < SCATTER_OUT; c++)
        out[c] = c < 3 ? rl_vload(0, diffuse + c * f->plane4 + v.at) : (floatv)0.0f;
    while (scatter_any(left)) {
        int m = scatter_max_int(id & left);
        intv mine = left & (id == m);
        left &= ~mine;
        if (materials[m].has_profile)
            filter_material(&in, &v, p, tables, gain, m, &materials[m], mine, out);
    }
    for (int c = 0; c < 3; c++)
        rl_vstore(out[c], 0, filtered + c * f->plane4 + v.at);
#if WANTS_energy
    SCATTER_KEEP_LEDGER(out, f->plane4, v.at)
#endif
}

kernel void sss_burley_gain(BURLEY_PORTS)
{
    inputs_t in = {diffuse, depth, area, stencil, f};
    BEND(find_gain(&in, p, materials, tables, gain);)
}

kernel void sss_burley_area(BURLEY_PORTS)
{
    AREA(scatter_area(depth, stencil, area, f);)
}

kernel void sss_burley_resolve(BURLEY_PORTS)
{
    scatter_resolve(filtered, lit, albedo, normal, stencil, color, f, materials);
}

#if WANTS_energy
kernel void sss_burley_energy(BURLEY_PORTS)
{
    SCATTER_ENERGY(RL_PHASE4);
}
#endif
