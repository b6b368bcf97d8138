/* Rows that the caller gets of a step (solver.h, points 4 and 6). Internal to the kernel. */
#ifndef MECH_OUTPUT_H
#define MECH_OUTPUT_H

#include "run.h"

/* Rows of the grid up to t_new, the end of the attempted step of h, of which dense is filled. */
void mech_output_grid(mech_solver *s, mech_real t_new, mech_real h);

/* A record of the step. */
void mech_output_record(mech_solver *s, mech_real h);

#endif
