/* Stepping with events: steps end where an indicator leaves its side, and at times known before. */
#include "hybrid.h"

#include <string.h>

#include "begin.h"
#include "branches.h"
#include "clock.h"
#include "contact_cones.h"
#include "contact_projection.h"
#include "history.h"
#include "indicators.h"
#include "instant.h"
#include "locate.h"
#include "contact_modes.h"
#include "method.h"
#include "projection.h"
#include "schedule.h"
#include "surface_friction.h"
#include "step.h"
#include "window.h"

static void swap(mech_real **a, mech_real **b)
{
    mech_real *x = *a;
    *a = *b;
    *b = x;
}

/* Of a crowd, whose rows at hand change with the attempt, before each of them. */
static void keep_sizes(mech_solver *s, int of_step)
{
    mech_event_state *e = s->events;
    if (of_step != !s->model->hybrid->crowd) return;
    memcpy(e->sizes, e->speed, (size_t)e->n_rows * sizeof(mech_real));
    memcpy(e->sizes + e->n_rows, e->force, (size_t)e->n_rows * sizeof(mech_real));
}

/* What a step beyond its event brings is not a size: forces may grow without bounds there, and so may speeds. */
static void forget_sizes(mech_solver *s)
{
    mech_event_state *e = s->events;
    for (int i = 0; i < e->n_rows && !s->model->hybrid->crowd; i++) {
        if (e->sizes[i] > 0) e->speed[i] = e->sizes[i];
        if (e->sizes[e->n_rows + i] > 0) e->force[i] = e->sizes[e->n_rows + i];
    }
}

/* Moves the attempted state onto the rows that hold. */
static void hold_attempt(mech_solver *s, mech_real t_new)
{
    const mech_real t = s->run->report.t;
    mech_event_state *e = s->events;
    if (s->method->impulses) return;
    s->run->report.t = t_new;
    swap(&s->y, &s->y_new);
    swap(&s->dy, &s->dy_new);
    keep_sizes(s, 0);
    mech_contact_projection_state(s);
    for (int i = 0; i < e->n_rows; i++)
        if (e->sizes[i] > 0) e->speed[i] = mech_min(e->speed[i], 100 * e->sizes[i]);
    swap(&s->y, &s->y_new);
    swap(&s->dy, &s->dy_new);
    s->run->report.t = t;
}

/* Whether an indicator that the polynomial of the step brings to zero at a part of it goes away from there by its own rate, and leaves zero
 * more slowly than the polynomial errs: the limit of a friction on what has no mass, which began to stick where its force was at the limit,
 * or the speed of a slip that a growing force has begun. */
static int rises_at(mech_solver *s, int hit, mech_real part, mech_real h)
{
    mech_event_state *e = s->events;
    mech_real *w = e->w + (MECH_SAMPLES - 1) * e->n, *rate = e->rate + (MECH_SAMPLES - 1) * e->n;
    const int n = s->model->hybrid->n_switches, of_row = hit >= n;
    if (part <= 0 || (hit >= s->model->hybrid->n_leading_switches && !of_row)) return 0;
    if (of_row && !mech_indicator_at_zero(s, hit, e->w[hit])) return 0;
    const mech_real place = of_row ? mech_max(part, MECH_C(1e-4)) : part; /* zero itself is flat */
    mech_indicator_place(s, hit, place, e->y_at);
    mech_indicator_read(s, hit, s->run->report.t + place * h, e->y_at, w, rate);
    return rate[hit] > MECH_C(1e-12) * e->rate_scale[hit] && (!of_row || w[hit] < 0);
}

/* dw/dt at a part of the attempted step; by a difference where it is not known. */
static mech_real slope_at(mech_solver *s, int hit, mech_real part, mech_real h)
{
    mech_event_state *e = s->events;
    mech_real *w = e->w + (MECH_SAMPLES - 1) * e->n, *rate = e->rate + (MECH_SAMPLES - 1) * e->n;
    const mech_real t = s->run->report.t, delta = mech_min(MECH_C(1e-3), part / 2);
    mech_dense_at(s->dense, s->n_dense, s->ny, part, e->y_at);
    mech_normalise(s->model, e->y_at);
    mech_indicator_read(s, hit, t + part * h, e->y_at, w, rate);
    if (rate[hit] != 0) return rate[hit];
    const mech_real end = w[hit];
    mech_dense_at(s->dense, s->n_dense, s->ny, part - delta, e->y_at);
    mech_normalise(s->model, e->y_at);
    mech_indicator_read(s, hit, t + (part - delta) * h, e->y_at, w, NULL);
    return (end - w[hit]) / (delta * h);
}

/* Attempts a part of a step that was good; *error as ever, at most 1 where good. MECH_NOT_FINITE where it has none. */
static int repeat_step(mech_solver *s, mech_real h, mech_real *error)
{
    const mech_method *m = s->method;
    const mech_real t_new = s->run->report.t + h;
    if (m->begin) m->begin(s, 1); /* what it remembers, its momenta among it, is the end of the whole step */
    *error = m->attempt(s, h);
    s->run->dense_of = 0;
    if (!mech_finite(*error)) return MECH_NOT_FINITE;
    mech_normalise(s->model, s->y_new);
    if (s->project && !m->keeps_constraints) {
        const int status = mech_project(s, t_new, s->y_new);
        if (status) return mech_fail(s, status, -1);
    }
    mech_rhs(s, t_new, s->y_new, s->dy_new);
    hold_attempt(s, t_new);
    return MECH_RUNNING;
}

enum { MOST_REPEATS = 12 };

/* Moves the end of the attempted step along its tangent; 0 where the square of that is more than rounding of a gap. Each
 * repetition of a step solves for the forces of a whole crowd again. */
static int moved_along_tangent(mech_solver *s, int hit, mech_real change, mech_real *h)
{
    const mech_model *m = s->model;
    const int row = hit - m->hybrid->n_switches;
    mech_real most = 0;
    if (!m->hybrid->crowd || row < 0) return 0;
    for (int i = m->nq; i < m->nq + m->nv; i++) most = mech_max(most, mech_abs(s->dy_new[i]));
    if (!(change * change * most <= MECH_C(1e-14) * s->events->gap_scale[row])) return 0;
    for (int i = 0; i < s->ny; i++) s->y_new[i] += change * s->dy_new[i];
    mech_normalise(m, s->y_new);
    *h += change;
    return 1;
}

/* Repeats the step so that it ends at the event: Newton's method on the step size. Where that does not settle at once,
 * it goes on by secants, to an end before the event: one beyond it would be a state that its mode does not allow. */
static int step_to_event(mech_solver *s, int hit, mech_real part, mech_real *h)
{
    mech_event_state *e = s->events;
    const mech_real t = s->run->report.t, whole = *h;
    mech_real *w = e->w + (MECH_SAMPLES - 1) * e->n;
    mech_real slope = slope_at(s, hit, part, whole), error, change = 0, before = 0;
    *h = part * whole;
    for (int k = 0;; k++) {
        int status = repeat_step(s, *h, &error);
        if (status == MECH_NOT_FINITE && k) { /* near it, then */
            status = repeat_step(s, *h -= change, &error);
            k = MOST_REPEATS;
        }
        if (status) return status;
        mech_indicator_read(s, hit, t + *h, s->y_new, w, NULL);
        if (k >= 3 && (w[hit] >= 0 || k >= MOST_REPEATS || mech_indicator_at_zero(s, hit, w[hit]))) break;
        if (k >= 3 && (w[hit] - before) / change < slope / 8) slope = (w[hit] - before) / change;
        before = w[hit];
        change = slope < 0 ? -w[hit] / slope : 0;
        if (mech_abs(change) <= 2 * MECH_EPSILON * mech_max(mech_abs(t), *h)) break;
        if (*h + change > 0 && moved_along_tangent(s, hit, change, h)) break;
        if (mech_abs(change) > *h / 4 || *h + change > whole) {
            if (w[hit] >= 0 || mech_indicator_at_zero(s, hit, w[hit])) break;
            change = -*h / 2;
        } else if (k >= 3) {
            change *= 2;
        }
        *h += change;
    }
    return MECH_RUNNING;
}

/* A step to the event where it is good, else a part of the way, without the event: a slide on a surface that ends or turns has a law that
 * turns the faster the less is left of the slip, and an implicit method that begins anew may not find its stages over so long a step; what
 * leads to an event that was hidden may hide as well. */
static int step_towards(mech_solver *s, int *hit, mech_real part, int hidden, mech_real *h)
{
    const int doubted = hidden || mech_surface_friction_at(s, *hit);
    const mech_real whole = *h, shares[] = {1, MECH_C(0.9999), MECH_C(0.99), MECH_C(0.9), MECH_C(0.5),
                                            MECH_C(0.1), MECH_C(1e-2), MECH_C(1e-3)};
    for (int k = 0; k < 8; k++) {
        mech_real error = 0;
        int status = MECH_RUNNING;
        *h = whole * part * shares[k];
        if (k || doubted) status = repeat_step(s, *h, &error);
        if (status == MECH_NOT_FINITE || error > 1) continue;
        if (!status && k == 0) {
            *h = whole;
            status = step_to_event(s, *hit, part, h);
        }
        if (status == MECH_NOT_FINITE) continue;
        if (k) *hit = -1;
        return status;
    }
    return MECH_NOT_FINITE;
}

/* Whether what rests at a part of the attempted step could go on to, by whatever shares of the loads. */
static int holds_at(mech_solver *s, mech_real part, mech_real h)
{
    const mech_real t = s->run->report.t;
    mech_real *y = s->y;
    if (part < 1) {
        mech_dense_at(s->dense, s->n_dense, s->ny, part, s->events->aside_at);
        mech_normalise(s->model, s->events->aside_at);
    }
    s->y = part < 1 ? s->events->aside_at : s->y_new;
    s->run->report.t = t + part * h;
    mech_rows_read(s);
    mech_rows_find_response(s);
    const int holds = mech_contact_cones_hold(s);
    s->y = y;
    s->run->report.t = t;
    return holds;
}

/* The part of the attempted step just behind which no share of the loads lets all rest, up to the part `until`; 1 where there is none.
 * What lasts less than the samples are apart is not seen, as of other events. */
static mech_real shares_end(mech_solver *s, mech_real h, mech_real until)
{
    enum { HALVES = 40 };
    static const mech_real places[] = {MECH_C(0.2371), MECH_C(0.5557), MECH_C(0.7913), 1};
    mech_real low = 0, high = 0;
    if (!(s->events->counters[MECH_CARRIED] > 0)) return 1;
    for (int k = 0; k < 4 && high == 0; k++) {
        if (holds_at(s, places[k] * until, h))
            low = places[k] * until;
        else
            high = places[k] * until;
    }
    if (high == 0) return 1;
    if (low == 0 && !holds_at(s, 0, h)) return 0;
    for (int k = 0; k < HALVES; k++) {
        const mech_real part = (low + high) / 2;
        if (holds_at(s, part, h))
            low = part;
        else
            high = part;
    }
    return high;
}

/* A branch that is undefined beyond its surface stops every step short of it, however small. Finds the switch that is
 * about to be reached, and moves along the tangent just beyond: an error of second order in a rounding. */
static int cross_tangentially(mech_solver *s)
{
    mech_event_state *e = s->events;
    mech_report *r = &s->run->report;
    const mech_real rounding = 10 * MECH_EPSILON * mech_abs(r->t) + MECH_C(1e-24) * s->o.dt_max;
    mech_real soonest = MECH_C(1e-9) * s->o.dt_max;
    int hit = -1;
    if (!e->n) return hit; /* times and clocks only */
    mech_indicators_read(s, r->t, s->y, e->w, e->rate);
    for (int k = 0; k < s->model->hybrid->n_switches; k++) {
        const mech_real wait = e->rate[k] < 0 ? e->w[k] / -e->rate[k] : -1;
        if (wait < 0 || wait > soonest) continue;
        soonest = wait;
        hit = k;
    }
    if (hit < 0) return hit;
    const mech_real h = 2 * soonest + rounding;
    for (int i = 0; i < s->ny; i++) s->y[i] += h * s->dy[i];
    mech_normalise(s->model, s->y);
    r->t += h;
    return hit;
}

/* Lets happen what was reached; where the caller wants to know before, only tells it. */
static int reach(mech_solver *s, int hit)
{
    if (!s->waits) return mech_instant(s, hit);
    s->run->pending = 1;
    s->run->pending_hit = hit;
    return MECH_AT_EVENT;
}

/* A limit of friction that an expression gives may have become negative. */
static int check_limits(mech_solver *s)
{
    int own = 0;
    for (int i = 0; i < s->events->n_rows; i++) own |= s->events->rows[i].kind == MECH_FRICTION && s->events->rows[i].normal < 0;
    if (!own) return MECH_RUNNING;
    mech_rows_read(s);
    return mech_rows_check(s, 1);
}

/* The end of a step of a crowd that is likely to meet an event: what lies far behind it would be looked at in vain. */
static mech_real paced(const mech_solver *s, mech_real limit)
{
    const mech_real pace = s->events->counters[MECH_PACE];
    return pace > 0 ? mech_min(limit, s->run->report.t + pace) : limit;
}

static void set_pace(mech_solver *s, mech_real h, int hit)
{
    enum { LONGER = 4 };
    if (s->model->hybrid->crowd && s->method->adaptive) 
        s->events->counters[MECH_PACE] = mech_max((hit >= 0 ? 1 : LONGER) * LONGER * h, MECH_C(1e-7) * s->o.dt_max);
}

/* An attempt of a step, and where in it which indicator leaves its side. */
static int try_and_locate(mech_solver *s, mech_real limit, mech_real *t_new, mech_real *h, int *hit, mech_real *part, int *hidden)
{
    enum { MOST_SHORTER = 8, SHORTER = 8 };
    mech_run *run = s->run;
    for (int shorter = 0;; shorter++) {
        int status = mech_step_try(s, limit, t_new, h);
        if (status) return status;
        if (s->model->hybrid->crowd && !s->method->impulses && (status = mech_window_for_step(s, t_new, h))) return status;
        if (!s->events->n) return MECH_RUNNING;
        hold_attempt(s, *t_new);
        mech_fill_dense(s, *h);
        if ((status = mech_locate(s, *h, hit, part, hidden))) return status;
        if (*hit < 0 || shorter == MOST_SHORTER || !s->method->adaptive || !rises_at(s, *hit, *part, *h)) return MECH_RUNNING;
        run->report.dt = *h / SHORTER;
        run->report.rejected++;
        run->after_rejection = 1;
    }
}

/* What a step that solved for contacts has found of them. */
static void tell_contacts(mech_solver *s)
{
    if (s->model->hybrid->crowd) {
        s->method->tell(s, s->events->z);
    } else {
        const mech_real *rates, *impulses = s->method->impulses(s, &rates);
        mech_contact_modes_tell(s, impulses, rates);
    }
}

/* What holds when a run begins, for laws and conditions that ask: what a step from there would find. */
static void look_ahead(mech_solver *s, mech_real limit)
{
    const mech_report *r = &s->run->report;
    const mech_hybrid *h = s->model->hybrid;
    if (!s->method->impulses || r->steps || !(h->n_told || h->n_branches)) return;
    if (s->method->attempt(s, mech_min(r->dt, limit - r->t)) <= 1) {
        tell_contacts(s);
        mech_branches_hold(s);
    }
    s->method->begin(s, 1);
}

/* Whether a friction in a contact slides. */
static int slides(const mech_solver *s)
{
    for (int i = 0; i < s->events->n_rows; i++) {
        const mech_row *row = mech_row_of(s, i);
        if (row->kind == MECH_FRICTION && row->normal >= 0 && s->events->z[row->sign] != 0) return 1;
    }
    return 0;
}

/* Where forces grow without bounds while a contact slides, its slip turns at once, by a shock (P. Painleve 1895). What a step beyond
 * that has seen is not a size. Gives whether there may be one. */
static int may_jam(mech_solver *s)
{
    mech_event_state *e = s->events;
    if (s->method->impulses || s->model->hybrid->crowd || !slides(s) || e->counters[MECH_JAMS] < 0) return 0;
    forget_sizes(s);
    e->counters[MECH_JAMS] = 1;
    return 1;
}

/* One step, and what happens at its end. */
static int hybrid_step(mech_solver *s, mech_real limit)
{
    mech_run *run = s->run;
    mech_event_state *e = s->events;
    const mech_real known = mech_schedule_next(s), next = s->history ? mech_min(known, mech_history_next(s)) : known;
    mech_real t_new, h, part;
    int hit = -1, given_up = 0, hidden = 0, rises = 0;
    keep_sizes(s, 1);
    look_ahead(s, mech_min(limit, next));
    int status = try_and_locate(s, paced(s, mech_min(limit, next)), &t_new, &h, &hit, &part, &hidden);
    if (status == MECH_NOT_FINITE && (hit = cross_tangentially(s)) >= 0) return reach(s, hit);
    if (status == MECH_STEP_TOO_SMALL && may_jam(s)) {
        run->report.status = MECH_RUNNING;
        return reach(s, -1);
    }
    if (status) return status;
    if (e->n) {
        const mech_real shared = shares_end(s, h, hit < 0 ? 1 : part);
        if (shared == 0) return reach(s, -1);
        if (shared < 1) {
            hit = -1;
            mech_real error;
            if ((status = repeat_step(s, h *= shared, &error))) return status;
            t_new = run->report.t + h;
            given_up = 1;
        }
    }
    if (hit >= 0 && part * h <= 0) {
        forget_sizes(s);
        return reach(s, hit);
    }
    if (hit >= 0) {
        status = step_towards(s, &hit, part, hidden, &h);
        forget_sizes(s);
        if (status == MECH_NOT_FINITE) status = mech_fail(s, MECH_STEP_TOO_SMALL, 0);
        if (status) return status;
        t_new = run->report.t + h;
        if (!(t_new > run->report.t)) return reach(s, hit);
        run->origin = t_new; /* fixed steps go on from here */
        run->n_fixed = 0;
    }
    set_pace(s, h, hit);
    const int stop = run->next_stop;
    if (s->history && (status = mech_history_keep(s, h))) return status;
    status = mech_step_accept(s, t_new, h);
    if (!status && s->method->impulses) {
        tell_contacts(s);
        rises = mech_branches_rise(s); /* what is closed changes without an event */
    }
    if (!status && s->history && run->next_stop > stop) status = mech_history_stop(s);
    if (status) return status;
    memset(e->fresh, 0, (size_t)e->n * sizeof(mech_real));
    e->counters[MECH_JAMS] = 0;
    const int broken = s->history ? mech_history_at_break(s) : 0;
    if (broken < 0) return broken;
    return hit >= 0 || given_up || broken || rises || mech_schedule_due(known, t_new) ? reach(s, hit) : check_limits(s);
}

static int advance(mech_solver *s, mech_real t_end, long max_steps)
{
    mech_run *run = s->run;
    mech_report *r = &run->report;
    /* Terminated stays terminated; what is full has been emptied. */
    if (r->status < 0 || r->status == MECH_TERMINATED) return r->status;
    if (!run->started) {
        const int status = mech_begin_run(s);
        if (status) return status;
    }
    if (run->pending) {
        run->pending = 0;
        const int status = mech_instant(s, run->pending_hit);
        if (status) return status;
    }
    for (long taken = 0; r->t < t_end; taken++) {
        if (taken == max_steps) return MECH_RUNNING;
        if (s->call_end > 0 && taken % 4 == 3 && mech_clock() > s->call_end) return MECH_RUNNING;
        if (s->o.record_capacity && r->n_record == s->o.record_capacity) return MECH_RECORD_FULL;
        if (s->o.instants && (r->n_instants == s->o.instant_capacity || 2 * r->n_events > s->o.event_capacity))
            return MECH_EVENTS_FULL;
        const int stop = run->next_stop < s->o.n_stops && s->o.stops[run->next_stop] < t_end;
        const int status = hybrid_step(s, stop ? s->o.stops[run->next_stop] : t_end);
        if (status) return status;
    }
    return MECH_REACHED;
}

int mech_hybrid_advance(mech_solver *s, mech_real t_end, long max_steps)
{
    if (s->model->hybrid->crowd) mech_window_again(s);
    const int status = advance(s, t_end, max_steps);
    if (s->history && s->run->begun) mech_history_look(s, s->run->report.t);
    if (s->model->hybrid->crowd) mech_window_name(s, status);
    return status;
}
