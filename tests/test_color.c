/* Colour: the programs that relit generates against OpenColorIO's own CPU path, for the configuration that
 * ships. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "graph/base/alloc.h"
#include "graph/base/pool.h"
#include "tests/color_help.h"
#include "tests/tool_run.h"

#define CONFIG "configs/color/relit.ocio"

static rl_ocio *config;

static int setup(void **state)
{
    (void)state;
    return color_help_start() && rl_ocio_open(CONFIG, &config, NULL) == RL_OK ? 0 : -1;
}

static int teardown(void **state)
{
    (void)state;
    rl_ocio_free(&config);
    color_help_stop();
    return 0;
}

/* ---- the configuration that ships -------------------------------------------------------------------- */

static void test_views_match(void **state)
{
    static const rl_ocio_request requests[] = {
        {.from = "ACEScg", .display = "sRGB", .view = "ACES"},
        {.from = "lin_rec709", .display = "sRGB", .view = "ACES"},
        {.from = "lin_rec709", .display = "Rec.709", .view = "ACES"},
        {.from = "ACES2065-1", .display = "Rec.709", .view = "Un-tone-mapped"},
    };
    (void)state;
    for (size_t i = 0; i < sizeof requests / sizeof *requests; i++) {
        rl_arena arena = {0};
        rl_color_pass pass = color_make_pass(config, &requests[i], &arena, NULL);
        assert_non_null(pass.pass);
        assert_false(pass.baked);
        difference d = color_compare(config, &requests[i], pass.pass, -0.1, 20);
        print_message("# %s to %s, %s: off by at most %.2g (%.2g where a display clips)\n", requests[i].from,
                      requests[i].display, requests[i].view, d.absolute, d.clipped);
        assert_true(d.absolute <= 1e-4);
        assert_true(d.clipped * 255 <= 0.5);
        rl_arena_free(&arena);
    }
}

static void test_spaces_match(void **state)
{
    static const rl_ocio_request requests[] = {
        {.from = "lin_rec709", .to = "ACEScg"},
        {.from = "lin_rec709", .to = "ACEScct"},
        {.from = "srgb_texture", .to = "lin_rec709"},
    };
    (void)state;
    for (size_t i = 0; i < sizeof requests / sizeof *requests; i++) {
        rl_arena arena = {0};
        rl_color_pass pass = color_make_pass(config, &requests[i], &arena, NULL);
        difference d = color_compare(config, &requests[i], pass.pass, -0.1, 20);
        print_message("# %s to %s: off by at most %.2g relative\n", requests[i].from, requests[i].to,
                      d.relative);
        assert_true(d.relative <= 3e-6);
        rl_arena_free(&arena);
    }
}

/* No transform that the shipped config can be asked for needs a table. */
static void test_config_is_whole(void **state)
{
    rl_arena arena = {0};
    rl_ocio_names spaces, displays, views;
    (void)state;
    assert_int_equal(rl_ocio_validate(config, NULL), RL_OK);
    assert_int_equal(rl_ocio_list_names(config, RL_OCIO_SPACES, NULL, &arena, &spaces, NULL), RL_OK);
    assert_int_equal(rl_ocio_list_names(config, RL_OCIO_DISPLAYS, NULL, &arena, &displays, NULL), RL_OK);
    assert_int_equal(spaces.n, 9);
    assert_int_equal(displays.n, 2);
    for (size_t i = 0; i < spaces.n; i++) {
        for (size_t k = 0; k < spaces.n; k++)
            assert_false(color_make_pass(config,
                                         &(rl_ocio_request){.from = spaces.names[i], .to = spaces.names[k]},
                                         &arena, NULL)
                             .baked);
        for (size_t d = 0; d < displays.n; d++) {
            assert_int_equal(
                rl_ocio_list_names(config, RL_OCIO_VIEWS, displays.names[d], &arena, &views, NULL), RL_OK);
            assert_int_equal(views.n, 3);
            for (size_t v = 0; v < views.n; v++) {
                rl_ocio_request request = {
                    .from = spaces.names[i], .display = displays.names[d], .view = views.names[v]};
                assert_false(color_make_pass(config, &request, &arena, NULL).baked);
            }
        }
    }
    rl_arena_free(&arena);
}

/* Every allocation fails once: an error or, where it was not needed, the same program; no crash, no leak. */
static void test_out_of_memory(void **state)
{
    static const rl_ocio_request request = {.from = "ACEScg", .display = "sRGB", .view = "ACES"};
    rl_arena kept = {0};
    rl_color_pass want = color_make_pass(config, &request, &kept, NULL);
    int failures = 0;
    (void)state;
    for (unsigned long n = 1; n < 300; n++) {
        rl_arena arena = {0};
        rl_color_pass pass;
        rl_alloc_fail_at(n, 0);
        rl_code code = rl_color_pass_new(config, &request, false, RL_NOWHERE, &arena, NULL, &pass, NULL);
        rl_alloc_fail_at(0, 0);
        if (code == RL_OK)
            assert_string_equal(pass.pass->kernel_text, want.pass->kernel_text);
        else
            assert_int_equal(code, RL_E_MEMORY);
        failures += code != RL_OK;
        rl_arena_free(&arena);
    }
    print_message("# %d allocations\n", failures);
    assert_true(failures > 20);
    rl_arena_free(&kept);
}

static void test_no_change_no_pass(void **state)
{
    static const rl_ocio_request raw = {.from = "lin_rec709", .display = "sRGB", .view = "Raw"};
    static const rl_ocio_request same = {.from = "lin_rec709", .to = "linear"};
    rl_arena arena = {0};
    (void)state;
    assert_null(color_make_pass(config, &raw, &arena, NULL).pass);
    rl_color_pass pass = color_make_pass(config, &same, &arena, NULL);
    assert_null(pass.pass);
    assert_string_equal(pass.note, "the transform changes nothing");
    rl_arena_free(&arena);
}

static void test_exposure(void **state)
{
    static const rl_ocio_request same = {.from = "lin_rec709", .to = "lin_rec709"};
    float *in = rl_malloc(6 * N * sizeof *in), *out = in + 3 * N;
    rl_arena arena = {0};
    rl_color_pass pass;
    (void)state;
    assert_int_equal(rl_color_pass_new(config, &same, true, RL_NOWHERE, &arena, NULL, &pass, NULL), RL_OK);
    assert_non_null(pass.pass);
    color_fill(in, -0.1, 20);
    static const float stops[] = {-2, 0, 1, 0.5f};
    for (size_t s = 0; s < sizeof stops / sizeof *stops; s++) {
        color_run(pass.pass, stops[s], in, out);
        for (int i = 0; i < 3 * N; i++)
            assert_true(fabs(out[i] - in[i] * exp2(stops[s])) <= 4e-7 * fabs(out[i]));
    }
    rl_free(in);
    rl_arena_free(&arena);
}

static void test_same_bits(void **state)
{
    static const rl_ocio_request request = {.from = "ACEScg", .display = "sRGB", .view = "ACES"};
    float *in = rl_malloc(9 * N * sizeof *in), *a = in + 3 * N, *b = a + 3 * N;
    rl_arena arena = {0};
    (void)state;
    color_fill(in, -0.1, 20);
    rl_color_pass first = color_make_pass(config, &request, &arena, NULL);
    rl_color_pass second = color_make_pass(config, &request, &arena, NULL);
    assert_string_equal(first.pass->kernel_text, second.pass->kernel_text);
    color_run(first.pass, 0, in, a);
    color_run(second.pass, 0, in, b);
    assert_memory_equal(a, b, 3 * N * sizeof *a);
    rl_free(in);
    rl_arena_free(&arena);
}

/* Rows of one image, converted on several threads with one transform. */
typedef struct conversion {
    const rl_ocio_transform *transform;
    float *planes;
} conversion;

static void convert_row(void *ctx, int y)
{
    const conversion *c = ctx;
    float *row = c->planes + y * COLUMNS;
    if (rl_ocio_apply(c->transform, row, row + N, row + 2 * N, COLUMNS, NULL) != RL_OK)
        row[0] = -1000;
}

static void test_rows_on_threads(void **state)
{
    static const rl_ocio_request request = {.from = "srgb_texture", .to = "ACEScg"};
    float *a = rl_malloc(6 * N * sizeof *a), *b = a + 3 * N;
    rl_ocio_transform *transform = NULL;
    rl_pool *pool = NULL;
    (void)state;
    color_fill(a, 0, 1);
    memcpy(b, a, 3 * N * sizeof *a);
    assert_int_equal(rl_ocio_transform_new(config, &request, &transform, NULL), RL_OK);
    assert_int_equal(rl_ocio_apply(transform, a, a + N, a + 2 * N, N, NULL), RL_OK);
    assert_int_equal(rl_pool_new(4, &pool, NULL), RL_OK);
    rl_pool_for(pool, ROWS, convert_row, &(conversion){transform, b});
    assert_memory_equal(a, b, 3 * N * sizeof *a);
    rl_pool_free(&pool);
    rl_ocio_transform_free(&transform);
    rl_free(a);
}

/* ---- names and primaries ----------------------------------------------------------------------------- */

static void test_names(void **state)
{
    const char *space;
    (void)state;
    static const char *const aliases[] = {
        "lin_srgb",
        "lin_rec709",
        "sRGB",
        "srgb_texture",
        "acescg",
        "ACEScg",
        "aces",
        "ACES2065-1",
        "data",
        "raw",
        "ap1",
        "ACEScg",
        "scene_linear",
        "lin_rec709",
        "linear",
        "lin_rec709",
        "ap0",
        "ACES2065-1",
        "default",
        "lin_rec709",
        "aces_interchange",
        "ACES2065-1",
        "cie_xyz_d65_interchange",
        "CIE-XYZ-D65",
    };
    for (size_t i = 0; i < sizeof aliases / sizeof *aliases; i += 2) {
        assert_int_equal(rl_color_space(config, aliases[i], RL_NOWHERE, &space, NULL), RL_OK);
        assert_string_equal(space, aliases[i + 1]);
    }
    assert_int_equal(rl_color_working(config, RL_NOWHERE, &space, NULL), RL_OK);
    assert_string_equal(space, "lin_rec709");
    assert_int_equal(rl_color_view(config, "Rec.709", "Un-tone-mapped", NULL, RL_NOWHERE, NULL), RL_OK);
}

static void test_unknown_names(void **state)
{
    static const rl_where where = {"p.yaml", 3, 7};
    const char *space;
    rl_error err = {0};
    (void)state;
    assert_int_equal(rl_color_space(config, "ACESgc", where, &space, &err), RL_E_CONFIG);
    assert_non_null(strstr(err.text, "did you mean 'ACEScg'?"));
    assert_int_equal(err.line, 3);
    err = (rl_error){0};
    assert_int_equal(rl_color_view(config, "srgb", "ACES", NULL, where, &err), RL_E_CONFIG);
    assert_non_null(strstr(err.text, "no display 'srgb'; did you mean 'sRGB'? known: Rec.709, sRGB"));
    err = (rl_error){0};
    assert_int_equal(rl_color_view(config, "sRGB", "Un-tonemapped", NULL, where, &err), RL_E_CONFIG);
    assert_non_null(strstr(err.text, "no view 'Un-tonemapped'; did you mean 'Un-tone-mapped'?"));
    err = (rl_error){0};
    assert_int_equal(rl_color_view(config, "sRGB", "ACES", "film", where, &err), RL_E_CONFIG);
    assert_non_null(strstr(err.text, "no look 'film'"));
    rl_ocio *none = NULL;
    err = (rl_error){0};
    assert_int_equal(rl_ocio_open("no/such.ocio", &none, &err), RL_E_IO);
    assert_null(none);
    assert_string_equal(err.file, "no/such.ocio");
}

/* One with other names for its spaces still has lin_rec709, the same one; one without the role cannot. */
static void test_rec709_of_others(void **state)
{
    (void)state;
    static const char *const changes[][2] = {
        {"name: lin_rec709", "name: other"},                              /* ACES2065-1 is the reference */
        {"aces_interchange: ACES2065-1", "aces_interchange: aces_of_it"}, /* …or leads to it */
        {"aces_interchange: ACES2065-1", "matte: raw"}};
    static const char added[] =
        "\n  - !<ColorSpace>\n    name: aces_of_it\n    encoding: scene-linear\n"
        "    from_scene_reference: !<MatrixTransform> {matrix: [2, 0, 0, 0, 0, 2, 0, 0, "
        "0, 0, 2, 0, 0, 0, 0, 1]}\n";
    size_t size;
    char *folder = folder_new(), *path = path_in(folder, "other.ocio"), *own = file_read(CONFIG, &size);
    for (int i = 0; i < 3; i++) {
        char *renamed = text_replace(own, changes[0][0], changes[0][1]);
        char *changed = i ? text_replace(renamed, changes[i][0], changes[i][1]) : strdup(renamed);
        char *text = malloc(strlen(changed) + sizeof added);
        strcat(strcpy(text, changed), added);
        char *roles = text_replace(text, "scene_linear: lin_rec709", "scene_linear: ACEScg");
        file_write(folder, "other.ocio", roles, strlen(roles));
        rl_ocio *theirs = NULL;
        rl_ocio_transform *a = NULL, *b = NULL;
        const rl_ocio_request request = {.from = "lin_rec709", .to = "ACES2065-1"};
        float x[3][2] = {{0.5f, 0.5f}, {0.25f, 0.25f}, {2, 2}};
        assert_int_equal(rl_ocio_open(path, &theirs, NULL), RL_OK);
        assert_true((rl_ocio_space(theirs, "lin_rec709") != NULL) == (i < 2));
        if (i < 2) {
            assert_int_equal(rl_ocio_transform_new(config, &request, &a, NULL), RL_OK);
            assert_int_equal(rl_ocio_transform_new(theirs, &request, &b, NULL), RL_OK);
            assert_int_equal(rl_ocio_apply(a, &x[0][0], &x[1][0], &x[2][0], 1, NULL), RL_OK);
            assert_int_equal(rl_ocio_apply(b, &x[0][1], &x[1][1], &x[2][1], 1, NULL), RL_OK);
            for (int c = 0; c < 3; c++) /* the second's ACES2065-1 is half of what it calls so */
                assert_true(fabsf(x[c][1] * (i ? 2 : 1) - x[c][0]) <= 2e-6f);
        }
        rl_ocio_transform_free(&a);
        rl_ocio_transform_free(&b);
        rl_ocio_free(&theirs);
        free(renamed);
        free(changed);
        free(text);
        free(roles);
    }
    free(path);
    free(own);
    folder_remove(folder);
}

static void test_primaries(void **state)
{
    static const double rec709[8] = {0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290};
    rl_primaries p;
    (void)state;
    assert_int_equal(rl_color_primaries(config, "linear", RL_NOWHERE, &p, NULL), RL_OK);
    assert_true(p.known);
    assert_string_equal(p.name, "Rec.709");
    assert_memory_equal(p.xy, rec709, sizeof rec709);
    assert_int_equal(rl_color_primaries(config, "ACEScg", RL_NOWHERE, &p, NULL), RL_OK);
    assert_string_equal(p.name, "ACES AP1");
    static const char *const others[] = {"sRGB", "raw", "ACEScct", "srgb_display"};
    for (size_t i = 0; i < sizeof others / sizeof *others; i++) {
        assert_int_equal(rl_color_primaries(config, others[i], RL_NOWHERE, &p, NULL), RL_OK);
        assert_false(p.known);
    }
}

static void test_unnamed_primaries(void **state)
{
    char folder[] = "/tmp/relit_color_XXXXXX";
    rl_primaries p;
    (void)state;
    assert_non_null(mkdtemp(folder));
    /* Red and green are swapped against AP0, which no well known set does. */
    rl_ocio *ocio =
        color_config(folder, "!<MatrixTransform> {matrix: [0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}");
    assert_int_equal(rl_color_primaries(ocio, "b", RL_NOWHERE, &p, NULL), RL_OK);
    assert_false(p.known); /* no role aces_interchange */
    rl_ocio_free(&ocio);
    color_remove_folder(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_views_match),
        cmocka_unit_test(test_spaces_match),
        cmocka_unit_test(test_config_is_whole),
        cmocka_unit_test(test_out_of_memory),
        cmocka_unit_test(test_no_change_no_pass),
        cmocka_unit_test(test_exposure),
        cmocka_unit_test(test_same_bits),
        cmocka_unit_test(test_rows_on_threads),
        cmocka_unit_test(test_names),
        cmocka_unit_test(test_unknown_names),
        cmocka_unit_test(test_rec709_of_others),
        cmocka_unit_test(test_primaries),
        cmocka_unit_test(test_unnamed_primaries),
    };
    return cmocka_run_group_tests_name("color", tests, setup, teardown);
}
