/* A capture of another size, for timing: every pixel of a frame repeated or left out, all channels kept. */
#ifndef RL_TOOL_ENLARGE_H
#define RL_TOOL_ENLARGE_H

#include "graph/base/pool.h"
#include "graph/model/manifest.h"

/* Writes the first `frames` frames of a capture, at width x height pixels, into `folder` with a capture.yaml;
 * *path is that file's, in the arena. Cameras keep their field of view; motion stays in pixels of the old
 * size, so that pictures of it are good for nothing but timing. RL_E_USAGE for captures of several files or
 * parts a frame. */
rl_code rl_enlarge_capture(rl_arena *arena, const rl_manifest *manifest, const char *folder, int width,
                           int height, size_t frames, rl_pool *pool, const char **path, rl_error *err);

#endif
