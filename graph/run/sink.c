#include "graph/run/sink.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "graph/base/alloc.h"
#include "graph/base/arena.h"
#include "graph/base/file.h"
#include "graph/relit.h"
#include "graph/run/sink_image.h"

/* What of the source's header stays true of the result: cameras, time, what a studio put there. */
static const char *const kept_attributes[] = {"camera:*",
                                              "worldToCamera",
                                              "worldToNDC",
                                              "cameraTransform",
                                              "cameraFov",
                                              "unreal/*",
                                              "timeCode",
                                              "framesPerSecond",
                                              "capDate",
                                              "utcOffset",
                                              "longitude",
                                              "latitude",
                                              "altitude",
                                              "focus",
                                              "expTime",
                                              "aperture",
                                              "isoSpeed",
                                              "owner",
                                              "comments",
                                              "reelName",
                                              "imageCounter",
                                              "cameraMake",
                                              "cameraModel",
                                              "cameraSerialNumber",
                                              "lensMake",
                                              "lensModel",
                                              "originalDataWindow",
                                              "nominalFocalLength",
                                              "pinholeFocalLength",
                                              "effectiveFocalLength"};

/* The part of the data window that is written, relative to it. */
typedef struct region {
    int x0, y0, width, height;
    rl_exr_box window; /* the same in display-window pixels */
} region;

static rl_code crop_region(const rl_sink_frame *f, region *r, rl_error *err)
{
    rl_exr_box d = f->data_window, w = d;
    if (f->crop) {
        const int *c = f->crop;
        w.x0 = c[0] > d.x0 ? c[0] : d.x0;
        w.y0 = c[1] > d.y0 ? c[1] : d.y0;
        long long x1 = (long long)c[0] + c[2] - 1, y1 = (long long)c[1] + c[3] - 1;
        w.x1 = x1 < d.x1 ? (int)x1 : d.x1;
        w.y1 = y1 < d.y1 ? (int)y1 : d.y1;
        if (w.x1 < w.x0 || w.y1 < w.y0)
            return rl_fail(err, RL_E_DATA, RL_NOWHERE,
                           "--crop %d,%d,%d,%d lies outside of the data window (%d, %d) - (%d, %d)", c[0],
                           c[1], c[2], c[3], d.x0, d.y0, d.x1, d.y1);
    }
    *r = (region){.x0 = w.x0 - d.x0,
                  .y0 = w.y0 - d.y0,
                  .width = w.x1 - w.x0 + 1,
                  .height = w.y1 - w.y0 + 1,
                  .window = w};
    return RL_OK;
}

/* Channel letters of DESIGN 3: R G B (A), X Y Z, V, ID. A plane a light has the light's name. */
static const char *const *letters(rl_format format, int *n)
{
    static const char *const rgb[] = {"R", "G", "B"}, *const xyz[] = {"X", "Y", "Z"}, *const v[] = {"V"},
                             *const id[] = {"ID"};
    switch (format) {
    case RL_RGB:
        *n = 3;
        return rgb;
    case RL_NORMAL:
        *n = 3;
        return xyz;
    case RL_VEC2:
        *n = 2;
        return xyz;
    case RL_ID:
        *n = 1;
        return id;
    default:
        *n = 1;
        return v;
    }
}

typedef struct channel_list {
    rl_exr_source *rows; /* with room for all */
    size_t n;
    rl_arena arena; /* of the rows and their names */
    bool failed;    /* out of memory */
} channel_list;

/* Room for the planes of all images and a coverage for each. */
static void list_begin(channel_list *list, const rl_sink_image *images, size_t n)
{
    size_t most = n;
    for (size_t i = 0; i < n; i++)
        most += (size_t)images[i].planes;
    list->rows = rl_arena_array(&list->arena, most, sizeof *list->rows);
    list->failed = !list->rows;
}

static void add_channel(channel_list *list, const char *layer, const char *letter, rl_exr_source source)
{
    source.name = *layer ? rl_arena_printf(&list->arena, "%s.%s", layer, letter)
                         : rl_arena_strdup(&list->arena, letter);
    list->failed |= !source.name;
    if (!list->failed)
        list->rows[list->n++] = source;
}

static void add_image(channel_list *list, const rl_sink_image *image, rl_exr_pixel type, const region *r)
{
    int n;
    const char *const *names = letters(image->format, &n);
    size_t at = (size_t)r->y0 * image->stride + (size_t)r->x0;
    for (int i = 0; i < image->planes; i++) {
        const char *letter = image->lights ? image->lights[i]
                             : i < n       ? names[i]
                                           : rl_arena_printf(&list->arena, "V%d", i);
        rl_exr_source s = {
            .stride = image->stride, .type = type, .floats = image->pixels + (size_t)i * image->plane + at};
        if (image->format == RL_ID) {
            s.type = RL_EXR_UINT;
            s.ids = (const uint32_t *)(const void *)s.floats;
            s.floats = NULL;
        }
        list->failed |= !letter;
        if (letter)
            add_channel(list, image->name, letter, s);
    }
}

/* An rgb image carries coverage as A, 1 where there is a material: its own layer's, or the file's when
 * several layers share it. */
static void add_coverage(channel_list *list, const rl_sink_image *images, size_t n, const rl_sink_frame *f,
                         const region *r, rl_exr_pixel type)
{
    const uint32_t *ids = f->stencil + (size_t)r->y0 * f->stencil_stride + r->x0;
    for (size_t i = 0; i < n; i++)
        if (images[i].format == RL_RGB)
            add_channel(list, images[i].name, "A",
                        (rl_exr_source){.type = type, .ids = ids, .stride = f->stencil_stride});
}

/* 24 is 24/1, 23.976… of broadcast 24000/1001, anything else thousandths. */
static rl_exr_value rational_fps(double fps)
{
    static const int denominators[] = {1, 1001, 1000};
    rl_exr_value v = {.type = RL_EXR_T_RATIONAL};
    for (int i = 0; i < 3; i++) {
        int unit = denominators[i] == 1001 ? 1000 : 1;
        v.v[1] = denominators[i];
        v.v[0] = floor(fps * denominators[i] / unit + 0.5) * unit;
        if (fabs(v.v[0] / v.v[1] - fps) < 5e-4)
            break;
    }
    return v;
}

/* `colors`: the file holds an rgb image. Data has neither primaries nor a colour space. */
static size_t add_attributes(const rl_sink_output *o, const rl_sink_frame *f, bool colors,
                             rl_exr_attribute *attrs)
{
    size_t n = 0;
    attrs[n++] = (rl_exr_attribute){"relit:version", {.type = RL_EXR_T_STRING, .text = RL_VERSION}};
    attrs[n++] = (rl_exr_attribute){"relit:pipeline", {.type = RL_EXR_T_STRING, .text = f->pipeline}};
    attrs[n++] = (rl_exr_attribute){"relit:capture", {.type = RL_EXR_T_STRING, .text = f->capture}};
    if (o->space && colors)
        attrs[n++] = (rl_exr_attribute){"relit:colorspace", {.type = RL_EXR_T_STRING, .text = o->space}};
    if (o->primaries.known && colors) {
        rl_exr_value v = {.type = RL_EXR_T_CHROMATICITIES};
        memcpy(v.v, o->primaries.xy, sizeof o->primaries.xy);
        attrs[n++] = (rl_exr_attribute){"chromaticities", v};
    }
    rl_exr_value fps;
    bool has = f->source && rl_exr_attr(f->source, f->source_part, "framesPerSecond", &fps);
    if (!has && f->fps > 0)
        attrs[n++] = (rl_exr_attribute){"framesPerSecond", rational_fps(f->fps)};
    return n;
}

static rl_code write_exr(const char *path, const rl_sink_output *o, const rl_sink_image *images, size_t n,
                         const rl_sink_frame *f, const region *r, rl_pool *pool, uint64_t *clamped,
                         rl_error *err)
{
    rl_exr_pixel type = o->spec->type == RL_FLOAT ? RL_EXR_FLOAT : RL_EXR_HALF;
    channel_list list = {0};
    list_begin(&list, images, n);
    for (size_t i = 0; i < n; i++)
        add_image(&list, &images[i], type, r);
    add_coverage(&list, images, n, f, r, type);
    uint64_t beyond = 0;
    bool colors = false;
    for (size_t i = 0; i < n; i++)
        colors |= images[i].format == RL_RGB;
    rl_exr_attribute attrs[8];
    /* A name that the pipeline's parser let pass is one that the codec knows; rl_exr_write refuses any other
     * number. */
    int compression = o->spec->compression ? rl_exr_compression_named(o->spec->compression) : RL_EXR_ZIP;
    rl_exr_image image = {.data_window = r->window,
                          .display_window = f->display_window,
                          .channels = list.rows,
                          .n_channels = list.n,
                          .compression = (rl_exr_compression)compression,
                          .level = o->spec->level,
                          .dwa_level = o->spec->quality > 0 ? (float)o->spec->quality : 0,
                          .attrs = attrs,
                          .n_attrs = add_attributes(o, f, colors, attrs),
                          .copy_from = f->source,
                          .copy_part = f->source_part,
                          .copy = kept_attributes,
                          .n_copy = sizeof kept_attributes / sizeof *kept_attributes};
    if (f->source) {
        const rl_exr_part *part = rl_exr_part_at(f->source, f->source_part);
        image.pixel_aspect = part->pixel_aspect;
        image.screen_width = part->screen_width;
        memcpy(image.screen_center, part->screen_center, sizeof image.screen_center);
    }
    rl_code code = list.failed ? rl_fail_memory(err, n * sizeof *list.rows)
                               : rl_exr_write(path, &image, pool, &beyond, err);
    *clamped += beyond;
    rl_arena_free(&list.arena);
    return code;
}

rl_code rl_sink_write(const char *path, const rl_sink_output *output, const rl_sink_image *images,
                      size_t n_images, const rl_sink_frame *frame, rl_pool *pool, uint64_t *clamped,
                      rl_error *err)
{
    region r;
    rl_arena arena = {0};
    const char *folder = rl_path_folder(&arena, path);
    rl_code code = folder ? crop_region(frame, &r, err) : rl_fail_memory(err, strlen(path));
    if (!code)
        code = rl_folder_make(folder, err);
    if (!code && !strcasecmp(rl_path_extension(path), ".exr"))
        code = write_exr(path, output, images, n_images, frame, &r, pool, clamped, err);
    else if (!code)
        code = rl_sink_write_image(path, output, &images[0], (size_t)r.y0 * images[0].stride + (size_t)r.x0,
                                   r.width, r.height, frame, pool, clamped, err);
    rl_arena_free(&arena);
    return code;
}
