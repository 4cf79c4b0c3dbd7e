/* Compiled OpenCL programs on disk. A file that is missing, damaged or of another key is simply not there. */
#ifndef RL_RUN_PROGRAM_CACHE_H
#define RL_RUN_PROGRAM_CACHE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "graph/base/error.h"

/* 128 bits over all parts, each with its length. */
void rl_program_cache_key(const char *const *parts, size_t n, uint64_t key[2]);

/* The binary in memory that the caller frees with rl_free; false when there is none. */
bool rl_program_cache_load(const uint64_t key[2], unsigned char **binary, size_t *size);

rl_code rl_program_cache_save(const uint64_t key[2], const unsigned char *binary, size_t size, rl_error *err);

#endif
