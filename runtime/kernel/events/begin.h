/* The start of a run with events. Internal to the kernel. */
#ifndef MECH_BEGIN_H
#define MECH_BEGIN_H

#include "run.h"

/* Switches, sizes and held conditions where nothing has happened yet. */
int mech_begin_look(mech_solver *s);
/* Looks, the first time; then what happens at the present time. */
int mech_begin_events(mech_solver *s);
/* The same, then ready for a step. */
int mech_begin_run(mech_solver *s);

#endif
