/* The point nearest to a guess that fulfils rows: damped Gauss-Newton. Internal to the kernel. */
#ifndef MECH_NEAREST_H
#define MECH_NEAREST_H

#include "onto_rows.h"

/* Numbers and integers that `work` and `order` have room for. */
size_t mech_nearest_numbers(const mech_model *model);
size_t mech_nearest_integers(const mech_model *model);

/* Goes from here.y to the nearest point; 1 where all hard rows vanish there, else 0. `worst`: the largest residual
   as a length over the characteristic one, `row` where, `steps` taken. */
int mech_nearest(mech_task *task, mech_real *worst, int *row, int *steps);

#endif
