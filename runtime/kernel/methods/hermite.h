/* Dense output of a step from its ends alone. Internal to the kernel. */
#ifndef MECH_HERMITE_H
#define MECH_HERMITE_H

#include "method.h"

/* Of order 3: the first four coefficients of every method. */
static inline void mech_hermite(mech_solver *s, mech_real h)
{
    const int n = s->ny;
    mech_real *c = s->dense;
    for (int i = 0; i < n; i++) {
        mech_real d = s->y_new[i] - s->y[i], b = h * s->dy[i] - d;
        c[i] = s->y[i];
        c[n + i] = d;
        c[2 * n + i] = b;
        c[3 * n + i] = d - h * s->dy_new[i] - b;
    }
}

/* Six coefficients of the dense output where q' = v, from the ends of the step. */
void mech_quintic(mech_solver *s, mech_real h);

#endif
