/* Variants in one run: the same bits as runs of their own, shared work done once, frames read again only
 * where they must be. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "graph/run/exr.h"
#include "graph/run/experiment.h"
#include "tests/small_capture.h"
#include "tests/tool_run.h"

/* ---- variants -------------------------------------------------------------------------------------------
 */

typedef struct change {
    const char *name;
    rl_setting settings[2];
    size_t n;
    const char *shares[3]; /* nodes that are the first variant's too; the others are not */
    bool apart;            /* reads frames on its own */
} change;

/* The first is what the others are compared with. */
static const change changes[] = {
    {"base", {{0}}, 0, {"light", "sss", "aa"}, false},
    {"same", {{"profiles.skin.scatter_distance_mm", "[3, 1.2, 0.7]"}}, 1, {"light", "sss", "aa"}, false},
    {"taps", {{"graph.sss.taps", "55"}}, 1, {"light"}, false},
    {"blend", {{"graph.aa.blend", "0.2"}}, 1, {"light", "sss"}, false},
    {"wide", {{"profiles.skin.scatter_distance_mm", "[6, 2.4, 1.4]"}}, 1, {0}, false}, /* transmission */
    {"rough", {{"materials.default.roughness", "0.9"}}, 1, {0}, false},
    {"lambert", {{"shading.diffuse", "lambert"}}, 1, {0}, false},
    {"sky", {{"ambient", "{sh: [[0.3, 0.3, 0.5], 0, 0, 0, 0, 0, 0, 0, 0]}"}}, 1, {0}, false},
    {"dim",
     {{"lights", "{key: {type: point, position: [0.1, 0.2, 0.5], intensity: [1, 1, 1]}}"}},
     1,
     {0},
     false},
    {"bare",
     {{"lights", "{key: {type: point, position: [0.1, 0.2, 0.5], intensity: [2, 1.9, 1.8], shadow: none}}"}},
     1,
     {0},
     true},
    {"ids", {{"materials.plaster", "{}"}, {"materials.default", "null"}}, 2, {0}, true},
};
enum { N = sizeof changes / sizeof *changes };

static void fill_variants(rl_variant *variants)
{
    for (size_t i = 0; i < N; i++)
        variants[i] = (rl_variant){.name = changes[i].name,
                                   .pipeline = small_pipe,
                                   .settings = changes[i].settings,
                                   .n_settings = changes[i].n,
                                   .files = true};
}

static rl_experiment *open_all(const rl_options *options, const rl_variant *variants, size_t n)
{
    rl_error err = {0};
    rl_experiment *x = NULL;
    if (rl_experiment_open(options, variants, n, &x, &err))
        fail_msg("%s:%d: %s", err.file, err.line, err.text);
    return x;
}

/* A run of its own, to be compared with; {variant} is nothing there. */
static void run_alone(const change *c, const char *out)
{
    rl_options options = {
        .pipeline = small_pipe, .out = out, .threads = 2, .settings = c->settings, .n_settings = c->n};
    rl_error err = {0};
    rl_session *s = NULL;
    rl_run_summary summary;
    if (rl_session_open(&options, &s, &err) || rl_session_run(s, NULL, &summary, &err))
        fail_msg("%s: %s", c->name, err.text);
    assert_int_equal(summary.failed, 0);
    rl_session_close(&s);
}

static void assert_same_file(const char *a, const char *b, const char *name)
{
    char *pa = path_in(a, name), *pb = path_in(b, name);
    size_t na, nb;
    char *da = file_read(pa, &na), *db = file_read(pb, &nb);
    if (na != nb || memcmp(da, db, na))
        fail_msg("%s and %s differ", pa, pb);
    free(da);
    free(db);
    free(pa);
    free(pb);
}

/* ---- tests ----------------------------------------------------------------------------------------------
 */

typedef struct seen {
    rl_experiment *x;
    int frames;
    float linear[N][SMALL_WIDTH * SMALL_HEIGHT]; /* red of the last frame */
    uint32_t ids[SMALL_WIDTH * SMALL_HEIGHT];
} seen;

static rl_code on_frame(void *ctx, const rl_experiment_frame *f, rl_error *err)
{
    seen *s = ctx;
    (void)err;
    assert_int_equal(f->error->code, RL_OK);
    assert_int_equal(f->index, s->frames);
    assert_int_equal(f->frame, ++s->frames);
    assert_int_equal(f->done, s->frames);
    assert_true(f->width == SMALL_WIDTH && f->height == SMALL_HEIGHT && f->total == SMALL_FRAMES);
    for (size_t v = 0; v < rl_experiment_variants(s->x); v++) {
        assert_int_equal(f->n_files[v], SMALL_OUTPUTS);
        for (int k = 0; k < RL_COMPARED; k++)
            assert_true(f->images[v][k].width == SMALL_WIDTH && f->images[v][k].plane[2]);
        for (int y = 0; y < SMALL_HEIGHT; y++)
            for (int i = 0; i < SMALL_WIDTH; i++) {
                const rl_compared_image *image = &f->images[v][RL_COMPARED_LINEAR];
                s->linear[v][y * SMALL_WIDTH + i] = image->plane[0][(size_t)y * image->stride + (size_t)i];
                s->ids[y * SMALL_WIDTH + i] = f->stencil[(size_t)y * f->stencil_stride + (size_t)i];
            }
    }
    return RL_OK;
}

/* ACEScg of a variant's file, red, as linear Rec. 709. */
static void check_linear(const seen *s, size_t variant, const char *out)
{
    static float planes[3][SMALL_WIDTH * SMALL_HEIGHT];
    char *path = path_in(out, "s.0003.exr");
    rl_exr *file = NULL;
    rl_error err = {0};
    assert_int_equal(rl_exr_open(path, 0, &file, &err), RL_OK);
    rl_exr_plane want[3] = {{.channel = "R"}, {.channel = "G"}, {.channel = "B"}};
    for (int c = 0; c < 3; c++) {
        want[c].floats = planes[c];
        want[c].stride = SMALL_WIDTH;
    }
    assert_int_equal(rl_exr_read(file, 0, want, 3, NULL, NULL, &err), RL_OK);
    rl_exr_close(&file);
    for (int i = 0; i < SMALL_WIDTH * SMALL_HEIGHT; i++) { /* AP1 to Rec. 709, D60 to D65 by Bradford */
        double red =
            1.70505 * (double)planes[0][i] - 0.62179 * (double)planes[1][i] - 0.08326 * (double)planes[2][i];
        assert_true(fabs(red - (double)s->linear[variant][i]) < 2e-3 * (1 + fabs(red))); /* of halfs */
    }
    free(path);
}

static void test_same_as_alone(void **state)
{
    (void)state;
    static seen s;
    rl_variant variants[N];
    char *together = path_in(small_folder, "together");
    rl_options options = {.out = together, .threads = 2};
    rl_error err = {0};
    rl_run_summary summary;
    fill_variants(variants);
    s.x = open_all(&options, variants, N);
    rl_experiment_hooks hooks = {.frame = on_frame, .ctx = &s};
    if (rl_experiment_run(s.x, &hooks, &summary, &err))
        fail_msg("%s", err.text);
    assert_int_equal(summary.frames, SMALL_FRAMES);
    assert_int_equal(summary.failed, 0);
    assert_int_equal(s.frames, SMALL_FRAMES);
    rl_experiment_cost cost;
    rl_experiment_cost_of(s.x, &cost);
    assert_true(cost.measured && cost.factor > 1 && cost.factor < cost.sum);
    rl_experiment_close(&s.x);
    for (size_t i = 0; i < N; i++) {
        char *own = path_in(together, changes[i].name), *alone = path_in(small_folder, "alone");
        run_alone(&changes[i], alone);
        for (int frame = 1; frame <= SMALL_FRAMES; frame++) {
            static const char *const before[] = {"", "", "aov/"}, *const behind[] = {"exr", "png", "exr"};
            for (int k = 0; k < 3; k++) {
                char name[64];
                snprintf(name, sizeof name, "%ss.%04d.%s", before[k], frame, behind[k]);
                assert_same_file(own, alone, name);
            }
        }
        check_linear(&s, i, own);
        folder_remove(alone);
        free(own);
    }
    int empty = 0, skin = 0;
    for (int i = 0; i < SMALL_WIDTH * SMALL_HEIGHT; i++) {
        empty += s.ids[i] == 0;
        skin += s.ids[i] == 1;
    }
    assert_true(empty > 100 && skin > 1000);
    folder_remove(together);
}

/* A node of the pipeline that variant `v` uses is the first variant's own exactly where the table says. */
static void test_sharing(void **state)
{
    (void)state;
    static const char *const names[] = {"light", "sss", "aa"};
    rl_variant variants[N];
    rl_options options = {.threads = 1};
    fill_variants(variants);
    rl_experiment *x = open_all(&options, variants, N);
    size_t apart = 0;
    for (size_t v = 1; v < N; v++) {
        apart += changes[v].apart;
        for (int k = 0; k < 3; k++) {
            bool expected = false, shared = false;
            for (int i = 0; i < 3; i++)
                expected |= changes[v].shares[i] && !strcmp(changes[v].shares[i], names[k]);
            rl_merged_node node;
            for (size_t i = 0; rl_experiment_node(x, 0, i, &node); i++)
                shared |= !strcmp(node.name, names[k]) && node.group == 0 && node.used[0] && node.used[v];
            if (shared != expected)
                fail_msg("'%s' %s node '%s'", changes[v].name, shared ? "shares" : "has its own", names[k]);
        }
    }
    assert_int_equal(rl_experiment_groups(x, 0), 1 + apart);
    assert_null(rl_experiment_group_reason(x, 0, 0));
    assert_non_null(strstr(rl_experiment_group_reason(x, 0, 1), "shadow layers"));
    assert_non_null(strstr(rl_experiment_group_reason(x, 0, 2), "stencil ids"));
    size_t n;
    const char *const *materials = rl_experiment_materials(x, 0, &n);
    assert_true(n == 3 && !strcmp(materials[1], "skin"));
    assert_string_equal(rl_experiment_image_name(x, 0, RL_COMPARED_DISPLAY), "sRGB / ACES");
    assert_string_equal(rl_experiment_image_name(x, 0, RL_COMPARED_LINEAR), "aa.color");
    rl_experiment_close(&x);
}

/* One more variant in which nothing differs costs only its writing. */
static void test_predicted_cost(void **state)
{
    (void)state;
    rl_variant variants[3] = {
        {.name = "a", .pipeline = small_pipe},
        {.name = "b", .pipeline = small_pipe},
        {.name = "c", .pipeline = small_pipe, .settings = changes[2].settings, .n_settings = 1}};
    rl_options options = {.threads = 1};
    rl_experiment_cost cost;
    rl_experiment *x = open_all(&options, variants, 2);
    rl_experiment_cost_of(x, &cost);
    assert_false(cost.measured);
    assert_true(fabs(cost.factor - 1) < 1e-9 && fabs(cost.sum - 2) < 1e-9);
    rl_experiment_close(&x);
    x = open_all(&options, variants, 3);
    rl_experiment_cost_of(x, &cost);
    assert_true(cost.factor > 1.05 && cost.factor < 2 && cost.sum > cost.factor);
    rl_experiment_close(&x);
}

static void test_refusals(void **state)
{
    (void)state;
    rl_setting bad = {"graph.sss.tapps", "3"}, frame = {"capture", "nowhere.yaml"};
    rl_variant variants[2] = {{.name = "good", .pipeline = small_pipe},
                              {.name = "bad", .pipeline = small_pipe, .settings = &bad, .n_settings = 1}};
    rl_options options = {.threads = 1}, shard = {.threads = 1, .shard = {1, 2}},
               small = {.memory_limit = 100000};
    rl_error err = {0};
    rl_experiment *x = NULL;
    assert_int_equal(rl_experiment_open(&options, variants, 2, &x, &err), RL_E_CONFIG);
    assert_null(x);
    assert_non_null(strstr(err.text, "variant 'bad': "));
    assert_non_null(strstr(err.text, "taps"));
    err = (rl_error){0};
    assert_int_equal(rl_experiment_open(&shard, variants, 1, &x, &err), RL_E_USAGE);
    err = (rl_error){0};
    assert_int_equal(rl_experiment_open(&small, variants, 1, &x, &err), RL_E_MEMORY);
    err = (rl_error){0};
    assert_int_equal(rl_experiment_open(&options, variants, 0, &x, &err), RL_E_USAGE);
    err = (rl_error){0};
    variants[1].settings = &frame;
    assert_int_not_equal(rl_experiment_open(&options, variants, 2, &x, &err), RL_OK);
}

/* A missing frame is an error of that frame in all variants, and the others are made. */
static void test_missing_frame(void **state)
{
    (void)state;
    char *place = folder_new(), *gone = path_in(place, "s.0002.exr"), *own = path_in(place, "pipe.yaml");
    small_capture_write(place);
    remove(gone);
    rl_variant variants[2] = {
        {.name = "a", .pipeline = own, .files = true},
        {.name = "b", .pipeline = own, .settings = changes[2].settings, .n_settings = 1}};
    char *out = path_in(place, "out"), *a = path_in(out, "a"), *b = path_in(out, "b");
    rl_options options = {.threads = 2, .out = out};
    rl_experiment *x = open_all(&options, variants, 2);
    rl_run_summary summary;
    rl_error err = {0};
    assert_int_equal(rl_experiment_run(x, NULL, &summary, &err), RL_OK);
    assert_int_equal(summary.frames, 3);
    assert_int_equal(summary.failed, 1);
    rl_experiment_close(&x);
    assert_int_equal(small_check_files(a), 2 * SMALL_OUTPUTS);
    assert_int_equal(folder_files(b), 0); /* .files is false */
    folder_remove(place);
    free(gone);
    free(own);
    free(out);
    free(a);
    free(b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_same_as_alone),  cmocka_unit_test(test_sharing),
        cmocka_unit_test(test_predicted_cost), cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_missing_frame),
    };
    return cmocka_run_group_tests(tests, small_setup, small_teardown);
}
