/* The plain sentences, the table, and what --fail-over prints. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "graph/tool/ab_table.h"
#include "graph/tool/ab_words.h"
#include "tests/ab_values.h"

static rl_experiment *e;
static ab_values v;

static int set_up(void **state)
{
    (void)state;
    e = fake_experiment_new(1);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    fake_experiment_free(e);
    return 0;
}

static void expect_words(const char *want)
{
    rl_str text = {0};
    rl_error err = {0};
    assert_int_equal(rl_ab_words(&v.report, &text, &err), RL_OK);
    assert_string_equal(rl_str_text(&text), want);
    rl_str_free(&text);
}

/* ---- sentences ----------------------------------------------------------------------------------------- */

static void add_two_frames(size_t pair, double scale)
{
    ab_values_add(&v, 0, pair, 0, RL_AB_WHOLE, 0.004 * scale, 0.01 * scale);
    ab_values_add(&v, 0, pair, 0, FAKE_SKIN, 0.02 * scale, 0.05 * scale);
    ab_values_add(&v, 0, pair, 0, FAKE_PLASTER, 0, 0);
    ab_values_add(&v, 0, pair, 2, RL_AB_WHOLE, 0.005 * scale, 0.012 * scale);
    ab_values_add(&v, 0, pair, 2, FAKE_SKIN, 0.03 * scale, 0.084 * scale);
    ab_values_add(&v, 0, pair, 2, FAKE_PLASTER, 0, 0);
}

static void test_one_pair(void **state)
{
    (void)state;
    ab_values_make(&v, e, 2, 2);
    add_two_frames(0, 1);
    expect_words("pre_post differs most from post on skin: FLIP p95 0.084 in frame 5 (whole image 0.012); "
                 "plaster is identical.");
    v.p.plan.stochastic = true;
    expect_words("pre_post differs most from post on skin: FLIP p95 0.084 in frame 5 (whole image 0.012); "
                 "plaster is identical. Some passes draw random numbers, and one seed cannot tell a "
                 "difference from noise (--seeds).");
    v.report.n_failures = 2;
    v.p.plan.stochastic = false;
    expect_words("pre_post differs most from post on skin: FLIP p95 0.084 in frame 5 (whole image 0.012); "
                 "plaster is identical. 2 frames failed and are not counted.");
}

/* FLIP reaches over a material's border; its pixels are the same all the same. */
static void test_beside(void **state)
{
    (void)state;
    ab_values_make(&v, e, 2, 2);
    add_two_frames(0, 1);
    for (size_t i = 0; i < v.results.n_values; i++)
        if (v.values[i].material == FAKE_PLASTER && v.values[i].metric <= RL_METRIC_HDRFLIP)
            v.values[i].stats[RL_STAT_MEAN] = v.values[i].stats[RL_STAT_MAX] = 1e-3;
    expect_words("pre_post differs most from post on skin: FLIP p95 0.084 in frame 5 (whole image 0.012); "
                 "plaster is identical.");
    /* One pixel, linear: it is not. */
    for (size_t i = 0; i < v.results.n_values; i++)
        if (v.values[i].material == FAKE_PLASTER && v.values[i].metric == RL_METRIC_MAX)
            v.values[i].stats[RL_STAT_MAX] = 1e-9;
    expect_words("pre_post differs most from post on skin: FLIP p95 0.084 in frame 5 (whole image 0.012).");
}

static void test_identical(void **state)
{
    (void)state;
    ab_values_make(&v, e, 2, 2);
    expect_words("No frame was compared.");
    ab_values_add(&v, 0, 0, 0, RL_AB_WHOLE, 0, 0);
    ab_values_add(&v, 0, 0, 0, FAKE_SKIN, 0, 0);
    expect_words("pre_post is bit-identical to post in all 3 frames.");
    v.report.frames = 1;
    expect_words("pre_post is bit-identical to post.");
    v.p.plan.against = "truth.exr";
    v.p.pairs[0].reference = RL_AB_AGAINST;
    expect_words("pre_post is identical to truth.exr.");
    v.p.plan.n_pairs = 0;
    v.results.n_values = 0;
    expect_words("There is one variant: nothing to compare.");
}

static void test_many(void **state)
{
    (void)state;
    ab_values_make(&v, e, 5, 5);
    add_two_frames(0, 0.5);
    add_two_frames(1, 1);
    for (size_t pair = 2; pair < 4; pair++)
        ab_values_add(&v, 0, pair, 0, RL_AB_WHOLE, 0, 0);
    expect_words("third differs most from post on skin: FLIP p95 0.084 in frame 5 (whole image 0.012); "
                 "plaster is identical. Then pre_post (FLIP p95 0.042 on skin). fourth and fifth are "
                 "bit-identical in all 3 frames.");
    /* Neighbours, and more than a sentence lists. */
    ab_values_make(&v, e, 6, 6);
    for (size_t pair = 0; pair < 5; pair++) {
        v.p.pairs[pair].reference = (int)pair;
        add_two_frames(pair, 0.2 + 0.1 * (double)pair);
    }
    expect_words(
        "sixth differs most from fifth on skin: FLIP p95 0.050 in frame 5 (whole image 0.007); "
        "plaster is identical. Then fifth against fourth (FLIP p95 0.042 on skin), fourth against "
        "third (FLIP p95 0.034 on skin), and 2 more down to pre_post against post (FLIP p95 0.017).");
    ab_values_make(&v, e, 6, 6);
    for (size_t pair = 0; pair < 5; pair++)
        ab_values_add(&v, 0, pair, 0, RL_AB_WHOLE, 0, 0);
    expect_words("All 5 comparisons are bit-identical in all 3 frames.");
    ab_values_make(&v, e, 3, 3);
    v.p.pairs[1].reference = 1;
    for (size_t pair = 0; pair < 2; pair++)
        ab_values_add(&v, 0, pair, 0, RL_AB_WHOLE, 0, 0);
    expect_words("pre_post against post and third against pre_post are bit-identical in all 3 frames.");
}

static void test_chance(void **state)
{
    (void)state;
    ab_values_make(&v, e, 4, 2);
    add_two_frames(0, 1);
    ab_values_null(&v, 0, FAKE_SKIN, 0.003);
    expect_words("pre_post differs most from post on skin: FLIP p95 0.084 in frame 5 (whole image 0.012); "
                 "plaster is identical; beyond chance (mean 0.030, with other seeds up to 0.003).");
    v.nulls[0].bounds[RL_STAT_MEAN] = 0.04;
    expect_words("pre_post differs most from post on skin: FLIP p95 0.084 in frame 5 (whole image 0.012); "
                 "plaster is identical; within chance (mean 0.030, with other seeds up to 0.040). No "
                 "difference is larger than what other seeds make (3 seeds).");
    /* Another value is beyond: the sentence about all of them is not true. */
    ab_values_null(&v, 0, RL_AB_WHOLE, 0.0001);
    expect_words("pre_post differs most from post on skin: FLIP p95 0.084 in frame 5 (whole image 0.012); "
                 "plaster is identical; within chance (mean 0.030, with other seeds up to 0.040).");
}

/* Differences that FLIP's percentile, or the display, does not show. */
static void test_subtle(void **state)
{
    (void)state;
    ab_values_make(&v, e, 2, 2);
    ab_values_add(&v, 0, 0, 1, RL_AB_WHOLE, 0.0001, 0);
    ab_values_add(&v, 0, 0, 1, FAKE_SKIN, 0.0002, 0);
    v.values[0].stats[RL_STAT_MAX] = v.values[6].stats[RL_STAT_MAX] = 0.31;
    expect_words(
        "pre_post differs most from post on skin: FLIP of single pixels up to 0.310 in frame 2 (whole "
        "image 0.310).");
    v.values[0].stats[RL_STAT_MAX] = v.values[6].stats[RL_STAT_MAX] = 0; /* flip */
    v.values[1].stats[RL_STAT_MAX] = v.values[7].stats[RL_STAT_MAX] = 0; /* hdrflip */
    v.values[11].stats[RL_STAT_P95] = 2e-5;                              /* max, of skin */
    v.values[11].stats[RL_STAT_MAX] = 4e-5;
    expect_words(
        "pre_post differs most from post on skin: linear difference p95 2e-05 in frame 2 (whole image "
        "0.000); nothing of it shows on the display.");
}

/* ---- the table ----------------------------------------------------------------------------------------- */

static void test_table(void **state)
{
    (void)state;
    static const char want[] =
        "pre_post against post\n"
        "                     FLIP       p95  HDR-FLIP       p95   PSNR dB      SSIM      RMSE       max\n"
        "  all              0.0045    0.0110    0.0090    0.0220     40.00   0.90000    0.0023    0.0120\n"
        "    frame 5        0.0050    0.0120    0.0100    0.0240     40.00   0.90000    0.0025    0.0120\n"
        "  skin             0.0250*   0.0670    0.0500    0.1340     40.00   0.90000    0.0127    0.0840\n"
        "    frame 5        0.0300*   0.0840    0.0600    0.1680     40.00   0.90000    0.0150    0.0840\n"
        "  plaster          0.0000    0.0000    0.0000    0.0000     equal   1.00000    0.0000    0.0000\n"
        "    frame 1        0.0000    0.0000    0.0000    0.0000     equal   1.00000    0.0000    0.0000\n"
        "\n"
        "Mean over the frames, then the worst frame. Pixels without material are left out. FLIP and SSIM "
        "look\n"
        "around a pixel: what is beside a material shows in its numbers.\n"
        "* beyond chance: more than 2 other seeds make. Without a cause, a material and metric gets a * in "
        "at\n"
        "  most 1 of 3 runs.\n";
    rl_str text = {0};
    ab_values_make(&v, e, 4, 2);
    add_two_frames(0, 1);
    ab_values_null(&v, 0, FAKE_SKIN, 0.003);
    v.p.plan.stochastic = true;
    rl_ab_table(&v.report, &text);
    assert_string_equal(rl_str_text(&text), want);
    rl_str_free(&text);
    v.p.plan.stochastic = false;
    v.results.n_nulls = 0;
    rl_ab_table(&v.report, &text);
    assert_non_null(strstr(rl_str_text(&text), "\nNo pass draws random numbers: every difference"));
    assert_null(strchr(rl_str_text(&text), '*'));
    rl_str_free(&text);
}

/* ---- thresholds ---------------------------------------------------------------------------------------- */

static rl_ab_verdict *check(rl_arena *arena, const char *spec, rl_error *err)
{
    rl_threshold t;
    rl_ab_verdict *verdicts = NULL;
    assert_int_equal(rl_threshold_parse(arena, "relit ab", spec, true, &t, err), RL_OK);
    if (!rl_ab_fail_check(arena, &v.report, &t, 1, &verdicts, err)) {
        v.report.verdicts = verdicts;
        v.report.n_verdicts = 1;
    }
    return verdicts;
}

static void expect_failures(const char *spec, const char *want)
{
    rl_arena arena = {0};
    rl_error err = {0};
    rl_str text = {0};
    check(&arena, spec, &err);
    assert_string_equal(err.text, "");
    assert_int_equal(rl_ab_fail_count(&v.report), *want ? 1 : 0);
    rl_ab_fail_print(&v.report, &text);
    assert_string_equal(rl_str_text(&text), want);
    rl_str_free(&text);
    rl_arena_free(&arena);
}

static void test_thresholds(void **state)
{
    (void)state;
    ab_values_make(&v, e, 2, 2);
    add_two_frames(0, 1);
    expect_failures("flip.p95=0.05", "flip.p95 is over 0.05 in 1 place:\n"
                                     "  pre_post against post, skin, frame 5: 0.084\n");
    expect_failures("flip.p95=0.0840001", "");
    expect_failures("0.01", "flip.mean is over 0.01 in 2 places:\n"
                            "  pre_post against post, skin, frame 5: 0.03\n"
                            "  pre_post against post, skin, frame 1: 0.02\n");
    expect_failures("flip.p95=0.01", "flip.p95 is over 0.01 in 3 places:\n"
                                     "  pre_post against post, skin, frame 5: 0.084\n"
                                     "  pre_post against post, skin, frame 1: 0.05\n"
                                     "  pre_post against post, all materials, frame 5: 0.012\n");
    /* psnr and ssim fail below. All of 4 are equal: in the order of the values. */
    expect_failures("psnr=41", "psnr.mean is under 41 in 4 places:\n"
                               "  pre_post against post, all materials, frame 1: 40\n"
                               "  pre_post against post, skin, frame 1: 40\n"
                               "  pre_post against post, all materials, frame 5: 40\n"
                               "  pre_post against post, skin, frame 5: 40\n");
    expect_failures("psnr=40", "");
    ab_values_add(&v, 0, 0, 1, RL_AB_WHOLE, 0.5, 0.7);
    ab_values_add(&v, 0, 0, 1, FAKE_DOT, 0.4, 0.6);
    expect_failures("max.max=0.001", "max.max is over 0.001 in 6 places:\n"
                                     "  pre_post against post, all materials, frame 2: 0.7\n"
                                     "  pre_post against post, dot, frame 2: 0.6\n"
                                     "  pre_post against post, skin, frame 5: 0.084\n"
                                     "  pre_post against post, skin, frame 1: 0.05\n"
                                     "  pre_post against post, all materials, frame 5: 0.012\n"
                                     "  and 1 more\n");
}

static void test_thresholds_that_check_nothing(void **state)
{
    (void)state;
    rl_arena arena = {0};
    rl_error err = {0};
    ab_values_make(&v, e, 2, 2);
    check(&arena, "ssim=0.9", &err);
    assert_int_equal(err.code, RL_E_DATA);
    assert_non_null(strstr(err.text, "there is no ssim.mean to check: no frame was compared"));
    err = (rl_error){0};
    check(&arena, "energy=0.01", &err); /* there is no ledger */
    assert_int_equal(err.code, RL_E_DATA);
    rl_threshold t;
    static const struct {
        const char *text, *says;
    } bad[] = {{"flipp=1", "did you mean 'flip'"},
               {"flip.p99=1", "there is no statistic 'p99'"},
               {"psnr.p95=1", "psnr has a mean"},
               {"flip=", "takes [METRIC.STAT=]X"},
               {"flip=nan", "takes"},
               {"energy=0.1", "there is no metric 'energy'"}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        err = (rl_error){0};
        assert_int_equal(rl_threshold_parse(&arena, "relit diff", bad[i].text, false, &t, &err), RL_E_USAGE);
        assert_non_null(strstr(err.text, bad[i].says));
    }
    assert_true(rl_threshold_is_over(RL_METRIC_FLIP, 1, (double)NAN));
    assert_true(rl_threshold_is_over(RL_METRIC_SSIM, 0, (double)NAN));
    rl_arena_free(&arena);
}

static void test_memory(void **state)
{
    (void)state;
    ab_values_make(&v, e, 3, 2);
    add_two_frames(0, 1);
    ab_values_starve(&v, rl_ab_words);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_one_pair, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_beside, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_identical, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_many, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_chance, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_subtle, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_table, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_thresholds, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_thresholds_that_check_nothing, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_memory, set_up, tear_down),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
