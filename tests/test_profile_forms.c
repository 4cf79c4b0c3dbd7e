/* A profile's width in other renderers' numbers: param and the forms of scatter_distance_mm. */
#include "tests/config_help.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "graph/model/materials.h"
#include "passes/burley.h"
#include "passes/shading_rows.h"

static const rl_stencil_name names[] = {{1, "skin"}};

static rl_code resolve_with(const rl_registry *registry, const rl_pass *used, const char *profile,
                            const rl_materials **out)
{
    char text[512];
    snprintf(text, sizeof text, "profiles:\n  a: {%s}\nmaterials: {skin: {profile: a}}", profile);
    const rl_value *root = config_parse(text);
    return rl_materials_resolve_from(registry, &config_arena, rl_value_get(root, "profiles"), NULL,
                                     rl_value_get(root, "materials"), names, 1, &used, 1, &config_log, out,
                                     &config_error);
}

static rl_code resolve(const char *profile, const rl_materials **out)
{
    return resolve_with(rl_registry_all(), rl_pass_find("sss_burley"), profile, out);
}

static void distance(const char *profile, double d[3])
{
    const rl_materials *m = NULL;
    config_assert_fine(resolve(profile, &m));
    assert_true(rl_material_get(m, 1, "profile", "scatter_distance_mm", d));
}

static void assert_near(const double a[3], double x, double y, double z)
{
    const double b[3] = {x, y, z};
    for (int c = 0; c < 3; c++)
        if (!(fabs(a[c] / b[c] - 1) < 2.5e-7)) /* two roundings to float */
            fail_msg("channel %d: %.9g, expected %.9g", c, a[c], b[c]);
}

static void refuse(const char *profile, const char *expected)
{
    const rl_materials *m;
    assert_int_equal(resolve(profile, &m), RL_E_CONFIG);
    config_assert_error(expected);
}

/* ---- formulas ---------------------------------------------------------------------------------------------
 */

/* A = 0.8, 0.5, 0.33 make every formula short enough for pencil and paper. */
static void test_by_hand(void **state)
{
    (void)state;
    double d[3];
    distance("param: mean_free_path, mean_free_path_mm: [1, 2, 3], albedo: [0.8, 0.5, 0.33]", d);
    assert_near(d, 1 / 1.05, 2 / 1.539, 3 / 2.246761);
    distance("param: mean_free_path_diffuse, mean_free_path_mm: [1, 2, 3], albedo: [0.8, 0.5, 0.33]", d);
    assert_near(d, 1 / 1.1, 2 / 1.715, 3 / 2.34315);
    distance("param: cycles_radius, cycles_radius_mm: [1, 2, 3], albedo: [0.8, 0.5, 0.33]", d);
    assert_near(d, 0.07957747154594767 / 1.1, 2 * 0.07957747154594767 / 1.715,
                3 * 0.07957747154594767 / 2.34315);
    distance("param: unreal_dmfp, diffuse_mean_free_path_mm: [1, 2, 3], albedo: [0.8, 0.5, 0.33]", d);
    assert_near(d, 1 / 8.379681, 2 / 3.583521, 3 / 3.5);
    distance("param: mean_free_path, mean_free_path_mm: 2, albedo: 1", d); /* one number for all channels */
    assert_near(d, 2 / 0.906, 2 / 0.906, 2 / 0.906);
    distance("param: mean_free_path, mean_free_path_mm: 2, albedo: 0", d); /* |A - 0.8|, not A - 0.8 */
    assert_near(d, 2 / 5.434, 2 / 5.434, 2 / 5.434);
}

/* What another renderer would be told for d comes back as d, whichever way. */
static void test_round_trip(void **state)
{
    (void)state;
    static const struct {
        const char *word, *key;
        rl_burley_fit fit;
        double factor;
    } ways[] = {
        {"mean_free_path", "mean_free_path_mm", RL_BURLEY_SEARCHLIGHT, 1},
        {"mean_free_path_diffuse", "mean_free_path_mm", RL_BURLEY_DIFFUSE, 1},
        {"cycles_radius", "cycles_radius_mm", RL_BURLEY_DIFFUSE, 4 * 3.14159265358979323846},
        {"unreal_dmfp", "diffuse_mean_free_path_mm", RL_BURLEY_DMFP, 1},
    };
    for (double albedo = 0.0625; albedo < 1; albedo += 0.125) { /* exact in float */
        for (size_t i = 0; i < sizeof ways / sizeof *ways; i++) {
            double l = ways[i].factor * rl_burley_scale(ways[i].fit, albedo), d[3];
            char profile[256];
            snprintf(profile, sizeof profile, "param: %s, %s: [%.17g, %.17g, %.17g], albedo: %.17g",
                     ways[i].word, ways[i].key, 3 * l, 1.2 * l, 0.7 * l, albedo);
            distance(profile, d);
            assert_near(d, 3, 1.2, 0.7);
        }
    }
}

/* s falls while A rises to where scattering is nearly all that happens: brighter surfaces blur further. */
static void test_brighter_is_wider(void **state)
{
    (void)state;
    for (double a = 0; a < 0.79; a += 0.01) {
        assert_true(rl_burley_scale(RL_BURLEY_SEARCHLIGHT, a) >
                    rl_burley_scale(RL_BURLEY_SEARCHLIGHT, a + 0.01));
        assert_true(rl_burley_scale(RL_BURLEY_DIFFUSE, a) > rl_burley_scale(RL_BURLEY_DIFFUSE, a + 0.01));
    }
    /* In units of l_d the profile is widest at 0.33 */
    assert_true(rl_burley_scale(RL_BURLEY_DMFP, 0.33) == 3.5);
}

/* ---- the default ------------------------------------------------------------------------------------------
 */

/* Profiles that do not say `param`: each number as it is written, to the bit, and the same table with the
 * word. */
static void test_default(void **state)
{
    (void)state;
    const rl_materials *m = NULL, *worded = NULL;
    double d[3];
    config_assert_fine(resolve("scatter_distance_mm: [3.0, 1.2, 0.7], border: occlude", &m));
    config_assert_fine(
        resolve("param: scatter_distance, scatter_distance_mm: [3.0, 1.2, 0.7], border: occlude", &worded));
    assert_int_equal(m->entry_bytes, worded->entry_bytes);
    assert_memory_equal(m->data, worded->data, m->count * m->entry_bytes);
    assert_true(rl_material_get(m, 1, "profile", "scatter_distance_mm", d));
    assert_true(d[0] == (double)3.0f && d[1] == (double)1.2f && d[2] == (double)0.7f);
}

/* ---- mistakes ---------------------------------------------------------------------------------------------
 */

static void test_mistakes(void **state)
{
    (void)state;
    refuse("param: mean_free_path, mean_free_path_mm: 1",
           "t.yaml:2:14: error: profile 'a': 'param: mean_free_path' needs 'albedo' (reflectance A of the "
           "surface that "
           "the other renderer was told; only for the formulas of param)");
    refuse("param: cycles_radius, albedo: 0.5", "t.yaml:2:14: error: profile 'a': 'param: cycles_radius' "
                                                "needs 'cycles_radius_mm' (radius times scale "
                                                "of a Cycles material, a channel)");
    refuse("param: mean_free_path, mean_free_path_mm: 1, albedo: 0.5, scatter_distance_mm: 1",
           "t.yaml:2:86: error: profile 'a': 'param: mean_free_path' has no use for 'scatter_distance_mm', "
           "which goes "
           "with 'param: scatter_distance' (or null removes it)");
    refuse("mean_free_path_mm: 1, albedo: 0.5", "t.yaml:2:26: error: profile 'a': 'param: scatter_distance' "
                                                "has no use for 'mean_free_path_mm', which goes "
                                                "with 'param: mean_free_path' (or null removes it)");
    refuse("param: unreal_dmfp, diffuse_mean_free_path_mm: 1e-4, albedo: 0.5",
           "t.yaml:2:54: error: profile 'a': 'scatter_distance_mm' that follows from 'param: unreal_dmfp' is "
           "2.79055e-05 mm; expected 0.0001 … 10000");
    refuse("param: scatter_distance", "t.yaml:2:3: error: profile 'a' needs 'scatter_distance_mm' for pass "
                                      "sss_burley: scattering distance d = 1/s "
                                      "a channel, for Burley's profile");
    refuse("param: mean_free_path, mean_free_path_mm: 1, albedo: 1.5",
           "t.yaml:2:60: error: 'albedo': expected a number or a list of three, each 0 … 1 (ratio), found "
           "the number '1.5'");
}

/* A profile that no material uses is checked as well, and does not inherit from the one before it. */
static void test_unused_profiles(void **state)
{
    (void)state;
    const rl_pass *used = rl_pass_find("sss_burley");
    const rl_materials *m;
    const rl_value *root = config_parse("a: {param: mean_free_path, mean_free_path_mm: 1, albedo: 0.5}\n"
                                        "b: {scatter_distance_mm: 1}\n"
                                        "c: {gaussians: [{variance_mm2: 1, weight: 1}]}\n");
    assert_int_equal(rl_materials_resolve(&config_arena, root, NULL, NULL, names, 1, &used, 1, &config_log,
                                          &m, &config_error),
                     RL_OK);
    root = config_parse("a: {scatter_distance_mm: 1}\nb: {param: cycles_radius, cycles_radius_mm: 1}\n");
    assert_int_equal(rl_materials_resolve(&config_arena, root, NULL, NULL, names, 1, &used, 1, &config_log,
                                          &m, &config_error),
                     RL_E_CONFIG);
    config_error = (rl_error){0};
}

/* ---- any pass ---------------------------------------------------------------------------------------------
 */

static double from_area(const double from[2])
{
    return sqrt(from[0]);
}

/* The engine knows no row by its name: other words, one channel, one source. */
static void test_own_pass(void **state)
{
    (void)state;
    static const rl_form forms[] = {{"side", {"side_mm"}, NULL, "as given", "none"},
                                    {"area", {"area_mm2"}, from_area, "sqrt", "none"}};
    static const rl_param rows[] = {
        M(RL_F32, area_mm2, 0, 100, 0, "mm2", "area", .no_default = true),
        M(RL_F32, side_mm, 0, 10, 0, "mm", "side", .no_default = true, .required = true, .form_row = "by",
          .forms = RL_ARRAY(forms)),
        M_ENUM(by, "side|area", 0, "which is given"),
    };
    static const rl_pass pass = {.name = "square", .help = "for tests", .profile_keys = RL_ARRAY(rows)};
    static const rl_pass *const passes[] = {&pass};
    static const rl_registry registry = {passes, 1};
    const rl_materials *m = NULL;
    double v[3];
    config_assert_fine(resolve_with(&registry, &pass, "by: area, area_mm2: 9", &m));
    assert_true(rl_material_get(m, 1, "profile", "side_mm", v) && v[0] == 3);
    config_assert_fine(resolve_with(&registry, &pass, "side_mm: 5", &m));
    assert_true(rl_material_get(m, 1, "profile", "side_mm", v) && v[0] == 5);
    assert_int_equal(resolve_with(&registry, &pass, "by: side, area_mm2: 9", &m), RL_E_CONFIG);
    config_error = (rl_error){0};
}

/* What the engine takes for granted of every registered row with forms. */
static void test_registered_forms(void **state)
{
    (void)state;
    size_t found = 0;
    for (size_t p = 0; p < rl_pass_count(); p++) {
        const rl_params rows = rl_pass_at(p)->profile_keys;
        for (size_t i = 0; i < rows.n; i++) {
            const rl_param *row = &rows.rows[i];
            size_t words = 0;
            if (!row->forms.n)
                continue;
            found++;
            assert_ptr_equal(row->forms.rows, rl_scatter_forms); /* equal wherever declared */
            assert_true(row->no_default && (row->type == RL_RGBF || row->type == RL_F32));
            for (size_t k = 0; k < rows.n; k++) {
                if (strcmp(rows.rows[k].name, row->form_row) != 0)
                    continue;
                for (const char *w = rows.rows[k].words; w; w = strchr(w, '|') ? strchr(w, '|') + 1 : NULL) {
                    const char *form = row->forms.rows[words++].word;
                    assert_true(!strncmp(form, w, strlen(form)) && strchr("|", w[strlen(form)]));
                }
            }
            assert_int_equal(words, row->forms.n);
            for (size_t f = 0; f < row->forms.n; f++)
                for (int s = 0; s < 2 && row->forms.rows[f].from[s]; s++) {
                    size_t k = 0;
                    while (k < rows.n && strcmp(rows.rows[k].name, row->forms.rows[f].from[s]) != 0)
                        k++;
                    assert_true(k < rows.n && rows.rows[k].type == row->type);
                }
        }
    }
    assert_true(found >= 3);
}

#define T(f) cmocka_unit_test_setup_teardown(f, config_setup, config_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        T(test_by_hand),  T(test_round_trip),      T(test_brighter_is_wider), T(test_default),
        T(test_mistakes), T(test_unused_profiles), T(test_own_pass),          T(test_registered_forms),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
