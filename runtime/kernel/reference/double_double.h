/* Numbers of 106 bits as unevaluated sums of two doubles, for Taylor series of references: a few operations of the processor take
 * the place of one of 113 bits, which software does. To be compiled without contraction of products and sums.
 *
 * T. J. Dekker, A floating-point technique for extending the available precision, Numer. Math. 18, 1971; T. Ogita, S. M. Rump,
 * S. Oishi, Accurate sum and dot product, SIAM J. Sci. Comput. 26, 2005.
 */
#ifndef MECH_DOUBLE_DOUBLE_H
#define MECH_DOUBLE_DOUBLE_H

#include <math.h>

#include "model.h"

#define MECH_INLINE static inline __attribute__((always_inline))
#ifdef MECH_DD_CALLED
#define MECH_DD static __attribute__((noinline))
#else
#define MECH_DD MECH_INLINE
#endif

typedef struct mech_dd {
    double high, low;
} mech_dd;

MECH_INLINE mech_dd mech_dd_of(mech_real x)
{
    const double high = (double)x;
    return (mech_dd){high, (double)(x - (mech_real)high)};
}

/* In units of 1 / back, which is one where scale is zero. */
MECH_INLINE mech_real mech_dd_value(mech_dd a, int scale, mech_real back)
{
    const mech_real value = (mech_real)a.high + (mech_real)a.low;
    return scale ? value * back : value;
}

/* A sum whose second number is the smaller one. */
MECH_INLINE mech_dd mech_dd_quick(double a, double b)
{
    const double sum = a + b;
    return (mech_dd){sum, b - (sum - a)};
}

/* A sum of two doubles, exactly. */
MECH_INLINE mech_dd mech_dd_both(double a, double b)
{
    const double sum = a + b, part = sum - a;
    return (mech_dd){sum, (a - (sum - part)) + (b - part)};
}

MECH_DD mech_dd mech_dd_add(mech_dd a, mech_dd b)
{
    const mech_dd sum = mech_dd_both(a.high, b.high);
    return mech_dd_quick(sum.high, sum.low + (a.low + b.low));
}

MECH_INLINE mech_dd mech_dd_neg(mech_dd a) { return (mech_dd){-a.high, -a.low}; }

MECH_DD mech_dd mech_dd_sub(mech_dd a, mech_dd b) { return mech_dd_add(a, mech_dd_neg(b)); }

MECH_DD mech_dd mech_dd_mul(mech_dd a, mech_dd b)
{
    const double product = a.high * b.high;
    return mech_dd_quick(product, fma(a.high, b.high, -product) + (a.high * b.low + a.low * b.high));
}

/* 2^k */
MECH_INLINE double mech_dd_power(int k) { return ldexp(1, k); }

/* By a power of two. */
MECH_INLINE mech_dd mech_dd_scaled(mech_dd a, double power) { return (mech_dd){a.high * power, a.low * power}; }

/* s / k */
MECH_INLINE mech_dd mech_dd_share(double s, int k)
{
    const double high = s / k;
    return (mech_dd){high, fma(-high, k, s) / k};
}

/* Of all slots A_1 B_(k-1) + ... + A_(k-1) B_1. Row j begins at rows + 4 j slots: high and low parts of A_j, then of B_j. Errors of
 * products and sums are added up beside them. */
MECH_INLINE void mech_dd_sums(int k, const double *rows, int slots, mech_dd *sums)
{
    enum { WIDE = 8 };
    for (int at = 0; at < slots; at += WIDE) {
        double high[WIDE] = {0}, low[WIDE] = {0};
        for (int j = 1; j < k; j++) {
            const double *a = rows + 4 * j * slots + at, *b = rows + (4 * (k - j) + 2) * slots + at;
            for (int i = 0; i < WIDE; i++) {
                const double product = a[i] * b[i], sum = high[i] + product, part = sum - high[i];
                const double rest = (high[i] - (sum - part)) + (product - part);
                low[i] += rest + (fma(a[i], b[i], -product) + (a[i] * b[slots + i] + a[slots + i] * b[i]));
                high[i] = sum;
            }
        }
        for (int i = 0; i < WIDE; i++) sums[at + i] = mech_dd_quick(high[i], low[i]);
    }
}

enum { MECH_DD_PILOT = 12 };

/* The power of two in units of which time is measured, so that coefficients neither grow nor fall out of range: from the largest of
 * orders 1 to 4, 5 to 8, 9 to 12, as motions that are symmetric in time lack two of four orders. Where one of these is left with
 * rounding alone, the other pair tells. x: coefficients of n states up to MECH_DD_PILOT, in rows of a stride. */
MECH_INLINE int mech_dd_scale(const mech_real *x, int n, int stride)
{
    double largest[3] = {0}, steepest = -INFINITY;
    for (int k = 0; k < MECH_DD_PILOT; k++)
        for (int i = 0; i < n; i++) largest[k / 4] = fmax(largest[k / 4], fabs((double)x[(k + 1) * stride + i]));
    for (int k = 0; k < 2; k++)
        if (largest[k] > 0 && largest[k + 1] > 0)
            steepest = fmax(steepest, (log2(largest[k + 1]) - log2(largest[k])) / 4);
    return isfinite(steepest) ? -(int)lrint(steepest) : 0;
}

#endif
