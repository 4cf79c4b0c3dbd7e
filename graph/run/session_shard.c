/* Which frames a shard takes, and where its history comes from. */
#include <string.h>

#include "graph/run/session_state.h"

bool rl_plan_has_history(const rl_plan *plan)
{
    for (size_t i = 0; i < plan->n_buffers; i++)
        if (plan->buffers[i].kind == RL_BUFFER_HISTORY)
            return true;
    return false;
}

bool rl_sequence_is_cut(const rl_sequence *q, size_t i)
{
    const rl_manifest *m = q->manifest;
    if (i == 0 || rl_frames_find(&m->cuts, q->frames.numbers[i]) >= 0)
        return true;
    return rl_frames_find(&m->frames, q->frames.numbers[i]) !=
           rl_frames_find(&m->frames, q->frames.numbers[i - 1]) + 1;
}

rl_code rl_session_count(rl_session *s, rl_error *err)
{
    const int *shard = s->options.shard;
    if (shard[1] && (shard[0] < 1 || shard[0] > shard[1]))
        return rl_fail(err, RL_E_USAGE, RL_NOWHERE, "there is no shard %d of %d", shard[0], shard[1]);
    if (s->options.preroll < 0 || s->options.checkpoint_frames < 0)
        return rl_fail(err, RL_E_USAGE, RL_NOWHERE, "a number of frames cannot be negative");
    size_t sum = 0;
    s->ends = rl_arena_array(&s->arena, s->n_sequences + 1, sizeof *s->ends);
    for (size_t k = 0; s->ends && k < s->n_sequences; k++)
        s->ends[k] = sum += s->sequences[k].frames.n;
    return s->ends ? RL_OK : rl_fail_memory(err, s->n_sequences * sizeof *s->ends);
}

/* The index, over the frames of all captures, at which the i-th shard (from 0) begins. */
static size_t shard_begin(const rl_session *s, size_t i)
{
    return rl_shard_begin(i, (size_t)s->options.shard[1], s->ends, s->n_sequences);
}

static size_t within(size_t x, size_t low, size_t high)
{
    return x < low ? low : x > high ? high : x;
}

static void find_frames(const rl_session *s, size_t sequence, rl_part *p)
{
    size_t before = 0, n = s->sequences[sequence].frames.n;
    *p = (rl_part){.last = n};
    if (!s->options.shard[1])
        return;
    for (size_t i = 0; i < sequence; i++)
        before += s->sequences[i].frames.n;
    size_t part = (size_t)s->options.shard[0];
    p->first = within(shard_begin(s, part - 1), before, before + n) - before;
    p->last = within(shard_begin(s, part), before, before + n) - before;
}

void rl_session_part(const rl_session *s, size_t sequence, rl_part *p)
{
    const rl_sequence *q = &s->sequences[sequence];
    size_t preroll = (size_t)s->options.preroll;
    find_frames(s, sequence, p);
    if (p->last <= p->first || !rl_plan_has_history(q->plan))
        return;
    p->hands_over = !preroll && p->last < q->frames.n && !rl_sequence_is_cut(q, p->last);
    while (p->warm < preroll && !rl_sequence_is_cut(q, p->first)) {
        p->first--;
        p->warm++;
    }
}

void rl_session_shard(const rl_session *s, size_t capture, rl_shard_part *out)
{
    rl_part p;
    *out = (rl_shard_part){0};
    if (capture >= s->n_sequences)
        return;
    const rl_sequence *q = &s->sequences[capture];
    rl_session_part(s, capture, &p);
    if (p.last <= p.first)
        return;
    bool history = rl_plan_has_history(q->plan), begins = !history || rl_sequence_is_cut(q, p.first);
    *out = (rl_shard_part){.n = p.last - p.first - p.warm,
                           .first = q->frames.numbers[p.first + p.warm],
                           .last = q->frames.numbers[p.last - 1],
                           .history = history,
                           .preroll = p.warm,
                           .exact = begins || !s->options.preroll,
                           .takes_over = !begins && !s->options.preroll,
                           .hands_over = p.hands_over};
    if (out->takes_over)
        out->from = q->frames.numbers[p.first - 1];
}

bool rl_session_fading(const rl_session *s, size_t capture, size_t i, rl_fading *out)
{
    if (capture >= s->n_sequences)
        return false;
    const rl_sequence *q = &s->sequences[capture];
    for (size_t k = 0; k < q->plan->n_nodes; k++) {
        const rl_graph_node *g = &q->graph->nodes[q->plan->nodes[k].node];
        bool history = false;
        for (size_t p = 0; p < g->pass->ports.n; p++)
            history |= g->pass->ports.rows[p].role == RL_HISTORY && q->plan->nodes[k].buffers[p] >= 0;
        if (!history || i-- > 0)
            continue;
        bool known = g->pass->least_share != NULL;
        *out = (rl_fading){.node = g->name,
                           .pass = g->pass->name,
                           .least = known ? g->pass->least_share(g->params) : -1,
                           .where = known ? g->pass->fades_where : NULL};
        return true;
    }
    return false;
}
