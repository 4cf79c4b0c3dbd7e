/* Outputs of one frame of the analytic scene, for tests that read them back. Include cmocka.h first. */
#ifndef RL_TESTS_OUTPUT_RUN_H
#define RL_TESTS_OUTPUT_RUN_H

#include "graph/relit.h"
#include "graph/run/exr.h"
#include "tests/capture_scene.h"

/* Data window -9,5 50x30 of the display window 0,0 72x48, shifted lens, wide pixels, all lights. */
extern scene output_truth;
extern const uint32_t output_ids[4]; /* what the scene's ids are in the file */

/* Of a group of tests. */
int output_setup(void **state);
int output_teardown(void **state);

/* Runs lighting and combine (c.color) with these outputs, a YAML map; the folder they are in. crop and
 * summary may be NULL. */
char *output_run(const char *outputs, const int *crop, rl_run_summary *summary);
rl_exr *output_open(const char *folder, const char *name);
/* One channel, malloc'ed, rows without gaps. */
float *output_floats(const rl_exr *file, const char *channel);
/* The channel is 1 where the scene has a surface, else 0. */
void output_expect_coverage(const rl_exr *file, const char *channel);

#endif
