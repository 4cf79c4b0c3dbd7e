/* A small page of `relit ab` with pixels that a test can compute again: hand-made frames, metrics and graph.
 */
#ifndef RL_TESTS_PAGE_MAKE_H
#define RL_TESTS_PAGE_MAKE_H

#include "graph/tool/ab_page.h"

enum { PAGE_WIDTH = 160, PAGE_HEIGHT = 96, PAGE_FRAMES = 6, PAGE_VARIANTS = 3 };

typedef struct page_make_options {
    const char *folder, *path;
    const char *report_frames; /* or NULL */
    unsigned long long budget; /* or 0 */
    const char *name;          /* of the second variant, in all texts; NULL: "pre_post" */
    bool plain;                /* no display: plain sRGB */
    bool reference;            /* pairs are against files */
    int failed;                /* index of a frame that failed, or -1 */
    const rl_log *log;
} page_make_options;

/* Linear value of a pixel: exact as a half float. `variant` -1: the reference. */
float page_make_linear(int variant, int index, int channel, int x, int y);
/* The map of flip, in 255ths; hdrflip is half of it. */
int page_make_flip(int index, int x, int y);
/* 0 … 3. */
unsigned page_make_id(int x, int y);
/* The display: mixes channels, then a curve. */
void page_make_display(const float in[3], float out[3]);
/* The mean FLIP that metrics.json and the results say for a frame: the fourth is the worst. */
double page_make_mean(int index, int pair);

/* Makes frames, then the page; *out is what rl_ab_page_write says. */
rl_code page_make(const page_make_options *options, rl_ab_page_summary *out, rl_error *err);

/* A page of `relit plan --format html`: two nodes, the second of that name; with `trace`, a file that is
 * written there, it shows times: 5 ms for the first step, 1.5 and 0.5 for the other's. */
rl_code page_make_plan(const char *path, const char *trace, const char *node, rl_error *err);

#endif
