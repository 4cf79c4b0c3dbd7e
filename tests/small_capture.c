#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "tests/small_capture.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/run/exr.h"
#include "graph/run/image_file.h"
#include "tests/tool_run.h"

enum { W = SMALL_WIDTH, H = SMALL_HEIGHT, PLANES = 10 };

const char small_manifest[] =
    "relit_capture: 1\n"
    "name: s\n"
    "files: s.####.exr\n"
    "frames: 1-3\n"
    "fps: 24\n"
    "unit: m\n"
    "camera: {matrix: header, forward: -z, fov_x: header, jitter: header}\n"
    "layers:\n"
    "  albedo: {channels: [albedo.R, albedo.G, albedo.B], colorspace: ACEScg}\n"
    "  normal: {channels: [normal.X, normal.Y, normal.Z], space: world, encoding: signed}\n"
    "  depth: {channels: [depth.Z], kind: planar, empty: 1e10}\n"
    "  stencil: {channels: [stencil.ID]}\n"
    "  shadow: {key: shadow.key}\n"
    "lights:\n"
    "  key: {type: point, position: [0.1, 0.2, 0.5], intensity: [2, 1.9, 1.8]}\n"
    "stencil_names: {1: skin, 2: plaster}\n";

const char small_pipeline[] =
    "relit: 1\n"
    "capture: capture.yaml\n"
    "profiles: {skin: {scatter_distance_mm: [3, 1.2, 0.7]}}\n"
    "materials: {skin: {profile: skin}, default: {}}\n"
    "graph:\n"
    "  light: {pass: lighting}\n"
    "  sss: {pass: sss_burley, in: {diffuse: light.diffuse, lit: light.lit}, taps: 21}\n"
    "  aa: {pass: taa, in: {color: sss.color}}\n"
    "outputs:\n"
    "  beauty: {image: aa.color, file: \"{capture}.{frame:04}.exr\", colorspace: ACEScg}\n"
    "  preview: {image: aa.color, file: \"{capture}.{frame:04}.png\", display: sRGB, view: ACES}\n"
    "  aovs: {layers: {diffuse: light.diffuse, depth: capture.depth, id: capture.stencil}, "
    "file: \"aov/{capture}.{frame:04}.exr\", compression: piz}\n";

/* A slope that turns a little from frame to frame, skin on the left, plaster on the right, nothing at the
 * top. */
static void fill(float planes[PLANES][W * H], uint32_t *ids, int frame)
{
    for (int i = 0; i < W * H; i++) {
        float x = (float)(i % W) / W, y = (float)(i / W) / H;
        const float v[PLANES] = {
            0.8f * x, 0.5f, 0.4f * y, 0.6f, 0, 0.8f, 0.4f + 0.1f * x + 0.01f * (float)frame, x > 0.3f};
        for (int p = 0; p < PLANES; p++)
            planes[p][i] = v[p];
        ids[i] = y < 0.2f ? 0 : x < 0.5f ? 1 : 2;
        if (!ids[i])
            planes[6][i] = 1e10f;
    }
}

static void write_frame(const char *folder, int frame)
{
    static float planes[PLANES][W * H];
    static uint32_t ids[W * H];
    static const char *const names[] = {"albedo.R", "albedo.G", "albedo.B", "normal.X",
                                        "normal.Y", "normal.Z", "depth.Z",  "shadow.key"};
    enum { N = sizeof names / sizeof *names };
    rl_exr_source channels[N + 1];
    fill(planes, ids, frame);
    for (int i = 0; i < N; i++)
        channels[i] =
            (rl_exr_source){.name = names[i], .type = RL_EXR_FLOAT, .floats = planes[i], .stride = W};
    channels[N] = (rl_exr_source){.name = "stencil.ID", .type = RL_EXR_UINT, .ids = ids, .stride = W};
    const rl_exr_attribute attrs[] = {
        {"worldToCamera", {.type = RL_EXR_T_M44F, .v = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}}},
        {"camera:fovx", {.type = RL_EXR_T_FLOAT, .v = {0.6}}},
        {"camera:jitter", {.type = RL_EXR_T_V2F, .v = {0.1 * frame, 0}}},
    };
    rl_exr_image image = {.data_window = {0, 0, W - 1, H - 1},
                          .display_window = {0, 0, W - 1, H - 1},
                          .channels = channels,
                          .n_channels = N + 1,
                          .compression = RL_EXR_ZIP,
                          .attrs = attrs,
                          .n_attrs = sizeof attrs / sizeof *attrs};
    char name[32];
    rl_error err = {0};
    snprintf(name, sizeof name, "s.%04d.exr", frame);
    char *path = path_in(folder, name);
    if (rl_exr_write(path, &image, NULL, NULL, &err))
        fail_msg("%s: %s", path, err.text);
    free(path);
}

void small_capture_write(const char *folder)
{
    for (int i = 1; i <= SMALL_FRAMES; i++)
        write_frame(folder, i);
    file_write(folder, "capture.yaml", small_manifest, strlen(small_manifest));
    file_write(folder, "pipe.yaml", small_pipeline, strlen(small_pipeline));
}

char *small_folder, *small_pipe, *small_out;

int small_setup(void **state)
{
    (void)state;
    small_folder = folder_new();
    small_capture_write(small_folder);
    small_pipe = path_in(small_folder, "pipe.yaml");
    small_out = path_in(small_folder, "out");
    return 0;
}

int small_teardown(void **state)
{
    (void)state;
    folder_remove(small_folder);
    free(small_pipe);
    free(small_out);
    return 0;
}

/* ---- runs ------------------------------------------------------------------------------------------------
 */

static void check_error(const rl_error *err, rl_code code)
{
    if (err->code != code || (code && !err->text[0]))
        fail_msg("code %s came with %s and the text '%s'", rl_code_name(code), rl_code_name(err->code),
                 err->text);
}

static void on_frame(void *ctx, const rl_frame_result *r)
{
    small_run *run = ctx;
    bool good = r->error->code == RL_OK;
    check_error(r->error, r->error->code);
    assert_true(r->frame >= 1 && r->frame <= SMALL_FRAMES);
    assert_true(good ? r->n_files == SMALL_OUTPUTS : r->n_files <= SMALL_OUTPUTS);
    run->frame_code[r->frame] = r->error->code;
    run->good += good;
    run->bad += !good;
}

small_run small_run_once(const char *folder, const char *out)
{
    small_run run = {0};
    char *pipe = path_in(folder, "pipe.yaml");
    size_t before = rl_alloc_live();
    rl_options options = {.pipeline = pipe, .out = out, .threads = 2};
    rl_run_hooks hooks = {.frame = on_frame, .ctx = &run};
    rl_session *session = NULL;
    run.code = rl_session_open(&options, &session, &run.err);
    run.opened = !run.code;
    assert_true(run.opened == (session != NULL));
    if (!run.code)
        run.code = rl_session_prepare(session, &run.err);
    if (!run.code)
        run.code = rl_session_run(session, &hooks, &run.summary, &run.err);
    check_error(&run.err, run.code);
    rl_session_close(&session);
    if (rl_alloc_live() != before)
        fail_msg("%zu bytes are left (%s: %s)", rl_alloc_live() - before, rl_code_name(run.code),
                 run.err.text);
    assert_int_equal(run.good + run.bad, run.summary.frames);
    assert_int_equal(run.bad, run.summary.failed);
    free(pipe);
    return run;
}

static void check_exr(const char *path)
{
    rl_exr *file = NULL;
    rl_error err = {0};
    float *pixels = rl_malloc(W * H * sizeof *pixels);
    if (rl_exr_open(path, 0, &file, &err))
        fail_msg("%s: %s", path, err.text);
    const rl_exr_part *part = rl_exr_part_at(file, 0);
    if (part->width != W || part->height != H)
        fail_msg("%s has %d x %d pixels", path, part->width, part->height);
    for (size_t i = 0; i < part->n_channels; i++) {
        rl_exr_plane plane = {.channel = part->channels[i].name, .floats = pixels, .stride = W};
        if (rl_exr_read(file, 0, &plane, 1, NULL, NULL, &err))
            fail_msg("%s: %s", path, err.text);
    }
    rl_exr_close(&file);
    rl_free(pixels);
}

static void check_image(const char *path)
{
    rl_image_file file = {0};
    rl_error err = {0};
    if (rl_image_file_read(path, &file, &err))
        fail_msg("%s: %s", path, err.text);
    if (file.width != W || file.height != H)
        fail_msg("%s has %d x %d pixels", path, file.width, file.height);
    rl_image_file_free(&file);
}

int small_check_files(const char *out)
{
    int n = 0;
    DIR *d = opendir(out);
    for (struct dirent *e = d ? readdir(d) : NULL; e; e = readdir(d)) {
        const char *dot = strrchr(e->d_name, '.');
        char *path = path_in(out, e->d_name);
        if (e->d_name[0] != '.' && e->d_type == DT_DIR)
            n += small_check_files(path);
        else if (dot && !strcmp(dot, ".exr") && ++n)
            check_exr(path);
        else if (dot && !strcmp(dot, ".png") && ++n)
            check_image(path);
        else if (strcmp(e->d_name, ".") && strcmp(e->d_name, "..") && strcmp(e->d_name, ".relit"))
            fail_msg("%s was left behind", path);
        free(path);
    }
    if (d)
        closedir(d);
    return n;
}
