/* Sequences of the analytic scene: written, run from files to files, judged. Include cmocka.h first. */
#ifndef RL_TESTS_CAPTURE_SEQUENCE_H
#define RL_TESTS_CAPTURE_SEQUENCE_H

#include "tests/capture_run.h"

/* capture_pipeline with temporal anti-aliasing behind it; output and name as there. */
extern const char sequence_with_taa[];

/* Scenes of frames 1…n, the camera a little further each time, and their files; the folder. */
char *sequence_make(const capture_form *form, scene *s, int n);
void sequence_leave(char *folder, scene *s, int n);
void sequence_remove(const char *folder, int frame);

/* What became of frames 1…15 of a run. */
typedef struct outcome {
    rl_code code[16];
    int files[16];
    char text[16][1600];
    uint64_t nonfinite[16], clamped[16];
    rl_run_summary summary;
} sequence_outcome;

/* Runs a capture; `out` is sequence_out(folder) unless options say otherwise. */
void sequence_run(const char *folder, const char *pipeline, rl_options options, sequence_outcome *o);
/* folder/out: outputs have the names of the capture's files. */
const char *sequence_out(const char *folder);

/* The largest difference of the red of an output from the truth, relative to its maximum. */
double sequence_off(const char *folder, const char *name, const scene *truth);

#endif
