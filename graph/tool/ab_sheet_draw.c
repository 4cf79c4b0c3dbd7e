/* The contact sheet's tiles and labels. */
#include <math.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/run/image_text.h"
#include "graph/tool/ab_sheet_parts.h"
#include "graph/tool/metric_color.h"

enum { GAP = 16, MOST_TILE = 960, LEAST_CELL = 256, LINES = 3 /* of a label */ };

/* ---- where things are ---------------------------------------------------------------------------------- */

static double smaller(double a, double b)
{
    return a < b ? a : b;
}

static void lay_out(size_t n, int columns, int width, int height, rl_ab_layout *l)
{
    int rows = (int)((n + (size_t)columns - 1) / (size_t)columns);
    double text = 18, most = RL_AB_SHEET_MOST - GAP;
    for (int i = 0; i < 2; i++) { /* text follows the cells, whose height follows the text */
        double label = LINES * 1.4 * text, top = 2.0 * text;
        double scale = smaller(1, (double)MOST_TILE / width);
        scale = smaller(scale, (most / columns - GAP) / width);
        scale = smaller(scale, ((most - top) / rows - label - GAP) / height);
        l->tile_width = (int)fmax(1, floor(width * scale));
        l->tile_height = (int)fmax(1, floor(height * scale));
        int least = (int)smaller(LEAST_CELL, most / columns - GAP);
        l->cell_width = (l->tile_width > least ? l->tile_width : least) + GAP;
        l->cell_height = l->tile_height + (int)ceil(label) + GAP;
        l->width = columns * l->cell_width + GAP;
        l->height = rows * l->cell_height + (int)ceil(top) + GAP;
        l->text = (int)text;
        text = fmax(9, smaller(24, l->cell_width / 24.0));
    }
    l->columns = columns;
    l->rows = rows;
}

void rl_ab_layout_make(size_t n, int width, int height, rl_ab_layout *out)
{
    double best = INFINITY;
    for (int columns = 1; columns <= (int)n; columns++) {
        rl_ab_layout l;
        lay_out(n, columns, width, height, &l);
        /* Small tiles are worse than an odd shape, and than places that stay empty. */
        double shape = fabs(log((double)l.width / l.height / 1.6)),
               size = log((double)smaller(width, MOST_TILE) / l.tile_width),
               empty = 1 - (double)n / (l.columns * l.rows);
        if (shape + 2 * size + empty < best - 1e-9) {
            best = shape + 2 * size + empty;
            *out = l;
        }
    }
}

/* ---- tiles --------------------------------------------------------------------------------------------- */

typedef struct shrinking {
    const rl_metric_image *image;
    const rl_ab_layout *layout;
    float *out;
} shrinking;

/* The mean over the pixels that [from, to) × [top, bottom) covers, by the part that it covers. */
static double covered(const rl_metric_image *image, int c, double from, double to, double top, double bottom)
{
    double sum = 0, area = 0;
    for (int y = (int)top; y < image->height && y < bottom; y++) {
        double h = smaller(y + 1, bottom) - fmax(y, top);
        for (int x = (int)from; x < image->width && x < to; x++) {
            double a = h * (smaller(x + 1, to) - fmax(x, from));
            sum += a * rl_srgb_decode((double)image->plane[c][(size_t)y * image->stride + (size_t)x]);
            area += a;
        }
    }
    return area > 0 ? sum / area : 0;
}

static void shrink_row(void *ctx, int y)
{
    const shrinking *s = ctx;
    const rl_metric_image *image = s->image;
    int width = s->layout->tile_width, height = s->layout->tile_height;
    double sx = (double)image->width / width, sy = (double)image->height / height;
    for (int c = 0; c < 3; c++) {
        float *out = s->out + ((size_t)c * (size_t)height + (size_t)y) * (size_t)width;
        const float *in = image->plane[c] + (size_t)y * image->stride;
        if (width == image->width && height == image->height)
            memcpy(out, in, (size_t)width * sizeof *out);
        else
            for (int x = 0; x < width; x++)
                out[x] = (float)rl_srgb_encode(covered(image, c, x * sx, (x + 1) * sx, y * sy, (y + 1) * sy));
    }
}

rl_code rl_ab_tile_shrink(const rl_metric_image *image, const rl_ab_layout *l, rl_pool *pool, rl_ab_tile *out,
                          rl_error *err)
{
    size_t samples = 3 * (size_t)l->tile_width * (size_t)l->tile_height;
    out->pixels = rl_malloc(samples * sizeof *out->pixels);
    if (!out->pixels)
        return rl_fail_memory(err, samples * sizeof *out->pixels);
    shrinking s = {image, l, out->pixels};
    if (pool)
        rl_pool_for(pool, l->tile_height, shrink_row, &s);
    else
        for (int y = 0; y < l->tile_height; y++)
            shrink_row(&s, y);
    return RL_OK;
}

/* ---- labels -------------------------------------------------------------------------------------------- */

typedef struct canvas {
    const rl_ab_layout *layout;
    float *const *plane;
    rl_error *err;
} canvas;

/* A line at (x, baseline), cut with an ellipsis where it would be longer than `most`. */
static rl_code draw_line(const canvas *c, int x, int baseline, int most, const char *text,
                         const rl_text_style *style)
{
    int width;
    rl_code code = rl_image_text_width(text, style, &width, c->err);
    rl_str cut = {0};
    size_t n = strlen(text);
    while (!code && width > most && n > 0) {
        do
            n--;
        while (n > 0 && ((unsigned char)text[n] & 0xC0) == 0x80);
        rl_str_free(&cut);
        rl_str_addn(&cut, text, n);
        rl_str_add(&cut, "…");
        code = cut.failed ? rl_fail_memory(c->err, n + 4)
                          : rl_image_text_width(rl_str_text(&cut), style, &width, c->err);
    }
    if (!code)
        code = rl_image_text(c->plane, c->layout->width, c->layout->height, (size_t)c->layout->width, x,
                             baseline, cut.length ? rl_str_text(&cut) : text, style, c->err);
    rl_str_free(&cut);
    return code;
}

/* "taps 8, texturing post": what differs between variants, the last part of each path. */
static void print_values(const rl_ab_plan *plan, size_t variant, rl_str *out)
{
    for (size_t i = 0; i < plan->n_parameters; i++) {
        const rl_ab_parameter *p = &plan->parameters[i];
        const char *dot = strrchr(p->path, '.');
        if (p->values[variant])
            rl_str_printf(out, "%s%s %s", out->length ? ", " : "", dot ? dot + 1 : p->path,
                          p->values[variant]);
    }
}

static void print_flip(const rl_ab_sheet *s, size_t variant, rl_str *out)
{
    const double *flip = s->tiles[variant].flip;
    if (variant + 1 == s->plan->n_listed)
        rl_str_add(out, s->plan->n_listed > 1 ? "the others' FLIP is against this one" : "");
    else
        rl_str_printf(out, "FLIP mean %.4f  p95 %.4f", flip[RL_STAT_MEAN], flip[RL_STAT_P95]);
}

static rl_code draw_label(const rl_ab_sheet *s, const canvas *c, size_t variant, int x, int y)
{
    const rl_text_style name = {s->layout.text, true, {0.92f, 0.92f, 0.92f}},
                        detail = {s->layout.text * 5 / 6, false, {0.72f, 0.72f, 0.72f}};
    int line = (int)ceil(1.35 * s->layout.text), most = s->layout.cell_width - GAP;
    rl_str values = {0}, flip = {0};
    print_values(s->plan, variant, &values);
    print_flip(s, variant, &flip);
    rl_code code = values.failed || flip.failed ? rl_fail_memory(c->err, values.length + flip.length) : RL_OK;
    if (!code)
        code = draw_line(c, x, y + line, most, s->plan->variants[variant].name, &name);
    if (!code)
        code = draw_line(c, x, y + 2 * line, most, rl_str_text(&flip), &detail);
    if (!code && values.length)
        code = draw_line(c, x, y + 3 * line, most, rl_str_text(&values), &detail);
    rl_str_free(&values);
    rl_str_free(&flip);
    return code;
}

static void copy_tile(const rl_ab_layout *l, const rl_ab_tile *tile, float *const plane[3], int x, int y)
{
    for (size_t c = 0; c < 3; c++)
        for (size_t row = 0; row < (size_t)l->tile_height; row++)
            memcpy(plane[c] + ((size_t)y + row) * (size_t)l->width + (size_t)x,
                   tile->pixels + (c * (size_t)l->tile_height + row) * (size_t)l->tile_width,
                   (size_t)l->tile_width * sizeof(float));
}

rl_code rl_ab_sheet_draw(const rl_ab_sheet *s, float *const plane[3], rl_error *err)
{
    const rl_ab_layout *l = &s->layout;
    const float paper = 0.13f;
    const rl_text_style title = {l->text, false, {0.92f, 0.92f, 0.92f}};
    canvas c = {l, plane, err};
    int top = l->height - GAP - l->rows * l->cell_height;
    for (int p = 0; p < 3; p++)
        for (size_t i = 0; i < (size_t)l->width * (size_t)l->height; i++)
            plane[p][i] = paper;
    rl_code code = draw_line(&c, GAP, GAP + l->text, l->width - 2 * GAP, s->title, &title);
    for (size_t i = 0; i < s->plan->n_listed && !code; i++) {
        int x = GAP + (int)(i % (size_t)l->columns) * l->cell_width,
            y = top + GAP + (int)(i / (size_t)l->columns) * l->cell_height;
        copy_tile(l, &s->tiles[i], plane, x, y);
        code = draw_label(s, &c, i, x, y + l->tile_height);
    }
    return code;
}
