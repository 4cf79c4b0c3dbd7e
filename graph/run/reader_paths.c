/* Which files a frame is read from, without opening them. */
#include "graph/run/reader_parts.h"

/* A layer that reads a pattern of the manifest; NULL when none does. */
static const rl_layer *reads(const rl_reader *r, int pattern)
{
    for (int i = 0; i < r->n_bindings; i++)
        if (r->bindings[i].layer->pattern == pattern)
            return r->bindings[i].layer;
    return NULL;
}

rl_code rl_reader_paths(const rl_reader *r, int file_number, rl_arena *arena,
                        const char *paths[RL_MOST_FILES], size_t *n, rl_error *err)
{
    *n = 0;
    for (int p = 0; p < r->setup.manifest->n_patterns && p < RL_MOST_FILES; p++) {
        const rl_layer *layer = reads(r, p);
        if (!layer)
            continue;
        paths[*n] = rl_manifest_path(arena, r->setup.manifest, layer, file_number);
        if (!paths[(*n)++])
            return rl_fail_memory(err, 1);
    }
    return RL_OK;
}
