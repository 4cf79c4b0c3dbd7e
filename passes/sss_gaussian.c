/* Subsurface scattering with a mixture of Gaussians: every pixel of the material within 3 sigma of the
 * widest, weighted by its distance in view space.
 *
 * Helix (D. Lenaerts), "Deferred subsurface scattering using compute shaders", after Jimenez et al. 2009 and
 * d'Eon et al. 2007. Helix blends in both passes of the separable form, which squares the unblurred share;
 * here each Gaussian has two passes of its own and is blended once. */
#include "passes/shading_rows.h"

typedef struct sss_gaussian_params {
    int32_t separable;
    int32_t weighting;
} sss_gaussian_params;

static const rl_param params[] = {
    P(sss_gaussian_params, RL_BOOL, separable, 0, 1, 1, "",
      "a row and a column of pixels a Gaussian, or the whole disk at once", .source = "Helix",
      .structural = true),
    P_ENUM(sss_gaussian_params, weighting, "area|plain", 0,
           "what a sample stands for: the surface that its pixel sees, or its pixel alone as in Helix",
           .structural = true),
};
RL_PARAMS_MATCH(sss_gaussian_params, 2);

static const rl_param gaussian_rows[] = {
    M(RL_F32, variance_mm2, 1e-6, 1e6, 0, "mm2", "sigma², along each axis", .required = true),
    M(RL_RGBF, weight, 0, 1, 0, "ratio", "share of the light, a channel; what all leave of 1 is not blurred",
      .required = true, .most_sum = 1),
};

static const rl_param profile_keys[] = {
    M_ROWS(gaussians, gaussian_rows, 1, 4, "the diffusion profile as a sum of Gaussians",
           .source = "Helix; d'Eon 2007", .required = true),
    RL_ROW_TEXTURING,
    RL_ROW_BORDER,
};

static const rl_param shading_keys[] = {RL_ROW_DIFFUSE, RL_ROW_EXIT_TRANSMISSION};

static const rl_port ports[] = {
    {"diffuse", RL_READ, RL_RGB, .help = "radiance below the surface"},
    {"lit", RL_READ, RL_RGB, .help = "radiance that does not scatter"},
    {"albedo", RL_READ, RL_RGB, .help = "0..1"},
    {"normal", RL_READ, RL_NORMAL, .help = "shading normal, for the way out"},
    {"depth", RL_READ, RL_SCALAR, .help = "planar, metres"},
    {"stencil", RL_READ, RL_ID, .help = "material"},
    {"area", RL_SCRATCH, RL_SCALAR, .help = "surface that a pixel sees"},
    {"line", RL_SCRATCH, RL_RGB, .help = "one Gaussian along the rows"},
    {"filtered", RL_SCRATCH, RL_RGB, .help = "scattered radiance below the surface"},
    {"color", RL_WRITE, RL_RGB, .help = "radiance, scene-linear"},
    RL_SCATTER_LEDGER(RL_LINEAR),
};

#define LINES(g)                                                                                             \
    {"sss_gaussian_rows_" #g, .domain = RL_EVERY_VECTOR, .when = "separable", .is = 1},                      \
    {                                                                                                        \
        "sss_gaussian_columns_" #g, .domain = RL_EVERY_VECTOR, .when = "separable", .is = 1                  \
    }

static const rl_step steps[] = {
    {"sss_gaussian_area", .domain = RL_EVERY_VECTOR, .when = "weighting", .is = 0},
    LINES(0),
    LINES(1),
    LINES(2),
    LINES(3),
    {"sss_gaussian_disk", .domain = RL_EVERY_VECTOR, .when = "separable", .is = 0},
    {"sss_gaussian_resolve", .domain = RL_EVERY_VECTOR},
    {"sss_gaussian_energy", .domain = RL_EVERY_BAND, .with = "energy"},
};

/* Follows the size of the profile in pixels, which is not known here: of skin, 3 mm at 2 px a mm. */
static double cost(const void *of)
{
    return ((const sss_gaussian_params *)of)->separable ? 500 : 16000;
}

const rl_pass rl_pass_sss_gaussian = {
    .name = "sss_gaussian",
    .help = "subsurface scattering with a mixture of Gaussians",
    .source = "Helix, Deferred subsurface scattering using compute shaders; Jimenez 2009; d'Eon 2007",
    .kernel = "sss_gaussian.cl",
    .kernel_prelude = "energy.cl scatter.cl scatter_surface.cl scatter_ledger.cl",
    .params = RL_ARRAY(params),
    .params_size = sizeof(sss_gaussian_params),
    .profile_keys = RL_ARRAY(profile_keys),
    .shading_keys = RL_ARRAY(shading_keys),
    .ports = RL_ARRAY(ports),
    .steps = RL_ARRAY(steps),
    .conserves = true,
    .cost = cost,
};
