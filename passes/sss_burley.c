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
    P_ENUM(sss_burley_params, weighting, "area|plain", 0,
           "what a sample stands for: the surface that its pixel sees, or its pixel alone",
           .structural = true),
    P_ENUM(sss_burley_params, rotation, "none|phase", 1,
           "turn the pattern: never, or for each of 4x4 pixels and each frame"),
    P(sss_burley_params, RL_I32, seed, 0, 2147483647, 0, "", "another choice of turns"),
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
};

static const rl_step steps[] = {
    {"sss_burley_area", .domain = RL_EVERY_PHASE},
    {"sss_burley_filter", .domain = RL_EVERY_PHASE},
    {"sss_burley_resolve", .domain = RL_EVERY_VECTOR},
};

/* As kernels/sss_burley.cl reads it: 256 directions (cos, sin), then one pattern, or with `auto` those of 21
 * and of 55 taps; a pattern is its x, y and weights, each padded to a multiple of 64. */
enum { TURNS = 256, TAP_BLOCK = 64 };

static rl_code tables(const rl_pass_input *in, rl_arena *arena, rl_tables *out, rl_error *err)
{
    const sss_burley_params *p = in->params;
    size_t patterns[2] = {21, 55}, count = 2, n = 2 * TURNS;
    if (p->taps > 0) {
        patterns[0] = (size_t)p->taps;
        count = 1;
    }
    for (size_t i = 0; i < count; i++)
        n += 3 * ((patterns[i] + TAP_BLOCK - 1) / TAP_BLOCK * TAP_BLOCK);
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
        size_t stride = (patterns[i] + TAP_BLOCK - 1) / TAP_BLOCK * TAP_BLOCK;
        rl_burley_taps(patterns[i], to, to + stride, to + 2 * stride);
        to += 3 * stride;
    }
    return RL_OK;
}

const rl_pass rl_pass_sss_burley = {
    .name = "sss_burley",
    .help = "subsurface scattering with Burley's profile, a few importance-sampled taps a pixel",
    .source = "Golubev, Efficient screen-space subsurface scattering, SIGGRAPH 2018",
    .kernel = "sss_burley.cl",
    .kernel_prelude = "scatter.cl",
    .params = RL_ARRAY(params),
    .params_size = sizeof(sss_burley_params),
    .profile_keys = RL_ARRAY(rl_scatter_profile_rows),
    .shading_keys = RL_ARRAY(rl_scatter_shading_rows),
    .ports = RL_ARRAY(ports),
    .steps = RL_ARRAY(steps),
    .tables = tables,
};
