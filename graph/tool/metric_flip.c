/* LDR-FLIP. Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild: FLIP: A Difference Evaluator
 * for Alternating Images, HPG 2020. Equation numbers below are that paper's sections: 4.1 colour, 4.2
 * features, 4.3 both. All its filters are separable, or sums of two that are. */
#include <math.h>
#include <stdatomic.h>

#include "graph/base/alloc.h"
#include "graph/tool/metric_color.h"
#include "graph/tool/metric_filter.h"
#include "graph/tool/metric_maps.h"

#define PI 3.14159265358979323846

/* The paper's constants. */
static const double qc = 0.7, pc = 0.4,
                    pt = 0.95;             /* 4.1.3: exponent, and where the error's remapping bends */
static const double feature_width = 0.082; /* 4.2: degrees, peak to trough of the edge detector */
static const double qf = 0.5;              /* 4.2: exponent */

/* The filters along rows, and what they read of YCxCz. */
enum { H_Y, H_CX, H_CZ1, H_CZ2, H_SMOOTH, H_EDGE, H_POINT, N_ACROSS };
static const int source_plane[N_ACROSS] = {0, 1, 2, 2, 0, 0, 0};

/* The filters along columns, and which of the above they read. */
enum { V_Y, V_CX, V_CZ1, V_CZ2, V_EDGE_X, V_EDGE_Y, V_POINT_X, V_POINT_Y, N_DOWN };
static const int source_across[N_DOWN] = {H_Y, H_CX, H_CZ1, H_CZ2, H_EDGE, H_SMOOTH, H_POINT, H_SMOOTH};

/* One row of both images, through all filters. */
typedef struct filtered {
    double *at[2][N_DOWN];
} filtered;

struct rl_flip {
    int width, height;
    rl_filter across[N_ACROSS], down[N_DOWN];
    rl_matrix rgb_from_xyz;
    double largest; /* the colour error that becomes 1: green against blue, to the power of qc */
    float *planes;  /* YCxCz of the reference, then of the test image */
    float *opponent[2][3];
    const rl_flip_input *input;
    float *map;
    atomic_bool failed; /* memory ran out in a task */
};

/* ---- filters ------------------------------------------------------------------------------------------- */

/* 4.1.1: the contrast sensitivity of a channel is a sum of two Gaussians, a·√(π/b)·exp(-π²·d²/b), d in
 * degrees. Both are normalized here, and their shares of the whole are put into the vertical filters. */
static void make_sensitivity(rl_flip *f, int across, int down, double b, double share, int radius)
{
    f->across[across] = rl_filter_gaussian(RL_PIXELS_PER_DEGREE * sqrt(b / 2) / PI, radius);
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
    make_sensitivity(f, H_Y, V_Y, b_y, 1, radius);
    make_sensitivity(f, H_CX, V_CX, b_cx, 1, radius);
    make_sensitivity(f, H_CZ1, V_CZ1, b_cz[0], mass1 / (mass1 + mass2), radius);
    make_sensitivity(f, H_CZ2, V_CZ2, b_cz[1], mass2 / (mass1 + mass2), radius);

    double sigma = 0.5 * feature_width * RL_PIXELS_PER_DEGREE;
    radius = (int)ceil(3 * sigma);
    f->across[H_SMOOTH] = f->down[V_EDGE_X] = f->down[V_POINT_X] = rl_filter_gaussian(sigma, radius);
    f->across[H_EDGE] = f->down[V_EDGE_Y] = make_derivative(sigma, radius, 1);
    f->across[H_POINT] = f->down[V_POINT_Y] = make_derivative(sigma, radius, 2);
}

/* ---- one pixel ----------------------------------------------------------------------------------------- */

/* 4.1.2: L*a*b*, chroma scaled by lightness after Hunt. */
static void hunt_lab(const double rgb[3], double lab[3])
{
    rl_lab_from_rgb(rgb, lab);
    lab[1] *= 0.01 * lab[0];
    lab[2] *= 0.01 * lab[0];
}

/* 4.1.3: city block in lightness, Euclid in chroma. */
static double hyab(const double a[3], const double b[3])
{
    double da = a[1] - b[1], db = a[2] - b[2];
    return fabs(a[0] - b[0]) + sqrt(da * da + db * db);
}

static double color_error(const rl_flip *f, const filtered *rows, int x)
{
    double lab[2][3];
    for (int k = 0; k < 2; k++) {
        double opponent[3] = {rows->at[k][V_Y][x], rows->at[k][V_CX][x],
                              rows->at[k][V_CZ1][x] + rows->at[k][V_CZ2][x]};
        double rgb[3];
        rl_rgb_from_opponent(&f->rgb_from_xyz, opponent, rgb);
        for (int c = 0; c < 3; c++)
            rgb[c] = fmin(fmax(rgb[c], 0), 1);
        hunt_lab(rgb, lab[k]);
    }
    double error = pow(hyab(lab[0], lab[1]), qc), bend = pc * f->largest;
    return error < bend ? pt / bend * error : pt + (error - bend) / (f->largest - bend) * (1 - pt);
}

static double feature_error(const filtered *rows, int x)
{
    /* Filters that sum to zero: of (Y + 16) / 116, which is 0 … 1, only the factor is left. */
    double edge[2], point[2];
    for (int k = 0; k < 2; k++) {
        double *const *d = rows->at[k];
        edge[k] = sqrt(d[V_EDGE_X][x] * d[V_EDGE_X][x] + d[V_EDGE_Y][x] * d[V_EDGE_Y][x]) / 116;
        point[k] = sqrt(d[V_POINT_X][x] * d[V_POINT_X][x] + d[V_POINT_Y][x] * d[V_POINT_Y][x]) / 116;
    }
    return pow(fmax(fabs(edge[0] - edge[1]), fabs(point[0] - point[1])) / sqrt(2), qf);
}

/* ---- bands of rows ------------------------------------------------------------------------------------- */

static void convert_band(void *ctx, int band)
{
    rl_flip *f = ctx;
    int end = (band + 1) * RL_BAND_ROWS < f->height ? (band + 1) * RL_BAND_ROWS : f->height;
    for (int y = band * RL_BAND_ROWS; y < end; y++) {
        for (int x = 0; x < f->width; x++) {
            size_t at = (size_t)y * (size_t)f->width + (size_t)x;
            for (int k = 0; k < 2; k++) {
                double rgb[3], opponent[3];
                f->input->prepare(f->input->ctx, f->input->image[k], x, y, rgb);
                rl_opponent_from_rgb(rgb, opponent);
                for (int c = 0; c < 3; c++)
                    f->opponent[k][c][at] = (float)opponent[c];
            }
        }
    }
}

/* Rows first … last - 1 of one image, filtered along, to rows[y - first] of each filter. */
static void filter_across(const rl_flip *f, int k, int first, int last, double *padded, double *out)
{
    size_t n = (size_t)rl_filter_width(f->width);
    for (int y = first; y < last; y++) {
        int loaded = -1;
        for (int h = 0; h < N_ACROSS; h++) {
            if (source_plane[h] != loaded) {
                loaded = source_plane[h];
                rl_filter_pad(padded, f->opponent[k][loaded] + (size_t)y * (size_t)f->width, f->width);
            }
            rl_filter_along(out + ((size_t)(y - first) * N_ACROSS + (size_t)h) * n, padded, &f->across[h],
                            (int)n);
        }
    }
}

/* Row y of all filters along columns, from rows first … last - 1; beyond the image its border is repeated. */
static void filter_down(const rl_flip *f, const double *across, int first, int y, double *const out[N_DOWN])
{
    size_t n = (size_t)rl_filter_width(f->width);
    for (int v = 0; v < N_DOWN; v++) {
        const rl_filter *filter = &f->down[v];
        const double *rows[2 * RL_FILTER_RADIUS + 1];
        int taps = 2 * filter->radius + 1;
        for (int i = 0; i < taps; i++) {
            int from = y - filter->radius + i;
            from = from < 0 ? 0 : from < f->height ? from : f->height - 1;
            rows[i] = across + ((size_t)(from - first) * N_ACROSS + (size_t)source_across[v]) * n;
        }
        rl_filter_sum(out[v], rows, filter->w, taps, (int)n);
    }
}

static void compare_row(const rl_flip *f, int y, const filtered *rows)
{
    float *map = f->map + (size_t)y * (size_t)f->width;
    for (int x = 0; x < f->width; x++) {
        double color = color_error(f, rows, x), feature = feature_error(rows, x);
        map[x] = fmaxf(map[x], (float)pow(color, 1 - feature)); /* 4.3 */
    }
}

static void compare_band(void *ctx, int band)
{
    rl_flip *f = ctx;
    int begin = band * RL_BAND_ROWS;
    int end = begin + RL_BAND_ROWS < f->height ? begin + RL_BAND_ROWS : f->height;
    int first = begin > RL_FILTER_RADIUS ? begin - RL_FILTER_RADIUS : 0;
    int last = end + RL_FILTER_RADIUS < f->height ? end + RL_FILTER_RADIUS : f->height;
    size_t n = (size_t)rl_filter_width(f->width), one = (size_t)(last - first) * N_ACROSS * n;
    size_t count = 2 * one + 2 * N_DOWN * n + n + 2 * RL_FILTER_RADIUS;
    double *scratch = rl_aligned(count * sizeof *scratch);
    filtered rows;
    if (!scratch) {
        atomic_store(&f->failed, true);
        return;
    }
    for (int i = 0; i < 2 * N_DOWN; i++)
        rows.at[i / N_DOWN][i % N_DOWN] = scratch + 2 * one + (size_t)i * n;
    for (int k = 0; k < 2; k++)
        filter_across(f, k, first, last, scratch + 2 * one + 2 * N_DOWN * n, scratch + (size_t)k * one);
    for (int y = begin; y < end; y++) {
        for (int k = 0; k < 2; k++)
            filter_down(f, scratch + (size_t)k * one, first, y, rows.at[k]);
        compare_row(f, y, &rows);
    }
    rl_free(scratch);
}

/* ---- the whole image ----------------------------------------------------------------------------------- */

rl_code rl_flip_new(int width, int height, rl_flip **out, rl_error *err)
{
    size_t n = (size_t)width * (size_t)height;
    rl_flip *f = rl_calloc(1, sizeof *f);
    *out = f;
    if (f)
        f->planes = rl_calloc(n, 6 * sizeof *f->planes);
    if (!f || !f->planes) {
        rl_flip_free(out);
        return rl_fail_memory(err, 6 * n * sizeof(float));
    }
    f->width = width;
    f->height = height;
    for (size_t i = 0; i < 6; i++)
        f->opponent[i / 3][i % 3] = f->planes + i * n;
    make_filters(f);
    f->rgb_from_xyz = rl_rgb_from_xyz();
    double green[3], blue[3];
    hunt_lab((const double[3]){0, 1, 0}, green);
    hunt_lab((const double[3]){0, 0, 1}, blue);
    f->largest = pow(hyab(green, blue), qc);
    return RL_OK;
}

void rl_flip_free(rl_flip **flip)
{
    if (*flip)
        rl_free((*flip)->planes);
    rl_free(*flip);
    *flip = NULL;
}

rl_code rl_flip_raise(rl_flip *flip, const rl_flip_input *input, rl_pool *pool, float *map, rl_error *err)
{
    flip->input = input;
    flip->map = map;
    atomic_store(&flip->failed, false);
    rl_filter_bands(pool, rl_band_count(flip->height), convert_band, flip);
    rl_filter_bands(pool, rl_band_count(flip->height), compare_band, flip);
    if (atomic_load(&flip->failed))
        return rl_fail_memory(err, sizeof(double) * 2 * (RL_BAND_ROWS + 2 * RL_FILTER_RADIUS) * N_ACROSS *
                                       (size_t)rl_filter_width(flip->width));
    return RL_OK;
}

static void prepare(void *ctx, const rl_metric_image *image, int x, int y, double rgb[3])
{
    (void)ctx;
    rl_metric_linear(image, x, y, rgb);
    for (int c = 0; c < 3; c++)
        rgb[c] = fmin(rgb[c], 1);
}

rl_code rl_flip_map(const rl_metric_image *reference, const rl_metric_image *test, rl_pool *pool, float *map,
                    rl_error *err)
{
    rl_flip *flip = NULL;
    rl_flip_input input = {{reference, test}, prepare, NULL};
    rl_code code = rl_flip_new(reference->width, reference->height, &flip, err);
    for (size_t i = 0, n = (size_t)reference->width * (size_t)reference->height; i < n; i++)
        map[i] = 0;
    if (!code)
        code = rl_flip_raise(flip, &input, pool, map, err);
    rl_flip_free(&flip);
    return code;
}
