/* Frames through three stages that overlap: load (one thread), run (the caller's), write (one thread), over a
 * bounded number of frames in flight. Knows nothing of pixels. Frames pass each stage in order. */
#ifndef RL_RUN_BATCH_H
#define RL_RUN_BATCH_H

#include <stddef.h>

#include "graph/base/error.h"

#ifdef __cplusplus
extern "C" {
#endif

/* `item` counts the work from 0, `slot` is 0…in_flight-1: what belongs to a frame in flight is kept by slot.
 * A stage records a failure in the caller's own state of the slot; the later stages are called all the same.
 */
typedef struct rl_batch {
    size_t items;
    int in_flight; /* >= 1; 1 = no overlap */
    void (*load)(void *ctx, size_t item, int slot);
    void (*run)(void *ctx, size_t item, int slot);
    void (*write)(void *ctx, size_t item, int slot);
    int (*stop)(void *ctx); /* asked before each item is loaded; nonzero: no further item; may be NULL */
    void *ctx;
} rl_batch;

/* Returns the number of items that went through all stages. */
rl_code rl_batch_run(const rl_batch *batch, size_t *done, rl_error *err);

#ifdef __cplusplus
}
#endif
#endif
