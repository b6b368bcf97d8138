/* Accelerations, and impacts, as a contact problem (cones.h). Internal to the kernel. */
#ifndef MECH_CONTACT_CONES_H
#define MECH_CONTACT_CONES_H

#include "rows.h"

/* What presses, sticks and slides, of all rows at hand that touch and rest, from a fresh solution of their contact problem: written
 * to the choices of events->open and events->slides. `ends` was located where its mode ends, or is -1. Gives 0 where the
 * problem has no solution. The responses were found last. */
int mech_contact_cones_choose(mech_solver *s, int ends);

/* Whether the problem has a solution at which all that holds rests: the least loads of the rows that hold, and of those that they
 * depend on, lie in their cones, whatever single ones of them would have to carry. */
int mech_contact_cones_hold(mech_solver *s);

/* Whether the limits of frictions are those without any forces: the losses of a gear follow what it carries, and the problem does not
 * say how that is shared. */
int mech_contact_cones_know_limits(mech_solver *s);

/* Whether the modes whose rows were read last move all that touches as a solution does, and press what slides as it does. Then they
 * differ from it only in how rows that do not slide share the loads. */
int mech_contact_cones_move_alike(mech_solver *s);

/* One blow of all that touches, or of the n contacts `among` that, where not NULL: its impulses in events->impulse, of contacts that
 * approach with these restitutions, by row. Friction acts against the slip that is left. Where Newton's restitution would raise the
 * energy, Poisson's: each impulse is that of the plastic impact, times one more than the restitution; with one restitution this
 * takes out energy as long as friction does. Gives 0 where the problem is not solved. */
int mech_contact_cones_strike(mech_solver *s, const mech_real *restitution, int n, const int *among);

/* An impact without an approach, of contacts that slide and that no force can hold (P. Painleve 1895, F. Genot and B. Brogliato 1999): it
 * goes on until slips have turned, or ended, so that forces can hold them. Impulses in events->impulse; gives 0 where there are none. */
int mech_contact_cones_shock(mech_solver *s);

#endif
