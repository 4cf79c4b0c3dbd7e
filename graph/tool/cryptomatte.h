/* Names of Cryptomatte's ids, from a file's header. */
#ifndef RL_TOOL_CRYPTOMATTE_H
#define RL_TOOL_CRYPTOMATTE_H

#include "graph/model/manifest.h"
#include "graph/run/exr.h"

/* Names of those of `ids` (ascending) that the header's manifest of the channel's layer
 * ("crypto_material00.R") has; into the arena, in the order of the ids. None (*n = 0) when the header has
 * none, or it is not to be read. */
rl_code rl_cryptomatte_names(rl_arena *arena, const rl_exr *file, const char *channel, const uint32_t *ids,
                             size_t n_ids, rl_stencil_label **out, size_t *n, rl_error *err);

#endif
