/* What the files that read a manifest share. Private to them. */
#ifndef RL_MODEL_MANIFEST_PARTS_H
#define RL_MODEL_MANIFEST_PARTS_H

#include "graph/model/manifest.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct rl_manifest_reader {
    rl_arena *arena;
    const rl_log *log;
    rl_error *err;
    rl_manifest *m;
    const char *presets;     /* the folder */
    const char *preset_file; /* the `where.file` of what came from the preset, or NULL */
} rl_manifest_reader;

/* m, cm, mm, or a number of metres. */
rl_code rl_manifest_unit(const rl_value *v, double *metres, rl_error *err);

/* Each reads one key of the manifest into r->m; v is NULL when the key is absent. */
rl_code rl_manifest_read_layers(rl_manifest_reader *r, const rl_value *v);
rl_code rl_manifest_read_camera(rl_manifest_reader *r, const rl_value *v);
/* Needs the layers. */
rl_code rl_manifest_read_files(rl_manifest_reader *r, const rl_value *v);
/* A spec, a number or a list of numbers. */
rl_code rl_manifest_read_frames(rl_manifest_reader *r, const rl_value *v, const char *name, rl_frames *out);
/* Needs the files: fills frames by looking, when `frames` was not given. */
rl_code rl_manifest_find_frames(rl_manifest_reader *r);
/* "shots/a_####.exr" -> "a" */
char *rl_manifest_stem(rl_arena *arena, const char *path);

#ifdef __cplusplus
}
#endif
#endif
