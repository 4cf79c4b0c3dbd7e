#include "graph/run/device_home.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "graph/base/file.h"

/* Room for a path; those that do not fit count as not usable. */
enum { ROOM = 2048 };

/* Whether a folder can be written to, or made: by the nearest of its parents that is there. Changes `path`.
 */
static bool usable(char *path)
{
    char *slash = NULL;
    while (!rl_path_exists(path) && (slash = strrchr(path, '/')) != NULL && slash != path)
        *slash = 0;
    if (slash == path)
        path[1] = 0; /* "/" */
    return rl_path_is_folder(path) && access(path, W_OK | X_OK) == 0;
}

/* The folder that PoCL would take. */
static bool own_folder(char *out)
{
    const char *xdg = getenv("XDG_CACHE_HOME"), *home = getenv("HOME");
    int n = xdg && *xdg ? snprintf(out, ROOM, "%s/pocl/kcache", xdg)
            : home      ? snprintf(out, ROOM, "%s/.cache/pocl/kcache", home)
                        : snprintf(out, ROOM, "/tmp/pocl/kcache");
    return n > 0 && n < ROOM;
}

/* A folder of this user alone: what lies in it becomes code that runs. */
static bool private_folder(char *out)
{
    const char *base = getenv("TMPDIR");
    struct stat st;
    int n = snprintf(out, ROOM, "%s/relit-%ld", base && *base ? base : "/tmp", (long)geteuid());
    if (n <= 0 || n >= ROOM)
        return false;
    mkdir(out, 0700); /* may be there */
    return lstat(out, &st) == 0 && S_ISDIR(st.st_mode) && st.st_uid == geteuid() && !(st.st_mode & 022);
}

void rl_device_home(void)
{
    char folder[ROOM];
    if (getenv("POCL_CACHE_DIR") || (own_folder(folder) && usable(folder)) || !private_folder(folder))
        return;
    setenv("POCL_CACHE_DIR", folder, 0);
}
