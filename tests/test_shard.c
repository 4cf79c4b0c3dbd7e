/* Shards: which frames each takes, that with exact hand-over they equal one run, what they say when they
 * cannot, and that warm-up errs by no more than `relit plan` states. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <jansson.h>
#include <limits.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "graph/run/exr.h"
#include "graph/run/schedule.h"
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

/* ---- numbers ---------------------------------------------------------------------------------------------
 */

static uint32_t next_random(uint32_t *state)
{
    return (*state = *state * 1664525u + 1013904223u) >> 16;
}

/* Over random captures: parts cover all frames once, in order; none is empty while there are captures enough,
 * and none then cuts a capture in two. */
static void test_parts(void **state)
{
    (void)state;
    uint32_t seed = 7;
    for (int trial = 0; trial < 2000; trial++) {
        size_t ends[8], captures = 1 + next_random(&seed) % 8, sum = 0, n = 1 + next_random(&seed) % 10,
                        at = 0;
        for (size_t k = 0; k < captures; k++)
            ends[k] = sum += 1 + next_random(&seed) % 50;
        assert_int_equal(rl_shard_begin(0, n, ends, captures), 0);
        for (size_t i = 1; i <= n; i++) {
            size_t next = rl_shard_begin(i, n, ends, captures);
            assert_true(next >= at && (next > at || sum < n || captures < n));
            bool boundary = false;
            for (size_t k = 0; k < captures; k++)
                boundary |= next == ends[k];
            assert_true(boundary || captures < 2 || n > captures);
            at = next;
        }
        assert_int_equal(at, sum);
    }
    const size_t one[] = {10};
    assert_int_equal(rl_shard_begin(1, 3, one, 1), 3);
    assert_int_equal(rl_shard_begin(2, 3, one, 1), 6);
}

/* Work done by hand from the schedule: what history a frame sees must be that of a run over everything. */
static void check_schedule(const rl_schedule *s, const rl_work *work, size_t n, bool lacking)
{
    for (size_t i = s->first, w = 0; i < s->last; i++) {
        bool runs = w < n && work[w].frame == i;
        assert_true(runs || !s->needed[i]);
        if (!runs)
            continue;
        assert_int_equal(work[w].write, s->needed[i]);
        bool before = w > 0 && work[w - 1].frame == i - 1;
        switch (work[w].start) {
        case RL_START_CUT:
            assert_true(s->cut[i]);
            break;
        case RL_START_CHECKPOINT:
            assert_true(!s->cut[i] && i > 0 && s->saved[i - 1]);
            break;
        case RL_START_ON:
            assert_true(!s->cut[i] && (before || (lacking && i == s->first)));
            break;
        }
        w++;
    }
}

static void test_schedule(void **state)
{
    (void)state;
    enum { MOST = 12 };
    uint32_t seed = 3;
    for (int trial = 0; trial < 20000; trial++) {
        bool cut[MOST], needed[MOST], saved[MOST], lacking;
        rl_work work[MOST];
        size_t first = next_random(&seed) % MOST, last = first + next_random(&seed) % (MOST - first + 1);
        for (size_t i = 0; i < MOST; i++) {
            cut[i] = i == 0 || next_random(&seed) % 5 == 0;
            needed[i] = i >= first && next_random(&seed) % 3 == 0;
            saved[i] = next_random(&seed) % 4 == 0;
        }
        rl_schedule s = {first, last, cut, needed, saved, next_random(&seed) % 2};
        size_t n = rl_schedule_make(&s, work, &lacking);
        assert_true(n <= last - first);
        check_schedule(&s, work, n, lacking);
        if (s.hand_over && last > first && !saved[last - 1])
            assert_true(n > 0 && work[n - 1].frame == last - 1);
    }
}

/* ---- runs ------------------------------------------------------------------------------------------------
 */

static void shard(const char *out, const char *which, const char *more)
{
    tool_result r = BATCH(&place, out, 0, "--quiet", "--shard", which, more);
    tool_result_free(&r);
}

static void test_equal_one_run(void **state)
{
    (void)state;
    shard("three", "1/3", NULL);
    assert_int_equal(batch_notes(&place, "three", ".checkpoint"), 1);
    shard("three", "2/3", NULL);
    shard("three", "3/3", NULL);
    batch_assert_same(&place, "plain", "three");
    /* A part that lost its task's pictures and its own checkpoint is made again, and hands over again. */
    char *picture = path_in(place.folder, "three/loop.0006.exr"),
         *checkpoint = path_in(place.folder, "three/.relit/loop.0009.checkpoint");
    assert_int_equal(remove(picture), 0);
    assert_int_equal(remove(checkpoint), 0);
    shard("three", "2/3", "--resume");
    assert_int_equal(batch_notes(&place, "three", "loop.0009.checkpoint"), 1);
    shard("three", "3/3", NULL);
    batch_assert_same(&place, "plain", "three");
    /* And the whole takes the parts' work for its own. */
    tool_result r = BATCH(&place, "three", 0, "--resume", "--json");
    assert_string_equal(r.out, "");
    tool_result_free(&r);
    free(picture);
    free(checkpoint);
}

static void test_lacking(void **state)
{
    (void)state;
    tool_result r = BATCH(&place, "early", 1, "--quiet", "--shard", "2/3");
    assert_non_null(strstr(r.err, "shard 2/3 needs the checkpoint after frame 4, which shard 1/3 writes"));
    tool_result_free(&r);
    char *out = path_in(place.folder, "early");
    assert_int_equal(folder_files(out), 0);
    shard("early", "1/3", NULL);
    /* A checkpoint of another pipeline does not help. */
    r = BATCH(&place, "early", 1, "--shard", "2/3", "--set", "graph.aa.blend=0.2");
    assert_non_null(strstr(r.err, "this checkpoint is not used: the pipeline, the kernels differ"));
    tool_result_free(&r);
    shard("early", "2/3", NULL);
    free(out);
}

/* A part whose history cannot be written has not done all of it: the next one would wait for ever. */
static void test_no_hand_over(void **state)
{
    (void)state;
    char *out = path_in(place.folder, "stuck"), *notes = path_in(out, ".relit"),
         *taken = path_in(notes, "loop.0004.checkpoint"), *inside = path_in(taken, "x");
    /* A folder has the checkpoint's name. */
    assert_int_equal(mkdir(out, 0777) | mkdir(notes, 0777) | mkdir(taken, 0777) | mkdir(inside, 0777), 0);
    for (int i = 0; i < 2; i++) {
        tool_result r = BATCH(&place, "stuck", 1, "--shard", "1/3", i ? "--resume" : "--quiet");
        assert_non_null(
            strstr(r.err, "loop.0004.checkpoint: error: the next shard cannot go on from here: "));
        assert_int_equal(folder_files(out), 4);
        tool_result_free(&r);
    }
    assert_int_equal(rmdir(inside) | rmdir(taken), 0);
    tool_result r = BATCH(&place, "stuck", 0, "--shard", "1/3", "--resume");
    assert_non_null(strstr(r.err, "4 frames are there already"));
    tool_result_free(&r);
    assert_int_equal(batch_notes(&place, "stuck", "loop.0004.checkpoint"), 1);
    shard("stuck", "2/3", NULL);
    shard("stuck", "3/3", NULL);
    batch_assert_same(&place, "plain", "stuck");
    free(inside);
    free(taken);
    free(notes);
    free(out);
}

/* Each part is killed or stopped at some moment, and started again, until all are through. */
static void test_killed(void **state)
{
    (void)state;
    static const char *const parts[] = {"1/3", "2/3", "3/3"};
    static const int signals[] = {SIGKILL, SIGTERM, SIGKILL, SIGINT};
    uint32_t random = 20261122;
    int kills = 0;
    struct timespec begin, end;
    clock_gettime(CLOCK_MONOTONIC, &begin);
    shard("timed", "1/3", NULL);
    clock_gettime(CLOCK_MONOTONIC, &end);
    /* ns; a process's start comes on top of a part */
    long whole = (end.tv_sec - begin.tv_sec) * 1000000000L + end.tv_nsec - begin.tv_nsec;
    for (int i = 0, tries = 0; i < 3; tries++) {
        pid_t pid = batch_start(&place, "killed",
                                (const char *const[]){"--quiet", "--resume", "--shard", parts[i],
                                                      "--checkpoint-frames", "1", NULL});
        random = random * 1664525u + 1013904223u;
        long pause = (long)((double)whole * (random >> 8) / (1 << 24) * (tries ? 1 : 0.3));
        if (tries < 6)
            nanosleep(&(struct timespec){pause / 1000000000L, pause % 1000000000L}, NULL);
        else
            tries = -1; /* whatever the machine's speed: let one go through */
        int status = 0, number = signals[random >> 16 & 3];
        if (tries >= 0)
            kill(pid, number);
        assert_int_equal(waitpid(pid, &status, 0), pid);
        bool through = WIFEXITED(status) && WEXITSTATUS(status) == 0;
        bool stopped = (WIFSIGNALED(status) && WTERMSIG(status) == number) ||
                       (WIFEXITED(status) && WEXITSTATUS(status) == 128 + number);
        assert_true(through || stopped);
        kills += stopped;
        i += through;
        tries = through ? -1 : tries;
    }
    assert_true(kills > 0);
    batch_assert_same(&place, "plain", "killed");
    assert_int_equal(batch_notes(&place, "killed", ".tmp"), 0);
    tool_result r = BATCH(&place, "killed", 0, "--resume", "--json"); /* nothing is left to be done */
    assert_string_equal(r.out, "");
    tool_result_free(&r);
}

/* Two captures and two parts: one each; no hand-over. Without history no part waits for another. */
static void test_several(void **state)
{
    (void)state;
    char monkey[PATH_MAX];
    assert_non_null(realpath("captures/monkey", monkey));
    tool_result r = BATCH(&place, "both", 0, "--quiet", "--capture", monkey, "--capture", place.capture);
    tool_result_free(&r);
    for (int i = 2; i > 0; i--) {
        r = BATCH(&place, "halves", 0, "--json", "--shard", i == 2 ? "2/2" : "1/2", "--capture", monkey,
                  "--capture", place.capture);
        assert_true(!strstr(r.out, "\"monkey\"") == (i == 2) && !strstr(r.out, "\"loop\"") == (i == 1));
        tool_result_free(&r);
    }
    batch_assert_same(&place, "both", "halves");
    for (int i = 3; i > 0; i--) {
        char which[16];
        snprintf(which, sizeof which, "%d/3", i);
        r = BATCH(&place, "flat", 0, "--quiet", "--shard", which, "--set", "outputs.beauty.image=join.color");
        tool_result_free(&r);
    }
    r = BATCH(&place, "flat one", 0, "--quiet", "--set", "outputs.beauty.image=join.color");
    tool_result_free(&r);
    batch_assert_same(&place, "flat one", "flat");
}

/* ---- warm-up ---------------------------------------------------------------------------------------------
 */

enum { WIDTH = 480, HEIGHT = 270, PIXELS = WIDTH * HEIGHT };

static float *load(const char *folder, const char *name)
{
    static const char *const letters[] = {"R", "G", "B"};
    char *base = path_in(place.folder, folder), *path = path_in(base, name);
    float *pixels = malloc(3 * PIXELS * sizeof *pixels);
    rl_exr_plane planes[3];
    rl_exr *file = NULL;
    rl_error err = {0};
    assert_non_null(pixels);
    for (int c = 0; c < 3; c++)
        planes[c] = (rl_exr_plane){.channel = letters[c], .floats = pixels + c * PIXELS, .stride = WIDTH};
    assert_int_equal(rl_exr_open(path, 0, &file, &err), RL_OK);
    assert_int_equal(rl_exr_read(file, 0, planes, 3, NULL, NULL, &err), RL_OK);
    rl_exr_close(&file);
    free(base);
    free(path);
    return pixels;
}

/* captures/monkey stands still, frames 1-8; the second of two parts is frames 5-8, its warm-up 3 and 4. */
static void test_warm_up(void **state)
{
    (void)state;
    char monkey[PATH_MAX];
    assert_non_null(realpath("captures/monkey", monkey));
#define STILL                                                                                                \
    "--quiet", "--capture", monkey, "--set", "graph.aa.clip_gamma=8", "--set", "graph.aa.blend=0.3",         \
        "--set", "outputs.beauty.type=float", "--dump", "join.color"
    tool_result r = BATCH(&place, "exact", 0, STILL);
    tool_result_free(&r);
    r = BATCH(&place, "warm", 0, STILL, "--shard", "2/2", "--preroll", "2");
    tool_result_free(&r);
    float *low = load("exact", "monkey.join.color.0001.exr"),
          *high = load("exact", "monkey.join.color.0001.exr");
    for (int i = 2; i <= 8; i++) {
        char name[64];
        snprintf(name, sizeof name, "monkey.join.color.%04d.exr", i);
        float *p = load("exact", name);
        for (int k = 0; k < 3 * PIXELS; k++) {
            low[k] = fminf(low[k], p[k]);
            high[k] = fmaxf(high[k], p[k]);
        }
        free(p);
    }
    /* A warmed-up shard that lost a picture gets the same one back. */
    r = BATCH(&place, "warm too", 0, STILL, "--shard", "2/2", "--preroll", "2");
    tool_result_free(&r);
    char *lost = path_in(place.folder, "warm too/monkey.0007.exr");
    assert_int_equal(remove(lost), 0);
    r = BATCH(&place, "warm too", 0, STILL, "--shard", "2/2", "--preroll", "2", "--resume");
    tool_result_free(&r);
    batch_assert_same(&place, "warm", "warm too");
    free(lost);
    for (int i = 5; i <= 8; i++) {
        char name[64];
        snprintf(name, sizeof name, "monkey.%04d.exr", i);
        float *a = load("exact", name), *b = load("warm", name);
        double share = pow(0.7, i - 2); /* (1 - w)^(K+1) in frame 5 */
        int beyond = 0, off = 0;
        for (int k = 0; k < 3 * PIXELS; k++) {
            double error = fabs((double)a[k] - (double)b[k]), range = (double)high[k] - (double)low[k];
            beyond += error > share * range + 1e-6;
            off += error > 0;
        }
        assert_true(off > 1000);                  /* there is something to be bounded */
        assert_true(beyond <= 3 * PIXELS / 1000); /* clipped all the same, or a firefly */
        free(a);
        free(b);
    }
    free(low);
    free(high);
}

/* relit plan says the same as happens. */
static void test_plan(void **state)
{
    (void)state;
    tool_result r = tool_run((const char *const[]){"plan", place.pipe, "--capture", place.capture, "--shard",
                                                   "2/3", "--json", NULL});
    assert_int_equal(r.status, 0);
    json_t *root = json_loads(r.out, 0, NULL), *part = json_object_get(root, "shard");
    assert_int_equal(json_integer_value(json_object_get(part, "first")), 5);
    assert_int_equal(json_integer_value(json_object_get(part, "last")), 9);
    assert_int_equal(json_integer_value(json_object_get(part, "needs_checkpoint_after")), 4);
    assert_true(json_is_true(json_object_get(part, "exact")));
    json_decref(root);
    tool_result_free(&r);
    r = tool_run((const char *const[]){"plan", place.pipe, "--capture", place.capture, "--shard", "3/3",
                                       "--preroll", "3", NULL});
    assert_int_equal(r.status, 0);
    assert_non_null(strstr(r.out, "shard 3/3 of 'loop': writes 5 of 14 frames, 10 to 14"));
    assert_non_null(strstr(r.out, "processes the 3 frames before them"));
    assert_non_null(strstr(r.out, "(1 - w)^(K+1) = 81.5 %")); /* 0.95^4 */
    assert_non_null(strstr(r.out, "K = 58 gives 5 %, K = 89 gives 1 %"));
    tool_result_free(&r);
    r = tool_run((const char *const[]){"plan", place.pipe, "--capture", place.capture, "--shard", "2/3",
                                       "--preroll", "9", NULL});
    assert_non_null(strstr(r.out, "exact: the pictures of one run")); /* back to the first frame */
    tool_result_free(&r);
}

int main(int argc, char **argv)
{
    tool_child(argc, argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_parts),         cmocka_unit_test(test_schedule),
        cmocka_unit_test(test_equal_one_run), cmocka_unit_test(test_lacking),
        cmocka_unit_test(test_no_hand_over),  cmocka_unit_test(test_killed),
        cmocka_unit_test(test_several),       cmocka_unit_test(test_warm_up),
        cmocka_unit_test(test_plan),
    };
    return cmocka_run_group_tests_name("shard", tests, setup, teardown);
}
