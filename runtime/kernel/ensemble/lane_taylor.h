/* Taylor's method in lanes: methods/taylor.c for the model that is included before, with `series_start`, and `series_next` and
 * `series_sums` of which compiler/targets/lane_series.py says how they lie in memory: row k of the coefficients begins with those of
 * order k of the state, behind which stand those of order k - 1 of the sides of the slots.
 *
 * Lanes may have different tolerances, and so different orders: all go to the highest, and each reads the terms of its own.
 */
#ifndef MECH_LANE_TAYLOR_H
#define MECH_LANE_TAYLOR_H

enum { LEAST = 6, MOST = 31, LAST = 4, N_DENSE = MOST + 1, LOOK_EVERY = 0 };
/* Of the extra numbers: what each order reads, then the rows of coefficients. */
enum { N_HELD = NY + N_SERIES_KEPT, N_EXTRA = N_HELD + (MOST + 1) * N_ROWS };
#define GROUPS 1 /* the coefficients of two do not stay near */
#define STIFFNESS_BOUND 0
#define LANE_PLAIN 1

#include "lane_step.h"

/* Orders for each factor e of the tolerance, as in the scalar kernel. Measured: 0.6 and 1.0 cost more for the same error. */
static MECH_FIXED double ORDERS = 0.8;
/* Residuals at the end of a good step, in errors that its last coefficients let expect. */
static MECH_FIXED double RESIDUAL = 10.0;

/* The order of a lane, from its tolerance. */
LANE V orders(const mech_lane_room *r)
{
    V order;
    for (int l = 0; l < WIDTH; l++) {
        const double wanted = ceil(ORDERS * -log(r->rtol[l] > MECH_EPSILON ? r->rtol[l] : MECH_EPSILON));
        LANE_OF(order, l) = wanted <= LEAST ? LEAST : wanted >= MOST ? MOST : wanted;
    }
    return order;
}

static void begin(mech_lane_room *r)
{
    const M fresh = lane_set(r->fresh);
    V found[N_HELD], *held = (V *)r->extra, *dy = (V *)r->dy;
    series_start(AT(r->t), (const V *)r->y, NULL, (const V *)r->z, (const V *)r->p, found);
    for (int i = 0; i < N_HELD; i++) held[i] = lane_pick(fresh, found[i], held[i]);
    for (int i = 0; i < NY; i++) dy[i] = held[i];
    AT(r->order) = lane_pick(fresh, orders(r), AT(r->order));
    begin_with(r, fresh, AT(r->longest));
}

/* A step under way in the lanes of one room. */
typedef struct work {
    V (*x)[N_ROWS], *held; /* coefficients, what all orders read */
    V weight[NY], slope[NY], y_new[NY], found[N_HELD], later[N_BEHIND + 1]; /* `later`: sums that are begun */
    trial step;
    int most, least; /* orders of lanes that hold a member */
} work;

static void begin_series(const mech_lane_room *r, work *w)
{
    const V *y = (const V *)r->y;
    w->held = (V *)r->extra;
    w->x = (V(*)[N_ROWS])(w->held + N_HELD);
    w->most = LEAST;
    w->least = MOST;
    for (int l = 0; l < WIDTH; l++)
        if (r->alive >> l & 1) {
            const int here = (int)r->order[l];
            if (here > w->most) w->most = here;
            if (here < w->least) w->least = here;
        }
    for (int i = 0; i < NY; i++) {
        w->x[0][i] = y[i];
        w->x[1][i] = w->held[i];
        w->weight[i] = 1.0 / lane_fma(AT(r->rtol), lane_abs(y[i]), ((const V *)r->atol)[i]);
    }
}

LANE void next_order(const mech_lane_room *r, work *w, int k)
{
    V sums[N_BEHIND + 3];
    series_sums(k, (const V(*)[N_ROWS])w->x, sums, w->later);
    sums[N_BEHIND] = lane(1.0 / k);
    sums[N_BEHIND + 1] = lane(k == 1);
    sums[N_BEHIND + 2] = lane(1.0 / (k + 1));
    series_next(lane(k), w->x[k], sums, w->held + NY, (const V *)r->p, w->x[k + 1]);
}

/* Leaves out of each lane what is beyond its order. */
static void cut(const mech_lane_room *r, work *w)
{
    for (int k = w->least + 1; k <= w->most; k++)
        for (int i = 0; i < NY; i++) w->x[k][i] = lane_pick(AT(r->order) >= (double)k, w->x[k][i], lane(0));
}

/* The longest step over which none of the last terms is larger than an error allowed. */
static void suggest(mech_lane_room *r, const work *w)
{
    const V order = AT(r->order);
    V least = lane(INFINITY); /* logarithms: one power serves all */
    for (int k = w->most; k > w->least - LAST; k--) {
        V size = lane(0);
        for (int i = 0; i < NY; i++) {
            const V here = lane_abs(w->x[k][i]) * w->weight[i];
            size = lane_larger(size, here);
        }
        const M counts = (order >= (double)k) & (order < (double)(k + LAST)) & lane_finite(size) & (size > 0.0);
        least = lane_pick(counts, lane_smaller(least, lane_rough_log2(size) * (-1.0 / k)), least);
    }
    AT(r->dt) = lane_smaller(lane_smaller(AT(r->dt), AT(r->longest)), lane_rough_exp2(least));
}

static void reach_end(mech_lane_room *r, work *w)
{
    w->step = next_trial(r);
    for (int i = 0; i < NY; i++) {
        V sum = lane(0), rate = lane(0);
        for (int k = w->most; k >= 0; k--) {
            rate = lane_fma(rate, w->step.h, sum);
            sum = lane_fma(sum, w->step.h, w->x[k][i]);
        }
        w->y_new[i] = sum;
        w->slope[i] = rate;
    }
#if N_ROTATIONS
    normalise(w->y_new);
#endif
    series_start(w->step.t_new, w->y_new, NULL, (const V *)r->z, (const V *)r->p, w->found);
}

/* The error is how far the polynomial at its end is off the equations, over what its last coefficients let expect. */
static void judge(mech_lane_room *r, work *w)
{
    const V order = AT(r->order), h = w->step.h;
    V off = lane(0);
    for (int i = 0; i < NY; i++) {
        const V residual = lane_abs(w->slope[i] - w->found[i]) * w->weight[i];
        off = lane_pick(residual <= off, off, residual);
    }
    const V error = h * off / ((order + 1.0) * RESIDUAL);
    const M good = error <= 1.0, took = good & lane_set(r->alive);
    r->terms = w->most + 1;
    if (lane_bits(wants_dense(r, &w->step) & took)) {
        V *c = (V *)r->dense, power = lane(1);
        for (int k = 0; k <= w->most; k++, power *= h)
            for (int i = 0; i < NY; i++) c[k * NY + i] = w->x[k][i] * power;
        if (r->watched) sample(r, &w->step, r->terms);
    }
    r->looked = 0;
    V factor = lane(0.25);
    const unsigned shorter = lane_bits((error > 1.0) & lane_finite(error));
    for (int l = 0; shorter >> l; l++) /* rare, and of another power in each lane */
        if (shorter >> l & 1) {
            const double wanted = 0.9 * pow(LANE_OF(error, l), -1.0 / (LANE_OF(order, l) + 1));
            LANE_OF(factor, l) = wanted < 0.2 ? 0.2 : wanted;
        }
    for (int i = 0; i < N_HELD; i++) w->held[i] = lane_pick(took, w->found[i], w->held[i]);
    take(r, &w->step, good, error, AT(r->longest), h * factor, w->y_new, w->found);
}

static void attempt(mech_lane_room *r)
{
    work w;
    begin_series(r, &w);
    for (int k = 1; k < w.most; k++) next_order(r, &w, k);
    cut(r, &w);
    suggest(r, &w);
    reach_end(r, &w);
    judge(r, &w);
}

#endif
