/* Ambient light before any kernel: harmonics, lobes, latitude-longitude maps, and the pipeline's section. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>

#include "graph/model/ambient.h"
#include "tests/cl_shade.h"

static const double pi = 3.14159265358979323846;

static void assert_near(double got, double want, double relative)
{
    if (fabs(got - want) > relative * fabs(want) + 1e-9)
        fail_msg("got %.9g, expected %.9g", got, want);
}

static double radiance(const void *ctx, const double *v)
{
    const double *sh = ctx;
    double basis[RL_AMBIENT_BANDS], sum = 0;
    rl_ambient_basis(v, basis);
    for (int i = 0; i < RL_AMBIENT_BANDS; i++)
        sum += sh[i] * basis[i];
    return sum;
}

static void harmonics_are_orthonormal(void **state)
{
    double product[RL_AMBIENT_BANDS][RL_AMBIENT_BANDS] = {{0}};
    (void)state;
    for (int i = 0; i < 400; i++) {
        for (int j = 0; j < 32; j++) {
            double z = (i + 0.5) / 200 - 1, phi = 2 * pi * (j + 0.5) / 32, r = sqrt(1 - z * z),
                   b[RL_AMBIENT_BANDS];
            rl_ambient_basis((double[]){r * cos(phi), r * sin(phi), z}, b);
            for (int a = 0; a < RL_AMBIENT_BANDS; a++)
                for (int c = 0; c < RL_AMBIENT_BANDS; c++)
                    product[a][c] += b[a] * b[c] * 4 * pi / (400 * 32);
        }
    }
    for (int a = 0; a < RL_AMBIENT_BANDS; a++)
        for (int c = 0; c < RL_AMBIENT_BANDS; c++)
            assert_true(fabs(product[a][c] - (a == c)) < 1e-4);
}

static void flux_of_a_lobe(void **state)
{
    (void)state;
    for (int i = 0; i < 5; i++) {
        double s = pow(10, i - 2), sum = 0;
        for (int k = 0; k < 400000; k++)
            sum += 2 * pi * 5e-6 * exp(s * ((k + 0.5) * 5e-6 - 2));
        assert_near(rl_ambient_lobe_flux(s), sum, 1e-5);
    }
}

/* ---- latitude-longitude maps -----------------------------------------------------------------------------
 */

/* A map that holds a band-limited sky gives its coefficients back, turned as the map is. */
static void map_gives_its_harmonics_back(void **state)
{
    enum { W = 256, H = 128 };
    static float image[3][W * H];
    const float *planes[3] = {image[0], image[1], image[2]};
    uint64_t seed = 3;
    (void)state;
    for (int z_up = 0; z_up < 2; z_up++) {
        rl_ambient a = {.z_up = z_up, .rotation = 0.7};
        double want[RL_AMBIENT_BANDS], got[RL_AMBIENT_BANDS][3] = {{0}};
        for (int i = 0; i < RL_AMBIENT_BANDS; i++)
            want[i] = 2 * shade_random(&seed) - 1;
        for (int y = 0; y < H; y++) {
            for (int x = 0; x < W; x++) {
                double d[3];
                rl_ambient_direction(&a, (x + 0.5) / W, (y + 0.5) / H, d);
                for (int c = 0; c < 3; c++)
                    image[c][y * W + x] = (float)((c + 1) * radiance(want, d));
            }
        }
        assert_true(rl_ambient_project(&a, planes, W, H, got) == 0);
        for (int i = 0; i < RL_AMBIENT_BANDS; i++)
            for (int c = 0; c < 3; c++)
                assert_true(fabs(got[i][c] - (c + 1) * want[i]) < 1e-3);
    }
    double sh[RL_AMBIENT_BANDS][3] = {{0}};
    image[1][5] = NAN;
    image[1][6] = INFINITY;
    assert_true(rl_ambient_project(&(rl_ambient){0}, planes, W, H, sh) == 2);
    assert_true(isfinite(sh[0][1]));
}

static void assert_direction(const rl_ambient *a, double u, double v, double x, double y, double z)
{
    double d[3];
    rl_ambient_direction(a, u, v, d);
    assert_true(fabs(d[0] - x) + fabs(d[1] - y) + fabs(d[2] - z) < 1e-12);
}

static void map_shows_the_world_from_within(void **state)
{
    rl_ambient y_up = {0}, z_up = {.z_up = true}, turned = {.z_up = true, .rotation = pi / 2};
    (void)state;
    assert_direction(&y_up, 0.5, 0.5, 0, 0, 1);
    assert_direction(&y_up, 0.25, 0.5, 1, 0, 0); /* who looks along +z with +y up has +x at the left */
    assert_direction(&y_up, 0.3, 0, 0, 1, 0);
    assert_direction(&z_up, 0.5, 0.5, 1, 0, 0);
    assert_direction(&z_up, 0.25, 0.5, 0, 1, 0);
    assert_direction(&z_up, 0.3, 1, 0, 0, -1);
    assert_direction(&turned, 0.5, 0.5, 0, 1, 0); /* counter-clockwise from above */
}

/* ---- the section -----------------------------------------------------------------------------------------
 */

static rl_code parse(const char *text, rl_ambient *out, rl_error *err)
{
    static rl_arena arena;
    rl_value *v;
    *err = (rl_error){0};
    assert_int_equal(rl_yaml_parse(&arena, text, strlen(text), "t.yaml", &v, err), RL_OK);
    rl_code code = rl_ambient_parse(&arena, v, out, err);
    if (out->hdri && !code)
        assert_string_equal(out->hdri, "sky.exr");
    rl_arena_free(&arena);
    return code;
}

static void section_is_checked(void **state)
{
    static const struct {
        const char *text, *says;
    } bad[] = {
        {"{sh: [1, 2, 3]}", "expected a list of 9 coefficients"},
        {"{lobes: [{axis: [0, 0, 1], sharpness: 2}]}", "a lobe needs 'amplitude'"},
        {"{lobes: [{axis: [0, 0, 0], sharpness: 2, amplitude: 1}]}", "'axis' has no usable length"},
        {"{lobes: [{axis: [0, 0, 1], sharpness: 0, amplitude: 1}]}", "sharpness"},
        {"{hdri: sky.exr}", "an hdri needs 'up'"},
        {"{rotation: 3}", "'rotation' is of an hdri"},
        {"{intensity: -1}", "intensity"},
        {"{hdr: sky.exr}", "did you mean 'hdri'?"},
    };
    rl_ambient a;
    rl_error err;
    (void)state;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        assert_int_equal(parse(bad[i].text, &a, &err), RL_E_CONFIG);
        if (!strstr(err.text, bad[i].says))
            fail_msg("'%s' does not say '%s'", err.text, bad[i].says);
    }
    assert_int_equal(parse("{hdri: sky.exr, up: z, rotation: 90, intensity: [1, 2, 3], sh: [1, 2, 3, 4, 5, "
                           "6, 7, 8, [9, 0, -9]], "
                           "lobes: [{axis: [0, 3, 0], sharpness: 2, amplitude: [1, 2, 3]}]}",
                           &a, &err),
                     RL_OK);
    assert_true(a.z_up && a.n_lobes == 1 && a.lobes[0].axis[1] == 1 && a.sh[8][2] == -9 && a.sh[1][0] == 2);
    assert_near(a.rotation, pi / 2, 1e-12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(harmonics_are_orthonormal),    cmocka_unit_test(flux_of_a_lobe),
        cmocka_unit_test(map_gives_its_harmonics_back), cmocka_unit_test(map_shows_the_world_from_within),
        cmocka_unit_test(section_is_checked),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
