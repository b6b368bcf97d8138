/* The start of a run with events: what holds there, then what happens there. */
#include "begin.h"

#include <string.h>

#include "branches.h"
#include "contact_modes.h"
#include "history.h"
#include "indicators.h"
#include "instant.h"
#include "journal.h"
#include "method.h"
#include "rows.h"
#include "schedule.h"
#include "step.h"
#include "window.h"

/* Sizes of a row that count as one where nothing has moved yet: of length and speed. */
static void set_sizes(mech_solver *s, int i, mech_real length, mech_real speed)
{
    s->events->gap_scale[i] = MECH_C(1e-3) * length;
    s->events->speed[i] = MECH_C(1e-3) * speed;
}

/* The same of its force. */
static void set_force(mech_solver *s, int i, mech_real length, mech_real speed)
{
    const mech_real w = mech_row_response(s, i, i);
    if (w > 0 && length > 0) mech_widen(s->events->force + i, MECH_C(1e-4) * speed * speed / (w * length));
}

/* A switch may read others, as that of min(a, max(b, c)) does: after as many rounds as there are switches all are known. */
static void set_switches(mech_solver *s)
{
    const mech_hybrid *h = s->model->hybrid;
    mech_event_state *e = s->events;
    for (int k = 0; k < h->n_switches; k++) e->z[h->switches[k]] = 0;
    int changed = 1;
    for (int round = 0; round < 2 || (changed && round <= h->n_switches); round++) {
        changed = 0;
        mech_schedule_set(s, 0);
        if (e->n) mech_indicators_read(s, s->run->report.t, s->y, e->w, NULL);
        for (int k = 0; k < h->n_switches; k++) {
            mech_real *z = &e->z[h->switches[k]];
            if (e->w[k] < 0) { /* measured on the side that the switch says */
                *z = 1 - *z;
                changed = 1;
            }
            e->scale[k] = mech_abs(e->w[k]);
        }
    }
}

/* What presses and sticks at the start, before anything happens. */
static void choose_modes(mech_solver *s)
{
    mech_event_state *e = s->events;
    int struck = 0;
    memset(e->open, 0, (size_t)e->n_rows * sizeof(mech_real));
    memset(e->slides, 0, (size_t)e->n_rows * sizeof(mech_real));
    mech_contact_modes_choose(s, -1, &struck);
}

/* What is true at the start does not become true there: conditions are read with what presses and sticks from the beginning. What
 * an impact or an action brings comes after that, and so do failures. */
static void read_held(mech_solver *s)
{
    mech_event_state *e = s->events;
    const mech_model *m = s->model;
    const mech_report report = s->run->report;
    const int rests = e->n_rows && !s->method->impulses && !m->hybrid->crowd; /* of a crowd no condition asks that */
    if (rests) {
        memcpy(e->y_before, s->y, (size_t)s->ny * sizeof(mech_real));
        memcpy(e->z_before, e->z, (size_t)m->nz * sizeof(mech_real));
        choose_modes(s);
        for (int round = 0; round < 2 && m->hybrid->n_switches; round++) { /* each may ask for the other */
            set_switches(s);
            choose_modes(s);
        }
    }
    const int before = mech_schedule_begin_before(s);
    mech_branches_read(s, e->held);
    if (before) mech_schedule_set(s, 0);
    if (!rests) return;
    memcpy(s->y, e->y_before, (size_t)s->ny * sizeof(mech_real));
    for (int k = 0; k < m->hybrid->n_switches; k++) { /* these are found */
        const int place = m->hybrid->switches[k];
        e->z_before[place] = e->z[place];
    }
    memcpy(e->z, e->z_before, (size_t)m->nz * sizeof(mech_real));
    s->run->report = report;
    mech_rows_read(s);
}

int mech_begin_look(mech_solver *s)
{
    const mech_model *m = s->model;
    const mech_hybrid *h = m->hybrid;
    mech_event_state *e = s->events;
    mech_real length, speed;
    if (h->n_rows > MECH_MOST_ROWS) return mech_fail(s, MECH_NO_MODE, -1);
    for (int k = 0; k < s->o.n_tables; k++) s->segments[k] = mech_segment(&s->o.tables[k], s->run->report.t);
    if (s->history) {
        const int delayed = mech_history_begin(s);
        if (delayed) return delayed;
    }
    length = mech_row_reach(s, -1, 0, &speed);
    for (int i = 0; i < e->n_rows; i++) set_sizes(s, i, length, speed);
    e->counters[MECH_LAST_TIME] = -(mech_real)INFINITY;
    int status = mech_schedule_check(s);
    if (status) return status;
    mech_schedule_pass(s);
    set_switches(s);
    if ((status = mech_branches_begin(s))) return status;
    if (h->crowd && (status = mech_window_begin(s, length, speed))) return status;
    if (e->n_rows) {
        if (h->crowd) {
            mech_rows_read(s);
            mech_rows_find_response(s);
        } else {
            mech_surroundings(s, s->run->report.t);
            mech_rows_find_response(s);
            for (int i = 0; i < e->n_rows; i++) {
                length = mech_row_reach(s, i, 0, &speed);
                set_sizes(s, i, length, speed);
                set_force(s, i, length, speed);
            }
            mech_rows_read(s);
        }
        status = mech_rows_check(s, 0);
        if (status) return status;
    }
    for (int i = 0; h->crowd && i < e->n_rows; i++) set_force(s, i, length, speed);
    for (int i = 0; i < s->events->n_rows; i++)
        if (mech_row_of(s, i)->kind == MECH_CONTACT && mech_row_is_enabled(s, i) && mech_row_value(s, i, MECH_GAP) < 0 &&
            !mech_row_touches(s, i)) {
            s->run->report.failed_value = mech_row_value(s, i, MECH_GAP);
            return mech_fail(s, MECH_PENETRATION, i);
        }
    if (h->initial >= 0) e->z[h->initial] = 0;
    if (h->n_branches) read_held(s);
    if (h->initial >= 0) e->z[h->initial] = 1;
    return MECH_RUNNING;
}

int mech_begin_events(mech_solver *s)
{
    const int resumed = s->run->begun;
    for (int k = 0; k < s->o.n_tables; k++) s->segments[k] = mech_segment(&s->o.tables[k], s->run->report.t);
    const long events = s->run->report.n_events;
    int status = resumed ? MECH_RUNNING : mech_begin_look(s);
    if (status) return status;
    status = mech_instant_happen(s, -1, !resumed);
    if (status < 0) return status;
    s->run->begun = 1;
    if (s->history && mech_history_freeze(s)) return MECH_NO_MEMORY;
    mech_journal_modes(s, !resumed);
    if (s->run->report.n_events > events) mech_journal_instant(s);
    return status;
}

int mech_begin_run(mech_solver *s)
{
    int status = mech_method_lacks(s->o.method, s->model);
    if (status) return mech_fail(s, status, -1);
    status = mech_begin_events(s);
    return status ? status : mech_step_start(s);
}
