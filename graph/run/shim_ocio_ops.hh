/* Between shim_ocio.cc and shim_ocio_ops.cc only: OpenColorIO's transforms as plain structs. */
#ifndef RL_RUN_SHIM_OCIO_OPS_HH
#define RL_RUN_SHIM_OCIO_OPS_HH

#include <OpenColorIO/OpenColorIO.h>

#include "graph/run/shim_ocio.h"

/* May throw. */
rl_code rl_shim_ops(const OCIO_NAMESPACE::GroupTransform &group, rl_arena *arena, rl_op **ops, size_t *n,
                    rl_error *err);

/* Inside a catch block: the exception as an error. */
rl_code rl_shim_caught(rl_error *err);

#endif
