#include "graph/tool/trace.h"

#include <inttypes.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/base/arena.h"
#include "graph/base/file.h"
#include "graph/base/text.h"
#include "graph/run/leftovers.h"
#include "graph/tool/ab_json.h"

struct rl_trace {
    pthread_mutex_t mutex;
    rl_arena names; /* each text once */
    const char **texts;
    size_t n_texts;
    rl_run_span *spans; /* their texts are in `names` */
    size_t n, room, lost;
};

rl_code rl_trace_new(rl_trace **out, rl_error *err)
{
    rl_trace *t = *out = rl_calloc(1, sizeof *t);
    if (!t)
        return rl_fail_memory(err, sizeof *t);
    pthread_mutex_init(&t->mutex, NULL);
    return RL_OK;
}

void rl_trace_free(rl_trace **trace)
{
    rl_trace *t = *trace;
    *trace = NULL;
    if (!t)
        return;
    pthread_mutex_destroy(&t->mutex);
    rl_arena_free(&t->names);
    rl_free(t->texts);
    rl_free(t->spans);
    rl_free(t);
}

/* There are few different texts: a name a step, an output, a capture. NULL when memory is out. */
static const char *keep(rl_trace *t, const char *text)
{
    for (size_t i = 0; i < t->n_texts; i++)
        if (!strcmp(t->texts[i], text))
            return t->texts[i];
    const char **grown = rl_realloc(t->texts, (t->n_texts + 1) * sizeof *grown);
    if (!grown)
        return NULL;
    t->texts = grown;
    const char *copy = rl_arena_strdup(&t->names, text);
    if (copy)
        t->texts[t->n_texts++] = copy;
    return copy;
}

static bool make_room(rl_trace *t)
{
    if (t->n < t->room)
        return true;
    size_t room = t->room ? 2 * t->room : 256;
    rl_run_span *grown = rl_realloc(t->spans, room * sizeof *grown);
    if (!grown)
        return false;
    t->spans = grown;
    t->room = room;
    return true;
}

void rl_trace_add(rl_trace *t, const rl_run_span *span)
{
    pthread_mutex_lock(&t->mutex);
    rl_run_span s = *span;
    s.category = keep(t, span->category);
    s.name = keep(t, span->name);
    s.capture = keep(t, span->capture);
    if (s.category && s.name && s.capture && make_room(t))
        t->spans[t->n++] = s;
    else
        t->lost++;
    pthread_mutex_unlock(&t->mutex);
}

/* Microseconds with three decimals, without a detour over floating point. */
static void add_time(rl_str *s, const char *key, uint64_t ns)
{
    rl_str_printf(s, ",\"%s\":%" PRIu64 ".%03u", key, ns / 1000, (unsigned)(ns % 1000));
}

static void add_lanes(rl_str *s)
{
    static const char *const names[RL_LANES] = {"1 read", "2 run", "3 device", "4 write"};
    rl_str_add(s, "{\"ph\":\"M\",\"pid\":1,\"name\":\"process_name\",\"args\":{\"name\":\"relit " RL_VERSION
                  "\"}}");
    for (int i = 0; i < RL_LANES; i++)
        rl_str_printf(
            s, ",\n{\"ph\":\"M\",\"pid\":1,\"tid\":%d,\"name\":\"thread_name\",\"args\":{\"name\":\"%s\"}}",
            i + 1, names[i]);
}

/* By time, and what holds another before that, as viewers nest the events of a thread. Of two that began and
 * ended together the one that was added later holds the other. */
static int by_time(const void *a, const void *b)
{
    const rl_run_span *x = *(const rl_run_span *const *)a, *y = *(const rl_run_span *const *)b;
    if (x->start != y->start)
        return x->start < y->start ? -1 : 1;
    if (x->end != y->end)
        return x->end > y->end ? -1 : 1;
    return x > y ? -1 : x < y;
}

static void add_span(rl_str *s, const rl_run_span *e, uint64_t zero)
{
    rl_str_printf(s, ",\n{\"ph\":\"X\",\"pid\":1,\"tid\":%d,\"cat\":", (int)e->lane + 1);
    rl_ab_json_text(s, e->category);
    rl_str_add(s, ",\"name\":");
    rl_ab_json_text(s, e->name);
    add_time(s, "ts", e->start - zero);
    add_time(s, "dur", e->end > e->start ? e->end - e->start : 0);
    rl_str_printf(s, ",\"args\":{\"frame\":%lld,\"capture\":", e->frame);
    rl_ab_json_text(s, e->capture);
    rl_str_add(s, "}}");
}

rl_code rl_trace_write(rl_trace *t, const char *path, rl_error *err)
{
    rl_str s = {0};
    rl_leftovers_remove(&path, 1);
    pthread_mutex_lock(&t->mutex);
    const rl_run_span **order = rl_calloc(t->n, sizeof *order);
    for (size_t i = 0; order && i < t->n; i++)
        order[i] = &t->spans[i];
    if (order)
        qsort(order, t->n, sizeof *order, by_time);
    rl_str_printf(&s, "{\"displayTimeUnit\":\"ms\",\"otherData\":{\"lost\":%zu},\"traceEvents\":[\n",
                  t->lost);
    add_lanes(&s);
    for (size_t i = 0; order && i < t->n; i++)
        add_span(&s, order[i], order[0]->start);
    rl_str_add(&s, "\n]}\n");
    pthread_mutex_unlock(&t->mutex);
    rl_code code = s.failed || !order ? rl_fail_memory(err, s.length)
                                      : rl_file_write(path, rl_str_text(&s), s.length, err);
    rl_free(order);
    rl_str_free(&s);
    return code;
}
