/* DOP853 in lanes: methods/explicit_attempt.h for the model that is included before. */
#ifndef MECH_LANE_DOP853_H
#define MECH_LANE_DOP853_H

#include "dop853_tableau.h"
#include "lane_step.h"

enum { N_DENSE = 4 + TERMS, N_EXTRA = 0, ERROR_ORDER = 8, LOOK_EVERY = 100 };
#define STIFFNESS_BOUND 6.1
static const double FACTOR_MIN = 0.333, FACTOR_MAX = 6.0;
/* Values between the ends of a step may be worse than those at the end by this factor; share of it that is noted. */
static const double DENSE_BOUND = 10.0, DENSE_NOTED = 0.1;

#define EACH_STAGE(DO) \
    DO(1) DO(2) DO(3) DO(4) DO(5) DO(6) DO(7) DO(8) DO(9) DO(10) DO(11) DO(12) DO(13) DO(14) DO(15) DO(16)

/* Element i of the sum of the first `last` stages, each times its weight, added to `sum`. */
LANE V weighted(const V k[][NY], int last, const double *w, int i, V sum)
{
#define TERM(j) \
    if ((j) <= last && w[j] != 0) sum = lane_fma(lane(w[j]), k[j][i], sum);
    EACH_STAGE(TERM)
#undef TERM
    return sum;
}

static __attribute__((noinline)) V dense(const mech_lane_room *r, const trial *step, V k[][NY], const V *y_new)
{
    const V *y = (const V *)r->y;
    V *c = (V *)r->dense, ys[NY], sum = lane(0);
    const V h = step->h;
#define STAGE(j)                                                                                              \
    if ((j) > STAGES + 1) {                                                                                   \
        for (int i = 0; i < NY; i++)                                                                          \
            ys[i] = lane_fma(h, weighted((const V(*)[NY])k, (j) - 1, TABLEAU.a[j], i, lane(0)), y[i]);        \
        rates_apart(r, lane_fma(lane(TABLEAU.c[j]), h, step->t), ys, k[j]);                                   \
    }
    EACH_STAGE(STAGE)
#undef STAGE
    for (int i = 0; i < NY; i++) {
        const V d = y_new[i] - y[i], b = h * k[1][i] - d;
        c[i] = y[i];
        c[NY + i] = d;
        c[2 * NY + i] = b;
        c[3 * NY + i] = d - h * k[STAGES + 1][i] - b;
        for (int q = 0; q < TERMS; q++)
            c[(4 + q) * NY + i] = h * weighted((const V(*)[NY])k, STAGES + 1 + FURTHER, TABLEAU.dense[q], i, lane(0));
        const V larger = lane_larger(lane_abs(y[i]), lane_abs(y_new[i]));
        const V scale = lane_fma(AT(r->rtol), larger, ((const V *)r->atol)[i]);
        const V x = c[(N_DENSE - 1) * NY + i] * TABLEAU.dense_share / scale;
        sum = lane_fma(x, x, sum);
    }
    return lane_sqrt(sum / (double)NY);
}

/* The ratio of the differences of derivative and state between the last stage and the end of the step. */
static __attribute__((noinline)) void look_at_stiffness(mech_lane_room *r, V h, V k[][NY], const V *ys, const V *y_new)
{
    V numerator = lane(0), denominator = lane(0);
    for (int i = 0; i < NY; i++) {
        const V scale = lane_fma(AT(r->rtol), lane_abs(y_new[i]), ((const V *)r->atol)[i]);
        const V a = (k[STAGES + 1][i] - k[STAGES][i]) / scale, b = (y_new[i] - ys[i]) / scale;
        numerator = lane_fma(a, a, numerator);
        denominator = lane_fma(b, b, denominator);
    }
    AT(r->stiffness) = lane_pick(denominator > 0.0, h * lane_sqrt(numerator / denominator), lane(0));
}

static void begin(mech_lane_room *r) { begin_lanes(r, ERROR_ORDER); }

static void attempt(mech_lane_room *r)
{
    const trial step = next_trial(r);
    const V t = step.t, h = step.h, *y = (const V *)r->y, *atol = (const V *)r->atol, rtol = AT(r->rtol);
    V k[STAGES + FURTHER + 2][NY], ys[NY], y_new[NY];
    for (int i = 0; i < NY; i++) k[1][i] = ((const V *)r->dy)[i];
#define STAGE(j)                                                                                              \
    if ((j) > 1 && (j) <= STAGES) {                                                                           \
        for (int i = 0; i < NY; i++)                                                                          \
            ys[i] = lane_fma(h, weighted((const V(*)[NY])k, (j) - 1, TABLEAU.a[j], i, lane(0)), y[i]);        \
        rates_apart(r, lane_fma(lane(TABLEAU.c[j]), h, t), ys, k[j]);                                         \
    }
    EACH_STAGE(STAGE)
#undef STAGE
    V first = lane(0), second = lane(0);
    for (int i = 0; i < NY; i++) {
        const V sum = weighted((const V(*)[NY])k, STAGES, TABLEAU.b, i, lane(0));
        y_new[i] = lane_fma(h, sum, y[i]);
        const V scale = lane_fma(rtol, lane_larger(lane_abs(y[i]), lane_abs(y_new[i])), atol[i]), over = 1.0 / scale;
        V far = sum;
        for (int j = 1; j <= STAGES; j++)
            if (TABLEAU.embedded[j] != 0) far = lane_fnma(lane(TABLEAU.embedded[j]), k[j][i], far);
        const V off = far * over, error = weighted((const V(*)[NY])k, STAGES, TABLEAU.error, i, lane(0)) * over;
        second = lane_fma(off, off, second);
        first = lane_fma(error, error, first);
    }
    const V both = lane_fma(lane(0.01), second, first);
    V error = lane_pick(both == 0.0, lane(0), h * first / lane_sqrt(both * (double)NY));
    V *end = k[STAGES + 1];
#if N_ROTATIONS
    normalise(y_new);
#endif
    rates_apart(r, step.t_new, y_new, end);
    error = lane_pick((error <= 1.0) & ~finite_all(end), lane(NAN), error);
    const M between = wants_dense(r, &step) & (error <= 1.0) & lane_set(r->alive);
    if (lane_bits(between)) {
        const V inside = dense(r, &step, k, y_new) / DENSE_BOUND;
        error = lane_pick(between & (inside > DENSE_NOTED), lane_larger(error, inside), error);
        if (r->watched) sample(r, &step, N_DENSE);
    }
    const M good = error <= 1.0;
    const M looks = good & (AT(r->steps) + 1.0 >= AT(r->next_look)) & lane_set(r->alive);
    r->looked = lane_bits(looks);
    if (r->looked) look_at_stiffness(r, h, k, ys, y_new);
    /* PI control, K. Gustafsson 1991, exponents as in the scalar kernel */
    const V err = lane_larger(error, lane(1e-300)), old = AT(r->error_old);
    const V before = lane_pick(old > 0.0, old, lane(1e-4));
    V factor = 0.9 * lane_rough_power(err, -(1.0 / ERROR_ORDER - 0.2 * 0.04)) * lane_rough_power(before, 0.04);
    factor = lane_smaller(lane(FACTOR_MAX), lane_larger(lane(FACTOR_MIN), factor));
    factor = lane_pick(error == 0.0, lane(FACTOR_MAX), factor);
    const V shrunk = lane_larger(lane(FACTOR_MIN), 0.9 * lane_rough_power(err, -1.0 / ERROR_ORDER));
    const V shorter = h * lane_pick(lane_finite(error), shrunk, lane(0.25));
    take(r, &step, good, error, h * factor, shorter, y_new, end);
}

#endif
