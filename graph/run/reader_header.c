/* What a frame is before its pixels: the files that hold its layers, its windows, its camera. */
#include <string.h>

#include "graph/run/camera.h"
#include "graph/run/camera_header.h"
#include "graph/run/reader_parts.h"

static rl_code missing_channel(const rl_layer *layer, const rl_exr *file, const char *channel, rl_error *err)
{
    rl_str text = {0};
    for (int p = 0; p < rl_exr_parts(file); p++) {
        const rl_exr_part *part = rl_exr_part_at(file, p);
        for (size_t i = 0; i < part->n_channels && text.length < 600; i++)
            rl_str_printf(&text, " %s%s%s", rl_exr_parts(file) > 1 ? part->name : "",
                          rl_exr_parts(file) > 1 ? ":" : "", part->channels[i].name);
    }
    rl_code code =
        rl_fail_file(err, RL_E_FORMAT, rl_exr_path(file),
                     "layer '%s' needs channel '%s'; the file has:%s (set layers.%s in capture.yaml)",
                     layer->name, channel, rl_str_text(&text), layer->name);
    rl_str_free(&text);
    return code;
}

static rl_code missing_part(const rl_layer *layer, const rl_exr *file, rl_error *err)
{
    enum { MOST = 64 };
    const char *names[MOST];
    rl_str text = {0};
    int n = 0;
    for (; n < rl_exr_parts(file) && n < MOST; n++)
        names[n] = rl_exr_part_at(file, n)->name;
    rl_suggest(&text, layer->part, names, (size_t)n, "the file has");
    rl_code code = rl_fail_file(err, RL_E_FORMAT, rl_exr_path(file),
                                "layer '%s' needs part '%s'%s (set layers.%s in capture.yaml)", layer->name,
                                layer->part, rl_str_text(&text), layer->name);
    rl_str_free(&text);
    return code;
}

/* How many of a layer's channels a part has before the first that it lacks. */
static int channels_found(const rl_layer *layer, const rl_exr_part *part)
{
    int have = 0;
    while (have < layer->n_channels && rl_exr_channel_named(part, layer->channels[have]))
        have++;
    return have;
}

/* The part that holds all channels of a layer. Where several do, which one is meant is not for relit to
 * guess: "R" is the red of a part's colour and the roughness of another. Deep ones count where there is no
 * other. */
rl_code rl_reader_find_part(const rl_layer *layer, const rl_exr *file, int *out, rl_error *err)
{
    int first = layer->part ? rl_exr_part_named(file, layer->part) : 0, found = -1, deep = -1;
    if (first < 0)
        return missing_part(layer, file, err);
    const char *missing = layer->channels[0];
    for (int p = first; p < (layer->part ? first + 1 : rl_exr_parts(file)); p++) {
        const rl_exr_part *part = rl_exr_part_at(file, p);
        int have = channels_found(layer, part);
        if (have < layer->n_channels)
            missing = have > 0 ? layer->channels[have] : missing;
        else if (part->deep)
            deep = p;
        else if (found < 0)
            found = p;
        else
            return rl_fail_file(err, RL_E_FORMAT, rl_exr_path(file),
                                "layer '%s': channel '%s' is in the parts '%s' and '%s' (set "
                                "layers.%s.part in capture.yaml)",
                                layer->name, layer->channels[0], rl_exr_part_at(file, found)->name,
                                part->name, layer->name);
    }
    *out = found >= 0 ? found : deep;
    return *out >= 0 ? RL_OK : missing_channel(layer, file, missing, err);
}

/* What the header says already about pixels that cannot be read. */
static rl_code check_readable(const rl_layer *layer, const rl_exr *file, int index, rl_error *err)
{
    const rl_exr_part *part = rl_exr_part_at(file, index);
    if (part->deep)
        return rl_fail_file(err, RL_E_FORMAT, rl_exr_path(file),
                            "layer '%s' is in deep data, which relit does not read: flatten it first",
                            layer->name);
    for (int i = 0; i < layer->n_channels; i++) {
        const rl_exr_channel *c = rl_exr_channel_named(part, layer->channels[i]);
        if (c->x_sampling != 1 || c->y_sampling != 1)
            return rl_fail_file(err, RL_E_FORMAT, rl_exr_path(file),
                                "layer '%s': channel '%s' has a sample every %d x %d pixels; relit needs one "
                                "in each",
                                layer->name, c->name, c->x_sampling, c->y_sampling);
    }
    return RL_OK;
}

/* ---- headers ---------------------------------------------------------------------------------------------
 */

/* Says once what the file leaves open. */
static void report_camera(rl_reader *r, const rl_frame *f, int file_number, const rl_camera_lens *lens,
                          bool has_jitter)
{
    const rl_where where = {.file = rl_exr_path(f->files[f->main_file])};
    bool window = !strcmp(lens->source, "screenWindowWidth"), unknown = window && lens->width == 1;
    if (!rl_manifest_fov_x(r->setup.manifest, file_number) && !r->said_window) {
        r->said_window = true;
        if (window)
            rl_report(r->setup.log, unknown ? RL_WARNING : RL_VERBOSE, where,
                      "no attribute camera:fovx: the field of view is taken from screenWindowWidth %g%s",
                      lens->width,
                      unknown
                          ? ", which writers leave at 1 when they do not know it (set camera.fov_x in the "
                            "manifest)"
                          : "");
        else
            rl_report(r->setup.log, RL_VERBOSE, where, "the field of view is taken from %s", lens->source);
    }
    if (!has_jitter && !r->said_jitter) {
        r->said_jitter = true;
        rl_report(r->setup.log, RL_VERBOSE, where,
                  "no attribute camera:jitter: samples lie at the pixels' centres");
    }
}

/* The file whose header knows the camera: that of the depth, or where that knows nothing, the first that
 * does. */
static const rl_exr *camera_file(const rl_reader *r, const rl_frame *f, int *part)
{
    const bool forward_z = r->setup.manifest->camera.forward_z;
    const rl_exr *main = f->files[f->main_file];
    *part = f->main_part;
    for (int i = -1; i < RL_MOST_FILES; i++) {
        const rl_exr *file = i < 0 ? main : f->files[i];
        double matrix[16];
        rl_camera_lens lens;
        if (!file)
            continue;
        rl_camera_header_lens(file, i < 0 ? *part : 0, forward_z, &lens);
        if (rl_camera_header_matrix(file, i < 0 ? *part : 0, forward_z, matrix) ||
            strcmp(lens.source, "screenWindowWidth")) {
            *part = i < 0 ? *part : 0;
            return file;
        }
    }
    return main;
}

static rl_code read_camera(rl_reader *r, rl_frame *f, int file_number, rl_error *err)
{
    int part;
    const rl_exr *file = camera_file(r, f, &part);
    rl_camera_info c;
    rl_camera_lens lens;
    rl_error inner = {0};
    bool has_jitter;
    rl_code code = rl_camera_read(r->setup.manifest, file_number, file, part, &c, &lens, &has_jitter, &inner);
    if (!code) {
        report_camera(r, f, file_number, &lens, has_jitter);
        code = rl_camera_make(&c, &f->camera, &inner);
    }
    if (!code)
        return RL_OK;
    /* What the header lacks is said of the file: the manifest may be a preset's. */
    double matrix[16];
    bool lacks = r->setup.manifest->camera.matrix_source == RL_SOURCE_HEADER &&
                 !rl_camera_header_matrix(file, part, r->setup.manifest->camera.forward_z, matrix);
    return rl_fail(err, code,
                   inner.file[0] && !lacks ? (rl_where){inner.file, inner.line, inner.column}
                                           : (rl_where){.file = rl_exr_path(file)},
                   "%s", inner.text);
}

static bool same_box(rl_exr_box a, rl_exr_box b)
{
    return a.x0 == b.x0 && a.y0 == b.y0 && a.x1 == b.x1 && a.y1 == b.y1;
}

/* Every wanted layer has its channels, and all have one size. */
static rl_code check_layers(rl_reader *r, rl_frame *f, rl_error *err)
{
    rl_exr_box window = f->data_window;
    for (int i = 0; i < r->n_bindings; i++) {
        const rl_layer *layer = r->bindings[i].layer;
        const rl_exr *file = f->files[layer->pattern];
        int part = 0;
        if (!layer->n_channels)
            continue;
        rl_code code = rl_reader_find_part(layer, file, &part, err);
        if (!code)
            code = check_readable(layer, file, part, err);
        if (code)
            return code;
        rl_exr_box w = rl_exr_part_at(file, part)->data_window;
        if (!same_box(w, window))
            return rl_fail_file(
                err, RL_E_FORMAT, rl_exr_path(file),
                "layer '%s' has the data window (%d, %d) - (%d, %d), layer 'depth' (%d, %d) - (%d, %d): all "
                "layers of a frame must have one size",
                layer->name, w.x0, w.y0, w.x1, w.y1, window.x0, window.y0, window.x1, window.y1);
    }
    return RL_OK;
}

static rl_code open_files(rl_reader *r, int file_number, rl_frame *f, rl_error *err)
{
    rl_code code = RL_OK;
    rl_arena arena = {0};
    for (int i = 0; i < r->n_bindings && !code; i++) {
        const rl_layer *layer = r->bindings[i].layer;
        if (layer->pattern >= RL_MOST_FILES)
            code = rl_fail(err, RL_E_CONFIG, layer->where, "a capture can have at most %d files a frame",
                           RL_MOST_FILES);
        else if (!f->files[layer->pattern]) {
            const char *path = rl_manifest_path(&arena, r->setup.manifest, layer, file_number);
            code = path ? rl_exr_open(path, r->setup.limit, &f->files[layer->pattern], err)
                        : rl_fail_memory(err, 1);
        }
    }
    rl_arena_free(&arena);
    return code;
}

rl_code rl_reader_open(rl_reader *r, int file_number, rl_frame *f, rl_error *err)
{
    rl_frame_release(f);
    if (r->setup.manifest->n_patterns == 0)
        return rl_fail(err, RL_E_CONFIG, r->setup.manifest->where,
                       "capture '%s' has 'files: memory': its frames must come through the C API",
                       r->setup.manifest->name);
    rl_code code = open_files(r, file_number, f, err);
    const rl_layer *depth = r->bindings[r->depth].layer;
    f->main_file = depth->pattern;
    if (!code)
        code = rl_reader_find_part(depth, f->files[f->main_file], &f->main_part, err);
    if (code)
        return code;
    const rl_exr_part *part = rl_exr_part_at(f->files[f->main_file], f->main_part);
    f->data_window = part->data_window;
    f->display_window = part->display_window;
    code = check_layers(r, f, err);
    rl_error why = {0};
    if (!code &&
        rl_geometry_make(f->data_window.x0, f->data_window.y0, part->width, part->height, &f->geometry, &why))
        code = rl_fail_file(err, why.code, rl_exr_path(f->files[f->main_file]), "%s", why.text);
    if (!code)
        code = read_camera(r, f, file_number, err);
    return code;
}

bool rl_reader_missed(rl_code code)
{
    return code == RL_E_IO || code == RL_E_FORMAT;
}
