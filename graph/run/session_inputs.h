/* What the frames of a sequence are made of, as hashes of their files. Inside of session_state.c. */
#ifndef RL_RUN_SESSION_INPUTS_H
#define RL_RUN_SESSION_INPUTS_H

#include "graph/run/session_state.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Of the files of frame i alone, as they are now. */
rl_inputs rl_state_own_inputs(const rl_sequence_state *state, size_t i);

/* A held frame is made of its own files, if there are any, and of those of the frame that it holds. */
uint64_t rl_state_held_content(const rl_inputs *own, const rl_inputs *source);

/* Whether a frame can be made of the files of frame i. Those that could not be read when a run last tried are
 * tried again, once: the reason may have been another one than their bytes. This and what is below looks at
 * files once, from one thread, before the frames run. */
bool rl_state_is_usable(rl_sequence_state *state, size_t i);

bool rl_state_is_missing(rl_sequence_state *state, size_t i); /* one of the files cannot even be opened */

/* Of what frame i will be made of, with what --on-missing puts in the place of files that cannot be used. */
uint64_t rl_state_expected_content(rl_sequence_state *state, size_t i);

#ifdef __cplusplus
}
#endif
#endif
