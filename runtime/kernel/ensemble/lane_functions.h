/* Elementary functions of vectors.
 *
 * Largest errors measured on random points, in units of the last place: sin and cos 1.5 (up to 1e9), tan 3.0, exp 1.0,
 * log 0.8, tanh 1.5, atan 1.0, atan2 1.7; all others are those of the C library, lane by lane, and so are these beyond the ranges that they are made for.
 * Lanes beside one that is beyond keep their values.
 *
 * W. J. Cody, W. Waite, Software Manual for the Elementary Functions, 1980, for the reduction of the arguments; the
 * polynomials of sin and cos are minimax ones by the exchange of E. Remez, that of log is of FDLIBM (Sun Microsystems, 1993), the
 * quotients of tanh and atan of Cephes (S. L. Moshier, 1984).
 */
#ifndef MECH_LANE_FUNCTIONS_H
#define MECH_LANE_FUNCTIONS_H

#include "lane_numbers.h"

/* ---- by the C library, one lane after the other */

#define LANE_BY_LANE(NAME, FUNCTION)                                       \
    static __attribute__((noinline, unused)) V lane_##NAME(V x)            \
    {                                                                      \
        for (int l = 0; l < WIDTH; l++) LANE_OF(x, l) = FUNCTION(LANE_OF(x, l)); \
        return x;                                                          \
    }
#define LANE_BY_LANE_OF_TWO(NAME, FUNCTION)                                \
    static __attribute__((noinline, unused)) V lane_##NAME(V x, V y)       \
    {                                                                      \
        for (int l = 0; l < WIDTH; l++) LANE_OF(x, l) = FUNCTION(LANE_OF(x, l), LANE_OF(y, l)); \
        return x;                                                          \
    }
/* The same for the lanes of a set; the others keep what they have. */
#define LANE_FAR(NAME, FUNCTION)                                                             \
    static __attribute__((noinline, cold, unused)) V lane_far_##NAME(M far, V x, V near)     \
    {                                                                                        \
        for (int l = 0; l < WIDTH; l++)                                                      \
            if (LANE_OF(far, l) & 1) LANE_OF(near, l) = FUNCTION(LANE_OF(x, l));             \
        return near;                                                                         \
    }

LANE_BY_LANE(asin, asin)
LANE_BY_LANE(acos, acos)
LANE_BY_LANE(sinh, sinh)
LANE_BY_LANE(cosh, cosh)
LANE_BY_LANE(asinh, asinh)
LANE_BY_LANE(acosh, acosh)
LANE_BY_LANE(atanh, atanh)
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
LANE_BY_LANE(tanh, tanh)
LANE_BY_LANE(atan, atan)
LANE_BY_LANE_OF_TWO(atan2, atan2)
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

#include "sincos.h"

LANE void lane_sincos(V x, V *s, V *c)
{
    lane_near_sincos(x, s, c);
    const M far = lane_abs(x) > MECH_TURN_LIMIT;
    if (LANE_RARELY(lane_bits(far))) {
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
    return LANE_RARELY(lane_bits(far)) ? lane_far_tan(far, x, near) : near;
}

/* ---- exponential: x = n log 2 + r, its series up to r^13, which is 4e-18 of it */

static MECH_FIXED double LANE_EXP[] = {1.0 / 479001600, 1.0 / 39916800, 1.0 / 3628800, 1.0 / 362880, 1.0 / 40320,
                                       1.0 / 5040,      1.0 / 720,      1.0 / 120,     1.0 / 24,     1.0 / 6, 0.5};

LANE V lane_exp(V x)
{
    const V shift = lane(0x1.8p52), shifted = lane_fma(x, lane(0x1.71547652b82fep+0), shift), n = shifted - shift;
    const V r = lane_fnma(n, lane(0x1.abc9e3b39803fp-56), lane_fnma(n, lane(0x1.62e42fefa39efp-1), x));
    V sum = lane(1.0 / 6227020800.0);
    for (int k = 0; k < 11; k++) sum = lane_fma(sum, r, lane(LANE_EXP[k]));
    sum = lane_fma(r * r, sum, r) + 1.0;
    const M far = ~(lane_abs(x) < 700.0);
    const V near = lane_value(lane_raw(sum) + (lane_raw(shifted) << 52));
    return LANE_RARELY(lane_bits(far)) ? lane_far_exp(far, x, near) : near;
}

/* ---- logarithm: x = 2^k (1 + f), 1 + f between the root of one half and that of two; s = f / (2 + f) */

static MECH_FIXED double LANE_LOG[] = {1.479819860511658591e-01, 1.531383769920937332e-01, 1.818357216161805012e-01,
                                       2.222219843214978396e-01, 2.857142874366239149e-01, 3.999999999940941908e-01,
                                       6.666666666666735130e-01};

LANE V lane_log(V x)
{
    const M bits = lane_raw(x), high = (bits & LANE_BITS(0xfffffffffffff)) > LANE_BITS(0x6a09e667f3bcd); /* those of the root of two */
    const V m = lane_value(((bits & LANE_BITS(0xfffffffffffff)) | LANE_BITS(0x3ff0000000000000)) -
                           (lane_all(high) & LANE_BITS(0x10000000000000)));
    const V k = lane_value((bits >> 52 & 0x7ff) | LANE_BITS(0x4330000000000000)) - (0x1p52 + 1023.0) + lane_number(high);
    const V f = m - 1.0, s = f / (m + 1.0), z = s * s, halved = 0.5 * f * f;
    V sum = lane(LANE_LOG[0]);
    for (int j = 1; j < 7; j++) sum = lane_fma(sum, z, lane(LANE_LOG[j]));
    const V rest = lane_fma(s, lane_fma(z, sum, halved), k * 1.90821492927058770002e-10);
    const V near = lane_fma(k, lane(6.93147180369123816490e-01), f - (halved - rest));
    const M far = ~((x >= 0x1p-1022) & (x <= 0x1.fffffffffffffp1023));
    return LANE_RARELY(lane_bits(far)) ? lane_far_log(far, x, near) : near;
}

/* ---- hyperbolic tangent: x + x z P(z)/Q(z), z = x^2, up to 0.625; beyond 1 - 2/(1 + exp 2x), which is 1 from 22 on */

LANE V lane_tanh(V x)
{
    const V a = lane_abs(x), z = a * a;
    const V p = lane_fma(z, lane_fma(z, lane(-9.64399179425052238628e-1), lane(-9.92877231001918586564e1)),
                         lane(-1.61468768441708447952e3));
    const V q = lane_fma(z, lane_fma(z, z + 1.12811678491632931402e2, lane(2.23548839060100448583e3)),
                         lane(4.84406305325125486048e3));
    const V twice = 2.0 * a, power = lane_exp(lane_pick(twice > 44.0, lane(44), twice));
    const V near = lane_pick(a < 0.625, lane_fma(a * z, p / q, a), 1.0 - 2.0 / (power + 1.0));
    return lane_with_sign(near, x);
}

/* ---- arc tangent of y/x, neither negative: q + q z P(z)/Q(z), z = q^2, of y/x up to 0.66, of (y - x)/(y + x) up to 1 + sqrt 2 */

static MECH_FIXED double LANE_ARC[] = {-8.750608600031904122785e-1, -1.615753718733365076637e1, -7.500855792314704667340e1,
                                       -1.228866684490136173410e2, -6.485021904942025371773e1};
static MECH_FIXED double LANE_ARC_BELOW[] = {2.485846490142306297962e1, 1.650270098316988542046e2, 4.328810604912902668951e2,
                                             4.853903996359136964868e2, 1.945506571482613964425e2};

LANE V lane_arc(V y, V x)
{
    const M flat = y <= 0.66 * x, steep = y > 2.41421356237309504880 * x;
    const V above = lane_pick(steep, -x, lane_pick(flat, y, y - x)), below = lane_pick(steep, y, lane_pick(flat, x, y + x));
    const V from = lane_pick(steep, lane(0x1.921fb54442d18p+0), lane_pick(flat, lane(0), lane(0x1.921fb54442d18p-1)));
    const V rest = lane_pick(steep, lane(0x1.1a62633145c07p-54), lane_pick(flat, lane(0), lane(0x1.1a62633145c07p-55)));
    const V q = above / below, z = q * q;
    V numerator = lane(LANE_ARC[0]), denominator = z + LANE_ARC_BELOW[0];
    for (int k = 1; k < 5; k++) {
        numerator = lane_fma(numerator, z, lane(LANE_ARC[k]));
        denominator = lane_fma(denominator, z, lane(LANE_ARC_BELOW[k]));
    }
    return from + (lane_fma(q * z, numerator / denominator, q) + rest);
}

LANE V lane_atan(V x) { return lane_with_sign(lane_arc(lane_abs(x), lane(1)), x); }

static __attribute__((noinline, cold, unused)) V lane_far_atan2(M far, V y, V x, V near)
{
    for (int l = 0; l < WIDTH; l++)
        if (LANE_OF(far, l) & 1) LANE_OF(near, l) = atan2(LANE_OF(y, l), LANE_OF(x, l));
    return near;
}

LANE V lane_atan2(V y, V x)
{
    const V a = lane_abs(y), b = lane_abs(x), arc = lane_arc(a, b);
    const V behind = (0x1.921fb54442d18p+1 - arc) + 0x1.1a62633145c07p-53;
    const V near = lane_with_sign(lane_pick(x < 0.0, behind, arc), y);
    const M far = ~((a <= 1e300) & (b <= 1e300) & ((a >= 1e-290) | (b >= 1e-290)));
    return LANE_RARELY(lane_bits(far)) ? lane_far_atan2(far, y, x, near) : near;
}
#endif

#endif
