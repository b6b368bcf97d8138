/* Branches of events: `when` and what it does. Internal to the kernel. */
#ifndef MECH_BRANCHES_H
#define MECH_BRANCHES_H

#include "run.h"

/* out[n_branches]: the conditions at present. */
void mech_branches_read(mech_solver *s, mech_real *out);
/* Those of events below zero act where their conditions hold: what the start alone decides, before it is looked at. */
int mech_branches_begin(mech_solver *s);
/* Fires those of the branches from first to last - 1 whose conditions have risen: the first one of each event. scheduled: the instant was known before, as
   that of a clock. *changed: the number of the last one, from 1. */
int mech_branches_fire(mech_solver *s, int first, int last, int scheduled, int *changed);
/* Whether a condition has begun to hold within a step that solved for contacts; those that have ceased to are noted. */
int mech_branches_rise(mech_solver *s);
/* Notes those that hold when such steps begin: they fire once they have ceased to. */
void mech_branches_hold(mech_solver *s);

#endif
