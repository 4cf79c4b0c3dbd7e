/* The loops over samples: the portable set against definitions, the vector set against the portable one. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "graph/run/exr_core.h"
#include "tests/exr_make.h"

#define MOST 1000

static void half_values(void **state)
{
    (void)state;
    for (unsigned h = 0; h < 65536; h++) {
        int exponent = h >> 10 & 31, mantissa = h & 1023;
        double want = exponent == 0 ? ldexp(mantissa, -24) : ldexp(1024 + mantissa, exponent - 25);
        if (h & 0x8000)
            want = -want;
        float got = rl_exr_half_value((uint16_t)h);
        if (exponent == 31)
            assert_true(mantissa ? isnan(got) : isinf(got) && (got < 0) == (h >= 0x8000));
        else
            assert_true((double)got == want && !signbit(got) == !signbit(want));
    }
}

/* Every half, and the points around the middle between it and the next, where rounding decides. */
static void to_half_rounds_to_nearest_even(void **state)
{
    (void)state;
    for (unsigned h = 0; h < 0x7bff; h++) {
        float low = rl_exr_half_value((uint16_t)h), high = rl_exr_half_value((uint16_t)(h + 1));
        float middle = low + (high - low) / 2; /* exact in a float */
        float in[5] = {low, nextafterf(middle, 0), middle, nextafterf(middle, 1e9f), -middle};
        uint16_t out[5], even = (uint16_t)(h + (h & 1));
        assert_int_equal(rl_exr_kernels_portable.float_to_half(in, out, 5), 0);
        assert_int_equal(out[0], h);
        assert_int_equal(out[1], h);
        assert_int_equal(out[2], even);
        assert_int_equal(out[3], h + 1);
        assert_int_equal(out[4], even | 0x8000);
    }
}

static void to_half_clamps_and_counts(void **state)
{
    (void)state;
    const float in[] = {65504.0f, 65519.99f, 65520.0f, 1e9f, -70000.0f, INFINITY, -INFINITY, NAN};
    const uint16_t want[] = {0x7bff, 0x7bff, 0x7bff, 0x7bff, 0xfbff, 0x7bff, 0xfbff, 0x7e00};
    uint16_t out[8];
    assert_int_equal(rl_exr_kernels_portable.float_to_half(in, out, 8), 5);
    assert_memory_equal(out, want, sizeof want);
    assert_int_equal(rl_exr_kernels_best()->float_to_half(in, out, 8), 5);
    assert_memory_equal(out, want, sizeof want);
}

static void fixing(void **state)
{
    (void)state;
    const float in[] = {1, NAN, INFINITY, -INFINITY, -0.0f, 3e38f, 1e-45f, -NAN, INFINITY};
    const rl_exr_kernels *set;
    for (int s = 0; (set = rl_exr_kernels_at(s)); s++) {
        float out[9];
        assert_int_equal(set->float_fix(in, out, 9, &(rl_exr_fix){0}), 5);
        const float plain[] = {1, 0, 0, 0, -0.0f, 3e38f, 1e-45f, 0, 0};
        assert_memory_equal(out, plain, sizeof plain);
        assert_int_equal(set->float_fix(in, out, 9, &(rl_exr_fix){true, 1e10f}), 3);
        const float empty[] = {1, 0, 1e10f, 0, -0.0f, 3e38f, 1e-45f, 0, 1e10f};
        assert_memory_equal(out, empty, sizeof empty);
    }
}

/* A vector set gives the same bits as the portable one at every length and for every kind of value. */
static void agrees(const rl_exr_kernels *b)
{
    const rl_exr_kernels *a = &rl_exr_kernels_portable;
    static uint16_t half_in[65536], half_a[65536], half_b[65536];
    static float float_a[65536], float_b[65536];
    const rl_exr_fix fixes[] = {{false, 0}, {true, 5}};
    uint32_t seed = 7;
    for (unsigned i = 0; i < 65536; i++)
        half_in[i] = (uint16_t)i;
    for (int f = 0; f < 2; f++) {
        assert_int_equal(a->half_to_float(half_in, float_a, 65536, &fixes[f]),
                         b->half_to_float(half_in, float_b, 65536, &fixes[f]));
        assert_memory_equal(float_a, float_b, sizeof float_a);
    }
    for (int round = 0; round < 40; round++) {
        uint32_t bits[65536 / 16];
        size_t n = 65536 / 16 - (size_t)round;
        for (size_t i = 0; i < n; i++)
            bits[i] = made_random(&seed) & (i % 3 ? 0xffffffff : 0xbfffffff); /* many within half's range */
        memcpy(float_a, bits, 4 * n);
        assert_int_equal(a->float_to_half(float_a, half_a, n), b->float_to_half(float_a, half_b, n));
        assert_memory_equal(half_a, half_b, 2 * n);
        for (int f = 0; f < 2; f++) {
            assert_int_equal(a->float_fix(bits, float_a, n, &fixes[f]),
                             b->float_fix(bits, float_b, n, &fixes[f]));
            assert_memory_equal(float_a, float_b, 4 * n);
        }
    }
}

static void vector_sets_agree(void **state)
{
    (void)state;
    const rl_exr_kernels *set;
    for (int i = 0; (set = rl_exr_kernels_at(i)); i++)
        agrees(set);
    assert_ptr_equal(rl_exr_kernels_at(0), &rl_exr_kernels_portable);
}

/* ZIP's byte order and predictor, as the format's description has them: even bytes, odd bytes, differences.
 */
static void reference_code(const uint8_t *in, size_t size, uint8_t *out)
{
    uint8_t apart[2 * MOST];
    for (size_t i = 0; i < size; i++)
        apart[i % 2 ? size / 2 + i / 2 : i / 2] = in[i];
    for (size_t i = 0; i < size; i++)
        out[i] = i ? (uint8_t)(apart[i] - apart[i - 1] + 128) : apart[0];
}

static void spans(void **state)
{
    (void)state;
    const rl_exr_kernels *set;
    uint32_t seed = 3;
    for (size_t n = 1; n <= 300; n++) {
        uint8_t in[2 * MOST], want[2 * MOST], got[2 * MOST], back[2 * MOST];
        for (size_t i = 0; i < 2 * n; i++)
            in[i] = (uint8_t)made_random(&seed);
        reference_code(in, 2 * n, want);
        for (int s = 0; (set = rl_exr_kernels_at(s)); s++) {
            size_t cut = n / 3; /* two spans, so that the carry matters */
            uint8_t carry[2] = {128, 128};
            set->span_encode(in, cut, carry, got, got + n);
            set->span_encode(in + 2 * cut, n - cut, carry, got + cut, got + n + cut);
            got[n] = (uint8_t)(got[n] - in[2 * n - 2] + 128);
            assert_memory_equal(got, want, 2 * n);
            uint8_t decode[2] = {128, set->span_skip(got, n, 128)};
            assert_int_equal(decode[1], in[2 * n - 2]);
            set->span_decode(got, got + n, cut, decode, back);
            set->span_decode(got + cut, got + n + cut, n - cut, decode, back + 2 * cut);
            assert_memory_equal(back, in, 2 * n);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(half_values),
        cmocka_unit_test(to_half_rounds_to_nearest_even),
        cmocka_unit_test(to_half_clamps_and_counts),
        cmocka_unit_test(fixing),
        cmocka_unit_test(vector_sets_agree),
        cmocka_unit_test(spans),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
