/* The start of a run with events: what holds there, then what happens there. */
#include <string.h>

#include "advance.h"
#include "hybrid.h"

/* Sizes that count as one where nothing has moved yet. */
static void set_sizes(mech_solver *s, mech_real *length, mech_real *speed)
{
    const mech_model *m = s->model;
    mech_modes *e = s->modes;
    *length = *speed = 0;
    for (int i = 0; i < m->nq; i++) *length = mech_max(*length, mech_nominal(s, i));
    for (int i = m->nq; i < m->nq + m->nv; i++) *speed = mech_max(*speed, mech_nominal(s, i));
    for (int i = 0; i < e->n_rows; i++) {
        e->gap_scale[i] = MECH_C(1e-3) * *length;
        e->speed[i] = MECH_C(1e-3) * *speed;
    }
}

/* A clock goes on with its count: its period is positive. */
static int check_clocks(mech_solver *s)
{
    const mech_hybrid *h = s->model->hybrid;
    mech_modes *e = s->modes;
    for (int k = 0; k < h->n_clocks; k++) {
        mech_real *count = e->z + h->clocks[2 * k + 1], *tick = e->times + h->n_times + k;
        h->crossing_times(s->run->report.t, s->y, s->u, e->z, s->o.p, e->times);
        const mech_real first = *tick;
        *count += 1;
        h->crossing_times(s->run->report.t, s->y, s->u, e->z, s->o.p, e->times);
        *count -= 1;
        if (*tick > first) continue;
        s->run->report.failed_value = *tick - first;
        return mech_fail(s, MECH_NO_PERIOD, k);
    }
    return MECH_RUNNING;
}

/* Ticks before the start are over. */
static void pass_ticks(mech_solver *s)
{
    const mech_hybrid *h = s->model->hybrid;
    mech_modes *e = s->modes;
    for (int k = 0; k < h->n_clocks; k++)
        for (long ticks = 0; ticks < 1000000000; ticks++) {
            h->crossing_times(s->run->report.t, s->y, s->u, e->z, s->o.p, e->times);
            if (!(e->times[h->n_times + k] < s->run->report.t)) break;
            e->z[h->clocks[2 * k + 1]] += 1;
        }
}

static void set_switches(mech_solver *s)
{
    const mech_hybrid *h = s->model->hybrid;
    mech_modes *e = s->modes;
    for (int round = 0; round < 2; round++) {
        mech_set_times(s, 0);
        for (int k = 0; k < h->n_switches; k++) e->z[h->switches[k]] = 0;
        if (e->n) mech_indicate(s, s->run->report.t, s->y, e->w, NULL);
        for (int k = 0; k < h->n_switches; k++) {
            e->z[h->switches[k]] = e->w[k] < 0;
            e->scale[k] = mech_abs(e->w[k]);
        }
    }
}

int mech_check_rows(mech_solver *s, int limits)
{
    const mech_hybrid *h = s->model->hybrid;
    for (int i = 0; i < h->n_rows; i++) {
        const mech_real *row = s->modes->row + i * MECH_ROW_VALUES;
        const mech_real coefficient = row[MECH_COEFFICIENT], limit = row[MECH_LIMIT];
        const int contact = h->rows[i].kind == MECH_CONTACT, friction = h->rows[i].kind == MECH_FRICTION;
        const int own = friction && h->rows[i].normal < 0;
        mech_real wrong = 0;
        if (contact && !(coefficient >= 0 && coefficient <= 1)) wrong = coefficient;
        if (friction && !own && coefficient < 0) wrong = coefficient;
        if (friction && !own && row[MECH_EXTRA] < 0) wrong = row[MECH_EXTRA];
        if (own && limits && limit < -MECH_C(1e-9) * s->modes->force[i]) wrong = limit;
        if (wrong == 0) continue;
        s->run->report.failed_value = wrong;
        return mech_fail(s, MECH_OUT_OF_RANGE, i);
    }
    return MECH_RUNNING;
}

int mech_look(mech_solver *s)
{
    const mech_model *m = s->model;
    const mech_hybrid *h = m->hybrid;
    mech_modes *e = s->modes;
    mech_real length, speed;
    if (h->n_rows > MECH_MOST_ROWS) return mech_fail(s, MECH_NO_MODE, MECH_MOST_ROWS);
    for (int k = 0; k < s->o.n_tables; k++) s->segments[k] = mech_segment(&s->o.tables[k], s->run->report.t);
    set_sizes(s, &length, &speed);
    e->counters[MECH_LAST_TIME] = -(mech_real)INFINITY;
    int status = check_clocks(s);
    if (status) return status;
    pass_ticks(s);
    set_switches(s);
    if (h->n_rows) {
        mech_read_rows(s);
        mech_find_response(s);
        status = mech_check_rows(s, 0);
        if (status) return status;
    }
    for (int i = 0; i < h->n_rows; i++) {
        const mech_real w = e->response[i * (m->nv + h->n_rows) + m->nv + i];
        if (w > 0 && length > 0) e->force[i] = mech_max(e->force[i], MECH_C(1e-4) * speed * speed / (w * length));
    }
    for (int i = 0; i < h->n_rows; i++)
        if (h->rows[i].kind == MECH_CONTACT && e->row[i * MECH_ROW_VALUES + MECH_GAP] < 0 && !mech_touches(s, i)) {
            s->run->report.failed_value = e->row[i * MECH_ROW_VALUES + MECH_GAP];
            return mech_fail(s, MECH_PENETRATION, i);
        }
    if (h->initial >= 0) e->z[h->initial] = 0;
    if (h->n_branches) mech_read_conditions(s, e->held);
    if (h->initial >= 0) e->z[h->initial] = 1;
    return MECH_RUNNING;
}

int mech_begin_modes(mech_solver *s)
{
    const int resumed = s->run->begun;
    for (int k = 0; k < s->o.n_tables; k++) s->segments[k] = mech_segment(&s->o.tables[k], s->run->report.t);
    int status = resumed ? MECH_RUNNING : mech_look(s);
    if (status) return status;
    const long events = s->run->report.n_events;
    status = mech_happen(s, -1, !resumed);
    if (status < 0) return status;
    s->run->begun = 1;
    mech_note_modes(s, !resumed);
    if (s->run->report.n_events > events) mech_write_instant(s);
    return status;
}

int mech_begin_hybrid(mech_solver *s)
{
    int status = mech_method_lacks(s->o.method, s->model);
    if (status) return mech_fail(s, status, -1);
    status = mech_begin_modes(s);
    return status ? status : mech_start(s);
}
