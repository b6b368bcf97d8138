/* Steps: attempted, made smaller until one is good, accepted. */
#include "step.h"

#include <string.h>

#include "method.h"
#include "output.h"
#include "pieces.h"
#include "projection.h"
#include "stability.h"

/* Factor of a step that would end near a singular position: the next one goes beyond it. */
static const mech_real SHORTER = MECH_C(0.7);
/* Smallest factor of a rejected step beside one: which of its stages met the position is chance. */
static const mech_real OTHER_STAGES = MECH_C(0.85);

/* Corrections of velocities by the projection of a good step, in tolerances, that its errors explain; and the share of
 * the velocities from which on the sum of larger ones is a jump. Measured: at most 2 tolerances in the examples. */
static const mech_real EXPLAINED = MECH_C(100.0), SMALLEST_JUMP = MECH_C(1e-3);

/* Values between the ends of a step may be worse than those at the end by this factor. */
static const mech_real DENSE_BOUND = MECH_C(10.0);
/* Share of that bound below which it does not hold back the next step: rounding is seen in so small estimates. */
static const mech_real DENSE_NOTED = MECH_C(0.1);

static mech_real scaled_norm(const mech_solver *s, const mech_real *a, const mech_real *b)
{
    mech_real sum = 0;
    for (int i = 0; i < s->ny; i++) {
        mech_real x = (b ? a[i] - b[i] : a[i]) / (s->o.atol[i] + s->o.rtol * mech_abs(s->y[i]));
        sum += x * x;
    }
    return mech_sqrt(sum);
}

/* The first step: Hairer, Norsett, Wanner, section II.4, with its absolute constants times dt_max. */
static mech_real first_step(mech_solver *s)
{
    const mech_real longest = s->o.dt_max, tiny = MECH_C(1e-6) * longest;
    const mech_real norm_f = scaled_norm(s, s->dy, NULL), norm_y = scaled_norm(s, s->y, NULL);
    mech_real h = norm_f > 0 && norm_y > 0 ? norm_y / norm_f * MECH_C(0.01) : tiny;
    h = mech_min(h, longest);
    for (int i = 0; i < s->ny; i++) s->y_new[i] = s->y[i] + h * s->dy[i];
    mech_rhs(s, s->run->report.t + h, s->y_new, s->dy_new);
    mech_real curvature = scaled_norm(s, s->dy_new, s->dy) / h, steepest = mech_max(norm_f, curvature);
    if (!mech_finite(curvature)) return h;
    mech_real h1 = steepest > 0 ? mech_pow(MECH_C(0.01) / steepest, MECH_C(1.0) / s->method->error_order) : h;
    return mech_min(mech_min(100 * h, h1), longest);
}

int mech_step_start(mech_solver *s)
{
    mech_run *run = s->run;
    int status = mech_method_lacks(s->o.method, s->model);
    if (status) return mech_fail(s, status, -1);
    status = mech_piece_enter(s);
    if (!status) status = mech_piece_check(s);
    if (status) return status;
    run->started = 1;
    run->after_rejection = run->measures = 0;
    run->fastest = run->fastest_until = 0;
    run->origin = run->report.t;
    run->n_fixed = 0;
    if (s->method->adaptive) {
        const mech_real first = s->o.dt > 0 ? s->o.dt : s->method->longest ? s->o.dt_max : first_step(s);
        run->report.dt = mech_min(first, s->o.dt_max);
    } else {
        run->report.dt = s->o.dt;
    }
    memcpy(s->y_new, s->y, (size_t)s->ny * sizeof(mech_real));
    mech_output_grid(s, run->report.t, 1); /* only a row at the present time: nothing precedes it */
    return MECH_RUNNING;
}

/* Factor of the next step: PI control, K. Gustafsson 1991, exponents as in DOPRI5 and DOP853. */
static mech_real control(const mech_solver *s, mech_real error)
{
    const mech_method *m = s->method;
    const mech_real safety = MECH_C(0.9), beta = MECH_C(0.04);
    const mech_real old = s->run->error_old > 0 ? s->run->error_old : MECH_C(1e-4);
    if (error == 0) return m->factor_max;
    mech_real exponent = MECH_C(1.0) / m->error_order - MECH_C(0.2) * beta;
    mech_real factor = safety * mech_pow(error, -exponent) * mech_pow(old, beta);
    return mech_min(m->factor_max, mech_max(m->factor_min, factor));
}

/* Goes on with the other part of a method that consists of two. */
static void change_method(mech_solver *s, const mech_method *method)
{
    mech_run *run = s->run;
    s->method = method;
    run->report.method = mech_method_index(method->name);
    run->report.switch_time = run->report.t;
    run->report.switches++;
    run->error_old = 0;
    run->stiff_hits = run->calm_hits = run->measures = 0;
    run->fastest = run->fastest_until = 0;
    memset(s->dense, 0, (size_t)s->ny * (size_t)s->n_dense * sizeof(mech_real));
    if (method->begin) method->begin(s, 1);
}

int mech_step_accept(mech_solver *s, mech_real t_new, mech_real h)
{
    mech_run *run = s->run;
    mech_report *r = &run->report;
    const size_t bytes = (size_t)s->ny * sizeof(mech_real);
    r->steps++;
    const mech_method *other = NULL;
    if (s->chosen->implicit_part == s->method) {
        if (mech_stability_calm(s, h)) other = s->chosen->explicit_part;
    } else if (s->method->stiffness && !s->method->lacks) { /* an explicit one: implicit methods need a Jacobian */
        const int stiff = mech_stability_stiff(s, h);
        if (stiff && s->method != s->chosen && !s->chosen->implicit_part->lacks(s->model)) other = s->chosen->implicit_part;
    }
    if (s->o.record_capacity || (r->n_grid < s->o.n_grid && s->o.grid[r->n_grid] < t_new))
        mech_fill_dense(s, h);
    if (r->n_grid < s->o.n_grid && s->o.grid[r->n_grid] <= t_new) mech_output_grid(s, t_new, h);
    if (s->o.record_capacity) mech_output_record(s, h);
    if (h < r->dt_min) r->dt_min = h;
    if (h > r->dt_max) r->dt_max = h;
    r->t = run->from = t_new;
    memcpy(s->y, s->y_new, bytes);
    memcpy(s->dy, s->dy_new, bytes);
    run->after_rejection = 0;
    run->dense_of = 0;
    if (run->measures) mech_stability_measure(s, h);
    if (other) change_method(s, other);
    if (run->next_stop < s->o.n_stops && t_new >= s->o.stops[run->next_stop]) {
        int status = mech_piece_enter(s);
        if (status) return status;
    }
    return mech_piece_check(s);
}

/* Where the steps have become too small: names what is to blame. */
static int give_up(mech_solver *s, int undefined)
{
    if (s->run->trouble) return mech_fail(s, s->run->trouble, -1);
    if (s->method->blame && s->method->blame(s) != MECH_RUNNING) return s->run->report.status;
    if (undefined && (mech_fail_not_finite(s, s->work, s->ny * s->method->n_stages) ||
                      mech_fail_not_finite(s, s->dy_new, s->ny)))
        return s->run->report.status;
    int worst = 0;
    mech_real largest = -1;
    for (int i = 0; i < s->ny - s->model->n_accounts; i++) { /* an account follows from the motion */
        mech_real rate = mech_abs(s->dy[i]) / (s->o.atol[i] + s->o.rtol * mech_abs(s->y[i]));
        if (rate > largest) {
            largest = rate;
            worst = i;
        }
    }
    s->run->report.failed_value = s->dy[worst];
    return mech_fail(s, MECH_STEP_TOO_SMALL, worst);
}

/* Whether somebody wants values between the ends of a step to t_new. */
static int wants_dense(const mech_solver *s, mech_real t_new)
{
    const mech_report *r = &s->run->report;
    const mech_hybrid *h = s->model->hybrid;
    return s->o.record_capacity || s->o.dense || s->history || (h && h->n_switches + h->n_rows) ||
           (r->n_grid < s->o.n_grid && s->o.grid[r->n_grid] < t_new);
}

/* A step that is tried: from the present time over h to t_new, which is the limit where it lands there, or halfway to it. */
typedef struct trial {
    mech_real t_new, h, fixed_end;
    int lands, halved;
} trial;

static trial next_trial(const mech_solver *s, mech_real limit)
{
    const mech_run *run = s->run;
    const mech_report *r = &run->report;
    const int adaptive = s->method->adaptive;
    const mech_real fixed_end = run->origin + (mech_real)(run->n_fixed + 1) * r->dt;
    const mech_real wanted = adaptive ? r->t + r->dt : fixed_end;
    /* A step that ends just before the limit is stretched to it. */
    const int lands = wanted + r->dt * (adaptive ? MECH_C(1e-2) : MECH_C(1e-6)) >= limit;
    const mech_real middle = r->t + (limit - r->t) / 2;
    const int halved = adaptive && s->o.halves && r->t != run->halfway && r->t < middle && middle < mech_min(wanted, limit);
    const mech_real t_new = halved ? middle : lands ? limit : wanted;
    mech_real h = halved || lands || !adaptive ? t_new - r->t : r->dt;
    /* A whole step that differs by the rounding of times is the same step. */
    if (!adaptive && mech_abs(h - r->dt) <= 4 * MECH_EPSILON * mech_abs(t_new)) h = r->dt;
    return (trial){t_new, h, fixed_end, lands && !halved, halved};
}

/* Attempts it, with all that belongs to a good step: projection, derivative, and error between the ends. Gives the
   error, which is not finite where something is undefined. */
static mech_real attempt(mech_solver *s, const trial *step)
{
    mech_run *run = s->run;
    const mech_method *m = s->method;
    run->trouble = MECH_RUNNING;
    run->cut = 0;
    run->dense_of = 0;
    run->dense_limits = 0;
    mech_real error = m->attempt(s, step->h);
    if (!(error <= 1)) return error;
    mech_normalise(s->model, s->y_new);
    if (s->project && !m->keeps_constraints) {
        run->trouble = mech_project(s, step->t_new, s->y_new);
        if (run->trouble != MECH_RUNNING) return (mech_real)NAN;
    }
    const int moved = s->model->n_rotations || (s->project && !m->keeps_constraints);
    if (!m->gives_derivative || moved) mech_rhs(s, step->t_new, s->y_new, s->dy_new);
    mech_real sum = 0;
    for (int i = 0; i < s->ny; i++) sum += s->dy_new[i];
    if (!mech_finite(sum)) return (mech_real)NAN;
    if (m->dense_error && wants_dense(s, step->t_new)) {
        mech_fill_dense(s, step->h);
        const mech_real between = m->dense_error(s) / DENSE_BOUND;
        run->dense_limits = between > error;
        if (between > DENSE_NOTED) error = mech_max(error, between);
    }
    return error;
}

/* Constraints of velocities that depended on each other, and no longer do, may ask for a jump of velocities, which no
 * force gives. The projection makes it then, within a step or within several that are near that place; what it
 * corrects otherwise is as small as the errors of the steps. Gives whether the sum of such corrections is a jump. */
static int jumps(mech_solver *s)
{
    mech_run *run = s->run;
    const mech_model *m = s->model;
    const mech_real explained = EXPLAINED * s->o.rtol;
    if (!s->project || s->method->keeps_constraints || m->n_velocity == m->n_position) return 0;
    if (run->corrected > explained) run->jumped += run->corrected;
    return run->jumped > mech_max(SMALLEST_JUMP, explained);
}

/* The size of the step after one that was not good. */
static mech_real after_rejection(const mech_solver *s, mech_real h, mech_real error)
{
    const mech_run *run = s->run;
    const mech_method *m = s->method;
    if (run->cut > 0) return h * run->cut;
    if (!mech_finite(error)) return h / 4;
    const mech_real factor = MECH_C(0.9) * mech_pow(error, MECH_C(-1.0) / m->error_order);
    return h * mech_max(run->near_singular ? OTHER_STAGES : m->factor_min, factor);
}

/* The size of the step after a good one of an adaptive method. */
static mech_real after_success(mech_solver *s, mech_real h, mech_real error)
{
    mech_run *run = s->run;
    const mech_method *m = s->method;
    mech_real next = h * (m->control ? m->control(s, h, error) : control(s, error));
    if (run->after_rejection) next = mech_min(next, h);
    /* A step cut short by its limit tells little: the former proposal stands. */
    if (h < run->report.dt)
        next = mech_max(run->report.dt, next);
    else
        run->error_old = mech_max(error, MECH_C(1e-4));
    return mech_stability_bounded(s, mech_min(next, s->o.dt_max));
}

int mech_step_try(mech_solver *s, mech_real limit, mech_real *end, mech_real *taken)
{
    mech_run *run = s->run;
    mech_report *r = &run->report;
    const int adaptive = s->method->adaptive;
    mech_real proposed = 0; /* before steps were made shorter that end near a singular position */
    if (s->method->longest) r->dt = mech_min(r->dt, s->method->longest(s));
    for (;;) {
        const mech_real shortest = 10 * MECH_EPSILON * mech_abs(r->t) + MECH_C(1e-24) * s->o.dt_max;
        const trial step = next_trial(s, limit);
        const mech_real h = step.h, error = attempt(s, &step);
        const int good = error <= 1;
        if (good && adaptive && !step.lands && h > shortest && mech_too_close(s, step.t_new, s->y_new, s->y)) {
            r->rejected++;
            proposed = mech_max(proposed, r->dt);
            r->dt = h * SHORTER;
            continue;
        }
        if (!good) {
            r->rejected++;
            if (!adaptive || h <= shortest) return give_up(s, !mech_finite(error));
            proposed = 0;
            r->dt = after_rejection(s, h, error);
            run->after_rejection = 1;
            continue;
        }
        if (adaptive && jumps(s)) return mech_fail(s, MECH_JUMPING, -1);
        if (adaptive)
            r->dt = mech_max(proposed, after_success(s, h, error));
        else if (step.t_new >= step.fixed_end - MECH_C(1e-6) * r->dt)
            run->n_fixed++;
        if (step.halved) run->halfway = step.t_new;
        *end = step.t_new;
        *taken = h;
        return MECH_RUNNING;
    }
}
