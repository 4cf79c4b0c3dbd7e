/* The manifest that `relit inspect` proposes for files without one. */
#ifndef RL_TOOL_INSPECT_GUESS_H
#define RL_TOOL_INSPECT_GUESS_H

#include "graph/tool/capture.h"
#include "graph/tool/tool.h"

/* `capture` is a bare file or pattern. What is printed reads back as a manifest, with comments that say what
 * was found, what to check, and what is missing. */
rl_code rl_inspect_guess(rl_tool *tool, const rl_capture *capture, rl_str *out, rl_error *err);

/* What a manifest that is there makes of its first frame, as comments: the camera, how far the depth goes,
 * whether normals and depth fit. What a preset leaves open in `m` is bound to the channels of the first
 * frame's files. */
void rl_inspect_look(rl_tool *tool, rl_manifest *m, rl_str *out);

/* rl_inspect_guess for sequences of one folder none of which has all layers: renderers that write a file a
 * layer, whose name says which. */
rl_code rl_inspect_guess_files(rl_tool *tool, const char *const *patterns, size_t n, rl_str *out,
                               rl_error *err);

#endif
