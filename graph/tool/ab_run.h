/* Inside of `relit ab`: cmd_ab.c, ab_frames.c (each frame) and ab_finish.c (what is written at the end). */
#ifndef RL_TOOL_AB_RUN_H
#define RL_TOOL_AB_RUN_H

#include "graph/tool/ab_fail.h"
#include "graph/tool/ab_page.h"
#include "graph/tool/ab_sheet.h"
#include "graph/tool/tool.h"
#include "graph/tool/trace.h"

typedef struct rl_ab_run {
    rl_tool *tool;
    const char *out; /* folder */
    rl_ab_plan plan;
    rl_threshold *thresholds; /* of --fail-over */
    size_t n_thresholds;
    rl_experiment *experiment; /* owned, like all below */
    rl_pool *pool;
    rl_ab_measure *measure;
    rl_ab_page_source source;
    rl_ab_page *page;
    rl_ab_sheet *sheet; /* NULL without --sheet */
    const char *sheet_path;
    rl_trace *trace; /* NULL without --trace */
    rl_energy_ledger energy;
    rl_experiment **ledgers; /* whose nodes its rows name, where they are not the experiment's */
    size_t n_ledgers;
    rl_ab_failure *failures;
    size_t n_failures, room_failures;
    size_t frames;     /* that were compared */
    bool incomparable; /* an image held NaN or infinity, or the reference has another size */
} rl_ab_run;

/* Hooks of the run, ctx is an rl_ab_run. A frame that cannot be measured is a frame that failed. */
void rl_ab_run_hooks(rl_ab_run *run, rl_experiment_hooks *out);

/* ab_ledger.c: adds the ledger of energy of each capture's last frame to run->energy. */
rl_code rl_ab_ledger(rl_ab_run *run, rl_error *err);

/* Removes what a command that was killed left of the files that rl_ab_finish writes. */
void rl_ab_clean(rl_ab_run *run);

/* Writes metrics.json, junit.xml, report.html and the sheet, and prints the summary; *over is how many
 * thresholds are exceeded. */
rl_code rl_ab_finish(rl_ab_run *run, double seconds, size_t *over, rl_error *err);

#endif
