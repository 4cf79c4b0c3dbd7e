/* graph/base: memory, arenas, text, errors, files, threads. */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <fcntl.h>
#include <float.h>
#include <limits.h>
#include <locale.h>
#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "graph/base/alloc.h"
#include "graph/base/arena.h"
#include "graph/base/error.h"
#include "graph/base/file.h"
#include "graph/base/log.h"
#include "graph/base/pool.h"
#include "graph/base/text.h"

static rl_error err;

static int setup(void **state)
{
    (void)state;
    err = (rl_error){0};
    return 0;
}

static int switch_off(void **state)
{
    (void)state;
    rl_alloc_fail_at(0, 0);
    return 0;
}

/* ---- memory ---- */

static void test_alloc(void **state)
{
    (void)state;
    size_t before = rl_alloc_live();
    rl_alloc_reset_peak();
    char *a = rl_malloc(1000), *b = rl_calloc(10, 100), *c = rl_aligned(1001), *d = rl_strdup("text");
    assert_true(rl_alloc_live() >= before + 3006);
    for (int i = 0; i < 1000; i++)
        assert_int_equal(b[i], 0);
    assert_int_equal((uintptr_t)c % RL_ALIGN, 0);
    memset(c, 1, 1001);
    assert_string_equal(d, "text");
    memset(a, 7, 1000);
    a = rl_realloc(a, 100000);
    assert_true(a[999] == 7 && rl_alloc_live() >= before + 102006);
    rl_free(a);
    rl_free(b);
    rl_free(c);
    rl_free(d);
    rl_free(NULL);
    assert_int_equal(rl_alloc_live(), before);
    assert_true(rl_alloc_peak() >= before + 102006);
    rl_alloc_reset_peak();
    assert_int_equal(rl_alloc_peak(), before);
    assert_null(rl_calloc(SIZE_MAX / 2, 3));
    assert_null(rl_aligned(SIZE_MAX - 5));
    void *empty[] = {rl_malloc(0), rl_calloc(0, 8), rl_aligned(0), rl_realloc(NULL, 0)};
    for (int i = 0; i < 4; i++) {
        assert_non_null(empty[i]);
        rl_free(empty[i]);
    }
    assert_int_equal(rl_alloc_live(), before);
}

static void test_alloc_fails_on_request(void **state)
{
    (void)state;
    void *p[4];
    rl_alloc_fail_at(2, 0);
    for (int i = 0; i < 4; i++)
        p[i] = rl_malloc(8);
    assert_true(p[0] && !p[1] && p[2] && p[3]);
    for (int i = 0; i < 4; i++)
        rl_free(p[i]);
    rl_alloc_fail_at(3, 1);
    p[0] = rl_malloc(8);
    p[1] = rl_aligned(8);
    assert_true(p[0] && p[1]);
    assert_true(!rl_calloc(1, 1) && !rl_malloc(1) && !rl_strdup("x") && !rl_aligned(1));
    assert_null(rl_realloc(p[0], 100)); /* and p[0] is still there */
    rl_alloc_fail_at(0, 0);
    rl_free(p[0]);
    rl_free(p[1]);
}

static void test_arena(void **state)
{
    (void)state;
    size_t before = rl_alloc_live();
    rl_arena arena = {0};
    unsigned char *p[200];
    for (size_t i = 0; i < 200; i++) {
        p[i] = rl_arena_alloc(&arena, i * 7);
        assert_int_equal((uintptr_t)p[i] % _Alignof(max_align_t), 0);
        for (size_t k = 0; k < i * 7; k++)
            assert_int_equal(p[i][k], 0);
        memset(p[i], (int)i, i * 7);
    }
    unsigned char *large = rl_arena_array(&arena, 1000, 1000);
    memset(large, 0xFF, 1000000);
    for (size_t i = 0; i < 200; i++)
        for (size_t k = 0; k < i * 7; k++)
            assert_int_equal(p[i][k], (unsigned char)i);
    assert_string_equal(rl_arena_strndup(&arena, "abcdef", 3), "abc");
    assert_string_equal(rl_arena_strdup(&arena, ""), "");
    assert_string_equal(rl_arena_printf(&arena, "%s.%04d", "x", 7), "x.0007");
    char *wide = rl_arena_printf(&arena, "%20000d", 1);
    assert_int_equal(strlen(wide), 20000);
    assert_null(rl_arena_array(&arena, SIZE_MAX / 4, 8));
    assert_null(rl_arena_alloc(&arena, SIZE_MAX - 1));
    rl_arena_free(&arena);
    assert_int_equal(rl_alloc_live(), before);
    rl_arena_free(&arena);
    rl_alloc_fail_at(1, 1);
    assert_true(!rl_arena_alloc(&arena, 1) && !rl_arena_strdup(&arena, "x") &&
                !rl_arena_printf(&arena, "%d", 1));
}

/* ---- text ---- */

static void test_str(void **state)
{
    (void)state;
    rl_str s = {0};
    assert_string_equal(rl_str_text(&s), "");
    char expected[4096] = "";
    for (int i = 0; i < 300; i++) {
        rl_str_printf(&s, "%d,", i);
        sprintf(expected + strlen(expected), "%d,", i);
    }
    rl_str_addn(&s, "xyz", 2);
    strcat(expected, "xy");
    assert_string_equal(rl_str_text(&s), expected);
    assert_int_equal(s.length, strlen(expected));
    rl_str_printf(&s, "%1000d", 1);
    assert_int_equal(s.length, strlen(expected) + 1000);
    assert_false(s.failed);
    rl_str_free(&s);
    rl_alloc_fail_at(2, 0);
    rl_str_add(&s, "a");
    for (int i = 0; i < 100; i++)
        rl_str_add(&s, "b");
    assert_true(s.failed);
    rl_str_free(&s);
    assert_false(s.failed);
}

/* A process may have set a locale with a decimal comma. None may be installed, so one is compiled when the
 * machine can (localedef); without it the C locale is what is tested. */
static bool use_comma(char *folder)
{
    static const char *const names[] = {"de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8", "de_DE"};
    char command[160];
    strcpy(folder, "/tmp/relit-locale-XXXXXX");
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (setlocale(LC_ALL, names[i]))
            return true;
    if (!mkdtemp(folder))
        return false;
    snprintf(command, sizeof command, "localedef -i de_DE -f UTF-8 %s/de_DE.UTF-8 >%s/log 2>&1", folder,
             folder);
    if (system(command))
        return false;
    setenv("LOCPATH", folder, 1);
    return setlocale(LC_ALL, "de_DE.UTF-8") != NULL;
}

static void test_numbers_ignore_the_locale(void **state)
{
    (void)state;
    char folder[40], buf[32], command[64];
    bool comma = use_comma(folder);
    double x = 0;
    unsigned long long bytes = 0;
    if (comma) {
        snprintf(buf, sizeof buf, "%.1f", 1.5);
        assert_string_equal(buf, "1,5");
    } else {
        print_message("no locale with a decimal comma here: only the C locale is tested\n");
    }
    bool dot = rl_parse_double("1.5", &x), with_comma = rl_parse_double("1,5", &(double){0});
    bool parsed = rl_parse_bytes("1.5K", &bytes);
    char f[32], d[32], b[32];
    rl_format_float(0.05f, f);
    rl_format_double(-1234.5678, d);
    rl_format_bytes(1536, b);
    if (comma) { /* the thread's own locale is back */
        snprintf(buf, sizeof buf, "%.1f", 1.5);
        assert_string_equal(buf, "1,5");
    }
    setlocale(LC_ALL, "C");
    unsetenv("LOCPATH");
    snprintf(command, sizeof command, "rm -rf %s", folder);
    assert_int_equal(system(command), 0);
    assert_true(dot && x == 1.5 && !with_comma && parsed && bytes == 1536);
    assert_string_equal(f, "0.05");
    assert_string_equal(d, "-1234.5678");
    assert_string_equal(b, "1.5 KiB");
}

static void test_parse(void **state)
{
    (void)state;
    static const char *const good[] = {"1e10", "-3", ".5", "5.", "+2", "1e-400", "0x10"};
    static const double values[] = {1e10, -3, 0.5, 5, 2, 0, 16};
    static const char *const bad[] = {"", " 1", "1 ", "1x", "x", "--1", "1e", ".", "1\n", "\t1"};
    double x;
    for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
        assert_true(rl_parse_double(good[i], &x));
        assert_true(x == values[i]);
    }
    long long n;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        assert_false(rl_parse_double(bad[i], &x));
        assert_false(rl_parse_int(bad[i], &n));
    }
    assert_true(rl_parse_int("-9223372036854775808", &n) && n == LLONG_MIN);
    assert_true(rl_parse_int("010", &n) && n == 10);
    assert_false(rl_parse_int("9223372036854775808", &n));
    assert_false(rl_parse_int("1.0", &n));
}

static void test_format(void **state)
{
    (void)state;
    static const double values[] = {0,   100,  24,     1e6,   1e5,  123456, 1e10,   1e-5,   0.0001,
                                    0.1, 1e22, 250000, -1500, 0.05, 1.5,    1e-300, DBL_MAX};
    static const char *const texts[] = {"0",
                                        "100",
                                        "24",
                                        "1e6",
                                        "100000",
                                        "123456",
                                        "1e10",
                                        "1e-5",
                                        "0.0001",
                                        "0.1",
                                        "1e22",
                                        "250000",
                                        "-1500",
                                        "0.05",
                                        "1.5",
                                        "1e-300",
                                        "1.7976931348623157e308"};
    char buf[32];
    for (size_t i = 0; i < sizeof values / sizeof *values; i++)
        assert_string_equal(rl_format_double(values[i], buf), texts[i]);
    assert_string_equal(rl_format_float(0.05f, buf), "0.05");
    assert_string_equal(rl_format_float(FLT_MAX, buf), "3.4028235e38");
    uint64_t random = 88172645463325252u;
    for (int i = 0; i < 200000; i++) {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        double d, back;
        float f;
        uint32_t low = (uint32_t)random;
        memcpy(&d, &random, sizeof d);
        memcpy(&f, &low, sizeof f);
        if (isfinite(d) && (!rl_parse_double(rl_format_double(d, buf), &back) || memcmp(&d, &back, sizeof d)))
            fail_msg("%a prints as %s", d, buf);
        if (!isfinite(f))
            continue;
        float single = rl_parse_double(rl_format_float(f, buf), &back) ? (float)back : 0;
        if (memcmp(&f, &single, sizeof f))
            fail_msg("%a prints as %s", (double)f, buf);
    }
}

static void test_bytes(void **state)
{
    (void)state;
    unsigned long long n = 0;
    char buf[32];
    assert_true(rl_parse_bytes("4G", &n) && n == 4ull << 30);
    assert_true(rl_parse_bytes("512M", &n) && n == 512ull << 20);
    assert_true(rl_parse_bytes("1.5GiB", &n) && n == 3ull << 29);
    assert_true(rl_parse_bytes("2kB", &n) && n == 2048);
    assert_true(rl_parse_bytes("1000000", &n) && n == 1000000);
    assert_true(rl_parse_bytes("10B", &n) && n == 10);
    static const char *const bad[] = {"", "G", "-1G", "0", "4X", "4Gx", "nan", "inf", "1e30", "4 G", "4i"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        if (rl_parse_bytes(bad[i], &n))
            fail_msg("'%s' reads as %llu bytes", bad[i], n);
    assert_string_equal(rl_format_bytes(0, buf), "0 bytes");
    assert_string_equal(rl_format_bytes(1023, buf), "1023 bytes");
    assert_string_equal(rl_format_bytes(1503238553, buf), "1.4 GiB");
    assert_string_equal(rl_format_bytes(1ull << 50, buf), "1024.0 TiB");
}

static void test_nearest(void **state)
{
    (void)state;
    static const char *const known[] = {"taps", "orientation", "rotation", "seed", "weighting"};
    assert_string_equal(rl_nearest("tapps", known, 5), "taps");
    assert_string_equal(rl_nearest("tpas", known, 5), "taps"); /* a swap is one step */
    assert_string_equal(rl_nearest("TAPS", known, 5), "taps");
    assert_string_equal(rl_nearest("orientaton", known, 5), "orientation");
    assert_string_equal(rl_nearest("rotations", known, 5), "rotation");
    assert_null(rl_nearest("blend", known, 5));
    assert_null(rl_nearest("", known, 5));
    assert_null(rl_nearest("x", (const char *const[]){"y"}, 1));
    assert_null(rl_nearest("taps", known, 0));
    char a[300], b[300];
    memset(a, 'a', 299);
    memset(b, 'a', 299);
    a[299] = b[299] = 0;
    b[3] = 'x';
    assert_ptr_equal(rl_nearest(a, (const char *const[]){b}, 1), b);
    rl_str s = {0};
    rl_suggest(&s, "tapps", known, 5, "known");
    assert_string_equal(rl_str_text(&s),
                        "; did you mean 'taps'? known: orientation, rotation, seed, taps, weighting");
    rl_str_free(&s);
    rl_suggest(&s, "zzz", known, 2, "ports");
    assert_string_equal(rl_str_text(&s), "; ports: orientation, taps");
    rl_str_free(&s);
    rl_suggest(&s, "zzz", known, 0, "ports");
    assert_string_equal(rl_str_text(&s), "");
    /* a beginning, of one only, and of some length */
    static const char *const words[] = {"lambert", "shadow_steps", "shadow_side"};
    const char *const beginnings[][2] = {
        {"Lam", "; did you mean 'lambert'? of: lambert, shadow_side, shadow_steps"},
        {"shadow", "; of: lambert, shadow_side, shadow_steps"},
        {"la", "; of: lambert, shadow_side, shadow_steps"}};
    for (size_t i = 0; i < 3; i++) {
        rl_suggest(&s, beginnings[i][0], words, 3, "of");
        assert_string_equal(rl_str_text(&s), beginnings[i][1]);
        rl_str_free(&s);
    }
    assert_null(rl_nearest("lam", words, 3));
}

static void test_errors(void **state)
{
    (void)state;
    char out[600];
    assert_int_equal(rl_fail(&err, RL_E_CONFIG, (rl_where){"a.yaml", 3, 7}, "no %s", "x"), RL_E_CONFIG);
    assert_int_equal(rl_fail(&err, RL_E_IO, RL_NOWHERE, "later"), RL_E_CONFIG);
    rl_error_format(&err, out, sizeof out);
    assert_string_equal(out, "a.yaml:3:7: error: no x");
    rl_error_format(&err, out, 10);
    assert_string_equal(out, "a.yaml:3:");
    err = (rl_error){0};
    char path[700];
    memset(path, 'a', sizeof path);
    strcpy(path + 690, "/tail.exr");
    rl_fail_file(&err, RL_E_IO, path, "x");
    assert_int_equal(strlen(err.file), sizeof err.file - 1);
    assert_string_equal(err.file + strlen(err.file) - 9, "/tail.exr");
    err = (rl_error){0};
    rl_fail_memory(&err, 12);
    rl_error_format(&err, out, sizeof out);
    assert_string_equal(out, "error: out of memory: 12 bytes could not be allocated");
    assert_int_equal(rl_fail(NULL, RL_E_DATA, RL_NOWHERE, "x"), RL_E_DATA);
    assert_string_equal(rl_code_name(RL_E_IO), "RL_E_IO");
    assert_string_equal(rl_code_text((rl_code)999), "unknown error");
}

static void remember(void *ctx, rl_severity severity, rl_where where, const char *text)
{
    snprintf(ctx, 200, "%d %s:%d %s", severity, where.file, where.line, text);
}

static void test_log(void **state)
{
    (void)state;
    char seen[200] = "";
    rl_log log = {.sink = remember, .ctx = seen};
    rl_report(&log, RL_WARNING, (rl_where){"f", 2, 1}, "%d pixels", 3);
    assert_string_equal(seen, "1 f:2 3 pixels");
    rl_report(NULL, RL_NOTE, RL_NOWHERE, "nothing");
    rl_report(&(rl_log){0}, RL_NOTE, RL_NOWHERE, "nothing");
}

/* ---- files ---- */

static char folder[64];

static int make_folder(void **state)
{
    strcpy(folder, "/tmp/relit-test-XXXXXX");
    return setup(state) || !mkdtemp(folder);
}

static int drop_folder(void **state)
{
    char command[192];
    snprintf(command, sizeof command, "chmod -R u+w %s && rm -r %s", folder, folder);
    return switch_off(state) || system(command);
}

static const char *in_folder(const char *name)
{
    static char path[4][512];
    static int next;
    char *out = path[next++ % 4];
    snprintf(out, sizeof path[0], "%s/%s", folder, name);
    return out;
}

static int count_files(void)
{
    char command[128];
    int n = -1;
    snprintf(command, sizeof command, "find %s -type f | wc -l", folder);
    FILE *f = popen(command, "r");
    if (f) {
        assert_int_equal(fscanf(f, "%d", &n), 1);
        pclose(f);
    }
    return n;
}

static void test_file_round_trip(void **state)
{
    (void)state;
    static char data[300000];
    for (size_t i = 0; i < sizeof data; i++)
        data[i] = (char)(i * 7 + i / 256);
    static const size_t sizes[] = {0, 1, 4095, 4096, 4097, sizeof data};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        char *back;
        size_t n;
        assert_int_equal(rl_file_write(in_folder("f.bin"), data, sizes[i], &err), RL_OK);
        assert_int_equal(rl_file_read(in_folder("f.bin"), &back, &n, &err), RL_OK);
        assert_int_equal(n, sizes[i]);
        assert_memory_equal(back, data, n);
        assert_int_equal(back[n], 0);
        rl_free(back);
    }
    assert_int_equal(count_files(), 1); /* no temporary is left */
}

static void test_file_read_pipe(void **state)
{
    (void)state;
    int fd[2];
    assert_int_equal(pipe(fd), 0);
    static char data[50000];
    memset(data, 'x', sizeof data);
    assert_int_equal(write(fd[1], data, sizeof data), sizeof data);
    close(fd[1]);
    char name[32], *back;
    size_t n;
    snprintf(name, sizeof name, "/dev/fd/%d", fd[0]);
    assert_int_equal(rl_file_read(name, &back, &n, &err), RL_OK);
    assert_int_equal(n, sizeof data);
    rl_free(back);
    close(fd[0]);
}

static void test_file_errors(void **state)
{
    (void)state;
    char *data;
    size_t n;
    assert_int_equal(rl_file_read(in_folder("none"), &data, &n, &err), RL_E_IO);
    assert_string_equal(err.text, "cannot be opened: No such file or directory");
    assert_string_equal(err.file, in_folder("none"));
    assert_null(data);
    err = (rl_error){0};
    assert_int_equal(rl_file_read(folder, &data, &n, &err), RL_E_IO);
    assert_string_equal(err.text, "cannot be read: it is a folder");
    err = (rl_error){0};
    assert_int_equal(rl_file_write(in_folder("no/such/f"), "x", 1, &err), RL_E_IO);
    assert_string_equal(err.text, "cannot be written: No such file or directory");
    err = (rl_error){0};
    assert_int_equal(mkdir(in_folder("sub"), 0777), 0);
    assert_int_equal(rl_file_write(in_folder("sub"), "x", 1, &err), RL_E_IO); /* rename onto a folder */
    assert_int_equal(count_files(), 0);
    err = (rl_error){0};
    assert_int_equal(mkfifo(in_folder("pipe"), 0666), 0); /* stays a pipe */
    int fd = open(in_folder("pipe"), O_RDWR);
    char seen[5] = "";
    assert_int_equal(rl_file_write(in_folder("pipe"), "text", 4, &err), RL_OK);
    assert_int_equal(read(fd, seen, 4), 4);
    assert_string_equal(seen, "text");
    close(fd);
    char temp[512];
    assert_int_equal(rl_file_temp(in_folder("pipe"), temp, sizeof temp, &err), RL_OK);
    assert_int_equal(rl_file_write(temp, "x", 1, &err), RL_OK);
    assert_int_equal(rl_file_commit(temp, in_folder("pipe"), &err), RL_E_IO);
    assert_string_equal(err.text, "cannot be written: it is no plain file");
    assert_false(rl_path_exists(temp));
    err = (rl_error){0};
    for (unsigned long i = 1; i < 3; i++) {
        rl_file_write(in_folder("g"), "text", 4, &err);
        rl_alloc_fail_at(i, 0);
        rl_code code = rl_file_read(in_folder("g"), &data, &n, &err);
        rl_alloc_fail_at(0, 0);
        assert_int_equal(code, i == 1 ? RL_E_MEMORY : RL_OK); /* a file of known size takes one allocation */
        rl_free(data);
        err = (rl_error){0};
    }
}

static void test_file_temp(void **state)
{
    (void)state;
    char a[256], b[256];
    assert_int_equal(rl_file_temp(in_folder("x.exr"), a, sizeof a, &err), RL_OK);
    assert_int_equal(rl_file_temp(in_folder("x.exr"), b, sizeof b, &err), RL_OK);
    assert_string_not_equal(a, b);
    assert_string_equal(a + strlen(a) - 4, ".tmp");
    assert_memory_equal(a, folder, strlen(folder));
    assert_int_equal(rl_file_temp(in_folder("x.exr"), b, 20, &err), RL_E_IO);
    err = (rl_error){0};
    assert_int_equal(rl_file_commit(a, in_folder("x.exr"), &err), RL_E_IO); /* it was never made */
    err = (rl_error){0};
    assert_int_equal(rl_file_write(a, "new", 3, &err), RL_OK);
    assert_int_equal(rl_file_write(in_folder("x.exr"), "old", 3, &err), RL_OK);
    assert_int_equal(rl_file_commit(a, in_folder("x.exr"), &err), RL_OK);
    char *data;
    size_t n;
    assert_int_equal(rl_file_read(in_folder("x.exr"), &data, &n, &err), RL_OK);
    assert_string_equal(data, "new");
    rl_free(data);
    assert_false(rl_path_exists(a));
    assert_int_equal(rl_file_write(b, "x", 1, &err), RL_OK);
    rl_file_discard(b);
    assert_false(rl_path_exists(b));
}

static void test_paths(void **state)
{
    (void)state;
    rl_arena a = {0};
    assert_string_equal(rl_path_folder(&a, "a/b/c.yaml"), "a/b");
    assert_string_equal(rl_path_folder(&a, "c.yaml"), ".");
    assert_string_equal(rl_path_folder(&a, "/c.yaml"), "/");
    assert_string_equal(rl_path_join(&a, "a", "b"), "a/b");
    assert_string_equal(rl_path_join(&a, "a/", "b"), "a/b");
    assert_string_equal(rl_path_join(&a, "a", "/b"), "/b");
    assert_string_equal(rl_path_join(&a, ".", "b"), "b");
    assert_string_equal(rl_path_join(&a, "/", "b"), "/b");
    assert_string_equal(rl_path_name("x/y.0001.exr"), "y.0001.exr");
    assert_string_equal(rl_path_extension("x.d/y.0001.exr"), ".exr");
    assert_string_equal(rl_path_extension("x.d/y"), "");
    assert_string_equal(rl_path_extension("x/.hidden"), "");
    rl_arena_free(&a);
    assert_int_equal(rl_folder_make(in_folder("p/q//r"), &err), RL_OK);
    assert_int_equal(rl_folder_make(in_folder("p/q/r/"), &err), RL_OK);
    assert_true(rl_path_is_folder(in_folder("p/q/r")));
    assert_int_equal(rl_file_write(in_folder("p/f"), "", 0, &err), RL_OK);
    assert_true(rl_path_exists(in_folder("p/f")) && !rl_path_is_folder(in_folder("p/f")));
    assert_int_equal(rl_folder_make(in_folder("p/f"), &err), RL_E_IO);
    assert_string_equal(err.text, "the folder cannot be made: a file has that name");
    err = (rl_error){0};
    assert_int_equal(rl_folder_make(in_folder("p/f/g"), &err), RL_E_IO);
}

/* ---- threads ---- */

static void add_square(void *ctx, int i)
{
    atomic_fetch_add((atomic_llong *)ctx, (long long)i * i);
}

typedef struct caller {
    rl_pool *pool;
    int n;
    bool good;
} caller;

static void *call_often(void *arg)
{
    caller *c = arg;
    c->good = true;
    for (int k = 0; k < 300; k++) {
        atomic_llong sum = 0;
        int n = (c->n + k) % 97;
        rl_pool_for(c->pool, n, add_square, &sum);
        c->good = c->good && sum == (long long)(n - 1) * n * (2 * n - 1) / 6;
    }
    return NULL;
}

static void test_pool(void **state)
{
    (void)state;
    size_t before = rl_alloc_live();
    for (int threads = 0; threads <= 5; threads++) {
        rl_pool *pool;
        assert_int_equal(rl_pool_new(threads, &pool, &err), RL_OK);
        assert_int_equal(rl_pool_threads(pool), threads ? threads : 1);
        enum { CALLERS = 4 };
        pthread_t ids[CALLERS];
        caller callers[CALLERS];
        for (int i = 0; i < CALLERS; i++) {
            callers[i] = (caller){.pool = pool, .n = 13 * i};
            assert_int_equal(pthread_create(&ids[i], NULL, call_often, &callers[i]), 0);
        }
        for (int i = 0; i < CALLERS; i++) {
            pthread_join(ids[i], NULL);
            assert_true(callers[i].good);
        }
        atomic_llong none = 0;
        rl_pool_for(pool, 0, add_square, &none);
        rl_pool_for(pool, -3, add_square, &none);
        assert_int_equal(none, 0);
        rl_pool_free(&pool);
        assert_null(pool);
    }
    rl_pool *pool = NULL;
    rl_pool_free(&pool);
    rl_alloc_fail_at(1, 0);
    assert_int_equal(rl_pool_new(4, &pool, &err), RL_E_MEMORY);
    assert_null(pool);
    assert_int_equal(rl_alloc_live(), before);
}

/* Counters and the failing allocation are shared by all threads: exactly one of many fails. */
static void allocate(void *ctx, int i)
{
    void *p = rl_malloc((size_t)(i % 500));
    atomic_fetch_add((atomic_llong *)ctx, p == NULL);
    rl_free(p);
}

static void test_alloc_from_threads(void **state)
{
    (void)state;
    rl_pool *pool;
    assert_int_equal(rl_pool_new(4, &pool, &err), RL_OK);
    size_t before = rl_alloc_live();
    atomic_llong failed = 0;
    rl_alloc_fail_at(5000, 0);
    rl_pool_for(pool, 20000, allocate, &failed);
    assert_int_equal(failed, 1);
    assert_int_equal(rl_alloc_live(), before);
    rl_pool_free(&pool);
}

int main(void)
{
#define T(f) cmocka_unit_test_setup_teardown(f, setup, switch_off)
#define F(f) cmocka_unit_test_setup_teardown(f, make_folder, drop_folder)
    const struct CMUnitTest tests[] = {
        T(test_alloc),
        T(test_alloc_fails_on_request),
        T(test_arena),
        T(test_str),
        T(test_numbers_ignore_the_locale),
        T(test_parse),
        T(test_format),
        T(test_bytes),
        T(test_nearest),
        T(test_errors),
        T(test_log),
        F(test_file_round_trip),
        T(test_file_read_pipe),
        F(test_file_errors),
        F(test_file_temp),
        F(test_paths),
        T(test_pool),
        T(test_alloc_from_threads),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
