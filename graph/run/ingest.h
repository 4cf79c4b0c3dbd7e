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

typedef enum rl_depth_kind { RL_DEPTH_PLANAR, RL_DEPTH_RADIAL, RL_DEPTH_DEVICE } rl_depth_kind;

typedef struct rl_ingest_depth {
    rl_depth_kind kind;
    double unit;            /* metres per unit of the file (planar, radial, near, far) */
    double empty;           /* in the file's units: values from here on are empty */
    double near_, far_;     /* DEVICE, in the file's units; far_ may be infinite */
    bool reversed;          /* DEVICE: 1 at the near plane */
    const camera_t *camera; /* RADIAL: focal, centre, jitter */
    int x, y;               /* RADIAL: display-window pixel of the data window's first */
} rl_ingest_depth;

/* Planar metres; 0 where the pixel is empty (>= empty, infinite, <= 0; DEVICE: at or behind the far plane).
 */
void rl_ingest_depth_rows(float *plane, rl_rows rows, const rl_ingest_depth *how);

typedef enum rl_normal_encoding {
    RL_NORMAL_SIGNED,
    RL_NORMAL_UNSIGNED,
    RL_NORMAL_OCTAHEDRAL
} rl_normal_encoding;

/* World space, unit length; a normal of length 0 stays 0. `rotate`: 9 numbers, rows listed, applied to the
 * decoded vector, or NULL. OCTAHEDRAL reads planes 0 and 1 (0…1 when `unsigned_octahedral`, else -1…1) and
 * writes all three. */
typedef struct rl_ingest_normal {
    rl_normal_encoding encoding;
    bool unsigned_octahedral;
    const float *rotate;
} rl_ingest_normal;

void rl_ingest_normal_rows(float *const planes[3], rl_rows rows, const rl_ingest_normal *how);

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
