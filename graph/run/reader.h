/* Reads the frames of one capture into the buffers of a plan: opens files, decodes only what the plan wants,
 * converts it to what relit works with (DESIGN 2) while the rows are in the cache. */
#ifndef RL_RUN_READER_H
#define RL_RUN_READER_H

#include "graph/base/pool.h"
#include "graph/model/manifest.h"
#include "graph/model/materials.h"
#include "graph/model/plan.h"
#include "graph/relit.h"
#include "graph/run/executor.h"
#include "graph/run/exr.h"
#include "graph/run/shim_ocio.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct rl_reader rl_reader;

enum { RL_MOST_FILES = 32 }; /* patterns of one capture */

/* A frame in flight. Zeroed at first; freed with rl_frame_free. Reused from frame to frame. */
typedef struct rl_frame {
    int number; /* under which it is processed */
    rl_geometry geometry;
    rl_exr_box data_window, display_window;
    camera_t camera;
    rl_frame_buffers *buffers;    /* of this geometry */
    rl_exr *files[RL_MOST_FILES]; /* open until the frame is released, for their attributes */
    int main_file, main_part;     /* that hold depth: cameras and metadata come from there */
    uint32_t *ids;                /* the stencil as the file has it, width*height; NULL unless asked for */
    size_t ids_room;
    uint64_t nonfinite, clamped; /* of the capture */
    uint64_t clipped;            /* of the outputs */
    rl_error error;              /* of any stage; the first one counts */
    double load_s, run_s, write_s;
} rl_frame;

/* Closes files; the buffers stay for the next frame. */
void rl_frame_release(rl_frame *frame);
void rl_frame_free(rl_frame *frame);

/* Where the planes of a layer's light come from, in the order of the planes. */
typedef struct rl_light_planes {
    const rl_layer *const *layers; /* [n] */
    const char *const *names; /* [n], of the lights, for files that hold the planes; the reader needs none */
    int n;
} rl_light_planes;

typedef struct rl_reader_setup {
    const rl_manifest *manifest; /* bound */
    const rl_plan *plan;
    const rl_materials *materials;
    rl_light_planes shadow, shadow_thickness;
    const rl_ocio *ocio;
    const char *working;
    bool keep_ids;
    uint64_t limit; /* bytes a file may make relit allocate; 0 = none */
    const rl_log *log;
} rl_reader_setup;

/* Keeps pointers to what the setup points to. */
rl_code rl_reader_new(const rl_reader_setup *setup, rl_reader **out, rl_error *err);
void rl_reader_free(rl_reader **reader);

/* Opens the files of frame `file_number` and reads headers: fills windows, geometry and camera, no pixel. */
rl_code rl_reader_open(rl_reader *reader, int file_number, rl_frame *frame, rl_error *err);

/* The files that a frame is read from, in the order of the manifest's patterns; paths in the arena. */
rl_code rl_reader_paths(const rl_reader *reader, int file_number, rl_arena *arena,
                        const char *paths[RL_MOST_FILES], size_t *n, rl_error *err);

/* Errors that say that a frame's files are missing or broken, which --on-missing is about. */
bool rl_reader_missed(rl_code code);

/* Reads the pixels of an opened frame into frame->buffers (made by the caller for frame->geometry). */
rl_code rl_reader_pixels(rl_reader *reader, rl_frame *frame, rl_pool *pool, rl_error *err);

/* Both for a frame in memory. */
rl_code rl_reader_memory(rl_reader *reader, const rl_frame_data *data, rl_frame *frame, rl_error *err);
rl_code rl_reader_memory_pixels(rl_reader *reader, const rl_frame_data *data, rl_frame *frame, rl_pool *pool,
                                rl_error *err);

#ifdef __cplusplus
}
#endif
#endif
