/* Which rows hold, stick, slide or are open. Internal to the kernel. */
#ifndef MECH_CONTACT_MODES_H
#define MECH_CONTACT_MODES_H

#include "run.h"

/* Finds the modes that fit, and sets them. `hit`: the row at which the present ones end, or -1. *struck: 1 where no forces fit, and
 * an impact has ended a slip instead: then they are to be chosen again. */
int mech_contact_modes_choose(mech_solver *s, int hit, int *struck);

/* Ends what rattles without progress, as where forces of contacts are about to be unbounded, by an impact: 1 where there is one, or by the
 * end of slips that are slow. */
int mech_contact_modes_end_rattle(mech_solver *s);

/* Sets the modes by the impulses of a step that has solved for contacts, and the rates that it left: what functions are told. */
void mech_contact_modes_tell(mech_solver *s, const mech_real *impulse, const mech_real *rate);

#endif
