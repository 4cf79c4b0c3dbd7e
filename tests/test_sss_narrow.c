/* Profiles whose channels differ by a factor of 30, from 21 taps on: the mean over patterns is the dense sum
 * in double precision, for the widest channel and for the narrow ones, and even light stays even. Surfaces
 * are flat and face the camera, where that is exact: what is left is what the frames have not averaged out,
 * and that the dense sum takes the pixel's own square for a disk. Light has an edge, or stripes, or differs
 * from pixel to pixel: a narrow channel has all of its difference within a few pixels. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdlib.h>

#include "graph/base/alloc.h"
#include "passes/burley.h"
#include "tests/sss_scene.h"

enum { WIDTH = 128, HEIGHT = 64, EDGE = 20, FRAMES = 96, SIDES = 2, CHANNELS = 2 };
typedef enum light { EVEN, STEP, STRIPES, GRAIN } light;
static const char *const light_names[] = {"even light", "an edge", "stripes", "grain"};

static float light_at(light kind, int x, int y)
{
    uint32_t state = (uint32_t)(x * 4099 + y * 131101) * 2654435761u;
    switch (kind) {
    case EVEN:
        break;
    case STEP:
        return x < WIDTH / 2 ? 1 : 0.05f;
    case STRIPES:
        return x % 12 < 6 ? 1 : 0.05f;
    case GRAIN:
        sss_random(&state);
        return sss_random(&state);
    }
    return 0.7f;
}

/* Material 1, pixels of `mm` millimetres. */
static sss_scene surface(float mm, light kind)
{
    sss_scene s = sss_scene_make(0, 0, WIDTH, HEIGHT, 1000);
    SSS_EACH_PIXEL(&s, x, y, i)
    {
        s.stencil[i] = 1;
        s.depth[i] = mm * 1e-3f * s.twin.frame.camera.focal[0];
        for (size_t c = 0; c < 3; c++) {
            s.albedo[c * s.n + i] = 1;
            s.diffuse[c * s.n + i] = light_at(kind, x, y);
        }
    }
    return s;
}

/* ---- the dense sum, in double: the integral of R over every pixel's square, divided by their sum ---- */

static const double pi = 3.14159265358979323846;

/* Over the square of side h around the centre, by its angle: a disk's integral is the CDF. */
static double own_square(double h, double d)
{
    double sum = 0;
    const int n = 2000;
    for (int i = 0; i < n; i++)
        sum += rl_burley_cdf(h / 2 / cos(pi / 4 * (i + 0.5) / n), d) / n;
    return sum;
}

/* Over another square: n² middles, as many as its distance asks for. */
static double other_square(double x, double y, double h, double d)
{
    double far = fmax(fabs(x), fabs(y)) / h, sum = 0;
    int n = far < 1.5 ? 64 : far < 4.5 ? 12 : 2;
    for (int j = 0; j < n; j++)
        for (int i = 0; i < n; i++)
            sum += rl_burley_profile(hypot(x + ((i + 0.5) / n - 0.5) * h, y + ((j + 0.5) / n - 0.5) * h), d);
    return sum * h * h / (n * n);
}

/* By distance in pixels. */
static double square_weights[HEIGHT][WIDTH];

static void weigh_squares(double h, double d, double reach)
{
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++)
            square_weights[y][x] = hypot(x, y) * h > reach ? 0
                                   : x || y                ? other_square(x * h, y * h, h, d)
                                                           : own_square(h, d);
}

static double dense_sum(const sss_scene *s, size_t c, int x, int y)
{
    double sum = 0, weights = 0;
    for (int v = 0; v < HEIGHT; v++)
        for (int u = 0; u < WIDTH; u++) {
            double w = square_weights[abs(v - y)][abs(u - x)];
            sum += w * (double)s->diffuse[c * s->n + (size_t)(v * s->twin.frame.columns + u)];
            weights += w;
        }
    return sum / weights;
}

/* ---- the estimate ---- */

/* Of the pixels that are brighter and darker than the dense sum, of the wide and a narrow channel. */
typedef struct bias {
    double mean[CHANNELS][SIDES]; /* of (estimate - dense sum) */
    double noise[CHANNELS];       /* root of its mean square, one frame */
    double worst;                 /* |estimate - dense sum| of any frame */
} bias;

/* Pixels that nothing beyond the image comes to in a narrow channel, every third. */
#define EACH_MEASURED(x, y)                                                                                  \
    for (int y = EDGE; y < HEIGHT - EDGE; y += 3)                                                            \
        for (int x = EDGE; x < WIDTH - EDGE; x++)

static bias measure(float mm, light kind, int taps, int rotation, int frames)
{
    sss_scene s = surface(mm, kind);
    double(*truth)[3] = rl_malloc(s.n * sizeof *truth);
    assert_non_null(truth);
    bias b = {{{0}}, {0}, 0};
    double count[CHANNELS][SIDES] = {{0}};
    for (size_t c = 0; c < CHANNELS; c++) {
        const float *d = sss_materials[1].scatter_distance_mm;
        weigh_squares((double)mm, (double)d[c], RL_BURLEY_RADIUS * (double)d[0]);
        EACH_MEASURED(x, y)
        truth[y * s.twin.frame.columns + x][c] = dense_sum(&s, c, x, y);
    }
    for (int frame = 0; frame < frames; frame++) {
        const sss_burley_params p = {taps, SCREEN, AREA, rotation, 0};
        s.twin.frame.number = 1000 + frame;
        sss_run(&s, &rl_pass_sss_burley, &p, sss_session);
        EACH_MEASURED(x, y)
        for (size_t c = 0; c < CHANNELS; c++) {
            size_t i = (size_t)(y * s.twin.frame.columns + x);
            double error = (double)s.filtered[c * s.n + i] - truth[i][c];
            int side = (double)s.diffuse[c * s.n + i] < truth[i][c];
            b.mean[c][side] += error;
            b.noise[c] += error * error;
            b.worst = fmax(b.worst, fabs(error));
            count[c][side]++;
        }
    }
    for (int c = 0; c < CHANNELS; c++) {
        b.noise[c] = sqrt(b.noise[c] / (count[c][0] + count[c][1]));
        for (int side = 0; side < SIDES; side++)
            b.mean[c][side] /= fmax(count[c][side], 1);
    }
    rl_free(truth);
    sss_scene_free(&s);
    return b;
}

static void set_distances(float wide, float narrow)
{
    sss_materials[1] = (twin_material){.has_profile = 1, .scatter_distance_mm = {wide, narrow, narrow}};
}

static const float pixels_mm[] = {0.1f, 0.3f};
static const int taps[] = {21, 55};

/* What the frames leave of the noise: a fortieth at worst. Normalized a pattern at a time, and placed for the
 * widest channel alone, 21 taps are off by 0.018 to 0.035 in stripes and grain. */
static void means_are_the_dense_sum(void **state)
{
    (void)state;
    set_distances(3, 0.1f);
    for (light kind = STEP; kind <= GRAIN; kind++)
        for (size_t k = 0; k < 4; k++) {
            float mm = pixels_mm[k / 2];
            int n = taps[k % 2];
            bias b = measure(mm, kind, n, TWIN_BLUE, FRAMES);
            print_message("%s, %g mm a pixel, %d taps: wide %+.5f %+.5f, narrow %+.5f %+.5f; noise %.4f "
                          "%.4f\n",
                          light_names[kind], (double)mm, n, b.mean[0][0], b.mean[0][1], b.mean[1][0],
                          b.mean[1][1], b.noise[0], b.noise[1]);
            for (int side = 0; side < SIDES; side++) {
                assert_true(fabs(b.mean[0][side]) < 0.003);
                assert_true(fabs(b.mean[1][side]) < (n > 21 ? 0.002 : 0.004));
            }
        }
}

/* Two taps of a hundred for each narrow channel: what they cost the widest. Single figures are a matter of
 * how a pattern meets the stripes. */
static void widest_is_hardly_noisier(void **state)
{
    (void)state;
    double mean = 0;
    for (light kind = STEP; kind <= GRAIN; kind++)
        for (size_t k = 0; k < 4; k++) {
            float mm = pixels_mm[k / 2];
            int n = taps[k % 2];
            set_distances(3, 0.1f);
            double mixed = measure(mm, kind, n, TWIN_WHITE, 16).noise[0];
            set_distances(3, 3);
            double alone = measure(mm, kind, n, TWIN_WHITE, 16).noise[0];
            print_message("%s, %g mm a pixel, %d taps: variance times %.3f\n", light_names[kind], (double)mm,
                          n, pow(mixed / alone, 2));
            assert_true(mixed * mixed < 1.25 * alone * alone);
            mean += mixed * mixed / (alone * alone) / 12;
        }
    print_message("mean: %.3f\n", mean);
    assert_true(mean < 1.1);
}

static void even_light_stays_even(void **state)
{
    (void)state;
    static const float narrow[] = {0.001f, 0.01f, 0.1f, 1};
    for (size_t k = 0; k < 4; k++) {
        set_distances(3, narrow[k]);
        double worst = measure(0.1f, EVEN, 21, TWIN_BLUE, 16).worst;
        print_message("even light, d = 3 and %g mm: %.2e\n", (double)narrow[k], worst);
        assert_true(worst < 1e-5);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(means_are_the_dense_sum),
        cmocka_unit_test(widest_is_hardly_noisier),
        cmocka_unit_test(even_light_stays_even),
    };
    return cmocka_run_group_tests(tests, sss_open, sss_close);
}
