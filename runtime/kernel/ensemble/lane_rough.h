/* Signs, sizes and rough powers, included once for each precision: N is V or S, OF(name) and NUMBER are the functions of it, MASK are
 * its bits, of which BIT is the lowest and FRACTION are those behind the point; exponents are offset by OFFSET.
 *
 * For step control: x^e for positive x to some five digits. The logarithm of the fraction by a polynomial of Chebyshev, which is
 * 1.6e-5 off at most; the power by its series.
 */
#define FRACTION_BITS ((BIT << FRACTION) - 1)
#define EXPONENT_BITS (2 * OFFSET + BIT)

LANE N OF(abs)(N x) { return OF(value)(OF(raw)(x) & (EXPONENT_BITS << FRACTION | FRACTION_BITS)); }
LANE MASK OF(finite)(N x) { return x - x == NUMBER(0); }

LANE N OF(rough_log2)(N x)
{
    const MASK bits = OF(raw)(x), whole = bits >> FRACTION & EXPONENT_BITS;
    const N k = OF(value)(whole | (OFFSET + FRACTION) * BIT << FRACTION) - NUMBER((double)(BIT << FRACTION) + OFFSET);
    const N m = OF(value)((bits & FRACTION_BITS) | OFFSET * BIT << FRACTION), m2 = m * m;
    const N low = OF(fma)(m, NUMBER(5.04785541344135746), NUMBER(-2.78792620730404308));
    const N middle = OF(fma)(m, NUMBER(1.58947429497570359), NUMBER(-3.48987855068486998));
    const N high = OF(fma)(m, NUMBER(0.0430049577918845579), NUMBER(-0.402513393549149253));
    return k + OF(fma)(m2, OF(fma)(m2, high, middle), low);
}

LANE N OF(rough_exp2)(N x)
{
    const N most = NUMBER(OFFSET - FRACTION / 2), exponent = OF(larger)(OF(smaller)(x, most), -most);
    const N shift = NUMBER(1.5 * (double)(BIT << FRACTION)), shifted = exponent + shift, whole = shifted - shift;
    const N f = (exponent - whole) * NUMBER(0.6931471805599453);
    N power = OF(fma)(f, NUMBER(1.0 / 120), NUMBER(1.0 / 24));
    power = OF(fma)(f, power, NUMBER(1.0 / 6));
    power = OF(fma)(f, power, NUMBER(0.5));
    power = OF(fma)(f, power, NUMBER(1));
    power = OF(fma)(f, power, NUMBER(1));
    return OF(value)(OF(raw)(power) + (OF(raw)(shifted) << FRACTION));
}

#undef FRACTION_BITS
#undef EXPONENT_BITS
#undef N
#undef MASK
#undef OF
#undef NUMBER
#undef BIT
#undef FRACTION
#undef OFFSET
