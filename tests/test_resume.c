/* A run that was killed, stopped or robbed of files goes on with --resume, and the result is that of a run
 * that nothing happened to, byte for byte. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "tests/batch_help.h"

enum { FRAMES = 30, KILLS = 25 };

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

static char *file_of(const char *out, const char *name)
{
    char *folder = path_in(place.folder, out), *path = path_in(folder, name);
    free(folder);
    return path;
}

static void drop(const char *out, const char *name)
{
    char *path = file_of(out, name);
    assert_int_equal(unlink(path), 0);
    free(path);
}

static double now_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static uint32_t next_random(uint32_t *state)
{
    return *state = *state * 1664525u + 1013904223u;
}

/* ---- kill -9 ---------------------------------------------------------------------------------------------
 */

/* Starts a run and kills it after `seconds`; true when it had ended by itself before, well. */
static bool run_and_kill(const char *out, double seconds)
{
    pid_t pid = batch_start(&place, out,
                            (const char *const[]){"--resume", "--quiet", "--checkpoint-frames", "3", NULL});
    struct timespec pause = {(time_t)seconds, (long)((seconds - (double)(time_t)seconds) * 1e9)};
    nanosleep(&pause, NULL);
    kill(pid, SIGKILL);
    int status;
    assert_int_equal(waitpid(pid, &status, 0), pid);
    if (WIFEXITED(status))
        assert_int_equal(WEXITSTATUS(status), 0);
    return WIFEXITED(status);
}

/* The pictures of another pipeline are there first, so that what is there is never enough to be right. */
static void fill_with_others(const char *out)
{
    tool_result r = BATCH(&place, out, 0, "--quiet", "--set", "graph.aa.blend=0.5");
    tool_result_free(&r);
    assert_int_equal(batch_differences(&place, "plain", out), FRAMES);
}

static void test_kill(void **state)
{
    (void)state;
    uint32_t seed = 20261122;
    double begin = now_s();
    tool_result r = BATCH(&place, "timed", 0, "--quiet");
    tool_result_free(&r);
    double whole = 1.2 * (now_s() - begin) + 0.05; /* a process's start comes on top */
    int kills = 0, rounds = 0;
    while (kills < KILLS) {
        char out[32];
        snprintf(out, sizeof out, "killed%d", rounds++);
        if (rounds % 2)
            fill_with_others(out);
        bool done = false;
        for (int tries = 0; !done && tries < 6; tries++) {
            done = run_and_kill(out, whole * (next_random(&seed) >> 8) / 16777216.0);
            kills += !done;
        }
        r = BATCH(&place, out, 0, "--resume", "--quiet");
        tool_result_free(&r);
        batch_assert_same(&place, "plain", out);
        assert_int_equal(batch_notes(&place, out, ".tmp"), 0);
        assert_int_equal(batch_notes(&place, out, ".checkpoint"), 0); /* nobody goes on from there any more */
    }
}

/* ---- signals ---------------------------------------------------------------------------------------------
 */

static void test_stop(void **state)
{
    (void)state;
    int stopped = 0;
    for (int i = 0; i < 6 && !stopped; i++) {
        char out[32];
        snprintf(out, sizeof out, "stopped%d", i);
        char *first = file_of(out, "loop.0004.exr");
        pid_t pid = batch_start(&place, out, (const char *const[]){"--quiet", NULL});
        for (int k = 0; k < 5000 && access(first, F_OK); k++)
            nanosleep(&(struct timespec){0, 1000000}, NULL);
        kill(pid, i % 2 ? SIGINT : SIGTERM);
        int status;
        assert_int_equal(waitpid(pid, &status, 0), pid);
        if (WIFEXITED(status) && WEXITSTATUS(status) == 128 + (i % 2 ? SIGINT : SIGTERM)) {
            stopped = 1;
            size_t size;
            char *log = path_in(place.folder, "log"), *text = file_read(log, &size);
            assert_non_null(strstr(text, "--resume goes on"));
            assert_int_equal(batch_notes(&place, out, ".checkpoint"), 1);
            tool_result r = BATCH(&place, out, 0, "--resume");
            assert_non_null(strstr(r.err, "going on from the checkpoint"));
            assert_null(
                strstr(r.err, "for their history only")); /* it is of the last frame that was written */
            tool_result_free(&r);
            batch_assert_same(&place, "plain", out);
            free(log);
            free(text);
        }
        free(first);
    }
    assert_true(stopped);
}

/* ---- what is there, what is missing ----------------------------------------------------------------------
 */

static void copy_of_plain(const char *out)
{
    tool_result r = BATCH(&place, out, 0, "--quiet");
    tool_result_free(&r);
}

static int count(const char *text, const char *part)
{
    int n = 0;
    for (const char *at = strstr(text, part); at; at = strstr(at + 1, part))
        n++;
    return n;
}

/* Two pictures are gone: they are made again, with the history that they had, and no other is touched. */
static void test_missing(void **state)
{
    (void)state;
    struct stat before, after;
    copy_of_plain("holes");
    drop("holes", "loop.0007.exr");
    drop("holes", "loop.0019.exr");
    char *other = file_of("holes", "loop.0008.exr");
    assert_int_equal(stat(other, &before), 0);
    tool_result r = BATCH(&place, "holes", 0, "--resume", "--json");
    assert_int_equal(count(r.out, "\"frame\""), 2);
    assert_non_null(strstr(r.err, "28 frames are there already"));
    assert_int_equal(stat(other, &after), 0);
    assert_int_equal(before.st_ino, after.st_ino);
    batch_assert_same(&place, "plain", "holes");
    tool_result_free(&r);
    r = BATCH(&place, "holes", 0, "--resume", "--json"); /* nothing is left to be done */
    assert_string_equal(r.out, "");
    tool_result_free(&r);
    free(other);
}

/* Without history there is nothing to be warmed up. */
static void test_no_history(void **state)
{
    (void)state;
    const char *set = "outputs.beauty.image=join.color";
    tool_result r = BATCH(&place, "flat", 0, "--quiet", "--set", set);
    tool_result_free(&r);
    assert_int_equal(batch_notes(&place, "flat", ".checkpoint"), 0);
    drop("flat", "loop.0007.exr");
    r = BATCH(&place, "flat", 0, "--resume", "--json", "--set", set);
    assert_int_equal(count(r.out, "\"frame\""), 1);
    assert_null(strstr(r.err, "for their history only"));
    tool_result_free(&r);
    assert_int_equal(batch_differences(&place, "plain", "flat"),
                     FRAMES); /* another picture, but all of them */
}

/* Another pipeline's pictures, or of other inputs, do not count; a touched file is still the same. */
static void test_identity(void **state)
{
    (void)state;
    copy_of_plain("other");
    tool_result r = BATCH(&place, "other", 0, "--resume", "--json", "--set", "graph.aa.blend=0.5");
    assert_int_equal(count(r.out, "\"frame\""), FRAMES);
    assert_non_null(strstr(r.err, "30 frames are there, but made by another pipeline"));
    tool_result_free(&r);
    r = BATCH(&place, "other", 0, "--resume", "--json"); /* and back */
    assert_int_equal(count(r.out, "\"frame\""), FRAMES);
    tool_result_free(&r);
    batch_assert_same(&place, "plain", "other");

    /* Frame 9 becomes a file of its own with the same bytes, then one with other bytes. */
    size_t size;
    char *path = path_in(place.capture, "loop.0009.exr"), *data = file_read(path, &size);
    assert_int_equal(unlink(path), 0);
    file_write(place.capture, "loop.0009.exr", data, size);
    r = BATCH(&place, "other", 0, "--resume", "--json");
    assert_string_equal(r.out, "");
    tool_result_free(&r);
    free(data);
    data = file_read("captures/monkey_turn/monkey_turn.0010.exr", &size);
    file_write(place.capture, "loop.0009.exr", data, size);
    r = BATCH(&place, "other", 0, "--resume", "--json");
    assert_int_equal(count(r.out, "\"frame\""), FRAMES - 8); /* from there on history is another */
    tool_result_free(&r);
    r = BATCH(&place, "changed", 0, "--quiet");
    tool_result_free(&r);
    batch_assert_same(&place, "changed", "other");
    assert_int_equal(unlink(path), 0);
    char target[4096];
    assert_non_null(realpath("captures/monkey_turn/monkey_turn.0009.exr", target));
    assert_int_equal(symlink(target, path), 0);
    free(path);
    free(data);
}

/* Frames that are held (one missing, one broken) end history in a resumed run as they do in one run, and are
 * held from the same frame; a skipped one is not missed. */
static void test_held(void **state)
{
    (void)state;
    size_t size;
    char *data = file_read("captures/monkey_turn/monkey_turn.0011.exr", &size);
    char *sixth = path_in(place.capture, "loop.0006.exr"),
         *eleventh = path_in(place.capture, "loop.0011.exr");
    assert_int_equal(unlink(sixth) | unlink(eleventh), 0);
    file_write(place.capture, "loop.0011.exr", data, size / 2);
    const char *gone[] = {"loop.0006.exr", "loop.0007.exr", "loop.0011.exr", "loop.0014.exr"};
    tool_result r = BATCH(&place, "held", 0, "--quiet", "--on-missing", "hold", "--frames", "1-16");
    tool_result_free(&r);
    r = BATCH(&place, "held too", 0, "--quiet", "--on-missing", "hold", "--frames", "1-16");
    tool_result_free(&r);
    for (int i = 0; i < 4; i++)
        drop("held too", gone[i]);
    r = BATCH(&place, "held too", 0, "--resume", "--on-missing", "hold", "--frames", "1-16");
    assert_non_null(strstr(r.err, "frame 6 holds the layers of frame 5"));
    assert_non_null(strstr(r.err, "frame 11 holds the layers of frame 10"));
    tool_result_free(&r);
    batch_assert_same(&place, "held", "held too");
    /* Exact shards, of which the second begins behind a frame that is held. */
    for (int i = 1; i <= 3; i++) {
        char which[8];
        snprintf(which, sizeof which, "%d/3", i); /* 1-6, 7-11, 12-17 */
        r = BATCH(&place, "held parts", 0, "--quiet", "--on-missing", "hold", "--frames", "1-17", "--shard",
                  which);
        tool_result_free(&r);
    }
    r = BATCH(&place, "held all", 0, "--quiet", "--on-missing", "hold", "--frames", "1-17");
    tool_result_free(&r);
    batch_assert_same(&place, "held all", "held parts");
    r = BATCH(&place, "skipped", 0, "--quiet", "--on-missing", "skip", "--frames", "1-8");
    tool_result_free(&r);
    r = BATCH(&place, "skipped", 0, "--resume", "--json", "--on-missing", "skip", "--frames", "1-8");
    assert_string_equal(r.out, "");
    tool_result_free(&r);
    char target[4096];
    assert_non_null(realpath("captures/monkey_turn/monkey_turn.0006.exr", target));
    assert_int_equal(symlink(target, sixth), 0);
    assert_non_null(realpath("captures/monkey_turn/monkey_turn.0011.exr", target));
    assert_int_equal(unlink(eleventh) | symlink(target, eleventh), 0);
    free(data);
    free(sixth);
    free(eleventh);
}

/* ---- checkpoints -----------------------------------------------------------------------------------------
 */

/* A run of the first frames that leaves its checkpoint: the first of two shards. */
static char *leave_checkpoint(const char *out)
{
    tool_result r = BATCH(&place, out, 0, "--quiet", "--shard", "1/2");
    tool_result_free(&r);
    char *path = file_of(out, ".relit/loop.0015.checkpoint");
    assert_int_equal(access(path, F_OK), 0);
    return path;
}

static void spoil(const char *path, long at)
{
    FILE *f = fopen(path, "r+b");
    assert_non_null(f);
    assert_int_equal(fseek(f, at, at < 0 ? SEEK_END : SEEK_SET), 0);
    int c = fgetc(f);
    assert_int_equal(fseek(f, at, at < 0 ? SEEK_END : SEEK_SET), 0);
    fputc(c ^ 1, f);
    fclose(f);
}

/* One bit in the header, in the history, or a byte less: seen, said, not used, and the pictures are right. */
static void test_damaged(void **state)
{
    (void)state;
    const long where[] = {3, 100, -5000, 0};
    for (int i = 0; i < 4; i++) {
        char out[32];
        snprintf(out, sizeof out, "damaged%d", i);
        char *path = leave_checkpoint(out);
        struct stat st;
        assert_int_equal(stat(path, &st), 0);
        if (where[i])
            spoil(path, where[i]);
        else
            assert_int_equal(truncate(path, st.st_size - 1), 0);
        tool_result r = BATCH(&place, out, 0, "--resume");
        assert_non_null(strstr(r.err, "it is not used"));
        assert_non_null(strstr(r.err, "15 frames are processed for their history only"));
        tool_result_free(&r);
        batch_assert_same(&place, "plain", out);
        free(path);
    }
}

/* A checkpoint of another pipeline says what differs. */
static void test_refused(void **state)
{
    (void)state;
    char *path = leave_checkpoint("refused");
    tool_result r = BATCH(&place, "refused", 0, "--resume", "--set", "graph.aa.blend=0.2");
    assert_non_null(strstr(r.err, "this checkpoint is not used: the pipeline, the kernels differ"));
    tool_result_free(&r);
    free(path);
    path = leave_checkpoint("accepted");
    r = BATCH(&place, "accepted", 0, "--resume");
    assert_non_null(strstr(r.err, "going on from the checkpoint after frame 15"));
    tool_result_free(&r);
    batch_assert_same(&place, "plain", "accepted");
    free(path);
}

int main(int argc, char **argv)
{
    tool_child(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_kill),       cmocka_unit_test(test_stop),     cmocka_unit_test(test_missing),
        cmocka_unit_test(test_no_history), cmocka_unit_test(test_identity), cmocka_unit_test(test_damaged),
        cmocka_unit_test(test_refused),    cmocka_unit_test(test_held),
    };
    return cmocka_run_group_tests_name("resume", tests, setup, teardown);
}
