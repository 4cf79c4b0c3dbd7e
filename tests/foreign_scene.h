/* A small scene as other renderers would write it: a matte ball on a floor, z up, seen from a known camera.
 * The pixels are exact; names, spaces, units and headers are each renderer's own. Include cmocka.h first. */
#ifndef RL_TESTS_FOREIGN_SCENE_H
#define RL_TESTS_FOREIGN_SCENE_H

#include <stdint.h>

#include "graph/run/exr.h"

enum { FOREIGN_WIDTH = 96, FOREIGN_HEIGHT = 72, FOREIGN_PIXELS = FOREIGN_WIDTH * FOREIGN_HEIGHT };

/* Metres, z up, right-handed. Ids: 0 nothing, 1 the floor, 2 the ball. */
typedef struct foreign_scene {
    double position[3], right[3], up[3], ahead[3]; /* of the camera */
    double yaw, pitch;                             /* degrees; from x to y, and up */
    int x, y;                                      /* where the windows of the file begin; 0 */
    double fov_x, shift;                           /* radians; to the right, in widths */
    float albedo[3][FOREIGN_PIXELS], normal[3][FOREIGN_PIXELS], world[3][FOREIGN_PIXELS],
        depth[FOREIGN_PIXELS];
    uint32_t id[FOREIGN_PIXELS];
} foreign_scene;

foreign_scene *foreign_scene_new(double shift); /* freed with free */

/* worldToCamera for row vectors: its z is ahead, or behind the camera. */
void foreign_matrix(const foreign_scene *s, double ahead, double out[16]);

typedef enum foreign_kind {
    FOREIGN_RELIT,   /* relit's own names, camera in the header */
    FOREIGN_BLENDER, /* no camera, but positions; ids are Cryptomatte's */
    FOREIGN_ARNOLD,  /* worldToCamera and worldToNDC */
    FOREIGN_UNREAL,  /* left-handed centimetres, normals of 0..1, the camera as text */
    FOREIGN_PBRT,    /* camera space, no depth but a position, no ids */
    FOREIGN_VRAY,    /* cameraTransform, cameraFov, Cryptomatte */
    FOREIGN_UNKNOWN  /* no preset: base_color.red, WorldNormal.x, zdepth */
} foreign_kind;

void foreign_write(const char *path, const foreign_scene *s, foreign_kind kind);
/* A file for each of albedo, normal, depth and position, whose names say so and whose channels do not; no
 * camera. */
void foreign_write_torn(const char *folder, const foreign_scene *s);
/* A point in the world that this renderer has, in its unit. */
void foreign_point(foreign_kind kind, const double metres[3], double out[3]);

#endif
