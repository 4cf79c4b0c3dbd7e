/* An experiment that never ran: two captures with materials and frames, a merged graph, and frames whose
 * pixels a test writes. It defines the functions of graph/run/experiment.h, so a test that uses it does not
 * run a real one. Include cmocka.h first. */
#ifndef RL_TESTS_FAKE_EXPERIMENT_H
#define RL_TESTS_FAKE_EXPERIMENT_H

#include "graph/run/session.h"
#include "graph/tool/ab.h"

enum {
    FAKE_WIDTH = 52,
    FAKE_HEIGHT = 44,
    FAKE_STRIDE = 57,
    FAKE_PIXELS = FAKE_WIDTH * FAKE_HEIGHT,
    FAKE_VARIANTS = 6,
    FAKE_FRAMES = 3,
    /* materials of both captures: "", skin, plaster, dot (two pixels), absent (none) */
    FAKE_SKIN = 1,
    FAKE_PLASTER,
    FAKE_DOT,
    FAKE_ABSENT,
    FAKE_MATERIALS
};

/* Where the data window begins. */
enum { FAKE_X = 3, FAKE_Y = -2 };

struct rl_experiment {
    rl_session session;
    rl_pipeline pipeline;
    rl_sequence sequences[2];
    rl_manifest manifests[2];
    int frames[FAKE_FRAMES];
    rl_arena arena;
    rl_plan plan;
    rl_sink_output outputs[4];
    rl_output specs[4];
    rl_output_layer layer;
    bool used[4][FAKE_VARIANTS];
    rl_experiment_cost cost;
    /* the frame */
    rl_experiment_frame frame;
    uint32_t stencil[FAKE_HEIGHT * FAKE_STRIDE];
    float pixels[FAKE_VARIANTS][RL_COMPARED][3][FAKE_HEIGHT * FAKE_STRIDE];
    rl_compared_image images[FAKE_VARIANTS][RL_COMPARED];
};

/* Frames 1, 2 and 5; one capture, "monkey", unless `captures` is 2 ("bust"). Freed with fake_experiment_free.
 */
rl_experiment *fake_experiment_new(size_t captures);
void fake_experiment_free(rl_experiment *e);

/* A smooth picture with some structure, the same for all variants, then `change` of variant v's by so much at
 * the pixels of a material (RL_AB_WHOLE: all). LINEAR is 0 … 1.5, DISPLAY its square root, beyond 1 too. */
void fake_frame_draw(rl_experiment *e, size_t capture, size_t index);
void fake_frame_change(rl_experiment *e, int variant, int material, float amount);
/* Noise of its own for every seed. */
void fake_frame_noise(rl_experiment *e, int variant, uint32_t seed, float amount);

/* post (the reference), pre_post, then as many as n_variants; pairs (0, v). */
typedef struct fake_plan {
    rl_ab_plan plan;
    rl_variant variants[FAKE_VARIANTS];
    rl_ab_pair pairs[FAKE_VARIANTS];
    rl_ab_parameter parameter;
    const char *values[FAKE_VARIANTS];
    rl_setting settings[FAKE_VARIANTS];
} fake_plan;
void fake_plan_make(fake_plan *p, size_t n_variants, size_t n_listed);

#endif
