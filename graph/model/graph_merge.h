/* Graphs of several variants as one: what they have in common is there once. */
#ifndef RL_MODEL_GRAPH_MERGE_H
#define RL_MODEL_GRAPH_MERGE_H

#include "graph/model/graph.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A variant's graph, and what its nodes read besides images and parameters. */
typedef struct rl_merge_input {
    const rl_graph *graph;
    const rl_materials *materials;
    uint64_t lights, ambient; /* hashes of all that kernels see of them */
} rl_merge_input;

typedef struct rl_content {
    uint64_t low, high;
} rl_content;

/* Constant once made. Node i of the merged graph: */
typedef struct rl_merged_from {
    rl_content content;
    const bool *used; /* [n]: variants whose outputs need it */
    size_t n_used;
} rl_merged_from;

typedef struct rl_merged {
    const rl_graph
        *graph; /* only nodes that some output needs. node.scene is the first variant that has it;
                   outputs are those of all variants, one variant after the other. Nodes and outputs
                   of later variants that differ are named "sss@2", by that variant (from 1). */
    const rl_merged_from *nodes;
    const size_t *first_output; /* [n]: of a variant */
} rl_merged;

/* All graphs must have the same layers in the same order (rl_graph_same_layers). Nodes are equal when passes,
 * parameters, host tables, what the pass declares to read of the materials, lights and ambient light, and the
 * contents of all inputs are; a pass whose program comes with the pipeline reads all of the materials if its
 * text has the word. Hashes are of 128 bits. Errors are those of the passes' tables, and memory. */
rl_code rl_graph_merge(rl_arena *arena, const rl_merge_input *inputs, size_t n, const rl_merged **out,
                       rl_error *err);

bool rl_graph_same_layers(const rl_graph *a, const rl_graph *b);

#ifdef __cplusplus
}
#endif
#endif
