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
    P_ENUM(sss_burley_params, orientation, "screen|tangent", 0,
           "the disk is parallel to the screen, or to the tangent plane that the depth gives",
           .structural = true),
    P_ENUM(sss_burley_params, weighting, "area|plain|surface", 0,
           "a sample stands for the area that its pixel sees, its pixel, or area over the tangent plane's",
           .structural = true),
    P_ENUM(sss_burley_params, rotation, "none|white|ign|blue", 3,
           "how the pattern changes from pixel to pixel and from frame to frame; blue: neighbours complement "
           "each other"),
    P(sss_burley_params, RL_I32, seed, 0, 2147483647, 0, "", "another choice of patterns"),
};
RL_PARAMS_MATCH(sss_burley_params, 5);

static const rl_port ports[] = {
    {"diffuse", RL_READ, RL_RGB, .help = "radiance below the surface", .layout = RL_PHASE4},
    {"lit", RL_READ, RL_RGB, .help = "radiance that does not scatter"},
    {"albedo", RL_READ, RL_RGB, .help = "0..1"},
    {"normal", RL_READ, RL_NORMAL, .help = "shading normal, for the way out"},
    {"depth", RL_READ, RL_SCALAR, .help = "planar, metres", .layout = RL_PHASE4},
    {"stencil", RL_READ, RL_ID, .help = "material", .layout = RL_PHASE4},
    {"area", RL_SCRATCH, RL_SCALAR, .help = "surface that a pixel sees", .layout = RL_PHASE4},
    {"filtered", RL_SCRATCH, RL_RGB, .help = "scattered radiance below the surface", .layout = RL_PHASE4},
    {"color", RL_WRITE, RL_RGB, .help = "radiance, scene-linear"},
    RL_SCATTER_LEDGER(RL_PHASE4),
};

static const rl_step steps[] = {
    {"sss_burley_area", .domain = RL_EVERY_PHASE},
    {"sss_burley_filter", .domain = RL_EVERY_PHASE},
    {"sss_burley_resolve", .domain = RL_EVERY_VECTOR},
    {"sss_burley_energy", .domain = RL_EVERY_BAND, .with = "energy"},
};

/* As kernels/sss_burley.cl reads it: 256 directions (cos, sin), then the patterns for `taps`, or with `auto`
 * those for 21 and those for 55. There are up to 15 for a number of taps, an odd number of them, their radii
 * offset by (j + 1/2)/patterns: the one in the middle by a half. A pattern is its x, y and weights, each
 * padded to a multiple of 64. */
enum { TURNS = 256, TAP_BLOCK = 64, MOST_PATTERNS = 15, PATTERN_TAPS = 4096 };

static size_t tap_stride(size_t taps)
{
    return (taps + TAP_BLOCK - 1) / TAP_BLOCK * TAP_BLOCK;
}

/* The more taps, the less the patterns differ: all together never exceed 4096 taps, 48 KiB. */
static size_t pattern_count(size_t taps)
{
    size_t fit = PATTERN_TAPS / tap_stride(taps);
    return fit > MOST_PATTERNS ? MOST_PATTERNS : (fit - 1) | 1;
}

static rl_code tables(const rl_pass_input *in, rl_arena *arena, rl_tables *out, rl_error *err)
{
    const sss_burley_params *p = in->params;
    size_t taps[2] = {21, 55}, count = 2, n = 2 * TURNS;
    if (p->taps > 0) {
        taps[0] = (size_t)p->taps;
        count = 1;
    }
    for (size_t i = 0; i < count; i++)
        n += 3 * tap_stride(taps[i]) * pattern_count(taps[i]);
    out->n = n;
    out->data = rl_arena_array(arena, n, sizeof *out->data);
    if (!out->data)
        return rl_fail_memory(err, n * sizeof *out->data);
    float *to = out->data;
    for (int i = 0; i < TURNS; i++) {
        double angle = 2 * 3.14159265358979323846 * i / TURNS;
        *to++ = (float)cos(angle);
        *to++ = (float)sin(angle);
    }
    for (size_t i = 0; i < count; i++) {
        size_t stride = tap_stride(taps[i]), patterns = pattern_count(taps[i]);
        for (size_t j = 0; j < patterns; j++, to += 3 * stride)
            rl_burley_taps(taps[i], ((double)j + 0.5) / (double)patterns, to, to + stride, to + 2 * stride);
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
    .kernel_prelude = "energy.cl scatter.cl pattern.cl",
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
