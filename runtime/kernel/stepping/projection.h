/* States and the constraints. Internal to the kernel. */
#ifndef MECH_PROJECTION_H
#define MECH_PROJECTION_H

#include "run.h"

/* Moves y onto the constraints at time t: 0, or MECH_OFF_CONSTRAINTS. */
int mech_project(mech_solver *s, mech_real t, mech_real *y);

/* Whether a step should not end at y at time t, as a singular position is too near and another end can be had.
   Asked once for each step that would be accepted: it counts. */
int mech_too_close(mech_solver *s, mech_real t, const mech_real *y, const mech_real *from);

#endif
