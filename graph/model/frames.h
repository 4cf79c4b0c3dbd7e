/* Sets of frame numbers: "1-24", "1-24x2" (every second), "1,5,9-12", "-10--1". */
#ifndef RL_MODEL_FRAMES_H
#define RL_MODEL_FRAMES_H

#include <stdbool.h>
#include <stddef.h>

#include "graph/base/arena.h"
#include "graph/base/error.h"
#include "graph/base/text.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A capture of more frames than this is a mistake in its manifest. */
#define RL_FRAMES_MOST 1000000

typedef struct rl_frames {
    int *numbers; /* ascending, each once; in the arena */
    size_t n;
} rl_frames;

/* `where` is the place of the spec, for errors. Spaces around parts are fine. RL_E_CONFIG when it is no spec,
 * a range runs backwards, a number leaves ±2,000,000,000, or there are more than RL_FRAMES_MOST. */
rl_code rl_frames_parse(rl_arena *arena, const char *spec, rl_where where, rl_frames *out, rl_error *err);

/* Sorts n numbers in place, drops the doubles, and makes them a set that owns nothing. */
rl_frames rl_frames_from(int *numbers, size_t n);

/* The index of a frame, or -1. */
long rl_frames_find(const rl_frames *frames, int number);

/* All of `wanted` are in `listed`, those of a capture, else RL_E_USAGE that names the first that is not, the
 * capture, and what it has. */
rl_code rl_frames_check(const rl_frames *listed, const char *capture, const rl_frames *wanted, rl_where where,
                        rl_error *err);

/* Adds a spec that reads back as the same set: three or more in a row, or four or more of one step, as a
 * range. */
void rl_frames_print(const rl_frames *frames, rl_str *out);

#ifdef __cplusplus
}
#endif
#endif
