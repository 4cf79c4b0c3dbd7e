/* Light on the closest back face, for `translucency`: the half of Golubev's future work that comes before the
 * gathering. The same lights and the same diffuse model as in `lighting`; no specular reflection, which stays
 * outside. */
#include "passes/shading_rows.h"

typedef struct back_lighting_params {
    int32_t facing;
} back_lighting_params;

static const rl_param params[] = {
    P_ENUM(back_lighting_params, facing, "away|camera", 0,
           "where back_normal points to: out of the object, or to the camera, as renderers give it that turn "
           "normals"),
};
RL_PARAMS_MATCH(back_lighting_params, 1);

static const rl_param profile_keys[] = {RL_ROW_TEXTURING, RL_ROW_TRANSMISSION};
static const rl_param material_keys[] = {RL_ROW_METALLIC};
static const rl_param shading_keys[] = {RL_ROW_DIFFUSE, RL_ROW_TRANSMIT, RL_ROW_EXIT_TRANSMISSION};

static const rl_port ports[] = {
    {"albedo", RL_READ, RL_RGB, .help = "of the front, where back_albedo is not there"},
    {"back_albedo", RL_READ, RL_RGB, .help = "of the closest back face", .optional = true},
    {"back_normal", RL_READ, RL_NORMAL, .help = "of the closest back face"},
    {"back_depth", RL_READ, RL_SCALAR, .help = "of the closest back face, planar, metres; 0 = there is none"},
    {"depth", RL_READ, RL_SCALAR, .help = "planar, metres"},
    {"stencil", RL_READ, RL_ID, .help = "material of the front, and of the back"},
    {"shadow", RL_READ, RL_LIGHTS, .help = "visibility of each light from the front, 0 to 1",
     .optional = true},
    {"shadow_thickness", RL_READ, RL_LIGHTS,
     .help = "metres along the light's ray; tells the object's own shadow from others'", .optional = true,
     .if_absent =
         "back faces are lit by all lights that they face: nothing but their own object shades them"},
    {"metallic", RL_READ, RL_SCALAR, .help = "0 to 1", .optional = true},
    {"diffuse", RL_WRITE, RL_RGB,
     .help = "radiance that entered the back of materials with transmission: gather", .any_layout = true},
};

static const rl_step steps[] = {{"back_lighting", .domain = RL_EVERY_VECTOR}};

static double cost(const void *of)
{
    (void)of;
    return 14;
}

const rl_pass rl_pass_back_lighting = {
    .name = "back_lighting",
    .help = "direct and ambient light that enters the closest back face",
    .source = "Golubev 2018, future work",
    .kernel = "back_lighting.cl",
    .kernel_prelude = "sg.cl surface.cl",
    .params = RL_ARRAY(params),
    .params_size = sizeof(back_lighting_params),
    .profile_keys = RL_ARRAY(profile_keys),
    .material_keys = RL_ARRAY(material_keys),
    .shading_keys = RL_ARRAY(shading_keys),
    .ports = RL_ARRAY(ports),
    .steps = RL_ARRAY(steps),
    .lights = true,
    .ambient = true,
    .cost = cost,
};
