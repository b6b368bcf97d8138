#include "branches.h"

#include <string.h>

#include "energy.h"
#include "event_state.h"
#include "journal.h"
#include "projection.h"

void mech_branches_read(mech_solver *s, mech_real *out)
{
    mech_surroundings(s, s->run->report.t);
    s->model->hybrid->conditions(s->run->report.t, s->y, s->u, s->o.z, s->o.p, out);
}

/* Stops where branches fire in geometrically shrinking intervals: after MECH_RECENT of them, or as soon as what is
 * left of the sequence is too short for its rounded positions to tell one side of the condition from the other.
 * Intervals that shrink ever less, as those of turns under a constant torque, have no end. Clocks and times that were known
 * before are not part of the sequence, however close they come to each other. */
static int check_accumulation(mech_solver *s, int branch)
{
    enum { FEWEST = 4 };
    const mech_real shortest = MECH_C(1e-6); /* of the sequence */
    mech_event_state *e = s->events;
    const mech_real t = s->run->report.t;
    int count = (int)e->counters[MECH_FIRED];
    if (count && e->recent[(count - 1) % MECH_RECENT] == t) return MECH_RUNNING;
    e->recent[count % MECH_RECENT] = t;
    e->counters[MECH_FIRED] = ++count;
    const int kept = count < MECH_RECENT ? count : MECH_RECENT;
    mech_real last = 0, second = 0, middle = 0, first = 0, span = 0;
    int n = 0;
    for (mech_real newer = 0; n < kept - 1; n++) {
        const mech_real interval =
            e->recent[(count - 1 - n) % MECH_RECENT] - e->recent[(count - 2 - n) % MECH_RECENT];
        if (n && !(interval > newer)) break;
        if (n == 0) last = interval;
        if (n == 1) second = interval;
        if (n == MECH_RECENT / 2 - 1) middle = interval;
        first = interval;
        span += interval;
        newer = interval;
    }
    if (n < FEWEST) return MECH_RUNNING;
    const mech_real left = last * last / (second - last);
    const int geometric = n == MECH_RECENT - 1 && last * first < MECH_C(1.2) * middle * middle;
    if (left < shortest * span || (geometric && left < MECH_C(1.9) * span))
        return mech_fail(s, MECH_ZENO, branch);
    return MECH_RUNNING;
}

static int act(mech_solver *s, int k, int scheduled)
{
    const mech_model *m = s->model;
    const mech_branch *branch = &m->hybrid->branches[k];
    mech_event_state *e = s->events;
    const mech_real before = mech_energy_total(s);
    mech_surroundings(s, s->run->report.t);
    memcpy(e->act, s->y, (size_t)s->ny * sizeof(mech_real));
    memcpy(e->act + s->ny, e->z, (size_t)m->nz * sizeof(mech_real));
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
    mech_energy_book(s, mech_energy_total(s) - before);
    mech_journal_note(s, MECH_WHEN, k, 0);
    if (branch->terminates) return mech_fail(s, MECH_TERMINATED, k);
    e->counters[MECH_BRANCH] = k + 1;
    e->counters[MECH_BRANCH_TIME] = s->run->report.t;
    return scheduled ? MECH_RUNNING : check_accumulation(s, k);
}

int mech_branches_rise(mech_solver *s)
{
    mech_event_state *e = s->events;
    int rises = 0;
    if (!s->model->hybrid->n_branches) return 0;
    mech_branches_read(s, e->held_new);
    for (int k = 0; k < s->model->hybrid->n_branches; k++) {
        rises |= e->held_new[k] > MECH_C(0.5) && !(e->held[k] > MECH_C(0.5));
        if (!(e->held_new[k] > MECH_C(0.5))) e->held[k] = 0;
    }
    return rises;
}

void mech_branches_hold(mech_solver *s)
{
    mech_event_state *e = s->events;
    if (!s->model->hybrid->n_branches) return;
    mech_branches_read(s, e->held_new);
    for (int k = 0; k < s->model->hybrid->n_branches; k++) e->held[k] = mech_max(e->held[k], e->held_new[k]);
}

int mech_branches_begin(mech_solver *s)
{
    const mech_hybrid *h = s->model->hybrid;
    mech_event_state *e = s->events;
    int any = 0, status = MECH_RUNNING;
    for (int k = 0; k < h->n_branches; k++) any |= h->branches[k].event < 0;
    if (!any) return status;
    e->z[h->initial] = 1;
    mech_branches_read(s, e->held_new);
    for (int k = 0; k < h->n_branches && !status; k++)
        if (h->branches[k].event < 0 && e->held_new[k] > MECH_C(0.5)) status = act(s, k, 1);
    return status;
}

int mech_branches_fire(mech_solver *s, int first, int last, int scheduled, int *changed)
{
    const mech_hybrid *h = s->model->hybrid;
    mech_event_state *e = s->events;
    int served = -1;
    if (first == last) return MECH_RUNNING;
    mech_branches_read(s, e->held_new);
    for (int k = first; k < last; k++) {
        const int rises = e->held_new[k] > MECH_C(0.5) && !(e->held[k] > MECH_C(0.5));
        if (!rises || h->branches[k].event < 0 || h->branches[k].event == served) continue;
        served = h->branches[k].event;
        const int status = act(s, k, scheduled);
        if (status) {
            s->run->report.failed_index = k;
            return status;
        }
        *changed = k + 1;
    }
    memcpy(e->held + first, e->held_new + first, (size_t)(last - first) * sizeof(mech_real));
    return MECH_RUNNING;
}
