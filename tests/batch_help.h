/* Runs over a small looped capture, for the tests of batches. Include cmocka.h first. */
#ifndef RL_TESTS_BATCH_HELP_H
#define RL_TESTS_BATCH_HELP_H

#include <stddef.h>
#include <sys/types.h>

#include "tests/tool_run.h"

typedef struct batch_place {
    char *folder;  /* temporary; all else lies in it */
    char *capture; /* a folder: `loop`, frames of captures/monkey_turn over and over */
    char *pipe;    /* lighting, combine, taa: one EXR a frame */
} batch_place;

/* Call from the repository's folder. */
batch_place batch_enter(int frames);
/* The same, with an undisturbed run in `plain`. */
batch_place batch_enter_plain(int frames);
void batch_leave(batch_place *place);

/* A run of the pipeline into place/out; `more` ends with NULL. Fails the test when the status is another. */
tool_result batch_run(const batch_place *place, const char *out, int status, const char *const *more);
#define BATCH(place, out, status, ...) batch_run(place, out, status, (const char *const[]){__VA_ARGS__, NULL})

/* The same in a process of its own, whose output goes to files in the folder; it runs when this returns. */
pid_t batch_start(const batch_place *place, const char *out, const char *const *more);

/* Both folders hold the same files with the same bytes, relit's own notes aside, and nothing temporary. */
void batch_assert_same(const batch_place *place, const char *a, const char *b);
/* How many files of one folder are missing in the other, or differ. */
int batch_differences(const batch_place *place, const char *a, const char *b);
/* How many names in place/out/.relit contain `part`. */
int batch_notes(const batch_place *place, const char *out, const char *part);

#endif
