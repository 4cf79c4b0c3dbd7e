/* Spherical Gaussians and ambient light through the tool: what a pipeline needs for them, and where the light
 * ends up. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "graph/run/image_file.h"
#include "tests/tool_run.h"

static char capture[PATH_MAX]; /* captures/monkey */

static const char pipeline[] = "relit: 1\n"
                               "profiles: {skin: {scatter_distance_mm: [3, 1.2, 0.7]}}\n"
                               "shading: {diffuse: sg, specular: none}\n"
                               "materials: {skin: {profile: skin}, default: {}}\n"
                               "lights: {}\n"
                               "@"
                               "graph:\n"
                               "  bend: {pass: curvature}\n"
                               "  light: {pass: lighting, in: {curvature: bend.curvature}}\n"
                               "outputs:\n"
                               "  both: {layers: {lit: light.lit, diffuse: light.diffuse, albedo: "
                               "capture.albedo}, file: out.exr, type: float}\n";

#define RUN(...) tool_run((const char *const[]){__VA_ARGS__, NULL})

/* `ambient` is put in front of the graph. */
static tool_result run_with(const char *folder, const char *ambient, const char *set)
{
    char *text = text_replace(pipeline, "@", ambient), *pipe = path_in(folder, "p.yaml");
    file_write(folder, "p.yaml", text, strlen(text));
    tool_result r = set ? RUN("run", pipe, "--capture", capture, "--frames", "1", "--crop", "200,60,128,64",
                              "--out", folder, "--set", set)
                        : RUN("run", pipe, "--capture", capture, "--frames", "1", "--crop", "200,60,128,64",
                              "--out", folder);
    free(text);
    free(pipe);
    return r;
}

static void expect(tool_result r, int status, const char *says)
{
    if (r.status != status || !strstr(r.err, says))
        print_error("status %d instead of %d, or not '%s' in:\n%s%s\n", r.status, status, says, r.out, r.err);
    assert_int_equal(r.status, status);
    assert_non_null(strstr(r.err, says));
    tool_result_free(&r);
}

static rl_image_file read_back(const char *folder)
{
    char *path = path_in(folder, "out.exr");
    rl_image_file file = {0};
    rl_error err = {0};
    if (rl_image_file_read(path, &file, &err))
        fail_msg("%s", err.text);
    free(path);
    return file;
}

/* Channel by name, e.g. "lit.R". */
static const float *channel(const rl_image_file *f, const char *name)
{
    const char *at = f->names;
    for (int i = 0; *at; i++) {
        size_t n = strcspn(at, ",");
        if (n == strlen(name) && !strncmp(at, name, n))
            return f->planes + (size_t)i * (size_t)f->width * (size_t)f->height;
        at += n + (at[n] == ',');
    }
    fail_msg("no channel %s in %s", name, f->names);
    return NULL;
}

static void curvature_must_be_there(void **state)
{
    char *folder = folder_new();
    (void)state;
    expect(run_with(folder, "", "graph.light.in=null"), 2,
           "pass 'light' (lighting): port 'curvature' needs an image (scalar), since material 'skin' has "
           "'diffuse: sg': name one in "
           "`in:` or give the capture a layer 'curvature'");
    expect(run_with(folder, "", "shading.diffuse=lambert"), 0, "");
    expect(run_with(folder, "", "materials.skin.profile=null"), 0, ""); /* nothing scatters */
    expect(run_with(folder, "", "profiles.skin.scatter_distance_mm=null"), 2,
           "the profile of material 'skin' needs 'sg_variance_mm2' or 'scatter_distance_mm', since it has "
           "'diffuse: sg'");
    expect(run_with(folder, "", "profiles.skin={sg_variance_mm2: [9, 3, 1]}"), 0, "");
    folder_remove(folder);
}

/* An even sky of radiance 2 lights everything with E = 2 pi, whatever the curvature: lit = 2 albedo, no
 * diffuse. */
static void expect_even_sky(const char *folder, double within)
{
    rl_image_file f = read_back(folder);
    const float *lit = channel(&f, "lit.G"), *albedo = channel(&f, "albedo.G"),
                *diffuse = channel(&f, "diffuse.G");
    double worst = 0;
    int seen = 0;
    for (int i = 0; i < f.width * f.height; i++) {
        assert_true(diffuse[i] == 0);
        if (albedo[i] <= 0)
            continue;
        worst = fmax(worst, fabs((double)lit[i] / (2 * (double)albedo[i]) - 1));
        seen++;
    }
    print_message("even sky: largest relative error %.1g over %d pixels\n", worst, seen);
    assert_true(seen > 4000);
    assert_true(worst < within);
    rl_image_file_free(&f);
}

static void write_sky(const char *folder, const char *name, rl_image_type type)
{
    enum { W = 128, H = 64 };
    static float plane[W * H];
    rl_image_planes image = {W, H, 3, {plane, plane, plane}, W};
    rl_image_options options = {.type = type};
    rl_error err = {0};
    char *path = path_in(folder, name);
    for (int i = 0; i < W * H; i++)
        plane[i] = 1;
    if (rl_image_file_write(path, &image, &options, NULL, NULL, &err))
        fail_msg("%s", err.text);
    free(path);
}

static void skies_light_from_everywhere(void **state)
{
    char *folder = folder_new(), harmonics[128];
    (void)state;
    write_sky(folder, "sky.tif", RL_IMAGE_FLOAT);
    write_sky(folder, "sky.png", RL_IMAGE_U8);
    snprintf(harmonics, sizeof harmonics, "ambient: {sh: [%.12f, 0, 0, 0, 0, 0, 0, 0, 0], intensity: 2}\n",
             sqrt(4 * acos(-1)));
    expect(run_with(folder, harmonics, NULL), 0, "");
    expect_even_sky(folder, 1e-6);
    expect(run_with(folder, "ambient: {hdri: sky.tif, up: z, rotation: 30, intensity: [2, 2, 2]}\n", NULL), 0,
           "");
    expect_even_sky(folder, 2e-4); /* 64 rows: harmonics are taken at the pixels' centres */
    expect(run_with(folder, "ambient: {hdri: sky.png, up: z}\n", NULL), 2, "linear light, half or float");
    expect(run_with(folder, "ambient: {hdri: night.exr, up: z}\n", NULL), 2, "night.exr");
    expect(run_with(folder, "ambient: {hdri: sky.tif, up: x}\n", NULL), 2, "p.yaml:6:");
    expect(run_with(folder, "ambient: {sh: 3, colorspace: mauve}\n", NULL), 2, "sh");
    expect(run_with(folder, "ambient: {colorspace: mauve}\n", NULL), 2, "mauve");
    folder_remove(folder);
}

int main(int argc, char **argv)
{
    tool_child(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(curvature_must_be_there),
        cmocka_unit_test(skies_light_from_everywhere),
    };
    if (!realpath("captures/monkey", capture))
        return 1;
    return cmocka_run_group_tests(tests, NULL, NULL);
}
