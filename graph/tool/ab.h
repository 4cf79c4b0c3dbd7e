/* `relit ab`: what is compared (ab_plan.c), how much it differs (ab_measure.c and what it calls), and what is
 * written about it (ab_json.c, ab_junit.c, ab_page.c, ab_sheet.c). cmd_ab.c puts them in a row:
 *
 *     command line → rl_ab_plan → rl_experiment → each frame: rl_ab_measure_frame, rl_ab_page_frame
 *                  → rl_ab_measure_end → metrics.json, junit.xml, report.html, exit status */
#ifndef RL_TOOL_AB_H
#define RL_TOOL_AB_H

#include "graph/base/arena.h"
#include "graph/run/experiment.h"
#include "graph/tool/metrics.h"
#include "graph/tool/options.h"

/* ---- what is compared (ab_plan.c) ---------------------------------------------------------------------- */

/* A value of the pipelines that is not the same in all variants. */
typedef struct rl_ab_parameter {
    const char *path;          /* "profiles.skin.texturing" */
    const char *const *values; /* [n_listed]: as YAML on one line; NULL: this variant has none */
} rl_ab_parameter;

enum { RL_AB_AGAINST = -1 }; /* as a reference: the files of --against */

typedef struct rl_ab_pair {
    int reference; /* a variant, or RL_AB_AGAINST */
    int test;
} rl_ab_pair;

/* In the arena it was made in; constant. */
typedef struct rl_ab_plan {
    const rl_variant *variants; /* the listed ones, then replicates of the first with other seeds */
    size_t n_variants, n_listed;
    const rl_ab_parameter *parameters;
    size_t n_parameters;
    const rl_ab_pair *pairs; /* of listed variants */
    size_t n_pairs;
    const char *against; /* --against: a file or a folder, or NULL */
} rl_ab_plan;

/* Reads the variants' pipelines as values, no pixel, no capture. Errors are of the command line and of YAML.
 */
rl_code rl_ab_plan_make(rl_arena *arena, const rl_arguments *args, const rl_log *log, rl_ab_plan *out,
                        rl_error *err);

/* ---- how much it differs (ab_measure.c) ---------------------------------------------------------------- */

enum { RL_AB_WHOLE = -1 }; /* as a material: all pixels that have one */

/* Statistics of one metric over the pixels of one material in one frame. */
typedef struct rl_ab_value {
    size_t pair, capture, index; /* a pair of the plan; the capture's index-th frame */
    long long frame;
    int material; /* dense index, or RL_AB_WHOLE */
    rl_metric metric;
    size_t pixels;
    double stats[RL_STATS]; /* as in metrics.h; NaN: does not exist */
} rl_ab_value;

/* The differences that chance alone makes: between replicates of the first variant. */
typedef struct rl_ab_null {
    size_t capture;
    int material;
    rl_metric metric;
    size_t n;                /* of values: pairs of replicates × frames */
    double bounds[RL_STATS]; /* the most different value of each statistic (psnr, ssim: the least) */
} rl_ab_null;

/* Owned by the measuring object. Ordered by capture, pair, frame, material (WHOLE first), metric. */
typedef struct rl_ab_results {
    const rl_ab_value *values;
    size_t n_values;
    const rl_ab_null *nulls; /* none: no pass is stochastic, or --seeds 1 */
    size_t n_nulls;
    bool stochastic; /* some pass of the first variant has a seed */
} rl_ab_results;

typedef struct rl_ab_measure rl_ab_measure;

/* flip, psnr and ssim are measured on DISPLAY images (clamped to 0 … 1), hdrflip, rmse and max on LINEAR
 * ones. Keeps pointers. */
rl_code rl_ab_measure_new(const rl_ab_plan *plan, const rl_experiment *experiment, rl_pool *pool,
                          const rl_log *log, rl_ab_measure **out, rl_error *err);
void rl_ab_measure_free(rl_ab_measure **measure);
/* RL_E_DATA on NaN in an image, with variant, frame and pixel. */
rl_code rl_ab_measure_frame(rl_ab_measure *measure, const rl_experiment_frame *frame, rl_error *err);
/* The map of a metric of the frame that was measured last; valid until the next one. NULL: not measured. */
const float *rl_ab_measure_map(const rl_ab_measure *measure, size_t pair, rl_metric metric);
/* The values so far. */
rl_code rl_ab_measure_results(rl_ab_measure *measure, rl_ab_results *out, rl_error *err);

#endif
