/* States that somebody else has integrated, a little beyond the event at which they ought to have stopped.
 *
 * Such a state goes back along its motion, so that a bounce neither gains nor loses energy by where it was noticed.
 */
#include "overshoot.h"

#include <string.h>

#include "contact_projection.h"
#include "rows.h"

enum { MOST_LOOKS = 5 };

/* Open contacts with a negative gap, behind the n rows that are listed already. */
static int list_passed(mech_solver *s, int n, int *rows)
{
    const mech_real *z = s->events->z;
    for (int i = 0; i < s->events->n_rows; i++) {
        const mech_row *row = mech_row_of(s, i);
        if (row->kind != MECH_CONTACT || z[row->flag] > MECH_C(0.5)) continue;
        if (row->enabled >= 0 && !(z[row->enabled] > MECH_C(0.5))) continue;
        if (mech_row_value(s, i, MECH_GAP) < 0) rows[n++] = i;
    }
    return n;
}

/* Moves along the motion by `time`: to second order in the coordinates, to first in all else. */
static void drift(mech_solver *s, mech_real time)
{
    const mech_model *m = s->model;
    mech_rhs(s, s->run->report.t, s->y, s->dy);
    mech_contact_projection_move(s, s->dy + m->nq);
    for (int i = 0; i < s->ny; i++) {
        const mech_real bend = i < m->nq ? time * time / 2 * s->events->move[i] : 0;
        s->y[i] += time * s->dy[i] + bend;
    }
    mech_normalise(m, s->y);
    s->run->report.t += time;
}

/* For how long the gap of row i has been negative, or, where it was at no time near, since it approached. */
static mech_real since(const mech_solver *s, int i)
{
    const mech_real gap = mech_row_value(s, i, MECH_GAP), rate = mech_row_value(s, i, MECH_RATE);
    const mech_real second = mech_row_value(s, i, MECH_SECOND);
    const mech_real square = rate * rate - 2 * second * gap;
    if (!(rate < 0) || !mech_finite(square)) return 0;
    const mech_real time = square > 0 ? 2 * gap / (rate - mech_sqrt(square)) : rate / second;
    return mech_min(time, s->o.dt_max);
}

/* Whether row i slides by a friction of its own, not on a surface. */
static int slides(const mech_solver *s, int i)
{
    const mech_row *row = &s->events->rows[i];
    const mech_real *z = s->events->z;
    if (row->kind != MECH_FRICTION || z[row->flag] > MECH_C(0.5) || z[row->sign] == 0) return 0;
    if (row->normal >= 0 && !(z[s->events->rows[row->normal].flag] > MECH_C(0.5))) return 0;
    return mech_row_partner(s, i) < 0 && !(i > 0 && mech_row_partner(s, i - 1) == i);
}

/* For how long friction i has slid the other way. */
static mech_real since_reversal(const mech_solver *s, int i)
{
    const mech_real sign = s->events->z[s->events->rows[i].sign];
    const mech_real along = sign * mech_row_value(s, i, MECH_RATE), second = sign * mech_row_value(s, i, MECH_SECOND);
    return along < 0 && second < 0 ? mech_min(along / second, s->o.dt_max) : 0;
}

mech_real mech_overshoot_go_back(mech_solver *s)
{
    const mech_real present = s->run->report.t;
    int rows[MECH_MOST_ROWS];
    if (!s->events->n_rows) return 0;
    mech_contact_projection_state(s);
    mech_rows_read(s);
    for (int look = 0; look < MOST_LOOKS; look++) {
        const int n = list_passed(s, 0, rows);
        mech_real time = 0;
        for (int k = 0; k < n; k++) time = mech_max(time, since(s, rows[k]));
        for (int i = 0; i < s->events->n_rows; i++)
            if (slides(s, i)) time = mech_max(time, since_reversal(s, i));
        if (!(time > 0)) break;
        drift(s, -time);
        mech_rows_read(s);
    }
    const int held = mech_contact_projection_rows(s, rows);
    int n = list_passed(s, held, rows);
    mech_rows_find_response(s);
    if (n > held) mech_contact_projection_close_gaps(s, n, rows);
    n = held;
    for (int i = 0; i < s->events->n_rows; i++) {
        const mech_row *row = mech_row_of(s, i);
        const mech_real *z = s->events->z;
        if (row->kind != MECH_FRICTION || z[row->flag] > MECH_C(0.5)) continue;
        if (row->normal >= 0 && !mech_row_holds(s, row->normal)) continue;
        if (i > 0 && mech_row_partner(s, i - 1) == i) continue; /* on a surface the slip is one, of two components */
        if (!mech_row_moves_itself(s, i)) continue; /* near a dead centre a little slip is much motion of all else */
        const int partner = mech_row_partner(s, i);
        mech_real along = z[row->sign] * mech_row_value(s, i, MECH_RATE);
        if (partner >= 0) along += z[s->events->rows[partner].sign] * mech_row_value(s, partner, MECH_RATE);
        if (along < 0) rows[n++] = i;
        if (along < 0 && partner >= 0 && !mech_row_holds(s, partner)) rows[n++] = partner;
    }
    if (n > held) mech_contact_projection_stop_rates(s, n, rows);
    return present - s->run->report.t;
}

void mech_overshoot_go_on(mech_solver *s, mech_real time)
{
    const mech_real then = s->run->report.t;
    const size_t bytes = (size_t)s->ny * sizeof(mech_real);
    int rows[MECH_MOST_ROWS];
    if (!(time > 0)) return;
    memcpy(s->y_new, s->y, bytes);
    drift(s, time);
    mech_rows_read(s);
    if (list_passed(s, 0, rows)) {
        memcpy(s->y, s->y_new, bytes);
        mech_rows_read(s);
        const int held = mech_contact_projection_rows(s, rows), n = list_passed(s, held, rows);
        mech_rows_find_response(s);
        if (n > held) mech_contact_projection_close_gaps(s, n, rows);
    }
    s->run->report.t = then;
}
