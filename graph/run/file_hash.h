/* What files hold, as a hash. */
#ifndef RL_RUN_FILE_HASH_H
#define RL_RUN_FILE_HASH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Of the bytes of n files, one after the other; read in pieces. false: one of them cannot be read (or memory
 * was out), *out is then 0. Thread-safe. */
bool rl_files_hash(const char *const *paths, size_t n, uint64_t *out);

#ifdef __cplusplus
}
#endif
#endif
