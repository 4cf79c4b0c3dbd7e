/* A capture as the command line names it, for commands that look at one without processing it. */
#ifndef RL_TOOL_CAPTURE_H
#define RL_TOOL_CAPTURE_H

#include "graph/model/manifest.h"
#include "graph/run/exr.h"

/* A manifest and where it came from. Everything lives in the arena. */
typedef struct rl_capture {
    rl_manifest *manifest; /* NULL: `missing` says why a bare file is not enough */
    const char *file;      /* the manifest's file; NULL: it was guessed from channels */
    const char *preset;    /* that guessed it, or NULL */
    const char *missing;   /* "stencil, albedo" when the best preset does not find all that is required */
} rl_capture;

/* `path`: a manifest, a folder that holds capture.yaml, an EXR file, or a pattern (#### or %04d). A bare file
 * that no preset fits is no error: manifest is NULL. */
rl_code rl_capture_find(rl_arena *arena, const char *path, const rl_log *log, rl_capture *out, rl_error *err);

/* The first file that a pattern stands for, or `pattern` itself when it has no number. RL_E_IO when there is
 * none. */
rl_code rl_capture_first(rl_arena *arena, const char *pattern, const char **out, rl_error *err);

/* All channels of an open file, for rl_preset_find and rl_manifest_bind. */
rl_code rl_capture_channels(rl_arena *arena, const rl_exr *file, rl_channel **out, size_t *n, rl_error *err);

#endif
