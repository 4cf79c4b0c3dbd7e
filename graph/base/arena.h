/* An arena: many small allocations that live and die together (a config, a graph, a plan).
 * Not thread-safe. Memory is zeroed. */
#ifndef RL_BASE_ARENA_H
#define RL_BASE_ARENA_H

#include <stdarg.h>
#include <stddef.h>

#include "graph/base/error.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct rl_arena {
    struct rl_arena_block *blocks; /* newest first */
} rl_arena;

/* Zeroed memory, aligned for any type; NULL when memory is out. Lives until rl_arena_free. */
void *rl_arena_alloc(rl_arena *arena, size_t bytes);

/* An array of n elements, overflow checked. */
void *rl_arena_array(rl_arena *arena, size_t n, size_t size);

/* A copy of the first n bytes of text, terminated; of a whole string; of a formatted one. NULL when out. */
char *rl_arena_strndup(rl_arena *arena, const char *text, size_t n);
char *rl_arena_strdup(rl_arena *arena, const char *text);
char *rl_arena_printf(rl_arena *arena, const char *fmt, ...) RL_PRINTF(2, 3);

/* Frees everything and leaves an empty arena; an arena that is all zero is empty. */
void rl_arena_free(rl_arena *arena);

#ifdef __cplusplus
}
#endif
#endif
