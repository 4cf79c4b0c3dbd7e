/* How much the surface bends: the mean curvature, (1/R1 + 1/R2)/2, from normals and depth. What spherical
 * Gaussians scale their width by (MJP), measured in view space and not with screen derivatives, so that it
 * does not depend on the pixel's size. */
#include "graph/model/pass.h"

typedef struct curvature_params {
    float radius_mm;
} curvature_params;

static const rl_param params[] = {
    P(curvature_params, RL_F32, radius_mm, 1e-3, 1e4, 6, "mm",
      "radius of the window, about as far as light scatters; 1 to 64 pixels"),
};
RL_PARAMS_MATCH(curvature_params, 1);

static const rl_port ports[] = {
    {"normal", RL_READ, RL_NORMAL, .help = "shading normal"},
    {"depth", RL_READ, RL_SCALAR, .help = "planar, metres"},
    {"stencil", RL_READ, RL_ID, .help = "material; neighbours of another are not used"},
    {"curvature", RL_WRITE, RL_SCALAR,
     .help = "mean curvature, 1/m, convex positive: 1/R on a sphere, 1/(2R) on a cylinder; 0 where unknown",
     .any_layout = true},
    {"smooth_normal", RL_WRITE, RL_NORMAL,
     .help =
         "mean of the normals of the window, a blur with standard deviation 0.54 radius_mm; 0 where empty",
     .any_layout = true},
};

static const rl_step steps[] = {{"curvature", .domain = RL_EVERY_VECTOR}};

const rl_pass rl_pass_curvature = {
    .name = "curvature",
    .help = "mean curvature of the surface, and its normal without small bumps",
    .source = "MJP, Approximating Subsurface Scattering With Spherical Gaussians",
    .kernel = "curvature.cl",
    .params = RL_ARRAY(params),
    .params_size = sizeof(curvature_params),
    .ports = RL_ARRAY(ports),
    .steps = RL_ARRAY(steps),
};
