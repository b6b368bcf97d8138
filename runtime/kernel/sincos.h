/* Sine and cosine of a vector of numbers: x = n pi/2 + r, and polynomials in r.
 *
 * Included where V (a vector of doubles, or a double), M (one of 64-bit integers of the same size), LANE, lane(x),
 * lane_fma(a, b, c) = a b + c, lane_fnma(a, b, c) = c - a b, each rounded once, lane_pick(m, a, b), lane_raw(x) and lane_value(m),
 * the same bits as M and as V, and MECH_FIXED, which qualifies constants in memory, are defined.
 *
 * Largest error 1.5 units of the last place up to MECH_TURN_LIMIT, also beside the multiples of pi/2. The first product is
 * exact with what it is taken from, as its bits reach from 2^-53 to 1; three terms of pi/2 hold 161 bits. The sine of -0 is 0.
 *
 * W. J. Cody, W. Waite, Software Manual for the Elementary Functions, 1980, for the reduction; the polynomials are minimax ones by
 * the exchange of E. Remez.
 */
#ifndef MECH_TURN_H
#define MECH_TURN_H

#define MECH_TURN_LIMIT 1e9

/* Polynomials in z = r^2 on [0, (pi/4)^2]: sin r = r + r z S(z) to 3.5e-18, cos r = 1 - z/2 + z^2 C(z) to 5e-20. */
static MECH_FIXED double LANE_SIN[] = {-0x1.5555555555549p-3, 0x1.111111110f87ap-7,  -0x1.a01a019c11978p-13,
                                  0x1.71de3577b56b1p-19, -0x1.ae5e6639d428fp-26, 0x1.5d9300cf18813p-33};
static MECH_FIXED double LANE_COS[] = {0x1.555555555554cp-5,   -0x1.6c16c16c1517ep-10, 0x1.a01a019cb1bebp-16,
                                  -0x1.27e4f809f15ecp-22, 0x1.1ee9ebe9aae80p-29,  -0x1.8fae9cb4449ffp-37};
static MECH_FIXED double LANE_HALF_PI[] = {0x1.921fb54442d18p+0, 0x1.1a62633145c07p-54, -0x1.f1976b7ed8fbcp-110};

LANE V lane_quintic(MECH_FIXED double *c, V z, V z2, V z4)
{
    const V low = lane_fma(z, lane(c[1]), lane(c[0])), middle = lane_fma(z, lane(c[3]), lane(c[2]));
    return lane_fma(z4, lane_fma(z, lane(c[5]), lane(c[4])), lane_fma(z2, middle, low));
}

LANE void lane_near_sincos(V x, V *s, V *c)
{
    const V shift = lane(0x1.8p52);
    const V shifted = lane_fma(x, lane(0x1.45f306dc9c883p-1), shift), n = shifted - shift;
    const V near = lane_fnma(n, lane(LANE_HALF_PI[1]), lane_fnma(n, lane(LANE_HALF_PI[0]), x));
    const V r = lane_fnma(n, lane(LANE_HALF_PI[2]), near);
    const V z = r * r, z2 = z * z, z4 = z2 * z2;
    const V a = lane_fma(r * z, lane_quintic(LANE_SIN, z, z2, z4), r);
    const V w = lane_fnma(lane(0.5), z, lane(1)); /* 1 - z/2 rounded; what was lost is added */
    const V b = w + lane_fma(z2, lane_quintic(LANE_COS, z, z2, z4), lane_fnma(lane(0.5), z, 1.0 - w));
    const M q = lane_raw(shifted), odd = -(q & 1); /* n modulo 4 in the low bits */
    *s = lane_value(lane_raw(lane_pick(odd, b, a)) ^ (q & 2) << 62);
    *c = lane_value(lane_raw(lane_pick(odd, a, b)) ^ ((q + 1) & 2) << 62);
}

#endif
