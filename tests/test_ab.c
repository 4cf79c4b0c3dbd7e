/* `relit ab` and `relit plan --vary`, end to end on a small capture: what they print and leave behind, and
 * their exit statuses. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <signal.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "graph/run/image_file.h"
#include "tests/small_capture.h"
#include "tests/tool_run.h"

static char *folder, *pipe_file, *out;

static int setup(void **state)
{
    (void)state;
    folder = folder_new();
    small_capture_write(folder);
    pipe_file = path_in(folder, "pipe.yaml");
    out = path_in(folder, "out");
    return 0;
}

static int teardown(void **state)
{
    (void)state;
    free(pipe_file);
    free(out);
    folder_remove(folder);
    return 0;
}

#define RUN(...) tool_run((const char *const[]){__VA_ARGS__, NULL})
/* relit ab pipe.yaml … --out out --quiet */
#define AB(...) RUN("ab", pipe_file, "--out", out, "--quiet", __VA_ARGS__)

static void expect(const tool_result *r, int status)
{
    if (r->status != status)
        print_error("status %d instead of %d\n%s%s\n", r->status, status, r->out, r->err);
    assert_int_equal(r->status, status);
}

static void expect_in(const char *text, const char *part)
{
    if (!strstr(text, part))
        fail_msg("'%s' is not in:\n%s", part, text);
}

/* ---- what is left behind ------------------------------------------------------------------------------- */

static bool is_there(const char *name)
{
    char *path = path_in(out, name);
    bool there = access(path, R_OK) == 0;
    free(path);
    return there;
}

static char *read_out(const char *name)
{
    size_t size;
    char *path = path_in(out, name), *text = file_read(path, &size);
    free(path);
    return text;
}

static json_t *metrics(void)
{
    char *text = read_out("metrics.json");
    json_error_t error;
    json_t *root = json_loads(text, 0, &error);
    if (!root)
        fail_msg("metrics.json: %s", error.text);
    free(text);
    return root;
}

static const char *text_at(const json_t *root, const char *list, size_t i, const char *key)
{
    const char *text =
        json_string_value(json_object_get(json_array_get(json_object_get(root, list), i), key));
    return text ? text : "";
}

static size_t count(const json_t *root, const char *list)
{
    return json_array_size(json_object_get(root, list));
}

static void expect_names(const json_t *root, const char *const *names, size_t n)
{
    assert_int_equal(count(root, "variants"), n);
    for (size_t i = 0; i < n; i++) {
        char *path = path_in(out, names[i]);
        assert_string_equal(text_at(root, "variants", i, "name"), names[i]);
        assert_int_equal(folder_files(path), SMALL_OUTPUTS * SMALL_FRAMES);
        free(path);
    }
}

static void expect_pairs(const json_t *root, const int (*pairs)[2], size_t n)
{
    json_t *list = json_object_get(root, "pairs");
    assert_int_equal(json_array_size(list), n);
    for (size_t i = 0; i < n; i++) {
        int reference, test;
        assert_int_equal(
            json_unpack(json_array_get(list, i), "{s:i, s:i}", "reference", &reference, "test", &test), 0);
        assert_int_equal(reference, pairs[i][0]);
        assert_int_equal(test, pairs[i][1]);
    }
}

/* The mean of a metric over all materials; NaN when it is null or not there. */
static double mean_of(const json_t *root, size_t pair, int frame, const char *metric)
{
    size_t i;
    json_t *row;
    json_array_foreach(json_object_get(root, "metrics"), i, row)
    {
        if (json_integer_value(json_object_get(row, "pair")) == (json_int_t)pair &&
            json_integer_value(json_object_get(row, "frame")) == frame &&
            !strcmp(json_string_value(json_object_get(row, "metric")), metric) &&
            json_is_null(json_object_get(row, "material")))
            return json_is_number(json_object_get(row, "mean"))
                       ? json_number_value(json_object_get(row, "mean"))
                       : NAN;
    }
    return NAN;
}

static void same_files(const char *a, const char *b)
{
    size_t n, m;
    char *left = file_read(a, &n), *right = file_read(b, &m);
    assert_int_equal(n, m);
    assert_memory_equal(left, right, n);
    free(left);
    free(right);
}

/* A variant's picture against that of a run of its own. EXR files name the pipeline's content, which --set
 * and
 * --vary write in the same way. */
static void same_as_run(const char *variant, const char *first, const char *second)
{
    char name[96], *alone = path_in(folder, "alone"), *left, *right;
    tool_result r = RUN("run", pipe_file, "--out", alone, "--quiet", "--set", first, "--set", second);
    expect(&r, 0);
    tool_result_free(&r);
    for (int i = 1; i <= SMALL_FRAMES; i++) {
        snprintf(name, sizeof name, "%s/s.%04d.exr", variant, i);
        left = path_in(out, name);
        right = path_in(alone, name + strlen(variant) + 1);
        same_files(left, right);
        free(left);
        free(right);
    }
    free(alone);
}

/* ---- comparing ----------------------------------------------------------------------------------------- */

static void test_grid(void **state)
{
    (void)state;
    static const char *const names[] = {"post_4", "post_21", "pre_post_4", "pre_post_21"};
    static const int first[][2] = {{0, 1}, {0, 2}, {0, 3}}, near[][2] = {{0, 1}, {0, 2}, {1, 3}, {2, 3}};
    tool_result r = AB("--vary", "profiles.skin.texturing=post,pre_post", "--vary", "graph.sss.taps=4,21");
    expect(&r, 0);
    assert_string_equal(r.err, "");
    expect_in(r.out, "report.html");
    expect_in(r.out, "6 variants = ");
    expect_in(r.out, "2 of them for chance alone");
    json_t *root = metrics();
    expect_names(root, names, 4);
    expect_pairs(root, first, 3);
    expect_in(json_string_value(json_object_get(root, "command")), "--vary graph.sss.taps=4,21");
    assert_string_equal(text_at(root, "parameters", 1, "path"), "graph.sss.taps");
    assert_int_equal(json_integer_value(json_object_get(root, "seeds")), 3);
    assert_true(mean_of(root, 0, 2, "flip") > 0 && mean_of(root, 1, 3, "rmse") > 0);
    assert_true(is_there("report.html") && is_there("junit.xml") && !is_there("sheet.png"));
    assert_true(!is_there("post_4.seed2"));
    same_as_run("pre_post_4", "profiles.skin.texturing=pre_post", "graph.sss.taps=4");
    json_decref(root);
    tool_result_free(&r);
    r = AB("--vary", "profiles.skin.texturing=post,pre_post", "--vary", "graph.sss.taps=4,21", "--pairs",
           "--seeds", "1", "--frames", "2");
    expect(&r, 0);
    expect_in(r.out, "4 variants = ");
    root = metrics();
    expect_pairs(root, near, 4);
    assert_true(isnan(mean_of(root, 0, 1, "flip")) && mean_of(root, 3, 2, "flip") > 0);
    json_decref(root);
    tool_result_free(&r);
}

/* Whole pipelines; and other passes, with a note of what they lack. */
static void test_pipelines(void **state)
{
    (void)state;
    static const char *const names[] = {"pipe", "plain"}, *const passes[] = {"sss_burley", "combine"};
    char *plain = text_replace(small_pipeline,
                               "sss_burley, in: {diffuse: light.diffuse, lit: light.lit}, taps: 21",
                               "combine, in: {diffuse: light.diffuse, lit: light.lit}"),
         *second = path_in(folder, "plain.yaml");
    file_write(folder, "plain.yaml", plain, strlen(plain));
    tool_result r = RUN("ab", pipe_file, second, "--out", out, "--quiet");
    expect(&r, 0);
    json_t *root = metrics();
    expect_names(root, names, 2);
    double flip = mean_of(root, 0, 3, "flip");
    assert_true(flip > 0);
    json_decref(root);
    tool_result_free(&r);
    r = RUN("ab", pipe_file, "--out", out, "--vary", "graph.sss.pass=sss_burley,combine");
    expect(&r, 0);
    expect_in(r.err, "note: variant 'combine': pass 'sss' is combine, which has no taps: left out");
    root = metrics();
    expect_names(root, passes, 2);
    assert_true(mean_of(root, 0, 3, "flip") == flip); /* it is the same comparison */
    json_decref(root);
    tool_result_free(&r);
    free(plain);
    free(second);
}

/* A path into a light of the capture, which no file of the pipeline lists, changes that light. */
static void test_capture_lights(void **state)
{
    (void)state;
    tool_result r = AB("--vary", "lights.key.exposure=0,1", "--seeds", "1");
    expect(&r, 0);
    same_as_run("exposure_0", "graph.sss.taps=21", "lights.key.exposure=0");
    same_as_run("exposure_1", "graph.sss.taps=21", "lights.key.exposure=1");
    json_t *root = metrics();
    assert_true(mean_of(root, 0, 1, "flip") > 0.05);
    json_decref(root);
    tool_result_free(&r);
}

/* One capture under two names is one capture. */
static void test_spellings(void **state)
{
    (void)state;
    char *again = path_in(folder, "./pipe.yaml");
    tool_result r = RUN("ab", pipe_file, again, "--out", out, "--quiet", "--seeds", "1");
    expect(&r, 0);
    expect_in(r.out, "pipe_2 is bit-identical to pipe in all 3 frames");
    tool_result_free(&r);
    free(again);
}

/* A kernel that its file does not have is found before the first frame. */
static void test_no_such_kernel(void **state)
{
    (void)state;
    static const char text[] = "relit: 1\ninclude: [pipe.yaml]\ngraph:\n"
                               "  own: {pass: kernel, file: own.cl, entry: brighter, in: {color: aa.color},\n"
                               "    ports: {color: {role: read, type: rgb}, out: {role: write, type: rgb}}}\n"
                               "outputs: {beauty: {image: own.out}}\n",
                      source[] = "kernel void bright(void) {}\n";
    char *own = path_in(folder, "own.yaml");
    file_write(folder, "own.yaml", text, strlen(text));
    file_write(folder, "own.cl", source, strlen(source));
    static const char *const commands[] = {"check", "run", "ab"};
    for (size_t i = 0; i < 3; i++) {
        tool_result r =
            RUN(commands[i], own, "--out", out, "--quiet", i < 2 ? NULL : "--vary", "graph.sss.taps=4,21");
        expect(&r, 2);
        expect_in(r.err, "own.yaml:4:3: error: pass 'own' (kernel) has no kernel 'brighter'; did you mean "
                         "'bright'? known: bright");
        tool_result_free(&r);
    }
    free(own);
}

static void remove_files(const char *where, const char *first, const char *second)
{
    char *a = path_in(where, first), *b = path_in(where, second);
    assert_int_equal(unlink(a), 0);
    assert_int_equal(unlink(b), 0);
    free(a);
    free(b);
}

static void test_against(void **state)
{
    (void)state;
    static const int pairs[][2] = {{-1, 0}, {-1, 1}};
    char *reference = path_in(folder, "reference");
    tool_result r = RUN("run", pipe_file, "--out", reference, "--quiet");
    expect(&r, 0);
    tool_result_free(&r);
    r = AB("--vary", "graph.sss.taps=21,4", "--against", reference, "--seeds", "1");
    expect(&r, 0);
    json_t *root = metrics();
    json_t *list = json_object_get(root, "pairs");
    assert_int_equal(json_array_size(list), 2);
    for (size_t i = 0; i < 2; i++) {
        assert_true(json_is_null(json_object_get(json_array_get(list, i), "reference")));
        assert_int_equal(json_integer_value(json_object_get(json_array_get(list, i), "test")), pairs[i][1]);
    }
    assert_true(mean_of(root, 0, 2, "hdrflip") < 0.003); /* half floats of the reference */
    assert_true(mean_of(root, 1, 2, "hdrflip") > 2 * mean_of(root, 0, 2, "hdrflip"));
    json_decref(root);
    tool_result_free(&r);
    r = AB("--against", reference); /* one variant is enough */
    expect(&r, 0);
    tool_result_free(&r);
    /* What an earlier comparison left: each variant finds its own. */
    r = RUN("ab", pipe_file, "--vary", "graph.sss.taps=21,4", "--seeds", "1", "--out", reference, "--quiet");
    expect(&r, 0);
    tool_result_free(&r);
    remove_files(reference, "s.0002.exr", "s.0002.png"); /* of the run */
    r = AB("--vary", "graph.sss.taps=21,4", "--against", reference, "--seeds", "1");
    expect(&r, 0);
    root = metrics();
    assert_true(mean_of(root, 0, 2, "hdrflip") < 0.003 && mean_of(root, 1, 2, "hdrflip") < 0.003);
    json_decref(root);
    tool_result_free(&r);
    free(reference);
}

/* ---- exit statuses ------------------------------------------------------------------------------------- */

static void test_over(void **state)
{
    (void)state;
    tool_result r =
        AB("--vary", "graph.sss.taps=21,4", "--fail-over", "flip.p95=1e-5", "--fail-over", "max=9");
    expect(&r, 3);
    expect_in(r.out, "flip.p95 is over");
    expect_in(r.out, "skin, frame ");
    char *junit = read_out("junit.xml");
    expect_in(junit, "<failure");
    free(junit);
    tool_result_free(&r);
    r = AB("--vary", "graph.sss.taps=21,4", "--fail-over", "flip.p95=1", "--fail-over", "psnr=1");
    expect(&r, 0);
    tool_result_free(&r);
}

/* A frame that fails: the others are compared, and the report says so. */
static void test_failed_frame(void **state)
{
    (void)state;
    char *frame = path_in(folder, "s.0002.exr");
    assert_int_equal(unlink(frame), 0);
    tool_result r =
        RUN("ab", pipe_file, "--out", out, "--vary", "graph.sss.taps=21,4", "--fail-over", "max=0");
    expect(&r, 1); /* rather than 3: not all was compared */
    expect_in(r.err, "s.0002.exr");
    expect_in(r.err, "1 of 3 frames failed");
    json_t *root = metrics();
    assert_true(mean_of(root, 0, 1, "flip") > 0 && mean_of(root, 0, 3, "flip") > 0);
    assert_true(isnan(mean_of(root, 0, 2, "flip")));
    json_decref(root);
    char *junit = read_out("junit.xml");
    expect_in(junit, "<error");
    free(junit);
    tool_result_free(&r);
    size_t size;
    char *whole = path_in(folder, "s.0001.exr"), *data = file_read(whole, &size);
    file_write(folder, "s.0002.exr", data, size / 2); /* the header is fine, */
    free(data);
    free(whole);
    r = RUN("ab", pipe_file, "--out", out, "--vary", "graph.sss.taps=21,4", "--frames", "2", "--sheet");
    expect(&r, 1); /* nothing at all to compare */
    expect_in(r.err, "sheet.png: error: is not written: its frame has failed");
    assert_true(is_there("metrics.json"));
    tool_result_free(&r);
    free(frame);
}

/* What is wrong before a pixel: nothing is written. */
static void test_wrong(void **state)
{
    (void)state;
    static const struct {
        const char *arguments[5], *says;
    } rows[] = {
        {{NULL}, "relit ab: error: one variant alone has nothing to be compared with"},
        {{"--vary", "graph.sss.taps"}, "option '--vary' takes PATH=V1,V2"},
        {{"--vary", "graph.sss.taps=8,[16"}, "--vary graph.sss.taps=8,[16:1:21: error: behind '='"},
        {{"--vary", "graph.sss.tapps=8,16"},
         "--vary graph.sss.tapps=8,16:1:17: error: pass 'sss' (sss_burley) has no parameter 'tapps'; did you "
         "mean 'taps'?"},
        {{"--vary", "graph.sss.taps=8,0"}, "--vary graph.sss.taps=8,0:1:18: error: 'taps'"},
        {{"--vary", "graph.sss.pass=sss_burley,sss_gausian"}, ":1:27: error: there is no pass 'sss_gausian'"},
        {{"--vary", "profiles.skin.texturing=post,psot"},
         "--vary profiles.skin.texturing=psot: error: variant 'psot': 'texturing' cannot be 'psot'; did you "
         "mean 'post'?"},
        {{"--vary", "graph.aa.pass=taa,curvature"},
         "variant 'curvature': output 'beauty': no image 'aa.color'"},
        {{"--vary", "a=1,2", "--vary", "a.b=3"}, "'a.b' is varied already, by '--vary a=1,2'"},
        {{"--vary", "graph.sss.taps=8,16", "--fail-over", "flipp=1"}, "there is no metric 'flipp'"},
        {{"--vary", "graph.sss.taps=8,16", "--sheet=a.nothing"}, "'.nothing'"},
        {{"--vary", "graph.sss.taps=8,16", "--against", "/nowhere/at/all"}, "/nowhere/at/all"},
        {{"--vary", "graph.sss.taps=8,16", "--report-frames", "frist"}, "frist"},
        {{"--vary", "lights.kee.exposure=0,1"}, "there is no light 'kee'; did you mean 'key'? known: key"},
        {{"--vary", "graph.sss.taps=8,16", "--set", "outputs.preview.file=../{capture}.{frame}.png"},
         "output 'preview': variants 'taps_8' and 'taps_16' would both write '"},
        {{"--vary", "graph.sss.taps=8,16", "--set", "outputs.preview.file=/nowhere/{frame}.png"},
         "would both write '/nowhere/1.png'; put {variant} into 'file'"},
        {{"/nowhere.yaml"}, "/nowhere.yaml: error: cannot be opened"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const char *const *a = rows[i].arguments;
        tool_result r = RUN("ab", pipe_file, "--out", out, "--quiet", a[0], a[1], a[2], a[3]);
        if (r.status != 2 || !strstr(r.err, rows[i].says))
            print_error("row %zu: status %d, %s", i, r.status, r.err);
        assert_int_equal(r.status, 2);
        expect_in(r.err, rows[i].says);
        assert_string_equal(r.out, "");
        assert_int_equal(folder_files(out), 0);
        tool_result_free(&r);
    }
}

/* A signal ends the run after the frames in flight, and the report is of those that were compared. */
static void test_signal(void **state)
{
    (void)state;
    char *manifest = text_replace(small_manifest, "s.####.exr", "s.0001.exr"),
         *many = text_replace(manifest, "1-3", "1-20000"), *said = path_in(folder, "said");
    int results[2], status;
    char c = 0;
    file_write(folder, "capture.yaml", many, strlen(many));
    assert_int_equal(pipe(results), 0);
    fflush(NULL);
    pid_t pid = fork();
    assert_true(pid >= 0);
    if (!pid) {
        dup2(results[1], 1);
        close(results[0]);
        if (freopen(said, "w", stderr))
            execl(tool_program(), "relit", "ab", pipe_file, "--vary", "graph.sss.taps=21,4", "--seeds", "1",
                  "--out", out, "--json", "--only", "beauty", (char *)NULL);
        _exit(127);
    }
    close(results[1]);
    for (int lines = 0; lines < 2;) { /* two frames, then the signal, then the rest */
        assert_int_equal(read(results[0], &c, 1), 1);
        lines += c == '\n';
    }
    kill(pid, SIGTERM);
    while (read(results[0], &c, 1) == 1)
        ;
    close(results[0]);
    assert_int_equal(waitpid(pid, &status, 0), pid);
    assert_true(WIFSIGNALED(status) && WTERMSIG(status) == SIGTERM);
    size_t size;
    char *text = file_read(said, &size);
    expect_in(text, "the others were not begun\n"); /* --resume is not for this command */
    json_t *root = metrics();
    assert_true(mean_of(root, 0, 2, "flip") > 0 && isnan(mean_of(root, 0, 20000, "flip")));
    assert_true(is_there("report.html"));
    json_decref(root);
    free(text);
    free(said);
    free(manifest);
    free(many);
}

/* ---- other results ------------------------------------------------------------------------------------- */

static void test_sheet(void **state)
{
    (void)state;
    rl_image_file image;
    rl_error err = {0};
    tool_result r = AB("--vary", "graph.sss.taps=4,8,21", "--seeds", "1", "--sheet", "--frames", "1-2");
    expect(&r, 0);
    char *path = path_in(out, "sheet.png");
    assert_int_equal(rl_image_file_read(path, &image, &err), RL_OK);
    assert_true(image.width > 3 * SMALL_WIDTH && image.height > SMALL_HEIGHT && image.channels == 3);
    rl_image_file_free(&image);
    expect_in(r.out, path);
    tool_result_free(&r);
    free(path);
    path = path_in(folder, "elsewhere.jpg");
    char *option = malloc(strlen(path) + 16);
    sprintf(option, "--sheet=%s", path);
    r = AB("--vary", "graph.sss.taps=4,8,21", "--seeds", "1", option, "--frames", "1");
    expect(&r, 0);
    assert_int_equal(rl_image_file_read(path, &image, &err), RL_OK);
    rl_image_file_free(&image);
    tool_result_free(&r);
    free(option);
    free(path);
}

/* An object a frame, then one that says where everything is. */
static void test_json(void **state)
{
    (void)state;
    char *trace = path_in(folder, "trace.json");
    tool_result r =
        RUN("ab", pipe_file, "--out", out, "--vary", "graph.sss.taps=21,4", "--json", "--trace", trace);
    expect(&r, 0);
    size_t lines = 0;
    for (char *at = r.out; *at; at = strchr(at, '\n') + 1, lines++) {
        json_t *line = json_loads(at, JSON_DISABLE_EOF_CHECK, NULL);
        assert_true(json_is_object(line));
        if (lines < SMALL_FRAMES) {
            assert_int_equal(json_integer_value(json_object_get(line, "done")), lines + 1);
            assert_int_equal(json_array_size(json_object_get(line, "files")), 2 * SMALL_OUTPUTS);
            assert_null(json_object_get(line, "load_s"));
        } else {
            assert_string_equal(json_string_value(json_object_get(line, "out")), out);
            assert_true(*json_string_value(json_object_get(line, "summary")));
        }
        json_decref(line);
    }
    assert_int_equal(lines, SMALL_FRAMES + 1);
    size_t size;
    char *text = file_read(trace, &size);
    expect_in(text, "sss@2");
    expect_in(text, "\"name\":\"taps_4/beauty\"");
    expect_in(text, "\"cat\":\"compare\"");
    free(text);
    free(trace);
    tool_result_free(&r);
}

/* The output folder is out/ab unless another is named. */
static void test_default_folder(void **state)
{
    (void)state;
    char *back = getcwd(NULL, 0);
    assert_true(back && chdir(folder) == 0);
    tool_result r = RUN("ab", "pipe.yaml", "--vary", "graph.sss.taps=21,4", "--frames", "1", "--seeds", "1");
    assert_int_equal(chdir(back), 0);
    free(back);
    expect(&r, 0);
    expect_in(r.out, "\nout/ab/report.html\n");
    assert_true(is_there("ab/metrics.json") && is_there("ab/taps_4/s.0001.exr"));
    tool_result_free(&r);
}

/* ---- plan ---------------------------------------------------------------------------------------------- */

#define PLAN(...) RUN("plan", pipe_file, "--vary", "graph.sss.taps=4,21", __VA_ARGS__)

static void test_plan(void **state)
{
    (void)state;
    double factor, one_by_one;
    tool_result r = PLAN("--quiet");
    expect(&r, 0);
    const char *cost = strstr(r.out, "2 variants = ");
    assert_non_null(cost);
    assert_int_equal(sscanf(cost, "2 variants = %lfx one (%lfx one after the other)", &factor, &one_by_one),
                     2);
    assert_true(factor > 1 && factor < one_by_one && one_by_one > 1.5 && one_by_one < 3);
    expect_in(r.out, "  taps_4   ");
    expect_in(r.out, "light             lighting    all\n");
    expect_in(r.out, "sss@2             sss_burley  taps_21\n");
    expect_in(r.out,
              "output.preview@2  color       taps_21\n"); /* shown, and compared: still one variant's */
    tool_result_free(&r);
    r = PLAN("--format", "json");
    expect(&r, 0);
    json_t *root = json_loads(r.out, 0, NULL), *group = NULL;
    assert_int_equal(count(root, "variants"), 2);
    group = json_array_get(json_object_get(root, "groups"), 0);
    json_t *nodes = json_object_get(group, "nodes"), *light = json_array_get(nodes, 0);
    assert_string_equal(json_string_value(json_object_get(light, "name")), "light");
    assert_int_equal(json_array_size(json_object_get(light, "variants")), 2);
    assert_true(json_is_false(json_object_get(light, "varied")));
    assert_true(json_is_true(json_object_get(json_array_get(nodes, 1), "varied")));
    assert_true(json_is_array(json_object_get(json_object_get(group, "plan"), "steps")));
    json_t *predicted = json_object_get(root, "cost");
    assert_true(fabs(json_number_value(json_object_get(predicted, "factor")) - factor) < 0.006);
    json_decref(root);
    tool_result_free(&r);
}

static void test_plan_drawn(void **state)
{
    (void)state;
    tool_result r = PLAN("--format", "dot");
    expect(&r, 0);
    expect_in(r.out, "label=\"2. sss\\nsss_burley\\ntaps_4\"");
    expect_in(r.out, "fillcolor");
    assert_null(strstr(r.out, "lighting\\n")); /* shared: not marked */
    tool_result_free(&r);
    r = PLAN("--format", "svg");
    expect(&r, 0);
    expect_in(r.out, "</svg>");
    expect_in(r.out, "#ffe2b8");
    tool_result_free(&r);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, setup, teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(test_grid),           TEST(test_pipelines), TEST(test_capture_lights), TEST(test_spellings),
        TEST(test_no_such_kernel), TEST(test_against),   TEST(test_over),           TEST(test_failed_frame),
        TEST(test_wrong),          TEST(test_signal),    TEST(test_sheet),          TEST(test_json),
        TEST(test_default_folder), TEST(test_plan),      TEST(test_plan_drawn),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
