/* What inspect_guess.c and inspect_say.c share. */
#ifndef RL_TOOL_INSPECT_PARTS_H
#define RL_TOOL_INSPECT_PARTS_H

#include "graph/tool/guess.h"
#include "graph/tool/inspect_guess.h"
#include "graph/tool/probe.h"

/* Where a channel is. */
typedef struct rl_guess_source {
    int pattern;
    const char *part, *name;
} rl_guess_source;

/* What is known while a guess is made. */
typedef struct rl_guesser {
    rl_arena *arena;
    rl_channel *channels;     /* by which names layers are looked for, */
    rl_guess_source *sources; /* and where they are */
    size_t n;
    const char *preset; /* whose conventions are taken; NULL: none fits well enough */
    rl_manifest *m;
    unsigned named; /* layers that were chosen by their names alone: 1 << id */
    bool positions;
    rl_guess position;
    rl_probe probe;
    rl_error unread; /* why the pixels could not be looked at */
} rl_guesser;

/* The manifest, with comments that say what was found, what to check, and what is missing. */
rl_code rl_inspect_say(const rl_guesser *g, rl_str *out, rl_error *err);
/* Of that, only what the first frame's header and pixels tell of camera, depth and normals. */
void rl_inspect_say_pixels(const rl_guesser *g, rl_str *out);

#endif
