/* What the dense sum and the taps of sss_twin.h share. Pixels are in buffer coordinates; lengths in metres.
 * What decides which pixel is hit, or what is behind what, is in float, as the kernels have it. */
#ifndef RL_TESTS_SSS_TWIN_PARTS_H
#define RL_TESTS_SSS_TWIN_PARTS_H

#include "tests/sss_twin.h"

typedef struct twin_sums {
    double w[3], light[3]; /* weights, weights times light */
    double planar[3],
        more[3]; /* weighting: surface: weights on the tangent plane, and how much more the surface's are */
} twin_sums;

/* weighting: surface. Slopes of the tangent plane, depth a pixel. */
typedef struct tangent_t {
    float x, y;
} tangent_t;

long twin_at(const twin_scene *s, int x, int y);
long twin_plane(const twin_scene *s);

/* 0 outside of the image. */
uint32_t twin_material_at(const twin_scene *s, int x, int y);

/* Slopes of the disk, depth a metre of the screen's plane; 0 with orientation: screen. */
void twin_tilt(const twin_scene *s, int x, int y, float t[2]);

/* From pixel (x, y) to what is (u, v) away on the plane z = -1, right and down, and dz deeper: in space with
 * orientation: tangent and weighting: surface, else r on the screen's plane and the depth beside it. */
double twin_distance_to(const twin_scene *s, int x, int y, double u, double v, double dz);

tangent_t twin_tangent_of(const twin_scene *s, int x, int y);

/* How much deeper the tangent plane of (x, y) is (dx, dy) pixels away, and the area that is seen of it there
 * beside the area here. */
double twin_plane_dz(const twin_scene *s, const tangent_t *t, int x, int y, int dx, int dy, double *area);

/* Whether pixel (px, py) shows that the surface of material `id` has turned away before; at_plane: the
 * plane's depth. */
bool twin_turned_away(const twin_scene *s, int px, int py, uint32_t id, float at_plane);

/* Between the surface and the ray. */
double twin_cosine_of(const twin_scene *s, int x, int y);

#endif
