/* What renderers write about their camera into an EXR's header. */
#ifndef RL_RUN_CAMERA_HEADER_H
#define RL_RUN_CAMERA_HEADER_H

#include <stdbool.h>

#include "graph/model/manifest.h"
#include "graph/run/camera.h"
#include "graph/run/exr.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The camera's place as worldToCamera has it: 16 numbers for row vectors, positions in the capture's unit.
 * Taken from worldToCamera (Arnold, RenderMan, Houdini, relit), V-Ray's cameraTransform, or Unreal's curPos
 * and curRot; of the latter two, whose axes are known, the matrix is made for the `forward_z` that the
 * manifest states. Returns the attribute's name, or NULL when the header has none of them. */
const char *rl_camera_header_matrix(const rl_exr *file, int part, bool forward_z, double out[16]);

/* The lens: a field of view, or the screen window at distance 1. */
typedef struct rl_camera_lens {
    const char *source; /* "camera:fovx", "cameraFov", "unreal/.../fov", "worldToNDC", "screenWindowWidth" */
    double fov_x;       /* radians, across the display window; 0: the window says it */
    double width;       /* of the screen window */
    double centre[2];   /* the display window's middle in the screen window, x right, y up */
} rl_camera_lens;

/* The first that the header has: camera:fovx (radians), worldToNDC beside worldToCamera (with the lens's
 * shift), V-Ray's cameraFov or Unreal's fov (degrees), else the screen window that every EXR has. */
void rl_camera_header_lens(const rl_exr *file, int part, bool forward_z, rl_camera_lens *out);

/* The camera of a frame: what the manifest states, and what it leaves to the header; jitter only if the
 * manifest or camera:jitter gives it (*has_jitter). The lens is what the header says, whether it is used or
 * not. */
rl_code rl_camera_read(const rl_manifest *manifest, int frame, const rl_exr *file, int part,
                       rl_camera_info *out, rl_camera_lens *lens, bool *has_jitter, rl_error *err);

#ifdef __cplusplus
}
#endif
#endif
