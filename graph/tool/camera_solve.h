/* The camera of a picture, from the world position and the depth of its pixels. */
#ifndef RL_TOOL_CAMERA_SOLVE_H
#define RL_TOOL_CAMERA_SOLVE_H

#include <stdbool.h>
#include <stddef.h>

/* One pixel: its place in the display window (x right, y down; the middle of the first pixel is 0.5), the
 * surface that it shows in the world's unit, and that surface's planar depth in the same unit. */
typedef struct rl_seen {
    double x, y, depth, world[3];
} rl_seen;

typedef struct rl_solved_camera {
    double matrix[16]; /* world to camera for column vectors, looking down -z */
    double focal;      /* pixels, of x */
    double aspect;     /* focal of y / focal of x */
    double centre[2];  /* pixels */
    double error; /* median distance between where the pixels are and where this camera puts them, pixels */
} rl_solved_camera;

/* Least squares of what fits: up to a quarter may be off (edges, where renderers blend what lies before and
 * behind). `seen` is reordered. False when there are fewer than 16, when they lie in one plane of depth or in
 * one line, or when position and depth differ in unit or depth is not planar; else `error` tells how good the
 * result is. */
bool rl_camera_solve(rl_seen *seen, size_t n, rl_solved_camera *out);

#endif
