/* The classical method of W. Kutta (1901) in lanes: steps of one size, for environments. A room is entered with t, dt, and `limit`,
 * the time at which the step ends. */
#ifndef MECH_LANE_RK4_H
#define MECH_LANE_RK4_H

enum { N_DENSE = 0, N_EXTRA = 0, LOOK_EVERY = 0 };
#define GROUPS (WIDTH > 1 && NY <= 16 ? 2 : 1)
#define STIFFNESS_BOUND 0
#define LANE_PLAIN 0

#include "lane_step.h"

/* Tells the lanes where an assertion does not hold. */
static void begin(mech_lane_room *r)
{
    r->troubled = lane_bits(broken(r, AT(r->t), (const V *)r->y));
}

static void attempt(mech_lane_room *rooms)
{
    V k[GROUPS][NY], x[GROUPS][NY], sum[GROUPS][NY];
    for (int g = 0; g < GROUPS; g++) rates_apart(&rooms[g], AT(rooms[g].t), (const V *)rooms[g].y, sum[g]);
    for (int stage = 1; stage <= 3; stage++) {
        const double part = stage < 3 ? 0.5 : 1, weight = stage < 3 ? 2 : 1;
        for (int g = 0; g < GROUPS; g++) {
            const mech_lane_room *r = &rooms[g];
            const V h = AT(r->dt) * part, *y = (const V *)r->y, *slope = stage == 1 ? sum[g] : k[g];
            for (int i = 0; i < NY; i++) x[g][i] = lane_fma(h, slope[i], y[i]);
            rates_apart(r, stage < 3 ? AT(r->t) + h : AT(r->limit), x[g], k[g]);
            for (int i = 0; i < NY; i++) sum[g][i] = lane_fma(lane(weight), k[g][i], sum[g][i]);
        }
    }
    for (int g = 0; g < GROUPS; g++) {
        mech_lane_room *r = &rooms[g];
        V *y = (V *)r->y;
        for (int i = 0; i < NY; i++) x[g][i] = lane_fma(AT(r->dt) / 6.0, sum[g][i], y[i]);
#if N_ROTATIONS
        normalise(x[g]);
#endif
        const M alive = lane_set(r->alive), took = finite_all(x[g]) & alive;
        for (int i = 0; i < NY; i++) y[i] = lane_pick(took, x[g][i], y[i]);
        AT(r->t) = lane_pick(took, AT(r->limit), AT(r->t));
        r->took = lane_bits(took);
        r->troubled = r->alive & ~r->took;
#if N_CHECKS
        r->troubled |= r->took & lane_bits(broken(r, AT(r->t), y));
#endif
    }
}

#endif
