/* HDR-FLIP. Andersson, Nilsson, Shirley, Akenine-Möller: Visualizing Errors in Rendered High Dynamic Range
 * Images, Eurographics 2021 (short papers). */
#include <math.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/tool/metric_color.h"
#include "graph/tool/metric_maps.h"
#include "graph/tool/select.h"

/* The paper's t_min and t_max: what the median and the largest luminance are exposed to. */
static const double target = 0.85;

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
    out->first = log2(rl_flip_tone_inverse(target) / largest);
    out->last =
        fmax(log2(rl_flip_tone_inverse(target) / median), out->first); /* the median was rounded to float */
    out->n = (int)fmax(2, ceil(out->last - out->first));
    return RL_OK;
}

rl_code rl_hdrflip_maps(const rl_metric_image *reference, const rl_metric_image *tests, size_t n,
                        rl_pool *pool, float *const *maps, rl_error *err)
{
    rl_flip *flip = NULL;
    rl_exposures e;
    rl_flip_input input = {reference, tests, n, RL_FLIP_TONE, 1};
    rl_code code = rl_metric_exposures(reference, &e, err);
    if (!code)
        code = rl_flip_new(reference->width, reference->height, &flip, err);
    for (size_t i = 0; i < n; i++)
        memset(maps[i], 0, (size_t)reference->width * (size_t)reference->height * sizeof *maps[i]);
    for (int i = 0; !code && i < e.n; i++) {
        input.scale = exp2(e.first + i * (e.last - e.first) / (e.n - 1));
        code = rl_flip_raise(flip, &input, pool, maps, err);
        if (e.last <= e.first)
            break; /* all exposures are one */
    }
    rl_flip_free(&flip);
    return code;
}
