/* Files and paths. */
#ifndef RL_BASE_FILE_H
#define RL_BASE_FILE_H

#include <stddef.h>

#include "graph/base/arena.h"
#include "graph/base/error.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The whole file, with a zero byte behind it that `size` does not count. Freed with rl_free. A missing file,
 * a folder, and a read error are RL_E_IO with the system's reason. */
rl_code rl_file_read(const char *path, char **data, size_t *size, rl_error *err);

/* Writes a file so that it is whole under its name or not there at all: temporary name in the same folder,
 * fsync, rename. A device or a pipe (/dev/stdout) is written to, not replaced. */
rl_code rl_file_write(const char *path, const void *data, size_t size, rl_error *err);

/* Whether a file could be written under this name: asked before the work whose result it will hold. */
rl_code rl_file_probe(const char *path, rl_error *err);

/* For writers that need a path of their own: a fresh name beside `path` (in `out`, room for `size` bytes);
 * then either commit (fsync and rename to `path`) or discard (unlink). The temporary's name ends in ".tmp"
 * behind the extension kept by `path`, so that a library that picks a format by name is told it otherwise. */
rl_code rl_file_temp(const char *path, char *out, size_t size, rl_error *err);
rl_code rl_file_commit(const char *temp, const char *path, rl_error *err);
void rl_file_discard(const char *temp);

/* Creates a folder and its parents; one that exists is fine. */
rl_code rl_folder_make(const char *path, rl_error *err);

bool rl_path_exists(const char *path);
bool rl_path_is_folder(const char *path);

/* "a/b/c.yaml" -> "a/b", "c.yaml" -> "."; "a" joined with "b" -> "a/b", with "/b" -> "/b", "." with "b" ->
 * "b"; "x/y.0001.exr" -> "y.0001.exr"; the part from the last dot of the file's name (".exr") or "". */
char *rl_path_folder(rl_arena *arena, const char *path);
char *rl_path_join(rl_arena *arena, const char *folder, const char *path);
/* With a folder that has no links and no dots in it, so that one file has one spelling; a copy as it is when
 * there is no such folder. NULL when memory is out. */
char *rl_path_real(rl_arena *arena, const char *path);
const char *rl_path_name(const char *path);
const char *rl_path_extension(const char *path);

#ifdef __cplusplus
}
#endif
#endif
