/* An analytic scene, in double: what a camera sees of two spheres and a floor, and how three lights light it
 * (Lambert). Everything is in metres, in a right-handed world, y up; views look down -z. Written under any
 * convention by capture_write.h. */
#ifndef RL_TESTS_CAPTURE_SCENE_H
#define RL_TESTS_CAPTURE_SCENE_H

#include <stddef.h>
#include <stdint.h>

/* A camera as OpenEXR describes one: the display window spans a screen window at distance 1. */
typedef struct scene_camera {
    int data[4], display[4]; /* x, y, width, height */
    double view[12];         /* world to view, 3 rows of 4, column vectors */
    double fov_x;            /* radians, across the display window */
    double center[2];        /* of the screen window, x right, y up */
    double aspect;           /* width / height of a pixel */
    double jitter[2];        /* pixels, x right, y down */
} scene_camera;

enum {
    SCENE_ALBEDO = 0,   /* 3, linear Rec.709 */
    SCENE_NORMAL = 3,   /* 3, world */
    SCENE_POSITION = 6, /* 3 */
    SCENE_DEPTH = 9,    /* along the view axis; 0 = empty */
    SCENE_RAY = 10,     /* length of the view ray per metre of depth */
    SCENE_THICKNESS = 11,
    SCENE_MOTION = 12, /* 2, pixels, x right, y down; made up */
    SCENE_SHADOW = 14, /* 2: key, rim; made up */
    SCENE_COLOR = 16,  /* 3: radiance towards the camera */
    SCENE_PLANES = 19
};

enum { SCENE_KEY = 1, SCENE_RIM = 2, SCENE_SUN = 4, SCENE_LIGHTS = 7 };
#define SCENE_KEY_POSITION                                                                                   \
    {                                                                                                        \
        0.6, 1.2, -0.4                                                                                       \
    }
#define SCENE_KEY_INTENSITY                                                                                  \
    {                                                                                                        \
        3, 2, 1                                                                                              \
    }
#define SCENE_RIM_POSITION                                                                                   \
    {                                                                                                        \
        -1.2, 0.9, -1.2                                                                                      \
    }
#define SCENE_RIM_DIRECTION                                                                                  \
    {                                                                                                        \
        0.74, -0.74, -0.3                                                                                    \
    } /* not of length 1 */
#define SCENE_RIM_ANGLE 60.0
#define SCENE_RIM_BLEND 0.4
#define SCENE_RIM_INTENSITY                                                                                  \
    {                                                                                                        \
        0.5, 1.5, 2.5                                                                                        \
    }
#define SCENE_SUN_DIRECTION                                                                                  \
    {                                                                                                        \
        -0.3, -0.9, -0.4                                                                                     \
    }
#define SCENE_SUN_IRRADIANCE                                                                                 \
    {                                                                                                        \
        0.4, 0.3, 0.2                                                                                        \
    }

typedef struct scene {
    scene_camera camera;
    int width, height;
    size_t n;
    double *plane[SCENE_PLANES]; /* rows without gaps */
    uint32_t *id;                /* 1 and 3: spheres, 2: floor; 0 where empty */
} scene;

scene_camera scene_camera_default(void); /* 72 x 48 */
/* `lights` are bits of SCENE_LIGHTS; `shadowed` those of key and rim whose shadow counts. */
scene scene_make(const scene_camera *camera, unsigned lights, unsigned shadowed);
void scene_free(scene *s);
/* The id of what a ray meets first, at a parameter in (0, end); 0 = nothing. The floor ends at parameter 5.
 */
uint32_t scene_first(const double *from, const double *ray, double end);
/* The id of what a point is inside of, or 0. */
uint32_t scene_inside(const double *p);

#endif
