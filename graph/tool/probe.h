/* A look at the pixels of a capture's first frame: what its depth is like, whether its conventions fit each
 * other, and the camera that its positions tell. */
#ifndef RL_TOOL_PROBE_H
#define RL_TOOL_PROBE_H

#include "graph/model/manifest.h"
#include "graph/run/normal_check.h"
#include "graph/tool/camera_solve.h"
#include "graph/tool/guess.h"

typedef struct rl_probe {
    double covered;              /* share of the pixels that are not empty */
    double nearest, median, far; /* their depth in the file's own numbers */
    double least, most;          /* all that is finite in the depth's channel */
    bool has_albedo;
    double albedo_mean, albedo_most; /* of all three channels, where something is */
    const char *matrix_source; /* what the header says of the camera's place: an attribute's name, or NULL */
    const char *lens_source;   /* the same of the lens; "screenWindowWidth" with width 1 is nothing */
    double lens_width;
    bool looked_at_normals; /* `check` holds something */
    rl_normal_check check;
    bool solved;
    rl_solved_camera camera;    /* from `position` */
    double x, y, width, height; /* of the display window */
} rl_probe;

/* `m` has its layers bound; without `depth` only the header is looked at. `position`
 * may be NULL. */
rl_code rl_probe_run(const rl_manifest *m, const rl_guess *position, rl_arena *arena, rl_probe *out,
                     rl_error *err);

#endif
