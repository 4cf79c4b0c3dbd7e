/* What sss_burley and sss_reference promise: energy, borders, detail, the same bits. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "graph/base/alloc.h"
#include "tests/sss_scene.h"

/* Flat and evenly lit: the filter changes nothing, and the way out is that of the unfiltered surface. Black
 * borders (occlude) take from what is near the edge, so there it is looked at in the middle. */
static void energy_is_kept(void **state)
{
    (void)state;
    static const int taps[] = {0, AUTO, 1, 21, 55, 4096};
    for (uint32_t id = 1; id < 6; id++)
        for (size_t t = 0; t < 6; t++) {
            sss_scene s = sss_scene_make(3, 1, 180, 110, 60);
            if (!sss_materials[id].has_profile)
                goto next;
            sss_scene_flat(&s, id, 0.3f, 0.7f);
            if (taps[t])
                sss_run_burley(&s, taps[t], t & 1 ? AREA : PLAIN);
            else
                sss_run_reference(&s, PLAIN);
            SSS_EACH_PIXEL(&s, x, y, i)
            {
                double unfiltered[3] = {0.7f, 0.7f, 0.7f}, color[3];
                int edge = x < 60 || y < 40 || x > 120 || y > 70;
                if (sss_materials[id].border == 1 && edge)
                    continue;
                twin_resolve(&s.twin, x, y, unfiltered, color);
                for (size_t c = 0; c < 3; c++)
                    assert_true(fabs(s.color[c * s.n + i] - color[c]) <= 1e-4 * color[c]);
            }
        next:
            sss_scene_free(&s);
        }
}

/* An occluding border darkens, half of the light at a straight edge. */
static void occlusion_is_black(void **state)
{
    (void)state;
    sss_scene s = sss_scene_make(0, 0, 192, 128, 300);
    sss_scene_flat(&s, 5, 0.3f, 1);
    SSS_EACH_PIXEL(&s, x, y, i)
    {
        s.stencil[i] = x < 96 ? 5 : 3;
    }
    sss_run_reference(&s, PLAIN);
    size_t edge = 64 * (size_t)s.twin.frame.columns + 95;
    float at_edge = s.filtered[edge], inside = s.filtered[edge - 60];
    assert_true(at_edge > 0.5f && at_edge < 0.75f);
    assert_true(inside > 0.995f);
    sss_run_burley(&s, 1024, PLAIN);
    assert_true(fabsf(s.filtered[edge] - at_edge) < 0.01f);
    sss_scene_free(&s);
}

/* Every material keeps its own light, whatever lies beside it: noisy borders, jumps in depth, nothing at all.
 */
static void materials_never_leak(void **state)
{
    (void)state;
    sss_scene s = sss_scene_make(37, 11, 150, 61, 400);
    sss_scene_random(&s, 5);
    int32_t border[6];
    for (int id = 0; id < 6; id++) {
        border[id] = sss_materials[id].border;
        sss_materials[id].border = 0;
    }
    static const float light[6] = {1e30f, 1, 1000, 1e30f, 1e-3f, 7};
    SSS_EACH_PIXEL(&s, x, y, i)
    {
        for (size_t c = 0; c < 3; c++)
            s.diffuse[c * s.n + i] = light[s.stencil[i]];
    }
    for (int pass = 0; pass < 3; pass++) {
        if (pass == 0)
            sss_run_reference(&s, AREA);
        else
            sss_run_burley(&s, pass == 1 ? 21 : 200, PLAIN);
        SSS_EACH_PIXEL(&s, x, y, i)
        {
            for (size_t c = 0; c < 3 && sss_materials[s.stencil[i]].has_profile; c++)
                assert_true(fabsf(s.filtered[c * s.n + i] / light[s.stencil[i]] - 1) < 1e-5f);
        }
    }
    for (int id = 0; id < 6; id++)
        sss_materials[id].border = border[id];
    sss_scene_free(&s);
}

static void nothing_to_scatter(void **state)
{
    (void)state;
    sss_scene s = sss_scene_make(2, 2, 100, 30, 300);
    sss_scene_flat(&s, 3, 0.5f, 0);
    SSS_EACH_PIXEL(&s, x, y, i)
    {
        if (x < 50)
            s.stencil[i] = 0;
        s.lit[i] = (float)i;
    }
    sss_run_burley(&s, AUTO, AREA);
    assert_memory_equal(s.color, s.lit, 3 * s.n * sizeof *s.lit);
    memset(s.color, 0, 3 * s.n * sizeof *s.color);
    sss_run_reference(&s, AREA);
    assert_memory_equal(s.color, s.lit, 3 * s.n * sizeof *s.lit);
    sss_scene_free(&s);
}

/* `auto` at radius rho pixels must be the blend of the forced patterns that DESIGN states. */
static void detail_blends(void **state)
{
    (void)state;
    static const struct {
        float rho, some, many;
    } at[] = {{0.3f, 0, 0}, {0.45f, 0, 0},   {0.475f, 0.25f, 0}, {0.5f, 0.5f, 0}, {0.55f, 1, 0}, {1.2f, 1, 0},
              {1.8f, 1, 0}, {2.0f, 1, 0.5f}, {2.1f, 1, 0.75f},   {2.2f, 1, 1},    {40, 1, 1}};
    for (size_t k = 0; k < sizeof at / sizeof *at; k++) {
        sss_scene s = sss_scene_make(0, 0, 70, 40, 100);
        sss_scene_flat(&s, 1, 16.5644f * 0.003f * 100 / at[k].rho, 1);
        uint32_t seed = 3;
        for (size_t i = 0; i < 3 * s.n; i++)
            s.diffuse[i] = sss_random(&seed);
        float *few = sss_planes(3 * s.n), *many = sss_planes(3 * s.n);
        sss_run_burley(&s, 21, PLAIN);
        memcpy(few, s.filtered, 3 * s.n * sizeof *few);
        sss_run_burley(&s, 55, PLAIN);
        memcpy(many, s.filtered, 3 * s.n * sizeof *many);
        sss_run_burley(&s, AUTO, PLAIN);
        SSS_EACH_PIXEL(&s, x, y, i)
        {
            for (size_t c = 0; c < 3; c++) {
                size_t j = c * s.n + i;
                float want = few[j] + at[k].many * (many[j] - few[j]);
                want = s.diffuse[j] + at[k].some * (want - s.diffuse[j]);
                assert_true(fabsf(s.filtered[j] - want) < 1e-4f);
            }
        }
        rl_free(few);
        rl_free(many);
        sss_scene_free(&s);
    }
}

/* The same bits from one thread, from all, and again; other seeds and frames turn the pattern. */
static void bits_do_not_depend_on_threads(void **state)
{
    (void)state;
    cl_session *one = cl_open(1);
    assert_non_null(one);
    sss_scene s = sss_scene_make(37, 11, 300, 161, 400);
    sss_scene_random(&s, 5);
    size_t bytes = 3 * s.n * sizeof(float);
    float *first = sss_planes(3 * s.n);
    sss_burley_params p = {AUTO, TANGENT, AREA, TWIN_BLUE, 0};
    sss_run(&s, &rl_pass_sss_burley, &p, sss_session);
    memcpy(first, s.color, bytes);
    sss_run(&s, &rl_pass_sss_burley, &p, one);
    assert_memory_equal(first, s.color, bytes);
    sss_run(&s, &rl_pass_sss_burley, &p, sss_session);
    assert_memory_equal(first, s.color, bytes);
    p.seed = 1;
    sss_run(&s, &rl_pass_sss_burley, &p, sss_session);
    assert_memory_not_equal(first, s.color, bytes);
    p.seed = 0;
    s.twin.frame.number++;
    sss_run(&s, &rl_pass_sss_burley, &p, sss_session);
    assert_memory_not_equal(first, s.color, bytes);
    p.rotation = TWIN_STILL;
    sss_run(&s, &rl_pass_sss_burley, &p, sss_session);
    memcpy(first, s.color, bytes);
    s.twin.frame.number++;
    sss_run(&s, &rl_pass_sss_burley, &p, sss_session);
    assert_memory_equal(first, s.color, bytes);
    const sss_reference_params r = {SCREEN, PLAIN};
    sss_run(&s, &rl_pass_sss_reference, &r, sss_session);
    memcpy(first, s.color, bytes);
    sss_run(&s, &rl_pass_sss_reference, &r, one);
    assert_memory_equal(first, s.color, bytes);
    rl_free(first);
    sss_scene_free(&s);
    cl_close(&one);
}

/* A pixel's bits depend on what is around it, not on where the data window starts: the same picture, cropped
 * by rows and columns that nothing within reach comes from. */
static void crop_gives_the_same_bits(void **state)
{
    (void)state;
    sss_scene whole = sss_scene_make(0, 0, 320, 96, 60), part = sss_scene_make(64, 8, 192, 72, 60);
    sss_scene_random(&whole, 12);
    sss_scene_crop(&part, &whole);
    sss_run_burley(&whole, 55, AREA);
    sss_run_burley(&part, 55, AREA);
    sss_crop_is_same(&part, &whole, 64, 16);
    sss_scene_free(&whole);
    sss_scene_free(&part);
}

/* Patterns for a number of taps and for `auto`, once for materials whose channels are alike; memory that runs
 * out is an error, not a crash. */
static void tables_are_made(void **state)
{
    (void)state;
    rl_arena arena = {0}, kept = {0};
    rl_tables tables;
    rl_error err = {0};
    rl_materials materials;
    sss_burley_params p = {.taps = 100};
    rl_pass_input in = {.params = &p, .materials = &materials};
    twin_material alike[4] = {sss_materials[0], sss_materials[1], sss_materials[2], sss_materials[1]};
    for (int c = 0; c < 3; c++)
        alike[3].scatter_distance_mm[c] *= 2;
    const cl_job job = {.pass = &rl_pass_sss_burley, .materials = alike, .materials_bytes = sizeof alike};
    assert_true(cl_read_materials(&job, &kept, &materials));
    assert_int_equal(rl_pass_sss_burley.tables(&in, &arena, &tables, &err), RL_OK);
    assert_int_equal(tables.n, 512 + 4 + 2 * 15 * (3 * 128 + 3));
    assert_true(fabsf(hypotf(tables.data[100], tables.data[101]) - 1) < 1e-6f);
    assert_true(tables.data[512 + 1] == 516 && tables.data[512 + 3] == 516);
    assert_true(tables.data[512 + 2] == 516 + 15 * (3 * 128 + 3));
    p.taps = AUTO;
    assert_int_equal(rl_pass_sss_burley.tables(&in, &arena, &tables, &err), RL_OK);
    assert_int_equal(tables.n, 512 + 4 + 2 * 15 * 2 * (3 * 64 + 3));
    for (p.taps = 1; p.taps <= 4096; p.taps += p.taps < 200 ? 1 : 61) {
        assert_int_equal(rl_pass_sss_burley.tables(&in, &arena, &tables, &err), RL_OK);
        assert_true(tables.n * sizeof(float) <= 2 * 51200);
        for (size_t i = 0; i < tables.n; i++)
            assert_true(isfinite(tables.data[i]));
        rl_arena_free(&arena);
    }
    rl_arena_free(&arena);
    rl_alloc_fail_at(1, 1);
    assert_int_equal(rl_pass_sss_burley.tables(&in, &arena, &tables, &err), RL_E_MEMORY);
    rl_alloc_fail_at(0, 0);
    assert_int_equal(err.code, RL_E_MEMORY);
    rl_arena_free(&arena);
    rl_arena_free(&kept);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(energy_is_kept),
        cmocka_unit_test(occlusion_is_black),
        cmocka_unit_test(materials_never_leak),
        cmocka_unit_test(nothing_to_scatter),
        cmocka_unit_test(detail_blends),
        cmocka_unit_test(bits_do_not_depend_on_threads),
        cmocka_unit_test(crop_gives_the_same_bits),
        cmocka_unit_test(tables_are_made),
    };
    return cmocka_run_group_tests(tests, sss_open, sss_close);
}
