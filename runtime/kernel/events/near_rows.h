/* Rows of a crowd, each of which is moved only by those near it in the list: systems of them, and what may not pull.
 *
 * Of row i, e->first[i] is the first that moves it (window.c lists what touches each other close together). Internal to
 * the kernel.
 */
#ifndef MECH_NEAR_ROWS_H
#define MECH_NEAR_ROWS_H

#include "event_state.h"

/* x of a[n][n] x = b for the rows in `set`, which rise; dependent rows get 0. Gives the rank. */
int mech_near_rows_solve(mech_solver *s, int n, const int *set, const mech_real *target, mech_real *x);

/* Rows that are independent of each other, in the order in which they were added. */
typedef struct mech_near_rows_basis {
    int n, row[MECH_MOST_ROWS], first[MECH_MOST_ROWS], at[MECH_MOST_ROWS];
    mech_real pivot[MECH_MOST_ROWS];
} mech_near_rows_basis;

/* Adds row i, if it is independent of those added before. */
int mech_near_rows_add(mech_solver *s, mech_near_rows_basis *basis, int i);

/* A problem of complementarity: x >= 0, W x + q >= 0, one of them zero in each of the n rows of `set`, which rise; of rows
 * that are held W x + q = 0, and x has either sign. */
typedef struct mech_near_rows_problem {
    int n, set[MECH_MOST_ROWS];
    mech_real q[MECH_MOST_ROWS], x[MECH_MOST_ROWS];
    mech_real slack[MECH_MOST_ROWS]; /* W x + q may be negative by so much, x by `weak`                        */
    mech_real weak[MECH_MOST_ROWS];
    int in[MECH_MOST_ROWS];          /* 1: x is that of a system of rows, else zero; a guess before            */
    int held[MECH_MOST_ROWS];
} mech_near_rows_problem;

/* Solves it; 0 where it has no solution. Rows give way by a little (MECH_EASE), so that those that depend on each other share:
 * of all x nearly the least. */
int mech_near_rows_complement(mech_solver *s, mech_near_rows_problem *problem);

#endif
