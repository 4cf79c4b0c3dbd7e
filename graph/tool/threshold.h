/* --fail-over of `relit diff` and `relit ab`: limits that differences must keep. */
#ifndef RL_TOOL_THRESHOLD_H
#define RL_TOOL_THRESHOLD_H

#include "graph/base/arena.h"
#include "graph/tool/metrics.h"

/* Besides the metrics: none was named, so it is the one that is shown (diff) or flip (ab); the energy that a
 * pass loses or makes. */
enum { RL_THRESHOLD_SHOWN = -1, RL_THRESHOLD_ENERGY = -2 };

typedef struct rl_threshold {
    int metric; /* rl_metric, or one of the above */
    rl_stat stat;
    double limit;
} rl_threshold;

/* The metric of an option's value ("relit diff", "metric", "flipp"); an unknown one is RL_E_USAGE with the
 * nearest. */
rl_code rl_threshold_metric(const char *place, const char *option, const char *name, int *out, rl_error *err);

/* "0.02" (the mean), "flip=0.02", "flip.p95=0.05", and "energy=0.01" where `energy` is true. RL_E_USAGE. */
rl_code rl_threshold_parse(rl_arena *arena, const char *place, const char *text, bool energy,
                           rl_threshold *out, rl_error *err);

/* psnr and ssim fail below their limit. NaN is over every limit. */
bool rl_threshold_is_over(rl_metric metric, double limit, double value);
/* "flip.p95", "energy"; `out` holds 32 bytes. */
const char *rl_threshold_name(const rl_threshold *threshold, char *out);

#endif
