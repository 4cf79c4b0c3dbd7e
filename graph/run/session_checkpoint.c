#include "graph/run/session_checkpoint.h"

#include <string.h>
#include <time.h>
#include <unistd.h>

#include "graph/base/alloc.h"
#include "graph/run/session_inputs.h"

double rl_state_now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* ---- found -----------------------------------------------------------------------------------------------
 */

static rl_code path_of(const rl_sequence_state *st, rl_arena *arena, int frame, const char **path,
                       rl_error *err)
{
    *path = rl_checkpoint_path(arena, st->folder, st->name, frame);
    return *path ? RL_OK : rl_fail_memory(err, 1);
}

static bool is_usable(rl_sequence_state *st, int frame)
{
    long i = rl_frames_find(&st->sequence->frames, frame);
    return i >= 0 && rl_state_is_usable(st, (size_t)i);
}

/* Why a checkpoint is of no use here: "" when it is of use. */
static void refusal(rl_sequence_state *st, const rl_checkpoint *c, uint64_t chain, char *out, size_t size)
{
    rl_identity_difference(&c->identity, &st->identity, out, size);
    if (!*out && c->chain != chain)
        strncpy(out, "input files of the frames up to it differ, or a frame failed then", size - 1);
    /* A run that made the frame after all, and was stopped before it could say what history is now. */
    if (!*out && !c->bytes && rl_ledger_find(st->ledger, c->frame)->kind != RL_LEDGER_FAILED &&
        is_usable(st, c->frame))
        strncpy(out, "its frame had failed, and has not since", size - 1);
}

static void judge(rl_sequence_state *st, int frame, uint64_t chain, bool *saved, bool *ended)
{
    rl_arena arena = {0};
    rl_error err = {0};
    rl_checkpoint c = {0};
    const char *path;
    char why[256] = "";
    if (!path_of(st, &arena, frame, &path, &err) && !rl_checkpoint_read(path, false, &c, &err))
        refusal(st, &c, chain, why, sizeof why);
    if (err.code)
        rl_report(st->session->log, RL_NOTE, (rl_where){.file = err.file}, "%s; it is not used", err.text);
    else if (*why)
        rl_report(st->session->log, RL_NOTE, (rl_where){.file = path}, "this checkpoint is not used: %s",
                  why);
    *saved = !err.code && !*why;
    *ended = *saved && !c.bytes;
    rl_checkpoint_free(&c);
    rl_arena_free(&arena);
}

rl_code rl_state_find_checkpoints(rl_sequence_state *st, size_t from, size_t to, const uint64_t *chains,
                                  bool *saved, rl_error *err)
{
    int *frames;
    size_t n;
    rl_code code = rl_checkpoint_list(&st->arena, st->folder, st->name, &frames, &n, err);
    for (size_t k = 0; k < n && !code; k++) {
        long i = rl_frames_find(&st->sequence->frames, frames[k]);
        bool ended = false;
        if (i >= (long)from && i < (long)to)
            judge(st, frames[k], chains[i], &saved[i], &ended);
        if (ended && i + 1 == (long)st->first)
            st->cut[st->first] = true;
    }
    return code;
}

static void remove_one(const rl_sequence_state *st, int frame)
{
    rl_arena arena = {0};
    const char *path = rl_checkpoint_path(&arena, st->folder, st->name, frame);
    if (path)
        unlink(path);
    rl_arena_free(&arena);
}

/* The last one before a frame that cannot be used: from there it goes on when its files are repaired. */
static bool before_broken(const rl_sequence_state *st, const bool *saved, size_t i)
{
    for (size_t k = i + 1; k < st->last; k++) {
        if (st->usable[k] == RL_NOT_USABLE)
            return true;
        if (saved[k])
            return false;
    }
    return false;
}

void rl_state_drop_checkpoints(rl_sequence_state *st, const bool *saved)
{
    int *frames;
    size_t n;
    rl_error ignored = {0};
    size_t newest = 0;
    for (size_t i = st->first; i < st->last; i++)
        newest = saved[i] ? i : newest;
    if (rl_checkpoint_list(&st->arena, st->folder, st->name, &frames, &n, &ignored))
        return;
    for (size_t k = 0; k < n; k++) {
        long i = rl_frames_find(&st->sequence->frames, frames[k]);
        if (i < (long)(st->first + st->warm) || i >= (long)st->last)
            continue; /* another shard's */
        bool used = saved[i] && ((size_t)i == newest || before_broken(st, saved, (size_t)i));
        for (size_t w = 0; w < st->n_work; w++)
            used |= st->work[w].start == RL_START_CHECKPOINT && st->work[w].frame == (size_t)i + 1;
        if (!used)
            remove_one(st, frames[k]);
    }
}

/* ---- loaded ----------------------------------------------------------------------------------------------
 */

rl_code rl_state_load_checkpoint(const rl_sequence_state *st, int frame, rl_checkpoint *out, rl_error *err)
{
    rl_arena arena = {0};
    const char *path;
    char why[256];
    rl_code code = path_of(st, &arena, frame, &path, err);
    if (!code)
        code = rl_checkpoint_read(path, true, out, err);
    if (!code) {
        rl_identity_difference(&out->identity, &st->identity, why, sizeof why);
        if (*why)
            code = rl_fail_file(err, RL_E_DATA, path, "this checkpoint cannot be used: %s", why);
    }
    rl_arena_free(&arena);
    return code;
}

rl_code rl_state_restore(rl_sequence_state *st, int frame, bool *restored, int *previous, camera_t *camera,
                         rl_error *err)
{
    rl_checkpoint c = {0};
    rl_executor *x = st->sequence->executor;
    rl_code code = rl_state_load_checkpoint(st, frame, &c, err);
    if (!code && c.bytes)
        code = rl_executor_history_load(x, &c.geometry, c.history, c.bytes, &c.previous, err);
    *restored = st->chained = !code && c.bytes > 0;
    st->chain = c.chain;
    *previous = c.frame;
    *camera = c.previous;
    rl_checkpoint_free(&c);
    return code;
}

/* ---- taken and stored ------------------------------------------------------------------------------------
 */

bool rl_state_is_due(const rl_sequence_state *st)
{
    int every = st->session->options.checkpoint_frames;
    if (__atomic_load_n(&st->pending, __ATOMIC_ACQUIRE))
        return false;
    if (every > 0)
        return st->since >= every;
    /* Before the first: a disk that writes 200 MB/s, and a twentieth of a second to make it safe. */
    double cost = st->cost_s > 0 ? st->cost_s
                                 : 0.05 + (double)rl_executor_history_bytes(st->sequence->executor) / 200e6;
    return rl_state_now() - st->saved_at >= 50 * cost;
}

static rl_code take(rl_sequence_state *st, rl_checkpoint *c, uint64_t chain, rl_error *err)
{
    rl_executor *x = st->sequence->executor;
    *c = (rl_checkpoint){.identity = st->identity,
                         .chain = chain,
                         .frame = st->last_frame,
                         .geometry = *rl_executor_geometry(x),
                         .bytes = rl_executor_history_bytes(x)};
    c->history = rl_malloc(c->bytes);
    rl_code code = c->history ? rl_executor_history_save(x, c->history, &c->previous, err)
                              : rl_fail_memory(err, c->bytes);
    if (code)
        rl_checkpoint_free(c);
    return code;
}

void rl_state_take(rl_sequence_state *st, rl_slot_state *slot)
{
    double start = rl_state_now();
    rl_error ignored = {0};
    st->saved_at = start;
    st->since = 0;
    if (take(st, &slot->saved, slot->chain, &ignored))
        return;
    slot->saved_s = rl_state_now() - start;
    __atomic_store_n(&st->pending, true, __ATOMIC_RELEASE);
}

static rl_code store(rl_sequence_state *st, const rl_checkpoint *c, rl_error *err)
{
    rl_arena arena = {0};
    const char *path;
    rl_code code = path_of(st, &arena, c->frame, &path, err);
    if (!code)
        code = rl_checkpoint_write(path, c, err);
    if (!code && st->n_kept < st->sequence->frames.n)
        st->kept[st->n_kept++] = c->frame;
    rl_arena_free(&arena);
    return code;
}

rl_code rl_state_store(rl_sequence_state *st, rl_slot_state *slot, rl_error *err)
{
    if (!slot->saved.history)
        return RL_OK;
    double start = rl_state_now();
    rl_code code = store(st, &slot->saved, err);
    slot->saved_s += rl_state_now() - start;
    rl_checkpoint_free(&slot->saved);
    __atomic_store_n(&st->pending, false, __ATOMIC_RELEASE);
    /* Two stay: if the newest turns out to be damaged, there is one more. */
    while (!code && st->n_kept - st->n_pinned > 2) {
        remove_one(st, st->kept[st->n_pinned]);
        memmove(&st->kept[st->n_pinned], &st->kept[st->n_pinned + 1],
                (st->n_kept - st->n_pinned - 1) * sizeof *st->kept);
        st->n_kept--;
    }
    return code;
}

void rl_state_pin(rl_sequence_state *st)
{
    if (!st->failed)
        st->n_pinned = st->n_kept;
    st->failed = true;
}

static bool stored_already(const rl_sequence_state *st)
{
    return st->n_kept && st->kept[st->n_kept - 1] == st->last_frame;
}

/* The state after the last frame, where somebody goes on from it. */
static rl_code store_end(rl_sequence_state *st, bool stopped, rl_error *err)
{
    rl_checkpoint c = {0};
    rl_code code = RL_OK;
    bool end = st->last_frame == st->sequence->frames.numbers[st->last - 1],
         hands_over = end && st->hands_over;
    if (stored_already(st))
        return RL_OK;
    if (st->chained && (stopped || hands_over)) {
        code = take(st, &c, st->chain, err);
    } else if (!st->chained && !stopped && hands_over) {
        /* The next shard must not wait for history that a frame which failed or was held has ended. */
        c = (rl_checkpoint){.identity = st->identity, .chain = st->chain, .frame = st->last_frame};
    } else {
        return RL_OK;
    }
    if (!code)
        code = store(st, &c, err);
    rl_checkpoint_free(&c);
    return code;
}

/* All is there: nobody goes on from inside. */
static void drop_all(rl_sequence_state *st)
{
    int *frames;
    size_t n;
    rl_error ignored = {0};
    if (rl_checkpoint_list(&st->arena, st->folder, st->name, &frames, &n, &ignored))
        return;
    for (size_t k = 0; k < n; k++) {
        long i = rl_frames_find(&st->sequence->frames, frames[k]);
        bool last = i + 1 == (long)st->last && st->hands_over;
        if (i >= (long)(st->first + st->warm) && i < (long)st->last && !last)
            remove_one(st, frames[k]);
    }
}

rl_code rl_state_finish(rl_sequence_state *st, bool stopped, rl_error *err)
{
    rl_error why = {0};
    rl_code code = st->history && st->n_work > 0 ? store_end(st, stopped, &why) : RL_OK;
    if (code && (stopped || !st->hands_over)) {
        rl_report(st->session->log, RL_WARNING, (rl_where){.file = why.file},
                  "no checkpoint could be written: %s", why.text);
        code = RL_OK;
    }
    if (code)
        return rl_fail_file(err, code, why.file,
                            "the next shard cannot go on from here: %s (--resume hands over once more)",
                            why.text);
    if (!stopped && !st->failed)
        drop_all(st);
    return RL_OK;
}
