/* What acts between rows of a run at which nothing moves. */
#ifndef MECH_RESTS_H
#define MECH_RESTS_H

#include "model.h"
#include "solver.h"

/* moved[n][each]: whether a rate differs from `rates` [n][ny] by more than `slow` [ny] at `each` places, evenly spread over a
   stretch that begins at t[n], y[n][ny], is as long as length[n], and follows these rates. `z` has z_step numbers for each
   stretch, 0: one row for all. work[nu + 2 ny]. */
MECH_API void mech_moved(const mech_model *model, const mech_table *tables, int n_tables, long n, long each,
                         const mech_real *t, const mech_real *length, const mech_real *y, const mech_real *rates,
                         const mech_real *z, long z_step, const mech_real *p, const mech_real *slow, mech_real *work,
                         unsigned char *moved);

#endif
