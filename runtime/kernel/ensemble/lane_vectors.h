/* Vectors of doubles, one number for each lane.
 *
 * MECH_LANE_WIDTH may be defined before; else it is the widest that the compiler may use. Written with vector extensions of
 * GCC and Clang, and one row of intrinsics for each width where these have no operator. Compiled with -ffp-contract=off:
 * what is fused stands in the text.
 */
#ifndef MECH_LANE_VECTORS_H
#define MECH_LANE_VECTORS_H

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
enum { PAIRED = 2 };                                                  /* rooms whose lanes stand in one S */
typedef float S __attribute__((vector_size(8 * MECH_LANE_WIDTH)));
typedef float lane_part __attribute__((vector_size(4 * MECH_LANE_WIDTH)));
#define LANE_BITS(hex) hex##LL
#define LANE_OF(x, l) x[l]
#define LANE_RARELY(x) __builtin_expect(x, 0)
LANE M lane_raw(V x) { return (M)x; }
LANE V lane_value(M m) { return (V)m; }
LANE V lane(double x) { return x - (V){0}; }
LANE M lane_all(M m) { return m; } /* all bits where something holds, else none */
LANE V lane_number(M m) { return lane_value(m & lane_raw(lane(1))); }
typedef int SM __attribute__((vector_size(8 * MECH_LANE_WIDTH)));
LANE SM single_raw(S x) { return (SM)x; }
LANE S single_value(SM m) { return (S)m; }
LANE S single_pick(SM m, S a, S b) { return (S)((m & (SM)a) | (~m & (SM)b)); }
LANE S single(double x) { return (float)x - (S){0}; }
#if MECH_LANE_WIDTH == 8 && !defined(__AVX512F__) /* GCC 12 fails where it converts vectors wider than those of the processor */
LANE void lane_narrow(S *to, int room, V from)
{
    for (int l = 0; l < WIDTH; l++) ((float *)to)[room * WIDTH + l] = (float)from[l];
}
LANE V lane_widened(const S *from, int room)
{
    V wide;
    for (int l = 0; l < WIDTH; l++) wide[l] = (double)((const float *)from)[room * WIDTH + l];
    return wide;
}
#else
LANE void lane_narrow(S *to, int room, V from) { ((lane_part *)to)[room] = __builtin_convertvector(from, lane_part); }
LANE V lane_widened(const S *from, int room) { return __builtin_convertvector(((const lane_part *)from)[room], V); }
#endif
LANE V lane_pick(M m, V a, V b) { return lane_value((m & lane_raw(a)) | (~m & lane_raw(b))); }

#if defined(__FMA__) || defined(__ARM_FEATURE_FMA)
#define LANE_FUSED 1
#define LANE_HOW ", fused"
#else
#define LANE_FUSED 0
#define LANE_HOW ", not fused"
#endif

/* ---- one row for each width: a b + c, c - a b, both of singles too, singles of two rooms, root, sets of lanes as bits, a where a > b (a < b), else b */

#if defined(__x86_64__) || defined(__i386__)
#include <immintrin.h>
#endif
#if MECH_LANE_WIDTH == 8 && defined(__AVX512F__)
#define LANE_NAME "AVX-512"
LANE V lane_fma(V a, V b, V c) { return _mm512_fmadd_pd(a, b, c); }
LANE V lane_fnma(V a, V b, V c) { return _mm512_fnmadd_pd(a, b, c); }
LANE S single_fma(S a, S b, S c) { return _mm512_fmadd_ps(a, b, c); }
LANE S single_fnma(S a, S b, S c) { return _mm512_fnmadd_ps(a, b, c); }
LANE S lane_joined(V a, V b)
{
    return _mm512_insertf32x8(_mm512_castps256_ps512(_mm512_cvtpd_ps(a)), _mm512_cvtpd_ps(b), 1);
}
#define LANE_JOINED
LANE V lane_sqrt(V a) { return _mm512_sqrt_pd(a); }
LANE V lane_larger(V a, V b) { return _mm512_max_pd(a, b); }
LANE V lane_smaller(V a, V b) { return _mm512_min_pd(a, b); }
#define LANE_EXTREMES
LANE unsigned lane_bits(M m) { return _mm512_movepi64_mask((__m512i)m); }
LANE M lane_set(unsigned bits) { return (M)_mm512_movm_epi64((__mmask8)bits); }
#elif MECH_LANE_WIDTH == 4 && defined(__AVX__)
#define LANE_NAME "AVX2"
#if LANE_FUSED
LANE V lane_fma(V a, V b, V c) { return _mm256_fmadd_pd(a, b, c); }
LANE V lane_fnma(V a, V b, V c) { return _mm256_fnmadd_pd(a, b, c); }
LANE S single_fma(S a, S b, S c) { return _mm256_fmadd_ps(a, b, c); }
LANE S single_fnma(S a, S b, S c) { return _mm256_fnmadd_ps(a, b, c); }
LANE S lane_joined(V a, V b) { return _mm256_set_m128(_mm256_cvtpd_ps(b), _mm256_cvtpd_ps(a)); }
#define LANE_JOINED
#else
#define LANE_IN_TWO_STEPS
#endif
LANE V lane_sqrt(V a) { return _mm256_sqrt_pd(a); }
LANE V lane_larger(V a, V b) { return _mm256_max_pd(a, b); }
LANE V lane_smaller(V a, V b) { return _mm256_min_pd(a, b); }
#define LANE_EXTREMES
LANE unsigned lane_bits(M m) { return (unsigned)_mm256_movemask_pd((__m256d)m); }
#define LANE_SET_BY_BITS
#elif MECH_LANE_WIDTH == 2 && defined(__SSE2__)
#define LANE_NAME "SSE2"
#if LANE_FUSED
LANE V lane_fma(V a, V b, V c) { return _mm_fmadd_pd(a, b, c); }
LANE V lane_fnma(V a, V b, V c) { return _mm_fnmadd_pd(a, b, c); }
LANE S single_fma(S a, S b, S c) { return _mm_fmadd_ps(a, b, c); }
LANE S single_fnma(S a, S b, S c) { return _mm_fnmadd_ps(a, b, c); }
#else
#define LANE_IN_TWO_STEPS
#endif
LANE V lane_sqrt(V a) { return _mm_sqrt_pd(a); }
LANE V lane_larger(V a, V b) { return _mm_max_pd(a, b); }
LANE V lane_smaller(V a, V b) { return _mm_min_pd(a, b); }
#define LANE_EXTREMES
LANE unsigned lane_bits(M m) { return (unsigned)_mm_movemask_pd((__m128d)m); }
#define LANE_SET_BY_BITS
#elif MECH_LANE_WIDTH == 2 && defined(__ARM_NEON) && defined(__aarch64__)
#define LANE_NAME "NEON"
#include <arm_neon.h>
LANE V lane_fma(V a, V b, V c) { return (V)vfmaq_f64((float64x2_t)c, (float64x2_t)a, (float64x2_t)b); }
LANE V lane_fnma(V a, V b, V c) { return (V)vfmsq_f64((float64x2_t)c, (float64x2_t)a, (float64x2_t)b); }
LANE S single_fma(S a, S b, S c) { return (S)vfmaq_f32((float32x4_t)c, (float32x4_t)a, (float32x4_t)b); }
LANE S single_fnma(S a, S b, S c) { return (S)vfmsq_f32((float32x4_t)c, (float32x4_t)a, (float32x4_t)b); }
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
LANE S single_fma(S a, S b, S c)
{
    for (int l = 0; l < PAIRED * WIDTH; l++) c[l] = LANE_FUSED ? fmaf(a[l], b[l], c[l]) : a[l] * b[l] + c[l];
    return c;
}
LANE S single_fnma(S a, S b, S c) { return single_fma(-a, b, c); }
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

#ifdef LANE_IN_TWO_STEPS
LANE V lane_fma(V a, V b, V c) { return a * b + c; }
LANE V lane_fnma(V a, V b, V c) { return c - a * b; }
LANE S single_fma(S a, S b, S c) { return a * b + c; }
LANE S single_fnma(S a, S b, S c) { return c - a * b; }
#endif

#ifndef LANE_JOINED
LANE S lane_joined(V a, V b)
{
    S both;
    lane_narrow(&both, 0, a);
    lane_narrow(&both, 1, b);
    return both;
}
#endif

#ifdef LANE_SET_BY_BITS
LANE M lane_set(unsigned bits)
{
    M m;
    for (int l = 0; l < WIDTH; l++) m[l] = -(long long)(bits >> l & 1);
    return m;
}
#endif

#endif
