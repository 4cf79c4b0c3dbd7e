/* The state of a run of one sequence: which frames it takes on, what is known of those that are done, where
 * history comes from and where it is saved. session_batch.c calls it from its three stages.
 *
 * The chain of a frame is a hash of all that its pictures depend on: the identity of the run (checkpoint.h)
 * and the inputs of every frame since history began. Equal chains mean equal bits. It may differ where bits
 * would not (a camera jump, which only the headers tell, does not end it): then a frame is made once more
 * than needed. */
#ifndef RL_RUN_SESSION_STATE_H
#define RL_RUN_SESSION_STATE_H

#include "graph/run/checkpoint.h"
#include "graph/run/ledger.h"
#include "graph/run/schedule.h"
#include "graph/run/session.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum rl_usable { RL_USABLE_UNKNOWN, RL_USABLE, RL_NOT_USABLE } rl_usable;

/* What belongs to a frame in flight. */
typedef struct rl_slot_state {
    rl_inputs inputs; /* its own files */
    uint64_t content; /* theirs, and of the frame that it holds */
    uint64_t chain;
    bool alone;          /* no history reaches it: its own files cannot be used */
    rl_checkpoint saved; /* history NULL: none to be written */
    double saved_s;      /* seconds that taking it cost */
} rl_slot_state;

typedef struct rl_sequence_state {
    rl_session *session;
    rl_sequence *sequence;
    rl_arena arena;
    const char *folder, *name; /* OUT/.relit; the capture's name as a part of file names */
    rl_identity identity;
    uint64_t root;      /* the chain of nothing */
    bool history;       /* the plan keeps some */
    bool hands_over;    /* another shard goes on behind the last frame */
    size_t first, last; /* indices of the sequence's frames: this run's, warm-up included */
    size_t warm;        /* so many of them are warm-up */
    bool *cut;          /* [frames.n]: no history reaches it, for all that is known before it runs */
    rl_usable *usable;  /* [frames.n]: whether its own files can be used (session_inputs.h), and */
    rl_inputs *inputs;  /* [frames.n], where that is known: what they were when the run began */
    rl_ledger *ledger;
    rl_work *work;
    size_t n_work, n_write; /* frames to be run; of them to be written */
    size_t n_there;         /* frames whose pictures are there already */
    bool lacking;           /* history from before `first` is needed, and not saved */
    /* the run stage's */
    uint64_t chain;
    bool chained; /* the last frame ran, and `chain` is its own */
    int last_frame;
    double saved_at; /* s on the monotonic clock: when the last checkpoint was taken, or the run began */
    int since;       /* frames that ran since then */
    double cost_s;   /* of a checkpoint, all in all; 0: none was written yet */
    bool pending;    /* a checkpoint was taken and is not written yet: one at a time, it is large; atomic */
    /* the write stage's: frames of the checkpoints that this run has written and not removed, oldest first */
    int *kept;
    size_t n_kept, n_pinned; /* the first of them that stay, since a frame behind them failed */
    bool failed;
    rl_slot_state slots[RL_MOST_IN_FLIGHT];
} rl_sequence_state;

/* session_shard.c: the part of a sequence's frames that belongs to this run's shard: all without --shard. */
typedef struct rl_part {
    size_t first, last; /* indices; last is not in it. Warm-up included */
    size_t warm;        /* frames of it that are warm-up */
    bool hands_over;    /* another shard goes on behind it */
} rl_part;
void rl_session_part(const rl_session *session, size_t sequence, rl_part *out);
/* Whether no history reaches frame i, as far as the manifest and the numbers tell. */
bool rl_sequence_is_cut(const rl_sequence *sequence, size_t i);
bool rl_plan_has_history(const rl_plan *plan);

/* session_identity.c: needs a prepared session. */
rl_code rl_session_identity(const rl_session *session, const rl_sequence *sequence, rl_identity *out,
                            rl_error *err);

/* Reads what is in OUT/.relit and decides what has to be run. The executor must be there. A frame's chain is
 * compared with --resume only; a shard's predecessor always. rl_sequence_state_end may follow in any case. */
rl_code rl_sequence_state_begin(rl_sequence_state *state, rl_session *session, size_t sequence,
                                rl_error *err);
void rl_sequence_state_end(rl_sequence_state *state);

/* The stages, for work item `w` in a slot. loaded: what became of reading frame `index`. ready: before its
 * kernels, an error or not; tells whether history was loaded from a checkpoint, of which frame and camera.
 * ran: after them; `keeps`: the next frame may use its history. */
void rl_state_loaded(rl_sequence_state *state, int slot, size_t index, const rl_loaded *loaded);
void rl_state_ready(rl_sequence_state *state, const rl_work *w, int slot, bool *restored, int *previous,
                    camera_t *camera, rl_error *err);
void rl_state_ran(rl_sequence_state *state, int slot, const rl_frame *frame, bool keeps);
/* writing: before the first picture is touched. written: after the last. */
rl_code rl_state_writing(rl_sequence_state *state, int slot, int frame, rl_error *err);
void rl_state_written(rl_sequence_state *state, const rl_work *w, int slot, const rl_frame *frame);
/* After the last frame: a checkpoint there when somebody may go on from it, none left over when nobody will.
 * An error when the next shard waits for one that cannot be written. */
rl_code rl_state_finish(rl_sequence_state *state, bool stopped, rl_error *err);

#ifdef __cplusplus
}
#endif
#endif
