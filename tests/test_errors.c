/* Bad input, a row each: the exit status, exactly one error line with its place and the nearest name, and
 * nothing written. The base is a good pipeline on captures/monkey; a row changes one thing in it. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "graph/run/exr.h"
#include "tests/tool_run.h"

static const char base_pipeline[] =
    "relit: 1\n"
    "capture: capture.yaml\n"
    "profiles:\n"
    "  skin: {scatter_distance_mm: [3.0, 1.2, 0.7]}\n"
    "materials:\n"
    "  skin: {profile: skin, roughness: 0.45}\n"
    "  default: {}\n"
    "lights:\n"
    "  key: {type: point, position: [-0.5, -0.52, 0.47], intensity: 2.2}\n"
    "graph:\n"
    "  light: {pass: lighting}\n"
    "  sss: {pass: sss_burley, in: {diffuse: light.diffuse, lit: light.lit}, taps: 21}\n"
    "  aa: {pass: taa, in: {color: sss.color}, blend: 0.05}\n"
    "outputs:\n"
    "  beauty: {image: aa.color, file: \"{capture}.{frame:04}.exr\"}\n"
    "  view: {image: aa.color, file: \"{capture}.{frame:04}.png\", display: sRGB, view: ACES}\n";

static char capture_folder[PATH_MAX]; /* captures/monkey of the repository */

/* What is changed, and what must come of it. `find` is replaced by `put`, in the pipeline or in the manifest
 * (NULL: `put` is appended). `at`: the text of that file at which the error must point, line and column. */
typedef struct row {
    const char *name;
    const char *find, *put;
    bool manifest; /* the change is in capture.yaml */
    const char *at;
    const char *arguments[5]; /* further ones */
    const char *says[6];      /* parts of the message */
    int status;               /* 0 stands for 2 */
} row;

/* clang-format off */
static const row rows[] = {
    /* lights */
    {"shadow that is neither a layer nor a word", "intensity: 2.2", "intensity: 2.2, shadow: screem", .at = "screem}", .says = {"did you mean 'screen'?", "known: fill, key, none, rim, screen"}},
    {"light in an unknown colour space", "intensity: 2.2", "intensity: 2.2, colorspace: lin_rec70", .at = "lin_rec70}", .says = {"did you mean 'lin_rec709'?"}},
    {"light too far for floats", "position: [-0.5,", "position: [1e300,", .at = "[1e300", .says = {"'key'", "more than 1e+12 m away"}},
    {"light too bright for floats", "intensity: 2.2", "intensity: [1, 1e31, 1]", .at = "{type: point", .says = {"'key'", "too bright", "1e+31 W/sr", "1e+30"}},
    {"area light too bright for floats", "type: point, position: [-0.5, -0.52, 0.47], intensity: 2.2", "type: sphere, radius: 1e-5, position: [0, 0, 0], intensity: 1e29", .at = "{type: sphere", .says = {"too bright", "W/(sr m2)"}},
    {"exposure too bright for floats", "intensity: 2.2", "intensity: 1e20, exposure: 64", .at = "{type: point", .says = {"too bright"}},
    {"no such ies file", "intensity: 2.2", "direction: [0, 0, -1], ies: no.ies", .at = "no.ies", .says = {"light 'key': the ies file '", "no.ies' cannot be opened: No such file"}},
    {"ies file without a name", "intensity: 2.2", "direction: [0, 0, -1], ies: ''", .at = "''}", .says = {"the ies file '", "cannot be"}},
    {"no such hdri", NULL, "ambient: {hdri: no.hdr, up: z}\n", .at = "no.hdr", .says = {"the hdri '", "no.hdr' cannot be read: No such file"}},
    {"hdri that is no picture", NULL, "ambient: {hdri: capture.yaml, up: z}\n", .at = "capture.yaml, up", .says = {"the hdri '", "is not an image"}},
    {"ambient light too bright for floats", NULL, "ambient: {sh: [3e38, 0, 0, 0, 0, 0, 0, 0, 0], intensity: 100}\n", .at = "{sh:", .says = {"ambient light is too bright", "1e+30"}},
    /* names */
    {"unknown key", "materials:", "materails:", .at = "materails", .says = {"'materails'", "did you mean 'materials'?"}},
    {"unknown pass", "sss_burley", "sss_burly", .at = "sss_burly", .says = {"did you mean 'sss_burley'?"}},
    {"unknown port", "diffuse: light", "difuse: light", .at = "difuse", .says = {"'sss'", "sss_burley", "did you mean 'diffuse'?"}},
    {"unknown parameter", "taps: 21", "tapps: 21", .at = "tapps", .says = {"pass 'sss' (sss_burley) has no parameter 'tapps'; did you mean 'taps'?"}},
    {"unknown capture layer", "in: {color: sss.color}", "in: {color: sss.color, depth: capture.dept}", .at = "capture.dept", .says = {"did you mean", "depth"}},
    {"unknown layer in the manifest", "roughness: {", "roughnes: {", true, "roughnes", .says = {"did you mean 'roughness'?"}},
    {"unknown image", "image: aa.color, file: \"{capture}.{frame:04}.exr\"", "image: aa.colour, file: \"{capture}.{frame:04}.exr\"", .at = "aa.colour", .says = {"'aa.colour'", "did you mean 'color'?"}},
    {"unknown image of an input", "color: sss.color", "color: ssss.color", .at = "ssss.color", .says = {"'ssss.color'", "did you mean 'sss'?"}},
    {"unknown light of a shadow layer", "intensity: 2.2", "intensity: 2.2, shadow: rimm", .at = "rimm}", .says = {"'key'", "shadow.rimm", "did you mean 'rim'?"}},
    {"unknown key of a light", "intensity: 2.2", "intensty: 2.2", .at = "intensty", .says = {"did you mean 'intensity'?"}},
    {"unknown profile", "profile: skin", "profile: skni", .at = "skni", .says = {"did you mean 'skin'?"}},
    {"unknown key of a profile", "scatter_distance_mm", "scatter_distance_m", .at = "scatter_distance_m", .says = {"did you mean 'scatter_distance_mm'?"}},
    {"unknown key of a material", "roughness: 0.45", "roughnes: 0.45", .at = "roughnes", .says = {"did you mean 'roughness'?"}},
    {"unknown display", "display: sRGB", "display: sRBG", .says = {"pipe.yaml:", "did you mean 'sRGB'?"}},
    {"unknown view", "view: ACES}", "view: ACSE}", .says = {"pipe.yaml:", "did you mean 'ACES'?"}},
    {"unknown colour space", "display: sRGB, view: ACES", "colorspace: ACEScgg", .says = {"pipe.yaml:", "did you mean 'ACEScg'?"}},
    {"unknown output", .arguments = {"--only", "beuaty"}, .says = {"did you mean 'beauty'?"}},
    {"unknown image to dump", .arguments = {"--dump", "light.difuse"}, .says = {"--dump: error:", "did you mean 'diffuse'?"}},
    {"unknown option", .arguments = {"--frmes", "1"}, .says = {"relit run: error:", "did you mean 'frames'?"}},
    {"unknown path of --set", .arguments = {"--set", "graph.sss.tapps=5"}, .says = {"--set", "did you mean 'taps'?"}},
    /* values */
    {"below the range", "blend: 0.05", "blend: -0.5", .at = "-0.5}", .says = {"blend", "-0.5", "0"}},
    {"above the range", "blend: 0.05", "blend: 1.5", .at = "1.5", .says = {"blend", "1.5", "1"}},
    {"NaN", "blend: 0.05", "blend: .nan", .at = ".nan", .says = {"blend"}},
    {"infinite", "intensity: 2.2", "intensity: .inf", .at = ".inf", .says = {"intensity"}},
    {"wrong type", "blend: 0.05", "blend: [0.05]", .at = "[0.05]", .says = {"blend", "a list"}},
    {"wrong type of a section", "profiles:\n", "shading: 5\nprofiles:\n", .at = "5\nprofiles", .says = {"shading", "a map"}},
    {"wrong word", "profile: skin", "profile: skin, diffuse: disny", .at = "disny", .says = {"did you mean 'disney'?"}},
    {"value of --set out of range", .arguments = {"--set", "graph.aa.blend=2"}, .says = {"--set graph.aa.blend", "blend", "2"}},
    {"frames that are not listed", .arguments = {"--frames", "7-9"}, .says = {"frame 9 is not in the capture 'monkey', which lists 1-8"}},
    {"frames that are no spec", .arguments = {"--frames", "1..3"}, .says = {"1..3"}},
    {"not YAML", "relit: 1", "relit: [1", .says = {"pipe.yaml:"}},
    {"key twice", "relit: 1", "relit: 1\nrelit: 1", .at = "relit: 1\ncapture", .says = {"relit"}},
    {"another pass's parameter", "pass: sss_burley", "pass: sss_gaussian", .at = "taps: 21", .says = {"has no parameter 'taps'; known: separable, weighting"}},
    {"the beginning of a word", "profile: skin", "profile: skin, diffuse: lamb", .at = "lamb, rough", .says = {"did you mean 'lambert'?"}},
    {"the beginning of a key", "roughness: 0.45", "rough: 0.45", .at = "rough:", .says = {"did you mean 'roughness'?"}},
    {"an integer of more than 32 bits", "taps: 21", "seed: 4294967296", .at = "4294967296", .says = {"'seed': expected an integer of at most 2147483647 (32 bits)"}},
    {"no version", "relit: 1\n", "", .says = {"pipe.yaml:", "relit: 1"}},
    /* structure */
    {"cycle", "light: {pass: lighting}", "light: {pass: lighting, in: {albedo: aa.color}}", .says = {"pipe.yaml:", "light", "sss", "aa", "->"}},
    {"two passes of one name", "  aa: {pass: taa", "  sss: {pass: combine, in: {diffuse: light.diffuse, lit: light.lit}}\n  aa: {pass: taa", .at = "sss: {pass: combine", .says = {"'sss'"}},
    {"wrong format", "color: sss.color", "color: capture.depth", .at = "capture.depth", .says = {"'aa'", "color", "rgb", "scalar"}},
    {"include loop", "relit: 1\n", "relit: 1\ninclude: [pipe.yaml]\n", .says = {"pipe.yaml:2:", "pipe.yaml"}},
    {"include missing", "relit: 1\n", "relit: 1\ninclude: [gone.yaml]\n", .says = {"gone.yaml"}},
    {"two outputs of one file", "frame:04}.png\"", "frame:04}.exr\"", .says = {"pipe.yaml:", "beauty", "view"}},
    /* captures */
    {"missing manifest", "capture: capture.yaml", "capture: gone.yaml", .says = {"gone.yaml"}},
    {"a pipeline for a manifest", "capture: capture.yaml", "capture: pipe.yaml", .says = {"pipe.yaml: error: this is a pipeline, not the manifest of a capture"}},
    {"missing files", "monkey.####.exr", "gone.####.exr", true, .says = {"gone."}},
    {"missing channel", "normal.X, normal.Y", "nrm.X, normal.Y", true, .says = {"monkey.0001.exr", "layer 'normal'", "'nrm.X'", "normal.X"}},
    {"missing required layer", "  depth:     {channels: [depth.Z], kind: planar, empty: 1e10}\n", "", true, .says = {"depth"}},
    {"a material for a name that the capture lacks", "  default: {}", "  default: {}\n  marbel: {}", .at = "marbel", .says = {"marbel"}},
    {"a stencil id without a material", "  default: {}\n", "", .says = {"id 2 'plaster' (", " pixels), 3 'leaf' ("}, .status = 1},
    {"more memory than allowed", .arguments = {"--memory-limit", "1M"}, .says = {"memory"}},
    {"a crop outside of the image", .arguments = {"--crop", "5000,0,10,10"}, .says = {"error: --crop 5000,0,10,10 lies outside of the image, which is 0,0,480,270"}},
    {"a layer in an unknown colour space", "colorspace: lin_rec709", "colorspace: lin_rec70", true, "lin_rec70}", .says = {"did you mean 'lin_rec709'?", "known: ACES2065-1"}},
    {"depth that is empty everywhere", "empty: 1e10", "empty: 0", true, "0}\n", .says = {"'empty' is 0: out of range, above 0"}},
};
/* clang-format on */

/* ---- checking --------------------------------------------------------------------------------------------
 */

static int error_lines(const char *text)
{
    int n = 0;
    for (const char *at = strstr(text, "error: "); at; at = strstr(at + 1, "error: "))
        n++;
    return n;
}

static bool place_found(const char *err, const char *path, const char *text, const char *at)
{
    const char *found = strstr(text, at);
    char place[PATH_MAX + 64];
    int line = 1, column = 1;
    if (!found)
        return false;
    for (const char *c = text; c < found; c++) {
        column = *c == '\n' ? 1 : column + 1;
        line += *c == '\n';
    }
    snprintf(place, sizeof place, "%s:%d:%d: error: ", path, line, column);
    if (strstr(err, place))
        return true;
    print_error("    expected the place %s\n", place);
    return false;
}

static bool check(const row *r, const tool_result *got, const char *folder, const char *changed)
{
    char *out = path_in(folder, "out"), *path = path_in(folder, r->manifest ? "capture.yaml" : "pipe.yaml");
    bool good = got->status == (r->status ? r->status : 2) && error_lines(got->err) == 1;
    for (int i = 0; i < 6 && r->says[i]; i++)
        good = good && strstr(got->err, r->says[i]);
    if (r->at)
        good = place_found(got->err, path, changed, r->at) && good;
    good = good && folder_files(out) == 0 && !strstr(got->err, "AddressSanitizer");
    if (!good)
        print_error("%s: status %d, %d error lines, %d files written:\n%s", r->name, got->status,
                    error_lines(got->err), folder_files(out), got->err);
    free(out);
    free(path);
    return good;
}

/* capture.yaml of captures/monkey with its files named absolutely. */
static char *base_manifest(void)
{
    size_t size;
    char *path = path_in(capture_folder, "capture.yaml"), *text = file_read(path, &size);
    char *files = path_in(capture_folder, "monkey.####.exr");
    char *result = text_replace(text, "monkey.####.exr", files);
    free(path);
    free(text);
    free(files);
    return result;
}

static tool_result run_in(const char *folder, const char *frames, const char *const *more,
                          const char *setting)
{
    char *pipe = path_in(folder, "pipe.yaml"), *out = path_in(folder, "out");
    const char *arguments[16] = {"run", pipe, "--out", out, "--quiet"};
    int n = 5;
    bool given = false;
    for (int i = 0; more && i < 5 && more[i]; i++) {
        given = given || !strcmp(more[i], "--frames");
        arguments[n++] = more[i];
    }
    if (!given) {
        arguments[n++] = "--frames";
        arguments[n++] = frames;
    }
    tool_result r = setting ? tool_run_child(setting, arguments) : tool_run(arguments);
    free(pipe);
    free(out);
    return r;
}

static void test_rows(void **state)
{
    (void)state;
    int bad = 0;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const row *r = &rows[i];
        char *folder = folder_new(), *manifest = base_manifest();
        char *pipeline = text_replace(base_pipeline, r->manifest ? "" : r->find, r->manifest ? "" : r->put);
        if (r->manifest) {
            char *changed = text_replace(manifest, r->find, r->put);
            free(manifest);
            manifest = changed;
        }
        file_write(folder, "pipe.yaml", pipeline, strlen(pipeline));
        file_write(folder, "capture.yaml", manifest, strlen(manifest));
        tool_result got = run_in(folder, "1", r->arguments, NULL);
        bad += !check(r, &got, folder, r->manifest ? manifest : pipeline);
        tool_result_free(&got);
        free(pipeline);
        free(manifest);
        folder_remove(folder);
    }
    assert_int_equal(bad, 0);
}

/* The rows prove something only if the unchanged input is good. */
static void test_base_is_good(void **state)
{
    (void)state;
    char *folder = folder_new(), *manifest = base_manifest(), *out = path_in(folder, "out");
    file_write(folder, "pipe.yaml", base_pipeline, strlen(base_pipeline));
    file_write(folder, "capture.yaml", manifest, strlen(manifest));
    tool_result got = run_in(folder, "1", NULL, NULL);
    if (got.status)
        print_error("%s", got.err);
    assert_int_equal(got.status, 0);
    assert_int_equal(folder_files(out), 2);
    assert_int_equal(error_lines(got.err), 0);
    tool_result_free(&got);
    free(manifest);
    free(out);
    folder_remove(folder);
}

/* ---- broken files ----------------------------------------------------------------------------------------
 */

static char *manifest_of_copies(void)
{
    size_t size;
    char *path = path_in(capture_folder, "capture.yaml"), *text = file_read(path, &size);
    char *result = text_replace(text, "frames: 1-8", "frames: 1-2");
    free(path);
    free(text);
    return result;
}

/* A folder with the pipeline, a manifest of two frames, and copies of two recorded ones. */
static char *two_frames(char **second, size_t *size)
{
    char *folder = folder_new(), *manifest = manifest_of_copies();
    char *one = path_in(capture_folder, "monkey.0001.exr"), *two = path_in(capture_folder, "monkey.0002.exr");
    char *data = file_read(one, size);
    file_write(folder, "pipe.yaml", base_pipeline, strlen(base_pipeline));
    file_write(folder, "capture.yaml", manifest, strlen(manifest));
    file_write(folder, "monkey.0001.exr", data, *size);
    free(data);
    *second = file_read(two, size);
    free(manifest);
    free(one);
    free(two);
    return folder;
}

/* With the second frame broken the first is written and the second is the one error; status 1. */
static void check_broken_frame(const char *name, char *(*damage)(char *data, size_t *size), const char *says)
{
    size_t size;
    char *data, *folder = two_frames(&data, &size), *out = path_in(folder, "out");
    data = damage(data, &size);
    if (data)
        file_write(folder, "monkey.0002.exr", data, size);
    tool_result got = run_in(folder, "1-2", NULL, NULL);
    bool good = got.status == 1 && error_lines(got.err) == 1 && folder_files(out) == 2 &&
                strstr(got.err, "monkey.0002.exr: error: ") && strstr(got.err, says);
    if (!good)
        print_error("%s: status %d, %d files:\n%s", name, got.status, folder_files(out), got.err);
    tool_result_free(&got);
    free(data);
    free(out);
    folder_remove(folder);
    assert_true(good);
}

static char *damage_truncate(char *data, size_t *size)
{
    *size = *size * 6 / 10;
    return data;
}

static char *damage_header(char *data, size_t *size)
{
    memset(data, 0x5a, *size < 64 ? *size : 64);
    return data;
}

/* The middle of the pixels: the header stays whole, a chunk does not unpack. */
static char *damage_pixels(char *data, size_t *size)
{
    for (size_t i = *size / 2; i < *size / 2 + 4096; i++)
        data[i] = (char)(data[i] ^ 0x5a);
    return data;
}

static char *damage_empty(char *data, size_t *size)
{
    *size = 0;
    return data;
}

static char *damage_remove(char *data, size_t *size)
{
    (void)size;
    free(data);
    return NULL;
}

static void test_truncated(void **state)
{
    (void)state;
    check_broken_frame("truncated", damage_truncate, "");
}

static void test_corrupt_header(void **state)
{
    (void)state;
    check_broken_frame("corrupt header", damage_header, "");
}

static void test_corrupt_pixels(void **state)
{
    (void)state;
    check_broken_frame("corrupt pixels", damage_pixels, "");
}

static void test_zero_bytes(void **state)
{
    (void)state;
    check_broken_frame("zero bytes", damage_empty, "");
}

static void test_missing_frame(void **state)
{
    (void)state;
    check_broken_frame("missing frame", damage_remove, "");
}

/* Data window and display window of 40,000 × 40,000 in the header: 6.4 GB a channel. */
static char *damage_size(char *data, size_t *size)
{
    static const char name[] = "dataWindow\0box2i";
    for (size_t i = 0; i + 64 < *size; i++) {
        if (memcmp(data + i, name, sizeof name))
            continue;
        int32_t box[4] = {0, 0, 39999, 39999};
        memcpy(data + i + sizeof name + 4, box, sizeof box);
        return data;
    }
    fail_msg("the file has no data window");
    return data;
}

static void test_huge_dimensions(void **state)
{
    (void)state;
    static const char *const limit[] = {"--memory-limit", "1G", NULL, NULL, NULL};
    size_t size;
    char *data, *folder = two_frames(&data, &size), *out = path_in(folder, "out");
    data = damage_size(data, &size);
    file_write(folder, "monkey.0002.exr", data, size);
    tool_result got = run_in(folder, "1-2", limit, NULL);
    bool good = got.status == 1 && error_lines(got.err) == 1 && folder_files(out) == 2 &&
                strstr(got.err, "monkey.0002.exr: error: ");
    if (!good)
        print_error("status %d, %d files:\n%s", got.status, folder_files(out), got.err);
    tool_result_free(&got);
    free(data);
    free(out);
    folder_remove(folder);
    assert_true(good);
}

/* ---- layers of different size ----------------------------------------------------------------------------
 */

static void write_small_albedo(const char *folder)
{
    enum { SIDE = 64 };
    static float plane[SIDE * SIDE];
    char *path = path_in(folder, "small.0001.exr");
    rl_exr_source channels[] = {{"albedo.R", RL_EXR_HALF, plane, NULL, SIDE},
                                {"albedo.G", RL_EXR_HALF, plane, NULL, SIDE},
                                {"albedo.B", RL_EXR_HALF, plane, NULL, SIDE}};
    rl_exr_image image = {.data_window = {0, 0, SIDE - 1, SIDE - 1},
                          .display_window = {0, 0, SIDE - 1, SIDE - 1},
                          .channels = channels,
                          .n_channels = 3,
                          .compression = RL_EXR_ZIP};
    rl_error err = {0};
    assert_int_equal(rl_exr_write(path, &image, NULL, NULL, &err), RL_OK);
    free(path);
}

static void test_layers_of_different_size(void **state)
{
    (void)state;
    char *folder = folder_new(), *manifest = base_manifest(), *out = path_in(folder, "out");
    char *small = path_in(folder, "small.####.exr"), *files = path_in(capture_folder, "monkey.####.exr");
    char map[2 * PATH_MAX + 64];
    snprintf(map, sizeof map, "{default: \"%s\", albedo: \"%s\"}", files, small);
    char *changed = text_replace(manifest, files, map);
    write_small_albedo(folder);
    file_write(folder, "pipe.yaml", base_pipeline, strlen(base_pipeline));
    file_write(folder, "capture.yaml", changed, strlen(changed));
    tool_result got = run_in(folder, "1", NULL, NULL);
    bool good = (got.status == 1 || got.status == 2) && error_lines(got.err) == 1 && folder_files(out) == 0 &&
                strstr(got.err, "(63, 63)") && strstr(got.err, "(479, 269)") && strstr(got.err, "albedo");
    if (!good)
        print_error("status %d:\n%s", got.status, got.err);
    tool_result_free(&got);
    free(manifest);
    free(changed);
    free(out);
    free(small);
    free(files);
    folder_remove(folder);
    assert_true(good);
}

/* ---- the machine -----------------------------------------------------------------------------------------
 */

static void check_machine(const char *out_folder, const char *setting, const char *says, const char *also)
{
    char *folder = folder_new(), *manifest = base_manifest(), *out = path_in(folder, out_folder);
    char *pipe = path_in(folder, "pipe.yaml");
    file_write(folder, "pipe.yaml", base_pipeline, strlen(base_pipeline));
    file_write(folder, "capture.yaml", manifest, strlen(manifest));
    int before = folder_files(folder);
    const char *arguments[] = {"run",      pipe, "--out", out_folder[0] == '/' ? out_folder : out,
                               "--frames", "1",  NULL};
    tool_result got = setting ? tool_run_child(setting, arguments) : tool_run(arguments);
    bool good = got.status == 2 && error_lines(got.err) == 1 && strstr(got.err, says) &&
                strstr(got.err, also) && folder_files(folder) == before;
    if (!good)
        print_error("status %d:\n%s", got.status, got.err);
    tool_result_free(&got);
    free(manifest);
    free(out);
    free(pipe);
    folder_remove(folder);
    assert_true(good);
}

static void test_no_device(void **state)
{
    (void)state;
    check_machine("out", "OCL_ICD_VENDORS=/nonexistent", "no OpenCL device", "PoCL");
}

/* Root ignores permissions: a path below a file, and a file system that takes no files. */
static void test_unwritable_output(void **state)
{
    (void)state;
    check_machine("pipe.yaml/out", NULL, "pipe.yaml", "error: ");
    check_machine("/proc", NULL, "/proc", "error: ");
    check_machine("/proc/relit-out", NULL, "/proc", "error: ");
}

static void test_missing_pipeline(void **state)
{
    (void)state;
    const char *arguments[] = {"run", "no/such/pipeline.yaml", NULL};
    tool_result got = tool_run(arguments);
    assert_int_equal(got.status, 2);
    assert_int_equal(error_lines(got.err), 1);
    assert_non_null(strstr(got.err, "no/such/pipeline.yaml"));
    tool_result_free(&got);
}

int main(int argc, char **argv)
{
    tool_child(argc, argv);
    if (!realpath("captures/monkey", capture_folder)) {
        fprintf(stderr, "run this from the repository: captures/monkey is not here\n");
        return 1;
    }
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_base_is_good),
        cmocka_unit_test(test_rows),
        cmocka_unit_test(test_truncated),
        cmocka_unit_test(test_corrupt_header),
        cmocka_unit_test(test_corrupt_pixels),
        cmocka_unit_test(test_zero_bytes),
        cmocka_unit_test(test_missing_frame),
        cmocka_unit_test(test_huge_dimensions),
        cmocka_unit_test(test_layers_of_different_size),
        cmocka_unit_test(test_no_device),
        cmocka_unit_test(test_unwritable_output),
        cmocka_unit_test(test_missing_pipeline),
    };
    return cmocka_run_group_tests_name("errors", tests, NULL, NULL);
}
