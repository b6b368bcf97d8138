/* Taylor's method one run at a time (taylor.c) and in lanes (ensemble/lane_taylor.h): the orders that a tolerance asks for, what the
 * end of a step is compared with, and how a step is cut.
 */
#ifndef MECH_TAYLOR_H
#define MECH_TAYLOR_H

#include "real.h"

/* The lowest order, and how many of the last coefficients a step follows from. */
enum { LEAST = 6, LAST = 4 };

/* Residuals at the end of a good step, in errors that its last coefficients let expect. */
#define RESIDUAL MECH_C(10.0)

/* `share`: orders for each factor e of the tolerance. */
static inline int mech_taylor_order(mech_real rtol, mech_real share, int most)
{
    const mech_real orders = share * -mech_log(mech_max(rtol, MECH_EPSILON));
    return orders <= LEAST ? LEAST : orders >= most ? most : (int)orders + ((int)orders < orders);
}

/* The part of a step that is tried after an error above one. */
static inline mech_real mech_taylor_part(mech_real error, int order)
{
    return mech_max(MECH_C(0.2), MECH_C(0.9) * mech_pow(error, MECH_C(-1.0) / (order + 1)));
}

#endif
