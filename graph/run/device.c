/* Every cl* call of the engine. */
#define CL_TARGET_OPENCL_VERSION 120
#include "graph/run/device.h"
#include "graph/run/device_home.h"

#include <CL/cl.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "graph/base/alloc.h"
#include "graph/base/text.h"
#include "graph/run/program_cache.h"

/* One scale for all machines: results must not depend on the vector width that a device likes. No
 * fast-relaxed-math: it deletes the rounding tricks of common.cl. */
#define BUILD_OPTIONS "-cl-std=CL1.2 -cl-mad-enable -cl-no-signed-zeros -cl-finite-math-only -DRL_W=16"

enum { MOST_DEVICES = 64, MOST_KERNELS = 16, MOST_SPANS = 512 };

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
    } spans[MOST_SPANS];
    size_t n_spans;
    int64_t clock_offset; /* device time + offset = CLOCK_MONOTONIC, ns */
};

struct rl_memory {
    rl_device *device;
    cl_mem mem;
    cl_mem seen; /* what kernels get: mem, or the part of it behind the guard */
    size_t bytes;
    void *host; /* host-memory devices: ours */
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
    } kernels[MOST_KERNELS];
    size_t n_kernels;
    bool from_source;
    int users; /* rl_program_share's included */
    uint64_t key[2];
};

/* ---- calls that can fail ---------------------------------------------------------------------------------
 */

static atomic_ulong countdown;

unsigned long rl_device_fail_at(unsigned long n)
{
    return atomic_exchange(&countdown, n);
}

static bool injected(void)
{
    unsigned long n = atomic_load(&countdown);
    while (n > 0)
        if (atomic_compare_exchange_weak(&countdown, &n, n - 1))
            return n == 1;
    return false;
}

/* The call's status, or an injected failure without the call. */
#define CL(call) (injected() ? CL_OUT_OF_RESOURCES : (call))

/* The status of a wait. An injected failure comes behind the call: the device must not be at work on memory
 * that the caller then frees. */
static cl_int waited(cl_int status)
{
    return injected() ? CL_OUT_OF_RESOURCES : status;
}

static const char *status_text(cl_int status)
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

static rl_code fail_cl(rl_error *err, cl_int status, const char *what)
{
    bool memory = status == CL_MEM_OBJECT_ALLOCATION_FAILURE || status == CL_OUT_OF_HOST_MEMORY;
    return rl_fail(err, memory ? RL_E_MEMORY : RL_E_DEVICE, RL_NOWHERE, "OpenCL: %s: %s (%d)", what,
                   status_text(status), status);
}

/* ---- devices ---------------------------------------------------------------------------------------------
 */

static size_t find_devices(cl_device_id *out)
{
    cl_platform_id platforms[16];
    cl_uint np = 0;
    size_t n = 0;
    rl_device_home();
    if (CL(clGetPlatformIDs(16, platforms, &np)) != CL_SUCCESS)
        return 0;
    for (cl_uint p = 0; p < np && p < 16; p++) {
        cl_uint nd = 0;
        if (CL(clGetDeviceIDs(platforms[p], CL_DEVICE_TYPE_ALL, (cl_uint)(MOST_DEVICES - n), out + n, &nd)) ==
            CL_SUCCESS)
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
    d->context = injected() ? NULL : clCreateContext(NULL, 1, &d->id, NULL, NULL, &status);
    if (!d->context)
        return fail_cl(err, status, "the context cannot be made");
    status = CL_OUT_OF_RESOURCES;
    d->queue =
        injected() ? NULL : clCreateCommandQueue(d->context, d->id, CL_QUEUE_PROFILING_ENABLE, &status);
    if (!d->queue)
        return fail_cl(err, status, "the queue cannot be made");
    status = CL_OUT_OF_RESOURCES;
    d->mapper = injected() ? NULL : clCreateCommandQueue(d->context, d->id, 0, &status);
    return d->mapper ? RL_OK : fail_cl(err, status, "the queue cannot be made");
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

/* ---- memory ----------------------------------------------------------------------------------------------
 */

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
        m->host = rl_aligned(m->bytes);
        if (!m->host)
            return rl_fail_memory(err, m->bytes);
        if (!injected())
            m->mem = clCreateBuffer(d->context, CL_MEM_READ_WRITE | CL_MEM_USE_HOST_PTR, m->bytes, m->host,
                                    &status);
    } else if (!injected()) {
        m->mem =
            clCreateBuffer(d->context, CL_MEM_READ_WRITE | CL_MEM_ALLOC_HOST_PTR, m->bytes, NULL, &status);
    }
    return m->mem ? RL_OK : fail_cl(err, status, "a buffer cannot be made");
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
        if (!injected())
            m->seen = clCreateSubBuffer(m->mem, 0, CL_BUFFER_CREATE_TYPE_REGION, &behind, &status);
        if (!m->seen)
            code = fail_cl(err, status, "a part of a buffer cannot be made");
    }
    if (!code)
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
    rl_free(m->host);
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
    if (!injected())
        *out = clEnqueueMapBuffer(memory->device->mapper, memory->mem, CL_TRUE, flags, 0, memory->bytes, 0,
                                  NULL, NULL, &status);
    memory->mapped = *out;
    memory->maps = *out != NULL;
    return *out ? RL_OK : fail_cl(err, status, "a buffer cannot be mapped");
}

rl_code rl_memory_unmap(rl_memory *memory, rl_error *err)
{
    cl_event done = NULL;
    if (--memory->maps > 0)
        return RL_OK;
    cl_int status =
        CL(clEnqueueUnmapMemObject(memory->device->mapper, memory->mem, memory->mapped, 0, NULL, &done));
    memory->mapped = NULL;
    if (status == CL_SUCCESS)
        status = waited(clWaitForEvents(1, &done));
    if (done)
        clReleaseEvent(done);
    return status == CL_SUCCESS ? RL_OK : fail_cl(err, status, "a buffer cannot be unmapped");
}

rl_code rl_memory_copy(rl_memory *to, rl_memory *from, rl_error *err)
{
    size_t bytes = to->bytes < from->bytes ? to->bytes : from->bytes;
    cl_int status =
        CL(clEnqueueCopyBuffer(to->device->queue, from->mem, to->mem, 0, 0, bytes, 0, NULL, NULL));
    return status == CL_SUCCESS ? RL_OK : fail_cl(err, status, "a buffer cannot be copied");
}

/* ---- programs --------------------------------------------------------------------------------------------
 */

/* Cuts a severity ("error: ") off the front of *text: 'e', 'w', or 0 where there is none. */
static char cut_severity(const char **text)
{
    static const char *const words[] = {"error: ", "fatal error: ", "warning: "};
    for (int i = 0; i < 3; i++) {
        size_t n = strlen(words[i]);
        if (!strncmp(*text, words[i], n)) {
            *text += n;
            return i < 2 ? 'e' : 'w';
        }
    }
    return 0;
}

/* A line of a compiler's log, "error: place: text" (PoCL) or "place: error: text" (clang): its severity, or
 * 0. The place, "file:line:column", is split in `line` itself. */
static char split_message(char *line, rl_where *where, const char **text)
{
    const char *start = line;
    char severity = cut_severity(&start);
    for (char *c = line + (start - line); *c; c++) {
        int used = 0, at_line, column;
        if (*c != ':' || sscanf(c, ":%d:%d: %n", &at_line, &column, &used) != 2 || !used)
            continue;
        *text = c + used;
        *c = 0;
        *where = (rl_where){start, at_line, column};
        char inner = cut_severity(text);
        return severity ? severity : inner;
    }
    return 0;
}

/* The first error of a compiler's log, or its first warning when there is none, becomes the error. */
static rl_code fail_build(rl_error *err, const char *name, char *log)
{
    rl_where where, found = RL_NOWHERE;
    const char *text, *what = NULL;
    char severity = 0;
    char *rest = NULL;
    for (char *line = strtok_r(log, "\n", &rest); line && severity != 'e';
         line = strtok_r(NULL, "\n", &rest)) {
        char s = split_message(line, &where, &text);
        if (!s || (s == 'w' && severity))
            continue;
        severity = s;
        found = where;
        what = text;
    }
    return rl_fail(err, RL_E_BUILD, found, what ? "%s" : "OpenCL program '%s' does not build",
                   what ? what : name);
}

static rl_code build_log(rl_program *p, cl_int status, bool strict, rl_error *err)
{
    size_t n = 0;
    clGetProgramBuildInfo(p->program, p->device->id, CL_PROGRAM_BUILD_LOG, 0, NULL, &n);
    char *log = n > 1 ? rl_calloc(1, n + 1) : NULL;
    if (log)
        clGetProgramBuildInfo(p->program, p->device->id, CL_PROGRAM_BUILD_LOG, n, log, NULL);
    bool warned = log && strstr(log, "warning: ");
    rl_code code = RL_OK;
    if (status != CL_SUCCESS && status != CL_BUILD_PROGRAM_FAILURE)
        code = fail_cl(err, status, p->name);
    else if (status != CL_SUCCESS || (warned && strict))
        code = log ? fail_build(err, p->name, log) : fail_cl(err, status, p->name);
    rl_free(log);
    return code;
}

static bool load_binary(rl_program *p)
{
    unsigned char *binary = NULL;
    size_t size = 0;
    if (!rl_program_cache_load(p->key, &binary, &size))
        return false;
    cl_int status = CL_OUT_OF_RESOURCES, each = CL_SUCCESS;
    const unsigned char *data = binary;
    if (!injected())
        p->program =
            clCreateProgramWithBinary(p->device->context, 1, &p->device->id, &size, &data, &each, &status);
    rl_free(binary);
    if (p->program &&
        CL(clBuildProgram(p->program, 1, &p->device->id, BUILD_OPTIONS, NULL, NULL)) == CL_SUCCESS)
        return true;
    if (p->program)
        clReleaseProgram(p->program);
    p->program = NULL;
    return false;
}

static rl_code build_source(rl_program *p, const char *text, bool strict, rl_error *err)
{
    cl_int status = CL_OUT_OF_RESOURCES;
    if (!injected())
        p->program = clCreateProgramWithSource(p->device->context, 1, &text, NULL, &status);
    if (!p->program)
        return fail_cl(err, status, "a program cannot be made");
    status = CL(clBuildProgram(p->program, 1, &p->device->id, BUILD_OPTIONS, NULL, NULL));
    p->from_source = true;
    return build_log(p, status, strict, err);
}

rl_code rl_program_build(rl_device *device, const char *name, const char *text, bool strict, rl_program **out,
                         rl_error *err)
{
    *out = NULL;
    rl_program *p = rl_calloc(1, sizeof *p);
    if (p)
        p->name = rl_strdup(name);
    if (!p || !p->name) {
        rl_free(p);
        return rl_fail_memory(err, sizeof *p);
    }
    p->device = device;
    p->users = 1;
    const char *const parts[] = {text, BUILD_OPTIONS, device->info.name, device->info.version,
                                 device->info.driver};
    rl_program_cache_key(parts, sizeof parts / sizeof *parts, p->key);
    rl_code code = load_binary(p) ? RL_OK : build_source(p, text, strict, err);
    if (code)
        rl_program_free(&p);
    *out = p;
    return code;
}

static void save_binary(rl_program *p)
{
    size_t size = 0;
    if (clGetProgramInfo(p->program, CL_PROGRAM_BINARY_SIZES, sizeof size, &size, NULL) != CL_SUCCESS ||
        !size)
        return;
    unsigned char *binary = rl_malloc(size);
    rl_error err = {0};
    if (binary &&
        clGetProgramInfo(p->program, CL_PROGRAM_BINARIES, sizeof binary, &binary, NULL) == CL_SUCCESS &&
        rl_program_cache_save(p->key, binary, size, &err))
        rl_report(p->device->log, RL_VERBOSE, RL_NOWHERE, "the compiled program '%s' was not cached: %s",
                  p->name, err.text);
    rl_free(binary);
}

rl_program *rl_program_share(rl_program *program)
{
    if (program)
        program->users++;
    return program;
}

void rl_program_free(rl_program **program)
{
    rl_program *p = *program;
    *program = NULL;
    if (!p || --p->users > 0)
        return;
    /* Only now does a PoCL binary hold the machine code of the sizes that were run. */
    if (p->program && p->from_source && p->n_kernels > 0)
        save_binary(p);
    for (size_t i = 0; i < p->n_kernels; i++)
        clReleaseKernel(p->kernels[i].kernel);
    if (p->program)
        clReleaseProgram(p->program);
    rl_free(p->name);
    rl_free(p);
}

static rl_code get_kernel(rl_program *p, const char *entry, cl_kernel *out, rl_error *err)
{
    for (size_t i = 0; i < p->n_kernels; i++) {
        if (!strcmp(p->kernels[i].entry, entry)) {
            *out = p->kernels[i].kernel;
            return RL_OK;
        }
    }
    cl_int status = CL_OUT_OF_RESOURCES;
    *out = NULL;
    if (p->n_kernels < MOST_KERNELS && !injected())
        *out = clCreateKernel(p->program, entry, &status);
    if (!*out)
        return rl_fail(err, RL_E_BUILD, RL_NOWHERE, "OpenCL program '%s': kernel '%s': %s (%d)", p->name,
                       entry, status_text(status), status);
    snprintf(p->kernels[p->n_kernels].entry, sizeof p->kernels[0].entry, "%s", entry);
    p->kernels[p->n_kernels++].kernel = *out;
    return RL_OK;
}

rl_code rl_program_check(const rl_program *p, const char *entry, const char *what, rl_where where,
                         rl_error *err)
{
    char list[4096] = "";
    const char *names[MOST_KERNELS];
    size_t n = 0;
    cl_int status = CL(clGetProgramInfo(p->program, CL_PROGRAM_KERNEL_NAMES, sizeof list - 1, list, NULL));
    if (status)
        return rl_fail(err, RL_E_DEVICE, RL_NOWHERE, "OpenCL program '%s': its kernels: %s (%d)", p->name,
                       status_text(status), status);
    for (char *at = list, *next; at && n < MOST_KERNELS; at = next) {
        next = strchr(at, ';');
        if (next)
            *next++ = 0;
        if (!strcmp(at, entry))
            return RL_OK;
        if (*at)
            names[n++] = at;
    }
    rl_str text = {0};
    rl_suggest(&text, entry, names, n, "known");
    rl_code code =
        rl_fail(err, RL_E_BUILD, where, "%s has no kernel '%s'%s", what, entry, rl_str_text(&text));
    rl_str_free(&text);
    return code;
}

/* ---- running ---------------------------------------------------------------------------------------------
 */

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
    cl_int status = CL(clGetKernelInfo(kernel, CL_KERNEL_NUM_ARGS, sizeof wanted, &wanted, NULL));
    if (status == CL_SUCCESS && wanted != x->n_arguments)
        return CL_INVALID_ARG_INDEX;
    for (size_t i = 0; status == CL_SUCCESS && i < x->n_arguments; i++) {
        const rl_memory *m = x->arguments[i];
        cl_mem mem = m ? m->seen ? m->seen : m->mem : NULL;
        status = CL(clSetKernelArg(kernel, (cl_uint)i, sizeof mem, mem ? &mem : NULL));
    }
    return status;
}

rl_code rl_device_run(rl_device *device, rl_program *program, const rl_dispatch *dispatch, rl_span *span,
                      rl_error *err)
{
    cl_kernel kernel;
    rl_code code = get_kernel(program, dispatch->entry, &kernel, err);
    if (code)
        return code;
    cl_int status = set_arguments(kernel, dispatch);
    if (status == CL_INVALID_ARG_INDEX)
        return rl_fail(err, RL_E_BUILD, RL_NOWHERE,
                       "OpenCL program '%s': kernel '%s' must take %zu arguments", program->name,
                       dispatch->entry, dispatch->n_arguments);
    bool timed = span && device->n_spans < MOST_SPANS;
    cl_event event = NULL;
    if (status == CL_SUCCESS)
        status = CL(clEnqueueNDRangeKernel(device->queue, kernel, dispatch->dims, NULL, dispatch->global,
                                           dispatch->local, 0, NULL, timed ? &event : NULL));
    if (status != CL_SUCCESS)
        return fail_cl(err, status, dispatch->entry);
    if (timed) {
        device->spans[device->n_spans].event = event;
        device->spans[device->n_spans++].out = span;
    }
    return RL_OK;
}

rl_code rl_device_finish(rl_device *device, rl_error *err)
{
    cl_int status = waited(clFinish(device->queue));
    for (size_t i = device->n_spans; i-- > 0;) {
        read_span(device, device->spans[i].event, i == device->n_spans - 1, device->spans[i].out);
        clReleaseEvent(device->spans[i].event);
    }
    device->n_spans = 0;
    return status == CL_SUCCESS ? RL_OK : fail_cl(err, status, "the device failed");
}
