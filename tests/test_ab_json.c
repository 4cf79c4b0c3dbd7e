/* metrics.json: read back by a JSON parser, every key of the contract. */
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

#include "graph/tool/ab_json.h"
#include "tests/ab_values.h"

static rl_experiment *e;
static ab_values v;
static json_t *object;

static void write_and_read(void)
{
    rl_str text = {0};
    rl_error err = {0};
    json_error_t bad = {0};
    assert_int_equal(rl_ab_json(&v.report, &text, &err), RL_OK);
    json_decref(object);
    object = json_loads(rl_str_text(&text), JSON_REJECT_DUPLICATES, &bad);
    if (!object)
        fail_msg("line %d: %s", bad.line, bad.text);
    assert_int_equal(text.text[text.length - 1], '\n');
    rl_str_free(&text);
}

/* "captures.0.materials.2" */
static json_t *at(const char *path)
{
    json_t *value = object;
    char copy[128], *rest = copy, *step;
    snprintf(copy, sizeof copy, "%s", path);
    while ((step = strsep(&rest, ".")))
        value =
            json_is_array(value) ? json_array_get(value, (size_t)atoi(step)) : json_object_get(value, step);
    return value;
}

static void expect_text(const char *path, const char *want)
{
    json_t *value = at(path);
    if (!json_is_string(value))
        fail_msg("%s is no text", path);
    assert_string_equal(json_string_value(value), want);
}

static void expect_number(const char *path, double want)
{
    json_t *value = at(path);
    if (!json_is_number(value))
        fail_msg("%s is no number", path);
    assert_true(fabs(json_number_value(value) - want) <= 1e-12);
}

static void expect_null(const char *path)
{
    if (!json_is_null(at(path)))
        fail_msg("%s is not null", path);
}

static int set_up(void **state)
{
    (void)state;
    e = fake_experiment_new(2);
    ab_values_make(&v, e, 5, 3);
    v.p.values[1] = NULL;
    v.report.command = "relit ab \"a b.yaml\" --vary x=\\";
    v.report.summary = "post \xc3\xa9 bad \xff byte\nline";
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    fake_experiment_free(e);
    json_decref(object);
    object = NULL;
    return 0;
}

/* ---- */

static void test_what_was_compared(void **state)
{
    (void)state;
    write_and_read();
    expect_text("relit", RL_VERSION);
    expect_text("command", "relit ab \"a b.yaml\" --vary x=\\");
    expect_text("summary", "post ?? bad ? byte\nline");
    assert_int_equal(json_array_size(at("variants")), 3); /* no replicates */
    expect_text("variants.1.name", "pre_post");
    expect_text("variants.1.pipeline", "configs/skin.yaml");
    expect_text("variants.1.settings.0.path", "profiles.skin.texturing");
    expect_text("variants.1.settings.0.value", "pre_post");
    expect_text("variants.0.hash", "0123456789abcdef");
    expect_text("parameters.0.path", "profiles.skin.texturing");
    expect_text("parameters.0.values.0", "post");
    expect_null("parameters.0.values.1");
    assert_int_equal(json_array_size(at("parameters.0.values")), 3);
    expect_number("pairs.1.reference", 0);
    expect_number("pairs.1.test", 2);
    expect_null("against");
    expect_text("images.linear", "aa.color, linear Rec. 709");
    expect_text("images.display", "aa.color, sRGB / ACES");
    expect_text("captures.1.name", "bust");
    expect_number("captures.0.frames.2", 5);
    expect_number("captures.0.width", FAKE_WIDTH);
    expect_number("captures.0.height", FAKE_HEIGHT);
    expect_text("captures.0.materials.0", "");
    expect_text("captures.0.materials.2", "plaster");
    v.p.plan.against = "truth";
    v.p.pairs[0].reference = RL_AB_AGAINST;
    write_and_read();
    expect_null("pairs.0.reference");
    expect_text("against", "truth");
}

static void test_metrics(void **state)
{
    (void)state;
    ab_values_add(&v, 0, 0, 0, RL_AB_WHOLE, 0.1, 0.25);
    ab_values_add(&v, 1, 1, 2, FAKE_SKIN, 0, 0);
    ab_values_null(&v, 0, RL_AB_WHOLE, 0.01);
    ab_values_null(&v, 1, FAKE_SKIN, 0.02);
    v.nulls[2] = (rl_ab_null){.capture = 0, .material = FAKE_ABSENT, .metric = RL_METRIC_MAX};
    v.results.n_nulls = 3;
    v.p.plan.stochastic = true;
    write_and_read();
    assert_int_equal(json_array_size(at("metrics")), 12);
    expect_number("metrics.0.capture", 0);
    expect_number("metrics.0.pair", 0);
    expect_number("metrics.0.frame", 1);
    expect_null("metrics.0.material");
    expect_text("metrics.0.metric", "flip");
    expect_number("metrics.0.pixels", 100);
    expect_number("metrics.0.mean", 0.1);
    expect_number("metrics.0.median", 0.05);
    expect_number("metrics.0.p95", 0.25);
    expect_number("metrics.0.max", 0.5);
    assert_true(json_is_true(at("metrics.0.beyond_chance")));
    assert_true(json_is_null(at("metrics.1.beyond_chance"))); /* no null of hdrflip */
    expect_text("metrics.2.metric", "psnr");
    expect_null("metrics.2.p95");
    expect_number("metrics.6.capture", 1);
    expect_number("metrics.6.frame", 5);
    expect_text("metrics.6.material", "skin");
    assert_true(json_is_false(at("metrics.6.beyond_chance")));
    expect_null("metrics.8.mean"); /* psnr of equal images */
    assert_int_equal(json_array_size(at("null")), 2);
    expect_number("null.1.capture", 1);
    expect_text("null.1.material", "skin");
    expect_text("null.1.metric", "flip");
    expect_number("null.1.n", 9);
    expect_number("null.1.p95", 0.04);
    assert_true(json_is_true(at("stochastic")));
    expect_number("seeds", 3);
    expect_number("false_positives", 1.0 / 3);
}

static void test_graph(void **state)
{
    (void)state;
    v.report.seconds = 1.25;
    write_and_read();
    assert_int_equal(json_array_size(at("graph")), 2); /* one of each capture */
    expect_number("graph.1.capture", 1);
    expect_number("graph.0.group", 0);
    expect_null("graph.0.reason");
    assert_int_equal(json_array_size(at("graph.0.nodes")), 4);
    expect_text("graph.0.nodes.0.name", "light");
    expect_text("graph.0.nodes.0.pass", "lighting");
    assert_int_equal(json_array_size(at("graph.0.nodes.0.variants")), 3);
    assert_true(json_is_false(at("graph.0.nodes.0.varied")));
    expect_null("graph.0.nodes.0.ms");
    expect_text("graph.0.nodes.2.name", "sss@2");
    assert_int_equal(json_array_size(at("graph.0.nodes.2.variants")), 2);
    expect_number("graph.0.nodes.2.variants.0", 1);
    assert_true(json_is_true(at("graph.0.nodes.2.varied")));
    expect_number("graph.0.nodes.2.ms", 1.5);
    /* light: albedo depth shadow; sss, sss@2: diffuse lit depth; aa: color depth and two pasts. */
    assert_int_equal(json_array_size(at("graph.0.edges")), 3 + 3 + 3 + 4);
    expect_text("graph.0.edges.0.from", "capture");
    expect_text("graph.0.edges.0.to", "light");
    expect_text("graph.0.edges.0.image", "capture.albedo");
    expect_text("graph.0.edges.6.from", "light");
    expect_text("graph.0.edges.6.to", "sss@2");
    expect_text("graph.0.edges.6.image", "light.diffuse");
    expect_text("graph.0.edges.6.port", "diffuse");
    assert_true(json_is_false(at("graph.0.edges.6.history")));
    expect_text("graph.0.edges.11.port", "history");
    expect_text("graph.0.edges.11.from", "aa");
    assert_true(json_is_true(at("graph.0.edges.11.history")));
    expect_number("cost.factor", 1.5);
    expect_number("cost.sum", 2);
    assert_true(json_is_true(at("cost.measured")));
    expect_number("cost.frames", FAKE_FRAMES);
    expect_number("cost.seconds", 1.25);
    expect_number("cost.variants", 5);
    /* A node of replicates alone is not drawn. */
    for (int i = 0; i < 3; i++)
        e->used[2][i] = false;
    e->used[2][4] = true;
    write_and_read();
    assert_int_equal(json_array_size(at("graph.0.nodes")), 3);
    assert_int_equal(json_array_size(at("graph.0.edges")), 3 + 3 + 4);
}

static void test_thresholds_and_failures(void **state)
{
    (void)state;
    rl_ab_offender over[] = {{0, 5, FAKE_SKIN, 1, -1, NULL, 0.084}, {1, 2, RL_AB_WHOLE, -1, 2, "sss", 0.02}};
    rl_ab_verdict verdicts[] = {{{RL_METRIC_FLIP, RL_STAT_P95, 0.05}, over, 1, 10},
                                {{RL_THRESHOLD_ENERGY, RL_STAT_MEAN, 0.01}, over + 1, 1, 10},
                                {{RL_METRIC_SSIM, RL_STAT_MEAN, 0.9}, NULL, 0, 10}};
    rl_ab_failure failures[] = {{1, 7, "broken"}};
    v.report.verdicts = verdicts;
    v.report.n_verdicts = 3;
    v.report.failures = failures;
    v.report.n_failures = 1;
    write_and_read();
    expect_text("thresholds.0.what", "flip.p95");
    expect_number("thresholds.0.limit", 0.05);
    expect_number("thresholds.0.over.0.capture", 0);
    expect_number("thresholds.0.over.0.pair", 1);
    expect_number("thresholds.0.over.0.frame", 5);
    expect_text("thresholds.0.over.0.material", "skin");
    expect_number("thresholds.0.over.0.value", 0.084);
    expect_text("thresholds.1.what", "energy");
    expect_null("thresholds.1.over.0.pair");
    expect_number("thresholds.1.over.0.variant", 2);
    expect_text("thresholds.1.over.0.node", "sss");
    expect_null("thresholds.1.over.0.material");
    assert_int_equal(json_array_size(at("thresholds.2.over")), 0);
    expect_number("failed.0.capture", 1);
    expect_number("failed.0.frame", 7);
    expect_text("failed.0.text", "broken");
}

static void test_memory(void **state)
{
    (void)state;
    ab_values_add(&v, 0, 0, 0, RL_AB_WHOLE, 0.1, 0.25);
    ab_values_starve(&v, rl_ab_json);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_what_was_compared, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_metrics, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_graph, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_thresholds_and_failures, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_memory, set_up, tear_down),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
