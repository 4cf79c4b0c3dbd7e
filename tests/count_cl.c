#include "tests/count_cl.h"

#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>
#include <dlfcn.h>
#include <stdatomic.h>
#include <string.h>

static atomic_long live[COUNT_CL_KINDS], made[COUNT_CL_KINDS];

long count_cl_live(count_cl_kind kind)
{
    return atomic_load(&live[kind]);
}

long count_cl_made(count_cl_kind kind)
{
    return atomic_load(&made[kind]);
}

const char *count_cl_name(count_cl_kind kind)
{
    static const char *const names[] = {"contexts", "queues", "buffers", "programs", "kernels", "events"};
    return names[kind];
}

static void count(count_cl_kind kind, int n)
{
    atomic_fetch_add(&live[kind], n);
    if (n > 0)
        atomic_fetch_add(&made[kind], n);
}

/* OpenCL's own function of the name. The bytes of a pointer to it are those of one to an object (POSIX). */
#define REAL(name)                                                                                           \
    __typeof__(&name) real;                                                                                  \
    void *address = dlsym(RTLD_NEXT, #name);                                                                 \
    memcpy(&real, &address, sizeof real)

#define RELEASE(name, type, kind)                                                                            \
    cl_int name(type object)                                                                                 \
    {                                                                                                        \
        REAL(name);                                                                                          \
        cl_int code = real(object);                                                                          \
        if (!code)                                                                                           \
            count(kind, -1);                                                                                 \
        return code;                                                                                         \
    }

RELEASE(clReleaseContext, cl_context, COUNT_CL_CONTEXT)
RELEASE(clReleaseCommandQueue, cl_command_queue, COUNT_CL_QUEUE)
RELEASE(clReleaseMemObject, cl_mem, COUNT_CL_MEMORY)
RELEASE(clReleaseProgram, cl_program, COUNT_CL_PROGRAM)
RELEASE(clReleaseKernel, cl_kernel, COUNT_CL_KERNEL)
RELEASE(clReleaseEvent, cl_event, COUNT_CL_EVENT)

/* Functions that make an object and return it. */
#define MAKE(type, name, kind, parameters, arguments)                                                        \
    type name parameters                                                                                     \
    {                                                                                                        \
        REAL(name);                                                                                          \
        type object = real arguments;                                                                        \
        if (object)                                                                                          \
            count(kind, 1);                                                                                  \
        return object;                                                                                       \
    }

typedef void(CL_CALLBACK *context_callback)(const char *, const void *, size_t, void *);

MAKE(cl_context, clCreateContext, COUNT_CL_CONTEXT,
     (const cl_context_properties *p, cl_uint n, const cl_device_id *d, context_callback f, void *u,
      cl_int *e),
     (p, n, d, f, u, e))
MAKE(cl_command_queue, clCreateCommandQueue, COUNT_CL_QUEUE,
     (cl_context c, cl_device_id d, cl_command_queue_properties p, cl_int *e), (c, d, p, e))
MAKE(cl_mem, clCreateBuffer, COUNT_CL_MEMORY, (cl_context c, cl_mem_flags f, size_t n, void *host, cl_int *e),
     (c, f, n, host, e))
MAKE(cl_mem, clCreateSubBuffer, COUNT_CL_MEMORY,
     (cl_mem m, cl_mem_flags f, cl_buffer_create_type t, const void *i, cl_int *e), (m, f, t, i, e))
MAKE(cl_program, clCreateProgramWithSource, COUNT_CL_PROGRAM,
     (cl_context c, cl_uint n, const char **s, const size_t *l, cl_int *e), (c, n, s, l, e))
MAKE(cl_program, clCreateProgramWithBinary, COUNT_CL_PROGRAM,
     (cl_context c, cl_uint n, const cl_device_id *d, const size_t *l, const unsigned char **b, cl_int *s,
      cl_int *e),
     (c, n, d, l, b, s, e))
MAKE(cl_kernel, clCreateKernel, COUNT_CL_KERNEL, (cl_program p, const char *n, cl_int *e), (p, n, e))

cl_int clEnqueueNDRangeKernel(cl_command_queue q, cl_kernel k, cl_uint dims, const size_t *from,
                              const size_t *global, const size_t *local, cl_uint n, const cl_event *wait,
                              cl_event *event)
{
    REAL(clEnqueueNDRangeKernel);
    cl_int code = real(q, k, dims, from, global, local, n, wait, event);
    if (!code && event)
        count(COUNT_CL_EVENT, 1);
    return code;
}

cl_int clEnqueueCopyBuffer(cl_command_queue q, cl_mem a, cl_mem b, size_t i, size_t k, size_t bytes,
                           cl_uint n, const cl_event *wait, cl_event *event)
{
    REAL(clEnqueueCopyBuffer);
    cl_int code = real(q, a, b, i, k, bytes, n, wait, event);
    if (!code && event)
        count(COUNT_CL_EVENT, 1);
    return code;
}

cl_int clEnqueueUnmapMemObject(cl_command_queue q, cl_mem m, void *p, cl_uint n, const cl_event *wait,
                               cl_event *event)
{
    REAL(clEnqueueUnmapMemObject);
    cl_int code = real(q, m, p, n, wait, event);
    if (!code && event)
        count(COUNT_CL_EVENT, 1);
    return code;
}

void *clEnqueueMapBuffer(cl_command_queue q, cl_mem m, cl_bool blocking, cl_map_flags f, size_t at,
                         size_t bytes, cl_uint n, const cl_event *wait, cl_event *event, cl_int *e)
{
    REAL(clEnqueueMapBuffer);
    void *p = real(q, m, blocking, f, at, bytes, n, wait, event, e);
    if (p && event)
        count(COUNT_CL_EVENT, 1);
    return p;
}
