/* Several variants of a pipeline, or several pipelines, in one run over the same frames. What they share runs
 * once: their graphs are merged, nodes of equal content (pass, program, parameters, the rows of materials,
 * the lights and the ambient light that they read, and their inputs, by content too) become one node, and a
 * frame is decoded once. Every variant's images have the same bits as in a run of its own.
 *
 * Variants whose frames must be read differently (another working space, other ids for the materials, other
 * shadow layers) are in different groups: each group has a merged graph, and reads the frames on its own.
 *
 * Used by one thread at a time, except where said. */
#ifndef RL_RUN_EXPERIMENT_H
#define RL_RUN_EXPERIMENT_H

#include "graph/model/plan.h"
#include "graph/relit.h"
#include "graph/run/energy.h"
#include "graph/run/sink.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct rl_variant {
    const char *name;           /* unique; a folder's name, and {variant} in the patterns of outputs */
    const char *pipeline;       /* a file */
    const rl_setting *settings; /* after those that all share */
    size_t n_settings;
    bool files; /* its outputs are written, below options.out/name */
} rl_variant;

typedef struct rl_experiment rl_experiment;

/* Opens every variant as rl_session_open would, and merges them. `options` are what all share (its pipeline
 * is not used; shards and resume do not apply: RL_E_USAGE). Variants that do not process the same frames of
 * the same captures are an error. Nothing is copied. An error's text names the variant when it is one's own.
 */
rl_code rl_experiment_open(const rl_options *options, const rl_variant *variants, size_t n_variants,
                           rl_experiment **out, rl_error *err);
void rl_experiment_close(rl_experiment **experiment);

/* ---- looking ---- */

size_t rl_experiment_variants(const rl_experiment *experiment);
/* The variant's own session, with the captures' names and frames; its plan is the merged one. */
const rl_session *rl_experiment_session(const rl_experiment *experiment, size_t variant);
size_t rl_experiment_groups(const rl_experiment *experiment, size_t capture);
/* Why the group reads frames on its own, "the working space differs"; NULL for the first one. */
const char *rl_experiment_group_reason(const rl_experiment *experiment, size_t capture, size_t group);
const rl_plan *rl_experiment_plan(const rl_experiment *experiment, size_t capture, size_t group);
/* The names of a capture's materials by dense index, [0] = "" (no material); all variants of group 0. */
const char *const *rl_experiment_materials(const rl_experiment *experiment, size_t capture, size_t *n);

/* A live node of a merged graph, in order of execution. */
typedef struct rl_merged_node {
    size_t group;
    int node;         /* in the graph of the group's plan */
    const char *name; /* "sss", "sss@2" for the one that variant 2 (from 1) is the first to have */
    const rl_pass *pass;
    const bool *used; /* [variants]: whose outputs need it */
    size_t n_used;    /* how many */
    uint64_t hash;    /* of its content; the same from run to run */
    double ms;        /* on the device a frame, mean of the frames that ran; < 0 before */
    double weight;    /* a model of that before it ran: planes of the frame that its steps read and write, and
                         what its arithmetic takes in the same unit (rl_pass.cost) */
} rl_merged_node;
/* The i-th of a capture, groups one after the other; false when there is none. */
bool rl_experiment_node(const rl_experiment *experiment, size_t capture, size_t i, rl_merged_node *out);

/* What a run costs against a run of variant 0 alone: reading, kernels and writing added up as if they did not
 * overlap, without what comparing takes. From the times that frames took when some ran, else from a model:
 * the weights of the nodes, and what a channel takes to decode and to encode (measured once, on one machine:
 * good for a third). */
typedef struct rl_experiment_cost {
    double factor; /* this run ÷ one run of variant 0 */
    double sum;    /* all variants one after the other ÷ one run of variant 0 */
    bool measured;
} rl_experiment_cost;
void rl_experiment_cost_of(const rl_experiment *experiment, rl_experiment_cost *out);

/* ---- running ---- */

/* The images that are compared. They come from the image of the pipeline's first output of one rgb image
 * that has a display, else a colour space, else any (--only chooses):
 *   LINEAR   scene-linear Rec. 709
 *   DISPLAY  encoded for that output's display and view (look and exposure too), else for the config's
 *            default display and view; 0 … 1, not clamped */
typedef enum rl_compared { RL_COMPARED_LINEAR, RL_COMPARED_DISPLAY, RL_COMPARED } rl_compared;

/* Planes in memory that lives during the callback. */
typedef struct rl_compared_image {
    int width, height;
    const float *plane[3];
    size_t stride;
} rl_compared_image;

/* A frame that ran (or failed) in all variants. Lives during the callback. */
typedef struct rl_experiment_frame {
    size_t capture, index; /* of the capture's frames */
    long long frame;
    const rl_error *error;   /* RL_OK: all below is there */
    int x, y, width, height; /* data window in display-window pixels */
    const uint32_t *stencil; /* dense index a pixel, of group 0 */
    size_t stencil_stride;
    const rl_compared_image (*images)[RL_COMPARED]; /* [variants] */
    const char *const *const *files;                /* [variants][n_files[v]]: what was written */
    const size_t *n_files;
    const rl_energy_row *energy; /* [n_energy] with options.energy, else none: of each variant the live nodes
                                    that keep a ledger, in order of execution. Materials are those of
                                    rl_experiment_materials */
    size_t n_energy;
    size_t done, total;
} rl_experiment_frame;

typedef struct rl_experiment_hooks {
    /* In order, one at a time, on a thread of the run's. An error of it is one of that frame. */
    rl_code (*frame)(void *ctx, const rl_experiment_frame *frame, rl_error *err);
    int (*stop)(void *ctx); /* as in rl_run_hooks */
    void *ctx;
    void (*stage)(void *ctx, rl_lane lane, long long frame);
    void (*span)(void *ctx, const rl_run_span *span);
} rl_experiment_hooks;

/* All frames of all captures, as rl_session_run: a frame that fails does not stop the others. */
rl_code rl_experiment_run(rl_experiment *experiment, const rl_experiment_hooks *hooks,
                          rl_run_summary *summary, rl_error *err);

/* Which image is compared, for people: "aa.color", "sRGB / ACES". */
const char *rl_experiment_image_name(const rl_experiment *experiment, size_t variant, rl_compared which);

#ifdef __cplusplus
}
#endif
#endif
