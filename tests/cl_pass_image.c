/* See cl_pass_image.h. */
#include "tests/cl_pass_image.h"

#include <math.h>
#include <string.h>

#include "graph/base/alloc.h"

void cl_frame(frame_t *f, int x, int y, int width, int height, float focal)
{
    memset(f, 0, sizeof *f);
    f->origin[0] = x & ~63;
    f->origin[1] = y & ~3;
    f->valid[0] = x - f->origin[0];
    f->valid[1] = y - f->origin[1];
    f->valid[2] = f->valid[0] + width;
    f->valid[3] = f->valid[1] + height;
    f->columns = (f->valid[2] + 63) & ~63;
    f->rows = (f->valid[3] + 3) & ~3;
    f->stride = f->columns;
    f->plane = f->stride * f->rows;
    f->stride4 = f->columns / 4 + 2 * RL_MARGIN4;
    f->plane4 = f->stride4 * (f->rows / 4) * 16;
    f->number = 1;
    for (int i = 0; i < 3; i++)
        f->camera.to_view[5 * i] = f->camera.to_world[5 * i] = 1;
    f->camera.focal[0] = f->camera.focal[1] = focal;
    f->camera.centre[0] = (float)x + 0.5f * (float)width;
    f->camera.centre[1] = (float)y + 0.5f * (float)height;
}

/* ---- images in both layouts ---- */

static int planes_of(rl_format format)
{
    return format == RL_RGB || format == RL_NORMAL ? 3 : format == RL_VEC2 ? 2 : 1;
}

static size_t place(const frame_t *f, rl_layout layout, int plane, int x, int y)
{
    if (layout == RL_LINEAR)
        return (size_t)(RL_GUARD + plane * f->plane + y * f->stride + x);
    int s = (y & 3) * 4 + (x & 3);
    return (size_t)(plane * f->plane4 + (s * (f->rows >> 2) + (y >> 2)) * f->stride4 + RL_MARGIN4 + (x >> 2));
}

size_t cl_floats_of(const frame_t *f, const rl_port *port)
{
    int n = planes_of(port->format);
    if (port->format == RL_SUMS)
        return RL_SUM_FLOATS + 2 * RL_GUARD;
    return (size_t)(port->layout == RL_LINEAR ? n * f->plane + 2 * RL_GUARD : n * f->plane4);
}

void cl_move_image(const frame_t *f, const rl_port *port, float *device, const void *from, float *to)
{
    if (port->format == RL_SUMS) {
        memcpy(to, device + RL_GUARD, RL_SUM_FLOATS * 4);
        return;
    }
    for (int p = 0; p < planes_of(port->format); p++)
        for (int y = 0; y < f->rows; y++)
            for (int x = 0; x < f->columns; x++) {
                size_t host = ((size_t)p * (size_t)f->rows + (size_t)y) * (size_t)f->columns + (size_t)x;
                size_t at = place(f, port->layout, p, x, y);
                if (from)
                    memcpy(&device[at], (const float *)from + host, 4);
                else
                    to[host] = device[at];
            }
}

static bool is_fed(const rl_port *port)
{
    return port->role == RL_READ || port->role == RL_HISTORY;
}

const cl_image *cl_image_of(const cl_job *job, const rl_port *port)
{
    for (size_t i = 0; i < job->n_images; i++)
        if (!strcmp(job->images[i].port, port->name) && is_fed(port) == !job->images[i].write)
            return &job->images[i];
    return NULL;
}

/* Whether the port is an argument of the kernels: what is only for sums is one when somebody wants them. */
bool cl_has_port(const cl_job *job, const rl_port *port)
{
    const char *name = port->role == RL_REDUCTION ? port->name : port->with;
    for (size_t i = 0; name && i < job->n_images; i++)
        if (!strcmp(job->images[i].port, name) && job->images[i].write)
            return true;
    return !name;
}

/* Whatever a kernel may not rely on is NaN: margins, guards and scratch. */
float *cl_make_plane(const cl_job *job, const rl_port *port)
{
    const cl_image *image = cl_image_of(job, port);
    if (port->role == RL_READ && !(image && image->read))
        return NULL;
    size_t n = cl_floats_of(job->frame, port);
    float *data = rl_aligned(n * 4);
    if (!data)
        return NULL;
    for (size_t i = 0; i < n; i++)
        data[i] = NAN;
    if (port->format == RL_ID)
        memset(data, 0, n * 4);
    if (is_fed(port) && image && image->read)
        cl_move_image(job->frame, port, data, image->read, NULL);
    return data;
}
