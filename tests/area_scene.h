/* A pass of lighting under one sphere or rect light, and sums over that light in double to hold it against.
 * Include cmocka.h first. */
#ifndef RL_TESTS_AREA_SCENE_H
#define RL_TESTS_AREA_SCENE_H

#include "tests/shade_scene.h"

enum { AREA_COLUMNS = 10, AREA_ROWS = 12, MATERIAL = 1 };

typedef struct area_yard {
    shade_scene scene;
    shade_run run;
    light_t light;
} area_yard;

/* Roughness 0.1 to 1 along a row, depth 1, 10 x 12 cm; a scattering material, so that `diffuse` is E F_in /
 * pi and `lit` the specular part alone. Free with shade_scene_free(&t->scene). */
void area_make(area_yard *t);
/* Sets a row of the material, a layer everywhere. */
void area_set(area_yard *t, const char *group, const char *key, double a);
void area_fill(area_yard *t, int port, double a);
/* A light at `distance` from the middle of what is seen, on the camera's side and to its right; tilted. An
 * intensity of 1 along the direction. a, b: half axes, or the radius. */
void area_place(area_yard *t, int type, double distance, double a, double b);
/* Row 0: the light's middle is mirrored. The next ones: further and further from that, around different
 * axes, the last ones until half of the light is below the horizon. */
void area_aim(area_yard *t);

typedef struct area_point {
    double p[3], v[3], n[3], roughness, f0;
} area_point;

typedef struct area_sums {
    double lambert, disney, specular, back, back_disney;
} area_sums;

/* x, y in buffer pixels. */
void area_read(const area_yard *t, int x, int y, area_point *out);
void area_set_normal(area_yard *t, int x, int y, const double *n);
double area_got(const area_yard *t, int port, int x, int y);

/* Over the light's surface, for a radiance of 1: n x n places. */
area_sums area_integrate(const light_t *light, const area_point *x, int n);

double area_dot(const double *a, const double *b);
void area_normalize(double *a);
void area_tangents(const double *n, double *t, double *b);

#endif
