#include "graph/tool/probe.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/run/camera_header.h"
#include "graph/run/ingest.h"
#include "graph/tool/capture.h"

enum { SIDE = 64 };

/* The file of the depth, and planes of its data window. */
typedef struct looked {
    const rl_manifest *m;
    rl_arena *arena;
    rl_exr *file;
    int part; /* that holds depth */
    size_t width, height;
    float *depth, *normal[3], *position[3], *albedo[3];
} looked;

/* The part that holds a channel, or -1. */
static int part_with(const rl_exr *file, const char *part, const char *channel)
{
    for (int k = 0; k < rl_exr_parts(file); k++)
        if ((!part || !strcmp(part, rl_exr_part_at(file, k)->name)) &&
            rl_exr_channel_named(rl_exr_part_at(file, k), channel))
            return k;
    return -1;
}

static rl_code read_part(looked *l, const rl_exr *file, int p, const char *const *names, int n, float **out,
                         rl_error *err)
{
    const rl_exr_part *info = rl_exr_part_at(file, p);
    if (!l->width) {
        l->width = (size_t)info->width;
        l->height = (size_t)info->height;
    }
    if ((size_t)info->width != l->width || (size_t)info->height != l->height)
        return rl_fail_file(err, RL_E_FORMAT, rl_exr_path(file),
                            "channel '%s' has another size than the depth", names[0]);
    rl_exr_plane planes[3];
    for (int k = 0; k < n; k++) {
        out[k] = rl_calloc(l->width * l->height, sizeof *out[k]);
        if (!out[k])
            return rl_fail_memory(err, l->width * l->height * sizeof *out[k]);
        planes[k] = (rl_exr_plane){.channel = names[k],
                                   .floats = out[k],
                                   .stride = l->width,
                                   .replace_inf = true,
                                   .inf_value = 3e38f};
    }
    return rl_exr_read(file, p, planes, (size_t)n, NULL, NULL, err);
}

/* Channels of the first frame's file of a pattern. */
static rl_code read_planes(looked *l, int pattern, const char *part, const char *const *names, int n,
                           float **out, rl_error *err)
{
    rl_exr *file = NULL;
    char *path = rl_capture_first(l->arena, l->m, pattern);
    rl_code code = path ? rl_exr_open(path, 0, &file, err) : rl_fail_memory(err, 1);
    int p = code ? -1 : part_with(file, part, names[0]);
    if (!code && p < 0)
        code = rl_fail_file(err, RL_E_FORMAT, path, "there is no channel '%s'", names[0]);
    if (!code)
        code = read_part(l, file, p, names, n, out, err);
    rl_exr_close(&file);
    return code;
}

static int by_value(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static rl_code look_at_depth(const looked *l, const rl_layer *layer, rl_probe *out, rl_error *err)
{
    size_t pixels = l->width * l->height, n = 0;
    float *sorted = rl_malloc((pixels + 1) * sizeof *sorted);
    if (!sorted)
        return rl_fail_memory(err, pixels * sizeof *sorted);
    for (size_t i = 0; i < pixels; i++) {
        double v = (double)l->depth[i];
        out->least = v < out->least || !i ? v : out->least;
        out->most = v < 1e30 && (v > out->most || !i) ? v : out->most;
        if (!rl_layer_is_empty(layer, v) && fabs(v) < 1e30)
            sorted[n++] = layer->negated ? -l->depth[i] : l->depth[i];
    }
    qsort(sorted, n, sizeof *sorted, by_value);
    out->covered = pixels ? (double)n / (double)pixels : 0;
    if (n) {
        out->nearest = (double)sorted[0];
        out->median = (double)sorted[n / 2];
        out->far = (double)sorted[n - 1];
    }
    rl_free(sorted);
    return RL_OK;
}

/* As the file has it, in whatever colour space. Before the depth is converted. */
static void look_at_albedo(const looked *l, const rl_layer *depth, rl_probe *out)
{
    double sum = 0;
    size_t n = 0;
    for (size_t i = 0; i < l->width * l->height; i++) {
        if (rl_layer_is_empty(depth, (double)l->depth[i]) || fabsf(l->depth[i]) > 1e30f)
            continue;
        for (int k = 0; k < 3; k++) {
            double v = (double)l->albedo[k][i];
            sum += v;
            out->albedo_most = v > out->albedo_most ? v : out->albedo_most;
        }
        n += 3;
    }
    out->has_albedo = n > 0;
    out->albedo_mean = n ? sum / (double)n : 0;
}

/* The camera of the first frame as a run would take it, when there is one. */
static bool find_camera(const looked *l, rl_probe *out, camera_t *camera)
{
    rl_camera_info info;
    rl_camera_lens lens;
    bool jitter;
    double header[16];
    rl_error ignored = {0};
    int frame = l->m->frames.n ? l->m->frames.numbers[0] : 1;
    rl_code code = rl_camera_read(l->m, frame, l->file, l->part, &info, &lens, &jitter, &ignored);
    out->matrix_source = rl_camera_header_matrix(l->file, l->part, l->m->camera.forward_z, header);
    out->lens_source = rl_arena_strdup(l->arena, lens.source); /* it may be the file's */
    out->lens_width = lens.width;
    out->x = info.display[0];
    out->y = info.display[1];
    out->width = info.display[2];
    out->height = info.display[3];
    return !code && !rl_camera_make(&info, camera, &ignored);
}

static void look_at_normals(looked *l, const rl_layer *depth, const rl_layer *normal, const camera_t *camera,
                            rl_probe *out)
{
    const rl_exr_box w = rl_exr_part_at(l->file, l->part)->data_window;
    rl_rows rows = {.width = (int)l->width, .y1 = (int)l->height, .stride = l->width};
    rl_ingest_depth how = {.layer = depth, .camera = camera, .x = w.x0, .y = w.y0};
    rl_ingest_depth_rows(l->depth, rows, &how);
    float m[9];
    rl_ingest_normal turn = {.encoding = normal->encoding,
                             .rotate = rl_ingest_normal_matrix(normal, camera, l->m->camera.forward_z, m)};
    rl_ingest_normal_rows(l->normal, rows, &turn);
    rl_normal_view view = {.depth = l->depth,
                           .normal = {l->normal[0], l->normal[1], l->normal[2]},
                           .stride = l->width,
                           .width = (int)l->width,
                           .height = (int)l->height,
                           .x = w.x0,
                           .y = w.y0,
                           .camera = camera};
    rl_normal_check_run(&view, normal, depth, l->m->camera.forward_z, &out->check);
    out->looked_at_normals = out->check.samples > 0;
}

/* Before the depth is converted. */
static void look_at_positions(const looked *l, const rl_layer *depth, rl_probe *out)
{
    const rl_exr_box w = rl_exr_part_at(l->file, l->part)->data_window;
    rl_seen *seen = rl_malloc(SIDE * SIDE * sizeof *seen);
    size_t n = 0;
    for (size_t i = 0; seen && i < SIDE * SIDE; i++) {
        size_t x = (2 * (i % SIDE) + 1) * l->width / (2 * SIDE),
               y = (2 * (i / SIDE) + 1) * l->height / (2 * SIDE);
        size_t at = y * l->width + x;
        double d = (double)l->depth[at];
        if (rl_layer_is_empty(depth, d) || fabs(d) > 1e30)
            continue;
        seen[n] = (rl_seen){
            .x = w.x0 + (double)x + 0.5, .y = w.y0 + (double)y + 0.5, .depth = depth->negated ? -d : d};
        for (int k = 0; k < 3; k++)
            seen[n].world[k] = (double)l->position[k][at];
        n++;
    }
    out->solved = seen && rl_camera_solve(seen, n, &out->camera) && out->camera.error < 0.5 &&
                  fabs(out->camera.aspect - 1) < 0.01;
    rl_free(seen);
}

rl_code rl_probe_run(const rl_manifest *m, const rl_guess *position, rl_arena *arena, rl_probe *out,
                     rl_error *err)
{
    const rl_layer *depth = rl_manifest_layer(m, "depth"), *normal = rl_manifest_layer(m, "normal");
    const rl_layer *albedo = rl_manifest_layer(m, "albedo");
    looked l = {.m = m, .arena = arena};
    camera_t camera;
    *out = (rl_probe){0};
    char *path = rl_capture_first(arena, m, depth ? depth->pattern : 0);
    rl_code code = path ? rl_exr_open(path, 0, &l.file, err) : rl_fail_memory(err, 1);
    int part = !code && depth ? part_with(l.file, depth->part, depth->channels[0]) : 0;
    l.part = part < 0 ? 0 : part;
    bool known = !code && find_camera(&l, out, &camera);
    if (!code && depth)
        code = read_planes(&l, depth->pattern, depth->part, depth->channels, 1, &l.depth, err);
    if (!code && depth && normal)
        code = read_planes(&l, normal->pattern, normal->part, normal->channels, normal->n_channels, l.normal,
                           err);
    if (!code && depth && position)
        code = read_planes(&l, position->pattern, position->part, position->names, 3, l.position, err);
    if (!code && depth && albedo)
        code = read_planes(&l, albedo->pattern, albedo->part, albedo->channels, 3, l.albedo, err);
    if (!code && depth && albedo)
        look_at_albedo(&l, depth, out);
    if (!code && depth)
        code = look_at_depth(&l, depth, out, err);
    if (!code && depth && position)
        look_at_positions(&l, depth, out);
    if (!code && known && l.depth && l.normal[2])
        look_at_normals(&l, depth, normal, &camera, out);
    rl_free(l.depth);
    for (int k = 0; k < 3; k++) {
        rl_free(l.normal[k]);
        rl_free(l.position[k]);
        rl_free(l.albedo[k]);
    }
    rl_exr_close(&l.file);
    return code;
}
