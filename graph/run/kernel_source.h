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
/* Of all files that $RELIT_KERNELS puts in the place of the built-in ones; 0 when it is not set. */
uint64_t rl_kernel_files_hash(void);

/* What some light asks for; the code for the rest is left out (LIGHTS_x in programs of passes with .lights or
 * .light_tables). */
enum {
    RL_LIGHTS_MARCH = 1,   /* SHADOW_MARCH; without, such a light has no shadow */
    RL_LIGHTS_AREA = 2,    /* spheres and rects; without, they are points with their cosine */
    RL_LIGHTS_PROFILE = 4, /* light_t.profile; without, such a light is even */
    RL_LIGHTS_SKY = 8,     /* ambient_t.sky_levels; without, the sky has no reflection */
    RL_LIGHTS_ALL = 15,
};

/* `lights`: RL_LIGHTS_….
 * HAS_x, WANTS_x, LAYOUT_x, P_x, params_t, material_t, then the sources, each behind a #line with its name.
 */
rl_code rl_kernel_text(rl_arena *arena, const rl_plan *plan, const rl_plan_node *node, unsigned lights,
                       rl_str *out, rl_error *err);

/* The program of the conversions between layouts. */
rl_code rl_kernel_convert_text(rl_arena *arena, rl_str *out, rl_error *err);

#ifdef __cplusplus
}
#endif
#endif
