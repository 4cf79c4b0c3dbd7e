/* Temporary files of processes that were killed while they wrote. */
#ifndef RL_RUN_LEFTOVERS_H
#define RL_RUN_LEFTOVERS_H

#include "graph/base/arena.h"
#include "graph/base/error.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Removes the temporary files (rl_file_temp) beside `paths` that were to become one of them, unless the
 * process that made them still runs on this machine. Sorts paths. What cannot be read or removed stays. */
void rl_leftovers_remove(const char **paths, size_t n);

#ifdef __cplusplus
}
#endif
#endif
