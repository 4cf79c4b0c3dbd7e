/* --sheet: one labelled picture of all variants, a tile each, of one frame: name, varied values, and FLIP
 * against the last variant (over the pixels that have a material, as in metrics.json).
 *
 * Used by one thread at a time. */
#ifndef RL_TOOL_AB_SHEET_H
#define RL_TOOL_AB_SHEET_H

#include "graph/tool/ab.h"

/* Which frame of n (numbers, ascending in order of processing): the first that --report-frames begins with
 * ("first", or a number that is there), else the last. n > 0. */
size_t rl_ab_sheet_choose(const char *report_frames, const long long *frames, size_t n);

typedef struct rl_ab_sheet rl_ab_sheet;

/* `index`: of the frame, in the first capture. `title` is drawn on top: "monkey frame 8, sRGB / ACES". Keeps
 * pointers. */
rl_code rl_ab_sheet_new(const rl_ab_plan *plan, size_t index, const char *title, rl_pool *pool,
                        rl_ab_sheet **out, rl_error *err);
void rl_ab_sheet_free(rl_ab_sheet **sheet);

/* Takes the images of the frame that the sheet is of; others, and a failed one, do nothing. */
rl_code rl_ab_sheet_frame(rl_ab_sheet *sheet, const rl_experiment_frame *frame, rl_error *err);

/* Writes the picture, 8 bits, at most RL_AB_SHEET_MOST pixels wide and high; whole or not at all. RL_E_DATA
 * when its frame has not come. */
enum { RL_AB_SHEET_MOST = 4096 };
rl_code rl_ab_sheet_write(const rl_ab_sheet *sheet, const char *path, rl_error *err);

#endif
