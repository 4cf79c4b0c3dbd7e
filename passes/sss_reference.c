/* Subsurface scattering as the dense sum over the image: what sss_burley estimates with a few taps. Slow
 * (thousands of samples a pixel) and without randomness. Every channel is summed within 16.5644 d of the
 * largest d; at d itself that is 0.997 of the light, for the smaller ones more. */
#include "passes/burley.h"

typedef struct sss_reference_params {
    int32_t orientation;
    int32_t weighting;
} sss_reference_params;

static const rl_param params[] = {
    RL_ROW_ORIENTATION(sss_reference_params),
    RL_ROW_WEIGHTING(sss_reference_params),
};
RL_PARAMS_MATCH(sss_reference_params, 2);

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
    .kernel_prelude = "energy.cl scatter.cl scatter_surface.cl scatter_ledger.cl",
    .params = RL_ARRAY(params),
    .params_size = sizeof(sss_reference_params),
    .profile_keys = RL_ARRAY(rl_scatter_profile_rows),
    .shading_keys = RL_ARRAY(rl_scatter_shading_rows),
    .ports = RL_ARRAY(rl_scatter_ports),
    .steps = RL_ARRAY(steps),
    .conserves = true,
    .cost = cost,
};
