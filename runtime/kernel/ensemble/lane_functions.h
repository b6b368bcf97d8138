/* Elementary functions of vectors.
 *
 * Largest errors measured on random points, in units of the last place: sin and cos 1.5 (up to 1e9), tan 3.0, exp 1.0,
 * log 0.8; all others are those of the C library, lane by lane, and so are these beyond the ranges that they are made for.
 * Lanes beside one that is beyond keep their values.
 *
 * W. J. Cody, W. Waite, Software Manual for the Elementary Functions, 1980, for the reduction of the arguments; the
 * polynomials of sin and cos are minimax ones by the exchange of E. Remez, that of log is of FDLIBM (Sun Microsystems, 1993).
 */
#ifndef MECH_LANE_FUNCTIONS_H
#define MECH_LANE_FUNCTIONS_H

#include "lane_numbers.h"

/* ---- by the C library, one lane after the other */

#define LANE_BY_LANE(NAME, FUNCTION)                                       \
    static __attribute__((noinline, unused)) V lane_##NAME(V x)            \
    {                                                                      \
        for (int l = 0; l < WIDTH; l++) x[l] = FUNCTION(x[l]);             \
        return x;                                                          \
    }
#define LANE_BY_LANE_OF_TWO(NAME, FUNCTION)                                \
    static __attribute__((noinline, unused)) V lane_##NAME(V x, V y)       \
    {                                                                      \
        for (int l = 0; l < WIDTH; l++) x[l] = FUNCTION(x[l], y[l]);       \
        return x;                                                          \
    }
/* The same for the lanes of a set; the others keep what they have. */
#define LANE_FAR(NAME, FUNCTION)                                                             \
    static __attribute__((noinline, cold, unused)) V lane_far_##NAME(M far, V x, V near)     \
    {                                                                                        \
        for (int l = 0; l < WIDTH; l++)                                                      \
            if (far[l]) near[l] = FUNCTION(x[l]);                                            \
        return near;                                                                         \
    }

LANE_BY_LANE(asin, asin)
LANE_BY_LANE(acos, acos)
LANE_BY_LANE(atan, atan)
LANE_BY_LANE(sinh, sinh)
LANE_BY_LANE(cosh, cosh)
LANE_BY_LANE(tanh, tanh)
LANE_BY_LANE(asinh, asinh)
LANE_BY_LANE(acosh, acosh)
LANE_BY_LANE(atanh, atanh)
LANE_BY_LANE_OF_TWO(atan2, atan2)
LANE_BY_LANE_OF_TWO(pow, pow)

static inline double lane_one_modulo(double a, double b)
{
    const double r = fmod(a, b);
    return r != 0 && (r < 0) != (b < 0) ? r + b : r == 0 ? copysign(r, b) : r;
}
LANE_BY_LANE_OF_TWO(modulo, lane_one_modulo)

#if !LANE_FUSED
LANE_BY_LANE(sin, sin)
LANE_BY_LANE(cos, cos)
LANE_BY_LANE(tan, tan)
LANE_BY_LANE(exp, exp)
LANE_BY_LANE(log, log)
LANE void lane_sincos(V x, V *s, V *c)
{
    *s = lane_sin(x);
    *c = lane_cos(x);
}
#else

LANE_FAR(sin, sin)
LANE_FAR(cos, cos)
LANE_FAR(tan, tan)
LANE_FAR(exp, exp)
LANE_FAR(log, log)

/* ---- sine and cosine */

#include "turn.h"

LANE void lane_sincos(V x, V *s, V *c)
{
    lane_near_sincos(x, s, c);
    const M far = lane_abs(x) > MECH_TURN_LIMIT;
    if (__builtin_expect(lane_bits(far), 0)) {
        *s = lane_far_sin(far, x, *s);
        *c = lane_far_cos(far, x, *c);
    }
}

LANE V lane_sin(V x)
{
    V s, c;
    lane_sincos(x, &s, &c);
    return s;
}

LANE V lane_cos(V x)
{
    V s, c;
    lane_sincos(x, &s, &c);
    return c;
}

LANE V lane_tan(V x)
{
    V s, c;
    lane_near_sincos(x, &s, &c);
    const M far = lane_abs(x) > MECH_TURN_LIMIT;
    const V near = s / c;
    return __builtin_expect(lane_bits(far), 0) ? lane_far_tan(far, x, near) : near;
}

/* ---- exponential: x = n log 2 + r, its series up to r^13, which is 4e-18 of it */

LANE V lane_exp(V x)
{
    const V shift = lane(0x1.8p52), shifted = lane_fma(x, lane(0x1.71547652b82fep+0), shift), n = shifted - shift;
    const V r = lane_fnma(n, lane(0x1.abc9e3b39803fp-56), lane_fnma(n, lane(0x1.62e42fefa39efp-1), x));
    static const double one_over[] = {1.0 / 479001600, 1.0 / 39916800, 1.0 / 3628800, 1.0 / 362880, 1.0 / 40320,
                                      1.0 / 5040,      1.0 / 720,      1.0 / 120,     1.0 / 24,     1.0 / 6, 0.5};
    V sum = lane(1.0 / 6227020800.0);
    for (int k = 0; k < 11; k++) sum = lane_fma(sum, r, lane(one_over[k]));
    sum = lane_fma(r * r, sum, r) + 1.0;
    const M far = ~(lane_abs(x) < 700.0);
    const V near = (V)((M)sum + ((M)shifted << 52));
    return __builtin_expect(lane_bits(far), 0) ? lane_far_exp(far, x, near) : near;
}

/* ---- logarithm: x = 2^k (1 + f), 1 + f between the root of one half and that of two; s = f / (2 + f) */

LANE V lane_log(V x)
{
    const M bits = (M)x, high = (bits & 0xfffffffffffffLL) > 0x6a09e667f3bcdLL; /* those of the root of two */
    const V m = (V)(((bits & 0xfffffffffffffLL) | 0x3ff0000000000000LL) - (high & 0x10000000000000LL));
    const V k = (V)((bits >> 52 & 0x7ff) | 0x4330000000000000LL) - (0x1p52 + 1023.0) + lane_number(high);
    static const double c[] = {1.479819860511658591e-01, 1.531383769920937332e-01, 1.818357216161805012e-01,
                               2.222219843214978396e-01, 2.857142874366239149e-01, 3.999999999940941908e-01,
                               6.666666666666735130e-01};
    const V f = m - 1.0, s = f / (m + 1.0), z = s * s, half = 0.5 * f * f;
    V sum = lane(c[0]);
    for (int j = 1; j < 7; j++) sum = lane_fma(sum, z, lane(c[j]));
    const V rest = lane_fma(s, lane_fma(z, sum, half), k * 1.90821492927058770002e-10);
    const V near = lane_fma(k, lane(6.93147180369123816490e-01), f - (half - rest));
    const M far = ~((x >= 0x1p-1022) & (x <= 0x1.fffffffffffffp1023));
    return __builtin_expect(lane_bits(far), 0) ? lane_far_log(far, x, near) : near;
}
#endif

#endif
