/* Parameters that are sets of materials (RL_MATERIALS). A pipeline knows their names; which materials those
 * are depends on the capture's stencil names, so the sets are filled for each capture. */
#ifndef RL_MODEL_MATERIALS_SETS_H
#define RL_MODEL_MATERIALS_SETS_H

#include "graph/model/materials.h"
#include "graph/model/pipeline.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A copy of the nodes (in the arena) whose sets hold the materials `m` that their maps name: by the name of a
 * material, by a stencil name or id that one covers (then all of that material), or an error with the nearest
 * name. What only the material `default` covers has no material of its own and is an error, too. */
rl_code rl_material_sets_fill(rl_arena *arena, const rl_node *nodes, size_t n_nodes, const rl_materials *m,
                              const rl_stencil_name *names, size_t n_names, const rl_node **out,
                              rl_error *err);

#ifdef __cplusplus
}
#endif
#endif
