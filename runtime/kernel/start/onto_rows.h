/* Rows at a point, and the shortest steps onto them. Internal to the kernel. */
#ifndef MECH_ONTO_ROWS_H
#define MECH_ONTO_ROWS_H

#include "orthogonal.h"

/* A state, and the rows there with their Jacobian and the deviation from the guess. */
typedef struct mech_point {
    mech_real *y, *values, *jacobian, *deviation;
} mech_point;

/* One stage of an assembly. */
typedef struct mech_task {
    const mech_model *model;
    mech_real t;
    const mech_real *u, *z, *p;
    int stage, n_hard, n_soft, n_loose, n_free;
    int settled;             /* whether the search ended at the nearest state, as far as rounding tells */
    int *hard, *soft;        /* rows of this stage                                               */
    int *loose;              /* [n_loose] of the velocities: what may move                       */
    int *free;               /* [n_free] of these: what something moves at this step             */
    int *reached;            /* [nv] whether something moves it                                  */
    mech_real *guess;        /* [ny]                                                             */
    mech_real *first, *best; /* [ny] where a search began, and the closest state of several          */
    mech_real length;        /* the characteristic one                                           */
    mech_real *weights;      /* [nv] one over the size of each coordinate                        */
    mech_real *shares;       /* [n_rows] weights of wishes                                       */
    mech_point here, there;
    mech_real *scale;        /* [n_rows] of a hard row: the largest entry of its gradient, over sizes */
    mech_real *d, *step, *work;
    int *order;
} mech_task;

/* Where the parts of `work` lie: factors of the gradients' transpose and of their range. */
typedef struct mech_factors {
    mech_orthogonal across, range;
    mech_real *rest;
    int *order;
} mech_factors;

/* Largest residual, as a share of a characteristic size, that counts as none; longest step in characteristic sizes. */
#define MECH_FULFILLED MECH_C(1e-11)
#define MECH_LONGEST MECH_C(0.5)

/* Fills values, Jacobian and deviation of a point from its y. */
void mech_look(const mech_task *task, mech_point *point);

/* y = from, moved by d[nv]. */
void mech_go(const mech_task *task, const mech_real *from, const mech_real *d, mech_real *y);

mech_real mech_scale_of(const mech_task *task, int row);

/* The largest residual of the hard rows, not-a-number where there is one, and its `row` unless that is NULL. */
mech_real mech_worst_of(const mech_task *task, const mech_point *at, int *row);

/* The entry of a gradient at a point in scaled directions. */
mech_real mech_entry(const mech_task *task, const mech_point *at, int row, int f);

/* Leaves free what is away from its guess, and what rows connect with that or with a row that is off. */
void mech_find_free(mech_task *task);

/* Factorises the gradients of the hard rows, [n_free][n_hard] after scaling, and their range; 0 where something is not
   finite. */
int mech_factor_rows(const mech_task *task, mech_factors *x);

/* step[n_free] = the shortest one in scaled directions that fulfils the linearised hard rows. */
void mech_onto(const mech_task *task, mech_factors *x, mech_real *step);

/* forward[range.rank] = the multipliers, in the axes of the range, of a pull in those of the factors. */
void mech_multiply_back(const mech_factors *x, int n_hard, const mech_real *pull, mech_real *forward);

mech_real mech_largest(const mech_real *x, int n);

/* there = here moved by a factor of the step; looks around there. */
void mech_try_step(mech_task *task, mech_real factor);

/* Exchanges here and there. */
void mech_take(mech_task *task);

/* Goes on by the shortest steps onto the rows alone, halved where they lead away, as far as rounding allows. Returns the
   steps. */
int mech_restore(mech_task *task);

#endif
