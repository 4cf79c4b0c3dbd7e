/* What device*.c share; no other file calls cl* or includes this. */
#ifndef RL_RUN_DEVICE_PARTS_H
#define RL_RUN_DEVICE_PARTS_H

#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>

#include "graph/run/device.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { RL_MOST_KERNELS = 16, RL_MOST_SPANS = 512 };

struct rl_device {
    rl_arena arena;
    rl_device_info info;
    cl_device_id id;
    cl_context context;
    cl_command_queue queue;  /* kernels; in order, profiled */
    cl_command_queue mapper; /* maps and unmaps, so that a reader thread does not wait behind kernels */
    const rl_log *log;
    struct {
        cl_event event;
        rl_span *out;
    } spans[RL_MOST_SPANS];
    size_t n_spans;
    int64_t clock_offset; /* device time + offset = CLOCK_MONOTONIC, ns */
};

struct rl_memory {
    rl_device *device;
    cl_mem mem;
    cl_mem seen; /* what kernels get: mem, or the part of it behind the guard */
    size_t bytes;
    void *block; /* host-memory devices: ours, where the buffer lies */
    void *mapped;
    int maps; /* how often it is mapped */
};

struct rl_program {
    rl_device *device;
    cl_program program;
    char *name;
    struct {
        char entry[64];
        cl_kernel kernel;
    } kernels[RL_MOST_KERNELS];
    size_t n_kernels;
    bool from_source;
    int users; /* rl_program_share's included */
    uint64_t key[2];
};

/* device_call.c: whether the call that comes now has to fail instead (rl_device_fail_at); counts it. From any
 * thread. */
bool rl_cl_injected(void);
/* The call's status, or an injected failure without the call. */
#define RL_CL(call) (rl_cl_injected() ? CL_OUT_OF_RESOURCES : (call))

/* The status of a wait. An injected failure comes behind the call: the device must not be at work on memory
 * that the caller then frees. */
cl_int rl_cl_waited(cl_int status);
const char *rl_cl_text(cl_int status);
/* RL_E_MEMORY or RL_E_DEVICE: "OpenCL: <what>: <status in words> (<status>)" */
rl_code rl_cl_fail(rl_error *err, cl_int status, const char *what);

/* device_program.c: the program's kernel of that name, made on first use; the program releases it. */
rl_code rl_program_kernel(rl_program *program, const char *entry, cl_kernel *out, rl_error *err);

#ifdef __cplusplus
}
#endif
#endif
