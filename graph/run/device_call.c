/* How an OpenCL call fails: its status in words and as an error, and the failures that tests ask for. */
#include "graph/run/device_parts.h"

#include <stdatomic.h>

static atomic_ulong countdown;

unsigned long rl_device_fail_at(unsigned long n)
{
    return atomic_exchange(&countdown, n);
}

bool rl_cl_injected(void)
{
    unsigned long n = atomic_load(&countdown);
    while (n > 0)
        if (atomic_compare_exchange_weak(&countdown, &n, n - 1))
            return n == 1;
    return false;
}

cl_int rl_cl_waited(cl_int status)
{
    return rl_cl_injected() ? CL_OUT_OF_RESOURCES : status;
}

const char *rl_cl_text(cl_int status)
{
    switch (status) {
    case CL_DEVICE_NOT_AVAILABLE:
        return "device not available";
    case CL_COMPILER_NOT_AVAILABLE:
        return "compiler not available";
    case CL_MEM_OBJECT_ALLOCATION_FAILURE:
        return "memory could not be allocated on the device";
    case CL_OUT_OF_RESOURCES:
        return "out of resources";
    case CL_OUT_OF_HOST_MEMORY:
        return "out of host memory";
    case CL_BUILD_PROGRAM_FAILURE:
        return "the program does not build";
    case CL_INVALID_KERNEL_NAME:
        return "no kernel of that name";
    case CL_INVALID_BUFFER_SIZE:
        return "buffer too large for the device";
    default:
        return "OpenCL error";
    }
}

rl_code rl_cl_fail(rl_error *err, cl_int status, const char *what)
{
    bool memory = status == CL_MEM_OBJECT_ALLOCATION_FAILURE || status == CL_OUT_OF_HOST_MEMORY;
    return rl_fail(err, memory ? RL_E_MEMORY : RL_E_DEVICE, RL_NOWHERE, "OpenCL: %s: %s (%d)", what,
                   rl_cl_text(status), status);
}
