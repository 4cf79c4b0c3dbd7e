/* What executor.c and executor_history.c share. */
#ifndef RL_RUN_EXECUTOR_PARTS_H
#define RL_RUN_EXECUTOR_PARTS_H

#include "graph/run/executor.h"

/* What a live node needs besides images. */
typedef struct rl_node_state {
    rl_program *program;
    rl_memory *params, *tables; /* NULL when the pass has none */
} rl_node_state;

/* A scene on the device. */
typedef struct rl_scene_state {
    rl_scene scene;
    rl_memory *materials, *frame, *lights, *ambient;
    rl_memory *profiles, *sky; /* NULL: none */
} rl_scene_state;

struct rl_executor {
    rl_arena arena;
    rl_device *device;
    const rl_plan *plan;
    const rl_log *log;
    rl_node_state *nodes; /* [graph->n_nodes] */
    rl_program *convert;
    rl_scene_state *scenes; /* [n_scenes] */
    size_t n_scenes;
    rl_geometry geometry; /* columns 0: no size yet */
    rl_memory **slots;    /* [plan->n_slots] */
    rl_memory **history;  /* [plan->n_buffers][2]; NULL where the buffer is not HISTORY */
    int newest;           /* which half of the pairs this frame writes */
    bool has_history;
    camera_t previous;
};

/* executor_programs.c: builds the programs of all live nodes and of the conversions. */
rl_code rl_executor_build(rl_executor *executor, int threads, rl_error *err);

#endif
