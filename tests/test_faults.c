/* Every allocation and every OpenCL call fails once, the disk fills up, files cannot be written or read: a
 * run never crashes, leaks nothing, says what went wrong, writes the other frames, and leaves only whole
 * files.
 *
 * By default a sample of the failures is tried; RELIT_FAULTS=all tries each (minutes). */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "graph/base/alloc.h"
#include "graph/run/device.h"
#include "graph/run/image_file.h"
#include "tests/count_cl.h"
#include "tests/small_capture.h"
#include "tests/tool_run.h"

enum { ALL_FILES = SMALL_FRAMES * SMALL_OUTPUTS };

static char *folder;

static char *fresh_out(void)
{
    static int serial;
    char name[32];
    snprintf(name, sizeof name, "out%d", serial++);
    return path_in(folder, name);
}

static void forget(char *out)
{
    chmod(out, 0777);
    folder_remove(out);
}

/* ---- the Nth call fails ----------------------------------------------------------------------------------
 */

static unsigned long arm_memory(unsigned long n)
{
    return rl_alloc_fail_at(n, 0);
}

static unsigned long arm_memory_for_good(unsigned long n)
{
    return rl_alloc_fail_at(n, 1);
}

/* A run whose n-th call fails. Whatever it was: whole files, and as many as the good frames have. */
static small_run run_armed(unsigned long (*arm)(unsigned long), unsigned long n)
{
    char *out = fresh_out();
    arm(n);
    small_run r = small_run_once(folder, out);
    arm(0);
    for (int k = 0; k < COUNT_CL_KINDS; k++)
        if (count_cl_live((count_cl_kind)k))
            fail_msg("call %lu: %ld %s are left", n, count_cl_live((count_cl_kind)k),
                     count_cl_name((count_cl_kind)k));
    int files = small_check_files(out);
    assert_true(files >= r.good * SMALL_OUTPUTS);
    forget(out);
    return r;
}

/* Failures 1 … total: all of the first few, then ever wider apart, so that about `most` are tried. */
static void try_all(unsigned long (*arm)(unsigned long), rl_code expected, int most, bool once)
{
    const char *how = getenv("RELIT_FAULTS");
    bool all = how && !strcmp(how, "all");
    const unsigned long never = 1ul << 40;
    char *out = fresh_out();
    arm(never);
    small_run r = small_run_once(folder, out);
    unsigned long total = never - arm(0);
    forget(out);
    assert_int_equal(r.code, RL_OK);
    assert_int_equal(r.good, SMALL_FRAMES);
    assert_true(total > 20);
    unsigned long step = all ? 1 : total / (unsigned long)most + 1, failed = 0, seen = 0;
    for (unsigned long n = 1; n <= total; n += n < 10 ? 1 : step) {
        r = run_armed(arm, n);
        failed += r.code || r.bad;
        seen += r.code == expected;
        for (int f = 1; f <= SMALL_FRAMES; f++)
            seen += r.frame_code[f] == expected;
        if (once && !r.code) { /* one call failed: one frame at the most, and the others are there */
            assert_int_equal(r.good + r.bad, SMALL_FRAMES);
            assert_true(r.bad <= 1);
        }
    }
    for (int k = 0; k < COUNT_CL_KINDS; k++)
        assert_true(count_cl_made((count_cl_kind)k) > 10);
    print_message("%lu calls, step %lu: %lu runs failed\n", total, step, failed);
    assert_true(failed > 5 && seen > 5); /* the injection works */
    r = run_armed(arm, 0);               /* and nothing stays broken */
    assert_int_equal(r.good, SMALL_FRAMES);
}

static void test_memory_fails_once(void **state)
{
    (void)state;
    try_all(arm_memory, RL_E_MEMORY, 60, true);
}

static void test_memory_fails_for_good(void **state)
{
    (void)state;
    try_all(arm_memory_for_good, RL_E_MEMORY, 40, false);
}

static void test_opencl_fails_once(void **state)
{
    (void)state;
    try_all(rl_device_fail_at, RL_E_DEVICE, 60, true);
}

/* ---- disks -----------------------------------------------------------------------------------------------
 */

/* No file can grow beyond `bytes`; 0 lifts the limit. A write beyond gives EFBIG. */
static void limit_files(rlim_t bytes)
{
    struct rlimit r;
    signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &r), 0);
    r.rlim_cur = bytes ? bytes : r.rlim_max;
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &r), 0);
}

/* Files stop at every size up to what the largest output has: the header, the table of chunks, pixels, the
 * last bytes. */
static void test_files_cannot_grow(void **state)
{
    (void)state;
    const rlim_t limits[] = {1, 100, 500, 1000, 2000, 4000, 8000, 12000, 16000};
    int failed = 0;
    for (size_t i = 0; i < sizeof limits / sizeof *limits; i++) {
        char *out = fresh_out();
        limit_files(limits[i]);
        small_run r = small_run_once(folder, out);
        limit_files(0);
        assert_int_equal(r.code, RL_OK);
        for (int f = 1; f <= SMALL_FRAMES; f++)
            assert_true(r.frame_code[f] == RL_OK || r.frame_code[f] == RL_E_IO);
        failed += r.bad;
        assert_true(limits[i] > 100 || r.bad == SMALL_FRAMES);
        assert_true(small_check_files(out) >= r.good * SMALL_OUTPUTS);
        forget(out);
    }
    assert_true(failed >= 2 * SMALL_FRAMES);
}

static void test_disk_is_full(void **state)
{
    (void)state;
    char *out = fresh_out();
    assert_int_equal(mkdir(out, 0777), 0);
    if (mount("none", out, "tmpfs", 0, "size=16k")) {
        print_message("not tried, no right to mount: %s\n", strerror(errno));
        forget(out);
        skip();
    }
    small_run r = small_run_once(folder, out);
    int files = small_check_files(out);
    umount(out);
    forget(out);
    assert_int_equal(r.code, RL_OK);
    assert_true(r.bad > 0 && r.good + r.bad == SMALL_FRAMES);
    for (int f = 1; f <= SMALL_FRAMES; f++)
        assert_true(r.frame_code[f] == RL_OK || r.frame_code[f] == RL_E_IO);
    assert_true(files >= r.good * SMALL_OUTPUTS && files < ALL_FILES);
}

/* root may write everywhere: there the folder's place is taken by a file instead. */
static void test_output_is_read_only(void **state)
{
    (void)state;
    char *out = fresh_out();
    assert_int_equal(mkdir(out, 0555), 0);
    if (geteuid() == 0) {
        assert_int_equal(rmdir(out), 0);
        file_write(folder, strrchr(out, '/') + 1, "x", 1);
    }
    small_run r = small_run_once(folder, out);
    assert_int_equal(r.good, 0);
    if (r.code)
        assert_int_equal(r.code, RL_E_IO);
    else
        assert_int_equal(r.frame_code[2], RL_E_IO);
    if (geteuid() == 0) {
        size_t size;
        char *text = file_read(out, &size);
        assert_string_equal(text, "x");
        free(text);
    }
    forget(out);
}

/* Where a file should go there is a folder: that frame fails, and the temporary file goes away. */
static void test_final_name_is_taken(void **state)
{
    (void)state;
    char *out = fresh_out(), *taken = path_in(out, "s.0002.exr"), *taken_too = path_in(out, "s.0003.png");
    assert_int_equal(mkdir(out, 0777) | mkdir(taken, 0777) | mkdir(taken_too, 0777), 0);
    small_run r = small_run_once(folder, out);
    assert_int_equal(r.code, RL_OK);
    assert_int_equal(r.frame_code[1], RL_OK);
    assert_int_equal(r.frame_code[2], RL_E_IO);
    assert_int_equal(r.frame_code[3], RL_E_IO);
    assert_true(small_check_files(out) >= SMALL_OUTPUTS);
    free(taken);
    free(taken_too);
    forget(out);
}

/* ---- captures --------------------------------------------------------------------------------------------
 */

/* The second frame is cut at every 16th of its length, or missing: the first and the third are written. */
static void test_one_bad_frame(void **state)
{
    (void)state;
    char *path = path_in(folder, "s.0002.exr");
    size_t size;
    char *whole = file_read(path, &size);
    for (size_t i = 0; i <= 16; i++) {
        char *out = fresh_out();
        file_write(folder, "s.0002.exr", whole, size * i / 16 - (i == 16));
        if (i == 0)
            unlink(path);
        small_run r = small_run_once(folder, out);
        assert_int_equal(r.code, RL_OK);
        assert_int_equal(r.frame_code[1], RL_OK);
        assert_int_equal(r.frame_code[3], RL_OK);
        assert_true(r.frame_code[2] == RL_E_FORMAT || r.frame_code[2] == RL_E_IO);
        assert_int_equal(small_check_files(out), 2 * SMALL_OUTPUTS);
        forget(out);
    }
    file_write(folder, "s.0002.exr", whole, size);
    free(whole);
    free(path);
}

/* ---- main ------------------------------------------------------------------------------------------------
 */

static int begin(void **state)
{
    (void)state;
    rl_error err = {0};
    folder = folder_new();
    char *cache = path_in(folder, "cache");
    setenv("RELIT_CACHE", cache, 1);
    free(cache);
    small_capture_write(folder);
    rl_image_file_load(&err); /* what it allocates stays */
    char *out = fresh_out();
    small_run_once(folder, out); /* fills the cache */
    int files = small_check_files(out);
    forget(out);
    return files != ALL_FILES;
}

static int end(void **state)
{
    (void)state;
    folder_remove(folder);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_memory_fails_once),   cmocka_unit_test(test_memory_fails_for_good),
        cmocka_unit_test(test_opencl_fails_once),   cmocka_unit_test(test_files_cannot_grow),
        cmocka_unit_test(test_disk_is_full),        cmocka_unit_test(test_output_is_read_only),
        cmocka_unit_test(test_final_name_is_taken), cmocka_unit_test(test_one_bad_frame),
    };
    return cmocka_run_group_tests(tests, begin, end);
}
