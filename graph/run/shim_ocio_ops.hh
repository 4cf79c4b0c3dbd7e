/* Between the shim_ocio*.cc only: OpenColorIO's transforms as plain structs. */
#ifndef RL_RUN_SHIM_OCIO_OPS_HH
#define RL_RUN_SHIM_OCIO_OPS_HH

#include <OpenColorIO/OpenColorIO.h>

#include "graph/run/shim_ocio.h"

/* May throw. */
rl_code rl_shim_ops(const OCIO_NAMESPACE::GroupTransform &group, rl_arena *arena, rl_op **ops, size_t *n,
                    rl_error *err);

/* Of one operation: what they cannot describe they leave alone, so that it stays RL_OP_OTHER. May throw. */
void rl_shim_curves(rl_arena *arena, const OCIO_NAMESPACE::GradingRGBCurveTransform &t, rl_op *op);
void rl_shim_primary(const OCIO_NAMESPACE::GradingPrimaryTransform &t, rl_op *op);

/* Inside a catch block: the exception as an error. */
rl_code rl_shim_caught(rl_error *err);

#endif
