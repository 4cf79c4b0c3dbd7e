/* Lists of frames. */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>

#include <string.h>

#include "graph/base/alloc.h"
#include "graph/model/frames.h"

static rl_arena arena;
static rl_error err;

static int reset(void **state)
{
    (void)state;
    rl_arena_free(&arena);
    rl_alloc_fail_at(0, 0);
    err = (rl_error){0};
    return 0;
}

static rl_frames parse(const char *spec)
{
    rl_frames f;
    err = (rl_error){0};
    if (rl_frames_parse(&arena, spec, RL_NOWHERE, &f, &err))
        fail_msg("'%s': %s", spec, err.text);
    return f;
}

static void expect(const char *spec, size_t n, const int *numbers, const char *printed)
{
    rl_frames f = parse(spec);
    rl_str s = {0};
    assert_int_equal(f.n, n);
    assert_memory_equal(f.numbers, numbers, n * sizeof *numbers);
    rl_frames_print(&f, &s);
    assert_string_equal(rl_str_text(&s), printed);
    rl_frames again = parse(rl_str_text(&s));
    assert_int_equal(again.n, n);
    assert_memory_equal(again.numbers, numbers, n * sizeof *numbers);
    rl_str_free(&s);
}
#define EXPECT(spec, printed, ...)                                                                           \
    expect(spec, sizeof((int[]){__VA_ARGS__}) / sizeof(int), (int[]){__VA_ARGS__}, printed)

static void test_specs(void **state)
{
    (void)state;
    EXPECT("7", "7", 7);
    EXPECT("-3", "-3", -3);
    EXPECT("1-4", "1-4", 1, 2, 3, 4);
    EXPECT("1-8x2", "1-7x2", 1, 3, 5, 7);
    EXPECT("1,5,9-12", "1,5,9-12", 1, 5, 9, 10, 11, 12);
    EXPECT("-10--8", "-10--8", -10, -9, -8);
    EXPECT("-2-1", "-2-1", -2, -1, 0, 1);
    EXPECT(" 3 , 1 , 2-3,1", "1-3", 1, 2, 3);
    EXPECT("5-5", "5", 5);
    EXPECT("1,2", "1,2", 1, 2);
    EXPECT("0001-0003", "1-3", 1, 2, 3);
    EXPECT("2000000000,-2000000000", "-2000000000,2000000000", -2000000000, 2000000000);
    EXPECT("1-100x40,2", "1,2,41,81", 1, 2, 41, 81);
    assert_int_equal(parse("1-1000000").n, 1000000);
}

static void test_bad_specs(void **state)
{
    (void)state;
    static const char *const bad[] = {"",       " ",          "a",   "1-",      "-",
                                      "--1",    "1,,2",       "1,",  ",1",      "1-2x",
                                      "1x2",    "1..5",       "1 2", "1-2-3",   "1-5x0",
                                      "1-5x-1", "2000000001", "1.5", "1-2x2x2", "99999999999999999999"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        rl_frames f;
        err = (rl_error){0};
        if (rl_frames_parse(&arena, bad[i], (rl_where){"c.yaml", 4, 9}, &f, &err) != RL_E_CONFIG)
            fail_msg("'%s' was taken", bad[i]);
        assert_int_equal(f.n, 0);
        assert_int_equal(err.line, 4);
    }
    rl_frames f;
    err = (rl_error){0};
    rl_frames_parse(&arena, "1-8,10-2", RL_NOWHERE, &f, &err);
    assert_string_equal(err.text, "frames '1-8,10-2': 10-2 runs backwards");
    err = (rl_error){0};
    rl_frames_parse(&arena, "1-1000000,5", RL_NOWHERE, &f, &err);
    assert_string_equal(err.text, "frames '1-1000000,5': more than 1000000");
    err = (rl_error){0};
    rl_frames_parse(&arena, "-2000000000-2000000000", RL_NOWHERE, &f, &err);
    assert_non_null(strstr(err.text, "more than 1000000"));
    err = (rl_error){0};
    rl_alloc_fail_at(1, 0);
    assert_int_equal(rl_frames_parse(&arena, "1-1000", RL_NOWHERE, &f, &err), RL_E_MEMORY);
}

static void test_find_and_check(void **state)
{
    (void)state;
    rl_frames listed = parse("1-9x2,20"), some = parse("3,20"), wrong = parse("3,4"), none = {0};
    assert_int_equal(rl_frames_find(&listed, 5), 2);
    assert_int_equal(rl_frames_find(&listed, 20), 5);
    assert_int_equal(rl_frames_find(&listed, 4), -1);
    assert_int_equal(rl_frames_find(&none, 4), -1);
    assert_int_equal(rl_frames_check(&listed, "shot", &some, RL_NOWHERE, &err), RL_OK);
    assert_int_equal(rl_frames_check(&listed, "shot", &wrong, RL_NOWHERE, &err), RL_E_USAGE);
    assert_string_equal(err.text, "frame 4 is not in the capture 'shot', which lists 1-9x2,20");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_specs, reset, reset),
        cmocka_unit_test_setup_teardown(test_bad_specs, reset, reset),
        cmocka_unit_test_setup_teardown(test_find_and_check, reset, reset),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
