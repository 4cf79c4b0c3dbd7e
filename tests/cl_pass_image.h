/* Images of cl_pass in the layouts of kernels/shared.h. Internal to tests/cl_pass*.c. */
#ifndef RL_TESTS_CL_PASS_IMAGE_H
#define RL_TESTS_CL_PASS_IMAGE_H

#include "tests/cl_pass.h"

/* Floats of a port's buffer, guards and margins included. */
size_t cl_floats_of(const frame_t *f, const rl_port *port);

/* Between the port's layout (`device`) and host planes: `from` to the device unless it is NULL, else back to
 * `to`. */
void cl_move_image(const frame_t *f, const rl_port *port, float *device, const void *from, float *to);

/* The job's image of a port, NULL when it has none. */
const cl_image *cl_image_of(const cl_job *job, const rl_port *port);

/* Whether the port is an argument of the kernels. */
bool cl_has_port(const cl_job *job, const rl_port *port);

/* A port's buffer, filled; NULL when memory is out or nothing feeds it. rl_free. */
float *cl_make_plane(const cl_job *job, const rl_port *port);

#endif
