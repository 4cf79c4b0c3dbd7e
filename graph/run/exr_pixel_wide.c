/* The loops over samples of EXR files with AVX-512, where that is faster: the predictor of ZIP. */
#include "graph/run/exr_core.h"

#if defined(__x86_64__)
#include <immintrin.h>
#define VECTOR __attribute__((target("avx512f,avx512bw")))

/* The running sum of 64 bytes, each lane of 16 first. *carry is a vector of the byte before, in all places.
 */
VECTOR static inline __m512i running_sum(__m512i v, __m512i *carry)
{
    v = _mm512_xor_si512(v, _mm512_set1_epi8((char)128)); /* = - 128 */
    v = _mm512_add_epi8(v, _mm512_bslli_epi128(v, 1));
    v = _mm512_add_epi8(v, _mm512_bslli_epi128(v, 2));
    v = _mm512_add_epi8(v, _mm512_bslli_epi128(v, 4));
    v = _mm512_add_epi8(v, _mm512_bslli_epi128(v, 8));
    __m512i last = _mm512_shuffle_epi8(v, _mm512_set1_epi8(15)); /* of lanes a b c d */
    __m512i one = _mm512_maskz_shuffle_i64x2(0xfc, last, last, _MM_SHUFFLE(2, 1, 0, 0));   /* 0 a b c */
    __m512i two = _mm512_maskz_shuffle_i64x2(0xf0, last, last, _MM_SHUFFLE(1, 0, 0, 0));   /* 0 0 a b */
    __m512i three = _mm512_maskz_shuffle_i64x2(0xc0, last, last, _MM_SHUFFLE(0, 0, 0, 0)); /* 0 0 0 a */
    __m512i before = _mm512_add_epi8(one, _mm512_add_epi8(two, three));
    __m512i total = _mm512_add_epi8(before, last);
    v = _mm512_add_epi8(v, _mm512_add_epi8(before, *carry));
    *carry = _mm512_add_epi8(*carry, _mm512_shuffle_i64x2(total, total, _MM_SHUFFLE(3, 3, 3, 3)));
    return v;
}

VECTOR static void span_decode(const uint8_t *even, const uint8_t *odd, size_t n, uint8_t carry[2],
                               uint8_t *out)
{
    const __m512i low = _mm512_set_epi64(11, 10, 3, 2, 9, 8, 1, 0);
    const __m512i high = _mm512_set_epi64(15, 14, 7, 6, 13, 12, 5, 4);
    __m512i a = _mm512_set1_epi8((char)carry[0]), b = _mm512_set1_epi8((char)carry[1]);
    size_t i = 0;
    for (; i + 64 <= n; i += 64) {
        __m512i x = running_sum(_mm512_loadu_si512(even + i), &a);
        __m512i y = running_sum(_mm512_loadu_si512(odd + i), &b);
        __m512i lo = _mm512_unpacklo_epi8(x, y), hi = _mm512_unpackhi_epi8(x, y);
        _mm512_storeu_si512(out + 2 * i, _mm512_permutex2var_epi64(lo, low, hi));
        _mm512_storeu_si512(out + 2 * i + 64, _mm512_permutex2var_epi64(lo, high, hi));
    }
    carry[0] = (uint8_t)_mm_cvtsi128_si32(_mm512_castsi512_si128(a));
    carry[1] = (uint8_t)_mm_cvtsi128_si32(_mm512_castsi512_si128(b));
    rl_exr_kernels_portable.span_decode(even + i, odd + i, n - i, carry, out + 2 * i);
}

bool rl_exr_kernels_widen(rl_exr_kernels *set)
{
    if (!__builtin_cpu_supports("avx512bw"))
        return false;
    set->span_decode = span_decode;
    return true;
}
#else
bool rl_exr_kernels_widen(rl_exr_kernels *set)
{
    (void)set;
    return false;
}
#endif
