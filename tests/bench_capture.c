/* Makes a 1920x1080 capture for tests/bench_batch.sh out of a frame of captures/monkey: four times as many
 * pixels each way, interpolated within a material, with the texture of half an 11-bit step that recorded
 * values have, so that it packs about as well as a recorded frame. Usage: bench_capture IN.exr OUT.exr */
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/run/exr.h"

enum { SCALE = 4, MOST_CHANNELS = 64 };

typedef struct capture {
    rl_exr *file;
    const rl_exr_part *part;
    int width, height; /* of the source */
    float *in, *out;   /* planes one behind another */
    uint32_t *ids;     /* of the result */
    uint32_t *in_ids;
} capture;

static bool is_id(const rl_exr_channel *c)
{
    return c->type == RL_EXR_UINT;
}

/* Reads all channels; the stencil is the one of uints. */
static rl_code read_all(capture *c, rl_error *err)
{
    rl_exr_plane planes[MOST_CHANNELS] = {0};
    size_t pixels = (size_t)c->width * (size_t)c->height;
    for (size_t i = 0; i < c->part->n_channels; i++) {
        planes[i].channel = c->part->channels[i].name;
        planes[i].stride = (size_t)c->width;
        if (is_id(&c->part->channels[i]))
            planes[i].ids = c->in_ids;
        else
            planes[i].floats = c->in + i * pixels;
    }
    return rl_exr_read(c->file, 0, planes, c->part->n_channels, NULL, NULL, err);
}

static int within(int x, int n)
{
    return x < 0 ? 0 : x >= n ? n - 1 : x;
}

/* Bilinear where all four neighbours are of one material, else the nearest. */
static float resample(const capture *c, const float *plane, int x, int y)
{
    float fx = ((float)x + 0.5f) / SCALE - 0.5f, fy = ((float)y + 0.5f) / SCALE - 0.5f;
    int x0 = within((int)floorf(fx), c->width), y0 = within((int)floorf(fy), c->height);
    int x1 = within(x0 + 1, c->width), y1 = within(y0 + 1, c->height);
    int at[4] = {y0 * c->width + x0, y0 * c->width + x1, y1 * c->width + x0, y1 * c->width + x1};
    int nearest = y / SCALE * c->width + x / SCALE;
    for (int i = 0; i < 4; i++)
        if (c->in_ids[at[i]] != c->in_ids[nearest])
            return plane[nearest];
    float u = fminf(fmaxf(fx - (float)x0, 0), 1), v = fminf(fmaxf(fy - (float)y0, 0), 1);
    float top = plane[at[0]] + u * (plane[at[1]] - plane[at[0]]),
          low = plane[at[2]] + u * (plane[at[3]] - plane[at[2]]);
    return top + v * (low - top);
}

static void magnify(capture *c)
{
    int width = SCALE * c->width, height = SCALE * c->height;
    size_t pixels = (size_t)c->width * (size_t)c->height, many = pixels * SCALE * SCALE;
    uint32_t noise = 1;
    for (size_t i = 0; i < c->part->n_channels; i++) {
        const rl_exr_channel *channel = &c->part->channels[i];
        bool textured = !strncmp(channel->name, "albedo.", 7) || !strncmp(channel->name, "normal.", 7);
        for (int y = 0; y < height; y++)
            for (int x = 0; x < width; x++) {
                size_t at = (size_t)y * (size_t)width + (size_t)x;
                noise = noise * 1664525u + 1013904223u;
                float texture = 1 + (textured ? (float)(noise >> 16) / 65536.0f - 0.5f : 0) / 2048;
                if (is_id(channel))
                    c->ids[at] = c->in_ids[y / SCALE * c->width + x / SCALE];
                else
                    c->out[i * many + at] = texture * resample(c, c->in + i * pixels, x, y);
            }
    }
}

static rl_code write_all(const capture *c, const char *path, rl_error *err)
{
    static const char *const keep[] = {"worldToCamera", "camera:fovx", "framesPerSecond", "chromaticities"};
    rl_exr_source channels[MOST_CHANNELS] = {0};
    size_t width = SCALE * (size_t)c->width, many = width * SCALE * (size_t)c->height;
    rl_exr_attribute jitter = {"camera:jitter", {.type = RL_EXR_T_V2F}};
    rl_exr_box window = {0, 0, SCALE * c->width - 1, SCALE * c->height - 1};
    for (size_t i = 0; i < c->part->n_channels; i++)
        channels[i] = (rl_exr_source){.name = c->part->channels[i].name,
                                      .type = c->part->channels[i].type,
                                      .floats = c->out + i * many,
                                      .ids = c->ids,
                                      .stride = width};
    rl_exr_attr(c->file, 0, jitter.name, &jitter.value);
    jitter.value.v[0] *= SCALE;
    jitter.value.v[1] *= SCALE;
    rl_exr_image image = {.data_window = window,
                          .display_window = window,
                          .channels = channels,
                          .n_channels = c->part->n_channels,
                          .compression = RL_EXR_ZIP,
                          .level = 4,
                          .screen_width = c->part->screen_width,
                          .attrs = &jitter,
                          .n_attrs = 1,
                          .copy_from = c->file,
                          .copy = keep,
                          .n_copy = sizeof keep / sizeof *keep};
    return rl_exr_write(path, &image, NULL, NULL, err);
}

int main(int argc, char **argv)
{
    capture c = {0};
    rl_error err = {0};
    rl_code code = RL_OK;
    if (argc != 3) {
        fprintf(stderr, "usage: bench_capture IN.exr OUT.exr\n");
        return EXIT_FAILURE;
    }
    code = rl_exr_open(argv[1], 0, &c.file, &err);
    if (code)
        goto done;
    c.part = rl_exr_part_at(c.file, 0);
    c.width = c.part->width;
    c.height = c.part->height;
    size_t pixels = (size_t)c.width * (size_t)c.height, many = pixels * SCALE * SCALE;
    c.in = rl_calloc(pixels * c.part->n_channels, sizeof *c.in);
    c.out = rl_calloc(many * c.part->n_channels, sizeof *c.out);
    c.in_ids = rl_calloc(pixels, sizeof *c.in_ids);
    c.ids = rl_calloc(many, sizeof *c.ids);
    if (!c.in || !c.out || !c.in_ids || !c.ids || c.part->n_channels > MOST_CHANNELS) {
        code = rl_fail_memory(&err, many * c.part->n_channels);
        goto done;
    }
    code = read_all(&c, &err);
    if (!code) {
        magnify(&c);
        code = write_all(&c, argv[2], &err);
    }
done:
    if (code)
        fprintf(stderr, "bench_capture: %s\n", err.text);
    rl_exr_close(&c.file);
    rl_free(c.in);
    rl_free(c.out);
    rl_free(c.in_ids);
    rl_free(c.ids);
    return code ? EXIT_FAILURE : EXIT_SUCCESS;
}
