/* What a run of a sequence takes on, and what it leaves for the next one. */
#include "graph/run/session_state.h"

#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>
#include <xxhash.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/run/leftovers.h"
#include "graph/run/session_checkpoint.h"
#include "graph/run/session_inputs.h"

/* ---- chains ----------------------------------------------------------------------------------------------
 */

static uint64_t extend(uint64_t chain, int frame, uint64_t content)
{
    uint64_t link[3] = {chain, (uint64_t)(int64_t)frame, content};
    return XXH3_64bits(link, sizeof link);
}

/* Whether frame i, as far as its files tell, ends history. Another shard's frame that is not there may be one
 * that is still waited for: its shard says by a checkpoint without history that it has not come. */
static bool ends_history(rl_sequence_state *st, size_t i)
{
    bool waited_for = i + 1 == st->first && rl_state_is_missing(st, i) &&
                      rl_ledger_find(st->ledger, st->sequence->frames.numbers[i])->kind == RL_LEDGER_NONE;
    return !waited_for && !rl_state_is_usable(st, i);
}

/* What the chains of frames from…to-1 will be, behind those of begin…from-1, if no frame fails of which the
 * ledger does not say so already. A frame whose own files cannot be used has no history and ends it: it
 * fails, or is skipped, or another is held there. */
static void expect_chains(rl_sequence_state *st, size_t begin, size_t from, size_t to, uint64_t *chains)
{
    uint64_t chain = from > begin ? chains[from - 1] : st->root;
    for (size_t i = from; i < to; i++) {
        st->cut[i] |= !rl_state_is_usable(st, i) || (i > begin && ends_history(st, i - 1));
        chain = extend(st->cut[i] ? st->root : chain, st->sequence->frames.numbers[i],
                       rl_state_expected_content(st, i));
        chains[i] = chain;
    }
}

/* ---- what is there ---------------------------------------------------------------------------------------
 */

static bool pictures_exist(rl_sequence_state *st, int frame)
{
    const rl_session *s = st->session;
    rl_arena arena = {0};
    bool all = true;
    for (size_t i = 0; i < s->n_outputs && all; i++) {
        const char *name, *path = NULL;
        if (!rl_output_path(&arena, s->outputs[i].spec, st->sequence->manifest->name, frame, NULL, &name,
                            NULL))
            path = rl_path_join(&arena, s->options.out ? s->options.out : "out", name);
        all = path && rl_path_exists(path);
    }
    rl_arena_free(&arena);
    return all;
}

/* Pictures of this run's frames that need not be made again. */
static void find_done(rl_sequence_state *st, const uint64_t *chains, bool *needed)
{
    size_t others = 0;
    for (size_t i = st->first + st->warm; i < st->last; i++) {
        int frame = st->sequence->frames.numbers[i];
        const rl_ledger_line *line = rl_ledger_find(st->ledger, frame);
        bool there = line->kind == RL_LEDGER_DONE && pictures_exist(st, frame);
        bool skips = st->session->options.on_missing == RL_MISSING_SKIP;
        if (skips && rl_state_is_missing(st, i))
            needed[i] = false;
        else
            needed[i] = !there || line->chain != chains[i];
        others += there && line->chain != chains[i];
        st->n_there += !needed[i];
    }
    if (others)
        rl_report(st->session->log, RL_NOTE, RL_NOWHERE,
                  "'%s': %zu frames are there, but made by another pipeline, version or device or from other "
                  "inputs; they "
                  "are made again",
                  st->sequence->manifest->name, others);
}

/* ---- the work --------------------------------------------------------------------------------------------
 */

/* Used checkpoints are read once in full: one that is damaged is as good as none. */
static bool all_readable(rl_sequence_state *st, bool *saved)
{
    bool good = true;
    for (size_t i = 0; i < st->n_work; i++) {
        if (st->work[i].start != RL_START_CHECKPOINT)
            continue;
        size_t before = st->work[i].frame - 1;
        rl_checkpoint c = {0};
        rl_error err = {0};
        if (rl_state_load_checkpoint(st, st->sequence->frames.numbers[before], &c, &err)) {
            rl_report(st->session->log, RL_WARNING, (rl_where){.file = err.file}, "%s; it is not used",
                      err.text);
            saved[before] = good = false;
        }
        rl_checkpoint_free(&c);
    }
    return good;
}

static void make_work(rl_sequence_state *st, const bool *needed, bool *saved)
{
    rl_schedule plan = {.first = st->first,
                        .last = st->last,
                        .cut = st->cut,
                        .needed = needed,
                        .saved = saved,
                        .hand_over = st->hands_over};
    do
        st->n_work = rl_schedule_make(&plan, st->work, &st->lacking);
    while (!all_readable(st, saved));
    for (size_t i = 0; i < st->n_work; i++)
        st->n_write += st->work[i].write;
}

/* Which frames have to be looked at: those of the run, and for a checkpoint's chain those since history
 * began. */
static size_t history_begins(const rl_sequence_state *st)
{
    size_t i = st->first;
    while (i > 0 && !st->cut[i])
        i--;
    return i;
}

/* What a killed run left of the files that this one may write. */
static void clean_up(rl_sequence_state *st)
{
    const rl_session *s = st->session;
    const int *numbers = st->sequence->frames.numbers;
    rl_arena arena = {0};
    size_t n = 0;
    const char **paths =
        rl_arena_array(&arena, st->n_work * s->n_outputs + (st->last - st->first) + 1, sizeof *paths);
    for (size_t i = st->first; paths && i < st->last; i++) {
        paths[n] = rl_checkpoint_path(&arena, st->folder, st->name, numbers[i]);
        n += paths[n] != NULL;
    }
    for (size_t w = 0; paths && w < st->n_work; w++) {
        for (size_t i = 0; i < s->n_outputs && st->work[w].write; i++) {
            const char *name;
            if (rl_output_path(&arena, s->outputs[i].spec, st->sequence->manifest->name,
                               numbers[st->work[w].frame], NULL, &name, NULL))
                continue;
            paths[n] = rl_path_join(&arena, s->options.out ? s->options.out : "out", name);
            n += paths[n] != NULL;
        }
    }
    if (paths)
        rl_leftovers_remove(paths, n);
    rl_arena_free(&arena);
}

static rl_code decide(rl_sequence_state *st, rl_error *err)
{
    size_t n = st->sequence->frames.n;
    uint64_t *chains = rl_arena_array(&st->arena, n + 1, sizeof *chains);
    bool *needed = rl_arena_array(&st->arena, n + 1, sizeof *needed);
    bool *saved = rl_arena_array(&st->arena, n + 1, sizeof *saved);
    st->work = rl_arena_array(&st->arena, n + 1, sizeof *st->work);
    if (!chains || !needed || !saved || !st->work)
        return rl_fail_memory(err, n * sizeof *chains);
    bool resume = st->session->options.resume;
    size_t begin = history_begins(st);
    for (size_t i = st->first + st->warm; i < st->last; i++)
        needed[i] = true;
    expect_chains(st, begin, begin, st->first, chains);
    rl_code code = st->history ? rl_state_find_checkpoints(st, begin, st->first, chains, saved, err) : RL_OK;
    st->cut[st->first] |= begin < st->first && ends_history(st, st->first - 1);
    if (resume && !code) {
        expect_chains(st, begin, st->first, st->last, chains);
        find_done(st, chains, needed);
        if (st->history)
            code = rl_state_find_checkpoints(st, st->first, st->last, chains, saved, err);
    }
    if (code)
        return code;
    make_work(st, needed, saved);
    if (!st->lacking) {
        rl_state_drop_checkpoints(st, saved);
        clean_up(st);
    }
    return RL_OK;
}

/* ---- beginning and end -----------------------------------------------------------------------------------
 */

static void find_range(rl_sequence_state *st, size_t sequence)
{
    rl_part part;
    rl_session_part(st->session, sequence, &part);
    st->first = part.first;
    st->last = part.last;
    st->warm = part.warm;
    st->hands_over = part.hands_over;
    for (size_t i = 0; i < st->sequence->frames.n; i++)
        st->cut[i] = !st->history || rl_sequence_is_cut(st->sequence, i);
    if (st->session->options.preroll && part.last > part.first)
        st->cut[part.first] = true;
}

/* Pictures come first: a run that needs nothing of what others left goes on without. */
static rl_code make_folder(const rl_sequence_state *st, rl_error *err)
{
    const rl_options *o = &st->session->options;
    rl_error why = {0};
    if (o->resume || o->shard[1])
        return rl_folder_make(st->folder, err);
    if (!rl_folder_make(st->folder, &why))
        return RL_OK;
    rl_report(st->session->log, RL_WARNING, (rl_where){.file = why.file},
              "%s; --resume will not find this run", why.text);
    return RL_OK;
}

rl_code rl_sequence_state_begin(rl_sequence_state *st, rl_session *s, size_t sequence, rl_error *err)
{
    rl_sequence *q = &s->sequences[sequence];
    char tag[64] = "";
    *st = (rl_sequence_state){.session = s, .sequence = q, .history = rl_plan_has_history(q->plan)};
    st->folder = rl_path_join(&st->arena, s->options.out ? s->options.out : "out", ".relit");
    st->name = rl_ledger_name(&st->arena, q->manifest->name);
    st->cut = rl_arena_array(&st->arena, q->frames.n + 1, sizeof *st->cut);
    st->usable = rl_arena_array(&st->arena, q->frames.n + 1, sizeof *st->usable);
    st->inputs = rl_arena_array(&st->arena, q->frames.n + 1, sizeof *st->inputs);
    st->kept = rl_arena_array(&st->arena, q->frames.n + 1, sizeof *st->kept);
    if (!st->folder || !st->name || !st->cut || !st->usable || !st->inputs || !st->kept)
        return rl_fail_memory(err, q->frames.n * sizeof *st->kept);
    find_range(st, sequence);
    if (s->options.shard[1])
        snprintf(tag, sizeof tag, "%d-of-%d", s->options.shard[0], s->options.shard[1]);
    rl_code code = make_folder(st, err);
    if (!code)
        code = rl_session_identity(s, q, &st->identity, err);
    st->root = XXH3_64bits(&st->identity, sizeof st->identity);
    if (!code)
        code = rl_ledger_open(st->folder, st->name, tag, &q->manifest->frames, &st->ledger, err);
    if (!code)
        code = decide(st, err);
    st->saved_at = rl_state_now();
    return code;
}

void rl_sequence_state_end(rl_sequence_state *st)
{
    for (int i = 0; i < RL_MOST_IN_FLIGHT; i++)
        rl_checkpoint_free(&st->slots[i].saved);
    rl_ledger_close(&st->ledger);
    rl_arena_free(&st->arena);
    *st = (rl_sequence_state){0};
}

/* ---- the stages ------------------------------------------------------------------------------------------
 */

void rl_state_loaded(rl_sequence_state *st, int slot, size_t index, const rl_loaded *loaded)
{
    rl_slot_state *s = &st->slots[slot];
    s->inputs = rl_state_own_inputs(st, index);
    s->inputs.broken = loaded->broken && !s->inputs.missing;
    s->content = s->inputs.content;
    s->alone = loaded->broken;
    if (loaded->source != index) {
        rl_inputs other = rl_state_own_inputs(st, loaded->source);
        s->content = rl_state_held_content(&s->inputs, &other);
    }
}

void rl_state_ready(rl_sequence_state *st, const rl_work *w, int slot, bool *restored, int *previous,
                    camera_t *camera, rl_error *err)
{
    rl_slot_state *slot_state = &st->slots[slot];
    const int *numbers = st->sequence->frames.numbers;
    *restored = false;
    if (slot_state->saved_s > 0) /* the last one that came out of this slot */
        st->cost_s = slot_state->saved_s;
    slot_state->saved_s = 0;
    if (w->start == RL_START_CHECKPOINT)
        rl_state_restore(st, numbers[w->frame - 1], restored, previous, camera, err);
    if (st->usable[w->frame] == RL_NOT_USABLE && !slot_state->alone) /* the work was made without it */
        rl_fail(err, RL_E_IO, RL_NOWHERE,
                "the files of frame %d could not be used when the run began, and can be now; --resume makes "
                "it",
                numbers[w->frame]);
    bool alone = !st->chained || st->cut[w->frame] || slot_state->alone;
    slot_state->chain = extend(alone ? st->root : st->chain, numbers[w->frame], slot_state->content);
}

void rl_state_ran(rl_sequence_state *st, int slot, const rl_frame *f, bool keeps)
{
    rl_slot_state *slot_state = &st->slots[slot];
    st->chained = keeps;
    st->chain = slot_state->chain;
    st->last_frame = f->number;
    st->since++;
    if (keeps && st->history && rl_state_is_due(st))
        rl_state_take(st, slot_state);
}

rl_code rl_state_writing(rl_sequence_state *st, int slot, int frame, rl_error *err)
{
    const rl_slot_state *slot_state = &st->slots[slot];
    if (rl_ledger_find(st->ledger, frame)->kind == RL_LEDGER_NONE)
        return RL_OK;
    return rl_ledger_write(st->ledger, frame, RL_LEDGER_BEGUN, slot_state->chain, &slot_state->inputs, err);
}

void rl_state_written(rl_sequence_state *st, const rl_work *w, int slot, const rl_frame *f)
{
    rl_slot_state *slot_state = &st->slots[slot];
    rl_error err = {0};
    bool failed = f->error.code != RL_OK;
    if (failed)
        rl_state_pin(st);
    if (w->write)
        rl_ledger_write(st->ledger, f->number, failed ? RL_LEDGER_FAILED : RL_LEDGER_DONE, slot_state->chain,
                        &slot_state->inputs, &err);
    rl_state_store(st, slot_state, &err);
    if (err.code)
        rl_report(st->session->log, RL_WARNING, (rl_where){.file = err.file},
                  "%s; the run goes on, but --resume will make some frames again", err.text);
}
