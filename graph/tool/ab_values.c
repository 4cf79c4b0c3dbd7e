/* Statistics of maps, material by material. */
#include <math.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/tool/ab_measure_parts.h"

rl_code rl_ab_pixels_sort(rl_ab_pixels *pixels, const rl_experiment_frame *frame, rl_error *err)
{
    size_t *begin = pixels->begin, n = pixels->n_materials;
    memset(begin, 0, (n + 1) * sizeof *begin);
    for (int y = 0; y < frame->height; y++) {
        const uint32_t *row = frame->stencil + (size_t)y * frame->stencil_stride;
        for (int x = 0; x < frame->width; x++) {
            if (row[x] >= n)
                return rl_fail(err, RL_E_INTERNAL, RL_NOWHERE,
                               "pixel (%d, %d) has material %u, the capture has %zu", x + frame->x,
                               y + frame->y, row[x], n);
            if (row[x])
                begin[row[x]]++;
        }
    }
    size_t sum = 0;
    for (size_t m = 1; m < n; m++) { /* counts become where each begins */
        size_t count = begin[m];
        begin[m] = sum;
        sum += count;
    }
    begin[n] = sum;
    pixels->n_pixels = sum;
    for (int y = 0; y < frame->height; y++) {
        const uint32_t *row = frame->stencil + (size_t)y * frame->stencil_stride;
        for (int x = 0; x < frame->width; x++)
            if (row[x])
                pixels->order[begin[row[x]]++] = (uint32_t)y * (uint32_t)frame->width + (uint32_t)x;
    }
    for (size_t m = n - 1; m > 0; m--) /* each now stands at its end, where the next one begins */
        begin[m] = m > 1 ? begin[m - 1] : 0;
    return RL_OK;
}

/* The map's values at pixels order[first … last - 1], without NaN; how many. */
static size_t gather(const rl_ab_pixels *pixels, const float *map, size_t first, size_t last, float *out)
{
    size_t n = 0;
    for (size_t i = first; i < last; i++) {
        float v = map[pixels->order[i]];
        if (!isnan(v))
            out[n++] = v;
    }
    return n;
}

rl_code rl_ab_pixels_stats(const rl_ab_pixels *pixels, rl_metric metric, const float *map, double peak,
                           int part, rl_ab_sums *sums, rl_error *err)
{
    float *values = rl_malloc(pixels->n_pixels * sizeof *values);
    if (!values)
        return rl_fail_memory(err, pixels->n_pixels * sizeof *values);
    for (size_t m = part ? 1 : 0; m < (part ? pixels->n_materials : 1); m++) {
        size_t first = m ? pixels->begin[m] : 0, last = m ? pixels->begin[m + 1] : pixels->n_pixels;
        sums[m].pixels = gather(pixels, map, first, last, values);
        rl_metric_stats_of(metric, values, sums[m].pixels, peak, sums[m].stats);
    }
    rl_free(values);
    return RL_OK;
}
