/* For callers who integrate themselves. Internal to the kernel. */
#ifndef MECH_OVERSHOOT_H
#define MECH_OVERSHOOT_H

#include "run.h"

/* Puts back a state that has left what holds, gone beyond the surface of an open contact, or beyond the end of a slip.
 * Gives by how much the present time went back with it. */
mech_real mech_overshoot_go_back(mech_solver *s);
/* After what happened there: on again by that much, unless a contact comes back sooner. The present time stays. */
void mech_overshoot_go_on(mech_solver *s, mech_real time);

#endif
