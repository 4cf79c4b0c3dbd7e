#include "graph/base/pool.h"

#include <pthread.h>
#include <stdatomic.h>

#include "graph/base/alloc.h"

/* One rl_pool_for call. It lives on its caller's stack: the caller leaves only when no thread holds it. */
typedef struct job {
    void (*body)(void *, int);
    void *ctx;
    int n;
    int next;    /* the next index to hand out; under the pool's mutex */
    int running; /* bodies handed out and not finished */
    struct job *link;
} job;

struct rl_pool {
    pthread_mutex_t mutex;
    pthread_cond_t work, done;
    job *jobs; /* those with indices left, oldest first */
    bool stop;
    int threads, started;
    pthread_t ids[];
};

static void unlink_job(rl_pool *pool, job *j)
{
    for (job **p = &pool->jobs; *p; p = &(*p)->link) {
        if (*p == j) {
            *p = j->link;
            return;
        }
    }
}

/* Takes one index of j and runs it. Called and left with the mutex held. */
static void run_one(rl_pool *pool, job *j)
{
    int i = j->next++;
    if (j->next == j->n)
        unlink_job(pool, j);
    j->running++;
    pthread_mutex_unlock(&pool->mutex);
    j->body(j->ctx, i);
    pthread_mutex_lock(&pool->mutex);
    if (--j->running == 0 && j->next == j->n)
        pthread_cond_broadcast(&pool->done);
}

static void *worker(void *arg)
{
    rl_pool *pool = arg;
    pthread_mutex_lock(&pool->mutex);
    for (;;) {
        while (!pool->stop && !pool->jobs)
            pthread_cond_wait(&pool->work, &pool->mutex);
        if (pool->stop)
            break;
        run_one(pool, pool->jobs);
    }
    pthread_mutex_unlock(&pool->mutex);
    return NULL;
}

rl_code rl_pool_new(int threads, rl_pool **out, rl_error *err)
{
    *out = NULL;
    if (threads < 1)
        threads = 1;
    rl_pool *pool = rl_calloc(1, sizeof *pool + (size_t)threads * sizeof pool->ids[0]);
    if (!pool)
        return rl_fail_memory(err, sizeof *pool);
    pool->threads = threads;
    pthread_mutex_init(&pool->mutex, NULL);
    pthread_cond_init(&pool->work, NULL);
    pthread_cond_init(&pool->done, NULL);
    for (int i = 0; i < threads - 1; i++) {
        if (pthread_create(&pool->ids[i], NULL, worker, pool)) {
            rl_pool_free(&pool);
            return rl_fail(err, RL_E_MEMORY, RL_NOWHERE, "thread %d of %d could not be started", i + 1,
                           threads);
        }
        pool->started++;
    }
    *out = pool;
    return RL_OK;
}

void rl_pool_free(rl_pool **pool)
{
    rl_pool *p = *pool;
    *pool = NULL;
    if (!p)
        return;
    pthread_mutex_lock(&p->mutex);
    p->stop = true;
    pthread_cond_broadcast(&p->work);
    pthread_mutex_unlock(&p->mutex);
    for (int i = 0; i < p->started; i++)
        pthread_join(p->ids[i], NULL);
    pthread_cond_destroy(&p->done);
    pthread_cond_destroy(&p->work);
    pthread_mutex_destroy(&p->mutex);
    rl_free(p);
}

int rl_pool_threads(const rl_pool *pool)
{
    return pool->threads;
}

void rl_pool_for(rl_pool *pool, int n, void (*body)(void *ctx, int i), void *ctx)
{
    if (pool->threads == 1 || n == 1) {
        for (int i = 0; i < n; i++)
            body(ctx, i);
        return;
    }
    if (n <= 0)
        return;
    job j = {.body = body, .ctx = ctx, .n = n};
    pthread_mutex_lock(&pool->mutex);
    job **last = &pool->jobs;
    while (*last)
        last = &(*last)->link;
    *last = &j;
    pthread_cond_broadcast(&pool->work);
    while (j.next < j.n)
        run_one(pool, &j);
    while (j.running > 0)
        pthread_cond_wait(&pool->done, &pool->mutex);
    pthread_mutex_unlock(&pool->mutex);
}
