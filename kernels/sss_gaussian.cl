/* Subsurface scattering with a mixture of Gaussians (Helix, after Jimenez and d'Eon). Weights come from
 * distances between view-space positions, every Gaussian is normalized by itself, and what the weights leave of
 * 1 is the light of the pixel itself.
 *
 * A Gaussian ends at 3 sigma of the widest of its material, or at TAIL sigma of its own where that is nearer:
 * 4e-5 of it lie beyond. In separable form (a line of pixels, then the other way) a square is cut out, else a
 * ball. `weighting: area` counts a sample by the surface that its pixel sees, in both directions of the
 * separable form.
 *
 * How wrong: the 3 sigma leave out 1.1 % of the widest Gaussian (0.5 % as a square) and, normalized, 5.1 % of
 * its variance (2.7 %); of those less than two thirds as wide, 0.04 % (0.014 %). A Gaussian under about half a
 * pixel wide is sampled too coarsely: at sigma = 0.5 pixels its variance is 15 % too small, at 0.3 pixels it is
 * all gone. Separable distances are those of two steps, one after the other, at right angles only where the
 * surface is parallel to the screen: there the form is exact. Mean difference to the full sum on a head with
 * skin's fitted set: 0.5, 0.3, 0.1 %; on a ball of wax (fitted set, radius about 40 mm, widest sigma 15 mm):
 * 1.4, 1.3, 0.8 %. */

#define MOST_GAUSSIANS 4    /* the table's, passes/sss_gaussian.c */
#define TAIL           4.5f /* sigma */
#define MOST_PIXELS    4096.0f

/* The ports of the pass, in their order. */
#define GAUSSIAN_PORTS                                                                                       \
    global const float *diffuse, global const float *lit, global const float *albedo,                        \
        global const float *normal, global const float *depth, global const uint *stencil,                   \
        global float *area, global float *line, global float *filtered, global float *color,                 \
        SCATTER_LEDGER constant params_t *p,                                                                 \
        constant frame_t *f, constant material_t *materials

#if P_weighting == WEIGHTING_AREA
#define AREA(x) x
#else
#define AREA(x)
#endif

/* Where a Gaussian of a material ends. */
typedef struct gaussian_t {
    float fall;    /* exponent of 2 a m²: -1 / (2 variance ln 2) */
    float reach2;  /* m² */
    float lateral; /* the same on the plane z = -1: no sample beyond it is within reach of any lane */
} gaussian_t;

/* What the filters read; `light` is what they average, 3 planes. */
typedef struct planes_t {
    global const float *light, *depth, *area;
    global const uint *stencil;
    constant frame_t *f;
} planes_t;

/* The lanes of a vector that have one material. */
typedef struct lanes_t {
    planes_t in;
    int x, y;                  /* of lane 0 */
    int material;
    intv keep;    /* all bits: samples that are none count as black */
    floatv z, rx; /* depth, and the ray on the plane z = -1 */
    floatv per_area; /* 1 / the surface that the pixel sees */
    float ry;
    float nearest, slant; /* the least depth, the longest ray of the lanes */
} lanes_t;

static inline lanes_t gather_lanes(const planes_t *in, constant material_t *mat, int material, intv mine, int x,
                                   int y)
{
    constant frame_t *f = in->f;
    lanes_t l;
    l.in = *in;
    l.x = x;
    l.y = y;
    l.material = material;
    l.keep = mat->profile_border == BORDER_OCCLUDE ? -1 : 0;
    l.z = rl_load(in->depth, rl_index(f, x, y));
    l.per_area = 1.0f;
    AREA(l.per_area = 1.0f / rl_load(in->area, rl_index(f, x, y));)
    l.rx = rl_ray_x(f, &f->camera, rl_to_floatv(RL_LANES + x));
    l.ry = rl_ray_y(f, &f->camera, (float)y);
    l.nearest = scatter_nearest(l.z, mine);
    l.slant = sqrt(1.0f + l.ry * l.ry + scatter_farthest(l.rx * l.rx, mine));
    return l;
}

/* A sample at distance reach lies at most reach * slant / (nearest - reach) away on the plane z = -1. Closer to
 * the camera than twice the reach that bound is kept at twice reach * slant / nearest, and samples that stand
 * still nearer to the camera are left out. */
static inline gaussian_t gaussian_of(constant material_t *mat, int g, const lanes_t *l)
{
    float widest = 0.0f, variance = mat->profile_gaussians_variance_mm2[g];
    for (int i = 0; i < mat->profile_gaussians_n; i++)
        widest = fmax(widest, mat->profile_gaussians_variance_mm2[i]);
    float reach = 1e-3f * fmin(3.0f * sqrt(widest), TAIL * sqrt(variance));
    gaussian_t gaussian;
    gaussian.fall = -0.72134752e6f / variance;
    gaussian.reach2 = reach * reach;
    gaussian.lateral = reach * l->slant / fmax(l->nearest - reach, 0.5f * l->nearest);
    return gaussian;
}

/* Pixels of a lateral reach; a surface that touches the camera does not stop the device. */
static inline int pixels_of(float lateral, float focal)
{
    return (int)fmin(lateral * focal, MOST_PIXELS);
}

/* The sample (dx, dy) pixels away. */
typedef struct sample_t {
    int at;
    intv same;  /* inside of the image, and the material is the lanes' */
    floatv far2; /* distance², m²; for what is no sample, as if it were as deep as the lane */
    floatv area; /* relative to the lane's own; 1 for what is no sample */
} sample_t;

static inline sample_t sample_of(const lanes_t *l, int dx, int dy)
{
    constant frame_t *f = l->in.f;
    sample_t s;
    int x = l->x + dx, y = l->y + dy;
    /* Whole vectors outside of the image read something that is there, and are masked. */
    s.at = rl_index(f, clamp(x, -RL_W, f->columns), clamp(y, 0, f->rows - 1));
    s.same = rl_as_intv(rl_load_id(l->in.stencil, s.at)) == l->material;
    if (x < 0 || x + RL_W > f->columns || y < 0 || y >= f->rows)
        s.same &= rl_insidev(f, x, y);
    float u = (float)dx / f->camera.focal[0], v = (float)dy / -f->camera.focal[1];
    floatv dz = scatter_keep(rl_load(l->in.depth, s.at) - l->z, s.same);
    s.far2 = scatter_far2(l->z, l->rx, l->ry, u, v, dz);
    s.area = 1.0f;
    AREA(s.area = rl_select(s.area, rl_load(l->in.area, s.at) * l->per_area, s.same);)
    return s;
}

static inline floatv weight_of(const gaussian_t *gaussian, const lanes_t *l, const sample_t *s)
{
    return scatter_keep(weight_exp2(s->far2 * gaussian->fall) AREA(*s->area),
                        (s->same | l->keep) & (s->far2 <= gaussian->reach2));
}

#if WANTS_energy
/* The weight that a sample would have which is none. */
static inline void reject(const gaussian_t *gaussian, const lanes_t *l, const sample_t *s, int dx, int dy,
                          rejected_t *r)
{
    floatv w = scatter_keep(weight_exp2(s->far2 * gaussian->fall), ~s->same & (s->far2 <= gaussian->reach2));
    intv inside = rl_insidev(l->in.f, l->x + dx, l->y + dy);
    for (int c = 0; c < 3; c++)
        scatter_reject(r, c, w, inside);
}
#endif

static inline floatv light_of(const lanes_t *l, const sample_t *s, int c)
{
    return scatter_keep(rl_load(l->in.light, s->at + c * l->in.f->plane), s->same);
}

/* What the weights leave of a channel. */
static inline float unblurred(constant material_t *mat, int c)
{
    float sum = 0.0f;
    for (int g = 0; g < mat->profile_gaussians_n; g++)
        sum += mat->profile_gaussians_weight[3 * g + c];
    return fmax(1.0f - sum, 0.0f);
}

/* A work-item's vector in strips of STRIP vectors from top to bottom, not in rows: what lies within reach above
 * and below stays in the cache. Narrower strips would leave the lines of DRAM and the pages half used. */
#define STRIP 16
static inline int2 place_in_strip(constant frame_t *f)
{
    int vectors = get_global_size(0), n = (int)get_global_id(1) * vectors + (int)get_global_id(0);
    int strip = n / (STRIP * f->rows), width = min(STRIP, vectors - strip * STRIP);
    n -= strip * STRIP * f->rows;
    return (int2)(RL_W * (strip * STRIP + n % width), n / width);
}

#if P_separable

/* The mean of the light along a row (ALONG_X) or a column. */
enum { ALONG_X, ALONG_Y };
static inline void mean_along(int axis, const lanes_t *l, const gaussian_t *gaussian, floatv *mean)
{
    constant frame_t *f = l->in.f;
    int n = pixels_of(gaussian->lateral, f->camera.focal[axis]);
    int first = -n, last = n;
    if (!(l->keep.s0 | WANTS_energy)) { /* nothing to see beyond the image but for the ledger */
        first = max(first, axis == ALONG_X ? f->valid[0] - l->x - (RL_W - 1) : f->valid[1] - l->y);
        last = min(last, axis == ALONG_X ? f->valid[2] - 1 - l->x : f->valid[3] - 1 - l->y);
    }
    floatv w = 0.0f, c0 = 0.0f, c1 = 0.0f, c2 = 0.0f;
#if WANTS_energy
    rejected_t rejected = {{0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.0f}};
#endif
    for (int i = first; i <= last; i++) {
        sample_t s = axis == ALONG_X ? sample_of(l, i, 0) : sample_of(l, 0, i);
        floatv e = weight_of(gaussian, l, &s);
        w += e;
        c0 = fma(e, light_of(l, &s, 0), c0);
        c1 = fma(e, light_of(l, &s, 1), c1);
        c2 = fma(e, light_of(l, &s, 2), c2);
#if WANTS_energy
        reject(gaussian, l, &s, axis == ALONG_X ? i : 0, axis == ALONG_X ? 0 : i, &rejected);
#endif
    }
    floatv per = 1.0f / w; /* the pixel itself has weight 1 */
    mean[0] = c0 * per;
    mean[1] = c1 * per;
    mean[2] = c2 * per;
#if WANTS_energy
    const floatv light[3] = {c0, c1, c2};
    for (int c = 0; c < 3; c++)
        scatter_account(mean, c, rl_load(l->in.light, rl_index(f, l->x, l->y) + c * f->plane), 1.0f, w, light[c],
                        &rejected, l->keep, mean[c], mean[c], 0.0f);
#endif
}

/* A Gaussian's share of the ledger joins that of the others, of the lanes `mine`; the planes begin with the first
 * Gaussian's rows. */
#if WANTS_energy
#define LEDGER_PARAMETERS                                                                                    \
    , global float *border, global float *off_screen, global float *clamped, global float *redistributed
#define LEDGER_ARGUMENTS , border, off_screen, clamped, redistributed
#define LEDGER_ADD(g, mat, mean, mine, at)                                                            \
    for (int c = 0; c < 3; c++) {                                                                            \
        global float *parts[4] = {border, off_screen, clamped, redistributed};                               \
        for (int i = 0; i < 4; i++) {                                                                        \
            global float *part = parts[i] + c * f->plane;                                                    \
            floatv sum = rl_load(part, at);                                                                  \
            floatv weight = (mat)->profile_gaussians_weight[3 * (g) + c];                                    \
            rl_store(rl_select(sum, fma(weight, (mean)[3 + 3 * i + c], sum), mine), part, at);               \
        }                                                                                                    \
    }
#else
#define LEDGER_PARAMETERS
#define LEDGER_ARGUMENTS
#define LEDGER_ADD(g, mat, mean, mine, at)
#endif

/* Gaussian g along the rows, into `line`. */
static inline void filter_rows(int g, const planes_t *in, global float *line, constant material_t *materials
                               LEDGER_PARAMETERS)
{
    constant frame_t *f = in->f;
    int x = RL_W * (int)get_global_id(0), y = get_global_id(1), at = rl_index(f, x, y), found = 0;
    intv id = rl_as_intv(rl_load_id(in->stencil, at)), left = id != 0;
    floatv out[3] = {0.0f, 0.0f, 0.0f};
#if WANTS_energy
    const floatv nothing[SCATTER_OUT] = {0.0f};
    if (!g)
        SCATTER_KEEP_LEDGER(nothing, f->plane, at)
#endif
    while (scatter_any(left)) {
        int m = scatter_max_int(id & left);
        intv mine = left & (id == m);
        left &= ~mine;
        constant material_t *mat = &materials[m];
        if (!mat->has_profile || g >= mat->profile_gaussians_n)
            continue;
        lanes_t l = gather_lanes(in, mat, m, mine, x, y);
        gaussian_t gaussian = gaussian_of(mat, g, &l);
        floatv mean[SCATTER_OUT];
        mean_along(ALONG_X, &l, &gaussian, mean);
        LEDGER_ADD(g, mat, mean, mine, at)
        for (int c = 0; c < 3; c++)
            out[c] = rl_select(out[c], mean[c], mine);
        found = 1;
    }
    for (int c = 0; found && c < 3; c++)
        rl_store(out[c], line, at + c * f->plane);
}

/* Gaussian g of in->light, which went along the rows, along the columns; blended into `filtered`. The first
 * puts the unblurred share there. */
static inline void filter_columns(int g, const planes_t *in, global const float *diffuse, global float *filtered,
                                  constant material_t *materials LEDGER_PARAMETERS)
{
    constant frame_t *f = in->f;
    int2 place = place_in_strip(f);
    int at = rl_index(f, place.x, place.y), found = 0;
    intv id = rl_as_intv(rl_load_id(in->stencil, at)), left = id != 0;
    if (!scatter_any(left))
        return;
    floatv out[3];
    for (int c = 0; c < 3; c++)
        out[c] = g ? rl_load(filtered, at + c * f->plane) : rl_load(diffuse, at + c * f->plane);
    while (scatter_any(left)) {
        int m = scatter_max_int(id & left);
        intv mine = left & (id == m);
        left &= ~mine;
        constant material_t *mat = &materials[m];
        if (!mat->has_profile)
            continue;
        found |= !g; /* without Gaussians all is unblurred */
        if (g >= mat->profile_gaussians_n)
            continue;
        lanes_t l = gather_lanes(in, mat, m, mine, place.x, place.y);
        gaussian_t gaussian = gaussian_of(mat, g, &l);
        floatv mean[SCATTER_OUT];
        mean_along(ALONG_Y, &l, &gaussian, mean);
        LEDGER_ADD(g, mat, mean, mine, at)
        for (int c = 0; c < 3; c++) {
            floatv before = g ? out[c] : out[c] * unblurred(mat, c);
            floatv weight = mat->profile_gaussians_weight[3 * g + c];
            out[c] = rl_select(out[c], fma(weight, mean[c], before), mine);
        }
        found = 1;
    }
    for (int c = 0; found && c < 3; c++)
        rl_store(out[c], filtered, at + c * f->plane);
}

#define GAUSSIAN(g)                                                                                          \
    kernel void sss_gaussian_rows_##g(GAUSSIAN_PORTS)                                                        \
    {                                                                                                        \
        planes_t in = {diffuse, depth, area, stencil, f};                                                    \
        filter_rows(g, &in, line, materials LEDGER_ARGUMENTS);                                                              \
    }                                                                                                        \
    kernel void sss_gaussian_columns_##g(GAUSSIAN_PORTS)                                                     \
    {                                                                                                        \
        planes_t in = {line, depth, area, stencil, f};                                                       \
        filter_columns(g, &in, diffuse, filtered, materials LEDGER_ARGUMENTS);                                              \
    }
GAUSSIAN(0)
GAUSSIAN(1)
GAUSSIAN(2)
GAUSSIAN(3)

#else

/* All Gaussians of a material over the disk of the widest. */
static inline void mean_around(const lanes_t *l, constant material_t *mat, floatv *out)
{
    constant frame_t *f = l->in.f;
    gaussian_t gaussians[MOST_GAUSSIANS];
    floatv w[MOST_GAUSSIANS], sum[3 * MOST_GAUSSIANS];
    float lateral = 0.0f;
#if WANTS_energy
    rejected_t rejected[MOST_GAUSSIANS];
    const floatv own[3] = {out[0], out[1], out[2]};
    for (int i = 0; i < 3 * MOST_GAUSSIANS; i++)
        rejected[i / 3].border[i % 3] = rejected[i / 3].off_screen[i % 3] = 0.0f;
#endif
    for (int g = 0; g < MOST_GAUSSIANS; g++) {
        for (int c = 0; c < 3; c++)
            sum[3 * g + c] = 0.0f;
        w[g] = 0.0f;
        gaussians[g] = gaussian_of(mat, min(g, mat->profile_gaussians_n - 1), l);
        gaussians[g].lateral = g < mat->profile_gaussians_n ? gaussians[g].lateral : -1.0f;
        lateral = fmax(lateral, gaussians[g].lateral);
    }
    int clip = !(l->keep.s0 | WANTS_energy); /* nothing to see beyond the image but for the ledger */
    int rows = pixels_of(lateral, f->camera.focal[1]);
    for (int dy = clip ? max(-rows, f->valid[1] - l->y) : -rows;
         dy <= (clip ? min(rows, f->valid[3] - 1 - l->y) : rows); dy++) {
        float v = (float)dy / f->camera.focal[1];
        int n = pixels_of(sqrt(fmax(lateral * lateral - v * v, 0.0f)), f->camera.focal[0]);
        int first = clip ? max(-n, f->valid[0] - l->x - (RL_W - 1)) : -n;
        int last = clip ? min(n, f->valid[2] - 1 - l->x) : n;
        for (int dx = first; dx <= last; dx++) {
            sample_t s = sample_of(l, dx, dy);
            floatv c0 = light_of(l, &s, 0), c1 = light_of(l, &s, 1), c2 = light_of(l, &s, 2);
            float u = (float)dx / f->camera.focal[0], off = sqrt(u * u + v * v);
            for (int g = 0; g < MOST_GAUSSIANS; g++) {
                if (off > gaussians[g].lateral)
                    continue;
                floatv e = weight_of(&gaussians[g], l, &s);
                w[g] += e;
#if WANTS_energy
                reject(&gaussians[g], l, &s, dx, dy, &rejected[g]);
#endif
                sum[3 * g] = fma(e, c0, sum[3 * g]);
                sum[3 * g + 1] = fma(e, c1, sum[3 * g + 1]);
                sum[3 * g + 2] = fma(e, c2, sum[3 * g + 2]);
            }
        }
    }
    for (int c = 0; c < 3; c++)
        out[c] *= unblurred(mat, c);
    for (int g = 0; g < mat->profile_gaussians_n; g++)
        for (int c = 0; c < 3; c++)
            out[c] = fma((floatv)mat->profile_gaussians_weight[3 * g + c], sum[3 * g + c] / w[g], out[c]);
#if WANTS_energy
    for (int g = 0; g < mat->profile_gaussians_n; g++)
        for (int c = 0; c < 3; c++) {
            floatv one[SCATTER_OUT], mean = sum[3 * g + c] / w[g];
            scatter_account(one, c, own[c], 1.0f, w[g], sum[3 * g + c], &rejected[g], l->keep, mean, mean, 0.0f);
            for (int i = 3 + c; i < SCATTER_OUT; i += 3)
                out[i] = fma((floatv)mat->profile_gaussians_weight[3 * g + c], one[i], out[i]);
        }
#endif
}

kernel void sss_gaussian_disk(GAUSSIAN_PORTS)
{
    planes_t in = {diffuse, depth, area, stencil, f};
    int2 place = place_in_strip(f);
    int at = rl_index(f, place.x, place.y);
    intv id = rl_as_intv(rl_load_id(stencil, at)), left = id != 0;
    floatv out[SCATTER_OUT];
    for (int c = 0; c < SCATTER_OUT; c++)
        out[c] = c < 3 ? rl_load(diffuse, at + c * f->plane) : (floatv)0.0f;
    while (scatter_any(left)) {
        int m = scatter_max_int(id & left);
        intv mine = left & (id == m);
        left &= ~mine;
        constant material_t *mat = &materials[m];
        if (!mat->has_profile || !mat->profile_gaussians_n)
            continue;
        lanes_t l = gather_lanes(&in, mat, m, mine, place.x, place.y);
        floatv all[SCATTER_OUT];
        for (int c = 0; c < SCATTER_OUT; c++)
            all[c] = c < 3 ? out[c] : (floatv)0.0f;
        mean_around(&l, mat, all);
        for (int c = 0; c < SCATTER_OUT; c++)
            out[c] = rl_select(out[c], all[c], mine);
    }
    for (int c = 0; c < 3; c++)
        rl_store(out[c], filtered, at + c * f->plane);
#if WANTS_energy
    SCATTER_KEEP_LEDGER(out, f->plane, at)
#endif
}

#endif

/* Slope of the depth along a row or a column, as scatter_slope has it. */
static inline floatv slope_of(global const float *depth, global const uint *stencil, constant frame_t *f, int x,
                              int y, int dx, int dy)
{
    int at = rl_index(f, x, y), step = dy ? dy * f->stride : dx;
    int i = y + dy < f->rows ? at + step : at, j = y >= dy ? at - step : at;
    intv id = rl_as_intv(rl_load_id(stencil, at));
    floatv z = rl_load(depth, at), a = rl_load(depth, i) - z, b = z - rl_load(depth, j);
    intv has_a = (rl_as_intv(rl_load_id(stencil, i)) == id) & rl_insidev(f, x + dx, y + dy),
         has_b = (rl_as_intv(rl_load_id(stencil, j)) == id) & rl_insidev(f, x - dx, y - dy);
    intv take_a = has_a & (~has_b | (fabs(a) <= fabs(b)));
    return rl_select(scatter_keep(b, has_b), a, take_a);
}

kernel void sss_gaussian_area(GAUSSIAN_PORTS)
{
    int x = RL_W * (int)get_global_id(0), y = get_global_id(1), at = rl_index(f, x, y);
    floatv zx = slope_of(depth, stencil, f, x, y, 1, 0), zy = slope_of(depth, stencil, f, x, y, 0, 1);
    rl_store(scatter_area_at(f, rl_to_floatv(RL_LANES + x), y, rl_load(depth, at), zx, zy), area, at);
}

kernel void sss_gaussian_resolve(GAUSSIAN_PORTS)
{
    scatter_resolve_from(RL_LINEAR, filtered, lit, albedo, normal, stencil, color, f, materials);
}

#if WANTS_energy
kernel void sss_gaussian_energy(GAUSSIAN_PORTS)
{
    SCATTER_ENERGY(RL_LINEAR);
}
#endif
