/* What goes to stderr: lines, their filtering, and the progress bar on a terminal (a pseudo-terminal here).
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "graph/tool/report.h"

/* ---- a reporter on a terminal or on a file ---------------------------------------------------------------
 */

typedef struct screen {
    rl_reporter r;
    FILE *out, *err;
    int reader; /* of the terminal; -1: err is a file */
    char text[1 << 16];
} screen;

static screen *screen_open(bool terminal)
{
    screen *s = calloc(1, sizeof *s);
    assert_non_null(s);
    s->out = tmpfile();
    s->reader = -1;
    if (terminal) {
        s->reader = posix_openpt(O_RDWR | O_NOCTTY);
        if (s->reader < 0 || grantpt(s->reader) || unlockpt(s->reader)) { /* a sandbox without /dev/pts */
            print_message("no pseudo-terminal on this machine\n");
            fclose(s->out);
            free(s);
            skip();
        }
        s->err = fopen(ptsname(s->reader), "r+");
        fcntl(s->reader, F_SETFL, O_NONBLOCK);
    } else {
        s->err = tmpfile();
    }
    assert_true(s->out && s->err);
    rl_reporter_begin(&s->r, s->out, s->err);
    return s;
}

/* What a terminal shows comes through the kernel when it comes: it is whole once a mark behind it is here. */
static void read_terminal(screen *s)
{
    static const char mark[] = "<end of the text>";
    size_t n = 0;
    fputs(mark, s->err);
    fflush(s->err);
    for (char *end = NULL; !end; end = strstr(s->text, mark)) {
        struct pollfd ready = {s->reader, POLLIN, 0};
        assert_int_equal(poll(&ready, 1, 10000), 1);
        ssize_t got = read(s->reader, s->text + n, sizeof s->text - 1 - n);
        assert_true(got > 0);
        n += (size_t)got;
        s->text[n] = 0;
    }
    *strstr(s->text, mark) = 0;
}

/* What was printed. The terminal writes "\r\n" for "\n". */
static const char *screen_text(screen *s)
{
    fflush(s->err);
    if (s->reader >= 0) {
        read_terminal(s);
    } else {
        rewind(s->err);
        assert_true(fread(s->text, 1, sizeof s->text - 1, s->err) < sizeof s->text - 1);
    }
    return s->text;
}

static void screen_close(screen *s)
{
    rl_reporter_end(&s->r);
    fclose(s->out);
    fclose(s->err);
    if (s->reader >= 0)
        close(s->reader);
    free(s);
}

static void frames(screen *s, size_t n)
{
    const char *files[] = {"out/a.exr"};
    rl_error none = {0};
    rl_report_run_begin(&s->r);
    for (size_t i = 1; i <= n; i++) {
        rl_frame_result f = {.capture = "shot",
                             .frame = (long long)i,
                             .error = &none,
                             .n_files = 1,
                             .files = files,
                             .done = i,
                             .total = n};
        rl_report_frame(&s->r, &f);
    }
}

/* ---- tests -----------------------------------------------------------------------------------------------
 */

static void test_error_line(void **state)
{
    (void)state;
    screen *s = screen_open(false);
    rl_error err = {.code = RL_E_CONFIG, .line = 14, .column = 9, .file = "skin.yaml", .text = "no"};
    rl_report_error(&s->r, &err);
    err.line = 0;
    rl_report_error(&s->r, &err);
    err.file[0] = 0;
    rl_report_error(&s->r, &err);
    assert_string_equal(screen_text(s), "skin.yaml:14:9: error: no\nskin.yaml: error: no\nerror: no\n");
    screen_close(s);
}

static void say_all(screen *s)
{
    rl_report(&s->r.log, RL_WARNING, (rl_where){"a", 1, 2}, "w");
    rl_report(&s->r.log, RL_NOTE, RL_NOWHERE, "n");
    rl_report(&s->r.log, RL_VERBOSE, RL_NOWHERE, "v");
}

static void test_what_is_said(void **state)
{
    (void)state;
    static const char *const expected[] = {"a:1:2: warning: w\nnote: n\n", "a:1:2: warning: w\n",
                                           "a:1:2: warning: w\nnote: n\nnote: v\n"};
    for (int i = 0; i < 3; i++) {
        screen *s = screen_open(false);
        s->r.quiet = i == 1;
        s->r.verbose = i == 2;
        say_all(s);
        assert_string_equal(screen_text(s), expected[i]);
        screen_close(s);
    }
}

/* The same warning of two thousand frames is one line; another place is another warning. */
static void test_each_once(void **state)
{
    (void)state;
    screen *s = screen_open(false);
    for (int i = 0; i < 2000; i++)
        rl_report(&s->r.log, RL_WARNING, (rl_where){"a", 1 + i % 2, 1}, "stale");
    assert_string_equal(screen_text(s), "a:1:1: warning: stale\na:2:1: warning: stale\n");
    screen_close(s);
}

static void test_plain_lines(void **state)
{
    (void)state;
    screen *s = screen_open(false);
    frames(s, 2);
    assert_string_equal(screen_text(s), "[1/2] shot frame 1: out/a.exr\n[2/2] shot frame 2: out/a.exr\n");
    screen_close(s);
}

static void test_bar(void **state)
{
    (void)state;
    setenv("TERM", "xterm", 1);
    unsetenv("NO_COLOR");
    screen *s = screen_open(true);
    assert_true(s->r.terminal && s->r.color);
    frames(s, 3);
    rl_report(&s->r.log, RL_WARNING, RL_NOWHERE, "w");
    const char *text = screen_text(s);
    assert_non_null(strstr(text, "[##########....................] 1/3  "));
    assert_non_null(strstr(text, "[##############################] 3/3  "));
    assert_non_null(strstr(text, " frames/s  0:00 left"));
    assert_null(strstr(text, "out/a.exr")); /* a bar, no lines */
    /* The warning takes the bar's line and is coloured. */
    assert_non_null(strstr(text, "left\r\033[K\033[1;33mwarning:\033[0m w\r\n"));
    screen_close(s);
}

static void test_no_color(void **state)
{
    (void)state;
    setenv("NO_COLOR", "1", 1);
    screen *s = screen_open(true);
    rl_report(&s->r.log, RL_WARNING, RL_NOWHERE, "w");
    assert_string_equal(screen_text(s), "warning: w\r\n");
    screen_close(s);
    unsetenv("NO_COLOR");
}

static void test_quiet_has_no_bar(void **state)
{
    (void)state;
    screen *s = screen_open(true);
    s->r.quiet = true;
    frames(s, 3);
    rl_run_summary summary = {.frames = 3};
    rl_report_run_end(&s->r, &summary, false);
    assert_string_equal(screen_text(s), "");
    screen_close(s);
}

static void test_summary_names_failures(void **state)
{
    (void)state;
    screen *s = screen_open(false);
    rl_error bad = {.code = RL_E_DATA, .text = "id 7 has no material"};
    rl_frame_result f = {.capture = "shot", .frame = 12, .error = &bad, .done = 1, .total = 2};
    rl_run_summary summary = {.frames = 2, .failed = 1, .nonfinite = 5};
    s->r.quiet = true;
    rl_report_run_begin(&s->r);
    rl_report_frame(&s->r, &f);
    rl_report_run_end(&s->r, &summary, false);
    assert_string_equal(screen_text(s),
                        "shot frame 12: error: id 7 has no material\n"
                        "1 of 2 frames failed:\n"
                        "  shot frame 12: id 7 has no material\n"
                        "warning: 5 samples of the capture were NaN or infinite; they became 0\n");
    screen_close(s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_error_line),
        cmocka_unit_test(test_what_is_said),
        cmocka_unit_test(test_each_once),
        cmocka_unit_test(test_plain_lines),
        cmocka_unit_test(test_bar),
        cmocka_unit_test(test_no_color),
        cmocka_unit_test(test_quiet_has_no_bar),
        cmocka_unit_test(test_summary_names_failures),
    };
    return cmocka_run_group_tests_name("report", tests, NULL, NULL);
}
