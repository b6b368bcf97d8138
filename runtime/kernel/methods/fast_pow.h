/* Powers for the control of steps, to some five digits: the logarithm of the fraction of a double by a polynomial of Chebyshev, which
 * is 1.6e-5 off at most, the power by its series. As in ensemble/lane_numbers.h. */
#ifndef MECH_ROUGH_H
#define MECH_ROUGH_H

#include <math.h>
#include <stdint.h>
#include <string.h>

/* Of a finite x > 0. */
static inline double mech_rough_log2(double x)
{
    uint64_t bits;
    if (!(x >= 0x1p-1022)) return log2(x);
    memcpy(&bits, &x, sizeof bits);
    const double k = (double)((int64_t)(bits >> 52) - 1023);
    bits = (bits & 0xfffffffffffffu) | 0x3ff0000000000000u;
    double m;
    memcpy(&m, &bits, sizeof m);
    const double low = 5.04785541344135746 * m - 2.78792620730404308, middle = 1.58947429497570359 * m - 3.48987855068486998;
    const double high = 0.0430049577918845579 * m - 0.402513393549149253;
    return k + (low + m * m * (middle + m * m * high));
}

static inline double mech_rough_exp2(double x)
{
    if (!(x > -1000 && x < 1000)) return exp2(x);
    const double whole = floor(x + 0.5), f = (x - whole) * 0.6931471805599453;
    const uint64_t bits = (uint64_t)((int64_t)whole + 1023) << 52;
    double power;
    memcpy(&power, &bits, sizeof power);
    return power * (1 + f * (1 + f * (0.5 + f * (1.0 / 6 + f * (1.0 / 24 + f / 120)))));
}

#endif
