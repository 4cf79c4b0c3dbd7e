/* A disk that is full, or becomes read-only, in the middle of a run. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mount.h>
#include <sys/stat.h>

#include "tests/batch_help.h"

enum { FRAMES = 14 };

static batch_place place;

static int setup(void **state)
{
    (void)state;
    place = batch_enter_plain(FRAMES);
    return 0;
}

static int teardown(void **state)
{
    (void)state;
    batch_leave(&place);
    return 0;
}

/* The disk is full, or becomes read-only, and is mended: --resume makes what is missing, and nothing
 * temporary stays. */
static void test_disk(void **state)
{
    (void)state;
    char *disk = path_in(place.folder, "disk");
    struct stat st;
    char *one = path_in(place.folder, "plain/loop.0001.exr");
    assert_int_equal(stat(one, &st) | mkdir(disk, 0777), 0);
    free(one);
    static const double room[] = {0.05, 4.5, 11.5}; /* pictures */
    for (int i = 0; i < 3; i++) {
        char size[64];
        snprintf(size, sizeof size, "size=%ld", (long)(room[i] * (double)st.st_size));
        if (mount("none", disk, "tmpfs", 0, size)) {
            print_message("not tried, no right to mount: %s\n", strerror(errno));
            free(disk);
            skip();
        }
        tool_result r = BATCH(&place, "disk/out", 1, "--checkpoint-frames", "5");
        assert_non_null(strstr(r.err, "cannot be written: No space left on device"));
        tool_result_free(&r);
        assert_int_equal(mount("none", disk, "tmpfs", MS_REMOUNT | MS_RDONLY, "size=1g"), 0);
        r = BATCH(&place, "disk/out", 2, "--resume"); /* before anything is written */
        assert_non_null(strstr(r.err, "Read-only file system"));
        tool_result_free(&r);
        assert_int_equal(mount("none", disk, "tmpfs", MS_REMOUNT, "size=1g"), 0);
        r = BATCH(&place, "disk/out", 0, "--resume");
        tool_result_free(&r);
        batch_assert_same(&place, "plain", "disk/out");
        assert_int_equal(batch_notes(&place, "disk/out", ".tmp"), 0);
        assert_int_equal(umount(disk), 0);
    }
    free(disk);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_disk)};
    tool_child(argc, argv);
    return cmocka_run_group_tests_name("disk", tests, setup, teardown);
}
