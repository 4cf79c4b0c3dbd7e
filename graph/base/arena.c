#include "graph/base/arena.h"

#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "graph/base/alloc.h"

#define BLOCK_BYTES 16384

typedef struct rl_arena_block {
    struct rl_arena_block *next;
    size_t used, size;
    _Alignas(max_align_t) unsigned char data[];
} rl_arena_block;

void *rl_arena_alloc(rl_arena *arena, size_t bytes)
{
    const size_t unit = _Alignof(max_align_t);
    if (bytes > SIZE_MAX / 2)
        return NULL;
    bytes = (bytes + unit - 1) / unit * unit;
    rl_arena_block *b = arena->blocks;
    if (!b || b->size - b->used < bytes) {
        size_t size = bytes > BLOCK_BYTES ? bytes : BLOCK_BYTES;
        b = rl_calloc(1, sizeof *b + size);
        if (!b)
            return NULL;
        b->size = size;
        b->next = arena->blocks;
        arena->blocks = b;
    }
    void *p = b->data + b->used;
    b->used += bytes;
    return p;
}

void *rl_arena_array(rl_arena *arena, size_t n, size_t size)
{
    if (size && n > SIZE_MAX / size)
        return NULL;
    return rl_arena_alloc(arena, n * size);
}

char *rl_arena_strndup(rl_arena *arena, const char *text, size_t n)
{
    char *copy = rl_arena_alloc(arena, n + 1);
    if (copy)
        memcpy(copy, text, n);
    return copy;
}

char *rl_arena_strdup(rl_arena *arena, const char *text)
{
    return rl_arena_strndup(arena, text, strlen(text));
}

char *rl_arena_printf(rl_arena *arena, const char *fmt, ...)
{
    va_list args;
    va_start(args, fmt);
    int n = vsnprintf(NULL, 0, fmt, args);
    va_end(args);
    char *text = n < 0 ? NULL : rl_arena_alloc(arena, (size_t)n + 1);
    if (text) {
        va_start(args, fmt);
        vsnprintf(text, (size_t)n + 1, fmt, args);
        va_end(args);
    }
    return text;
}

void rl_arena_free(rl_arena *arena)
{
    for (rl_arena_block *b = arena->blocks, *next; b; b = next) {
        next = b->next;
        rl_free(b);
    }
    arena->blocks = NULL;
}
