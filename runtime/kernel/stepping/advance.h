/* Parts of stepping that runs with events share. Internal to the kernel. */
#ifndef MECH_ADVANCE_H
#define MECH_ADVANCE_H

#include "method.h"

int mech_fail(mech_solver *s, int status, int index);
/* Checks and makes ready; the derivative at the present time is known after it. */
int mech_start(mech_solver *s);
/* Takes up the motion from a state or a piece that begins at the present time. */
int mech_enter_pieces(mech_solver *s);
/* An attempt of a step, no further than `limit`, repeated with smaller steps until it succeeds: y_new and
   dy_new at t_new = t + h. */
int mech_try_step(mech_solver *s, mech_real limit, mech_real *t_new, mech_real *h);
/* Takes what was attempted as done. */
int mech_accept(mech_solver *s, mech_real t_new, mech_real h);
int mech_check_assertions(mech_solver *s);

#endif
