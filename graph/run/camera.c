#include "graph/run/camera.h"

#include <math.h>
#include <string.h>

/* The inverse of the affine 3x4 matrix a; false when it has none. */
static bool invert(const double a[12], double out[12])
{
    double c[9] = {a[5] * a[10] - a[6] * a[9], a[2] * a[9] - a[1] * a[10], a[1] * a[6] - a[2] * a[5],
                   a[6] * a[8] - a[4] * a[10], a[0] * a[10] - a[2] * a[8], a[2] * a[4] - a[0] * a[6],
                   a[4] * a[9] - a[5] * a[8],  a[1] * a[8] - a[0] * a[9],  a[0] * a[5] - a[1] * a[4]};
    double det = a[0] * c[0] + a[1] * c[3] + a[2] * c[6];
    if (!(fabs(det) > 1e-12))
        return false;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++)
            out[4 * i + j] = c[3 * i + j] / det;
        out[4 * i + 3] = -(out[4 * i] * a[3] + out[4 * i + 1] * a[7] + out[4 * i + 2] * a[11]);
    }
    return true;
}

rl_code rl_camera_make(const rl_camera_info *info, camera_t *out, rl_error *err)
{
    double world[12];
    const double *view = info->view;
    memset(out, 0, sizeof *out);
    for (int i = 0; i < 12; i++)
        if (!isfinite(view[i]))
            return rl_fail(err, RL_E_DATA, RL_NOWHERE,
                           "the camera's matrix holds a number that is not finite");
    if (!invert(view, world))
        return rl_fail(err, RL_E_DATA, RL_NOWHERE, "the camera's matrix has no inverse");
    double width = info->fov_x != 0 ? 2 * tan(info->fov_x / 2) : info->screen_width;
    if (!(width > 1e-6 && width < 1e6) || (info->fov_x != 0 && !(info->fov_x > 0 && info->fov_x < 3.14159)))
        return rl_fail(err, RL_E_DATA, RL_NOWHERE,
                       "the camera's field of view is out of range (fov_x %g radians, screen window %g wide)",
                       info->fov_x, info->screen_width);
    double aspect = info->pixel_aspect > 0 ? info->pixel_aspect : 1;
    double fx = info->display[2] / width, fy = fx * aspect;
    for (int i = 0; i < 12; i++) {
        out->to_view[i] = (float)view[i];
        out->to_world[i] = (float)world[i];
    }
    out->focal[0] = (float)fx;
    out->focal[1] = (float)fy;
    /* The shift is a part of the header's own screen window, also where the manifest gives the field of view.
     */
    double window = info->screen_width > 0 ? info->screen_width : width;
    double shift_x = info->screen_center[0] * info->display[2] / window;
    double shift_y = info->screen_center[1] * info->display[2] / window * aspect;
    out->centre[0] = (float)(info->display[0] + info->display[2] / 2.0 - shift_x);
    out->centre[1] = (float)(info->display[1] + info->display[3] / 2.0 + shift_y);
    out->jitter[0] = (float)info->jitter[0];
    out->jitter[1] = (float)info->jitter[1];
    return RL_OK;
}

bool rl_camera_jumped(const camera_t *a, const camera_t *b, double reach)
{
    double dot = 0, moved = 0;
    for (int i = 0; i < 3; i++) {
        dot += (double)a->to_world[4 * i + 2] * (double)b->to_world[4 * i + 2];
        double d = (double)a->to_world[4 * i + 3] - (double)b->to_world[4 * i + 3];
        moved += d * d;
    }
    double zoom = (double)b->focal[0] / (double)a->focal[0];
    return dot < 0.8660254 || sqrt(moved) > reach || zoom > 1.5 || zoom < 1 / 1.5;
}

static double row(const float *m, int i, const double *p)
{
    return (double)m[4 * i] * p[0] + (double)m[4 * i + 1] * p[1] + (double)m[4 * i + 2] * p[2] +
           (double)m[4 * i + 3];
}

/* Whether the point at depth z under display pixel (x, y) lay in the window before. */
static bool was_seen(const camera_t *now, const camera_t *before, const rl_depth_view *d, int x, int y,
                     double z)
{
    double view[3] = {(x + 0.5 - (double)now->centre[0]) / (double)now->focal[0] * z,
                      -(y + 0.5 - (double)now->centre[1]) / (double)now->focal[1] * z, -z};
    double world[3], p[3];
    for (int i = 0; i < 3; i++)
        world[i] = row(now->to_world, i, view);
    for (int i = 0; i < 3; i++)
        p[i] = row(before->to_view, i, world);
    double px = (double)before->centre[0] + (double)before->focal[0] * p[0] / -p[2];
    double py = (double)before->centre[1] - (double)before->focal[1] * p[1] / -p[2];
    return p[2] < 0 && px >= d->x && py >= d->y && px < d->x + d->width && py < d->y + d->height;
}

double rl_camera_share_seen(const camera_t *now, const camera_t *before, const rl_depth_view *d)
{
    enum { SIDE = 16 };
    int n = 0, seen = 0;
    for (int i = 0; i < SIDE * SIDE; i++) {
        int x = (int)((2LL * (i % SIDE) + 1) * d->width / (2 * SIDE));
        int y = (int)((2LL * (i / SIDE) + 1) * d->height / (2 * SIDE));
        double z = (double)d->pixels[(size_t)y * d->stride + (size_t)x];
        if (!(z > 0))
            continue;
        n++;
        seen += was_seen(now, before, d, d->x + x, d->y + y, z);
    }
    return n ? (double)seen / n : 1;
}
