/* The capture manifest (capture.yaml): what a sequence of recorded frames holds, and by which conventions.
 * Parsed and checked; no image file is opened here. Everything lives in the arena and is constant after
 * rl_manifest_parse, except for what rl_manifest_bind fills in. */
#ifndef RL_MODEL_MANIFEST_H
#define RL_MODEL_MANIFEST_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "graph/base/arena.h"
#include "graph/base/error.h"
#include "graph/base/log.h"
#include "graph/base/text.h"
#include "graph/model/frames.h"
#include "graph/model/lights.h"
#include "graph/model/pass.h"
#include "graph/model/value.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- layers ---- */

typedef enum rl_layer_id {
    RL_LAYER_ALBEDO,
    RL_LAYER_NORMAL,
    RL_LAYER_DEPTH,
    RL_LAYER_STENCIL,
    RL_LAYER_THICKNESS,
    RL_LAYER_SHADOW,           /* one for each light that has it */
    RL_LAYER_SHADOW_THICKNESS, /* the same */
    RL_LAYER_MOTION,
    RL_LAYER_ROUGHNESS,
    RL_LAYER_SPECULAR,
    RL_LAYER_METALLIC,
    RL_LAYER_EMISSION,
    RL_LAYER_CURVATURE,
    RL_LAYER_BACK_DEPTH,
    RL_LAYER_BACK_NORMAL,
    RL_LAYER_BACK_ALBEDO,
    RL_LAYER_COUNT
} rl_layer_id;

/* What every layer of a kind is: the table that parsing, defaults, printing and `relit inspect` read. */
typedef struct rl_layer_type {
    const char *name;
    rl_format format;
    int channels;
    bool required, per_light;
    const char *keys[8]; /* beside channels and part */
    const char *help;
} rl_layer_type;
extern const rl_layer_type rl_layer_types[RL_LAYER_COUNT];

typedef enum rl_space { RL_SPACE_WORLD, RL_SPACE_CAMERA } rl_space;
/* signed: as is; unsigned: 2v - 1; octahedral: two channels in -1..1 (Cigolle et al. 2014) */
typedef enum rl_encoding { RL_ENCODING_SIGNED, RL_ENCODING_UNSIGNED, RL_ENCODING_OCTAHEDRAL } rl_encoding;
typedef enum rl_depth_kind { RL_DEPTH_PLANAR, RL_DEPTH_RADIAL, RL_DEPTH_DEVICE } rl_depth_kind;
/* pixels; uv: fractions of the image, 0..1 across; ndc: -1..1 across */
typedef enum rl_motion_unit { RL_MOTION_PIXELS, RL_MOTION_UV, RL_MOTION_NDC } rl_motion_unit;

typedef struct rl_layer {
    rl_layer_id id;
    const char *name;  /* "albedo", "shadow.key" */
    const char *light; /* "key"; NULL unless per light */
    rl_where where;

    /* Alternatives of n_channels names each, one after the other; after rl_manifest_bind one is left. A name
     * may hold one '*' (presets: the view layer's name). */
    const char **channels;
    int n_channels, n_alternatives; /* 0, 0: a stencil that is constant */
    const char *part;               /* of a multi-part file; NULL: whichever has the channels */
    int pattern;                    /* index into rl_manifest.patterns */
    bool from_preset; /* not the user's own: dropped by rl_manifest_bind when the file lacks it */

    const char *colorspace; /* albedo, emission, back_albedo */
    rl_where colorspace_where;
    rl_space space; /* normals */
    rl_encoding encoding;
    int axes[3]; /* normals: which of the file's axes are x, y, z: 1, 2, 3, or negative; 1, 2, 3 as a rule */
    rl_depth_kind kind;   /* depths */
    bool hashed;          /* stencil: Cryptomatte, the bits of a float are the id */
    uint32_t constant;    /* stencil: the id of all pixels, when n_channels is 0 */
    double near_m, far_m; /* RL_DEPTH_DEVICE; metres, 0 < near < far, far may be infinite */
    bool negated;         /* depths: the file has -z, as view space looks down -z; all below is of +z */
    bool reversed;        /* RL_DEPTH_DEVICE: 1 at the near plane */
    double empty;         /* the file's value from which on (reversed: down to which) a pixel is empty */
    double scale;         /* lengths: metres a unit of the file; curvature: 1/m a unit */
    bool remapped;        /* the file's 0..1 stands for remap[0]..remap[1] of its unit */
    double remap[2];
    rl_motion_unit motion_unit;
    bool points_next; /* the vector leads from the previous position to here: negate it. (A vector to the
                       * next frame's position is taken for that: right for constant velocity.) */
    bool y_up;
} rl_layer;

/* Planar depth in metres of the file's value `raw`; `slope` is the length of the pixel's view ray per unit of
 * planar depth (>= 1), used by radial depth. Infinite or NaN values are the caller's. */
double rl_layer_depth(const rl_layer *layer, double raw, double slope);
/* Whether a pixel of this value is empty: beyond `empty`, infinite, NaN, or not in front of the camera. */
bool rl_layer_is_empty(const rl_layer *layer, double raw);

/* ---- camera ---- */

typedef enum rl_source { RL_SOURCE_HEADER, RL_SOURCE_ONE, RL_SOURCE_LIST } rl_source;

typedef struct rl_camera_spec {
    rl_where where;
    rl_source matrix_source, fov_source, jitter_source;
    double (*matrix)[16]; /* world to camera, column vectors, rows listed; positions in the capture's unit */
    double *fov_x;        /* radians */
    double (*jitter)[2];  /* pixels, x right, y down */
    size_t n_matrix, n_fov, n_jitter; /* 1, or one a frame of rl_manifest.frames */
    bool forward_z;                   /* forward: +z, left-handed */
    bool has_shift;                   /* else the header's screen window says it */
    double shift[2]; /* of the lens: the image is moved right and up, in widths of the display window */
} rl_camera_spec;

/* ---- the manifest ---- */

typedef struct rl_pattern {
    const char *path; /* resolved against the file that names it; with #### or %04d, or neither */
    rl_where where;
    bool numbered;
} rl_pattern;

typedef struct rl_stencil_label {
    uint32_t id; /* negative ids of signed writers are the same 32 bits */
    const char *name;
} rl_stencil_label;

typedef struct rl_manifest {
    rl_where where;
    const char *name;
    const char *description, *license; /* NULL when not given */
    const char *preset;                /* NULL when none */
    double fps;                        /* 0: not given */
    double unit;                       /* metres */
    rl_pattern *patterns;
    int n_patterns;    /* 0: `files: memory`, frames come through the C API */
    rl_frames frames;  /* listed or found; {1} when no file is numbered */
    bool frames_found; /* by looking into the folder */
    rl_camera_spec camera;
    rl_layer *layers;
    int n_layers;
    rl_lights lights;
    rl_value *lights_written; /* the map that they were read from; NULL when there is none */
    rl_stencil_label *stencil_names;
    size_t n_stencil_names;
    rl_frames cuts; /* frames that start a new shot */
} rl_manifest;

/* From a value tree (a file, or inline in a pipeline). `presets` is the folder of presets, may be NULL. What
 * is not stated and matters is assumed as relit works (metres, world space, planar) with a note in `log`. */
rl_code rl_manifest_parse(rl_arena *arena, const rl_value *v, const char *presets, const rl_log *log,
                          rl_manifest **out, rl_error *err);

/* From a capture.yaml, or a folder that holds one. */
rl_code rl_manifest_load(rl_arena *arena, const char *path, const char *presets, const rl_log *log,
                         rl_manifest **out, rl_error *err);

/* For a bare EXR file or pattern without manifest, by the rules of a preset. A single file keeps the frame
 * number of its name. Without a preset (NULL) the manifest has files and frames, but no layers. */
rl_code rl_manifest_bare(rl_arena *arena, const char *files, const char *preset, const char *presets,
                         const rl_log *log, rl_manifest **out, rl_error *err);

/* The layer of a name ("normal", "shadow.key"), or NULL. */
const rl_layer *rl_manifest_layer(const rl_manifest *m, const char *name);
/* The name of a stencil id, or NULL; the id of a name: false when there is none. */
const char *rl_manifest_stencil_name(const rl_manifest *m, uint32_t id);
bool rl_manifest_stencil_id(const rl_manifest *m, const char *name, uint32_t *id);

/* The file that holds a layer at a frame; NULL when memory is out. */
char *rl_manifest_path(rl_arena *arena, const rl_manifest *m, const rl_layer *layer, int frame);

/* World to view of a frame as the kernels want it: 3 rows of 4, column vectors, metres, looking down -z.
 * `header` is the file's worldToCamera (16 floats as stored), NULL when it has none: then an error if the
 * manifest wants it. A matrix that does more than rotate, mirror and shift is an error: relit measures
 * lengths in view space. `frame` must be in m->frames. */
rl_code rl_manifest_view(const rl_manifest *m, int frame, const float *header, double out[12], rl_error *err);
/* Radians, and pixels (x right, y down); NULL when the header is to be asked. */
const double *rl_manifest_fov_x(const rl_manifest *m, int frame);
const double *rl_manifest_jitter(const rl_manifest *m, int frame);

/* ---- files' channels and presets (presets.c) ---- */

typedef struct rl_channel {
    const char *part; /* NULL or "" in a single-part file */
    const char *name;
} rl_channel;

/* Chooses among alternatives and fills in '*' from the channels that one frame's file holds; layers of a
 * preset that it lacks are dropped, layers of the user are left as they are. Call it for one pattern's file
 * (`file`, for errors), with the pattern's index, before the layers of that pattern are read. Manifests
 * without preset are left as they are. A required layer that is not there is an error, or dropped, too, when
 * `file` is NULL: for a manifest to start from. */
rl_code rl_manifest_bind(rl_arena *arena, rl_manifest *m, int pattern, const char *file,
                         const rl_channel *channels, size_t n, rl_error *err);

/* The same for a manifest of one pattern, without an error for required layers that are not there: they go.
 */
rl_code rl_manifest_bind_found(rl_arena *arena, rl_manifest *m, const rl_channel *channels, size_t n,
                               rl_error *err);

/* The error of a file that lacks a channel of a layer: says what is needed, what is there, and where to set
 * it. */
rl_code rl_layer_missing(const rl_layer *layer, const char *file, const rl_channel *channels, size_t n,
                         rl_error *err);

typedef struct rl_preset_match {
    const char *name;     /* NULL when no preset finds even one layer */
    int layers;           /* that it finds */
    int missing_required; /* of albedo, normal, depth, stencil; 0 = a bare file works */
    const char *missing;  /* "stencil, albedo" */
} rl_preset_match;

/* The preset of the folder that fits the channels of a file best: fewest required layers missing, then most
 * layers found, then by name. */
rl_code rl_preset_find(rl_arena *arena, const char *presets, const rl_channel *channels, size_t n,
                       rl_preset_match *out, rl_error *err);

/* What a preset says to its users. */
typedef struct rl_preset_words {
    const char *help;   /* one line */
    const char **check; /* what to look after, a line each */
    size_t n_check;
} rl_preset_words;
rl_code rl_preset_about(rl_arena *arena, const char *presets, const char *name, rl_preset_words *out,
                        rl_error *err);

/* A preset's value tree, without its own keys; an unknown name suggests the nearest. */
rl_code rl_preset_load(rl_arena *arena, const char *presets, const char *name, rl_where where, rl_value **out,
                       rl_error *err);

/* ---- printing (manifest_print.c) ---- */

/* The manifest as a capture.yaml that reads back as the same one; paths as they are. */
void rl_manifest_print(const rl_manifest *m, rl_str *out);

#ifdef __cplusplus
}
#endif
#endif
