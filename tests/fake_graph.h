/* The standard graph from passes that exist only as descriptors: light -> sss -> aa, and a spare branch. */
#ifndef RL_TESTS_FAKE_GRAPH_H
#define RL_TESTS_FAKE_GRAPH_H

#include "graph/model/graph.h"

/* Fields of an rl_port; more may follow. */
#define PORT(name_, role_, format_) .name = name_, .role = role_, .format = format_
#define INPUTS(...)                                                                                          \
    .inputs = (const rl_node_input[]){__VA_ARGS__},                                                          \
    .n_inputs = sizeof((const rl_node_input[]){__VA_ARGS__}) / sizeof(rl_node_input)

/* lighting: albedo depth -> diffuse (any layout) lit
 * sss: diffuse (phase4) lit depth (phase4), scratch temp (phase4), two steps -> color
 * taa: color depth, past of color and depth -> color
 * view: from -> to */
extern const rl_pass fake_lighting, fake_sss, fake_taa, fake_view;

/* light, sss, aa and `spare` (a view of aa.color that nobody wants). */
extern const rl_node fake_nodes[4];

/* Builds; fails the test when that fails. Layers: albedo, depth, normal, shadow (2 lights). */
const rl_graph *fake_graph(rl_arena *arena, const rl_node *nodes, size_t n_nodes, const rl_wanted *wanted,
                           size_t n_wanted);

#endif
