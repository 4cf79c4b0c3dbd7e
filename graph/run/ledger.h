/* What a run has done so far: a line in OUT/.relit/ for every frame that was begun, written, or failed, kept
 * so that a later run can tell which pictures are whole, which inputs they were made from, and by what. One
 * file a process (shards of one run may share a folder, also over a network); all of a capture's are read.
 *
 * One thread writes and finds; rl_ledger_inputs may be called from any. */
#ifndef RL_RUN_LEDGER_H
#define RL_RUN_LEDGER_H

#include <stdbool.h>
#include <stdint.h>

#include "graph/base/error.h"
#include "graph/model/frames.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The files that a frame is made from. `stat` is a hash of their sizes and times of change, `content` of
 * their bytes: while `stat` stays what it was, the bytes are not read again. */
typedef struct rl_inputs {
    uint64_t stat, content;
    bool missing; /* one of them cannot be read */
    bool broken;  /* of a ledger's line: they were there, and no frame could be made of them */
} rl_inputs;

typedef enum rl_ledger_kind {
    RL_LEDGER_NONE,
    RL_LEDGER_BEGUN,
    RL_LEDGER_DONE,
    RL_LEDGER_FAILED
} rl_ledger_kind;

/* The last that is known of a frame. */
typedef struct rl_ledger_line {
    rl_ledger_kind kind;
    uint64_t time;    /* ns since 1970; the later of two lines counts */
    uint64_t chain;   /* DONE: all that the pictures depend on (rl_chain in session_state.h) */
    rl_inputs inputs; /* as they were when the frame was last read; zero when not known */
} rl_ledger_line;

typedef struct rl_ledger rl_ledger;

/* Reads what there is about a capture (damaged lines are left out). `name` becomes part of file names; `tag`
 * tells processes that work at the same time apart ("" when there is one). `frames` are those that can occur.
 */
rl_code rl_ledger_open(const char *folder, const char *name, const char *tag, const rl_frames *frames,
                       rl_ledger **out, rl_error *err);
void rl_ledger_close(rl_ledger **ledger);

const rl_ledger_line *rl_ledger_find(const rl_ledger *ledger, int frame); /* never NULL */

/* Hashes the files of a frame, or takes the hash from the ledger when their sizes and times are what they
 * were. */
rl_inputs rl_ledger_inputs(rl_ledger *ledger, int frame, const char *const *paths, size_t n);

/* BEGUN is written before the first picture of a frame that has a line already is touched, DONE when all are
 * whole. */
rl_code rl_ledger_write(rl_ledger *ledger, int frame, rl_ledger_kind kind, uint64_t chain,
                        const rl_inputs *inputs, rl_error *err);

/* The part of file names below the folder that stands for a capture: no '/', no leading dot. In the arena. */
char *rl_ledger_name(rl_arena *arena, const char *capture);

#ifdef __cplusplus
}
#endif
#endif
