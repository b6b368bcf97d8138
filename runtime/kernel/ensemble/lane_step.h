/* What all methods in lanes share: the model at all lanes, how a step is cut, taken and followed by the next one. Included by
 * generated lanes behind the functions of the model and its sizes (NY, NU, N_KEPT, N_CHECKS, N_ROTATIONS).
 *
 * The rules and constants are those of stepping/step.c.
 */
#ifndef MECH_LANE_STEP_H
#define MECH_LANE_STEP_H

#define AT(array) (*(V *)(array))

/* Derivatives at all lanes. */
LANE void rates(const mech_lane_room *r, V t, const V *y, V *restrict out)
{
#if NU
    V u[NU];
    inputs(t, NULL, NULL, (const V *)r->z, (const V *)r->p, u);
    for (int i = 0; i < NU; i++)
        if (r->given[i]) u[i] = ((const V *)r->u)[i];
    rhs(t, y, u, (const V *)r->z, (const V *)r->p, out);
#else
    rhs(t, y, NULL, (const V *)r->z, (const V *)r->p, out);
#endif
}

static __attribute__((noinline, unused)) void rates_apart(const mech_lane_room *r, V t, const V *y, V *restrict out)
{
    rates(r, t, y, out);
}

/* The lanes where an assertion of the model does not hold. */
LANE M broken(const mech_lane_room *r, V t, const V *y)
{
    M some = {0};
#if N_CHECKS
    V u[NU + 1], checks[N_CHECKS];
#if NU
    inputs(t, NULL, NULL, (const V *)r->z, (const V *)r->p, u);
    for (int i = 0; i < NU; i++)
        if (r->given[i]) u[i] = ((const V *)r->u)[i];
#endif
    assertions(t, y, u, (const V *)r->z, (const V *)r->p, checks);
    for (int i = 0; i < N_CHECKS; i++) some |= ~(checks[i] > 0.5);
#else
    (void)r, (void)t, (void)y;
#endif
    return some;
}

#if N_ROTATIONS
static void normalise(V *y)
{
    for (int k = 0; k < N_ROTATIONS; k++) {
        V *e = y + rotations[k];
        const V sum = lane_fma(e[3], e[3], lane_fma(e[2], e[2], lane_fma(e[1], e[1], e[0] * e[0])));
        const V factor = 1.0 / lane_sqrt(sum);
        for (int i = 0; i < 4; i++) e[i] *= factor;
    }
}
#endif

LANE M finite_all(const V *x)
{
    V sum = x[0];
    for (int i = 1; i < NY; i++) sum += x[i];
    return lane_finite(sum);
}

/* ---- the first step: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, section II.4 */

LANE V norm(const mech_lane_room *r, const V *y, const V *a, const V *b)
{
    V sum = lane(0);
    for (int i = 0; i < NY; i++) {
        const V scale = lane_fma(AT(r->rtol), lane_abs(y[i]), ((const V *)r->atol)[i]);
        const V x = (b ? a[i] - b[i] : a[i]) / scale;
        sum = lane_fma(x, x, sum);
    }
    return lane_sqrt(sum);
}

static V first_step(const mech_lane_room *r, V t, const V *y, const V *dy, int error_order)
{
    V y_new[NY], dy_new[NY];
    const V longest = AT(r->longest), tiny = longest * 1e-6;
    const V norm_f = norm(r, y, dy, NULL), norm_y = norm(r, y, y, NULL);
    V h = lane_pick((norm_f > 0.0) & (norm_y > 0.0), norm_y / norm_f * 0.01, tiny);
    h = lane_smaller(h, longest);
    for (int i = 0; i < NY; i++) y_new[i] = lane_fma(h, dy[i], y[i]);
    rates_apart(r, t + h, y_new, dy_new);
    const V curvature = norm(r, y, dy_new, dy) / h, steepest = lane_larger(norm_f, curvature);
    const V power = lane_rough_power(lane_larger(0.01 / steepest, lane(1e-300)), 1.0 / error_order);
    const V h1 = lane_pick(steepest > 0.0, power, h);
    return lane_pick(lane_finite(curvature), lane_smaller(lane_smaller(100 * h, h1), longest), h);
}

/* Lets fresh lanes begin, whose derivatives are known, with a first step. */
LANE void begin_with(mech_lane_room *r, M fresh, V first)
{
    const V *dy = (const V *)r->dy;
    AT(r->dt) = lane_pick(fresh, lane_smaller(first, AT(r->longest)), AT(r->dt));
    AT(r->error_old) = lane_pick(fresh, lane(0), AT(r->error_old));
    AT(r->steps) = lane_pick(fresh, lane(0), AT(r->steps));
    r->after_rejection &= ~r->fresh;
    r->troubled = r->fresh & lane_bits(~finite_all(dy) | broken(r, AT(r->t), (const V *)r->y));
}

/* ---- one step */

typedef struct trial {
    V t, t_new, h;
    M lands;
} trial;

/* A step that ends just before its limit is stretched to it. */
LANE trial next_trial(const mech_lane_room *r)
{
    const V t = AT(r->t), dt = AT(r->dt), limit = AT(r->limit), wanted = t + dt;
    const M lands = wanted + dt * 1e-2 >= limit;
    return (trial){t, lane_pick(lands, limit, wanted), lane_pick(lands, limit - t, dt), lands};
}

/* The polynomial of the step at one place: as in solver.h, point 6, or LANE_PLAIN, in powers of s alone. */
LANE void state_at(const mech_lane_room *r, int n_dense, double s, V *y)
{
    const V *c = (const V *)r->dense;
    for (int i = 0; i < NY; i++) {
        V sum = c[(n_dense - 1) * NY + i];
        for (int k = n_dense - 2; k >= 0; k--)
            sum = lane_fma(lane(k % 2 && !LANE_PLAIN ? 1 - s : s), sum, c[k * NY + i]);
        y[i] = sum;
    }
#if N_ROTATIONS
    normalise(y);
#endif
}

static MECH_FIXED double LANE_PLACES[] = MECH_LANE_PLACES;

#if N_KEPT
LANE void kept_at(const mech_lane_room *r, V t, const V *y, V *out)
{
#if NU
    V u[NU];
    inputs(t, NULL, NULL, (const V *)r->z, (const V *)r->p, u);
    for (int i = 0; i < NU; i++)
        if (r->given[i]) u[i] = ((const V *)r->u)[i];
#else
    V *u = NULL;
#endif
    kept(t, y, u, (const V *)r->z, (const V *)r->p, out);
}
#endif

/* What is kept, along a step whose polynomial is there. */
static __attribute__((unused)) void sample(const mech_lane_room *r, const trial *step, int n_dense)
{
#if N_KEPT
    for (int j = 0; j < MECH_LANE_SAMPLES; j++) {
        V y[NY];
        state_at(r, n_dense, LANE_PLACES[j], y);
        kept_at(r, lane_fma(lane(LANE_PLACES[j]), step->h, step->t), y, (V *)r->samples + j * N_KEPT);
    }
#else
    (void)r, (void)step, (void)n_dense;
#endif
}

/* Lanes that want values between the ends of this step. */
LANE M wants_dense(const mech_lane_room *r, const trial *step)
{
    return lane_set(r->watched ? ~0u : 0) | (AT(r->next_row) < step->t_new);
}

/* Takes the step where it is good, and tells what it brought; `next` is the size of the next one as the method likes it after
 * a good step, `shorter` after another one. */
LANE void take(mech_lane_room *r, const trial *step, M good, V error, V next, V shorter, const V *y_new, const V *dy_new)
{
    V *y = (V *)r->y, *dy = (V *)r->dy;
    const M alive = lane_set(r->alive), took = good & alive;
    const V dt = AT(r->dt), longest = AT(r->longest), h = step->h;
    const V shortest = lane_fma(lane_abs(step->t), lane(10 * MECH_EPSILON), longest * 1e-24);
    next = lane_pick(lane_set(r->after_rejection), lane_smaller(next, h), next);
    const M cut = h < dt; /* a step cut short by its limit tells little: the former proposal stands */
    const V after = lane_smaller(lane_pick(cut, lane_larger(dt, next), next), longest);
    AT(r->dt) = lane_pick(good, after, shorter);
    AT(r->error_old) = lane_pick(took & ~cut, lane_larger(error, lane(1e-4)), AT(r->error_old));
    AT(r->from) = step->t;
    AT(r->h) = h;
    AT(r->t) = lane_pick(took, step->t_new, step->t);
    const V steps = AT(r->steps) + lane_number(took);
    AT(r->steps) = steps;
    for (int i = 0; i < NY; i++) {
        y[i] = lane_pick(took, y_new[i], y[i]);
        dy[i] = lane_pick(took, dy_new[i], dy[i]);
    }
    const unsigned bits = lane_bits(took);
    r->took = bits;
    r->after_rejection = ~lane_bits(good);
    r->landed = bits & lane_bits(step->lands);
    r->passed = bits & lane_bits(AT(r->next_row) <= step->t_new);
    r->full = bits & lane_bits(steps >= AT(r->most));
    r->troubled = lane_bits(~good & alive & (h <= shortest));
#if N_CHECKS
    r->troubled |= bits & lane_bits(broken(r, step->t_new, y));
#endif
}

#endif
