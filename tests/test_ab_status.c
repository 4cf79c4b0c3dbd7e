/* What `relit ab` ends with when images cannot be compared, and when a signal comes while its ledger is kept.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <jansson.h>
#include <libgen.h>
#include <limits.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "tests/small_capture.h"
#include "tests/tool_run.h"

static char program[PATH_MAX]; /* relit, beside the tests */

#define RUN(...) tool_run((const char *const[]){__VA_ARGS__, NULL})

static void expect(const tool_result *r, int status, const char *says)
{
    if (r->status != status || !strstr(r->err, says))
        fail_msg("status %d, not %d with '%s':\n%s%s", r->status, status, says, r->out, r->err);
}

/* How many frames metrics.json has numbers of. */
static size_t frames_compared(void)
{
    size_t size, n = 0;
    char *path = path_in(small_out, "metrics.json"), *text = file_read(path, &size);
    json_t *root = json_loads(text, 0, NULL), *row;
    assert_non_null(root);
    bool seen[SMALL_FRAMES + 1] = {false};
    json_t *list = json_object_get(root, "metrics");
    for (size_t i = 0; i < json_array_size(list); i++) {
        row = json_array_get(list, i);
        seen[json_integer_value(json_object_get(row, "frame"))] = true;
    }
    for (int i = 0; i <= SMALL_FRAMES; i++)
        n += seen[i];
    json_decref(root);
    free(path);
    free(text);
    return n;
}

/* A kernel that makes NaN of frame 2: all pictures are written and the other frames compared, but the answer
 * is none. A limit that is exceeded besides does not hide it. */
static void test_nan(void **state)
{
    static const char kernel[] =
        "kernel void spoil(global const float *in, global float *out, constant params_t *p,\n"
        "                  constant frame_t *f, constant material_t *materials)\n"
        "{\n"
        "    int x = get_global_id(0), y = get_global_id(1), at = rl_index(f, x, y);\n"
        "    for (int c = 0; c < 3 && rl_inside(f, x, y); c++)\n"
        "        out[c * f->plane + at] = f->number == 2 && p->gain > 0 ? NAN : in[c * f->plane + at];\n"
        "}\n";
    static const char pipeline[] =
        "relit: 1\ninclude: [pipe.yaml]\n"
        "graph:\n"
        "  bad: {pass: kernel, file: spoil.cl, entry: spoil, ports: {in: {role: read, type: rgb}, out: "
        "{role: "
        "write, type: rgb}}, params: {gain: {type: float, value: 0, range: [0, 2]}}, in: {in: aa.color}}\n"
        "outputs: {beauty: {image: bad.out}, preview: {image: bad.out}}\n";
    (void)state;
    char *path = path_in(small_folder, "nan.yaml");
    file_write(small_folder, "nan.yaml", pipeline, strlen(pipeline));
    file_write(small_folder, "spoil.cl", kernel, strlen(kernel));
    tool_result r =
        RUN("ab", path, "--vary", "graph.bad.gain=0,1", "--out", small_out, "--seeds", "1", "--quiet");
    expect(&r, 2, "frame 2: bad.out (linear) holds NaN");
    assert_int_equal(frames_compared(), SMALL_FRAMES - 1);
    assert_int_equal(folder_files(small_out), 2 * SMALL_OUTPUTS * SMALL_FRAMES + 3);
    tool_result_free(&r);
    r = RUN("ab", path, "--vary", "graph.bad.gain=0,1", "--vary", "graph.sss.taps=4,21", "--out", small_out,
            "--seeds", "1", "--quiet", "--fail-over", "max=0");
    expect(&r, 2, "holds NaN");
    tool_result_free(&r);
    free(path);
}

/* The pictures of an earlier run, one of which is of another size since; one that is gone is a frame that
 * fails. */
static void test_reference(void **state)
{
    (void)state;
    char *golden = path_in(small_folder, "golden"), *second = path_in(golden, "s.0002.exr");
    tool_result r = RUN("run", small_pipe, "--out", golden, "--quiet");
    expect(&r, 0, "");
    tool_result_free(&r);
    char *cropped = path_in(small_folder, "cropped"), *small = path_in(cropped, "s.0002.exr");
    r = RUN("run", small_pipe, "--out", cropped, "--quiet", "--crop", "0,0,8,8");
    tool_result_free(&r);
    assert_int_equal(rename(small, second), 0);
    r = RUN("ab", small_pipe, "--against", golden, "--out", small_out, "--seeds", "1", "--quiet");
    expect(&r, 2, "s.0002.exr");
    assert_int_equal(frames_compared(), SMALL_FRAMES - 1);
    tool_result_free(&r);
    free(golden);
    free(second);
    free(cropped);
    free(small);
}

/* All frames are there when the signal comes, the ledger is not: the report is written, and the command ends
 * as one that was stopped. */
static void test_signal(void **state)
{
    (void)state;
    int results[2], status;
    char c, *said = path_in(small_folder, "said");
    assert_int_equal(pipe(results), 0);
    fflush(NULL);
    pid_t pid = fork();
    assert_true(pid >= 0);
    if (!pid) {
        dup2(results[1], 1);
        close(results[0]);
        if (freopen(said, "w", stderr))
            execl(program, "relit", "ab", small_pipe, "--vary", "graph.sss.taps=21,4", "--seeds", "1",
                  "--out", small_out, "--json", (char *)NULL);
        _exit(127);
    }
    close(results[1]);
    for (int lines = 0; lines < SMALL_FRAMES; lines += c == '\n')
        assert_int_equal(read(results[0], &c, 1), 1);
    kill(pid, SIGINT);
    while (read(results[0], &c, 1) == 1)
        ;
    close(results[0]);
    assert_int_equal(waitpid(pid, &status, 0), pid);
    if (!WIFSIGNALED(status) || WTERMSIG(status) != SIGINT)
        fail_msg("status %#x", (unsigned)status);
    size_t size;
    char *text = file_read(said, &size);
    assert_non_null(strstr(text, "the report's ledger of energy is not whole: stopped after"));
    assert_int_equal(frames_compared(), SMALL_FRAMES);
    free(text);
    free(said);
}

/* All is compared when the signal comes, and the report is being written: it is finished. */
static void test_late_signal(void **state)
{
    (void)state;
    char *late = path_in(small_folder, "late"), *metrics = path_in(late, "metrics.json"),
         *report = path_in(late, "report.html");
    int status;
    fflush(NULL);
    pid_t pid = fork();
    assert_true(pid >= 0);
    if (!pid) {
        if (freopen("/dev/null", "w", stdout) && freopen("/dev/null", "w", stderr))
            execl(program, "relit", "ab", small_pipe, "--vary", "graph.sss.taps=21,4", "--seeds", "1",
                  "--out", late, (char *)NULL);
        _exit(127);
    }
    while (access(metrics, F_OK) && !waitpid(pid, &status, WNOHANG)) /* the page comes behind it */
        ;
    kill(pid, SIGTERM);
    assert_int_equal(waitpid(pid, &status, 0), pid);
    assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 0);
    assert_int_equal(access(report, F_OK), 0);
    assert_int_equal(folder_files(late), 2 * SMALL_OUTPUTS * SMALL_FRAMES + 3); /* nothing temporary */
    free(report);
    free(metrics);
    free(late);
}

/* A temporary file of process `pid` that was to become folder/name. */
static char *leave(const char *where, const char *name, long pid)
{
    char *path;
    assert_true(asprintf(&path, "%s/.%s.%ld-3.tmp", where, name, pid) > 0);
    FILE *f = fopen(path, "w");
    assert_true(f && fputs("half", f) >= 0 && !fclose(f));
    return path;
}

/* What a command that was killed had begun to write is gone after the next one, and nothing else. */
static void test_leftovers(void **state)
{
    (void)state;
    pid_t dead = fork();
    if (!dead)
        _exit(0);
    assert_int_equal(waitpid(dead, NULL, 0), dead);
    char *variant = path_in(small_out, "taps_4"), *trace = path_in(small_folder, "t.json");
    tool_result r =
        RUN("ab", small_pipe, "--vary", "graph.sss.taps=4,21", "--out", small_out, "--seeds", "1", "--quiet");
    expect(&r, 0, "");
    tool_result_free(&r);
    char *gone[] = {leave(small_out, "report.html", dead), leave(small_out, "metrics.json", dead),
                    leave(small_out, "junit.xml", dead),   leave(small_out, "sheet.png", dead),
                    leave(variant, "s.0003.exr", dead),    leave(variant, "s.0001.png", dead),
                    leave(small_folder, "t.json", dead)},
         *stay[] = {leave(small_out, "notes.txt", dead), leave(variant, "s.0004.exr", dead),
                    leave(variant, "s.0002.exr", (long)getppid())};
    r = RUN("ab", small_pipe, "--vary", "graph.sss.taps=4,21", "--out", small_out, "--seeds", "1", "--quiet",
            "--sheet", "--trace", trace);
    expect(&r, 0, "");
    tool_result_free(&r);
    for (size_t i = 0; i < sizeof gone / sizeof *gone; i++) {
        if (!access(gone[i], F_OK))
            fail_msg("%s is there", gone[i]);
        free(gone[i]);
    }
    for (size_t i = 0; i < sizeof stay / sizeof *stay; i++) {
        if (unlink(stay[i]))
            fail_msg("%s is gone", stay[i]);
        free(stay[i]);
    }
    free(trace);
    free(variant);
}

/* Killed at some moment, and run again: the pictures are those of a command that nothing happened to, and
 * what is there after a kill is whole. */
static void test_killed(void **state)
{
    (void)state;
    char *plain = path_in(small_folder, "plain"), *killed = path_in(small_folder, "killed");
    for (int i = 0; i < 8; i++) {
        fflush(NULL);
        pid_t pid = fork();
        assert_true(pid >= 0);
        if (!pid) {
            if (freopen("/dev/null", "w", stdout) && freopen("/dev/null", "w", stderr))
                execl(program, "relit", "ab", small_pipe, "--vary", "graph.sss.taps=21,4", "--seeds", "1",
                      "--out", i ? killed : plain, (char *)NULL);
            _exit(127);
        }
        if (i && i < 7) /* the first and the last are through */
            nanosleep(&(struct timespec){0, 30000000 * i}, NULL);
        if (i && i < 7)
            kill(pid, SIGKILL);
        int status;
        assert_int_equal(waitpid(pid, &status, 0), pid);
        if (i && i < 7)
            continue;
        assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 0);
    }
    static const char *const variants[] = {"taps_21", "taps_4"};
    for (int v = 0; v < 2; v++) {
        char *a = path_in(plain, variants[v]), *b = path_in(killed, variants[v]);
        assert_int_equal(small_check_files(b), SMALL_OUTPUTS * SMALL_FRAMES); /* whole, nothing temporary */
        for (int f = 1; f <= SMALL_FRAMES; f++) {
            char name[32];
            size_t n[2];
            snprintf(name, sizeof name, "s.%04d.exr", f);
            char *x = path_in(a, name), *y = path_in(b, name), *p = file_read(x, &n[0]),
                 *q = file_read(y, &n[1]);
            assert_true(n[0] == n[1] && !memcmp(p, q, n[0]));
            free(x);
            free(y);
            free(p);
            free(q);
        }
        free(a);
        free(b);
    }
    assert_int_equal(folder_files(killed), folder_files(plain));
    free(plain);
    free(killed);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_nan),       cmocka_unit_test(test_reference),
                                       cmocka_unit_test(test_signal),    cmocka_unit_test(test_late_signal),
                                       cmocka_unit_test(test_leftovers), cmocka_unit_test(test_killed)};
    (void)argc;
    char *self = realpath(argv[0], NULL);
    snprintf(program, sizeof program, "%s/../relit", self ? dirname(self) : "build/tests");
    free(self);
    return cmocka_run_group_tests(tests, small_setup, small_teardown);
}
