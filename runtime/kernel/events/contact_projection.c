#include "contact_projection.h"

#include <string.h>

void mech_contact_projection_move(mech_solver *s, const mech_real *d)
{
    const int nq = s->model->nq, nv = s->model->nv;
    mech_event_state *e = s->events;
    memcpy(e->y_at, s->y, (size_t)s->ny * sizeof(mech_real));
    memcpy(e->y_at + nq, d, (size_t)nv * sizeof(mech_real));
    mech_rhs(s, s->run->report.t, e->y_at, e->move);
    memset(e->y_at + nq, 0, (size_t)nv * sizeof(mech_real));
    mech_rhs(s, s->run->report.t, e->y_at, e->driven);
    for (int i = 0; i < nq; i++) e->move[i] -= e->driven[i];
}

void mech_contact_projection_close_gaps(mech_solver *s, int n, const int *rows)
{
    const mech_model *m = s->model;
    mech_event_state *e = s->events;
    mech_real target[MECH_MOST_ROWS], x[MECH_MOST_ROWS];
    const int width = m->nv + e->n_rows;
    for (int k = 0; k < n; k++) target[k] = -mech_row_value(s, rows[k], MECH_GAP);
    mech_rows_solve(s, n, rows, target, x);
    for (int i = 0; i < m->nv; i++) {
        e->correction[i] = 0;
        for (int k = 0; k < n; k++) e->correction[i] += x[k] * e->response[rows[k] * width + i];
    }
    mech_contact_projection_move(s, e->correction);
    for (int i = 0; i < m->nq; i++) s->y[i] += e->move[i];
    mech_normalise(m, s->y);
    mech_rows_read(s);
    mech_rows_find_response(s);
}

void mech_contact_projection_set_rates(mech_solver *s, int n, const int *rows, const mech_real *aim)
{
    const mech_model *m = s->model;
    mech_event_state *e = s->events;
    mech_real target[MECH_MOST_ROWS], x[MECH_MOST_ROWS];
    const int width = m->nv + e->n_rows;
    for (int k = 0; k < n; k++) target[k] = aim[k] - mech_row_value(s, rows[k], MECH_RATE);
    if (n > 0) mech_rows_solve(s, n, rows, target, x);
    for (int k = 0; k < n; k++)
        for (int i = 0; i < m->nv; i++) s->y[m->nq + i] += x[k] * e->response[rows[k] * width + i];
    mech_rhs(s, s->run->report.t, s->y, s->dy);
}

void mech_contact_projection_stop_rates(mech_solver *s, int n, const int *rows)
{
    mech_real aim[MECH_MOST_ROWS];
    memset(aim, 0, (size_t)n * sizeof(mech_real));
    mech_contact_projection_set_rates(s, n, rows, aim);
}

int mech_contact_projection_rows(const mech_solver *s, int *held)
{
    int n = 0;
    for (int i = 0; i < s->events->n_rows; i++)
        if (s->events->rows[i].flag >= 0 && mech_row_holds(s, i)) held[n++] = i;
    return n;
}

void mech_contact_projection_state(mech_solver *s)
{
    int held[MECH_MOST_ROWS], located = 0;
    const int n = mech_contact_projection_rows(s, held);
    if (!n) return;
    mech_rows_read(s);
    mech_rows_find_response(s);
    for (int k = 0; k < n; k++) located |= mech_row_value(s, held[k], MECH_GAP) != 0;
    if (located) mech_contact_projection_close_gaps(s, n, held);
    mech_contact_projection_stop_rates(s, n, held);
}
