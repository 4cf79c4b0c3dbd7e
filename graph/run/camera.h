/* From what a capture says about its camera to the camera_t of the kernels. */
#ifndef RL_RUN_CAMERA_H
#define RL_RUN_CAMERA_H

#include <stdbool.h>
#include <stddef.h>

#include "graph/base/error.h"
#include "kernels/shared.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct rl_camera_info {
    double view[12];         /* world (metres) to view space, 3 rows of 4, column vectors; looks down -z */
    double fov_x;            /* radians, across the display window; 0: take screen_width */
    double screen_width;     /* width of the screen window at distance 1 */
    double screen_center[2]; /* lens shift: the display window's centre in the screen window, x right, y up */
    double pixel_aspect;     /* width / height of a pixel */
    double jitter[2];        /* pixels, x right, y down */
    int display[4];          /* display window: x, y, width, height */
} rl_camera_info;

/* RL_E_DATA when the matrix has no inverse or a number is not finite or out of range (fov in (0, pi)). */
rl_code rl_camera_make(const rl_camera_info *info, camera_t *out, rl_error *err);

/* True when b is so far from a that reprojection makes no sense: the view direction turned by more than 30
 * degrees, the camera moved by more than `reach` metres, or the focal length changed by more than a half. */
bool rl_camera_jumped(const camera_t *a, const camera_t *b, double reach);

/* Planar depth in metres, 0 where empty, of the display pixels from (x, y) on. */
typedef struct rl_depth_view {
    const float *pixels;
    size_t stride; /* floats */
    int x, y, width, height;
} rl_depth_view;

/* Of what `now` sees, the share that lay in front of `before` and inside of the same window: of 16 x 16
 * samples of the depth; hiding is not looked at. 1 when all is empty. */
double rl_camera_share_seen(const camera_t *now, const camera_t *before, const rl_depth_view *depth);

#ifdef __cplusplus
}
#endif
#endif
