#include "indicators.h"

#include <string.h>

#include "rows.h"
#include "surface_friction.h"
#include "window.h"

/* Where one direction of a friction on a surface holds, by how much it sticks in the share of the load that it bears best. */
static mech_real margin_across(mech_solver *s, int i, mech_real t, const mech_real *y)
{
    mech_event_state *e = s->events;
    mech_real kept[MECH_MOST_ROWS * MECH_ROW_VALUES], *state = s->y;
    const mech_real time = s->run->report.t;
    memcpy(kept, e->row, (size_t)(e->n_rows * MECH_ROW_VALUES) * sizeof(mech_real));
    s->y = (mech_real *)y;
    s->run->report.t = t;
    mech_rows_read(s);
    mech_row_share_across(s, i);
    s->y = state;
    s->run->report.t = time;
    const mech_real margin = mech_row_value(s, i, MECH_LIMIT) - mech_row_size(s, i, MECH_FORCE);
    memcpy(e->row, kept, (size_t)(e->n_rows * MECH_ROW_VALUES) * sizeof(mech_real));
    mech_surroundings(s, t);
    return margin;
}

/* Of a friction that neither sticks nor slides, as others hold it: it begins to slide at a speed that modes know from none. While its
 * contact is open there is nothing to begin. */
static void widen_unheld(mech_solver *s, mech_real *w)
{
    for (int i = 0; i < s->events->n_rows; i++) {
        const mech_row *row = mech_row_of(s, i);
        mech_real *own = w + s->model->hybrid->n_switches + i;
        const int j = mech_row_partner(s, i);
        if (row->kind != MECH_FRICTION || row->sign < 0 || !(*own < 0) || mech_row_holds(s, i) || s->events->z[row->sign] != 0) continue;
        if (j >= 0 && (mech_row_holds(s, j) || s->events->z[mech_row_of(s, j)->sign] != 0)) continue;
        const int open = row->normal >= 0 && !mech_row_holds(s, row->normal);
        *own = open ? 0 : *own + 100 * mech_max(mech_row_still(s, i), j < 0 ? 0 : mech_surface_friction_none(s, i));
    }
}

void mech_indicators_read(mech_solver *s, mech_real t, const mech_real *y, mech_real *w, mech_real *rate)
{
    const mech_model *m = s->model;
    const mech_hybrid *h = m->hybrid;
    const mech_real *z = s->events->z;
    mech_surroundings(s, t);
    if (h->indicators) h->indicators(t, y, s->u, z, s->o.p, w);
    if (rate && h->indicator_rates) h->indicator_rates(t, y, s->u, z, s->o.p, rate);
    if (h->crowd) mech_window_indicate(s, t, y, w + h->n_switches, rate ? rate + h->n_switches : NULL);
    for (int i = 0; s->events->counters[MECH_CARRIED] > 0 && i < s->events->n_rows; i++) {
        if (!mech_row_is_carried(s, i)) continue;
        w[h->n_switches + i] = *mech_indicator_size(s, h->n_switches + i); /* in its unit: what slides, or is open, holds no force */
        if (rate) rate[h->n_switches + i] = 0;
    }
    if (!h->crowd) widen_unheld(s, w);
    for (int k = 0; k < h->n_switches; k++)
        if (z[h->switches[k]] > MECH_C(0.5)) {
            w[k] = -w[k];
            if (rate) rate[k] = -rate[k];
        }
    for (int i = 0; i < s->events->n_rows && !h->crowd && !(s->events->counters[MECH_CARRIED] > 0); i++) {
        const int j = mech_row_partner(s, i), k = h->n_switches + i;
        if (j < 0 || mech_row_holds(s, i) == mech_row_holds(s, j)) continue;
        w[k] = margin_across(s, i, t, y);
        if (rate) rate[k] = 0; /* unknown */
    }
}

void mech_indicator_place(mech_solver *s, int k, mech_real part, mech_real *y)
{
    const int i = k - s->model->hybrid->n_switches;
    if (i >= 0 && s->model->hybrid->crowd) {
        mech_window_place(s, i, part, y);
        return;
    }
    mech_dense_at(s->dense, s->n_dense, s->ny, part, y);
    mech_normalise(s->model, y);
}

void mech_indicator_read(mech_solver *s, int k, mech_real t, const mech_real *y, mech_real *w, mech_real *rate)
{
    const int i = k - s->model->hybrid->n_switches;
    if (i >= 0 && s->model->hybrid->crowd && mech_window_indicate_one(s, i, t, y, w + k, rate ? rate + k : NULL)) return;
    mech_indicators_read(s, t, y, w, rate);
}

/* Of a row the mode decides what is measured. */
mech_real *mech_indicator_size(const mech_solver *s, int k)
{
    const mech_hybrid *h = s->model->hybrid;
    mech_event_state *e = s->events;
    const int i = k - h->n_switches;
    if (i < 0 || s->events->rows[i].flag < 0) return e->scale + k;
    if (mech_row_holds(s, i)) return e->force + i;
    const int j = mech_row_partner(s, i); /* on a surface the first row measures both, and one of them may hold alone */
    if (j >= 0 && mech_row_holds(s, j)) return e->force + j;
    const mech_row *row = &s->events->rows[i];
    return row->kind == MECH_CONTACT && row->sign != MECH_FREEWHEEL ? e->gap_scale + i : e->speed + i;
}

/* Whether the size of an indicator is that of a force. */
static int of_force(const mech_solver *s, const mech_real *size)
{
    return size >= s->events->force && size < s->events->force + s->events->n_rows;
}

void mech_indicator_widen(mech_solver *s, int k, mech_real w)
{
    mech_real *size = mech_indicator_size(s, k);
    if (!s->model->hybrid->crowd || !of_force(s, size)) mech_widen(size, w);
}

mech_real mech_indicator_tolerance(const mech_solver *s, int k)
{
    const mech_real *largest = mech_indicator_size(s, k);
    return (of_force(s, largest) ? MECH_C(1e-10) : MECH_C(1e-13)) * *largest;
}

int mech_indicator_at_zero(const mech_solver *s, int k, mech_real w)
{
    return mech_abs(w) <= (s->events->fresh[k] > 0 ? 10000 : 1) * mech_indicator_tolerance(s, k);
}

/* The differences are taken over 1e-6 of each value: far above rounding, and a size needs no digits. A 32nd of the terms makes
 * the tolerance 14 roundings of them. */
void mech_indicator_widen_by_terms(mech_solver *s, int k, mech_real t, const mech_real *y)
{
    const mech_real share = MECH_C(1e-6);
    mech_event_state *e = s->events;
    mech_real *w = e->w + (MECH_SAMPLES - 1) * e->n, *rate = e->rate + (MECH_SAMPLES - 1) * e->n;
    mech_real size = 0, rate_size = 0;
    mech_indicator_read(s, k, t, y, w, rate);
    const mech_real here = w[k], rate_here = rate[k];
    for (int i = 0; i < s->ny; i++) e->y_at[i] = y[i];
    for (int i = 0; i < s->ny; i++) {
        e->y_at[i] = y[i] * (1 + share);
        mech_indicator_read(s, k, t, e->y_at, w, rate);
        size += mech_abs(w[k] - here) / share;
        rate_size += mech_abs(rate[k] - rate_here) / share;
        e->y_at[i] = y[i];
    }
    mech_indicator_widen(s, k, size / 32);
    mech_widen(e->rate_scale + k, rate_size / 32);
}
