/* Rows of parameters: reading, refusing, printing, the OpenCL struct; and the tables of every registered
 * pass. */
#include "tests/config_help.h"

#include <math.h>
#include <float.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/model/params.h"

static const rl_pass *blur_pass(void)
{
    return rl_registry_find(&config_registry, "blur");
}

static const rl_param *row_of(const char *name)
{
    for (size_t i = 0; i < blur_pass()->params.n; i++)
        if (!strcmp(blur_pass()->params.rows[i].name, name))
            return &blur_pass()->params.rows[i];
    fail_msg("no row %s", name);
    return NULL;
}

typedef union any {
    float f[64];
    int32_t i;
} any;

static any read_row(const char *row, const char *text)
{
    any out = {{-77, -77, -77}};
    config_assert_fine(rl_param_read(row_of(row), config_parse(text), &out, &config_error));
    return out;
}

static void refuse_row(const char *row, const char *text, const char *expected)
{
    any out;
    assert_int_equal(rl_param_read(row_of(row), config_parse(text), &out, &config_error), RL_E_CONFIG);
    config_assert_error(expected);
}

static void test_values(void **state)
{
    (void)state;
    assert_true(read_row("radius", "0.1").f[0] == 0.1f);
    assert_true(read_row("radius", "8").f[0] == 8.0f);
    assert_true(read_row("radius", "0").f[0] == 0.0f);
    assert_int_equal(read_row("taps", "21").i, 21);
    assert_int_equal(read_row("taps", "1e3").i, 1000);
    assert_int_equal(read_row("taps", "auto").i, -1);
    assert_int_equal(read_row("taps", "most").i, -2);
    assert_int_equal(read_row("shape", "square").i, 1);
    assert_int_equal(read_row("wrap", "true").i, 1);
    assert_int_equal(read_row("wrap", "false").i, 0);
    any one = read_row("tint", "0.5"), three = read_row("tint", "[0.1, 0.2, 0.3]");
    assert_true(one.f[0] == 0.5f && one.f[1] == 0.5f && one.f[2] == 0.5f);
    assert_true(three.f[0] == 0.1f && three.f[1] == 0.2f && three.f[2] == 0.3f);
}

/* The check is made in double: 1 + 1e-12 is 1 as a float. */
static void test_ranges(void **state)
{
    (void)state;
    refuse_row("radius", "8.1",
               "t.yaml:1:1: error: 'radius': expected a number 0 … 8 (mm), found the number '8.1'");
    refuse_row(
        "radius", "8.000000000001",
        "t.yaml:1:1: error: 'radius': expected a number 0 … 8 (mm), found the number '8.000000000001'");
    refuse_row("radius", "-1e-30",
               "t.yaml:1:1: error: 'radius': expected a number 0 … 8 (mm), found the number '-1e-30'");
    refuse_row("radius", ".nan",
               "t.yaml:1:1: error: 'radius': expected a number 0 … 8 (mm), found the number '.nan'");
    refuse_row("radius", ".inf",
               "t.yaml:1:1: error: 'radius': expected a number 0 … 8 (mm), found the number '.inf'");
    refuse_row("tint", "[0, 2, 0]",
               "t.yaml:1:5: error: 'tint': expected a number or a list of three, each 0 … 1 "
               "(ratio), found the number '2'");
    refuse_row("taps", "0",
               "t.yaml:1:1: error: 'taps': expected auto|most or an integer 1 … 4096, found the number '0'");
    refuse_row("taps", "-1",
               "t.yaml:1:1: error: 'taps': expected auto|most or an integer 1 … 4096, found the number '-1'");
    refuse_row(
        "taps", "2.5",
        "t.yaml:1:1: error: 'taps': expected auto|most or an integer 1 … 4096, found the number '2.5'");
    const rl_param any_float = {.name = "any", .type = RL_F32, .min = -INFINITY, .max = INFINITY};
    float out = 5;
    assert_int_equal(rl_param_read(&any_float, config_parse("1e39"), &out, &config_error), RL_E_CONFIG);
    config_assert_error("t.yaml:1:1: error: 'any': expected a number, found the number '1e39'");
}

static void test_types(void **state)
{
    (void)state;
    refuse_row("radius", "wide",
               "t.yaml:1:1: error: 'radius': expected a number 0 … 8 (mm), found the text 'wide'");
    refuse_row("radius", "[1]",
               "t.yaml:1:1: error: 'radius': expected a number 0 … 8 (mm), found a list of 1");
    refuse_row(
        "taps", "autos",
        "t.yaml:1:1: error: 'taps': expected auto|most or an integer 1 … 4096, found the text 'autos'");
    refuse_row("taps", "\"21\"",
               "t.yaml:1:1: error: 'taps': expected auto|most or an integer 1 … 4096, found the text '21'");
    refuse_row("shape", "sqare",
               "t.yaml:1:1: error: 'shape' cannot be 'sqare'; did you mean 'square'? known: "
               "disk, square");
    refuse_row("wrap", "1", "t.yaml:1:1: error: 'wrap': expected true or false, found the number '1'");
    refuse_row("tint", "[1, 1]",
               "t.yaml:1:1: error: 'tint': expected a number or a list of three, each 0 … 1 (ratio), "
               "found a list of 2");
    refuse_row("tint", "~",
               "t.yaml:1:1: error: 'tint': expected a number or a list of three, each 0 … 1 (ratio), "
               "found null");
    static const rl_param free_row = {
        .name = "shift", .type = RL_RGBF, .min = (double)-FLT_MAX, .max = (double)FLT_MAX, .help = "any"};
    float out[3];
    assert_int_equal(rl_param_read(&free_row, config_parse("x"), out, &config_error), RL_E_CONFIG);
    config_assert_error(
        "t.yaml:1:1: error: 'shift': expected a number or a list of three, found the text 'x'");
}

/* ---- a pass's struct
 * --------------------------------------------------------------------------------------- */

static const char *const also[] = {"pass", "in"};

static rl_code read_node(const rl_pass *pass, const char *text, const void **out)
{
    return rl_params_read(&config_arena, pass, "soft", text ? config_parse(text) : NULL, also, 2, out,
                          &config_error);
}

static void test_struct(void **state)
{
    (void)state;
    struct {
        float radius;
        int32_t taps, shape, wrap;
        float tint[3];
    } p;
    const void *data;
    assert_int_equal(sizeof p, blur_pass()->params_size);
    config_assert_fine(
        read_node(blur_pass(), "{pass: blur, in: {color: x}, taps: 55, tint: [0, 0.5, 1]}", &data));
    memcpy(&p, data, sizeof p);
    assert_true(p.radius == 1.5f && p.taps == 55 && p.shape == 0 && p.wrap == 0);
    assert_true(p.tint[0] == 0.0f && p.tint[1] == 0.5f && p.tint[2] == 1.0f);
    config_assert_fine(read_node(blur_pass(), NULL, &data));
    memcpy(&p, data, sizeof p);
    assert_true(p.radius == 1.5f && p.taps == -1 && p.tint[2] == 1.0f);
}

static void test_unknown_parameter(void **state)
{
    (void)state;
    const void *data;
    assert_int_equal(read_node(blur_pass(), "{pass: blur, tapps: 3}", &data), RL_E_CONFIG);
    config_assert_error(
        "t.yaml:1:14: error: pass 'soft' (blur) has no parameter 'tapps'; did you mean 'taps'? known: "
        "radius, shape, taps, tint, wrap");
    assert_int_equal(read_node(blur_pass(), "zzz: 3", &data), RL_E_CONFIG);
    config_assert_error("t.yaml:1:1: error: pass 'soft' (blur) has no parameter 'zzz'; known: radius, shape, "
                        "taps, tint, wrap");
    assert_int_equal(read_node(blur_pass(), "inn: 3", &data), RL_E_CONFIG);
    config_assert_error("t.yaml:1:1: error: pass 'soft' (blur) has no parameter 'inn'; did you mean 'in'?");
    assert_int_equal(read_node(rl_registry_find(&config_registry, "tint"), "gain: 3", &data), RL_E_CONFIG);
    config_assert_error("t.yaml:1:1: error: pass 'soft' (tint) has no parameter 'gain'; it has none");
    assert_int_equal(read_node(blur_pass(), "3", &data), RL_E_CONFIG);
    config_assert_error("t.yaml:1:1: error: 'soft': expected a map, found the number '3'");
}

/* ---- telling
 * ------------------------------------------------------------------------------------------------- */

static void assert_text(rl_str *s, const char *expected)
{
    assert_false(s->failed);
    assert_string_equal(rl_str_text(s), expected);
    rl_str_free(s);
}

static void test_printing(void **state)
{
    (void)state;
    static const char *const values[][3] = {
        {"radius", "0.05", "0.05"},
        {"radius", "5.0", "5"},
        {"taps", "4096", "4096"},
        {"taps", "most", "most"},
        {"shape", "square", "square"},
        {"wrap", "true", "true"},
        {"tint", "[1, 0, 0.25]", "[1, 0, 0.25]"},
    };
    for (size_t i = 0; i < RL_ARRAY_LENGTH(values); i++) {
        any value = read_row(values[i][0], values[i][1]);
        rl_str s = {0};
        rl_param_print(row_of(values[i][0]), &value, &s);
        assert_text(&s, values[i][2]);
    }
}

static void test_describing(void **state)
{
    (void)state;
    static const char *const texts[][2] = {
        {"radius", "0 … 8, default 1.5 mm"},        {"taps", "auto|most|1 … 4096, default auto"},
        {"shape", "disk|square, default disk"},     {"wrap", "true|false, default false"},
        {"tint", "0 … 1, default [1, 1, 1] ratio"},
    };
    rl_str s = {0};
    for (size_t i = 0; i < RL_ARRAY_LENGTH(texts); i++) {
        rl_param_describe(row_of(texts[i][0]), &s);
        assert_text(&s, texts[i][1]);
    }
    const rl_param open = {.name = "open", .type = RL_F32, .min = 0, .max = INFINITY, .unit = "W"};
    const rl_param free_ = {
        .name = "free", .type = RL_I32, .min = INT32_MIN, .max = INT32_MAX, .def = {7}, .unit = ""};
    const rl_param layer = {.name = "layer", .type = RL_F32, .max = 1, .unit = "ratio", .no_default = true};
    rl_param_describe(&open, &s);
    assert_text(&s, "≥ 0, default 0 W");
    rl_param_describe(&free_, &s);
    assert_text(&s, "an integer, default 7");
    rl_param_describe(&layer, &s);
    assert_text(&s, "0 … 1 ratio, no default");
    rl_param_describe(&rl_registry_find(&config_registry, "blur")->profile_keys.rows[0], &s);
    assert_text(&s, "0.001 … 1000 mm, required");
}

static void test_struct_text(void **state)
{
    (void)state;
    rl_str s = {0};
    rl_params_struct_text(blur_pass()->params, "params_t", &s);
    assert_text(&s, "typedef struct params_t { float radius; int taps; int shape; int wrap; float tint[3]; } "
                    "params_t;\n");
    rl_params_struct_text((rl_params){0}, "params_t", &s);
    assert_text(&s, "");
}

static void test_no_default(void **state)
{
    (void)state;
    const rl_param layer = {.name = "layer", .type = RL_F32, .max = 1, .def = {0.5}, .no_default = true};
    float out = 0;
    rl_param_default(&layer, &out);
    assert_true(out == -1.0f);
    assert_int_equal(rl_param_read(&layer, config_parse("-1"), &out, &config_error), RL_E_CONFIG);
    config_assert_error("t.yaml:1:1: error: 'layer': expected a number 0 … 1, found the number '-1'");
}

/* ---- memory
 * ---------------------------------------------------------------------------------------------------- */

/* Whatever allocation fails, the result is an error of memory or, where it was only a message, of the config.
 */
static void test_out_of_memory(void **state)
{
    (void)state;
    const rl_value *good = config_parse("{taps: 55}"), *bad = config_parse("{tapps: 55}");
    for (unsigned long n = 1;; n++) {
        rl_arena arena = {0};
        rl_error err = {0}, err2 = {0};
        const void *data = NULL;
        rl_alloc_fail_at(n, 0);
        rl_code code = rl_params_read(&arena, blur_pass(), "soft", good, also, 2, &data, &err);
        rl_alloc_fail_at(n, 0);
        rl_code code2 = rl_params_read(&arena, blur_pass(), "soft", bad, also, 2, &data, &err2);
        rl_alloc_fail_at(0, 0);
        rl_arena_free(&arena);
        assert_true(code == RL_OK || code == RL_E_MEMORY);
        assert_true(code2 == RL_E_CONFIG || code2 == RL_E_MEMORY);
        if (!code && code2 == RL_E_CONFIG)
            break;
        assert_true(n < 100);
    }
}

/* ---- every registered pass
 * ------------------------------------------------------------------------------------- */

static void check_row(const char *pass, const rl_param *row)
{
    if (!row->help || !row->help[0] || !row->unit || !row->name || !row->name[0])
        fail_msg("%s: row '%s' lacks help or unit", pass, row->name);
    if (row->type == RL_ENUM && !row->words)
        fail_msg("%s: '%s' has no words", pass, row->name);
    rl_str s = {0};
    any value;
    assert_true(rl_param_bytes(row) <= sizeof value);
    assert_int_equal(row->type == RL_ROWS, row->list.n > 0);
    for (size_t i = 0; i < row->list.n; i++) {
        assert_int_not_equal(row->list.rows[i].type, RL_ROWS);
        check_row(pass, &row->list.rows[i]);
    }
    rl_param_default(row, &value);
    rl_param_print(row, &value, &s);
    if (!row->no_default &&
        !row->required) { /* what is printed reads back: a default outside of the range does not */
        any again = value;
        config_assert_fine(rl_param_read(row, config_parse(rl_str_text(&s)), &again, &config_error));
        assert_memory_equal(&again, &value, rl_param_bytes(row));
    }
    rl_str_free(&s);
}

static void test_registry(void **state)
{
    (void)state;
    for (size_t i = 0; i < rl_pass_count(); i++) {
        const rl_pass *pass = rl_pass_at(i);
        size_t offset = 0;
        assert_ptr_equal(rl_pass_find(pass->name), pass);
        assert_string_not_equal(pass->name, "kernel"); /* the user's */
        assert_true(pass->help && pass->help[0]);
        for (size_t k = 0; k < pass->params.n; k++) {
            const rl_param *row = &pass->params.rows[k];
            check_row(pass->name, row);
            if (row->offset != offset)
                fail_msg("%s: '%s' is not in the struct's order", pass->name, row->name);
            offset += rl_param_bytes(row);
            for (size_t m = 0; m < RL_ARRAY_LENGTH(also); m++)
                assert_string_not_equal(row->name, also[m]);
            for (size_t m = 0; m < k; m++)
                assert_string_not_equal(row->name, pass->params.rows[m].name);
        }
        assert_int_equal(pass->params_size, offset);
        for (size_t k = 0; k < pass->profile_keys.n; k++)
            check_row(pass->name, &pass->profile_keys.rows[k]);
        for (size_t k = 0; k < pass->material_keys.n; k++)
            check_row(pass->name, &pass->material_keys.rows[k]);
        for (size_t k = 0; k < pass->shading_keys.n; k++)
            check_row(pass->name, &pass->shading_keys.rows[k]);
    }
    assert_null(rl_pass_find("no such pass"));
}

#define T(f) cmocka_unit_test_setup_teardown(f, config_setup, config_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        T(test_values),
        T(test_ranges),
        T(test_types),
        T(test_struct),
        T(test_unknown_parameter),
        T(test_printing),
        T(test_describing),
        T(test_struct_text),
        T(test_no_default),
        T(test_out_of_memory),
        T(test_registry),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
