/* Sums of the slots of Taylor series, eight slots at a time, for code of models with few of them (model.h, point 19).
 *
 * A slot has a lane of its own and its sum one order of additions, so that vectors of all widths give the same bits.
 */
#ifndef MECH_SERIES_H
#define MECH_SERIES_H

#include "model.h"

/* Numbers that lie otherwise (reference/double_double.h) say before what their lanes are, and how they are added up. */
#if defined(MECH_SERIES_ADD)
#elif defined(__GNUC__) && !defined(MECH_QUAD) && !defined(MECH_LONG)
#if defined(__AVX512F__)
typedef double mech_lanes __attribute__((vector_size(64)));
#define MECH_SERIES_PUT(to, a, b, c, d, e, f, g, h) ((mech_lanes *)(to))[0] = (mech_lanes){a, b, c, d, e, f, g, h}
#elif defined(__AVX__)
typedef double mech_lanes __attribute__((vector_size(32)));
#define MECH_SERIES_PUT(to, a, b, c, d, e, f, g, h) \
    ((mech_lanes *)(to))[0] = (mech_lanes){a, b, c, d}, ((mech_lanes *)(to))[1] = (mech_lanes){e, f, g, h}
#else
typedef double mech_lanes __attribute__((vector_size(16)));
#define MECH_SERIES_PUT(to, a, b, c, d, e, f, g, h) \
    ((mech_lanes *)(to))[0] = (mech_lanes){a, b}, ((mech_lanes *)(to))[1] = (mech_lanes){c, d}, \
    ((mech_lanes *)(to))[2] = (mech_lanes){e, f}, ((mech_lanes *)(to))[3] = (mech_lanes){g, h}
#endif
#else
typedef mech_real mech_lanes;
#define MECH_SERIES_PUT(to, a, b, c, d, e, f, g, h) \
    (to)[0] = a, (to)[1] = b, (to)[2] = c, (to)[3] = d, (to)[4] = e, (to)[5] = f, (to)[6] = g, (to)[7] = h
#endif

#ifndef MECH_SERIES_ADD
#define MECH_SERIES_ADD(sum, a, b) (sum) += (a) * (b)
#define MECH_SERIES_JOIN(sum, more) (sum) += (more)
#endif

#if defined(MECH_QUAD) || defined(MECH_LONG)
#define MECH_SERIES_MOST 71
#else
#define MECH_SERIES_MOST 31
#endif
enum { MECH_SERIES_WIDTH = sizeof(mech_lanes) / sizeof(mech_real) };

/* 1 / k */
#define MECH_OVER_FOUR(k) (mech_real)1 / (k), (mech_real)1 / ((k) + 1), (mech_real)1 / ((k) + 2), (mech_real)1 / ((k) + 3)
static const mech_real mech_series_over[MECH_SERIES_MOST + 2] = {
    0, MECH_OVER_FOUR(1), MECH_OVER_FOUR(5), MECH_OVER_FOUR(9), MECH_OVER_FOUR(13), MECH_OVER_FOUR(17), MECH_OVER_FOUR(21),
    MECH_OVER_FOUR(25), MECH_OVER_FOUR(29),
#if MECH_SERIES_MOST > 31
    MECH_OVER_FOUR(33), MECH_OVER_FOUR(37), MECH_OVER_FOUR(41), MECH_OVER_FOUR(45), MECH_OVER_FOUR(49), MECH_OVER_FOUR(53),
    MECH_OVER_FOUR(57), MECH_OVER_FOUR(61), MECH_OVER_FOUR(65), MECH_OVER_FOUR(69),
#endif
};

/* Models of no more slots form all orders in one loop. */
enum { MECH_FEW_SLOTS = 64 };

/* Of all slots A_first B_(k-first) + ... + A_(k-first) B_first, where A_j stand at rows + j stride, B_j behind them. What
 * was formed last is added last. */
static inline void mech_series_sums(int first, int k, const mech_real *rows, int slots, int stride, mech_real *sums)
{
    const int step = stride / MECH_SERIES_WIDTH, last = k - first;
    for (int i = 0; i < slots / MECH_SERIES_WIDTH; i++) {
        const mech_lanes *a = (const mech_lanes *)rows + i, *b = a + slots / MECH_SERIES_WIDTH;
        mech_lanes even = {0}, odd = {0};
        int j = first + 1;
        for (; j < last - 1; j += 2) {
            MECH_SERIES_ADD(even, a[step * j], b[step * (k - j)]);
            MECH_SERIES_ADD(odd, a[step * (j + 1)], b[step * (k - j - 1)]);
        }
        if (j < last) MECH_SERIES_ADD(even, a[step * j], b[step * (k - j)]);
        MECH_SERIES_JOIN(even, odd);
        if (last > first) MECH_SERIES_ADD(even, a[step * last], b[step * first]);
        if (last >= first) MECH_SERIES_ADD(even, a[step * first], b[step * last]);
        ((mech_lanes *)sums)[i] = even;
    }
}

#endif
