/* Profiles, shading and materials resolve to one table with an entry for each dense stencil index: entry 0 is
 * "no material" (empty pixels), entries 1… are the materials of the pipeline in the order of the file. The
 * rows are the union of what the registered passes declare; equal names must be equal rows (checked by a
 * test). */
#ifndef RL_MODEL_MATERIALS_H
#define RL_MODEL_MATERIALS_H

#include "graph/base/log.h"
#include "graph/model/params.h"
#include "graph/model/pass.h"
#include "graph/model/registry.h"
#include "graph/model/value.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct rl_stencil_name {
    int64_t id; /* any 32-bit integer, signed or unsigned */
    const char *name;
} rl_stencil_name;

typedef struct rl_stencil_id {
    int64_t id;
    unsigned dense; /* 1 … count-1 */
} rl_stencil_id;

/* A field of material_t: `<group>_<name of the row>`. */
typedef struct rl_material_row {
    const char *group; /* "profile", "material", "shading" */
    const rl_param *param;
    size_t offset; /* bytes from the start of an entry, whose first word is has_profile */
} rl_material_row;

/* Constant after rl_materials_resolve; lives in the arena that was given. */
typedef struct rl_materials {
    size_t count;                /* entries, the empty one included */
    const char **names;          /* [count]; names[0] = "" */
    const char **profiles;       /* [count]; NULL = no profile; an inline profile has its material's name */
    const rl_material_row *rows; /* in the order of the fields; rl_material_get looks here */
    size_t n_rows;
    size_t entry_bytes;       /* of material_t on the device */
    const void *data;         /* count * entry_bytes; entry 0 has no profile and holds defaults */
    const rl_stencil_id *ids; /* sorted by id */
    size_t n_ids;
    unsigned other; /* dense index of the material named `default`, 0 = ids without a material are an error */
} rl_materials;

/* The fields of material_t: the rows of the passes in the order of the registry, each name of a group once,
 * and the bytes of an entry. */
rl_code rl_material_rows(rl_arena *arena, const rl_registry *registry, const rl_material_row **rows,
                         size_t *n, size_t *entry_bytes, rl_error *err);

/* `profiles`, `shading`, `materials` are the pipeline's maps (may be NULL); `used` are the passes of the
 * graph: their required profile keys must be there for every profile that a material uses. A material's
 * `stencil` is a number, a name of stencil_names, or a list of them; without it, the ids that have the
 * material's name. Two materials with one id are an error. A `profile` is the name of one, or one written in
 * place. A key that only unused passes read is accepted; one that no registered pass reads is an error with
 * the nearest name. A material's key is looked up among material rows, then among shading rows (by type where
 * both have it: `specular: 0.028` is the material's, `specular: none` the shading's). Names and places in the
 * result point into the trees, which must outlive it. */
rl_code rl_materials_resolve(rl_arena *arena, const rl_value *profiles, const rl_value *shading,
                             const rl_value *materials, const rl_stencil_name *names, size_t n_names,
                             const rl_pass *const *used, size_t n_used, const rl_log *log,
                             const rl_materials **out, rl_error *err);
/* The same with the rows of other passes than the build's. */
rl_code rl_materials_resolve_from(const rl_registry *registry, rl_arena *arena, const rl_value *profiles,
                                  const rl_value *shading, const rl_value *materials,
                                  const rl_stencil_name *names, size_t n_names, const rl_pass *const *used,
                                  size_t n_used, const rl_log *log, const rl_materials **out, rl_error *err);

/* The OpenCL text of material_t: "typedef struct material_t { int has_profile; float profile_…; }
 * material_t;". The same for every pipeline of this build. */
void rl_materials_struct_text(rl_str *s);
void rl_materials_struct_text_from(const rl_registry *registry, rl_str *s);

#ifdef __cplusplus
}
#endif
#endif
