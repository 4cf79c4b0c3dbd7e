/* The curvature pass for one pixel, in double and plain C: what the kernel is held against; and the scene
 * that it runs on. */
#ifndef RL_TESTS_TWIN_CURVATURE_H
#define RL_TESTS_TWIN_CURVATURE_H

#include "tests/shade_scene.h"

/* Ports of the pass. */
enum { NORMAL, DEPTH, STENCIL, CURVATURE, SMOOTH };

typedef struct bend_scene {
    shade_scene scene; /* smooth normals are in its .color */
    shade_image curvature;
    shade_run run;
    float radius_mm; /* the pass's only parameter, at its default */
} bend_scene;

/* A random scene; the test fails when memory is out. The scene must not move. */
void bend_make(bend_scene *t, int w, int h, int x0, int y0, uint64_t seed);
void bend_free(bend_scene *t);

double bend_dot(const double *a, const double *b);
void bend_normalize(double *v);

/* What is at a pixel: a port's plane, the point relative to the eye, the normal, the material (0 outside). */
double bend_get(const bend_scene *t, int port, int plane, int x, int y);
void bend_position(const bend_scene *t, int x, int y, double *p);
void bend_normal(const bend_scene *t, int x, int y, double *n);
uint32_t bend_id(const bend_scene *t, int x, int y);

/* `spread` tells how well the neighbours span the tangent plane: 0 where they lie in a line. False where
 * rounding decides which neighbours count. */
bool twin_bend(const bend_scene *t, int x, int y, double *curvature, double *smooth, double *spread);

#endif
