#include "graph/tool/outdir.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "graph/base/file.h"

static const char *folder_of(const char *path)
{
    return path ? path : "out";
}

rl_code rl_outdir_make(const char *path, rl_error *err)
{
    const char *folder = folder_of(path);
    char probe[4096];
    rl_code code = rl_folder_make(folder, err);
    if (code)
        return code;
    int fd = open(folder, O_TMPFILE | O_WRONLY | O_CLOEXEC, 0600); /* nothing that could stay behind */
    if (fd >= 0) {
        close(fd);
        return RL_OK;
    }
    int n = snprintf(probe, sizeof probe, "%s/.relit-%ld.tmp", folder, (long)getpid());
    if (n < 0 || (size_t)n >= sizeof probe)
        return rl_fail_file(err, RL_E_IO, folder, "the path is too long");
    fd = open(probe, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    if (fd < 0)
        return rl_fail_file(err, RL_E_IO, folder, "no file can be made in this folder: %s", strerror(errno));
    close(fd);
    unlink(probe);
    return RL_OK;
}

rl_code rl_outdir_check(rl_arena *arena, const char *path, rl_error *err)
{
    const char *at = folder_of(path);
    while (!rl_path_exists(at) && strcmp(at, ".") && strcmp(at, "/")) {
        at = rl_path_folder(arena, at);
        if (!at)
            return rl_fail_memory(err, strlen(folder_of(path)));
    }
    if (!rl_path_is_folder(at))
        return rl_fail_file(err, RL_E_IO, folder_of(path), "the folder cannot be made: '%s' is not a folder",
                            at);
    if (access(at, W_OK | X_OK))
        return rl_fail_file(err, RL_E_IO, folder_of(path), "the folder '%s' cannot be written: %s", at,
                            strerror(errno));
    return RL_OK;
}
