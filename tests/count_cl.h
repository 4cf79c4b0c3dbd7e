/* How many objects of OpenCL there are: a leak check sees the driver's memory only, which has leaks of its
 * own. A program that is linked with count_cl.c has these functions between itself and OpenCL. */
#ifndef RL_TESTS_COUNT_CL_H
#define RL_TESTS_COUNT_CL_H

typedef enum count_cl_kind {
    COUNT_CL_CONTEXT,
    COUNT_CL_QUEUE,
    COUNT_CL_MEMORY,
    COUNT_CL_PROGRAM,
    COUNT_CL_KERNEL,
    COUNT_CL_EVENT,
    COUNT_CL_KINDS
} count_cl_kind;

/* References that were made and not released. */
long count_cl_live(count_cl_kind kind);
/* … and that were ever made. */
long count_cl_made(count_cl_kind kind);
const char *count_cl_name(count_cl_kind kind);

#endif
