/* Inputs of a model: its own defaults, and tables in place of them. Internal to the kernel. */
#ifndef MECH_INPUTS_H
#define MECH_INPUTS_H

#include "solver.h"

/* Row i with t[i] <= t < t[i + 1]; -1 before the first. */
int mech_segment(const mech_table *table, mech_real t);

/* All inputs at t. `segments` fixes the row of each table, so that a step sees one smooth piece up to its
   end; NULL: by search, right-continuous. */
void mech_inputs(const mech_model *model, const mech_table *tables, int n_tables, const int *segments,
                 mech_real t, const mech_real *p, mech_real *u);

#endif
