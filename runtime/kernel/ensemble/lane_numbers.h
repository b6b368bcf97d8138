/* Numbers of lanes and the functions of them that generated lanes call: of vectors, or of one member on a device.
 *
 * Both files give V (numbers), M (where something holds), what is written of them one by one, and what vectors have no operator
 * for. What follows here is made of that.
 */
#ifndef MECH_LANE_NUMBERS_H
#define MECH_LANE_NUMBERS_H

#if defined(__OPENCL_VERSION__)
#include "item_numbers.h"
#else
#include "lane_vectors.h"
#endif

/* ---- numbers and choices */

LANE V lane_abs(V x) { return lane_value(lane_raw(x) & LANE_BITS(0x7fffffffffffffff)); }
LANE V lane_with_sign(V size, V x) { return lane_value(lane_raw(size) | (lane_raw(x) & ~LANE_BITS(0x7fffffffffffffff))); }
#ifndef LANE_EXTREMES
LANE V lane_larger(V a, V b) { return lane_pick(a > b, a, b); }
LANE V lane_smaller(V a, V b) { return lane_pick(a < b, a, b); }
#endif
LANE M lane_finite(V x) { return x - x == 0.0; }

/* As the functions of the same names in the C text of a model. */
LANE V lane_minimum(V a, V b) { return lane_pick((a < b) | (a != a), a, b); }
LANE V lane_maximum(V a, V b) { return lane_pick((a > b) | (a != a), a, b); }
LANE V lane_sign(V x) { return lane_pick(x > 0.0, lane(1), lane_pick(x < 0.0, lane(-1), x)); }

/* The next whole number below; what is 2^52 or more is whole. */
LANE V lane_floor(V x)
{
    const V shift = lane(0x1p52), a = lane_abs(x), near = (a + shift) - shift;
    const V whole = lane_with_sign(near, x);
    return lane_pick(a < shift, lane_with_sign(whole - lane_number(whole > x), x), x);
}

/* ---- step control: x^e for positive x to some five digits. The logarithm of the fraction by a polynomial of Chebyshev, which is
 * 1.6e-5 off at most; the power by its series. */

LANE V lane_rough_log2(V x)
{
    const M bits = lane_raw(x);
    const V k = lane_value((bits >> 52 & 0x7ff) | LANE_BITS(0x4330000000000000)) - (0x1p52 + 1023.0);
    const V m = lane_value((bits & LANE_BITS(0xfffffffffffff)) | LANE_BITS(0x3ff0000000000000)), m2 = m * m;
    const V low = lane_fma(m, lane(5.04785541344135746), lane(-2.78792620730404308));
    const V middle = lane_fma(m, lane(1.58947429497570359), lane(-3.48987855068486998));
    const V high = lane_fma(m, lane(0.0430049577918845579), lane(-0.402513393549149253));
    return k + lane_fma(m2, lane_fma(m2, high, middle), low);
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
    return lane_value(lane_raw(power) + (lane_raw(shifted) << 52));
}

/* The same of singles. */
LANE S single_rough_log2(S x)
{
    const SM bits = single_raw(x);
    const S k = single_value((bits >> 23 & 0xff) | 0x4b000000) - (0x1p23f + 127.0f);
    const S m = single_value((bits & 0x7fffff) | 0x3f800000), m2 = m * m;
    const S low = single_fma(m, single(5.04785541344135746), single(-2.78792620730404308));
    const S middle = single_fma(m, single(1.58947429497570359), single(-3.48987855068486998));
    const S high = single_fma(m, single(0.0430049577918845579), single(-0.402513393549149253));
    return k + single_fma(m2, single_fma(m2, high, middle), low);
}

LANE S single_rough_exp2(S x)
{
    const S inside = single_pick(x < 100.0f, x, single(100)), exponent = single_pick(inside > -100.0f, inside, single(-100));
    const S shifted = exponent + 0x1.8p23f, whole = shifted - 0x1.8p23f, f = (exponent - whole) * 0.693147181f;
    S power = single_fma(f, single(1.0 / 120), single(1.0 / 24));
    power = single_fma(f, power, single(1.0 / 6));
    power = single_fma(f, power, single(0.5));
    power = single_fma(f, power, single(1));
    power = single_fma(f, power, single(1));
    return single_value(single_raw(power) + (single_raw(shifted) << 23));
}

LANE V lane_rough_power(V x, double e) { return lane_rough_exp2(lane_rough_log2(x) * e); }

#endif
