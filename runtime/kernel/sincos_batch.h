/* Sines and cosines of four angles at once, for the code of a model that is compiled for this processor.
 *
 * With AVX2 and fused operations by vectors (sincos.h), else by the C library. Builtin functions in the place of immintrin.h,
 * which takes longer to read than a small model to compile.
 */
#ifndef MECH_TURNS_H
#define MECH_TURNS_H

#include <math.h>

#if defined(_WIN32) && defined(__GNUC__) && !defined(__clang__)
/* GCC does not align the stack there */
#elif defined(__AVX2__) && defined(__FMA__) && defined(__has_builtin)
#if __has_builtin(__builtin_ia32_vfmaddpd256) && __has_builtin(__builtin_ia32_movmskpd256)
#define MECH_TURNS_FUSED(a, b, c) __builtin_ia32_vfmaddpd256(a, b, c)
#elif __has_builtin(__builtin_elementwise_fma) && __has_builtin(__builtin_ia32_movmskpd256)
#define MECH_TURNS_FUSED(a, b, c) __builtin_elementwise_fma(a, b, c)
#endif
#endif

/* turns[0..3]: sines, turns[4..7]: cosines. */
#if !defined(MECH_TURNS_FUSED)
static inline void mech_turns(double *turns, double a, double b, double c, double d)
{
    const double angles[] = {a, b, c, d};
    for (int i = 0; i < 4; i++) {
        turns[i] = sin(angles[i]);
        turns[4 + i] = cos(angles[i]);
    }
}
#else
#define LANE static inline __attribute__((always_inline))
typedef double V __attribute__((vector_size(32)));
typedef long long M __attribute__((vector_size(32)));

#define MECH_FIXED const
LANE M lane_raw(V x) { return (M)x; }
LANE V lane_value(M m) { return (V)m; }
LANE V lane(double x) { return (V){x, x, x, x}; }
LANE V lane_fma(V a, V b, V c) { return MECH_TURNS_FUSED(a, b, c); }
LANE V lane_fnma(V a, V b, V c) { return MECH_TURNS_FUSED(-a, b, c); }
LANE V lane_pick(M m, V a, V b) { return (V)((m & (M)a) | (~m & (M)b)); }

#include "sincos.h"

static __attribute__((noinline, cold)) void mech_far_turns(double *turns, V x, M far)
{
    for (int i = 0; i < 4; i++)
        if (far[i]) {
            turns[i] = sin(x[i]);
            turns[4 + i] = cos(x[i]);
        }
}

LANE void mech_turns(double *turns, double a, double b, double c, double d)
{
    const V x = {a, b, c, d};
    V sines, cosines;
    lane_near_sincos(x, &sines, &cosines);
    __builtin_memcpy(turns, &sines, sizeof sines);
    __builtin_memcpy(turns + 4, &cosines, sizeof cosines);
    const M far = (V)((M)x & 0x7fffffffffffffffLL) > MECH_TURN_LIMIT;
    if (__builtin_expect(__builtin_ia32_movmskpd256((V)far), 0)) mech_far_turns(turns, x, far);
}
#endif

/* Sines and cosines of n angles; the arrays have room for a multiple of four. */
static inline void mech_turn_row(int n, double *restrict angles, double *restrict sines, double *restrict cosines)
{
    for (int k = n; k % 4; k++) angles[k] = 0.0;
    for (int k = 0; k < n; k += 4) {
        double turns[8];
        mech_turns(turns, angles[k], angles[k + 1], angles[k + 2], angles[k + 3]);
        for (int i = 0; i < 4; i++) {
            sines[k + i] = turns[i];
            cosines[k + i] = turns[4 + i];
        }
    }
}

#endif
