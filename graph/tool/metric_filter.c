#include "graph/tool/metric_filter.h"

#include <math.h>

rl_filter rl_filter_gaussian(double sigma, int radius)
{
    rl_filter f = {.radius = radius};
    double sum = 0;
    for (int i = -radius; i <= radius; i++)
        sum += f.w[i + radius] = exp(-i * i / (2 * sigma * sigma));
    for (int i = 0; i <= 2 * radius; i++)
        f.w[i] /= sum;
    return f;
}

int rl_filter_width(int width)
{
    return (width + RL_FILTER_BLOCK - 1) / RL_FILTER_BLOCK * RL_FILTER_BLOCK;
}

/* Four lanes, said outright: left to itself the compiler vectorizes over the taps, and shuffles for most of
 * its time. Rows begin at any double. */
typedef double lanes __attribute__((vector_size(32), aligned(8), may_alias));

/* A block's sums stay in registers while the taps pass. */
static inline void __attribute__((always_inline))
sum_blocks(double *out, const double *const *rows, const double *w, int taps, int n)
{
    for (int x = 0; x < n; x += RL_FILTER_BLOCK) {
        lanes s0 = {0}, s1 = {0}, s2 = {0}, s3 = {0};
        for (int k = 0; k < taps; k++) {
            const lanes weight = {w[k], w[k], w[k], w[k]}, *row = (const lanes *)(rows[k] + x);
            s0 += weight * row[0];
            s1 += weight * row[1];
            s2 += weight * row[2];
            s3 += weight * row[3];
        }
        lanes *to = (lanes *)(out + x);
        to[0] = s0;
        to[1] = s1;
        to[2] = s2;
        to[3] = s3;
    }
}

#if defined(__x86_64__) && defined(__GNUC__)
/* Wider vectors, same order, no fused operations: same bits. */
static void __attribute__((target("avx2")))
sum_avx2(double *out, const double *const *rows, const double *w, int taps, int n)
{
    sum_blocks(out, rows, w, taps, n);
}

void rl_filter_sum(double *out, const double *const *rows, const double *w, int taps, int n)
{
    if (__builtin_cpu_supports("avx2"))
        sum_avx2(out, rows, w, taps, n);
    else
        sum_blocks(out, rows, w, taps, n);
}
#else
void rl_filter_sum(double *out, const double *const *rows, const double *w, int taps, int n)
{
    sum_blocks(out, rows, w, taps, n);
}
#endif

void rl_filter_along(double *out, const double *padded, const rl_filter *f, int n)
{
    const double *rows[2 * RL_FILTER_RADIUS + 1];
    int taps = 2 * f->radius + 1;
    for (int k = 0; k < taps; k++)
        rows[k] = padded + RL_FILTER_RADIUS - f->radius + k;
    rl_filter_sum(out, rows, f->w, taps, n);
}

void rl_filter_pad(double *padded, const float *row, int width)
{
    int n = rl_filter_width(width) + 2 * RL_FILTER_RADIUS;
    for (int i = 0; i < n; i++) {
        int x = i - RL_FILTER_RADIUS;
        padded[i] = (double)row[x < 0 ? 0 : x < width ? x : width - 1];
    }
}

int rl_band_count(int height)
{
    return (height + RL_BAND_ROWS - 1) / RL_BAND_ROWS;
}

void rl_filter_bands(rl_pool *pool, int n, void (*body)(void *ctx, int i), void *ctx)
{
    if (pool)
        rl_pool_for(pool, n, body, ctx);
    else
        for (int i = 0; i < n; i++)
            body(ctx, i);
}
