/* Writes an analytic scene as a capture under given conventions: EXR files by OpenEXR's own core, and the
 * manifest that describes them. Include cmocka.h first: what cannot be written fails the test. */
#ifndef RL_TESTS_CAPTURE_WRITE_H
#define RL_TESTS_CAPTURE_WRITE_H

#include "graph/base/text.h"
#include "tests/capture_scene.h"
#include "tests/exr_make.h"

typedef enum capture_files { FILES_ONE, FILES_LAYERS, FILES_PARTS } capture_files;
typedef enum capture_depth { DEPTH_PLANAR, DEPTH_RADIAL, DEPTH_DEVICE } capture_depth;
typedef enum capture_normal { NORMAL_SIGNED, NORMAL_UNSIGNED, NORMAL_OCTAHEDRAL } capture_normal;
typedef enum capture_camera { CAMERA_HEADER, CAMERA_MANIFEST, CAMERA_LIST } capture_camera;
typedef enum capture_fov { FOV_HEADER, FOV_WINDOW, FOV_MANIFEST, FOV_LIST } capture_fov;
typedef enum capture_motion { MOTION_PIXELS, MOTION_UV, MOTION_NDC } capture_motion;

/* All zero: one float scanline file a frame, metres, planar, world normals, camera in the header. */
typedef struct capture_form {
    const char *name;  /* for people */
    const char *title; /* the manifest's `name`; NULL: cap */
    capture_files files;
    const char *pattern;  /* the manifest's `files`; NULL: what fits */
    rl_exr_pixel pixel;   /* RL_EXR_HALF, else float */
    rl_exr_pixel stencil; /* 0 is RL_EXR_UINT */
    bool depth_uint;      /* depth as whole numbers of the unit */
    rl_exr_compression compression;
    int tile;
    capture_depth depth;
    bool reversed;
    double near, far;      /* metres */
    const char *unit;      /* NULL: m */
    double metres;         /* of that unit; 0: 1 */
    double empty;          /* the file's value where nothing is; 0 means 0 */
    const char *empty_key; /* `empty:` in the manifest; NULL: not given */
    bool normal_camera, forward_z;
    capture_normal normal;
    capture_camera camera;
    capture_fov fov;
    bool jitter_in_manifest;
    const char *colorspace;                                /* of albedo; NULL: lin_rec709 */
    void (*encode)(const double linear[3], double out[3]); /* into that; NULL: none */
    double remap[2]; /* thickness in the unit, as 0..1; remap[1] 0: not remapped */
    capture_motion motion;
    bool motion_next, motion_up;
    const uint32_t *ids; /* what the scene's ids 0..3 are in the file; NULL: themselves */
    const char *stencil_names, *frames, *extra; /* further lines of the manifest, or NULL */
    const char *shadows;                        /* NULL: {key: …, rim: …} by their names */
    const char *lights;                         /* NULL: the scene's */
    bool blender;                               /* names of Cycles' passes; FILES_ONE */
    bool no_lights, no_matrix;                  /* the header's matrix is left out */
    const uint32_t *time_code;
    int fps[2];
    const char *owner;
    /* spoils planes, in the file's units, before they are narrowed: [layer's channel] of width*height */
    void (*spoil)(const char *layer, double **channels, int n, size_t pixels);
} capture_form;

/* Files of one frame. */
void capture_write(const char *folder, const capture_form *form, const scene *s, int frame);
/* capture.yaml for frames written so; `first` is the scene of the first frame, `n` how many there are. */
void capture_manifest(const char *folder, const capture_form *form, const scene *frames, int n);

#endif
