/* Taylor's method in lanes: methods/taylor.c for the model that is included before, with `series_start` and what lane_orders.h needs.
 * The last orders stand in the tail.
 *
 * Lanes may have different tolerances, and so different orders: all go to the highest, and each reads the terms of its own.
 */
#ifndef MECH_LANE_TAYLOR_H
#define MECH_LANE_TAYLOR_H

#include "taylor.h"

enum { MOST = 31, N_DENSE = MOST + 1, LOOK_EVERY = 0 };
/* Of the extra numbers: what each order reads, the unit of times, the last order before the tail, and steps that the tail has
 * spoiled; then the coefficients. */
enum { N_START = NY + N_SERIES_KEPT, UNIT = N_START, LOW, SPOILED, N_HELD };
enum { N_COEFFICIENTS = (MOST + 1) * N_ROWS, N_EXTRA = N_HELD + 2 * N_COEFFICIENTS + N_SERIES_KEPT + N_TAIL_P };
enum { TAIL_ORDERS = 12 }; /* at least; measured: ten and fourteen cost more for the same error */
#define GROUPS PAIRED
#define STIFFNESS_BOUND 0
#define LANE_PLAIN 1

#include "lane_step.h"

#define EACH_SLOT(DO) DO(0) DO(1) DO(2) DO(3) DO(4) DO(5) DO(6) DO(7)
enum { GROUP = 8 };

#define N V
#define MASK M
#define OF(name) lane_##name
#define NUMBER lane
#include "lane_orders.h"

#define N S
#define MASK SM
#define OF(name) single_##name
#define NUMBER single
#include "lane_orders.h"

/* Orders for each factor e of the tolerance: more than in the scalar kernel, as those of the tail cost half. Measured: 0.8 and 1.0
 * cost more for the same error. */
static MECH_FIXED double ORDERS = 0.9;

/* The order of a lane, from its tolerance. */
LANE V orders(const mech_lane_room *r)
{
    V order;
    for (int l = 0; l < WIDTH; l++) LANE_OF(order, l) = mech_taylor_order(r->rtol[l], ORDERS, MOST);
    return order;
}

LANE V first_lows(V order)
{
    for (int l = 0; l < WIDTH; l++) {
        const int before = (int)LANE_OF(order, l) - TAIL_ORDERS;
        LANE_OF(order, l) = before < 2 ? 2 : before / 2 * 2;
    }
    return order;
}

/* The power of two below a time, where that can be inverted, else another one. */
LANE V unit_of(V time, V other)
{
    const V unit = lane_value(lane_raw(time) & LANE_BITS(0x7ff0000000000000));
    return lane_pick((unit > 0x1p-1000) & (unit < 0x1p1000), unit, other);
}

static void begin(mech_lane_room *r)
{
    const M fresh = lane_set(r->fresh);
    V found[N_START], *held = (V *)r->extra, *dy = (V *)r->dy;
    series_start(AT(r->t), (const V *)r->y, NULL, (const V *)r->z, (const V *)r->p, found);
    for (int i = 0; i < N_START; i++) held[i] = lane_pick(fresh, found[i], held[i]);
    for (int i = 0; i < NY; i++) dy[i] = held[i];
    const V size = norm(r, (const V *)r->y, (const V *)r->y, NULL), rate = norm(r, (const V *)r->y, dy, NULL);
    held[UNIT] = lane_pick(fresh, unit_of(size / rate, lane(1)), held[UNIT]);
    held[LOW] = lane_pick(fresh, first_lows(orders(r)), held[LOW]);
    V spoiled = lane(0); /* numbers that singles may not hold, or products of which, let a member go without a tail */
    for (int i = 0; i < N_START; i++) {
        const V number = lane_abs(i < NY ? ((const V *)r->y)[i] : found[i]);
        spoiled = lane_pick((number > 1e12) | ((number < 1e-12) & (number > 0.0)), lane(INFINITY), spoiled);
    }
    held[SPOILED] = lane_pick(fresh, spoiled, held[SPOILED]);
    AT(r->order) = lane_pick(fresh, orders(r), AT(r->order));
    begin_with(r, fresh, AT(r->longest));
}

/* A step under way in the lanes of one room. */
typedef struct work {
    V (*x)[N_ROWS], *held;          /* coefficients, in units of powers of `unit`; what all orders read */
    V unit, over, low;              /* a power of two, one over it; the last order before the tail      */
    V scale[NY], y_new[NY], found[N_START], later[N_BEHIND + 1]; /* `later`: sums that are begun       */
    V sum[NY], rate[NY];            /* state and slope at the end of the step, of the orders so far     */
    trial step;
    int room;
} work;

/* Of all lanes that hold a member: the highest order and the lowest one, and where their tails begin. */
typedef struct span {
    int most, least, last_low, first_low;
} span;

static void widen_span(span *all, int order, int low)
{
    if (order > all->most) all->most = order;
    if (order < all->least) all->least = order;
    if (low > all->last_low) all->last_low = low;
    if (low < all->first_low) all->first_low = low;
}

#include "lane_tail.h"

static void begin_series(const mech_lane_room *r, work *w, span *all)
{
    const V *y = (const V *)r->y;
    w->held = (V *)r->extra;
    w->x = (V(*)[N_ROWS])(w->held + N_HELD);
    w->unit = w->held[UNIT];
    w->over = lane_value(LANE_BITS(0x7fe0000000000000) - lane_raw(w->unit));
    w->low = low_orders(r, w->held);
    unsigned open = r->alive;
    for (int l = 0; open; l++) /* mostly, the first lane is like all others */
        if (open >> l & 1) {
            const V order = lane(r->order[l]), low = lane(LANE_OF(w->low, l));
            widen_span(all, (int)r->order[l], (int)LANE_OF(w->low, l));
            open &= ~(1u << l) & ~lane_bits((AT(r->order) == order) & (w->low == low));
        }
    for (int i = 0; i < NY; i++) {
        w->x[0][i] = y[i];
        w->x[1][i] = w->held[i] * w->unit;
        w->scale[i] = lane_fma(AT(r->rtol), lane_abs(y[i]), ((const V *)r->atol)[i]);
        w->sum[i] = w->rate[i] = lane(0);
    }
}

/* Leaves out of each lane what is beyond its order. */
static void cut(const mech_lane_room *r, work *w, const span *all, int last)
{
    for (int k = all->least + 1; k <= last; k++)
        for (int i = 0; i < NY; i++) w->x[k][i] = lane_pick(AT(r->order) >= (double)k, w->x[k][i], lane(0));
}

static void cut_step(mech_lane_room *r, work *w, const tail *s, const span *all)
{
    V wanted = lane_widened(&s->wanted, w->room);
    if (all->last_low >= all->most) { /* of lanes without a tail */
        V weight[NY];
        for (int i = 0; i < NY; i++) weight[i] = lane_widened(&s->weight[i], w->room);
        const V whole = lane_suggested(w->x[0], weight, AT(r->order), all->most, all->least);
        wanted = lane_pick(w->low >= AT(r->order), whole, wanted);
    }
    const V longest = lane_smaller(AT(r->dt), AT(r->longest)), dt = lane_smaller(longest, wanted * w->unit);
    AT(r->dt) = dt;
    w->held[UNIT] = unit_of(dt, w->unit);
    w->step = next_trial(r);
}

/* The state at the end, and all that is known of the derivative there. */
static void reach_end(mech_lane_room *r, work *w, const span *all, int last)
{
    const V h = w->step.h * w->over;
    const int even = all->first_low == all->last_low;
    for (int i = 0; i < NY; i++) {
        V sum = w->sum[i], rate = w->rate[i];
        for (int k = last; k >= 0; k--) {
            const V next_rate = lane_fma(rate, h, sum), next_sum = lane_fma(sum, h, w->x[k][i]);
            const M here = w->low >= (double)k;
            rate = even ? next_rate : lane_pick(here, next_rate, rate);
            sum = even ? next_sum : lane_pick(here, next_sum, sum);
        }
        w->y_new[i] = sum;
        w->rate[i] = rate * w->over;
    }
#if N_ROTATIONS
    normalise(w->y_new);
#endif
    series_start(w->step.t_new, w->y_new, NULL, (const V *)r->z, (const V *)r->p, w->found);
}

/* The error is how far the polynomial at its end is off the equations, over what its last coefficients let expect. */
static void judge(mech_lane_room *r, work *w, const tail *s, const span *all)
{
    const V order = AT(r->order), h = w->step.h, part = h * w->over;
    V off = lane(0);
    for (int i = 0; i < NY; i++) {
        const V residual = lane_abs(w->rate[i] - w->found[i]) * lane_widened(&s->weight[i], w->room);
        off = lane_pick(residual <= off, off, residual);
    }
    const V error = h * off / ((order + 1.0) * RESIDUAL);
    const M good = error <= 1.0, took = good & lane_set(r->alive);
    r->terms = all->most + 1;
    if (lane_bits(wants_dense(r, &w->step) & took)) {
        V *c = (V *)r->dense, power = lane(1);
        for (int k = 0; k <= all->most; k++, power *= part)
            for (int i = 0; i < NY; i++) c[k * NY + i] = coefficient(w, s, all, k, i) * power;
        if (r->watched) sample(r, &w->step, r->terms);
    }
    r->looked = 0;
    V factor = lane(0.25);
    const unsigned shorter = lane_bits((error > 1.0) & lane_finite(error));
    for (int l = 0; shorter >> l; l++) /* rare, and of another power in each lane */
        if (shorter >> l & 1) LANE_OF(factor, l) = mech_taylor_part(LANE_OF(error, l), (int)LANE_OF(order, l));
    w->held[SPOILED] += lane_number(~good & (w->low < order));
    for (int i = 0; i < N_START; i++) w->held[i] = lane_pick(took, w->found[i], w->held[i]);
    take(r, &w->step, good, error, AT(r->longest), h * factor, w->y_new, w->found);
}

static void attempt(mech_lane_room *r)
{
    work w[GROUPS];
    span all = {LEAST, MOST, 0, MOST + 1};
    tail s;
    for (int g = 0; g < GROUPS; g++) {
        w[g].room = g;
        begin_series(&r[g], &w[g], &all);
    }
    for (int i = 0; i < NY; i++) s.weight[i] = 1.0f / lane_joined(w[0].scale[i], w[GROUPS - 1].scale[i]);
    const int last = all.last_low < all.most ? all.last_low : all.most;
    for (int k = 1; k < last; k++)
        for (int g = 0; g < GROUPS; g++)
            lane_next_order(k, w[g].x[0], w[g].held + NY, (const V *)r[g].p, w[g].unit, w[g].later);
    form_tail(r, w, &s, &all);
    for (int g = 0; g < GROUPS; g++) {
        cut(&r[g], &w[g], &all, last);
        cut_step(&r[g], &w[g], &s, &all);
    }
    end_tail(w, &s, &all);
    for (int g = 0; g < GROUPS; g++) {
        reach_end(&r[g], &w[g], &all, last);
        judge(&r[g], &w[g], &s, &all);
    }
}

#endif
