/* Do a capture's normals, depth and camera agree? Renderers disagree about spaces, signs and the kind of
 * depth, and what is read by a wrong convention still makes a picture, only a wrong one. So the normals of
 * smooth places are held against those that the depth has there, by the stated conventions and by others. */
#ifndef RL_RUN_NORMAL_CHECK_H
#define RL_RUN_NORMAL_CHECK_H

#include <stdbool.h>
#include <stddef.h>

#include "graph/base/text.h"
#include "graph/model/manifest.h"
#include "kernels/shared.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A frame as it is after conversion. */
typedef struct rl_normal_view {
    const float *depth;     /* planar metres, 0 where empty; pixel (0, 0) of the data window */
    const float *normal[3]; /* world space */
    size_t stride;          /* floats from row to row */
    int width, height;
    int x, y; /* display-window pixel of the first */
    const camera_t *camera;
} rl_normal_view;

typedef struct rl_normal_check {
    size_t samples;   /* smooth places that were looked at, up to 64 x 64; below 64 nothing else is said */
    double cosine;    /* mean cosine between the normals and the depth's, by the stated conventions */
    double best;      /* the same by the best of the others */
    bool other_space; /* the best one: the other of world and camera space, */
    bool other_way;   /* the other camera.forward, */
    int axes[3];      /* and these of the file's axes as x, y, z: 1, 2, 3 or negative */
    double radial;    /* the mean cosine if planar depth were radial, or radial depth planar */
    bool positive;    /* no normal has a negative component: 0..1 read as -1..1? */
} rl_normal_check;

/* `normal` and `depth`: how the layers were read. */
void rl_normal_check_run(const rl_normal_view *view, const rl_layer *normal, const rl_layer *depth,
                         bool forward_z, rl_normal_check *out);

/* What to write in the manifest, when the check says that something is wrong; else nothing is added and the
 * result is false. */
bool rl_normal_check_advice(const rl_normal_check *check, const rl_layer *normal, const rl_layer *depth,
                            bool forward_z, rl_str *out);

#ifdef __cplusplus
}
#endif
#endif
