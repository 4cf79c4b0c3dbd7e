/* YAML to values, includes, merging, setting, checked reading, and what goes wrong. */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <float.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "graph/base/alloc.h"
#include "graph/base/file.h"
#include "graph/base/text.h"
#include "graph/model/value.h"

static rl_arena arena;
static rl_error err;
static char message[2300];

static int setup(void **state)
{
    (void)state;
    err = (rl_error){0};
    return 0;
}

static int teardown(void **state)
{
    (void)state;
    rl_alloc_fail_at(0, 0);
    rl_arena_free(&arena);
    return 0;
}

static rl_value *parse(const char *text)
{
    rl_value *v;
    err = (rl_error){0};
    if (rl_yaml_parse(&arena, text, strlen(text), "t.yaml", &v, &err)) {
        rl_error_format(&err, message, sizeof message);
        fail_msg("%s\n%s", text, message);
    }
    return v;
}

static void assert_message(const char *expected)
{
    rl_error_format(&err, message, sizeof message);
    assert_string_equal(message, expected);
    assert_int_not_equal(err.code, RL_OK);
    err = (rl_error){0};
}

static void refuse(const char *text, const char *expected)
{
    rl_value *v;
    err = (rl_error){0};
    assert_int_equal(rl_yaml_parse(&arena, text, strlen(text), "t.yaml", &v, &err), RL_E_CONFIG);
    assert_null(v);
    assert_message(expected);
}

static void assert_prints(const rl_value *v, const char *expected)
{
    rl_str s = {0};
    rl_value_print(v, &s);
    assert_string_equal(rl_str_text(&s), expected);
    rl_str_free(&s);
}

static const rl_value *get(const rl_value *root, const char *path)
{
    const rl_value *v = rl_value_at(root, path);
    if (!v)
        fail_msg("nothing at %s", path);
    return v;
}

/* ---- reading ---- */

static void test_core_schema(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        rl_kind kind;
        bool integral;
        double number;
    } rows[] = {
        {"12", RL_NUMBER, true, 12},
        {"-12", RL_NUMBER, true, -12},
        {"+7", RL_NUMBER, true, 7},
        {"007", RL_NUMBER, true, 7},
        {"0x1F", RL_NUMBER, true, 31},
        {"0xffffffff", RL_NUMBER, true, 4294967295.0},
        {"0o17", RL_NUMBER, true, 15},
        {"1e10", RL_NUMBER, false, 1e10},
        {"1E+2", RL_NUMBER, false, 100},
        {".5", RL_NUMBER, false, 0.5},
        {"5.", RL_NUMBER, false, 5},
        {"-0.25e-3", RL_NUMBER, false, -0.00025},
        {".inf", RL_NUMBER, false, INFINITY},
        {"-.Inf", RL_NUMBER, false, -INFINITY},
        {"+.INF", RL_NUMBER, false, INFINITY},
        {"9223372036854775807", RL_NUMBER, true, 9223372036854775807.0},
        {"9223372036854775808", RL_NUMBER, false, 9223372036854775808.0},
        {"0xffffffffffffffffff", RL_NUMBER, false, 4722366482869645213695.0},
        {"true", RL_TRUTH, false, 1},
        {"False", RL_TRUTH, false, 0},
        {"TRUE", RL_TRUTH, false, 1},
        {"~", RL_NULL, false, 0},
        {"Null", RL_NULL, false, 0},
        {"", RL_NULL, false, 0},
        {"yes", RL_TEXT, false, 0},
        {"no", RL_TEXT, false, 0},
        {"on", RL_TEXT, false, 0},
        {"tRUE", RL_TEXT, false, 0},
        {"1:30", RL_TEXT, false, 0},
        {"0b11", RL_TEXT, false, 0},
        {"1_000", RL_TEXT, false, 0},
        {"-0x1F", RL_TEXT, false, 0},
        {"0x", RL_TEXT, false, 0},
        {"0o8", RL_TEXT, false, 0},
        {".", RL_TEXT, false, 0},
        {"-.", RL_TEXT, false, 0},
        {"e5", RL_TEXT, false, 0},
        {"1e", RL_TEXT, false, 0},
        {"1e+", RL_TEXT, false, 0},
        {"1.2.3", RL_TEXT, false, 0},
        {"inf", RL_TEXT, false, 0},
        {"nan", RL_TEXT, false, 0},
        {"-.nan", RL_TEXT, false, 0},
        {"2001-12-14", RL_TEXT, false, 0},
        {"'12'", RL_TEXT, false, 0},
        {"\"true\"", RL_TEXT, false, 0},
        {"''", RL_TEXT, false, 0},
        {"!!str 12", RL_TEXT, false, 0},
        {"! 12", RL_TEXT, false, 0},
        {"!!int '12'", RL_NUMBER, true, 12},
        {"!!float 3", RL_NUMBER, true, 3},
        {"!!bool true", RL_TRUTH, false, 1},
        {"!!null ''", RL_NULL, false, 0},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        char text[64];
        snprintf(text, sizeof text, "[%s, x]", rows[i].text);
        if (!rows[i].text[0])
            strcpy(text, "{a: }");
        const rl_value *v = parse(text);
        v = v->kind == RL_LIST ? v->items[0] : v->entries[0].value;
        if (v->kind != rows[i].kind || v->integral != rows[i].integral)
            fail_msg("'%s' reads as kind %d, integral %d", rows[i].text, v->kind, v->integral);
        if (v->kind == RL_NUMBER && v->number != rows[i].number)
            fail_msg("'%s' reads as %g", rows[i].text, v->number);
        if (v->kind == RL_TRUTH)
            assert_int_equal(v->truth, rows[i].number);
        if (v->integral && fabs(v->number) < 1e15)
            assert_int_equal(v->integer, (long long)v->number);
    }
    assert_true(isnan(parse(".NaN")->number));
    assert_int_equal(parse("9223372036854775807")->integer, LLONG_MAX);
}

static void test_places_and_texts(void **state)
{
    (void)state;
    const rl_value *v = parse("# first\ngraph:\n  sss: {pass: sss_burley,   taps: 0x10}\nname: 'a ''b'''\n"
                              "long: |\n  two\n  lines\nlist:\n- 1\n- - 2\n  - x: 3\n");
    const rl_value *taps = get(v, "graph.sss.taps");
    assert_string_equal(taps->where.file, "t.yaml");
    assert_int_equal(taps->where.line, 3);
    assert_int_equal(taps->where.column, 35);
    assert_string_equal(taps->text, "0x10");
    const rl_value *sss = get(v, "graph.sss");
    assert_int_equal(sss->entries[1].where.line, 3);
    assert_int_equal(sss->entries[1].where.column, 29);
    assert_string_equal(get(v, "name")->text, "a 'b'");
    assert_string_equal(get(v, "long")->text, "two\nlines\n");
    assert_int_equal(get(v, "list.1.1.x")->integer, 3);
    assert_null(rl_value_at(v, "list.2"));
    assert_null(rl_value_at(v, "list.-1"));
    assert_null(rl_value_at(v, "list.99999999999999999999"));
    assert_null(rl_value_at(v, "name.x"));
    assert_null(rl_value_at(v, "graph.ss"));
    assert_null(rl_value_at(v, "graph.sss."));
    assert_null(rl_value_get(taps, "x"));
    assert_int_equal(parse("")->kind, RL_NULL);
    assert_int_equal(parse("# nothing\n---\n...\n")->kind, RL_NULL);
    assert_int_equal(parse("\xEF\xBB\xBF"
                           "a: 1\n")
                         ->n,
                     1);
    /* columns count characters, not bytes */
    assert_int_equal(get(parse("{\xC3\xA9: 1, b: 2}"), "b")->where.column, 11);
}

static void test_anchors(void **state)
{
    (void)state;
    rl_value *v = parse("a: &x {d: [1, 2]}\nb: *x\nc: &x 5\nd: *x\n&k key: 1\ne: *k\n");
    assert_prints(v, "{a: {d: [1, 2]}, b: {d: [1, 2]}, c: 5, d: 5, key: 1, e: key}");
    /* setting through an alias leaves the other user alone */
    rl_value *nine = parse("9");
    assert_int_equal(rl_value_set(&arena, &v, "b.d.0", nine, &err), RL_OK);
    assert_prints(v, "{a: {d: [1, 2]}, b: {d: [9, 2]}, c: 5, d: 5, key: 1, e: key}");
    refuse("a: *x\n", "t.yaml:1:4: error: the alias '*x' has no anchor '&x' before it");
    refuse("a: &x [1, *x]\n", "t.yaml:1:11: error: the alias '*x' stands inside its own anchor");
    rl_str bomb = {0};
    rl_str_add(&bomb, "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n");
    for (int i = 1; i < 9; i++) {
        rl_str_printf(&bomb, "a%d: &a%d [", i, i);
        for (int k = 0; k < 10; k++)
            rl_str_printf(&bomb, "%s*a%d", k ? ", " : "", i - 1);
        rl_str_add(&bomb, "]\n");
    }
    refuse(rl_str_text(&bomb), "t.yaml:5:45: error: the aliases stand for more than 100000 values");
    rl_str_free(&bomb);
}

static void test_bad_yaml(void **state)
{
    (void)state;
    refuse("a: 1\nb: 2\na: 3\n", "t.yaml:3:1: error: the key 'a' is given twice, first in line 1");
    refuse("x: {b: 1, c: 2, 'b': 3}\n", "t.yaml:1:17: error: the key 'b' is given twice, first in line 1");
    refuse("a: !thing 1\n", "t.yaml:1:4: error: the tag '!thing' is not known here; known: !!bool, !!float, "
                            "!!int, !!map, !!null, !!seq, !!str");
    refuse("a: !!set {x}\n", "t.yaml:1:4: error: the tag 'tag:yaml.org,2002:set' is not known here; known: "
                             "!!bool, !!float, !!int, !!map, !!null, !!seq, !!str");
    refuse("a: !!int 1.5\n", "t.yaml:1:4: error: '1.5' is not what its tag !!int says");
    refuse("--- 1\n--- 2\n", "t.yaml:2:1: error: a second document; a file holds one");
    refuse("? [1, 2]\n: x\n", "t.yaml:1:3: error: a key must be a word or a number, not a list");
    refuse("{{a: 1}: 2}\n", "t.yaml:1:2: error: a key must be a word or a number, not a map");
    refuse("?\n: 1\n", "t.yaml:1:2: error: a key is missing before ':'");
    refuse("a: \"x\\0y\"\n", "t.yaml:1:4: error: a text with a zero byte in it");
    refuse("a: 1\nb: x\xFFy\n", "t.yaml:2:5: error: not YAML: invalid leading UTF-8 octet");
    refuse("a: [1, 2\nb: 3\n", "t.yaml:2:2: error: not YAML: while parsing a flow sequence: did not find "
                               "expected ',' or ']'");
    refuse("a:\n\t- 1\n", "t.yaml:2:1: error: not YAML: a tab, where only spaces may indent");
    refuse("\xC3\xA4: 1\nb:\n\t- 1\n", "t.yaml:3:1: error: not YAML: a tab, where only spaces may indent");
    refuse("a: @b\n", "t.yaml:1:4: error: not YAML: while scanning for the next token: found character that "
                      "cannot start any token");
    rl_str deep = {0};
    for (int i = 0; i < 500; i++)
        rl_str_add(&deep, "[");
    refuse(rl_str_text(&deep), "t.yaml:1:65: error: lists and maps within each other more than 64 deep");
    rl_str_free(&deep);
    rl_value *v;
    assert_int_equal(rl_yaml_parse(&arena, "a: x\0y", 6, "t.yaml", &v, &err), RL_E_CONFIG);
    assert_message("t.yaml:1:5: error: not YAML: control characters are not allowed");
    assert_int_equal(rl_yaml_load(&arena, "no/such.yaml", &v, &err), RL_E_IO);
    assert_message("no/such.yaml: error: cannot be opened: No such file or directory");
}

/* Cuts and flips of a file with everything in it: an error or a tree, no crash, no leak (run under ASan). */
static void test_damaged_yaml(void **state)
{
    (void)state;
    static const char good[] =
        "a: &x {d: [1, 2.5, .inf], 'k': \"q\\n\"}\nb: *x\n? c\n: |\n  text\n  more\n- bad\n";
    size_t n = sizeof good - 1;
    unsigned random = 1;
    for (size_t i = 0; i < 6000; i++) {
        char text[sizeof good];
        memcpy(text, good, sizeof good);
        size_t size = i < n ? i : n;
        for (int k = 0; i >= n && k < 3; k++) {
            random = random * 1664525u + 1013904223u;
            text[(random >> 8) % n] = (char)(random >> 24);
        }
        rl_value *v;
        err = (rl_error){0};
        rl_code code = rl_yaml_parse(&arena, text, size, "t.yaml", &v, &err);
        assert_int_equal(code, err.code);
        assert_true((code == RL_OK) == (v != NULL));
        if (code)
            assert_true(err.line > 0 && err.text[0]);
        rl_arena_free(&arena);
    }
}

/* ---- includes ---- */

static char folder[64];

static void put(const char *name, const char *text)
{
    char path[128];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    rl_arena scratch = {0};
    assert_int_equal(rl_folder_make(rl_path_folder(&scratch, path), &err), RL_OK);
    rl_arena_free(&scratch);
    assert_int_equal(rl_file_write(path, text, strlen(text), &err), RL_OK);
}

static rl_code load(const char *name, rl_value **v)
{
    char path[128];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    err = (rl_error){0};
    return rl_config_load(&arena, path, v, &err);
}

static int make_folder(void **state)
{
    strcpy(folder, "/tmp/relit-test-XXXXXX");
    return setup(state) || !mkdtemp(folder);
}

static int drop_folder(void **state)
{
    char command[96];
    snprintf(command, sizeof command, "rm -r %s", folder);
    return teardown(state) || system(command);
}

static void expect_failure(const char *name, rl_code code, const char *expected)
{
    rl_value *v;
    char text[1024] = "", *out = text;
    assert_int_equal(load(name, &v), code);
    assert_null(v);
    for (const char *e = expected; *e; e++) /* @ stands for the folder */
        out += *e == '@' ? sprintf(out, "%s", folder) : sprintf(out, "%c", *e);
    assert_message(text);
}

static void test_includes(void **state)
{
    (void)state;
    rl_value *v;
    put("main.yaml",
        "include: [common/one.yaml, common/two.yaml]\nm: {own: 1, two: 3}\nlist: [9]\ngone: null\n");
    put("common/one.yaml", "include: ../base.yaml\nm: {one: 1, two: 1, deep: {x: 1}}\nlist: [1, 2, 3]\n");
    put("common/two.yaml", "m: {two: 2, deep: {y: 2}}\ngone: 5\n");
    put("base.yaml", "m: {base: 0, one: 0}\n");
    assert_int_equal(load("main.yaml", &v), RL_OK);
    assert_prints(v, "{m: {base: 0, one: 1, two: 3, deep: {x: 1, y: 2}, own: 1}, list: [9]}");
    assert_string_equal(rl_path_name(get(v, "m.base")->where.file), "base.yaml");
    assert_string_equal(rl_path_name(get(v, "m.deep.y")->where.file), "two.yaml");
    assert_int_equal(get(v, "m.deep.y")->where.line, 1);
    put("alone.yaml", "a: null\nb: {c: ~}\n");
    assert_int_equal(load("alone.yaml", &v), RL_OK);
    assert_prints(v, "{a: null, b: {c: null}}");
    put("empty.yaml", "include: [nothing.yaml]\n");
    put("nothing.yaml", "# nothing\n");
    assert_int_equal(load("empty.yaml", &v), RL_OK);
    assert_prints(v, "{}");
}

static void test_bad_includes(void **state)
{
    (void)state;
    put("a.yaml", "x: 1\ninclude: [sub/b.yaml]\n");
    put("sub/b.yaml", "include: ../c.yaml\n");
    put("c.yaml", "include:\n  - ./a.yaml\n");
    expect_failure("a.yaml", RL_E_CONFIG,
                   "@/sub/../c.yaml:2:5: error: the includes go in a circle: @/a.yaml -> @/sub/b.yaml -> "
                   "@/sub/../c.yaml -> @/sub/.././a.yaml");
    put("self.yaml", "include: self.yaml\n");
    expect_failure("self.yaml", RL_E_CONFIG,
                   "@/self.yaml:1:10: error: the includes go in a circle: @/self.yaml -> @/self.yaml");
    put("missing.yaml", "include: [no.yaml]\n");
    expect_failure(
        "missing.yaml", RL_E_CONFIG,
        "@/missing.yaml:1:11: error: cannot include 'no.yaml' (@/no.yaml): cannot be opened: No such "
        "file or directory");
    put("list.yaml", "[1]\n");
    put("of_list.yaml", "include: list.yaml\n");
    expect_failure("of_list.yaml", RL_E_CONFIG,
                   "@/list.yaml:1:1: error: 'include': expected a file that holds a map, found a list of 1");
    put("number.yaml", "include: [3]\n");
    expect_failure("number.yaml", RL_E_CONFIG,
                   "@/number.yaml:1:11: error: 'include': expected a path, found the number '3'");
    put("broken.yaml", "a: [\n");
    put("of_broken.yaml", "include: broken.yaml\n");
    expect_failure(
        "of_broken.yaml", RL_E_CONFIG,
        "@/broken.yaml:2:1: error: not YAML: while parsing a flow node: did not find expected node content");
    expect_failure("none.yaml", RL_E_IO, "@/none.yaml: error: cannot be opened: No such file or directory");
    for (int i = 0; i < 12; i++) { /* 2^12 visits */
        char name[16], text[64];
        snprintf(name, sizeof name, "d%d.yaml", i);
        snprintf(text, sizeof text, i < 11 ? "include: [d%d.yaml, d%d.yaml]\n" : "x: 1\n", i + 1, i + 1);
        put(name, text);
    }
    rl_value *v;
    assert_int_equal(load("d0.yaml", &v), RL_E_CONFIG);
    assert_non_null(strstr(err.text, "more than 1000 files are included"));
}

/* ---- changing and printing ---- */

static void test_merge(void **state)
{
    (void)state;
    rl_value *base = parse("{a: 1, m: {x: 1, y: {z: 1}}, l: [1, 2], n: 5}");
    rl_value *over = parse("{a: text, m: {y: {w: null, v: 2}, x: null}, l: [3], n: null, new: {k: null}}");
    assert_prints(rl_value_merge(&arena, base, over), "{a: text, m: {y: {z: 1, v: 2}}, l: [3], new: {}}");
    assert_prints(base, "{a: 1, m: {x: 1, y: {z: 1}}, l: [1, 2], n: 5}");
    assert_prints(rl_value_merge(&arena, base, parse("7")), "7");
    assert_prints(rl_value_merge(&arena, parse("7"), parse("{a: 1}")), "{a: 1}");
    assert_ptr_equal(rl_value_merge(&arena, base, NULL), base);
    /* nothing of a merge is shared with what can be changed later */
    rl_value *sum = rl_value_merge(&arena, base, parse("{b: 1}"));
    assert_int_equal(rl_value_set(&arena, &sum, "m.y.z", parse("8"), &err), RL_OK);
    assert_int_equal(get(base, "m.y.z")->integer, 1);
    assert_int_equal(get(sum, "m.y.z")->integer, 8);
}

static rl_value *option(const char *text, const char *name)
{
    rl_value *v;
    assert_int_equal(rl_yaml_parse(&arena, text, strlen(text), name, &v, &err), RL_OK);
    v->where = (rl_where){.file = name};
    return v;
}

static void test_set(void **state)
{
    (void)state;
    rl_value *v = parse("{graph: {sss: {taps: 21}}, w: [[1, 2], 3], capture: c.yaml, nothing: ~}");
    assert_int_equal(rl_value_set(&arena, &v, "graph.sss.taps", option("55", "--set"), &err), RL_OK);
    assert_int_equal(rl_value_set(&arena, &v, "graph.aa.pass", option("taa", "--set"), &err), RL_OK);
    assert_int_equal(rl_value_set(&arena, &v, "w.0.1", option("[7]", "--set"), &err), RL_OK);
    assert_int_equal(rl_value_set(&arena, &v, "nothing.a.b", option("1", "--set"), &err), RL_OK);
    assert_int_equal(rl_value_set(&arena, &v, "no.such.key", option("null", "--set"), &err), RL_OK);
    assert_prints(v, "{graph: {sss: {taps: 55}, aa: {pass: taa}}, w: [[1, [7]], 3], capture: c.yaml, "
                     "nothing: {a: {b: 1}}}");
    assert_int_equal(rl_value_set(&arena, &v, "graph.sss", option("null", "--set"), &err), RL_OK);
    assert_prints(get(v, "graph"), "{aa: {pass: taa}}");
    assert_string_equal(get(v, "graph.aa.pass")->where.file, "--set");

    const char *name = "--set x";
    assert_int_equal(rl_value_set(&arena, &v, "w.2", option("1", name), &err), RL_E_CONFIG);
    assert_message("--set x: error: 'w' is a list of 2 (from 0): it has no element '2'");
    assert_int_equal(rl_value_set(&arena, &v, "w.0.x.y", option("1", name), &err), RL_E_CONFIG);
    assert_message("--set x: error: 'w.0' is a list of 2 (from 0): it has no element 'x'");
    assert_int_equal(rl_value_set(&arena, &v, "w.1", option("null", name), &err), RL_E_CONFIG);
    assert_message("--set x: error: an element of the list 'w' cannot be removed; set the whole list");
    assert_int_equal(rl_value_set(&arena, &v, "capture.files", option("1", name), &err), RL_E_CONFIG);
    assert_message("--set x: error: 'capture' is the text 'c.yaml': it has no 'files'");
    static const char *const bad[] = {"", ".", "a.", ".a", "a..b"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        assert_int_equal(rl_value_set(&arena, &v, bad[i], option("1", name), &err), RL_E_USAGE);
        assert_non_null(strstr(err.text, "is no dotted path"));
        err = (rl_error){0};
    }
    char deep[200];
    memset(deep, 'a', sizeof deep);
    for (size_t i = 1; i < sizeof deep; i += 2)
        deep[i] = '.';
    deep[sizeof deep - 1] = 0;
    deep[sizeof deep - 2] = 'b';
    assert_int_equal(rl_value_set(&arena, &v, deep, option("1", name), &err), RL_E_USAGE);
    assert_message("--set x: error: the path has 100 parts; the most is 32");
    rl_value *empty = NULL;
    assert_int_equal(rl_value_set(&arena, &empty, "a.b", option("1", name), &err), RL_OK);
    assert_prints(empty, "{a: {b: 1}}");
}

/* What is printed reads back as the same values, and prints the same again. */
static void test_print_round_trip(void **state)
{
    (void)state;
    static const char text[] =
        "{plain: lin_rec709, path: ../a/b-c.exr, q: 'true', n: '12', e: '', s: \"a \\\"b\\\"\\n\\\\\\x01\", "
        "u: \"\xC3\xA9\", 1: skin, d: [0.1, 1e10, 100, -3, 0x10, .inf, -.inf, .nan, 1e-5, 250000, 3.0], t: "
        "true, "
        "z: null, m: {}, l: [], 'k: v': -, star: '*x', hash: a#b}";
    rl_str once = {0}, twice = {0};
    const rl_value *v = parse(text);
    rl_value_print(v, &once);
    assert_string_equal(
        rl_str_text(&once),
        "{plain: lin_rec709, path: \"../a/b-c.exr\", q: \"true\", n: \"12\", e: \"\", "
        "s: \"a \\\"b\\\"\\x0a\\\\\\x01\", u: \"\xC3\xA9\", \"1\": skin, d: [0.1, 1e10, 100, -3, 16, "
        ".inf, -.inf, .nan, 1e-5, 250000, 3], t: true, z: null, m: {}, l: [], \"k: v\": \"-\", "
        "star: \"*x\", hash: a#b}");
    const rl_value *back = parse(rl_str_text(&once));
    rl_value_print(back, &twice);
    assert_string_equal(rl_str_text(&once), rl_str_text(&twice));
    assert_string_equal(get(back, "s")->text, get(v, "s")->text);
    assert_int_equal(get(back, "q")->kind, RL_TEXT);
    rl_str_free(&once);
    rl_str_free(&twice);
}

/* ---- checked reading ---- */

static void test_keys(void **state)
{
    (void)state;
    static const char *const known[] = {"taps", "orientation", "weighting", "rotation", "seed"};
    assert_int_equal(rl_value_keys(parse("{seed: 1, taps: 2}"), "pass 'sss' (sss_burley)", known, 5, &err),
                     RL_OK);
    assert_int_equal(
        rl_value_keys(parse("seed: 1\n  # x\ntapps: 2\n"), "pass 'sss' (sss_burley)", known, 5, &err),
        RL_E_CONFIG);
    assert_message(
        "t.yaml:3:1: error: pass 'sss' (sss_burley) has no key 'tapps'; did you mean 'taps'? known: "
        "orientation, rotation, seed, taps, weighting");
    rl_value_keys(parse("zebra: 2\n"), "a light", known, 2, &err);
    assert_message("t.yaml:1:1: error: a light has no key 'zebra'; known: orientation, taps");
    rl_value_keys(parse("- 1\n"), "a light", known, 2, &err);
    assert_message("t.yaml:1:1: error: a light: expected a map, found a list of 1");
    rl_value_keys(NULL, "a light", known, 2, &err);
    assert_message("error: a light: expected a map, found nothing");
}

static void test_numbers(void **state)
{
    (void)state;
    double x = -1;
    const double pi = 3.25;
    assert_int_equal(rl_value_number(parse("3.25"), "x", 0, 4, &x, &err), RL_OK);
    assert_true(x == pi);
    assert_int_equal(rl_value_number(parse("4"), "x", 0, 4, &x, &err), RL_OK);
    rl_value_number(parse("a: 1\nb:   4.0001\n")->entries[1].value, "blend", 0, 4, &x, &err);
    assert_message("t.yaml:2:6: error: 'blend' is 4.0001: out of range, 0 to 4");
    rl_value_number(parse("-1e-3"), "fov_x", 0.001, 179.5, &x, &err);
    assert_message("t.yaml:1:1: error: 'fov_x' is -1e-3: out of range, 0.001 to 179.5");
    rl_value_number(parse(".nan"), "x", -INFINITY, INFINITY, &x, &err);
    assert_message("t.yaml:1:1: error: 'x' is .nan: a number is needed");
    assert_int_equal(rl_value_number(parse(".inf"), "x", 0, INFINITY, &x, &err), RL_OK);
    assert_true(isinf(x));
    rl_value_number(parse("1e999"), "x", 0, DBL_MAX, &x, &err);
    assert_message("t.yaml:1:1: error: 'x' is 1e999: a finite number is needed");
    rl_value_number(parse("0"), "unit", DBL_MIN, DBL_MAX, &x, &err);
    assert_message("t.yaml:1:1: error: 'unit' is 0: out of range, above 0");
    rl_value_number(parse("0"), "angle", DBL_MIN, 180, &x, &err);
    assert_message("t.yaml:1:1: error: 'angle' is 0: out of range, above 0 and at most 180");
    rl_value_number(parse("-2"), "x", 0, DBL_MAX, &x, &err);
    assert_message("t.yaml:1:1: error: 'x' is -2: out of range, at least 0");
    rl_value_number(parse("7"), "x", -DBL_MAX, 5, &x, &err);
    assert_message("t.yaml:1:1: error: 'x' is 7: out of range, at most 5");
    rl_value_number(parse("'7'"), "x", 0, 9, &x, &err);
    assert_message("t.yaml:1:1: error: 'x': expected a number, found the text '7'");
    assert_true(isinf(x)); /* untouched by every failure */

    double v[3];
    assert_int_equal(rl_value_numbers(parse("[1, -2.5, 1e3]"), "p", 3, v, &err), RL_OK);
    assert_true(v[1] == -2.5 && v[2] == 1000);
    rl_value_numbers(parse("[1, 2]"), "position", 3, v, &err);
    assert_message("t.yaml:1:1: error: 'position': expected a list of 3 numbers, found a list of 2");
    rl_value_numbers(parse("[1, 2, .nan]"), "position", 3, v, &err);
    assert_message("t.yaml:1:8: error: 'position' is .nan: a number is needed");
    assert_int_equal(rl_value_numbers(parse("[1, x, 3]"), "position", 3, v, NULL), RL_E_CONFIG);
}

static void test_other_scalars(void **state)
{
    (void)state;
    long long i = 0;
    assert_int_equal(rl_value_integer(parse("0x10"), "i", 0, 99, &i, &err), RL_OK);
    assert_int_equal(i, 16);
    assert_int_equal(rl_value_integer(parse("1e2"), "i", 0, 100, &i, &err), RL_OK);
    assert_int_equal(i, 100);
    rl_value_integer(parse("1.5"), "taps", 0, 99, &i, &err);
    assert_message("t.yaml:1:1: error: 'taps': expected an integer, found the number '1.5'");
    rl_value_integer(parse("5000"), "taps", 1, 4096, &i, &err);
    assert_message("t.yaml:1:1: error: 'taps' is 5000: out of range, 1 to 4096");
    rl_value_integer(parse(".nan"), "taps", 1, 4096, &i, &err);
    assert_message("t.yaml:1:1: error: 'taps': expected an integer, found the number '.nan'");
    rl_value_integer(parse("99999999999999999999"), "taps", 1, 4096, &i, &err);
    assert_message("t.yaml:1:1: error: 'taps': expected an integer, found the number '99999999999999999999'");
    bool b = false;
    assert_int_equal(rl_value_truth(parse("True"), "b", &b, &err), RL_OK);
    assert_true(b);
    rl_value_truth(parse("yes"), "enabled", &b, &err);
    assert_message("t.yaml:1:1: error: 'enabled': expected true or false, found the text 'yes'");
    const char *t = NULL;
    assert_int_equal(rl_value_text(parse("'12'"), "t", &t, &err), RL_OK);
    assert_string_equal(t, "12");
    rl_value_text(parse("12"), "name", &t, &err);
    assert_message("t.yaml:1:1: error: 'name': expected a text, found the number '12'");
    int w = -1;
    assert_int_equal(rl_value_word(parse("radial"), "kind", "planar|radial|device", &w, &err), RL_OK);
    assert_int_equal(w, 1);
    assert_int_equal(rl_value_word(parse("device"), "kind", "planar|radial|device", &w, &err), RL_OK);
    assert_int_equal(w, 2);
    rl_value_word(parse("radia"), "kind", "planar|radial|device", &w, &err);
    assert_message("t.yaml:1:1: error: 'kind' cannot be 'radia'; did you mean 'radial'? known: "
                   "device, planar, radial");
    rl_value_word(parse("[a]"), "kind", "planar|radial", &w, &err);
    assert_message("t.yaml:1:1: error: 'kind': expected one of planar|radial, found a list of 1");
    assert_int_equal(w, 2);
}

static void test_describe(void **state)
{
    (void)state;
    char buf[96];
    assert_string_equal(rl_value_describe(parse("{}"), buf), "an empty map");
    assert_string_equal(rl_value_describe(parse("~"), buf), "null");
    assert_string_equal(rl_value_describe(parse("false"), buf), "false");
    char text[200] = "'";
    for (int i = 0; i < 60;
         i++) /* 2 bytes each: the cut would fall inside one if bytes were counted from 1 */
        strcat(text, i ? "\xC3\xA9" : "x");
    strcat(text, "'");
    rl_value_describe(parse(text), buf);
    assert_int_equal(strlen(buf), strlen("the text ''") + 59 + 3);
    assert_string_equal(buf + strlen(buf) - 6, "\xC3\xA9...'");
}

/* ---- memory ---- */

/* Every allocation of parse, load, merge and set fails once: RL_E_MEMORY, nothing leaks. */
static void test_failing_memory(void **state)
{
    (void)state;
    put("main.yaml", "include: [inc.yaml]\na: &x {b: [1, 2, 3, 4, 5, 6], c: d}\ne: *x\n");
    put("inc.yaml", "a: {b: 3, q: {z: 1}}\nf: [1, 2]\n");
    size_t before = rl_alloc_live();
    unsigned long n = 1;
    for (bool done = false; !done; n++) {
        rl_value *v = NULL;
        rl_str s = {0};
        rl_error inner = {0};
        err = (rl_error){0};
        char path[128];
        snprintf(path, sizeof path, "%s/main.yaml", folder);
        rl_alloc_fail_at(n, n % 2);
        rl_code code = rl_config_load(&arena, path, &v, &err);
        if (!code)
            code = rl_value_set(&arena, &v, "a.b.2", v, &err);
        if (!code) {
            rl_value_print(v, &s);
            rl_value_keys(v, "it", (const char *const[]){"x"}, 1, &inner);
            code = s.failed || inner.code == RL_E_MEMORY ? RL_E_MEMORY : RL_OK;
        }
        rl_alloc_fail_at(0, 0);
        assert_true(code == RL_OK || code == RL_E_MEMORY);
        done = code == RL_OK;
        rl_str_free(&s);
        rl_arena_free(&arena);
        assert_int_equal(rl_alloc_live(), before);
        assert_true(n < 1000);
    }
    assert_true(n > 5);
}

static void test_paths(void **state)
{
    (void)state;
    rl_value v = {.kind = RL_TEXT, .text = "b/c.exr", .where = {.file = "a/p.yaml", .line = 3, .column = 1}};
    assert_string_equal(rl_value_path(&arena, &v), "a/b/c.exr");
    v.where.file = "--set capture=b/c.exr"; /* the option's text is no folder */
    assert_string_equal(rl_value_path(&arena, &v), "b/c.exr");
    v.where = RL_NOWHERE;
    assert_string_equal(rl_value_path(&arena, &v), "b/c.exr");
}

int main(void)
{
#define T(f) cmocka_unit_test_setup_teardown(f, setup, teardown)
#define F(f) cmocka_unit_test_setup_teardown(f, make_folder, drop_folder)
    const struct CMUnitTest tests[] = {
        T(test_core_schema),   T(test_places_and_texts), T(test_anchors),        T(test_bad_yaml),
        T(test_damaged_yaml),  F(test_includes),         F(test_bad_includes),   T(test_merge),
        T(test_set),           T(test_print_round_trip), T(test_keys),           T(test_numbers),
        T(test_other_scalars), T(test_describe),         F(test_failing_memory), T(test_paths),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
