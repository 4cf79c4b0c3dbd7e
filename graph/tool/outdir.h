/* The output folder: a complaint about it must come before the first frame, not from each of them. */
#ifndef RL_TOOL_OUTDIR_H
#define RL_TOOL_OUTDIR_H

#include "graph/base/arena.h"
#include "graph/base/error.h"

/* Makes the folder (NULL: "out") and proves that a file can be made in it. RL_E_IO names the folder. */
rl_code rl_outdir_make(const char *path, rl_error *err);

/* The same question without writing: the folder, or the nearest folder above it that exists, may be written.
 */
rl_code rl_outdir_check(rl_arena *arena, const char *path, rl_error *err);

#endif
