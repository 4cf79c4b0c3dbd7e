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
#include "graph/run/exr.h"
#include "graph/run/source.h"

#ifdef __cplusplus
extern "C" {
#endif

/* One capture with all that depends on it. Constant after rl_session_open, except for the executor. */
typedef struct rl_sequence {
    rl_source *source;
    const rl_materials *materials;
    const rl_graph *graph;
    const rl_plan *plan;
    const rl_source_plan *wanted; /* what of a frame must be read */
    rl_executor *executor;        /* NULL until prepared */
} rl_sequence;

/* How an output of the pipeline is written. */
typedef struct rl_sink_output {
    const rl_output *spec;
    const char *attribute_space; /* the colour space of the pixels, for metadata; NULL for data */
    rl_primaries primaries;      /* known: chromaticities are written */
    bool converted;              /* a colour pass runs in front */
} rl_sink_output;

struct rl_session {
    rl_arena arena;
    rl_options options;
    const rl_log *log;
    const rl_pipeline *pipeline;
    rl_ocio *ocio;
    const char *working;
    rl_pool *pool;
    rl_device *device;
    rl_sink_output *outputs; /* the pipeline's that are wanted, then one for each dump */
    rl_wanted *wanted;       /* the same, then a hidden one for depth and stencil */
    size_t n_outputs;
    rl_sequence *sequences;
    size_t n_sequences;
    /* rl_session_process: its one frame */
    rl_frame *frame;
    size_t frame_sequence;
    long long last_number;
    bool has_last;
};

/* session_color.c: opens the OCIO config, checks every colour name, makes the passes of the outputs. */
rl_code rl_session_colors(rl_session *session, rl_error *err);

#ifdef __cplusplus
}
#endif
#endif
