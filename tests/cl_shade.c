#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/base/text.h"
#include "graph/model/params.h"
#include "tests/cl_shade.h"
#include "tests/cl_shade_parts.h"

static const char options[] = "-cl-std=CL1.2 -cl-mad-enable -cl-no-signed-zeros -cl-finite-math-only";
static cl_context context;
static cl_command_queue queue;
static cl_device_id device;

/* ---- the program's text ----------------------------------------------------------------------------------
 */

static void add_field(rl_str *s, const char *group, const rl_param *row)
{
    const char *type = row->type == RL_F32 || row->type == RL_RGBF ? "float" : "int";
    rl_str_printf(s, "%s %s%s%s%s; ", type, group, *group ? "_" : "", row->name,
                  row->type == RL_RGBF        ? "[3]"
                  : row->type == RL_MATERIALS ? "[8]"
                                              : "");
}

static bool add_row(void *ctx, const char *group, const rl_param *row, size_t word)
{
    (void)word;
    add_field(ctx, group, row);
    return false;
}

static void add_param(rl_str *s, const rl_param *row, const void *params)
{
    uint32_t word;
    memcpy(&word, (const char *)params + row->offset, 4);
    if (row->structural)
        rl_str_printf(s, "#define P_%s %g\n", row->name, shade_from_word(row->type, word));
}

/* The run's own, or the defaults. */
static const void *params_of(const shade_run *run)
{
    static uint32_t words[SHADE_WORDS];
    if (run->params)
        return run->params;
    shade_params_default(run->pass, words);
    return words;
}

static void add_prelude(rl_str *s, const shade_run *run)
{
    const rl_pass *pass = run->pass;
    if (pass->params.n) {
        rl_str_add(s, "typedef struct params_t { ");
        for (size_t r = 0; r < pass->params.n; r++)
            add_field(s, "", &pass->params.rows[r]);
        rl_str_add(s, "} params_t;\n");
    }
    for (size_t r = 0; r < pass->params.n; r++)
        add_param(s, &pass->params.rows[r], params_of(run));
    int march = 0;
    for (int i = 0; i < run->frame.lights && pass->lights; i++)
        march |= run->lights[i].shadow == SHADOW_MARCH;
    if (pass->lights)
        rl_str_printf(s, "#define LIGHTS_MARCH %d\n", march);
    rl_str_add(s, "typedef struct material_t { int has_profile; ");
    shade_each_row(run->materials, add_row, s);
    rl_str_add(s, "} material_t;\n");
    for (size_t i = 0; i < pass->ports.n; i++) {
        const rl_port *port = &pass->ports.rows[i];
        if (port->role != RL_WRITE && port->role != RL_SCRATCH)
            rl_str_printf(s, "#define HAS_%s %d\n", port->name, run->images[i] != NULL);
        if (port->any_layout)
            rl_str_printf(s, "#define LAYOUT_%s %d\n", port->name, run->phase4[i]);
    }
}

static bool add_file(rl_str *s, const char *path)
{
    char *text = NULL;
    size_t size = 0;
    rl_error err = {0};
    if (rl_file_read(path, &text, &size, &err) != RL_OK) {
        fprintf(stderr, "%s\n", err.text);
        return false;
    }
    rl_str_printf(s, "#line 1 \"%s\"\n", path);
    rl_str_addn(s, text, size);
    rl_free(text);
    return true;
}

/* Names separated by spaces; NULL = none. */
static bool add_preludes(rl_str *s, const char *names)
{
    bool ok = true;
    while (names && *names && ok) {
        char path[256];
        int n = (int)strcspn(names, " ");
        snprintf(path, sizeof path, "kernels/%.*s", n, names);
        ok = add_file(s, path);
        names += n + (int)strspn(names + n, " ");
    }
    return ok;
}

/* ---- the device ------------------------------------------------------------------------------------------
 */

bool shade_device(void)
{
    cl_platform_id platform;
    cl_int bad = 0;
    if (queue)
        return true;
    if (clGetPlatformIDs(1, &platform, NULL) != CL_SUCCESS)
        return false;
    if (clGetDeviceIDs(platform, CL_DEVICE_TYPE_ALL, 1, &device, NULL) != CL_SUCCESS)
        return false;
    context = clCreateContext(NULL, 1, &device, NULL, NULL, &bad);
    if (bad)
        return false;
    queue = clCreateCommandQueue(context, device, 0, &bad);
    return bad == CL_SUCCESS;
}

static cl_program build(const char *text, int lanes)
{
    static char log[1 << 16];
    char with[256];
    cl_int bad = 0;
    snprintf(with, sizeof with, "%s -DRL_W=%d", options, lanes);
    cl_program program = clCreateProgramWithSource(context, 1, &text, NULL, &bad);
    if (bad)
        return NULL;
    bad = clBuildProgram(program, 1, &device, with, NULL, NULL);
    log[0] = 0;
    clGetProgramBuildInfo(program, device, CL_PROGRAM_BUILD_LOG, sizeof log, log, NULL);
    if (bad || strstr(log, "warning:")) {
        fprintf(stderr, "build (%d): %s\n", bad, log);
        clReleaseProgram(program);
        return NULL;
    }
    return program;
}

typedef struct launch {
    cl_program program;
    cl_kernel kernel;
    cl_mem buffers[SHADE_PORTS + 6]; /* NULL for absent ports */
    cl_uint n;
} launch;

static bool add_buffer(launch *l, const void *data, size_t bytes)
{
    cl_int bad = 0;
    cl_mem buffer = NULL;
    if (data)
        buffer = clCreateBuffer(context, CL_MEM_READ_WRITE | CL_MEM_COPY_HOST_PTR, bytes,
                                (void *)(uintptr_t)data, &bad);
    l->buffers[l->n++] = buffer;
    return bad == CL_SUCCESS;
}

/* Ports are sub-buffers behind their guard, as in the executor. */
static bool add_port(launch *l, const frame_t *f, const shade_image *image)
{
    if (!image)
        return add_buffer(l, NULL, 0);
    size_t bytes = shade_image_floats(f, image->planes) * sizeof(float);
    cl_int bad = 0;
    cl_mem whole = clCreateBuffer(context, CL_MEM_READ_WRITE | CL_MEM_COPY_HOST_PTR, bytes,
                                  image->data - RL_GUARD, &bad);
    if (bad)
        return false;
    cl_buffer_region region = {RL_GUARD * sizeof(float), bytes - RL_GUARD * sizeof(float)};
    cl_mem buffer = clCreateSubBuffer(whole, CL_MEM_READ_WRITE, CL_BUFFER_CREATE_TYPE_REGION, &region, &bad);
    clReleaseMemObject(whole); /* lives on in the sub-buffer */
    l->buffers[l->n++] = buffer;
    return bad == CL_SUCCESS;
}

static bool set_arguments(const launch *l)
{
    bool ok = true;
    for (cl_uint i = 0; i < l->n && ok; i++)
        ok = clSetKernelArg(l->kernel, i, sizeof(cl_mem), &l->buffers[i]) == CL_SUCCESS;
    return ok;
}

static void free_launch(launch *l)
{
    for (cl_uint i = 0; i < l->n; i++)
        if (l->buffers[i])
            clReleaseMemObject(l->buffers[i]);
    if (l->kernel)
        clReleaseKernel(l->kernel);
    if (l->program)
        clReleaseProgram(l->program);
}

static bool count_words(void *ctx, const char *group, const rl_param *row, size_t word)
{
    size_t *words = ctx;
    (void)group;
    *words = word + RL_PARAM_BYTES(row->type) / 4;
    return false;
}

static bool add_materials(launch *l, const shade_materials *m)
{
    static uint32_t packed[SHADE_MATERIALS * SHADE_WORDS];
    size_t words = 1;
    shade_each_row(m, count_words, &words);
    for (size_t i = 0; i < m->n; i++)
        memcpy(packed + i * words, m->words[i], words * 4);
    return add_buffer(l, packed, (m->n ? m->n : 1) * words * 4);
}

static bool add_arguments(launch *l, const shade_run *run)
{
    const rl_pass *pass = run->pass;
    light_t none = {0};
    for (size_t i = 0; i < pass->ports.n; i++)
        if (!rl_port_on_request(&pass->ports.rows[i]) && !add_port(l, &run->frame, run->images[i]))
            return false;
    if (pass->params.n && !add_buffer(l, params_of(run), pass->params_size))
        return false;
    if (!add_buffer(l, &run->frame, sizeof run->frame) || !add_materials(l, run->materials))
        return false;
    size_t n = run->frame.lights > 0 ? (size_t)run->frame.lights : 1;
    const ambient_t dark = {0};
    if (pass->lights && !add_buffer(l, run->frame.lights ? run->lights : &none, n * sizeof(light_t)))
        return false;
    return !pass->ambient || add_buffer(l, run->ambient ? run->ambient : &dark, sizeof dark);
}

static int lanes_of(const shade_run *run)
{
    return run->lanes ? run->lanes : 16;
}

static double now_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec * 1e3 + (double)t.tv_nsec * 1e-6;
}

static bool dispatch(launch *l, shade_run *run, rl_domain domain)
{
    const frame_t *f = &run->frame;
    size_t width = (size_t)lanes_of(run);
    bool vectors = domain == RL_EVERY_VECTOR;
    size_t size[2] = {(size_t)f->columns / (vectors ? width : 1), (size_t)f->rows};
    size_t local[2] = {vectors ? 4 : 64, 1}; /* as the executor: items of a group keep their state at once */
    run->best_ms = 1e30;
    for (int i = 0; i <= run->repeat; i++) {
        double start = now_ms();
        if (clEnqueueNDRangeKernel(queue, l->kernel, 2, NULL, size, local, 0, NULL, NULL) != CL_SUCCESS)
            return false;
        if (clFinish(queue) != CL_SUCCESS)
            return false;
        double ms = now_ms() - start;
        run->best_ms = ms < run->best_ms ? ms : run->best_ms;
    }
    return true;
}

static bool read_back(launch *l, const shade_run *run)
{
    for (size_t i = 0; i < run->pass->ports.n; i++) {
        const rl_port *port = &run->pass->ports.rows[i];
        const shade_image *image = run->images[i];
        if (!image || (port->role != RL_WRITE && port->role != RL_SCRATCH))
            continue;
        size_t bytes = (shade_image_floats(&run->frame, image->planes) - RL_GUARD) * sizeof(float);
        if (clEnqueueReadBuffer(queue, l->buffers[i], CL_TRUE, 0, bytes, image->data, 0, NULL, NULL) !=
            CL_SUCCESS)
            return false;
    }
    return true;
}

/* Whether the run has no image for the port of that name. */
static bool is_without(const shade_run *run, const char *port)
{
    for (size_t i = 0; port && i < run->pass->ports.n; i++)
        if (!strcmp(run->pass->ports.rows[i].name, port))
            return !run->images[i];
    return true;
}

static bool run_step(launch *l, shade_run *run, const rl_step *step)
{
    cl_int bad = 0;
    l->kernel = clCreateKernel(l->program, step->entry, &bad);
    bool ok = l->kernel && set_arguments(l) && dispatch(l, run, step->domain);
    if (l->kernel)
        clReleaseKernel(l->kernel);
    l->kernel = NULL;
    return ok;
}

bool shade_execute(shade_run *run)
{
    bool ok = false;
    char path[256];
    rl_str text = {0};
    launch l = {0};
    snprintf(path, sizeof path, "kernels/%s", run->pass->kernel);
    add_prelude(&text, run);
    if (!shade_device() || !add_file(&text, "kernels/shared.h") || !add_file(&text, "kernels/common.cl") ||
        !add_preludes(&text, run->pass->kernel_prelude) || !add_file(&text, path))
        goto done;
    l.program = build(rl_str_text(&text), lanes_of(run));
    if (!l.program)
        goto done;
    ok = add_arguments(&l, run);
    for (size_t i = 0; i < run->pass->steps.n && ok; i++) {
        const rl_step *step = &run->pass->steps.rows[i];
        if (rl_step_runs(run->pass, step, params_of(run)) && is_without(run, step->without) && !step->with)
            ok = run_step(&l, run, step);
    }
    ok = ok && read_back(&l, run);
    if (!ok)
        fprintf(stderr, "%s: cannot run\n", run->pass->name);
done:
    free_launch(&l);
    rl_str_free(&text);
    return ok;
}

bool shade_function(const char *source, const char *entry, const float *in, float *out, size_t n)
{
    bool ok = false;
    rl_str text = {0};
    launch l = {0};
    cl_int bad = 0;
    rl_str_add(&text, "typedef struct material_t { int has_profile; } material_t;\n");
    if (!shade_device() || !add_file(&text, "kernels/shared.h") || !add_file(&text, "kernels/common.cl"))
        goto done;
    rl_str_printf(&text, "#line 1 \"%s\"\n%s", entry, source);
    l.program = build(rl_str_text(&text), 16);
    if (!l.program)
        goto done;
    l.kernel = clCreateKernel(l.program, entry, &bad);
    if (bad || !add_buffer(&l, in, n * sizeof *in) || !add_buffer(&l, out, n * sizeof *out) ||
        !set_arguments(&l))
        goto done;
    ok = clEnqueueNDRangeKernel(queue, l.kernel, 1, NULL, &(size_t){n / 16}, NULL, 0, NULL, NULL) ==
             CL_SUCCESS &&
         clEnqueueReadBuffer(queue, l.buffers[1], CL_TRUE, 0, n * sizeof *out, out, 0, NULL, NULL) ==
             CL_SUCCESS;
done:
    free_launch(&l);
    rl_str_free(&text);
    return ok;
}
