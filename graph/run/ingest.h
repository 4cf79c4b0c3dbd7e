/* From what a file holds to what relit works with (DESIGN 2), on rows that have just been decoded. All
 * functions change planes in place, are pure per pixel (so the order of rows does not matter) and may run in
 * parallel on different rows.
 *
 * A plane is addressed by its pixel (0, 0) of the data window and a stride in elements; rows y0…y1-1 are
 * converted. */
#ifndef RL_RUN_INGEST_H
#define RL_RUN_INGEST_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "graph/base/error.h"
#include "graph/model/manifest.h"
#include "graph/model/materials.h"
#include "kernels/shared.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct rl_rows {
    int width, y0, y1;
    size_t stride;
} rl_rows;

/* x·scale + offset, then clamped to low…high. Returns how many were clamped. */
uint64_t rl_ingest_scalar(float *plane, rl_rows rows, float scale, float offset, float low, float high);

typedef struct rl_ingest_depth {
    const rl_layer *layer;
    const camera_t *camera; /* RL_DEPTH_RADIAL: focal, centre, jitter */
    int x, y;               /* RL_DEPTH_RADIAL: display-window pixel of the data window's first */
} rl_ingest_depth;

/* Planar metres; 0 where the pixel is empty (>= empty, infinite, <= 0; DEVICE: at or behind the far plane).
 */
void rl_ingest_depth_rows(float *plane, rl_rows rows, const rl_ingest_depth *how);

/* World space, unit length; a normal of length 0 stays 0. `rotate`: 9 numbers, rows listed, applied to the
 * decoded vector, or NULL. OCTAHEDRAL reads planes 0 and 1 (0…1 when `unsigned_octahedral`, else -1…1) and
 * writes all three. */
typedef struct rl_ingest_normal {
    rl_encoding encoding;
    const float *rotate;
} rl_ingest_normal;

/* The rotation of a layer's normals to world space: its axes and, in camera space, the camera's; `m` holds
 * it. NULL when there is nothing to do. */
const float *rl_ingest_normal_matrix(const rl_layer *layer, const camera_t *camera, bool forward_z,
                                     float m[9]);

void rl_ingest_normal_rows(float *const planes[3], rl_rows rows, const rl_ingest_normal *how);

/* Vectors to the frame before, in pixels, x right, y down. `width` and `height`: of the display window. */
void rl_ingest_motion_rows(float *const planes[2], rl_rows rows, const rl_layer *layer, int width,
                           int height);

/* Ids that no material covers: up to 8 of them, the smallest, with their pixel counts. Zeroed by the caller.
 */
enum { RL_UNKNOWN_IDS = 8 };
typedef struct rl_unknown_ids {
    size_t n;
    struct {
        uint32_t id;
        uint64_t pixels;
    } ids[RL_UNKNOWN_IDS];
    uint64_t pixels; /* in all */
} rl_unknown_ids;

/* Stencil ids of the file to dense indices; 0 where depth is 0. */
void rl_ingest_stencil_rows(uint32_t *plane, const float *depth, rl_rows rows, const rl_materials *materials,
                            rl_unknown_ids *unknown);
/* Adds b to a. */
void rl_unknown_ids_add(rl_unknown_ids *a, const rl_unknown_ids *b);

#ifdef __cplusplus
}
#endif
#endif
