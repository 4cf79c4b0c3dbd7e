/* Inside of a session: what relit.h's functions share. Not installed. */
#ifndef RL_RUN_SESSION_H
#define RL_RUN_SESSION_H

#include "graph/base/arena.h"
#include "graph/base/pool.h"
#include "graph/model/manifest.h"
#include "graph/model/materials.h"
#include "graph/model/pipeline.h"
#include "graph/model/plan.h"
#include "graph/relit.h"
#include "graph/run/color.h"
#include "graph/run/executor.h"
#include "graph/run/reader.h"
#include "graph/run/sink.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A light that shines. */
typedef struct rl_active_light {
    const rl_light_spec *spec;
    const rl_layer *shadow, *thickness; /* the capture's layers for it, or NULL */
    int shadow_plane, thickness_plane;  /* of the ports, or -1 */
    float to_working[9]; /* from the colour space of its amounts, rows listed; its temperature's colour is in
                            it */
    int profile;         /* where its profile is in the table of all, 0 = none */
} rl_active_light;

/* Of a variant: the images that are compared (experiment.h), for people, and the output whose display, view,
 * look and exposure DISPLAY has ("sRGB / ACES": `space`). */
typedef struct rl_compared_names {
    const char *linear, *display;
    const char *space;
    const rl_output *shown;
} rl_compared_names;

/* One capture with all that depends on it. Constant after rl_session_open, except for the executor. */
typedef struct rl_sequence {
    rl_manifest *manifest;
    rl_frames frames; /* to be processed, in order */
    rl_active_light *lights;
    size_t n_lights;
    rl_light_setup setup;  /* what they and the sky need of the programs, and their tables */
    light_t *light_values; /* of the frame that runs */
    rl_light_planes shadow, thickness;
    const rl_materials *materials;
    const rl_node *nodes; /* the pipeline's, with this capture's sets of materials */
    const rl_graph *graph;
    const rl_plan *plan;
    size_t first_output;   /* where its outputs begin in a merged graph's (experiment.h); else 0 */
    rl_geometry geometry;  /* of the first frame */
    uint64_t decode_bytes; /* that reading it takes besides its buffers */
    rl_reader *reader;
    rl_executor *executor; /* NULL until prepared */
    uint64_t content; /* hash of the manifest, without paths and frames, and of the files of its lights */
    bool has_last;    /* the frame that ran last, and may be the past of the next one */
    int last_number;
    camera_t last_camera;
} rl_sequence;

struct rl_session {
    rl_arena arena;
    rl_options options;
    int threads;
    const rl_log *log;
    const rl_pipeline *pipeline;
    rl_ocio *ocio;
    const char *working;
    uint64_t colors;   /* hash of the OCIO configuration and of the files that it names */
    uint64_t content;  /* hash of the pipeline and of all files that it names, this configuration included */
    ambient_t ambient; /* in the working space */
    float *sky;        /* what surfaces mirror of it (kernels/shared.h), owned; NULL = nothing */
    size_t n_sky;
    rl_pool *pool;
    rl_device *device;
    rl_sink_output *outputs; /* the pipeline's that are wanted, then one for each dump */
    rl_wanted *wanted; /* the same, then the hidden ones: depth and stencil, and of a variant the images that
                          are compared */
    size_t n_outputs, n_hidden;
    const char *variant; /* NULL: none */
    rl_compared_names compared;
    rl_sequence *sequences;
    size_t n_sequences;
    size_t *ends; /* [n_sequences] how many frames captures 0…k have together */
    /* rl_session_process: its one frame */
    rl_frame frame;
    rl_sequence *frame_sequence; /* NULL: none yet */
    bool processed;
    rl_memory *
        *viewed; /* mapped for rl_session_image until the next call that processes or closes; owned array */
    size_t n_viewed;
};

/* session.c: rl_session_open for a variant of that name, which keeps the images that are compared. */
rl_code rl_session_open_variant(const rl_options *options, const char *variant, rl_session **out,
                                rl_error *err);

/* session_run.c: ends what rl_session_image gave out. */
void rl_session_end_views(rl_session *session);

/* session_color.c: opens the OCIO config, checks every colour name, makes the passes of the outputs. */
rl_code rl_session_colors(rl_session *session, rl_error *err);
/* The colour transform of an output as a pass, and what its file says of it. */
rl_code rl_session_make_output(rl_session *session, const rl_output *spec, rl_sink_output *out,
                               rl_wanted *wanted, rl_error *err);
/* The matrix from a linear colour space (named at `where`) to the working space. */
rl_code rl_session_light_matrix(const rl_session *session, const char *space, rl_where where, float m[9],
                                rl_error *err);

/* session_lights.c: the active lights of a capture; what the kernels see of them at a frame. */
rl_code rl_session_lights(rl_session *session, rl_sequence *sequence, rl_error *err);
/* session_absent.c: notes and warnings about what the passes of the plan have to do without. */
void rl_session_note_absent(const rl_session *session, const rl_sequence *sequence);
void rl_session_light_values(const rl_sequence *sequence, const camera_t *camera, light_t *out);

/* session_ambient.c: the pipeline's ambient light; reads its HDRI. */
rl_code rl_session_ambient(rl_session *session, rl_error *err);

/* session_content.c: finds the hashes of content. After all else: what is missing has been complained about.
 */
rl_code rl_session_content(rl_session *session, rl_error *err);

/* session_compared.c: adds the hidden outputs of what is compared. */
rl_code rl_session_compared(rl_session *session, rl_error *err);

/* session_capture.c: manifests, frames, materials, graph and plan of every capture. */
rl_code rl_session_sequences(rl_session *session, rl_error *err);
/* Makes the reader anew, for another plan: what frames are read into. */
rl_code rl_sequence_read_for(rl_session *session, rl_sequence *sequence, const rl_plan *plan, bool keep_ids,
                             rl_error *err);
bool rl_session_keeps_ids(const rl_session *session);
void rl_sequence_close(rl_sequence *sequence);

/* session_paths.c: no two outputs, captures or frames write one file. */
rl_code rl_session_paths(rl_session *session, rl_error *err);
/* Removes what a killed process left of the files that the session writes (leftovers.h). */
void rl_session_clean(const rl_session *session);

/* session_run.c (batches of frames: session_batch.c): runs the kernels on a loaded frame, and decides whether
 * history reaches it. `spans`: NULL, or plan->n_steps of them. */
rl_code rl_session_execute(rl_session *session, rl_sequence *sequence, rl_frame *frame, rl_span *spans,
                           rl_error *err);
/* The same with the lights and ambient lights of all scenes of the executor. */
rl_code rl_sequence_execute(rl_sequence *sequence, rl_frame *frame, const rl_scene_values *scenes,
                            rl_span *spans, rl_error *err);
/* Buffers follow the size of the frame that they hold. */
rl_code rl_session_fit_buffers(rl_sequence *sequence, rl_frame *frame, rl_error *err);
/* session_load.c: reads frame `index` of the sequence into frame->buffers, or what --on-missing puts in its
 * place. Errors are frame->error. */
typedef struct rl_loaded {
    bool skipped; /* missing, and not to be written */
    bool held;    /* the layers are of frame `source`: no past of the next one */
    bool broken;  /* its own files are missing, or no frame can be made of them */
    size_t source;
} rl_loaded;
rl_code rl_session_read(rl_session *session, rl_sequence *sequence, rl_frame *frame, int file_number,
                        rl_error *err); /* its own files alone */
void rl_session_load(rl_session *session, rl_sequence *sequence, size_t index, rl_frame *frame,
                     rl_loaded *out);
/* Writes all outputs of a frame that ran; files[0…n_outputs-1] (may be NULL: memory was out) get the names of
 * those that are whole. */
rl_code rl_session_write_frame(rl_session *session, rl_sequence *sequence, rl_frame *frame,
                               const rl_run_hooks *hooks, rl_arena *arena, const char **files,
                               size_t *n_files, rl_error *err);
/* Where the planes of a graph output's image are, mapped; unmap with the memory. */
rl_code rl_session_map_image(const rl_sequence *sequence, const rl_frame *frame, int buffer,
                             rl_sink_image *out, rl_memory **memory, rl_error *err);

/* session_shard.c: checks the options of shards and counts frames. */
rl_code rl_session_count(rl_session *session, rl_error *err);

/* session_memory.c: bytes that a run of a sequence allocates at most with so many frames in flight,
 * saturating: the plan's buffers, and what reading, writing and checkpoints take besides. 0 when the size is
 * not known (frames in memory). */
typedef struct rl_memory_need {
    size_t plan, decode, encode, checkpoint, total;
} rl_memory_need;
void rl_session_need(const rl_session *session, const rl_sequence *sequence, int in_flight,
                     rl_memory_need *out);
/* As many frames as overlap usefully and as the memory limit lets be in flight. */
enum { RL_MOST_IN_FLIGHT = 3 }; /* one is read, one runs, one is written */
int rl_session_in_flight(const rl_session *session, const rl_sequence *sequence);
/* Adds it to a printed plan. */
rl_code rl_session_print_need(const rl_session *session, const rl_sequence *sequence, bool json, rl_str *text,
                              rl_error *err);
rl_code rl_session_check_memory(const rl_session *session, rl_error *err);

#ifdef __cplusplus
}
#endif
#endif
