/* The OpenCL device. device*.c are the only files of the engine that call cl*: passes supply data, the
 * executor decides what runs. One thread at a time may use a device and what belongs to it, except where it
 * says otherwise. */
#ifndef RL_RUN_DEVICE_H
#define RL_RUN_DEVICE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "graph/base/arena.h"
#include "graph/base/error.h"
#include "graph/base/log.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct rl_device rl_device;
typedef struct rl_memory rl_memory;
typedef struct rl_program rl_program;

typedef struct rl_device_info {
    const char *name, *platform, *version, *driver; /* in the arena */
    bool cpu;
    bool host_memory; /* buffers are host memory: nothing is copied */
    unsigned units;
    uint64_t memory, largest; /* bytes: global memory, largest single buffer */
} rl_device_info;

/* All devices of all platforms, in the order in which --device N counts them, from 0. None is not an error.
 */
rl_code rl_device_list(rl_arena *arena, rl_device_info **out, size_t *n, rl_error *err);

/* `choice`: NULL (the first CPU device, else the first), "cpu", "gpu" or a number. `threads` > 0 limits a
 * PoCL device's threads; it must be the first use of OpenCL in the process to have an effect. */
rl_code rl_device_open(const char *choice, int threads, const rl_log *log, rl_device **out, rl_error *err);
/* Saves the binaries of programs that were built from source (an error there is only a note), then releases
 * all. Memory and programs of the device must have been freed before. */
void rl_device_close(rl_device **device);
const rl_device_info *rl_device_about(const rl_device *device);

/* A buffer, zeroed. Kernels get a pointer behind its first `guard` bytes (a multiple of 512, so that every
 * device takes the offset), the host's view starts at the first. On a host-memory device it is
 * RL_ALIGN-aligned memory from rl_aligned, else device memory. */
rl_code rl_memory_new(rl_device *device, size_t bytes, size_t guard, rl_memory **out, rl_error *err);
void rl_memory_free(rl_memory **memory);
size_t rl_memory_bytes(const rl_memory *memory);
/* The host's view. Between map and unmap no kernel may use it. Map and unmap may be called from another
 * thread than the one that runs kernels. NULL is never returned with RL_OK. */
rl_code rl_memory_map(rl_memory *memory, bool write, void **out, rl_error *err);
rl_code rl_memory_unmap(rl_memory *memory, rl_error *err);
/* Whole copy between buffers of equal size, in order with the kernels. */
rl_code rl_memory_copy(rl_memory *to, rl_memory *from, rl_error *err);

/* A program from its text. Compiled binaries are kept in the cache folder ($RELIT_CACHE, else
 * $XDG_CACHE_HOME/relit, else
 * ~/.cache/relit; "" switches it off) under a hash of text, options, device and driver; a file that is
 * damaged is rebuilt. A compile error is RL_E_BUILD with the place that the #line directives give and the
 * compiler's first lines; warnings are errors for `strict`. `name` is for messages. */
rl_code rl_program_build(rl_device *device, const char *name, const char *text, bool strict, rl_program **out,
                         rl_error *err);
/* That the program has a kernel of that name; otherwise RL_E_BUILD at `where`: "<what> has no kernel 'x'",
 * and which ones it has. Makes none, so that binaries are not saved before they hold machine code. */
rl_code rl_program_check(const rl_program *program, const char *entry, const char *what, rl_where where,
                         rl_error *err);
/* The same program for another holder, who frees it too; NULL for NULL. Not while others build or free. */
rl_program *rl_program_share(rl_program *program);
void rl_program_free(rl_program **program);

/* One dispatch, in order. `arguments` may hold NULL entries (a NULL pointer for the kernel). Sizes in items,
 * dims 1…3; global must be a multiple of local. `span`, when not NULL, gets the device's start and end time
 * in ns after rl_device_finish. */
typedef struct rl_span {
    uint64_t start, end; /* ns on CLOCK_MONOTONIC; 0 until finished */
} rl_span;

typedef struct rl_dispatch {
    const char *entry;
    rl_memory *const *arguments;
    size_t n_arguments;
    unsigned dims;
    size_t global[3], local[3];
} rl_dispatch;

rl_code rl_device_run(rl_device *device, rl_program *program, const rl_dispatch *dispatch, rl_span *span,
                      rl_error *err);
/* Waits until all that was enqueued is done. */
rl_code rl_device_finish(rl_device *device, rl_error *err);

/* For tests: the n-th OpenCL call from now fails with CL_OUT_OF_RESOURCES; 0 switches this off. Returns how
 * many were left of the n before, 0 when it has failed. */
unsigned long rl_device_fail_at(unsigned long n);

#ifdef __cplusplus
}
#endif
#endif
