/* What a run of a sequence tells (session_notes.c). */
#ifndef RL_RUN_SESSION_NOTES_H
#define RL_RUN_SESSION_NOTES_H

#include "graph/run/session_checkpoint.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What is there already, where it goes on, what is processed for its history only: notes in the session's
 * log. */
void rl_state_announce(const rl_sequence_state *state);
/* The error of a shard whose predecessor has not finished. */
rl_code rl_state_lacks(const rl_sequence_state *state, rl_error *err);

/* The hooks `stage` and `span`, where there are any. A span ends now. */
void rl_session_stage(const rl_run_hooks *hooks, rl_lane lane, const rl_frame *frame);
void rl_session_span(const rl_run_hooks *hooks, const rl_sequence *sequence, const rl_frame *frame,
                     rl_lane lane, const char *category, const char *name, double start_s);
/* The plan's steps, after the device has finished. */
void rl_session_step_spans(const rl_run_hooks *hooks, const rl_sequence *sequence, const rl_frame *frame,
                           const rl_span *spans);

#ifdef __cplusplus
}
#endif
#endif
