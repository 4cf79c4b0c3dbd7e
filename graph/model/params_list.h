/* Rows whose value is a list of maps (RL_ROWS): the part of params.h's functions that deals with them; not
 * for others. */
#ifndef RL_MODEL_PARAMS_LIST_H
#define RL_MODEL_PARAMS_LIST_H

#include "graph/model/params.h"

#ifdef __cplusplus
extern "C" {
#endif

size_t rl_list_bytes(const rl_param *row);
rl_code rl_list_read(const rl_param *row, const rl_value *v, void *out, rl_error *err);
/* What the elements add up to: apart from reading, since it is of no matter in a list that no pass reads. */
rl_code rl_list_check_sums(const rl_param *row, const rl_value *v, const void *value, rl_error *err);
void rl_list_print(const rl_param *row, const void *value, rl_str *s);
/* "a list of 1 … 4 maps {variance_mm2, weight}" */
void rl_list_expected(const rl_param *row, rl_str *s);
void rl_list_field(const rl_param *row, const char *prefix, rl_str *s);

#ifdef __cplusplus
}
#endif
#endif
