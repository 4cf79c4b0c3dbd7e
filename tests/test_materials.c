/* Profiles, shading and materials to one table. */
#include "tests/config_help.h"

#include <string.h>

#include "graph/base/alloc.h"
#include "graph/model/materials.h"

static const rl_stencil_name names[] = {{1, "skin"}, {2, "plaster"}, {7, "skin"}, {-3, "wax"}};

/* The sections of one text; blur and tint are the passes of the graph. */
static rl_code resolve_used(const char *text, size_t n_names, size_t n_used, const rl_materials **out)
{
    const rl_value *root = config_parse(text);
    return rl_materials_resolve_from(&config_registry, &config_arena, rl_value_get(root, "profiles"),
                                     rl_value_get(root, "shading"), rl_value_get(root, "materials"), names,
                                     n_names, config_registry.passes, n_used, &config_log, out,
                                     &config_error);
}

static const rl_materials *resolve(const char *text)
{
    const rl_materials *m = NULL;
    config_assert_fine(resolve_used(text, 4, 2, &m));
    return m;
}

static void refuse(const char *text, const char *expected)
{
    const rl_materials *m;
    assert_int_equal(resolve_used(text, 4, 2, &m), RL_E_CONFIG);
    config_assert_error(expected);
}

static double get(const rl_materials *m, size_t material, const char *group, const char *key, int channel)
{
    double v[3] = {-99, -99, -99};
    assert_true(rl_material_get(m, material, group, key, v));
    return v[channel];
}

/* ---- the table
 * ------------------------------------------------------------------------------------------------- */

static void test_struct_text(void **state)
{
    (void)state;
    rl_str s = {0};
    rl_materials_struct_text_from(&config_registry, &s);
    assert_string_equal(
        rl_str_text(&s),
        "typedef struct material_t { int has_profile; float profile_distance_mm[3]; int profile_border; "
        "float profile_strength; float material_roughness; float material_specular; int "
        "shading_specular; int shading_transmission; } material_t;\n");
    rl_str_free(&s);
}

/* What the device reads, field for field. */
static void test_layout(void **state)
{
    (void)state;
    struct {
        int32_t has_profile;
        float distance_mm[3];
        int32_t border;
        float strength, roughness, specular;
        int32_t lobe, transmission;
    } t[3];
    const rl_materials *m =
        resolve("profiles: {a: {distance_mm: [3, 1.5, 0.5], border: occlude}}\n"
                "shading: {transmission: false}\n"
                "materials: {skin: {profile: a, roughness: 0.5}, plaster: {specular: none}}");
    assert_int_equal(m->entry_bytes, sizeof *t);
    assert_int_equal(m->count, 3);
    memcpy(t, m->data, sizeof t);
    assert_int_equal(t[1].has_profile, 1);
    assert_true(t[1].distance_mm[0] == 3.0f && t[1].distance_mm[1] == 1.5f && t[1].distance_mm[2] == 0.5f);
    assert_int_equal(t[1].border, 1);
    assert_true(t[1].strength == 0.25f && t[1].roughness == 0.5f && t[1].specular == 0.04f);
    assert_int_equal(t[1].lobe, 0);
    assert_int_equal(t[1].transmission, 0);
    assert_int_equal(t[2].has_profile, 0);
    assert_true(t[2].distance_mm[2] == 1.0f && t[2].roughness == -1.0f);
    assert_int_equal(t[2].lobe, 1);
    assert_int_equal(t[0].has_profile, 0);
    assert_int_equal(t[0].transmission, 0);
    assert_true(t[0].distance_mm[0] == 1.0f);
}

static void test_reading_back(void **state)
{
    (void)state;
    const rl_materials *m = resolve("profiles: {a: {distance_mm: [3, 1.5, 0.5]}}\n"
                                    "materials: {skin: {profile: a, transmission: false}}");
    double v[3];
    assert_int_equal(rl_material_count(m), 2);
    assert_true(rl_material_has_profile(m, 1));
    assert_false(rl_material_has_profile(m, 0));
    assert_false(rl_material_has_profile(m, 2));
    assert_true(get(m, 1, "profile", "distance_mm", 1) == 1.5);
    assert_true(get(m, 1, "shading", "transmission", 0) == 0);
    assert_true(get(m, 0, "shading", "transmission", 0) == 1);
    assert_false(rl_material_get(m, 1, "profile", "roughness", v));
    assert_false(rl_material_get(m, 2, "profile", "border", v));
    assert_string_equal(m->names[1], "skin");
    assert_string_equal(m->profiles[1], "a");
}

/* `specular` is a number of the material and a word of the shading. */
static void test_one_key_two_rows(void **state)
{
    (void)state;
    const rl_materials *m = resolve("materials: {skin: {specular: 0.028}, plaster: {specular: none}}");
    assert_true(get(m, 1, "material", "specular", 0) == (double)0.028f);
    assert_true(get(m, 1, "shading", "specular", 0) == 0);
    assert_true(get(m, 2, "material", "specular", 0) == (double)0.04f);
    assert_true(get(m, 2, "shading", "specular", 0) == 1);
    refuse("materials: {skin: {specular: 2}}",
           "t.yaml:1:30: error: 'specular': expected a number 0 … 1 (ratio), found the number '2'");
    refuse("materials: {skin: {specular: gxg}}", "t.yaml:1:30: error: 'specular' cannot be 'gxg'; did you "
                                                 "mean 'ggx'? known: ggx, none");
    refuse("materials: {skin: {specular: true}}",
           "t.yaml:1:30: error: 'specular': expected a number 0 … 1 (ratio), found true");
}

static void test_nothing(void **state)
{
    (void)state;
    const rl_materials *m = resolve("{}");
    assert_int_equal(m->count, 1);
    assert_int_equal(m->n_ids, 0);
    assert_int_equal(m->other, 0);
}

/* ---- stencil ids
 * ------------------------------------------------------------------------------------------------- */

static void test_ids(void **state)
{
    (void)state;
    const rl_materials *m =
        resolve("materials: {default: {}, plaster: {stencil: [4294967295, 5, wax]}, skin: {}}");
    static const rl_stencil_id ids[] = {{-3, 2}, {1, 3}, {5, 2}, {7, 3}, {4294967295, 2}};
    assert_int_equal(m->other, 1);
    assert_int_equal(m->n_ids, RL_ARRAY_LENGTH(ids));
    for (size_t i = 0; i < m->n_ids; i++) {
        assert_true(m->ids[i].id == ids[i].id);
        assert_int_equal(m->ids[i].dense, ids[i].dense);
    }
}

static void test_wrong_ids(void **state)
{
    (void)state;
    refuse("materials: {a: {stencil: 2}, b: {stencil: [3, 2]}}",
           "t.yaml:1:47: error: materials 'a' and 'b' both cover stencil id 2");
    refuse("materials: {a: {stencil: [1, skin]}}",
           "t.yaml:1:30: error: material 'a' lists stencil id 1 twice");
    refuse("materials: {a: {stencil: 1.5}}",
           "t.yaml:1:26: error: 'stencil': expected a 32-bit integer, a name of "
           "stencil_names, or a list of them, found the number '1.5'");
    refuse("materials: {a: {stencil: 4294967296}}",
           "t.yaml:1:26: error: 'stencil': expected a 32-bit integer, a name of "
           "stencil_names, or a list of them, found the number '4294967296'");
    refuse("materials: {a: {stencil: []}}",
           "t.yaml:1:26: error: 'stencil': expected at least one id, found an empty list");
    refuse("materials: {a: {stencil: skni}}", "t.yaml:1:26: error: the capture's stencil_names have no "
                                              "'skni'; did you mean 'skin'? known: plaster, skin, wax");
    refuse("materials: {plastre: {}}",
           "t.yaml:1:13: error: material 'plastre' needs 'stencil' (an id): the capture names "
           "no id like it; did you mean 'plaster'? known: plaster, skin, wax");
    const rl_materials *absent; /* unlike any name: not in this capture, which is no mistake */
    assert_int_equal(resolve_used("materials: {jade: {}}", 3, 2, &absent), RL_OK);
    assert_int_equal(absent->n_ids, 0);
    refuse("materials: {default: {stencil: 1}}",
           "t.yaml:1:32: error: material 'default' is for every id that no other "
           "material covers: it takes no 'stencil'");
    const rl_materials *m;
    assert_int_equal(resolve_used("materials: {skin: {}}", 0, 2, &m), RL_E_CONFIG);
    config_assert_error(
        "t.yaml:1:13: error: material 'skin' needs 'stencil' (an id): the capture has no stencil_names");
    assert_int_equal(resolve_used("materials: {a: {stencil: skin}}", 0, 2, &m), RL_E_CONFIG);
    config_assert_error(
        "t.yaml:1:26: error: stencil 'skin' is a name, but the capture has no stencil_names: write the id");
}

/* ---- profiles
 * ------------------------------------------------------------------------------------------------------ */

static void test_inline_profile(void **state)
{
    (void)state;
    const rl_materials *m = resolve("materials: {skin: {profile: {distance_mm: 2}}}");
    assert_string_equal(m->profiles[1], "skin");
    assert_true(get(m, 1, "profile", "distance_mm", 2) == 2);
}

static void test_wrong_profiles(void **state)
{
    (void)state;
    refuse(
        "profiles: {marble: {distance_mm: 1}, jade: {distance_mm: 1}}\nmaterials: {skin: {profile: marbel}}",
        "t.yaml:2:29: error: there is no profile 'marbel'; did you mean 'marble'? known: jade, marble");
    refuse("materials: {skin: {profile: marble}}", "t.yaml:1:29: error: there is no profile 'marble'");
    refuse("materials: {skin: {profile: 3}}", "t.yaml:1:29: error: 'profile': expected the name of a "
                                              "profile, or a profile's map, found the number '3'");
    refuse("profiles: {a: {boder: occlude}}",
           "t.yaml:1:16: error: profile 'a' has no key 'boder'; did you mean "
           "'border'? known: border, distance_mm, strength");
    refuse("profiles: {a: {roughness: 1}}",
           "t.yaml:1:16: error: profile 'a' has no key 'roughness'; it is a key of "
           "materials; known: border, distance_mm, strength");
    refuse("profiles: {a: {distance_mm: 0}}",
           "t.yaml:1:29: error: 'distance_mm': expected a number or a list of three, "
           "each 0.001 … 1000 (mm), found the number '0'");
    refuse("profiles: {a: 3}", "t.yaml:1:15: error: 'a': expected a map, found the number '3'");
    refuse("profiles: []", "t.yaml:1:11: error: 'profiles': expected a map, found an empty list");
    refuse("materials: {skin: {profile: {borde: occlude}}}",
           "t.yaml:1:30: error: profile 'skin' has no key 'borde'; did you mean 'border'? known: border, "
           "distance_mm, "
           "strength");
}

/* Only what the passes of the graph need is required, and only of profiles that a material uses. */
static void test_required(void **state)
{
    (void)state;
    const char *text = "profiles: {a: {border: occlude}, unused: {}}\nmaterials: {skin: {profile: a}}";
    const rl_materials *m;
    refuse(text, "t.yaml:1:12: error: profile 'a' needs 'distance_mm' for pass blur: how far");
    config_assert_fine(resolve_used(text, 4, 0, &m));
    assert_string_equal(config_logged,
                        "verbose t.yaml:1:16 profile 'a': no pass of the graph reads 'border'");
    resolve("profiles: {unused: {}}\nmaterials: {skin: {}}");
}

static void test_wrong_keys(void **state)
{
    (void)state;
    refuse("shading: {transmision: true}",
           "t.yaml:1:11: error: shading has no key 'transmision'; did you mean "
           "'transmission'? known: specular, transmission");
    refuse("shading: {distance_mm: 1}", "t.yaml:1:11: error: shading has no key 'distance_mm'; it is a key "
                                        "of profiles; known: specular, transmission");
    refuse("shading: {specular: 0.5}", "t.yaml:1:21: error: 'specular' cannot be '0.5'; known: ggx, none");
    refuse("materials: {skin: {rougness: 1}}", "t.yaml:1:20: error: material 'skin' has no key 'rougness'; "
                                               "did you mean 'roughness'? known: profile, "
                                               "roughness, specular, stencil, transmission");
    refuse("materials: {skin: {distance_mm: 1}}", "t.yaml:1:20: error: material 'skin' has no key "
                                                  "'distance_mm'; it is a key of profiles; known: profile, "
                                                  "roughness, specular, stencil, transmission");
    refuse("materials: {skin: 1}", "t.yaml:1:19: error: 'skin': expected a map, found the number '1'");
    refuse("materials: [1]", "t.yaml:1:12: error: 'materials': expected a map, found a list of 1");
    refuse("materials: {skin: {roughness: .nan}}",
           "t.yaml:1:31: error: 'roughness': expected a number 0 … 1 (ratio), found the number '.nan'");
}

/* ---- memory, and the build's own rows
 * --------------------------------------------------------------------------- */

static void test_out_of_memory(void **state)
{
    (void)state;
    const rl_value *root =
        config_parse("profiles: {a: {distance_mm: 1}}\nmaterials: {skin: {profile: a}, default: {}}");
    for (unsigned long n = 1;; n++) {
        rl_arena arena = {0};
        rl_error err = {0};
        const rl_materials *m;
        rl_alloc_fail_at(n, 0);
        rl_code code = rl_materials_resolve_from(&config_registry, &arena, rl_value_get(root, "profiles"),
                                                 NULL, rl_value_get(root, "materials"), names, 4,
                                                 config_registry.passes, 2, NULL, &m, &err);
        rl_alloc_fail_at(0, 0);
        rl_arena_free(&arena);
        assert_int_equal(code, err.code);
        if (!code)
            break;
        assert_int_equal(code, RL_E_MEMORY);
        assert_true(n < 1000);
    }
}

static bool same_text(const char *a, const char *b)
{
    return a == b || (a && b && !strcmp(a, b));
}

static bool same_row(const rl_param *a, const rl_param *b)
{
    return a->type == b->type && a->min == b->min && a->max == b->max &&
           !memcmp(a->def, b->def, sizeof a->def) && same_text(a->words, b->words) &&
           same_text(a->unit, b->unit) && same_text(a->help, b->help) && a->no_default == b->no_default &&
           a->most_sum == b->most_sum && a->list.rows == b->list.rows && a->list.n == b->list.n;
}

static rl_params group_of(const rl_pass *pass, const char *group)
{
    return !strcmp(group, "profile")    ? pass->profile_keys
           : !strcmp(group, "material") ? pass->material_keys
                                        : pass->shading_keys;
}

/* A key means one thing, whichever pass reads it and needs it; `profile` and `stencil` are the resolver's. */
static void test_registered_rows(void **state)
{
    (void)state;
    const rl_material_row *rows;
    size_t n, bytes;
    config_assert_fine(rl_material_rows(&config_arena, rl_registry_all(), &rows, &n, &bytes, &config_error));
    for (size_t i = 0; i < n; i++) {
        const char *name = rows[i].param->name;
        if (strcmp(rows[i].group, "profile") != 0) {
            assert_string_not_equal(name, "profile");
            assert_string_not_equal(name, "stencil");
        }
        for (size_t p = 0; p < rl_pass_count(); p++) {
            rl_params declared = group_of(rl_pass_at(p), rows[i].group);
            for (size_t k = 0; k < declared.n; k++)
                if (!strcmp(declared.rows[k].name, name) && !same_row(&declared.rows[k], rows[i].param))
                    fail_msg("%s key '%s' differs in pass %s", rows[i].group, name, rl_pass_at(p)->name);
        }
    }
    rl_str s = {0};
    rl_materials_struct_text(&s);
    assert_int_equal(strncmp(rl_str_text(&s), "typedef struct material_t { int has_profile;", 44), 0);
    rl_str_free(&s);
}

#define T(f) cmocka_unit_test_setup_teardown(f, config_setup, config_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        T(test_struct_text),     T(test_layout),   T(test_reading_back), T(test_one_key_two_rows),
        T(test_nothing),         T(test_ids),      T(test_wrong_ids),    T(test_inline_profile),
        T(test_wrong_profiles),  T(test_required), T(test_wrong_keys),   T(test_out_of_memory),
        T(test_registered_rows),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
