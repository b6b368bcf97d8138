/* How long explicit steps may be for stability's sake, and whether that bounds them. */
#ifndef MECH_STABILITY_H
#define MECH_STABILITY_H

#include "run.h"

/* After a good step of an explicit method, before its stages are gone: whether such have been bounded for long. Asks for a
 * measurement where it may be near. */
int mech_stability_stiff(mech_solver *s, mech_real h);

/* After a good step of an implicit method: whether an explicit one could have taken such for long. */
int mech_stability_calm(mech_solver *s, mech_real h);

/* The next step, or the longest stable one. */
mech_real mech_stability_bounded(mech_solver *s, mech_real next);

/* With the step of h accepted: how fast the derivative changes where it changes fastest. The stages are overwritten. */
void mech_stability_measure(mech_solver *s, mech_real h);

#endif
