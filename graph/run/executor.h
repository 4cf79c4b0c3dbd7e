/* Runs a plan on a device, frame by frame. One thread at a time. */
#ifndef RL_RUN_EXECUTOR_H
#define RL_RUN_EXECUTOR_H

#include "graph/base/log.h"
#include "graph/model/materials.h"
#include "graph/model/plan.h"
#include "graph/run/device.h"
#include "kernels/shared.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct rl_executor rl_executor;

/* The buffers that belong to one frame in flight: what its source fills and what its writers read. */
typedef struct rl_frame_buffers rl_frame_buffers;

/* What programs of passes with .lights or .light_tables must be able to do (RL_LIGHTS_…, kernel_source.h),
 * and the large tables of those with .light_tables: kernels/shared.h describes them. NULL and 0: none. */
typedef struct rl_light_setup {
    unsigned kinds;
    const float *profiles, *sky;
    size_t n_profiles, n_sky; /* floats */
} rl_light_setup;

/* What the kernels of a node read besides images and parameters: those of node.scene. One, or one a variant
 * of a merged graph. */
typedef struct rl_scene {
    const rl_materials *materials;
    rl_light_setup lights; /* the tables must live as long as the executor */
} rl_scene;

/* Builds the programs of all live nodes, on up to `threads` threads; nodes whose texts are equal share one.
 * Keeps pointers to all arguments but the array of scenes. */
rl_code rl_executor_new(rl_device *device, const rl_plan *plan, const rl_scene *scenes, size_t n_scenes,
                        int threads, const rl_log *log, rl_executor **out, rl_error *err);
void rl_executor_free(rl_executor **executor);

/* Allocates slots and history for frames of this size (nothing happens when it is the size already); history
 * is then empty. Frame buffers of another size must have been freed. */
rl_code rl_executor_resize(rl_executor *executor, const rl_geometry *geometry, rl_error *err);
const rl_geometry *rl_executor_geometry(const rl_executor *executor);

/* May be called while another thread runs a frame. */
rl_code rl_frame_buffers_new(rl_executor *executor, const rl_geometry *geometry, rl_frame_buffers **out,
                             rl_error *err);
void rl_frame_buffers_free(rl_frame_buffers **buffers);
/* The geometry that they were made for. */
const rl_geometry *rl_frame_buffers_geometry(const rl_frame_buffers *buffers);
/* The memory of a SOURCE or SINK buffer of the plan; NULL for others. */
rl_memory *rl_frame_buffers_memory(const rl_frame_buffers *buffers, int buffer);

/* What changes from frame to frame, besides pixels. The executor fills sizes, history and the previous
 * camera. */
typedef struct rl_scene_values {
    const light_t *lights;
    int n_lights;             /* at most what it was for the first frame, or any number for it */
    const ambient_t *ambient; /* NULL = none */
} rl_scene_values;

typedef struct rl_frame_values {
    int number;
    camera_t camera;
    const rl_scene_values *scenes; /* as many as the executor has */
} rl_frame_values;

/* Runs all steps and waits for them; then history swaps. On an error history is empty afterwards. `spans` may
 * be NULL, else gets plan->n_steps entries. */
rl_code rl_executor_run(rl_executor *executor, rl_frame_buffers *buffers, const rl_frame_values *values,
                        rl_span *spans, rl_error *err);

/* Forgets history: a cut. */
void rl_executor_cut(rl_executor *executor);

/* ---- history as bytes: a checkpoint (executor_history.c) ---- */

/* What the next frame would see of the past: the valid half of every pair, one after the other in the order
 * of the plan's buffers. 0 when the plan keeps no history or no frame has run. */
size_t rl_executor_history_bytes(const rl_executor *executor);
bool rl_executor_has_history(const rl_executor *executor);
/* Copies it out (rl_executor_history_bytes bytes), with the camera of the frame that it is of. RL_E_INTERNAL
 * when there is none. */
rl_code rl_executor_history_save(rl_executor *executor, void *out, camera_t *previous, rl_error *err);
/* Puts it back, bit for bit, for frames of that size: the next run goes on as if the frame had just run here.
 * RL_E_DATA when `bytes` is not what such history takes. */
rl_code rl_executor_history_load(rl_executor *executor, const rl_geometry *geometry, const void *in,
                                 size_t bytes, const camera_t *previous, rl_error *err);

#ifdef __cplusplus
}
#endif
#endif
