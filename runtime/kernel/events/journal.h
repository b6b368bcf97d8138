/* What is told of events: solver.h, mech_event and the instants. Internal to the kernel. */
#ifndef MECH_JOURNAL_H
#define MECH_JOURNAL_H

#include "run.h"

void mech_journal_note(mech_solver *s, int kind, int index, mech_real value);
/* Tells the changes of modes since it was called last; `quiet`: only remembers them. */
void mech_journal_modes(mech_solver *s, int quiet);
/* Both sides of the present instant. */
void mech_journal_instant(mech_solver *s);

#endif
