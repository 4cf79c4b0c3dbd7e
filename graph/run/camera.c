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
