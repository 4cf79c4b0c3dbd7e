/* A pool of threads for data-parallel loops: decoding chunks, converting rows, encoding. */
#ifndef RL_BASE_POOL_H
#define RL_BASE_POOL_H

#include "graph/base/error.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct rl_pool rl_pool;

/* `threads` is how many work at once, the caller of rl_pool_for included; 1 starts no thread at all. */
rl_code rl_pool_new(int threads, rl_pool **out, rl_error *err);
void rl_pool_free(rl_pool **pool);
int rl_pool_threads(const rl_pool *pool);

/* Calls body(ctx, i) for every i in 0…n-1, in any order and on any thread of the pool and the caller's, and
 * returns when all are done. May be called from several threads at a time, not from inside a body. A body
 * must not depend on the order: that is how results stay the same for every thread count. */
void rl_pool_for(rl_pool *pool, int n, void (*body)(void *ctx, int i), void *ctx);

#ifdef __cplusplus
}
#endif
#endif
