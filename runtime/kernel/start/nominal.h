/* Nominal values by rules (nominal.c). Internal to the kernel, but for callers that make the first run themselves. */
#ifndef MECH_NOMINAL_H
#define MECH_NOMINAL_H

#include "start.h"

/* What the rules read. `y0` as wanted where an assembly has moved it by rounding; `rates`: dy/dt at the start. */
typedef struct mech_motion {
    const mech_model *model;
    const mech_sizes *sizes;
    const mech_real *p;
    mech_real *y0, *rates; /* [ny], without what is rounding beside others of their unit            */
    mech_real energy;      /* the largest one at the start                                        */
    mech_real duration;
} mech_motion;

/* Whether they have one unit and feel each other. */
int mech_alike(const mech_quantity *a, const mech_quantity *b);

/* nominal[ny]; `reached`: the largest size of each state in a first run, NULL before it, and `bounds` of what is far below
   others of its unit, NULL: unknown. 1 where a first run would tell more, else 0. */
int mech_nominal_rules(const mech_motion *motion, const mech_real *reached, const mech_real *bounds,
                       mech_real *nominal);

/* Zero for what is rounding beside other states, of values[ny], of its unit that it feels. */
void mech_drop_rounding(const mech_model *model, const mech_sizes *sizes, mech_real *values);

/* Fills y0, rates and energy; u[nu] and out[n_outputs] are there to work in. */
void mech_look_at_start(mech_motion *motion, const mech_options *options, const mech_real *plain, mech_real *u,
                        mech_real *out);

#endif
