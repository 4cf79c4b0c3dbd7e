/* No scattering: what entered leaves at the same place. The "SSS off" half of an A/B test; at a distance it
 * equals every subsurface filter (Golubev 2018). */
#include "passes/shading_rows.h"

static const rl_param profile_keys[] = {RL_ROW_TEXTURING};
static const rl_param shading_keys[] = {RL_ROW_DIFFUSE, RL_ROW_EXIT_TRANSMISSION};

static const rl_port ports[] = {
    {"diffuse", RL_READ, RL_RGB, .help = "radiance that entered a subsurface material"},
    {"lit", RL_READ, RL_RGB, .help = "all other radiance"},
    {"albedo", RL_READ, RL_RGB, .help = "0 to 1, scene-linear"},
    {"normal", RL_READ, RL_NORMAL, .help = "shading normal"},
    {"depth", RL_READ, RL_SCALAR, .help = "planar, metres"},
    {"stencil", RL_READ, RL_ID, .help = "material"},
    {"color", RL_WRITE, RL_RGB, .help = "radiance towards the camera", .any_layout = true},
    RL_PORT_ENERGY,
};

static const rl_step steps[] = {
    {"combine", .domain = RL_EVERY_VECTOR},
    {"combine_energy", .domain = RL_EVERY_BAND, .with = "energy"},
};

const rl_pass rl_pass_combine = {
    .name = "combine",
    .help = "lit and diffuse together, without scattering",
    .source = "Golubev 2018",
    .kernel = "combine.cl",
    .kernel_prelude = "energy.cl",
    .profile_keys = RL_ARRAY(profile_keys),
    .shading_keys = RL_ARRAY(shading_keys),
    .ports = RL_ARRAY(ports),
    .steps = RL_ARRAY(steps),
    .conserves = true,
};
