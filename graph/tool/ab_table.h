/* What `relit ab` prints about differences: a table a pair. */
#ifndef RL_TOOL_AB_TABLE_H
#define RL_TOOL_AB_TABLE_H

#include "graph/tool/ab_report.h"

/* Adds a table for each pair and capture: a row for all materials and for each, mean over the frames, and,
 * when there are several, a second row for the frame that is worst by FLIP (else HDR-FLIP). Over frames rmse
 * and psnr are those of all pixels of equal frames: the root of the mean square. Up to 100 columns wide. */
void rl_ab_table(const rl_ab_report *report, rl_str *out);

#endif
