#include "graph/run/program_cache.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"

/* In front of every file. `content` proves that the rest was written whole. */
typedef struct header {
    char magic[8];
    uint64_t key[2], size, content;
} header;

static const char magic[8] = "rlprog1";

void rl_program_cache_key(const char *const *parts, size_t n, uint64_t key[2])
{
    uint64_t chain = n;
    XXH128_hash_t h = {0};
    for (size_t i = 0; i < n; i++) {
        h = XXH3_128bits_withSeed(parts[i], strlen(parts[i]), chain ^ h.low64);
        chain = h.high64 + i + 1;
    }
    key[0] = h.low64;
    key[1] = chain;
}

/* The cache folder, "" when it is switched off or there is no home. */
static void cache_folder(char *out, size_t size)
{
    const char *own = getenv("RELIT_CACHE"), *xdg = getenv("XDG_CACHE_HOME"), *home = getenv("HOME");
    if (own)
        snprintf(out, size, "%s", own);
    else if (xdg && *xdg)
        snprintf(out, size, "%s/relit", xdg);
    else if (home && *home)
        snprintf(out, size, "%s/.cache/relit", home);
    else
        *out = 0;
}

static bool cache_path(const uint64_t key[2], char *folder, char *path, size_t size)
{
    cache_folder(folder, size);
    int n = snprintf(path, size, "%s/%016" PRIx64 "%016" PRIx64 ".clbin", folder, key[0], key[1]);
    return *folder && n > 0 && (size_t)n < size;
}

bool rl_program_cache_load(const uint64_t key[2], unsigned char **binary, size_t *size)
{
    char folder[2048], path[2048];
    char *data = NULL;
    size_t bytes = 0;
    rl_error ignored = {0};
    if (!cache_path(key, folder, path, sizeof path) || rl_file_read(path, &data, &bytes, &ignored))
        return false;
    header h;
    bool good = bytes > sizeof h;
    if (good) {
        memcpy(&h, data, sizeof h);
        good = !memcmp(h.magic, magic, sizeof magic) && h.key[0] == key[0] && h.key[1] == key[1] &&
               h.size == bytes - sizeof h && h.content == XXH3_64bits(data + sizeof h, bytes - sizeof h);
    }
    if (!good) {
        rl_free(data);
        return false;
    }
    memmove(data, data + sizeof h, bytes - sizeof h);
    *binary = (unsigned char *)data;
    *size = bytes - sizeof h;
    return true;
}

rl_code rl_program_cache_save(const uint64_t key[2], const unsigned char *binary, size_t size, rl_error *err)
{
    char folder[2048], path[2048];
    if (!cache_path(key, folder, path, sizeof path))
        return RL_OK;
    header h = {.key = {key[0], key[1]}, .size = size, .content = XXH3_64bits(binary, size)};
    memcpy(h.magic, magic, sizeof magic);
    unsigned char *whole = rl_malloc(sizeof h + size);
    if (!whole)
        return rl_fail_memory(err, sizeof h + size);
    memcpy(whole, &h, sizeof h);
    memcpy(whole + sizeof h, binary, size);
    rl_code code = rl_folder_make(folder, err);
    if (!code)
        code = rl_file_write(path, whole, sizeof h + size, err);
    rl_free(whole);
    return code;
}
