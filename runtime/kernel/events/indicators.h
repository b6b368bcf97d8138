/* Indicators of events, w >= 0 as long as the modes hold. Internal to the kernel. */
#ifndef MECH_INDICATORS_H
#define MECH_INDICATORS_H

#include "event_state.h"

/* w and, where asked for, dw/dt at a state. */
void mech_indicators_read(mech_solver *s, mech_real t, const mech_real *y, mech_real *w, mech_real *rate);
/* The state at a part of the attempted step, as far as indicator k reads it. */
void mech_indicator_place(mech_solver *s, int k, mech_real part, mech_real *y);
/* The same, of which at least that of indicator k is known afterwards. */
void mech_indicator_read(mech_solver *s, int k, mech_real t, const mech_real *y, mech_real *w, mech_real *rate);
/* 1 where w vanishes up to rounding. */
int mech_indicator_at_zero(const mech_solver *s, int k, mech_real w);
/* The largest size so far of what indicator k measures in its present mode. */
mech_real *mech_indicator_size(const mech_solver *s, int k);
/* Lets it grow to |w|; of forces of a crowd mech_rows_weigh does. */
void mech_indicator_widen(mech_solver *s, int k, mech_real w);
/* Lets the sizes of switch k and of its rate grow until their tolerances cover the rounding of their terms, whose size is the
 * sum of |y dw/dy| over the state: a difference of equal terms is rounding. */
void mech_indicator_widen_by_terms(mech_solver *s, int k, mech_real t, const mech_real *y);
/* Of w, up to which it vanishes: forces are differences of larger ones. */
mech_real mech_indicator_tolerance(const mech_solver *s, int k);

#endif
