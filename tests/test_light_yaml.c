/* Lights as people write them, through the tool: a matte ball under panels, spheres, lamps and an even sky,
 * against integrals over the lights in double; what a changed file of a light does to a run. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "graph/run/image_file.h"
#include "tests/exr_make.h"
#include "tests/tool_run.h"

#define RUN(...) tool_run((const char *const[]){__VA_ARGS__, NULL})

static const double pi = 3.14159265358979323846;

/* ---- a ball, its capture in centimetres ---- */

enum { SIZE = 48, PIXELS = SIZE * SIZE };
static const double centre[3] = {0, 0, -0.3}, radius = 0.009, focal = 640; /* metres, pixels */
static float plane[5][PIXELS];                                             /* normal, depth, albedo */
static uint32_t stencil[PIXELS];

static double dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void shoot(int x, int y)
{
    const int at = y * SIZE + x;
    const double ray[3] = {(x + 0.5 - SIZE / 2.0) / focal, -(y + 0.5 - SIZE / 2.0) / focal, -1};
    double a = dot(ray, ray), h = dot(ray, centre),
           root = h * h - a * (dot(centre, centre) - radius * radius), t = (h - sqrt(fmax(root, 0))) / a;
    for (int k = 0; k < 3; k++)
        plane[k][at] = root > 0 ? (float)((t * ray[k] - centre[k]) / radius) : 0;
    plane[3][at] = root > 0 ? (float)(100 * t) : 1e10f;
    plane[4][at] = 1;
    stencil[at] = root > 0;
}

/* `camera`: 16 numbers, world to camera. Normals are the camera's, so that any camera sees the same. */
static void write_capture(const char *folder, const char *camera)
{
    static const char *const names[] = {"A", "N.X", "N.Y", "N.Z", "Z", "id"};
    made_channel channels[6];
    char text[1024];
    for (int i = 0; i < PIXELS; i++)
        shoot(i % SIZE, i / SIZE);
    for (int c = 0; c < 5; c++)
        channels[c] = (made_channel){names[c], RL_EXR_FLOAT, 0, plane[(c + 4) % 5]};
    channels[5] = (made_channel){names[5], RL_EXR_UINT, 0, stencil};
    const made_header header = {.fov_x = (float)(2 * atan(SIZE / 2.0 / focal))};
    const made_part part = {
        .width = SIZE, .height = SIZE, .channels = channels, .n_channels = 6, .header = &header};
    char *path = path_in(folder, "ball.exr");
    made_write(path, &part, 1);
    free(path);
    snprintf(text, sizeof text,
             "relit_capture: 1\nname: ball\nfiles: ball.exr\nframes: 1-2\nunit: cm\n"
             "camera: {matrix: [%s], forward: -z, fov_x: header}\nlayers:\n"
             "  albedo: {channels: [A, A, A], colorspace: lin_rec709}\n"
             "  normal: {channels: [N.X, N.Y, N.Z], space: camera, encoding: signed}\n"
             "  depth: {channels: [Z], kind: planar, empty: 1e10}\n  stencil: {channels: [id]}\n",
             camera);
    file_write(folder, "capture.yaml", text, strlen(text));
}

static const char identity[] = "1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1";

/* The picture of the pipeline with `more`; free with rl_image_file_free. */
static rl_image_file shade(const char *folder, const char *more)
{
    static const char head[] = "relit: 1\ncapture: capture.yaml\n"
                               "graph:\n  light: {pass: lighting}\n"
                               "outputs: {out: {image: light.lit, file: 'out.exr', type: float}}\n";
    char text[2048];
    rl_image_file file = {0};
    rl_error err = {0};
    char *pipe = path_in(folder, "p.yaml"), *out = path_in(folder, "out.exr");
    snprintf(text, sizeof text, "%s%s%s%s", head,
             strstr(more, "materials:") ? "" : "materials: {default: {}}\n",
             strstr(more, "shading:") ? "" : "shading: {diffuse: lambert, specular: none}\n", more);
    file_write(folder, "p.yaml", text, strlen(text));
    remove(out);
    tool_result r = RUN("run", pipe, "--frames", "1", "--out", folder, "--quiet");
    if (r.status || rl_image_file_read(out, &file, &err))
        fail_msg("%s%s\n%s", r.err, err.text, more);
    tool_result_free(&r);
    free(out);
    free(pipe);
    return file;
}

/* ---- the truth ---- */

typedef double irradiance_fn(const double *p, const double *n, const void *light);

/* The largest difference of the picture from irradiance/pi, relative to the picture's largest value. */
static double error_of(const rl_image_file *file, irradiance_fn *truth, const void *light)
{
    double worst = 0, most = 0;
    for (int i = 0; i < PIXELS; i += 3) {
        double n[3], p[3];
        if (!stencil[i])
            continue;
        for (int k = 0; k < 3; k++) {
            n[k] = (double)plane[k][i];
            p[k] = centre[k] + radius * n[k];
        }
        double want = truth(p, n, light) / pi;
        worst = fmax(worst, fabs((double)file->planes[i] - want));
        most = fmax(most, want);
    }
    assert_true(most > 0);
    return worst / most;
}

typedef struct panel {
    double position[3], normal[3], side[3], top[3]; /* half axes, metres */
    double radiance;
    int two_sided;
} panel;

static double from_panel(const double *p, const double *n, const void *light)
{
    enum { N = 48 };
    const panel *a = light;
    double sum = 0, area = 4 * sqrt(dot(a->side, a->side) * dot(a->top, a->top));
    for (int i = 0; i < N * N; i++) {
        double u = 2 * (i / N + 0.5) / N - 1, v = 2 * (i % N + 0.5) / N - 1, l[3];
        for (int k = 0; k < 3; k++)
            l[k] = a->position[k] + u * a->side[k] + v * a->top[k] - p[k];
        double d2 = dot(l, l), from = -dot(l, a->normal), to = fmax(dot(l, n), 0);
        sum += to * (a->two_sided ? fabs(from) : fmax(from, 0)) / (d2 * d2);
    }
    return a->radiance * sum * area / (N * N);
}

typedef struct bulb {
    double position[3], radius, radiance;
} bulb;

static double from_bulb(const double *p, const double *n, const void *light)
{
    enum { N = 64 };
    const bulb *a = light;
    double sum = 0; /* over its whole surface; what is turned away does not count */
    for (int i = 0; i < 2 * N * N; i++) {
        double z = 1 - 2 * (i / (2 * N) + 0.5) / N, turn = pi * (i % (2 * N) + 0.5) / N,
               across = sqrt(1 - z * z), m[3] = {across * cos(turn), across * sin(turn), z}, l[3];
        for (int k = 0; k < 3; k++)
            l[k] = a->position[k] + a->radius * m[k] - p[k];
        double d2 = dot(l, l);
        sum += fmax(dot(l, n), 0) * fmax(-dot(l, m), 0) / (d2 * d2);
    }
    return a->radiance * sum * 4 * pi * a->radius * a->radius / (2 * N * N);
}

/* A point light at a place, its candela 100, 50 and 10 at 0, 45 and 90 degrees off -y. */
static double from_lamp(const double *p, const double *n, const void *light)
{
    const double *at = light;
    double l[3], d2;
    for (int k = 0; k < 3; k++)
        l[k] = at[k] - p[k];
    d2 = dot(l, l);
    double down = acos(l[1] / sqrt(d2)) * 180 / pi;
    double candela = down < 45 ? 100 - down / 45 * 50 : down < 90 ? 50 - (down - 45) / 45 * 40 : 0;
    return candela / 683 * fmax(dot(l, n), 0) / (d2 * sqrt(d2));
}

/* ---- panels, spheres, lamps ---- */

static void expect(const char *folder, const char *more, irradiance_fn *truth, const void *light, double most)
{
    rl_image_file file = shade(folder, more);
    double error = error_of(&file, truth, light);
    if (error > most)
        fail_msg("error %.2g in\n%s", error, more);
    rl_image_file_free(&file);
}

static void panels(void **state)
{
    char *folder = folder_new();
    /* shines along (0, -0.6, -0.8); its height lies along up without what of it is along that: (0, 0.8, -0.6)
     */
    panel a = {.position = {0.02, 0.06, -0.2},
               .normal = {0, -0.6, -0.8},
               .side = {0.02, 0, 0},
               .top = {0, 0.8 * 0.01, -0.6 * 0.01},
               .radiance = 5};
    (void)state;
    write_capture(folder, identity);
#define PANEL                                                                                                \
    "lights:\n  a: {type: rect, position: [2, 6, -20], direction: [0, -3, -4], width: 4, height: 2, "
    expect(folder, PANEL "radiance: 5}\n", from_panel, &a, 1e-4);
    expect(folder, PANEL "radiance: 5, up: [0, 1, 7]}\n", from_panel, &a, 1e-4);
    expect(folder, PANEL "intensity: 0.004}\n", from_panel, &a, 1e-4); /* L times 8 cm2 */
    expect(folder, PANEL "luminance: 3415}\n", from_panel, &a, 1e-4);
    expect(folder, PANEL "power: 0.012566370614}\n", from_panel, &a, 1e-4); /* pi A L */
    expect(folder, PANEL "two_sided: true, power: 0.025132741229}\n", from_panel, &a, 1e-4);
    expect(folder, PANEL "radiance: 0.625, exposure: 3, color: [1, 0.5, 0]}\n", from_panel, &a, 1e-4);
    for (int k = 0; k < 3; k++) { /* turned by 90 degrees around its direction */
        double side = a.side[k];
        a.side[k] = a.top[k] * 2;
        a.top[k] = side / 2;
    }
    expect(folder, PANEL "radiance: 5, up: [1, 0, 0]}\n", from_panel, &a, 1e-4);
    a.two_sided = 1; /* seen from behind alone */
    expect(folder,
           "lights:\n  a: {type: rect, position: [2, 6, -20], direction: [0, 3, 4], width: 4, height: 2, "
           "radiance: 5, up: [1, 0, 0], two_sided: true}\n",
           from_panel, &a, 1e-4);
    a.radiance = 0;
    rl_image_file dark =
        shade(folder, "lights:\n  a: {type: rect, position: [2, 6, -20], direction: [0, 3, 4], "
                      "width: 4, height: 2, radiance: 5}\n");
    for (int i = 0; i < PIXELS; i++)
        assert_true(fabsf(dark.planes[i]) < 1e-6f);
    rl_image_file_free(&dark);
    folder_remove(folder);
}

/* The camera looks along +x from (2, 0, 1): what is in its own space lights as before. */
static void camera_space(void **state)
{
    char *folder = folder_new();
    const panel a = {.position = {0.02, 0.06, -0.2},
                     .normal = {0, -0.6, -0.8},
                     .side = {0.02, 0, 0},
                     .top = {0, 0.008, -0.006},
                     .radiance = 5};
    (void)state;
    write_capture(folder, "0, 0, 1, -100, 0, 1, 0, 0, -1, 0, 0, 200, 0, 0, 0, 1");
    expect(folder, PANEL "radiance: 5, space: camera}\n", from_panel, &a, 1e-4);
    /* the same in the world: (x, y, z) of the camera is (2 - z, y, 1 + x) there, in metres */
    expect(folder,
           "lights:\n  a: {type: rect, position: [220, 6, 102], direction: [4, -3, 0], width: 4, height: 2, "
           "radiance: 5}\n",
           from_panel, &a, 1e-4);
    folder_remove(folder);
}

static void spheres_and_lamps(void **state)
{
    static const char lamp[] = "IESNA:LM-63-1995\r\n[MANUFAC] L\xe4mp\r\nTILT=NONE\r\n1 1000 1 3 1 1 2 0 0 "
                               "0\r\n1 1 9\r\n0 45 90\r\n0\r\n"
                               "100 50 10\r\n";
    char *folder = folder_new();
    bulb b = {.position = {0.03, 0.02, -0.26}, .radius = 0.02, .radiance = 5};
    const double at[3] = {0.02, 0.02, -0.28};
    (void)state;
    write_capture(folder, identity);
    file_write(folder, "lamp.ies", lamp, sizeof lamp - 1);
#define BULB "lights:\n  a: {type: sphere, position: [3, 2, -26], radius: 2, "
    expect(folder, BULB "radiance: 5}\n", from_bulb, &b, 2e-3); /* the sum's own */
    expect(folder, BULB "power: 0.0789568352}\n", from_bulb, &b, 2e-3);
    expect(folder, BULB "candela: 4.291415539}\n", from_bulb, &b, 2e-3);
    expect(folder,
           "lights:\n  a: {type: point, position: [2, 2, -28], direction: [0, -1, 0], ies: lamp.ies}\n",
           from_lamp, at, 1e-4);
    folder_remove(folder);
}

/* ---- an even sky ---- */

static void write_sky(const char *folder, int width, int height, float value)
{
    static float sky[64 * 32];
    for (int i = 0; i < width * height; i++)
        sky[i] = value;
    const made_channel channels[] = {
        {"B", RL_EXR_FLOAT, 0, sky}, {"G", RL_EXR_FLOAT, 0, sky}, {"R", RL_EXR_FLOAT, 0, sky}};
    const made_part part = {.width = width, .height = height, .channels = channels, .n_channels = 3};
    char *path = path_in(folder, "sky.exr");
    made_write(path, &part, 1);
    free(path);
}

/* What of even light a single bounce on GGX sends on: over normals spaced evenly in D's share. */
static double albedo_of(double nv, double roughness)
{
    enum { N = 200 };
    double a2 = pow(roughness, 4), sv = sqrt(1 - nv * nv), sum = 0;
    for (int i = 0; i < N * N; i++) {
        double u = (i / N + 0.5) / N, turn = 2 * pi * (i % N + 0.5) / N, c2 = (1 - u) / (1 + (a2 - 1) * u);
        double nh = sqrt(c2), vh = nv * nh + sv * sqrt(1 - c2) * cos(turn), nl = 2 * vh * nh - nv;
        if (nl <= 0 || vh <= 0)
            continue;
        double g = 2 * nl * nv / (nl * sqrt(a2 + (1 - a2) * nv * nv) + nv * sqrt(a2 + (1 - a2) * nl * nl));
        sum += g * vh / (nh * nv);
    }
    return sum / (N * N);
}

/* A white matte ball under an even sky is as bright as the sky; a white metal one as its lobe's albedo. */
static void furnace(void **state)
{
    char *folder = folder_new();
    double worst = 0;
    (void)state;
    write_capture(folder, identity);
    rl_image_file file;
    for (int side = 1; side <= 32; side += 31) {
        write_sky(folder, 2 * side, side, 0.75f);
        file = shade(folder, "lights: {}\nambient: {hdri: sky.exr, up: y}\n");
        for (int i = 0; i < PIXELS; i++)
            worst = fmax(worst, fabs((double)file.planes[i] - (stencil[i] ? 0.75 : 0)));
        rl_image_file_free(&file);
    }
    print_message("even sky, matte: largest error %.1e\n", worst);
    assert_true(worst < 2e-5);
    for (int r = 1; r <= 10; r += 3) {
        char more[256];
        double most = 0;
        worst = 0;
        snprintf(more, sizeof more,
                 "lights: {}\nambient: {hdri: sky.exr, up: z, rotation: 77}\n"
                 "materials: {default: {roughness: %g, metallic: 1}}\nshading: {specular: ggx}\n",
                 r / 10.0);
        file = shade(folder, more);
        for (int i = 0; i < PIXELS; i += 5) {
            const double n[3] = {(double)plane[0][i], (double)plane[1][i], (double)plane[2][i]};
            double v[3];
            for (int k = 0; k < 3; k++)
                v[k] = -centre[k] - radius * n[k];
            double nv = dot(n, v) / sqrt(dot(v, v));
            if (!stencil[i] || nv < 0.05)
                continue;
            most = fmax(most, (double)file.planes[i] / 0.75);
            worst = fmax(worst, fabs((double)file.planes[i] / 0.75 - albedo_of(nv, r / 10.0)));
        }
        print_message("even sky, GGX of roughness %.1f: largest error %.4f, at most %.4f\n", r / 10.0, worst,
                      most);
        assert_true(worst < 0.02 && most < 1.005);
        rl_image_file_free(&file);
    }
    folder_remove(folder);
}

/* An HDRI that does not fit the memory limit is not decoded: this one claims much, and holds nothing. */
static void sky_within_limit(void **state)
{
    static const char hdr[] = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8192 +X 16384\n",
                      text[] = "relit: 1\ncapture: capture.yaml\nmaterials: {default: {}}\n"
                               "ambient: {hdri: sky.hdr, up: y}\n"
                               "graph: {light: {pass: lighting}}\n"
                               "outputs: {out: {image: light.lit, file: 'o.{frame}.exr'}}\n",
                      says[] = "p.yaml:4:17: error: the hdri '";
    (void)state;
    char *folder = folder_new(), *pipe = path_in(folder, "p.yaml"), *out = path_in(folder, "out");
    write_capture(folder, identity);
    file_write(folder, "sky.hdr", hdr, strlen(hdr));
    file_write(folder, "p.yaml", text, strlen(text));
    tool_result r = RUN("run", pipe, "--out", out, "--memory-limit", "500M");
    if (r.status != 2 || !strstr(r.err, says) ||
        !strstr(r.err, "has 16384 x 8192 pixels of 3 channels, which take 3.0 GiB to read"))
        fail_msg("%d: %s", r.status, r.err);
    assert_int_equal(folder_files(out), 0);
    tool_result_free(&r);
    free(out);
    free(pipe);
    folder_remove(folder);
}

/* ---- --resume ---- */

static void run_to(const char *folder, const char *says)
{
    char *pipe = path_in(folder, "p.yaml");
    tool_result r = RUN("run", pipe, "--out", folder, "--resume");
    if (r.status || !strstr(r.err, says))
        fail_msg("'%s' is not in\n%s", says, r.err);
    tool_result_free(&r);
    free(pipe);
}

/* Pictures of another lamp or another sky are not kept, though the pipeline's text is the same. */
static void changed_files_are_noticed(void **state)
{
    static const char text[] =
        "relit: 1\ncapture: capture.yaml\nmaterials: {default: {}}\n"
        "shading: {diffuse: lambert, specular: none}\n"
        "ambient: {hdri: sky.exr, up: y, specular: false}\n"
        "lights:\n  a: {type: point, position: [2, 2, -28], direction: [0, -1, 0], ies: lamp.ies}\n"
        "graph: {light: {pass: lighting}}\n"
        "outputs: {out: {image: light.lit, file: 'o.{frame}.exr'}}\n",
                      lamp[] = "IESNA91\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 9\n0 90\n0\n100 10\n";
    char *folder = folder_new(), *other = text_replace(lamp, "100 10", "100 20");
    (void)state;
    write_capture(folder, identity);
    write_sky(folder, 64, 32, 0.75f);
    file_write(folder, "p.yaml", text, strlen(text));
    file_write(folder, "lamp.ies", lamp, strlen(lamp));
    run_to(folder, "2 frames, 2 files");
    run_to(folder, "2 frames are there already");
    file_write(folder, "lamp.ies", other, strlen(other));
    run_to(folder, "they are made again");
    run_to(folder, "2 frames are there already");
    write_sky(folder, 64, 32, 0.5f);
    run_to(folder, "they are made again");
    free(other);
    folder_remove(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(panels),
        cmocka_unit_test(camera_space),
        cmocka_unit_test(spheres_and_lamps),
        cmocka_unit_test(furnace),
        cmocka_unit_test(sky_within_limit),
        cmocka_unit_test(changed_files_are_noticed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
