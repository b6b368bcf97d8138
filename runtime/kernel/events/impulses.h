/* One blow: the impulses of the contacts that hit at once. Internal to the kernel. */
#ifndef MECH_IMPULSES_H
#define MECH_IMPULSES_H

#include "run.h"

/* The contact that approaches fastest, with all that approach as fast. */
int mech_impulse_fastest(mech_solver *s, int contact);
/* All that touch in a crowd: `of_crowd`: of contacts without friction at hand; `with_friction`: where some have it; there `contact`
   hits alone where the others have no common solution. */
int mech_impulse_of_crowd(mech_solver *s);
int mech_impulse_with_friction(mech_solver *s, int contact);
/* Whether row i is a constraint that is engaged. */
int mech_impulse_holds(const mech_solver *s, int i);
/* Restitution of a contact that approaches: none where the rebound would be slower than the contact rests, or where
 * it would not rise above what rounding leaves of the gap. */
mech_real mech_impulse_restitution(mech_solver *s, int i);
void mech_impulse_set(mech_solver *s, int n, const int *set, const mech_real *x);

#endif
