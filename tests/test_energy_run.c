/* The ledger of energy of whole pipelines: the same pictures with it and without, rows for every node of
 * every variant that keeps one, and what taa, lighting and combine say. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/run/experiment.h"
#include "tests/small_capture.h"

#define GAUSSIANS "[{variance_mm2: 9, weight: [0.1, 0.3, 0.3]}, {variance_mm2: 90, weight: [0.5, 0.1, 0]}]"
#define PASS(name)                                                                                           \
    {"graph.sss.pass", name},                                                                                \
    {                                                                                                        \
        "graph.sss.taps", "null"                                                                             \
    }

static const struct {
    const char *name;
    rl_setting settings[4];
    size_t n;
} changes[] = {
    {"base", {{0}}, 0},
    {"surface", {{"graph.sss.weighting", "surface"}}, 1},
    {"tangent", {{"graph.sss.orientation", "tangent"}, {"graph.sss.taps", "auto"}}, 2},
    {"occlude", {{"profiles.skin.border", "occlude"}, {"graph.sss.weighting", "plain"}}, 2},
    {"dense", {PASS("sss_reference")}, 2},
    {"lines", {PASS("sss_gaussian"), {"profiles.skin.gaussians", GAUSSIANS}}, 3},
    {"disk",
     {PASS("sss_gaussian"), {"profiles.skin.gaussians", GAUSSIANS}, {"graph.sss.separable", "false"}},
     4},
    {"off", {PASS("combine")}, 2},
    {"ids", {{"materials.plaster", "{}"}, {"materials.default", "null"}}, 2}, /* reads frames on its own */
};
enum { N = sizeof changes / sizeof *changes, PIXELS = SMALL_WIDTH * SMALL_HEIGHT };

typedef struct seen {
    int frames;
    rl_energy_ledger ledger; /* of all frames; names live as long as the experiment */
    float pixels[SMALL_FRAMES][N][3][PIXELS];
} seen;

static rl_code on_frame(void *ctx, const rl_experiment_frame *f, rl_error *err)
{
    seen *s = ctx;
    (void)err;
    if (f->error->code)
        fail_msg("%s", f->error->text);
    for (size_t v = 0; v < N; v++)
        for (size_t c = 0; c < 3; c++)
            for (size_t y = 0; y < SMALL_HEIGHT; y++) {
                const rl_compared_image *image = &f->images[v][RL_COMPARED_LINEAR];
                memcpy(&s->pixels[s->frames][v][c][y * SMALL_WIDTH], image->plane[c] + y * image->stride,
                       SMALL_WIDTH * sizeof(float));
            }
    rl_energy_row *rows = rl_realloc(s->ledger.rows, (s->ledger.n + f->n_energy + 1) * sizeof *rows);
    assert_non_null(rows);
    if (f->n_energy)
        memcpy(rows + s->ledger.n, f->energy, f->n_energy * sizeof *rows);
    s->ledger.rows = rows;
    s->ledger.n += f->n_energy;
    s->frames++;
    return RL_OK;
}

static rl_experiment *run_all(seen *s, bool energy)
{
    rl_variant variants[N];
    for (size_t i = 0; i < N; i++)
        variants[i] = (rl_variant){.name = changes[i].name,
                                   .pipeline = small_pipe,
                                   .settings = changes[i].settings,
                                   .n_settings = changes[i].n};
    rl_options options = {.threads = 2, .energy = energy, .out = small_out};
    rl_experiment_hooks hooks = {.frame = on_frame, .ctx = s};
    rl_run_summary summary;
    rl_error err = {0};
    rl_experiment *x = NULL;
    if (rl_experiment_open(&options, variants, N, &x, &err) || rl_experiment_run(x, &hooks, &summary, &err))
        fail_msg("%s:%d: %s", err.file, err.line, err.text);
    assert_int_equal(summary.failed, 0);
    assert_int_equal(s->frames, SMALL_FRAMES);
    return x;
}

static seen *seen_new(void)
{
    seen *s = calloc(1, sizeof *s);
    assert_non_null(s);
    return s;
}

static void seen_free(seen *s)
{
    rl_energy_ledger_free(&s->ledger);
    free(s);
}

static const rl_energy_row *find(const seen *s, size_t variant, const char *node, long long frame,
                                 int material)
{
    for (size_t i = 0; i < s->ledger.n; i++) {
        const rl_energy_row *r = &s->ledger.rows[i];
        if (r->variant == variant && r->frame == frame && r->material == material && !strcmp(r->node, node))
            return r;
    }
    return NULL;
}

static int material_named(const rl_experiment *x, const char *name)
{
    size_t n;
    const char *const *names = rl_experiment_materials(x, 0, &n);
    for (size_t i = 0; i < n; i++)
        if (!strcmp(names[i], name))
            return (int)i;
    fail_msg("no material '%s'", name);
    return -1;
}

static double sum3(const double v[3])
{
    return v[0] + v[1] + v[2];
}

/* What holds of every row. */
static void check_row(const rl_energy_row *r)
{
    const rl_energy *e = &r->energy;
    double values[18];
    memcpy(values, e, sizeof values);
    for (int i = 0; i < 18; i++)
        assert_true(isfinite(values[i]));
    assert_true(e->pixels >= 1 && e->pixels <= PIXELS);
    assert_true(sum3(e->out) >= 0 && sum3(e->border) >= 0 && sum3(e->off_screen) >= 0);
    if (!strcmp(r->pass->name, "combine") || !strcmp(r->pass->name, "taa")) {
        if (rl_energy_open(e) > 2e-6)
            fail_msg("%s of variant %s, frame %lld: %g of its energy is open", r->node,
                     changes[r->variant].name, r->frame, rl_energy_open(e));
        assert_true(sum3(e->border) == 0 && sum3(e->off_screen) == 0);
    }
    assert_true(r->pass->conserves ==
                (!strncmp(r->pass->name, "sss_", 4) || !strcmp(r->pass->name, "combine")));
    if (!strcmp(r->pass->name, "lighting"))
        assert_true(sum3(e->in) == 0 && sum3(e->out) > 0);
}

static void check_frame(const seen *s, long long frame, int skin)
{
    static const char *const nodes[] = {"light", "sss", "aa"};
    for (size_t v = 0; v < N; v++) {
        for (size_t k = 0; k < 3; k++) {
            const rl_energy_row *all = find(s, v, nodes[k], frame, RL_ENERGY_ALL);
            const rl_energy_row *one = find(s, v, nodes[k], frame, skin);
            if (!all || !one)
                fail_msg("no row of '%s' of variant '%s', frame %lld", nodes[k], changes[v].name, frame);
            assert_true(one->energy.out[0] > 0 && one->energy.out[0] <= all->energy.out[0]);
        }
        const rl_energy *e = &find(s, v, "sss", frame, skin)->energy;
        if (strcmp(changes[v].name, "off")) {
            if (e->border[0] + e->off_screen[0] <= 0)
                fail_msg("'%s' loses nothing: in %g out %g", changes[v].name, e->in[0], e->out[0]);
        } else
            assert_true(e->out[0] > 0 && fabs(e->in[0] - e->out[0]) < 1e-6 * e->in[0]);
        if (!strcmp(changes[v].name, "occlude"))
            assert_true(fabs(e->redistributed[0]) < 1e-6 * e->in[0] && e->out[0] < e->in[0]);
    }
}

static void test_pictures_and_rows(void **state)
{
    (void)state;
    seen *plain = seen_new(), *kept = seen_new(), *again = seen_new();
    rl_experiment *a = run_all(plain, false), *b = run_all(kept, true), *c = run_all(again, true);
    assert_int_equal(plain->ledger.n, 0);
    for (size_t f = 0; f < SMALL_FRAMES; f++)
        for (size_t v = 0; v < N; v++)
            if (memcmp(plain->pixels[f][v], kept->pixels[f][v], sizeof kept->pixels[f][v]))
                fail_msg("variant '%s', frame %zu: another picture with the ledger", changes[v].name, f + 1);
    assert_true(kept->ledger.n > 3 * N * SMALL_FRAMES);
    for (size_t i = 0; i < kept->ledger.n; i++)
        check_row(&kept->ledger.rows[i]);
    for (long long f = 1; f <= SMALL_FRAMES; f++)
        check_frame(kept, f, material_named(b, "skin"));
    assert_int_equal(again->ledger.n, kept->ledger.n);
    for (size_t i = 0; i < kept->ledger.n; i++) { /* the same bits from run to run */
        assert_string_equal(kept->ledger.rows[i].node, again->ledger.rows[i].node);
        assert_memory_equal(&kept->ledger.rows[i].energy, &again->ledger.rows[i].energy, sizeof(rl_energy));
    }
    /* Jittered or not, a history adds and is clipped from the second frame on. */
    double history = 0, first = 0;
    for (size_t i = 0; i < kept->ledger.n; i++) {
        const rl_energy_row *r = &kept->ledger.rows[i];
        double both = fabs(sum3(r->energy.redistributed)) + fabs(sum3(r->energy.clamped));
        if (!strcmp(r->pass->name, "taa"))
            *(r->frame == 1 ? &first : &history) += both;
    }
    assert_true(first == 0 && history > 0);
    seen_free(plain);
    seen_free(kept);
    seen_free(again);
    rl_experiment_close(&a);
    rl_experiment_close(&b);
    rl_experiment_close(&c);
}

/* Nodes that two variants share have a row in each. */
static void test_shared_nodes(void **state)
{
    (void)state;
    seen *s = seen_new();
    rl_experiment *x = run_all(s, true);
    const rl_energy_row *a = find(s, 0, "light", 2, RL_ENERGY_ALL),
                        *b = find(s, 1, "light", 2, RL_ENERGY_ALL);
    assert_true(a && b);
    assert_ptr_equal(a->node, b->node);
    assert_memory_equal(&a->energy, &b->energy, sizeof a->energy);
    seen_free(s);
    rl_experiment_close(&x);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pictures_and_rows),
        cmocka_unit_test(test_shared_nodes),
    };
    return cmocka_run_group_tests(tests, small_setup, small_teardown);
}
