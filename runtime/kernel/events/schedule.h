/* Times and clocks: events that are known before. Internal to the kernel. */
#ifndef MECH_SCHEDULE_H
#define MECH_SCHEDULE_H

#include "run.h"

/* Whether `next` has come at t, but for rounding: what belongs together happens at one instant. */
int mech_schedule_due(mech_real next, mech_real t);
/* Sets the switches that depend on time alone; `ticks`: pulses of the clocks that are due. 1: any changed. */
int mech_schedule_set(mech_solver *s, int ticks);
/* Pulses end, counts go on to the next tick; gives whether there was one. */
int mech_schedule_end_ticks(mech_solver *s);
/* The first time after the present one at which something is known to happen, or infinity. */
mech_real mech_schedule_next(mech_solver *s);
/* At the start, `time > T` at T itself is false yet: sets such switches so; gives whether there is one. */
int mech_schedule_begin_before(mech_solver *s);
/* At the start: a clock goes on with its count, its period is positive; ticks before the start are over. */
int mech_schedule_check(mech_solver *s);
void mech_schedule_pass(mech_solver *s);

#endif
