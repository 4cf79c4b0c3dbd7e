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
    bool stochastic;     /* some pass of the first variant has a seed that its result depends on */
    int seeds;           /* of the first variant: 1 + replicates */
} rl_ab_plan;

/* Reads the variants' pipelines as values, no pixel, no capture. Errors are of the command line and of YAML.
 */
rl_code rl_ab_plan_make(rl_arena *arena, const rl_arguments *args, const rl_log *log, rl_ab_plan *out,
                        rl_error *err);

/* ---- how much it differs (ab_measure.c) ---------------------------------------------------------------- */

enum { RL_AB_WHOLE = -1 }; /* as a material: all pixels that have one */

/* Statistics of one metric over the pixels of one material in one frame. Materials without a pixel in a frame
 * have no values there, nor have metrics whose images do not exist (--against) or are too small (ssim). */
typedef struct rl_ab_value {
    size_t pair, capture, index; /* a pair of the plan; the capture's index-th frame */
    long long frame;
    int material; /* dense index, 1 …, or RL_AB_WHOLE */
    rl_metric metric;
    size_t pixels;          /* that count: ssim leaves out those within 5 of the border */
    double stats[RL_STATS]; /* as in metrics.h; NaN: does not exist */
} rl_ab_value;

/* The differences that chance alone makes: between the first variant and its replicates, all pairs of them,
 * over all frames. A value is marked when its mean is beyond bounds[RL_STAT_MEAN].
 *
 * How often that happens by chance: `n` counts values, and they are not independent, since pairs share images
 * and frames share seeds. What can be said without knowing how they depend: with R replicates, a first
 * variant and a test that differ in their random choices alone are R + 2 exchangeable images a frame, so the
 * largest difference of the test over all frames exceeds the largest of each of the R replicates with
 * probability at most 1 / (R + 1). That is the rate at which a pair, material and metric gets any mark at all
 * without a cause; with K of them K / (R + 1) are to be expected at most. */
typedef struct rl_ab_null {
    size_t capture;
    int material;
    rl_metric metric;
    size_t n;                /* of values: pairs of replicates × frames with the material */
    double bounds[RL_STATS]; /* the most different value of each statistic (psnr, ssim: the least) */
} rl_ab_null;

/* A capture's frames as they were measured. */
typedef struct rl_ab_size {
    int width, height; /* of the largest frame, 0: none yet */
} rl_ab_size;

/* Owned by the measuring object. Ordered by capture, frame, pair, material (WHOLE first), metric. */
typedef struct rl_ab_results {
    const rl_ab_value *values;
    size_t n_values;
    const rl_ab_null *nulls; /* none: no pass is stochastic, or --seeds 1 */
    size_t n_nulls;
    const rl_ab_size *sizes; /* [captures] */
} rl_ab_results;

/* Is the value's mean beyond all that chance made? 1 yes, 0 no, -1: there is no null distribution. */
int rl_ab_beyond_chance(const rl_ab_results *results, const rl_ab_value *value);
/* The null of a capture, material and metric, or NULL. */
const rl_ab_null *rl_ab_null_of(const rl_ab_results *results, size_t capture, int material, rl_metric metric);

typedef struct rl_ab_measure rl_ab_measure;

/* flip, psnr and ssim are measured on DISPLAY images (clamped to 0 … 1), hdrflip, rmse and max on LINEAR
 * ones; see metrics.h. Empty pixels (stencil index 0) are not counted, but the filters of flip, hdrflip and
 * ssim see them.
 *
 * Keeps pointers. Memory besides the values: a frame's three clamped planes for each variant, a map for each
 * metric and pair of the plan, and one for each replicate; not more for more frames. */
rl_code rl_ab_measure_new(const rl_ab_plan *plan, const rl_experiment *experiment, rl_pool *pool,
                          const rl_log *log, rl_ab_measure **out, rl_error *err);
void rl_ab_measure_free(rl_ab_measure **measure);
/* RL_E_DATA on NaN and infinities in an image, with variant, frame and pixel, and when a file of --against
 * does not fit. A frame that fails leaves no values. */
rl_code rl_ab_measure_frame(rl_ab_measure *measure, const rl_experiment_frame *frame, rl_error *err);
/* The map of a metric of the frame that was measured last; valid until the next one. NULL: not measured.
 * Without gaps, of the frame's size; all pixels, those without material too. */
const float *rl_ab_measure_map(const rl_ab_measure *measure, size_t pair, rl_metric metric);
/* --against: the [RL_COMPARED] images of the frame that was measured last, of its last pair; plane[0] of one
 * that the files do not give is NULL. NULL without --against. Valid until the next frame. */
const rl_compared_image *rl_ab_measure_reference(const rl_ab_measure *measure);
/* The values so far; pointers are valid until the next frame. */
rl_code rl_ab_measure_results(rl_ab_measure *measure, rl_ab_results *out, rl_error *err);

#endif
