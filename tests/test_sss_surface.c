/* weighting: surface against integrals over known surfaces, evenly lit, so that what comes out is what the
 * profile's integral over the surface says. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "passes/burley.h"
#include "tests/sss_scene.h"

enum { SIZE = 176 };
#define FOCAL 4000.0f /* pixels: as good as parallel */
#define DEPTH 1.0f    /* metres, so that a pixel is 0.25 mm and d = 1 mm four pixels */

static double mean_near(const sss_scene *s, int x, int y)
{
    double sum = 0;
    for (int j = -2; j <= 2; j++)
        for (int i = -2; i <= 2; i++)
            sum += (double)s->filtered[(size_t)(y + j) * (size_t)s->twin.frame.columns + (size_t)(x + i)];
    return sum / 25;
}

static sss_scene scene_of_size(void)
{
    return sss_scene_make(0, 0, SIZE, SIZE, FOCAL);
}

/* Material 1 with d = 1 mm in red. */
static void put(sss_scene *s, size_t i, float depth)
{
    s->stencil[i] = 1;
    s->depth[i] = depth;
    for (size_t c = 0; c < 3; c++)
        s->diffuse[c * s->n + i] = 1;
}

static int open_thin(void **state)
{
    for (int c = 0; c < 3; c++)
        sss_materials[1].scatter_distance_mm[c] = 1;
    return sss_open(state);
}

/* By Archimedes the part of a sphere within a chord r has the area pi r², so the integral over the half that
 * the camera sees, from its middle, is the CDF at sqrt(2) radii. Beyond the silhouette there is nothing. */
static void ball_loses_light(void **state)
{
    (void)state;
    for (int radius = 16; radius <= 64; radius *= 2) {
        sss_scene s = scene_of_size();
        SSS_EACH_PIXEL(&s, x, y, i)
        {
            float u = (float)x - SIZE / 2, v = (float)y - SIZE / 2,
                  w = (float)(radius * radius) - u * u - v * v;
            if (w > 0)
                put(&s, i, DEPTH - sqrtf(w) * (DEPTH / FOCAL));
        }
        double want = rl_burley_cdf(sqrt(2) * radius * (double)(DEPTH / FOCAL), 1e-3) / RL_BURLEY_REACH;
        sss_run_reference(&s, SURFACE);
        double dense = mean_near(&s, SIZE / 2, SIZE / 2);
        sss_run_burley(&s, 1024, SURFACE);
        double taps = mean_near(&s, SIZE / 2, SIZE / 2);
        print_message("radius %d: %.4f, dense %.4f, 1024 taps %.4f\n", radius, want, dense, taps);
        /* the rim, where pixels are few and steep, is missed in part: less, the more pixels there are */
        assert_true(fabs(dense - want) < 0.4 / radius);
        assert_true(fabs(taps - want) < 0.4 / radius);
        sss_run_reference(&s, AREA);
        assert_true(fabs(mean_near(&s, SIZE / 2, SIZE / 2) - 1) < 1e-4);
        sss_scene_free(&s);
    }
}

/* The integral over the two sides of a right-angled groove from a point at distance h of its bottom, along
 * one side: rows along the groove, strips across. */
static double groove(double h, double d)
{
    double sum = 0, step = d / 25, reach = 30 * d;
    for (double t = step / 2; t < reach; t += step) {
        double own = fabs(t - h), far = sqrt(t * t + h * h); /* this side, the other one */
        for (double z = step / 2; z < reach; z += step)
            sum += 2 * step * step *
                   (rl_burley_profile(sqrt(own * own + z * z), d) +
                    rl_burley_profile(sqrt(far * far + z * z), d));
    }
    return sum;
}

static void groove_gains_light(void **state)
{
    (void)state;
    sss_scene s = scene_of_size();
    SSS_EACH_PIXEL(&s, x, y, i)
    {
        put(&s, i, DEPTH + (SIZE / 2 - fabsf((float)x + 0.5f - SIZE / 2)) * (DEPTH / FOCAL));
    }
    const int off[] = {6, 12, 24};
    for (int k = 0; k < 3; k++) {
        double h = (off[k] + 0.5) * sqrt(2) * (double)(DEPTH / FOCAL), cosine = sqrt(0.5);
        double want = 1 - cosine + cosine * groove(h, 1e-3);
        sss_run_reference(&s, SURFACE);
        double dense = mean_near(&s, SIZE / 2 + off[k], SIZE / 2);
        sss_run_burley(&s, 1024, SURFACE);
        double taps = mean_near(&s, SIZE / 2 + off[k], SIZE / 2);
        print_message("%d pixels from the bottom: %.4f, dense %.4f, 1024 taps %.4f\n", off[k], want, dense,
                      taps);
        assert_true(want > 1.005);
        assert_true(fabs(dense - want) < 0.01);
        assert_true(fabs(taps - want) < 0.02);
    }
    sss_scene_free(&s);
}

/* A tilted plane keeps its light up to the image's edge, and up to another material in the same plane. */
static void plane_keeps_light(void **state)
{
    (void)state;
    sss_scene s = scene_of_size();
    SSS_EACH_PIXEL(&s, x, y, i)
    {
        put(&s, i, DEPTH + 0.7f * (float)(x - y) * (DEPTH / FOCAL));
        if (x > 100)
            s.stencil[i] = 3;
    }
    sss_run_reference(&s, SURFACE);
    for (int pass = 0; pass < 2; pass++) {
        SSS_EACH_PIXEL(&s, x, y, i)
        {
            if (s.stencil[i] == 1)
                assert_true(fabsf(s.filtered[i] - 1) < 0.005f);
        }
        sss_run_burley(&s, 55, SURFACE);
    }
    sss_scene_free(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ball_loses_light),
        cmocka_unit_test(groove_gains_light),
        cmocka_unit_test(plane_keeps_light),
    };
    return cmocka_run_group_tests(tests, open_thin, sss_close);
}
