/* The fast functions of common.cl, and the built-in ones that kernels count on, over their whole domain
 * against double; the operations on masks lane by lane. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "tests/cl_shade.h"

enum { COUNT = 1 << 21 };

static float *in, *out;

static int make_room(void **state)
{
    (void)state;
    in = malloc(COUNT * sizeof *in);
    out = malloc(COUNT * sizeof *out);
    return in && out ? 0 : -1;
}

static int free_room(void **state)
{
    (void)state;
    free(in);
    free(out);
    return 0;
}

static float from_bits(uint32_t bits)
{
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static uint32_t to_bits(float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

/* Floats from low to high (both of one sign, by magnitude), evenly spaced over their bit patterns, ends
 * included. */
static void spread(float low, float high, float *to, size_t n)
{
    uint64_t first = to_bits(low), span = to_bits(high) - first;
    for (size_t i = 0; i < n; i++)
        to[i] = from_bits((uint32_t)(first + span * i / (n - 1)));
}

static void run(const char *expression)
{
    char source[512];
    snprintf(source, sizeof source,
             "kernel void math(global const float *in, global float *out)\n"
             "{\n    int i = RL_W * (int)get_global_id(0);\n    floatv x = rl_load(in, i);\n"
             "    rl_store(%s, out, i);\n}\n",
             expression);
    assert_true(shade_function(source, "math", in, out, COUNT));
}

static double largest_error(double (*exact)(double), const char *name)
{
    double worst = 0, where = 0;
    for (size_t i = 0; i < COUNT; i++) {
        double want = exact((double)in[i]), error = fabs(out[i] - want) / want;
        if (!(error <= worst)) {
            worst = error;
            where = in[i];
        }
    }
    print_message("%s: largest relative error %.3g, at %.9g\n", name, worst, where);
    return worst;
}

static double exact_rsqrt(double x)
{
    return 1 / sqrt(x);
}

static void exp2_is_exact_to_float(void **state)
{
    (void)state;
    spread(-1e-30f, -126.0f, in, COUNT / 2);
    spread(1e-30f, 126.0f, in + COUNT / 2, COUNT / 2);
    run("rl_exp2(x)");
    assert_true(largest_error(exp2, "rl_exp2") < 1e-7);
}

static void exp2_of_whole_numbers_is_exact(void **state)
{
    (void)state;
    for (int i = 0; i < COUNT; i++)
        in[i] = (float)(i % 253 - 126);
    run("rl_exp2(x)");
    for (int i = 0; i < COUNT; i++)
        assert_true(out[i] == ldexpf(1, i % 253 - 126));
}

static void exp2_of_much_less_is_zero(void **state)
{
    (void)state;
    spread(-126.0001f, -3e38f, in, COUNT);
    run("rl_exp2(x)");
    for (int i = 0; i < COUNT; i++)
        assert_true(out[i] == 0);
}

static void roots_are_exact_to_float(void **state)
{
    (void)state;
    spread(1.2e-38f, 3.4e38f, in, COUNT);
    run("rsqrt(x)");
    assert_true(largest_error(exact_rsqrt, "rsqrt") < 2.5e-7);
    run("sqrt(x)");
    assert_true(largest_error(sqrt, "sqrt") < 4e-7);
    memset(in, 0, COUNT * sizeof *in);
    run("sqrt(x)");
    assert_true(out[0] == 0 && out[COUNT - 1] == 0);
}

/* Any lane alone must be seen, and the largest id wherever it stands. */
static void reductions_see_every_lane(void **state)
{
    (void)state;
    for (int i = 0; i < COUNT; i++)
        in[i] = (float)(i % 16 == i / 16 % 17 ? i / 272 % 1000 + 1 : 0);
    run("(floatv)(rl_any(x > 0.0f) ? 1.0f : 0.0f)");
    for (int i = 0; i < COUNT; i++)
        assert_true(out[i] == (i / 16 % 17 < 16));
    run("(floatv)rl_max_lane(x)");
    for (int i = 0; i < COUNT; i++)
        assert_true(out[i] == in[i / 16 * 16 + i / 16 % 17 % 16]);
    run("(floatv)(float)rl_max_id(RL_CAT(convert_uint, RL_W)(x))");
    for (int i = 0; i < COUNT; i++)
        assert_true(out[i] == in[i / 16 * 16 + i / 16 % 17 % 16]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(exp2_is_exact_to_float),    cmocka_unit_test(exp2_of_whole_numbers_is_exact),
        cmocka_unit_test(exp2_of_much_less_is_zero), cmocka_unit_test(roots_are_exact_to_float),
        cmocka_unit_test(reductions_see_every_lane),
    };
    return cmocka_run_group_tests(tests, make_room, free_room);
}
