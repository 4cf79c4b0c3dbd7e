/* Drives temporal anti-aliasing alone through the public API, over frames in memory. */
#ifndef RL_TESTS_TEMPORAL_RUN_H
#define RL_TESTS_TEMPORAL_RUN_H

#include "graph/relit.h"
#include "tests/temporal_scene.h"

typedef struct temporal_session {
    rl_session *session;
    rl_error err;
    char text[4096]; /* the pipeline */
} temporal_session;

/* A session whose graph is one pass `taa` over capture.albedo; `with_motion`: the capture has a motion layer.
 * `taa` is what the pass's map holds besides, ", blend: 0"; `more` are further lines of the manifest (" cuts:
 * [3]\n"). */
bool temporal_open(temporal_session *t, bool with_motion, const char *taa, const char *more,
                   const rl_log *log);
void temporal_close(temporal_session *t);

/* Runs the pass on a frame and copies its colour to rgb (three planes of the frame's size) and, when not
 * NULL, the number of frames that each pixel consists of to count. */
bool temporal_step(temporal_session *t, long long number, const temporal_frame *f, float *const rgb[3],
                   float *count);

/* ---- errors of a picture against the truth, white = 1 ---- */

double temporal_psnr(const temporal_frame *shape, float *const rgb[3], float *const truth[3]);
/* The error that a share of the samples does not exceed. */
double temporal_percentile(const temporal_frame *shape, float *const rgb[3], float *const truth[3],
                           double share);

/* ---- whole sequences ---- */

typedef struct temporal_report {
    double raw_psnr, psnr;         /* dB, over the frames that were compared: the samples; the results */
    double p95;                    /* 95th percentile of the error, the worst frame's */
    long disoccluded;              /* pixels, in all frames, whose surroundings were all hidden before */
    double disoccluded_difference; /* the largest difference between result and sample there */
    double behind, ahead; /* mean error of the background 1 to 8 pixels behind and in front of the sphere */
    double far_behind, far_behind_raw; /* 3 to 8 pixels behind: of the results, of the samples */
    temporal_frame frame;              /* the last one */
    float *result[3], *truth[3], *count;
} temporal_report;

/* Runs `frames` frames of a scene and compares the last `compared` ones with the truth of n * n samples. `t`
 * is open. Free the report in any case. */
bool temporal_sequence(temporal_session *t, const temporal_scene *scene, int frames, int compared, int n,
                       temporal_report *out);
void temporal_report_free(temporal_report *report);

#endif
