#include "graph/tool/compare_image.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/run/exr.h"
#include "graph/run/image_file.h"

/* ---- which channels of an EXR -------------------------------------------------------------------------- */

enum { MOST_CHANNELS = 4 };

/* A layer: the channels of a part whose names are equal up to the last dot. */
typedef struct layer {
    int part;
    size_t prefix; /* length, with the dot */
    const char *name;
    const char *channel[MOST_CHANNELS]; /* without alpha */
    int n;                              /* may be more than fit */
} layer;

static size_t prefix_of(const char *name)
{
    const char *dot = strrchr(name, '.');
    return dot ? (size_t)(dot - name) + 1 : 0;
}

static bool in_layer(const layer *l, const char *name)
{
    return prefix_of(name) == l->prefix && !strncmp(name, l->name, l->prefix);
}

/* Puts three channels in the order of `letters` in front, if the part has them all. */
static bool take_letters(const rl_exr_part *part, layer *l, const char *letters)
{
    const char *found[3] = {0};
    for (size_t i = 0; i < part->n_channels; i++) {
        const char *name = part->channels[i].name, *base = name + prefix_of(name);
        const char *at = in_layer(l, name) && base[0] && !base[1] ? strchr(letters, base[0]) : NULL;
        if (at)
            found[at - letters] = name;
    }
    if (!found[0] || !found[1] || !found[2])
        return false;
    memcpy(l->channel, found, sizeof found);
    l->n = 3;
    return true;
}

/* The layer that channel `first` begins: RGB if it has them, else XYZ, else all that is in it. */
static layer make_layer(const rl_exr_part *part, int index, size_t first)
{
    const char *name = part->channels[first].name;
    layer l = {.part = index, .prefix = prefix_of(name), .name = name};
    if (take_letters(part, &l, "RGB") || take_letters(part, &l, "XYZ"))
        return l;
    for (size_t i = 0; i < part->n_channels; i++) {
        name = part->channels[i].name;
        if (!in_layer(&l, name) || !strcmp(name + l.prefix, "A"))
            continue;
        if (l.n < MOST_CHANNELS)
            l.channel[l.n] = name;
        l.n++;
    }
    return l;
}

static bool begins_layer(const rl_exr_part *part, size_t channel)
{
    layer l = {.name = part->channels[channel].name, .prefix = prefix_of(part->channels[channel].name)};
    for (size_t i = 0; i < channel; i++)
        if (in_layer(&l, part->channels[i].name))
            return false;
    return true;
}

static bool is_rgb(const layer *l)
{
    return l->n == 3 && !strcmp(l->channel[0] + l->prefix, "R");
}

/* R, G, B without a layer's name win; else the file must have one layer. */
static rl_code choose_layer(const rl_exr *file, layer *out, rl_error *err)
{
    rl_str names = {0};
    int n = 0;
    for (int p = 0; p < rl_exr_parts(file); p++) {
        const rl_exr_part *part = rl_exr_part_at(file, p);
        for (size_t i = 0; i < part->n_channels; i++) {
            if (!begins_layer(part, i))
                continue;
            layer l = make_layer(part, p, i);
            if (is_rgb(&l) && !l.prefix) {
                *out = l;
                rl_str_free(&names);
                return RL_OK;
            }
            if (!l.n) /* alpha alone */
                continue;
            rl_str_printf(&names, " %.*s", l.prefix ? (int)l.prefix - 1 : (int)strlen(l.name), l.name);
            *out = l;
            n++;
        }
    }
    if (n != 1)
        rl_fail_file(err, RL_E_FORMAT, rl_exr_path(file),
                     "has no channels R, G, B and %s:%s; compare files that hold one image",
                     n ? "more than one layer" : "no layer", n ? rl_str_text(&names) : " alpha only");
    else if (out->n > MOST_CHANNELS)
        rl_fail_file(err, RL_E_FORMAT, rl_exr_path(file),
                     "its only layer has %d channels; up to %d can be compared", out->n, (int)MOST_CHANNELS);
    rl_str_free(&names);
    return err->code;
}

/* ---- reading ------------------------------------------------------------------------------------------- */

static rl_code make_room(rl_compare_image *out, int width, int height, int channels, rl_error *err)
{
    size_t n = (size_t)width * (size_t)height;
    out->view =
        (rl_metric_image){.width = width, .height = height, .channels = channels, .stride = (size_t)width};
    out->pixels = rl_calloc(n, (size_t)channels * sizeof(float));
    if (!out->pixels)
        return rl_fail_memory(err, n * (size_t)channels * sizeof(float));
    for (int c = 0; c < channels; c++)
        out->view.plane[c] = out->pixels + (size_t)c * n;
    return RL_OK;
}

static void add_channel(rl_compare_image *out, const char *name)
{
    size_t used = strlen(out->channels);
    snprintf(out->channels + used, sizeof out->channels - used, "%s%s", used ? " " : "", name);
}

static void read_space(const rl_exr *file, int part, rl_compare_image *out)
{
    static const double primaries[8] = {0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329};
    rl_exr_value value;
    if (rl_exr_attr(file, part, "relit:colorspace", &value) && value.type == RL_EXR_T_STRING)
        snprintf(out->space, sizeof out->space, "%s", value.text);
    out->rec709 = true;
    if (!rl_exr_attr(file, part, "chromaticities", &value) || value.type != RL_EXR_T_CHROMATICITIES)
        return;
    out->has_xy = true;
    memcpy(out->xy, value.v, sizeof out->xy);
    for (int i = 0; i < 8; i++)
        out->rec709 = out->rec709 && !(fabs(value.v[i] - primaries[i]) > 1e-3);
}

static rl_code read_exr(const char *path, rl_pool *pool, rl_compare_image *out, rl_error *err)
{
    rl_exr *file = NULL;
    layer l = {0};
    if (rl_exr_open(path, 0, &file, err) || choose_layer(file, &l, err))
        goto done;
    const rl_exr_part *part = rl_exr_part_at(file, l.part);
    if (make_room(out, part->width, part->height, l.n, err))
        goto done;
    rl_exr_plane planes[MOST_CHANNELS];
    for (int c = 0; c < l.n; c++) {
        planes[c] =
            (rl_exr_plane){.channel = l.channel[c],
                           .floats = out->pixels + (size_t)c * out->view.stride * (size_t)part->height,
                           .stride = out->view.stride,
                           .keep_nonfinite = true};
        add_channel(out, l.channel[c]);
    }
    out->x = part->data_window.x0;
    out->y = part->data_window.y0;
    out->data = l.n != 1 && !is_rgb(&l);
    read_space(file, l.part, out);
    rl_exr_read(file, l.part, planes, (size_t)l.n, NULL, pool, err);
done:
    rl_exr_close(&file);
    return err->code;
}

static rl_code read_other(const char *path, rl_compare_image *out, rl_error *err)
{
    rl_image_file file;
    char names[sizeof file.names], *rest = names;
    rl_code code = rl_image_file_read(path, &file, err);
    if (code)
        return code;
    memcpy(names, file.names, sizeof names);
    const char *name[MOST_CHANNELS] = {0};
    for (int c = 0; c < file.channels && c < MOST_CHANNELS; c++) {
        name[c] = strsep(&rest, ",");
        name[c] = name[c] ? name[c] : "?";
    }
    int channels = file.channels;
    if (channels > 1 && channels <= MOST_CHANNELS && !strcmp(name[channels - 1], "A"))
        channels--;
    if (channels > MOST_CHANNELS)
        code = rl_fail_file(err, RL_E_FORMAT, path, "has %d channels; up to %d can be compared", channels,
                            (int)MOST_CHANNELS);
    else
        code = make_room(out, file.width, file.height, channels, err);
    if (!code) {
        size_t n = (size_t)channels * (size_t)file.width * (size_t)file.height;
        memcpy(out->pixels, file.planes, n * sizeof *file.planes);
        for (int c = 0; c < channels; c++)
            add_channel(out, name[c]);
        out->x = file.x;
        out->y = file.y;
        out->levels = file.type == RL_IMAGE_U8 ? 255 : file.type == RL_IMAGE_U16 ? 65535 : 0;
        out->view.encoded = out->levels > 0;
        out->data = channels != 1 && channels != 3;
        out->rec709 = true;
    }
    rl_image_file_free(&file);
    return code;
}

/* NaN is never equal to anything, and a difference of infinities is none. */
static rl_code check_finite(const char *path, const rl_compare_image *image, rl_error *err)
{
    const rl_metric_image *v = &image->view;
    for (int y = 0; y < v->height; y++) {
        for (int x = 0; x < v->width; x++) {
            const char *name = image->channels;
            for (int c = 0; c < v->channels; c++, name += strcspn(name, " ") + 1) {
                float value = v->plane[c][(size_t)y * v->stride + (size_t)x];
                if (!isfinite(value))
                    return rl_fail_file(
                        err, RL_E_DATA, path,
                        "channel '%.*s' holds %s at pixel (%d, %d); images to compare must be "
                        "finite",
                        (int)strcspn(name, " "), name,
                        isnan(value) ? "NaN"
                        : value > 0  ? "infinity"
                                     : "-infinity",
                        x + image->x, y + image->y);
            }
        }
    }
    return RL_OK;
}

rl_code rl_compare_image_read(const char *path, rl_pool *pool, rl_compare_image *out, rl_error *err)
{
    *out = (rl_compare_image){0};
    rl_code code = strcasecmp(rl_path_extension(path), ".exr") ? read_other(path, out, err)
                                                               : read_exr(path, pool, out, err);
    if (!code)
        code = check_finite(path, out, err);
    if (code)
        rl_compare_image_free(out);
    return code;
}

void rl_compare_image_free(rl_compare_image *image)
{
    rl_free(image->pixels);
    *image = (rl_compare_image){0};
}
