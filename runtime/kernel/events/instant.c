/* One instant: switches, impacts, modes and branches until nothing changes. */
#include "instant.h"

#include <string.h>

#include "branches.h"
#include "energy.h"
#include "history.h"
#include "impacts.h"
#include "indicators.h"
#include "method.h"
#include "journal.h"
#include "contact_modes.h"
#include "pieces.h"
#include "projection.h"
#include "rows.h"
#include "schedule.h"
#include "surface_friction.h"
#include "window.h"

enum { MOST_ROUNDS = 100, MOST_TURNS = 6, CROWD = 1000 };

/* Lets the state follow a law that has changed: a constraint may hold another rate now. What the law itself brings is
 * supplied; what the constraint takes out of the velocities, as a bend of a guide does, is lost. */
static int follow(mech_solver *s, mech_real before)
{
    mech_energy_supply(s, before);
    if (!s->project) return MECH_RUNNING;
    const mech_real free = mech_energy_booked(s) ? mech_energy_total(s) : 0;
    const int status = mech_project(s, s->run->report.t, s->y);
    if (status) return mech_fail(s, status, -1);
    if (mech_energy_booked(s)) mech_energy_book_beyond_rounding(s, free);
    return MECH_RUNNING;
}

/* Turns one switch; where an energy jumps there, an impulse goes with it, and the motion may be thrown back. */
static int turn(mech_solver *s, int k)
{
    mech_event_state *e = s->events;
    const mech_real before = s->model->hybrid->supplied < 0 ? 0 : mech_energy_total(s);
    int passed = 1;
    if (s->run->report.t > s->o.t0 || s->run->report.steps) {
        const int status = mech_impacts_pass_step(s, k, &passed);
        if (status) return status;
    }
    if (passed) {
        mech_real *z = e->z + s->model->hybrid->switches[k];
        *z = *z > MECH_C(0.5) ? 0 : 1;
    }
    e->fresh[k] = 1;
    const int *slides = s->model->hybrid->slides; /* a switch and the mode of sliding on its surface follow each other */
    for (int i = 0; slides && i < s->model->hybrid->n_switches; i++)
        if (i == slides[k] || slides[i] == k) e->fresh[i] = 1;
    return follow(s, before);
}

/* Turns every switch from first to last - 1 whose indicator is, or is about to be, on the wrong side. */
static int turn_switches(mech_solver *s, int first, int last, int *changed)
{
    mech_event_state *e = s->events;
    if (first == last) return MECH_RUNNING;
    mech_indicators_read(s, s->run->report.t, s->y, e->w, e->rate);
    for (int k = first; k < last; k++) {
        mech_widen(e->rate_scale + k, e->rate[k]);
        const int zero = mech_indicator_at_zero(s, k, e->w[k]);
        const int leaves = e->rate[k] < -MECH_C(1e-12) * e->rate_scale[k];
        const int known = e->fresh[k] > 0 || k < s->model->hybrid->n_leading_switches;
        if (zero ? !leaves || !known : e->w[k] >= 0) continue;
        const int status = turn(s, k);
        if (status) return status;
        *changed = k + 1;
    }
    return MECH_RUNNING;
}

/* What was exactly zero while a friction held may be zero but for the rounding of its terms now. */
static void widen_others(mech_solver *s)
{
    const mech_hybrid *h = s->model->hybrid;
    for (int k = h->n_leading_switches; k < h->n_switches; k++)
        mech_indicator_widen_by_terms(s, k, s->run->report.t, s->y);
}

/* Lets frictions on what has no mass stick or slide. What asks for a rate is asked after that: it does not go through zero where
 * a slip ends. */
static int lead(mech_solver *s, int scheduled, int *changed)
{
    const mech_hybrid *h = s->model->hybrid;
    int status = turn_switches(s, 0, h->n_leading_switches, changed);
    if (!status) status = mech_branches_fire(s, 0, h->n_leading_branches, scheduled, changed);
    if (*changed) widen_others(s);
    return status;
}

/* Impacts until nothing approaches, then the modes that fit. */
static int settle(mech_solver *s, int hit, int *changed)
{
    int count = 0, status;
    if (!s->events->n_rows || s->method->impulses) return MECH_RUNNING;
    if (mech_contact_modes_end_rattle(s)) *changed = 1;
    status = mech_impacts_resolve(s, &count);
    int struck = 0;
    if (!status) status = mech_contact_modes_choose(s, hit, &struck);
    if (count || struck) *changed = 1;
    return status;
}

/* Whether velocities are others than before the instant. */
static int is_jolted(const mech_solver *s)
{
    const int nq = s->model->nq;
    return memcmp(s->y + nq, s->events->y_before + nq, (size_t)s->model->nv * sizeof(mech_real)) != 0;
}

static int rounds(mech_solver *s, int hit, int ticks)
{
    const mech_hybrid *h = s->model->hybrid;
    int row = hit - h->n_switches, status, turns = 0, scheduled = 0;
    for (int round = 0;; round++) {
        const mech_real before = h->n_times && h->supplied >= 0 ? mech_energy_total(s) : 0;
        int changed = mech_schedule_set(s, ticks && round == 0), turned = 0, fired = 0;
        scheduled |= changed;
        status = changed && h->n_times ? follow(s, before) : MECH_RUNNING;
        if (!status) status = settle(s, row >= 0 ? row : -1, &changed);
        row = -1;
        if (!status) status = lead(s, scheduled, &turned);
        if (!status) status = turn_switches(s, h->n_leading_switches, h->n_switches, &turned);
        if (!status) status = mech_branches_fire(s, h->n_leading_branches, h->n_branches, scheduled, &fired);
        if (status) return status;
        if (!changed && !turned && !fired) return MECH_RUNNING;
        turns = turned && !fired ? turns + 1 : 0;
        if (turns == MOST_TURNS) {
            if (s->project && is_jolted(s)) s->run->report.failed_part = 3;
            return mech_fail_to_settle(s, MECH_CHATTER, turned - 1);
        }
        if (round == MOST_ROUNDS) {
            s->run->report.failed_part = !fired;
            return mech_fail(s, MECH_EVENT_LOOP, fired ? fired - 1 : turned ? turned - 1 : 0);
        }
    }
}

/* Names what goes on happening for less than a moment: a row, a branch that fires, or a switch. */
static int fail_to_progress(mech_solver *s, int hit, mech_real moment)
{
    mech_real *counters = s->events->counters;
    const int row = hit - s->model->hybrid->n_switches;
    if (row >= 0) {
        if ((counters[MECH_RATTLES] += 1) <= MOST_ROUNDS) return MECH_RUNNING;
        s->run->report.failed_part = 1;
        return mech_fail_to_settle(s, MECH_NO_MODE, row);
    }
    if (counters[MECH_BRANCH] > 0 && s->run->report.t - counters[MECH_BRANCH_TIME] <= moment)
        return mech_fail(s, MECH_ZENO, (int)counters[MECH_BRANCH] - 1);
    if (counters[MECH_JOLTS] > MOST_ROUNDS / 2) s->run->report.failed_part = s->events->n_rows ? 1 : 3;
    return mech_fail_to_settle(s, MECH_CHATTER, hit < 0 ? 0 : hit);
}

/* Many instants without a step between them, or crowds of them with steps that lead nowhere: a thousand bounces may be about to
 * end, but a thousand turns of a law lead as far as the next thousand. */
static int check_progress(mech_solver *s, int hit)
{
    const int turns = hit >= 0 && hit < s->model->hybrid->n_switches;
    mech_real *counters = s->events->counters;
    const mech_real share = turns ? MECH_C(1e-6) : MECH_C(1e-9);
    const mech_real t = s->run->report.t, moment = share * mech_min(s->o.dt_max, mech_abs(t));
    if ((counters[MECH_CROWD] += 1) >= CROWD) {
        const mech_real most = mech_max(moment, MECH_C(1e-12) * s->o.dt_max); /* near t = 0, too, the end must come */
        if (t - counters[MECH_CROWD_TIME] < most) return fail_to_progress(s, hit, most);
        counters[MECH_CROWD] = counters[MECH_RATTLES] = 0;
        counters[MECH_CROWD_TIME] = t;
    }
    if (t - counters[MECH_LAST_TIME] > 1000 * MECH_EPSILON * mech_abs(t)) {
        counters[MECH_STANDING] = 0;
        counters[MECH_LAST_TIME] = t;
        if (counters[MECH_CROWD] < CROWD) counters[MECH_RATTLES] = 0;
    } else if ((counters[MECH_STANDING] += 1) > MOST_ROUNDS) {
        return fail_to_progress(s, hit, moment);
    }
    return MECH_RUNNING;
}

/* Whether coordinates have moved since the last jolt, by their rates now. */
static int moved_since(const mech_solver *s, mech_real t)
{
    for (int i = 0; i < s->model->nq; i++)
        if (mech_abs(s->dy[i]) * (s->run->report.t - t) > MECH_C(1e-3) * (mech_nominal(s, i) + mech_abs(s->y[i]))) return 1;
    return 0;
}

/* Jolts again and again where a gap or a constraint bends, after which the state is where it was: a corner, which has one normal
 * at a time and throws what rests there from side to side. */
static int check_jolts(mech_solver *s, int hit)
{
    mech_event_state *e = s->events;
    const mech_model *m = s->model;
    if (hit < 0 || hit >= m->hybrid->n_switches || (!e->n_rows && !s->project)) return MECH_RUNNING;
    int moved = 0;
    if (!e->n_rows && moved_since(s, e->counters[MECH_JOLT_TIME])) e->counters[MECH_JOLTS] = 0; /* it only passes */
    e->counters[MECH_JOLT_TIME] = s->run->report.t;
    if (!is_jolted(s)) {
        e->counters[MECH_JOLTS] = 0;
        return MECH_RUNNING;
    }
    if (e->counters[MECH_JOLTS] == 0) memcpy(e->jolted, s->y, (size_t)s->ny * sizeof(mech_real));
    if ((e->counters[MECH_JOLTS] += 1) < CROWD) return MECH_RUNNING;
    e->counters[MECH_JOLTS] = 0;
    for (int i = 0; i < m->nq; i++)
        moved |= mech_abs(s->y[i] - e->jolted[i]) > MECH_C(1e-3) * (mech_nominal(s, i) + mech_abs(s->y[i]));
    if (moved) return MECH_RUNNING;
    s->run->report.failed_part = e->n_rows ? 1 : 3;
    return mech_fail(s, MECH_CHATTER, hit);
}

/* A switch that turns a thousand times, and between its turns its indicator moves by less than the tolerance: a force that jumps
 * through zero holds the motion there, ever closer and ever denser. Where a force bends without a jump, turns follow each other
 * as fast as before while their rate falls. */
static int check_rest(mech_solver *s, int hit)
{
    mech_event_state *e = s->events;
    const mech_real t = s->run->report.t;
    if (hit < 0 || hit >= s->model->hybrid->n_switches) return MECH_RUNNING;
    mech_indicators_read(s, t, s->y, e->w, e->rate);
    const mech_real wait = t - e->turned[hit], rate = mech_abs(e->rate[hit]);
    const mech_real way = rate * wait / 4; /* there and back under a constant force */
    e->turned[hit] = t;
    if (!(way > 0 && way < s->o.rtol * e->scale[hit])) e->idle[hit] = -1;
    if ((e->idle[hit] += 1) == 1) {
        e->first_wait[hit] = wait;
        e->first_rate[hit] = rate;
    }
    if (e->idle[hit] < CROWD) return MECH_RUNNING;
    e->idle[hit] = 0;
    const mech_real shorter = e->first_wait[hit] / wait;
    if (!(shorter > 1 && shorter * shorter > e->first_rate[hit] / rate)) return MECH_RUNNING;
    s->run->report.failed_part = 4;
    return mech_fail(s, MECH_CHATTER, hit);
}

static int rubs(const mech_solver *s, int i)
{
    const mech_row *row = mech_row_of(s, i);
    return row->kind == MECH_FRICTION || row->sign == MECH_FREEWHEEL;
}

/* Whether a friction that slides, or a freewheel, has come to where it may stick. */
static int may_stick(mech_solver *s)
{
    mech_event_state *e = s->events;
    const int n = s->model->hybrid->n_switches;
    int any = 0;
    for (int i = 0; i < e->n_rows; i++) any |= rubs(s, i) && !mech_row_holds(s, i);
    if (!any || s->method->impulses || s->model->hybrid->crowd) return 0;
    mech_indicators_read(s, s->run->report.t, s->y, e->w, e->rate);
    mech_rows_read(s);
    for (int i = 0; i < e->n_rows; i++) {
        if (!rubs(s, i) || mech_row_holds(s, i)) continue;
        const int on_surface = mech_row_partner(s, i) >= 0;
        if (on_surface ? mech_surface_friction_is_slow(s, i) : mech_indicator_at_zero(s, n + i, e->w[n + i])) return 1;
    }
    return 0;
}

/* Turns the switch that was hit. Where a friction comes to rest at this instant, what asks for the rate behind zero is not
 * reached: the modes come first. */
static int turn_hit(mech_solver *s, int hit)
{
    mech_event_state *e = s->events;
    int changed = 0, status = MECH_RUNNING;
    if (hit < s->model->hybrid->n_leading_switches) {
        status = turn(s, hit);
        widen_others(s);
        return status;
    }
    const int sticks = may_stick(s);
    if (sticks) status = settle(s, -1, &changed);
    if (!status) status = lead(s, 0, &changed);
    if (status) return status;
    if (sticks || changed) {
        mech_indicators_read(s, s->run->report.t, s->y, e->w, e->rate);
        const int known = e->rate_scale[hit] > 0, leaves = e->rate[hit] < -MECH_C(1e-12) * e->rate_scale[hit];
        if (mech_indicator_at_zero(s, hit, e->w[hit]) ? known && !leaves : e->w[hit] >= 0) return MECH_RUNNING;
    }
    return turn(s, hit);
}

/* A switch is on where its indicator is below zero. What has come to stay at zero, as the rate of what rests, is not below it.
 * Gives whether any was on. */
static int turn_equal(mech_solver *s)
{
    mech_event_state *e = s->events;
    const int n = s->model->hybrid->n_switches;
    int turned = 0;
    if (!n) return 0;
    mech_indicators_read(s, s->run->report.t, s->y, e->w, e->rate);
    for (int k = 0; k < n; k++) {
        mech_real *z = e->z + s->model->hybrid->switches[k];
        const int stays = e->rate_scale[k] > 0 && mech_abs(e->rate[k]) <= MECH_C(1e-12) * e->rate_scale[k];
        if (!(*z > MECH_C(0.5)) || !stays || !mech_indicator_at_zero(s, k, e->w[k])) continue;
        *z = 0;
        turned = 1;
    }
    return turned;
}

int mech_instant_happen(mech_solver *s, int hit, int ticks)
{
    mech_event_state *e = s->events;
    int status = MECH_RUNNING;
    if (s->history) mech_history_look_before(s);
    memcpy(e->y_before, s->y, (size_t)s->ny * sizeof(mech_real));
    memcpy(e->z_before, e->z, (size_t)s->model->nz * sizeof(mech_real));
    memset(e->fresh, 0, (size_t)e->n * sizeof(mech_real));
    memset(e->open, 0, (size_t)e->n_rows * sizeof(mech_real));
    memset(e->slides, 0, (size_t)e->n_rows * sizeof(mech_real));
    memset(e->delay, 0, (size_t)e->n_rows * sizeof(mech_real));
    if (hit >= 0) e->fresh[hit] = 1;
    if (hit >= 0 && hit < s->model->hybrid->n_switches) status = turn_hit(s, hit);
    if (!status) status = rounds(s, hit, ticks);
    if (!status && (e->n_rows || s->model->hybrid->n_leading_switches) && turn_equal(s)) status = rounds(s, -1, 0);
    if (s->history) mech_history_look(s, s->run->report.t);
    for (int i = 0; i < e->n_rows; i++) /* what touches now may open within rounding of zero */
        if (mech_row_touches(s, i)) e->fresh[s->model->hybrid->n_switches + i] = 1;
    if (mech_schedule_end_ticks(s) && s->model->hybrid->n_branches) mech_branches_read(s, e->held);
    return status;
}

/* Begins the piece behind an event. At the surface itself, within rounding, its branch may be undefined yet: then the
 * coordinates move on along their velocities, by roundings at first, until it is defined. */
static int enter_behind(mech_solver *s)
{
    mech_report *r = &s->run->report;
    int status = mech_piece_enter(s);
    mech_real h = 10 * MECH_EPSILON * mech_abs(r->t) + MECH_C(1e-24) * s->o.dt_max;
    for (; status == MECH_NOT_FINITE && h < MECH_C(1e-9) * s->o.dt_max; h *= 4) {
        for (int i = 0; i < s->ny; i++)
            if (mech_finite(s->dy[i])) s->y[i] += h * s->dy[i];
        mech_normalise(s->model, s->y);
        r->t += h;
        status = mech_piece_enter(s);
    }
    return status;
}

/* Whether the instant has changed anything since there were so many events. */
static int is_changed(const mech_solver *s, long events)
{
    const mech_event_state *e = s->events;
    return s->run->report.n_events > events || memcmp(e->y_before, s->y, (size_t)s->ny * sizeof(mech_real)) ||
           memcmp(e->z_before, e->z, (size_t)s->model->nz * sizeof(mech_real));
}

int mech_instant(mech_solver *s, int hit)
{
    mech_run *run = s->run;
    int status = check_progress(s, hit);
    if (!status) status = check_rest(s, hit);
    if (status) return status;
    const long events = run->report.n_events;
    if (s->model->hybrid->crowd) hit = mech_window_for_instant(s, hit);
    status = mech_instant_happen(s, hit, 1);
    if (status >= 0) status = check_jolts(s, hit) < 0 ? MECH_CHATTER : status;
    if (status < 0) return status;
    mech_journal_modes(s, 0);
    if (s->o.events && run->report.n_events >= s->o.event_capacity) return mech_fail(s, MECH_EVENT_LOOP, -1);
    if (is_changed(s, events)) mech_journal_instant(s);
    if (status) return status;
    run->error_old = 0;
    run->started = 0; /* a jump: methods with a memory forget it */
    status = enter_behind(s);
    run->started = 1;
    if (s->history && !status) status = mech_history_instant(s);
    return status ? status : mech_piece_check(s);
}
