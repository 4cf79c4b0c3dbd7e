/* Dispatches: a kernel's arguments, its turn in the queue, and when the device worked on it. */
#include "graph/run/device_parts.h"

#include <time.h>

static void read_span(rl_device *d, cl_event event, bool newest, rl_span *out)
{
    cl_ulong start = 0, end = 0;
    clGetEventProfilingInfo(event, CL_PROFILING_COMMAND_START, sizeof start, &start, NULL);
    clGetEventProfilingInfo(event, CL_PROFILING_COMMAND_END, sizeof end, &end, NULL);
    if (newest) { /* it has just ended: close enough to line two clocks up, every time anew since they drift
                   */
        struct timespec now;
        clock_gettime(CLOCK_MONOTONIC, &now);
        d->clock_offset = (int64_t)now.tv_sec * 1000000000 + now.tv_nsec - (int64_t)end;
    }
    out->start = (uint64_t)((int64_t)start + d->clock_offset);
    out->end = (uint64_t)((int64_t)end + d->clock_offset);
}

static cl_int set_arguments(cl_kernel kernel, const rl_dispatch *x)
{
    cl_uint wanted = 0;
    cl_int status = RL_CL(clGetKernelInfo(kernel, CL_KERNEL_NUM_ARGS, sizeof wanted, &wanted, NULL));
    if (status == CL_SUCCESS && wanted != x->n_arguments)
        return CL_INVALID_ARG_INDEX;
    for (size_t i = 0; status == CL_SUCCESS && i < x->n_arguments; i++) {
        const rl_memory *m = x->arguments[i];
        cl_mem mem = m ? m->seen ? m->seen : m->mem : NULL;
        status = RL_CL(clSetKernelArg(kernel, (cl_uint)i, sizeof mem, mem ? &mem : NULL));
    }
    return status;
}

rl_code rl_device_run(rl_device *device, rl_program *program, const rl_dispatch *dispatch, rl_span *span,
                      rl_error *err)
{
    cl_kernel kernel;
    rl_code code = rl_program_kernel(program, dispatch->entry, &kernel, err);
    if (code)
        return code;
    cl_int status = set_arguments(kernel, dispatch);
    if (status == CL_INVALID_ARG_INDEX)
        return rl_fail(err, RL_E_BUILD, RL_NOWHERE,
                       "OpenCL program '%s': kernel '%s' must take %zu arguments", program->name,
                       dispatch->entry, dispatch->n_arguments);
    bool timed = span && device->n_spans < RL_MOST_SPANS;
    cl_event event = NULL;
    if (status == CL_SUCCESS)
        status = RL_CL(clEnqueueNDRangeKernel(device->queue, kernel, dispatch->dims, NULL, dispatch->global,
                                              dispatch->local, 0, NULL, timed ? &event : NULL));
    if (status != CL_SUCCESS)
        return rl_cl_fail(err, status, dispatch->entry);
    if (timed) {
        device->spans[device->n_spans].event = event;
        device->spans[device->n_spans++].out = span;
    }
    return RL_OK;
}

rl_code rl_device_finish(rl_device *device, rl_error *err)
{
    cl_int status = rl_cl_waited(clFinish(device->queue));
    for (size_t i = device->n_spans; i-- > 0;) {
        read_span(device, device->spans[i].event, i == device->n_spans - 1, device->spans[i].out);
        clReleaseEvent(device->spans[i].event);
    }
    device->n_spans = 0;
    return status == CL_SUCCESS ? RL_OK : rl_cl_fail(err, status, "the device failed");
}
