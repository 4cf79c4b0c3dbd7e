#include "graph/run/color_bake.h"

#include <math.h>
#include <string.h>

#include "graph/base/alloc.h"

#define N      65
#define CELLS  (N * N * N)
#define TRIALS 20000

/* The shaper: log2(1 + 256 x)/16, so that 0 is 0, mid grey near the middle and 256 is 1. */
static double shape(double x)
{
    return fmin(log2(1 + 256 * fmax(x, 0)) / 16, 1);
}

static double unshape(double u)
{
    return (exp2(16 * u) - 1) / 256;
}

/* planes: 3 of n floats. Fills them with the colours of the cube. */
static void fill_cube(float *planes)
{
    for (int i = 0; i < CELLS; i++) {
        planes[i] = (float)unshape((double)(i / (N * N)) / (N - 1));
        planes[CELLS + i] = (float)unshape((double)(i / N % N) / (N - 1));
        planes[2 * CELLS + i] = (float)unshape((double)(i % N) / (N - 1));
    }
}

/* What the generated program computes, in double: tetrahedral interpolation, sorting the axes. */
static void look_up(const float *rgb, const float in[3], double out[3])
{
    static const int strides[3] = {3 * N * N, 3 * N, 3};
    double place[3];
    int base = 0, order[3] = {0, 1, 2};
    for (int c = 0; c < 3; c++) {
        double at = shape(in[c]) * (N - 1);
        int i = at < N - 2 ? (int)at : N - 2;
        place[c] = at - i;
        base += i * strides[c];
    }
    for (int a = 0; a < 2; a++)
        for (int b = 0; b < 2 - a; b++)
            if (place[order[b]] < place[order[b + 1]]) {
                int swap = order[b];
                order[b] = order[b + 1];
                order[b + 1] = swap;
            }
    for (int c = 0; c < 3; c++) {
        int i = base;
        out[c] = rgb[i + c];
        for (int a = 0; a < 3; a++) {
            int next = i + strides[order[a]];
            out[c] += place[order[a]] * ((double)rgb[next + c] - rgb[i + c]);
            i = next;
        }
    }
}

static float random_value(unsigned *state)
{
    *state = *state * 1664525u + 1013904223u;
    double u = (double)(*state >> 8) / 16777216.0;
    return (float)(u < 0.1 ? -u : 20 * u * u * u);
}

static rl_code measure(const rl_ocio_transform *transform, const float *rgb, double *error, rl_error *err)
{
    float *in = rl_malloc(6 * TRIALS * sizeof *in), *want = in + 3 * TRIALS;
    if (!in)
        return rl_fail_memory(err, 6 * TRIALS * sizeof *in);
    unsigned state = 1;
    for (int i = 0; i < 3 * TRIALS; i++)
        in[i] = want[i] = random_value(&state);
    rl_code code = rl_ocio_apply(transform, want, want + TRIALS, want + 2 * TRIALS, TRIALS, err);
    *error = 0;
    for (int i = 0; code == RL_OK && i < TRIALS; i++) {
        double got[3];
        look_up(rgb, (float[3]){in[i], in[TRIALS + i], in[2 * TRIALS + i]}, got);
        for (int c = 0; c < 3; c++)
            *error = fmax(*error, fabs(got[c] - want[c * TRIALS + i]));
    }
    rl_free(in);
    return code;
}

rl_code rl_color_bake(const rl_ocio_transform *transform, rl_color_text *text, double *error, rl_error *err)
{
    float *planes = rl_malloc(6 * CELLS * sizeof *planes), *rgb = planes + 3 * CELLS;
    if (!planes)
        return rl_fail_memory(err, 6 * CELLS * sizeof *planes);
    fill_cube(planes);
    rl_code code = rl_ocio_apply(transform, planes, planes + CELLS, planes + 2 * CELLS, CELLS, err);
    if (code != RL_OK)
        goto done;
    for (int i = 0; i < 3 * CELLS; i++)
        rgb[i] = planes[i % 3 * CELLS + i / 3];
    code = measure(transform, rgb, error, err);
    size_t start = rl_color_table_add(text, rgb, 3 * CELLS);
    for (int c = 0; c < 3; c++)
        rl_str_printf(&text->body, "    %c = rl_c_log2(fma(max(%c, 0.0f), K(256.0f), K(1.0f))) * 0.0625f;\n",
                      "rgb"[c], "rgb"[c]);
    rl_str_printf(&text->body, "    rl_c_lut3d(tables + %zu, %d, &r, &g, &b);\n", start, N);
    if (code == RL_OK && (text->no_memory || text->body.failed))
        code = rl_fail_memory(err, 0);
done:
    rl_free(planes);
    return code;
}
