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

LANE V lane_with_sign(V size, V x) { return lane_value(lane_raw(size) | (lane_raw(x) & ~LANE_BITS(0x7fffffffffffffff))); }
#ifndef LANE_EXTREMES
LANE V lane_larger(V a, V b) { return lane_pick(a > b, a, b); }
LANE V lane_smaller(V a, V b) { return lane_pick(a < b, a, b); }
#endif
LANE S single_larger(S a, S b) { return single_pick(a > b, a, b); }
LANE S single_smaller(S a, S b) { return single_pick(a < b, a, b); }

#define N V
#define MASK M
#define OF(name) lane_##name
#define NUMBER lane
#define BIT LANE_BITS(0x1)
#define FRACTION 52
#define OFFSET 1023
#include "lane_rough.h"

#define N S
#define MASK SM
#define OF(name) single_##name
#define NUMBER single
#define BIT 1
#define FRACTION 23
#define OFFSET 127
#include "lane_rough.h"

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

LANE V lane_rough_power(V x, double e) { return lane_rough_exp2(lane_rough_log2(x) * e); }

#endif
