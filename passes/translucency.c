/* Screen-space translucency: the light that entered the closest back face, gathered to the front through the
 * object. What comes out goes into `lit`, behind the filter of the front, since it is the whole way already:
 * the exact integral over the surface is the sum of both. */
#include "passes/burley.h"
#include "passes/shading_rows.h"

#include <math.h>

typedef struct translucency_params {
    int32_t taps;
    int32_t rotation;
    int32_t seed;
} translucency_params;

static const rl_param params[] = {
    P(translucency_params, RL_I32, taps, 3, 4096, 64, "samples a pixel", "a third of them for each channel"),
    P_ENUM(translucency_params, rotation, "none|white|ign|blue", 3,
           "how the pattern changes from pixel to pixel and from frame to frame, as in sss_burley"),
    P(translucency_params, RL_I32, seed, 0, 2147483647, 0, "", "another choice of patterns"),
};
RL_PARAMS_MATCH(translucency_params, 3);

static const rl_param profile_keys[] = {
    RL_ROW_SCATTER_DISTANCE(.required_with = "transmission=gather"),
    RL_ROWS_SCATTER_PARAM,
    RL_ROW_TEXTURING,
    RL_ROW_BORDER,
    RL_ROW_TRANSMISSION,
};
static const rl_param shading_keys[] = {RL_ROW_DIFFUSE, RL_ROW_TRANSMIT, RL_ROW_EXIT_TRANSMISSION};

static const rl_port ports[] = {
    {"back", RL_READ, RL_RGB, .help = "radiance that entered the back face, from back_lighting",
     .layout = RL_PHASE4},
    {"lit", RL_READ, RL_RGB, .help = "radiance that does not scatter, from lighting"},
    {"albedo", RL_READ, RL_RGB, .help = "0 to 1, of the front"},
    {"normal", RL_READ, RL_NORMAL, .help = "shading normal of the front, for the way out"},
    {"depth", RL_READ, RL_SCALAR, .help = "planar, metres", .layout = RL_PHASE4},
    {"back_depth", RL_READ, RL_SCALAR, .help = "of the closest back face, planar, metres; 0 = there is none",
     .layout = RL_PHASE4},
    {"back_normal", RL_READ, RL_NORMAL, .help = "of the closest back face; either way round",
     .layout = RL_PHASE4},
    {"stencil", RL_READ, RL_ID, .help = "material", .layout = RL_PHASE4},
    {"area", RL_SCRATCH, RL_SCALAR, .help = "of the back face that a pixel sees", .layout = RL_PHASE4},
    {"slope", RL_SCRATCH, RL_VEC2, .help = "of the back face, metres a pixel", .layout = RL_PHASE4},
    {"through", RL_SCRATCH, RL_RGB, .help = "radiance from the back, below the surface", .layout = RL_PHASE4},
    {"lit", RL_WRITE, RL_RGB, .help = "lit, and what comes through from the back"},
};

static const rl_step steps[] = {
    {"translucency_area", .domain = RL_EVERY_PHASE},
    {"translucency_gather", .domain = RL_EVERY_PHASE},
    {"translucency_resolve", .domain = RL_EVERY_VECTOR},
};

/* As kernels/translucency.cl reads it: 256 directions (cos, sin), then for planes at 0 and 2^k/4 of d, k = 1
 * … 7, the patterns: x and y of taps on the golden spiral whose radii r have P(sqrt(r² + t²)) = P(t) + (1 -
 * P(t)) (i + offset)/n. */
enum { TURNS = 256, DEPTHS = 8, TAP_BLOCK = 64, MOST_PATTERNS = 15, PATTERN_TAPS = 4096 };

static size_t tap_stride(size_t taps)
{
    return (taps + TAP_BLOCK - 1) / TAP_BLOCK * TAP_BLOCK;
}

static size_t pattern_count(size_t taps)
{
    size_t fit = PATTERN_TAPS / tap_stride(taps);
    return fit > MOST_PATTERNS ? MOST_PATTERNS : (fit - 1) | 1;
}

static void make_taps(size_t n, double t, double offset, float *x, float *y)
{
    const double golden = 3.14159265358979323846 * (3 - sqrt(5.0));
    double left = 1 - rl_burley_cdf(t, 1);
    for (size_t i = 0; i < n; i++) {
        double rho = rl_burley_inverse(1 - left * (1 - ((double)i + offset) / (double)n));
        double r = sqrt(fmax((rho - t) * (rho + t), 0));
        x[i] = (float)(r * cos((double)i * golden));
        y[i] = (float)(r * sin((double)i * golden));
    }
}

static rl_code tables(const rl_pass_input *in, rl_arena *arena, rl_tables *out, rl_error *err)
{
    const translucency_params *p = in->params;
    size_t taps = (size_t)p->taps, stride = tap_stride(taps), patterns = pattern_count(taps);
    out->n = 2 * TURNS + 2 * stride * patterns * DEPTHS;
    out->data = rl_arena_array(arena, out->n, sizeof *out->data);
    if (!out->data)
        return rl_fail_memory(err, out->n * sizeof *out->data);
    float *to = out->data;
    for (int i = 0; i < TURNS; i++) {
        double angle = 2 * 3.14159265358979323846 * i / TURNS;
        *to++ = (float)cos(angle);
        *to++ = (float)sin(angle);
    }
    for (int depth = 0; depth < DEPTHS; depth++)
        for (size_t j = 0; j < patterns; j++, to += 2 * stride)
            make_taps(taps, depth ? ldexp(0.25, depth) : 0, ((double)j + 0.5) / (double)patterns, to,
                      to + stride);
    return RL_OK;
}

static bool stochastic(const void *of, bool march)
{
    (void)march;
    return ((const translucency_params *)of)->rotation != 0; /* none */
}

/* Of a picture that is about half skin. */
static double cost(const void *of)
{
    return 20 + 8.0 * ((const translucency_params *)of)->taps;
}

const rl_pass rl_pass_translucency = {
    .name = "translucency",
    .help = "light from the closest back face, gathered through the object with Burley's profile",
    .source = "Golubev 2018, future work; Christensen and Burley 2015",
    .kernel = "translucency.cl",
    .kernel_prelude = "scatter.cl scatter_surface.cl pattern.cl",
    .params = RL_ARRAY(params),
    .params_size = sizeof(translucency_params),
    .profile_keys = RL_ARRAY(profile_keys),
    .shading_keys = RL_ARRAY(shading_keys),
    .ports = RL_ARRAY(ports),
    .steps = RL_ARRAY(steps),
    .tables = tables,
    .stochastic = stochastic,
    .cost = cost,
    .fulfils = "transmission: gather",
};
