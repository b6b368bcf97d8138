/* Which rows rest beside those that hold (shares.h). Internal to the kernel. */
#ifndef MECH_CONTACT_RESTS_H
#define MECH_CONTACT_RESTS_H

#include "rows.h"

/* Marks them in z, where the model tells their share of a load. */
void mech_contact_rests_mark(mech_solver *s);

/* Whether a friction slides in the modes, at no speed, on what the rows that hold keep at rest: it bears its limit of their load. The
 * rows and their responses were found last. */
int mech_contact_rests_any_slide(mech_solver *s);

#endif
