/* A frame whose files are there and broken: --resume says so again and makes no other frame; when its files
 * are repaired, it makes what depends on them. Pictures are those of one run, byte for byte. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "graph/relit.h"
#include "graph/run/exr.h"
#include "tests/batch_help.h"

enum { FRAMES = 16, BROKEN = 8 }; /* the last frame of the first of two shards */

static batch_place place;

static char *frame_file(void)
{
    return path_in(place.capture, "loop.0008.exr");
}

static void repair(void)
{
    char target[4096], *path = frame_file();
    unlink(path);
    assert_non_null(realpath("captures/monkey_turn/monkey_turn.0008.exr", target));
    assert_int_equal(symlink(target, path), 0);
    free(path);
}

static void break_it(void)
{
    size_t size;
    char *path = frame_file(), *data = file_read("captures/monkey_turn/monkey_turn.0008.exr", &size);
    assert_int_equal(unlink(path), 0);
    file_write(place.capture, "loop.0008.exr", data, size / 2);
    free(data);
    free(path);
}

static void run(const char *out, int status, const char *a, const char *b, const char *c)
{
    tool_result r = BATCH(&place, out, status, "--quiet", a, b, c);
    tool_result_free(&r);
}

static int setup(void **state)
{
    (void)state;
    place = batch_enter(FRAMES);
    run("plain", 0, NULL, NULL, NULL);
    break_it();
    run("error", 1, NULL, NULL, NULL);
    run("hold", 0, "--on-missing", "hold", NULL);
    run("skip", 0, "--on-missing", "skip", NULL);
    repair();
    return 0;
}

static int teardown(void **state)
{
    (void)state;
    batch_leave(&place);
    return 0;
}

static void drop(const char *out, int frame)
{
    char name[64], *folder = path_in(place.folder, out);
    snprintf(name, sizeof name, "loop.%04d.exr", frame);
    char *path = path_in(folder, name);
    assert_int_equal(unlink(path), 0);
    free(path);
    free(folder);
}

static int count(const char *text, const char *part)
{
    int n = 0;
    for (const char *at = strstr(text, part); at; at = strstr(at + 1, part))
        n++;
    return n;
}

/* Resumes; `frames` are those that it reports, in order ("8 9 "). */
static void resume(const char *out, int status, const char *policy, const char *shard, const char *frames)
{
    tool_result r =
        shard ? BATCH(&place, out, status, "--resume", "--json", "--on-missing", policy, "--shard", shard)
              : BATCH(&place, out, status, "--resume", "--json", "--on-missing", policy);
    char made[256] = "";
    for (const char *at = r.out; (at = strstr(at, "\"frame\"")); at++)
        snprintf(made + strlen(made), sizeof made - strlen(made), "%d ", atoi(strpbrk(at, "0123456789")));
    if (strcmp(made, frames))
        fail_msg("%s %s: frames %s instead of %s\n%s", policy, shard ? shard : "", made, frames, r.err);
    if (status)
        assert_non_null(strstr(r.err, "loop.0008.exr: error: "));
    if (!strcmp(frames, "8 ") && !strcmp(policy, "skip") && !shard)
        assert_non_null(strstr(r.err, "frame 8 is skipped"));
    if (count(frames, " ") == 1 && !shard)
        assert_null(strstr(r.err, "for their history only"));
    tool_result_free(&r);
}

static const struct {
    const char *policy;
    int status;
    const char *again; /* what each resume reports */
} policies[] = {{"error", 1, "8 "}, {"skip", 0, "8 "}, {"hold", 0, ""}};

/* Nothing has changed, nothing is made; a picture that is gone comes back, alone; so does what is repaired.
 */
static void test_policies(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof policies / sizeof *policies; i++) {
        const char *policy = policies[i].policy, *whole = policy;
        char out[32];
        snprintf(out, sizeof out, "%s too", policy);
        break_it();
        run(out, policies[i].status, "--on-missing", policy, NULL);
        batch_assert_same(&place, whole, out);
        for (int k = 0; k < 2; k++)
            resume(out, policies[i].status, policy, NULL, policies[i].again);
        batch_assert_same(&place, whole, out);
        drop(out, BROKEN + 1); /* no history reaches it */
        resume(out, policies[i].status, policy, NULL, *policies[i].again ? "8 9 " : "9 ");
        batch_assert_same(&place, whole, out);
        if (!*policies[i].again) {
            drop(out, BROKEN);
            resume(out, 0, policy, NULL, "8 ");
            batch_assert_same(&place, whole, out);
        }
        repair();
        resume(out, 0, policy, NULL, "8 9 10 11 12 13 14 15 16 ");
        batch_assert_same(&place, "plain", out);
        resume(out, 0, policy, NULL, "");
    }
}

/* The second shard begins behind the broken frame. */
static void test_shards(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof policies / sizeof *policies; i++) {
        const char *policy = policies[i].policy;
        char out[32];
        snprintf(out, sizeof out, "%s parts", policy);
        break_it();
        tool_result r = BATCH(&place, out, policies[i].status, "--on-missing", policy, "--shard", "1/2");
        tool_result_free(&r);
        r = BATCH(&place, out, 0, "--on-missing", policy, "--shard", "2/2");
        tool_result_free(&r);
        batch_assert_same(&place, policy, out);
        for (int k = 0; k < 2; k++) {
            resume(out, policies[i].status, policy, "1/2", policies[i].again);
            resume(out, 0, policy, "2/2", "");
        }
        batch_assert_same(&place, policy, out);
        repair();
        resume(out, 0, policy, "1/2", "8 ");
        resume(out, 0, policy, "2/2", "9 10 11 12 13 14 15 16 ");
        batch_assert_same(&place, "plain", out);
        resume(out, 0, policy, "1/2", "");
        resume(out, 0, policy, "2/2", "");
    }
}

static void repair_after_first(void *ctx, const rl_frame_result *result)
{
    char *text = ctx;
    if (result->frame == 1)
        repair();
    if (result->error->code)
        strcpy(text, result->error->text);
}

/* Files that are repaired while a run is under way, which has planned without them: no picture without the
 * history that it should have; the next --resume makes all. */
static void test_repaired_meanwhile(void **state)
{
    (void)state;
    char *out = path_in(place.folder, "meanwhile"), text[1600] = "";
    const char *capture = place.capture;
    break_it();
    run("meanwhile", 1, NULL, NULL, NULL);
    for (int i = 1; i < 7; i++) /* frame 8 is read when the first of them are written */
        drop("meanwhile", i);
    const rl_options options = {
        .pipeline = place.pipe, .captures = &capture, .n_captures = 1, .out = out, .resume = true};
    const rl_run_hooks hooks = {.frame = repair_after_first, .ctx = text};
    rl_run_summary summary;
    rl_session *s = NULL;
    rl_error err = {0};
    if (rl_session_open(&options, &s, &err) || rl_session_run(s, &hooks, &summary, &err))
        fail_msg("%s: %s", err.file, err.text);
    rl_session_close(&s);
    assert_int_equal(summary.failed, 1);
    assert_non_null(strstr(text, "--resume makes it"));
    resume("meanwhile", 0, "error", NULL, "8 9 10 11 12 13 14 15 16 ");
    batch_assert_same(&place, "plain", "meanwhile");
    free(out);
}

/* Frame 8 with nine times the pixels, all of them empty. */
static void enlarge(void)
{
    enum { WIDTH = 1440, HEIGHT = 810 };
    static const char *const all[] = {"*"};
    char *path = frame_file();
    rl_exr *from = NULL;
    assert_int_equal(rl_exr_open("captures/monkey_turn/monkey_turn.0008.exr", 0, &from, NULL), RL_OK);
    const rl_exr_part *part = rl_exr_part_at(from, 0);
    float *zero = calloc((size_t)WIDTH * HEIGHT, sizeof *zero);
    rl_exr_source *channels = calloc(part->n_channels, sizeof *channels);
    for (size_t i = 0; i < part->n_channels; i++)
        channels[i] = (rl_exr_source){.name = part->channels[i].name,
                                      .type = part->channels[i].type,
                                      .floats = zero,
                                      .ids = (const uint32_t *)(const void *)zero,
                                      .stride = WIDTH};
    const rl_exr_image image = {.data_window = {0, 0, WIDTH - 1, HEIGHT - 1},
                                .display_window = {0, 0, WIDTH - 1, HEIGHT - 1},
                                .channels = channels,
                                .n_channels = part->n_channels,
                                .compression = RL_EXR_ZIP,
                                .copy_from = from,
                                .copy = all,
                                .n_copy = 1};
    assert_int_equal(unlink(path), 0);
    assert_int_equal(rl_exr_write(path, &image, NULL, NULL, NULL), RL_OK);
    rl_exr_close(&from);
    free(channels);
    free(zero);
    free(path);
}

/* Files that could not be read for another reason than their bytes are tried again. */
static void test_other_reasons(void **state)
{
    (void)state;
    enlarge();
    run("large", 0, NULL, NULL, NULL);
    run("large too", 1, "--memory-limit", "60M", NULL);
    run("large too", 1, "--memory-limit", "60M", "--resume");
    assert_int_equal(batch_differences(&place, "large", "large too"), 1); /* another size ends history, too */
    resume("large too", 0, "error", NULL, "8 9 10 11 12 13 14 15 16 ");
    batch_assert_same(&place, "large", "large too");
    repair();
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_policies), cmocka_unit_test(test_shards),
                                       cmocka_unit_test(test_repaired_meanwhile),
                                       cmocka_unit_test(test_other_reasons)};
    tool_child(argc, argv);
    return cmocka_run_group_tests(tests, setup, teardown);
}
