#include "graph/tool/ab_sheet.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/run/image_file.h"
#include "graph/tool/ab_sheet_parts.h"

size_t rl_ab_sheet_choose(const char *report_frames, const long long *frames, size_t n)
{
    size_t length = report_frames ? strcspn(report_frames, ",") : 0;
    char *end = NULL;
    if (length == 5 && !strncmp(report_frames, "first", length))
        return 0;
    long long number = length ? strtoll(report_frames, &end, 10) : 0;
    for (size_t i = 0; i < n && length && end != report_frames; i++)
        if (frames[i] == number)
            return i;
    return n - 1;
}

/* ---- what is kept of the frame ------------------------------------------------------------------------- */

rl_code rl_ab_sheet_new(const rl_ab_plan *plan, size_t index, const char *title, rl_pool *pool,
                        rl_ab_sheet **out, rl_error *err)
{
    rl_ab_sheet *s = rl_calloc(1, sizeof *s);
    *out = s;
    if (!s)
        return rl_fail_memory(err, sizeof *s);
    *s = (rl_ab_sheet){.plan = plan, .index = index, .title = title, .pool = pool};
    s->tiles = rl_calloc(plan->n_listed, sizeof *s->tiles);
    if (s->tiles)
        return RL_OK;
    rl_ab_sheet_free(out);
    return rl_fail_memory(err, plan->n_listed * sizeof *s->tiles);
}

static void forget(rl_ab_sheet *s)
{
    for (size_t i = 0; i < s->plan->n_listed; i++) {
        rl_free(s->tiles[i].pixels);
        s->tiles[i] = (rl_ab_tile){0};
    }
    s->taken = false;
}

void rl_ab_sheet_free(rl_ab_sheet **sheet)
{
    rl_ab_sheet *s = *sheet;
    *sheet = NULL;
    if (!s)
        return;
    if (s->tiles)
        forget(s);
    rl_free(s->tiles);
    rl_free(s);
}

/* What FLIP and the mask work on. */
typedef struct measured {
    float *clamped[2]; /* test, reference: three planes each */
    float *map;
    uint8_t *mask;
    size_t n;
} measured;

static rl_code measured_new(measured *m, size_t n, rl_error *err)
{
    *m = (measured){.n = n};
    for (int i = 0; i < 2; i++)
        m->clamped[i] = rl_malloc(3 * n * sizeof(float));
    m->map = rl_malloc(n * sizeof(float));
    m->mask = rl_malloc(n);
    return m->clamped[0] && m->clamped[1] && m->map && m->mask ? RL_OK
                                                               : rl_fail_memory(err, 7 * n * sizeof(float));
}

static void measured_free(measured *m)
{
    rl_free(m->clamped[0]);
    rl_free(m->clamped[1]);
    rl_free(m->map);
    rl_free(m->mask);
}

static rl_metric_image clamp_image(const rl_compared_image *in, float *to)
{
    size_t width = (size_t)in->width, height = (size_t)in->height, n = width * height;
    for (size_t c = 0; c < 3; c++)
        for (size_t y = 0; y < height; y++)
            for (size_t x = 0; x < width; x++) {
                float v = in->plane[c][y * in->stride + x];
                to[c * n + y * width + x] = v > 0 ? v < 1 ? v : 1 : 0;
            }
    return (rl_metric_image){.width = in->width,
                             .height = in->height,
                             .channels = 3,
                             .plane = {to, to + n, to + 2 * n},
                             .stride = width,
                             .encoded = true};
}

static rl_code take_tiles(rl_ab_sheet *s, const rl_experiment_frame *f, rl_error *err)
{
    size_t n = s->plan->n_listed, pixels = (size_t)f->width * (size_t)f->height;
    measured m;
    rl_code code = measured_new(&m, pixels, err);
    if (code)
        goto done;
    rl_metric_image last = clamp_image(&f->images[n - 1][RL_COMPARED_DISPLAY], m.clamped[1]);
    for (size_t y = 0; y < (size_t)f->height; y++)
        for (size_t x = 0; x < (size_t)f->width; x++)
            m.mask[y * (size_t)f->width + x] = f->stencil[y * f->stencil_stride + x] != 0;
    for (size_t i = 0; i < n && !code; i++) {
        rl_metric_image image = clamp_image(&f->images[i][RL_COMPARED_DISPLAY], m.clamped[0]);
        code = rl_ab_tile_shrink(&image, &s->layout, s->pool, &s->tiles[i], err);
        if (!code && i + 1 < n)
            code = rl_metric_map(RL_METRIC_FLIP, &last, &image, s->pool, m.map, err);
        if (!code && i + 1 < n)
            code = rl_metric_stats(RL_METRIC_FLIP, m.map, m.mask, pixels, 1, s->tiles[i].flip, err);
    }
done:
    measured_free(&m);
    return code;
}

rl_code rl_ab_sheet_frame(rl_ab_sheet *s, const rl_experiment_frame *f, rl_error *err)
{
    if (f->capture != 0 || f->index != s->index || f->error->code)
        return RL_OK;
    forget(s);
    s->frame = f->frame;
    rl_ab_layout_make(s->plan->n_listed, f->width, f->height, &s->layout);
    rl_code code = take_tiles(s, f, err);
    if (code)
        forget(s);
    s->taken = !code;
    return code;
}

/* ---- the picture --------------------------------------------------------------------------------------- */

rl_code rl_ab_sheet_write(const rl_ab_sheet *s, const char *path, rl_error *err)
{
    const rl_ab_layout *l = &s->layout;
    if (!s->taken)
        return rl_fail_file(err, RL_E_DATA, path, "is not written: its frame has failed or did not run");
    size_t n = (size_t)l->width * (size_t)l->height;
    float *pixels = rl_malloc(3 * n * sizeof *pixels);
    if (!pixels)
        return rl_fail_memory(err, 3 * n * sizeof *pixels);
    rl_code code = rl_ab_sheet_draw(s, (float *const[3]){pixels, pixels + n, pixels + 2 * n}, err);
    rl_image_planes image = {.width = l->width,
                             .height = l->height,
                             .channels = 3,
                             .plane = {pixels, pixels + n, pixels + 2 * n},
                             .stride = (size_t)l->width};
    rl_image_options options = {.type = RL_IMAGE_U8, .colorspace = "sRGB", .compression = 6};
    if (!code)
        code = rl_image_file_write(path, &image, &options, s->pool, NULL, err);
    rl_free(pixels);
    return code;
}
