/* From one accepted step to the next. Internal to the kernel. */
#ifndef MECH_STEP_H
#define MECH_STEP_H

#include "run.h"

/* Checks and makes ready; the derivative at the present time is known after it. */
int mech_step_start(mech_solver *s);

/* An attempt of a step, no further than `limit`, repeated with smaller steps until it succeeds: y_new and
   dy_new at t_new = t + h. */
int mech_step_try(mech_solver *s, mech_real limit, mech_real *t_new, mech_real *h);

/* Takes what was attempted as done: the step from t to t_new, of which dy_new is known. */
int mech_step_accept(mech_solver *s, mech_real t_new, mech_real h);

#endif
