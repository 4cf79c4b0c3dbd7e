/* HDR-FLIP. Andersson, Nilsson, Shirley, Akenine-Möller: Visualizing Errors in Rendered High Dynamic Range
 * Images, Eurographics 2021 (short papers). */
#include <math.h>

#include "graph/base/alloc.h"
#include "graph/tool/metric_color.h"
#include "graph/tool/metric_maps.h"
#include "graph/tool/select.h"

/* Narkowicz 2015: a fit of the ACES tone curve, (k0 x² + k1 x) / (k3 x² + k4 x + k5); its exposure of 0.6 is
 * folded into the factors. */
static const double k0 = 0.6 * 0.6 * 2.51, k1 = 0.6 * 0.03, k3 = 0.6 * 0.6 * 2.43, k4 = 0.6 * 0.59, k5 = 0.14;

/* The paper's t_min and t_max: what the median and the largest luminance are exposed to. */
static const double target = 0.85;

static double tone(double x)
{
    /* Divided by x, so that no square overflows; the curve tends to k0 / k3, which is above 1. */
    double y = x > 0 ? (k0 * x + k1) / (k3 * x + k4 + k5 / x) : 0;
    return fmin(y, 1);
}

/* The luminance that the curve maps to `target`. */
static double tone_inverse(void)
{
    double a = k0 - target * k3, b = k1 - target * k4, c = -target * k5;
    return (-b + sqrt(b * b - 4 * a * c)) / (2 * a);
}

rl_code rl_metric_exposures(const rl_metric_image *reference, rl_exposures *out, rl_error *err)
{
    size_t n = 0, above = 0, all = (size_t)reference->width * (size_t)reference->height;
    float *values = rl_malloc(all * sizeof *values);
    double largest = 0;
    *out = (rl_exposures){0, 0, 2};
    if (!values)
        return rl_fail_memory(err, all * sizeof *values);
    for (int y = 0; y < reference->height; y++) {
        for (int x = 0; x < reference->width; x++) {
            double rgb[3];
            rl_metric_linear(reference, x, y, rgb);
            double v = rl_luminance(rgb);
            largest = fmax(largest, v);
            values[n++] = (float)v;
        }
    }
    double median = (double)rl_select(values, n, n / 2);
    if (median <= 0) {
        for (size_t i = 0; i < n; i++)
            if (values[i] > 0)
                values[above++] = values[i];
        median = above ? (double)rl_select(values, above, above / 2) : 0;
    }
    rl_free(values);
    if (median <= 0)
        return RL_OK;
    out->first = log2(tone_inverse() / largest);
    out->last = fmax(log2(tone_inverse() / median), out->first); /* the median was rounded to float */
    out->n = (int)fmax(2, ceil(out->last - out->first));
    return RL_OK;
}

static void prepare(void *ctx, const rl_metric_image *image, int x, int y, double rgb[3])
{
    const double *scale = ctx;
    rl_metric_linear(image, x, y, rgb);
    for (int c = 0; c < 3; c++)
        rgb[c] = tone(rgb[c] * *scale);
}

rl_code rl_hdrflip_map(const rl_metric_image *reference, const rl_metric_image *test, rl_pool *pool,
                       float *map, rl_error *err)
{
    rl_flip *flip = NULL;
    rl_exposures e;
    double scale;
    rl_flip_input input = {{reference, test}, prepare, &scale};
    rl_code code = rl_metric_exposures(reference, &e, err);
    if (!code)
        code = rl_flip_new(reference->width, reference->height, &flip, err);
    for (size_t i = 0, n = (size_t)reference->width * (size_t)reference->height; i < n; i++)
        map[i] = 0;
    for (int i = 0; !code && i < e.n; i++) {
        scale = exp2(e.first + i * (e.last - e.first) / (e.n - 1));
        code = rl_flip_raise(flip, &input, pool, map, err);
        if (e.last <= e.first)
            break; /* all exposures are one */
    }
    rl_flip_free(&flip);
    return code;
}
