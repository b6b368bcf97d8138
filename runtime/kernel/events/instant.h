/* What happens at the present time. Internal to the kernel. */
#ifndef MECH_INSTANT_H
#define MECH_INSTANT_H

#include "run.h"

/* `hit`: the indicator that was located, or -1. */
int mech_instant(mech_solver *s, int hit);
/* The same without a step before or behind it. `ticks`: pulses of the clocks that are due. */
int mech_instant_happen(mech_solver *s, int hit, int ticks);

#endif
