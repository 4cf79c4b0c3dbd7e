/* A captured frame with path-traced renders of it, for tests/accuracy.c: a folder that holds
 *
 *     capture.json                  the recorder's notes: frame's file, lights, materials with their d
 *     ref_clay_burley.exr           the truth, all lights but `rim`
 *     ref_clay_burley_rim.exr       the truth, `rim` alone                        } both or neither
 *     gt_clay_lambert_rim.exr       the same light without scattering             }
 *
 * and the G-buffer that capture.json names. Failures print and return false. One thread. */
#ifndef RL_TESTS_ACCURACY_SCENE_H
#define RL_TESTS_ACCURACY_SCENE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "graph/base/arena.h"
#include "graph/relit.h"
#include "graph/run/image_file.h"

enum { ACCURACY_MATERIALS = 8, ACCURACY_LIGHTS = 8, ACCURACY_FRAMES = 16 };

/* Pixels are compared when everything across a silhouette, a material's border or a hard shadow's edge is
 * farther away than this, centre to centre: the edge itself, which the truth filters over a pixel where the
 * G-buffer has points, is 2 pixels away at least. */
enum { ACCURACY_APART = 3 };

typedef struct accuracy_material {
    const char *name;
    int id;
    double d_mm[3]; /* 0: does not scatter */
} accuracy_material;

typedef struct accuracy_light {
    const char *name;
    double position[3], intensity[3]; /* metres, world; W/sr */
} accuracy_light;

/* Which lights are on. */
typedef enum accuracy_lit { ACCURACY_MAIN, ACCURACY_RIM } accuracy_lit;

typedef struct accuracy_scene {
    rl_arena arena;
    const char *folder, *out, *frame; /* out: for manifests and pictures */
    int width, height;
    size_t n; /* pixels */
    accuracy_material materials[ACCURACY_MATERIALS];
    size_t n_materials;
    accuracy_light lights[ACCURACY_LIGHTS];
    size_t n_lights;
    double to_world[3][4], focal;                /* camera: rows; pixels */
    rl_image_file truth, rim_truth, rim_lambert; /* planes R, G, B; the last two may be empty */
    uint8_t *clear; /* pixels at least 2 from a silhouette, a material's border and a hard shadow's
                       edge */
    uint8_t *ear;   /* pixels that the rim light reaches from behind only */
    int *id;        /* of the material */
    bool has_back;  /* the G-buffer has the layers back_depth (.Z) and back_normal (.X .Y .Z) */
} accuracy_scene;

bool accuracy_scene_open(accuracy_scene *s, const char *folder, const char *out);
void accuracy_scene_close(accuracy_scene *s);

#define ACCURACY_GATHER "gather" /* screen-space translucency, of a scene that has_back */

/* A model: the text of graph.sss without its inputs, and what else to set. */
typedef struct accuracy_model {
    char name[96];
    char sss[160];      /* "pass: sss_burley, taps: 55" */
    char shading[32];   /* shading.diffuse, "" = lambert */
    const char *set;    /* of profiles: NAME_set is used for material NAME; NULL = NAME itself */
    char thickness[16]; /* thickness_from of thick transmission, ACCURACY_GATHER, "" = none */
    double unit;        /* metres a unit of the capture's lengths; 0 = 1 */
    bool settled;       /* ACCURACY_FRAMES frames of TAA, not one frame */
} accuracy_model;

/* The model's picture, planes R, G, B of s->n pixels. */
bool accuracy_render(accuracy_scene *s, const accuracy_model *model, accuracy_lit lit, float *color);

/* mean |color - truth| / mean truth and mean (color - truth) / mean truth, per channel, over the pixels of a
 * mask (nonzero) with this id (-1: any). Returns their number. */
size_t accuracy_error(const accuracy_scene *s, const float *color, const float *truth, const uint8_t *mask,
                      int id, double error[3], double bias[3]);

#endif
