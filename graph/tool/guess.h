/* Which channels of a file may hold which layer, by their names alone: for files that no preset knows. */
#ifndef RL_TOOL_GUESS_H
#define RL_TOOL_GUESS_H

#include <stdbool.h>

#include "graph/model/manifest.h"

/* Channels that a layer may be. */
typedef struct rl_guess {
    const char *names[3]; /* in order */
    const char *part;     /* NULL in a file of one part */
    bool hashed;          /* stencil: Cryptomatte */
    int pattern;          /* of the manifest, that holds them; set by the caller */
} rl_guess;

/* The likeliest channels for a layer, or for the world position of each pixel (RL_LAYER_COUNT), which is no
 * layer. false when no name is like it. Texts live as long as the channels'. */
bool rl_guess_layer(rl_layer_id id, const rl_channel *channels, size_t n, rl_guess *out);

#endif
