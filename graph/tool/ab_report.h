/* What the writers of `relit ab` are given: metrics.json (ab_json.h), junit.xml (ab_junit.h), the plain
 * sentence (ab_words.h), the table (ab_table.h) and --fail-over (ab_fail.h). */
#ifndef RL_TOOL_AB_REPORT_H
#define RL_TOOL_AB_REPORT_H

#include "graph/base/text.h"
#include "graph/tool/ab.h"

/* A frame that was not compared. */
typedef struct rl_ab_failure {
    size_t capture;
    long long frame;
    const char *text; /* of its error */
} rl_ab_failure;

struct rl_ab_verdict; /* ab_fail.h */

/* Nothing is owned. */
typedef struct rl_ab_report {
    const char *command; /* the command line, for people */
    const char *summary; /* of rl_ab_words; NULL: none yet */
    const rl_ab_plan *plan;
    const rl_experiment *experiment;
    const rl_ab_results *results;
    const rl_energy_ledger *energy; /* NULL: not kept */
    const struct rl_ab_verdict *verdicts;
    size_t n_verdicts;
    const rl_ab_failure *failures;
    size_t n_failures;
    size_t frames;     /* that were compared */
    double seconds;    /* of the whole run, by the clock */
    long long started; /* seconds since 1970, UTC; 0: not known */
} rl_ab_report;

/* "skin", or NULL for RL_AB_WHOLE. */
const char *rl_ab_material_name(const rl_ab_report *report, size_t capture, int material);
const char *rl_ab_capture_name(const rl_ab_report *report, size_t capture);
/* Of a pair: a variant's name, or the path of --against. */
const char *rl_ab_reference_name(const rl_ab_report *report, size_t pair);
const char *rl_ab_test_name(const rl_ab_report *report, size_t pair);

#endif
