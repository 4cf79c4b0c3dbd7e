/* Translucency through the tool: what a pipeline for it needs and is told, and a ball that is lit from
 * behind, in every mode, against the exact integral over its whole surface. */
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
#include "graph/run/image_file.h"
#include "passes/burley.h"
#include "tests/exr_make.h"
#include "tests/tool_run.h"

#define RUN(...) tool_run((const char *const[]){__VA_ARGS__, NULL})

static const double pi = 3.14159265358979323846;

/* ---- a ball in skin, 48 pixels; its capture ----------------------------------------------------------- */

enum { SIZE = 128, PIXELS = SIZE * SIZE };
enum {
    ALBEDO,
    NORMAL,
    DEPTH = NORMAL + 3,
    BACK_DEPTH,
    BACK_NORMAL,
    THICKNESS = BACK_NORMAL + 3,
    SHADOW,
    SHADOW_THICKNESS,
    PLANES
};
static const double centre[3] = {0, 0, -0.3}, radius = 0.009, focal = 1600, sun[3] = {0.6, 0, -0.8},
                    d_mm[3] = {3, 1.2, 0.7};
static float plane[PLANES][PIXELS];
static uint32_t stencil[PIXELS];

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void shoot(int x, int y)
{
    const int at = y * SIZE + x;
    const double ray[3] = {(x + 0.5 - SIZE / 2.0) / focal, -(y + 0.5 - SIZE / 2.0) / focal, -1};
    double a = dot(ray, ray), h = dot(ray, centre),
           root = h * h - a * (dot(centre, centre) - radius * radius), n[3];
    plane[DEPTH][at] = plane[BACK_DEPTH][at] = 1e10f;
    if (root <= 0)
        return;
    double front = (h - sqrt(root)) / a, back = (h + sqrt(root)) / a;
    for (int k = 0; k < 3; k++) {
        n[k] = (front * ray[k] - centre[k]) / radius;
        plane[NORMAL + k][at] = (float)n[k];
        plane[BACK_NORMAL + k][at] = (float)((back * ray[k] - centre[k]) / radius);
    }
    stencil[at] = 1;
    plane[ALBEDO][at] = 1;
    plane[DEPTH][at] = (float)front;
    plane[BACK_DEPTH][at] = (float)back;
    plane[THICKNESS][at] = (float)(2 * radius);
    plane[SHADOW][at] = dot(n, sun) > 0;
    plane[SHADOW_THICKNESS][at] = (float)(2 * radius * fmax(-dot(n, sun), 0));
}

static const char manifest[] =
    "relit_capture: 1\nname: ball\nfiles: ball.exr\nframes: 1\nunit: m\n"
    "camera: {matrix: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1], forward: -z, fov_x: header}\n"
    "layers:\n"
    "  albedo: {channels: [A, A, A], colorspace: lin_rec709}\n"
    "  normal: {channels: [N.X, N.Y, N.Z], space: world, encoding: signed}\n"
    "  depth: {channels: [Z], kind: planar, empty: 1e10}\n"
    "  stencil: {channels: [id]}\n  thickness: {channels: [T]}\n"
    "@"
    "  shadow: {sun: S}\n  shadow_thickness: {sun: ST}\n"
    "lights: {sun: {type: directional, direction: [-0.6, 0, 0.8], irradiance: 1}}\n"
    "stencil_names: {1: skin}\n";
static const char back_layers[] =
    "  back_depth: {channels: [back.Z], kind: planar, empty: 1e10}\n"
    "  back_normal: {channels: [back.NX, back.NY, back.NZ], space: world, encoding: signed}\n";

/* The ball's folder; with `layers` in the manifest. */
static void write_ball(const char *folder, const char *layers)
{
    static const struct {
        const char *name;
        int plane;
    } names[] = {{"A", ALBEDO},
                 {"N.X", NORMAL},
                 {"N.Y", NORMAL + 1},
                 {"N.Z", NORMAL + 2},
                 {"S", SHADOW},
                 {"ST", SHADOW_THICKNESS},
                 {"T", THICKNESS},
                 {"Z", DEPTH},
                 {"back.NX", BACK_NORMAL},
                 {"back.NY", BACK_NORMAL + 1},
                 {"back.NZ", BACK_NORMAL + 2},
                 {"back.Z", BACK_DEPTH},
                 {"id", -1}};
    enum { CHANNELS = sizeof names / sizeof *names };
    made_channel channels[CHANNELS];
    for (int y = 0; y < SIZE; y++)
        for (int x = 0; x < SIZE; x++)
            shoot(x, y);
    for (int c = 0; c < CHANNELS; c++)
        channels[c] = names[c].plane < 0
                          ? (made_channel){names[c].name, RL_EXR_UINT, 0, stencil}
                          : (made_channel){names[c].name, RL_EXR_FLOAT, 0, plane[names[c].plane]};
    const made_header header = {.fov_x = (float)(2 * atan(SIZE / 2.0 / focal))};
    const made_part part = {.width = SIZE,
                            .height = SIZE,
                            .compression = RL_EXR_ZIP,
                            .channels = channels,
                            .n_channels = CHANNELS,
                            .header = &header};
    char *path = path_in(folder, "ball.exr"), *text = text_replace(manifest, "@", layers);
    made_write(path, &part, 1);
    file_write(folder, "capture.yaml", text, strlen(text));
    free(path);
    free(text);
}

static const char pipeline[] =
    "relit: 1\n"
    "profiles: {skin: {scatter_distance_mm: [3, 1.2, 0.7], transmission: gather, thickness_from: max}}\n"
    "shading: {diffuse: lambert, specular: none}\n"
    "materials: {skin: {profile: skin}}\n"
    "graph:\n"
    "  light: {pass: lighting}\n"
    "  behind: {pass: back_lighting}\n"
    "  through: {pass: translucency, in: {back: behind.diffuse, lit: light.lit}, taps: 1024}\n"
    "  sss: {pass: sss_reference, in: {diffuse: light.diffuse, lit: through.lit}, weighting: surface}\n"
    "outputs: {out: {image: sss.color, file: out.exr, type: float}}\n";

static char *write_pipeline(const char *folder)
{
    file_write(folder, "p.yaml", pipeline, strlen(pipeline));
    return path_in(folder, "p.yaml");
}

/* ---- the truth ---------------------------------------------------------------------------------------- */

/* Light at normal n from all around a ball: the area between chords r and r + dr is 2 pi r dr, so that shares
 * of the profile's light are shares of r. */
static void ball_truth(const double n[3], double out[3])
{
    enum { RINGS = 500, TURNS = 90 };
    double u[3], v[3], side = hypot(n[0], n[1]);
    u[0] = -n[1] / side, u[1] = n[0] / side, u[2] = 0;
    v[0] = n[1] * u[2] - n[2] * u[1], v[1] = n[2] * u[0] - n[0] * u[2], v[2] = n[0] * u[1] - n[1] * u[0];
    for (int c = 0; c < 3; c++) {
        double d = d_mm[c] * 1e-3, all = rl_burley_cdf(2 * radius, d);
        out[c] = 0;
        for (int i = 0; i < RINGS; i++) {
            double r = d * rl_burley_inverse(all * (i + 0.5) / RINGS),
                   cosine = 1 - r * r / (2 * radius * radius), sine = sqrt(fmax(1 - cosine * cosine, 0));
            for (int j = 0; j < TURNS; j++) {
                double turn = 2 * pi * (j + 0.5) / TURNS, nl = 0;
                for (int k = 0; k < 3; k++)
                    nl += (cosine * n[k] + sine * (cos(turn) * u[k] + sin(turn) * v[k])) * sun[k];
                out[c] += fmax(nl, 0) / pi * all / (RINGS * TURNS);
            }
        }
    }
}

typedef struct mode {
    const char *name, *set[2];
    double error[3], bias[3];
} mode;

/* Pixels that the light reaches only from behind, at least two from the silhouette. */
static void compare(const float *image, mode *m)
{
    double mean[3] = {0};
    memset(m->error, 0, sizeof m->error);
    memset(m->bias, 0, sizeof m->bias);
    for (int y = 2; y < SIZE - 2; y++)
        for (int x = 2; x < SIZE - 2; x++) {
            const int at = y * SIZE + x;
            const double n[3] = {(double)plane[NORMAL][at], (double)plane[NORMAL + 1][at],
                                 (double)plane[NORMAL + 2][at]};
            double want[3];
            bool edge = (x * 5 + y * 3) % 23 || dot(n, sun) > -0.05;
            for (int k = -2; k <= 2; k++)
                edge |= !stencil[at + k] || !stencil[at + k * SIZE];
            if (edge)
                continue;
            ball_truth(n, want);
            for (int c = 0; c < 3; c++) {
                double off = (double)image[c * PIXELS + at] - want[c];
                m->error[c] += fabs(off);
                m->bias[c] += off;
                mean[c] += want[c];
            }
        }
    for (int c = 0; c < 3; c++) {
        m->error[c] /= mean[c];
        m->bias[c] /= mean[c];
    }
}

static void ball_from_behind(void **state)
{
    mode modes[] = {{.name = "none", .set = {"profiles.skin.transmission=none"}},
                    {.name = "thin", .set = {"profiles.skin.transmission=thin"}},
                    {.name = "thick, max", .set = {"profiles.skin.transmission=thick"}},
                    {.name = "thick, layer",
                     .set = {"profiles.skin.transmission=thick", "profiles.skin.thickness_from=layer"}},
                    {.name = "thick, shadow",
                     .set = {"profiles.skin.transmission=thick", "profiles.skin.thickness_from=shadow"}},
                    {.name = "gather", .set = {"profiles.skin.transmission=gather"}}};
    enum { MODES = sizeof modes / sizeof *modes };
    char *folder = folder_new();
    (void)state;
    write_ball(folder, back_layers);
    char *pipe = write_pipeline(folder), *out = path_in(folder, "out.exr");
    for (mode *m = modes; m < modes + MODES; m++) {
        rl_image_file file = {0};
        rl_error err = {0};
        remove(out);
        const char *second = m->set[1] ? m->set[1] : m->set[0];
        tool_result r = RUN("run", pipe, "--capture", folder, "--frames", "1", "--out", folder, "--set",
                            m->set[0], "--set", second);
        if (r.status || rl_image_file_read(out, &file, &err))
            fail_msg("%s%s", r.err, err.text);
        compare(file.planes, m);
        print_message("%-14s", m->name);
        for (int c = 0; c < 3; c++)
            print_message(" %6.1f %% (%+.1f %%)", 100 * m->error[c], 100 * m->bias[c]);
        print_message("\n");
        rl_image_file_free(&file);
        tool_result_free(&r);
    }
    for (int c = 0; c < 3; c++) /* the other modes guess */
        for (int k = 0; k < MODES - 1; k++)
            assert_true(modes[MODES - 1].error[c] < 0.6 * modes[k].error[c]);
    free(out);
    free(pipe);
    folder_remove(folder);
}

/* ---- what is missing ---------------------------------------------------------------------------------- */

static void expect(tool_result r, int status, const char *says)
{
    if (r.status != status || !strstr(r.err, says))
        print_error("status %d instead of %d, or not '%s' in:\n%s%s\n", r.status, status, says, r.out, r.err);
    assert_int_equal(r.status, status);
    assert_non_null(strstr(r.err, says));
    tool_result_free(&r);
}

static void missing_layers_are_named(void **state)
{
    char *folder = folder_new();
    (void)state;
    write_ball(folder, "");
    char *pipe = write_pipeline(folder);
    expect(RUN("check", pipe, "--capture", folder), 2,
           "pass 'behind' (back_lighting): port 'back_normal' needs an image (normal): `in:` does not name "
           "one and the "
           "capture has no layer 'back_normal'");
    expect(RUN("check", pipe, "--capture", folder, "--set", "graph.behind.in.back_normal=capture.normal"), 2,
           "port 'back_depth' needs an image (scalar)");
    write_ball(folder, back_layers);
    expect(RUN("check", pipe, "--capture", folder), 0, "");
    expect(RUN("check", pipe, "--capture", folder, "--set", "profiles.skin.scatter_distance_mm=null"), 2,
           "scatter_distance_mm");
    expect(RUN("check", pipe, "--capture", folder, "--set", "graph.through=null", "--set",
               "graph.sss.in.lit=light.lit"),
           2,
           "p.yaml:6:3: error: the profile of material 'skin' has 'transmission: gather', which pass "
           "translucency does: the "
           "graph has none");
    expect(RUN("check", pipe, "--capture", folder, "--set", "graph.through=null", "--set",
               "graph.sss.in.lit=light.lit", "--set", "shading.transmission=false"),
           0, "");
    free(pipe);
    folder_remove(folder);
}

int main(int argc, char **argv)
{
    tool_child(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ball_from_behind),
        cmocka_unit_test(missing_layers_are_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
