/* For the tests of colour: passes run over random colours and compared with OpenColorIO. Functions fail the
 * test that calls them. */
#ifndef COLOR_HELP_H
#define COLOR_HELP_H

#include <stdbool.h>

#include "graph/run/color.h"

#define COLUMNS 256
#define ROWS    64
#define N       (COLUMNS * ROWS)

/* Opens the OpenCL device that everything below uses; false when there is none. */
bool color_help_start(void);
void color_help_stop(void);

/* 3 planes of N colours between low and high. */
void color_fill(float *planes, double low, double high);

/* in, out: 3 planes of N floats. */
void color_run(const rl_pass *pass, float exposure, const float *in, float *out);

rl_color_pass color_make_pass(const rl_ocio *ocio, const rl_ocio_request *request, rl_arena *arena,
                              const rl_log *log);

typedef struct difference {
    double absolute, clipped,
        relative; /* the largest; clipped: both sides brought to 0..1; relative to max(1, |x|) */
} difference;

/* Of the pass from OpenColorIO, over colours between low and high. */
difference color_compare(const rl_ocio *ocio, const rl_ocio_request *request, const rl_pass *pass, double low,
                         double high);

/* A config in `folder` with the spaces a (the reference) and b, `transform` (YAML) leading from a to b. */
rl_ocio *color_config(const char *folder, const char *transform);
void color_remove_folder(const char *folder); /* and the files that the tests put there */

#endif
