/* What capture_write.c and capture_manifest.c share. */
#ifndef RL_TESTS_CAPTURE_PARTS_H
#define RL_TESTS_CAPTURE_PARTS_H

#include "tests/capture_write.h"

enum { MOST = 3, LAYERS = 8 };

typedef struct layer_names {
    const char *name;
    int plane, n;
    /* Channels where layers share a file, where each has its own, and as Blender's Cycles names them. */
    const char *full[MOST], *bare[MOST], *blender[MOST];
} layer_names;

extern const layer_names capture_layers[LAYERS];

double capture_metres(const capture_form *form); /* a unit of the file */
int capture_channels(const capture_form *form, int layer);
/* World to camera in the file's convention and unit, rows listed, column vectors. */
void capture_matrix(const capture_form *form, const scene_camera *camera, double m[16]);

#endif
