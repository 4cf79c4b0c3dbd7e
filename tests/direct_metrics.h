/* FLIP and SSIM by their definitions alone: two-dimensional kernels, every tap of every pixel, no
 * separation, nothing shared with graph/tool. Slow: for small images. */
#ifndef RL_TESTS_DIRECT_METRICS_H
#define RL_TESTS_DIRECT_METRICS_H

/* Pixels are interleaved RGB. LDR-FLIP of linear RGB in 0…1. */
double direct_flip(const double *a, const double *b, int width, int height, int x, int y);

/* SSIM of grey values with peak 1 at a pixel whose window is inside. */
double direct_ssim(const double *a, const double *b, int width, int x, int y);

/* The ACES fit. */
double direct_tone(double v);

#endif
