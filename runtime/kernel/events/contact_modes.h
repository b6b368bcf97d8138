/* Which rows hold, stick, slide or are open. Internal to the kernel. */
#ifndef MECH_CONTACT_MODES_H
#define MECH_CONTACT_MODES_H

#include "run.h"

/* Finds the modes that fit, and sets them. `hit`: the row at which the present ones end, or -1. */
int mech_contact_modes_choose(mech_solver *s, int hit);

#endif
