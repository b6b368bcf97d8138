/* Stepping with events. Internal to the kernel. */
#ifndef MECH_HYBRID_H
#define MECH_HYBRID_H

#include "run.h"

int mech_hybrid_advance(mech_solver *s, mech_real t_end, long max_steps);

#endif
