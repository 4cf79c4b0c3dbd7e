/* What plan.c and plan_memory.c share; nobody else includes this. */
#ifndef RL_MODEL_PLAN_BUILD_H
#define RL_MODEL_PLAN_BUILD_H

#include "graph/model/plan.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { RL_LAYOUTS = 2 };

/* What live nodes and outputs want of an image, and the buffers (or -1) that give it. */
typedef struct rl_image_plan {
    bool live;              /* somebody makes or wants it */
    bool read[RL_LAYOUTS];  /* by a READ port with that layout */
    bool past[RL_LAYOUTS];  /* by a HISTORY port */
    bool output;            /* by the writer, which reads linear */
    int reader[RL_LAYOUTS]; /* place in the order of the first node that reads it so */
    rl_layout made;         /* the layout that the producer or the source writes */
    int now[RL_LAYOUTS];    /* this frame's */
    int before[RL_LAYOUTS]; /* the pair that holds its past; the same as now[] where that is the pair */
    int sink;               /* what the writer reads */
} rl_image_plan;

typedef struct rl_planner {
    rl_arena *arena;
    rl_error *err;
    const rl_graph *graph;
    int *order; /* [n_live]: nodes as they run */
    int *place; /* a node of the graph: its index in order, or -1: culled */
    size_t n_live;
    rl_image_plan *images;
    rl_buffer *buffers;
    size_t n_buffers;
    rl_plan_step *steps;
    size_t n_steps;
    rl_plan_node *nodes; /* [n_live] */
    int *slot_planes;
    size_t n_slots;
} rl_planner;

/* From the steps: when each buffer holds something. Then slots for the TRANSIENT ones. */
rl_code rl_plan_memory(rl_planner *p);

#ifdef __cplusplus
}
#endif
#endif
