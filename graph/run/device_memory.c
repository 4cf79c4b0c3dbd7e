/* Buffers: host memory where the device shares it. Maps have a queue of their own; copies go with the
 * kernels. */
#include "graph/run/device_parts.h"

#include <string.h>

#include "graph/base/alloc.h"

static rl_code fill_zero(rl_memory *m, rl_error *err)
{
    void *p;
    rl_code code = rl_memory_map(m, true, &p, err);
    if (code)
        return code;
    memset(p, 0, m->bytes);
    return rl_memory_unmap(m, err);
}

static rl_code create_buffer(rl_memory *m, rl_error *err)
{
    const rl_device *d = m->device;
    cl_int status = CL_OUT_OF_RESOURCES;
    if (d->info.host_memory) {
        void *host = rl_aligned_zeroed(m->bytes, &m->block);
        if (!host)
            return rl_fail_memory(err, m->bytes);
        if (!rl_cl_injected())
            m->mem =
                clCreateBuffer(d->context, CL_MEM_READ_WRITE | CL_MEM_USE_HOST_PTR, m->bytes, host, &status);
    } else if (!rl_cl_injected()) {
        m->mem =
            clCreateBuffer(d->context, CL_MEM_READ_WRITE | CL_MEM_ALLOC_HOST_PTR, m->bytes, NULL, &status);
    }
    return m->mem ? RL_OK : rl_cl_fail(err, status, "a buffer cannot be made");
}

rl_code rl_memory_new(rl_device *device, size_t bytes, size_t guard, rl_memory **out, rl_error *err)
{
    *out = NULL;
    rl_memory *m = rl_calloc(1, sizeof *m);
    if (!m)
        return rl_fail_memory(err, sizeof *m);
    m->device = device;
    m->bytes = bytes ? bytes : RL_ALIGN;
    rl_code code = create_buffer(m, err);
    if (!code && guard) {
        cl_int status = CL_OUT_OF_RESOURCES;
        cl_buffer_region behind = {guard, m->bytes - guard};
        if (!rl_cl_injected())
            m->seen = clCreateSubBuffer(m->mem, 0, CL_BUFFER_CREATE_TYPE_REGION, &behind, &status);
        if (!m->seen)
            code = rl_cl_fail(err, status, "a part of a buffer cannot be made");
    }
    if (!code && !m->block)
        code = fill_zero(m, err);
    if (code)
        rl_memory_free(&m);
    *out = m;
    return code;
}

void rl_memory_free(rl_memory **memory)
{
    rl_memory *m = *memory;
    *memory = NULL;
    if (!m)
        return;
    if (m->seen)
        clReleaseMemObject(m->seen);
    if (m->mem)
        clReleaseMemObject(m->mem);
    rl_free(m->block);
    rl_free(m);
}

size_t rl_memory_bytes(const rl_memory *memory)
{
    return memory->bytes;
}

rl_code rl_memory_map(rl_memory *memory, bool write, void **out, rl_error *err)
{
    cl_int status = CL_OUT_OF_RESOURCES;
    *out = memory->mapped;
    if (memory->maps > 0) {
        memory->maps++;
        return RL_OK;
    }
    cl_map_flags flags = write ? CL_MAP_READ | CL_MAP_WRITE : CL_MAP_READ;
    if (!rl_cl_injected())
        *out = clEnqueueMapBuffer(memory->device->mapper, memory->mem, CL_TRUE, flags, 0, memory->bytes, 0,
                                  NULL, NULL, &status);
    memory->mapped = *out;
    memory->maps = *out != NULL;
    return *out ? RL_OK : rl_cl_fail(err, status, "a buffer cannot be mapped");
}

rl_code rl_memory_unmap(rl_memory *memory, rl_error *err)
{
    cl_event done = NULL;
    if (--memory->maps > 0)
        return RL_OK;
    cl_int status =
        RL_CL(clEnqueueUnmapMemObject(memory->device->mapper, memory->mem, memory->mapped, 0, NULL, &done));
    memory->mapped = NULL;
    if (status == CL_SUCCESS)
        status = rl_cl_waited(clWaitForEvents(1, &done));
    if (done)
        clReleaseEvent(done);
    return status == CL_SUCCESS ? RL_OK : rl_cl_fail(err, status, "a buffer cannot be unmapped");
}

rl_code rl_memory_copy(rl_memory *to, rl_memory *from, rl_error *err)
{
    size_t bytes = to->bytes < from->bytes ? to->bytes : from->bytes;
    cl_int status =
        RL_CL(clEnqueueCopyBuffer(to->device->queue, from->mem, to->mem, 0, 0, bytes, 0, NULL, NULL));
    return status == CL_SUCCESS ? RL_OK : rl_cl_fail(err, status, "a buffer cannot be copied");
}
