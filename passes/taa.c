/* Temporal anti-aliasing: reproject the history, reject it where it shows something else, clip it to the
 * colours around the pixel, blend. Static, jittered frames with blend 0 add up to their plain mean.
 *
 * Variance clipping: Salvi 2016. Closest motion, luminance weights: Karis 2014. Motion without a layer, by
 * tiles: Lucas and Kanade 1981; Longuet-Higgins and Prazdny 1980. Survey of the rest: Yang et al. 2020. */
#include "graph/model/pass.h"
#include "passes/shading_rows.h"

typedef struct taa_params {
    float blend;
    float clip_gamma;
    uint32_t exclude[RL_SET_WORDS];
} taa_params;

static const rl_param params[] = {
    P(taa_params, RL_F32, blend, 0, 1, 0.05, "ratio", "least weight of the current frame"),
    P(taa_params, RL_F32, clip_gamma, 0, 8, 1, "stddev",
      "half width of the colour box that the history is clipped to; tripled where nothing moves",
      .source = "Salvi 2016"),
    P_MATERIALS(taa_params, exclude, "what is not accumulated: always the current frame"),
};
RL_PARAMS_MATCH(taa_params, 2 + RL_SET_WORDS);

static const rl_port ports[] = {
    {"color", RL_READ, RL_RGB, .help = "this frame, scene-linear"},
    {"depth", RL_READ, RL_SCALAR, .help = "planar, metres"},
    {"motion", RL_READ, RL_VEC2, .help = "pixels to the same point one frame before; else depth and cameras",
     .optional = true,
     .if_absent = "motion comes from depth and the cameras, that of what moves by itself from a search"},
    {"stencil", RL_READ, RL_ID, .help = "material, to reject history of another", .optional = true},
    {"last_color", RL_HISTORY, RL_RGB, .of = "color", .help = "the previous result"},
    {"last_depth", RL_HISTORY, RL_SCALAR, .of = "depth", .help = "the previous depth"},
    {"last_stencil", RL_HISTORY, RL_ID, .of = "stencil", .help = "the previous materials", .optional = true},
    {"last_count", RL_HISTORY, RL_SCALAR, .of = "count", .help = "frames in the previous result"},
    {"moved", RL_SCRATCH, RL_VEC2, .help = "motion as depth, cameras and colours show it",
     .without = "motion"},
    {"color", RL_WRITE, RL_RGB, .help = "anti-aliased, scene-linear"},
    {"count", RL_WRITE, RL_SCALAR,
     .help = "frames in the pixel, this one included; negative: it follows an edge in front"},
    {"clamped", RL_SCRATCH, RL_RGB, .help = "light that the clip takes", .with = "energy"},
    {"redistributed", RL_SCRATCH, RL_RGB, .help = "light that the history adds", .with = "energy"},
    RL_PORT_ENERGY,
};

static const rl_step steps[] = {
    {"taa_motion", .domain = RL_EVERY_VECTOR, .without = "motion"},
    {"taa", .domain = RL_EVERY_VECTOR},
    {"taa_energy", .domain = RL_EVERY_BAND, .with = "energy"},
};

static double least_share(const void *values)
{
    return (double)((const taa_params *)values)->blend;
}

static double cost(const void *of)
{
    (void)of;
    return 32;
}

const rl_pass rl_pass_taa = {
    .name = "taa",
    .help = "temporal anti-aliasing with variance clipping",
    .source = "Salvi 2016; Karis 2014; Lucas and Kanade 1981; Yang et al. 2020",
    .kernel = "taa.cl",
    .kernel_prelude = "energy.cl temporal.cl taa_tile.cl taa_search.cl taa_motion.cl",
    .params = RL_ARRAY(params),
    .params_size = sizeof(taa_params),
    .ports = RL_ARRAY(ports),
    .steps = RL_ARRAY(steps),
    .least_share = least_share,
    .fades_where =
        "where history is neither clipped, nor resampled, nor a firefly; elsewhere it lies in the colour box "
        "of "
        "the pixel's 3x3 neighbours whatever came before, so that no two runs differ by more than that box",
    .cost = cost,
};
