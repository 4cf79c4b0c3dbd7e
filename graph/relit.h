/* relit's public C API: open a pipeline, set values, process frames from files or from memory, read images
 * back. `relit run` is written on nothing else.
 *
 *     rl_error err = {0};
 *     rl_options options = {.pipeline = "configs/skin.yaml"};
 *     rl_session *s = NULL;
 *     if (rl_session_open(&options, &s, &err) || rl_session_run(s, NULL, NULL, &err))
 *         ... err.file, err.line, err.text say what is wrong
 *     rl_session_close(&s);
 *
 * A session is used by one thread at a time. Several sessions may exist. Nothing here prints, and nothing
 * aborts. */
#ifndef RL_RELIT_H
#define RL_RELIT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "graph/base/error.h"
#include "graph/base/log.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RL_VERSION "0.1.0"

typedef struct rl_session rl_session;

/* ---- opening ---------------------------------------------------------------------------------------------
 */

/* A frame whose files are missing or broken: an error of that frame; or no output for it; or the layers and
 * the camera of the frame before it in the run under its number. Whichever, history ends there. */
typedef enum rl_on_missing { RL_MISSING_ERROR, RL_MISSING_SKIP, RL_MISSING_HOLD } rl_on_missing;

/* A value of the pipeline by its dotted path: {"graph.sss.taps", "55"}. `value` is one YAML value; "null"
 * removes. */
typedef struct rl_setting {
    const char *path, *value;
} rl_setting;

/* What `run`, `check` and `plan` share; all zero is a good start. Nothing is copied: strings must live as
 * long as the session. */
typedef struct rl_options {
    const char *pipeline; /* a file; or NULL with pipeline_text */
    const char
        *pipeline_text; /* a pipeline in memory; relative paths in it are relative to the working folder */
    const char *const *captures; /* replace the pipeline's own */
    size_t n_captures;
    const rl_setting *settings; /* in order; a later one wins */
    size_t n_settings;
    const char *frames;      /* "1-24", "1,5,9-12", "-10--1"; NULL = all */
    const char *out;         /* folder of the outputs; NULL = "out" */
    const char *const *only; /* outputs to make; none = all */
    size_t n_only;
    const char *const *dump; /* images of the graph that are written as EXR besides */
    size_t n_dump;
    int crop[4];           /* x, y, width, height in display-window pixels; width 0 = everything */
    int threads;           /* 0 = as many as processors */
    const char *device;    /* "cpu", "gpu", a number; NULL = a CPU device if there is one */
    uint64_t memory_limit; /* bytes; 0 = none */
    rl_on_missing on_missing;
    bool resume;  /* frames whose pictures are there, made of the same inputs by the same pipeline, stay */
    int shard[2]; /* {I, N}: the I-th of N parts, from 1; N = 0: everything */
    int preroll;  /* frames of warm-up before a shard's first; 0 = history comes from the shard before it */
    int checkpoint_frames; /* a checkpoint of history every so many frames; 0 = by what one costs */
    bool energy;           /* experiments keep the ledger of energy (graph/run/energy.h) */
    const char *ocio;      /* OpenColorIO config; NULL = the pipeline's, else $OCIO, else relit's own */
    const rl_log *log;
} rl_options;

/* Reads and checks everything that needs no pixel: pipeline, captures (headers of their first frames),
 * colour; makes the plan. On an error *out is NULL. */
rl_code rl_session_open(const rl_options *options, rl_session **out, rl_error *err);
void rl_session_close(rl_session **session);

/* Opens the device and builds the kernels. rl_session_run and _process do so when it has not happened yet. */
rl_code rl_session_prepare(rl_session *session, rl_error *err);

/* ---- looking ---------------------------------------------------------------------------------------------
 */

size_t rl_session_captures(const rl_session *session);
const char *rl_session_capture_name(const rl_session *session, size_t capture);
/* Frame numbers that a run processes, in order; 0 for captures and frames that do not exist. */
size_t rl_session_frames(const rl_session *session, size_t capture);
long long rl_session_frame(const rl_session *session, size_t capture, size_t i);

typedef enum rl_plan_format { RL_PLAN_TEXT, RL_PLAN_DOT, RL_PLAN_JSON } rl_plan_format;
/* The plan of a capture. *text is freed with rl_text_free. */
rl_code rl_session_plan(const rl_session *session, size_t capture, rl_plan_format format, char **text,
                        rl_error *err);
void rl_text_free(char *text);

/* What a run with options.shard does to a capture. */
typedef struct rl_shard_part {
    size_t n;              /* frames that it writes; 0: none, and nothing below counts */
    long long first, last; /* the first and the last of them */
    bool history;          /* the graph keeps history */
    size_t preroll;        /* frames of warm-up before them, fewer than asked for behind a cut: then exact */
    bool exact;            /* the pictures are those of one run over all frames, bit for bit */
    bool takes_over, hands_over; /* history, from the checkpoint after frame `from`; after its last frame */
    long long from;
} rl_shard_part;
void rl_session_shard(const rl_session *session, size_t capture, rl_shard_part *out);

/* A node that keeps history: the least share that a frame has in its result, < 0 when the pass does not say.
 * What lies before K frames of warm-up then has at most the share (1 - least)^(K+1) in the first picture
 * behind them. */
typedef struct rl_fading {
    const char *node, *pass;
    double least;
    const char *where; /* where that holds; NULL when least < 0 */
} rl_fading;
/* The i-th of a capture's live nodes with history; false when there is none. */
bool rl_session_fading(const rl_session *session, size_t capture, size_t i, rl_fading *out);

/* ---- processing files ------------------------------------------------------------------------------------
 */

/* What became of a frame. Lives during the callback. */
typedef struct rl_frame_result {
    const char *capture;
    long long frame;
    const rl_error *error; /* code RL_OK when it went well */
    size_t n_files;        /* written */
    const char *const *files;
    uint64_t nonfinite, clamped; /* samples of the capture that were NaN or infinite (now 0), or clamped */
    uint64_t clipped;            /* samples of the outputs beyond what their files can hold */
    double load_s, run_s,
        write_s;        /* seconds in each stage; < 0: not known of this frame alone, nor the counts */
    size_t done, total; /* frames of the whole run, this one included */
} rl_frame_result;

/* What took which time: a stage of a frame (category "read", "run", "write"), within "write" an output that
 * was encoded ("encode"), a checkpoint that was written ("checkpoint") and what `frame` of an experiment did
 * with the pictures ("compare"), or a step on the device ("kernel", "colour", "convert", "copy"). */
typedef enum rl_lane { RL_LANE_READ, RL_LANE_RUN, RL_LANE_DEVICE, RL_LANE_WRITE, RL_LANES } rl_lane;

typedef struct rl_run_span {
    rl_lane lane; /* the thread, or the device's queue; spans of one lane nest or follow each other */
    const char *category, *name, *capture; /* live during the callback */
    long long frame;
    uint64_t start, end; /* ns on CLOCK_MONOTONIC */
} rl_run_span;

typedef struct rl_run_hooks {
    void (*frame)(void *ctx, const rl_frame_result *result); /* in order of completion, one at a time */
    int (*stop)(void *ctx); /* asked before each frame: nonzero finishes the frames in flight and returns
                               RL_E_CANCELLED */
    void *ctx;
    /* What happens meanwhile; may be NULL. Any thread; span several at a time. */
    void (*stage)(void *ctx, rl_lane lane, long long frame); /* begins to read, run or write a frame */
    void (*span)(void *ctx, const rl_run_span *span);        /* has ended */
} rl_run_hooks;

typedef struct rl_run_summary {
    size_t frames, failed;
    size_t skipped; /* frames that a resumed run found done */
    bool lacking;   /* the shard before this one has not handed over its history yet: nothing was written */
    bool stuck;     /* this shard could not hand over its own: all else was written */
    uint64_t nonfinite, clamped, clipped;
    size_t peak_bytes; /* the most that relit had allocated, device buffers included */
} rl_run_summary;

/* All frames of all captures. Reading, kernels and writing overlap. A frame that fails does not stop the
 * others: RL_OK is returned and the summary counts it. hooks and summary may be NULL. */
rl_code rl_session_run(rl_session *session, const rl_run_hooks *hooks, rl_run_summary *summary,
                       rl_error *err);

/* ---- processing memory, reading back ---------------------------------------------------------------------
 */

/* For frames that never were a file the capture says `files: memory` (tests/example.c).
 *
 * A channel as a file would have it, named as in the manifest's `layers`. One of floats and ids. Row 0 is the
 * top row; `stride` counts elements from row to row. The caller keeps the memory. */
typedef struct rl_channel_data {
    const char *name;
    const float *floats;
    const uint32_t *ids;
    size_t stride;
} rl_channel_data;

typedef struct rl_frame_data {
    int x, y, width, height; /* data window, display-window pixels */
    int display[4];          /* x, y, width, height; width 0 = the data window */
    const rl_channel_data *channels;
    size_t n_channels;
    double world_to_camera[16]; /* rows listed, column vectors (M·p), in the manifest's `forward` convention;
                                   used when the manifest says `matrix: header` */
    double fov_x;               /* radians; used when the manifest says `fov_x: header` */
    double jitter[2];           /* pixels; used when the manifest says `jitter: header` */
} rl_frame_data;

/* Runs the graph on one frame; frames of a sequence must come in order: history ends at a gap of the numbers,
 * at a `cuts:` of the manifest, at a jump of the camera, when the size changes, and after a frame that
 * failed. Nothing is written: read the images. With data NULL the frame is read from the session's capture.
 */
rl_code rl_session_process(rl_session *session, size_t capture, long long frame, const rl_frame_data *data,
                           rl_error *err);
/* Forgets history. */
void rl_session_cut(rl_session *session);

/* An image that the session's outputs (or `dump`) ask for, of the last processed frame: "light.diffuse".
 * Planes R, G, B and such; ids, as the capture has them, are given as floats' bits (format "id"). Valid until
 * the next call that processes or closes. */
typedef struct rl_image_view {
    int x, y, width, height; /* data window */
    int planes;
    const char *format;     /* "rgb", "normal", "vec2", "scalar", "id", "lights" */
    const float *plane[16]; /* the first 16; "lights" may have more */
    size_t stride;          /* floats from row to row */
    size_t plane_stride;    /* from plane to plane: plane i is at plane[0] + i * plane_stride */
} rl_image_view;

rl_code rl_session_image(rl_session *session, const char *image, rl_image_view *out, rl_error *err);

#ifdef __cplusplus
}
#endif
#endif
