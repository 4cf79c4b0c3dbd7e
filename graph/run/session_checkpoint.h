/* Checkpoints of a running sequence: taken, stored, found, loaded, dropped. Inside of session_state.c. */
#ifndef RL_RUN_SESSION_CHECKPOINT_H
#define RL_RUN_SESSION_CHECKPOINT_H

#include "graph/run/session_state.h"

#ifdef __cplusplus
extern "C" {
#endif

double rl_state_now(void); /* s on the monotonic clock */
/* saved[i] for frames from…to-1 whose checkpoint is there and of this run; says why others are refused. One
 * without history before this run's first frame cuts that. */
rl_code rl_state_find_checkpoints(rl_sequence_state *state, size_t from, size_t to, const uint64_t *chains,
                                  bool *saved, rl_error *err);
/* Removes checkpoints inside of this run's frames that nobody will go on from: of the `saved` ones those that
 * the work needs stay, the newest, and the last before a frame that cannot be used. */
void rl_state_drop_checkpoints(rl_sequence_state *state, const bool *saved);

/* All of the checkpoint after a frame; an error when it is not of this run. */
rl_code rl_state_load_checkpoint(const rl_sequence_state *state, int frame, rl_checkpoint *out,
                                 rl_error *err);
/* Loads it into the executor. *restored is false when it says that history ended there. */
rl_code rl_state_restore(rl_sequence_state *state, int frame, bool *restored, int *previous, camera_t *camera,
                         rl_error *err);

/* Whether the frame that has just run should be saved: every --checkpoint-frames, else when the time since
 * the last one is 50 times what a checkpoint costs, so that they take 2 % of a run. */
bool rl_state_is_due(const rl_sequence_state *state);
/* Run stage: copies history into the slot (out of memory: none is taken). Write stage: writes it as a file,
 * removes the one before the last. */
void rl_state_take(rl_sequence_state *state, rl_slot_state *slot);
rl_code rl_state_store(rl_sequence_state *state, rl_slot_state *slot, rl_error *err);
/* From now on the checkpoints that exist stay: a frame failed behind them. */
void rl_state_pin(rl_sequence_state *state);

#ifdef __cplusplus
}
#endif
#endif
