/* What reader.c and reader_convert.c share. */
#ifndef RL_RUN_READER_PARTS_H
#define RL_RUN_READER_PARTS_H

#include <pthread.h>

#include "graph/run/ingest.h"
#include "graph/run/reader.h"

enum { RL_MOST_BINDINGS = 96 };

/* A layer of the manifest and the planes that it fills. */
typedef struct rl_binding {
    const rl_layer *layer;
    int buffer; /* of the plan */
    int plane;  /* its first plane there */
    int n;      /* planes that it fills */
    bool is_stencil, is_depth, said_nonfinite;
    rl_ocio_transform *to_working; /* colours in another space; NULL: none needed */
} rl_binding;

struct rl_reader {
    rl_reader_setup setup;
    rl_binding bindings[RL_MOST_BINDINGS]; /* depth first: the stencil needs it */
    int n_bindings;
    int depth, stencil; /* bindings, or -1 */
    bool said_jitter, said_window, said_normals, said_empty;
};

/* A frame's planes on the host while it is read. */
typedef struct rl_frame_maps {
    float *base[RL_MOST_BINDINGS][3]; /* pixel (0, 0) of the data window */
    pthread_mutex_t mutex;            /* guards what follows, and the frame's counters */
    rl_unknown_ids unknown;
    uint64_t clamped;
    rl_error error;
} rl_frame_maps;

/* Converts rows of one layer whose raw values are there. Any thread. */
void rl_reader_convert(rl_reader *r, rl_frame *f, rl_frame_maps *maps, int binding, int y0, int y1);

/* Ids without a material: an error of the frame that names them. */
rl_code rl_reader_check_ids(const rl_reader *r, const rl_frame *f, const rl_frame_maps *maps, rl_error *err);

/* reader_header.c: the part of the file that holds all channels of a layer. */
rl_code rl_reader_find_part(const rl_layer *layer, const rl_exr *file, int *out, rl_error *err);

/* reader_pixels.c: samples of a layer of the frame that were NaN or infinite. A layer's first ones are a
 * warning. */
void rl_reader_count_nonfinite(rl_reader *r, rl_frame *f, int binding, uint64_t count, const char *file);

/* reader_pixels.c: what reading from files and from memory share. Map the planes, and make room for the
 * file's ids; convert all rows of a layer; unmap and give the frame's verdict (`code` is what happened
 * before). */
rl_code rl_reader_map(rl_reader *r, rl_frame *f, rl_frame_maps *maps, rl_error *err);
rl_code rl_reader_prepare_ids(rl_reader *r, rl_frame *f, rl_error *err);
void rl_reader_convert_all(rl_reader *r, rl_frame *f, rl_frame_maps *maps, int binding, rl_pool *pool);
rl_code rl_reader_finish(rl_reader *r, rl_frame *f, rl_frame_maps *maps, rl_code code, rl_error *err);

#endif
