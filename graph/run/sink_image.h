/* The part of the sink that writes other formats than EXR, through the OpenImageIO module. */
#ifndef RL_RUN_SINK_IMAGE_H
#define RL_RUN_SINK_IMAGE_H

#include "graph/run/sink.h"

#ifdef __cplusplus
extern "C" {
#endif

/* `first` is the offset of the region's first pixel in the image's planes. */
rl_code rl_sink_write_image(const char *path, const rl_sink_output *output, const rl_sink_image *image,
                            size_t first, int width, int height, const rl_sink_frame *frame, rl_pool *pool,
                            uint64_t *clamped, rl_error *err);

#ifdef __cplusplus
}
#endif
#endif
