/* report.html: the page of `relit ab`, one file that needs nothing else. cmd_ab.c hands over each frame after
 * it was measured (rl_ab_page_measured), and writes the page at the end (rl_ab_page_write) from metrics.json.
 *
 * The page holds pixels of the frames that matter: the first, the last, and the worst by each metric so far
 * (--report-frames changes that). Meanwhile they are in a spool file of the report's folder that has no name:
 * it is gone when the page is freed, and when the process ends, whatever ends it. Frames that the page does
 * not hold are linked: the files that the run wrote.
 *
 * Used by one thread at a time. Errors: RL_E_MEMORY, RL_E_IO, and what is said. */
#ifndef RL_TOOL_AB_PAGE_H
#define RL_TOOL_AB_PAGE_H

#include "graph/model/frames.h"
#include "graph/tool/ab.h"

/* Bytes that a page may have when nothing else is asked for. */
#define RL_AB_PAGE_BUDGET (96ull << 20)

/* What the pipeline shows: from scene-linear Rec. 709 to encoded values, 0 … 1 but not clamped, with the
 * output's own exposure and look. n pixels, in place. */
typedef struct rl_ab_page_display {
    const char *name; /* "sRGB / ACES" */
    rl_code (*apply)(const void *ctx, float *r, float *g, float *b, size_t n, rl_error *err);
    const void *ctx;
} rl_ab_page_display;

/* What the page has to know of an experiment before its first frame. Keeps pointers. */
typedef struct rl_ab_page_source {
    size_t n_captures;
    const size_t *n_frames;             /* [n_captures]: to be processed */
    const rl_ab_page_display *displays; /* different ones */
    size_t n_displays;                  /* 0: plain sRGB is all there is */
    const size_t *display_of;           /* [plan->n_listed] */
} rl_ab_page_source;

/* From an experiment (ab_page_source.c); in the arena. Keeps pointers to the experiment. */
rl_code rl_ab_page_source_make(rl_arena *arena, const rl_ab_plan *plan, const rl_experiment *experiment,
                               rl_ab_page_source *out, rl_error *err);
/* What rl_ab_page_source_make opened; the arena is the caller's. */
void rl_ab_page_source_close(rl_ab_page_source *source);

typedef struct rl_ab_page_options {
    const char *folder; /* the report's: the spool is in it, and links start from it */
    /* --report-frames: words and frame numbers in a list, "first,last,worst,all,none,1-24x2"; NULL:
     * "first,last,worst". Anything else is RL_E_USAGE. */
    const char *frames;
    unsigned long long budget; /* bytes of the page; 0: RL_AB_PAGE_BUDGET. Beyond it fewer frames are held */
    rl_pool *pool;             /* or NULL */
    const rl_log *log;         /* or NULL */
} rl_ab_page_options;

typedef struct rl_ab_page rl_ab_page;

/* Keeps the pointers that it is given, until rl_ab_page_free. Bakes the displays (some 10 ms each). */
rl_code rl_ab_page_new(const rl_ab_plan *plan, const rl_ab_page_source *source,
                       const rl_ab_page_options *options, rl_ab_page **out, rl_error *err);
/* The frames that options.frames gives by number. */
const rl_frames *rl_ab_page_asked(const rl_ab_page *page);

void rl_ab_page_free(rl_ab_page **page);

/* A frame and what was measured of it. Lives during the call. */
typedef struct rl_ab_page_input {
    const rl_experiment_frame *frame; /* one that failed is noted as such; nothing else is looked at then */
    const rl_ab_results *results;     /* the values so far, of this frame too */
    /* The metric's map of a pair in this frame, width · height values, or NULL. */
    const float *(*map)(const void *ctx, size_t pair, rl_metric metric);
    const void *ctx;
    /* --against: [RL_COMPARED], plane[0] of one that does not exist NULL (a DISPLAY one alone is decoded from
     * sRGB for the page); else NULL. */
    const rl_compared_image *reference;
} rl_ab_page_input;

/* Frames may come in any order. An error leaves the page as it was before. */
rl_code rl_ab_page_frame(rl_ab_page *page, const rl_ab_page_input *input, rl_error *err);
/* The same of the frame that was measured last (ab_page_source.c). `reference` as above. */
rl_code rl_ab_page_measured(rl_ab_page *page, const rl_experiment_frame *frame, rl_ab_measure *measure,
                            const rl_compared_image *reference, rl_error *err);

/* What the page holds: for the log, and for tests. */
typedef struct rl_ab_page_summary {
    size_t frames;            /* that were handed over and ran */
    size_t held;              /* of them, with pixels */
    size_t left_out;          /* that were asked for, but did not fit the budget */
    unsigned long long bytes; /* of the file that was written last */
} rl_ab_page_summary;

/* Writes report.html, whole or not at all. `metrics` is the text of metrics.json: an object (RL_E_FORMAT
 * otherwise). A page without some frames because of its budget is a note to the log. out may be NULL. */
rl_code rl_ab_page_write(rl_ab_page *page, const char *path, const char *metrics, rl_ab_page_summary *out,
                         rl_error *err);

#endif
