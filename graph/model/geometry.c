/* Sizes of buffers for a data window; the rules are those of kernels/shared.h. */
#include <limits.h>

#include "graph/model/plan.h"
#include "kernels/shared.h"

#define COLUMN_UNIT 64 /* RL_W up to 16 times the four phases of RL_PHASE4 */
#define ROW_UNIT    4
/* Rows that lie a multiple of 2 KiB apart fall into two sets of a first-level cache; a stencil of several
 * rows and planes then evicts itself. Such strides get two cache lines more. */
#define ALIASING_STRIDE 512
#define STRIDE_PAD      32
/* As do neighbours in RL_PHASE4: the sub-rows and planes that a filter's taps read at a time. An odd number
 * of cache lines from one sub-row to the next puts them into all sets. */
#define LINE 16
/* Kernels index the planes of an rgb image with an int; rl_plan_fits looks at images with more planes. */
#define PLANES_AT_LEAST 3

/* The multiple of unit at or below v; C's division would round a negative v up. */
static long long floor_to(long long v, long long unit)
{
    long long rest = v % unit;
    return v - (rest < 0 ? rest + unit : rest);
}

rl_code rl_geometry_make(int x, int y, int width, int height, rl_geometry *out, rl_error *err)
{
    if (width <= 0 || height <= 0)
        return rl_fail(err, RL_E_FORMAT, RL_NOWHERE, "the data window is empty (%d x %d)", width, height);
    const long long origin_x = floor_to(x, COLUMN_UNIT), origin_y = floor_to(y, ROW_UNIT);
    const long long columns = -floor_to(-((long long)x + width - origin_x), COLUMN_UNIT);
    const long long rows = -floor_to(-((long long)y + height - origin_y), ROW_UNIT);
    const long long stride = columns + (columns % ALIASING_STRIDE == 0 ? STRIDE_PAD : 0);
    const long long least4 = columns / 4 + 2 * RL_MARGIN4;
    const long long stride4 = least4 + (least4 / LINE % 2 == 0 ? LINE : 0);
    const long long plane = stride * rows, plane4 = 16 * (rows / 4) * stride4;
    const long long most = (INT_MAX - 2 * RL_GUARD) / PLANES_AT_LEAST;
    if (plane > most || plane4 > most || origin_x < INT_MIN || origin_y < INT_MIN ||
        origin_x + columns > INT_MAX || origin_y + rows > INT_MAX)
        return rl_fail(
            err, RL_E_MEMORY, RL_NOWHERE,
            "a data window of %d x %d at (%d, %d) is too large: a plane must have at most %lld pixels", width,
            height, x, y, most);
    *out = (rl_geometry){
        .x = x,
        .y = y,
        .width = width,
        .height = height,
        .columns = (int)columns,
        .rows = (int)rows,
        .origin_x = (int)origin_x,
        .origin_y = (int)origin_y,
        .stride = (int)stride,
        .plane = (int)plane,
        .stride4 = (int)stride4,
        .plane4 = (int)plane4,
    };
    return RL_OK;
}
