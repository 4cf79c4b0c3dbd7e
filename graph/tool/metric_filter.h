/* Separable filters for the metrics, row by row in double. Images are cut into bands of rows, one a task; a
 * band is the same whatever the number of threads, and so is every sum. */
#ifndef RL_TOOL_METRIC_FILTER_H
#define RL_TOOL_METRIC_FILTER_H

#include <stddef.h>

#include "graph/base/pool.h"

enum {
    RL_FILTER_RADIUS = 10, /* the largest */
    RL_FILTER_BLOCK = 16,  /* rows are filtered in blocks of this many pixels */
    RL_BAND_ROWS = 64
};

/* 2 · radius + 1 weights. */
typedef struct rl_filter {
    int radius;
    double w[2 * RL_FILTER_RADIUS + 1];
} rl_filter;

/* exp(-x² / (2 σ²)) at the pixels, sum 1. */
rl_filter rl_filter_gaussian(double sigma, int radius);

/* `width` rounded up to whole blocks. */
int rl_filter_width(int width);

/* out[x] = Σ w[k] · rows[k][x], x < n; n is a multiple of RL_FILTER_BLOCK. */
void rl_filter_sum(double *out, const double *const *rows, const double *w, int taps, int n);

/* Along a row: `padded` holds the row from pixel -RL_FILTER_RADIUS on, rl_filter_width(width) +
 * 2 · RL_FILTER_RADIUS values. */
void rl_filter_along(double *out, const double *padded, const rl_filter *f, int n);

/* padded from a row of floats; beyond its ends its border pixels are repeated. */
void rl_filter_pad(double *padded, const float *row, int width);

/* Calls body(ctx, i) for i < n on the pool, or one after the other without one. */
void rl_filter_bands(rl_pool *pool, int n, void (*body)(void *ctx, int i), void *ctx);
int rl_band_count(int height);

#endif
