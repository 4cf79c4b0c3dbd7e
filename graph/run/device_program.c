/* Programs: from the cache or compiled, a compiler's log as an error, and their kernels by name. */
#include "graph/run/device_parts.h"

#include <stdio.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/base/text.h"
#include "graph/run/program_cache.h"

/* One scale for all machines: results must not depend on the vector width that a device likes. No
 * fast-relaxed-math: it deletes the rounding tricks of common.cl. */
#define BUILD_OPTIONS "-cl-std=CL1.2 -cl-mad-enable -cl-no-signed-zeros -cl-finite-math-only -DRL_W=16"

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
        code = rl_cl_fail(err, status, p->name);
    else if (status != CL_SUCCESS || (warned && strict))
        code = log ? fail_build(err, p->name, log) : rl_cl_fail(err, status, p->name);
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
    if (!rl_cl_injected())
        p->program =
            clCreateProgramWithBinary(p->device->context, 1, &p->device->id, &size, &data, &each, &status);
    rl_free(binary);
    if (p->program &&
        RL_CL(clBuildProgram(p->program, 1, &p->device->id, BUILD_OPTIONS, NULL, NULL)) == CL_SUCCESS)
        return true;
    if (p->program)
        clReleaseProgram(p->program);
    p->program = NULL;
    return false;
}

static rl_code build_source(rl_program *p, const char *text, bool strict, rl_error *err)
{
    cl_int status = CL_OUT_OF_RESOURCES;
    if (!rl_cl_injected())
        p->program = clCreateProgramWithSource(p->device->context, 1, &text, NULL, &status);
    if (!p->program)
        return rl_cl_fail(err, status, "a program cannot be made");
    status = RL_CL(clBuildProgram(p->program, 1, &p->device->id, BUILD_OPTIONS, NULL, NULL));
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

rl_code rl_program_kernel(rl_program *p, const char *entry, cl_kernel *out, rl_error *err)
{
    for (size_t i = 0; i < p->n_kernels; i++) {
        if (!strcmp(p->kernels[i].entry, entry)) {
            *out = p->kernels[i].kernel;
            return RL_OK;
        }
    }
    cl_int status = CL_OUT_OF_RESOURCES;
    *out = NULL;
    if (p->n_kernels < RL_MOST_KERNELS && !rl_cl_injected())
        *out = clCreateKernel(p->program, entry, &status);
    if (!*out)
        return rl_fail(err, RL_E_BUILD, RL_NOWHERE, "OpenCL program '%s': kernel '%s': %s (%d)", p->name,
                       entry, rl_cl_text(status), status);
    snprintf(p->kernels[p->n_kernels].entry, sizeof p->kernels[0].entry, "%s", entry);
    p->kernels[p->n_kernels++].kernel = *out;
    return RL_OK;
}

rl_code rl_program_check(const rl_program *p, const char *entry, const char *what, rl_where where,
                         rl_error *err)
{
    char list[4096] = "";
    const char *names[RL_MOST_KERNELS];
    size_t n = 0;
    cl_int status = RL_CL(clGetProgramInfo(p->program, CL_PROGRAM_KERNEL_NAMES, sizeof list - 1, list, NULL));
    if (status)
        return rl_fail(err, RL_E_DEVICE, RL_NOWHERE, "OpenCL program '%s': its kernels: %s (%d)", p->name,
                       rl_cl_text(status), status);
    for (char *at = list, *next; at && n < RL_MOST_KERNELS; at = next) {
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
