/* For tests: builds the program of one pass as the engine would (generated part, shared.h, common.cl, its
 * text) and runs it over planes, with plain OpenCL calls. Not thread-safe. The working folder is the source
 * tree. */
#ifndef CL_HARNESS_H
#define CL_HARNESS_H

#include <stdbool.h>
#include <stddef.h>

#include "graph/model/pass.h"
#include "kernels/shared.h"

typedef struct cl_harness cl_harness;

/* The first device of the first platform; NULL when there is none. */
cl_harness *cl_harness_new(void);
void cl_harness_free(cl_harness **h);
/* What went wrong last: an OpenCL call with its code, or the compiler's log. */
const char *cl_harness_error(const cl_harness *h);

typedef struct cl_kernel_of_pass cl_kernel_of_pass;

/* `generated`: text behind the struct of parameters, for what a test defines itself; NULL for
 * "typedef struct material_t { int none; } material_t;" alone. Text of a pass with .kernel is read from
 * kernels/. */
cl_kernel_of_pass *cl_harness_build(cl_harness *h, const rl_pass *pass, const char *generated, size_t step);
void cl_harness_release(cl_kernel_of_pass **k);

/* Host memory that the device uses in place, aligned to RL_ALIGN. */
typedef struct cl_buffer {
    void *data; /* NULL: the argument is a null pointer */
    size_t bytes;
} cl_buffer;

/* A frame of columns x rows pixels, linear, all of it valid; stride = columns, plane = columns * rows +
 * guards. */
frame_t cl_harness_frame(int columns, int rows);

/* Runs with the arguments in order: ports, params, frame, material table, tables. Items: global[0] x
 * global[1]. *ms is the time of the kernel on the device; may be NULL. */
bool cl_harness_run(cl_kernel_of_pass *k, const cl_buffer *args, size_t n, const size_t global[2],
                    double *ms);

#endif
