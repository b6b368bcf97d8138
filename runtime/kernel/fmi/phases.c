/* Initialisation, and the steps of Co-Simulation. */
#include <string.h>

#include "instance.h"
#include "projection.h"

int fmu_plan_experiment(fmu *f, int tolerance_defined, mech_real tolerance, mech_real start, int stop_defined,
                        mech_real stop)
{
    if (!mech_finite(start) || (stop_defined && !(stop >= start)))
        return fmu_fail(f, FMU_ERROR, "start %g and stop %g are not an interval", start, stop);
    if (tolerance_defined && (!(tolerance > 0) || !mech_finite(tolerance)))
        return fmu_fail(f, FMU_ERROR, "the tolerance %g is not positive and finite", tolerance);
    const int ends = stop_defined && mech_finite(stop - start); /* a stop at infinity is none */
    f->st->start = start;
    f->st->stop_defined = ends;
    f->st->stop = ends ? stop : start + (f->d->stop - f->d->t0);
    f->st->tolerance_defined = tolerance_defined;
    if (tolerance_defined) f->st->tolerance = tolerance;
    return FMU_OK;
}

int fmu_enter_initialisation(fmu *f)
{
    fmu_state *st = f->st;
    st->t = st->last_step_end = st->start;
    st->mode = FMU_INITIALISATION;
    st->stale_inputs = st->stale_initial = 1;
    st->off |= st->start != f->d->t0;
    fmu_touch(f);
    if (st->tolerance_defined && st->tolerance > 0)
        for (int i = 0; i < f->ny; i++) f->atol[i] = st->tolerance * f->d->nominal[i];
    else
        st->tolerance = f->d->tolerance;
    fmu_set_experiment(f);
    fmu_list_tables(f);
    return FMU_OK;
}

static int check_assertions(fmu *f)
{
    mech_real *holds = f->scratch;
    for (int k = 0; k < f->d->n_ranges; k++) {
        const fmu_range *r = f->d->ranges + k;
        const mech_real value = f->p[r->p];
        if (value < r->low || value > r->high)
            return fmu_fail(f, FMU_ERROR, "the parameter '%s' is %g%s, %s %g%s", r->name, value, r->unit,
                            value < r->low ? "below its minimum" : "above its maximum", value < r->low ? r->low : r->high,
                            r->unit);
    }
    if (!f->m->n_assertions) return FMU_OK;
    f->m->assertions(f->st->t, f->y, f->u, f->z, f->p, holds);
    for (int k = 0; k < f->m->n_assertions; k++)
        if (!(holds[k] > MECH_C(0.5))) return fmu_fail(f, FMU_ERROR, "at time %g: %s", f->st->t, f->d->assertions[k]);
    return FMU_OK;
}

int fmu_exit_initialisation(fmu *f)
{
    fmu_state *st = f->st;
    int status = fmu_refresh_initial(f);
    if (!status) status = fmu_refresh_rates(f);
    if (!status) status = fmu_refresh_outputs(f);
    if (!status) status = check_assertions(f);
    if (status) return status;
    st->off = 0;
    fmu_begin_drives(f);
    fmu_list_tables(f);
    st->solver_stale = 1;
    if (f->d->events && f->is_co_simulation && !f->event_mode) {
        status = f->d->events->begin(f);
        if (status) return status;
        st->solver_stale = 0;
    }
    st->mode = f->is_co_simulation && !f->event_mode ? FMU_STEP : FMU_EVENT;
    return FMU_OK;
}

int fmu_completed_step(fmu *f, int *event)
{
    const mech_model *m = f->m;
    *event = 0;
    int status = fmu_refresh_initial(f);
    if (!status) status = fmu_check_drives(f);
    if (!status) status = check_assertions(f);
    if (status) return status;
    if (fmu_off_unit(f) > f->st->tolerance) *event = 1;
    if (m->n_velocity) {
        /* the size of a correction over the nominal values, without making it */
        mech_real *moved = f->scratch;
        memcpy(moved, f->y, (size_t)f->ny * sizeof(mech_real));
        if (mech_project(f->s, f->st->t, moved)) return fmu_undefined(f, "the constraints cannot be met");
        for (int i = 0; i < m->nq + m->nv; i++)
            if (mech_abs(moved[i] - f->y[i]) > f->st->tolerance * (f->d->nominal[i] + mech_abs(f->y[i]))) *event = 1;
    }
    if (f->d->events && f->d->events->drifts(f)) *event = 1;
    return FMU_OK;
}

int fmu_update(fmu *f, fmu_news *news)
{
    memset(news, 0, sizeof *news);
    news->next = (mech_real)INFINITY;
    int status = fmu_refresh_initial(f);
    if (status) return status;
    mech_real *before = f->scratch;
    memcpy(before, f->y, (size_t)f->ny * sizeof(mech_real));
    if (f->d->events)
        status = f->d->events->update(f, news);
    else if (!f->is_co_simulation && fmu_project(f))
        status = fmu_fail(f, FMU_ERROR, "at time %g the constraints cannot be met", f->st->t);
    if (status) return status;
    news->moved = memcmp(before, f->y, (size_t)f->ny * sizeof(mech_real)) != 0;
    f->st->off = 0;
    fmu_touch(f);
    return FMU_OK;
}

/* The solver takes up what was changed from outside. */
static int take_over(fmu *f)
{
    mech_solver *s = f->s;
    if (f->d->events && !s->run->begun) return f->d->events->begin(f);
    fmu_list_tables(f);
    s->run->report.t = s->run->origin = f->st->t;
    if (f->st->off && fmu_project(f))
        return fmu_fail(f, FMU_DISCARD, "at time %g the constraints cannot be met", f->st->t);
    f->st->off = 0;
    mech_write(s, f->y);
    return FMU_OK;
}

int fmu_failed(fmu *f, int outcome)
{
    const mech_report *r = &f->s->run->report;
    const mech_real at = r->t;
    /* only a step can be made smaller */
    const int status = f->st->mode == FMU_STEP ? FMU_DISCARD : FMU_ERROR;
    switch (outcome) {
    case MECH_ASSERTION: return fmu_fail(f, FMU_ERROR, "at time %g: %s", at, f->d->assertions[r->failed_index]);
    case MECH_NOT_FINITE: return fmu_fail(f, status, "at time %g a derivative is not finite", at);
    case MECH_NO_SERIES: return fmu_fail(f, status, "at time %g a derivative has no Taylor series", at);
    case MECH_OFF_CONSTRAINTS: return fmu_fail(f, status, "at time %g the constraints cannot be met", at);
    case MECH_JUMPING:
        return fmu_fail(f, FMU_ERROR, "at time %g constraints of velocities would have to change these at once", at);
    case MECH_NOT_CONVERGED: return fmu_fail(f, status, "at time %g an implicit step did not converge", at);
    case MECH_STEP_TOO_SMALL:
        return fmu_fail(f, status, "at time %g the error bound cannot be met with any step size", at);
    default:
        return f->d->events ? f->d->events->fail(f, outcome)
                            : fmu_fail(f, FMU_ERROR, "the method does not fit the model");
    }
}

static void read_solver(fmu *f)
{
    memcpy(f->y, f->s->y, (size_t)f->ny * sizeof(mech_real));
    f->st->t = f->s->run->report.t;
    fmu_follow_drives(f);
    f->st->stale_inputs = 1;
    fmu_touch(f);
}

static int advance(fmu *f, mech_real end, int (*stop_asked)(fmu *f, mech_real t, mech_real *until))
{
    int outcome;
    do {
        outcome = mech_advance(f->s, end, stop_asked ? 1 : 1000);
        if (stop_asked && (outcome == MECH_RUNNING || outcome == MECH_REACHED)) {
            read_solver(f);
            mech_real until = end;
            if (stop_asked(f, f->st->t, &until)) {
                if (until <= f->st->t) break;
                end = mech_min(end, until);
            }
        }
    } while (outcome == MECH_RUNNING);
    return outcome;
}

int fmu_step(fmu *f, mech_real t, mech_real h, int (*stop_asked)(fmu *f, mech_real t, mech_real *until),
             fmu_news *news)
{
    fmu_state *st = f->st;
    memset(news, 0, sizeof *news);
    news->reached = st->t;
    if (!mech_finite(t) || !(mech_abs(t - st->t) <= MECH_C(1e-9) * mech_max(1, mech_abs(t))))
        return fmu_fail(f, FMU_ERROR, "the step begins at %.17g, the FMU stands at %.17g", t, st->t);
    const mech_real end = t + h;
    if (!(h > 0) || !mech_finite(end)) return fmu_fail(f, FMU_ERROR, "the step size %g is not positive and finite", h);
    if (st->stop_defined && end > st->stop + MECH_C(1e-9) * mech_max(1, mech_abs(st->stop)))
        return fmu_fail(f, FMU_ERROR, "the step to %.17g goes beyond the stop time %.17g", end, st->stop);
    news->ends = st->ended;
    if (st->ended) return FMU_OK;
    fmu_save(f, &f->saved);
    int status = fmu_refresh_parameters(f), outcome = MECH_RUNNING;
    if (!status) status = fmu_check_drives(f);
    if (!status && st->solver_stale) status = take_over(f);
    if (!status) {
        fmu_plan_drives(f, end);
        f->s->waits = f->event_mode && f->early_return;
        outcome = advance(f, end, stop_asked);
        if (outcome < 0) status = fmu_failed(f, outcome);
    }
    if (status) {
        fmu_load(f, f->saved);
        return status;
    }
    read_solver(f);
    st->last_step_end = news->reached = st->t;
    st->solver_stale = 0;
    news->event = outcome == MECH_AT_EVENT;
    news->ends = st->ended = outcome == MECH_TERMINATED;
    if (news->ends) fmu_tell(f, FMU_LOG_EVENTS, f->d->ends[f->s->run->report.failed_index]);
    return FMU_OK;
}
