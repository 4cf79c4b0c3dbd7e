/* Checkpoints: the state of a run between two frames of a sequence, as a file in OUT/.relit/. A file under
 * its final name is whole, and says exactly what it is the state of: one that was made by another pipeline,
 * version, device or from other inputs is refused. */
#ifndef RL_RUN_CHECKPOINT_H
#define RL_RUN_CHECKPOINT_H

#include "graph/base/arena.h"
#include "graph/model/plan.h"
#include "kernels/shared.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What decides the bits of a picture besides its inputs: hashes, so that a complaint can say what differs. */
typedef enum rl_identity_part {
    RL_ID_VERSION,
    RL_ID_PIPELINE, /* its content and that of the files that it names; --only, --dump, --crop */
    RL_ID_CAPTURE,  /* the manifest without its paths and its list of frames; the colour configuration */
    RL_ID_PLAN,
    RL_ID_KERNELS, /* their texts and tables: colour transforms are in there */
    RL_ID_DEVICE,  /* its name, version and driver */
    RL_ID_PARTS
} rl_identity_part;

typedef struct rl_identity {
    uint64_t part[RL_ID_PARTS];
} rl_identity;

/* "the pipeline and the device differ"; "" when they do not. */
void rl_identity_difference(const rl_identity *a, const rl_identity *b, char *out, size_t size);

typedef struct rl_checkpoint {
    rl_identity identity;
    uint64_t chain; /* identity, and the inputs of all frames up to this one since history began */
    int frame;      /* after which */
    rl_geometry geometry;
    camera_t previous;
    void *history; /* owned; freed by rl_checkpoint_free */
    size_t bytes;  /* 0: none; it ended with that frame, which failed or was held */
} rl_checkpoint;

void rl_checkpoint_free(rl_checkpoint *checkpoint);

/* Whole or not there, on the disk when it returns. */
rl_code rl_checkpoint_write(const char *path, const rl_checkpoint *checkpoint, rl_error *err);

/* The header alone (history NULL, but its bytes), or all of it, its hash checked. RL_E_FORMAT when it is no
 * checkpoint of this layout or is damaged. */
rl_code rl_checkpoint_read(const char *path, bool whole, rl_checkpoint *out, rl_error *err);

/* "FOLDER/NAME.0012.checkpoint". */
char *rl_checkpoint_path(rl_arena *arena, const char *folder, const char *name, int frame);

/* The frames that checkpoints of that name are there for, in ascending order. No folder: none. */
rl_code rl_checkpoint_list(rl_arena *arena, const char *folder, const char *name, int **frames, size_t *n,
                           rl_error *err);

#ifdef __cplusplus
}
#endif
#endif
