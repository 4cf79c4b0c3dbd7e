/* A run that is stopped at any moment leaves only whole files: by SIGTERM or SIGINT it finishes what is in
 * flight, cleans up and ends by that signal, soon; by SIGKILL it cannot clean up, but what has a final name
 * is whole. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
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

static char *folder;

static double now_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void wait_s(double seconds)
{
    struct timespec t = {(time_t)seconds, (long)((seconds - (double)(time_t)seconds) * 1e9)};
    nanosleep(&t, NULL);
}

static pid_t start(const char *out)
{
    char *pipe = path_in(folder, "pipe.yaml");
    fflush(NULL);
    pid_t pid = fork();
    assert_true(pid >= 0);
    if (!pid) {
        int nowhere = open("/dev/null", O_WRONLY);
        dup2(nowhere, 1);
        dup2(nowhere, 2);
        execl(tool_program(), "relit", "run", pipe, "--out", out, (char *)NULL);
        _exit(127);
    }
    free(pipe);
    return pid;
}

/* The process's status; 15 s are a hang. */
static int wait_for_end(pid_t pid)
{
    int status = 0;
    double end = now_s() + 15;
    while (!waitpid(pid, &status, WNOHANG)) {
        if (now_s() > end) {
            kill(pid, SIGKILL);
            waitpid(pid, &status, 0);
            fail_msg("it hangs");
        }
        wait_s(0.005);
    }
    return status;
}

/* Files with their final names; neither temporaries nor the run's own in .relit count. */
static int outputs(const char *out)
{
    int n = 0;
    DIR *d = opendir(out);
    for (struct dirent *e = d ? readdir(d) : NULL; e; e = readdir(d)) {
        const char *dot = strrchr(e->d_name, '.');
        char *path = path_in(out, e->d_name);
        if (e->d_name[0] != '.' && e->d_type == DT_DIR)
            n += outputs(path);
        n += dot && (!strcmp(dot, ".exr") || !strcmp(dot, ".png"));
        free(path);
    }
    if (d)
        closedir(d);
    return n;
}

static void wait_for_files(const char *out, int n, double most_s)
{
    for (double end = now_s() + most_s; outputs(out) < n && now_s() < end;)
        wait_s(0.002);
    assert_true(outputs(out) >= n);
}

/* Before the signals are caught, while kernels are made, at the first file, and in full course. */
static void stop_with(int number)
{
    const double delays[] = {0,  0.02, 0.05, 0.1,
                             -1, -7,   -20}; /* seconds after the start; < 0: after so many files */
    for (size_t i = 0; i < sizeof delays / sizeof *delays; i++) {
        char *out = path_in(folder, "out");
        pid_t pid = start(out);
        if (delays[i] >= 0)
            wait_s(delays[i]);
        else
            wait_for_files(out, (int)-delays[i], 60);
        kill(pid, number);
        int status = wait_for_end(pid);
        assert_true(WIFSIGNALED(status) && WTERMSIG(status) == number);
        int files = small_check_files(out);
        assert_true(files >= (delays[i] < 0 ? (int)-delays[i] : 0));
        assert_int_equal(files % SMALL_OUTPUTS, 0); /* all of a frame or nothing */
        folder_remove(out);
    }
}

static void test_sigterm(void **state)
{
    (void)state;
    stop_with(SIGTERM);
}

static void test_sigint(void **state)
{
    (void)state;
    stop_with(SIGINT);
}

/* What is not finished has a name that says so. */
static void remove_temporaries(const char *out)
{
    DIR *d = opendir(out);
    for (struct dirent *e = d ? readdir(d) : NULL; e; e = readdir(d)) {
        const char *dot = strrchr(e->d_name, '.');
        char *path = path_in(out, e->d_name);
        if (e->d_name[0] != '.' && e->d_type == DT_DIR)
            remove_temporaries(path);
        else if (dot && !strcmp(dot, ".tmp"))
            unlink(path);
        free(path);
    }
    if (d)
        closedir(d);
}

static void test_sigkill(void **state)
{
    (void)state;
    for (int i = 0; i < 12; i++) {
        char *out = path_in(folder, "out");
        pid_t pid = start(out);
        wait_for_files(out, 1 + 2 * i, 60);
        wait_s(0.0013 * i);
        kill(pid, SIGKILL);
        wait_for_end(pid);
        remove_temporaries(out);
        small_check_files(out);
        folder_remove(out);
    }
}

/* Every frame is the same file. */
static int begin(void **state)
{
    (void)state;
    folder = folder_new();
    small_capture_write(folder);
    char *one = text_replace(small_manifest, "s.####.exr", "s.0001.exr"),
         *many = text_replace(one, "frames: 1-3", "frames: 1-20000");
    file_write(folder, "capture.yaml", many, strlen(many));
    char *cache = path_in(folder, "cache");
    setenv("RELIT_CACHE", cache, 1);
    free(cache);
    free(one);
    free(many);
    return access(tool_program(), X_OK);
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
        cmocka_unit_test(test_sigterm),
        cmocka_unit_test(test_sigint),
        cmocka_unit_test(test_sigkill),
    };
    return cmocka_run_group_tests(tests, begin, end);
}
