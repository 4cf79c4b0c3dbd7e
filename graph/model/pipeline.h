/* A pipeline file (DESIGN 3), parsed and checked on its own: what can be known without opening the capture.
 */
#ifndef RL_MODEL_PIPELINE_H
#define RL_MODEL_PIPELINE_H

#include "graph/base/log.h"
#include "graph/model/pass.h"
#include "graph/model/registry.h"
#include "graph/model/value.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct rl_node_input {
    const char *port;
    const char *image; /* as written: "light.diffuse", "capture.normal", "capture.shadow.key", "none" */
    rl_where where;    /* of the image's name */
} rl_node_input;

typedef struct rl_node {
    const char *name;
    rl_where where; /* of the name; RL_NOWHERE for nodes that relit adds */
    const rl_pass *pass;
    const void *params; /* pass->params_size bytes; sets of materials are empty, see rl_material_sets_fill */
    const rl_node_input *inputs;
    size_t n_inputs;
    const rl_value *map; /* as written; NULL for nodes that relit adds */
} rl_node;

typedef struct rl_output_layer {
    const char *name; /* "" for an output with one image */
    const char *image;
    rl_where where;
} rl_output_layer;

typedef enum rl_pixel_type { RL_HALF, RL_FLOAT, RL_UINT8, RL_UINT16, RL_UINT32 } rl_pixel_type;

typedef struct rl_output {
    const char *name;
    rl_where where;
    const rl_output_layer *layers; /* one for `image:`, several for `layers:` */
    size_t n_layers;
    const char *file; /* pattern, relative to --out */
    rl_where file_where;
    const char *colorspace;            /* or NULL */
    const char *display, *view, *look; /* or NULL */
    rl_where color_where;
    double exposure;    /* stops */
    rl_pixel_type type; /* given, or the file type's default: half for EXR, uint8 for PNG and JPEG, … */
    const char *compression; /* EXR: lower case name, default "zip"; TIFF: none|lzw|zip; NULL = the writer's
                                default */
    double quality;          /* JPEG 1…100, DWA level; < 0 = default */
    int level;               /* zip level, 0 = default */
} rl_output;

/* Constant after rl_pipeline_parse. Lives in the arena that was given, and points into the tree: both must
 * outlive it. */
typedef struct rl_pipeline {
    const char *file;        /* as given on the command line */
    const char *name;        /* file name without folder and extension */
    unsigned long long hash; /* XXH3 of the merged content (includes, --set) and of user kernels' files */
    const rl_value *root;    /* merged; the parts below point into it */
    const rl_value *capture; /* a path (text) or an inline manifest (map); NULL = must come from --capture */
    const char *ocio_config; /* path resolved against the file that names it, or NULL */
    const char *working;     /* working colour space, or NULL: the config's scene_linear role */
    rl_where color_where;
    const rl_value *profiles, *shading, *materials; /* maps or NULL, see materials.h */
    const rl_value *lights;  /* map, or NULL: the capture's own; `implied`: changes to those */
    const rl_value *ambient; /* map (ambient.h), or NULL */
    const rl_node *nodes;    /* in the order of the file */
    size_t n_nodes;
    const rl_output *outputs;
    size_t n_outputs;
} rl_pipeline;

/* --set on the tree of a pipeline: rl_value_set, and what removing (null) means here. Of lights that no file
 * of the pipeline lists it removes the capture's, by a null that stays in the implied map until the two are
 * merged. A path that leads to nothing is a warning with the nearest name (log may be NULL). */
rl_code rl_pipeline_set(rl_arena *arena, rl_value **root, const char *path, rl_value *v, const rl_log *log,
                        rl_error *err);

/* Parses a merged tree. User kernels (`pass: kernel`) become descriptors in the arena; their .cl file is read
 * here. Unknown keys, passes, parameters, ports: an error with the nearest name. Does not look at image names
 * (graph.h). */
rl_code rl_pipeline_parse(rl_arena *arena, const char *file, rl_value *root, const rl_log *log,
                          const rl_pipeline **out, rl_error *err);

/* The same with other passes than the build's. */
rl_code rl_pipeline_parse_from(const rl_registry *registry, rl_arena *arena, const char *file, rl_value *root,
                               const rl_log *log, const rl_pipeline **out, rl_error *err);

/* Expands {capture}, {frame:04}, {variant} and such in an output's file pattern; unknown names are an error.
 * {frame} is printf's %lld, {frame:04} %04lld. capture and variant may be NULL where there is none: a pattern
 * that asks for it is an error. */
rl_code rl_output_path(rl_arena *arena, const rl_output *output, const char *capture, long long frame,
                       const char *variant, const char **out, rl_error *err);

#ifdef __cplusplus
}
#endif
#endif
