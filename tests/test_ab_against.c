/* --against: files found, converted and cut; metrics whose image they do not give are left out. */
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
#include "graph/base/file.h"
#include "graph/run/data_files.h"
#include "graph/run/exr.h"
#include "graph/run/image_file.h"
#include "tests/fake_experiment.h"
#include "tests/tool_run.h"

static rl_experiment *e;
static fake_plan p;
static char *folder;
static rl_str notes;

static void note(void *ctx, rl_severity severity, rl_where where, const char *text)
{
    (void)ctx, (void)severity, (void)where;
    rl_str_add(&notes, text);
}
static const rl_log logger = {note, NULL};

static int set_up(void **state)
{
    (void)state;
    rl_error err = {0};
    folder = folder_new();
    e = fake_experiment_new(1);
    fake_frame_draw(e, 0, 0);
    fake_plan_make(&p, 3, 2);
    p.plan.n_variants = 2;
    p.pairs[0] = (rl_ab_pair){RL_AB_AGAINST, 0};
    p.pairs[1] = (rl_ab_pair){RL_AB_AGAINST, 1};
    p.plan.n_pairs = 2;
    const char *config = rl_data_path(&e->arena, "color/relit.ocio");
    rl_ocio_open(config, &e->session.ocio, &err);
    assert_string_equal(err.text, "");
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    rl_ocio_free(&e->session.ocio);
    fake_experiment_free(e);
    folder_remove(folder);
    rl_str_free(&notes);
    return 0;
}

/* ---- files --------------------------------------------------------------------------------------------- */

/* Rows of linear Rec. 709 to what a file holds. */
static float pixels[3][(FAKE_HEIGHT + 8) * (FAKE_WIDTH + 8)];
static int file_x = FAKE_X, file_y = FAKE_Y, file_width = FAKE_WIDTH, file_height = FAKE_HEIGHT;

/* The reference is variant 0's image through m, with a window of its own. */
static void draw(rl_compared which, const double m[9])
{
    for (int y = 0; y < file_height; y++)
        for (int x = 0; x < file_width; x++) {
            int fx = x + file_x - FAKE_X, fy = y + file_y - FAKE_Y;
            bool inside = fx >= 0 && fy >= 0 && fx < FAKE_WIDTH && fy < FAKE_HEIGHT;
            double in[3];
            for (int c = 0; c < 3; c++)
                in[c] = inside ? (double)e->pixels[0][which][c][fy * FAKE_STRIDE + fx] : 7;
            for (int c = 0; c < 3; c++)
                pixels[c][y * file_width + x] =
                    (float)(m ? m[3 * c] * in[0] + m[3 * c + 1] * in[1] + m[3 * c + 2] * in[2] : in[c]);
        }
}

static char *write_exr(const char *name, const rl_exr_attribute *attr)
{
    char *path = path_in(folder, name);
    rl_error err = {0};
    const rl_exr_source channels[] = {{"R", RL_EXR_FLOAT, pixels[0], NULL, (size_t)file_width},
                                      {"G", RL_EXR_FLOAT, pixels[1], NULL, (size_t)file_width},
                                      {"B", RL_EXR_FLOAT, pixels[2], NULL, (size_t)file_width}};
    const rl_exr_box box = {file_x, file_y, file_x + file_width - 1, file_y + file_height - 1};
    const rl_exr_image image = {.data_window = box,
                                .display_window = box,
                                .channels = channels,
                                .n_channels = 3,
                                .compression = RL_EXR_ZIP,
                                .attrs = attr,
                                .n_attrs = attr != NULL};
    rl_exr_write(path, &image, NULL, NULL, &err);
    assert_string_equal(err.text, "");
    return path;
}

static rl_image_type image_type = RL_IMAGE_U16;

static char *write_png(const char *name)
{
    char *path = path_in(folder, name);
    rl_error err = {0};
    const rl_image_planes planes = {
        file_width, file_height, 3, {pixels[0], pixels[1], pixels[2]}, (size_t)file_width};
    rl_image_file_write(path, &planes, &(rl_image_options){.type = image_type}, NULL, NULL, &err);
    assert_string_equal(err.text, "");
    return path;
}

/* ---- measuring ----------------------------------------------------------------------------------------- */

static rl_code measure_more(rl_ab_measure *m, rl_ab_results *r, rl_error *err)
{
    rl_code code = rl_ab_measure_frame(m, &e->frame, err);
    return code ? code : rl_ab_measure_results(m, r, err);
}

static rl_ab_measure *measure(const char *against, rl_ab_results *r, rl_error *err)
{
    rl_ab_measure *m = NULL;
    p.plan.against = against;
    if (!rl_ab_measure_new(&p.plan, e, NULL, &logger, &m, err))
        measure_more(m, r, err);
    return m;
}

static const rl_ab_value *value_of(const rl_ab_results *r, size_t pair, rl_metric metric)
{
    for (size_t i = 0; i < r->n_values; i++)
        if (r->values[i].pair == pair && r->values[i].metric == metric &&
            r->values[i].material == RL_AB_WHOLE)
            return &r->values[i];
    return NULL;
}

static double most(const rl_ab_results *r, size_t pair)
{
    const rl_ab_value *v = value_of(r, pair, RL_METRIC_MAX);
    assert_non_null(v);
    return v->stats[RL_STAT_MAX];
}

static void expect_equal(const char *against, double tolerance)
{
    rl_ab_results r = {0};
    rl_error err = {0};
    rl_ab_measure *m = measure(against, &r, &err);
    assert_string_equal(err.text, "");
    assert_true(most(&r, 0) <= tolerance);
    assert_true(most(&r, 1) <= tolerance);
    assert_null(value_of(&r, 0, RL_METRIC_FLIP)); /* not invented */
    assert_null(value_of(&r, 0, RL_METRIC_PSNR));
    assert_null(rl_ab_measure_map(m, 0, RL_METRIC_SSIM));
    assert_non_null(value_of(&r, 1, RL_METRIC_HDRFLIP));
    assert_non_null(value_of(&r, 1, RL_METRIC_RMSE));
    assert_non_null(rl_ab_measure_reference(m)[RL_COMPARED_LINEAR].plane[0]);
    assert_null(rl_ab_measure_reference(m)[RL_COMPARED_DISPLAY].plane[0]);
    rl_ab_measure_free(&m);
}

/* Rec. 709 to ACEScg (AP1) with Bradford, of the ACES documents, and to linear Rec. 2020 (BT.2087). */
static const double to_ap1[9] = {0.6130974024, 0.3395231462, 0.0473794514, 0.0701937225, 0.9163538791,
                                 0.0134523985, 0.0206155929, 0.1095697729, 0.8698146342};
static const double to_2020[9] = {0.6274039, 0.3292830, 0.0433131, 0.0690973, 0.9195404,
                                  0.0113623, 0.0163914, 0.0880133, 0.8955953};

static void test_primaries(void **state)
{
    (void)state;
    static const rl_exr_attribute ap1 = {
        "chromaticities",
        {.type = RL_EXR_T_CHROMATICITIES, .v = {0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767}}};
    static const rl_exr_attribute rec2020 = {
        "chromaticities",
        {.type = RL_EXR_T_CHROMATICITIES, .v = {0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.329}}};
    static const rl_exr_attribute named = {"relit:colorspace", {.type = RL_EXR_T_STRING, .text = "ACEScg"}};
    static const rl_exr_attribute rec709 = {
        "chromaticities",
        {.type = RL_EXR_T_CHROMATICITIES, .v = {0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329}}};
    char *path;
    draw(RL_COMPARED_LINEAR, NULL);
    path = write_exr("plain.exr", NULL);
    expect_equal(path, 0);
    assert_non_null(strstr(rl_str_text(&notes), "taken as linear Rec. 709"));
    free(path);
    rl_str_free(&notes);
    path = write_exr("rec709.exr", &rec709);
    expect_equal(path, 0);
    free(path);
    draw(RL_COMPARED_LINEAR, to_ap1);
    path = write_exr("ap1.exr", &ap1);
    expect_equal(path, 2e-5);
    free(path);
    path = write_exr("named.exr", &named);
    expect_equal(path, 2e-5);
    free(path);
    draw(RL_COMPARED_LINEAR, to_2020);
    path = write_exr("2020.exr", &rec2020);
    expect_equal(path, 2e-5);
    assert_int_equal(notes.length, 0);
    free(path);
}

static void test_refused_primaries(void **state)
{
    (void)state;
    static const rl_exr_attribute line = {
        "chromaticities",
        {.type = RL_EXR_T_CHROMATICITIES, .v = {0.1, 0.1, 0.2, 0.2, 0.3, 0.3, 0.3127, 0.329}}};
    static const rl_exr_attribute unknown = {"relit:colorspace", {.type = RL_EXR_T_STRING, .text = "ACESgg"}};
    rl_ab_results r;
    rl_error err = {0};
    draw(RL_COMPARED_LINEAR, NULL);
    char *path = write_exr("line.exr", &line);
    rl_ab_measure *m = measure(path, &r, &err);
    assert_int_equal(err.code, RL_E_FORMAT);
    assert_non_null(strstr(err.text, "chromaticities"));
    rl_ab_measure_free(&m);
    free(path);
    err = (rl_error){0};
    path = write_exr("unknown.exr", &unknown);
    m = measure(path, &r, &err);
    assert_int_not_equal(err.code, RL_OK);
    assert_non_null(strstr(err.text, "ACESgg"));
    rl_ab_measure_free(&m);
    free(path);
}

static void test_display(void **state)
{
    (void)state;
    rl_ab_results r = {0};
    rl_error err = {0};
    /* Rows within the file; beyond 1 both clamp. */
    draw(RL_COMPARED_DISPLAY, NULL);
    e->frame.x = e->frame.y = 0; /* a PNG has no windows */
    char *path = write_png("a.png");
    rl_ab_measure *m = measure(path, &r, &err);
    assert_string_equal(err.text, "");
    assert_null(value_of(&r, 0, RL_METRIC_HDRFLIP));
    assert_null(value_of(&r, 0, RL_METRIC_MAX));
    /* What a file of so many bits can hold of an image is equal to it. */
    assert_true(isinf(value_of(&r, 0, RL_METRIC_PSNR)->stats[RL_STAT_MEAN]));
    assert_true(value_of(&r, 1, RL_METRIC_FLIP)->stats[RL_STAT_MAX] <= 0);
    assert_true(value_of(&r, 1, RL_METRIC_SSIM)->stats[RL_STAT_MEAN] > 0.9999);
    rl_ab_measure_free(&m);
    free(path);
    /* One step of 8 bits in one channel everywhere: psnr is 10 log10(3 · 255²). */
    image_type = RL_IMAGE_U8;
    for (int i = 0; i < FAKE_WIDTH * FAKE_HEIGHT; i++)
        pixels[0][i] = (floorf(fminf(pixels[0][i], 0.99f) * 255 + 0.5f) + 1) / 255;
    for (int y = 0; y < FAKE_HEIGHT; y++)
        for (int x = 0; x < FAKE_WIDTH; x++) {
            float *v = &e->pixels[0][RL_COMPARED_DISPLAY][0][y * FAKE_STRIDE + x];
            *v = fminf(*v, 0.99f);
        }
    path = write_png("b.png");
    m = measure(path, &r, &err);
    assert_string_equal(err.text, "");
    assert_true(fabs(value_of(&r, 0, RL_METRIC_PSNR)->stats[RL_STAT_MEAN] - 10 * log10(3.0 * 255 * 255)) <
                1e-4);
    rl_ab_measure_free(&m);
    free(path);
    image_type = RL_IMAGE_U16;
}

static void test_windows(void **state)
{
    (void)state;
    rl_ab_results r;
    rl_error err = {0};
    file_x = FAKE_X - 3, file_y = FAKE_Y - 1, file_width = FAKE_WIDTH + 5, file_height = FAKE_HEIGHT + 4;
    draw(RL_COMPARED_LINEAR, NULL);
    char *path = write_exr("larger.exr", NULL);
    expect_equal(path, 0);
    free(path);
    for (int i = 0; i < 4; i++) {
        file_x = FAKE_X + (i == 0), file_y = FAKE_Y + (i == 1);
        file_width = FAKE_WIDTH - (i == 2), file_height = FAKE_HEIGHT - (i == 3);
        draw(RL_COMPARED_LINEAR, NULL);
        path = write_exr("other.exr", NULL);
        err = (rl_error){0};
        rl_ab_measure *m = measure(path, &r, &err);
        assert_int_equal(err.code, RL_E_DATA);
        assert_non_null(strstr(err.text, "frame 1 is 52 x 44 from (3, -2) on"));
        rl_ab_measure_free(&m);
        free(path);
    }
    file_x = FAKE_X, file_y = FAKE_Y, file_width = FAKE_WIDTH, file_height = FAKE_HEIGHT;
}

/* ---- finding ------------------------------------------------------------------------------------------- */

static void test_patterns(void **state)
{
    (void)state;
    rl_ab_results r = {0};
    rl_error err = {0};
    draw(RL_COMPARED_LINEAR, NULL);
    free(write_exr("t.0001.exr", NULL));
    pixels[0][25 * FAKE_WIDTH + 20] += 0.25f;
    free(write_exr("t.0002.exr", NULL));
    char *path = path_in(folder, "t.####.exr");
    rl_ab_measure *m = measure(path, &r, &err);
    assert_string_equal(err.text, "");
    e->frame.frame = 2;
    e->frame.index = 1;
    assert_int_equal(measure_more(m, &r, &err), RL_OK);
    for (size_t i = 0; i < r.n_values; i++)
        if (r.values[i].metric == RL_METRIC_MAX && r.values[i].material == RL_AB_WHOLE)
            assert_true(fabs(r.values[i].stats[RL_STAT_MAX] - (r.values[i].frame == 2 ? 0.25 : 0)) < 1e-6);
    e->frame.frame = 3;
    assert_int_equal(measure_more(m, &r, &err), RL_E_IO);
    assert_non_null(strstr(err.file, "t.0003.exr"));
    rl_ab_measure_free(&m);
    free(path);
    /* A file that is not there is told before a frame runs. */
    path = path_in(folder, "none.exr");
    err = (rl_error){0};
    assert_null(measure(path, &r, &err));
    assert_int_equal(err.code, RL_E_IO);
    free(path);
    /* NaN is never equal. */
    pixels[1][9] = NAN;
    path = write_exr("nan.exr", NULL);
    err = (rl_error){0};
    m = measure(path, &r, &err);
    assert_int_equal(err.code, RL_E_DATA);
    assert_non_null(strstr(err.text, "channel 'G' holds NaN at pixel (12, -2)"));
    rl_ab_measure_free(&m);
    free(path);
}

static void add_output(const char *file, const char *display, rl_pixel_type type)
{
    size_t i = e->session.n_outputs++;
    e->layer = (rl_output_layer){.name = "", .image = "aa.color"};
    e->specs[i] = (rl_output){
        .name = "o", .layers = &e->layer, .n_layers = 1, .file = file, .display = display, .type = type};
    e->outputs[i] = (rl_sink_output){.spec = &e->specs[i], .space = display ? "sRGB / ACES" : "ACEScg"};
}

static void test_folder(void **state)
{
    (void)state;
    rl_ab_results r = {0};
    rl_error err = {0};
    add_output("{capture}.{frame:04}.exr", "sRGB", RL_HALF); /* for the display: not scene-linear */
    add_output("sub/{capture}.{variant}.{frame:04}.exr", NULL, RL_HALF);
    add_output("{capture}.{frame:04}.png", "sRGB", RL_UINT8);
    draw(RL_COMPARED_LINEAR, NULL);
    free(write_exr("monkey.0001.exr", NULL)); /* the trap: equal to both */
    free(write_exr("monkey.post.0001.exr", NULL));
    pixels[2][25 * FAKE_WIDTH + 20] -= 0.5f;
    free(write_exr("monkey.pre_post.0001.exr", NULL));
    rl_ab_measure *m = measure(folder, &r, &err);
    assert_string_equal(err.text, "");
    assert_true(most(&r, 0) <= 0);
    assert_true(fabs(most(&r, 1) - 0.5) < 1e-6);
    assert_null(value_of(&r, 0, RL_METRIC_FLIP));
    rl_ab_measure_free(&m);
    /* The second pair fails: the first one's values of this frame are none either. */
    m = measure(folder, &r, &err);
    size_t before = r.n_values;
    assert_true(before > 0);
    e->frame.frame = 2;
    e->frame.index = 1;
    char *second[] = {write_exr("monkey.post.0002.exr", NULL), NULL};
    pixels[0][3] = NAN;
    second[1] = write_exr("monkey.pre_post.0002.exr", NULL);
    assert_int_equal(measure_more(m, &r, &err), RL_E_DATA);
    for (int i = 0; i < 2; i++) {
        remove(second[i]);
        free(second[i]);
    }
    err = (rl_error){0};
    assert_int_equal(rl_ab_measure_results(m, &r, &err), RL_OK);
    assert_int_equal(r.n_values, before);
    assert_null(rl_ab_measure_map(m, 0, RL_METRIC_MAX));
    e->frame.frame = 1;
    e->frame.index = 0;
    rl_ab_measure_free(&m);
    /* The display's, when it is there; the same file for both, read once. */
    draw(RL_COMPARED_DISPLAY, NULL);
    free(write_png("monkey.0001.png"));
    e->frame.x = e->frame.y = 0;
    file_x = file_y = 0;
    draw(RL_COMPARED_LINEAR, NULL);
    err = (rl_error){0};
    m = measure(folder, &r, &err);
    assert_int_equal(err.code, RL_E_DATA); /* the EXR begins elsewhere */
    rl_ab_measure_free(&m);
    char *path = path_in(folder, "monkey.post.0001.exr");
    remove(path);
    free(path);
    path = path_in(folder, "monkey.pre_post.0001.exr");
    remove(path);
    free(path);
    err = (rl_error){0};
    m = measure(folder, &r, &err);
    assert_string_equal(err.text, "");
    assert_true(value_of(&r, 1, RL_METRIC_FLIP)->stats[RL_STAT_MEAN] < 1e-3);
    assert_null(value_of(&r, 1, RL_METRIC_MAX));
    e->frame.frame = 2;
    assert_int_equal(measure_more(m, &r, &err), RL_E_IO);
    assert_non_null(strstr(err.text, "variant 'post', frame 2"));
    assert_non_null(strstr(err.text, "'monkey.post.0002.exr' and 'monkey.0002.png'"));
    rl_ab_measure_free(&m);
    e->session.n_outputs = 1;
    err = (rl_error){0};
    m = measure(folder, &r, &err);
    assert_int_equal(err.code, RL_E_CONFIG);
    rl_ab_measure_free(&m);
    file_x = FAKE_X, file_y = FAKE_Y;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_primaries, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_refused_primaries, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_display, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_windows, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_patterns, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_folder, set_up, tear_down),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
