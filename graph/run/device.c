/* Which OpenCL devices there are, which one is meant, and its context and queues. */
#include "graph/run/device_parts.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/base/text.h"

enum { MOST_DEVICES = 64 };

static size_t find_devices(cl_device_id *out)
{
    cl_platform_id platforms[16];
    cl_uint np = 0;
    size_t n = 0;
    if (RL_CL(clGetPlatformIDs(16, platforms, &np)) != CL_SUCCESS)
        return 0;
    for (cl_uint p = 0; p < np && p < 16; p++) {
        cl_uint nd = 0;
        if (RL_CL(clGetDeviceIDs(platforms[p], CL_DEVICE_TYPE_ALL, (cl_uint)(MOST_DEVICES - n), out + n,
                                 &nd)) == CL_SUCCESS)
            n += nd < MOST_DEVICES - n ? nd : MOST_DEVICES - n;
    }
    return n;
}

static const char *info_text(rl_arena *arena, cl_device_id id, cl_device_info what)
{
    char text[512] = "";
    if (clGetDeviceInfo(id, what, sizeof text - 1, text, NULL) != CL_SUCCESS)
        return "?";
    const char *copy = rl_arena_strdup(arena, text);
    return copy ? copy : "?";
}

static rl_device_info describe(rl_arena *arena, cl_device_id id)
{
    rl_device_info d = {.name = info_text(arena, id, CL_DEVICE_NAME),
                        .version = info_text(arena, id, CL_DEVICE_VERSION),
                        .driver = info_text(arena, id, CL_DRIVER_VERSION),
                        .platform = "?"};
    cl_platform_id platform;
    char text[256] = "";
    if (clGetDeviceInfo(id, CL_DEVICE_PLATFORM, sizeof platform, &platform, NULL) == CL_SUCCESS &&
        clGetPlatformInfo(platform, CL_PLATFORM_NAME, sizeof text - 1, text, NULL) == CL_SUCCESS) {
        const char *copy = rl_arena_strdup(arena, text);
        d.platform = copy ? copy : "?";
    }
    cl_device_type type = 0;
    cl_bool unified = CL_FALSE;
    cl_uint units = 0;
    cl_ulong memory = 0, largest = 0;
    clGetDeviceInfo(id, CL_DEVICE_TYPE, sizeof type, &type, NULL);
    clGetDeviceInfo(id, CL_DEVICE_HOST_UNIFIED_MEMORY, sizeof unified, &unified, NULL);
    clGetDeviceInfo(id, CL_DEVICE_MAX_COMPUTE_UNITS, sizeof units, &units, NULL);
    clGetDeviceInfo(id, CL_DEVICE_GLOBAL_MEM_SIZE, sizeof memory, &memory, NULL);
    clGetDeviceInfo(id, CL_DEVICE_MAX_MEM_ALLOC_SIZE, sizeof largest, &largest, NULL);
    d.cpu = (type & CL_DEVICE_TYPE_CPU) != 0;
    d.host_memory = d.cpu && unified;
    d.units = units;
    d.memory = memory;
    d.largest = largest;
    return d;
}

rl_code rl_device_list(rl_arena *arena, rl_device_info **out, size_t *n, rl_error *err)
{
    cl_device_id ids[MOST_DEVICES];
    *n = find_devices(ids);
    *out = rl_arena_array(arena, *n + 1, sizeof **out);
    if (!*out)
        return rl_fail_memory(err, *n * sizeof **out);
    for (size_t i = 0; i < *n; i++)
        (*out)[i] = describe(arena, ids[i]);
    return RL_OK;
}

static rl_code choose(const char *choice, const cl_device_id *ids, const rl_device_info *infos, size_t n,
                      cl_device_id *out, rl_error *err)
{
    long long index = -1;
    if (n == 0)
        return rl_fail(err, RL_E_DEVICE, RL_NOWHERE,
                       "no OpenCL device found; install PoCL (Debian: pocl-opencl-icd) or a driver for your "
                       "GPU, and see "
                       "`relit devices`");
    if (!choice) {
        for (size_t i = 0; i < n && index < 0; i++)
            index = infos[i].cpu ? (long long)i : -1;
        index = index < 0 ? 0 : index;
    } else if (!strcmp(choice, "cpu") || !strcmp(choice, "gpu")) {
        for (size_t i = 0; i < n && index < 0; i++)
            index = infos[i].cpu == !strcmp(choice, "cpu") ? (long long)i : -1;
        if (index < 0)
            return rl_fail(err, RL_E_DEVICE, RL_NOWHERE,
                           "--device %s: there is no such device; `relit devices` lists %zu", choice, n);
    } else if (!rl_parse_int(choice, &index) || index < 0 || (size_t)index >= n) {
        return rl_fail(err, RL_E_USAGE, RL_NOWHERE,
                       "--device '%s': expected cpu, gpu or 0 … %zu (see `relit devices`)", choice, n - 1);
    }
    *out = ids[index];
    return RL_OK;
}

static rl_code open_queues(rl_device *d, rl_error *err)
{
    cl_int status = CL_OUT_OF_RESOURCES;
    d->context = rl_cl_injected() ? NULL : clCreateContext(NULL, 1, &d->id, NULL, NULL, &status);
    if (!d->context)
        return rl_cl_fail(err, status, "the context cannot be made");
    status = CL_OUT_OF_RESOURCES;
    d->queue =
        rl_cl_injected() ? NULL : clCreateCommandQueue(d->context, d->id, CL_QUEUE_PROFILING_ENABLE, &status);
    if (!d->queue)
        return rl_cl_fail(err, status, "the queue cannot be made");
    status = CL_OUT_OF_RESOURCES;
    d->mapper = rl_cl_injected() ? NULL : clCreateCommandQueue(d->context, d->id, 0, &status);
    return d->mapper ? RL_OK : rl_cl_fail(err, status, "the queue cannot be made");
}

rl_code rl_device_open(const char *choice, int threads, const rl_log *log, rl_device **out, rl_error *err)
{
    *out = NULL;
    if (threads > 0) {
        char text[16];
        snprintf(text, sizeof text, "%d", threads);
        setenv("POCL_MAX_PTHREAD_COUNT", text, 0);
    }
    rl_device *d = rl_calloc(1, sizeof *d);
    if (!d)
        return rl_fail_memory(err, sizeof *d);
    d->log = log;
    cl_device_id ids[MOST_DEVICES];
    rl_device_info infos[MOST_DEVICES];
    size_t n = find_devices(ids);
    for (size_t i = 0; i < n; i++)
        infos[i] = describe(&d->arena, ids[i]);
    rl_code code = choose(choice, ids, infos, n, &d->id, err);
    if (!code) {
        d->info = describe(&d->arena, d->id);
        code = open_queues(d, err);
    }
    if (code)
        rl_device_close(&d);
    *out = d;
    return code;
}

void rl_device_close(rl_device **device)
{
    rl_device *d = *device;
    *device = NULL;
    if (!d)
        return;
    if (d->queue) {
        rl_device_finish(d, NULL);
        clReleaseCommandQueue(d->queue);
    }
    if (d->mapper) {
        clFinish(d->mapper);
        clReleaseCommandQueue(d->mapper);
    }
    if (d->context)
        clReleaseContext(d->context);
    rl_arena_free(&d->arena);
    rl_free(d);
}

const rl_device_info *rl_device_about(const rl_device *device)
{
    return &device->info;
}
