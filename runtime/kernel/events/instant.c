/* One instant: switches, impacts, modes and branches until nothing changes. */
#include <string.h>

#include "advance.h"
#include "hybrid.h"

enum { MOST_ROUNDS = 100, MOST_TURNS = 6, CROWD = 1000 };

void mech_note(mech_solver *s, int kind, int index, mech_real value)
{
    mech_report *r = &s->run->report;
    if (!s->o.events || r->n_events >= s->o.event_capacity) return; /* too many at one instant: mech_instant tells */
    const mech_real t = r->t + (kind == MECH_REST ? value : 0);
    s->o.events[r->n_events++] = (mech_event){t, kind == MECH_REST ? 0 : value, kind, index, r->n_instants};
}

static void read_inputs(mech_solver *s)
{
    if (s->model->nu)
        mech_inputs(s->model, s->o.tables, s->o.n_tables, s->segments, s->run->report.t, s->o.p, s->u);
}

void mech_read_conditions(mech_solver *s, mech_real *out)
{
    read_inputs(s);
    s->model->hybrid->conditions(s->run->report.t, s->y, s->u, s->o.z, s->o.p, out);
}

static mech_real total_energy(mech_solver *s)
{
    const mech_hybrid *h = s->model->hybrid;
    if (h->total < 0) return 0;
    read_inputs(s);
    s->model->outputs(s->run->report.t, s->y, s->u, s->o.z, s->o.p, s->modes->outputs);
    mech_real total = s->modes->outputs[h->total];
    return total;
}

/* Books a change of the total energy. */
static void book(mech_solver *s, mech_real gain)
{
    const mech_hybrid *h = s->model->hybrid;
    if (h->supplied >= 0 && (gain > 0 || h->dissipated < 0))
        s->y[h->supplied] += gain;
    else if (h->dissipated >= 0)
        s->y[h->dissipated] -= gain;
}

/* Books what a law brings in that changes at this instant, and with it the energy of a state that stays. */
static void supply(mech_solver *s, mech_real before)
{
    const int account = s->model->hybrid->supplied;
    if (account < 0) return;
    const mech_real after = total_energy(s), gain = after - before;
    if (mech_abs(gain) > MECH_C(1e-12) * (mech_abs(before) + mech_abs(after))) s->y[account] += gain;
}

/* Lets the state follow a law that has changed: a constraint may hold another rate now. */
static int follow(mech_solver *s, mech_real before)
{
    if (s->project) {
        const int status = mech_project(s, s->run->report.t, s->y);
        if (status) return mech_fail(s, status, -1);
    }
    supply(s, before);
    return MECH_RUNNING;
}

int mech_set_times(mech_solver *s, int ticks)
{
    const mech_hybrid *h = s->model->hybrid;
    mech_modes *e = s->modes;
    const mech_real t = s->run->report.t;
    int changed = 0;
    if (!(h->n_times + h->n_clocks)) return 0;
    h->crossing_times(t, s->y, s->u, e->z, s->o.p, e->times);
    for (int k = 0; k < h->n_times; k++) {
        const mech_real after = (mech_real)h->times[2 * k + 1], value = t >= e->times[k] ? after : 1 - after;
        if (e->z[h->times[2 * k]] != value) {
            e->z[h->times[2 * k]] = value;
            changed = 1;
        }
    }
    for (int k = 0; ticks && k < h->n_clocks; k++)
        if (e->times[h->n_times + k] == t) {
            e->z[h->clocks[2 * k]] = 1;
            changed = 1;
        }
    return changed;
}

/* Pulses end, counts go on to the next tick. */
static void end_ticks(mech_solver *s)
{
    const mech_hybrid *h = s->model->hybrid;
    mech_real *z = s->modes->z;
    int ended = h->initial >= 0 && z[h->initial] > 0;
    for (int k = 0; k < h->n_clocks; k++)
        if (z[h->clocks[2 * k]] > 0) {
            z[h->clocks[2 * k]] = 0;
            z[h->clocks[2 * k + 1]] += 1;
            ended = 1;
        }
    if (h->initial >= 0) z[h->initial] = 0;
    if (ended && h->n_branches) mech_read_conditions(s, s->modes->held);
}

/* Turns one switch; where an energy jumps there, an impulse goes with it, and the motion may be thrown back. */
static int turn(mech_solver *s, int k)
{
    mech_modes *e = s->modes;
    const mech_real before = s->model->hybrid->supplied < 0 ? 0 : total_energy(s);
    int passed = 1;
    if (s->run->report.t > s->o.t0 || s->run->report.steps) {
        const int status = mech_pass_step(s, k, &passed);
        if (status) return status;
    }
    if (passed) {
        mech_real *z = e->z + s->model->hybrid->switches[k];
        *z = *z > MECH_C(0.5) ? 0 : 1;
    }
    e->fresh[k] = 1;
    return follow(s, before);
}

/* Turns every switch whose indicator is, or is about to be, on the wrong side. */
static int turn_switches(mech_solver *s, int *changed)
{
    mech_modes *e = s->modes;
    const int n = s->model->hybrid->n_switches;
    if (!n) return MECH_RUNNING;
    mech_indicate(s, s->run->report.t, s->y, e->w, e->rate);
    for (int k = 0; k < n; k++) {
        mech_widen(e->rate_scale + k, e->rate[k]);
        const int zero = mech_at_zero(s, k, e->w[k]);
        const int leaves = e->rate[k] < -MECH_C(1e-12) * e->rate_scale[k];
        if (zero ? !leaves || !(e->fresh[k] > 0) : e->w[k] >= 0) continue;
        const int status = turn(s, k);
        if (status) return status;
        *changed = k + 1;
    }
    return MECH_RUNNING;
}

/* Stops where branches fire in geometrically shrinking intervals: after MECH_RECENT of them, or as soon as what is
 * left of the sequence is too short for its rounded positions to tell one side of the condition from the other. */
static int check_accumulation(mech_solver *s, int branch)
{
    enum { FEWEST = 4 };
    const mech_real shortest = MECH_C(1e-6); /* of the sequence */
    mech_modes *e = s->modes;
    const mech_real t = s->run->report.t;
    int count = (int)e->counters[MECH_FIRED];
    if (count && e->recent[(count - 1) % MECH_RECENT] == t) return MECH_RUNNING;
    e->recent[count % MECH_RECENT] = t;
    e->counters[MECH_FIRED] = ++count;
    e->counters[MECH_BRANCH] = branch;
    const int kept = count < MECH_RECENT ? count : MECH_RECENT;
    mech_real last = 0, second = 0, span = 0;
    int n = 0;
    for (mech_real newer = 0; n < kept - 1; n++) {
        const mech_real interval =
            e->recent[(count - 1 - n) % MECH_RECENT] - e->recent[(count - 2 - n) % MECH_RECENT];
        if (n && !(interval > newer)) break;
        if (n == 0) last = interval;
        if (n == 1) second = interval;
        span += interval;
        newer = interval;
    }
    if (n < FEWEST) return MECH_RUNNING;
    const mech_real left = last * last / (second - last);
    if (left < shortest * span || (n == MECH_RECENT - 1 && left < MECH_C(1.9) * span))
        return mech_fail(s, MECH_ZENO, branch);
    return MECH_RUNNING;
}

static int act(mech_solver *s, int k)
{
    const mech_model *m = s->model;
    const mech_branch *branch = &m->hybrid->branches[k];
    mech_modes *e = s->modes;
    const mech_real before = total_energy(s);
    read_inputs(s);
    branch->act(s->run->report.t, s->y, s->u, e->z, s->o.p, e->act);
    for (int i = 0; i < branch->n_checks; i++)
        if (!(e->act[s->ny + m->nz + i] > MECH_C(0.5))) {
            s->run->report.failed_part = i;
            return mech_fail(s, MECH_BRANCH_ASSERTION, k);
        }
    memcpy(s->y, e->act, (size_t)s->ny * sizeof(mech_real));
    memcpy(e->z, e->act + s->ny, (size_t)m->nz * sizeof(mech_real));
    mech_normalise(m, s->y);
    if (s->project) {
        const int status = mech_project(s, s->run->report.t, s->y);
        if (status) return mech_fail(s, status, -1);
    }
    book(s, total_energy(s) - before);
    mech_note(s, MECH_WHEN, k, 0);
    if (branch->terminates) return mech_fail(s, MECH_TERMINATED, k);
    return check_accumulation(s, k);
}

/* Fires the branches whose conditions have risen: the first one of each event. */
static int fire(mech_solver *s, int *changed)
{
    const mech_hybrid *h = s->model->hybrid;
    mech_modes *e = s->modes;
    int served = -1;
    if (!h->n_branches) return MECH_RUNNING;
    mech_read_conditions(s, e->held_new);
    for (int k = 0; k < h->n_branches; k++) {
        const int rises = e->held_new[k] > MECH_C(0.5) && !(e->held[k] > MECH_C(0.5));
        if (!rises || h->branches[k].event == served) continue;
        served = h->branches[k].event;
        const int status = act(s, k);
        if (status) {
            s->run->report.failed_index = k;
            return status;
        }
        *changed = k + 1;
    }
    memcpy(e->held, e->held_new, (size_t)h->n_branches * sizeof(mech_real));
    return MECH_RUNNING;
}

/* Impacts until nothing approaches, then the modes that fit. */
static int settle(mech_solver *s, int hit, int *changed)
{
    int count = 0, status;
    if (!s->modes->n_rows) return MECH_RUNNING;
    status = mech_impacts(s, &count);
    if (!status) status = mech_choose_modes(s, hit);
    if (count) *changed = 1;
    return status;
}

static int rounds(mech_solver *s, int hit, int ticks)
{
    const mech_hybrid *h = s->model->hybrid;
    int row = hit - h->n_switches, status, turns = 0;
    for (int round = 0;; round++) {
        const mech_real before = h->n_times && h->supplied >= 0 ? total_energy(s) : 0;
        int changed = mech_set_times(s, ticks && round == 0), turned = 0, fired = 0;
        status = changed && h->n_times ? follow(s, before) : MECH_RUNNING;
        if (!status) status = settle(s, row >= 0 ? row : -1, &changed);
        row = -1;
        if (!status) status = turn_switches(s, &turned);
        if (!status) status = fire(s, &fired);
        if (status) return status;
        if (!changed && !turned && !fired) return MECH_RUNNING;
        turns = turned && !fired ? turns + 1 : 0;
        if (turns == MOST_TURNS) return mech_fail(s, MECH_CHATTER, turned - 1);
        if (round == MOST_ROUNDS) {
            s->run->report.failed_part = !fired;
            return mech_fail(s, MECH_EVENT_LOOP, fired ? fired - 1 : turned ? turned - 1 : 0);
        }
    }
}

/* Whether row i belongs to the row before it: of a constraint of vectors, or of friction on a surface. */
static int belongs(const mech_solver *s, int i)
{
    const mech_row *rows = s->model->hybrid->rows;
    return i && (rows[i - 1].flag == rows[i].flag || mech_partner(s, i - 1) == i);
}

void mech_note_modes(mech_solver *s, int quiet)
{
    const mech_hybrid *h = s->model->hybrid;
    mech_modes *e = s->modes;
    for (int i = 0; i < h->n_rows; i++) {
        const mech_row *row = &h->rows[i];
        if (row->flag < 0) continue;
        const int partner = mech_partner(s, i);
        mech_real flag = e->z[row->flag], sign = row->sign < 0 ? 0 : e->z[row->sign];
        if (partner >= 0) {
            flag = mech_max(flag, e->z[h->rows[partner].flag]);
            sign = mech_max(mech_abs(sign), mech_abs(e->z[h->rows[partner].sign]));
        }
        if (!quiet && flag != e->flags[i]) {
            const int kinds[3][2] = {
                {MECH_LIFT_OFF, MECH_REST}, {MECH_SLIP, MECH_STICK}, {MECH_RELEASED, MECH_ENGAGED}};
            const int open = row->normal >= 0 && !(e->z[h->rows[row->normal].flag] > MECH_C(0.5));
            const int idle = row->kind == MECH_FRICTION && !(flag > MECH_C(0.5)) && sign == 0; /* others hold it */
            if (!open && !idle && !belongs(s, i))
                mech_note(s, kinds[row->kind][flag > MECH_C(0.5)], i, e->delay[i]);
        } else if (!quiet && row->kind == MECH_FRICTION && sign * e->signs[i] < 0 && !belongs(s, i)) {
            mech_note(s, MECH_SLIP, i, 0);
        }
        e->flags[i] = flag;
        e->signs[i] = sign;
    }
}

void mech_write_instant(mech_solver *s)
{
    if (!s->o.instants) return;
    mech_report *r = &s->run->report;
    const mech_modes *e = s->modes;
    const size_t ny = (size_t)s->ny, nz = (size_t)s->model->nz, real = sizeof(mech_real);
    mech_real *row = s->o.instants + (size_t)r->n_instants * (1 + 2 * (ny + nz));
    row[0] = r->t;
    memcpy(row + 1, e->y_before, ny * real);
    memcpy(row + 1 + ny, e->z_before, nz * real);
    memcpy(row + 1 + ny + nz, s->y, ny * real);
    memcpy(row + 1 + 2 * ny + nz, e->z, nz * real);
    r->n_instants++;
}

/* Names what goes on happening: a branch, a row, or a switch. */
static int fail_to_progress(mech_solver *s, int hit)
{
    const mech_modes *e = s->modes;
    const int row = hit - s->model->hybrid->n_switches;
    if (row >= 0) return mech_fail(s, MECH_NO_MODE, row);
    if (e->counters[MECH_FIRED] > 0) return mech_fail(s, MECH_ZENO, (int)e->counters[MECH_BRANCH]);
    return mech_fail(s, MECH_CHATTER, hit < 0 ? 0 : hit);
}

/* Many instants without a step between them, or crowds of them with steps that lead nowhere. */
static int check_progress(mech_solver *s, int hit)
{
    mech_real *counters = s->modes->counters;
    const mech_real t = s->run->report.t, moment = MECH_C(1e-9) * mech_min(s->o.dt_max, mech_abs(t));
    if ((counters[MECH_CROWD] += 1) >= CROWD) {
        if (t - counters[MECH_CROWD_TIME] < moment) return fail_to_progress(s, hit);
        counters[MECH_CROWD] = 0;
        counters[MECH_CROWD_TIME] = t;
    }
    if (t - counters[MECH_LAST_TIME] > 1000 * MECH_EPSILON * mech_abs(t)) {
        counters[MECH_STANDING] = 0;
        counters[MECH_LAST_TIME] = t;
    } else if ((counters[MECH_STANDING] += 1) > MOST_ROUNDS) {
        return fail_to_progress(s, hit);
    }
    return MECH_RUNNING;
}

int mech_happen(mech_solver *s, int hit, int ticks)
{
    mech_modes *e = s->modes;
    int status = MECH_RUNNING;
    memcpy(e->y_before, s->y, (size_t)s->ny * sizeof(mech_real));
    memcpy(e->z_before, e->z, (size_t)s->model->nz * sizeof(mech_real));
    memset(e->fresh, 0, (size_t)e->n * sizeof(mech_real));
    memset(e->open, 0, (size_t)e->n_rows * sizeof(mech_real));
    memset(e->slides, 0, (size_t)e->n_rows * sizeof(mech_real));
    memset(e->delay, 0, (size_t)e->n_rows * sizeof(mech_real));
    if (hit >= 0) e->fresh[hit] = 1;
    if (hit >= 0 && hit < s->model->hybrid->n_switches) status = turn(s, hit);
    if (!status) status = rounds(s, hit, ticks);
    for (int i = 0; i < e->n_rows; i++) /* what touches now may open within rounding of zero */
        if (mech_touches(s, i)) e->fresh[s->model->hybrid->n_switches + i] = 1;
    end_ticks(s);
    return status;
}

/* Begins the piece behind an event. At the surface itself, within rounding, its branch may be undefined yet: then the
 * coordinates move on along their velocities, by roundings at first, until it is defined. */
static int enter_behind(mech_solver *s)
{
    mech_report *r = &s->run->report;
    int status = mech_enter_pieces(s);
    mech_real h = 10 * MECH_EPSILON * mech_abs(r->t) + MECH_C(1e-24) * s->o.dt_max;
    for (; status == MECH_NOT_FINITE && h < MECH_C(1e-9) * s->o.dt_max; h *= 4) {
        for (int i = 0; i < s->ny; i++)
            if (mech_finite(s->dy[i])) s->y[i] += h * s->dy[i];
        mech_normalise(s->model, s->y);
        r->t += h;
        status = mech_enter_pieces(s);
    }
    return status;
}

int mech_instant(mech_solver *s, int hit)
{
    mech_run *run = s->run;
    mech_modes *e = s->modes;
    int status = check_progress(s, hit);
    if (status) return status;
    const long events = run->report.n_events;
    status = mech_happen(s, hit, 1);
    if (status < 0) return status;
    mech_note_modes(s, 0);
    if (s->o.events && run->report.n_events >= s->o.event_capacity) return mech_fail(s, MECH_EVENT_LOOP, -1);
    if (run->report.n_events > events || memcmp(e->y_before, s->y, (size_t)s->ny * sizeof(mech_real)) ||
        memcmp(e->z_before, e->z, (size_t)s->model->nz * sizeof(mech_real)))
        mech_write_instant(s);
    if (status) return status;
    run->error_old = 0;
    run->started = 0; /* a jump: methods with a memory forget it */
    status = enter_behind(s);
    run->started = 1;
    return status ? status : mech_check_assertions(s);
}
