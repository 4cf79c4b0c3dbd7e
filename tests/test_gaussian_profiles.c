/* The Gaussians of configs/common/profiles.yaml: what the published sets leave unblurred, and how well the
 * fitted ones follow Burley's profile with the d beside them. */
#include "tests/config_help.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "graph/model/materials.h"
#include "passes/burley.h"

typedef struct set {
    int n;
    double d[3], variance[4], weight[4][3];
} set;

/* Every profile of the file becomes a material of its own. */
static const rl_materials *load(void)
{
    rl_value *root = NULL;
    const rl_materials *m = NULL;
    rl_str text = {0};
    config_assert_fine(rl_config_load(&config_arena, "configs/common/profiles.yaml", &root, &config_error));
    const rl_value *profiles = rl_value_get(root, "profiles");
    assert_non_null(profiles);
    rl_str_add(&text, "{");
    for (size_t i = 0; i < profiles->n; i++)
        rl_str_printf(&text, "%s: {profile: %s, stencil: %zu}, ", profiles->entries[i].key,
                      profiles->entries[i].key, i);
    rl_str_add(&text, "}");
    const rl_pass *used[] = {rl_pass_find("sss_gaussian"), rl_pass_find("sss_burley"),
                             rl_pass_find("lighting")};
    config_assert_fine(rl_materials_resolve(&config_arena, profiles, NULL, config_parse(rl_str_text(&text)),
                                            NULL, 0, used, 3, &config_log, &m, &config_error));
    rl_str_free(&text);
    return m;
}

static void get(const rl_materials *m, size_t material, const char *key, double out[3])
{
    assert_true(rl_material_get(m, material, "profile", key, out));
}

static set set_of(const rl_materials *m, size_t material)
{
    set s = {0};
    double v[3];
    char key[64];
    get(m, material, "gaussians", v);
    s.n = (int)v[0];
    get(m, material, "scatter_distance_mm", s.d);
    for (int g = 0; g < s.n; g++) {
        snprintf(key, sizeof key, "gaussians.%d.variance_mm2", g);
        get(m, material, key, v);
        s.variance[g] = v[0];
        snprintf(key, sizeof key, "gaussians.%d.weight", g);
        get(m, material, key, s.weight[g]);
    }
    return s;
}

static size_t find(const rl_materials *m, const char *name)
{
    for (size_t i = 1; i < m->count; i++)
        if (!strcmp(m->names[i], name))
            return i;
    fail_msg("no profile '%s'", name);
    return 0;
}

static void assert_rest(const rl_materials *m, const char *name, double r, double g, double b,
                        double tolerance)
{
    const double expected[3] = {r, g, b};
    set s = set_of(m, find(m, name));
    for (int c = 0; c < 3; c++) {
        double rest = 1;
        for (int i = 0; i < s.n; i++)
            rest -= s.weight[i][c];
        assert_true(fabs(rest - expected[c]) <= tolerance);
    }
}

static void test_unblurred(void **state)
{
    (void)state;
    const rl_materials *m = load();
    assert_rest(m, "skin", 0.241, 0.448, 0.616, 5.1e-4);
    assert_rest(m, "wax", 0, 0, 0, 2.1e-4);
    static const char *const fitted[] = {"skin_fitted", "wax_fitted", "marble", "jade", "leaf"};
    for (size_t i = 0; i < RL_ARRAY_LENGTH(fitted); i++)
        assert_rest(m, fitted[i], 0, 0, 0, 5e-4);
}

/* Half the integral of |sum - f| over the distance, f = 2 pi r R: the share of the light at a wrong distance.
 */
static double misplaced(const set *s, int c)
{
    double sum = 0, step = s->d[c] * 1e-3;
    for (double r = step / 2; r < 40 * s->d[c]; r += step) {
        double f = -2 * 3.14159265358979323846 * r * rl_burley_profile(r, s->d[c]);
        for (int g = 0; g < s->n; g++)
            f += s->weight[g][c] * r / s->variance[g] * exp(-r * r / (2 * s->variance[g]));
        sum += 0.5 * fabs(f) * step;
    }
    return sum;
}

/* As the file's comments say. */
static void test_fits(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        double percent[3];
    } fits[] = {
        {"skin_fitted", {11.3, 9.6, 9.9}}, {"wax_fitted", {9.2, 7.8, 7.9}}, {"marble", {9.9, 7.3, 8.0}},
        {"jade", {8.3, 10.1, 7.6}},        {"leaf", {7.8, 10.5, 9.5}},
    };
    const rl_materials *m = load();
    for (size_t i = 0; i < RL_ARRAY_LENGTH(fits); i++) {
        set s = set_of(m, find(m, fits[i].name));
        for (int c = 0; c < 3; c++) {
            double percent = 100 * misplaced(&s, c);
            if (!(fabs(percent - fits[i].percent[c]) < 0.15))
                fail_msg("%s, channel %d: %.2f %%, not %.1f", fits[i].name, c, percent, fits[i].percent[c]);
        }
    }
    set narrow = set_of(m, find(m, "skin")); /* Jimenez' is not a fit to this d */
    assert_true(misplaced(&narrow, 0) > 0.3);
}

#define T(f) cmocka_unit_test_setup_teardown(f, config_setup, config_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {T(test_unblurred), T(test_fits)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
