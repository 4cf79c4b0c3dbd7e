/* Colour: what the pipeline asks of OpenColorIO, as passes for the executor. A transform becomes a program of
 * vector code that is made from OpenColorIO's own list of operations, so that it computes what OpenColorIO
 * computes; what has no generator is baked into a table, measured, and reported as a warning. */
#ifndef RL_RUN_COLOR_H
#define RL_RUN_COLOR_H

#include <stdbool.h>
#include <stddef.h>

#include "graph/base/arena.h"
#include "graph/base/error.h"
#include "graph/base/log.h"
#include "graph/model/pass.h"
#include "graph/run/shim_ocio.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- names, with errors that help -------------------------------------------------------------------- */

/* The space that `name` (name, alias or role) stands for; unknown: an error at `where` with the nearest
 * names. *out lives as long as the configuration. Thread-safe. */
rl_code rl_color_space(const rl_ocio *ocio, const char *name, rl_where where, const char **out,
                       rl_error *err);

/* Display and view exist, and the look (if any), else an error at `where` that lists what there is. */
rl_code rl_color_view(const rl_ocio *ocio, const char *display, const char *view, const char *look,
                      rl_where where, rl_error *err);

/* The working space when the pipeline names none: the role scene_linear. */
rl_code rl_color_working(const rl_ocio *ocio, rl_where where, const char **out, rl_error *err);

/* ---- a transform as a pass --------------------------------------------------------------------------- */

/* The parameters of the pass. */
typedef struct rl_color_params {
    float exposure; /* stops, in front of the transform: colours are multiplied by 2^exposure */
} rl_color_params;

typedef struct rl_color_pass {
    const rl_pass *pass; /* in the arena; NULL: nothing changes, no pass is needed */
    const char *note;    /* one line about what it consists of; in the arena */
    bool baked;          /* a table stands for operations without a generator */
    double error;        /* baked: the largest difference that was measured, in output units; else 0 */
} rl_color_pass;

/* Ports `in` (read, RGB) and `out` (write, RGB), one step over vectors, entry `color_apply`, parameter
 * `exposure`. `exposed`: make a pass even if the transform itself changes nothing, since exposure will not be
 * 0. Names are checked; errors are at `where`. A table that stands for operations is a warning to `log`.
 * Takes about a millisecond, baking a few hundred; thread-safe. */
rl_code rl_color_pass_new(const rl_ocio *ocio, const rl_ocio_request *request, bool exposed, rl_where where,
                          rl_arena *arena, const rl_log *log, rl_color_pass *out, rl_error *err);

/* ---- primaries --------------------------------------------------------------------------------------- */

typedef struct rl_primaries {
    bool known;       /* the space is linear RGB; xy and name are only set then */
    double xy[8];     /* CIE 1931 x, y of red, green, blue, white: EXR's `chromaticities` */
    const char *name; /* "Rec.709" and such when it is one of the well known sets, else NULL; static */
} rl_primaries;

/* Of a colour space, through the role aces_interchange. A space of a well known set that the configuration
 * adapts to the ACES white gets that set's own white and primaries back; another one is described as adapted.
 */
rl_code rl_color_primaries(const rl_ocio *ocio, const char *space, rl_where where, rl_primaries *out,
                           rl_error *err);

/* The matrix (rows listed, column vectors) from linear RGB with these primaries and white to linear Rec. 709;
 * another white than D65 is adapted after Bradford. False when the primaries lie on a line or the white has
 * no luminance: there is no such matrix. Pure. */
bool rl_color_to_rec709(const double xy[8], double m[9]);

#ifdef __cplusplus
}
#endif
#endif
