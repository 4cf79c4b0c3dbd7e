/* What the tests of the published figures share: a frame of a shipped capture read with OpenEXR alone, as the
 * twins want it, and statistics of errors. Failures fail the running test; include cmocka.h first. */
#ifndef RL_TESTS_FIGURE_HELP_H
#define RL_TESTS_FIGURE_HELP_H

#include "graph/relit.h"
#include "tests/twin_shading.h"

#define FIGURE_CAPTURE "captures/monkey"

/* One frame of FIGURE_CAPTURE: images in the order of the lighting pass, materials 1…6 as entries 1…6 (all
 * rows at their defaults; 1, 3, 4 and 6 have a profile), its three lights. The camera is worked out here from
 * the header's attributes, not by the code under test. */
typedef struct figure_frame {
    frame_t frame;
    shade_image images[LIGHTING_PORTS]; /* layers that the capture lacks, and outputs: no data */
    shade_materials materials;
    light_t lights[3];
} figure_frame;

void figure_frame_read(figure_frame *f, int number);
void figure_frame_free(figure_frame *f);
/* Runs of the two passes on it, for twin_lighting and twin_combine. */
shade_run figure_lighting(const figure_frame *f);
shade_run figure_combine(const figure_frame *f);

/* A session on a pipeline's text, relative to the project's folder; one value may be set (or path is NULL).
 */
rl_session *figure_open(const char *pipeline, rl_setting set);
void figure_process(rl_session *s, long long frame, const rl_frame_data *data);
rl_image_view figure_image(rl_session *s, const char *name);

/* Differences, collected one at a time; zeroed at first, freed with figure_errors_free. */
typedef struct figure_errors {
    double *values;
    size_t n, room;
} figure_errors;

void figure_add(figure_errors *e, double value);
/* p in 0…1: 0.5 is the median, 1 the largest. Sorts. */
double figure_percentile(figure_errors *e, double p);
void figure_errors_free(figure_errors *e);

#endif
