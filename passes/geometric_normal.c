/* The normal of the surface itself, from depth: what shading normals leave out. Golubev 2018 names it as
 * future work
 * ("a robust tangent space normal from the depth buffer"), for a disk in the tangent plane. */
#include "graph/model/pass.h"

static const rl_port ports[] = {
    {"depth", RL_READ, RL_SCALAR, .help = "planar, metres"},
    {"stencil", RL_READ, RL_ID, .help = "material; neighbours of another are not used"},
    {"normal", RL_WRITE, RL_NORMAL, .help = "of the surface, facing the camera; 0 where empty",
     .any_layout = true},
};

static const rl_step steps[] = {{"geometric_normal", .domain = RL_EVERY_VECTOR}};

const rl_pass rl_pass_geometric_normal = {
    .name = "geometric_normal",
    .help = "surface normal from depth",
    .source = "Golubev 2018, future work",
    .kernel = "geometric_normal.cl",
    .ports = RL_ARRAY(ports),
    .steps = RL_ARRAY(steps),
};
