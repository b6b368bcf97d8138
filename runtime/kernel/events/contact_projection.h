/* States moved onto rows, by the response of the velocities to impulses. Internal to the kernel. */
#ifndef MECH_CONTACT_PROJECTION_H
#define MECH_CONTACT_PROJECTION_H

#include "rows.h"

/* The rows that hold or stick; gives their number. */
int mech_contact_projection_rows(const mech_solver *s, int *held);
/* Moves the present state onto them: rounding errors only, as a rule. */
void mech_contact_projection_state(mech_solver *s);
/* events->move[nq]: how coordinates move along d[nv] in the place of velocities, of which q' is an affine function: what is
 * driven by its rate moves by itself. */
void mech_contact_projection_move(mech_solver *s, const mech_real *d);
/* Moves coordinates so that the gaps of n rows vanish; velocities so that their rates do, or are as `aim` says. */
void mech_contact_projection_close_gaps(mech_solver *s, int n, const int *rows);
void mech_contact_projection_stop_rates(mech_solver *s, int n, const int *rows);
void mech_contact_projection_set_rates(mech_solver *s, int n, const int *rows, const mech_real *aim);

#endif
