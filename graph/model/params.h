/* Reading a pass's table of parameters from YAML, and telling about it. */
#ifndef RL_MODEL_PARAMS_H
#define RL_MODEL_PARAMS_H

#include "graph/base/text.h"
#include "graph/model/pass.h"
#include "graph/model/value.h"

#ifdef __cplusplus
extern "C" {
#endif

/* An error whose text ends in "; did you mean …? known: …" (n names, in any order). text == NULL stands for
 * memory that is out, so that the result of rl_arena_printf can be handed over unseen. */
rl_code rl_fail_suggest(rl_error *err, rl_where where, const char *text, const char *name,
                        const char *const *known, size_t n);

/* What a value of the row takes in a struct. */
size_t rl_param_bytes(const rl_param *row);

/* The default of a row, or -1 for .no_default rows, written to out (rl_param_bytes(row) bytes); lists are
 * empty. */
void rl_param_default(const rl_param *row, void *out);

/* One value: type and range checked in double before narrowing, NaN refused, words known with did-you-mean.
 * `out` gets rl_param_bytes(row) bytes. Lists: unknown keys, missing ones that are .required, and sums beyond
 * .most_sum are errors. */
rl_code rl_param_read(const rl_param *row, const rl_value *v, void *out, rl_error *err);

/* A pass's struct (pass->params_size bytes in the arena): defaults, then what the node's map (may be NULL)
 * says. Keys named in `also` (such as "pass" and "in") are skipped; any other unknown key is an error that
 * reads "pass 'sss' (sss_burley) has no parameter 'tapps'; did you mean 'taps'? known: …". */
rl_code rl_params_read(rl_arena *arena, const rl_pass *pass, const char *node, const rl_value *map,
                       const char *const *also, size_t n_also, const void **out, rl_error *err);

/* Where row `row->list.rows[k]` of element `i` is in the value of a list (i < row->max). */
const void *rl_param_element(const rl_param *row, const void *value, size_t i, size_t k);

/* Whether a value of an RL_ENUM row is one of the words "a|b". */
bool rl_param_is(const rl_param *row, const void *value, const char *words);

/* Whether a step of the pass runs, and whether there is memory for a SCRATCH port, with these parameters (the
 * pass's struct; may be NULL when it has none): their .when and .is. */
bool rl_step_runs(const rl_pass *pass, const rl_step *step, const void *params);
bool rl_port_exists(const rl_pass *pass, const rl_port *port, const void *params);

/* A value as YAML text ("auto", "screen", "0.05", "[1, 0, 0]"), appended to s. */
void rl_param_print(const rl_param *row, const void *value, rl_str *s);
/* The row's range and default for people: "0 … 1, default 0.05 ratio", "screen|tangent, default screen",
 * "0 … 1 ratio, no default" for .no_default rows. */
void rl_param_describe(const rl_param *row, rl_str *s);

/* What may be given for a number, for an error that names the row: "auto or an integer 0 … 64 (taps)". */
void rl_param_expected(const rl_param *row, rl_str *s);

/* A row as a field of an OpenCL struct, "float blend;" or, with the prefix "profile_", "float
 * profile_weight[3];"; a list as its fields. */
void rl_param_field(const rl_param *row, const char *prefix, rl_str *s);
/* The OpenCL text of a struct with these rows, in order: "typedef struct params_t { float blend; } params_t;"
 * and a newline; nothing when there are no rows. */
void rl_params_struct_text(rl_params params, const char *name, rl_str *s);

#ifdef __cplusplus
}
#endif
#endif
