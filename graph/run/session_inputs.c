#include "graph/run/session_inputs.h"

#include <xxhash.h>

rl_inputs rl_state_own_inputs(const rl_sequence_state *st, size_t i)
{
    const rl_sequence *q = st->sequence;
    rl_arena arena = {0};
    const char *paths[RL_MOST_FILES];
    size_t n;
    rl_inputs in = {.missing = true};
    if (!rl_reader_paths(q->reader, q->frames.numbers[i], &arena, paths, &n, NULL))
        in = rl_ledger_inputs(st->ledger, q->frames.numbers[i], paths, n);
    rl_arena_free(&arena);
    return in;
}

uint64_t rl_state_held_content(const rl_inputs *own, const rl_inputs *source)
{
    uint64_t both[2] = {own->content, source->content};
    return XXH3_64bits(both, sizeof both);
}

static bool can_be_read(const rl_sequence_state *st, size_t i)
{
    rl_frame frame = {0};
    rl_error err = {0};
    rl_code code = rl_session_read(st->session, st->sequence, &frame, st->sequence->frames.numbers[i], &err);
    rl_frame_free(&frame);
    return !code;
}

bool rl_state_is_usable(rl_sequence_state *st, size_t i)
{
    if (st->usable[i] != RL_USABLE_UNKNOWN)
        return st->usable[i] == RL_USABLE;
    const rl_inputs in = st->inputs[i] = rl_state_own_inputs(st, i);
    const rl_inputs *last = &rl_ledger_find(st->ledger, st->sequence->frames.numbers[i])->inputs;
    bool broke = !in.missing && last->broken && last->content == in.content;
    st->usable[i] = in.missing || (broke && !can_be_read(st, i)) ? RL_NOT_USABLE : RL_USABLE;
    return st->usable[i] == RL_USABLE;
}

bool rl_state_is_missing(rl_sequence_state *st, size_t i)
{
    return !rl_state_is_usable(st, i) && st->inputs[i].missing;
}

uint64_t rl_state_expected_content(rl_sequence_state *st, size_t i)
{
    if (rl_state_is_usable(st, i) || st->session->options.on_missing != RL_MISSING_HOLD)
        return st->inputs[i].content;
    for (size_t k = i; k-- > 0;)
        if (rl_state_is_usable(st, k))
            return rl_state_held_content(&st->inputs[i], &st->inputs[k]);
    return st->inputs[i].content;
}
