#include "graph/run/file_hash.h"

#include <fcntl.h>
#include <unistd.h>
#include <xxhash.h>

#include "graph/base/alloc.h"

/* Bytes of one file into a running hash. */
static bool add_file(XXH3_state_t *hash, const char *path, void *buffer, size_t room)
{
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    ssize_t n = -1;
    while (fd >= 0 && (n = read(fd, buffer, room)) > 0)
        XXH3_64bits_update(hash, buffer, (size_t)n);
    if (fd >= 0)
        close(fd);
    return n == 0;
}

bool rl_files_hash(const char *const *paths, size_t n, uint64_t *out)
{
    enum { ROOM = 1 << 18 }; /* stays in the second-level cache */
    void *buffer = rl_malloc(ROOM);
    XXH3_state_t *hash = XXH3_createState();
    bool good = buffer && hash;
    if (good)
        XXH3_64bits_reset(hash);
    for (size_t i = 0; i < n && good; i++)
        good = add_file(hash, paths[i], buffer, ROOM);
    *out = good ? XXH3_64bits_digest(hash) : 0;
    XXH3_freeState(hash);
    rl_free(buffer);
    return good;
}
