/* rl_hash of kernels/common.cl, for the twins: the same bits. */
#ifndef RL_TESTS_TWIN_HASH_H
#define RL_TESTS_TWIN_HASH_H

#include <stdint.h>

static inline uint32_t twin_hash(uint32_t a, uint32_t b, uint32_t c, uint32_t d)
{
    uint32_t h = a * 0x9E3779B1u ^ b * 0x85EBCA77u ^ c * 0xC2B2AE3Du ^ d * 0x27D4EB2Fu;
    h ^= h >> 15;
    h *= 0x2C1B3C6Du;
    h ^= h >> 12;
    h *= 0x297A2D39u;
    return h ^ (h >> 15);
}

#endif
