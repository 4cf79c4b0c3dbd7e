/* Variants of pipelines by varied values: `--vary PATH=V1,V2,…`. Several make a full grid; pipelines are its
 * first axis, the last --vary counts fastest. */
#ifndef RL_MODEL_VARY_H
#define RL_MODEL_VARY_H

#include "graph/base/log.h"
#include "graph/model/registry.h"
#include "graph/model/value.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Everything lives in the arena that it was made in. */
typedef struct rl_vary {
    const char *option; /* "--vary graph.sss.taps=8,16": what errors give as their place */
    const char *path;
    rl_value *const *values;  /* [n], n >= 1, all different; .where is in `option` */
    const char *const *texts; /* [n]: the same as YAML on one line */
    size_t n;
} rl_vary;

/* "PATH=V1,V2,…": what is behind '=' is the inside of a YAML list. An error's column counts in `text`. */
rl_code rl_vary_parse(rl_arena *arena, const char *text, rl_vary *out, rl_error *err);

enum { RL_MOST_VARIANTS = 256 };

typedef struct rl_grid {
    const char *const *pipelines; /* files: their stems are parts of names when there are several */
    size_t n_pipelines;           /* >= 1 */
    const rl_vary *varies;
    size_t n_varies;
    size_t n; /* variants; set by rl_grid_count */
} rl_grid;

/* Sets .n; RL_E_USAGE beyond RL_MOST_VARIANTS, and when a path is varied twice or inside of another. */
rl_code rl_grid_count(rl_grid *grid, rl_error *err);

/* The axes are the pipelines (0) and the --vary (1 …). */
size_t rl_grid_axes(const rl_grid *grid);
size_t rl_grid_choice(const rl_grid *grid, size_t variant, size_t axis);
/* The variant that is one step back on an axis; false: it is the first there. */
bool rl_grid_before(const rl_grid *grid, size_t variant, size_t axis, size_t *out);

/* Names for all variants, names[grid->n] in the arena: the pipeline's stem when there are several, then the
 * varied values, "post_21"; "separable_true" and "taps_21" where a value alone says nothing. Letters, digits,
 * '.', '-', '_' and bytes of UTF-8, no '.' first, unique also where case does not count, none of `taken`. */
rl_code rl_grid_names(rl_arena *arena, const rl_grid *grid, const char *const *taken, size_t n_taken,
                      const char *const **names, rl_error *err);

typedef struct rl_change {
    const char *path, *value; /* YAML on one line; "null" removes */
} rl_change;

/* Applies a variant's choices to a copy of its pipeline's tree (*root is replaced; nothing it holds is
 * changed). Where graph.NODE.pass is varied, parameters and inputs that another of its passes has and this
 * one lacks are dropped, with a note on `log` that begins with `name`. *changes: what was done, in order.
 * Errors: a path that leads to a pass, profile or output that the pipeline does not have, with the nearest;
 * what rl_value_set refuses. */
rl_code rl_grid_apply(rl_arena *arena, const rl_registry *registry, const rl_grid *grid, size_t variant,
                      const char *name, rl_value **root, const rl_log *log, const rl_change **changes,
                      size_t *n_changes, rl_error *err);

#ifdef __cplusplus
}
#endif
#endif
