/* Which rows rest beside those that hold (shares.h). Internal to the kernel. */
#ifndef MECH_CONTACT_RESTS_H
#define MECH_CONTACT_RESTS_H

#include "rows.h"

/* Marks them in z, where the model tells their share of a load. */
void mech_contact_rests_mark(mech_solver *s);

#endif
