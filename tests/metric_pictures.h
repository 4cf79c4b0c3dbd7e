/* Small pictures for the tests of metrics, drawn by formula. Include cmocka.h first. */
#ifndef RL_TESTS_METRIC_PICTURES_H
#define RL_TESTS_METRIC_PICTURES_H

#include <stdbool.h>
#include <stdint.h>

#include "graph/tool/metrics.h"

/* More than one band of rows, no whole block of columns. */
enum {
    PICTURE_WIDTH = 45,
    PICTURE_HEIGHT = 83,
    PICTURE_STRIDE = 47,
    PICTURE_SIZE = PICTURE_WIDTH * PICTURE_HEIGHT
};

typedef struct picture {
    float plane[3][PICTURE_HEIGHT * PICTURE_STRIDE];
    rl_metric_image image; /* of the planes */
} picture;

/* Sets `image`; needed again after a picture was copied. */
void picture_describe(picture *p, bool encoded);
/* Smooth shapes, an edge, points and noise, 0 … most; NaN-like rubbish behind the rows. */
void picture_draw(picture *p, uint32_t seed, bool encoded, double most);
void picture_fill(picture *p, bool encoded, double r, double g, double b);
/* 0 … 1, deterministic. */
double picture_random(uint32_t *state);

/* The metric of b against a; fails the test on an error. */
void picture_map(rl_metric metric, const picture *a, const picture *b, rl_pool *pool, float *map);
/* Fails the test when |got - want| > tolerance, or for NaN. */
void assert_close(double got, double want, double tolerance);

#endif
