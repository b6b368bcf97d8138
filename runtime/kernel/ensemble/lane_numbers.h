/* Vectors of numbers, one for each lane, and the functions of them that generated lanes call.
 *
 * MECH_LANE_WIDTH may be defined before; else it is the widest that the compiler may use. Written with vector extensions of
 * GCC and Clang, and one row of intrinsics for each width where these have no operator. Compiled with -ffp-contract=off:
 * what is fused stands in the text.
 */
#ifndef MECH_LANE_NUMBERS_H
#define MECH_LANE_NUMBERS_H

#include "lanes.h"
#include "real.h"

#define LANE static inline __attribute__((always_inline))
#if defined(__clang__)
#define LANE_TWICE _Pragma("clang loop unroll_count(2)")
#else
#define LANE_TWICE _Pragma("GCC unroll 2")
#endif

#ifndef MECH_LANE_WIDTH
#if defined(_WIN32) && defined(__GNUC__) && !defined(__clang__)
#define MECH_LANE_WIDTH 2 /* GCC does not align the stack there */
#elif defined(__AVX512F__) && defined(__AVX512DQ__)
#define MECH_LANE_WIDTH 8
#elif defined(__AVX__)
#define MECH_LANE_WIDTH 4
#else
#define MECH_LANE_WIDTH 2
#endif
#endif

enum { WIDTH = MECH_LANE_WIDTH };
typedef double V __attribute__((vector_size(8 * MECH_LANE_WIDTH)));
typedef long long M __attribute__((vector_size(8 * MECH_LANE_WIDTH))); /* -1 where something holds, else 0 */

#if defined(__FMA__) || defined(__ARM_FEATURE_FMA)
#define LANE_FUSED 1
#define LANE_HOW ", fused"
#else
#define LANE_FUSED 0
#define LANE_HOW ", not fused"
#endif

/* ---- one row for each width: a b + c, c - a b, root, sets of lanes as bits */

#if defined(__x86_64__) || defined(__i386__)
#include <immintrin.h>
#endif
#if MECH_LANE_WIDTH == 8 && defined(__AVX512F__)
#define LANE_NAME "AVX-512"
LANE V lane_fma(V a, V b, V c) { return _mm512_fmadd_pd(a, b, c); }
LANE V lane_fnma(V a, V b, V c) { return _mm512_fnmadd_pd(a, b, c); }
LANE V lane_sqrt(V a) { return _mm512_sqrt_pd(a); }
LANE unsigned lane_bits(M m) { return _mm512_movepi64_mask((__m512i)m); }
LANE M lane_set(unsigned bits) { return (M)_mm512_movm_epi64((__mmask8)bits); }
#elif MECH_LANE_WIDTH == 4 && defined(__AVX__)
#define LANE_NAME "AVX2"
#if LANE_FUSED
LANE V lane_fma(V a, V b, V c) { return _mm256_fmadd_pd(a, b, c); }
LANE V lane_fnma(V a, V b, V c) { return _mm256_fnmadd_pd(a, b, c); }
#else
LANE V lane_fma(V a, V b, V c) { return a * b + c; }
LANE V lane_fnma(V a, V b, V c) { return c - a * b; }
#endif
LANE V lane_sqrt(V a) { return _mm256_sqrt_pd(a); }
LANE unsigned lane_bits(M m) { return (unsigned)_mm256_movemask_pd((__m256d)m); }
#define LANE_SET_BY_BITS
#elif MECH_LANE_WIDTH == 2 && defined(__SSE2__)
#define LANE_NAME "SSE2"
#if LANE_FUSED
LANE V lane_fma(V a, V b, V c) { return _mm_fmadd_pd(a, b, c); }
LANE V lane_fnma(V a, V b, V c) { return _mm_fnmadd_pd(a, b, c); }
#else
LANE V lane_fma(V a, V b, V c) { return a * b + c; }
LANE V lane_fnma(V a, V b, V c) { return c - a * b; }
#endif
LANE V lane_sqrt(V a) { return _mm_sqrt_pd(a); }
LANE unsigned lane_bits(M m) { return (unsigned)_mm_movemask_pd((__m128d)m); }
#define LANE_SET_BY_BITS
#elif MECH_LANE_WIDTH == 2 && defined(__ARM_NEON) && defined(__aarch64__)
#define LANE_NAME "NEON"
#include <arm_neon.h>
LANE V lane_fma(V a, V b, V c) { return (V)vfmaq_f64((float64x2_t)c, (float64x2_t)a, (float64x2_t)b); }
LANE V lane_fnma(V a, V b, V c) { return (V)vfmsq_f64((float64x2_t)c, (float64x2_t)a, (float64x2_t)b); }
LANE V lane_sqrt(V a) { return (V)vsqrtq_f64((float64x2_t)a); }
LANE unsigned lane_bits(M m) { return (unsigned)((m[0] & 1) | (m[1] & 2)); }
#define LANE_SET_BY_BITS
#else
#define LANE_NAME "vectors"
#define LANE_ONE_BY_ONE
LANE V lane_fma(V a, V b, V c)
{
    for (int l = 0; l < WIDTH; l++) c[l] = LANE_FUSED ? fma(a[l], b[l], c[l]) : a[l] * b[l] + c[l];
    return c;
}
LANE V lane_fnma(V a, V b, V c) { return lane_fma(-a, b, c); }
LANE V lane_sqrt(V a)
{
    for (int l = 0; l < WIDTH; l++) a[l] = sqrt(a[l]);
    return a;
}
LANE unsigned lane_bits(M m)
{
    unsigned bits = 0;
    for (int l = 0; l < WIDTH; l++) bits |= (unsigned)(m[l] & 1) << l;
    return bits;
}
#define LANE_SET_BY_BITS
#endif

#ifdef LANE_SET_BY_BITS
LANE M lane_set(unsigned bits)
{
    M m;
    for (int l = 0; l < WIDTH; l++) m[l] = -(long long)(bits >> l & 1);
    return m;
}
#endif

/* ---- numbers and choices */

LANE V lane(double x) { return x - (V){0}; }
LANE V lane_pick(M m, V a, V b) { return (V)((m & (M)a) | (~m & (M)b)); }
LANE V lane_abs(V x) { return (V)((M)x & 0x7fffffffffffffffLL); }
LANE V lane_larger(V a, V b) { return lane_pick(a > b, a, b); }
LANE V lane_smaller(V a, V b) { return lane_pick(a < b, a, b); }
LANE M lane_finite(V x) { return x - x == 0.0; }

/* As the functions of the same names in the C text of a model. */
LANE V lane_minimum(V a, V b) { return lane_pick((a < b) | (a != a), a, b); }
LANE V lane_maximum(V a, V b) { return lane_pick((a > b) | (a != a), a, b); }
LANE V lane_sign(V x) { return lane_pick(x > 0.0, lane(1), lane_pick(x < 0.0, lane(-1), x)); }
LANE V lane_number(M m) { return (V)(m & (M)lane(1)); }

/* The next whole number below; what is 2^52 or more is whole. */
LANE V lane_floor(V x)
{
    const V shift = lane(0x1p52), a = lane_abs(x), near = (a + shift) - shift;
    const V whole = (V)((M)near | ((M)x & ~0x7fffffffffffffffLL));
    return lane_pick(a < shift, (V)((M)(whole - lane_number(whole > x)) | ((M)x & ~0x7fffffffffffffffLL)), x);
}

/* ---- step control: x^e for positive x to some five digits. The logarithm by the area tangent, the power by its series. */

LANE V lane_rough_log2(V x)
{
    const M bits = (M)x;
    const V k = (V)((bits >> 52 & 0x7ff) | 0x4330000000000000LL) - (0x1p52 + 1023.0);
    const V m = (V)((bits & 0xfffffffffffffLL) | 0x3ff0000000000000LL);
    const V root = lane(1.41421356237309515), d = (m - root) / (m + root), d2 = d * d;
    const V series = lane_fma(d2, lane_fma(d2, lane(0.2), lane(1.0 / 3)), lane(1));
    return k + lane_fma(d * series, lane(2 * 1.4426950408889634), lane(0.5));
}

LANE V lane_rough_exp2(V x)
{
    const V exponent = lane_larger(lane_smaller(x, lane(1000)), lane(-1000));
    const V shifted = exponent + 0x1.8p52, whole = shifted - 0x1.8p52, f = (exponent - whole) * 0.6931471805599453;
    V power = lane_fma(f, lane(1.0 / 120), lane(1.0 / 24));
    power = lane_fma(f, power, lane(1.0 / 6));
    power = lane_fma(f, power, lane(0.5));
    power = lane_fma(f, power, lane(1));
    power = lane_fma(f, power, lane(1));
    return (V)((M)power + ((M)shifted << 52));
}

LANE V lane_rough_power(V x, double e) { return lane_rough_exp2(lane_rough_log2(x) * e); }

#endif
