/* Pipeline files: sections, nodes, user kernels, outputs, file patterns, the content's hash. */
#include "tests/config_help.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/base/text.h"
#include "graph/model/pipeline.h"

static rl_code parse_code(const char *text, const rl_pipeline **out)
{
    return rl_pipeline_parse_from(&config_registry, &config_arena, "dir/soft.skin.yaml", config_parse(text),
                                  &config_log, out, &config_error);
}

static const rl_pipeline *parse(const char *text)
{
    const rl_pipeline *p = NULL;
    config_assert_fine(parse_code(text, &p));
    return p;
}

static void refuse(const char *text, const char *expected)
{
    const rl_pipeline *p;
    assert_int_equal(parse_code(text, &p), RL_E_CONFIG);
    config_assert_error(expected);
}

/* An output's keys, refused; its line is 2 and its first key at column 16. */
static void refuse_output(const char *keys, const char *expected)
{
    char text[512];
    snprintf(text, sizeof text, "relit: 1\noutputs: {o: {%s}}", keys);
    refuse(text, expected);
}

static const rl_output *output(const char *keys)
{
    char text[512];
    snprintf(text, sizeof text, "relit: 1\noutputs: {o: {%s}}", keys);
    const rl_pipeline *p = parse(text);
    assert_int_equal(p->n_outputs, 1);
    return &p->outputs[0];
}

/* ---- sections
 * -------------------------------------------------------------------------------------------------- */

static void test_whole(void **state)
{
    (void)state;
    const rl_pipeline *p =
        parse("relit: 1\n"
              "capture: {files: a.exr}\n"
              "color: {config: c.ocio, working: lin_rec709}\n"
              "profiles: {a: {distance_mm: 1}}\n"
              "shading: {specular: none}\n"
              "materials: {default: {}}\n"
              "lights: {key: {type: point}}\n"
              "graph:\n"
              "  soft: {pass: blur, in: {color: capture.albedo, depth: capture.depth}, taps: 21}\n"
              "  warm: {pass: tint, in: {color: soft.color}}\n"
              "outputs: {beauty: {image: warm.out, file: a.exr}}\n");
    assert_string_equal(p->name, "soft.skin");
    assert_string_equal(p->file, "dir/soft.skin.yaml");
    assert_int_equal(p->capture->kind, RL_MAP);
    assert_string_equal(p->working, "lin_rec709");
    assert_string_equal(p->ocio_config, "c.ocio");
    assert_int_equal(p->color_where.line, 3);
    assert_true(p->profiles && p->shading && p->materials && p->lights);
    assert_int_equal(p->n_nodes, 2);
    const rl_node *soft = &p->nodes[0];
    assert_string_equal(soft->name, "soft");
    assert_int_equal(soft->where.line, 9);
    assert_int_equal(soft->where.column, 3);
    assert_ptr_equal(soft->pass, config_registry.passes[0]);
    int32_t taps;
    memcpy(&taps, (const char *)soft->params + 4, sizeof taps);
    assert_int_equal(taps, 21);
    assert_int_equal(soft->n_inputs, 2);
    assert_string_equal(soft->inputs[1].port, "depth");
    assert_string_equal(soft->inputs[1].image, "capture.depth");
    assert_int_equal(soft->inputs[1].where.column, 57);
    assert_string_equal(p->outputs[0].layers[0].image, "warm.out");
    assert_string_equal(config_logged, "");
}

static void test_little(void **state)
{
    (void)state;
    const rl_pipeline *p = parse("relit: 1");
    assert_true(!p->capture && !p->working && !p->ocio_config && !p->lights && !p->materials);
    assert_int_equal(p->n_nodes + p->n_outputs, 0);
    assert_string_equal(config_logged,
                        "warning t.yaml:1:1 the pipeline has no outputs: nothing needs its passes");
    assert_string_equal(parse("{relit: 1, capture: a.exr}")->capture->text, "a.exr");
}

static void test_wrong_sections(void **state)
{
    (void)state;
    refuse("graph: {}", "t.yaml:1:1: error: 'relit: 1' is missing: write it as the first line of a pipeline");
    refuse(
        "relit: 2",
        "t.yaml:1:8: error: 'relit': expected 1, the version of the pipeline format, found the number '2'");
    refuse("relit_capture: 1",
           "t.yaml:1:1: error: this is the manifest of a capture, not a pipeline: `relit init` "
           "writes a pipeline for it");
    refuse("3",
           "t.yaml:1:1: error: 'pipeline': expected a map that starts with 'relit: 1', found the number '3'");
    refuse("{relit: 1, output: {}}", "t.yaml:1:12: error: a pipeline has no key 'output'; did you mean "
                                     "'outputs'? known: ambient, capture, color, graph, "
                                     "lights, materials, outputs, profiles, relit, shading");
    refuse("{relit: 1, include: a.yaml}", "t.yaml:1:21: error: 'include' works in a file only");
    refuse("{relit: 1, capture: [a.exr]}",
           "t.yaml:1:21: error: 'capture': expected a path, or a map with the keys of a "
           "capture.yaml, found a list of 1");
    refuse("{relit: 1, capture: ''}",
           "t.yaml:1:21: error: 'capture': expected a path, or a map with the keys of a "
           "capture.yaml, found the text ''");
    refuse("{relit: 1, color: {workin: a}}",
           "t.yaml:1:20: error: color has no key 'workin'; did you mean 'working'? known: config, working");
    refuse("{relit: 1, color: {working: 3}}",
           "t.yaml:1:29: error: 'working': expected a text, found the number '3'");
    refuse("{relit: 1, lights: []}", "t.yaml:1:20: error: 'lights': expected a map, found an empty list");
    refuse("{relit: 1, outputs: 3}", "t.yaml:1:21: error: 'outputs': expected a map, found the number '3'");
    refuse("{relit: 1, graph: 3}",
           "t.yaml:1:19: error: 'graph': expected a map from names to passes, found the number '3'");
}

static void test_wrong_nodes(void **state)
{
    (void)state;
    refuse("{relit: 1, graph: {a: {pass: blurr}}}",
           "t.yaml:1:30: error: there is no pass 'blurr'; did you mean 'blur'? known: blur, kernel, tint");
    refuse("{relit: 1, graph: {a: {}}}",
           "t.yaml:1:20: error: graph entry 'a' needs 'pass': the pass that it runs");
    refuse("{relit: 1, graph: {a: blur}}",
           "t.yaml:1:23: error: 'a': expected a map such as {pass: lighting}, found the text 'blur'");
    refuse("{relit: 1, graph: {a: {pass: blur, tapps: 3}}}",
           "t.yaml:1:36: error: pass 'a' (blur) has no parameter 'tapps'; did you mean 'taps'? known: "
           "radius, shape, taps, "
           "tint, wrap");
    refuse("{relit: 1, graph: {a: {pass: blur, in: {colour: x.y}}}}",
           "t.yaml:1:41: error: pass 'a' (blur) has no input 'colour'; did you mean 'color'? known: color, "
           "depth");
    refuse("{relit: 1, graph: {a: {pass: blur, in: {last: x.y}}}}",
           "t.yaml:1:41: error: pass 'a' (blur) has no input 'last'; known: color, depth");
    refuse("{relit: 1, graph: {a: {pass: blur, in: {color: 3}}}}",
           "t.yaml:1:48: error: 'color': expected a text, found the number '3'");
    refuse("{relit: 1, graph: {a: {pass: blur, in: light.lit}}}",
           "t.yaml:1:40: error: 'in': expected a map from ports to images, found the text 'light.lit'");
    refuse("{relit: 1, graph: {a.b: {pass: blur}}}",
           "t.yaml:1:20: error: 'a.b' cannot be the name of a pass: letters, digits, '_' and '-' may be in "
           "it, a letter "
           "comes first");
    refuse("{relit: 1, graph: {capture: {pass: blur}}}",
           "t.yaml:1:20: error: 'capture' cannot be the name of a pass: it begins the names of relit's own "
           "images");
}

static void test_paths(void **state)
{
    (void)state;
    rl_value v = {.kind = RL_TEXT, .text = "c.ocio", .where = {.file = "a/b/p.yaml", .line = 1}};
    assert_string_equal(rl_value_path(&config_arena, &v), "a/b/c.ocio");
    v.where.file = "--set color.config";
    assert_string_equal(rl_value_path(&config_arena, &v), "c.ocio");
    v.where.file = "a/p.yaml";
    v.text = "/x/c.ocio";
    assert_string_equal(rl_value_path(&config_arena, &v), "/x/c.ocio");
}

/* ---- outputs
 * ------------------------------------------------------------------------------------------------------ */

static void test_output_defaults(void **state)
{
    (void)state;
    static const struct {
        const char *file;
        rl_pixel_type type;
        const char *compression;
    } cases[] = {
        {"a.exr", RL_HALF, "zip"},    {"a.EXR", RL_HALF, "zip"}, {"a.png", RL_UINT8, NULL},
        {"a.tif", RL_UINT16, "zip"},  {"a.jpg", RL_UINT8, NULL}, {"a.jpeg", RL_UINT8, NULL},
        {"a.tiff", RL_UINT16, "zip"}, {"a.hdr", RL_FLOAT, NULL}, {"a.webp", RL_UINT8, NULL},
    };
    for (size_t i = 0; i < RL_ARRAY_LENGTH(cases); i++) {
        char keys[64];
        snprintf(keys, sizeof keys, "image: a.b, file: %s", cases[i].file);
        const rl_output *o = output(keys);
        assert_int_equal(o->type, cases[i].type);
        assert_true(!o->compression == !cases[i].compression);
        if (o->compression)
            assert_string_equal(o->compression, cases[i].compression);
        assert_true(!o->colorspace && !o->display && !o->view && !o->look);
        assert_true(o->exposure == 0 && o->quality == -1 && o->level == 0);
        assert_int_equal(o->n_layers, 1);
        assert_string_equal(o->layers[0].name, "");
    }
}

static void test_output_keys(void **state)
{
    (void)state;
    const rl_output *o =
        output("image: a.b, file: a.exr, type: float, compression: DWAA, quality: 60, exposure: -0.5, "
               "colorspace: ACEScg");
    assert_int_equal(o->type, RL_FLOAT);
    assert_string_equal(o->compression, "dwaa");
    assert_true(o->quality == 60 && o->exposure == -0.5);
    assert_string_equal(o->colorspace, "ACEScg");
    o = output("image: a.b, file: a.png, type: uint16, level: 3, display: sRGB, view: ACES, look: warm");
    assert_int_equal(o->type, RL_UINT16);
    assert_int_equal(o->level, 3);
    assert_string_equal(o->display, "sRGB");
    assert_string_equal(o->view, "ACES");
    assert_string_equal(o->look, "warm");
    o = output("layers: {one: a.b, two: c.d}, file: a.exr, compression: none");
    assert_int_equal(o->n_layers, 2);
    assert_string_equal(o->layers[1].name, "two");
    assert_string_equal(o->layers[1].image, "c.d");
    assert_int_equal(o->layers[1].where.line, 2);
    assert_string_equal(output("image: a.b, file: a.exr, display: sRGB")->display, "sRGB");
}

static void test_wrong_outputs(void **state)
{
    (void)state;
    refuse_output(
        "image: a.b, file: a.exr, exposur: 1",
        "t.yaml:2:40: error: output 'o' has no key 'exposur'; did you mean 'exposure'? known: colorspace, "
        "compression, display, exposure, file, image, layers, level, look, quality, type, view");
    refuse_output("file: a.exr",
                  "t.yaml:2:11: error: output 'o' needs 'image' or 'layers': 'image' names one image, "
                  "'layers' is a map {layer: image}");
    refuse_output("image: a, layers: {b: c}, file: a.exr",
                  "t.yaml:2:11: error: output 'o' needs one of 'image' and 'layers', not both: 'image' names "
                  "one image, "
                  "'layers' is a map {layer: image}");
    refuse_output("image: a.b",
                  "t.yaml:2:11: error: output 'o' needs 'file': such as \"{capture}.{frame:04}.exr\"");
    refuse_output(
        "image: a.b, file: a.exe",
        "t.yaml:2:33: error: output 'o': a file's ending says its format, and relit does not write '.exe'; "
        "did "
        "you mean '.exr'? known: .bmp, .dpx, .exr, .hdr, .jpeg, .jpg, .png, .tga, .tif, .tiff, .webp");
    refuse_output("image: a.b, file: a.exr, type: uint8",
                  "t.yaml:2:46: error: output 'o': a .exr file cannot hold uint8; it can hold: half, float");
    refuse_output("image: a.b, file: a.png, type: half",
                  "t.yaml:2:46: error: output 'o': a .png file cannot hold half; it can hold: uint8, uint16");
    refuse_output("image: a.b, file: a.exr, type: hafl",
                  "t.yaml:2:46: error: 'type' cannot be 'hafl'; did you mean 'half'? known: "
                  "float, half, "
                  "uint16, uint32, uint8");
    refuse_output("image: a.b, file: a.exr, colorspace: x, display: y",
                  "t.yaml:2:64: error: output 'o' has both 'colorspace' and 'display': keep 'colorspace' for "
                  "files that "
                  "are worked on, 'display' for files that are looked at");
    refuse_output("image: a.b, file: a.exr, view: y",
                  "t.yaml:2:46: error: output 'o': 'view' is of a display; name it in 'display'");
    refuse_output("image: a.b, file: a.exr, look: y",
                  "t.yaml:2:46: error: output 'o': 'look' is of a display; name it in 'display'");
    refuse_output("image: a.b, file: a.exr, compression: ZPI",
                  "t.yaml:2:53: error: 'compression' cannot be 'zpi'; did you mean 'zip'? "
                  "known: b44, b44a, "
                  "dwaa, dwab, none, piz, pxr24, rle, zip, zips");
    refuse_output("image: a.b, file: a.png, compression: zip",
                  "t.yaml:2:53: error: output 'o': a .png file has no choice of compression");
    refuse_output("image: a.b, file: a.exr, quality: 3",
                  "t.yaml:2:49: error: output 'o': a .exr file with compression zip has no 'quality'");
    refuse_output("image: a.b, file: a.exr, compression: piz, level: 3",
                  "t.yaml:2:65: error: output 'o': a .exr file with compression piz has no 'level'");
    refuse_output("image: a.b, file: a.jpg, level: 3",
                  "t.yaml:2:47: error: output 'o': a .jpg file has no 'level'");
    refuse_output("image: a.b, file: a.jpg, quality: 0",
                  "t.yaml:2:49: error: 'quality' is 0: out of range, 1 to 100");
    refuse_output("image: a.b, file: a.exr, exposure: .nan",
                  "t.yaml:2:50: error: 'exposure' is .nan: a number is needed");
    refuse_output("layers: {a: b, c: d}, file: a.png", "t.yaml:2:43: error: output 'o' has 2 layers, and a "
                                                       ".png file holds one image: write .exr, or an output "
                                                       "each");
    refuse_output("layers: {a/b: b}, file: a.exr", "t.yaml:2:24: error: 'a/b' cannot be the name of a layer: "
                                                   "letters, digits, '_' and '-' may be in it, a "
                                                   "letter comes first");
    refuse_output("layers: {}, file: a.exr",
                  "t.yaml:2:23: error: 'layers': expected a map {layer: image}, found an empty map");
    refuse_output(
        "image: a.b, file: 'x{fram:04}.exr'",
        "t.yaml:2:33: error: file 'x{fram:04}.exr' has the unknown field '{fram:04}'; did you mean 'frame'? "
        "known: capture, frame, variant");
    refuse("{relit: 1, outputs: {a: {image: x, file: 'f.{frame:04}.exr'}, b: {image: y, file: "
           "'f.{frame:04}.exr'}}}",
           "t.yaml:1:83: error: outputs 'a' and 'b' would write one file, 'f.{frame:04}.exr'");
    refuse("{relit: 1, outputs: {a: 3}}",
           "t.yaml:1:25: error: output 'a': expected a map, found the number '3'");
}

/* ---- file patterns
 * --------------------------------------------------------------------------------------------------- */

static rl_code expand(const char *pattern, const char *capture, long long frame, const char *variant,
                      const char **out)
{
    const rl_output o = {.file = pattern, .file_where = {.file = "t.yaml", .line = 3, .column = 4}};
    return rl_output_path(&config_arena, &o, capture, frame, variant, out, &config_error);
}

static void test_patterns(void **state)
{
    (void)state;
    static const struct {
        const char *pattern;
        long long frame;
        const char *path;
    } cases[] = {
        {"plain.exr", 1, "plain.exr"},
        {"{capture}.{frame:04}.exr", 7, "monkey.0007.exr"},
        {"{capture}.{frame:04}.exr", 12345, "monkey.12345.exr"},
        {"{frame:04}", -3, "-003"},
        {"{frame}", -3, "-3"},
        {"{frame:4}", 12, "  12"},
        {"{variant}/{capture}/{frame:018}", 5, "post/monkey/000000000000000005"},
    };
    for (size_t i = 0; i < RL_ARRAY_LENGTH(cases); i++) {
        const char *path = NULL;
        config_assert_fine(expand(cases[i].pattern, "monkey", cases[i].frame, "post", &path));
        assert_string_equal(path, cases[i].path);
    }
}

static void test_wrong_patterns(void **state)
{
    (void)state;
    static const char *const cases[][2] = {
        {"{frame:x}", "file '{frame:x}': after '{frame:' comes a width to 18, such as 4 or 04, not 'x'"},
        {"{frame:19}", "file '{frame:19}': after '{frame:' comes a width to 18, such as 4 or 04, not '19'"},
        {"{frame:}",
         "file '{frame:}' has the unknown field '{frame:}'; did you mean 'frame'? known: capture, frame, "
         "variant"},
        {"{capture:3}",
         "file '{capture:3}' has the unknown field '{capture:3}'; did you mean 'capture'? known: capture, "
         "frame, variant"},
        {"{}", "file '{}' has the unknown field '{}'; known: capture, frame, variant"},
        {"a{frame", "file 'a{frame': '{' without its partner; fields look like {frame:04}"},
        {"a}b", "file 'a}b': '}' without its partner; fields look like {frame:04}"},
        {"{{frame}}", "file '{{frame}}': '{' without its partner; fields look like {frame:04}"},
        {"{variant}.exr", "file '{variant}.exr': {variant} has no value here"},
    };
    for (size_t i = 0; i < RL_ARRAY_LENGTH(cases); i++) {
        const char *path;
        char expected[512];
        assert_int_equal(expand(cases[i][0], "monkey", 1, NULL, &path), RL_E_CONFIG);
        snprintf(expected, sizeof expected, "t.yaml:3:4: error: %s", cases[i][1]);
        config_assert_error(expected);
    }
}

/* ---- user kernels
 * --------------------------------------------------------------------------------------------------- */

static char folder[] = "/tmp/relit-test-pipeline-XXXXXX";
static char cl_path[128], yaml_path[128];

static int make_folder(void **state)
{
    (void)state;
    if (!mkdtemp(folder))
        return -1;
    snprintf(cl_path, sizeof cl_path, "%s/vignette.cl", folder);
    snprintf(yaml_path, sizeof yaml_path, "%s/p.yaml", folder);
    return rl_file_write(cl_path, "kernel void vignette() {}\n", 26, NULL) != RL_OK;
}

static int remove_folder(void **state)
{
    (void)state;
    unlink(cl_path);
    unlink(yaml_path);
    return rmdir(folder);
}

#define PORTS "ports: {color: {role: read, type: rgb}, out: {role: write, type: rgb}}"

/* A pipeline in the folder, with a node `vig` of these keys. */
static rl_code parse_kernel(const char *keys, const rl_pipeline **out)
{
    rl_str s = {0};
    rl_value *root = NULL;
    rl_str_printf(
        &s, "relit: 1\ngraph:\n  vig: {pass: kernel, %s}\noutputs: {o: {image: vig.out, file: a.exr}}\n",
        keys);
    config_assert_fine(
        rl_yaml_parse(&config_arena, rl_str_text(&s), s.length, yaml_path, &root, &config_error));
    rl_str_free(&s);
    return rl_pipeline_parse_from(&config_registry, &config_arena, yaml_path, root, NULL, out, &config_error);
}

static const rl_pipeline *kernel(const char *keys)
{
    const rl_pipeline *p = NULL;
    config_assert_fine(parse_kernel(keys, &p));
    return p;
}

/* `expected` without the file; every kernel here stands in line 3. */
static void refuse_kernel(const char *keys, int column, const char *expected)
{
    const rl_pipeline *p;
    char whole[1024];
    assert_int_not_equal(parse_kernel(keys, &p), RL_OK);
    snprintf(whole, sizeof whole, "%s:3:%d: error: %s", yaml_path, column, expected);
    config_assert_error(whole);
}

static void test_kernel(void **state)
{
    (void)state;
    const rl_pipeline *p = kernel(
        "file: vignette.cl, entry: vignette, items: vector, in: {color: capture.albedo},\n"
        "ports: {color: {role: read, type: rgb}, z: {role: read, type: scalar, optional: true, layout: "
        "phase4},\n"
        "  out: {role: write, type: rgb}, last: {role: history, type: rgb, of: out}, t: {role: scratch, "
        "type: vec2}},\n"
        "params: {gain: {type: float, value: 0.4, range: [0, 10], unit: stops, help: how dark},\n"
        "  n: {type: int, value: auto, words: [auto]}, on: {type: bool, value: true},\n"
        "  mode: {type: enum, words: [fast, good], value: good}, tint: {type: rgb, value: [1, 0.5, 0]}},\n"
        "gain: 1.5, mode: fast");
    const rl_pass *pass = p->nodes[0].pass;
    assert_string_equal(pass->kernel_text, "kernel void vignette() {}\n");
    assert_string_equal(pass->kernel_file, cl_path);
    assert_null(pass->kernel);
    assert_string_equal(pass->steps.rows[0].entry, "vignette");
    assert_int_equal(pass->steps.rows[0].domain, RL_EVERY_VECTOR);
    assert_int_equal(pass->ports.n, 5);
    const rl_port *ports = pass->ports.rows;
    assert_true(ports[1].optional && ports[1].layout == RL_PHASE4 && ports[1].format == RL_SCALAR);
    assert_int_equal(ports[2].role, RL_WRITE);
    assert_int_equal(ports[3].role, RL_HISTORY);
    assert_string_equal(ports[3].of, "out");
    assert_true(ports[4].role == RL_SCRATCH && ports[4].format == RL_VEC2);
    struct {
        float gain;
        int32_t n, on, mode;
        float tint[3];
    } values;
    assert_int_equal(pass->params_size, sizeof values);
    memcpy(&values, p->nodes[0].params, sizeof values);
    assert_true(values.gain == 1.5f && values.n == -1 && values.on == 1 && values.mode == 0);
    assert_true(values.tint[0] == 1.0f && values.tint[1] == 0.5f && values.tint[2] == 0.0f);
    assert_string_equal(pass->params.rows[0].unit, "stops");
    assert_true(pass->params.rows[0].def[0] == (double)0.4f && pass->params.rows[3].def[0] == 1);
}

static void test_wrong_kernels(void **state)
{
    (void)state;
    char text[512];
    snprintf(text, sizeof text, "kernel 'vig': file '%s/none.cl' cannot be opened: No such file or directory",
             folder);
    refuse_kernel("file: none.cl, entry: e, " PORTS, 29, text);
    refuse_kernel("entry: e, " PORTS, 3, "kernel 'vig' needs 'file': the .cl file with its program");
    refuse_kernel("file: vignette.cl, " PORTS, 3,
                  "kernel 'vig' needs 'entry': the name of the kernel function in its file");
    refuse_kernel("file: vignette.cl, entry: e", 3,
                  "kernel 'vig' needs 'ports': {name: {role: read, type: rgb}, …}");
    refuse_kernel("file: vignette.cl, entry: 2e, " PORTS, 49,
                  "'2e' cannot be the name of a kernel function: it has to be a C identifier (letters, "
                  "digits and '_')");
    refuse_kernel("file: vignette.cl, entry: e, items: row, " PORTS, 59,
                  "'items' cannot be 'row'; known: phase, pixel, vector");
    refuse_kernel("file: vignette.cl, entry: e, gian: 1, params: {gain: {type: float, value: 1}}, " PORTS, 52,
                  "pass 'vig' (kernel) has no parameter 'gian'; did you mean 'gain'? known: gain");
    refuse_kernel("file: vignette.cl, entry: e, in: {colour: a.b}, " PORTS, 57,
                  "pass 'vig' (kernel) has no input 'colour'; did you mean 'color'? known: color");
}

static void refuse_port(const char *port, int column, const char *expected)
{
    char keys[512];
    snprintf(keys, sizeof keys, "file: vignette.cl, entry: e, ports: {out: {role: write, type: rgb}, %s}",
             port);
    refuse_kernel(keys, column, expected);
}

static void test_wrong_ports(void **state)
{
    (void)state;
    enum { KEY = 91 }; /* the column of the second port */
    refuse_port("a: {role: read}", KEY, "port 'a' needs 'type': rgb|normal|vec2|scalar|id");
    refuse_port("a: {role: reed, type: rgb}", KEY + 10,
                "'role' cannot be 'reed'; did you mean 'read'? known: history, read, scratch, write");
    refuse_port("a: {role: write, type: rgb, optional: true}", KEY + 38,
                "port 'a': only a port that is read can be optional");
    refuse_port("a: {role: read, type: rgb, of: out}", KEY + 31,
                "port 'a': 'of' is for ports with 'role: history'");
    refuse_port("a: {role: history, type: rgb}", KEY,
                "port 'a' of kernel 'vig' needs 'of': the port whose past it is");
    refuse_port("a: {role: history, type: rgb, of: ouut}", KEY,
                "port 'a' of kernel 'vig' is the past of 'ouut', which is no image of it; did you mean "
                "'out'? known: out");
    refuse_port("a: {role: history, type: vec2, of: out}", KEY,
                "port 'a' of kernel 'vig' and 'out', whose past it is, differ in type");
    refuse_port("float4: {role: read, type: rgb}", KEY,
                "'float4' cannot be the name of a port: OpenCL C or relit uses it");
    refuse_port("a-b: {role: read, type: rgb}", KEY,
                "'a-b' cannot be the name of a port: it has to be a C identifier (letters, digits and '_')");
    refuse_port("a: {role: read, type: rgb, colour: x}", KEY + 27,
                "a port has no key 'colour'; known: help, layout, of, optional, role, type");
    refuse_kernel("file: vignette.cl, entry: e, ports: {a: {role: read, type: rgb}}", 59,
                  "kernel 'vig' has no port with 'role: write'");
}

static void refuse_param(const char *param, int column, const char *expected)
{
    char keys[512];
    snprintf(keys, sizeof keys, "file: vignette.cl, entry: e, " PORTS ", params: {%s}", param);
    refuse_kernel(keys, column, expected);
}

static void test_wrong_params(void **state)
{
    (void)state;
    const int key = 52 + (int)strlen(PORTS) + 2 + 9; /* the column of the parameter's name */
    refuse_param("g: {type: float}", key, "parameter 'g' needs 'value': its default");
    refuse_param("g: {value: 1}", key, "parameter 'g' needs 'type': float|int|bool|rgb|enum");
    refuse_param("g: {type: float, value: 3, range: [0, 2]}", key + 24,
                 "'g': expected a number 0 … 2, found the number '3'");
    refuse_param("g: {type: float, value: 3, range: [2, 0]}", key + 34,
                 "'range': expected [least, most], found a list of 2");
    refuse_param("g: {type: bool, value: true, range: [0, 1]}", key + 36,
                 "parameter 'g': 'range' is for numbers");
    refuse_param("g: {type: float, value: 1, words: [a]}", key + 34,
                 "parameter 'g': 'words' is for enum and int");
    refuse_param("g: {type: enum, value: a}", key, "parameter 'g' needs 'words': [one, another]");
    refuse_param("g: {type: enum, value: a, words: [b]}", key + 23, "'g' cannot be 'a'; known: b");
    refuse_param("g: {type: enum, value: a, words: ['a|b']}", key + 34,
                 "'words': expected a word, found the text 'a|b'");
    refuse_param("entry: {type: float, value: 1}", key,
                 "'entry' cannot be the name of a parameter: it is a key of the kernel itself");
    refuse_param("kernel: {type: float, value: 1}", key,
                 "'kernel' cannot be the name of a parameter: OpenCL C or relit uses it");
    refuse_param("RL_W: {type: float, value: 1}", key,
                 "'RL_W' cannot be the name of a parameter: OpenCL C or relit uses it");
}

/* ---- the hash
 * ----------------------------------------------------------------------------------------------------- */

static void test_hash(void **state)
{
    (void)state;
    const char *text = "{relit: 1, graph: {a: {pass: blur, taps: 3}}}";
    unsigned long long hash = parse(text)->hash;
    assert_true(parse("relit: 1 # the same\ngraph:\n  a:\n    pass: blur\n    taps: 3\n")->hash == hash);
    assert_true(parse("{relit: 1, graph: {a: {pass: blur, taps: 4}}}")->hash != hash);
    const char *vignette = "file: vignette.cl, entry: vignette, " PORTS;
    hash = kernel(vignette)->hash;
    assert_true(kernel(vignette)->hash == hash);
    assert_int_equal(rl_file_write(cl_path, "kernel void vignette() { }\n", 27, NULL), RL_OK);
    assert_true(kernel(vignette)->hash != hash);
    assert_int_equal(rl_file_write(cl_path, "kernel void vignette() {}\n", 26, NULL), RL_OK);
    assert_true(kernel(vignette)->hash == hash);
    assert_int_equal(rl_file_write(cl_path, "a\0b", 3, NULL), RL_OK);
    char expected[512];
    snprintf(expected, sizeof expected, "kernel 'vig': file '%s' is not text", cl_path);
    refuse_kernel(vignette, 29, expected);
    assert_int_equal(rl_file_write(cl_path, "kernel void vignette() {}\n", 26, NULL), RL_OK);
}

/* ---- memory
 * ---------------------------------------------------------------------------------------------------------
 */

static void test_out_of_memory(void **state)
{
    (void)state;
    rl_str s = {0};
    rl_value *root = NULL;
    rl_str_add(&s, "{relit: 1, graph: {a: {pass: blur, in: {color: x.y}}, vig: {pass: kernel, file: "
                   "vignette.cl, entry: e, "
                   "params: {g: {type: enum, words: [a, b], value: a}}, " PORTS
                   "}}, outputs: {o: {image: a.b, file: "
                   "'{capture}.exr'}}}");
    config_assert_fine(
        rl_yaml_parse(&config_arena, rl_str_text(&s), s.length, yaml_path, &root, &config_error));
    rl_str_free(&s);
    for (unsigned long n = 1;; n++) {
        rl_arena arena = {0};
        rl_error err = {0};
        const rl_pipeline *p;
        rl_alloc_fail_at(n, 0);
        rl_code code = rl_pipeline_parse_from(&config_registry, &arena, yaml_path, root, NULL, &p, &err);
        rl_alloc_fail_at(0, 0);
        rl_arena_free(&arena);
        assert_int_equal(code, err.code);
        if (!code)
            break;
        assert_int_equal(code, RL_E_MEMORY);
        assert_true(n < 1000);
    }
}

#define T(f) cmocka_unit_test_setup_teardown(f, config_setup, config_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        T(test_whole),       T(test_little),          T(test_wrong_sections), T(test_wrong_nodes),
        T(test_paths),       T(test_output_defaults), T(test_output_keys),    T(test_wrong_outputs),
        T(test_patterns),    T(test_wrong_patterns),  T(test_kernel),         T(test_wrong_kernels),
        T(test_wrong_ports), T(test_wrong_params),    T(test_hash),           T(test_out_of_memory),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
