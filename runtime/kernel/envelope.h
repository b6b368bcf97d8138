/* Linear equations whose rows have entries from a first one on to the diagonal: the envelope of a sparse matrix.
 *
 * Factors stay inside it, without exchanges of rows. The entries of row i left of its diagonal stand at at[i] + first[i]
 * up to at[i] + i - 1, those above the diagonal in column i the same way in `upper`; diagonals stand in d. Both generated
 * code and the kernel include this file.
 */
#ifndef MECH_ENVELOPE_H
#define MECH_ENVELOPE_H

#include "real.h"

/* Share of its diagonal below which a pivot is rounding: its row depends on those before it. */
#define MECH_DEPENDENT MECH_C(1e-11)

/* Share of its own response by which a contact of a crowd gives way to its force, before what that leaves is taken away
 * once more: contacts that depend on each other share their force then, and it grows no larger than its root says, where
 * they nearly do. */
#define MECH_EASE MECH_C(1e-10)

/* Places of rows; gives how many entries there are. */
static inline int mech_envelope_places(int n, const int *first, int *at)
{
    int entries = 0;
    for (int i = 0; i < n; i++) {
        at[i] = entries - first[i];
        entries += i - first[i];
    }
    return entries;
}

static inline mech_real mech_envelope_dot(const mech_real *a, const mech_real *b, int n)
{
    mech_real s0 = 0, s1 = 0, s2 = 0, s3 = 0;
    int k = 0;
    for (; k + 4 <= n; k += 4) {
        s0 += a[k] * b[k];
        s1 += a[k + 1] * b[k + 1];
        s2 += a[k + 2] * b[k + 2];
        s3 += a[k + 3] * b[k + 3];
    }
    for (; k < n; k++) s0 += a[k] * b[k];
    return (s0 + s1) + (s2 + s3);
}

/* One row of the factors L D L^T: entries become those of L, d[i] its pivot, 0 where it is less than a share of its diagonal:
 * the row depends on those before it. */
static inline int mech_envelope_row(int i, const int *first, const int *at, mech_real share, mech_real *a, mech_real *d)
{
    mech_real *row = a + at[i];
    const mech_real least = share * d[i];
    for (int j = first[i]; j < i; j++) {
        const int from = first[i] > first[j] ? first[i] : first[j];
        if (from < j) row[j] -= mech_envelope_dot(a + at[j] + from, row + from, j - from);
    }
    for (int j = first[i]; j < i; j++) {
        const mech_real u = row[j];
        row[j] = d[j] != 0 ? u / d[j] : 0;
        d[i] -= row[j] * u;
    }
    if (d[i] <= least) d[i] = 0;
    return d[i] != 0;
}

/* Factors of a symmetric matrix without negative eigenvalues; gives its rank. */
static inline int mech_envelope_factor(int n, const int *first, const int *at, mech_real share, mech_real *a, mech_real *d)
{
    int rank = 0;
    for (int i = 0; i < n; i++) rank += mech_envelope_row(i, first, at, share, a, d);
    return rank;
}

/* x of L D L^T x = b, b in its place; 0 for dependent rows. */
static inline void mech_envelope_solve(int n, const int *first, const int *at, const mech_real *a, const mech_real *d,
                                       mech_real *x)
{
    for (int i = 0; i < n; i++)
        x[i] = d[i] != 0 ? x[i] - mech_envelope_dot(a + at[i] + first[i], x + first[i], i - first[i]) : 0;
    for (int i = 0; i < n; i++)
        if (d[i] != 0) x[i] /= d[i];
    for (int i = n - 1; i >= 0; i--)
        for (int j = first[i]; d[i] != 0 && j < i; j++) x[j] -= a[at[i] + j] * x[i];
    for (int i = 0; i < n; i++)
        if (d[i] == 0) x[i] = 0;
}

/* Factors L U of a matrix that is not symmetric; 0 where a pivot is so small that rows ought to be exchanged. */
static inline int mech_envelope_factor_lu(int n, const int *first, const int *at, mech_real *lower, mech_real *upper,
                                          mech_real *d)
{
    for (int i = 0; i < n; i++) {
        mech_real *row = lower + at[i], *column = upper + at[i];
        const mech_real least = MECH_C(1e-6) * mech_abs(d[i]);
        for (int j = first[i]; j < i; j++) {
            const int from = first[i] > first[j] ? first[i] : first[j];
            if (from < j) {
                row[j] -= mech_envelope_dot(row + from, upper + at[j] + from, j - from);
                column[j] -= mech_envelope_dot(lower + at[j] + from, column + from, j - from);
            }
            row[j] /= d[j];
        }
        d[i] -= mech_envelope_dot(row + first[i], column + first[i], i - first[i]);
        if (!(mech_abs(d[i]) > least)) return 0; /* what is not a number, too */
    }
    return 1;
}

static inline void mech_envelope_solve_lu(int n, const int *first, const int *at, const mech_real *lower,
                                          const mech_real *upper, const mech_real *d, mech_real *x)
{
    for (int i = 0; i < n; i++) x[i] -= mech_envelope_dot(lower + at[i] + first[i], x + first[i], i - first[i]);
    for (int i = n - 1; i >= 0; i--) {
        x[i] /= d[i];
        for (int j = first[i]; j < i; j++) x[j] -= upper[at[i] + j] * x[i];
    }
}

#endif
