/* Which stencil ids a material covers: a part of rl_materials_resolve, not for others. */
#ifndef RL_MODEL_MATERIALS_IDS_H
#define RL_MODEL_MATERIALS_IDS_H

#include "graph/model/materials.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct rl_id_use {
    int64_t id;
    unsigned dense;
    rl_where where;
} rl_id_use;

/* All in the arena. */
typedef struct rl_id_list {
    rl_arena *arena;
    const rl_log *log;
    const rl_stencil_name *names;
    size_t n_names;
    rl_id_use *uses;
    size_t n, room;
} rl_id_list;

/* Reads the cover of the material `entry`, whose dense index is given. A material without `stencil` covers
 * the id of its name; where the capture names ids, but none like this one, the material is not in this
 * capture: a warning. */
rl_code rl_ids_read(rl_id_list *list, rl_materials *m, unsigned dense, const rl_entry *entry, rl_error *err);
/* Sorts what was read into m->ids; two materials with one id are an error. */
rl_code rl_ids_finish(rl_id_list *list, rl_materials *m, rl_error *err);

#ifdef __cplusplus
}
#endif
#endif
