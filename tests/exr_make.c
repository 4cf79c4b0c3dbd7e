#include "tests/exr_make.h"

#include <dirent.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>
#include <openexr.h>

#include "graph/run/exr_core.h"

#define OK(call) assert_int_equal(call, EXR_ERR_SUCCESS)

static size_t bytes_of(rl_exr_pixel type)
{
    return type == RL_EXR_HALF ? 2 : 4;
}

static void declare_header(exr_context_t ctx, int part, const made_header *h)
{
    exr_attr_m44f_t matrix;
    if (h->matrix) {
        memcpy(matrix.m, h->matrix, sizeof matrix.m);
        OK(exr_attr_set_m44f(ctx, part, "worldToCamera", &matrix));
    }
    if (h->fov_x > 0)
        OK(exr_attr_set_float(ctx, part, "camera:fovx", h->fov_x));
    if (h->jitter) {
        exr_attr_v2f_t jitter = {.x = h->jitter[0], .y = h->jitter[1]};
        OK(exr_attr_set_v2f(ctx, part, "camera:jitter", &jitter));
    }
    if (h->time_code[0]) {
        exr_attr_timecode_t code = {h->time_code[0], h->time_code[1]};
        OK(exr_attr_set_timecode(ctx, part, "timeCode", &code));
    }
    if (h->fps[0]) {
        exr_attr_rational_t fps = {h->fps[0], (uint32_t)h->fps[1]};
        OK(exr_attr_set_rational(ctx, part, "framesPerSecond", &fps));
    }
    if (h->owner)
        OK(exr_attr_set_string(ctx, part, "owner", h->owner));
}

static void declare(exr_context_t ctx, const made_part *p)
{
    static const made_header plain;
    const made_header *h = p->header ? p->header : &plain;
    int part;
    exr_attr_v2f_t center = {.x = h->screen_center[0], .y = h->screen_center[1]};
    exr_attr_box2i_t window, display;
    window.min.x = p->x0;
    window.min.y = p->y0;
    window.max.x = p->x0 + p->width - 1;
    window.max.y = p->y0 + p->height - 1;
    display = window;
    if (h->display[2] > 0) {
        display.min.x = h->display[0];
        display.min.y = h->display[1];
        display.max.x = h->display[0] + h->display[2] - 1;
        display.max.y = h->display[1] + h->display[3] - 1;
    }
    exr_storage_t storage = p->deep   ? EXR_STORAGE_DEEP_SCANLINE
                            : p->tile ? EXR_STORAGE_TILED
                                      : EXR_STORAGE_SCANLINE;
    OK(exr_add_part(ctx, p->name, storage, &part));
    OK(exr_initialize_required_attr(ctx, part, &display, &window, h->aspect > 0 ? h->aspect : 1.0f, &center,
                                    h->screen_width > 0 ? h->screen_width : 1.0f, EXR_LINEORDER_INCREASING_Y,
                                    (exr_compression_t)p->compression));
    declare_header(ctx, part, h);
    if (p->tile)
        OK(exr_set_tile_descriptor(ctx, part, (uint32_t)p->tile, (uint32_t)p->tile,
                                   p->mipmap ? EXR_TILE_MIPMAP_LEVELS : EXR_TILE_ONE_LEVEL,
                                   EXR_TILE_ROUND_DOWN));
    for (int c = 0; c < p->n_channels; c++) {
        int s = p->channels[c].sampling ? p->channels[c].sampling : 1;
        OK(exr_add_channel(ctx, part, p->channels[c].name, (exr_pixel_type_t)p->channels[c].type,
                           EXR_PERCEPTUALLY_LOGARITHMIC, s, s));
    }
}

/* `zeros`: for the levels above 0. */
static void encode(exr_context_t ctx, int part, const made_part *p, const exr_chunk_info_t *chunk, int x,
                   int y, const uint8_t *zeros)
{
    exr_encode_pipeline_t e = EXR_ENCODE_PIPELINE_INITIALIZER;
    OK(exr_encoding_initialize(ctx, part, chunk, &e));
    for (int c = 0; c < p->n_channels; c++) {
        size_t bytes = bytes_of(p->channels[c].type);
        int s = p->channels[c].sampling ? p->channels[c].sampling : 1;
        size_t line = (size_t)(p->width / s) * bytes;
        e.channels[c].encode_from_ptr =
            zeros ? zeros
                  : (const uint8_t *)p->channels[c].pixels + (size_t)(y / s) * line + (size_t)x * bytes;
        e.channels[c].user_pixel_stride = (int32_t)bytes;
        e.channels[c].user_line_stride = (int32_t)line;
    }
    OK(exr_encoding_choose_default_routines(ctx, part, &e));
    OK(exr_encoding_run(ctx, part, &e));
    OK(exr_encoding_destroy(ctx, &e));
}

static void write_tiles(exr_context_t ctx, int part, const made_part *p)
{
    int levels, w, h;
    exr_chunk_info_t chunk;
    uint8_t *zeros = calloc((size_t)p->width * (size_t)p->height, 4);
    OK(exr_get_tile_levels(ctx, part, &levels, NULL));
    for (int l = 0; l < levels; l++) {
        OK(exr_get_level_sizes(ctx, part, l, l, &w, &h));
        for (int ty = 0; ty * p->tile < h; ty++) {
            for (int tx = 0; tx * p->tile < w; tx++) {
                OK(exr_write_tile_chunk_info(ctx, part, tx, ty, l, l, &chunk));
                encode(ctx, part, p, &chunk, tx * p->tile, ty * p->tile, l ? zeros : NULL);
            }
        }
    }
    free(zeros);
}

static void write_lines(exr_context_t ctx, int part, const made_part *p)
{
    int step;
    exr_chunk_info_t chunk;
    OK(exr_get_scanlines_per_chunk(ctx, part, &step));
    for (int y = 0; y < p->height; y += step) {
        OK(exr_write_scanline_chunk_info(ctx, part, p->y0 + y, &chunk));
        encode(ctx, part, p, &chunk, 0, y, NULL);
    }
}

void made_write(const char *path, const made_part *parts, int n_parts)
{
    exr_context_t ctx;
    OK(exr_start_write(&ctx, path, EXR_WRITE_FILE_DIRECTLY, NULL));
    for (int i = 0; i < n_parts; i++)
        declare(ctx, &parts[i]);
    OK(exr_write_header(ctx));
    bool header_only = false;
    for (int i = 0; i < n_parts; i++) {
        header_only |= parts[i].deep;
        if (header_only)
            break;
        if (parts[i].tile)
            write_tiles(ctx, i, &parts[i]);
        else
            write_lines(ctx, i, &parts[i]);
    }
    if (header_only) { /* the core would remove an incomplete file */
        char keep[512];
        snprintf(keep, sizeof keep, "%s.keep", path);
        assert_int_equal(link(path, keep), 0);
        exr_finish(&ctx);
        assert_int_equal(rename(keep, path), 0);
    } else {
        OK(exr_finish(&ctx));
    }
}

void made_read(const char *path, int part, const char *channel, void *out)
{
    exr_context_t ctx;
    exr_decode_pipeline_t d = EXR_DECODE_PIPELINE_INITIALIZER;
    exr_attr_box2i_t window;
    int step;
    OK(exr_start_read(&ctx, path, NULL));
    OK(exr_get_data_window(ctx, part, &window));
    OK(exr_get_scanlines_per_chunk(ctx, part, &step));
    size_t width = (size_t)(window.max.x - window.min.x) + 1;
    bool found = false;
    for (int y = window.min.y; y <= window.max.y; y += step) {
        exr_chunk_info_t chunk;
        OK(exr_read_scanline_chunk_info(ctx, part, y, &chunk));
        if (y == window.min.y)
            OK(exr_decoding_initialize(ctx, part, &chunk, &d));
        else
            OK(exr_decoding_update(ctx, part, &chunk, &d));
        for (int c = 0; c < d.channel_count; c++) {
            exr_coding_channel_info_t *info = &d.channels[c];
            if (strcmp(info->channel_name, channel))
                continue;
            found = true;
            info->user_pixel_stride = info->bytes_per_element;
            info->user_line_stride = (int32_t)width * info->bytes_per_element;
            info->decode_to_ptr =
                (uint8_t *)out + (size_t)(y - window.min.y) * (size_t)info->user_line_stride;
        }
        if (y == window.min.y)
            OK(exr_decoding_choose_default_routines(ctx, part, &d));
        OK(exr_decoding_run(ctx, part, &d));
    }
    assert_true(found);
    exr_decoding_destroy(ctx, &d);
    exr_finish(&ctx);
}

/* ---- the folder ---- */

static char folder[256];

const char *made_path(const char *name)
{
    static char path[8][600]; /* a caller may hold a few at a time */
    static int turn;
    if (!folder[0]) {
        const char *base = getenv("TMPDIR");
        snprintf(folder, sizeof folder, "%s/relit_exr_XXXXXX", base ? base : "/tmp");
        assert_non_null(mkdtemp(folder));
    }
    turn = (turn + 1) % 8;
    snprintf(path[turn], sizeof path[turn], "%s/%s", folder, name);
    return path[turn];
}

static int each_file(bool remove_it)
{
    int n = 0;
    DIR *dir = folder[0] ? opendir(folder) : NULL;
    for (struct dirent *e; dir && (e = readdir(dir));) {
        if (e->d_name[0] == '.' && (!e->d_name[1] || e->d_name[1] == '.'))
            continue;
        n++;
        if (remove_it)
            unlink(made_path(e->d_name));
    }
    if (dir)
        closedir(dir);
    return n;
}

int made_count(void)
{
    return each_file(false);
}

void made_clean(void)
{
    each_file(true);
    if (folder[0])
        rmdir(folder);
    folder[0] = 0;
}

void made_good(rl_code code, const rl_error *err)
{
    if (code)
        fail_msg("%s: %s: %s", rl_code_name(code), err->file, err->text);
}

rl_pool *made_pools[3];

int made_setup(void **state)
{
    (void)state;
    rl_error err = {0};
    for (int i = 0; i < 3; i++)
        made_good(rl_pool_new(1 << i, &made_pools[i], &err), &err);
    return 0;
}

int made_teardown(void **state)
{
    (void)state;
    for (int i = 0; i < 3; i++)
        rl_pool_free(&made_pools[i]);
    made_clean();
    return 0;
}

uint32_t made_random(uint32_t *state)
{
    uint32_t x = *state ? *state : 1;
    x ^= x << 13;
    x ^= x >> 17;
    x ^= x << 5;
    return *state = x;
}

uint16_t made_half(float f)
{
    uint16_t h;
    rl_exr_kernels_portable.float_to_half(&f, &h, 1);
    return h;
}
