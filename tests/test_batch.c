/* What a long run takes: memory as `relit plan` says, nothing that grows, and a device that fails once. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <dirent.h>
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "graph/base/alloc.h"
#include "graph/relit.h"
#include "graph/run/device.h"
#include "graph/tool/enlarge.h"
#include "tests/batch_help.h"

static int open_files(void)
{
    int n = 0;
    DIR *dir = opendir("/proc/self/fd");
    for (struct dirent *d = dir ? readdir(dir) : NULL; d; d = readdir(dir))
        n++;
    if (dir)
        closedir(dir);
    return n;
}

/* ---- memory ----------------------------------------------------------------------------------------------
 */

/* What the plan states, and what a run took, of one pipeline at one size. */
static void measure(const batch_place *place, const char *capture, const char *limit, double *stated,
                    double *took)
{
    tool_result r =
        tool_run((const char *const[]){"plan", "configs/skin.yaml", "--capture", capture, "--only", "beauty",
                                       "--json", "--memory-limit", limit, NULL});
    assert_int_equal(r.status, 0);
    json_t *root = json_loads(r.out, 0, NULL);
    *stated = json_number_value(json_object_get(json_object_get(root, "peak"), "total"));
    json_decref(root);
    tool_result_free(&r);
    rl_alloc_reset_peak();
    r = batch_run(place, "out", 0,
                  (const char *const[]){"--capture", capture, "--only", "beauty", "--quiet", "--memory-limit",
                                        limit, "--checkpoint-frames", "3", NULL});
    *took = (double)rl_alloc_peak();
    tool_result_free(&r);
}

static void test_memory(void **state)
{
    (void)state;
    batch_place place = batch_enter(6);
    rl_arena arena = {0};
    rl_error err = {0};
    rl_manifest *m = NULL;
    rl_pool *pool = NULL;
    const char *capture = NULL;
    double stated, took;
    char *big = path_in(place.folder, "big"), *pipe = place.pipe;
    assert_int_equal(mkdir(big, 0777), 0);
    assert_int_equal(rl_manifest_load(&arena, place.capture, NULL, NULL, &m, &err), RL_OK);
    assert_int_equal(rl_pool_new(2, &pool, &err), RL_OK);
    if (rl_enlarge_capture(&arena, m, big, 1920, 1080, 6, pool, &capture, &err))
        fail_msg("%s: %s", err.file, err.text);
    rl_pool_free(&pool);
    place.pipe = (char *)(uintptr_t) "configs/skin.yaml";
    measure(&place, capture, "64G", &stated, &took);
    print_message("stated %.1f MiB, took %.1f MiB\n", stated / 1048576, took / 1048576);
    assert_true(took > 0.9 * stated && took < 1.1 * stated);
    /* Under a limit fewer frames are in flight, and the limit holds. */
    char limit[32];
    snprintf(limit, sizeof limit, "%.0f", 0.8 * stated);
    measure(&place, capture, limit, &stated, &took);
    assert_true(took > 0.9 * stated && took < 1.1 * stated && took <= atof(limit));
    /* Not even one frame: said before anything is written. */
    tool_result r = BATCH(&place, "none", 2, "--capture", capture, "--memory-limit", "100M");
    assert_non_null(strstr(r.err, "one frame of 1920 x 1080 needs"));
    char *none = path_in(place.folder, "none");
    assert_int_equal(folder_files(none), 0);
    tool_result_free(&r);
    free(none);
    free(big);
    place.pipe = pipe;
    rl_arena_free(&arena);
    batch_leave(&place);
}

/* ---- soak ------------------------------------------------------------------------------------------------
 */

typedef struct soak {
    size_t frames, *live;
    int *files;
    size_t failed;
} soak;

static void on_frame(void *ctx, const rl_frame_result *f)
{
    soak *s = ctx;
    s->live[s->frames] = rl_alloc_live();
    s->files[s->frames++] = open_files();
    s->failed += f->error->code != RL_OK;
}

/* The least, not the mean: what the frames in flight happen to hold besides comes and goes with the threads;
 * a leak stays. */
static double least(const size_t *values, size_t from, size_t to)
{
    size_t m = values[from];
    for (size_t i = from; i < to; i++)
        m = values[i] < m ? values[i] : m;
    return (double)m;
}

static int most(const int *values, size_t from, size_t to)
{
    int m = 0;
    for (size_t i = from; i < to; i++)
        m = values[i] > m ? values[i] : m;
    return m;
}

/* captures/monkey_turn over and over: the last quarter takes what the second did, and no more files are open.
 * With $RELIT_SOAK_FRAMES (make soak) longer. */
static void test_soak(void **state)
{
    (void)state;
    const char *asked = getenv("RELIT_SOAK_FRAMES");
    size_t n = asked ? (size_t)atol(asked) : 120;
    batch_place place = batch_enter((int)n);
    char *out = path_in(place.folder, "out");
    const char *captures[] = {place.capture};
    rl_options options = {
        .pipeline = place.pipe, .captures = captures, .n_captures = 1, .out = out, .checkpoint_frames = 10};
    soak s = {.live = calloc(n, sizeof *s.live), .files = calloc(n, sizeof *s.files)};
    rl_run_hooks hooks = {.frame = on_frame, .ctx = &s};
    rl_session *session = NULL;
    rl_error err = {0};
    int before = open_files();
    size_t live = rl_alloc_live();
    assert_true(s.live && s.files);
    if (rl_session_open(&options, &session, &err) || rl_session_run(session, &hooks, NULL, &err))
        fail_msg("%s: %s", err.file, err.text);
    rl_session_close(&session);
    assert_int_equal(s.frames, n);
    assert_int_equal(s.failed, 0);
    double second = least(s.live, n / 4, n / 2), last = least(s.live, n - n / 4, n);
    print_message("%zu frames: %.2f MiB in the second quarter, %.2f MiB in the last\n", n, second / 1048576,
                  last / 1048576);
    assert_true(last <= 1.01 * second);
    assert_true(most(s.files, n - n / 4, n) <=
                most(s.files, n / 4, n / 2) + 1); /* a checkpoint may be open */
    assert_true(open_files() <= before + 1);      /* the device's driver keeps what it likes, once */
    assert_int_equal(rl_alloc_live(), live);
    free(s.live);
    free(s.files);
    free(out);
    batch_leave(&place);
}

/* ---- the device ------------------------------------------------------------------------------------------
 */

/* One OpenCL call fails while the fifth frame runs. */
static void fail_once(void *ctx, rl_lane lane, long long frame)
{
    const unsigned long *n = ctx;
    if (lane == RL_LANE_RUN && frame == 5)
        rl_device_fail_at(*n);
}

static rl_run_summary run_with_failure(const batch_place *place, const char *out, unsigned long n)
{
    const char *captures[] = {place->capture};
    rl_options options = {
        .pipeline = place->pipe, .captures = captures, .n_captures = 1, .out = out, .checkpoint_frames = 2};
    rl_run_hooks hooks = {.ctx = &n, .stage = fail_once};
    rl_run_summary summary;
    rl_session *session = NULL;
    rl_error err = {0};
    assert_int_equal(rl_session_open(&options, &session, &err), RL_OK);
    assert_int_equal(rl_session_run(session, &hooks, &summary, &err), RL_OK);
    rl_device_fail_at(0);
    rl_session_close(&session);
    return summary;
}

/* That frame is reported and the others are written; --resume then makes it and what its loss changed. Other
 * threads call the device too, and a call that gives a picture back may fail without harm, so several are
 * tried. */
static void test_device_fails(void **state)
{
    (void)state;
    int failed = 0;
    batch_place place = batch_enter(12);
    tool_result r = BATCH(&place, "plain", 0, "--quiet");
    tool_result_free(&r);
    for (unsigned long n = 1; n <= 25; n += 4) {
        char name[16];
        snprintf(name, sizeof name, "out%lu", n);
        char *out = path_in(place.folder, name);
        rl_run_summary summary = run_with_failure(&place, out, n);
        assert_int_equal(summary.frames, 12);
        assert_true(summary.failed <= 1);
        assert_int_equal(folder_files(out), 12 - (int)summary.failed);
        if (summary.failed) {
            assert_true(batch_notes(&place, name, ".checkpoint") > 0);
            failed++;
        }
        r = BATCH(&place, name, 0, "--resume", "--quiet");
        tool_result_free(&r);
        batch_assert_same(&place, "plain", name);
        free(out);
    }
    assert_true(failed >= 3);
    batch_leave(&place);
}

int main(int argc, char **argv)
{
    tool_child(argc, argv);
    const struct CMUnitTest all[] = {cmocka_unit_test(test_soak), cmocka_unit_test(test_device_fails),
                                     cmocka_unit_test(test_memory)};
    const struct CMUnitTest soak_only[] = {cmocka_unit_test(test_soak)};
    if (getenv("RELIT_SOAK_FRAMES"))
        return cmocka_run_group_tests_name("soak", soak_only, NULL, NULL);
    return cmocka_run_group_tests_name("batch", all, NULL, NULL);
}
