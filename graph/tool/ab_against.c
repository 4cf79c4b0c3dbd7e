/* --against FILE|DIR: the images that variants are compared with come from files.
 *
 *   a file      of every frame, or with #### or %04d one for each frame
 *   a folder    of an earlier run, or of an earlier comparison with a folder a variant: files named as the
 * outputs of the variant that show the compared image: an EXR without
 * display, look and exposure gives the linear one, an integer file for the compared display the other
 *
 * EXR and float files are scene-linear, files of integers are for the display. What a file's half floats
 * rounded stays in the numbers: RMSE 1e-4 of values near 0.5. */
#include <string.h>
#include <strings.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/model/manifest.h"
#include "graph/run/session.h"
#include "graph/tool/ab_measure_parts.h"
#include "graph/tool/compare_image.h"

struct rl_ab_against {
    const rl_ab_plan *plan;
    const rl_experiment *experiment;
    rl_pool *pool;
    const rl_log *log;
    bool folder;
    /* What was read last: an EXR, and another file. */
    rl_compare_image images[RL_COMPARED];
    char *paths[RL_COMPARED]; /* of them, or NULL */
};

/* The files of a frame and variant; NULL: none of that kind. */
typedef struct found {
    const char *path[RL_COMPARED]; /* LINEAR: an EXR; DISPLAY: any other */
} found;

static bool is_exr(const char *path)
{
    return !strcasecmp(rl_path_extension(path), ".exr");
}

/* ---- which files --------------------------------------------------------------------------------------- */

static rl_code find_file(const rl_ab_against *a, rl_arena *arena, const rl_experiment_frame *frame,
                         found *out, rl_error *err)
{
    rl_pattern pattern = {.path = a->plan->against};
    const rl_manifest m = {.patterns = &pattern, .n_patterns = 1};
    const rl_layer layer = {.pattern = 0};
    const char *path = rl_manifest_path(arena, &m, &layer, (int)frame->frame);
    if (!path)
        return rl_fail_memory(err, strlen(a->plan->against));
    out->path[is_exr(path) ? RL_COMPARED_LINEAR : RL_COMPARED_DISPLAY] = path;
    return RL_OK;
}

/* Which of the compared images an output writes as it is; RL_COMPARED: none. */
static rl_compared shows(const rl_ab_against *a, int variant, const rl_sink_output *output)
{
    const rl_output *spec = output->spec;
    const char *image = rl_experiment_image_name(a->experiment, (size_t)variant, RL_COMPARED_LINEAR);
    const char *display = rl_experiment_image_name(a->experiment, (size_t)variant, RL_COMPARED_DISPLAY);
    if (spec->n_layers != 1 || strcmp(spec->layers[0].image, image))
        return RL_COMPARED;
    if (is_exr(spec->file) && !spec->display && !spec->look && !(spec->exposure < 0 || spec->exposure > 0))
        return RL_COMPARED_LINEAR;
    bool integers = spec->type == RL_UINT8 || spec->type == RL_UINT16;
    if (!is_exr(spec->file) && integers && output->space && !strcmp(output->space, display))
        return RL_COMPARED_DISPLAY;
    return RL_COMPARED;
}

/* Below the folder's own folder of the variant, which an earlier `relit ab` left, else below the folder; as
 * the output names it, else without the folders of that name. NULL when there is none. */
static rl_code find_in_folder(const rl_ab_against *a, rl_arena *arena, const char *variant, const char *name,
                              const char **out, rl_error *err)
{
    const char *own = rl_path_join(arena, a->plan->against, variant);
    const char *const folders[] = {own, a->plan->against}, *const names[] = {name, rl_path_name(name)};
    *out = NULL;
    for (int i = 0; i < 4 && !*out; i++) {
        const char *path = own ? rl_path_join(arena, folders[i / 2], names[i % 2]) : NULL;
        if (!path)
            return rl_fail_memory(err, strlen(name));
        *out = rl_path_exists(path) ? path : NULL;
    }
    return RL_OK;
}

static rl_code find_outputs(const rl_ab_against *a, rl_arena *arena, const rl_experiment_frame *frame,
                            int variant, found *out, rl_error *err)
{
    const rl_session *s = rl_experiment_session(a->experiment, (size_t)variant);
    const char *capture = rl_session_capture_name(s, frame->capture);
    rl_str looked_for = {0};
    for (size_t i = 0; i < s->n_outputs; i++) {
        rl_compared which = shows(a, variant, &s->outputs[i]);
        const char *name, *own = a->plan->variants[variant].name;
        if (which == RL_COMPARED || out->path[which])
            continue;
        if (rl_output_path(arena, s->outputs[i].spec, capture, frame->frame, own, &name, err) ||
            find_in_folder(a, arena, own, name, &out->path[which], err))
            goto done;
        rl_str_printf(&looked_for, "%s'%s'", looked_for.length ? " and " : "", rl_path_name(name));
    }
    if (out->path[RL_COMPARED_LINEAR] || out->path[RL_COMPARED_DISPLAY])
        goto done;
    if (looked_for.length)
        rl_fail_file(err, RL_E_IO, a->plan->against,
                     "--against: there is no file for variant '%s', frame %lld; looked for %s, there and "
                     "in its folder '%s'",
                     a->plan->variants[variant].name, frame->frame, rl_str_text(&looked_for),
                     a->plan->variants[variant].name);
    else
        rl_fail_file(err, RL_E_CONFIG, a->plan->against,
                     "--against: variant '%s' has no output whose files could be in the folder: one image, "
                     "%s, as EXR without display, look and exposure, or as integers for %s; give a FILE or "
                     "a pattern (####) instead",
                     a->plan->variants[variant].name,
                     rl_experiment_image_name(a->experiment, (size_t)variant, RL_COMPARED_LINEAR),
                     rl_experiment_image_name(a->experiment, (size_t)variant, RL_COMPARED_DISPLAY));
done:
    rl_str_free(&looked_for);
    return err->code;
}

static rl_code find(const rl_ab_against *a, rl_arena *arena, const rl_experiment_frame *frame, int variant,
                    found *out, rl_error *err)
{
    *out = (found){{NULL, NULL}};
    return a->folder ? find_outputs(a, arena, frame, variant, out, err)
                     : find_file(a, arena, frame, out, err);
}

rl_code rl_ab_against_same(rl_ab_against *a, const rl_experiment_frame *frame, int u, int v, bool *same,
                           rl_error *err)
{
    rl_arena arena = {0};
    found f[2];
    *same = !a->folder;
    if (!*same && !find(a, &arena, frame, u, &f[0], err) && !find(a, &arena, frame, v, &f[1], err)) {
        *same = true;
        for (int i = 0; i < RL_COMPARED; i++) {
            const char *x = f[0].path[i], *y = f[1].path[i];
            *same = *same && (x && y ? !strcmp(x, y) : x == y);
        }
    }
    rl_arena_free(&arena);
    return err->code;
}

/* ---- their colours ------------------------------------------------------------------------------------- */

typedef struct convert_job {
    float *plane[3];
    size_t stride;
    double m[9];
} convert_job;

static void convert_row(void *ctx, int y)
{
    const convert_job *j = ctx;
    for (size_t x = 0; x < j->stride; x++) {
        size_t at = (size_t)y * j->stride + x;
        double in[3];
        for (int c = 0; c < 3; c++)
            in[c] = (double)j->plane[c][at];
        for (int c = 0; c < 3; c++)
            j->plane[c][at] =
                (float)(j->m[3 * c] * in[0] + j->m[3 * c + 1] * in[1] + j->m[3 * c + 2] * in[2]);
    }
}

static void apply_matrix(const rl_ab_against *a, rl_compare_image *image, const double m[9])
{
    size_t n = image->view.stride * (size_t)image->view.height;
    convert_job j = {.plane = {image->pixels, image->pixels + n, image->pixels + 2 * n},
                     .stride = image->view.stride};
    memcpy(j.m, m, sizeof j.m);
    if (a->pool)
        rl_pool_for(a->pool, image->view.height, convert_row, &j);
    else
        for (int y = 0; y < image->view.height; y++)
            convert_row(&j, y);
}

/* From a colour space of the configuration: to ACES2065-1 by OpenColorIO, from there by primaries. */
static rl_code convert_space(const rl_ab_against *a, const char *path, rl_compare_image *image, rl_error *err)
{
    static const double ap0[8] = {0.7347, 0.2653, 0, 1, 0.0001, -0.077, 0.32168, 0.33767};
    const rl_session *s = rl_experiment_session(a->experiment, 0);
    size_t n = image->view.stride * (size_t)image->view.height;
    rl_ocio_transform *t = NULL;
    const char *space;
    double m[9];
    if (rl_color_space(s->ocio, image->space, (rl_where){.file = path}, &space, err))
        return err->code;
    const rl_ocio_request request = {.from = space, .to = "aces_interchange"};
    rl_code code = rl_ocio_transform_new(s->ocio, &request, &t, err);
    if (!code)
        code = rl_ocio_apply(t, image->pixels, image->pixels + n, image->pixels + 2 * n, n, err);
    rl_ocio_transform_free(&t);
    if (!code && rl_color_to_rec709(ap0, m))
        apply_matrix(a, image, m);
    return code;
}

/* Scene-linear Rec. 709, as the variants' images are. Grey has no primaries. */
static rl_code convert(const rl_ab_against *a, const char *path, rl_compare_image *image, rl_error *err)
{
    double m[9];
    if (image->view.encoded || image->view.channels == 1)
        return RL_OK;
    if (image->has_xy) {
        if (!rl_color_to_rec709(image->xy, m))
            return rl_fail_file(err, RL_E_FORMAT, path, "its chromaticities are of no colour space");
        if (!image->rec709)
            apply_matrix(a, image, m);
        return RL_OK;
    }
    if (image->space[0])
        return convert_space(a, path, image, err);
    rl_report(a->log, RL_NOTE, (rl_where){.file = a->plan->against},
              "--against: the files do not say what their primaries are (chromaticities); they are taken as "
              "linear Rec. 709");
    return RL_OK;
}

/* ---- reading ------------------------------------------------------------------------------------------- */

static rl_code load(rl_ab_against *a, rl_compared which, const char *path, rl_error *err)
{
    rl_compare_image *image = &a->images[which];
    if (a->paths[which] && !strcmp(a->paths[which], path))
        return RL_OK;
    rl_compare_image_free(image);
    rl_free(a->paths[which]);
    a->paths[which] = NULL;
    if (rl_compare_image_read(path, a->pool, image, err))
        return err->code;
    if (image->data || (image->view.channels != 1 && image->view.channels != 3))
        return rl_fail_file(err, RL_E_FORMAT, path, "has channels %s; colours are compared", image->channels);
    if (convert(a, path, image, err))
        return err->code;
    size_t n = image->view.stride * (size_t)image->view.height * (size_t)image->view.channels;
    if (image->levels) /* how a reader divides is its own affair */
        rl_ab_round(image->pixels, n, image->levels, image->pixels);
    a->paths[which] = rl_strdup(path);
    return a->paths[which] ? RL_OK : rl_fail_memory(err, strlen(path));
}

/* The part of a file that lies under the frame. */
static rl_code cut(const rl_compare_image *image, const char *path, const rl_experiment_frame *frame,
                   rl_compared_image *out, rl_error *err)
{
    const rl_metric_image *v = &image->view;
    int x = frame->x - image->x, y = frame->y - image->y;
    if (x < 0 || y < 0 || x + frame->width > v->width || y + frame->height > v->height)
        return rl_fail_file(err, RL_E_DATA, path,
                            "is %d x %d pixels from (%d, %d) on; frame %lld is %d x %d from (%d, %d) on: the "
                            "reference must cover it",
                            v->width, v->height, image->x, image->y, frame->frame, frame->width,
                            frame->height, frame->x, frame->y);
    *out = (rl_compared_image){.width = frame->width, .height = frame->height, .stride = v->stride};
    for (int c = 0; c < 3; c++)
        out->plane[c] = v->plane[v->channels == 1 ? 0 : c] + (size_t)y * v->stride + (size_t)x;
    return RL_OK;
}

rl_code rl_ab_against_read(rl_ab_against *a, const rl_experiment_frame *frame, int variant,
                           rl_compared_image out[RL_COMPARED], int *levels, rl_error *err)
{
    rl_arena arena = {0};
    found files;
    memset(out, 0, RL_COMPARED * sizeof *out);
    *levels = 0;
    if (find(a, &arena, frame, variant, &files, err))
        goto done;
    for (int i = 0; i < RL_COMPARED; i++) {
        if (!files.path[i])
            continue;
        const rl_compare_image *image = &a->images[i];
        if (load(a, (rl_compared)i, files.path[i], err))
            goto done;
        rl_compared which = image->view.encoded ? RL_COMPARED_DISPLAY : RL_COMPARED_LINEAR;
        if (!out[which].plane[0] && cut(image, files.path[i], frame, &out[which], err))
            goto done;
        if (which == RL_COMPARED_DISPLAY)
            *levels = image->levels;
    }
done:
    rl_arena_free(&arena);
    return err->code;
}

/* ---- the object ---------------------------------------------------------------------------------------- */

rl_code rl_ab_against_new(const rl_ab_plan *plan, const rl_experiment *experiment, rl_pool *pool,
                          const rl_log *log, rl_ab_against **out, rl_error *err)
{
    rl_ab_against *a = *out = rl_calloc(1, sizeof *a);
    if (!a)
        return rl_fail_memory(err, sizeof *a);
    a->plan = plan;
    a->experiment = experiment;
    a->pool = pool;
    a->log = log;
    a->folder = rl_path_is_folder(plan->against);
    bool numbered = strpbrk(plan->against, "#%") != NULL;
    if (a->folder || numbered || rl_path_exists(plan->against))
        return RL_OK;
    rl_ab_against_free(out);
    return rl_fail_file(err, RL_E_IO, plan->against, "--against: there is no such file or folder");
}

void rl_ab_against_free(rl_ab_against **against)
{
    rl_ab_against *a = *against;
    *against = NULL;
    for (int i = 0; a && i < RL_COMPARED; i++) {
        rl_compare_image_free(&a->images[i]);
        rl_free(a->paths[i]);
    }
    rl_free(a);
}
