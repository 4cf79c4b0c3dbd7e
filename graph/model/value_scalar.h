/* What a plain YAML scalar means. Private to the reader of YAML. */
#ifndef RL_MODEL_VALUE_SCALAR_H
#define RL_MODEL_VALUE_SCALAR_H

#include "graph/model/value.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The kind that v->text has as a plain scalar; fills truth, number, integral and integer, not kind. */
rl_kind rl_scalar_resolve(rl_value *v);

#ifdef __cplusplus
}
#endif
#endif
