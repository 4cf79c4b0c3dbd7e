/* Writes one output of one frame: planes of the plan's buffers into an EXR, or another image format through
 * the OpenImageIO module. Called by the writer's thread. */
#ifndef RL_RUN_SINK_H
#define RL_RUN_SINK_H

#include "graph/base/pool.h"
#include "graph/model/pipeline.h"
#include "graph/model/plan.h"
#include "graph/run/color.h"
#include "graph/run/exr.h"

#ifdef __cplusplus
extern "C" {
#endif

/* One image of an output, mapped. Pixel (0, 0) of the data window in plane i is at pixels + i * plane. */
typedef struct rl_sink_image {
    const char *name; /* of the layer, "" for an output with one image */
    rl_format format;
    int planes;
    const char *const *lights; /* RL_LIGHTS: the name of each plane */
    const float *pixels;       /* ids: their bits */
    size_t stride, plane;
} rl_sink_image;

typedef struct rl_sink_frame {
    rl_exr_box data_window, display_window;
    const int *crop;         /* x, y, width, height, or NULL */
    const uint32_t *stencil; /* dense, pixel (0, 0) of the data window: coverage is where it is not 0 */
    size_t stencil_stride;
    const rl_exr *source; /* attributes are taken over from there; NULL: none */
    int source_part;
    double fps;           /* written where the source has no framesPerSecond; 0 = not known */
    const char *pipeline; /* relit:pipeline */
    const char *capture;  /* relit:capture */
} rl_sink_frame;

typedef struct rl_sink_output {
    const rl_output *spec;
    const char *space;      /* the colour space of the pixels, or "display view"; NULL: data */
    rl_primaries primaries; /* known: chromaticities are written */
} rl_sink_output;

/* `path` is the final name; the file is whole or not there. *clamped grows by the samples beyond the range of
 * the file's type. RL_E_DATA when the crop misses the data window. */
rl_code rl_sink_write(const char *path, const rl_sink_output *output, const rl_sink_image *images,
                      size_t n_images, const rl_sink_frame *frame, rl_pool *pool, uint64_t *clamped,
                      rl_error *err);

#ifdef __cplusplus
}
#endif
#endif
