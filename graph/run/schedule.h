/* Which frames of a sequence a run must process, in order, and what history each begins with. Knows numbers
 * only. */
#ifndef RL_RUN_SCHEDULE_H
#define RL_RUN_SCHEDULE_H

#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum rl_start {
    RL_START_ON,        /* history is what the frame before it left behind */
    RL_START_CUT,       /* none reaches here */
    RL_START_CHECKPOINT /* that of the checkpoint after the frame before it */
} rl_start;

typedef struct rl_work {
    size_t frame; /* index into the sequence's frames */
    rl_start start;
    bool write; /* false: processed for its history only */
} rl_work;

/* Indices from `first` to `last` - 1 are this run's. [i] of the others, all of the sequence's frames:
 * `cut`: no history reaches frame i; `needed`: its pictures have to be made; `saved`: there is a checkpoint
 * after it. */
typedef struct rl_schedule {
    size_t first, last;
    const bool *cut, *needed, *saved;
    bool hand_over; /* the state after the last frame is wanted too */
} rl_schedule;

/* Fills work[0…last-first-1] and returns how many of it are used. A frame that is needed takes along those
 * before it back to a cut or a checkpoint, no further than to `first`: when history would have to come from
 * before `first` and is not saved there, *lacking is set (and the frame starts as if it were there). */
size_t rl_schedule_make(const rl_schedule *schedule, rl_work *work, bool *lacking);

/* Shards: where the i-th of n parts of `total` frames begins, 0 <= i <= n. `ends[k]` is how many frames
 * captures 0…k have together. With at least as many captures as parts, parts begin where captures do: at the
 * nearest. */
size_t rl_shard_begin(size_t i, size_t n, const size_t *ends, size_t n_captures);

#ifdef __cplusplus
}
#endif
#endif
