#include "graph/run/batch.h"

#include <pthread.h>

/* Each stage counts the items that it has finished. Item i may be loaded when i - written < in_flight, run
 * when it is loaded, written when it has run; its slot is i mod in_flight. */
typedef struct state {
    const rl_batch *b;
    pthread_mutex_t mutex;
    pthread_cond_t changed;
    size_t loaded, ran, written;
    size_t end; /* items that will come; lowered by stop */
} state;

static void *loader(void *arg)
{
    state *s = arg;
    const rl_batch *b = s->b;
    for (size_t i = 0;; i++) {
        pthread_mutex_lock(&s->mutex);
        while (i < s->end && i - s->written >= (size_t)b->in_flight)
            pthread_cond_wait(&s->changed, &s->mutex);
        if (i < s->end && b->stop && b->stop(b->ctx))
            s->end = i;
        size_t end = s->end;
        pthread_cond_broadcast(&s->changed);
        pthread_mutex_unlock(&s->mutex);
        if (i >= end)
            return NULL;
        b->load(b->ctx, i, (int)(i % (size_t)b->in_flight));
        pthread_mutex_lock(&s->mutex);
        s->loaded = i + 1;
        pthread_cond_broadcast(&s->changed);
        pthread_mutex_unlock(&s->mutex);
    }
}

/* Waits until *stage is beyond item i; false when i will never come. */
static int wait_for(state *s, const size_t *stage, size_t i)
{
    pthread_mutex_lock(&s->mutex);
    while (i < s->end && *stage <= i)
        pthread_cond_wait(&s->changed, &s->mutex);
    int comes = i < s->end;
    pthread_mutex_unlock(&s->mutex);
    return comes;
}

static void finish(state *s, size_t *stage, size_t i)
{
    pthread_mutex_lock(&s->mutex);
    *stage = i + 1;
    pthread_cond_broadcast(&s->changed);
    pthread_mutex_unlock(&s->mutex);
}

static void *writer(void *arg)
{
    state *s = arg;
    for (size_t i = 0; wait_for(s, &s->ran, i); i++) {
        s->b->write(s->b->ctx, i, (int)(i % (size_t)s->b->in_flight));
        finish(s, &s->written, i);
    }
    return NULL;
}

static size_t run_serially(const rl_batch *b)
{
    size_t i = 0;
    for (; i < b->items && !(b->stop && b->stop(b->ctx)); i++) {
        b->load(b->ctx, i, 0);
        b->run(b->ctx, i, 0);
        b->write(b->ctx, i, 0);
    }
    return i;
}

rl_code rl_batch_run(const rl_batch *batch, size_t *done, rl_error *err)
{
    if (batch->in_flight <= 1 || batch->items <= 1) {
        *done = run_serially(batch);
        return RL_OK;
    }
    state s = {.b = batch, .end = batch->items};
    pthread_t load_id, write_id;
    pthread_mutex_init(&s.mutex, NULL);
    pthread_cond_init(&s.changed, NULL);
    rl_code code = RL_OK;
    int started = !pthread_create(&load_id, NULL, loader, &s);
    int writes = started && !pthread_create(&write_id, NULL, writer, &s);
    if (!writes)
        code = rl_fail(err, RL_E_MEMORY, RL_NOWHERE, "a thread could not be started");
    if (started && !writes) {
        pthread_mutex_lock(&s.mutex);
        s.end = 0;
        pthread_cond_broadcast(&s.changed);
        pthread_mutex_unlock(&s.mutex);
    }
    for (size_t i = 0; writes && wait_for(&s, &s.loaded, i); i++) {
        batch->run(batch->ctx, i, (int)(i % (size_t)batch->in_flight));
        finish(&s, &s.ran, i);
    }
    if (started)
        pthread_join(load_id, NULL);
    if (writes)
        pthread_join(write_id, NULL);
    pthread_cond_destroy(&s.changed);
    pthread_mutex_destroy(&s.mutex);
    *done = s.written;
    return code;
}
