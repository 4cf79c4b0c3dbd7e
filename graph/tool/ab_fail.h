/* --fail-over of `relit ab`: what is over a limit. */
#ifndef RL_TOOL_AB_FAIL_H
#define RL_TOOL_AB_FAIL_H

#include "graph/tool/ab_report.h"
#include "graph/tool/threshold.h"

/* What is over a limit. */
typedef struct rl_ab_offender {
    size_t capture;
    long long frame;
    int material; /* dense index or RL_AB_WHOLE */
    int pair;     /* of the plan; energy: -1, and: */
    int variant;  /* of the plan */
    const char *node;
    double value;
} rl_ab_offender;

typedef struct rl_ab_verdict {
    rl_threshold threshold; /* with a metric */
    const rl_ab_offender *over;
    size_t n_over;
    size_t n_checked; /* values */
} rl_ab_verdict;

/* Checks every pair, frame and material, the whole too. Verdicts in the order of the thresholds, in the
 * arena. Statistics that do not exist
 * (of no pixels) are not checked; a threshold of which not one exists is RL_E_DATA: a limit that nothing is
 * held against must not pass. */
rl_code rl_ab_fail_check(rl_arena *arena, const rl_ab_report *report, const rl_threshold *thresholds,
                         size_t n, rl_ab_verdict **out, rl_error *err);

/* How many thresholds are exceeded: exit status 3 unless 0. */
size_t rl_ab_fail_count(const rl_ab_report *report);

/* Adds a line for each threshold that is exceeded, then one for each of its first offenders, the worst first,
 * then "and N more". */
void rl_ab_fail_print(const rl_ab_report *report, rl_str *out);
/* One offender without a line's end: "pre_post, skin, frame 5: 0.084". */
void rl_ab_fail_offender(const rl_ab_report *report, const rl_ab_offender *offender, rl_str *out);

#endif
