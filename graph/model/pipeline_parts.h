/* The parts of rl_pipeline_parse that live in files of their own. Not for others. */
#ifndef RL_MODEL_PIPELINE_PARTS_H
#define RL_MODEL_PIPELINE_PARTS_H

#include "graph/model/params.h"
#include "graph/model/pipeline.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Names become parts of dotted paths and of image names: letters, digits, '_' and '-', a letter first. `what`
 * is "pass", "output", … for the error. */
rl_code rl_name_check(const char *name, const char *what, rl_where where, rl_error *err);

/* The value of a key that must be there: "<what> '<name>' needs '<key>' (<remedy>)" at `where` when it is
 * not. */
rl_code rl_value_need(const rl_value *map, const char *key, const char *what, const char *name,
                      const char *remedy, rl_where where, const rl_value **out, rl_error *err);

/* pipeline_outputs.c: the map `outputs` (may be NULL). */
rl_code rl_outputs_read(rl_arena *arena, const rl_value *map, const rl_output **out, size_t *n,
                        rl_error *err);
/* output_path.c: the pattern as a file's name for this frame; capture and variant may be NULL. */
rl_code rl_pattern_expand(rl_arena *arena, const char *pattern, rl_where where, const char *capture,
                          long long frame, const char *variant, const char **out, rl_error *err);

/* user_kernel.c: the keys of a `pass: kernel` node that are not parameters. */
extern const char *const rl_user_kernel_keys[];
extern const size_t rl_user_kernel_n_keys;
/* The descriptor that such a node declares, its program's text included; in the arena. */
rl_code rl_user_kernel_read(rl_arena *arena, const rl_entry *node, const rl_pass **out, rl_error *err);

#ifdef __cplusplus
}
#endif
#endif
