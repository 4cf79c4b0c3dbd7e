/* Files that come with relit: kernels are in the library, but configs are read from disk. */
#ifndef RL_RUN_DATA_FILES_H
#define RL_RUN_DATA_FILES_H

#include "graph/base/arena.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The path of configs/NAME ("color/relit.ocio", "presets"): in $RELIT_DATA, in or above the folder of the
 * library or the program (a build tree's configs, an installed share/relit/configs), in the place that relit
 * was built for; NULL when it is in none of them. In the arena. */
const char *rl_data_path(rl_arena *arena, const char *name);

#ifdef __cplusplus
}
#endif
#endif
