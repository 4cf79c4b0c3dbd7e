/* Subsurface scattering with Burley's profile: importance-sampled taps with bilateral weights. */
#include "passes/burley.h"

#include <math.h>

typedef struct sss_burley_params {
    int32_t taps;
    int32_t orientation;
    int32_t weighting;
    int32_t rotation;
    int32_t seed;
} sss_burley_params;

static const rl_param params[] = {
    P(sss_burley_params, RL_I32, taps, 1, 4096, -1, "samples a pixel",
      "auto: none, 21 or 55 by the filter's radius in pixels; a number forces that many", .words = "auto"),
    RL_ROW_ORIENTATION(sss_burley_params),
    RL_ROW_WEIGHTING(sss_burley_params),
    P_ENUM(sss_burley_params, rotation, "none|white|ign|blue", 3,
           "how the pattern changes from pixel to pixel and from frame to frame; blue: neighbours complement "
           "each other"),
    P(sss_burley_params, RL_I32, seed, 0, 2147483647, 0, "", "another choice of patterns"),
};
RL_PARAMS_MATCH(sss_burley_params, 5);

enum { WEIGHTING_SURFACE = 2 };

static const rl_port ports[] = {
    RL_ROWS_SCATTER_PORTS,
    {"gain", RL_SCRATCH, RL_SCALAR, .help = "what curvature adds to the light, of one pixel of 4x4",
     .layout = RL_PHASE4, .when = "weighting", .is = WEIGHTING_SURFACE},
    RL_SCATTER_LEDGER(RL_PHASE4),
};

static const rl_step steps[] = {
    {"sss_burley_area", .domain = RL_EVERY_PHASE},
    {"sss_burley_gain", .domain = RL_EVERY_PHASE, .when = "weighting", .is = WEIGHTING_SURFACE},
    {"sss_burley_filter", .domain = RL_EVERY_PHASE},
    {"sss_burley_resolve", .domain = RL_EVERY_VECTOR},
    {"sss_burley_energy", .domain = RL_EVERY_BAND, .with = "energy"},
};

/* As kernels/sss_burley.cl reads it: 256 directions (cos, sin); for each material where its patterns start,
 * in floats from the table's start (exact, below 2^24); the patterns, which materials whose channels have the
 * same proportions share. A set of patterns is those for `taps`, or with `auto` those for 21 and those for
 * 55, and with `weighting: surface` those for the gain, twice as many taps. There are up to 15 for a number
 * of taps, an odd number of them, their radii offset by (j + 1/2)/patterns: the one in the middle by a half.
 * A pattern is its x, y and weights, each padded to a multiple of 64, and for each channel the sum of its
 * weights on a plane beside the mean of those of all patterns. */
enum { TURNS = 256, TAP_BLOCK = 64, MOST_PATTERNS = 15, PATTERN_TAPS = 4096, MOST_TAPS = 4096 };

static size_t tap_stride(size_t taps)
{
    return (taps + TAP_BLOCK - 1) / TAP_BLOCK * TAP_BLOCK;
}

/* The more taps, the less the patterns differ: those of a set never exceed 4096 taps, 48 KiB. */
static size_t pattern_count(size_t taps)
{
    size_t fit = PATTERN_TAPS / tap_stride(taps);
    return fit > MOST_PATTERNS ? MOST_PATTERNS : (fit - 1) | 1;
}

static size_t patterns_floats(size_t taps)
{
    return (3 * tap_stride(taps) + 3) * pattern_count(taps);
}

static void make_patterns(size_t taps, const double d[3], float *to)
{
    size_t stride = tap_stride(taps), count = pattern_count(taps);
    double sum[MOST_PATTERNS][3], mean[3] = {0};
    for (size_t j = 0; j < count; j++) {
        float *x = to + j * (3 * stride + 3);
        rl_burley_mixture_taps(taps, ((double)j + 0.5) / (double)count, d, x, x + stride, x + 2 * stride,
                               sum[j]);
        for (int c = 0; c < 3; c++)
            mean[c] += sum[j][c] / (double)count;
    }
    for (size_t j = 0; j < count; j++)
        for (int c = 0; c < 3; c++)
            to[j * (3 * stride + 3) + 3 * stride + (size_t)c] = (float)(sum[j][c] / mean[c]);
}

/* For how many taps there are patterns: those for one size on screen or for two, and twice as many as the
 * larger to find the gain with. Returns how many counts. */
static size_t tap_counts(const sss_burley_params *p, size_t counts[3])
{
    size_t n = 0;
    counts[n++] = p->taps > 0 ? (size_t)p->taps : 21;
    if (p->taps < 0)
        counts[n++] = 55;
    if (p->weighting == WEIGHTING_SURFACE) {
        counts[n] = 2 * counts[n - 1] < MOST_TAPS ? 2 * counts[n - 1] : MOST_TAPS;
        n++;
    }
    return n;
}

/* A material's scattering distances in units of the largest; false: it has none. */
static bool proportions(const struct rl_materials *m, size_t material, double d[3])
{
    if (!rl_material_has_profile(m, material) ||
        !rl_material_get(m, material, "profile", "scatter_distance_mm", d))
        return false;
    double most = fmax(d[0], fmax(d[1], d[2]));
    for (int c = 0; c < 3; c++)
        d[c] /= most;
    return most > 0;
}

/* The first material with the proportions of this one. */
static size_t first_alike(const struct rl_materials *m, size_t material, const double d[3])
{
    double other[3];
    for (size_t k = 0; k < material; k++)
        if (proportions(m, k, other) && other[0] == d[0] && other[1] == d[1] && other[2] == d[2])
            return k;
    return material;
}

static rl_code tables(const rl_pass_input *in, rl_arena *arena, rl_tables *out, rl_error *err)
{
    const sss_burley_params *p = in->params;
    size_t materials = rl_material_count(in->materials), sets = 0, n = 2 * TURNS + materials;
    size_t taps[3], n_taps = tap_counts(p, taps), per_set = 0;
    for (size_t k = 0; k < n_taps; k++)
        per_set += patterns_floats(taps[k]);
    double d[3];
    for (size_t i = 0; i < materials; i++)
        sets += proportions(in->materials, i, d) && first_alike(in->materials, i, d) == i;
    out->n = n + sets * per_set;
    out->data = rl_arena_array(arena, out->n, sizeof *out->data);
    if (!out->data)
        return rl_fail_memory(err, out->n * sizeof *out->data);
    for (int i = 0; i < TURNS; i++) {
        double angle = 2 * 3.14159265358979323846 * i / TURNS;
        out->data[2 * i] = (float)cos(angle);
        out->data[2 * i + 1] = (float)sin(angle);
    }
    float *starts = out->data + 2 * TURNS;
    for (size_t i = 0; i < materials; i++) {
        starts[i] = 0;
        if (!proportions(in->materials, i, d))
            continue;
        size_t first = first_alike(in->materials, i, d);
        starts[i] = first < i ? starts[first] : (float)n;
        if (first < i)
            continue;
        for (size_t k = 0; k < n_taps; k++) {
            make_patterns(taps[k], d, out->data + n);
            n += patterns_floats(taps[k]);
        }
    }
    return RL_OK;
}

/* Of a picture that is about half skin. */
static double cost(const void *of)
{
    const sss_burley_params *p = of;
    return 45 + 2.0 * (p->taps > 0 ? p->taps : 30);
}

static bool stochastic(const void *values, bool march)
{
    const sss_burley_params *p = values;
    (void)march;
    return p->rotation != 0; /* none */
}

const rl_pass rl_pass_sss_burley = {
    .name = "sss_burley",
    .help = "subsurface scattering with Burley's profile, a few importance-sampled taps a pixel",
    .source = "Golubev, Efficient screen-space subsurface scattering, SIGGRAPH 2018",
    .kernel = "sss_burley.cl",
    .kernel_prelude = "energy.cl scatter.cl scatter_surface.cl scatter_ledger.cl pattern.cl "
                      "burley_taps.cl burley_gain.cl",
    .params = RL_ARRAY(params),
    .params_size = sizeof(sss_burley_params),
    .profile_keys = RL_ARRAY(rl_scatter_profile_rows),
    .shading_keys = RL_ARRAY(rl_scatter_shading_rows),
    .ports = RL_ARRAY(ports),
    .steps = RL_ARRAY(steps),
    .tables = tables,
    .stochastic = stochastic,
    .cost = cost,
    .conserves = true,
};
