/* How sss_burley's patterns complement each other: what is left of the error after frames, or neighbours, are
 * averaged. The scene is what shows it best: a ball much smaller than the filter, lit from the side, with a
 * shadow's edge. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "tests/sss_scene.h"

enum { WIDTH = 128, HEIGHT = 96 };

/* A ball of 40 pixels' radius in the middle; the filter's radius is 220 pixels. */
static void ball(sss_scene *s)
{
    const float z = 0.5f, radius = 40, metre = z / s->twin.frame.camera.focal[0];
    SSS_EACH_PIXEL(s, x, y, i)
    {
        float u = (float)(x - WIDTH / 2) / radius, v = (float)(y - HEIGHT / 2) / radius,
              w = 1 - u * u - v * v;
        if (w <= 0)
            continue;
        w = sqrtf(w);
        float light = fmaxf(0, 0.6f * u - 0.5f * v + 0.62f * w) * (v > 0.3f ? 0.1f : 1);
        s->stencil[i] = 4;
        s->depth[i] = z - w * radius * metre;
        for (size_t c = 0; c < 3; c++)
            s->diffuse[c * s->n + i] = light + 0.02f;
    }
}

/* Root mean square of the means of `error` over blocks of bx × by pixels that lie inside of the ball. */
static double blocks(const sss_scene *s, const float *error, int bx, int by)
{
    double sum = 0;
    size_t n = 0;
    for (size_t c = 0; c < 3; c++)
        for (int y = 0; y + by <= HEIGHT; y++)
            for (int x = 0; x + bx <= WIDTH; x++) {
                double mean = 0;
                bool inside = true;
                for (int k = 0; k < bx * by; k++) {
                    size_t i = (size_t)(y + k / bx) * (size_t)s->twin.frame.columns + (size_t)(x + k % bx);
                    inside = inside && s->stencil[i];
                    mean += (double)error[c * s->n + i] / (bx * by);
                }
                if (inside) {
                    sum += mean * mean;
                    n++;
                }
            }
    assert_true(n > 1000);
    return sqrt(sum / (double)n);
}

typedef struct noise {
    double pixel, block2, block4, row; /* RMS of the error: of pixels, of 2x2, 4x4 and 24x1 of them */
} noise;

/* What is left in the mean of `frames` frames; the worst of three places in the sequence. The mean light is
 * about 0.3. */
static noise measure(sss_scene *s, const float *truth, int rotation, int frames)
{
    noise worst = {0, 0, 0, 0};
    float *error = sss_planes(3 * s->n);
    for (int first = -5; first < 900; first += 400) {
        memset(error, 0, 3 * s->n * sizeof *error);
        s->twin.rotation = rotation;
        for (int f = first; f < first + frames; f++) {
            s->twin.frame.number = f;
            sss_run_burley(s, 55, AREA);
            for (size_t i = 0; i < 3 * s->n; i++)
                error[i] += (s->filtered[i] - truth[i]) / (float)frames;
        }
        worst.pixel = fmax(worst.pixel, blocks(s, error, 1, 1));
        worst.block2 = fmax(worst.block2, blocks(s, error, 2, 2));
        worst.block4 = fmax(worst.block4, blocks(s, error, 4, 4));
        worst.row = fmax(worst.row, blocks(s, error, 24, 1));
    }
    rl_free(error);
    print_message("rotation %d, %d frames: pixels %.5f, 2x2 %.5f, 4x4 %.5f, rows %.5f\n", rotation, frames,
                  worst.pixel, worst.block2, worst.block4, worst.row);
    return worst;
}

static sss_scene scene;
static float *dense;

static int scene_open(void **state)
{
    if (sss_open(state))
        return -1;
    scene = sss_scene_make(0, 0, WIDTH, HEIGHT, 780);
    ball(&scene);
    sss_run_reference(&scene, AREA);
    dense = sss_planes(3 * scene.n);
    memcpy(dense, scene.filtered, 3 * scene.n * sizeof *dense);
    return 0;
}

static int scene_close(void **state)
{
    sss_scene_free(&scene);
    rl_free(dense);
    return sss_close(state);
}

/* The default leaves no bands. Turns of one pattern leave 0.0035 in the rows of 8 frames, 0.0085 in their
 * pixels; what the patterns cannot resolve, whatever the number of frames, is 0.0007. */
static void frames_leave_no_bands(void **state)
{
    (void)state;
    noise eight = measure(&scene, dense, TWIN_BLUE, 8), sixteen = measure(&scene, dense, TWIN_BLUE, 16);
    assert_true(eight.row < 0.0017);
    assert_true(eight.block2 < 0.0031);
    assert_true(eight.pixel < 0.0060);
    assert_true(sixteen.row < 0.0013);
    assert_true(sixteen.block2 < 0.0022);
    assert_true(sixteen.pixel < 0.0043);
}

/* Why it is the default: frames complement each other better than at random and than with interleaved
 * gradient noise, and so do neighbours in one frame. */
static void default_is_best(void **state)
{
    (void)state;
    noise white[2] = {measure(&scene, dense, TWIN_WHITE, 1), measure(&scene, dense, TWIN_WHITE, 8)};
    noise ign[2] = {measure(&scene, dense, TWIN_IGN, 1), measure(&scene, dense, TWIN_IGN, 8)};
    noise blue[2] = {measure(&scene, dense, TWIN_BLUE, 1), measure(&scene, dense, TWIN_BLUE, 8)};
    assert_true(blue[1].pixel < 0.85 * white[1].pixel && blue[1].pixel < 0.7 * ign[1].pixel);
    assert_true(blue[0].block2 < 0.95 * white[0].block2);
    assert_true(blue[0].block4 < 0.8 * white[0].block4 && blue[0].block4 < ign[0].block4);
}

/* A still pattern errs the same way everywhere, here a little less than the others do on average; what turns
 * it must not add to a pixel's own noise. */
static void turning_costs_no_noise(void **state)
{
    (void)state;
    noise still = measure(&scene, dense, TWIN_STILL, 1);
    assert_true(still.block4 > 0.5 * still.pixel);
    for (int rotation = TWIN_WHITE; rotation <= TWIN_BLUE; rotation++)
        assert_true(measure(&scene, dense, rotation, 1).pixel < 1.12 * still.pixel);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(frames_leave_no_bands),
        cmocka_unit_test(default_is_best),
        cmocka_unit_test(turning_costs_no_noise),
    };
    return cmocka_run_group_tests(tests, scene_open, scene_close);
}
