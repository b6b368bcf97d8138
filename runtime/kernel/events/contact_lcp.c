/* What presses in a crowd without friction is the solution of one problem of complementarity of accelerations; contacts that
 * would fall back slower than they rest are laid down, by one of velocities. */
#include "contact_lcp.h"

#include <string.h>

#include "envelope.h"
#include "near_rows.h"
#include "rows.h"

static void set(mech_solver *s, int i, int flag) { s->events->z[mech_row_of(s, i)->flag] = flag; }

/* Those of the contacts that may rest that press: of the others the force is zero, and they do not come closer. A contact
 * that was located where its force ends is out at first, and held again only if it would come back. */
static int press(mech_solver *s, int ends)
{
    mech_event_state *e = s->events;
    mech_near_rows_problem p;
    p.n = 0;
    for (int i = 0; i < e->n_rows; i++)
        if (mech_row_may_rest(s, i) && mech_row_moves_itself(s, i)) {
            p.in[p.n] = i != ends;
            p.held[p.n] = 0;
            p.set[p.n++] = i;
        }
    for (int i = 0; i < e->n_rows; i++) set(s, i, 0);
    mech_rows_read(s);
    mech_rows_weigh(s);
    for (int k = 0; k < p.n; k++) {
        const int i = p.set[k];
        p.q[k] = mech_row_value(s, i, MECH_SECOND);
        p.slack[k] = MECH_C(1e-7) * e->force[i] * mech_row_response(s, i, i);
        p.weak[k] = MECH_C(1e-10) * e->force[i];
    }
    if (!mech_near_rows_complement(s, &p)) return MECH_NO_MODE;
    for (int k = 0; k < p.n; k++) set(s, p.set[k], p.in[k]);
    mech_rows_read(s);
    return MECH_RUNNING;
}

/* Marks contacts that rise and would fall back, from no height or at no speed that matters; gives how many there are. */
static int mark_short_flights(mech_solver *s)
{
    mech_event_state *e = s->events;
    int count = 0;
    for (int i = 0; i < e->n_rows; i++) {
        const mech_real rate = mech_row_value(s, i, MECH_RATE);
        if (mech_row_holds(s, i) || e->open[i] != 0 || !(rate > 0) || !mech_row_touches(s, i)) continue;
        const mech_real slack = MECH_C(1e-7) * e->force[i] * mech_row_response(s, i, i);
        const int slow = rate <= mech_row_rest(s, i) && mech_row_value(s, i, MECH_SECOND) < -slack;
        if (!slow && !mech_row_falls_back(s, i, rate)) continue;
        e->open[i] = -1;
        count++;
    }
    return count;
}

/* The nearest velocities, by kinetic energy, at which what is marked and what presses rests, and nothing approaches. */
static int lay_down(mech_solver *s)
{
    mech_event_state *e = s->events;
    mech_near_rows_problem p;
    p.n = 0;
    for (int i = 0; i < e->n_rows; i++) {
        if (!mech_row_touches(s, i) || !mech_row_moves_itself(s, i)) continue;
        p.held[p.n] = e->open[i] < 0 || mech_row_holds(s, i);
        p.in[p.n] = p.held[p.n];
        p.q[p.n] = mech_row_value(s, i, MECH_RATE);
        p.slack[p.n] = mech_row_idle(s, i) / 10;
        p.weak[p.n] = 0;
        p.set[p.n++] = i;
    }
    if (!mech_near_rows_complement(s, &p)) return MECH_NO_MODE;
    for (int k = 0; k < p.n; k++)
        if (!p.in[k] && p.q[k] < 0) e->open[p.set[k]] = -1;
    memset(e->impulse, 0, (size_t)e->n_rows * sizeof(mech_real));
    for (int k = 0; k < p.n; k++) e->impulse[p.set[k]] = p.x[k];
    const int account = s->model->hybrid->dissipated;
    const mech_real before = account < 0 ? 0 : s->y[account];
    mech_rows_apply_impulses(s);
    if (account >= 0) s->run->report.laid_energy += s->y[account] - before;
    return MECH_RUNNING;
}

static int holds_what_moves(const mech_solver *s)
{
    int moves = 0;
    for (int i = 0; i < s->events->n_rows; i++)
        moves |= mech_row_holds(s, i) && mech_abs(mech_row_value(s, i, MECH_RATE)) > mech_row_still(s, i);
    return moves;
}

int mech_contact_lcp_choose(mech_solver *s, int ends)
{
    for (int round = 0;; round++) {
        int status = press(s, ends);
        if (status) return status;
        const int count = mark_short_flights(s);
        if (!count && (round || !holds_what_moves(s))) return MECH_RUNNING;
        s->run->report.laid += count;
        status = lay_down(s);
        if (status) return status;
    }
}
