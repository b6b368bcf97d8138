#include "journal.h"

#include <string.h>

#include "method.h"
#include "rows.h"
#include "window.h"

void mech_journal_note(mech_solver *s, int kind, int index, mech_real value)
{
    mech_report *r = &s->run->report;
    if (!s->o.events || r->n_events >= s->o.event_capacity) return; /* too many at one instant: mech_instant tells */
    const mech_real t = r->t + (kind == MECH_REST ? value : 0);
    const int place = kind == MECH_WHEN ? index : mech_window_number(s, index);
    s->o.events[r->n_events++] = (mech_event){t, kind == MECH_REST ? 0 : value, kind, place, r->n_instants};
}

/* Whether row i belongs to the row before it: of a constraint of vectors, or of friction on a surface. */
static int belongs(const mech_solver *s, int i)
{
    const mech_row *rows = s->events->rows;
    return i && (rows[i - 1].flag == rows[i].flag || mech_row_partner(s, i - 1) == i);
}

void mech_journal_modes(mech_solver *s, int quiet)
{
    mech_event_state *e = s->events;
    for (int i = 0; i < s->events->n_rows; i++) {
        const mech_row *row = mech_row_of(s, i);
        if (row->flag < 0) continue;
        const int partner = mech_row_partner(s, i);
        mech_real flag = e->z[row->flag], sign = row->sign < 0 ? 0 : e->z[row->sign];
        if (partner >= 0) {
            flag = mech_max(flag, e->z[s->events->rows[partner].flag]);
            sign = mech_max(mech_abs(sign), mech_abs(e->z[s->events->rows[partner].sign]));
        }
        if (s->method->impulses) continue;
        if (!quiet && flag != e->flags[i]) {
            const int kinds[3][2] = {
                {MECH_LIFT_OFF, MECH_REST}, {MECH_SLIP, MECH_STICK}, {MECH_RELEASED, MECH_ENGAGED}};
            const int open = row->normal >= 0 && !(e->z[mech_row_of(s, row->normal)->flag] > MECH_C(0.5));
            const int idle = row->kind == MECH_FRICTION && !(flag > MECH_C(0.5)) && sign == 0; /* others hold it */
            if (!open && !idle && !belongs(s, i))
                mech_journal_note(s, kinds[row->kind][flag > MECH_C(0.5)], i, e->delay[i]);
        } else if (!quiet && row->kind == MECH_FRICTION && sign * e->signs[i] < 0 && !belongs(s, i)) {
            mech_journal_note(s, MECH_SLIP, i, 0);
        }
        e->flags[i] = flag;
        e->signs[i] = sign;
    }
}

void mech_journal_instant(mech_solver *s)
{
    if (!s->o.instants) return;
    mech_report *r = &s->run->report;
    const mech_event_state *e = s->events;
    const size_t ny = (size_t)s->ny, nz = (size_t)s->model->nz, real = sizeof(mech_real);
    mech_real *row = s->o.instants + (size_t)r->n_instants * (1 + 2 * (ny + nz));
    row[0] = r->t;
    memcpy(row + 1, e->y_before, ny * real);
    memcpy(row + 1 + ny, e->z_before, nz * real);
    memcpy(row + 1 + ny + nz, s->y, ny * real);
    memcpy(row + 1 + 2 * ny + nz, e->z, nz * real);
    r->n_instants++;
}
