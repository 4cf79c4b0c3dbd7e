#include "graph/run/leftovers.h"

#include <dirent.h>
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "graph/base/file.h"

static int by_text(const void *a, const void *b)
{
    return strcmp(*(const char *const *)a, *(const char *const *)b);
}

static bool still_runs(long pid)
{
    return pid == (long)getpid() || kill((pid_t)pid, 0) == 0 || errno == EPERM;
}

/* ".NAME.PID-SERIAL.tmp": the name's length and the process; false for any other file. */
static bool parse(const char *file, size_t *length, long *pid)
{
    size_t n = strlen(file);
    unsigned serial;
    int used = 0;
    if (file[0] != '.' || n < 8 || strcmp(file + n - 4, ".tmp"))
        return false;
    size_t dot = n - 4;
    while (dot > 1 && file[dot - 1] != '.')
        dot--;
    if (dot < 3 || sscanf(file + dot, "%ld-%u.tmp%n", pid, &serial, &used) != 2 || dot + (size_t)used != n)
        return false;
    *length = dot - 2;
    return *pid > 0;
}

static void clean_folder(const char *folder, const char **paths, size_t n)
{
    DIR *dir = opendir(folder);
    if (!dir)
        return;
    for (struct dirent *d = readdir(dir); d; d = readdir(dir)) {
        size_t length;
        long pid;
        if (!parse(d->d_name, &length, &pid) || still_runs(pid))
            continue;
        rl_arena arena = {0};
        char *name = rl_arena_strndup(&arena, d->d_name + 1, length);
        const char *path = name ? rl_path_join(&arena, folder, name) : NULL;
        if (path && bsearch(&path, paths, n, sizeof *paths, by_text))
            unlinkat(dirfd(dir), d->d_name, 0);
        rl_arena_free(&arena);
    }
    closedir(dir);
}

void rl_leftovers_remove(const char **paths, size_t n)
{
    rl_arena arena = {0};
    const char *last = NULL;
    if (n)
        qsort(paths, n, sizeof *paths, by_text);
    for (size_t i = 0; i < n; i++) {
        const char *folder = rl_path_folder(&arena, paths[i]);
        if (folder && (!last || strcmp(folder, last))) /* sorted: those of a folder mostly stand together */
            clean_folder(folder, paths, n);
        last = folder;
    }
    rl_arena_free(&arena);
}
