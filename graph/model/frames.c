#include "graph/model/frames.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"

enum { LARGEST = 2000000000 };

/* One part of a spec: first, last, step. */
typedef struct range {
    int first, last, step;
} range;

static const char *skip_spaces(const char *p)
{
    while (*p == ' ' || *p == '\t')
        p++;
    return p;
}

/* An integer with an optional '-'; NULL when there is none or it is too large. */
static const char *read_number(const char *p, int *out)
{
    bool minus = *p == '-';
    long long n = 0;
    p += minus;
    if (!isdigit((unsigned char)*p))
        return NULL;
    for (; isdigit((unsigned char)*p); p++) {
        n = n * 10 + (*p - '0');
        if (n > LARGEST)
            return NULL;
    }
    *out = (int)(minus ? -n : n);
    return p;
}

/* "A", "A-B" or "A-BxS"; returns what follows, NULL when it is none of them. */
static const char *read_range(const char *p, range *r)
{
    p = read_number(skip_spaces(p), &r->first);
    if (!p)
        return NULL;
    r->last = r->first;
    r->step = 1;
    if (*p == '-') {
        p = read_number(p + 1, &r->last);
        if (p && *p == 'x')
            p = read_number(p + 1, &r->step);
    }
    return p ? skip_spaces(p) : NULL;
}

static rl_code read_ranges(const char *spec, rl_where where, int *numbers, size_t *n, rl_error *err)
{
    *n = 0;
    for (const char *p = spec;; p++) {
        range r;
        p = read_range(p, &r);
        if (!p || (*p && *p != ','))
            return rl_fail(err, RL_E_CONFIG, where,
                           "'%s' is no list of frames; expected such as 1-24, 1-24x2, 1,5,9-12 or -10--1",
                           spec);
        if (r.last < r.first)
            return rl_fail(err, RL_E_CONFIG, where, "frames '%s': %d-%d runs backwards", spec, r.first,
                           r.last);
        if (r.step < 1)
            return rl_fail(err, RL_E_CONFIG, where, "frames '%s': the step must be at least 1", spec);
        size_t count = (size_t)(((long long)r.last - r.first) / r.step) + 1;
        if (count > RL_FRAMES_MOST - *n)
            return rl_fail(err, RL_E_CONFIG, where, "frames '%s': more than %d", spec, RL_FRAMES_MOST);
        for (size_t i = 0; numbers && i < count; i++)
            numbers[*n + i] = (int)(r.first + (long long)i * r.step);
        *n += count;
        if (!*p)
            return RL_OK;
    }
}

static int ascending(const void *a, const void *b)
{
    int x = *(const int *)a, y = *(const int *)b;
    return (x > y) - (x < y);
}

rl_frames rl_frames_from(int *numbers, size_t n)
{
    rl_frames frames = {.numbers = numbers};
    if (n)
        qsort(numbers, n, sizeof *numbers, ascending);
    for (size_t i = 0; i < n; i++)
        if (frames.n == 0 || numbers[frames.n - 1] != numbers[i])
            numbers[frames.n++] = numbers[i];
    return frames;
}

rl_code rl_frames_parse(rl_arena *arena, const char *spec, rl_where where, rl_frames *out, rl_error *err)
{
    size_t n;
    *out = (rl_frames){0};
    rl_code code = read_ranges(spec, where, NULL, &n, err);
    if (code)
        return code;
    int *numbers = rl_arena_array(arena, n, sizeof *numbers);
    if (!numbers)
        return rl_fail_memory(err, n * sizeof *numbers);
    code = read_ranges(spec, where, numbers, &n, err);
    if (!code)
        *out = rl_frames_from(numbers, n);
    return code;
}

long rl_frames_find(const rl_frames *frames, int number)
{
    const int *p = frames->n ? bsearch(&number, frames->numbers, frames->n, sizeof number, ascending) : NULL;
    return p ? (long)(p - frames->numbers) : -1;
}

rl_code rl_frames_check(const rl_frames *listed, const char *capture, const rl_frames *wanted, rl_where where,
                        rl_error *err)
{
    for (size_t i = 0; i < wanted->n; i++) {
        if (rl_frames_find(listed, wanted->numbers[i]) >= 0)
            continue;
        rl_str there = {0};
        rl_frames_print(listed, &there);
        rl_code code = rl_fail(err, RL_E_USAGE, where, "frame %d is not in the capture '%s', which lists %s",
                               wanted->numbers[i], capture, there.length ? rl_str_text(&there) : "none");
        rl_str_free(&there);
        return code;
    }
    return RL_OK;
}

void rl_frames_print(const rl_frames *frames, rl_str *out)
{
    const int *f = frames->numbers;
    for (size_t i = 0, last; i < frames->n; i = last + 1) {
        last = i;
        long long step = i + 1 < frames->n ? (long long)f[i + 1] - f[i] : 0;
        while (last + 1 < frames->n && (long long)f[last + 1] - f[last] == step)
            last++;
        if (last < i + (step > 1 ? 3 : 2)) /* 1,5,9 says more than 1-9x4 */
            last = i;
        rl_str_printf(out, "%s%d", i ? "," : "", f[i]);
        if (last > i)
            rl_str_printf(out, step > 1 ? "-%dx%lld" : "-%d", f[last], step);
    }
}
