/* Events within a step: sampled on its polynomial, then located to rounding. */
#include "hybrid.h"

void mech_indicate(mech_solver *s, mech_real t, const mech_real *y, mech_real *w, mech_real *rate)
{
    const mech_model *m = s->model;
    const mech_hybrid *h = m->hybrid;
    const mech_real *z = s->modes->z;
    if (m->nu) mech_inputs(m, s->o.tables, s->o.n_tables, s->segments, t, s->o.p, s->u);
    h->indicators(t, y, s->u, z, s->o.p, w);
    if (rate) h->indicator_rates(t, y, s->u, z, s->o.p, rate);
    for (int k = 0; k < h->n_switches; k++)
        if (z[h->switches[k]] > MECH_C(0.5)) {
            w[k] = -w[k];
            if (rate) rate[k] = -rate[k];
        }
}

/* Of a row the mode decides what is measured. */
mech_real *mech_indicator_size(const mech_solver *s, int k)
{
    const mech_hybrid *h = s->model->hybrid;
    mech_modes *e = s->modes;
    const int i = k - h->n_switches;
    if (i < 0 || h->rows[i].flag < 0) return e->scale + k;
    if (e->z[h->rows[i].flag] > MECH_C(0.5)) return e->force + i;
    return h->rows[i].kind == MECH_CONTACT ? e->gap_scale + i : e->speed + i;
}

/* Forces are differences of larger ones. */
static mech_real tolerance(const mech_solver *s, int k)
{
    const mech_real *largest = mech_indicator_size(s, k);
    const int of_force = largest >= s->modes->force && largest < s->modes->force + s->modes->n_rows;
    return (of_force ? MECH_C(1e-10) : MECH_C(1e-13)) * *largest;
}

static void widen(mech_solver *s, int k, mech_real w)
{
    mech_real *largest = mech_indicator_size(s, k);
    *largest = mech_max(*largest, mech_abs(w));
}

int mech_at_zero(const mech_solver *s, int k, mech_real w)
{
    return mech_abs(w) <= (s->modes->fresh[k] > 0 ? 10000 : 1) * tolerance(s, k);
}

static mech_real at(mech_solver *s, mech_real h, mech_real part, int k, mech_real *w)
{
    mech_real *y = s->modes->y_at;
    mech_dense_at(s->dense, s->n_dense, s->ny, part, y);
    mech_normalise(s->model, y);
    mech_indicate(s, s->run->report.t + part * h, y, w, NULL);
    return w[k];
}

/* One indicator on a step. `leaves`: w begins at zero and grows, so that zero itself is no event. */
typedef struct search {
    mech_solver *s;
    mech_real h, shift, slope;
    int k, leaves;
} search;

static mech_real value(const search *q, mech_real part)
{
    mech_real w = at(q->s, q->h, part, q->k, q->s->modes->w + (MECH_SAMPLES - 1) * q->s->modes->n);
    if (q->leaves) return part > 0 ? (w + q->shift) / part : q->slope;
    return w + q->shift;
}

/* Illinois method from a (value >= 0) to b (value < 0), with bisection where it is slow. */
static mech_real zero_between(const search *q, mech_real a, mech_real fa, mech_real b, mech_real fb)
{
    int side = 0;
    for (int i = 0; i < 100 && b - a > 2 * MECH_EPSILON * b; i++) {
        mech_real c = i % 8 == 7 ? (a + b) / 2 : (fa * b - fb * a) / (fa - fb);
        if (!(c > a && c < b)) c = (a + b) / 2;
        if (!(c > a && c < b)) break;
        const mech_real fc = value(q, c);
        if (fc == 0) return c;
        if (fc < 0) {
            b = c;
            fb = fc;
            if (side == -1) fa /= 2;
            side = -1;
        } else {
            a = c;
            fa = fc;
            if (side == 1) fb /= 2;
            side = 1;
        }
    }
    return b;
}

/* Golden section for the least value between a and c; stops at the first negative one. */
static mech_real lowest(const search *q, mech_real a, mech_real c)
{
    const mech_real golden = MECH_C(0.38196601125010515);
    mech_real b = a + golden * (c - a), fb = value(q, b);
    for (int i = 0; i < 30 && fb >= 0; i++) {
        const int right = c - b > b - a;
        const mech_real x = right ? b + golden * (c - b) : b - golden * (b - a), fx = value(q, x);
        if (fx < fb) {
            if (right) a = b; else c = b;
            b = x;
            fb = fx;
        } else {
            if (right) c = x; else a = x;
        }
    }
    return fb < 0 ? b : -1;
}

/* Whether three samples in a row may hide a negative value: the parabola through them has a low vertex. */
static int dips(mech_real a, mech_real b, mech_real c)
{
    if (!(b <= a && b <= c)) return 0;
    const mech_real bend = a - 2 * b + c, slope = (c - a) / 2;
    return bend > 0 && b - slope * slope / (2 * bend) < MECH_C(0.2) * b + MECH_C(0.02) * mech_max(a, c);
}

void mech_locate(mech_solver *s, mech_real h, int *hit, mech_real *part)
{
    mech_modes *e = s->modes;
    const mech_real t = s->run->report.t;
    mech_real *end_rate = e->end_rate;
    const int n = e->n, last = MECH_SAMPLES - 2; /* the row behind is room for the search */
    *hit = -1;
    *part = 1;
    mech_indicate(s, t, s->y, e->w, e->rate);
    for (int k = 0; k < n; k++) {
        widen(s, k, e->w[k]);
        e->rate_scale[k] = mech_max(e->rate_scale[k], mech_abs(e->rate[k]));
        const int zero = mech_at_zero(s, k, e->w[k]);
        const int falls = e->rate[k] < -MECH_C(1e-12) * e->rate_scale[k];
        if ((!zero && e->w[k] < 0) || (zero && !(e->fresh[k] > 0) && falls && e->w[k] < 0)) {
            *hit = k;
            *part = 0;
            return;
        }
    }
    for (int j = 1; j <= last; j++) {
        const mech_real where = (mech_real)j / last;
        if (j < last)
            at(s, h, where, 0, e->w + j * n);
        else
            mech_indicate(s, t + h, s->y_new, e->w + j * n, end_rate);
        for (int k = 0; k < n; k++) widen(s, k, e->w[j * n + k]);
    }
    mech_real room = 1;
    for (int k = 0; k < n; k++) {
        const mech_real tol = tolerance(s, k);
        const int zero = mech_at_zero(s, k, e->w[k]);
        search q = {s, h, 0, h * e->rate[k], k, zero && e->rate[k] > MECH_C(1e-12) * e->rate_scale[k]};
        /* Rounding may leave w below zero: the way back to that level is the event. */
        if (zero) q.shift = mech_max(0, -e->w[k]) + (q.leaves ? 0 : tol);
        for (int j = 0; j < last; j++) {
            const mech_real a = (mech_real)j / last, b = (mech_real)(j + 1) / last;
            if (a >= room) break;
            const mech_real wa = e->w[j * n + k], wb = e->w[(j + 1) * n + k];
            mech_real begin = a, end = b;
            if (!(wb < -tol)) {
                const mech_real *w = e->w + k;
                /* It falls at the start or rises at the end, though the first or last sample is the lowest. */
                const int first = j == 0 && !zero && wa <= wb &&
                                  (e->rate[k] < 0 || -3 * w[0] + 4 * w[n] - w[2 * n] < 0);
                const int ends = j == last - 1 && wb <= wa && (3 * wb - 4 * wa + w[(last - 2) * n] > 0 || end_rate[k] > 0);
                if (j > 1 - !zero && dips(w[(j - 1) * n], wa, wb))
                    begin = (mech_real)(j - 1) / last;
                else if (!first && !ends)
                    continue;
                end = lowest(&q, begin, b);
                if (end < 0) continue;
            }
            const mech_real fa = mech_max(0, value(&q, begin)), fb = value(&q, end);
            const mech_real found = fb < 0 ? zero_between(&q, begin, fa, end, fb) : end;
            if (found < room) {
                room = found;
                *hit = k;
            }
            break;
        }
    }
    *part = room;
}
