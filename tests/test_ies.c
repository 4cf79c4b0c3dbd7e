/* Profiles of lamps: files, units, and what the lighting pass makes of them. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>

#include "graph/base/file.h"
#include "graph/model/lights.h"
#include "tests/area_scene.h"
#include "tests/config_help.h"

static const double pi = 3.14159265358979323846;

static rl_arena arena;

#define HEAD "IESNA:LM-63-1995\n[TEST] made for this test\n[MANUFAC] none\nTILT=NONE\n"

/* Four equal quarters, brighter across than along; 2 x 0.5 on all candela. */
static const char quarters[] = HEAD "1 1000 2.0 4 3 1 2 0.1 0.2 0\n0.5 1 40\n0 30 60 90\n0 45 90\n"
                                    "100, 80 40 0\n100 120 70 10\n100 160 90 20\n";

static const rl_ies *parse(const char *text)
{
    const rl_ies *ies = NULL;
    rl_error err = {0};
    if (rl_ies_parse(&arena, text, "lamp.ies", &ies, &err))
        fail_msg("lamp.ies:%d: %s", err.line, err.text);
    return ies;
}

static double value(const rl_ies *ies, double down, double around)
{
    double row = down / 180 * (ies->vertical - 1), column = around / 360 * (ies->horizontal - 1);
    return (double)ies
               ->value[(int)round(row) * ies->horizontal + (ies->horizontal > 1 ? (int)round(column) : 0)] *
           ies->candela;
}

static void assert_near(double got, double want, double within)
{
    if (fabs(got - want) > within)
        fail_msg("got %.9g, expected %.9g", got, want);
}

static void tables_repeat_the_file(void **state)
{
    (void)state;
    const rl_ies *ies = parse(quarters);
    assert_int_equal(ies->vertical, 181);
    assert_int_equal(ies->horizontal, 9);
    assert_near(ies->candela, 160, 1e-9);
    for (int i = 0; i < 4; i++) {
        static const double turns[] = {45, 135, 225, 315};
        assert_near(value(ies, 30, turns[i]), 120, 1e-4);
        assert_near(value(ies, 60, turns[i]), 70, 1e-4);
    }
    assert_near(value(ies, 30, 90), 160, 1e-4);
    assert_near(value(ies, 60, 270), 90, 1e-4);
    assert_near(value(ies, 60, 180), 40, 1e-4);
    assert_near(value(ies, 0, 200), 100, 1e-4);
    assert_near(value(ies, 120, 90), 0, 1e-9); /* above the lamp */
    /* halves, the other way round, and all around */
    ies = parse(HEAD "1 -1 1 2 3 1 1 0 0 0 1 1 9\r\n90 180\r\n0 90 180\r\n1 2\r\n3 4\r\n5 6\r\n");
    assert_near(value(ies, 180, 90), 4, 1e-5);
    assert_near(value(ies, 180, 270), 4, 1e-5);
    assert_near(value(ies, 90, 180), 5, 1e-5);
    assert_near(value(ies, 0, 180), 0, 1e-9);
    ies = parse(HEAD "1 -1 1 2 3 1 1 0 0 0 1 1 9 0 180 90 180 270 1 2 3 4 5 6");
    assert_near(value(ies, 180, 90), 2, 1e-5);
    assert_near(value(ies, 180, 0), 4, 1e-5);
    assert_near(value(ies, 180, 270), 6, 1e-5);
    ies = parse(HEAD "1 -1 1 2 5 1 1 0 0 0 1 1 9 0 180 0 90 180 270 360 1 2 3 4 5 6 7 8 1 2");
    assert_near(value(ies, 180, 90), 4, 1e-5);
    assert_near(value(ies, 180, 270), 8, 1e-5);
    assert_near(value(ies, 180, 360), 2, 1e-5);
    ies = parse("IESNA:LM-63-2002\n[TEST] x\nTILT=NONE\n1 -1 1 3 1 1 1 0 0 0 1 0 9 0 90 180 0 10 10 10");
    assert_int_equal(ies->horizontal, 1);
    assert_near(rl_ies_integral(ies, pi), 4 * pi, 1e-4);
    assert_near(rl_ies_integral(ies, 0.4), 2 * pi * (1 - cos(0.4)), 1e-5);
}

/* What stands behind the ballast factor: the ballast-lamp factor until 1995, "future use" in 2002, and in
 * 2019 how the file was made (1.1: in an accredited laboratory). */
static void editions_differ(void **state)
{
    static const struct {
        const char *head;
        double candela;
    } rows[] = {{"IESNA91", 5.5},
                {"IESNA:LM-63-1995", 5.5},
                {"IESNA:LM-63-2002", 5},
                {"IES:LM-63-2019", 5},
                {"\xef\xbb\xbfIESNA:LM-63-2002", 5}};
    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        for (int crlf = 0; crlf < 2; crlf++) {
            char text[256];
            snprintf(text, sizeof text,
                     "%s%s[MANUFAC] L\xe4mp\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1.1 9\n0 90\n0\n5 0\n",
                     rows[i].head, crlf ? "\r\n" : "\n");
            assert_near(parse(text)->candela, rows[i].candela, 1e-9);
        }
}

static void bad_files_say_where(void **state)
{
    static const struct {
        const char *text;
        int line;
        const char *what;
    } rows[] = {
        {"LM-63\n", 1,
         "not a photometric file: its first line is not 'IESNA…' or 'IES:…' (LM-63-1991 or later), but "
         "'LM-63'"},
        {"", 1,
         "not a photometric file: its first line is not 'IESNA…' or 'IES:…' (LM-63-1991 or later), but ''"},
        {"IESNA91\n[TEST]\n", 3, "expected a line 'TILT=NONE', found the end of the file"},
        {"IESNA91\n\nTILT=INCLUDE\n1\n", 3, "TILT=INCLUDE: only files with TILT=NONE can be used"},
        {HEAD "1 1000 x\n", 5, "expected the candela multiplier, found 'x'"},
        {HEAD "1 1000 1\xb0 3\n", 5, "expected the candela multiplier, found '1?'"}, /* no UTF-8 */
        {HEAD "1 1000 1\xc2\xb0 3\n", 5, "expected the candela multiplier, found '1°'"},
        {HEAD "1 1000 0\n", 5, "the candela multiplier: expected above 0, found 0"},
        {HEAD "1 1000 1 0.5 1 1\n", 5, "the number of vertical angles: expected 1 to 2048, found 0.5"},
        {HEAD "1 1000 1\n2 1\n3 2 0 0 0 1 1 9\n", 7, "photometric type 3 (A): only type C (1) can be used"},
        {HEAD "1 1 1 2 1 1 2 0 0 0\n1 1 9\n90 0\n", 7, "vertical angles do not rise: 0 follows 90"},
        {HEAD "1 1 1 2 1 1 2 0 0 0\n1 1 9\n0 45\n0\n", 8,
         "vertical angles from 0 to 45: of type C they go from 0 to 90, 90 to 180 or 0 to 180"},
        {HEAD "1 1 1 2 2 1 2 0 0 0\n1 1 9\n0 90\n0 60\n", 8,
         "horizontal angles from 0 to 60: of type C they are 0, or go from 0 to 90, 180 or 360 or from 90 to "
         "270"},
        {HEAD "1 1 1 2 1 1 2 0 0 0\n1 1 9\n0 90\n0\n4\n", 10, "expected candela, found the end of the file"},
        {HEAD "1 1 1 2 1 1 2 0 0 0\n1 1 9\n0 90\n0\n4 -1\n", 9, "candela: expected at least 0, found -1"},
        {HEAD "1 1 1 2 1 1 2 0 0 0\n1 1 9\n0 90\n0\n0 0", 9, "no candela value is above 0"},
        {HEAD "1 1 1e200 2 1 1 2 0 0 0\n1 1 9\n0 90\n0\n0 1e200", 9,
         "the largest candela times the multiplier: expected at most 1e30, found inf"},
        {HEAD "1 1 1 1e300 1 1 2 0 0 0\n", 5,
         "the number of vertical angles: expected 1 to 2048, found 1e+300"},
        {HEAD "1 1 1 2 1 1 2 0 0 0\n0 1 9\n", 6, "the ballast factor: expected above 0, found 0"},
        {HEAD "1 1 1 2 1 1 2 0 0 0\n1 -2 9\n", 6, "the ballast-lamp factor: expected at least 0, found -2"},
    };
    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const rl_ies *ies;
        rl_error err = {0};
        assert_int_equal(rl_ies_parse(&arena, rows[i].text, "lamp.ies", &ies, &err), RL_E_FORMAT);
        assert_string_equal(err.text, rows[i].what);
        assert_string_equal(err.file, "lamp.ies");
        assert_int_equal(err.line, rows[i].line);
        assert_true(err.column > 0);
    }
    for (size_t n = 0; n < sizeof quarters - 1; n++) { /* cut anywhere: an error or a table, nothing else */
        char text[sizeof quarters] = {0};
        const rl_ies *ies;
        memcpy(text, quarters, n);
        rl_ies_parse(&arena, text, "lamp.ies", &ies, NULL);
    }
}

/* Bilinear in degrees, from the file's numbers, folded by hand. */
static double truth(double down, double around)
{
    static const double candela[3][4] = {{100, 80, 40, 0}, {100, 120, 70, 10}, {100, 160, 90, 20}};
    around = around > 180 ? 360 - around : around;
    around = around > 90 ? 180 - around : around;
    if (down > 90)
        return 0;
    double row = fmin(down / 30, 2.999999), column = fmin(around / 45, 1.999999), s = row - (int)row,
           t = column - (int)column;
    const double *a = candela[(int)column], *b = candela[(int)column + 1];
    int i = (int)row;
    return ((1 - t) * ((1 - s) * a[i] + s * a[i + 1]) + t * ((1 - s) * b[i] + s * b[i + 1])) / 160;
}

/* ---- lights ---- */

static rl_code read_lights(const char *keys, rl_lights *out)
{
    char text[512];
    snprintf(text, sizeof text, "lamp: {%s}", keys);
    return rl_lights_parse(&config_arena, config_parse(text), 0.01, out, &config_error);
}

static void expect_amount(const char *keys, double want, double within)
{
    rl_lights lights;
    double rgb[3];
    if (read_lights(keys, &lights))
        fail_msg("%s: %s", keys, config_error.text);
    rl_light_resolve(&lights.light[0], rgb);
    assert_near(rgb[0] / want, 1, within);
}

static void expect_error(const char *keys, const char *want)
{
    rl_lights lights;
    config_error = (rl_error){0};
    assert_true(read_lights(keys, &lights) != RL_OK);
    assert_string_equal(config_error.text, want);
    config_error = (rl_error){0};
}

#define LAMP  "type: point, position: [0, 0, 0], direction: [0, 0, -1], ies: \"%s\""
#define BALL  "type: sphere, position: [0, 0, 0], radius: 20"
#define PANEL "type: rect, position: [0, 0, 0], direction: [0, 0, -1], width: 50, height: 20"

/* Lengths are in cm here. Every unit of a light that sends 3 W/sr where it is brightest. */
static void units_agree(void **state)
{
    char keys[512], path[] = "/tmp/relit_ies_XXXXXX";
    (void)state;
    int file = mkstemp(path);
    assert_true(file >= 0);
    close(file);
    assert_int_equal(rl_file_write(path, quarters, sizeof quarters - 1, NULL), RL_OK);
    double flux = 0; /* of the profile: linear in both angles */
    for (int i = 0; i < 900; i++)
        for (int j = 0; j < 360; j++) {
            flux += truth((i + 0.5) / 10, j + 0.5) * sin((i + 0.5) * pi / 1800) * (pi / 1800) * (pi / 180);
        }
#define WITH(more, ...) (snprintf(keys, sizeof keys, LAMP ", " more, path, __VA_ARGS__), keys)
    expect_amount(WITH("exposure: %g", 1.0), 2 * 160 / 683.0, 2e-5);
    expect_amount(WITH("color: 0.5, efficacy: %g", 80.0), 1.0, 2e-5);
    expect_amount(WITH("intensity: %g", 3.0), 3, 2e-5);
    expect_amount(WITH("candela: %g", 3 * 683.0), 3, 2e-5);
    expect_amount(WITH("power: %g", 3 * flux), 3, 2e-3);
    expect_amount(WITH("lumen: %g", 683 * 3 * flux), 3, 2e-3);
    expect_amount(BALL ", intensity: 3", 3, 2e-5);
    snprintf(keys, sizeof keys, BALL ", radiance: %.9g", 3 / (pi * 0.04));
    expect_amount(keys, 3, 2e-5);
    snprintf(keys, sizeof keys, BALL ", lumen: %.9g", 683 * 12 * pi);
    expect_amount(keys, 3, 2e-5);
    snprintf(keys, sizeof keys, PANEL ", luminance: %.9g", 683 * 3 / 0.1);
    expect_amount(keys, 3, 2e-5);
    snprintf(keys, sizeof keys, PANEL ", power: %.9g", 3 * pi);
    expect_amount(keys, 3, 2e-5);
    snprintf(keys, sizeof keys, PANEL ", two_sided: true, power: %.9g", 6 * pi);
    expect_amount(keys, 3, 2e-5);
    expect_amount("type: point, position: [0, 0, 0], power: 12.5663706", 1, 2e-5);
    snprintf(keys, sizeof keys, "type: point, position: [0, 0, 0], ies: %s", path);
    expect_error(keys,
                 "light 'lamp': with 'ies' it needs 'direction', where the file's vertical angle 0 points");
    remove(path);
    expect_error(BALL ", width: 3, radiance: 1", "light 'lamp': a sphere light has no 'width'");
    expect_error("type: sphere, position: [0, 0, 0], radiance: 1",
                 "light 'lamp': a sphere light needs 'radius'");
    expect_error("type: sphere, position: [0, 0, 0], radius: 0, radiance: 1",
                 "light 'lamp': the radius is below a nanometre; a light without size is a point");
    expect_error(PANEL ", up: [0, 0, 2], radiance: 1", "light 'lamp': 'up' lies along the direction");
    expect_error(
        PANEL ", lux: 1",
        "light 'lamp': a rect light takes radiance, intensity, power, luminance, candela or lumen, not lux");
    expect_error("type: point, position: [0, 0, 0], up: [0, 0, 1], intensity: 1",
                 "light 'lamp': a point light has no 'up' without 'ies'");
}

/* ---- the kernel ---- */

static void kernel_looks_up(void **state)
{
    static float even[AREA_COLUMNS * AREA_ROWS], table[2 + 181 * 9 + 1];
    area_yard t;
    double worst = 0;
    rl_lights lights;
    (void)state;
    area_make(&t);
    t.scene.frame.camera.focal[0] = t.scene.frame.camera.focal[1] = 5; /* two metres are seen */
    t.run.frame = t.scene.frame;
    const frame_t *f = &t.scene.frame;
    area_place(&t, LIGHT_POINT, 0.5, 1, 1);
    area_aim(&t);
    const rl_ies *ies = parse(quarters);
    table[1] = (float)ies->vertical;
    table[2] = (float)ies->horizontal;
    memcpy(table + 3, ies->value, 181 * 9 * sizeof *table);
    if (read_lights("type: rect, position: [0, 0, 0], direction: [0.3, 0.5, -0.9], up: [1, 2, 0.5], width: "
                    "1, height: 1, "
                    "radiance: 1",
                    &lights))
        fail_msg("%s", config_error.text);
    double side[3], top[3];
    rl_light_axes(&lights.light[0], side, top);
    for (int pass = 0; pass < 2; pass++) {
        assert_true(shade_execute(&t.run));
        for (int i = 0; i < AREA_COLUMNS * AREA_ROWS; i++) {
            area_point p;
            int x = i % AREA_COLUMNS + f->valid[0], y = i / AREA_COLUMNS + f->valid[1];
            double w[3], got = area_got(&t, LIGHTING_DIFFUSE, x, y);
            if (pass == 0) {
                even[i] = (float)got;
                continue;
            }
            area_read(&t, x, y, &p);
            for (int k = 0; k < 3; k++)
                w[k] = p.p[k] - (double)t.light.position[k];
            area_normalize(w);
            double down = acos(area_dot(w, lights.light[0].direction)) * 180 / pi;
            double around = atan2(area_dot(w, side), area_dot(w, top)) * 180 / pi;
            if (down > 90 && down < 91)
                continue; /* the table ends in a slope of one step */
            if (even[i] > 0)
                worst = fmax(worst,
                             fabs(got / (double)even[i] - truth(down, around < 0 ? around + 360 : around)));
        }
        t.run.profiles = table;
        t.run.n_profiles = sizeof table / sizeof *table;
        t.light.profile = 1;
        for (int k = 0; k < 3; k++) {
            t.light.direction[k] = (float)lights.light[0].direction[k];
            t.light.side[k] = (float)side[k];
            t.light.top[k] = (float)top[k];
        }
    }
    print_message("profile in the kernel: largest error %.1e of its largest value\n", worst);
    assert_true(worst < 2e-5);
    shade_scene_free(&t.scene);
}

static int clean(void **state)
{
    (void)state;
    rl_arena_free(&arena);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tables_repeat_the_file), cmocka_unit_test(editions_differ),
        cmocka_unit_test(bad_files_say_where),    cmocka_unit_test(units_agree),
        cmocka_unit_test(kernel_looks_up),
    };
    return cmocka_run_group_tests(tests, NULL, clean);
}
