/* The ledger of energy in `relit ab`: rows of metrics.json and --fail-over energy=X, on a small capture. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/small_capture.h"
#include "tests/tool_run.h"

#define RUN(...) tool_run((const char *const[]){__VA_ARGS__, NULL})
#define AB(...)  RUN("ab", small_pipe, "--out", small_out, "--quiet", "--seeds", "1", __VA_ARGS__)

static json_t *metrics(void)
{
    size_t size;
    json_error_t error;
    char *path = path_in(small_out, "metrics.json"), *text = file_read(path, &size);
    json_t *root = json_loads(text, 0, &error);
    if (!root)
        fail_msg("metrics.json: %s", error.text);
    free(path);
    free(text);
    return root;
}

static double red(const json_t *row, const char *name)
{
    const json_t *list = json_object_get(row, name);
    assert_int_equal(json_array_size(list), 3);
    return json_number_value(json_array_get(list, 0));
}

static const char *text_of(const json_t *row, const char *name)
{
    return json_string_value(json_object_get(row, name));
}

static bool is_row(const json_t *row, int variant, const char *node, const char *material, int frame)
{
    const char *named = text_of(row, "material");
    return json_integer_value(json_object_get(row, "variant")) == variant &&
           !strcmp(text_of(row, "node"), node) &&
           json_integer_value(json_object_get(row, "frame")) == frame &&
           (material && named ? !strcmp(named, material) : !material && !named);
}

static const json_t *find(const json_t *root, int variant, const char *node, const char *material, int frame)
{
    const json_t *list = json_object_get(root, "energy");
    for (size_t i = 0; i < json_array_size(list); i++)
        if (is_row(json_array_get(list, i), variant, node, material, frame))
            return json_array_get(list, i);
    fail_msg("no row of variant %d, node %s, frame %d", variant, node, frame);
    return NULL;
}

static void test_rows(void **state)
{
    (void)state;
    tool_result r = AB("--vary", "profiles.skin.border=renormalize,occlude", "--fail-over", "energy=1000");
    if (r.status)
        fail_msg("%s%s", r.out, r.err);
    json_t *root = metrics();
    for (int variant = 0; variant < 2; variant++) /* nodes have their own names, "sss" in both */
        for (int frame = 1; frame <= SMALL_FRAMES; frame++) {
            const json_t *skin = find(root, variant, "sss", "skin", frame), *light;
            assert_string_equal(text_of(skin, "pass"), "sss_burley");
            double in = red(skin, "in"), sent = red(skin, "out"),
                   lost = red(skin, "border") + red(skin, "off_screen");
            assert_true(in > 0 && lost > 0.01 * in && red(skin, "clamped") == 0);
            assert_true(variant ? sent < in - 0.5 * lost : fabs(sent - in) < 0.5 * lost);
            assert_true(fabs(red(skin, "redistributed") - (variant ? 0 : lost)) < 0.2 * lost);
            assert_true(json_integer_value(json_object_get(skin, "pixels")) > 1);
            light = find(root, variant, "light", NULL, frame);
            assert_true(red(light, "in") == 0 && red(light, "out") > 0);
            find(root, variant, "aa", NULL, frame);
        }
    json_decref(root);
    tool_result_free(&r);
}

/* Without a limit only the last frame's is kept, by a run of its own: the filters' rows are the same. */
static void test_last_frame(void **state)
{
    (void)state;
    tool_result r = AB("--vary", "graph.sss.taps=21,55", "--fail-over", "energy=1000");
    assert_int_equal(r.status, 0);
    tool_result_free(&r);
    json_t *all = metrics();
    r = AB("--vary", "graph.sss.taps=21,55");
    assert_int_equal(r.status, 0);
    assert_null(strstr(r.err, "warning"));
    tool_result_free(&r);
    json_t *root = metrics();
    const json_t *list = json_object_get(root, "energy");
    for (size_t i = 0; i < json_array_size(list); i++)
        assert_int_equal(json_integer_value(json_object_get(json_array_get(list, i), "frame")), SMALL_FRAMES);
    for (int variant = 0; variant < 2; variant++) {
        const json_t *one = find(root, variant, "sss", "skin", SMALL_FRAMES);
        assert_true(json_equal(one, find(all, variant, "sss", "skin", SMALL_FRAMES)));
        find(root, variant, "aa", NULL, SMALL_FRAMES);
    }
    json_decref(root);
    json_decref(all);
}

/* The last frame cannot be read: that the ledger lacks it is said. */
static void test_no_last_frame(void **state)
{
    (void)state;
    char *last = path_in(small_folder, "s.0003.exr"), *away = path_in(small_folder, "s.away");
    assert_int_equal(rename(last, away), 0);
    tool_result r = AB("--vary", "graph.sss.taps=21,55");
    assert_int_equal(rename(away, last), 0);
    assert_int_equal(r.status, 1);
    assert_non_null(strstr(r.err, "the report's ledger of energy is not whole: "));
    json_t *root = metrics();
    assert_int_equal(json_array_size(json_object_get(root, "energy")), 0);
    json_decref(root);
    tool_result_free(&r);
    free(last);
    free(away);
}

/* renormalize keeps what occlude loses: the first is below a limit that the second exceeds. */
static void test_fail_over(void **state)
{
    (void)state;
    tool_result r = AB("--vary", "graph.sss.taps=21,55", "--fail-over", "energy=1000");
    assert_int_equal(r.status, 0);
    tool_result_free(&r);
    r = AB("--vary", "profiles.skin.border=occlude,renormalize", "--fail-over", "energy=1e-9");
    assert_int_equal(r.status, 3);
    assert_non_null(strstr(r.out, "energy is over 1e-09 in "));
    assert_non_null(strstr(r.out, "occlude, pass 'sss', skin, frame "));
    assert_null(strstr(r.out, "'light'")); /* light is made there, not lost */
    assert_null(strstr(r.out, "'aa'"));
    json_t *root = metrics();
    const json_t *verdict = json_array_get(json_object_get(root, "thresholds"), 0);
    assert_string_equal(text_of(verdict, "what"), "energy");
    const json_t *worst = json_array_get(json_object_get(verdict, "over"), 0);
    const json_t *row = find(root, 0, "sss", "skin", 1);
    double value = json_number_value(json_object_get(worst, "value")), most = 0;
    for (size_t c = 0; c < 3; c++) {
        double in = json_number_value(json_array_get(json_object_get(row, "in"), c));
        double sent = json_number_value(json_array_get(json_object_get(row, "out"), c));
        most = fmax(most, fabs(in - sent) / in);
    }
    assert_true(fabs(value - most) < 1e-5 && most > 0.01);
    json_decref(root);
    tool_result_free(&r);
}

/* A limit that nothing is held against does not pass. */
static void test_nothing_to_check(void **state)
{
    (void)state;
    tool_result r = AB("--vary", "graph.aa.blend=0.1,0.2", "--set", "graph.aa.in.color=light.lit",
                       "--fail-over", "energy=0.5");
    assert_int_not_equal(r.status, 0);
    assert_int_not_equal(r.status, 3);
    assert_non_null(strstr(r.err, "there is no energy to check"));
    tool_result_free(&r);
}

/* The sums are no picture. */
static void test_no_picture(void **state)
{
    (void)state;
    tool_result r = RUN("run", small_pipe, "--out", small_out, "--quiet", "--dump", "sss.energy");
    assert_int_equal(r.status, 2);
    assert_non_null(strstr(r.err, "'sss.energy' is sums over a frame, no image"));
    tool_result_free(&r);
    r = RUN("run", small_pipe, "--out", small_out, "--quiet", "--set", "graph.aa.in.color=sss.energy");
    assert_int_equal(r.status, 2);
    assert_non_null(strstr(r.err, "'sss.energy' is sums"));
    tool_result_free(&r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rows),
        cmocka_unit_test(test_last_frame),
        cmocka_unit_test(test_no_last_frame),
        cmocka_unit_test(test_fail_over),
        cmocka_unit_test(test_nothing_to_check),
        cmocka_unit_test(test_no_picture),
    };
    return cmocka_run_group_tests(tests, small_setup, small_teardown);
}
