/* A capture of three frames of 64 x 48 pixels that is written in a blink, a pipeline that uses most of the
 * engine on it, and runs of that pipeline whose results are checked: for tests of what goes wrong. Include
 * cmocka.h first. */
#ifndef RL_TESTS_SMALL_CAPTURE_H
#define RL_TESTS_SMALL_CAPTURE_H

#include <stdbool.h>
#include <stddef.h>

#include "graph/relit.h"

enum { SMALL_WIDTH = 64, SMALL_HEIGHT = 48, SMALL_FRAMES = 3, SMALL_OUTPUTS = 3 };

/* capture.yaml, s.0001.exr … s.0003.exr and pipe.yaml in `folder`. */
void small_capture_write(const char *folder);
extern const char small_manifest[], small_pipeline[];

/* A group's setup and teardown: a fresh folder with the capture in it, its pipeline, and `out` in it, which
 * is not there yet. */
int small_setup(void **state);
int small_teardown(void **state);
extern char *small_folder, *small_pipe, *small_out;

/* What became of a session that opened, ran and closed. */
typedef struct small_run {
    rl_code code; /* of the first call that failed */
    bool opened;
    rl_error err;
    rl_run_summary summary;
    int good, bad; /* frames reported */
    rl_code frame_code[SMALL_FRAMES + 1];
} small_run;

/* Opens, prepares, runs and closes folder/pipe.yaml into `out`. Checks on the way: every error has a code and
 * a text, a good frame reports all its files, nothing that rl_alloc counts is left behind. */
small_run small_run_once(const char *folder, const char *out);

/* Every file in `out` is a whole image under a final name; returns how many. Fails the test otherwise. */
int small_check_files(const char *out);

#endif
