#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "tests/metric_pictures.h"

#include <math.h>
#include <string.h>

void assert_close(double got, double want, double tolerance)
{
    if (!(fabs(got - want) <= tolerance))
        print_error("%.9g instead of %.9g\n", got, want);
    assert_true(fabs(got - want) <= tolerance);
}

double picture_random(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return (*state >> 8) / 16777216.0;
}

void picture_describe(picture *p, bool encoded)
{
    p->image =
        (rl_metric_image){PICTURE_WIDTH,  PICTURE_HEIGHT, 3, {p->plane[0], p->plane[1], p->plane[2], NULL},
                          PICTURE_STRIDE, encoded};
}

void picture_draw(picture *p, uint32_t seed, bool encoded, double most)
{
    uint32_t random = seed;
    picture_describe(p, encoded);
    memset(p->plane, 0x7f, sizeof p->plane); /* what is behind the rows must not count */
    for (int y = 0; y < PICTURE_HEIGHT; y++) {
        for (int x = 0; x < PICTURE_WIDTH; x++) {
            for (int c = 0; c < 3; c++) {
                double v =
                    0.5 + 0.3 * sin(x * 0.11 * (c + 1) + y * 0.07) + 0.15 * (picture_random(&random) - 0.5);
                v += x > 20 + (int)(seed % 3) ? 0.2 : -0.2;
                v = picture_random(&random) < 0.01 ? 1 : v;
                p->plane[c][y * PICTURE_STRIDE + x] = (float)(most * fmin(fmax(v, 0), 1));
            }
        }
    }
}

void picture_fill(picture *p, bool encoded, double r, double g, double b)
{
    picture_describe(p, encoded);
    for (int i = 0; i < PICTURE_HEIGHT * PICTURE_STRIDE; i++) {
        p->plane[0][i] = (float)r;
        p->plane[1][i] = (float)g;
        p->plane[2][i] = (float)b;
    }
}

void picture_map(rl_metric metric, const picture *a, const picture *b, rl_pool *pool, float *map)
{
    rl_error err = {0};
    if (rl_metric_map(metric, &a->image, &b->image, pool, map, &err))
        print_error("%s\n", err.text);
    assert_int_equal(err.code, RL_OK);
}
