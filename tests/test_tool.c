/* The commands: what they print, what they leave behind, their exit statuses. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <jansson.h>
#include <limits.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "graph/model/pass.h"
#include "graph/relit.h"
#include "graph/run/exr.h"
#include "tests/tool_run.h"

static char capture[PATH_MAX]; /* captures/monkey */

static const char pipeline[] =
    "relit: 1\n"
    "profiles: {skin: {scatter_distance_mm: [3, 1.2, 0.7]}}\n"
    "materials: {skin: {profile: skin}, default: {}}\n"
    "graph:\n"
    "  light: {pass: lighting}\n"
    "  sss: {pass: sss_burley, in: {diffuse: light.diffuse, lit: light.lit}, taps: 21}\n"
    "  spare: {pass: combine, in: {diffuse: light.diffuse, lit: light.lit}}\n"
    "outputs:\n"
    "  beauty: {image: sss.color, file: \"{capture}.{frame:04}.exr\"}\n";

/* A folder with the pipeline; `pipe` is its path. Both are given back to leave(). */
static char *enter(char **pipe)
{
    char *folder = folder_new();
    file_write(folder, "p.yaml", pipeline, strlen(pipeline));
    *pipe = path_in(folder, "p.yaml");
    return folder;
}

static void leave(char *folder, char *pipe)
{
    free(pipe);
    folder_remove(folder);
}

#define RUN(...) tool_run((const char *const[]){__VA_ARGS__, NULL})

static void expect(const tool_result *r, int status)
{
    if (r->status != status)
        print_error("status %d instead of %d\n%s%s\n", r->status, status, r->out, r->err);
    assert_int_equal(r->status, status);
}

static int lines(const char *text)
{
    int n = 0;
    for (const char *c = text; *c; c++)
        n += *c == '\n';
    return n;
}

/* ---- help ------------------------------------------------------------------------------------------------
 */

static const char *const commands[] = {"run",     "ab",     "check",   "plan", "init",
                                       "inspect", "passes", "devices", "bench"};

static void expect_narrow(const char *text)
{
    for (const char *at = text; *at; at += strcspn(at, "\n") + 1) {
        if (strcspn(at, "\n") > 80)
            print_error("over 80 columns: %.*s\n", (int)strcspn(at, "\n"), at);
        assert_true(strcspn(at, "\n") <= 80);
        assert_true(strcspn(at, "\n") == 0 || at[strcspn(at, "\n") - 1] != ' ');
    }
}

static void test_help(void **state)
{
    (void)state;
    tool_result r = RUN("--help");
    expect(&r, 0);
    expect_narrow(r.out);
    assert_string_equal(r.err, "");
    for (size_t i = 0; i < sizeof commands / sizeof *commands; i++) {
        char line[32];
        snprintf(line, sizeof line, "\n  %s", commands[i]);
        assert_non_null(strstr(r.out, line));
        tool_result one = RUN(commands[i], "--help");
        expect(&one, 0);
        expect_narrow(one.out);
        assert_non_null(strstr(one.out, "--help"));
        assert_true(!strstr(one.out, "--frames") ==
                    (i > 3 && i < 8)); /* only run, ab, check, plan and bench take frames */
        tool_result_free(&one);
    }
    tool_result_free(&r);
    r = RUN("help", "plan");
    tool_result same = RUN("plan", "--help");
    expect(&r, 0);
    assert_string_equal(r.out, same.out);
    tool_result_free(&r);
    tool_result_free(&same);
    r = RUN("help");
    same = RUN("--help");
    expect(&r, 0);
    assert_string_equal(r.out, same.out);
    tool_result_free(&r);
    tool_result_free(&same);
}

static void test_version(void **state)
{
    (void)state;
    tool_result r = RUN("--version");
    expect(&r, 0);
    assert_string_equal(r.out, "relit " RL_VERSION "\n");
    tool_result_free(&r);
}

/* ---- the command line ------------------------------------------------------------------------------------
 */

typedef struct usage_row {
    const char *arguments[6];
    const char *says;
} usage_row;

static void test_usage(void **state)
{
    (void)state;
    static const usage_row rows[] = {
        {{NULL}, "needs a command"},
        {{"rum", "p"}, "did you mean 'run'?"},
        {{"run"}, "needs a PIPELINE"},
        {{"run", "p", "q"}, "takes one PIPELINE, found 'p' and 'q'"},
        {{"devices", "x"}, "takes no argument"},
        {{"run", "p", "-v"}, "there is no option '-v'"},
        {{"run", "p", "--frames"}, "'--frames' needs SPEC"},
        {{"run", "p", "--frames", "--quiet"}, "'--frames' needs SPEC"},
        {{"run", "p", "--quiet=yes"}, "takes no value"},
        {{"run", "p", "--threads", "0"}, "an integer from 1 to 1024, found '0'"},
        {{"run", "p", "--threads", "1025"}, "found '1025'"},
        {{"run", "p", "--threads=two"}, "found 'two'"},
        {{"run", "p", "--memory-limit", "4X"}, "found '4X'"},
        {{"run", "p", "--memory-limit=-1"}, "found '-1'"},
        {{"run", "p", "--crop", "0,0,10"}, "four integers"},
        {{"run", "p", "--crop", "0,0,10,0"}, "at least 1"},
        {{"run", "p", "--crop", "0,0,10,10,10"}, "four integers"},
        {{"run", "p", "--on-missing", "ignore"}, "error|skip"},
        {{"run", "p", "--set", "graph.sss.taps"}, "PATH=VALUE"},
        {{"run", "p", "--set", "=3"}, "PATH=VALUE"},
        {{"plan", "p", "--format", "png"}, "text|dot|svg|json"},
        {{"init", "c", "--frames", "1"}, "it is for run, ab, check, plan, bench"},
        {{"run", "p", "--quiet", "--verbose"}, "exclude each other"},
        {{"passes", "lightning"}, "did you mean 'lighting'?"},
        {{"run", "p", "--shard", "0/3"}, "I from 1 to N"},
        {{"run", "p", "--shard", "4/3"}, "I from 1 to N"},
        {{"run", "p", "--shard", "3"}, "I from 1 to N"},
        {{"run", "p", "--shard", "1/1000001"}, "I from 1 to N"},
        {{"run", "p", "--preroll", "4"}, "give --shard I/N too"},
        {{"ab"}, "needs a PIPELINE, see"},
        {{"ab", "p", "--sheet="}, "option '--sheet' takes [=FILE], found ''"},
        {{"ab", "p", "--shard", "1/2"}, "it is for run, check, plan"},
        {{"ab", "p", "--seeds", "0"}, "an integer from 1 to 64, found '0'"},
        {{"run", "p", "--pairs"}, "it is for ab"},
        {{"bench", "--size", "1920"}, "WxH in pixels"},
        {{"bench", "--size", "0x10"}, "WxH in pixels"},
        {{"bench", "--size", "10x65537"}, "WxH in pixels"},
        {{"inspect", "p", "--resume"}, "it is for run, check, plan"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        tool_result r = tool_run(rows[i].arguments);
        if (r.status != 2 || lines(r.err) != 1 || !strstr(r.err, rows[i].says))
            print_error("row %zu: status %d, %s", i, r.status, r.err);
        assert_int_equal(r.status, 2);
        assert_int_equal(lines(r.err), 1);
        assert_non_null(strstr(r.err, rows[i].says));
        assert_string_equal(r.out, "");
        tool_result_free(&r);
    }
}

/* A value may begin with a dash, may be glued on with '=', and --set splits at the first '='. */
static void test_values_of_options(void **state)
{
    (void)state;
    char *pipe, *folder = enter(&pipe);
    tool_result r = RUN("check", pipe, "--capture", capture, "--frames", "-10--1");
    expect(&r, 2);
    assert_non_null(strstr(r.err, "-10")); /* understood, and not listed by the capture */
    assert_null(strstr(r.err, "option"));
    tool_result_free(&r);
    r = RUN("check", pipe, "--capture", capture, "--frames=2-3", "--set", "graph.sss.taps=55",
            "--set=outputs.beauty.file=\"a=b.{frame}.exr\"");
    expect(&r, 0);
    assert_non_null(strstr(r.out, "2 frames (2 to 3)"));
    tool_result_free(&r);
    leave(folder, pipe);
}

/* ---- run -------------------------------------------------------------------------------------------------
 */

static void test_run(void **state)
{
    (void)state;
    char *pipe, *folder = enter(&pipe), *out = path_in(folder, "deep/er/out");
    tool_result r = RUN("run", pipe, "--capture", capture, "--frames", "1-3x2", "--out", out);
    expect(&r, 0);
    assert_string_equal(r.out, "");
    assert_int_equal(folder_files(out), 2);
    char *file = path_in(out, "monkey.0003.exr");
    assert_non_null(strstr(r.err, file)); /* a plain line a frame, with what was written */
    assert_int_equal(lines(r.err), 3);    /* and one for the run */
    tool_result_free(&r);
    r = RUN("run", pipe, "--capture", capture, "--frames", "1", "--out", out, "--quiet");
    expect(&r, 0);
    assert_string_equal(r.err, "");
    tool_result_free(&r);
    free(file);
    free(out);
    leave(folder, pipe);
}

static void test_run_json(void **state)
{
    (void)state;
    char *pipe, *folder = enter(&pipe), *out = path_in(folder, "out");
    tool_result r =
        RUN("run", pipe, "--capture", capture, "--frames", "1-2", "--out", out, "--json", "--quiet");
    expect(&r, 0);
    assert_int_equal(lines(r.out), 2);
    char *second = strchr(r.out, '\n') + 1;
    json_t *frame = json_loads(second, JSON_DISABLE_EOF_CHECK, NULL);
    assert_non_null(frame);
    assert_int_equal(json_integer_value(json_object_get(frame, "frame")), 2);
    assert_int_equal(json_integer_value(json_object_get(frame, "total")), 2);
    assert_string_equal(json_string_value(json_object_get(frame, "capture")), "monkey");
    assert_true(json_is_true(json_object_get(frame, "ok")));
    assert_true(json_is_null(json_object_get(frame, "error")));
    const char *file = json_string_value(json_array_get(json_object_get(frame, "files"), 0));
    assert_int_equal(access(file, R_OK), 0);
    json_decref(frame);
    tool_result_free(&r);
    free(out);
    leave(folder, pipe);
}

/* A frame that fails says so in its object, and the status is 1. */
static void test_run_json_failure(void **state)
{
    (void)state;
    char *pipe, *folder = enter(&pipe), *out = path_in(folder, "out");
    tool_result r = RUN("run", pipe, "--capture", capture, "--frames", "1", "--out", out, "--json", "--set",
                        "materials.default=null");
    expect(&r, 1);
    json_t *frame = json_loads(r.out, 0, NULL);
    assert_non_null(frame);
    assert_true(json_is_false(json_object_get(frame, "ok")));
    const char *code = json_string_value(json_object_get(json_object_get(frame, "error"), "code"));
    assert_string_equal(code, "RL_E_DATA");
    assert_int_equal(folder_files(out), 0);
    json_decref(frame);
    tool_result_free(&r);
    free(out);
    leave(folder, pipe);
}

/* ---- signals ---------------------------------------------------------------------------------------------
 */

/* Reads a descriptor up to and with `stop` ('\n'), or to its end; how many times `stop` came. */
static int read_lines(int fd, int most, char *text, size_t room)
{
    int n = 0;
    size_t used = 0;
    char c;
    while (n < most && read(fd, &c, 1) == 1) {
        n += c == '\n';
        if (used + 1 < room)
            text[used++] = c;
    }
    text[used] = 0;
    return n;
}

/* What a run of 20,000 frames left when it was interrupted after its first. */
typedef struct interrupted {
    int status, frames;
    char said[4096]; /* on stderr */
} interrupted;

/* `again`: a second signal as soon as the first is answered. */
static interrupted interrupt(int number, int again, const char *pipe, const char *out)
{
    interrupted r = {0};
    int results[2], errors[2];
    char text[4096];
    assert_int_equal(pipe2(results, 0) | pipe2(errors, 0), 0);
    fflush(NULL);
    pid_t pid = fork();
    assert_true(pid >= 0);
    if (!pid) {
        dup2(results[1], 1);
        dup2(errors[1], 2);
        close(results[0]);
        close(errors[0]);
        execl(tool_program(), "relit", "run", pipe, "--out", out, "--json", "--quiet", (char *)NULL);
        _exit(127);
    }
    close(results[1]);
    close(errors[1]);
    r.frames = read_lines(results[0], 1, text, sizeof text);
    kill(pid, number);
    read_lines(errors[0], 2, r.said, sizeof r.said); /* an empty line, since a bar may stand there */
    if (again)
        kill(pid, again);
    r.frames += read_lines(results[0], INT_MAX, text, sizeof text);
    read_lines(errors[0], INT_MAX, r.said + strlen(r.said), sizeof r.said - strlen(r.said));
    close(results[0]);
    close(errors[0]);
    assert_int_equal(waitpid(pid, &r.status, 0), pid);
    return r;
}

static void test_signals(void **state)
{
    (void)state;
    char *pipe, *folder = enter(&pipe), *out = path_in(folder, "out"),
                *file = path_in(capture, "monkey.0001.exr");
    size_t size;
    char *path = path_in(capture, "capture.yaml"), *manifest = file_read(path, &size);
    char *same = text_replace(manifest, "monkey.####.exr", file);
    char *many = text_replace(same, "frames: 1-8", "frames: 1-20000");
    file_write(folder, "capture.yaml", many, strlen(many));
    char *with = text_replace(pipeline, "relit: 1\n", "relit: 1\ncapture: capture.yaml\n");
    file_write(folder, "p.yaml", with, strlen(with));
    const int numbers[] = {SIGINT, SIGTERM};
    for (int i = 0; i < 2; i++) {
        interrupted r = interrupt(numbers[i], 0, pipe, out);
        assert_true(WIFSIGNALED(r.status) && WTERMSIG(r.status) == numbers[i]);
        assert_true(r.frames >= 1 && r.frames < 20000);
        assert_int_equal(folder_files(out), r.frames); /* what was begun is whole, and reported */
        assert_non_null(strstr(r.said, "stopping after the frames in flight"));
        assert_non_null(strstr(r.said, "stopped: "));
        interrupted twice = interrupt(numbers[i], numbers[!i], pipe, out);
        assert_true(WIFSIGNALED(twice.status) && WTERMSIG(twice.status) == numbers[!i]);
        assert_null(strstr(twice.said, "stopped: "));
        out = (folder_remove(out), path_in(folder, "out"));
    }
    free(file);
    free(path);
    free(manifest);
    free(same);
    free(many);
    free(with);
    free(out);
    leave(folder, pipe);
}

/* ---- check, plan -----------------------------------------------------------------------------------------
 */

static void test_check_writes_nothing(void **state)
{
    (void)state;
    char *pipe, *folder = enter(&pipe), *out = path_in(folder, "out");
    tool_result r = RUN("check", pipe, "--capture", capture, "--out", out);
    expect(&r, 0);
    assert_non_null(strstr(r.out, ": OK\n"));
    assert_non_null(strstr(r.out, "capture 'monkey': 8 frames (1 to 8)"));
    assert_int_equal(access(out, F_OK), -1);
    assert_int_equal(folder_files(folder), 1);
    tool_result_free(&r);
    r = RUN("check", pipe, "--capture", capture, "--json");
    expect(&r, 0);
    json_t *json = json_loads(r.out, 0, NULL);
    assert_true(json_is_true(json_object_get(json, "ok")));
    assert_int_equal(json_array_size(json_object_get(json, "errors")), 0);
    json_decref(json);
    tool_result_free(&r);
    r = RUN("check", pipe, "--capture", capture, "--quiet");
    expect(&r, 0);
    assert_string_equal(r.out, "");
    assert_string_equal(r.err, "");
    tool_result_free(&r);
    r = RUN("check", pipe, "--capture", capture, "--out", pipe);
    expect(&r, 2); /* a file is in the way */
    tool_result_free(&r);
    free(out);
    leave(folder, pipe);
}

/* What is wrong is on stdout with --json, too. */
static void test_check_json_failure(void **state)
{
    (void)state;
    char *pipe, *folder = enter(&pipe);
    tool_result r = RUN("check", pipe, "--capture", capture, "--json", "--set", "graph.sss.tapps=3");
    expect(&r, 2);
    assert_int_equal(lines(r.err), 1);
    json_t *json = json_loads(r.out, 0, NULL), *errors = json_object_get(json, "errors");
    assert_true(json_is_false(json_object_get(json, "ok")));
    assert_int_equal(json_array_size(errors), 1);
    json_t *error = json_array_get(errors, 0);
    assert_string_equal(json_string_value(json_object_get(error, "code")), "RL_E_CONFIG");
    assert_string_equal(json_string_value(json_object_get(error, "file")), "--set graph.sss.tapps=3");
    assert_int_equal(json_integer_value(json_object_get(error, "line")), 1);
    assert_non_null(strstr(json_string_value(json_object_get(error, "text")), "did you mean 'taps'?"));
    json_decref(json);
    tool_result_free(&r);
    r = RUN("check", "gone.yaml", "--json");
    expect(&r, 2);
    assert_non_null(strstr(r.out, "\"ok\":false,\"captures\":[]"));
    tool_result_free(&r);
    leave(folder, pipe);
}

/* A profile that lets light through, and a capture that does not say how thick things are. */
static void test_check_missed_layers(void **state)
{
    (void)state;
    size_t size;
    char *pipe, *folder = enter(&pipe), *manifest = path_in(capture, "capture.yaml");
    char *files = path_in(capture, "monkey.####.exr"), *text = file_read(manifest, &size);
    char *here = text_replace(text, "monkey.####.exr", files);
    char *some = text_replace(here, "  thickness: {channels: [thickness.T]}\n", "");
    char *none = text_replace(some,
                              "  shadow_thickness: {key: shadow_thickness.key, rim: shadow_thickness.rim, "
                              "fill: shadow_thickness.fill}\n",
                              "");
    const struct {
        const char *manifest, *set;
        bool noted;
    } rows[] = {{none, "profiles.skin.transmission=thick", true},
                {none, "profiles.skin.transmission=none", false},
                {some, "profiles.skin.transmission=thick", false}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        file_write(folder, "capture.yaml", rows[i].manifest, strlen(rows[i].manifest));
        tool_result r = RUN("check", pipe, "--capture", folder, "--set", rows[i].set);
        expect(&r, 0);
        const char *said = strstr(r.err, "note: pass 'light' (lighting): the profile of material 'skin' has "
                                         "'transmission: thick', but there is no 'thickness' and no "
                                         "'shadow_thickness': no light comes through");
        assert_int_equal(said != NULL, rows[i].noted);
        tool_result_free(&r);
        r = RUN("check", pipe, "--capture", folder, "--set", rows[i].set, "--set",
                "shading.transmission=false");
        expect(&r, 0);
        assert_string_equal(r.err, "");
        tool_result_free(&r);
    }
    free(none);
    free(some);
    free(here);
    free(text);
    free(files);
    free(manifest);
    leave(folder, pipe);
}

/* --trace is an option that run, ab, check and plan share. */
static void test_check_trace(void **state)
{
    (void)state;
    char *pipe, *folder = enter(&pipe), *path = path_in(folder, "t.json");
    tool_result r = RUN("check", pipe, "--capture", capture, "--frames", "1-3", "--trace", path);
    expect(&r, 0);
    tool_result_free(&r);
    json_t *json = json_load_file(path, 0, NULL), *event;
    size_t i, headers = 0, others = 0;
    json_array_foreach(json_object_get(json, "traceEvents"), i, event)
    {
        const char *name = json_string_value(json_object_get(event, "name"));
        headers += !strcmp(name, "header");
        others += !strcmp(name, "open") || !strcmp(name, "compile");
    }
    assert_int_equal(headers, 3);
    assert_int_equal(others, 2);
    json_decref(json);
    free(path);
    leave(folder, pipe);
}

/* A hole and a broken header in the middle of a sequence: an error each. */
static void test_check_opens_every_header(void **state)
{
    (void)state;
    char *pipe, *folder = enter(&pipe), *manifest = path_in(folder, "capture.yaml");
    const char *names[] = {"capture.yaml", "monkey.0001.exr", "monkey.0002.exr", "monkey.0003.exr"};
    for (int i = 0; i < 4; i++) {
        size_t size;
        char *path = path_in(capture, names[i]), *data = file_read(path, &size);
        file_write(folder, names[i], data, i == 2 ? 100 : size);
        free(path);
        free(data);
    }
    tool_result r = RUN("check", pipe, "--capture", manifest, "--frames", "1-4");
    expect(&r, 2);
    assert_int_equal(lines(r.err), 2);
    assert_non_null(strstr(r.err, "monkey.0002.exr: error: "));
    assert_non_null(strstr(r.err, "monkey.0004.exr: error: "));
    assert_string_equal(r.out, "");
    tool_result_free(&r);
    free(manifest);
    leave(folder, pipe);
}

static void test_plan(void **state)
{
    (void)state;
    char *pipe, *folder = enter(&pipe);
    tool_result text = RUN("plan", pipe, "--capture", capture);
    tool_result dot = RUN("plan", pipe, "--capture", capture, "--format", "dot");
    tool_result json = RUN("plan", pipe, "--capture", capture, "--format", "json");
    tool_result also = RUN("plan", pipe, "--capture", capture, "--json");
    expect(&text, 0);
    expect(&dot, 0);
    expect(&json, 0);
    assert_non_null(strstr(text.out, "sss.color"));
    assert_non_null(strstr(text.out, "spare")); /* culled, and said */
    assert_int_equal(strncmp(dot.out, "digraph", 7), 0);
    json_t *value = json_loads(json.out, 0, NULL);
    assert_non_null(value);
    assert_string_equal(json.out, also.out);
    json_decref(value);
    tool_result_free(&text);
    tool_result_free(&dot);
    tool_result_free(&json);
    tool_result_free(&also);
    leave(folder, pipe);
}

/* In a child: graphviz's plugins keep memory, which is not ours to report. */
static void test_plan_svg(void **state)
{
    (void)state;
    char *pipe, *folder = enter(&pipe);
    const char *arguments[] = {"plan", pipe, "--capture", capture, "--format", "svg", NULL};
    tool_result r = tool_run_child("ASAN_OPTIONS=detect_leaks=0", arguments);
    expect(&r, 0);
    assert_non_null(strstr(r.out, "<svg "));
    assert_non_null(strstr(r.out, "sss"));
    assert_non_null(strstr(r.out, "</svg>"));
    assert_string_equal(r.err, "");
    tool_result_free(&r);
    leave(folder, pipe);
}

/* ---- init, inspect ---------------------------------------------------------------------------------------
 */

static void expect_init_checks(const char *of, const char *has)
{
    char *folder = folder_new(), *pipe = path_in(folder, "init.yaml");
    tool_result r = RUN("init", of);
    expect(&r, 0);
    assert_non_null(strstr(r.out, has));
    file_write(folder, "init.yaml", r.out, strlen(r.out));
    tool_result_free(&r);
    r = RUN("check", pipe);
    expect(&r, 0);
    assert_string_equal(r.err, "");
    tool_result_free(&r);
    free(pipe);
    folder_remove(folder);
}

static void test_init(void **state)
{
    (void)state;
    char *file = path_in(capture, "monkey.0001.exr"), *manifest = path_in(capture, "capture.yaml");
    expect_init_checks(capture,
                       "#  key: {type: point, position: [-0.5, -0.52, 0.47], intensity: [2.2, 2.024, 1.804]");
    expect_init_checks(manifest, "#  skin: {scatter_distance_mm: [3.0, 1.2, 0.7]}");
    expect_init_checks(file, "id-6: {stencil: 6}"); /* no manifest: ids from the pixels */
    /* two ids of one name are one material */
    size_t size;
    char *folder = folder_new(), *text = file_read(manifest, &size),
         *files = path_in(capture, "monkey.####.exr");
    char *here = text_replace(text, "monkey.####.exr", files),
         *twice = text_replace(here, "6: marble", "6: wax");
    file_write(folder, "capture.yaml", twice, strlen(twice));
    expect_init_checks(folder,
                       "  wax: {stencil: [4, 6]}    # {stencil: [4, 6], profile: wax}\n  eyes: {stencil: 5}");
    free(twice);
    free(here);
    free(files);
    free(text);
    folder_remove(folder);
    free(file);
    free(manifest);
}

/* What is commented must be right too: with every comment of a whole line taken out it still checks, and has
 * these. */
static void expect_uncommented_checks(const char *of, const char *const *has)
{
    char *folder = folder_new(), *pipe = path_in(folder, "init.yaml");
    tool_result r = RUN("init", of);
    expect(&r, 0);
    char *to = r.out;
    for (const char *from = r.out; *from; from++) {
        bool start = from == r.out || from[-1] == '\n';
        if (!(start && *from == '#' && (from[1] != ' ' || from[2] == ' ')))
            *to++ = *from;
    }
    *to = 0;
    file_write(folder, "init.yaml", r.out, strlen(r.out));
    for (; *has; has++)
        if (!strstr(r.out, *has))
            fail_msg("no '%s' in\n%s", *has, r.out);
    tool_result_free(&r);
    r = RUN("check", pipe);
    expect(&r, 0);
    assert_null(strstr(r.err, "warning")); /* the lights stand where they stood */
    tool_result_free(&r);
    free(pipe);
    folder_remove(folder);
}

static void test_init_uncommented(void **state)
{
    (void)state;
    char *backlit = path_in(capture, "../backlit"), *made = folder_new(),
         *path = path_in(capture, "capture.yaml");
    expect_uncommented_checks(capture, (const char *const[]){"\nlights:\n", NULL});
    expect_uncommented_checks(backlit,
                              (const char *const[]){"pass: back_lighting", "back: behind.diffuse", NULL});
    /* in centimetres, with a panel that has no shadow layer */
    size_t size;
    char *manifest = file_read(path, &size), frame[PATH_MAX + 32];
    snprintf(frame, sizeof frame, "files: %s/monkey.####.exr", capture);
    char *files = text_replace(manifest, "files: monkey.####.exr", frame);
    char *unit = text_replace(files, "unit: m\n", "unit: cm\n");
    char *lights =
        text_replace(unit, "  key:  {type: point, position: [-0.5, -0.52, 0.47],",
                     "  panel: {type: rect, position: [10, 20, 30.5], direction: [0, 0, -1], width: 12.5, "
                     "height: 3, power: 4, temperature: 3000}\n  key:  {type: point, position: [-50, "
                     "-52, 47],");
    file_write(made, "capture.yaml", lights, strlen(lights));
    expect_uncommented_checks(
        made, (const char *const[]){"position: [10, 20, 30.5], direction: [0, 0, -1], width: 12.5, height: 3",
                                    "temperature: 3000}\n", "position: [-50, -52, 47]", NULL});
    free(lights);
    free(unit);
    free(files);
    free(manifest);
    free(path);
    free(backlit);
    folder_remove(made);
}

static void test_inspect(void **state)
{
    (void)state;
    char *folder = folder_new(), *file = path_in(capture, "monkey.0001.exr");
    tool_result r = RUN("inspect", file);
    expect(&r, 0);
    assert_non_null(strstr(r.out, "scanline, zip compression"));
    assert_non_null(strstr(r.out, "data window    480 x 270 at 0, 0"));
    assert_non_null(strstr(r.out, "stencil.ID             uint"));
    assert_non_null(strstr(r.out, "camera:jitter (v2f): [0 -0.1666"));
    assert_non_null(strstr(r.out, "relit_capture: 1\n"));
    assert_non_null(strstr(r.out, "files: monkey.####.exr\nframes: 1-8")); /* the sequence that it is of */
    assert_null(strstr(r.out, "no attribute"));
    tool_result_free(&r);
    r = RUN("inspect", capture);
    expect(&r, 0);
    assert_non_null(strstr(r.out, "stencil_names: {1: skin"));
    tool_result_free(&r);
    r = RUN("inspect", folder); /* neither a capture nor an EXR */
    expect(&r, 2);
    tool_result_free(&r);
    r = RUN("init", folder);
    expect(&r, 2);
    assert_non_null(strstr(r.err, "the folder holds no capture.yaml; `relit inspect "));
    tool_result_free(&r);
    r = RUN("check", folder);
    expect(&r, 2);
    assert_non_null(strstr(r.err, "this is a capture, not a pipeline: `relit init "));
    tool_result_free(&r);
    r = RUN("check", file);
    expect(&r, 2);
    assert_non_null(strstr(r.err, "this is a capture, not a pipeline: `relit init "));
    tool_result_free(&r);
    free(file);
    folder_remove(folder);
}

/* Channels that no preset knows are found by their names; what is not there is said, and what was put in its
 * place. */
static void test_inspect_gaps(void **state)
{
    (void)state;
    static const char *const names[] = {"albedo.R", "albedo.G", "albedo.B", "N.x",
                                        "N.y",      "N.z",      "depth.Z",  "mat"};
    static float plane[64];
    rl_exr_source channels[8];
    for (int i = 0; i < 8; i++)
        channels[i] = (rl_exr_source){.name = names[i], .type = RL_EXR_FLOAT, .floats = plane, .stride = 8};
    rl_exr_image image = {.data_window = {0, 0, 7, 7},
                          .display_window = {0, 0, 7, 7},
                          .channels = channels,
                          .n_channels = 8,
                          .compression = RL_EXR_ZIP};
    char *folder = folder_new(), *file = path_in(folder, "odd.0001.exr"),
         *yaml = path_in(folder, "capture.yaml");
    rl_error err = {0};
    assert_int_equal(rl_exr_write(file, &image, NULL, NULL, &err), RL_OK);
    tool_result r = RUN("inspect", file), again;
    expect(&r, 0);
    char *guess = strstr(r.out, "# guessed by preset 'relit' and by names");
    assert_non_null(guess);
    assert_non_null(strstr(guess, "camera.matrix: the file does not say where the camera is"));
    assert_non_null(strstr(guess, "camera.fov_x"));
    assert_non_null(
        strstr(guess, "  albedo: {channels: [albedo.R, albedo.G, albedo.B], colorspace: lin_rec709}\n"));
    assert_non_null(strstr(guess, "  depth: {channels: [depth.Z], kind: planar, empty: 1e10}\n"));
    assert_non_null(strstr(guess, "  normal: {channels: [N.x, N.y, N.z], space: world, encoding: signed}\n"));
    assert_non_null(strstr(guess, "stencil: no channel is named like an id; so all is one material"));
    char *whole = text_replace(guess, "stencil: {constant: 1}", "stencil: {channels: [mat]}");
    file_write(folder, "capture.yaml", whole, strlen(whole));
    again = RUN("inspect", yaml);
    expect(&again, 0);
    assert_non_null(
        strstr(again.out, "normal: {channels: [N.x, N.y, N.z], space: world, encoding: signed}\n"));
    tool_result_free(&again);
    tool_result_free(&r);
    free(whole);
    free(file);
    free(yaml);
    folder_remove(folder);
}

/* A folder without manifest: its sequences, each by its first file. */
static void test_inspect_folder(void **state)
{
    (void)state;
    char *folder = folder_new();
    const char *names[] = {"monkey.0001.exr", "monkey.0002.exr", "monkey.0003.exr"};
    for (int i = 0; i < 3; i++) {
        size_t size;
        char *path = path_in(capture, names[i]), *data = file_read(path, &size);
        file_write(folder, names[i], data, size);
        free(path);
        free(data);
    }
    file_write(folder, "capture.yaml", "", 0); /* as `> capture.yaml` makes it before relit looks */
    tool_result r = RUN("inspect", folder);
    expect(&r, 0);
    char *pattern = path_in(folder, "monkey.####.exr\n"), *second = path_in(folder, names[1]);
    assert_non_null(strstr(r.out, pattern));
    assert_null(strstr(r.out, second));
    assert_non_null(strstr(r.out, "frames: 1-3"));
    char *manifest = strstr(r.out, "relit_capture: 1\n");
    assert_non_null(manifest);
    file_write(folder, "capture.yaml", manifest, strlen(manifest)); /* where it says that it belongs */
    tool_result_free(&r);
    r = RUN("init", folder);
    expect(&r, 0);
    tool_result_free(&r);
    free(pattern);
    free(second);
    folder_remove(folder);
}

/* ---- passes, devices -------------------------------------------------------------------------------------
 */

static void expect_rows(const char *text, rl_params rows)
{
    for (size_t i = 0; i < rows.n; i++) {
        assert_non_null(strstr(text, rows.rows[i].name));
        assert_non_null(strstr(text, rows.rows[i].help));
    }
}

static void test_passes(void **state)
{
    (void)state;
    tool_result all = RUN("passes"), json = RUN("passes", "--json");
    expect(&all, 0);
    expect(&json, 0);
    json_t *list = json_loads(json.out, 0, NULL);
    assert_true(json_is_array(list));
    assert_int_equal(json_array_size(list), rl_pass_count() + 1); /* and the user's own */
    tool_result own = RUN("passes", "kernel", "--json");
    expect(&own, 0);
    json_t *kernel = json_loads(own.out, 0, NULL);
    assert_string_equal(json_string_value(json_object_get(kernel, "name")), "kernel");
    assert_true(json_equal(kernel, json_array_get(list, rl_pass_count())));
    json_decref(kernel);
    tool_result_free(&own);
    for (size_t i = 0; i < rl_pass_count(); i++) {
        const rl_pass *pass = rl_pass_at(i);
        tool_result r = RUN("passes", pass->name);
        expect(&r, 0);
        assert_non_null(strstr(all.out, pass->name));
        for (size_t k = 0; k < pass->ports.n; k++)
            assert_true(pass->ports.rows[k].role == RL_SCRATCH || strstr(r.out, pass->ports.rows[k].help));
        expect_rows(r.out, pass->params);
        expect_rows(r.out, pass->profile_keys);
        expect_rows(r.out, pass->material_keys);
        expect_rows(r.out, pass->shading_keys);
        json_t *object = json_array_get(list, i);
        assert_int_equal(json_array_size(json_object_get(object, "parameters")), pass->params.n);
        tool_result_free(&r);
    }
    json_decref(list);
    tool_result_free(&all);
    tool_result_free(&json);
}

/* The example that `relit passes kernel` prints compiles and runs, and its range holds. */
static void test_kernel_example(void **state)
{
    (void)state;
    char *pipe, *folder = enter(&pipe), *out = path_in(folder, "out");
    tool_result r = RUN("passes", "kernel");
    expect(&r, 0);
    expect_narrow(r.out);
    char *node = strstr(r.out, "in the pipeline:\n"), *source = strstr(r.out, "in dim.cl:\n");
    assert_true(node && source);
    node += strlen("in the pipeline:\n");
    file_write(folder, "dim.cl", source + strlen("in dim.cl:\n"), strlen(source + strlen("in dim.cl:\n")));
    source[-(ptrdiff_t)strlen("example, ")] = 0;
    char *added = text_replace(pipeline, "outputs:", node),
         *whole = text_replace(added, "  beauty:", "outputs:\n  beauty:");
    file_write(folder, "p.yaml", whole, strlen(whole));
    tool_result got = RUN("run", pipe, "--capture", capture, "--frames", "1", "--out", out, "--set",
                          "outputs.beauty.image=dim.out");
    expect(&got, 0);
    tool_result_free(&got);
    got = RUN("check", pipe, "--capture", capture, "--set", "graph.dim.amount=2");
    expect(&got, 2); /* its range holds */
    tool_result_free(&got);
    tool_result_free(&r);
    free(added);
    free(whole);
    free(out);
    leave(folder, pipe);
}

static void test_devices(void **state)
{
    (void)state;
    tool_result r = RUN("devices");
    expect(&r, 0);
    assert_int_equal(r.out[0] == '*' || strstr(r.out, "\n* "), 1);
    tool_result_free(&r);
    r = RUN("devices", "--json");
    expect(&r, 0);
    json_t *list = json_loads(r.out, 0, NULL);
    assert_true(json_array_size(list) >= 1);
    json_decref(list);
    tool_result_free(&r);
    r = RUN("devices", "--device", "99");
    expect(&r, 2);
    tool_result_free(&r);
    const char *arguments[] = {"devices", NULL};
    r = tool_run_child("OCL_ICD_VENDORS=/nonexistent", arguments);
    expect(&r, 2);
    assert_non_null(strstr(r.err, "no OpenCL device"));
    tool_result_free(&r);
}

/* ---- the program -----------------------------------------------------------------------------------------
 */

static void test_program(void **state)
{
    (void)state;
    const char *version[] = {"--version", NULL}, *wrong[] = {"rum", NULL};
    tool_result r = tool_spawn(tool_program(), NULL, version);
    expect(&r, 0);
    assert_string_equal(r.out, "relit " RL_VERSION "\n");
    tool_result_free(&r);
    r = tool_spawn(tool_program(), NULL, wrong);
    expect(&r, 2);
    assert_string_equal(r.out, "");
    tool_result_free(&r);
}

int main(int argc, char **argv)
{
    tool_child(argc, argv);
    if (!realpath("captures/monkey", capture)) {
        fprintf(stderr, "run this from the repository: captures/monkey is not here\n");
        return 1;
    }
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_help),
        cmocka_unit_test(test_version),
        cmocka_unit_test(test_usage),
        cmocka_unit_test(test_values_of_options),
        cmocka_unit_test(test_run),
        cmocka_unit_test(test_run_json),
        cmocka_unit_test(test_run_json_failure),
        cmocka_unit_test(test_signals),
        cmocka_unit_test(test_check_writes_nothing),
        cmocka_unit_test(test_check_json_failure),
        cmocka_unit_test(test_check_missed_layers),
        cmocka_unit_test(test_check_trace),
        cmocka_unit_test(test_check_opens_every_header),
        cmocka_unit_test(test_plan),
        cmocka_unit_test(test_plan_svg),
        cmocka_unit_test(test_init),
        cmocka_unit_test(test_init_uncommented),
        cmocka_unit_test(test_inspect),
        cmocka_unit_test(test_inspect_gaps),
        cmocka_unit_test(test_inspect_folder),
        cmocka_unit_test(test_passes),
        cmocka_unit_test(test_kernel_example),
        cmocka_unit_test(test_devices),
        cmocka_unit_test(test_program),
    };
    return cmocka_run_group_tests_name("tool", tests, NULL, NULL);
}
