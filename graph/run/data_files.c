#include "graph/run/data_files.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "graph/base/file.h"

#ifndef RELIT_DATADIR
#define RELIT_DATADIR "/usr/local/share/relit/configs"
#endif

/* The first parent of a file's folder, itself included, that has NAME in `configs` (a build tree: build/,
 * build/tests/) or in `share/relit/configs` (an installed one: bin/, lib/). */
static const char *beside(rl_arena *arena, const char *file, const char *name)
{
    static const char *const places[] = {"configs", "share/relit/configs"};
    char folder[2048];
    if (snprintf(folder, sizeof folder, "%s", file) >= (int)sizeof folder)
        return NULL;
    for (int up = 0; up < 4; up++) {
        char *slash = strrchr(folder, '/');
        if (!slash || slash == folder)
            return NULL;
        *slash = 0;
        for (size_t i = 0; i < sizeof places / sizeof *places; i++) {
            const char *path = rl_arena_printf(arena, "%s/%s/%s", folder, places[i], name);
            if (path && rl_path_exists(path))
                return path;
        }
    }
    return NULL;
}

static const char *beside_program(rl_arena *arena, const char *name)
{
    char exe[2048];
    ssize_t n = readlink("/proc/self/exe", exe, sizeof exe - 1);
    if (n <= 0)
        return NULL;
    exe[n] = 0;
    return beside(arena, exe, name);
}

/* Where this code itself was loaded from: librelit.so in a program of somebody else's. */
static const char *beside_library(rl_arena *arena, const char *name)
{
    static const char here;
    Dl_info info;
    if (!dladdr(&here, &info) || !info.dli_fname || info.dli_fname[0] != '/')
        return NULL;
    return beside(arena, info.dli_fname, name);
}

const char *rl_data_path(rl_arena *arena, const char *name)
{
    const char *env = getenv("RELIT_DATA");
    if (env && *env)
        return rl_path_join(arena, env, name);
    const char *path = beside_library(arena, name);
    if (!path)
        path = beside_program(arena, name);
    if (!path) {
        path = rl_arena_printf(arena, "%s/%s", RELIT_DATADIR, name);
        if (path && !rl_path_exists(path))
            path = NULL;
    }
    return path;
}
