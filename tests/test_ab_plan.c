/* What `relit ab` compares: variants, pairs, what differs between them, other seeds. Reads pipelines as
 * values: no capture is there. */
#include "tests/config_help.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/tool/ab.h"
#include "tests/tool_run.h"

static const char first[] =
    "relit: 1\n"
    "include: [common.yaml]\n"
    "lights: {key: {type: point, position: [0, 0, 1], intensity: [1, 1, 1]}}\n"
    "graph:\n"
    "  light: {pass: lighting}\n"
    "  sss: {pass: sss_burley, in: {diffuse: light.diffuse, lit: light.lit}, taps: 21}\n"
    "  aa: {pass: taa, in: {color: sss.color}}\n"
    "outputs: {beauty: {image: aa.color, file: \"{frame}.exr\"}}\n";
static const char second[] = "relit: 1\n"
                             "include: [common.yaml]\n"
                             "shading: {specular: none}\n"
                             "lights: {key: {type: point, position: [0, 0, 1], intensity: [1, 1, 1]}}\n"
                             "graph:\n"
                             "  light: {pass: lighting}\n"
                             "  sss: {pass: combine, in: {diffuse: light.diffuse, lit: light.lit}}\n"
                             "outputs: {beauty: {image: sss.color, file: \"{frame}.exr\"}}\n";
static const char common[] = "relit: 1\n"
                             "profiles: {skin: {scatter_distance_mm: [3, 1.2, 0.7], texturing: post}}\n"
                             "materials: {skin: {profile: skin}, default: {}}\n";

static char *folder;
static char *files[2];
static rl_ab_plan plan;

static int setup(void **state)
{
    config_setup(state);
    folder = folder_new();
    file_write(folder, "a.yaml", first, strlen(first));
    file_write(folder, "b.yaml", second, strlen(second));
    file_write(folder, "common.yaml", common, strlen(common));
    files[0] = path_in(folder, "a.yaml");
    files[1] = path_in(folder, "b.yaml");
    return 0;
}

static int teardown(void **state)
{
    free(files[0]);
    free(files[1]);
    folder_remove(folder);
    return config_teardown(state);
}

/* A command line: vary ends with NULL. */
typedef struct command {
    size_t pipelines; /* 1 or 2 */
    const char *vary[5], *set[2][2], *against;
    bool pairs;
    int seeds;
} command;

static rl_code make(command c)
{
    static rl_setting settings[2];
    rl_arguments args = {.operands = (const char *const *)files,
                         .n_operands = c.pipelines,
                         .operand = files[0],
                         .vary = c.vary,
                         .against = c.against,
                         .pairs = c.pairs,
                         .seeds = c.seeds};
    while (args.n_vary < 5 && c.vary[args.n_vary])
        args.n_vary++;
    for (size_t i = 0; i < 2 && c.set[i][0]; i++)
        settings[args.run.n_settings++] = (rl_setting){c.set[i][0], c.set[i][1]};
    args.run.settings = settings;
    return rl_ab_plan_make(&config_arena, &args, &config_log, &plan, &config_error);
}

static void expect_pairs(const int (*pairs)[2], size_t n)
{
    assert_int_equal(plan.n_pairs, n);
    for (size_t i = 0; i < n; i++) {
        assert_int_equal(plan.pairs[i].reference, pairs[i][0]);
        assert_int_equal(plan.pairs[i].test, pairs[i][1]);
    }
}

#define PAIRS(...)                                                                                           \
    expect_pairs((const int[][2]){__VA_ARGS__}, sizeof((int[][2]){__VA_ARGS__}) / sizeof(int[2]))

static void expect_parameter(size_t i, const char *path, const char *const *values)
{
    assert_true(i < plan.n_parameters);
    assert_string_equal(plan.parameters[i].path, path);
    for (size_t v = 0; v < plan.n_listed; v++) {
        const char *found = plan.parameters[i].values[v];
        if (!values[v])
            assert_null(found);
        else
            assert_string_equal(found ? found : "nothing", values[v]);
    }
}

#define PARAMETER(i, path, ...) expect_parameter(i, path, (const char *const[]){__VA_ARGS__})

/* ------------------------------------------------------------------------------------------------------- */

static void test_one_vary(void **state)
{
    (void)state;
    config_assert_fine(
        make((command){.pipelines = 1, .vary = {"profiles.skin.texturing=post,pre_post"}, .seeds = 1}));
    assert_int_equal(plan.n_variants, 2);
    assert_int_equal(plan.n_listed, 2);
    assert_string_equal(plan.variants[0].name, "post");
    assert_string_equal(plan.variants[1].pipeline, files[0]);
    assert_true(plan.variants[1].files);
    assert_int_equal(plan.variants[1].n_settings, 1);
    assert_string_equal(plan.variants[1].settings[0].value, "pre_post");
    PAIRS({0, 1});
    assert_int_equal(plan.n_parameters, 1);
    PARAMETER(0, "profiles.skin.texturing", "post", "pre_post");
    assert_null(plan.against);
}

static void test_grid(void **state)
{
    (void)state;
    command c = {.pipelines = 1,
                 .vary = {"profiles.skin.texturing=post,pre_post", "graph.sss.taps=8,16,auto"},
                 .seeds = 1};
    config_assert_fine(make(c));
    assert_int_equal(plan.n_listed, 6);
    PAIRS({0, 1}, {0, 2}, {0, 3}, {0, 4}, {0, 5});
    PARAMETER(0, "profiles.skin.texturing", "post", "post", "post", "pre_post", "pre_post", "pre_post");
    PARAMETER(1, "graph.sss.taps", "8", "16", "auto", "8", "16", "auto");
    c.pairs = true; /* a step on one axis: 3 + 4 of them */
    config_assert_fine(make(c));
    PAIRS({0, 1}, {1, 2}, {0, 3}, {1, 4}, {3, 4}, {2, 5}, {4, 5});
    c.pairs = false;
    c.against = "reference.exr";
    config_assert_fine(make(c));
    PAIRS({-1, 0}, {-1, 1}, {-1, 2}, {-1, 3}, {-1, 4}, {-1, 5});
    assert_string_equal(plan.against, "reference.exr");
    c.pairs = true;
    assert_int_equal(make(c), RL_E_USAGE);
    config_assert_error("relit ab: error: --pairs compares variants with each other, --against with a "
                        "reference: choose one");
    config_assert_fine(make(
        (command){.pipelines = 1, .vary = {"graph.sss.taps=8"}, .seeds = 1})); /* nothing to compare with */
    assert_int_equal(plan.n_listed, 1);
    assert_int_equal(plan.n_pairs, 0);
}

/* Pipelines that differ anywhere: what one has and the other lacks is a difference too. */
static void test_pipelines(void **state)
{
    (void)state;
    config_assert_fine(make((command){.pipelines = 2, .vary = {NULL}, .seeds = 1}));
    assert_int_equal(plan.n_listed, 2);
    assert_string_equal(plan.variants[0].name, "a");
    assert_string_equal(plan.variants[1].name, "b");
    PAIRS({0, 1});
    assert_int_equal(plan.n_parameters, 6);
    PARAMETER(0, "graph.sss.pass", "sss_burley", "combine");
    PARAMETER(1, "graph.sss.taps", "21", NULL);
    PARAMETER(2, "graph.aa.pass", "taa", NULL);
    PARAMETER(3, "graph.aa.in.color", "sss.color", NULL);
    PARAMETER(4, "outputs.beauty.image", "aa.color", "sss.color");
    PARAMETER(5, "shading.specular", NULL, "none");
    /* With a value that both have: each of both. --set is for all, and is no difference. */
    command c = {
        2, {"profiles.skin.texturing=post,pre_post"}, {{"materials.skin.roughness", "0.3"}}, .seeds = 1};
    config_assert_fine(make(c));
    assert_int_equal(plan.n_listed, 4);
    assert_string_equal(plan.variants[3].name, "b_pre_post");
    assert_int_equal(plan.n_parameters, 7);
    PARAMETER(0, "profiles.skin.texturing", "post", "pre_post", "post", "pre_post");
    /* A value of one's own that the other pipeline does not know. */
    assert_int_equal(make((command){.pipelines = 2, .vary = {"graph.aa.blend=0.1,0.2"}, .seeds = 1}),
                     RL_E_CONFIG);
    char expected[512];
    snprintf(
        expected, sizeof expected,
        "--vary graph.aa.blend=0.1,0.2:1:7: error: %s has no pass in its graph called 'aa'; known: light, "
        "sss",
        files[1]);
    config_assert_error(expected);
}

/* Another pass: taps are gone with it, and are a difference. */
static void test_pass(void **state)
{
    (void)state;
    config_assert_fine(
        make((command){.pipelines = 1, .vary = {"graph.sss.pass=sss_burley,combine"}, .seeds = 1}));
    PARAMETER(0, "graph.sss.pass", "sss_burley", "combine");
    PARAMETER(1, "graph.sss.taps", "21", NULL);
    assert_int_equal(plan.variants[1].n_settings, 2);
    assert_string_equal(plan.variants[1].settings[1].path, "graph.sss.taps");
    assert_string_equal(plan.variants[1].settings[1].value, "null");
    assert_non_null(strstr(config_logged, "variant 'combine': pass 'sss' is combine, which has no taps"));
}

/* ---- seeds --------------------------------------------------------------------------------------------- */

static const char *seed_of(size_t variant, const char *path)
{
    const char *value = NULL;
    for (size_t i = 0; i < plan.variants[variant].n_settings; i++)
        if (!strcmp(plan.variants[variant].settings[i].path, path))
            value = plan.variants[variant].settings[i].value;
    return value;
}

static void test_seeds(void **state)
{
    (void)state;
    command c = {.pipelines = 1, .vary = {"graph.sss.taps=8,16"}};
    config_assert_fine(make(c)); /* three unless said otherwise */
    assert_int_equal(plan.n_listed, 2);
    assert_int_equal(plan.n_variants, 4);
    assert_int_equal(plan.seeds, 3);
    assert_true(plan.stochastic);
    for (size_t i = 2; i < 4; i++) {
        assert_false(plan.variants[i].files);
        assert_string_equal(plan.variants[i].settings[0].value, "8"); /* the first variant otherwise */
        assert_int_equal(plan.variants[i].n_settings, 2);             /* lights are not marched */
        assert_non_null(seed_of(i, "graph.sss.seed"));
    }
    assert_string_not_equal(seed_of(2, "graph.sss.seed"), seed_of(3, "graph.sss.seed"));
    assert_string_not_equal(seed_of(2, "graph.sss.seed"), "0"); /* the first one's own */
    assert_string_equal(plan.variants[2].name, "taps_8.seed2");
    c.seeds = 1;
    config_assert_fine(make(c));
    assert_int_equal(plan.n_variants, 2);
    assert_true(plan.stochastic); /* all the same */
    assert_int_equal(plan.seeds, 1);
    c.seeds = 5;
    c.set[0][0] = "graph.sss.seed"; /* near the end of its range: goes round */
    c.set[0][1] = "2147483640";
    config_assert_fine(make(c));
    assert_int_equal(plan.n_variants, 6);
    for (size_t i = 2; i < 6; i++)
        for (size_t k = 2; k < i; k++)
            assert_string_not_equal(seed_of(i, "graph.sss.seed"), seed_of(k, "graph.sss.seed"));
    assert_string_equal(seed_of(2, "graph.sss.seed"), "104721");
}

/* Nothing that chance has a part in: no other seeds. A light whose shadow is marched makes one of lighting.
 */
static void test_no_seeds(void **state)
{
    (void)state;
    command c = {.pipelines = 1, .vary = {"graph.sss.taps=8,16"}, .set = {{"graph.sss.rotation", "none"}}};
    config_assert_fine(make(c));
    assert_false(plan.stochastic);
    assert_int_equal(plan.n_variants, 2);
    assert_int_equal(plan.seeds, 1);
    c.set[1][0] = "lights.key.shadow";
    c.set[1][1] = "screen";
    config_assert_fine(make(c));
    assert_true(plan.stochastic);
    assert_int_equal(plan.n_variants, 4);
    assert_non_null(seed_of(2, "graph.light.seed"));
    assert_null(seed_of(2, "graph.sss.seed"));
    c.set[0][0] = "graph.light.shadow_jitter";
    c.set[0][1] = "false";
    c.vary[0] = "graph.sss.pass=combine,sss_burley";
    config_assert_fine(make(c));
    assert_false(plan.stochastic);
}

/* The capture's own lights, when the pipeline has none. */
static void test_lights_of_the_capture(void **state)
{
    (void)state;
    static const char manifest[] = "relit_capture: 1\nlights: {key: {type: point, shadow: screen}}\n";
    file_write(folder, "capture.yaml", manifest, strlen(manifest));
    command c = {.pipelines = 1,
                 .vary = {"graph.sss.taps=8,16"},
                 .set = {{"lights", "null"}, {"capture", "{lights: {a: {shadow: none}}}"}}};
    config_assert_fine(make(c));
    assert_null(seed_of(2, "graph.light.seed"));
    c.set[1][1] = "{lights: {a: {shadow: screen}}}";
    config_assert_fine(make(c));
    assert_non_null(seed_of(2, "graph.light.seed"));
    c.set[1][1] = folder;
    config_assert_fine(make(c));
    assert_non_null(seed_of(2, "graph.light.seed"));
}

/* A seed of a user's own kernel has the range that it says. */
static void test_small_range(void **state)
{
    (void)state;
    static const char kernel[] =
        "kernel void k(global const float *color, global float *out, constant params_t *p, "
        "constant frame_t *f, constant material_t *m) {}\n";
    file_write(folder, "k.cl", kernel, strlen(kernel));
    char *path = path_in(folder, "k.cl"), node[800];
    snprintf(node, sizeof node,
             "{pass: kernel, file: %s, entry: k, ports: {color: {role: read, type: rgb}, out: {role: write, "
             "type: rgb}}, params: {seed: {type: int, value: 4, range: [3, 5]}}, in: {color: sss.color}}",
             path);
    command c = {.pipelines = 1,
                 .vary = {"graph.sss.taps=8,16"},
                 .set = {{"graph.k", node}, {"graph.sss.rotation", "none"}}};
    config_assert_fine(make(c));
    assert_string_equal(seed_of(2, "graph.k.seed"), "5");
    assert_string_equal(seed_of(3, "graph.k.seed"), "3");
    c.seeds = 4;
    assert_int_equal(make(c), RL_E_USAGE);
    assert_non_null(strstr(config_error.text, "pass 'k' takes 3 values of 'seed' only: too few for 4 runs"));
    config_error = (rl_error){0};
    free(path);
}

/* Every allocation fails once. */
static void test_memory(void **state)
{
    (void)state;
    const rl_arena kept = config_arena;
    bool done = false;
    for (unsigned long nth = 1; !done && nth < 20000; nth += 1 + nth / 40) {
        config_arena = (rl_arena){0};
        rl_alloc_fail_at(nth, 0);
        rl_code code = make((command){.pipelines = 2, .vary = {"profiles.skin.texturing=post,pre_post"}});
        done = rl_alloc_fail_at(0, 0) > 0;
        assert_true(done ? code == RL_OK : code != RL_OK && config_error.code == code);
        config_error = (rl_error){0};
        rl_arena_free(&config_arena);
    }
    assert_true(done);
    config_arena = kept;
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, setup, teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(test_one_vary),
        TEST(test_grid),
        TEST(test_pipelines),
        TEST(test_pass),
        TEST(test_seeds),
        TEST(test_no_seeds),
        TEST(test_lights_of_the_capture),
        TEST(test_small_range),
        TEST(test_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
