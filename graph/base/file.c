#include "graph/base/file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "graph/base/alloc.h"

static rl_code io_error(rl_error *err, const char *path, const char *what)
{
    return rl_fail_file(err, RL_E_IO, path, "%s: %s", what, strerror(errno));
}

/* A pipe or a device that has more than this has no end (/dev/zero): far beyond any text that is read whole.
 */
enum { STREAM_BYTES = 64 << 20 };

static rl_code read_all(int fd, const char *path, char **data, size_t *size, rl_error *err)
{
    struct stat st;
    if (fstat(fd, &st))
        return io_error(err, path, "cannot be read");
    if (S_ISDIR(st.st_mode))
        return rl_fail_file(err, RL_E_IO, path, "cannot be read: it is a folder");
    size_t room = st.st_size > 0 ? (size_t)st.st_size + 1 : 4096,
           used = 0; /* + 1: the read that finds the end */
    char *text = rl_malloc(room + 1);
    rl_code code = RL_OK;
    while (text) {
        ssize_t n = read(fd, text + used, room - used);
        if (n < 0 && errno == EINTR)
            continue;
        if (n < 0)
            code = io_error(err, path, "cannot be read");
        if (n <= 0)
            break;
        used += (size_t)n;
        if (used > STREAM_BYTES && !S_ISREG(st.st_mode)) {
            code = rl_fail_file(err, RL_E_IO, path,
                                "cannot be read: no file, and more than %d MiB come out of it",
                                STREAM_BYTES >> 20);
            break;
        }
        if (used == room) { /* a pipe, or a file that grows */
            char *grown = rl_realloc(text, room * 2 + 1);
            if (!grown) {
                rl_free(text);
                text = NULL;
                break;
            }
            text = grown;
            room *= 2;
        }
    }
    if (!text)
        return rl_fail_memory(err, room);
    if (code) {
        rl_free(text);
        return code;
    }
    text[used] = 0;
    *data = text;
    *size = used;
    return RL_OK;
}

rl_code rl_file_read(const char *path, char **data, size_t *size, rl_error *err)
{
    *data = NULL;
    *size = 0;
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0)
        return io_error(err, path, "cannot be opened");
    rl_code code = read_all(fd, path, data, size, err);
    close(fd);
    return code;
}

/* A device or a pipe, such as /dev/stdout: must not be replaced by a file of its name. */
static bool is_special(const char *path)
{
    struct stat st;
    return stat(path, &st) == 0 && !S_ISREG(st.st_mode) && !S_ISDIR(st.st_mode);
}

rl_code rl_file_temp(const char *path, char *out, size_t size, rl_error *err)
{
    static atomic_uint serial;
    const char *name = rl_path_name(path);
    int n = snprintf(out, size, "%.*s.%s.%ld-%u.tmp", (int)(name - path), path, name, (long)getpid(),
                     atomic_fetch_add(&serial, 1));
    if (n < 0 || (size_t)n >= size)
        return rl_fail_file(err, RL_E_IO, path, "the path is too long");
    return RL_OK;
}

rl_code rl_file_commit(const char *temp, const char *path, rl_error *err)
{
    rl_code code = RL_OK;
    int fd = open(temp, O_RDONLY | O_CLOEXEC);
    if (is_special(path))
        code = rl_fail_file(err, RL_E_IO, path, "cannot be written: it is no plain file");
    else if (fd < 0 || fsync(fd) || rename(temp, path))
        code = io_error(err, path, "cannot be written");
    if (fd >= 0)
        close(fd);
    if (code)
        unlink(temp);
    return code;
}

void rl_file_discard(const char *temp)
{
    unlink(temp);
}

rl_code rl_file_probe(const char *path, rl_error *err)
{
    char temp[4096];
    if (is_special(path))
        return RL_OK;
    if (rl_path_is_folder(path))
        return rl_fail_file(err, RL_E_IO, path, "cannot be written: it is a folder");
    rl_code code = rl_file_temp(path, temp, sizeof temp, err);
    if (code)
        return code;
    int fd = open(temp, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    if (fd < 0)
        return io_error(err, path, "cannot be written");
    close(fd);
    unlink(temp);
    return RL_OK;
}

static rl_code write_all(int fd, const char *path, const void *data, size_t size, rl_error *err)
{
    for (size_t done = 0; done < size;) {
        ssize_t n = write(fd, (const char *)data + done, size - done);
        if (n < 0 && errno != EINTR)
            return io_error(err, path, "cannot be written");
        if (n > 0)
            done += (size_t)n;
    }
    return RL_OK;
}

rl_code rl_file_write(const char *path, const void *data, size_t size, rl_error *err)
{
    char temp[4096];
    bool special = is_special(path);
    rl_code code = special ? RL_OK : rl_file_temp(path, temp, sizeof temp, err);
    if (code)
        return code;
    int fd = special ? open(path, O_WRONLY | O_CLOEXEC)
                     : open(temp, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (fd < 0)
        return io_error(err, path, "cannot be written");
    code = write_all(fd, path, data, size, err);
    if (close(fd) && !code)
        code = io_error(err, path, "cannot be written");
    if (special)
        return code;
    if (code) {
        unlink(temp);
        return code;
    }
    return rl_file_commit(temp, path, err);
}

rl_code rl_folder_make(const char *path, rl_error *err)
{
    char part[4096];
    size_t n = strlen(path);
    if (n >= sizeof part)
        return rl_fail_file(err, RL_E_IO, path, "the path is too long");
    for (size_t i = 1; i <= n; i++) {
        if (path[i] != '/' && path[i])
            continue;
        memcpy(part, path, i);
        part[i] = 0;
        if (mkdir(part, 0777) && errno != EEXIST)
            return io_error(err, part, "the folder cannot be made");
    }
    if (!rl_path_is_folder(path))
        return rl_fail_file(err, RL_E_IO, path, "the folder cannot be made: a file has that name");
    return RL_OK;
}

bool rl_path_exists(const char *path)
{
    struct stat st;
    return stat(path, &st) == 0;
}

bool rl_path_is_folder(const char *path)
{
    struct stat st;
    return stat(path, &st) == 0 && S_ISDIR(st.st_mode);
}

char *rl_path_folder(rl_arena *arena, const char *path)
{
    const char *name = rl_path_name(path);
    if (name == path)
        return rl_arena_strdup(arena, ".");
    size_t n = (size_t)(name - path);
    return rl_arena_strndup(arena, path, n > 1 ? n - 1 : n);
}

char *rl_path_join(rl_arena *arena, const char *folder, const char *path)
{
    if (path[0] == '/' || !folder[0] || !strcmp(folder, "."))
        return rl_arena_strdup(arena, path);
    size_t n = strlen(folder);
    return rl_arena_printf(arena, "%s%s%s", folder, folder[n - 1] == '/' ? "" : "/", path);
}

char *rl_path_real(rl_arena *arena, const char *path)
{
    char *folder = rl_path_folder(arena, path);
    char *real = folder ? realpath(*folder ? folder : ".", NULL) : NULL;
    char *out = !folder ? NULL
                : real  ? rl_path_join(arena, real, rl_path_name(path))
                        : rl_arena_strdup(arena, path);
    free(real);
    return out;
}

const char *rl_path_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

const char *rl_path_extension(const char *path)
{
    const char *name = rl_path_name(path);
    const char *dot = strrchr(name, '.');
    return dot && dot != name ? dot : "";
}
