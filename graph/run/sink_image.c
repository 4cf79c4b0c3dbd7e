#include "graph/run/sink_image.h"

#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
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

/* Formats without windows show the display window: what lies beyond it is cut off, what has no data is black.
 * Gives planes of that size, whose memory is *room; NULL when the data window is the display window. */
static rl_code fill_display(const rl_sink_frame *frame, rl_image_planes *planes, float **room, rl_error *err)
{
    const rl_exr_box *d = &frame->display_window, *w = &frame->data_window;
    if (!memcmp(d, w, sizeof *d))
        return RL_OK;
    int width = d->x1 - d->x0 + 1, height = d->y1 - d->y0 + 1;
    int x0 = w->x0 > d->x0 ? w->x0 : d->x0, x1 = w->x1 < d->x1 ? w->x1 : d->x1;
    size_t plane = (size_t)width * (size_t)height;
    *room = rl_calloc(plane * (size_t)planes->channels, sizeof **room);
    if (!*room)
        return rl_fail_memory(err, plane * (size_t)planes->channels * sizeof **room);
    for (int c = 0; c < planes->channels; c++) {
        float *to = *room + plane * (size_t)c;
        for (int y = w->y0 > d->y0 ? w->y0 : d->y0; y <= (w->y1 < d->y1 ? w->y1 : d->y1) && x1 >= x0; y++)
            memcpy(to + (size_t)(y - d->y0) * (size_t)width + (x0 - d->x0),
                   planes->plane[c] + (size_t)(y - w->y0) * planes->stride + (x0 - w->x0),
                   (size_t)(x1 - x0 + 1) * sizeof *to);
        planes->plane[c] = to;
    }
    planes->width = width;
    planes->height = height;
    planes->stride = (size_t)width;
    return RL_OK;
}

rl_code rl_sink_write_image(const char *path, const rl_sink_output *output, const rl_sink_image *image,
                            size_t first, int width, int height, const rl_sink_frame *frame, rl_pool *pool,
                            uint64_t *clamped, rl_error *err)
{
    rl_image_planes planes = {
        .width = width, .height = height, .channels = image->planes, .stride = image->stride};
    if (image->format == RL_ID || image->planes > 3)
        return rl_fail_file(err, RL_E_CONFIG, path,
                            "output '%s': ids and light layers can only be written as EXR",
                            output->spec->name);
    for (int i = 0; i < image->planes; i++)
        planes.plane[i] = image->pixels + (size_t)i * image->plane + first;
    rl_image_note notes[] = {{"Software", "relit " RL_VERSION},
                             {"relit:pipeline", frame->pipeline},
                             {"relit:capture", frame->capture}};
    rl_image_options options = {.type = image_type(output->spec->type),
                                .colorspace = output->space,
                                .quality = output->spec->quality > 0 ? (int)output->spec->quality : 0,
                                .compression = output->spec->level,
                                .notes = notes,
                                .notes_n = sizeof notes / sizeof *notes};
    rl_image_counts counts = {0};
    float *room = NULL;
    rl_code code =
        frame->crop ? RL_OK : fill_display(frame, &planes, &room, err); /* a crop stands for itself */
    if (!code)
        code = rl_image_file_write(path, &planes, &options, pool, &counts, err);
    *clamped += counts.clipped;
    rl_free(room);
    return code;
}
