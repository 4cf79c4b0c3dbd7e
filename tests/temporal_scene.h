/* A scene whose box-filtered picture is known: a textured plane, tilted, and a textured sphere in front of
 * it, seen by a pinhole camera. Point samples as a rasterizer would record them, the truth by supersampling,
 * all in double. */
#ifndef RL_TESTS_TEMPORAL_SCENE_H
#define RL_TESTS_TEMPORAL_SCENE_H

#include <stdbool.h>
#include <stdint.h>

enum { SCENE_PLANE = 1, SCENE_SPHERE = 2 }; /* ids */

/* Frames are numbered from 0; frame 0 is the same in all scenes. */
typedef struct temporal_scene {
    int width, height;
    bool camera_moves; /* drifts, comes closer and turns: one to two pixels a frame */
    bool object_moves; /* the sphere goes right by 2.3 pixels a frame and spins */
    bool plain;        /* the plane has a smooth gradient and no texture */
    double density;    /* of the textures' detail, 0 = 1: their shortest wave is 4 pixels at 1 */
} temporal_scene;

/* A recorded frame: width * height samples a plane. */
typedef struct temporal_frame {
    int width, height;
    double to_camera[16]; /* rows listed, column vectors */
    double fov_x;         /* radians */
    double jitter[2];     /* pixels */
    float *color[3], *depth, *motion[2];
    float *normal[3];
    uint32_t *id;
} temporal_frame;

/* False when memory is out; free in any case. */
bool temporal_frame_new(temporal_frame *f, int width, int height);
void temporal_frame_free(temporal_frame *f);

/* Offset of frame n in pixels, -0.5 … 0.5: Halton's sequence in bases 2 and 3. */
void temporal_jitter(int n, double jitter[2]);

/* One point sample a pixel at the frame's jitter, which is set. */
void temporal_render(const temporal_scene *s, int number, const double jitter[2], temporal_frame *out);
/* The mean colour of n * n samples over each pixel's square; three planes. */
void temporal_truth(const temporal_scene *s, int number, int n, float *const rgb[3]);

/* What is seen of pixel (x, y) of frame `number` was hidden or outside of the image one frame before, and so
 * was all that lies less than `reach` pixels from it there. */
bool temporal_disoccluded(const temporal_scene *s, int number, int x, int y, double reach);

/* Signed distance in pixels from the pixel's centre to the sphere's outline along the row: > 0 right of it, <
 * 0 left of it, 0 in it or where the row misses it. */
double temporal_beside_sphere(const temporal_scene *s, int number, int x, int y);

#endif
