/* Random graphs for property tests: passes with random ports, layouts, steps, histories; outputs with
 * conversions. */
#ifndef RL_TESTS_RANDOM_GRAPH_H
#define RL_TESTS_RANDOM_GRAPH_H

#include "graph/model/graph.h"

/* The same seed gives the same graph. Lives in the arena; never NULL (asserts). */
const rl_graph *random_graph(rl_arena *arena, unsigned long long seed);

#endif
