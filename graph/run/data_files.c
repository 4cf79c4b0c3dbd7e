#include "graph/run/data_files.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "graph/base/file.h"

#ifndef RELIT_DATADIR
#define RELIT_DATADIR "/usr/local/share/relit/configs"
#endif

/* The first parent of the running program's folder, itself included, that has a `configs` with NAME in it; programs of a
 * build tree lie in build/ and build/tests/. */
static const char *beside_program(rl_arena *arena, const char *name)
{
    char exe[2048];
    ssize_t n = readlink("/proc/self/exe", exe, sizeof exe - 1);
    if (n <= 0)
        return NULL;
    exe[n] = 0;
    for (int up = 0; up < 4; up++) {
        char *slash = strrchr(exe, '/');
        if (!slash || slash == exe)
            return NULL;
        *slash = 0;
        const char *path = rl_arena_printf(arena, "%s/configs/%s", exe, name);
        if (path && rl_path_exists(path))
            return path;
    }
    return NULL;
}

const char *rl_data_path(rl_arena *arena, const char *name)
{
    const char *env = getenv("RELIT_DATA");
    if (env && *env)
        return rl_path_join(arena, env, name);
    const char *path = beside_program(arena, name);
    if (!path) {
        path = rl_arena_printf(arena, "%s/%s", RELIT_DATADIR, name);
        if (path && !rl_path_exists(path))
            path = NULL;
    }
    return path;
}
