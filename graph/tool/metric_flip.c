/* LDR-FLIP. Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild: FLIP: A Difference Evaluator
 * for Alternating Images, HPG 2020. Section numbers are that paper's: 4.1 colour, 4.2 features, 4.3 both. All
 * its filters are separable, or sums of two that are.
 *
 * Images are cut into tiles whose rows, filtered along, stay in a core's cache while they are filtered down.
 * Where a test image has the reference's pixels, as far as the filters reach, the error is 0: such tiles are
 * skipped, and what the reference needs is computed once for all tests. */
#include <math.h>
#include <stdatomic.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/tool/metric_filter.h"
#include "graph/tool/metric_flip_rows.h"
#include "graph/tool/metric_maps.h"

#define PI 3.14159265358979323846

enum {
    TILE_COLUMNS = 128, /* a multiple of RL_FILTER_BLOCK */
    TILE_ROWS = 64,
    REACH = RL_FILTER_RADIUS,
    PADDED = TILE_COLUMNS + 2 * REACH /* columns that the filters along rows read */
};
static const double feature_width = 0.082; /* 4.2: degrees, peak to trough of the edge detector */

/* The filters along rows, and what they read of YCxCz. */
enum { H_Y, H_CX, H_CZ1, H_CZ2, H_SMOOTH, H_EDGE, H_POINT, N_ACROSS };
static const int source_plane[N_ACROSS] = {0, 1, 2, 2, 0, 0, 0};

/* The filters along columns read these. */
static const int source_across[RL_FLIP_FILTERED] = {
    [RL_FLIP_Y] = H_Y,           [RL_FLIP_CX] = H_CX,         [RL_FLIP_CZ1] = H_CZ1,
    [RL_FLIP_CZ2] = H_CZ2,       [RL_FLIP_EDGE_X] = H_EDGE,   [RL_FLIP_EDGE_Y] = H_SMOOTH,
    [RL_FLIP_POINT_X] = H_POINT, [RL_FLIP_POINT_Y] = H_SMOOTH};

struct rl_flip {
    int width, height;
    rl_filter across[N_ACROSS], down[RL_FLIP_FILTERED];
    rl_matrix rgb_from_xyz;
    double largest; /* the colour error that becomes 1: green against blue, to the power of 0.7 */
    const rl_flip_input *input;
    float *const *maps;
    atomic_bool failed; /* memory ran out in a task */
};

/* ---- filters ------------------------------------------------------------------------------------------- */

/* 4.1.1: the contrast sensitivity of a channel is a sum of two Gaussians, a·√(π/b)·exp(-π²·d²/b), d in
 * degrees. Both are normalized here, and their shares of the whole are put into the vertical filters. */
static void make_sensitivity(rl_flip *f, int across, int down, double b, double share, int radius)
{
    double sigma = RL_PIXELS_PER_DEGREE * sqrt(b / 2) / PI;
    int reach = (int)ceil(7 * sigma); /* e^(-7² / 2): below 3e-11 of the middle */
    radius = reach < radius ? reach : radius;
    f->across[across] = rl_filter_gaussian(sigma, radius);
    f->down[down] = f->across[across];
    for (int i = 0; i <= 2 * radius; i++)
        f->down[down].w[i] *= share;
}

/* The sum over the pixel grid of one of the two Gaussians: its weight in the whole. */
static double mass(double a, double b, int radius)
{
    double sum = 0;
    for (int i = -radius; i <= radius; i++)
        sum += exp(-PI * PI * i * i / (b * RL_PIXELS_PER_DEGREE * RL_PIXELS_PER_DEGREE));
    return a * sqrt(PI / b) * sum * sum;
}

/* 4.2: the first (edges) or second (points) derivative of a Gaussian along one axis; what is above zero sums
 * to 1, what is below to -1. */
static rl_filter make_derivative(double sigma, int radius, int order)
{
    rl_filter f = {.radius = radius};
    double above = 0, below = 0;
    for (int i = -radius; i <= radius; i++) {
        double v = (order == 1 ? -i : i * i / (sigma * sigma) - 1) * exp(-i * i / (2 * sigma * sigma));
        f.w[i + radius] = v;
        above += v > 0 ? v : 0;
        below -= v < 0 ? v : 0;
    }
    for (int i = 0; i <= 2 * radius; i++)
        f.w[i] /= f.w[i] > 0 ? above : below;
    return f;
}

static void make_filters(rl_flip *f)
{
    const double b_y = 0.0047, b_cx = 0.0053, a_cz[2] = {34.1, 13.5}, b_cz[2] = {0.04, 0.025};
    int radius = (int)ceil(3 * sqrt(b_cz[0] / 2) / PI * RL_PIXELS_PER_DEGREE);
    double mass1 = mass(a_cz[0], b_cz[0], radius), mass2 = mass(a_cz[1], b_cz[1], radius);
    make_sensitivity(f, H_Y, RL_FLIP_Y, b_y, 1, radius);
    make_sensitivity(f, H_CX, RL_FLIP_CX, b_cx, 1, radius);
    make_sensitivity(f, H_CZ1, RL_FLIP_CZ1, b_cz[0], mass1 / (mass1 + mass2), radius);
    make_sensitivity(f, H_CZ2, RL_FLIP_CZ2, b_cz[1], mass2 / (mass1 + mass2), radius);

    double sigma = 0.5 * feature_width * RL_PIXELS_PER_DEGREE;
    radius = (int)ceil(3 * sigma);
    f->across[H_SMOOTH] = f->down[RL_FLIP_EDGE_X] = f->down[RL_FLIP_POINT_X] =
        rl_filter_gaussian(sigma, radius);
    f->across[H_EDGE] = f->down[RL_FLIP_EDGE_Y] = make_derivative(sigma, radius, 1);
    f->across[H_POINT] = f->down[RL_FLIP_POINT_Y] = make_derivative(sigma, radius, 2);
}

/* 4.1.3: the largest difference of two colours, of their L*a*b* whose chroma is scaled by lightness. */
static double largest_error(void)
{
    double lab[2][3];
    rl_lab_from_rgb((const double[3]){0, 1, 0}, lab[0]);
    rl_lab_from_rgb((const double[3]){0, 0, 1}, lab[1]);
    double da = 0.01 * (lab[0][0] * lab[0][1] - lab[1][0] * lab[1][1]);
    double db = 0.01 * (lab[0][0] * lab[0][2] - lab[1][0] * lab[1][2]);
    return pow(fabs(lab[0][0] - lab[1][0]) + sqrt(da * da + db * db), 0.7);
}

/* ---- tiles --------------------------------------------------------------------------------------------- */

typedef struct tile {
    int x0, x1, y0, y1;  /* pixels, the ends excluded */
    int first, last;     /* rows that the filters along columns read */
    int n;               /* x1 - x0 in whole blocks */
    double *across;      /* [last - first][N_ACROSS][n] of one image */
    double *features[2]; /* [y1 - y0][RL_FLIP_FEATURES][n] of the reference, of a test */
    double *padded[3];   /* a row of R, G, B, then Y, Cx, Cz, from column x0 - REACH on */
    double *filtered[RL_FLIP_FILTERED], *errors;
} tile;

/* A row of the image in linear light, then in YCxCz; beyond the image its border is repeated. */
static void load_row(const rl_flip *f, const rl_metric_image *image, const tile *t, int y)
{
    int padded = t->n + 2 * REACH;
    for (int c = 0; c < 3; c++) {
        const float *row = image->plane[image->channels == 1 ? 0 : c] + (size_t)y * image->stride;
        int x = t->x0 - REACH, begin = x < 0 ? -x : 0;
        int end = x + padded < f->width ? padded : f->width - x;
        for (int i = 0; i < begin; i++)
            t->padded[c][i] = (double)row[0];
        for (int i = begin; i < end; i++)
            t->padded[c][i] = (double)row[x + i];
        for (int i = end; i < padded; i++)
            t->padded[c][i] = (double)row[f->width - 1];
        rl_flip_curve_row(f->input->curve, f->input->scale, t->padded[c], padded);
    }
    rl_flip_opponent_row(t->padded, padded);
}

/* Filters along rows, then along columns, then what is compared of each pixel. */
static void describe(const rl_flip *f, const rl_metric_image *image, const tile *t, double *features)
{
    size_t n = (size_t)t->n;
    for (int y = t->first; y < t->last; y++) {
        double *out = t->across + (size_t)(y - t->first) * N_ACROSS * n;
        load_row(f, image, t, y);
        for (int h = 0; h < N_ACROSS; h++)
            rl_filter_along(out + (size_t)h * n, t->padded[source_plane[h]], &f->across[h], t->n);
    }
    for (int y = t->y0; y < t->y1; y++) {
        double *out[RL_FLIP_FEATURES];
        for (int v = 0; v < RL_FLIP_FILTERED; v++) {
            const rl_filter *filter = &f->down[v];
            const double *rows[2 * RL_FILTER_RADIUS + 1];
            int taps = 2 * filter->radius + 1;
            for (int i = 0; i < taps; i++) {
                int from = y - filter->radius + i;
                from = from < 0 ? 0 : from < f->height ? from : f->height - 1;
                rows[i] = t->across + ((size_t)(from - t->first) * N_ACROSS + (size_t)source_across[v]) * n;
            }
            rl_filter_sum(t->filtered[v], rows, filter->w, taps, t->n);
        }
        for (size_t i = 0; i < RL_FLIP_FEATURES; i++)
            out[i] = features + ((size_t)(y - t->y0) * RL_FLIP_FEATURES + i) * n;
        rl_flip_features_row(&f->rgb_from_xyz, t->filtered, out, t->n);
    }
}

/* Has the test the reference's pixels wherever the tile's filters reach? */
static bool is_equal(const rl_flip *f, const rl_metric_image *a, const rl_metric_image *b, const tile *t)
{
    int x0 = t->x0 > REACH ? t->x0 - REACH : 0, x1 = t->x1 + REACH < f->width ? t->x1 + REACH : f->width;
    for (int c = 0; c < a->channels && c < 3; c++)
        for (int y = t->first; y < t->last; y++)
            if (memcmp(a->plane[c] + (size_t)y * a->stride + (size_t)x0,
                       b->plane[c] + (size_t)y * b->stride + (size_t)x0, (size_t)(x1 - x0) * sizeof(float)))
                return false;
    return true;
}

static void compare(const rl_flip *f, const tile *t, float *map)
{
    for (int y = t->y0; y < t->y1; y++) {
        double *rows[2][RL_FLIP_FEATURES];
        for (int k = 0; k < 2; k++)
            for (size_t i = 0; i < RL_FLIP_FEATURES; i++)
                rows[k][i] = t->features[k] + ((size_t)(y - t->y0) * RL_FLIP_FEATURES + i) * (size_t)t->n;
        rl_flip_compare_row(rows[0], rows[1], f->largest, t->errors, t->n,
                            map + (size_t)y * (size_t)f->width + (size_t)t->x0, t->x1 - t->x0);
    }
}

static int tiles_across(const rl_flip *f)
{
    return (f->width + TILE_COLUMNS - 1) / TILE_COLUMNS;
}

static tile tile_at(const rl_flip *f, int index)
{
    tile t = {.x0 = index % tiles_across(f) * TILE_COLUMNS, .y0 = index / tiles_across(f) * TILE_ROWS};
    t.x1 = t.x0 + TILE_COLUMNS < f->width ? t.x0 + TILE_COLUMNS : f->width;
    t.y1 = t.y0 + TILE_ROWS < f->height ? t.y0 + TILE_ROWS : f->height;
    t.first = t.y0 > REACH ? t.y0 - REACH : 0;
    t.last = t.y1 + REACH < f->height ? t.y1 + REACH : f->height;
    t.n = rl_filter_width(t.x1 - t.x0);
    return t;
}

enum {
    ACROSS_ROOM = (TILE_ROWS + 2 * REACH) * N_ACROSS * TILE_COLUMNS,
    FEATURES_ROOM = TILE_ROWS * RL_FLIP_FEATURES * TILE_COLUMNS,
    TILE_ROOM = ACROSS_ROOM + 2 * FEATURES_ROOM + 3 * PADDED + (RL_FLIP_FILTERED + 1) * TILE_COLUMNS
};

static void share_room(tile *t, double *room)
{
    t->across = room;
    room += ACROSS_ROOM;
    for (int k = 0; k < 2; k++, room += FEATURES_ROOM)
        t->features[k] = room;
    for (int c = 0; c < 3; c++, room += PADDED)
        t->padded[c] = room;
    for (int v = 0; v < RL_FLIP_FILTERED; v++, room += TILE_COLUMNS)
        t->filtered[v] = room;
    t->errors = room;
}

static void compare_tile(void *ctx, int index)
{
    rl_flip *f = ctx;
    tile t = tile_at(f, index);
    double *room = NULL;
    for (size_t i = 0; i < f->input->n_tests; i++) {
        const rl_metric_image *test = &f->input->tests[i];
        if (is_equal(f, f->input->reference, test, &t))
            continue;
        if (!room) { /* the first that differs */
            room = rl_malloc(TILE_ROOM * sizeof *room);
            if (!room) {
                atomic_store(&f->failed, true);
                return;
            }
            share_room(&t, room);
            describe(f, f->input->reference, &t, t.features[0]);
        }
        describe(f, test, &t, t.features[1]);
        compare(f, &t, f->maps[i]);
    }
    rl_free(room);
}

/* ---- the whole image ----------------------------------------------------------------------------------- */

rl_code rl_flip_new(int width, int height, rl_flip **out, rl_error *err)
{
    rl_flip *f = *out = rl_calloc(1, sizeof *f);
    if (!f)
        return rl_fail_memory(err, sizeof *f);
    f->width = width;
    f->height = height;
    make_filters(f);
    f->rgb_from_xyz = rl_rgb_from_xyz();
    f->largest = largest_error();
    return RL_OK;
}

void rl_flip_free(rl_flip **flip)
{
    rl_free(*flip);
    *flip = NULL;
}

rl_code rl_flip_raise(rl_flip *f, const rl_flip_input *input, rl_pool *pool, float *const *maps,
                      rl_error *err)
{
    f->input = input;
    f->maps = maps;
    atomic_store(&f->failed, false);
    rl_filter_bands(pool, tiles_across(f) * ((f->height + TILE_ROWS - 1) / TILE_ROWS), compare_tile, f);
    return atomic_load(&f->failed) ? rl_fail_memory(err, TILE_ROOM * sizeof(double)) : RL_OK;
}

rl_code rl_flip_maps(const rl_metric_image *reference, const rl_metric_image *tests, size_t n, rl_pool *pool,
                     float *const *maps, rl_error *err)
{
    rl_flip *flip = NULL;
    const rl_flip_input input = {reference, tests, n, reference->encoded ? RL_FLIP_SRGB : RL_FLIP_CLAMP, 1};
    rl_code code = rl_flip_new(reference->width, reference->height, &flip, err);
    for (size_t i = 0; i < n; i++)
        memset(maps[i], 0, (size_t)reference->width * (size_t)reference->height * sizeof *maps[i]);
    if (!code)
        code = rl_flip_raise(flip, &input, pool, maps, err);
    rl_flip_free(&flip);
    return code;
}
