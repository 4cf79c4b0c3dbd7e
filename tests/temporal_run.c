#include "tests/temporal_run.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char pipeline[] = "relit: 1\n"
                               "capture:\n"
                               "  relit_capture: 1\n"
                               "  name: made\n"
                               "  files: memory\n"
                               "  frames: 1-999\n"
                               "  unit: m\n"
                               "%s"
                               "  camera: {matrix: header, forward: -z, fov_x: header, jitter: header}\n"
                               "  stencil_names: {1: plane, 2: sphere}\n"
                               "  layers:\n"
                               "    albedo: {channels: [R, G, B], colorspace: lin_rec709}\n"
                               "    normal: {channels: [NX, NY, NZ], space: world, encoding: signed}\n"
                               "    depth: {channels: [Z], kind: planar, empty: 1e10}\n"
                               "    stencil: {channels: [ID]}\n"
                               "%s"
                               "materials: {plane: {}, sphere: {}}\n"
                               "graph: {aa: {pass: taa, in: {color: capture.albedo}%s}}\n"
                               "outputs: {o: {layers: {c: aa.color, n: aa.count}, file: 'o.{frame}.exr'}}\n";

bool temporal_open(temporal_session *t, bool with_motion, const char *taa, const char *more,
                   const rl_log *log)
{
    static const char motion[] =
        "    motion: {channels: [MX, MY], unit: pixels, points: previous, y: down}\n";
    memset(t, 0, sizeof *t);
    snprintf(t->text, sizeof t->text, pipeline, more ? more : "", with_motion ? motion : "", taa);
    rl_options options = {.pipeline_text = t->text, .log = log};
    if (rl_session_open(&options, &t->session, &t->err))
        return false;
    return !rl_session_prepare(t->session, &t->err);
}

void temporal_close(temporal_session *t)
{
    rl_session_close(&t->session);
}

static void copy_plane(const rl_image_view *v, int plane, float *out)
{
    for (int y = 0; y < v->height; y++)
        memcpy(out + (size_t)y * (size_t)v->width, v->plane[plane] + (size_t)y * v->stride,
               (size_t)v->width * sizeof *out);
}

bool temporal_step(temporal_session *t, long long number, const temporal_frame *f, float *const rgb[3],
                   float *count)
{
    size_t w = (size_t)f->width;
    rl_channel_data channels[] = {
        {.name = "R", .floats = f->color[0], .stride = w},
        {.name = "G", .floats = f->color[1], .stride = w},
        {.name = "B", .floats = f->color[2], .stride = w},
        {.name = "NX", .floats = f->normal[0], .stride = w},
        {.name = "NY", .floats = f->normal[1], .stride = w},
        {.name = "NZ", .floats = f->normal[2], .stride = w},
        {.name = "Z", .floats = f->depth, .stride = w},
        {.name = "ID", .ids = f->id, .stride = w},
        {.name = "MX", .floats = f->motion[0], .stride = w},
        {.name = "MY", .floats = f->motion[1], .stride = w},
    };
    rl_frame_data data = {.width = f->width,
                          .height = f->height,
                          .channels = channels,
                          .n_channels = sizeof channels / sizeof *channels,
                          .fov_x = f->fov_x,
                          .jitter = {f->jitter[0], f->jitter[1]}};
    memcpy(data.world_to_camera, f->to_camera, sizeof data.world_to_camera);
    rl_image_view view;
    if (rl_session_process(t->session, 0, number, &data, &t->err) ||
        rl_session_image(t->session, "aa.color", &view, &t->err))
        return false;
    for (int c = 0; c < 3; c++)
        copy_plane(&view, c, rgb[c]);
    if (!count)
        return true;
    if (rl_session_image(t->session, "aa.count", &view, &t->err))
        return false;
    copy_plane(&view, 0, count);
    return true;
}

/* ---- errors
 * ------------------------------------------------------------------------------------------------------- */

double temporal_psnr(const temporal_frame *shape, float *const rgb[3], float *const truth[3])
{
    size_t n = (size_t)shape->width * (size_t)shape->height;
    double sum = 0;
    for (int c = 0; c < 3; c++)
        for (size_t i = 0; i < n; i++)
            sum += pow((double)rgb[c][i] - (double)truth[c][i], 2);
    return -10 * log10(fmax(sum / (3.0 * (double)n), 1e-20));
}

static int ascending(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

double temporal_percentile(const temporal_frame *shape, float *const rgb[3], float *const truth[3],
                           double share)
{
    size_t n = (size_t)shape->width * (size_t)shape->height;
    float *errors = malloc(3 * n * sizeof *errors);
    if (!errors)
        return INFINITY;
    for (size_t c = 0; c < 3; c++)
        for (size_t i = 0; i < n; i++)
            errors[c * n + i] = fabsf(rgb[c][i] - truth[c][i]);
    qsort(errors, 3 * n, sizeof *errors, ascending);
    double e = (double)errors[(size_t)(share * (double)(3 * n - 1))];
    free(errors);
    return e;
}

/* ---- whole sequences
 * ---------------------------------------------------------------------------------------------- */

void temporal_report_free(temporal_report *r)
{
    temporal_frame_free(&r->frame);
    free(r->result[0]);
    memset(r, 0, sizeof *r);
}

static bool make_report(temporal_report *r, const temporal_scene *s)
{
    size_t n = (size_t)s->width * (size_t)s->height;
    memset(r, 0, sizeof *r);
    float *all = calloc(7 * n, sizeof *all);
    r->result[0] = all;
    if (!temporal_frame_new(&r->frame, s->width, s->height) || !all)
        return false;
    for (size_t c = 0; c < 3; c++) {
        r->result[c] = all + c * n;
        r->truth[c] = all + (3 + c) * n;
    }
    r->count = all + 6 * n;
    return true;
}

static double error_at(float *const a[3], float *const b[3], size_t i)
{
    double sum = 0;
    for (int c = 0; c < 3; c++)
        sum += fabs((double)a[c][i] - (double)b[c][i]);
    return sum / 3;
}

/* Whether the 3x3 pixels around (x, y) show one surface only. */
static bool all_one(const temporal_frame *f, int x, int y)
{
    for (int i = 0; i < 9; i++) {
        int nx = x + i % 3 - 1, ny = y + i / 3 - 1;
        if (nx >= 0 && ny >= 0 && nx < f->width && ny < f->height &&
            f->id[ny * f->width + nx] != f->id[y * f->width + x])
            return false;
    }
    return true;
}

static void look_at_disoccluded(const temporal_scene *s, int number, temporal_report *r)
{
    for (int y = 0; y < s->height; y++) {
        for (int x = 0; x < s->width; x++) {
            size_t i = (size_t)(y * s->width + x);
            if (!all_one(&r->frame, x, y) || !temporal_disoccluded(s, number, x, y, 1))
                continue;
            r->disoccluded++;
            r->disoccluded_difference =
                fmax(r->disoccluded_difference, error_at(r->result, r->frame.color, i));
        }
    }
}

typedef struct trail {
    double behind, ahead, far, far_raw; /* sums */
    long n_behind, n_ahead, n_far;
} trail;

static void look_beside_sphere(const temporal_scene *s, int number, const temporal_report *r, trail *t)
{
    for (int y = s->height * 3 / 8; y < s->height * 5 / 8; y++) { /* where the outline is upright */
        for (int x = 0; x < s->width; x++) {
            size_t i = (size_t)(y * s->width + x);
            double d = temporal_beside_sphere(s, number, x, y);
            if (fabs(d) < 1 || fabs(d) > 8)
                continue;
            if (d > 0) {
                t->ahead += error_at(r->result, r->truth, i);
                t->n_ahead++;
            } else {
                t->behind += error_at(r->result, r->truth, i);
                t->n_behind++;
            }
            if (d < -3) {
                t->far += error_at(r->result, r->truth, i);
                t->far_raw += error_at(r->frame.color, r->truth, i);
                t->n_far++;
            }
        }
    }
}

bool temporal_sequence(temporal_session *t, const temporal_scene *scene, int frames, int compared, int n,
                       temporal_report *r)
{
    if (!make_report(r, scene))
        return false;
    double raw = 0, done = 0;
    trail beside = {0};
    for (int i = 0; i < frames; i++) {
        double jitter[2];
        temporal_jitter(i, jitter);
        temporal_render(scene, i, jitter, &r->frame);
        if (!temporal_step(t, i + 1, &r->frame, r->result, r->count))
            return false;
        if (i > 0 && scene->object_moves)
            look_at_disoccluded(scene, i, r);
        if (i < frames - compared)
            continue;
        temporal_truth(scene, i, n, r->truth);
        raw += pow(10, -0.1 * temporal_psnr(&r->frame, r->frame.color, r->truth)) / compared;
        done += pow(10, -0.1 * temporal_psnr(&r->frame, r->result, r->truth)) / compared;
        r->p95 = fmax(r->p95, temporal_percentile(&r->frame, r->result, r->truth, 0.95));
        look_beside_sphere(scene, i, r, &beside);
    }
    r->raw_psnr = -10 * log10(raw);
    r->psnr = -10 * log10(done);
    r->behind = beside.behind / fmax((double)beside.n_behind, 1);
    r->far_behind = beside.far / fmax((double)beside.n_far, 1);
    r->far_behind_raw = beside.far_raw / fmax((double)beside.n_far, 1);
    r->ahead = beside.ahead / fmax((double)beside.n_ahead, 1);
    return true;
}
