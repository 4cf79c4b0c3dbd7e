/* The figures that relit promises, measured through the engine on the shipped capture: shading against a
 * twin in double precision, the sampled filter against the dense one, energy, temporal anti-aliasing. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "tests/figure_help.h"

/* Profiles in every texturing and transmission mode; their twins are in set_profiles. */
static const char head[] =
    "relit: 1\n"
    "capture: captures/monkey/capture.yaml\n"
    "profiles:\n"
    "  skin: {scatter_distance_mm: [3, 1.2, 0.7], texturing: post, transmission: thick, thickness_from: "
    "shadow}\n"
    "  wax: {scatter_distance_mm: [6, 5, 3], texturing: pre_post, transmission: thick, thickness_from: max}\n"
    "  marble: {scatter_distance_mm: [8.5, 5.6, 4], texturing: pre_post}\n"
    "  leaf: {scatter_distance_mm: [0.6, 1, 0.3], texturing: post, transmission: thin}\n"
    "materials:\n"
    "  skin: {profile: skin, roughness: 0.45, specular: 0.028}\n"
    "  wax: {profile: wax}\n"
    "  marble: {profile: marble}\n"
    "  leaf: {profile: leaf}\n"
    "  default: {}\n";

static const rl_setting nothing = {NULL, NULL};

/* `head` and the rest of a pipeline; valid until the next call. */
static const char *pipeline(const char *rest)
{
    static char text[4096];
    int n = snprintf(text, sizeof text, "%s%s", head, rest);
    assert_true(n > 0 && (size_t)n < sizeof text);
    return text;
}

static double pixel(const rl_image_view *v, int plane, int x, int y)
{
    return (double)v->plane[plane][(size_t)y * v->stride + (size_t)x];
}

/* ---- lighting and combine
 * ----------------------------------------------------------------------------------- */

static void set_row(figure_frame *f, size_t entry, const char *group, const char *key, double a, double b,
                    double c)
{
    assert_true(shade_material_set(&f->materials, entry, group, key, (double[]){a, b, c}));
}

/* What `head` says, by stencil id. The numbers are those of the words in the passes' tables. */
static void set_profiles(figure_frame *f, bool lambert)
{
    enum {
        SKIN = 1,
        LEAF = 3,
        WAX = 4,
        MARBLE = 6,
        PRE_POST = 1,
        THIN = 1,
        THICK = 2,
        FROM_MAX = 0,
        FROM_SHADOW = 2
    };
    set_row(f, SKIN, "profile", "scatter_distance_mm", 3, 1.2, 0.7);
    set_row(f, SKIN, "profile", "transmission", THICK, 0, 0);
    set_row(f, SKIN, "profile", "thickness_from", FROM_SHADOW, 0, 0);
    set_row(f, SKIN, "material", "roughness", 0.45, 0, 0);
    set_row(f, SKIN, "material", "specular", 0.028, 0, 0);
    set_row(f, WAX, "profile", "scatter_distance_mm", 6, 5, 3);
    set_row(f, WAX, "profile", "texturing", PRE_POST, 0, 0);
    set_row(f, WAX, "profile", "transmission", THICK, 0, 0);
    set_row(f, WAX, "profile", "thickness_from", FROM_MAX, 0, 0);
    set_row(f, MARBLE, "profile", "scatter_distance_mm", 8.5, 5.6, 4);
    set_row(f, MARBLE, "profile", "texturing", PRE_POST, 0, 0);
    set_row(f, LEAF, "profile", "scatter_distance_mm", 0.6, 1, 0.3);
    set_row(f, LEAF, "profile", "transmission", THIN, 0, 0);
    for (size_t i = 1; i <= 6 && lambert; i++) {
        set_row(f, i, "shading", "diffuse", 1, 0, 0);
        set_row(f, i, "shading", "specular", 1, 0, 0);
    }
}

/* Relative where values are above 1e-4; smaller ones are held to 1e-7. */
static void add_differences(figure_errors *e, const rl_image_view *got, const double want[3], int x, int y)
{
    for (int c = 0; c < 3; c++) {
        double d = fabs(pixel(got, c, x, y) - want[c]);
        if (fabs(want[c]) > 1e-4)
            figure_add(e, d / fabs(want[c]));
        else
            assert_true(d <= 1e-7);
    }
}

static void against_double(const char *shading, bool lambert)
{
    char rest[1024];
    snprintf(
        rest, sizeof rest,
        "shading: %s\n"
        "graph: {light: {pass: lighting}, off: {pass: combine, in: {diffuse: light.diffuse, lit: "
        "light.lit}}}\n"
        "outputs: {o: {layers: {d: light.diffuse, l: light.lit, c: off.color}, file: 'o.{frame}.exr'}}\n",
        shading);
    figure_frame f;
    figure_errors e = {0};
    figure_frame_read(&f, 3);
    set_profiles(&f, lambert);
    rl_session *s = figure_open(pipeline(rest), nothing);
    figure_process(s, 3, NULL);
    rl_image_view diffuse = figure_image(s, "light.diffuse"), lit = figure_image(s, "light.lit"),
                  color = figure_image(s, "off.color");
    shade_run lighting = figure_lighting(&f), combine = figure_combine(&f);
    for (int y = 0; y < diffuse.height; y++) {
        for (int x = 0; x < diffuse.width; x++) {
            double d[3], l[3], c[3];
            twin_lighting(&lighting, x, y, d, l);
            twin_combine(&combine, x, y, d, l, c);
            add_differences(&e, &diffuse, d, x, y);
            add_differences(&e, &lit, l, x, y);
            add_differences(&e, &color, c, x, y);
        }
    }
    double most = figure_percentile(&e, 1), p999 = figure_percentile(&e, 0.999);
    print_message("%zu values: 99.9th percentile %.2g, largest %.2g\n", e.n, p999, most);
    assert_true(e.n > 300000);
    assert_true(p999 <= 1e-5 && most <= 1e-4);
    rl_session_close(&s);
    figure_errors_free(&e);
    figure_frame_free(&f);
}

static void lambert_agrees_with_double(void **state)
{
    (void)state;
    against_double("{diffuse: lambert, specular: none}", true);
}

static void disney_and_ggx_agree_with_double(void **state)
{
    (void)state;
    against_double("{diffuse: disney, specular: ggx}", false);
}

/* ---- taps against the dense sum ---------------------------------------------------------------------------
 */

static void many_taps_are_the_dense_sum(void **state)
{
    (void)state;
    figure_frame f;
    figure_errors e = {0};
    figure_frame_read(&f, 1);
    rl_session *s = figure_open(
        pipeline("shading: {diffuse: lambert, specular: none}\n"
                 "graph:\n"
                 "  light: {pass: lighting}\n"
                 "  many: {pass: sss_burley, in: {diffuse: light.diffuse, lit: light.lit}, taps: 1024,\n"
                 "         orientation: screen, weighting: plain}\n"
                 "  dense: {pass: sss_reference, in: {diffuse: light.diffuse, lit: light.lit},\n"
                 "          orientation: screen, weighting: plain}\n"
                 "outputs: {o: {layers: {m: many.color, d: dense.color}, file: 'o.{frame}.exr'}}\n"),
        nothing);
    figure_process(s, 1, NULL);
    rl_image_view many = figure_image(s, "many.color"), dense = figure_image(s, "dense.color");
    for (int y = 0; y < many.height; y++) {
        for (int x = 0; x < many.width; x++) {
            uint32_t id = shade_id(&f.images[LIGHTING_STENCIL], &f.frame, x, y);
            for (int c = 0; c < 3 && f.materials.words[id][0]; c++)
                if (pixel(&dense, c, x, y) > 1e-4)
                    figure_add(&e, fabs(pixel(&many, c, x, y) / pixel(&dense, c, x, y) - 1));
        }
    }
    double median = figure_percentile(&e, 0.5), p95 = figure_percentile(&e, 0.95);
    print_message("%zu values: median %.3g %%, 95th percentile %.3g %%\n", e.n, 100 * median, 100 * p95);
    assert_true(e.n > 100000);
    assert_true(median <= 0.003 && p95 <= 0.015);
    rl_session_close(&s);
    figure_errors_free(&e);
    figure_frame_free(&f);
}

/* ---- energy
 * ------------------------------------------------------------------------------------------------ */

enum { FLAT_W = 192, FLAT_H = 96 };

/* A wall of one material that fills the image, squarely in an even light; id 1 is post, id 2 pre_post. */
static const char flat[] =
    "relit: 1\n"
    "capture:\n"
    "  relit_capture: 1\n"
    "  name: wall\n"
    "  files: memory\n"
    "  unit: m\n"
    "  camera: {matrix: header, forward: -z, fov_x: header, jitter: header}\n"
    "  layers:\n"
    "    albedo: {channels: [R, G, B], colorspace: lin_rec709}\n"
    "    normal: {channels: [NX, NY, NZ], space: world, encoding: signed}\n"
    "    depth: {channels: [Z], kind: planar, empty: 1e10}\n"
    "    stencil: {channels: [ID]}\n"
    "profiles:\n"
    "  post: {scatter_distance_mm: [3, 1.2, 0.7], texturing: post}\n"
    "  pre_post: {scatter_distance_mm: [3, 1.2, 0.7], texturing: pre_post}\n"
    "materials: {a: {stencil: 1, profile: post}, b: {stencil: 2, profile: pre_post}}\n"
    "lights: {sun: {type: directional, direction: [0, 0, -1], irradiance: [3, 2, 1]}}\n"
    "graph:\n"
    "  light: {pass: lighting}\n"
    "  off: {pass: combine, in: {diffuse: light.diffuse, lit: light.lit}}\n"
    "  few: {pass: sss_burley, in: {diffuse: light.diffuse, lit: light.lit}, taps: 21}\n"
    "  auto: {pass: sss_burley, in: {diffuse: light.diffuse, lit: light.lit}, taps: auto}\n"
    "  plain: {pass: sss_burley, in: {diffuse: light.diffuse, lit: light.lit}, taps: 55, weighting: plain}\n"
    "  laid: {pass: sss_burley, in: {diffuse: light.diffuse, lit: light.lit}, taps: 55, orientation: "
    "tangent}\n"
    "  dense: {pass: sss_reference, in: {diffuse: light.diffuse, lit: light.lit}}\n"
    "outputs: {o: {layers: {o: off.color, f: few.color, a: auto.color, p: plain.color, l: laid.color,\n"
    "                       d: dense.color}, file: 'o.{frame}.exr'}}\n";

static void process_wall(rl_session *s, long long number, uint32_t id)
{
    static const char *const names[] = {"R", "G", "B", "NX", "NY", "NZ", "Z"};
    static const float values[] = {0.8f, 0.5f, 0.4f, 0, 0, 1, 0.6f};
    static float planes[7][FLAT_W * FLAT_H];
    static uint32_t ids[FLAT_W * FLAT_H];
    rl_channel_data channels[8];
    for (int i = 0; i < 7; i++) {
        for (int k = 0; k < FLAT_W * FLAT_H; k++)
            planes[i][k] = values[i];
        channels[i] = (rl_channel_data){.name = names[i], .floats = planes[i], .stride = FLAT_W};
    }
    for (int k = 0; k < FLAT_W * FLAT_H; k++)
        ids[k] = id;
    channels[7] = (rl_channel_data){.name = "ID", .ids = ids, .stride = FLAT_W};
    const rl_frame_data data = {.width = FLAT_W,
                                .height = FLAT_H,
                                .channels = channels,
                                .n_channels = 8,
                                .world_to_camera = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
                                .fov_x = 0.35}; /* a radius of about 45 pixels */
    figure_process(s, number, &data);
}

static void filters_keep_energy(void **state)
{
    static const char *const filtered[] = {"few.color", "auto.color", "plain.color", "laid.color",
                                           "dense.color"};
    (void)state;
    rl_session *s = figure_open(flat, nothing);
    for (uint32_t id = 1; id <= 2; id++) {
        process_wall(s, id, id);
        rl_image_view off = figure_image(s, "off.color");
        for (size_t i = 0; i < sizeof filtered / sizeof *filtered; i++) {
            rl_image_view on = figure_image(s, filtered[i]);
            double worst = 0;
            for (int y = 0; y < FLAT_H; y++)
                for (int x = 0; x < FLAT_W; x++)
                    for (int c = 0; c < 3; c++) {
                        assert_true(pixel(&off, c, x, y) > 0.05);
                        worst = fmax(worst, fabs(pixel(&on, c, x, y) / pixel(&off, c, x, y) - 1));
                    }
            print_message("%s, %s: largest difference %.2g\n", id == 1 ? "post" : "pre_post", filtered[i],
                          worst);
            assert_true(worst <= 1e-4);
        }
    }
    rl_session_close(&s);
}

/* ---- temporal anti-aliasing
 * -------------------------------------------------------------------------------- */

enum { SEQUENCE = 8 };

/* One material in 3x3, and every light either lit or shadowed there. */
static bool is_plain(const figure_frame *f, int x, int y)
{
    const shade_image *shadow = &f->images[LIGHTING_SHADOW];
    uint32_t id = shade_id(&f->images[LIGHTING_STENCIL], &f->frame, x, y);
    for (int dy = -1; dy <= 1; dy++)
        for (int dx = -1; dx <= 1; dx++) {
            int px = x + dx, py = y + dy;
            if (px < 0 || py < 0 || px >= f->frame.valid[2] || py >= f->frame.valid[3])
                continue;
            if (shade_id(&f->images[LIGHTING_STENCIL], &f->frame, px, py) != id)
                return false;
            for (int light = 0; light < 3; light++)
                if (*shade_at(shadow, &f->frame, light, px, py) != *shade_at(shadow, &f->frame, light, x, y))
                    return false;
        }
    return true;
}

/* The means of the frames so far, and how far TAA may be from them. */
typedef struct still {
    const char *before, *after; /* images in front of and behind TAA */
    double *mean;               /* pixels of three */
    double least_db;
} still;

/* PSNR over plain pixels, against the mean's maximum there. */
static void compare_with_mean(const figure_frame *last, rl_session *s, const still *run)
{
    rl_image_view taa = figure_image(s, run->after);
    double sum = 0, peak = 0;
    size_t n = 0;
    for (int y = 0; y < taa.height; y++)
        for (int x = 0; x < taa.width; x++)
            for (int c = 0; c < 3 && is_plain(last, x, y); c++, n++) {
                double m = run->mean[((size_t)y * (size_t)taa.width + (size_t)x) * 3 + (size_t)c];
                double d = pixel(&taa, c, x, y) - m;
                peak = fmax(peak, m);
                sum += d * d;
            }
    double psnr = 10 * log10(peak * peak * (double)n / sum);
    print_message("%s: %.1f dB over %zu values, peak %.3g\n", run->before, psnr, n, peak);
    assert_true(n > 200000);
    assert_true(psnr >= run->least_db);
}

static void add_to_mean(rl_session *s, const still *run)
{
    rl_image_view view = figure_image(s, run->before);
    for (int y = 0; y < view.height; y++)
        for (int x = 0; x < view.width; x++)
            for (int c = 0; c < 3; c++)
                run->mean[((size_t)y * (size_t)view.width + (size_t)x) * 3 + (size_t)c] +=
                    pixel(&view, c, x, y) / SEQUENCE;
}

static void becomes_its_mean(const char *text, const char *before, double least_db)
{
    figure_frame last;
    figure_frame_read(&last, SEQUENCE);
    size_t pixels = (size_t)last.frame.valid[2] * (size_t)last.frame.valid[3];
    still run = {before, "aa.color", calloc(3 * pixels, sizeof(double)), least_db};
    assert_non_null(run.mean);
    /* Marble's filter takes two thirds of the time, and is as smooth as the others'. */
    rl_session *s = figure_open(pipeline(text), (rl_setting){"materials.marble.profile", "null"});
    for (int number = 1; number <= SEQUENCE; number++) {
        figure_process(s, number, NULL);
        add_to_mean(s, &run);
    }
    compare_with_mean(&last, s, &run);
    rl_session_close(&s);
    free(run.mean);
    figure_frame_free(&last);
}

/* Nothing but scattering, whose light is smooth: nothing may be clipped. The bar is 45 dB. */
static void still_scattering_becomes_its_mean(void **state)
{
    (void)state;
    becomes_its_mean("shading: {diffuse: lambert, specular: none}\n"
                     "graph:\n"
                     "  light: {pass: lighting}\n"
                     "  sss: {pass: sss_reference, in: {diffuse: light.diffuse, lit: light.lit}}\n"
                     "  aa: {pass: taa, in: {color: sss.color}, blend: 0}\n"
                     "outputs: {o: {layers: {s: sss.color, a: aa.color}, file: 'o.{frame}.exr'}}\n",
                     "sss.color", 45);
}

/* Highlights smaller than a pixel come and go with the jitter: the weights against fireflies count. */
static void still_highlights_become_their_mean(void **state)
{
    (void)state;
    becomes_its_mean("graph:\n"
                     "  light: {pass: lighting}\n"
                     "  off: {pass: combine, in: {diffuse: light.diffuse, lit: light.lit}}\n"
                     "  aa: {pass: taa, in: {color: off.color}, blend: 0}\n"
                     "outputs: {o: {layers: {s: off.color, a: aa.color}, file: 'o.{frame}.exr'}}\n",
                     "off.color", 45);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lambert_agrees_with_double),
        cmocka_unit_test(disney_and_ggx_agree_with_double),
        cmocka_unit_test(many_taps_are_the_dense_sum),
        cmocka_unit_test(filters_keep_energy),
        cmocka_unit_test(still_scattering_becomes_its_mean),
        cmocka_unit_test(still_highlights_become_their_mean),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
