#include "graph/run/sink_image.h"

#include <stdlib.h>
#include <string.h>

#include "graph/relit.h"
#include "graph/run/image_file.h"

static rl_image_type image_type(rl_pixel_type type)
{
    switch (type) {
    case RL_UINT8:
        return RL_IMAGE_U8;
    case RL_UINT16:
        return RL_IMAGE_U16;
    case RL_HALF:
        return RL_IMAGE_HALF;
    default:
        return RL_IMAGE_FLOAT;
    }
}

rl_code rl_sink_write_image(const char *path, const rl_sink_output *output, const rl_sink_image *image, size_t first,
                            int width, int height, const rl_sink_frame *frame, rl_pool *pool, uint64_t *clamped,
                            rl_error *err)
{
    const rl_exr_box *d = &frame->display_window, *w = &frame->data_window;
    rl_image_planes planes = {.width = width, .height = height, .channels = image->planes, .stride = image->stride};
    if (image->format == RL_ID || image->planes > 3)
        return rl_fail_file(err, RL_E_CONFIG, path, "output '%s': ids and light layers can only be written as EXR",
                            output->spec->name);
    for (int i = 0; i < image->planes; i++)
        planes.plane[i] = image->pixels + (size_t)i * image->plane + first;
    int left = (int)(first % image->stride), top = (int)(first / image->stride);
    rl_image_note notes[] = {{"Software", "relit " RL_VERSION}, {"relit:pipeline", frame->pipeline}};
    rl_image_options options = {.type = image_type(output->spec->type),
                                .x = w->x0 + left,
                                .y = w->y0 + top,
                                .display = {d->x0, d->y0, d->x1 - d->x0 + 1, d->y1 - d->y0 + 1},
                                .colorspace = output->space,
                                .quality = output->spec->quality > 0 ? (int)output->spec->quality : 0,
                                .compression = output->spec->level,
                                .notes = notes,
                                .notes_n = sizeof notes / sizeof *notes};
    if (frame->crop) /* formats without windows would pad a crop: it stands for itself */
        memset(options.display, 0, sizeof options.display);
    rl_image_counts counts = {0};
    rl_code code = rl_image_file_write(path, &planes, &options, pool, &counts, err);
    *clamped += counts.clipped;
    return code;
}
