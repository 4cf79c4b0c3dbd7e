/* The ledger of energy: what taa says, figures, rows. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "graph/run/energy.h"
#include "tests/sss_scene.h"

/* taa on still frames: `history` under `color`, three frames of it, so that the new frame counts a quarter.
 */
static rl_energy run_taa(const frame_t *f, const float *color, const float *history)
{
    extern const rl_pass rl_pass_taa;
    const struct {
        float blend, clip_gamma;
        uint32_t exclude[8];
    } params = {0.05f, 1, {0}};
    size_t n = (size_t)f->columns * (size_t)f->rows;
    float *depth = sss_planes(n), *count = sss_planes(n), *out = sss_planes(3 * n), *frames = sss_planes(n);
    float *sums = sss_planes(RL_SUM_FLOATS);
    uint32_t *ids = (uint32_t *)sss_planes(n);
    const int32_t materials[2] = {0, 0};
    for (size_t i = 0; i < n; i++) {
        depth[i] = 1;
        count[i] = 3;
        ids[i] = 1;
    }
    const cl_image images[] = {
        {"color", color, NULL},  {"depth", depth, NULL},        {"stencil", ids, NULL},
        {"color", NULL, out},    {"last_color", history, NULL}, {"last_depth", depth, NULL},
        {"energy", NULL, sums},  {"last_stencil", ids, NULL},   {"last_count", count, NULL},
        {"count", NULL, frames},
    };
    cl_job job = {.pass = &rl_pass_taa,
                  .frame = f,
                  .params = &params,
                  .materials = materials,
                  .materials_bytes = sizeof materials,
                  .images = images,
                  .n_images = 10};
    rl_energy e;
    assert_true(cl_run(sss_session, &job));
    rl_energy_read(sums, 1, &e);
    void *all[] = {depth, count, out, frames, sums, ids};
    for (size_t i = 0; i < 6; i++)
        rl_free(all[i]);
    return e;
}

static void test_taa(void **state)
{
    (void)state;
    frame_t f;
    uint32_t seed = 1;
    cl_frame(&f, 3, 2, 90, 40, 100);
    f.history = 1;
    f.materials = 2;
    f.previous = f.camera;
    size_t n = (size_t)f.columns * (size_t)f.rows;
    float *color = sss_planes(3 * n), *history = sss_planes(3 * n);
    for (int varied = 0; varied < 2; varied++) {
        double in[3] = {0}, more[3] = {0};
        for (size_t c = 0; c < 3; c++)
            for (int y = f.valid[1]; y < f.valid[3]; y++)
                for (int x = f.valid[0]; x < f.valid[2]; x++) {
                    size_t i = c * n + (size_t)y * (size_t)f.columns + (size_t)x;
                    const int pattern[3] = {x + y, x, y};
                    color[i] = varied ? (float)(pattern[c] & 1) : 0.5f; /* a wide box or none */
                    history[i] = 0.3f + 0.3f * sss_random(&seed);
                    in[c] += (double)color[i];
                    more[c] += 0.75 * (double)(history[i] - color[i]);
                }
        rl_energy e = run_taa(&f, color, history);
        for (int c = 0; c < 3; c++) {
            assert_true(fabs(e.in[c] - in[c]) < 1e-5 * in[c] && e.border[c] == 0 && e.off_screen[c] == 0);
            assert_true(fabs(e.redistributed[c] - more[c]) < 1e-5 * in[c]);
            assert_true(fabs(e.clamped[c] - (varied ? 0 : more[c])) < 1e-5 * in[c]);
            assert_true(fabs(e.out[c] - (in[c] + (varied ? more[c] : 0))) < 1e-5 * in[c]);
        }
        assert_true(rl_energy_open(&e) < 1e-6 && e.pixels == 90 * 40);
    }
    rl_free(color);
    rl_free(history);
}

/* Words of the ledger. */
static void test_figures(void **state)
{
    (void)state;
    rl_energy e = {.in = {2, 1, 0}, .out = {1, 1.1, 0}};
    assert_true(fabs(rl_energy_imbalance(&e) - 0.5) < 1e-12);
    e.border[0] = 1.5;
    e.redistributed[0] = 0.5;
    assert_true(fabs(rl_energy_open(&e) - 0.1) < 1e-12);
    e.clamped[1] = -0.1;
    assert_true(rl_energy_open(&e) < 1e-12);
    e.out[2] = 1;
    assert_true(isinf(rl_energy_imbalance(&e)));
}

/* Rows of a node: the whole, materials that have something; memory that runs out leaves the ledger alone. */
static void test_ledger(void **state)
{
    (void)state;
    rl_energy_ledger ledger = {0};
    rl_energy_row about = {.variant = 2, .node = "sss", .frame = 7};
    rl_error err = {0};
    float *sums = rl_calloc(RL_SUM_FLOATS, sizeof *sums);
    assert_non_null(sums);
    for (size_t band = 0; band < RL_BANDS; band++) {
        float *m = sums + 2 * (band * RL_SUM_MATERIALS + 3) * RL_SUM_VALUES;
        m[2 * ENERGY_OUT] = 1;
        m[2 * ENERGY_OUT + 1] = 1e-9f;
        m[2 * ENERGY_PIXELS] = 4;
        m[-2 * RL_SUM_VALUES + 2 * ENERGY_PIXELS] = 1; /* material 2: pixels without light */
    }
    rl_alloc_fail_at(1, 0);
    assert_int_equal(rl_energy_ledger_add(&ledger, &about, sums, 5, &err), RL_E_MEMORY);
    rl_alloc_fail_at(0, 0);
    assert_int_equal(ledger.n, 0);
    for (int i = 0; i < 40; i++)
        assert_int_equal(rl_energy_ledger_add(&ledger, &about, sums, 5, &err), RL_OK);
    assert_int_equal(ledger.n, 80);
    const rl_energy_row *all = &ledger.rows[78], *one = &ledger.rows[79];
    assert_true(all->material == RL_ENERGY_ALL && one->material == 3 && one->variant == 2 && one->frame == 7);
    assert_true(one->energy.pixels == 4 * RL_BANDS && all->energy.pixels == 5 * RL_BANDS);
    assert_true(fabs(one->energy.out[0] - RL_BANDS * (1 + 1e-9)) < 1e-12);
    rl_energy_ledger_free(&ledger);
    assert_null(ledger.rows);
    rl_free(sums);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_taa),
        cmocka_unit_test(test_figures),
        cmocka_unit_test(test_ledger),
    };
    return cmocka_run_group_tests(tests, sss_open, sss_close);
}
