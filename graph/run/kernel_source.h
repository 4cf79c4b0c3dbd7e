/* The text of the program of a node: generated part, shared.h, common.cl, the pass's own file. */
#ifndef RL_RUN_KERNEL_SOURCE_H
#define RL_RUN_KERNEL_SOURCE_H

#include "graph/base/text.h"
#include "graph/model/plan.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A file of kernels/, built into the library ("taa.cl"); NULL when there is none. With $RELIT_KERNELS set,
 * files are read from that folder instead (for those who work on kernels); the text then lives in the arena.
 */
const char *rl_kernel_file(rl_arena *arena, const char *name);

/* `march`: a light asks for SHADOW_MARCH (LIGHTS_MARCH in programs of passes with .lights).
 * HAS_x, WANTS_x, LAYOUT_x, P_x, params_t, material_t, then the sources, each behind a #line with its name.
 */
rl_code rl_kernel_text(rl_arena *arena, const rl_plan *plan, const rl_plan_node *node, bool march,
                       rl_str *out, rl_error *err);

/* The program of the conversions between layouts. */
rl_code rl_kernel_convert_text(rl_arena *arena, rl_str *out, rl_error *err);

#ifdef __cplusplus
}
#endif
#endif
