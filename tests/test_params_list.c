/* Rows whose value is a list of maps: reading, refusing, printing, their place in the material table; rows
 * that are required now and then; steps that run now and then. */
#include "tests/config_help.h"

#include <string.h>

#include "graph/base/alloc.h"
#include "graph/model/materials.h"
#include "graph/model/params.h"

static const rl_param lobe_keys[] = {
    M(RL_F32, width, 0.5, 8, 0, "mm", "half width", .required = true, .most_sum = 10),
    M(RL_RGBF, share, 0, 1, 0, "ratio", "of the light", .required = true, .most_sum = 1),
    M_ENUM(shape, "round|flat", 1, "of the lobe"),
};

static const rl_param lobes = M_ROWS(lobes, lobe_keys, 1, 3, "what is added up", .required = true);

/* As a kernel sees it. */
typedef struct lobes_value {
    int32_t n;
    float width[3];
    float share[9];
    int32_t shape[3];
} lobes_value;

static lobes_value read_lobes(const char *text)
{
    lobes_value v;
    memset(&v, 0x55, sizeof v);
    config_assert_fine(rl_param_read(&lobes, config_parse(text), &v, &config_error));
    return v;
}

static void refuse(const char *text, const char *expected)
{
    lobes_value v;
    assert_int_equal(rl_param_read(&lobes, config_parse(text), &v, &config_error), RL_E_CONFIG);
    config_assert_error(expected);
}

static void test_reading(void **state)
{
    (void)state;
    assert_int_equal(rl_param_bytes(&lobes), sizeof(lobes_value));
    lobes_value v = read_lobes("[{width: 2, share: [0.1, 0.2, 0.3]}, {shape: round, share: 0.5, width: 8}]");
    static const float shares[9] = {0.1f, 0.2f, 0.3f, 0.5f, 0.5f, 0.5f, 0, 0, 0};
    assert_int_equal(v.n, 2);
    assert_true(v.width[0] == 2 && v.width[1] == 8 && v.width[2] == 0);
    assert_memory_equal(v.share, shares, sizeof shares);
    assert_true(v.shape[0] == 1 && v.shape[1] == 0 && v.shape[2] == 0);
    rl_param_default(&lobes, &v);
    assert_int_equal(v.n, 0);
    assert_true(v.width[0] == 0);
}

static void test_refusing(void **state)
{
    (void)state;
    refuse("3", "t.yaml:1:1: error: 'lobes': expected a list of 1 … 3 maps {width, share, shape}, found the "
                "number '3'");
    refuse("[]", "t.yaml:1:1: error: 'lobes': expected a list of 1 … 3 maps {width, share, shape}, found an "
                 "empty list");
    refuse("[{}, {}, {}, {}]", "t.yaml:1:1: error: 'lobes': expected a list of 1 … 3 maps {width, share, "
                               "shape}, found a list of 4");
    refuse("[1]", "t.yaml:1:2: error: an element of 'lobes': expected a map, found the number '1'");
    refuse(
        "[{width: 2, share: 0}, {widht: 2}]",
        "t.yaml:1:25: error: an element of 'lobes' has no key 'widht'; did you mean 'width'? known: shape, "
        "share, width");
    refuse("[{width: 2, share: 0}, {share: 0}]",
           "t.yaml:1:24: error: an element of 'lobes' needs 'width': half width");
    refuse("[{width: 9, share: 0}]",
           "t.yaml:1:10: error: 'width': expected a number 0.5 … 8 (mm), found the number '9'");
    refuse("[{width: 2, share: [0, 0, .nan]}]",
           "t.yaml:1:27: error: 'share': expected a number or a list of three, each 0 … 1 (ratio), found the "
           "number '.nan'");
    refuse("[{width: 2, share: 0, shape: rond}]",
           "t.yaml:1:30: error: 'shape' cannot be 'rond'; did you mean 'round'? known: flat, round");
}

/* At most 1 a channel, and a millionth for rounding. */
static void test_sums(void **state)
{
    (void)state;
    read_lobes("[{width: 2, share: [1, 0.5, 0.3]}, {width: 2, share: [0, 0.5, 0.7]}]");
    read_lobes("[{width: 2, share: 0.3333334}, {width: 2, share: 0.3333334}, {width: 2, share: 0.3333334}]");
    refuse(
        "[{width: 2, share: [1, 0.5, 0.25]}, {width: 2, share: [0, 0.50001, 0.5]}]",
        "t.yaml:1:1: error: 'lobes': 'share' adds up to [1, 1.00001, 0.75], at most 1 a channel is allowed");
    refuse("[{width: 8, share: 0}, {width: 8, share: 0}]",
           "t.yaml:1:1: error: 'lobes': 'width' adds up to 16, at most 10 is allowed");
}

/* An element that comes from elsewhere than its list is the one to look at. */
static void test_sums_place(void **state)
{
    (void)state;
    rl_value *root = config_parse("lobes: [{width: 2, share: 0.6}, {width: 2, share: 0.3}]"), *v = NULL;
    lobes_value out;
    config_assert_fine(
        rl_yaml_parse(&config_arena, "[0, 0.5, 0]", 11, "--set lobes.1.share", &v, &config_error));
    config_assert_fine(rl_value_set(&config_arena, &root, "lobes.1.share", v, &config_error));
    assert_int_equal(rl_param_read(&lobes, rl_value_get(root, "lobes"), &out, &config_error), RL_E_CONFIG);
    config_assert_error(
        "--set lobes.1.share:1:1: error: 'lobes': 'share' adds up to [0.6, 1.1, 0.6], at most 1 a "
        "channel is allowed");
}

static void test_telling(void **state)
{
    (void)state;
    static const char text[] =
        "[{width: 2, share: [0.1, 0.2, 0.3], shape: flat}, {width: 4, share: [0, 0, 0], "
        "shape: round}]";
    lobes_value v = read_lobes(text), again;
    rl_str s = {0};
    rl_param_print(&lobes, &v, &s);
    assert_string_equal(rl_str_text(&s), text);
    again = read_lobes(rl_str_text(&s));
    assert_memory_equal(&v, &again, sizeof v);
    rl_str_free(&s);
    rl_param_describe(&lobes, &s);
    assert_string_equal(rl_str_text(&s), "a list of 1 … 3 maps {width, share, shape}, required");
    rl_str_free(&s);
    rl_param_field(&lobes, "profile_", &s);
    assert_string_equal(rl_str_text(&s), "int profile_lobes_n; float profile_lobes_width[3]; float "
                                         "profile_lobes_share[9]; int profile_lobes_shape[3];");
    rl_str_free(&s);
}

/* ---- in the material table ---- */

static const rl_param spread_keys[] = {M(RL_F32, before, 0, 1, 0.5, "", "a field in front"),
                                       M_ROWS(lobes, lobe_keys, 1, 3, "what is added up", .required = true),
                                       M_ENUM(mode, "none|thin|thick", 0, "how")};
static const rl_param tell_keys[] = {
    M_ROWS(lobes, lobe_keys, 1, 3, "what is added up"),
    M(RL_F32, depth_mm, 0.1, 10, 0, "mm", "how deep", .no_default = true, .required_with = "mode=thin|thick"),
};
static const rl_pass spread = {.name = "spread", .profile_keys = RL_ARRAY(spread_keys)};
static const rl_pass tell = {.name = "tell", .profile_keys = RL_ARRAY(tell_keys)};
static const rl_pass *const both[] = {&spread, &tell};
static const rl_registry registry = {both, 2};

static rl_code resolve(const char *text, const rl_pass *const *used, size_t n, const rl_materials **out)
{
    const rl_value *root = config_parse(text);
    return rl_materials_resolve_from(&registry, &config_arena, rl_value_get(root, "profiles"), NULL,
                                     rl_value_get(root, "materials"), NULL, 0, used, n, &config_log, out,
                                     &config_error);
}

static void test_table(void **state)
{
    (void)state;
    struct {
        int32_t has_profile;
        float before;
        lobes_value lobes;
        int32_t mode;
        float depth_mm;
    } t[2];
    const rl_materials *m;
    double v[3];
    config_assert_fine(
        resolve("profiles: {a: {lobes: [{width: 2, share: 0.25}, {width: 3, share: [0, 0.5, 0.75]}]}}\n"
                "materials: {skin: {profile: a, stencil: 1}}",
                both, 2, &m));
    assert_int_equal(m->entry_bytes, sizeof *t);
    memcpy(t, m->data, sizeof t);
    assert_int_equal(t[1].lobes.n, 2);
    assert_true(t[1].before == 0.5f && t[1].lobes.width[1] == 3 && t[1].lobes.share[5] == 0.75f);
    assert_int_equal(t[0].lobes.n, 0);
    assert_true(rl_material_get(m, 1, "profile", "lobes", v) && v[0] == 2);
    assert_true(rl_material_get(m, 1, "profile", "lobes.1.width", v) && v[0] == 3);
    assert_true(rl_material_get(m, 1, "profile", "lobes.1.share", v) && v[0] == 0 && v[1] == 0.5 &&
                v[2] == 0.75);
    assert_false(rl_material_get(m, 1, "profile", "lobes.2.width", v));
    assert_false(rl_material_get(m, 1, "profile", "lobes.-1.width", v));
    assert_false(rl_material_get(m, 1, "profile", "lobes.0.wide", v));
    assert_false(rl_material_get(m, 1, "profile", "lobes.0", v));
    assert_false(rl_material_get(m, 1, "profile", "lobes.", v));
    assert_false(rl_material_get(m, 1, "profile", "lobe", v));
    assert_false(rl_material_get(m, 1, "profile", "before.0.width", v));
    assert_false(rl_material_get(m, 2, "profile", "lobes.0.width", v));
}

/* What one pass needs does not bind another that reads the same key; some keys are needed with others only.
 */
static void test_required(void **state)
{
    (void)state;
    const rl_materials *m;
    const char *bare = "profiles: {a: {before: 1}}\nmaterials: {skin: {profile: a, stencil: 1}}";
    config_assert_fine(resolve(bare, &both[1], 1, &m));
    assert_int_equal(resolve(bare, both, 2, &m), RL_E_CONFIG);
    config_assert_error("t.yaml:1:12: error: profile 'a' needs 'lobes' for pass spread: what is added up");
    const char *thick = "profiles: {a: {mode: thick}}\nmaterials: {skin: {profile: a, stencil: 1}}";
    assert_int_equal(resolve(thick, &both[1], 1, &m), RL_E_CONFIG);
    config_assert_error(
        "t.yaml:1:12: error: profile 'a' needs 'depth_mm' for pass tell (mode=thin|thick): how deep");
    config_assert_fine(
        resolve("profiles: {a: {mode: thick, depth_mm: 2}}\nmaterials: {skin: {profile: a, stencil: 1}}",
                &both[1], 1, &m));
    config_assert_fine(
        resolve("profiles: {a: {mode: none}}\nmaterials: {skin: {profile: a, stencil: 1}}", &both[1], 1, &m));
}

/* What a list adds up to is the business of the passes that read it. */
static void test_sums_unread(void **state)
{
    (void)state;
    static const rl_param before_keys[] = {M(RL_F32, before, 0, 1, 0.5, "", "a field in front")};
    static const rl_pass other = {.name = "other", .profile_keys = RL_ARRAY(before_keys)};
    static const rl_pass *const unread[] = {&other};
    static const char text[] = "profiles: {a: {lobes: [{width: 2, share: 0.9}, {width: 2, share: 0.9}]}}\n"
                               "materials: {skin: {profile: a, stencil: 1}}";
    const rl_materials *m;
    config_assert_fine(resolve(text, unread, 1, &m));
    assert_int_equal(resolve(text, both, 1, &m), RL_E_CONFIG);
    config_assert_error(
        "t.yaml:1:23: error: 'lobes': 'share' adds up to [1.8, 1.8, 1.8], at most 1 a channel is "
        "allowed");
    assert_int_equal(
        resolve("profiles: {a: {lobes: [{width: 2, share: 1.5}]}}\nmaterials: {skin: {profile: a, "
                "stencil: 1}}",
                unread, 1, &m),
        RL_E_CONFIG); /* ranges are checked all the same */
    config_error = (rl_error){0};
}

static void test_set(void **state)
{
    (void)state;
    rl_value *root = config_parse("profiles: {a: {lobes: [{width: 2, share: 0.25}]}}\n"
                                  "materials: {skin: {profile: a, stencil: 1}}");
    const rl_materials *m;
    double v[3];
    config_assert_fine(rl_value_set(&config_arena, &root, "profiles.a.lobes.0.share",
                                    config_parse("[1, 0, 0]"), &config_error));
    config_assert_fine(rl_materials_resolve_from(&registry, &config_arena, rl_value_get(root, "profiles"),
                                                 NULL, rl_value_get(root, "materials"), NULL, 0, both, 2,
                                                 &config_log, &m, &config_error));
    assert_true(rl_material_get(m, 1, "profile", "lobes.0.share", v) && v[0] == 1 && v[1] == 0);
}

static void test_out_of_memory(void **state)
{
    (void)state;
    static const char *const texts[] = {"[{width: 2, share: 0}]", "[{widht: 2}]", "[]"};
    for (size_t k = 0; k < 3; k++) {
        const rl_value *v = config_parse(texts[k]);
        for (unsigned long n = 1;; n++) {
            lobes_value out;
            rl_error err = {0};
            rl_alloc_fail_at(n, 0);
            rl_code code = rl_param_read(&lobes, v, &out, &err);
            rl_alloc_fail_at(0, 0);
            assert_int_equal(code, err.code);
            assert_true(code == RL_E_MEMORY || code == (k ? RL_E_CONFIG : RL_OK));
            if (code != RL_E_MEMORY)
                break;
            assert_true(n < 100);
        }
    }
}

/* ---- steps ---- */

typedef struct two_params {
    int32_t first, fast;
} two_params;

static void test_steps(void **state)
{
    (void)state;
    static const rl_param rows[] = {P(two_params, RL_BOOL, first, 0, 1, 0, "", "other"),
                                    P(two_params, RL_BOOL, fast, 0, 1, 0, "", "how", .structural = true)};
    static const rl_step steps[] = {{"always", .domain = RL_EVERY_PIXEL},
                                    {"quick", .domain = RL_EVERY_PIXEL, .when = "fast", .is = 1},
                                    {"slow", .domain = RL_EVERY_PIXEL, .when = "fast", .is = 0}};
    const rl_pass pass = {.params = RL_ARRAY(rows), .params_size = sizeof(two_params)};
    const two_params fast = {0, 1}, slow = {1, 0};
    assert_true(rl_step_runs(&pass, &steps[0], &fast) && rl_step_runs(&pass, &steps[0], NULL));
    assert_true(rl_step_runs(&pass, &steps[1], &fast) && !rl_step_runs(&pass, &steps[2], &fast));
    assert_true(!rl_step_runs(&pass, &steps[1], &slow) && rl_step_runs(&pass, &steps[2], &slow));
    for (size_t p = 0; p < rl_pass_count(); p++) /* conditions name a structural parameter that is there */
        for (size_t i = 0; i < rl_pass_at(p)->steps.n; i++) {
            const rl_step *step = &rl_pass_at(p)->steps.rows[i];
            bool found = !step->when;
            for (size_t k = 0; k < rl_pass_at(p)->params.n; k++)
                found |= step->when && !strcmp(rl_pass_at(p)->params.rows[k].name, step->when) &&
                         rl_pass_at(p)->params.rows[k].structural;
            assert_true(found);
        }
}

#define T(f) cmocka_unit_test_setup_teardown(f, config_setup, config_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        T(test_reading),     T(test_refusing), T(test_sums),          T(test_sums_place),
        T(test_sums_unread), T(test_telling),  T(test_table),         T(test_required),
        T(test_set),         T(test_steps),    T(test_out_of_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
