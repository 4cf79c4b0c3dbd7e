/* --vary: parsing, the grid and its names, what a variant's pipeline becomes. */
#include "tests/config_help.h"

#include <stdio.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/base/text.h"
#include "graph/model/vary.h"

#define N(array) (sizeof(array) / sizeof *(array))

static const char pipeline[] =
    "relit: 1\n"
    "profiles: {skin: {scatter_distance_mm: [3, 1.2, 0.7], texturing: post}}\n"
    "graph:\n"
    "  light: {pass: lighting}\n"
    "  sss: {pass: sss_burley, in: {diffuse: light.diffuse, lit: light.lit}, "
    "taps: 21, weighting: plain, colour: red}\n"
    "  vig: {pass: kernel, file: v.cl, entry: v, ports: {color: {role: read, type: "
    "rgb}, out: {role: write, type: rgb}}, params: {gain: {type: float}}, gain: 2, "
    "in: {color: sss.color}}\n"
    "outputs: {beauty: {image: sss.color, file: a.exr}}\n";

static rl_vary vary(const char *text)
{
    rl_vary v;
    config_assert_fine(rl_vary_parse(&config_arena, text, &v, &config_error));
    return v;
}

/* ---- one option ---------------------------------------------------------------------------------------- */

static void expect_values(const char *text, const char *path, const char *const *texts, size_t n)
{
    rl_vary v = vary(text);
    assert_string_equal(v.path, path);
    assert_int_equal(v.n, n);
    for (size_t i = 0; i < n; i++)
        assert_string_equal(v.texts[i], texts[i]);
}

static void test_values(void **state)
{
    (void)state;
    expect_values("graph.sss.taps=8,16,auto", "graph.sss.taps", (const char *const[]){"8", "16", "auto"}, 3);
    expect_values("a.b=[3,1.2,.7],[6, 5,3]", "a.b", (const char *const[]){"[3, 1.2, 0.7]", "[6, 5, 3]"}, 2);
    expect_values("a=null,true,\"x, y\",'=',0x10", "a",
                  (const char *const[]){"null", "true", "\"x, y\"", "\"=\"", "16"}, 5);
    expect_values("a={k: 1},{k: 2}", "a", (const char *const[]){"{k: 1}", "{k: 2}"}, 2);
    expect_values("a= 1 ,", "a", (const char *const[]){"1"}, 1);
    rl_vary v = vary("a.bc=7,xy"); /* columns are those of the option's text */
    assert_int_equal(v.values[1]->where.column, 8);
    assert_string_equal(v.values[1]->where.file, "--vary a.bc=7,xy");
}

static void refuse(const char *text, const char *expected)
{
    rl_vary v;
    assert_int_equal(rl_vary_parse(&config_arena, text, &v, &config_error), RL_E_USAGE);
    config_assert_error(expected);
}

static void test_bad_values(void **state)
{
    (void)state;
#define LIST "behind '=' the inside of a YAML list is expected, such as 8,16 or [3, 1.2, 0.7],[6, 5, 3]: "
    refuse("taps",
           "--vary taps: error: option '--vary' takes PATH=V1,V2,…, such as graph.sss.taps=8,16, found "
           "'taps'");
    refuse("=8,16", "--vary =8,16: error: option '--vary' takes PATH=V1,V2,…, such as graph.sss.taps=8,16, "
                    "found '=8,16'");
    refuse("taps=", "--vary taps=:1:5: error: there is no value behind 'taps='");
    refuse("taps=8,16,8",
           "--vary taps=8,16,8:1:11: error: value 3 of 'taps' is 8 again, as value 1: each may "
           "be there once");
    refuse("taps=1.0,1.00",
           "--vary taps=1.0,1.00:1:10: error: value 2 of 'taps' is 1 again, as value 1: each "
           "may be there once");
    refuse("t=[1,2", "--vary t=[1,2:1:7: error: " LIST
                     "not YAML: while parsing a flow sequence: did not find expected ',' or ']'");
    refuse("t=1],[2", "--vary t=1],[2:1:5: error: " LIST "not YAML: did not find expected <document start>");
#undef LIST
}

/* ---- the grid ------------------------------------------------------------------------------------------ */

static const char *const one_file[] = {"configs/skin.yaml"};

static rl_grid grid_of(const char *const *files, size_t n_files, const rl_vary *varies, size_t n)
{
    rl_grid g = {.pipelines = files, .n_pipelines = n_files, .varies = varies, .n_varies = n};
    config_assert_fine(rl_grid_count(&g, &config_error));
    return g;
}

static void expect_names(const rl_grid *g, const char *const *expected)
{
    static const char *const taken[] = {"report.html"};
    const char *const *names;
    config_assert_fine(rl_grid_names(&config_arena, g, taken, N(taken), &names, &config_error));
    for (size_t i = 0; i < g->n; i++)
        assert_string_equal(names[i], expected[i]);
}

/* The last --vary counts fastest, pipelines slowest. */
static void test_order(void **state)
{
    (void)state;
    static const char *const files[] = {"x/a.yaml", "y/b.yaml"};
    const rl_vary varies[] = {vary("profiles.skin.texturing=post,pre_post"), vary("graph.sss.taps=8,16,21")};
    rl_grid g = grid_of(files, 2, varies, 2);
    assert_int_equal(g.n, 12);
    expect_names(&g, (const char *const[]){"a_post_8", "a_post_16", "a_post_21", "a_pre_post_8",
                                           "a_pre_post_16", "a_pre_post_21", "b_post_8", "b_post_16",
                                           "b_post_21", "b_pre_post_8", "b_pre_post_16", "b_pre_post_21"});
    for (size_t i = 0; i < g.n; i++) {
        assert_int_equal(rl_grid_choice(&g, i, 0), i / 6);
        assert_int_equal(rl_grid_choice(&g, i, 1), i / 3 % 2);
        assert_int_equal(rl_grid_choice(&g, i, 2), i % 3);
    }
    size_t before;
    assert_false(rl_grid_before(&g, 3, 2, &before));
    assert_true(rl_grid_before(&g, 4, 2, &before) && before == 3);
    assert_true(rl_grid_before(&g, 4, 1, &before) && before == 1);
    assert_false(rl_grid_before(&g, 4, 0, &before));
    assert_true(rl_grid_before(&g, 10, 0, &before) && before == 4);
}

static void names_of(const char *option, const char *const *expected)
{
    rl_vary v = vary(option);
    rl_grid g = grid_of(one_file, 1, &v, 1);
    expect_names(&g, expected);
}

static void test_names(void **state)
{
    (void)state;
    names_of("p.texturing=post,pre_post", (const char *const[]){"post", "pre_post"});
    names_of("g.separable=true,false,null",
             (const char *const[]){"separable_true", "separable_false", "separable_null"});
    names_of("p.d=[3,1.2,.7],[6, 5, 3]", (const char *const[]){"d_3_1.2_0.7", "d_6_5_3"});
    names_of("g.file=kernels/a.cl,'../b c.cl',' ',\"/\"",
             (const char *const[]){"kernels_a.cl", "file_.._b_c.cl", "value3", "value4"});
    names_of("g.x=-1,.5,A,a", (const char *const[]){"x_-1", "x_0.5", "A", "a_2"});
    names_of("graph.sss.taps=8,auto", (const char *const[]){"taps_8", "auto"});
    names_of("p.gaussians.0.weight=1,2", (const char *const[]){"weight_1", "weight_2"});
    names_of("p.d_mm.0=1,2", (const char *const[]){"d_mm.0_1", "d_mm.0_2"});
    names_of("g.x=report.html,\"\xc3\xa4\"", (const char *const[]){"report.html_2", "\xc3\xa4"});
    names_of("g.x=abcdefghijklmnopqrstuvwxyz01234\xc3\xa4,abcdefghijklmnopqrstuvwxyz0123456789,"
             "abcdefghijklmnopqrstuvwxyz0123456789a",
             (const char *const[]){"abcdefghijklmnopqrstuvwxyz01234\xc3\xa4",
                                   "abcdefghijklmnopqrstuvwxyz012345", "abcdefghijklmnopqrstuvwxyz012345_2"});
    static const char *const same[] = {"a/skin.yaml", "b/skin.yaml", ".yaml"};
    rl_grid g = grid_of(same, 3, NULL, 0);
    expect_names(&g, (const char *const[]){"skin", "skin_2", "v.yaml"});
    g = grid_of(same, 1, NULL, 0);
    expect_names(&g, (const char *const[]){"skin"});
    const rl_vary varies[] = {vary("a=1,2"), vary("b=3")}; /* what all have is in no name */
    g = grid_of(one_file, 1, varies, 2);
    expect_names(&g, (const char *const[]){"a_1", "a_2"});
}

/* Whatever the values: a name that a folder may have, and another one for each. */
static void test_names_of_anything(void **state)
{
    (void)state;
    unsigned random = 1;
    for (int round = 0; round < 300; round++) {
        char text[64] = "p=";
        size_t n = 2;
        for (int value = 0; value < 5; value++) {
            n += (size_t)sprintf(text + n, "%s\"", value ? "," : "");
            for (int i = 0; i < 4; i++) {
                random = random * 1664525 + 1013904223;
                static const char letters[] = "aA./-_ :~\t%*?|<>[]{}&";
                text[n++] = letters[(random >> 16) % (sizeof letters - 1)];
            }
            n += (size_t)sprintf(text + n, "%d\"", value);
        }
        rl_vary v = vary(text);
        rl_grid g = grid_of(one_file, 1, &v, 1);
        const char *const *names;
        config_assert_fine(rl_grid_names(&config_arena, &g, NULL, 0, &names, &config_error));
        for (size_t i = 0; i < g.n; i++) {
            assert_true(names[i][0] && names[i][0] != '.' && names[i][0] != '-');
            assert_int_equal(strspn(names[i], "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"
                                              "._-"),
                             strlen(names[i]));
            for (size_t k = 0; k < i; k++)
                assert_string_not_equal(names[i], names[k]);
        }
    }
}

static void test_bad_grids(void **state)
{
    (void)state;
    const rl_vary twice[] = {vary("graph.sss.taps=8,16"), vary("graph.sss={pass: combine},{pass: kernel}")};
    rl_grid g = {.pipelines = one_file, .n_pipelines = 1, .varies = twice, .n_varies = 2};
    assert_int_equal(rl_grid_count(&g, &config_error), RL_E_USAGE);
    config_assert_error("--vary graph.sss={pass: combine},{pass: kernel}: error: 'graph.sss' is varied "
                        "already, by '--vary graph.sss.taps=8,16'");
    const rl_vary near[] = {vary("a.bc=8,16"), vary("a.b=1,2")}; /* no part of each other */
    grid_of(one_file, 1, near, 2);
    rl_vary many[9];
    static const char *const paths[] = {"a=1,2", "b=1,2", "c=1,2", "d=1,2", "e=1,2",
                                        "f=1,2", "g=1,2", "h=1,2", "i=1,2"};
    for (size_t i = 0; i < N(many); i++)
        many[i] = vary(paths[i]);
    g = (rl_grid){.pipelines = one_file, .n_pipelines = 1, .varies = many, .n_varies = 8};
    config_assert_fine(rl_grid_count(&g, &config_error));
    assert_int_equal(g.n, 256);
    g.n_varies = 9;
    assert_int_equal(rl_grid_count(&g, &config_error), RL_E_USAGE);
    config_assert_error("--vary: error: this makes 512 variants or more; the most is 256");
}

/* ---- what it makes of a pipeline ----------------------------------------------------------------------- */

/* Applies the last variant of a grid of one --vary or two; the tree, and its changes as text in `out`. */
static rl_value *apply(const char *first, const char *second, char *out, size_t size)
{
    rl_vary varies[2];
    size_t n_varies = second ? 2 : 1, n;
    const rl_change *changes;
    rl_value *root = config_parse(pipeline), *kept = root;
    rl_str before = {0}, after = {0};
    varies[0] = vary(first);
    if (second)
        varies[1] = vary(second);
    rl_grid g = grid_of(one_file, 1, varies, n_varies);
    rl_value_print(root, &before);
    rl_code code = rl_grid_apply(&config_arena, rl_registry_all(), &g, g.n - 1, "last", &root, &config_log,
                                 &changes, &n, &config_error);
    rl_value_print(kept, &after);
    assert_string_equal(rl_str_text(&before), rl_str_text(&after)); /* other variants start from it */
    rl_str_free(&before);
    rl_str_free(&after);
    out[0] = 0;
    for (size_t i = 0; !code && i < n; i++) {
        size_t used = strlen(out);
        snprintf(out + used, size - used, "%s%s=%s", i ? "; " : "", changes[i].path, changes[i].value);
    }
    return code ? NULL : root;
}

static void test_apply(void **state)
{
    (void)state;
    char text[400];
    rl_value *root = apply("graph.sss.taps=8,16", "profiles.skin.texturing=post,pre_post", text, sizeof text);
    assert_non_null(root);
    assert_string_equal(text, "graph.sss.taps=16; profiles.skin.texturing=pre_post");
    assert_int_equal(rl_value_at(root, "graph.sss.taps")->integer, 16);
    assert_string_equal(config_logged, "");
    root = apply("graph.sss.taps=8,null", NULL, text, sizeof text);
    assert_non_null(root);
    assert_null(rl_value_at(root, "graph.sss.taps"));
    assert_non_null(apply("materials.skin.roughness=0.2,0.5", NULL, text, sizeof text)); /* may be new */
}

/* Another pass: what it lacks goes, what nobody knows stays, for the error that names it. */
static void test_switch(void **state)
{
    (void)state;
    char text[400];
    rl_value *root = apply("graph.sss.pass=sss_burley,curvature", NULL, text, sizeof text);
    assert_non_null(root);
    assert_string_equal(text, "graph.sss.pass=curvature; graph.sss.taps=null; graph.sss.weighting=null; "
                              "graph.sss.in.diffuse=null; graph.sss.in.lit=null");
    assert_null(rl_value_at(root, "graph.sss.taps"));
    assert_non_null(rl_value_at(root, "graph.sss.colour"));
    assert_int_equal(rl_value_at(root, "graph.sss.in")->n, 0);
    assert_string_equal(config_logged,
                        "note (null):0:0 variant 'last': pass 'sss' is curvature, which has no taps, "
                        "weighting, input diffuse, input lit: left out");
    root = apply("graph.sss.pass=sss_burley,combine", "graph.sss.taps=8,16", text, sizeof text);
    assert_non_null(root); /* varied with it: the same */
    assert_null(rl_value_at(root, "graph.sss.taps"));
    assert_non_null(rl_value_at(root, "graph.sss.in.lit"));
    /* a parameter of the second pass alone, varied: gone with the first one */
    root =
        apply("graph.sss.pass=sss_gaussian,sss_burley", "graph.sss.separable=true,false", text, sizeof text);
    assert_non_null(root);
    assert_null(rl_value_at(root, "graph.sss.separable"));
    assert_int_equal(rl_value_at(root, "graph.sss.taps")->integer, 21);
}

/* From a kernel of the user's own: what declares it goes, its own parameters too. */
static void test_switch_from_kernel(void **state)
{
    (void)state;
    char text[400];
    rl_value *root = apply("graph.vig.pass=kernel,taa", NULL, text, sizeof text);
    assert_non_null(root);
    assert_string_equal(text, "graph.vig.pass=taa; graph.vig.file=null; graph.vig.entry=null; "
                              "graph.vig.ports=null; graph.vig.params=null; graph.vig.gain=null");
    assert_non_null(rl_value_at(root, "graph.vig.in.color"));
    assert_non_null(apply("graph.sss.pass=sss_burley,sss_burly", NULL, text, sizeof text));
    assert_string_equal(text, "graph.sss.pass=sss_burly"); /* no such pass: that is said elsewhere */
}

static void test_paths(void **state)
{
    (void)state;
    char text[400];
    assert_null(apply("graph.ssss.taps=8,16", NULL, text, sizeof text));
    config_assert_error("--vary graph.ssss.taps=8,16:1:7: error: configs/skin.yaml has no pass in its graph "
                        "called 'ssss'; did you mean 'sss'? known: light, sss, vig");
    assert_null(apply("profiles.skim.texturing=post,pre_post", NULL, text, sizeof text));
    config_assert_error("--vary profiles.skim.texturing=post,pre_post:1:10: error: configs/skin.yaml has no "
                        "profile 'skim'; did you mean 'skin'? known: skin");
    assert_null(apply("outputs.x.exposure=0,1", NULL, text, sizeof text));
    config_assert_error("--vary outputs.x.exposure=0,1:1:9: error: configs/skin.yaml has no output 'x'; "
                        "known: beauty");
    assert_null(apply("graph..taps=8,16", NULL, text, sizeof text));
    assert_non_null(strstr(config_error.text, "no dotted path"));
    config_error = (rl_error){0};
    assert_null(apply("profiles.skin.texturing.x=8,16", NULL, text, sizeof text));
    assert_non_null(strstr(config_error.text, "it has no 'x'"));
    config_error = (rl_error){0};
}

/* Every allocation fails once: an error, and no crash. */
static void test_memory(void **state)
{
    (void)state;
    bool done = false;
    for (unsigned long nth = 1; !done && nth < 4000; nth++) {
        rl_arena arena = {0};
        rl_error err = {0};
        rl_vary v;
        const rl_change *changes;
        const char *const *names;
        size_t n;
        rl_value *root = config_parse(pipeline);
        rl_alloc_fail_at(nth, 0);
        rl_code code = rl_vary_parse(&arena, "graph.sss.pass=sss_burley,curvature", &v, &err);
        rl_grid g = {.pipelines = one_file, .n_pipelines = 1, .varies = &v, .n_varies = 1, .n = 2};
        if (!code)
            code = rl_grid_names(&arena, &g, NULL, 0, &names, &err);
        if (!code)
            code = rl_grid_apply(&arena, rl_registry_all(), &g, 1, "b", &root, NULL, &changes, &n, &err);
        done = rl_alloc_fail_at(0, 0) > 0;
        assert_true(done ? code == RL_OK : code == RL_E_MEMORY);
        assert_int_equal(err.code, code);
        rl_arena_free(&arena);
    }
    assert_true(done);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, config_setup, config_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(test_values),
        TEST(test_bad_values),
        TEST(test_order),
        TEST(test_names),
        TEST(test_names_of_anything),
        TEST(test_bad_grids),
        TEST(test_apply),
        TEST(test_switch),
        TEST(test_switch_from_kernel),
        TEST(test_paths),
        TEST(test_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
