/* All that the tool prints besides a command's own result: errors, warnings, notes, progress. report.c is the
 * only file that writes to stderr. */
#ifndef RL_TOOL_REPORT_H
#define RL_TOOL_REPORT_H

#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "graph/base/text.h"
#include "graph/relit.h"

enum { RL_REPORT_SEEN = 256 };

typedef struct rl_reporter {
    FILE *out, *err;
    bool quiet, verbose, json; /* set once the command line is read */
    bool resumes;              /* a run that was stopped can go on with --resume; true at first */
    bool terminal, color;      /* of err */
    pthread_mutex_t lock;
    rl_log log;                    /* hand &log to whatever reports; any thread */
    uint64_t seen[RL_REPORT_SEEN]; /* hashes of the warnings and notes that were printed: each once */
    size_t n_seen;
    bool bar;                   /* a progress bar stands on the terminal's last line */
    uint64_t bar_at;            /* ns, when it was drawn */
    uint64_t begin;             /* ns on CLOCK_MONOTONIC */
    long long stages[RL_LANES]; /* the frame that each stage is at, */
    bool staged[RL_LANES];      /* if it is at one */
    size_t done, total;         /* of the last frame that was reported */
    rl_str failed;              /* a line for each frame that failed: "monkey frame 3: why" */
    size_t n_files;
} rl_reporter;

/* out: results; err: everything else. */
void rl_reporter_begin(rl_reporter *r, FILE *out, FILE *err);
void rl_reporter_end(rl_reporter *r);

/* "file:line:column: error: text". */
void rl_report_error(rl_reporter *r, const rl_error *err);
/* {"code", "file", "line", "column", "text"}; NULL when memory is out. */
struct json_t;
struct json_t *rl_report_error_json(const rl_error *err);
/* A command's result, on stdout, all of it or an error: a full disk must not end with status 0. */
rl_code rl_report_result(rl_reporter *r, const char *text, rl_error *err);

/* Progress of a run. A frame: a bar on a terminal, a line elsewhere, an object with --json. */
void rl_report_run_begin(rl_reporter *r);
void rl_report_stage(rl_reporter *r, rl_lane lane, long long frame);
void rl_report_frame(rl_reporter *r, const rl_frame_result *frame);
void rl_report_run_end(rl_reporter *r, const rl_run_summary *summary, bool stopped);

#endif
