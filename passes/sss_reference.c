/* Subsurface scattering as the dense sum over the image: what sss_burley estimates with a few taps. Slow
 * (thousands of samples a pixel) and without randomness. Every channel is summed within 16.5644 d of the
 * largest d; at d itself that is 0.997 of the light, for the smaller ones more. */
#include "passes/burley.h"

typedef struct sss_reference_params {
    int32_t orientation;
    int32_t weighting;
} sss_reference_params;

static const rl_param params[] = {
    P_ENUM(sss_reference_params, orientation, "screen|tangent", 0,
           "the disk is parallel to the screen, or to the tangent plane that the depth gives",
           .structural = true),
    P_ENUM(sss_reference_params, weighting, "area|plain|surface", 0,
           "a sample stands for the area that its pixel sees, its pixel, or area over the tangent plane's",
           .structural = true),
};
RL_PARAMS_MATCH(sss_reference_params, 2);

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
    {"sss_reference_area", .domain = RL_EVERY_PHASE},
    {"sss_reference_filter", .domain = RL_EVERY_PHASE},
    {"sss_reference_resolve", .domain = RL_EVERY_VECTOR},
    {"sss_reference_energy", .domain = RL_EVERY_BAND, .with = "energy"},
};

/* Follows the square of the profile's size in pixels: of skin, 3 mm at 2 px a mm. */
static double cost(const void *of)
{
    (void)of;
    return 50000;
}

const rl_pass rl_pass_sss_reference = {
    .name = "sss_reference",
    .help = "subsurface scattering with Burley's profile, summed over every pixel in reach",
    .source = "Golubev 2018; Christensen and Burley 2015",
    .kernel = "sss_reference.cl",
    .kernel_prelude = "energy.cl scatter.cl",
    .params = RL_ARRAY(params),
    .params_size = sizeof(sss_reference_params),
    .profile_keys = RL_ARRAY(rl_scatter_profile_rows),
    .shading_keys = RL_ARRAY(rl_scatter_shading_rows),
    .ports = RL_ARRAY(ports),
    .steps = RL_ARRAY(steps),
    .conserves = true,
    .cost = cost,
};
