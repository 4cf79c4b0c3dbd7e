#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "tests/fuzz/fuzz.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/relit.h"
#include "graph/run/exr.h"
#include "tests/exr_make.h"
#include "tests/small_capture.h"
#include "tests/tool_run.h"

/* Bytes that an input may make relit allocate. */
#define LIMIT (64u << 20)

void fuzz_broken(const char *promise, const rl_error *err)
{
    fprintf(stderr, "broken promise: %s (%s: '%s')\n", promise, rl_code_name(err->code), err->text);
    abort();
}

void fuzz_check(rl_code code, const rl_error *err)
{
    if (code != err->code)
        fuzz_broken("the code is not the error's", err);
    if (code && !err->text[0])
        fuzz_broken("an error has a text", err);
    if (code == RL_E_INTERNAL)
        fuzz_broken("no input leads to a broken promise inside", err);
    for (const char *c = err->text; *c; c++)
        if ((unsigned char)*c < ' ')
            fuzz_broken("a message is one line of text", err);
}

void fuzz_write_input(const char *folder, const char *name, const uint8_t *data, size_t size)
{
    char *path = path_in(folder, name);
    FILE *f = fopen(path, "wb");
    if (!f || fwrite(data, 1, size, f) != size || fclose(f))
        abort();
    free(path);
}

fuzz_bytes fuzz_seed_text(const char *text)
{
    fuzz_bytes b = {malloc(strlen(text) + 1), strlen(text)};
    if (!b.data)
        abort();
    memcpy(b.data, text, b.size + 1);
    return b;
}

static fuzz_bytes seed_file(const char *path)
{
    fuzz_bytes b = {0};
    b.data = (uint8_t *)file_read(path, &b.size);
    return b;
}

/* ---- configuration ---------------------------------------------------------------------------------------
 */

static bool open_session(const char *folder)
{
    rl_error err = {0};
    rl_session *session = NULL;
    char *pipe = path_in(folder, "pipe.yaml");
    size_t before = rl_alloc_live();
    rl_options options = {.pipeline = pipe, .out = "/nonexistent", .threads = 1, .memory_limit = LIMIT};
    rl_code code = rl_session_open(&options, &session, &err);
    fuzz_check(code, &err);
    for (int format = RL_PLAN_TEXT; !code && format <= RL_PLAN_JSON; format++) {
        char *text = NULL;
        fuzz_check(rl_session_plan(session, 0, (rl_plan_format)format, &text, &err), &err);
        rl_text_free(text);
    }
    rl_session_close(&session);
    free(pipe);
    if (rl_alloc_live() != before)
        fuzz_broken("nothing is left behind", &err);
    return !code;
}

static const char kernel_pipeline[] =
    "relit: 1\n"
    "capture: capture.yaml\n"
    "materials: {default: {}}\n"
    "graph:\n"
    "  k:\n"
    "    pass: kernel\n"
    "    file: k.cl\n"
    "    entry: run\n"
    "    items: pixel\n"
    "    in: {color: capture.albedo}\n"
    "    ports:\n"
    "      color: {role: read, type: rgb, help: in}\n"
    "      mask: {role: read, type: scalar, optional: true}\n"
    "      last: {role: history, type: rgb, of: result}\n"
    "      temp: {role: scratch, type: scalar, layout: phase4}\n"
    "      result: {role: write, type: rgb}\n"
    "    params:\n"
    "      gain: {type: float, value: 0.5, range: [0, 2], unit: ratio, help: how much}\n"
    "      mode: {type: enum, words: [add, mul], value: mul}\n"
    "      tint: {type: rgb, value: [1, 0.5, 0.25]}\n"
    "      count: {type: int, words: [auto], range: [0, 10], value: auto}\n"
    "      on: {type: bool, value: true}\n"
    "    gain: 1.5\n"
    "outputs:\n"
    "  o: {image: k.result, file: \"o.{frame}.exr\"}\n";

static size_t begin_files(const char *folder)
{
    static const char kernel[] = "kernel void run(global float *a) { }\n";
    small_capture_write(folder);
    file_write(folder, "k.cl", kernel, strlen(kernel));
    return 0;
}

static size_t begin_pipeline(const char *folder, fuzz_bytes *seeds, size_t room)
{
    size_t n = begin_files(folder);
    (void)room;
    seeds[n++] = fuzz_seed_text(small_pipeline);
    static const char *const files[] = {"configs/skin.yaml", "configs/common/profiles.yaml"};
    for (size_t i = 0; i < sizeof files / sizeof *files; i++)
        seeds[n++] = seed_file(files[i]);
    return n;
}

static bool one_pipeline(const char *folder, const uint8_t *data, size_t size)
{
    fuzz_write_input(folder, "pipe.yaml", data, size);
    return open_session(folder);
}

static size_t begin_kernel(const char *folder, fuzz_bytes *seeds, size_t room)
{
    size_t n = begin_files(folder);
    (void)room;
    seeds[n++] = fuzz_seed_text(kernel_pipeline);
    return n;
}

static size_t begin_manifest(const char *folder, fuzz_bytes *seeds, size_t room)
{
    size_t n = begin_files(folder);
    (void)room;
    seeds[n++] = fuzz_seed_text(small_manifest);
    seeds[n++] = seed_file("captures/monkey/capture.yaml");
    seeds[n++] = seed_file("captures/monkey_turn/capture.yaml");
    return n;
}

static bool one_manifest(const char *folder, const uint8_t *data, size_t size)
{
    fuzz_write_input(folder, "capture.yaml", data, size);
    return open_session(folder);
}

/* ---- EXR -------------------------------------------------------------------------------------------------
 */

enum { W = 37, H = 21 };

/* Every compression, scanlines and tiles; two parts; uint, half and float. */
static size_t begin_exr(const char *folder, fuzz_bytes *seeds, size_t room)
{
    static float floats[W * H];
    static uint16_t halfs[W * H];
    static uint32_t ids[W * H];
    size_t n = 0;
    for (int i = 0; i < W * H; i++) {
        floats[i] = (float)(i % W) * 0.1f;
        halfs[i] = (uint16_t)(0x3000 + i);
        ids[i] = (uint32_t)(i / W);
    }
    const made_channel channels[] = {{"B", RL_EXR_HALF, 1, halfs},
                                     {"G", RL_EXR_HALF, 1, halfs},
                                     {"ID", RL_EXR_UINT, 1, ids},
                                     {"Z", RL_EXR_FLOAT, 1, floats}};
    for (int c = 0; c < RL_EXR_DWAA && n + 3 < room; c++) {
        made_part part = {.x0 = -3,
                          .y0 = 2,
                          .width = W,
                          .height = H,
                          .compression = (rl_exr_compression)c,
                          .channels = channels,
                          .n_channels = 4};
        char *path = path_in(folder, "seed.exr");
        for (int tile = 0; tile <= 16; tile += 16) {
            part.tile = tile;
            made_write(path, &part, 1);
            seeds[n++] = seed_file(path);
        }
        free(path);
    }
    char *path = path_in(folder, "seed.exr");
    for (rl_exr_compression c = RL_EXR_DWAA; c <= RL_EXR_DWAB; c++) {
        const rl_exr_source sources[] = {{"R", RL_EXR_HALF, floats, NULL, W},
                                         {"Z", RL_EXR_FLOAT, floats, NULL, W}};
        const rl_exr_image image = {.data_window = {0, 0, W - 1, H - 1},
                                    .display_window = {0, 0, W - 1, H - 1},
                                    .channels = sources,
                                    .n_channels = 2,
                                    .compression = c};
        rl_error err = {0};
        if (rl_exr_write(path, &image, NULL, NULL, &err))
            fuzz_broken("a seed can be written", &err);
        seeds[n++] = seed_file(path);
    }
    const made_part parts[] = {{.name = "one",
                                .width = W,
                                .height = H,
                                .compression = RL_EXR_ZIP,
                                .channels = channels,
                                .n_channels = 4},
                               {.name = "two",
                                .width = 8,
                                .height = 8,
                                .compression = RL_EXR_ZIPS,
                                .tile = 8,
                                .mipmap = true,
                                .channels = channels,
                                .n_channels = 2}};
    made_write(path, parts, 2);
    seeds[n++] = seed_file(path);
    free(path);
    small_capture_write(folder);
    path = path_in(folder, "s.0001.exr");
    seeds[n++] = seed_file(path);
    free(path);
    return n;
}

static bool read_part(const rl_exr *file, int p)
{
    const rl_exr_part *part = rl_exr_part_at(file, p);
    rl_error err = {0};
    rl_str text = {0};
    for (size_t i = 0; i < part->n_attrs; i++)
        rl_exr_attr_print(file, p, i, &text);
    rl_str_free(&text);
    size_t pixels = (size_t)part->width * (size_t)part->height;
    float *out = rl_malloc(pixels * sizeof *out);
    bool fine = false; /* any channel can be read */
    for (size_t i = 0; i < part->n_channels && out && i < 16; i++) {
        rl_exr_plane plane = {.channel = part->channels[i].name, .stride = (size_t)part->width};
        err = (rl_error){0};
        if (i % 2)
            plane.ids = (uint32_t *)(void *)out;
        else
            plane.floats = out;
        fuzz_check(rl_exr_read(file, p, &plane, 1, NULL, NULL, &err), &err);
        fine |= !err.code;
    }
    rl_free(out);
    return fine;
}

static bool one_exr(const char *folder, const uint8_t *data, size_t size)
{
    rl_error err = {0};
    rl_exr *file = NULL;
    char *path = path_in(folder, "in.exr");
    size_t before = rl_alloc_live();
    fuzz_write_input(folder, "in.exr", data, size);
    fuzz_check(rl_exr_open(path, LIMIT, &file, &err), &err);
    bool fine = file != NULL;
    for (int p = 0; file && p < rl_exr_parts(file) && p < 4; p++)
        fine &= read_part(file, p);
    rl_exr_close(&file);
    free(path);
    if (rl_alloc_live() != before)
        fuzz_broken("nothing is left behind", &err);
    return fine;
}

/* ---- frames in memory ------------------------------------------------------------------------------------
 */

/* One session processes all inputs: what an input did to it must not hurt the next. */
static rl_session *frames;

static const char frame_pipeline[] =
    "relit: 1\n"
    "capture:\n"
    "  relit_capture: 1\n"
    "  name: made\n"
    "  files: memory\n"
    "  unit: m\n"
    "  camera: {matrix: header, forward: -z, fov_x: header, jitter: header}\n"
    "  layers:\n"
    "    albedo: {channels: [a, b, c], colorspace: lin_rec709}\n"
    "    normal: {channels: [d, e], space: camera, encoding: octahedral}\n"
    "    depth: {channels: [g], kind: radial, empty: 1e10}\n"
    "    stencil: {channels: [ID]}\n"
    "    thickness: {channels: [h]}\n"
    "    motion: {channels: [i, j], unit: pixels, points: previous, y: down}\n"
    "    roughness: {channels: [k]}\n"
    "    shadow: {key: l}\n"
    "    shadow_thickness: {key: m}\n"
    "profiles: {p: {scatter_distance_mm: [30, 12, 7], transmission: thick}}\n"
    "materials: {some: {profile: p, stencil: [0, 1, 2, 3]}, default: {}}\n"
    "lights: {key: {type: point, position: [0.1, 0.2, 0.3], intensity: 1}, sun: {type: directional, "
    "direction: [0, 0, -1], irradiance: 3}}\n"
    "graph:\n"
    "  light: {pass: lighting}\n"
    "  sss: {pass: sss_burley, in: {diffuse: light.diffuse, lit: light.lit}, orientation: tangent}\n"
    "  aa: {pass: taa, in: {color: sss.color}}\n"
    "outputs: {o: {image: aa.color, file: 'o.{frame}.exr'}}\n";

static size_t begin_frame(const char *folder, fuzz_bytes *seeds, size_t room)
{
    (void)folder, (void)room;
    rl_error err = {0};
    rl_options options = {.pipeline_text = frame_pipeline, .threads = 2, .memory_limit = LIMIT};
    if (rl_session_open(&options, &frames, &err) || rl_session_prepare(frames, &err))
        fuzz_broken("the frame target's pipeline is fine", &err);
    for (size_t n = 0; n < 4; n++) { /* sizes, place, camera, then samples */
        static const float start[] = {50, 40, 0, 0, 0.6f, 0.1f, 0.2f, 0.5f, 0.5f, -0.5f, 0.7f, 0.01f};
        float v[64];
        for (size_t i = 0; i < 64; i++)
            v[i] = i < 12 ? start[i] * (float)(n + 1) : (float)((i * (n + 3)) % 11) * 0.1f;
        seeds[n].data = malloc(sizeof v);
        if (!seeds[n].data)
            abort();
        memcpy(seeds[n].data, v, seeds[n].size = sizeof v);
    }
    return 4;
}

static int whole(float v, int least, int most)
{
    return v >= (float)least && v <= (float)most ? (int)v : least;
}

static bool one_frame(const char *folder, const uint8_t *data, size_t size)
{
    enum { SAMPLES = 200 * 200, CHANNELS = 13 };
    static float planes[CHANNELS][SAMPLES];
    static uint32_t ids[SAMPLES];
    static const char names[] = "a\0b\0c\0d\0e\0f\0g\0h\0i\0j\0k\0l\0m";
    static long long number;
    float v[64] = {0};
    rl_channel_data channels[CHANNELS + 1];
    rl_error err = {0};
    (void)folder;
    memcpy(v, data, size < sizeof v ? size : sizeof v);
    for (size_t c = 0; c < CHANNELS; c++) {
        for (size_t i = 0; i < SAMPLES; i++)
            planes[c][i] = v[12 + (i * (c + 1) + i / 97) % 52];
        channels[c] = (rl_channel_data){.name = names + 2 * c, .floats = planes[c], .stride = 200};
    }
    for (size_t i = 0; i < SAMPLES; i++)
        memcpy(&ids[i], &planes[0][i / 7], sizeof *ids);
    channels[CHANNELS] = (rl_channel_data){.name = "ID", .ids = ids, .stride = 200};
    rl_frame_data frame = {
        .x = whole(v[2], -100000, 100000),
        .y = whole(v[3], -100000, 100000),
        .width = whole(v[0], -1, 200),
        .height = whole(v[1], -1, 200),
        .channels = channels,
        .n_channels = CHANNELS + 1,
        .world_to_camera = {1, 0, 0, (double)v[7], 0, 1, 0, (double)v[8], 0, 0, 1, (double)v[9], 0, 0, 0, 1},
        .fov_x = (double)v[4],
        .jitter = {(double)v[5], (double)v[6]}};
    rl_image_view image;
    rl_code code = rl_session_process(frames, 0, ++number, &frame, &err);
    fuzz_check(code, &err);
    if (!code)
        fuzz_check(rl_session_image(frames, "aa.color", &image, &err), &err);
    if (!code && (image.width != frame.width || image.height != frame.height))
        fuzz_broken("the image has the frame's size", &err);
    return !code;
}

static void end_frame(void)
{
    rl_session_close(&frames);
}

const fuzz_target fuzz_targets[] = {
    {"pipeline", "a pipeline's YAML, up to the plan", true, begin_pipeline, one_pipeline, NULL},
    {"kernel", "a user kernel's declaration, up to the plan", true, begin_kernel, one_pipeline, NULL},
    {"manifest", "a capture's YAML, up to the plan", true, begin_manifest, one_manifest, NULL},
    {"ies", "photometric files of lamps", true, fuzz_begin_ies, fuzz_one_ies, NULL},
    {"exr", "EXR files: headers, attributes, pixels", false, begin_exr, one_exr, NULL},
    {"frame", "frames in memory: sizes, cameras, samples of any value, through the kernels", false,
     begin_frame, one_frame, end_frame},
};
const size_t fuzz_n_targets = sizeof fuzz_targets / sizeof *fuzz_targets;
