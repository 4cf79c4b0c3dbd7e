/* A random but reproducible scene for the shading passes: images of every layer, materials of every kind,
 * lights of every type, an arbitrary camera and data window. */
#ifndef RL_TESTS_SHADE_SCENE_H
#define RL_TESTS_SHADE_SCENE_H

#include "tests/twin_shading.h"

enum { SCENE_LIGHTS = 4 };

typedef struct shade_scene {
    frame_t frame;
    shade_image images[LIGHTING_PORTS];
    shade_image color; /* for combine */
    shade_materials materials;
    light_t lights[SCENE_LIGHTS];
} shade_scene;

/* False when memory is out; free in any case. Every pixel is depth 0.4 to 1.6, its normal any direction;
 * patches of 7x5 pixels have one material, an eighth of them and a random sixteenth of the pixels none. */
bool shade_scene_make(shade_scene *s, int w, int h, int x0, int y0, uint64_t seed);
void shade_scene_free(shade_scene *s);

/* A run of a pass on all images of the scene. */
shade_run shade_scene_lighting(const shade_scene *s);
shade_run shade_scene_combine(const shade_scene *s);

/* A camera at `eye` that looks along a fixed oblique direction. */
void shade_camera(camera_t *c, const double *eye, double turn, double tilt);

/* Sets an RGB image (or the first planes of any) everywhere in the valid rectangle. */
void shade_fill(const shade_image *image, const frame_t *f, const double *value);

#endif
