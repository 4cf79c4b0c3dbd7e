/* `make temporal`: shows what temporal anti-aliasing does, as tables and as strips (sample | result | truth
 * or reference) in out/temporal. Sequences whose box-filtered truth is known; then the captures that are
 * given, by default captures/monkey_turn, along whose motion the flicker is measured; their reference is the
 * same with 1024 taps a pixel. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/file.h"
#include "graph/run/image_file.h"
#include "tests/temporal_capture.h"
#include "tests/temporal_run.h"

static const char folder[] = "out/temporal";

/* ---- strips
 * ------------------------------------------------------------------------------------------------------- */

/* sRGB's curve. */
static float encode(float v)
{
    double x = fmin(fmax((double)v, 0), 1);
    return (float)(x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1 / 2.4) - 0.055);
}

/* Three pictures of width x height side by side, enlarged `scale` times. */
static bool write_strip(const char *name, float *const *pictures[3], int width, int height, int scale,
                        rl_error *err)
{
    int w = 3 * width * scale, h = height * scale;
    size_t n = (size_t)w * (size_t)h;
    char path[256];
    float *all = malloc(3 * n * sizeof *all);
    if (!all)
        return false;
    for (size_t c = 0; c < 3; c++)
        for (int y = 0; y < h; y++)
            for (int x = 0; x < w; x++)
                all[c * n + (size_t)y * (size_t)w + (size_t)x] =
                    encode(pictures[x / (width * scale)][c][y / scale * width + x / scale % width]);
    rl_image_planes image = {
        .width = w, .height = h, .channels = 3, .plane = {all, all + n, all + 2 * n}, .stride = (size_t)w};
    rl_image_options options = {.colorspace = "sRGB"};
    snprintf(path, sizeof path, "%s/%s.png", folder, name);
    rl_code code = rl_image_file_write(path, &image, &options, NULL, NULL, err);
    free(all);
    return !code;
}

/* ---- scenes whose truth is known
 * ---------------------------------------------------------------------------------- */

static const struct {
    const char *name;
    bool motion;
    temporal_scene scene;
} scenes[] = {
    {"still", false, {.width = 192, .height = 108}},
    {"camera", true, {.width = 192, .height = 108, .camera_moves = true}},
    {"camera_no_motion", false, {.width = 192, .height = 108, .camera_moves = true}},
    {"object", true, {.width = 192, .height = 108, .object_moves = true}},
    {"object_no_motion", false, {.width = 192, .height = 108, .object_moves = true}},
    {"both_no_motion", false, {.width = 192, .height = 108, .camera_moves = true, .object_moves = true}},
    {"both", true, {.width = 192, .height = 108, .camera_moves = true, .object_moves = true}},
    {"fine", true, {.width = 192, .height = 108, .camera_moves = true, .density = 1.3}},
    {"plain_no_motion", false, {.width = 192, .height = 108, .object_moves = true, .plain = true}},
    {"plain", true, {.width = 192, .height = 108, .object_moves = true, .plain = true}},
};

static bool show_scene(size_t i, rl_error *err)
{
    temporal_session t;
    temporal_report r = {0};
    bool ok = temporal_open(&t, scenes[i].motion, "", NULL, NULL) &&
              temporal_sequence(&t, &scenes[i].scene, 16, 2, 8, &r);
    if (ok) {
        printf("%-18s %8.2f %8.2f %8.2f %% %10.4f %10.4f %8ld %10.4f\n", scenes[i].name, r.raw_psnr, r.psnr,
               100 * r.p95, r.behind, r.ahead, r.disoccluded, r.disoccluded_difference);
        fflush(stdout);
        float *const *pictures[3] = {r.frame.color, r.result, r.truth};
        ok = write_strip(scenes[i].name, pictures, r.frame.width, r.frame.height, 3, err);
    } else {
        *err = t.err;
    }
    temporal_report_free(&r);
    temporal_close(&t);
    return ok;
}

/* ---- captures
 * ----------------------------------------------------------------------------------------------------- */

static bool make_images(const char *capture, const char *taps, temporal_images *out, rl_error *err)
{
    const rl_setting set[] = {{"graph.sss.taps", taps}};
    rl_options options = {.pipeline = "configs/skin.yaml",
                          .captures = &capture,
                          .n_captures = 1,
                          .settings = set,
                          .n_settings = 1};
    return !temporal_images_make(&options, out, err);
}

static bool show_capture(const char *capture, rl_error *err)
{
    temporal_images m, reference;
    bool ok = make_images(capture, "21", &m, err);
    if (ok) {
        temporal_flicker f = temporal_measure_flicker(&m, false);
        printf("%-28s %8ld %11.3f %% %11.3f %% %8.2f\n", capture, f.pixels, 100 * f.raw, 100 * f.done,
               f.raw / f.done);
        fflush(stdout);
        ok = make_images(capture, "1024", &reference, err);
        const char *last = strrchr(capture, '/');
        for (int i = 0; i < m.n && ok; i++) {
            char name[128];
            float *const *pictures[3] = {m.raw[i], m.done[i], reference.done[i]};
            snprintf(name, sizeof name, "%.100s.%04d", last ? last + 1 : capture, i + 1);
            ok = write_strip(name, pictures, m.width, m.height, 1, err);
        }
        temporal_images_free(&reference);
    }
    temporal_images_free(&m);
    return ok;
}

int main(int argc, char **argv)
{
    static const char *standard[] = {"captures/monkey_turn"};
    rl_error err = {0};
    bool ok = !rl_folder_make(folder, &err);
    printf("%-18s %8s %8s %10s %10s %10s %8s %10s\n", "PSNR to the truth:", "sample", "result", "p95",
           "behind", "in front", "new", "differ by");
    for (size_t i = 0; i < sizeof scenes / sizeof *scenes && ok; i++)
        ok = show_scene(i, &err);
    printf("\n%-28s %8s %13s %13s %8s\n", "deviation in time:", "pixels", "21 taps", "with taa", "ratio");
    const char *const *captures = argc > 1 ? (const char *const *)argv + 1 : standard;
    for (int i = 0; i < (argc > 1 ? argc - 1 : 1) && ok; i++)
        ok = show_capture(captures[i], &err);
    if (ok)
        printf("\nstrips (sample | result | truth or reference): %s\n", folder);
    else
        fprintf(stderr, "%s: %s\n", err.file, err.text);
    return ok ? EXIT_SUCCESS : EXIT_FAILURE;
}
