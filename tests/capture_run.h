/* Runs lighting and combine on a capture in a folder and compares what comes out with the scene. Include
 * cmocka.h first. */
#ifndef RL_TESTS_CAPTURE_RUN_H
#define RL_TESTS_CAPTURE_RUN_H

#include "graph/relit.h"
#include "tests/capture_write.h"

/* lighting (Lambert, no specular) and combine, all ids covered; images light.lit and c.color. */
extern const char capture_pipeline[];

/* Kernels are compiled once a test program: a folder of its own for their cache. False when there is none. */
bool capture_start(void);
void capture_stop(void);
/* The same as a group's setup and teardown. */
int capture_setup(void **state);
int capture_teardown(void **state);

/* A folder with frames 1 … `frames` of the scene with all lights, the key and rim shadowed, in this form. */
char *capture_lit(const capture_form *form, int frames);

/* A session on folder/capture.yaml that keeps color, depth, normal, stencil, albedo, motion and thickness.
 * Options that are set in `more` (may be NULL) are taken over. Fails the test on an error, which it prints.
 */
rl_session *capture_open(const char *path, const char *pipeline, const rl_options *more);

/* The image of the frame that was processed last, or a failed test. */
rl_image_view capture_image(rl_session *s, const char *name);

/* The largest |image - truth| over all planes, divided by `scale` (0: by the largest truth). Empty pixels
 * have no normal to compare. */
double capture_error(const rl_image_view *image, const scene *truth, int plane, int planes, double scale);

/* Warnings since capture_start or capture_log_clear. */
const char *capture_log(void);
void capture_log_clear(void);
extern const rl_log capture_logger;

#endif
