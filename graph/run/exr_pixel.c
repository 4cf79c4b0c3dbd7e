/* The loops over samples of EXR files: half floats, what is not finite, and the byte order and predictor of
 * ZIP. */
#include "graph/run/exr_core.h"

#include <math.h>
#include <pthread.h>
#include <string.h>

#if defined(__x86_64__)
#include <cpuid.h>
#include <immintrin.h>
#define RL_X86 1
#define VECTOR __attribute__((target("avx2,f16c,popcnt")))
#endif

#define HALF_MAX      65504.0f
#define HALF_OVERFLOW 65520.0f /* from here on, rounding to nearest would give infinity */

/* ---- portable ---- */

static float bits_float(uint32_t bits)
{
    float f;
    memcpy(&f, &bits, sizeof f);
    return f;
}

static uint32_t float_bits(float f)
{
    uint32_t bits;
    memcpy(&bits, &f, sizeof bits);
    return bits;
}

float rl_exr_half_value(uint16_t half)
{
    uint32_t sign = (uint32_t)(half & 0x8000) << 16;
    uint32_t exponent = (half >> 10) & 31, mantissa = half & 1023u;
    if (exponent == 31)
        return bits_float(sign | 0x7f800000u | mantissa << 13);
    if (exponent == 0) { /* zero and subnormals: mantissa · 2^-24, exact in a float */
        float f = (float)mantissa * 0x1p-24f;
        return sign ? -f : f;
    }
    return bits_float(sign | (exponent + 112) << 23 | mantissa << 13);
}

/* |f| < 65520, or NaN. */
static uint16_t half_from_float(float f)
{
    uint32_t bits = float_bits(f), sign = bits >> 16 & 0x8000, size = bits & 0x7fffffff;
    if (size > 0x7f800000) /* NaN: the payload's upper bits, made quiet as the hardware does */
        return (uint16_t)(sign | 0x7e00 | (size >> 13 & 0x3ff));
    if (size <
        0x38800000) { /* below 2^-14: in steps of 2^-24; the addition rounds to nearest, ties to even */
        float shifted = bits_float(size) + 0.5f;
        return (uint16_t)(sign | (float_bits(shifted) - float_bits(0.5f)));
    }
    uint32_t odd = size >> 13 & 1;
    return (uint16_t)(sign | ((size - 0x38000000 + 0xfff + odd) >> 13));
}

static float fixed(float f, const rl_exr_fix *fix, size_t *count)
{
    if ((float_bits(f) & 0x7f800000) != 0x7f800000)
        return f;
    if (fix->replace_inf && float_bits(f) == 0x7f800000)
        return fix->inf_value;
    ++*count;
    return 0.0f;
}

static size_t half_to_float_c(const void *in, float *out, size_t n, const rl_exr_fix *fix)
{
    size_t count = 0;
    for (size_t i = 0; i < n; i++) {
        uint16_t h;
        memcpy(&h, (const char *)in + 2 * i, 2);
        out[i] = fixed(rl_exr_half_value(h), fix, &count);
    }
    return count;
}

static size_t float_fix_c(const void *in, float *out, size_t n, const rl_exr_fix *fix)
{
    size_t count = 0;
    for (size_t i = 0; i < n; i++) {
        float f;
        memcpy(&f, (const char *)in + 4 * i, 4);
        out[i] = fixed(f, fix, &count);
    }
    return count;
}

static size_t float_to_half_c(const float *in, void *out, size_t n)
{
    size_t count = 0;
    for (size_t i = 0; i < n; i++) {
        float f = in[i];
        if (fabsf(f) >= HALF_OVERFLOW) {
            f = copysignf(HALF_MAX, f);
            count++;
        }
        uint16_t h = half_from_float(f);
        memcpy((char *)out + 2 * i, &h, 2);
    }
    return count;
}

static void span_decode_c(const uint8_t *even, const uint8_t *odd, size_t n, uint8_t carry[2], uint8_t *out)
{
    uint8_t a = carry[0], b = carry[1];
    for (size_t i = 0; i < n; i++) {
        out[2 * i] = a = (uint8_t)(a + even[i] - 128);
        out[2 * i + 1] = b = (uint8_t)(b + odd[i] - 128);
    }
    carry[0] = a;
    carry[1] = b;
}

static uint8_t span_skip_c(const uint8_t *coded, size_t n, uint8_t carry)
{
    unsigned sum = carry;
    for (size_t i = 0; i < n; i++)
        sum += coded[i] ^ 128u;
    return (uint8_t)sum;
}

static void span_encode_c(const uint8_t *in, size_t n, uint8_t carry[2], uint8_t *even, uint8_t *odd)
{
    uint8_t a = carry[0], b = carry[1];
    for (size_t i = 0; i < n; i++) {
        even[i] = (uint8_t)(in[2 * i] - a + 128);
        odd[i] = (uint8_t)(in[2 * i + 1] - b + 128);
        a = in[2 * i];
        b = in[2 * i + 1];
    }
    carry[0] = a;
    carry[1] = b;
}

const rl_exr_kernels rl_exr_kernels_portable = {
    .span_decode = span_decode_c,
    .span_skip = span_skip_c,
    .span_encode = span_encode_c,
    .half_to_float = half_to_float_c,
    .float_fix = float_fix_c,
    .float_to_half = float_to_half_c,
};

size_t rl_exr_uint_to_float(const void *in, float *out, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        uint32_t u;
        memcpy(&u, (const char *)in + 4 * i, 4);
        out[i] = (float)u;
        if ((double)out[i] != (double)u)
            return i;
    }
    return n;
}

/* Integral and within int32 or uint32; NaN fails every comparison. */
static bool id_from(float v, uint32_t *out)
{
    if (!(v >= -2147483648.0f && v < 4294967296.0f))
        return false;
    int64_t i = (int64_t)v;
    *out = (uint32_t)i;
    return (float)i == v;
}

size_t rl_exr_half_to_id(const void *in, uint32_t *out, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        uint16_t h;
        memcpy(&h, (const char *)in + 2 * i, 2);
        if (!id_from(rl_exr_half_value(h), &out[i]))
            return i;
    }
    return n;
}

size_t rl_exr_float_to_id(const void *in, uint32_t *out, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        float f;
        memcpy(&f, (const char *)in + 4 * i, 4);
        if (!id_from(f, &out[i]))
            return i;
    }
    return n;
}

/* ---- AVX2 and F16C ---- */

#ifdef RL_X86

/* The running sum of 32 bytes, each lane of 16 first. *carry is a vector of the byte before, in all places.
 */
VECTOR static inline __m256i running_sum(__m256i v, __m256i *carry)
{
    v = _mm256_xor_si256(v, _mm256_set1_epi8((char)128)); /* = - 128 */
    v = _mm256_add_epi8(v, _mm256_slli_si256(v, 1));
    v = _mm256_add_epi8(v, _mm256_slli_si256(v, 2));
    v = _mm256_add_epi8(v, _mm256_slli_si256(v, 4));
    v = _mm256_add_epi8(v, _mm256_slli_si256(v, 8));
    __m256i last = _mm256_shuffle_epi8(v, _mm256_set1_epi8(15));
    v = _mm256_add_epi8(
        v, _mm256_permute2x128_si256(last, last, 0x08)); /* the low lane's sum into the high one */
    __m256i total = _mm256_add_epi8(last, _mm256_permute2x128_si256(last, last, 0x01));
    v = _mm256_add_epi8(v, *carry);
    *carry = _mm256_add_epi8(*carry, total);
    return v;
}

VECTOR static void span_decode_avx2(const uint8_t *even, const uint8_t *odd, size_t n, uint8_t carry[2],
                                    uint8_t *out)
{
    __m256i ca = _mm256_set1_epi8((char)carry[0]), cb = _mm256_set1_epi8((char)carry[1]);
    size_t i = 0;
    for (; i + 32 <= n; i += 32) {
        __m256i a = running_sum(_mm256_loadu_si256((const __m256i *)(even + i)), &ca);
        __m256i b = running_sum(_mm256_loadu_si256((const __m256i *)(odd + i)), &cb);
        __m256i lo = _mm256_unpacklo_epi8(a, b), hi = _mm256_unpackhi_epi8(a, b);
        _mm256_storeu_si256((__m256i *)(out + 2 * i), _mm256_permute2x128_si256(lo, hi, 0x20));
        _mm256_storeu_si256((__m256i *)(out + 2 * i + 32), _mm256_permute2x128_si256(lo, hi, 0x31));
    }
    carry[0] = (uint8_t)_mm256_extract_epi8(ca, 0);
    carry[1] = (uint8_t)_mm256_extract_epi8(cb, 0);
    span_decode_c(even + i, odd + i, n - i, carry, out + 2 * i);
}

VECTOR static uint8_t span_skip_avx2(const uint8_t *coded, size_t n, uint8_t carry)
{
    __m256i sum = _mm256_setzero_si256();
    size_t i = 0;
    for (; i + 32 <= n; i += 32) {
        __m256i v = _mm256_loadu_si256((const __m256i *)(coded + i));
        sum = _mm256_add_epi64(sum, _mm256_sad_epu8(v, _mm256_setzero_si256()));
    }
    __m128i s = _mm_add_epi64(_mm256_castsi256_si128(sum), _mm256_extracti128_si256(sum, 1));
    unsigned total =
        (unsigned)_mm_cvtsi128_si32(s) + (unsigned)_mm_extract_epi16(s, 4); /* modulo 256 is enough */
    total -= 128u * (unsigned)i;
    return span_skip_c(coded + i, n - i, (uint8_t)(carry + total));
}

VECTOR static void span_encode_avx2(const uint8_t *in, size_t n, uint8_t carry[2], uint8_t *even,
                                    uint8_t *odd)
{
    const __m256i low = _mm256_set1_epi16(0xff), bias = _mm256_set1_epi8((char)128);
    __m256i pa = _mm256_set1_epi8((char)carry[0]), pb = _mm256_set1_epi8((char)carry[1]);
    size_t i = 0;
    for (; i + 32 <= n; i += 32) {
        __m256i x = _mm256_loadu_si256((const __m256i *)(in + 2 * i));
        __m256i y = _mm256_loadu_si256((const __m256i *)(in + 2 * i + 32));
        __m256i a = _mm256_packus_epi16(_mm256_and_si256(x, low), _mm256_and_si256(y, low));
        __m256i b = _mm256_packus_epi16(_mm256_srli_epi16(x, 8), _mm256_srli_epi16(y, 8));
        a = _mm256_permute4x64_epi64(a, 0xd8);
        b = _mm256_permute4x64_epi64(b, 0xd8);
        __m256i before_a = _mm256_alignr_epi8(a, _mm256_permute2x128_si256(pa, a, 0x21), 15);
        __m256i before_b = _mm256_alignr_epi8(b, _mm256_permute2x128_si256(pb, b, 0x21), 15);
        _mm256_storeu_si256((__m256i *)(even + i), _mm256_xor_si256(_mm256_sub_epi8(a, before_a), bias));
        _mm256_storeu_si256((__m256i *)(odd + i), _mm256_xor_si256(_mm256_sub_epi8(b, before_b), bias));
        pa = a;
        pb = b;
    }
    carry[0] = (uint8_t)_mm256_extract_epi8(pa, 31);
    carry[1] = (uint8_t)_mm256_extract_epi8(pb, 31);
    span_encode_c(in + 2 * i, n - i, carry, even + i, odd + i);
}

/* Eight values with what is not finite replaced; *count grows by how many became 0. */
VECTOR static inline __m256 fix_eight(__m256 v, __m256i inf_mask, __m256 inf_value, size_t *count)
{
    const __m256i exponent = _mm256_set1_epi32(0x7f800000);
    __m256i bits = _mm256_castps_si256(v);
    __m256i bad = _mm256_cmpeq_epi32(_mm256_and_si256(bits, exponent), exponent);
    if (__builtin_expect(_mm256_testz_si256(bad, bad), 1))
        return v;
    __m256i inf = _mm256_and_si256(_mm256_cmpeq_epi32(bits, exponent), inf_mask);
    __m256 kept = _mm256_blendv_ps(_mm256_castsi256_ps(_mm256_andnot_si256(bad, bits)), inf_value,
                                   _mm256_castsi256_ps(inf));
    int zeroed = _mm256_movemask_ps(_mm256_castsi256_ps(_mm256_andnot_si256(inf, bad)));
    *count += (size_t)__builtin_popcount((unsigned)zeroed);
    return kept;
}

VECTOR static size_t half_to_float_avx2(const void *in, float *out, size_t n, const rl_exr_fix *fix)
{
    const uint16_t *halves = in;
    const __m256i inf_mask = _mm256_set1_epi32(fix->replace_inf ? -1 : 0);
    const __m256 inf_value = _mm256_set1_ps(fix->inf_value);
    size_t count = 0, i = 0;
    for (; i + 8 <= n; i += 8) {
        __m256 v = _mm256_cvtph_ps(_mm_loadu_si128((const __m128i *)(const void *)(halves + i)));
        _mm256_storeu_ps(out + i, fix_eight(v, inf_mask, inf_value, &count));
    }
    return count + half_to_float_c(halves + i, out + i, n - i, fix);
}

VECTOR static size_t float_fix_avx2(const void *in, float *out, size_t n, const rl_exr_fix *fix)
{
    const char *bytes = in;
    const __m256i inf_mask = _mm256_set1_epi32(fix->replace_inf ? -1 : 0);
    const __m256 inf_value = _mm256_set1_ps(fix->inf_value);
    size_t count = 0, i = 0;
    for (; i + 8 <= n; i += 8) {
        __m256 v = _mm256_castsi256_ps(_mm256_loadu_si256((const __m256i *)(const void *)(bytes + 4 * i)));
        _mm256_storeu_ps(out + i, fix_eight(v, inf_mask, inf_value, &count));
    }
    return count + float_fix_c(bytes + 4 * i, out + i, n - i, fix);
}

VECTOR static size_t float_to_half_avx2(const float *in, void *out, size_t n)
{
    const __m256 sign = _mm256_set1_ps(-0.0f), overflow = _mm256_set1_ps(HALF_OVERFLOW);
    const __m256 top = _mm256_set1_ps(HALF_MAX);
    size_t count = 0, i = 0;
    for (; i + 8 <= n; i += 8) {
        __m256 v = _mm256_loadu_ps(in + i);
        __m256 size = _mm256_andnot_ps(sign, v);
        __m256 over = _mm256_cmp_ps(size, overflow, _CMP_GE_OQ); /* false for NaN */
        if (__builtin_expect(!_mm256_testz_ps(over, over), 0)) {
            count += (size_t)__builtin_popcount((unsigned)_mm256_movemask_ps(over));
            v = _mm256_blendv_ps(v, _mm256_or_ps(_mm256_and_ps(sign, v), top), over);
        }
        __m128i h = _mm256_cvtps_ph(v, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC);
        _mm_storeu_si128((__m128i *)(void *)((char *)out + 2 * i), h);
    }
    return count + float_to_half_c(in + i, (char *)out + 2 * i, n - i);
}

static const rl_exr_kernels kernels_avx2 = {
    .span_decode = span_decode_avx2,
    .span_skip = span_skip_avx2,
    .span_encode = span_encode_avx2,
    .half_to_float = half_to_float_avx2,
    .float_fix = float_fix_avx2,
    .float_to_half = float_to_half_avx2,
};

#endif

static rl_exr_kernels kernels_wide; /* AVX-512 where that is faster */
static int n_sets = 1;
static pthread_once_t once = PTHREAD_ONCE_INIT;

static void find_sets(void)
{
#ifdef RL_X86
    unsigned a, b, c, d; /* F16C by hand: not every compiler's __builtin_cpu_supports knows it */
    if (!__builtin_cpu_supports("avx2") || !__get_cpuid(1, &a, &b, &c, &d) || !(c & bit_F16C))
        return;
    kernels_wide = kernels_avx2;
    n_sets = rl_exr_kernels_widen(&kernels_wide) ? 3 : 2;
#endif
}

const rl_exr_kernels *rl_exr_kernels_at(int i)
{
    pthread_once(&once, find_sets);
    if (i < 0 || i >= n_sets)
        return NULL;
#ifdef RL_X86
    if (i > 0)
        return i == 1 ? &kernels_avx2 : &kernels_wide;
#endif
    return &rl_exr_kernels_portable;
}

const rl_exr_kernels *rl_exr_kernels_best(void)
{
    pthread_once(&once, find_sets);
    return rl_exr_kernels_at(n_sets - 1);
}
