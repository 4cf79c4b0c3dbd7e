/* junit.xml: read by a strict parser of its own (well-formed, no unknown entity), then held against the form
 * that Ant's JUnit task writes: which elements and attributes there must be, in which order, and counts that
 * agree. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "graph/tool/ab_junit.h"
#include "tests/ab_values.h"

static rl_experiment *e;
static ab_values v;

/* ---- a strict reader of small XML ---------------------------------------------------------------------- */

enum { MOST_NODES = 256, MOST_ATTRIBUTES = 12, MOST_TEXT = 4096 };

typedef struct element {
    char name[32];
    int parent; /* -1: the root */
    char keys[MOST_ATTRIBUTES][32], values[MOST_ATTRIBUTES][1024];
    int n_attributes;
    char text[MOST_TEXT]; /* its own, without that of its children */
} element;

static element elements[MOST_NODES];
static int n_elements;
static const char *at, *begin;

static void expect(bool good, const char *what)
{
    if (!good)
        fail_msg("byte %d: %s: %.40s", (int)(at - begin), what, at);
}

static void read_name(char *out)
{
    size_t n = strspn(at, "abcdefghijklmnopqrstuvwxyz-");
    expect(n > 0 && n < 32, "a name");
    memcpy(out, at, n);
    out[n] = 0;
    at += n;
}

/* One character, an entity resolved. */
static char read_char(void)
{
    static const struct {
        const char *name;
        char value;
    } known[] = {{"&amp;", '&'},  {"&lt;", '<'},   {"&gt;", '>'},
                 {"&quot;", '"'}, {"&#10;", '\n'}, {"&#9;", '\t'}};
    expect(*at != '<' && *at != 0, "a character");
    expect((unsigned char)*at >= 0x20 || *at == '\n', "no control character");
    if (*at != '&')
        return *at++;
    for (size_t i = 0; i < sizeof known / sizeof *known; i++)
        if (!strncmp(at, known[i].name, strlen(known[i].name))) {
            at += strlen(known[i].name);
            return known[i].value;
        }
    expect(false, "a known entity");
    return 0;
}

static void skip_space(void)
{
    at += strspn(at, " \n");
}

static void read_attributes(element *out)
{
    while (*at == ' ') {
        int k = out->n_attributes++;
        size_t n = 0;
        expect(k < MOST_ATTRIBUTES, "fewer attributes");
        skip_space();
        read_name(out->keys[k]);
        for (int i = 0; i < k; i++)
            assert_string_not_equal(out->keys[i], out->keys[k]);
        expect(at[0] == '=' && at[1] == '"', "=\"");
        for (at += 2; *at != '"';) {
            expect(n < sizeof out->values[k] - 1, "shorter");
            out->values[k][n++] = read_char();
        }
        out->values[k][n] = 0;
        at++;
    }
}

static void read_element(int parent)
{
    int self = n_elements++;
    size_t n = 0;
    char end[32];
    expect(self < MOST_NODES, "fewer elements");
    element *out = &elements[self];
    memset(out, 0, sizeof *out);
    out->parent = parent;
    expect(*at == '<', "<");
    at++;
    read_name(out->name);
    read_attributes(out);
    if (!strncmp(at, "/>", 2)) {
        at += 2;
        return;
    }
    expect(*at == '>', ">");
    at++;
    while (strncmp(at, "</", 2)) {
        if (*at == '<') {
            read_element(self);
            continue;
        }
        expect(n < MOST_TEXT - 1, "less text");
        out->text[n++] = read_char();
    }
    at += 2;
    read_name(end);
    assert_string_equal(end, out->name);
    expect(*at == '>', ">");
    at++;
}

/* ---- the form ------------------------------------------------------------------------------------------ */

static const char *attribute(const element *x, const char *key)
{
    for (int i = 0; i < x->n_attributes; i++)
        if (!strcmp(x->keys[i], key))
            return x->values[i];
    fail_msg("%s has no %s", x->name, key);
    return NULL;
}

static void only(const element *x, const char *const *keys)
{
    for (int i = 0; i < x->n_attributes; i++) {
        bool found = false;
        for (int k = 0; keys[k]; k++)
            found = found || !strcmp(keys[k], x->keys[i]);
        if (!found)
            fail_msg("%s must not have %s", x->name, x->keys[i]);
    }
}

static bool is_blank(const char *text)
{
    return text[strspn(text, " \n")] == 0;
}

static int count(const element *x, const char *key)
{
    char *end;
    long n = strtol(attribute(x, key), &end, 10);
    assert_true(!*end && n >= 0);
    return (int)n;
}

static double seconds(const element *x)
{
    const char *text = attribute(x, "time");
    assert_int_equal(strspn(text, "0123456789."), strlen(text));
    return strtod(text, NULL);
}

/* Children in the order that the schema demands; counts; times that add up. */
static void check_suite(int self)
{
    static const char *const keys[] = {"name",  "package",  "id",     "timestamp", "hostname",
                                       "tests", "failures", "errors", "time",      NULL};
    static const char *const order[] = {"properties", "testcase", "system-out", "system-err"};
    static const char *const case_keys[] = {"classname", "name", "time", NULL};
    static const char *const problem_keys[] = {"message", "type", NULL};
    const element *suite = &elements[self];
    int stage = 0, tests = 0, failures = 0, errors = 0, seen[4] = {0};
    double time = 0;
    only(suite, keys);
    assert_true(strlen(attribute(suite, "name")) > 0);
    assert_int_equal(strlen(attribute(suite, "timestamp")), strlen("2026-01-01T00:00:00"));
    assert_true(is_blank(suite->text));
    for (int i = self + 1; i < n_elements; i++) {
        const element *x = &elements[i];
        if (x->parent == self) {
            while (stage < 4 && strcmp(order[stage], x->name))
                stage++;
            assert_true(stage < 4);
            seen[stage]++;
            if (stage == 1) {
                only(x, case_keys);
                assert_true(strlen(attribute(x, "name")) > 0 && strlen(attribute(x, "classname")) > 0);
                assert_true(is_blank(x->text));
                time += seconds(x);
                tests++;
            }
        } else if (x->parent > self && elements[x->parent].parent == self &&
                   !strcmp(elements[x->parent].name, "testcase")) {
            only(x, problem_keys);
            assert_true(strlen(attribute(x, "type")) > 0 && strlen(attribute(x, "message")) > 0);
            assert_true(!strcmp(x->name, "failure") || !strcmp(x->name, "error"));
            failures += !strcmp(x->name, "failure");
            errors += !strcmp(x->name, "error");
        }
    }
    assert_true(seen[0] == 1 && seen[2] == 1 && seen[3] == 1);
    assert_int_equal(count(suite, "tests"), tests);
    assert_int_equal(count(suite, "failures"), failures);
    assert_int_equal(count(suite, "errors"), errors);
    assert_true(fabs(time - seconds(suite)) <= 5e-4 * (tests + 1));
}

static int suites;

static void write_and_check(void)
{
    rl_str text = {0};
    rl_error err = {0};
    assert_int_equal(rl_ab_junit(&v.report, &text, &err), RL_OK);
    const char *keep = getenv("RELIT_KEEP_JUNIT"); /* for another validator */
    FILE *copy = keep ? fopen(keep, "w") : NULL;
    if (copy) {
        fputs(rl_str_text(&text), copy);
        fclose(copy);
    }
    static const char head[] = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
    begin = at = rl_str_text(&text);
    assert_memory_equal(at, head, sizeof head - 1);
    at += sizeof head - 1;
    n_elements = suites = 0;
    read_element(-1);
    assert_string_equal(at, "\n");
    assert_string_equal(elements[0].name, "testsuites");
    assert_int_equal(elements[0].n_attributes, 0);
    for (int i = 1; i < n_elements; i++)
        if (elements[i].parent == 0) {
            assert_string_equal(elements[i].name, "testsuite");
            assert_int_equal(count(&elements[i], "id"), suites++);
            check_suite(i);
        }
    rl_str_free(&text);
}

static const element *find(const char *name, int skip)
{
    for (int i = 0; i < n_elements; i++)
        if (!strcmp(elements[i].name, name) && !skip--)
            return &elements[i];
    return NULL;
}

/* ---- tests --------------------------------------------------------------------------------------------- */

static int set_up(void **state)
{
    (void)state;
    e = fake_experiment_new(2);
    ab_values_make(&v, e, 3, 3);
    for (size_t capture = 0; capture < 2; capture++)
        for (size_t pair = 0; pair < 2; pair++)
            for (size_t i = 0; i < 2; i++) {
                ab_values_add(&v, capture, pair, i, RL_AB_WHOLE, 0.004, 0.01);
                ab_values_add(&v, capture, pair, i, FAKE_SKIN, capture || pair ? 0.001 : 0.02, 0.05);
            }
    v.report.started = 1767225600; /* 2026-01-01 */
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    fake_experiment_free(e);
    return 0;
}

static void test_without_thresholds(void **state)
{
    (void)state;
    write_and_check();
    assert_int_equal(suites, 2);
    const element *suite = find("testsuite", 1);
    assert_string_equal(attribute(suite, "name"), "bust");
    assert_string_equal(attribute(suite, "timestamp"), "2026-01-01T00:00:00");
    assert_int_equal(count(suite, "tests"), 2);
    assert_true(fabs(seconds(suite) - 1.5) < 1e-9);
    assert_string_equal(attribute(find("testcase", 1), "classname"), "monkey.third against post");
}

static void test_failures(void **state)
{
    (void)state;
    rl_arena arena = {0};
    rl_error err = {0};
    rl_threshold thresholds[] = {{RL_METRIC_FLIP, RL_STAT_MEAN, 0.01}, {RL_METRIC_PSNR, RL_STAT_MEAN, 41}};
    rl_ab_verdict *verdicts;
    assert_int_equal(rl_ab_fail_check(&arena, &v.report, thresholds, 2, &verdicts, &err), RL_OK);
    v.report.verdicts = verdicts;
    v.report.n_verdicts = 2;
    write_and_check();
    /* 2 pairs × 2 thresholds × (whole, skin). */
    const element *suite = find("testsuite", 0);
    assert_int_equal(count(suite, "tests"), 8);
    assert_int_equal(count(suite, "failures"), 1 + 4);
    assert_int_equal(count(find("testsuite", 1), "failures"), 4);
    assert_string_equal(attribute(find("testcase", 0), "name"), "flip.mean of all materials");
    assert_string_equal(attribute(find("testcase", 1), "name"), "flip.mean of skin");
    const element *failure = find("failure", 0);
    assert_ptr_equal(&elements[failure->parent], find("testcase", 1));
    assert_string_equal(attribute(failure, "message"), "flip.mean over 0.01 in 2 frames");
    assert_string_equal(failure->text, "pre_post against post, skin, capture 'monkey', frame 1: 0.02\n"
                                       "pre_post against post, skin, capture 'monkey', frame 2: 0.02\n");
    assert_string_equal(attribute(find("failure", 1), "message"), "psnr.mean under 41 in 2 frames");
    rl_arena_free(&arena);
}

static void test_errors_and_energy(void **state)
{
    (void)state;
    rl_ab_failure failures[] = {{1, 7, "file \"a<b>\" & more\x01"}, {1, -3, "bytes \xff\xfe"}};
    rl_ab_offender over[] = {{0, 2, FAKE_SKIN, -1, 1, "sss", 0.02}};
    rl_ab_verdict verdicts[] = {{{RL_THRESHOLD_ENERGY, RL_STAT_MEAN, 0.01}, over, 1, 10}};
    v.report.failures = failures;
    v.report.n_failures = 2;
    v.report.verdicts = verdicts;
    v.report.n_verdicts = 1;
    v.report.command = "relit ab 'a&b' \"<\"\t>";
    v.report.summary = "post ]]> caf\xc3\xa9";
    write_and_check();
    assert_string_equal(attribute(find("property", 0), "value"), "relit ab 'a&b' \"<\"\t>");
    assert_string_equal(find("system-out", 0)->text, "post ]]> caf\xc3\xa9");
    assert_int_equal(count(find("testsuite", 0), "failures"), 1);
    assert_int_equal(count(find("testsuite", 1), "failures"), 0);
    assert_int_equal(count(find("testsuite", 1), "errors"), 2);
    assert_string_equal(attribute(find("error", 0), "message"), "file \"a<b>\" & more?");
    assert_string_equal(attribute(find("error", 1), "message"), "bytes ??");
    assert_string_equal(attribute(&elements[find("error", 1)->parent], "name"), "frame -3");
    assert_string_equal(find("failure", 0)->text,
                        "pre_post, pass 'sss', skin, capture 'monkey', frame 2: 0.02\n");
    /* Pairs are still there when energy is all that has a limit. */
    assert_int_equal(count(find("testsuite", 0), "tests"), 3);
}

static void test_memory(void **state)
{
    (void)state;
    rl_ab_offender over[] = {{0, 2, FAKE_SKIN, 0, -1, NULL, 0.02}, {0, 2, FAKE_SKIN, -1, 1, "sss", 0.02}};
    rl_ab_verdict verdicts[] = {{{RL_METRIC_FLIP, RL_STAT_MEAN, 0.01}, over, 1, 10},
                                {{RL_THRESHOLD_ENERGY, RL_STAT_MEAN, 0.01}, over + 1, 1, 10}};
    v.report.verdicts = verdicts;
    v.report.n_verdicts = 2;
    ab_values_starve(&v, rl_ab_junit);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_without_thresholds, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_failures, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_errors_and_energy, set_up, tear_down),
        cmocka_unit_test_setup_teardown(test_memory, set_up, tear_down),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
