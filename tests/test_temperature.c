/* The colour of black bodies, and lights that have it. */
#include "tests/config_help.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "graph/model/lights.h"
#include "graph/model/temperature.h"

static const double same[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

/* ---- chromaticity -----------------------------------------------------------------------------------------
 */

/* Wyman, Sloan and Shirley 2013, multi-lobe fits to the CIE 1931 functions. */
static double lobe(double nm, double mean, double below, double above)
{
    double t = (nm - mean) / (nm < mean ? below : above);
    return exp(-0.5 * t * t);
}

static void wyman(double kelvin, double xy[2])
{
    double sum[3] = {0};
    for (double nm = 360.5; nm < 830; nm += 1) {
        double power = pow(nm / 560, -5) / expm1(1.4388e7 / (nm * kelvin));
        sum[0] += power * (1.056 * lobe(nm, 599.8, 37.9, 31.0) + 0.362 * lobe(nm, 442.0, 16.0, 26.7) -
                           0.065 * lobe(nm, 501.1, 20.4, 26.2));
        sum[1] += power * (0.821 * lobe(nm, 568.8, 46.9, 40.5) + 0.286 * lobe(nm, 530.9, 16.3, 31.1));
        sum[2] += power * (1.217 * lobe(nm, 437.0, 11.8, 36.0) + 0.681 * lobe(nm, 459.0, 26.0, 13.8));
    }
    xy[0] = sum[0] / (sum[0] + sum[1] + sum[2]);
    xy[1] = sum[1] / (sum[0] + sum[1] + sum[2]);
}

/* Kim et al. 2002, cubic fits to the locus, 1667 … 25000 K. */
static void kim(double t, double xy[2])
{
    double u = 1e3 / t, x, y;
    x = t < 4000 ? ((-0.2661239 * u - 0.2343589) * u + 0.8776956) * u + 0.179910
                 : ((-3.0258469 * u + 2.1070379) * u + 0.2226347) * u + 0.240390;
    y = t < 2222   ? ((-1.1063814 * x - 1.34811020) * x + 2.18555832) * x - 0.20219683
        : t < 4000 ? ((-0.9549476 * x - 1.37418593) * x + 2.09137015) * x - 0.16748867
                   : ((3.0817580 * x - 5.87338670) * x + 3.75112997) * x - 0.37001483;
    xy[0] = x;
    xy[1] = y;
}

static double apart(const double a[2], const double b[2])
{
    return hypot(a[0] - b[0], a[1] - b[1]);
}

/* CIE standard illuminant A is a black body of 2856 K (CIE 015); the others are the locus in Wyszecki and
 * Stiles 1982. */
static void test_published(void **state)
{
    (void)state;
    static const double published[][3] = {{1000, 0.6528, 0.3444},   {2000, 0.5267, 0.4133},
                                          {10000, 0.2807, 0.2884},  {2856, 0.44757, 0.40745},
                                          {3000, 0.43693, 0.40407}, {4000, 0.38052, 0.37676},
                                          {5000, 0.34510, 0.35161}, {6000, 0.32208, 0.33178}};
    for (size_t i = 0; i < sizeof published / sizeof *published; i++) {
        double xy[2];
        rl_kelvin_xy(published[i][0], xy);
        if (!(apart(xy, published[i] + 1) < 2e-4))
            fail_msg("%g K: %.5f %.5f, published %.5f %.5f", published[i][0], xy[0], xy[1], published[i][1],
                     published[i][2]);
    }
}

/* Two independent fits, whose own errors bound the comparison: Kim's locus, and Wyman's functions integrated.
 * Their red tails end too soon, which is 0.015 at 1000 K, where most of the light is there. */
static void test_fits(void **state)
{
    (void)state;
    double worst_wyman = 0, worst_warm = 0, worst_kim = 0;
    for (double t = RL_KELVIN_LEAST; t <= RL_KELVIN_MOST; t *= 1.05) {
        double xy[2], other[2];
        rl_kelvin_xy(t, xy);
        wyman(t, other);
        double *worst = t < 2200 ? &worst_warm : &worst_wyman;
        *worst = fmax(*worst, apart(xy, other));
        kim(t, other);
        if (t > 1667 && t < 25000)
            worst_kim = fmax(worst_kim, apart(xy, other));
    }
    assert_true(worst_warm < 0.016);
    assert_true(worst_wyman < 0.003);
    assert_true(worst_kim < 0.001);
}

static void uv(const double xy[2], double out[2])
{
    double scale = 12 * xy[1] - 2 * xy[0] + 3;
    out[0] = 4 * xy[0] / scale;
    out[1] = 6 * xy[1] / scale;
}

/* `tint` away from the locus, whose nearest point is the temperature's; D65 is 6504 K and 0.0032. */
static void test_tint(void **state)
{
    (void)state;
    for (double t = RL_KELVIN_LEAST * 1.01; t <= RL_KELVIN_MOST / 1.01; t *= 1.3) {
        for (double duv = -0.02; duv < 0.021; duv += 0.01) {
            double xy[2], at[2], near[2], away = 1;
            rl_kelvin_tinted_xy(t, duv, xy);
            uv(xy, at);
            for (double k = 0.99; k < 1.0101; k += 0.001) {
                rl_kelvin_xy(t * k, xy);
                uv(xy, near);
                away = fmin(away, apart(at, near));
            }
            assert_true(fabs(away - fabs(duv)) < 2e-6);
            rl_kelvin_xy(t, xy);
            uv(xy, near);
            assert_true(duv == 0 || (at[1] > near[1]) == (duv > 0));
        }
    }
    static const double d65[2] = {0.3127, 0.3290};
    double xy[2];
    rl_kelvin_tinted_xy(6504, 0.0032, xy);
    assert_true(apart(xy, d65) < 3e-4);
}

/* ---- RGB --------------------------------------------------------------------------------------------------
 */

static double luminance(const double c[3])
{
    return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
}

static void test_rgb(void **state)
{
    (void)state;
    double rgb[3], last = 0;
    for (double t = RL_KELVIN_LEAST; t <= RL_KELVIN_MOST; t *= 1.1) {
        rl_kelvin_rgb(t, 0, same, rgb);
        assert_true(fabs(luminance(rgb) - 1) < 5e-4);
        assert_true(rgb[0] >= 0 && rgb[1] >= 0 && rgb[2] >= 0);
        assert_true(t < 2000 ? rgb[2] < 0.02 : rgb[2] / rgb[0] > last); /* bluer and bluer */
        last = rgb[2] / rgb[0];
    }
    rl_kelvin_rgb(6504, 0.0032, same, rgb); /* D65 is the white of Rec.709 */
    for (int c = 0; c < 3; c++)
        assert_true(fabs(rgb[c] - 1) < 5e-3);
    rl_kelvin_rgb(2856, 0, same, rgb); /* by hand from x = 0.44757, y = 0.40745 */
    assert_true(fabs(rgb[0] - 1.8450) < 1e-3 && fabs(rgb[1] - 0.8261) < 1e-3 && fabs(rgb[2] - 0.2333) < 1e-3);
}

/* In another space the factors mean the same light, and its own luminance weights hold. */
static void test_other_space(void **state)
{
    (void)state;
    static const double wide[9] = {1.66,  -0.59, -0.07, -0.12, 1.13,
                                   -0.01, -0.02, -0.10, 1.12}; /* Rec.2020, 2 digits */
    for (double t = 2200; t < 20000; t *= 1.5) {
        double a[3], b[3], back[3] = {0};
        rl_kelvin_rgb(t, 0, same, a);
        rl_kelvin_rgb(t, 0, wide, b);
        for (int i = 0; i < 9; i++)
            back[i / 3] += wide[i] * b[i % 3];
        for (int c = 0; c < 3; c++)
            assert_true(fabs(back[c] - a[c]) < 1e-9);
    }
}

static void test_inverse(void **state)
{
    (void)state;
    static const double m[9] = {2, 1, 0, 0, 3, 1, 1, 0, 4}, flat[9] = {1, 2, 3, 2, 4, 6, 0, 0, 1};
    double inverse[9];
    assert_true(rl_invert3(m, inverse));
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            double v = 0;
            for (int k = 0; k < 3; k++)
                v += m[3 * i + k] * inverse[3 * k + j];
            assert_true(fabs(v - (i == j)) < 1e-14);
        }
    assert_false(rl_invert3(flat, inverse));
}

/* ---- lights -----------------------------------------------------------------------------------------------
 */

static rl_code parse(const char *keys, rl_lights *out)
{
    char text[256];
    snprintf(text, sizeof text, "k: {type: point, position: [0, 0, 0], candela: 683, %s}", keys);
    return rl_lights_parse(&config_arena, config_parse(text), 1, out, &config_error);
}

static void refuse(const char *keys, const char *expected)
{
    rl_lights lights;
    assert_int_equal(parse(keys, &lights), RL_E_CONFIG);
    config_assert_error(expected);
}

static void test_keys(void **state)
{
    (void)state;
    rl_lights lights;
    double out[3];
    config_assert_fine(parse("temperature: 5600, tint: -0.01", &lights));
    assert_true(lights.light[0].kelvin == 5600 && lights.light[0].duv == -0.01);
    rl_light_resolve(&lights.light[0], out);
    assert_true(out[0] == 1 && out[1] == 1 && out[2] == 1); /* candela keep their meaning */
    config_assert_fine(parse("color: [1, 0.5, 0]", &lights));
    assert_true(lights.light[0].kelvin == 0);
    refuse("color: 1, temperature: 5600",
           "t.yaml:1:76: error: light 'k' has both color and temperature; give one");
    refuse("tint: 0.01",
           "t.yaml:1:59: error: light 'k': 'tint' is off the locus of a 'temperature'; give one");
    refuse("temperature: 999", "t.yaml:1:66: error: 'temperature' is 999: out of range, 1000 to 40000");
    refuse("temperature: 40001", "t.yaml:1:66: error: 'temperature' is 40001: out of range, 1000 to 40000");
    refuse("temperature: 5000, tint: 0.1", "t.yaml:1:78: error: 'tint' is 0.1: out of range, -0.05 to 0.05");
}

#define T(f) cmocka_unit_test_setup_teardown(f, config_setup, config_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        T(test_published),   T(test_fits),    T(test_tint), T(test_rgb),
        T(test_other_space), T(test_inverse), T(test_keys),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
