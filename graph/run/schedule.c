#include "graph/run/schedule.h"

/* Backwards: whether a frame runs depends on those behind it. work[] is filled from its end, then moved. */
size_t rl_schedule_make(const rl_schedule *s, rl_work *work, bool *lacking)
{
    size_t room = s->last - s->first, n = 0;
    /* The frame behind this one needs its history. */
    bool runs_on = s->hand_over && s->last > s->first && !s->saved[s->last - 1];
    *lacking = false;
    for (size_t i = s->last; i-- > s->first;) {
        rl_work *w = &work[room - 1 - n];
        if (!s->needed[i] && !runs_on)
            continue;
        *w = (rl_work){.frame = i, .write = s->needed[i]};
        bool earlier = i > s->first && s->needed[i - 1];
        if (s->cut[i])
            w->start = RL_START_CUT;
        else if (i > 0 && s->saved[i - 1] && !earlier)
            w->start = RL_START_CHECKPOINT;
        else
            w->start = RL_START_ON;
        runs_on = w->start == RL_START_ON;
        *lacking |= runs_on && i == s->first;
        n++;
    }
    for (size_t i = 0; i < n; i++)
        work[i] = work[room - n + i];
    return n;
}

static size_t apart(size_t a, size_t b)
{
    return a > b ? a - b : b - a;
}

size_t rl_shard_begin(size_t i, size_t n, const size_t *ends, size_t n_captures)
{
    size_t total = n_captures ? ends[n_captures - 1] : 0;
    size_t even = (size_t)((unsigned long long)total * i / n);
    if (n_captures < 2 || n > n_captures || i == 0 || i == n)
        return even;
    /* Each boundary takes the capture's end nearest to the even one, behind the boundary before it and so
     * that a capture is left for every part to come. */
    size_t at = 0;
    for (size_t b = 1, from = 0; b <= i; b++, from = at + 1) {
        even = (size_t)((unsigned long long)total * b / n);
        at = from;
        for (size_t k = from; k < n_captures - (n - b); k++)
            if (apart(ends[k], even) < apart(ends[at], even))
                at = k;
    }
    return ends[at];
}
