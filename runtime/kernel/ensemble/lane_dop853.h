/* DOP853 in lanes: methods/explicit_attempt.h for the model that is included before. */
#ifndef MECH_LANE_DOP853_H
#define MECH_LANE_DOP853_H

#include "dop853_tableau.h"
enum { N_DENSE = 4 + TERMS, N_HELD = 0, N_EXTRA = 0, ERROR_ORDER = 8, LOOK_EVERY = 100 };
/* Rooms that are stepped together: two hide latencies, where the stages of both stay near. */
#define GROUPS (WIDTH > 1 && NY <= 16 ? 2 : 1)
#define STIFFNESS_BOUND 6.1
#define LANE_PLAIN 0

#include "lane_step.h"

static MECH_FIXED double FACTOR_MIN = 0.333, FACTOR_MAX = 6.0;
/* Values between the ends of a step may be worse than those at the end by this factor; share of it that is noted. */
static MECH_FIXED double DENSE_BOUND = 10.0, DENSE_NOTED = 0.1;

#define EACH_STAGE(DO) \
    DO(1) DO(2) DO(3) DO(4) DO(5) DO(6) DO(7) DO(8) DO(9) DO(10) DO(11) DO(12) DO(13) DO(14) DO(15) DO(16)

/* Element i of the sum of the first `last` stages, each times its weight, added to `sum`. */
LANE V weighted(V k[][NY], int last, MECH_FIXED double *w, int i, V sum)
{
#define TERM(j) \
    if ((j) <= last && w[j] != 0) sum = lane_fma(lane(w[j]), k[j][i], sum);
    EACH_STAGE(TERM)
#undef TERM
    return sum;
}

/* A step under way in the lanes of one room. */
typedef struct work {
    trial step;
    V k[STAGES + FURTHER + 2][NY], ys[NY], y_new[NY];
} work;

LANE void stage(const mech_lane_room *r, work *w, int j)
{
    const V h = w->step.h, *y = (const V *)r->y;
    for (int i = 0; i < NY; i++) w->ys[i] = lane_fma(h, weighted(w->k, j - 1, TABLEAU.a[j], i, lane(0)), y[i]);
    rates_apart(r, lane_fma(lane(TABLEAU.c[j]), h, w->step.t), w->ys, w->k[j]);
}

/* Fills the coefficients of the polynomial; gives the norm of the error between the ends. */
static __attribute__((noinline)) V dense(const mech_lane_room *r, work *w)
{
    const V *y = (const V *)r->y, *y_new = w->y_new, h = w->step.h;
    V *c = (V *)r->dense, sum = lane(0);
#define STAGE(j) \
    if ((j) > STAGES + 1) stage(r, w, j);
    EACH_STAGE(STAGE)
#undef STAGE
    for (int i = 0; i < NY; i++) {
        const V d = y_new[i] - y[i], b = h * w->k[1][i] - d;
        c[i] = y[i];
        c[NY + i] = d;
        c[2 * NY + i] = b;
        c[3 * NY + i] = d - h * w->k[STAGES + 1][i] - b;
        for (int q = 0; q < TERMS; q++)
            c[(4 + q) * NY + i] = h * weighted(w->k, STAGES + 1 + FURTHER, TABLEAU.dense[q], i, lane(0));
        const V larger = lane_larger(lane_abs(y[i]), lane_abs(y_new[i]));
        const V scale = lane_fma(AT(r->rtol), larger, ((const V *)r->atol)[i]);
        const V x = c[(N_DENSE - 1) * NY + i] * TABLEAU.dense_share / scale;
        sum = lane_fma(x, x, sum);
    }
    return lane_sqrt(sum / (double)NY);
}

/* The ratio of the differences of derivative and state between the last stage and the end of the step. */
static __attribute__((noinline)) void look_at_stiffness(mech_lane_room *r, const work *w, const V *last)
{
    V numerator = lane(0), denominator = lane(0);
    for (int i = 0; i < NY; i++) {
        const V scale = lane_fma(AT(r->rtol), lane_abs(w->y_new[i]), ((const V *)r->atol)[i]);
        const V a = (w->k[STAGES + 1][i] - w->k[STAGES][i]) / scale, b = (w->y_new[i] - last[i]) / scale;
        numerator = lane_fma(a, a, numerator);
        denominator = lane_fma(b, b, denominator);
    }
    AT(r->stiffness) = lane_pick(denominator > 0.0, w->step.h * lane_sqrt(numerator / denominator), lane(0));
}

static void begin(mech_lane_room *r)
{
    const M fresh = lane_set(r->fresh);
    V *y = (V *)r->y, *dy = (V *)r->dy, found[NY];
    rates_apart(r, AT(r->t), y, found);
    for (int i = 0; i < NY; i++) dy[i] = lane_pick(fresh, found[i], dy[i]);
    begin_with(r, fresh, first_step(r, AT(r->t), y, dy, ERROR_ORDER));
    r->terms = N_DENSE;
}

/* The new state, its derivative, and the norm of the error. */
static V reach_end(const mech_lane_room *r, work *w)
{
    const V h = w->step.h, *y = (const V *)r->y, *atol = (const V *)r->atol, rtol = AT(r->rtol);
    V first = lane(0), second = lane(0), *y_new = w->y_new;
    for (int i = 0; i < NY; i++) {
        const V sum = weighted(w->k, STAGES, TABLEAU.b, i, lane(0));
        y_new[i] = lane_fma(h, sum, y[i]);
        const V scale = lane_fma(rtol, lane_larger(lane_abs(y[i]), lane_abs(y_new[i])), atol[i]), over = 1.0 / scale;
        V far = sum;
        for (int j = 1; j <= STAGES; j++)
            if (TABLEAU.embedded[j] != 0) far = lane_fnma(lane(TABLEAU.embedded[j]), w->k[j][i], far);
        const V off = far * over, error = weighted(w->k, STAGES, TABLEAU.error, i, lane(0)) * over;
        second = lane_fma(off, off, second);
        first = lane_fma(error, error, first);
    }
    const V both = lane_fma(lane(0.01), second, first);
#if N_ROTATIONS
    normalise(y_new);
#endif
    rates_apart(r, w->step.t_new, y_new, w->k[STAGES + 1]);
    return lane_pick(both == 0.0, lane(0), h * first / lane_sqrt(both * (double)NY));
}

/* PI control, K. Gustafsson 1991, exponents as in the scalar kernel. */
static void judge(mech_lane_room *r, work *w, V error)
{
    const V h = w->step.h, *end = w->k[STAGES + 1];
    V last[NY];
    for (int i = 0; i < NY; i++) last[i] = w->ys[i];
    error = lane_pick((error <= 1.0) & ~finite_all(end), lane(NAN), error);
    const M between = wants_dense(r, &w->step) & (error <= 1.0) & lane_set(r->alive);
    if (lane_bits(between)) {
        const V inside = dense(r, w) / DENSE_BOUND;
        error = lane_pick(between & (inside > DENSE_NOTED), lane_larger(error, inside), error);
        if (r->watched) sample(r, &w->step, N_DENSE);
    }
    const M good = error <= 1.0;
    r->looked = lane_bits(good & (AT(r->steps) + 1.0 >= AT(r->next_look)) & lane_set(r->alive));
    if (r->looked) look_at_stiffness(r, w, last);
    const V err = lane_larger(error, lane(1e-300)), old = AT(r->error_old);
    const V before = lane_pick(old > 0.0, old, lane(1e-4));
    V factor = 0.9 * lane_rough_power(err, -(1.0 / ERROR_ORDER - 0.2 * 0.04)) * lane_rough_power(before, 0.04);
    factor = lane_smaller(lane(FACTOR_MAX), lane_larger(lane(FACTOR_MIN), factor));
    factor = lane_pick(error == 0.0, lane(FACTOR_MAX), factor);
    const V shrunk = lane_larger(lane(FACTOR_MIN), 0.9 * lane_rough_power(err, -1.0 / ERROR_ORDER));
    const V shorter = h * lane_pick(lane_finite(error), shrunk, lane(0.25));
    take(r, &w->step, good, error, h * factor, shorter, w->y_new, end);
}

/* Stage by stage in one room after the other, so that none waits for the latencies of its own. */
static void attempt(mech_lane_room *rooms)
{
    work w[GROUPS];
    V error[GROUPS];
    for (int g = 0; g < GROUPS; g++) {
        w[g].step = next_trial(&rooms[g]);
        for (int i = 0; i < NY; i++) w[g].k[1][i] = ((const V *)rooms[g].dy)[i];
    }
#define STAGE(j)                 \
    if ((j) > 1 && (j) <= STAGES) \
        for (int g = 0; g < GROUPS; g++) stage(&rooms[g], &w[g], j);
    EACH_STAGE(STAGE)
#undef STAGE
    for (int g = 0; g < GROUPS; g++) error[g] = reach_end(&rooms[g], &w[g]);
    for (int g = 0; g < GROUPS; g++) judge(&rooms[g], &w[g], error[g]);
}

#endif
