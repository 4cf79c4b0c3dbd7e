/* The arithmetic of FLIP on rows of pixels, in vectors (metric_flip_rows.c). n is a multiple of
 * RL_FILTER_BLOCK; rows do not overlap. Section numbers are those of the paper (metric_flip.c). */
#ifndef RL_TOOL_METRIC_FLIP_ROWS_H
#define RL_TOOL_METRIC_FLIP_ROWS_H

#include "graph/tool/metric_color.h"

/* What a value of an image becomes before FLIP sees it: linear light that a display can show, 0 … 1. */
typedef enum rl_flip_curve {
    RL_FLIP_CLAMP, /* linear light */
    RL_FLIP_SRGB,  /* sRGB-encoded */
    RL_FLIP_TONE   /* linear light through HDR-FLIP's tone curve */
} rl_flip_curve;

/* Rows of the filters along columns. */
enum {
    RL_FLIP_Y,
    RL_FLIP_CX,
    RL_FLIP_CZ1,
    RL_FLIP_CZ2,
    RL_FLIP_EDGE_X,
    RL_FLIP_EDGE_Y,
    RL_FLIP_POINT_X,
    RL_FLIP_POINT_Y,
    RL_FLIP_FILTERED
};

/* What is compared of a pixel: L*a*b* scaled after Hunt, the strength of edges and of points. */
enum { RL_FLIP_L, RL_FLIP_A, RL_FLIP_B, RL_FLIP_EDGE, RL_FLIP_POINT, RL_FLIP_FEATURES };

/* In place; scale is for RL_FLIP_TONE. */
void rl_flip_curve_row(rl_flip_curve curve, double scale, double *values, int n);
/* Linear RGB to YCxCz, in place. */
void rl_flip_opponent_row(double *const rgb[3], int n);
/* 4.1.2 and 4.2: filtered YCxCz to features. */
void rl_flip_features_row(const rl_matrix *rgb_from_xyz, double *const filtered[RL_FLIP_FILTERED],
                          double *const features[RL_FLIP_FEATURES], int n);
/* 4.1.3 and 4.3: raises map[0 … width - 1] to the error. `largest` is the colour error that becomes 1. */
void rl_flip_compare_row(double *const a[RL_FLIP_FEATURES], double *const b[RL_FLIP_FEATURES], double largest,
                         double *errors, int n, float *map, int width);
/* The tone curve of one value, for finding exposures. */
double rl_flip_tone_inverse(double target);

#endif
