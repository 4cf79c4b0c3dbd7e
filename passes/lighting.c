/* Light on the G-buffer: point, spot, directional, sphere and rectangle lights, unshadowed ambient light and
 * the reflection of an HDRI, Lambert's or Disney's diffuse transmission, GGX specular, translucency through a
 * slab.
 *
 * Golubev 2018 (transmission at entry and exit, texturing modes, thin and thick slabs), Helix (Beer-Lambert),
 * MJP (scattering as spherical Gaussians: the irradiance is complete, and goes into `lit`), Ramamoorthi and
 * Hanrahan 2001 (irradiance of spherical harmonics), McGuire and Mara 2014 (shadows marched in the depth
 * buffer), Walter 2007 and Heitz 2014 (GGX, height-correlated Smith), Schlick 1994 (Fresnel), Heitz et al.
 * 2016 (area lights: linearly transformed cosines), Karis 2013 (reflections: split sum). */
#include <string.h>

#include "passes/ltc_table.h"
#include "passes/shading_rows.h"

typedef struct lighting_params {
    int32_t shadow_steps;
    float shadow_thickness_m;
    float shadow_bias_m;
    int32_t shadow_jitter;
    int32_t seed;
} lighting_params;

static const rl_param params[] = {
    P(lighting_params, RL_I32, shadow_steps, 1, 16384, 128, "steps",
      "shadow: screen: most steps of a ray; ways of up to so many pixels miss nothing that is in sight",
      .source = "McGuire and Mara 2014"),
    P(lighting_params, RL_F32, shadow_thickness_m, 0, 1e6, 0.05, "m",
      "shadow: screen: depth of occluders behind what is seen; what is out of sight or crop casts no shadow"),
    P(lighting_params, RL_F32, shadow_bias_m, 0, 1e3, 0.0005, "m",
      "shadow: screen: how far behind a surface rays are blocked; more for depth in half precision"),
    P(lighting_params, RL_BOOL, shadow_jitter, 0, 1, 1, "",
      "shadow: screen: rays that leave pixels out begin at a random one, a pixel and frame"),
    P(lighting_params, RL_I32, seed, 0, 2147483647, 0, "", "of shadow_jitter"),
};
RL_PARAMS_MATCH(lighting_params, 5);

static const rl_param profile_keys[] = {
    RL_ROW_SCATTER_DISTANCE(.required_with = "transmission=thin|thick"),
    RL_ROWS_SCATTER_PARAM,
    RL_ROW_TEXTURING,
    RL_ROW_TRANSMISSION,
    M_ENUM(thickness_from, "max|layer|shadow", 0,
           "thick, beer_lambert: the thickness layer, shadow_thickness along the normal, or the larger",
           .source = "Golubev 2018"),
    M(RL_RGBF, transmittance_color, 1e-6, 1, 0.5, "ratio",
      "beer_lambert: what is left of white light after transmittance_distance_mm", .source = "Bavoil, Helix"),
    M(RL_F32, transmittance_distance_mm, 1e-3, 1e6, 1, "mm", "beer_lambert: where transmittance_color holds"),
    M(RL_RGBF, sg_variance_mm2, 1e-8, 1e8, -1, "mm2",
      "diffuse: sg: variance of the scattering along an axis; not given: 7 d^2, that of Burley's profile",
      .source = "MJP", .no_default = true, .needed_by = "diffuse: sg", .instead = "scatter_distance_mm"),
};

static const rl_param material_keys[] = {
    M(RL_F32, roughness, 0, 1, -1, "ratio",
      "perceptual roughness, alpha is its square; not given: the roughness layer, else 0.5",
      .no_default = true),
    M(RL_F32, specular, 0, 1, -1, "ratio",
      "reflectance at normal incidence; not given: the specular layer, else 0.04", .no_default = true),
    RL_ROW_METALLIC,
    M(RL_F32, normal_detail_mm, 0, 1e4, 3, "mm",
      "diffuse: sg: size of the bumps that smooth_normal leaves out, as a standard deviation",
      .source = "d'Eon and Luebke 2007; MJP"),
};

static const rl_param shading_keys[] = {
    RL_ROW_DIFFUSE,
    M_ENUM(specular, "ggx|none", 0, "the specular lobe", .source = "Walter 2007, Heitz 2014"),
    RL_ROW_TRANSMIT,
    RL_ROW_EXIT_TRANSMISSION,
};

static const rl_port ports[] = {
    {"albedo", RL_READ, RL_RGB, .help = "0 to 1, scene-linear"},
    {"normal", RL_READ, RL_NORMAL, .help = "shading normal"},
    {"depth", RL_READ, RL_SCALAR, .help = "planar, metres"},
    {"stencil", RL_READ, RL_ID, .help = "material"},
    {"thickness", RL_READ, RL_SCALAR, .help = "metres along the inward normal, 0 = unknown", .optional = true,
     .missed_by = "transmission: thin|thick|beer_lambert", .instead = "shadow_thickness",
     .if_missed = "no light comes through"},
    {"shadow", RL_READ, RL_LIGHTS,
     .help = "visibility of each light, 0 to 1; shadow: screen needs none, and leaves back faces lit",
     .optional = true},
    {"shadow_thickness", RL_READ, RL_LIGHTS,
     .help = "metres along the light's ray, 0 where lit; unknown with shadow: screen", .optional = true},
    {"roughness", RL_READ, RL_SCALAR, .help = "perceptual, 0 to 1", .optional = true},
    {"specular", RL_READ, RL_SCALAR, .help = "reflectance at normal incidence, 0 to 1", .optional = true},
    {"metallic", RL_READ, RL_SCALAR, .help = "0 to 1", .optional = true},
    {"emission", RL_READ, RL_RGB, .help = "emitted radiance", .optional = true},
    {"curvature", RL_READ, RL_SCALAR, .help = "1/m; only its amount counts, hollows scatter like hills",
     .optional = true, .needed_by = "diffuse: sg"},
    {"smooth_normal", RL_READ, RL_NORMAL, .help = "diffuse: sg: normal without small bumps",
     .optional = true},
    {"diffuse", RL_WRITE, RL_RGB, .help = "radiance that entered a subsurface material", .any_layout = true},
    {"lit", RL_WRITE, RL_RGB, .help = "all other radiance, complete"},
    RL_PORT_ENERGY,
};

/* The kernel's only table, the same for all pipelines. */
static rl_code lighting_tables(const rl_pass_input *in, rl_arena *arena, rl_tables *out, rl_error *err)
{
    (void)in;
    out->data = rl_arena_array(arena, RL_LTC_FLOATS, sizeof *out->data);
    if (!out->data)
        return rl_fail_memory(err, sizeof rl_ltc_table);
    memcpy(out->data, rl_ltc_table, sizeof rl_ltc_table);
    out->n = RL_LTC_FLOATS;
    return RL_OK;
}

static const rl_step steps[] = {
    {"lighting", .domain = RL_EVERY_VECTOR},
    {"lighting_energy", .domain = RL_EVERY_BAND, .with = "energy"},
};

/* With three lights; how many there are is not known here. */
static double cost(const void *p)
{
    (void)p;
    return 26;
}

static bool stochastic(const void *values, bool march)
{
    const lighting_params *p = values;
    return march && p->shadow_jitter;
}

const rl_pass rl_pass_lighting = {
    .name = "lighting",
    .help = "direct, area and ambient light: diffuse transmission, specular reflection, translucency",
    .source = "Golubev 2018; Helix; Walter 2007; Heitz 2014; Heitz et al. 2016",
    .kernel = "lighting.cl",
    .kernel_prelude =
        "energy.cl sg.cl surface.cl sg_shade.cl slab.cl screen_shadow.cl ltc.cl area.cl profile.cl "
        "sky.cl",
    .params = RL_ARRAY(params),
    .params_size = sizeof(lighting_params),
    .profile_keys = RL_ARRAY(profile_keys),
    .material_keys = RL_ARRAY(material_keys),
    .shading_keys = RL_ARRAY(shading_keys),
    .ports = RL_ARRAY(ports),
    .steps = RL_ARRAY(steps),
    .lights = true,
    .ambient = true,
    .light_tables = true,
    .tables = lighting_tables,
    .stochastic = stochastic,
    .cost = cost,
};
