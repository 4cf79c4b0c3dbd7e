/* The pages of `relit ab` and `relit plan` in real headless Chromium: tests/page_browser.py drives it. Where
 * no browser can be started the test is skipped. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>

#include "tests/page_make.h"
#include "tests/tool_run.h"

static char *folder;

static const char *in_folder(const char *name)
{
    static char paths[4][512];
    static int turn;
    char *path = paths[turn++ % 4];
    snprintf(path, sizeof paths[0], "%s/%s", folder, name);
    return path;
}

static page_make_options options_for(const char *name)
{
    return (page_make_options){.folder = folder, .path = in_folder(name), .failed = -1};
}

static int count(const char *text, const char *what)
{
    int n = 0;
    for (const char *at = strstr(text, what); at; at = strstr(at + 1, what))
        n++;
    return n;
}

/* What tests/page_browser.py says, a line a test. */
static char browser_says[65536];
static int browser_status = -1;

static void run_browser(void)
{
    page_make_options o = options_for("main.html");
    rl_ab_page_summary got;
    rl_error err = {0};
    assert_int_equal(page_make(&o, &got, &err), RL_OK);
    o.path = in_folder("evil.html");
    o.name = "</script><img src=x onerror=\"window.evil=1\">";
    assert_int_equal(page_make(&o, &got, &err), RL_OK);
    o = options_for("none.html");
    o.report_frames = "none";
    assert_int_equal(page_make(&o, &got, &err), RL_OK);
    o = options_for("reference.html");
    o.reference = o.plain = true;
    o.failed = 1;
    assert_int_equal(page_make(&o, &got, &err), RL_OK);

    assert_int_equal(page_make_plan(in_folder("plan.html"), in_folder("trace.json"), "a</script>a", &err),
                     RL_OK);

    const char *const arguments[] = {"ab",       "configs/skin.yaml",
                                     "--vary",   "profiles.skin.texturing=post,pre_post",
                                     "--frames", "1",
                                     "--seeds",  "1",
                                     "--out",    in_folder("real"),
                                     "--quiet",  NULL};
    tool_result real = tool_run(arguments);
    assert_int_equal(real.status, 0);
    tool_result_free(&real);

    char command[512];
    snprintf(command, sizeof command, "python3 tests/page_browser.py '%s' 2>&1", folder);
    FILE *pipe = popen(command, "r");
    assert_non_null(pipe);
    size_t n = fread(browser_says, 1, sizeof browser_says - 1, pipe);
    browser_says[n] = 0;
    int status = pclose(pipe);
    browser_status = WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

static void works_in_a_browser(void **state)
{
    (void)state;
    run_browser();
    if (browser_status == 77 || browser_status == 127) {
        print_message("%s", browser_says[0] ? browser_says : "no python3\n");
        skip();
    }
    if (browser_status)
        print_error("%s", browser_says);
    assert_int_equal(browser_status, 0);
    assert_int_equal(count(browser_says, "passed "), 29);
}

static int make_folder(void **state)
{
    (void)state;
    folder = folder_new();
    return folder ? 0 : -1;
}

static int remove_folder(void **state)
{
    (void)state;
    folder_remove(folder);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(works_in_a_browser)};
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
