/* The point nearest to a guess that fulfils rows: damped Gauss-Newton. Internal to the kernel. */
#ifndef MECH_NEAREST_H
#define MECH_NEAREST_H

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
    int *hard, *soft;        /* rows of this stage                                               */
    int *loose;              /* [n_loose] of the velocities: what may move                       */
    int *free;               /* [n_free] of these: what something moves at this step             */
    int *reached;            /* [nv] whether something moves it                                  */
    mech_real *guess;        /* [ny]                                                             */
    mech_real *weights;      /* [nv] one over the size of each coordinate                        */
    mech_real *shares;       /* [n_rows] weights of wishes                                       */
    mech_point here, there;
    mech_real *scale;        /* [n_rows] of a hard row: the largest entry of its gradient, over sizes */
    mech_real *d, *step, *work;
    int *order;
} mech_task;

/* Numbers and integers that `work` and `order` have room for. */
size_t mech_nearest_numbers(const mech_model *model);
size_t mech_nearest_integers(const mech_model *model);

/* Fills values, Jacobian and deviation of a point from its y. */
void mech_look(const mech_task *task, mech_point *point);

/* Goes from here.y to the nearest point; 1 where all hard rows vanish there, else 0. `worst`: the largest residual
   as a length over the characteristic one, `row` where, `steps` taken. */
int mech_nearest(mech_task *task, mech_real *worst, int *row, int *steps);

#endif
