/* What graph.c, graph_bind.c and plan.c share; nobody else includes this. */
#ifndef RL_MODEL_GRAPH_BUILD_H
#define RL_MODEL_GRAPH_BUILD_H

#include "graph/base/text.h"
#include "graph/model/graph.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A graph while it is made. The arrays have room for everything that can be added. */
typedef struct rl_graph_builder {
    rl_arena *arena;
    rl_error *err;
    rl_image *images;
    size_t n_images;
    rl_graph_node *nodes;
    size_t n_nodes;
    int **bound; /* a node: nodes[i].images, while it may still be written */
} rl_graph_builder;

/* Connects the READ and HISTORY ports of a node whose WRITE ports have their images. */
rl_code rl_graph_bind(rl_graph_builder *b, size_t node, const rl_node_input *inputs, size_t n_inputs);

/* The image that a person named, or an error at `where` that tells what is nearest. `user` says who asks, for
 * the error: "output 'beauty'". */
rl_code rl_graph_resolve(rl_graph_builder *b, const char *name, rl_where where, const char *user, int *out);

/* The port can take the image, or an error that names both formats. */
rl_code rl_graph_check_format(rl_graph_builder *b, const char *user, const rl_port *port, int image,
                              rl_where where);

/* Planes of an image that a pass makes; RL_LIGHTS has no number of its own, and RL_SUMS no planes: 0. */
int rl_format_planes(rl_format format);

/* Depth-first from the roots (nodes; -1 is skipped): `order` (room for n_nodes) gets every node that they
 * need, each behind its producers, ties as ports and roots list them. When the walk meets a cycle, *cycle is
 * set and `order` holds its nodes in the direction of the data. Only memory can fail. */
rl_code rl_graph_walk(rl_arena *arena, const rl_image *images, const rl_graph_node *nodes, size_t n_nodes,
                      const int *roots, size_t n_roots, int *order, size_t *n_order, bool *cycle,
                      rl_error *err);

#ifdef __cplusplus
}
#endif
#endif
