/* History in and out of an executor: the state that a run carries from frame to frame. */
#include <string.h>

#include "graph/run/executor_parts.h"

/* The half that the next frame reads as the past. */
static rl_memory *past_half(const rl_executor *x, size_t buffer)
{
    return x->history[2 * buffer + !x->newest];
}

static size_t bytes_of(const rl_plan *plan, const rl_geometry *g)
{
    size_t sum = 0;
    for (size_t i = 0; i < plan->n_buffers && g->columns; i++)
        if (plan->buffers[i].kind == RL_BUFFER_HISTORY)
            sum += rl_buffer_bytes(&plan->buffers[i], g);
    return sum;
}

size_t rl_executor_history_bytes(const rl_executor *x)
{
    return bytes_of(x->plan, &x->geometry);
}

bool rl_executor_has_history(const rl_executor *x)
{
    return x->has_history;
}

static rl_code copy_one(rl_memory *memory, char *host, size_t bytes, bool into_device, rl_error *err)
{
    void *p;
    rl_code code = rl_memory_map(memory, into_device, &p, err);
    if (code)
        return code;
    memcpy(into_device ? p : host, into_device ? host : p, bytes);
    return rl_memory_unmap(memory, err);
}

static rl_code copy_all(rl_executor *x, char *host, bool into_device, rl_error *err)
{
    rl_code code = RL_OK;
    for (size_t i = 0; i < x->plan->n_buffers && !code; i++) {
        if (x->plan->buffers[i].kind != RL_BUFFER_HISTORY)
            continue;
        size_t bytes = rl_buffer_bytes(&x->plan->buffers[i], &x->geometry);
        code = copy_one(past_half(x, i), host, bytes, into_device, err);
        host += bytes;
    }
    return code;
}

rl_code rl_executor_history_save(rl_executor *x, void *out, camera_t *previous, rl_error *err)
{
    if (!x->has_history)
        return rl_fail(err, RL_E_INTERNAL, RL_NOWHERE, "there is no history to be saved");
    *previous = x->previous;
    return copy_all(x, out, false, err);
}

rl_code rl_executor_history_load(rl_executor *x, const rl_geometry *geometry, const void *in, size_t bytes,
                                 const camera_t *previous, rl_error *err)
{
    if (bytes != bytes_of(x->plan, geometry))
        return rl_fail(err, RL_E_DATA, RL_NOWHERE, "history of %zu bytes, where this plan keeps %zu", bytes,
                       bytes_of(x->plan, geometry));
    rl_code code = rl_executor_resize(x, geometry, err);
    x->has_history = false; /* until all of it is there */
    if (!code)
        code = copy_all(x, (char *)(uintptr_t)in, true, err);
    x->has_history = !code;
    x->previous = *previous;
    return code;
}
