#define CL_TARGET_OPENCL_VERSION 120
#include "tests/cl_harness.h"

#include <CL/cl.h>
#include <stdio.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/base/text.h"

#define OPTIONS "-cl-std=CL1.2 -cl-mad-enable -cl-no-signed-zeros -cl-finite-math-only"

struct cl_harness {
    cl_device_id device;
    cl_context context;
    cl_command_queue queue;
    char error[8192];
};

struct cl_kernel_of_pass {
    cl_harness *h;
    cl_program program;
    cl_kernel kernel;
};

static bool check(cl_harness *h, cl_int code, const char *call)
{
    if (code != CL_SUCCESS)
        snprintf(h->error, sizeof h->error, "%s: OpenCL error %d", call, (int)code);
    return code == CL_SUCCESS;
}

cl_harness *cl_harness_new(void)
{
    cl_platform_id platform;
    cl_int code;
    cl_harness *h = rl_calloc(1, sizeof *h);
    if (!h)
        return NULL;
    if (clGetPlatformIDs(1, &platform, NULL) != CL_SUCCESS ||
        clGetDeviceIDs(platform, CL_DEVICE_TYPE_ALL, 1, &h->device, NULL) != CL_SUCCESS)
        goto failed;
    h->context = clCreateContext(NULL, 1, &h->device, NULL, NULL, &code);
    if (!h->context)
        goto failed;
    h->queue = clCreateCommandQueue(h->context, h->device, CL_QUEUE_PROFILING_ENABLE, &code);
    if (h->queue)
        return h;
failed:
    cl_harness_free(&h);
    return NULL;
}

void cl_harness_free(cl_harness **h)
{
    if (!h || !*h)
        return;
    if ((*h)->queue)
        clReleaseCommandQueue((*h)->queue);
    if ((*h)->context)
        clReleaseContext((*h)->context);
    rl_free(*h);
    *h = NULL;
}

const char *cl_harness_error(const cl_harness *h)
{
    return h ? h->error : "no OpenCL device";
}

/* ---- programs ---------------------------------------------------------------------------------------- */

static void add_params(rl_str *s, const rl_pass *pass)
{
    if (pass->params.n == 0)
        return;
    rl_str_add(s, "typedef struct params_t {\n");
    for (size_t i = 0; i < pass->params.n; i++) {
        const rl_param *row = &pass->params.rows[i];
        rl_str_printf(s, "    %s %s%s;\n", row->type == RL_F32 || row->type == RL_RGBF ? "float" : "int",
                      row->name, row->type == RL_RGBF ? "[3]" : "");
    }
    rl_str_add(s, "} params_t;\n");
}

static bool add_file(rl_str *s, const char *name)
{
    char path[256], *text = NULL;
    size_t size;
    snprintf(path, sizeof path, "kernels/%s", name);
    if (rl_file_read(path, &text, &size, NULL) != RL_OK)
        return false;
    rl_str_printf(s, "#line 1 \"%s\"\n", path);
    rl_str_addn(s, text, size);
    rl_free(text);
    return true;
}

static bool add_program(rl_str *s, const rl_pass *pass, const char *generated)
{
    add_params(s, pass);
    rl_str_add(s, generated ? generated : "typedef struct material_t { int none; } material_t;\n");
    if (!add_file(s, "shared.h") || !add_file(s, "common.cl"))
        return false;
    if (!pass->kernel_text)
        return add_file(s, pass->kernel);
    rl_str_printf(s, "#line 1 \"%s\"\n%s", pass->kernel_file, pass->kernel_text);
    return !s->failed;
}

cl_kernel_of_pass *cl_harness_build(cl_harness *h, const rl_pass *pass, const char *generated, size_t step)
{
    rl_str source = {0};
    cl_int code;
    cl_kernel_of_pass *k = rl_calloc(1, sizeof *k);
    if (!k || !add_program(&source, pass, generated))
        goto failed;
    k->h = h;
    const char *text = rl_str_text(&source);
    k->program = clCreateProgramWithSource(h->context, 1, &text, NULL, &code);
    if (!check(h, code, "clCreateProgramWithSource"))
        goto failed;
    code = clBuildProgram(k->program, 1, &h->device, OPTIONS, NULL, NULL);
    if (!check(h, code, "clBuildProgram")) {
        clGetProgramBuildInfo(k->program, h->device, CL_PROGRAM_BUILD_LOG, sizeof h->error, h->error, NULL);
        goto failed;
    }
    k->kernel = clCreateKernel(k->program, pass->steps.rows[step].entry, &code);
    if (!check(h, code, "clCreateKernel"))
        goto failed;
    rl_str_free(&source);
    return k;
failed:
    rl_str_free(&source);
    cl_harness_release(&k);
    return NULL;
}

void cl_harness_release(cl_kernel_of_pass **k)
{
    if (!k || !*k)
        return;
    if ((*k)->kernel)
        clReleaseKernel((*k)->kernel);
    if ((*k)->program)
        clReleaseProgram((*k)->program);
    rl_free(*k);
    *k = NULL;
}

/* ---- running ----------------------------------------------------------------------------------------- */

frame_t cl_harness_frame(int columns, int rows)
{
    frame_t f = {.columns = columns, .rows = rows, .valid = {0, 0, columns, rows}, .stride = columns};
    f.plane = columns * rows;
    f.stride4 = columns / 4 + 2 * RL_MARGIN4;
    f.plane4 = 4 * rows * f.stride4;
    return f;
}

#define MAX_ARGS 32

static bool launch(cl_kernel_of_pass *k, const size_t global[2], double *ms)
{
    cl_event event;
    cl_ulong start = 0, end = 0;
    if (!check(k->h, clEnqueueNDRangeKernel(k->h->queue, k->kernel, 2, NULL, global, NULL, 0, NULL, &event),
               "clEnqueueNDRangeKernel"))
        return false;
    bool good = check(k->h, clFinish(k->h->queue), "clFinish");
    clGetEventProfilingInfo(event, CL_PROFILING_COMMAND_START, sizeof start, &start, NULL);
    clGetEventProfilingInfo(event, CL_PROFILING_COMMAND_END, sizeof end, &end, NULL);
    clReleaseEvent(event);
    if (ms)
        *ms = (double)(end - start) * 1e-6;
    return good;
}

bool cl_harness_run(cl_kernel_of_pass *k, const cl_buffer *args, size_t n, const size_t global[2], double *ms)
{
    cl_mem buffers[MAX_ARGS] = {0};
    cl_int code;
    bool good = n <= MAX_ARGS;
    for (size_t i = 0; good && i < n; i++) {
        if (args[i].data) {
            buffers[i] = clCreateBuffer(k->h->context, CL_MEM_READ_WRITE | CL_MEM_USE_HOST_PTR, args[i].bytes,
                                        args[i].data, &code);
            good = check(k->h, code, "clCreateBuffer");
        }
        good = good && check(k->h, clSetKernelArg(k->kernel, (cl_uint)i, sizeof buffers[i], &buffers[i]),
                             "clSetKernelArg");
    }
    good = good && launch(k, global, ms);
    for (size_t i = 0; i < n && i < MAX_ARGS; i++) {
        if (!buffers[i])
            continue;
        if (good) { /* a device with memory of its own hands its results back */
            void *p = clEnqueueMapBuffer(k->h->queue, buffers[i], CL_TRUE, CL_MAP_READ, 0, args[i].bytes, 0,
                                         NULL, NULL, &code);
            good = check(k->h, code, "clEnqueueMapBuffer");
            if (p)
                clEnqueueUnmapMemObject(k->h->queue, buffers[i], p, 0, NULL, NULL);
            clFinish(k->h->queue);
        }
        clReleaseMemObject(buffers[i]);
    }
    return good;
}
