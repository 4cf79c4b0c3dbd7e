/* See cl_pass.h. */
#define CL_TARGET_OPENCL_VERSION 120
#include "tests/cl_pass.h"
#include "tests/cl_pass_image.h"

#include <CL/cl.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/base/text.h"
#include "graph/model/materials.h"
#include "graph/model/params.h"

#define KEPT    32
#define OPTIONS "-cl-std=CL1.2 -cl-mad-enable -cl-no-signed-zeros -cl-finite-math-only"

struct cl_session {
    cl_device_id device;
    cl_context context;
    cl_command_queue queue;
    bool part; /* of a device */
    struct {
        char *text;
        cl_program program;
    } kept[KEPT];
    int n_kept;
};

static bool failed(const char *what, cl_int code)
{
    if (code != CL_SUCCESS)
        fprintf(stderr, "%s: OpenCL error %d\n", what, code);
    return code != CL_SUCCESS;
}

cl_session *cl_open(int threads)
{
    cl_platform_id platforms[8];
    cl_uint n = 0;
    cl_device_id device = NULL;
    if (clGetPlatformIDs(8, platforms, &n) != CL_SUCCESS)
        return NULL;
    for (cl_uint i = 0; i < n && !device; i++)
        clGetDeviceIDs(platforms[i], CL_DEVICE_TYPE_CPU, 1, &device, NULL);
    for (cl_uint i = 0; i < n && !device; i++)
        clGetDeviceIDs(platforms[i], CL_DEVICE_TYPE_ALL, 1, &device, NULL);
    if (!device)
        return NULL;
    if (threads > 0) {
        cl_device_partition_property how[] = {CL_DEVICE_PARTITION_BY_COUNTS, threads,
                                              CL_DEVICE_PARTITION_BY_COUNTS_LIST_END, 0};
        cl_device_id part;
        if (clCreateSubDevices(device, how, 1, &part, NULL) == CL_SUCCESS)
            device = part;
    }
    cl_session *s = rl_calloc(1, sizeof *s);
    if (!s)
        return NULL;
    cl_int code;
    s->part = threads > 0;
    s->device = device;
    s->context = clCreateContext(NULL, 1, &device, NULL, NULL, &code);
    if (!failed("clCreateContext", code))
        s->queue = clCreateCommandQueue(s->context, device, CL_QUEUE_PROFILING_ENABLE, &code);
    if (failed("clCreateCommandQueue", code))
        cl_close(&s);
    return s;
}

/* PoCL 3.1: a worker lets go of the last event after those who wait for it have been told, and needs the part
 * of a device that it is of; so such parts are kept until the program ends. */
static struct {
    cl_device_id device;
    cl_context context;
    cl_command_queue queue;
} parts[16];
static int n_parts;

void cl_close(cl_session **session)
{
    cl_session *s = *session;
    *session = NULL;
    if (!s)
        return;
    for (int i = 0; i < s->n_kept; i++) {
        clReleaseProgram(s->kept[i].program);
        rl_free(s->kept[i].text);
    }
    if (s->part && n_parts < 16) {
        parts[n_parts].device = s->device;
        parts[n_parts].context = s->context;
        parts[n_parts++].queue = s->queue;
    } else {
        if (s->queue)
            clReleaseCommandQueue(s->queue);
        if (s->context)
            clReleaseContext(s->context);
        clReleaseDevice(s->device);
    }
    rl_free(s);
}

/* ---- programs ---- */

static void add_fields(rl_str *s, const rl_params *rows, const char *prefix)
{
    for (size_t i = 0; i < rows->n; i++) {
        rl_str_add(s, "    ");
        rl_param_field(&rows->rows[i], prefix, s);
        rl_str_add(s, "\n");
    }
}

static void add_words(rl_str *s, const rl_param *row, const void *params)
{
    int32_t v;
    memcpy(&v, (const char *)params + row->offset, 4);
    rl_str_printf(s, "#define P_%s %d\n", row->name, v);
}

char *cl_read_file(const char *path)
{
    FILE *file = fopen(path, "rb");
    if (!file) {
        fprintf(stderr, "%s: cannot be read (run from the project's folder)\n", path);
        return NULL;
    }
    char *text = NULL;
    if (fseek(file, 0, SEEK_END) == 0) {
        long size = ftell(file);
        rewind(file);
        text = size >= 0 ? rl_malloc((size_t)size + 1) : NULL;
        if (text)
            text[fread(text, 1, (size_t)size, file)] = 0;
    }
    fclose(file);
    return text;
}

static bool add_file(rl_str *s, const char *name)
{
    char path[256];
    snprintf(path, sizeof path, "kernels/%s", name);
    char *text = cl_read_file(path);
    if (!text)
        return false;
    rl_str_printf(s, "\n#line 1 \"%s\"\n%s", path, text);
    rl_free(text);
    return true;
}

static int width_of(const cl_job *job)
{
    return job->width ? job->width : 16;
}

static bool program_text(const cl_job *job, rl_str *s)
{
    const rl_pass *pass = job->pass;
    bool ok = add_file(s, "shared.h");
    rl_str_printf(s, "#define RL_W %d\n", width_of(job));
    rl_str_printf(s, "typedef struct params_t {\n");
    add_fields(s, &pass->params, "");
    rl_str_printf(s, "} params_t;\ntypedef struct material_t {\n    int has_profile;\n");
    add_fields(s, &pass->profile_keys, "profile_");
    add_fields(s, &pass->material_keys, "material_");
    add_fields(s, &pass->shading_keys, "shading_");
    rl_str_printf(s, "} material_t;\n");
    for (size_t i = 0; i < pass->params.n; i++)
        if (pass->params.rows[i].structural)
            add_words(s, &pass->params.rows[i], job->params);
    for (size_t i = 0; i < pass->ports.n; i++) {
        const rl_port *port = &pass->ports.rows[i];
        const cl_image *image = cl_image_of(job, port);
        if (port->role == RL_REDUCTION)
            rl_str_printf(s, "#define WANTS_%s %d\n", port->name, cl_has_port(job, port));
        if (port->role == RL_READ)
            rl_str_printf(s, "#define HAS_%s %d\n", port->name, image && image->read);
        if (port->role == RL_WRITE)
            rl_str_printf(s, "#define LAYOUT_%s %d\n", port->name, port->layout);
    }
    ok = ok && add_file(s, "common.cl");
    for (const char *names = pass->kernel_prelude; ok && names && *names;) {
        char name[64];
        int n = (int)strcspn(names, " ");
        snprintf(name, sizeof name, "%.*s", n, names);
        ok = add_file(s, name);
        names += n + (int)strspn(names + n, " ");
    }
    return ok && add_file(s, pass->kernel) && !s->failed;
}

static cl_program build(cl_session *s, const char *text)
{
    for (int i = 0; i < s->n_kept; i++)
        if (!strcmp(s->kept[i].text, text))
            return s->kept[i].program;
    cl_int code;
    cl_program program = clCreateProgramWithSource(s->context, 1, &text, NULL, &code);
    if (failed("clCreateProgramWithSource", code))
        return NULL;
    code = clBuildProgram(program, 1, &s->device, OPTIONS, NULL, NULL);
    char log[8192] = "";
    clGetProgramBuildInfo(program, s->device, CL_PROGRAM_BUILD_LOG, sizeof log - 1, log, NULL);
    if (code != CL_SUCCESS || strstr(log, "warning:"))
        fprintf(stderr, "%s\n", log);
    char *copy = rl_strdup(text);
    if (failed("clBuildProgram", code) || s->n_kept == KEPT || !copy) {
        rl_free(copy);
        clReleaseProgram(program);
        return NULL;
    }
    s->kept[s->n_kept].text = copy;
    s->kept[s->n_kept++].program = program;
    return program;
}

bool cl_read_materials(const cl_job *job, rl_arena *arena, rl_materials *m)
{
    const rl_registry alone = {&job->pass, 1};
    *m = (rl_materials){.data = job->materials};
    if (rl_material_rows(arena, &alone, &m->rows, &m->n_rows, &m->entry_bytes, NULL) != RL_OK)
        return false;
    m->count = job->materials_bytes / m->entry_bytes;
    m->profiles = rl_arena_array(arena, m->count, sizeof *m->profiles);
    for (size_t i = 0; m->profiles && i < m->count; i++) {
        int32_t has;
        memcpy(&has, (const char *)m->data + i * m->entry_bytes, sizeof has);
        m->profiles[i] = has ? "profile" : NULL;
    }
    return m->profiles != NULL;
}

/* ---- running ---- */

typedef struct cl_args {
    cl_mem mem[32];
    cl_uint n;
} cl_args;

static bool add_buffer(cl_session *s, cl_args *a, void *data, size_t bytes)
{
    cl_int code = CL_SUCCESS;
    a->mem[a->n++] =
        data ? clCreateBuffer(s->context, CL_MEM_READ_WRITE | CL_MEM_USE_HOST_PTR, bytes, data, &code) : NULL;
    return !failed("clCreateBuffer", code);
}

static double run_kernel(cl_session *s, cl_kernel kernel, cl_uint dims, const size_t *global,
                         const size_t *local)
{
    cl_event event;
    cl_ulong begin = 0, end = 0;
    if (failed("clEnqueueNDRangeKernel",
               clEnqueueNDRangeKernel(s->queue, kernel, dims, NULL, global, local, 0, NULL, &event)))
        return -1;
    clWaitForEvents(1, &event);
    clGetEventProfilingInfo(event, CL_PROFILING_COMMAND_START, sizeof begin, &begin, NULL);
    clGetEventProfilingInfo(event, CL_PROFILING_COMMAND_END, sizeof end, &end, NULL);
    clReleaseEvent(event);
    return (double)(end - begin) * 1e-6;
}

static double run_step(cl_session *s, const cl_job *job, cl_program program, const rl_step *step,
                       const cl_args *args)
{
    const frame_t *f = job->frame;
    cl_int code;
    cl_kernel kernel = clCreateKernel(program, step->entry, &code);
    if (failed(step->entry, code))
        return -1;
    double ms = -1;
    for (cl_uint i = 0; i < args->n; i++)
        if (failed(step->entry, clSetKernelArg(kernel, i, sizeof(cl_mem), &args->mem[i])))
            goto done;
    size_t columns = (size_t)f->columns, rows = (size_t)f->rows, width = (size_t)width_of(job);
    if (step->domain == RL_EVERY_PHASE)
        ms = run_kernel(s, kernel, 3, (size_t[]){16, columns / (4 * width), rows / 4}, (size_t[]){16, 1, 1});
    else if (step->domain == RL_EVERY_VECTOR)
        ms = run_kernel(s, kernel, 2, (size_t[]){columns / width, rows}, (size_t[]){4, 1});
    else if (step->domain == RL_EVERY_BAND)
        ms = run_kernel(s, kernel, 1, (size_t[]){RL_BANDS}, (size_t[]){1});
    else
        ms = run_kernel(s, kernel, 2, (size_t[]){columns, rows}, (size_t[]){64, 1});
done:
    clReleaseKernel(kernel);
    return ms;
}

static bool run_steps(cl_session *s, const cl_job *job, cl_program program, const cl_args *args)
{
    const rl_pass *pass = job->pass;
    for (size_t i = 0; i < pass->steps.n; i++) {
        const char *with = pass->steps.rows[i].with;
        if (!rl_step_runs(pass, &pass->steps.rows[i], job->params) ||
            !cl_has_port(job, &(rl_port){.role = RL_SCRATCH, .with = with}))
            continue;
        for (int again = 0; again < (job->repeat > 1 ? job->repeat : 1); again++) {
            double ms = run_step(s, job, program, &pass->steps.rows[i], args);
            if (ms < 0)
                return false;
            if (job->ms && (again == 0 || ms < job->ms[i]))
                job->ms[i] = ms;
        }
    }
    return true;
}

bool cl_run(cl_session *s, const cl_job *job)
{
    const rl_pass *pass = job->pass;
    float *planes[24] = {NULL};
    cl_args args = {.n = 0};
    rl_arena arena = {0};
    rl_str text = {0};
    rl_tables tables = {0};
    frame_t frame = *job->frame;
    bool ok = pass->ports.n <= 24 && program_text(job, &text);
    cl_program program = ok ? build(s, text.text) : NULL;
    ok = program != NULL;
    for (size_t i = 0; ok && i < pass->ports.n; i++) {
        const rl_port *port = &pass->ports.rows[i];
        if (!cl_has_port(job, port))
            continue;
        planes[i] = cl_make_plane(job, port);
        ok = (planes[i] || port->optional) &&
             add_buffer(s, &args, planes[i], cl_floats_of(job->frame, port) * 4);
        if (port->layout == RL_LINEAR && ok && planes[i]) { /* the kernel's pointer is behind the guard */
            cl_buffer_region region = {RL_GUARD * 4, (cl_floats_of(job->frame, port) - RL_GUARD) * 4};
            cl_int code;
            cl_mem part =
                clCreateSubBuffer(args.mem[args.n - 1], 0, CL_BUFFER_CREATE_TYPE_REGION, &region, &code);
            ok = !failed("clCreateSubBuffer", code);
            clReleaseMemObject(args.mem[args.n - 1]);
            args.mem[args.n - 1] = part;
        }
    }
    if (ok && pass->tables) {
        rl_error err = {0};
        rl_materials materials;
        ok = cl_read_materials(job, &arena, &materials) &&
             pass->tables(&(rl_pass_input){.params = job->params, .materials = &materials}, &arena, &tables,
                          &err) == RL_OK;
    }
    ok = ok && (!pass->params.n || add_buffer(s, &args, (void *)(uintptr_t)job->params, pass->params_size));
    ok = ok && add_buffer(s, &args, &frame, sizeof frame);
    ok = ok && add_buffer(s, &args, (void *)(uintptr_t)job->materials, job->materials_bytes);
    ok = ok && (!pass->tables || add_buffer(s, &args, tables.data, tables.n * 4));
    ok = ok && run_steps(s, job, program, &args);
    for (size_t i = 0, k = 0; ok && i < pass->ports.n; i++) {
        const rl_port *port = &pass->ports.rows[i];
        const cl_image *image = cl_image_of(job, port);
        const cl_mem mem = cl_has_port(job, port) ? args.mem[k++] : NULL;
        if (port->role == RL_READ || port->role == RL_HISTORY || !image || !mem)
            continue;
        size_t skip = port->layout == RL_LINEAR ? RL_GUARD * 4 : 0,
               bytes = cl_floats_of(job->frame, port) * 4;
        ok = !failed("clEnqueueReadBuffer", clEnqueueReadBuffer(s->queue, mem, CL_TRUE, 0, bytes - skip,
                                                                (char *)planes[i] + skip, 0, NULL, NULL));
        cl_move_image(job->frame, port, planes[i], NULL, image->write);
    }
    for (cl_uint i = 0; i < args.n; i++)
        if (args.mem[i])
            clReleaseMemObject(args.mem[i]);
    for (size_t i = 0; i < 24; i++)
        rl_free(planes[i]);
    rl_arena_free(&arena);
    rl_str_free(&text);
    return ok;
}

double cl_run_text(cl_session *s, const char *text, const char *entry, const cl_buffer *buffers, size_t n,
                   const size_t global[2], const size_t local[2], int repeat)
{
    cl_args args = {.n = 0};
    double best = -1;
    cl_int code;
    cl_kernel kernel = NULL;
    cl_program program = build(s, text);
    if (!program)
        return -1;
    kernel = clCreateKernel(program, entry, &code);
    if (failed(entry, code))
        return -1;
    for (size_t i = 0; i < n; i++)
        if (!add_buffer(s, &args, buffers[i].data, buffers[i].bytes) ||
            failed("clSetKernelArg", clSetKernelArg(kernel, (cl_uint)i, sizeof(cl_mem), &args.mem[i])))
            goto done;
    for (int again = 0; again < repeat; again++) {
        double ms = run_kernel(s, kernel, 2, global, local);
        if (ms < 0)
            goto done;
        best = again == 0 || ms < best ? ms : best;
    }
    for (size_t i = 0; i < n; i++)
        if (buffers[i].write && failed("clEnqueueReadBuffer",
                                       clEnqueueReadBuffer(s->queue, args.mem[i], CL_TRUE, 0,
                                                           buffers[i].bytes, buffers[i].data, 0, NULL, NULL)))
            best = -1;
done:
    for (cl_uint i = 0; i < args.n; i++)
        if (args.mem[i])
            clReleaseMemObject(args.mem[i]);
    clReleaseKernel(kernel);
    return best;
}
