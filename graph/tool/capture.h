/* A capture as the command line names it, for commands that look at one without processing it. */
#ifndef RL_TOOL_CAPTURE_H
#define RL_TOOL_CAPTURE_H

#include "graph/model/manifest.h"
#include "graph/run/exr.h"

/* A manifest and where it came from. Everything lives in the arena. */
typedef struct rl_capture {
    rl_manifest *manifest; /* of a bare file that no preset fits: files, frames, and the layers found */
    const char *file;      /* the manifest's file; NULL: it was guessed from channels */
    const char *preset;    /* of a bare file: the one that fits best, or NULL */
    const char *missing;   /* of a bare file: what the best preset does not find, or NULL */
} rl_capture;

/* `path`: a manifest, a folder that holds capture.yaml, an EXR file, or a pattern (#### or %04d). A bare file
 * that no preset fits is no error: `missing` says so. */
rl_code rl_capture_find(rl_arena *arena, const char *path, const rl_log *log, rl_capture *out, rl_error *err);

/* The file of a pattern of the manifest at its first frame; NULL when memory is out. */
char *rl_capture_first(rl_arena *arena, const rl_manifest *m, int pattern);

/* The channels of an open file that relit can read (no deep parts, no subsampling); their names live as long
 * as the file. */
rl_code rl_capture_channels(rl_arena *arena, const rl_exr *file, rl_channel **out, size_t *n, rl_error *err);

/* Gives the ids of the first frame the names that the file has for them (Cryptomatte), when the manifest has
 * none. */
rl_code rl_capture_name_ids(rl_arena *arena, rl_manifest *m, rl_error *err);

/* The stencil ids of the first frame, ascending, each once, at most `most`; 0 is left out, since it marks the
 * background as a rule. None when there is no stencil. */
rl_code rl_capture_ids(rl_arena *arena, const rl_manifest *m, size_t most, uint32_t *out, size_t *n,
                       rl_error *err);

#endif
