/* --trace: a file that trace viewers open, with every stage of every frame where it belongs. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "tests/batch_help.h"

enum { FRAMES = 6 };

static batch_place place;

static int setup(void **state)
{
    (void)state;
    place = batch_enter(FRAMES);
    return 0;
}

static int teardown(void **state)
{
    (void)state;
    batch_leave(&place);
    return 0;
}

typedef struct event {
    const char *category, *name;
    double begin, end; /* microseconds */
    int lane, frame;
} event;

static const char *capture = "loop";
static bool lanes[8]; /* those that have been given a name */

static bool read_event(json_t *o, event *e)
{
    const char *kind = json_string_value(json_object_get(o, "ph"));
    assert_non_null(kind);
    assert_int_equal(json_integer_value(json_object_get(o, "pid")), 1);
    if (!strcmp(kind, "M")) {
        size_t tid = (size_t)json_integer_value(json_object_get(o, "tid")); /* the process has none: 0 */
        assert_true(tid < 8 && json_is_string(json_object_get(json_object_get(o, "args"), "name")));
        lanes[tid] = true;
        return false;
    }
    assert_string_equal(kind, "X");
    *e = (event){.category = json_string_value(json_object_get(o, "cat")),
                 .name = json_string_value(json_object_get(o, "name")),
                 .begin = json_number_value(json_object_get(o, "ts")),
                 .lane = (int)json_integer_value(json_object_get(o, "tid")),
                 .frame = (int)json_integer_value(json_object_get(json_object_get(o, "args"), "frame"))};
    e->end = e->begin + json_number_value(json_object_get(o, "dur"));
    assert_true(e->category && e->name && e->begin >= 0 && e->end >= e->begin && lanes[e->lane]);
    assert_string_equal(json_string_value(json_object_get(json_object_get(o, "args"), "capture")), capture);
    return true;
}

/* Events in the order of the file; the caller gives the tree back. */
static json_t *load(const char *path, event *events, int most, int *n)
{
    json_error_t error;
    json_t *root = json_load_file(path, 0, &error);
    if (!root)
        fail_msg("%s:%d: %s", path, error.line, error.text);
    json_t *list = json_object_get(root, "traceEvents");
    assert_true(json_is_array(list));
    *n = 0;
    memset(lanes, 0, sizeof lanes);
    for (size_t i = 0; i < json_array_size(list) && *n < most; i++)
        *n += read_event(json_array_get(list, i), &events[*n]);
    /* As viewers want them, which make a stack of each thread: by time, what holds others first. */
    for (int i = 1; i < *n; i++)
        assert_true(events[i].begin >= events[i - 1].begin);
    return root;
}

static const event *find(const event *events, int n, const char *category, int frame)
{
    for (int i = 0; i < n; i++)
        if (events[i].frame == frame && !strcmp(events[i].category, category))
            return &events[i];
    return NULL;
}

static bool inside(const event *a, const event *b)
{
    return a->begin >= b->begin && a->end <= b->end + 0.002; /* times are rounded to ns */
}

static void test_stages(void **state)
{
    (void)state;
    static event events[4096];
    int n;
    char *path = path_in(place.folder, "t.json");
    tool_result r = BATCH(&place, "out", 0, "--quiet", "--trace", path, "--set",
                          "outputs.beauty.colorspace=ACEScg", "--checkpoint-frames", "2");
    tool_result_free(&r);
    json_t *root = load(path, events, 4096, &n);
    for (int frame = 1; frame <= FRAMES; frame++) {
        const event *read = find(events, n, "read", frame), *run = find(events, n, "run", frame),
                    *write = find(events, n, "write", frame), *encode = find(events, n, "encode", frame),
                    *colour = find(events, n, "colour", frame);
        assert_true(read && run && write && encode && colour);
        assert_true(read->lane == 1 && run->lane == 2 && colour->lane == 3 && write->lane == 4 &&
                    encode->lane == 4);
        assert_true(read->end <= run->begin && run->end <= write->begin); /* a frame passes them in order */
        assert_true(inside(encode, write));
        assert_string_equal(encode->name, "beauty");
        int kernels = 0;
        for (int i = 0; i < n; i++) {
            if (events[i].lane != 3 || events[i].frame != frame)
                continue;
            assert_true(inside(&events[i], run));
            kernels += !strcmp(events[i].category, "kernel");
        }
        assert_int_equal(kernels, 3); /* lighting, combine, taa */
    }
    const event *saved = find(events, n, "checkpoint", 2);
    assert_true(saved && saved->lane == 4 && inside(saved, find(events, n, "write", 2)));
    for (int a = 0; a < n; a++) /* what one thread does nests or follows, or viewers draw nonsense */
        for (int b = 0; b < a; b++)
            if (events[a].lane == events[b].lane)
                assert_true(inside(&events[a], &events[b]) || inside(&events[b], &events[a]) ||
                            events[a].begin >= events[b].end - 0.002 ||
                            events[b].begin >= events[a].end - 0.002);
    json_decref(root);
    free(path);
}

/* A run with a frame that fails leaves its trace too; one that cannot be written is an error, after the
 * pictures. */
static void test_failures(void **state)
{
    (void)state;
    static event events[4096];
    int n;
    char *path = path_in(place.folder, "f.json"), *frame = path_in(place.capture, "loop.0003.exr");
    assert_int_equal(unlink(frame), 0);
    size_t size;
    char *manifest = path_in(place.capture, "capture.yaml"), *text = file_read(manifest, &size),
         *named = text_replace(text, "name: loop", "name: köln");
    file_write(place.capture, "capture.yaml", named, strlen(named));
    capture = "köln";
    tool_result r = BATCH(&place, "failed", 1, "--quiet", "--trace", path);
    tool_result_free(&r);
    json_t *root = load(path, events, 4096, &n);
    assert_non_null(find(events, n, "read", 3));
    assert_null(find(events, n, "encode", 3));
    assert_non_null(find(events, n, "encode", 4));
    json_decref(root);
    r = BATCH(&place, "unwritten", 1, "--quiet", "--frames", "1-2", "--trace", "/nonexistent/t.json");
    assert_non_null(strstr(r.err, "/nonexistent/t.json: error: "));
    tool_result_free(&r);
    char *out = path_in(place.folder, "unwritten");
    assert_int_equal(folder_files(out), 2);
    free(manifest);
    free(named);
    free(text);
    free(out);
    free(frame);
    free(path);
}

int main(int argc, char **argv)
{
    tool_child(argc, argv);
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_stages), cmocka_unit_test(test_failures)};
    return cmocka_run_group_tests_name("trace", tests, setup, teardown);
}
