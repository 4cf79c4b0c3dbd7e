/* A display as a table that a browser can evaluate. */
#include <math.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/run/exr_core.h"
#include "graph/tool/ab_page_parts.h"

#define N RL_PAGE_LUT

static double axis(const rl_page_lut *lut, double x)
{
    double t = log2(1 + fabs(x) / lut->knee);
    return x < 0 ? -t : t;
}

static double from_axis(const rl_page_lut *lut, double t)
{
    double x = lut->knee * (exp2(fabs(t)) - 1);
    return t < 0 ? -x : x;
}

void rl_page_lut_free(rl_page_lut *lut)
{
    rl_free(lut->entries);
    rl_free(lut->packed);
    lut->entries = NULL;
    lut->packed = NULL;
}

/* The colours of the entries, planes of n³. */
static void fill(const rl_page_lut *lut, float *planes)
{
    size_t total = (size_t)N * N * N, i = 0;
    float x[N];
    double first = axis(lut, lut->first), last = axis(lut, lut->last);
    for (int k = 0; k < N; k++)
        x[k] = (float)from_axis(lut, first + (last - first) * k / (N - 1));
    for (int r = 0; r < N; r++)
        for (int g = 0; g < N; g++)
            for (int b = 0; b < N; b++, i++) {
                planes[i] = x[r];
                planes[total + i] = x[g];
                planes[2 * total + i] = x[b];
            }
}

rl_code rl_page_lut_bake(const rl_ab_page_display *display, rl_page_lut *out, rl_error *err)
{
    size_t total = (size_t)N * N * N;
    *out = (rl_page_lut){.display = display,
                         .n = N,
                         .knee = 1.0 / 128,
                         .first = -0.125,
                         .last = 128,
                         .low = -0.25,
                         .high = 1.25};
    float *planes = rl_calloc(3 * total, sizeof *planes);
    out->entries = rl_calloc(3 * total, sizeof *out->entries);
    if (!planes || !out->entries) {
        rl_free(planes);
        return rl_fail_memory(err, 3 * total * sizeof *planes);
    }
    fill(out, planes);
    rl_code code = display->apply(display->ctx, planes, planes + total, planes + 2 * total, total, err);
    for (size_t i = 0; i < 3 * total; i++) {
        double v = isnan(planes[i]) ? 0 : fmin(fmax((double)planes[i], out->low), out->high);
        out->entries[i] = (uint16_t)lrint((v - out->low) / (out->high - out->low) * 65535);
    }
    rl_free(planes);
    const rl_page_plain plain = {16, 3, N, N * N, out->entries};
    return code ? code : rl_page_pack(&plain, &out->packed, &out->size, err);
}

/* Kasson et al. 1995: a cube is six tetrahedra around its grey diagonal; which one a point is in follows from
 * the order of its fractions. */
void rl_page_lut_apply(const rl_page_lut *lut, const float in[3], double out[3])
{
    double first = axis(lut, lut->first), scale = (lut->n - 1) / (axis(lut, lut->last) - first), f[3];
    size_t n = (size_t)lut->n, total = n * n * n, at = 0;
    size_t step[3] = {n * n, n, 1};
    for (int c = 0; c < 3; c++) {
        double t = (axis(lut, (double)in[c]) - first) * scale;
        t = fmin(fmax(t, 0), (double)(lut->n - 1));
        size_t cell = (size_t)fmin(floor(t), (double)(lut->n - 2));
        f[c] = t - (double)cell;
        at += cell * step[c];
    }
    int large = f[0] >= f[1] ? (f[0] >= f[2] ? 0 : 2) : (f[1] >= f[2] ? 1 : 2);
    int small = f[0] < f[1] ? (f[0] < f[2] ? 0 : 2) : (f[1] < f[2] ? 1 : 2);
    int middle = 3 - large - small;
    for (size_t c = 0; c < 3; c++) {
        const uint16_t *e = lut->entries + c * total + at;
        double v = (1 - f[large]) * e[0] + (f[large] - f[middle]) * e[step[large]] +
                   (f[middle] - f[small]) * e[step[large] + step[middle]] +
                   f[small] * e[step[0] + step[1] + step[2]];
        out[c] = lut->low + (lut->high - lut->low) * v / 65535;
    }
}

void rl_page_lut_compare(rl_page_lut *lut, const rl_compared_image *linear, const rl_compared_image *display)
{
    size_t width = (size_t)linear->width, n = width * (size_t)linear->height;
    size_t step = n / 16384 + 1;
    const rl_exr_kernels *kernels = rl_exr_kernels_best();
    for (size_t i = 0; i < n; i += step) {
        size_t from = i / width * linear->stride + i % width, to = i / width * display->stride + i % width;
        float in[3];
        double out[3];
        for (int c = 0; c < 3; c++) {
            uint16_t half;
            kernels->float_to_half(linear->plane[c] + from, &half, 1);
            in[c] = rl_exr_half_value(half);
        }
        rl_page_lut_apply(lut, in, out);
        for (int c = 0; c < 3; c++) {
            double want = fmin(fmax((double)display->plane[c][to], 0), 1);
            double error = fabs(fmin(fmax(out[c], 0), 1) - want);
            lut->error_max = fmax(lut->error_max, error);
            lut->error_sum += error / 3;
        }
        lut->pixels++;
    }
}
