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

/* By a power of two. */
MECH_INLINE mech_dd mech_dd_scaled(mech_dd a, double power) { return (mech_dd){a.high * power, a.low * power}; }

/* s / k */
MECH_INLINE mech_dd mech_dd_share(double s, int k)
{
    const double high = s / k;
    return (mech_dd){high, fma(-high, k, s) / k};
}

/* ---- eight slots at a time (series.h): errors of products and sums are added up beside them */

typedef struct mech_lanes {
    double high[MECH_LANES], low[MECH_LANES];
} mech_lanes;

MECH_INLINE void mech_dd_add_products(mech_lanes *sum, const mech_lanes *a, const mech_lanes *b)
{
    for (int i = 0; i < MECH_LANES; i++) {
        const double product = a->high[i] * b->high[i];
        const mech_dd both = mech_dd_both(sum->high[i], product);
        const double rest = fma(a->high[i], b->high[i], -product) + (a->high[i] * b->low[i] + a->low[i] * b->high[i]);
        sum->high[i] = both.high;
        sum->low[i] += both.low + rest;
    }
}

MECH_INLINE void mech_dd_add_lanes(mech_lanes *sum, const mech_lanes *more)
{
    for (int i = 0; i < MECH_LANES; i++) {
        const mech_dd both = mech_dd_both(sum->high[i], more->high[i]);
        sum->high[i] = both.high;
        sum->low[i] += both.low + more->low[i];
    }
}

#define MECH_SERIES_ADD(sum, a, b) mech_dd_add_products(&(sum), &(a), &(b))
#define MECH_SERIES_JOIN(sum, more) mech_dd_add_lanes(&(sum), &(more))
#include "series.h"

/* ---- all orders */

typedef void mech_dd_next(mech_dd t, const mech_dd *y, const mech_dd *u, const mech_dd *z, const mech_dd *p, mech_dd *out);

/* Coefficients of n states from order 2 up to a given one, formed for time in units of 2^scale. */
static inline void mech_dd_orders(mech_dd_next *next, int n, int n_slots, int order, int scale, const mech_dd *kept,
                                  const mech_dd *p, mech_real *restrict x, mech_real *restrict rows)
{
    const int states = (n + MECH_LANES - 1) / MECH_LANES * MECH_LANES;
    const int slots = (n_slots + MECH_LANES - 1) / MECH_LANES * MECH_LANES;
    mech_dd y[states], u[slots + 2], out[states + 2 * slots];
    mech_lanes *blocks = (mech_lanes *)rows;
    const double unit = ldexp(1, scale);
    mech_real back = (mech_real)1 / (mech_real)unit;
    for (int i = 0; i < n; i++) y[i] = mech_dd_scaled(mech_dd_of(x[states + i]), unit);
    for (int k = 1; k < order; k++) {
        mech_series_sums(1, k, rows, slots, 2 * slots, rows);
        for (int i = 0; i < slots; i++)
            u[i] = mech_dd_quick(blocks[i / MECH_LANES].high[i % MECH_LANES], blocks[i / MECH_LANES].low[i % MECH_LANES]);
        u[slots] = mech_dd_share(1, k);
        u[slots + 1] = (mech_dd){k == 1 ? unit : 0, 0};
        next((mech_dd){k, 0}, y, u, kept, p, out);
        mech_lanes *row = blocks + 2 * slots / MECH_LANES * k;
        for (int i = 0; i < 2 * slots; i++) {
            row[i / MECH_LANES].high[i % MECH_LANES] = out[states + i].high;
            row[i / MECH_LANES].low[i % MECH_LANES] = out[states + i].low;
        }
        const mech_dd share = mech_dd_share(unit, k + 1);
        back /= (mech_real)unit;
        for (int i = 0; i < n; i++) {
            y[i] = mech_dd_mul(out[i], share);
            x[states * (k + 1) + i] = mech_dd_value(y[i], scale, back);
        }
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

/* Defines a mech_expansion by the `next` of a model. Two sweeps: a short one finds the unit of time. */
#define MECH_DD_EXPANSION(name, next, n, n_slots, n_kept, n_p)                                                        \
    static void name(int order, const mech_real *kept, const mech_real *p, mech_real *x, mech_real *rows)             \
    {                                                                                                                 \
        mech_dd kept_dd[(n_kept) + 1], p_dd[(n_p) + 1];                                                               \
        for (int i = 0; i < (n_kept); i++) kept_dd[i] = mech_dd_of(kept[i]);                                          \
        for (int i = 0; i < (n_p); i++) p_dd[i] = mech_dd_of(p[i]);                                                   \
        mech_dd_orders(next, n, n_slots, MECH_DD_PILOT, 0, kept_dd, p_dd, x, rows);                                   \
        const int scale = mech_dd_scale(x, n, ((n) + MECH_LANES - 1) / MECH_LANES * MECH_LANES);                      \
        mech_dd_orders(next, n, n_slots, order, scale, kept_dd, p_dd, x, rows);                                       \
    }

#endif
