/* Impacts: impulses along the rows that keep all constraints, by the response of the velocities to unit impulses.
 *
 * Newton's restitution, Coulomb's cone for the impulses. One after the other, the fastest approach first, or all
 * at once as a linear complementarity problem (solved by principal pivoting, K. G. Murty 1974).
 */
#include <string.h>

#include "advance.h"
#include "hybrid.h"

enum { ROUNDS_PER_ROW = 50, MOST_PIVOTS = 2000 };

static mech_real value(const mech_solver *s, int i, int which)
{
    return s->modes->row[i * MECH_ROW_VALUES + which];
}

static mech_real *rate(const mech_solver *s, int i) { return s->modes->row + i * MECH_ROW_VALUES + MECH_RATE; }

static const mech_row *row_of(const mech_solver *s, int i) { return &s->model->hybrid->rows[i]; }

/* Change of the rate of row i by a unit impulse along row j. */
static mech_real response(const mech_solver *s, int i, int j)
{
    const int nv = s->model->nv;
    return s->modes->response[j * (nv + s->modes->n_rows) + nv + i];
}

void mech_read_rows(mech_solver *s)
{
    const mech_model *m = s->model;
    mech_modes *e = s->modes;
    const mech_real t = s->run->report.t;
    if (m->nu) mech_inputs(m, s->o.tables, s->o.n_tables, s->segments, t, s->o.p, s->u);
    m->hybrid->row_values(t, s->y, s->u, e->z, s->o.p, e->row);
    for (int i = 0; i < e->n_rows; i++) {
        e->speed[i] = mech_max(e->speed[i], mech_abs(*rate(s, i)));
        if (row_of(s, i)->kind != MECH_STEP_ROW)
            e->force[i] = mech_max(e->force[i], mech_abs(value(s, i, MECH_FORCE)));
    }
}

mech_real mech_still(const mech_solver *s, int i) { return MECH_C(1e-11) * s->modes->speed[i]; }

/* Whether a contact is closed at present, as far as numbers tell. */
int mech_touches(const mech_solver *s, int i)
{
    const mech_row *row = row_of(s, i);
    if (row->kind != MECH_CONTACT || (row->enabled >= 0 && !(s->modes->z[row->enabled] > MECH_C(0.5)))) return 0;
    const int closed = s->modes->z[row->flag] > MECH_C(0.5);
    return mech_abs(value(s, i, MECH_GAP)) <= (closed ? 1000 : 1) * MECH_C(1e-9) * s->modes->gap_scale[i];
}

static int engaged(const mech_solver *s, int i)
{
    return row_of(s, i)->kind == MECH_BILATERAL && s->modes->z[row_of(s, i)->flag] > MECH_C(0.5);
}

void mech_find_response(mech_solver *s)
{
    const mech_model *m = s->model;
    mech_modes *e = s->modes;
    for (int j = 0; j < e->n_rows; j++) {
        e->z[row_of(s, j)->impulse] = 1;
        m->hybrid->respond(s->run->report.t, s->y, s->u, e->z, s->o.p, e->response + j * (m->nv + e->n_rows));
        e->z[row_of(s, j)->impulse] = 0;
    }
}

int mech_solve_rows(mech_solver *s, int n, const int *set, const mech_real *target, mech_real *x)
{
    /* Gaussian elimination with complete pivoting; what is left below rounding is dependent. */
    mech_real *a = s->modes->matrix;
    const int width = n + 1;
    int rank = 0;
    int column[64], used[64];
    if (n > 64) return -1;
    mech_real largest = 0;
    for (int i = 0; i < n; i++) {
        column[i] = i;
        used[i] = i;
        for (int j = 0; j < n; j++) {
            a[i * width + j] = response(s, set[i], set[j]);
            largest = mech_max(largest, mech_abs(a[i * width + j]));
        }
        a[i * width + n] = target[i];
    }
    for (; rank < n; rank++) {
        int p = rank, q = rank;
        for (int i = rank; i < n; i++)
            for (int j = rank; j < n; j++)
                if (mech_abs(a[used[i] * width + column[j]]) > mech_abs(a[used[p] * width + column[q]])) {
                    p = i;
                    q = j;
                }
        if (!(mech_abs(a[used[p] * width + column[q]]) > MECH_C(1e-11) * largest)) break;
        const int ip = used[p], jq = column[q];
        used[p] = used[rank];
        used[rank] = ip;
        column[q] = column[rank];
        column[rank] = jq;
        for (int i = rank + 1; i < n; i++) {
            const mech_real f = a[used[i] * width + jq] / a[ip * width + jq];
            for (int j = rank; j < n; j++) a[used[i] * width + column[j]] -= f * a[ip * width + column[j]];
            a[used[i] * width + n] -= f * a[ip * width + n];
        }
    }
    for (int i = 0; i < n; i++) x[i] = 0;
    for (int k = rank - 1; k >= 0; k--) {
        mech_real sum = a[used[k] * width + n];
        for (int j = k + 1; j < rank; j++) sum -= a[used[k] * width + column[j]] * x[column[j]];
        x[column[k]] = sum / a[used[k] * width + column[k]];
    }
    return rank;
}

void mech_apply_impulses(mech_solver *s)
{
    const mech_model *m = s->model;
    const mech_hybrid *h = m->hybrid;
    mech_modes *e = s->modes;
    const int width = m->nv + e->n_rows;
    mech_real lost = 0, supplied = 0;
    memset(e->change, 0, (size_t)width * sizeof(mech_real));
    for (int j = 0; j < e->n_rows; j++)
        for (int i = 0; e->impulse[j] != 0 && i < width; i++)
            e->change[i] += e->impulse[j] * e->response[j * width + i];
    for (int i = 0; i < e->n_rows; i++) {
        const mech_real *change = e->change + m->nv + i;
        if (row_of(s, i)->kind != MECH_STEP_ROW) {
            lost -= e->impulse[i] * (*rate(s, i) + *change / 2);
            supplied -= e->impulse[i] * value(s, i, MECH_DRIFT);
        }
        *rate(s, i) += *change;
        e->impulse[i] = 0;
    }
    for (int i = 0; i < m->nv; i++) s->y[m->nq + i] += e->change[i];
    if (h->dissipated >= 0) s->y[h->dissipated] += lost;
    if (h->supplied >= 0) s->y[h->supplied] += supplied;
}

/* What the present impulses take out of the energy. */
static mech_real energy_lost(const mech_solver *s, mech_real *size)
{
    const mech_modes *e = s->modes;
    mech_real lost = 0;
    *size = 0;
    for (int i = 0; i < e->n_rows; i++) {
        mech_real change = 0;
        for (int j = 0; j < e->n_rows; j++) change += response(s, i, j) * e->impulse[j];
        lost -= e->impulse[i] * (*rate(s, i) + change / 2);
        *size += mech_abs(e->impulse[i]) * (mech_abs(*rate(s, i)) + mech_abs(change));
    }
    return lost;
}

/* Restitution of a contact that approaches: none where the rebound would be slower than the contact rests, or where
 * it would not rise above what rounding leaves of the gap. */
static mech_real restitution(mech_solver *s, int i)
{
    const mech_real e = value(s, i, MECH_COEFFICIENT), rest = value(s, i, MECH_EXTRA), r = -*rate(s, i);
    const mech_real t = s->run->report.t, flight = t - s->modes->last_hit[i];
    const int rests = e * r <= (rest >= 0 ? rest : MECH_C(1e-9) * s->modes->speed[i]) ||
                      mech_falls_back(s, i, e * r);
    /* The flights that are left out would last as long as this geometric series. */
    s->modes->delay[i] = rests && e > 0 && e < 1 && s->modes->last_hit[i] > s->o.t0 ? flight * e / (1 - e) : 0;
    s->modes->last_hit[i] = t;
    return rests ? 0 : e;
}

static void set_impulses(mech_solver *s, int n, const int *set, const mech_real *x)
{
    memset(s->modes->impulse, 0, (size_t)s->modes->n_rows * sizeof(mech_real));
    for (int k = 0; k < n; k++) s->modes->impulse[set[k]] = x[k];
}

/* One contact hits: its impulse, that of its friction, and those of constraints that are engaged. */
static int hit_alone(mech_solver *s, int contact)
{
    mech_modes *e = s->modes;
    int set[64], n = 0, slips = -1;
    mech_real target[64], x[64];
    for (int i = 0; i < e->n_rows && n < 62; i++)
        if (engaged(s, i)) {
            set[n] = i;
            target[n++] = -*rate(s, i);
        }
    set[n] = contact;
    target[n++] = -(1 + restitution(s, contact)) * *rate(s, contact);
    for (int i = 0; i < e->n_rows; i++)
        if (row_of(s, i)->kind == MECH_FRICTION && row_of(s, i)->normal == contact && value(s, i, MECH_COEFFICIENT) > 0)
            slips = i;
    if (slips >= 0) {
        set[n] = slips;
        target[n] = -*rate(s, slips);
        mech_solve_rows(s, n + 1, set, target, x);
        const mech_real normal = x[n - 1], tangential = x[n];
        if (mech_abs(tangential) <= value(s, slips, MECH_COEFFICIENT) * normal) {
            set_impulses(s, n + 1, set, x);
            return MECH_RUNNING;
        }
        /* It slides: the impulse lies on the cone, against the slip. */
        const mech_real slip = *rate(s, slips);
        const mech_real side = mech_abs(slip) > mech_still(s, slips) ? (slip > 0 ? -1 : 1) : (tangential > 0 ? 1 : -1);
        const mech_real share = side * value(s, slips, MECH_EXTRA);
        mech_real *a = e->response + slips * (s->model->nv + e->n_rows);
        mech_real *b = e->response + contact * (s->model->nv + e->n_rows);
        const int width = s->model->nv + e->n_rows;
        for (int i = 0; i < width; i++) b[i] += share * a[i]; /* the two act as one */
        const int rank = mech_solve_rows(s, n, set, target, x);
        for (int i = 0; i < width; i++) b[i] -= share * a[i];
        set_impulses(s, n, set, x);
        e->impulse[slips] = share * x[n - 1];
        return rank == n && x[n - 1] >= 0 ? MECH_RUNNING : mech_fail(s, MECH_NO_IMPACT, contact);
    }
    mech_solve_rows(s, n, set, target, x);
    set_impulses(s, n, set, x);
    return MECH_RUNNING;
}

/* All hits at once: 0 <= p, r+ + e r- >= 0, one of them zero in each touching row; r+ = 0 where engaged. */
static int hit_together(mech_solver *s)
{
    mech_modes *e = s->modes;
    int row[64], in[64], set[64] = {0}, m = 0;
    mech_real aim[64], target[64] = {0}, x[64];
    for (int i = 0; i < e->n_rows && m < 64; i++)
        if (engaged(s, i) || mech_touches(s, i)) {
            row[m] = i;
            in[m] = engaged(s, i);
            const mech_real r = *rate(s, i);
            aim[m++] = engaged(s, i) || r >= 0 ? -r : -(1 + restitution(s, i)) * r;
        }
    for (int pivots = 0; pivots < MOST_PIVOTS; pivots++) {
        int n = 0, wrong = -1;
        for (int k = 0; k < m; k++)
            if (in[k]) {
                set[n] = row[k];
                target[n++] = aim[k];
            }
        mech_solve_rows(s, n, set, target, x);
        set_impulses(s, n, set, x);
        for (int k = 0; k < m && wrong < 0; k++) {
            if (engaged(s, row[k])) continue;
            mech_real change = 0, size = mech_abs(aim[k]);
            for (int j = 0; j < n; j++) {
                const mech_real part = response(s, row[k], set[j]) * x[j];
                change += part;
                size += mech_abs(part);
            }
            if (in[k] ? e->impulse[row[k]] < 0 : change - aim[k] < -MECH_C(1e-12) * size) wrong = k;
        }
        if (wrong < 0) return MECH_RUNNING;
        in[wrong] = !in[wrong];
    }
    return mech_fail(s, MECH_NO_IMPACT, m ? row[0] : 0);
}

static int apply_checked(mech_solver *s, int contact)
{
    mech_real size;
    const mech_real lost = energy_lost(s, &size);
    if (!mech_finite(lost)) return mech_fail(s, MECH_NO_IMPACT, contact);
    if (lost < -MECH_C(1e-9) * size) return mech_fail(s, MECH_ENERGY_RAISED, contact);
    mech_apply_impulses(s);
    return MECH_RUNNING;
}

static int fastest_approach(const mech_solver *s)
{
    int found = -1;
    mech_real fastest = 0;
    for (int i = 0; i < s->modes->n_rows; i++)
        if (mech_touches(s, i) && -*rate(s, i) > mech_still(s, i) && (found < 0 || -*rate(s, i) > fastest)) {
            found = i;
            fastest = -*rate(s, i);
        }
    return found;
}

/* Constraints that were engaged take their rates away at once. */
static int engage(mech_solver *s)
{
    mech_modes *e = s->modes;
    int set[64], n = 0, moves = -1;
    mech_real target[64], x[64];
    for (int i = 0; i < e->n_rows && n < 64; i++) {
        if (!engaged(s, i)) continue;
        if (!(mech_abs(value(s, i, MECH_GAP)) <= MECH_C(1e-6) * mech_max(e->gap_scale[i], 0))) {
            s->run->report.failed_value = value(s, i, MECH_GAP);
            return mech_fail(s, MECH_APART, i);
        }
        if (mech_abs(*rate(s, i)) > mech_still(s, i)) moves = i;
        set[n] = i;
        target[n++] = -*rate(s, i);
    }
    if (moves < 0) return MECH_RUNNING;
    mech_find_response(s);
    mech_solve_rows(s, n, set, target, x);
    set_impulses(s, n, set, x);
    return apply_checked(s, moves);
}

int mech_impacts(mech_solver *s, int *count)
{
    mech_modes *e = s->modes;
    mech_read_rows(s);
    int status = engage(s), ready = 0;
    for (int round = 0; !status; round++) {
        const int contact = fastest_approach(s);
        if (contact < 0) break;
        if (!ready) mech_find_response(s);
        ready = 1;
        const mech_real approach = -*rate(s, contact);
        const int together = s->model->hybrid->simultaneous || round >= ROUNDS_PER_ROW * e->n_rows;
        if (round > 2 * ROUNDS_PER_ROW * e->n_rows) return mech_fail(s, MECH_NO_IMPACT, contact);
        if (together)
            for (int i = 0; i < e->n_rows; i++) {
                if (i != contact && mech_touches(s, i) && -*rate(s, i) > mech_still(s, i))
                    mech_note(s, MECH_IMPACT, i, -*rate(s, i));
            }
        mech_note(s, MECH_IMPACT, contact, approach);
        status = together ? hit_together(s) : hit_alone(s, contact);
        if (!status) status = apply_checked(s, contact);
        (*count)++;
    }
    return status;
}

/* The jump of the energy in row i. At the surface itself, within rounding, one of the branches may be undefined: then
   the jump is that a little before or behind, along the velocities, by roundings at first. */
static mech_real jump_in(mech_solver *s, int i)
{
    const mech_model *m = s->model;
    const mech_real t = s->run->report.t;
    mech_real *y = s->modes->y_at, jump = value(s, i, MECH_FORCE);
    mech_real h = 10 * MECH_EPSILON * mech_abs(t) + MECH_C(1e-24) * s->o.dt_max;
    for (int k = 0; !mech_finite(jump) && h < MECH_C(1e-9) * s->o.dt_max; k++) {
        memcpy(y, s->y, (size_t)s->ny * sizeof(mech_real));
        for (int j = 0; j < m->nq; j++)
            if (mech_finite(s->dy[j])) y[j] += (k % 2 ? h : -h) * s->dy[j];
        mech_normalise(m, y);
        m->hybrid->row_values(t, y, s->u, s->modes->z, s->o.p, s->modes->row);
        jump = value(s, i, MECH_FORCE);
        if (k % 2) h *= 4;
        mech_read_rows(s);
    }
    return jump;
}

/* A switch across which an energy jumps: an impulse along its gradient keeps the total energy; where that is too
   little to pass, the motion is thrown back. */
int mech_pass_step(mech_solver *s, int hit, int *passed)
{
    mech_modes *e = s->modes;
    for (int i = 0; i < e->n_rows; i++) {
        if (row_of(s, i)->kind != MECH_STEP_ROW || row_of(s, i)->normal != hit) continue;
        mech_read_rows(s);
        mech_find_response(s);
        const mech_real jump = jump_in(s, i), r = *rate(s, i), w = response(s, i, i);
        if (jump == 0 || !(w > 0)) return MECH_RUNNING;
        const mech_real square = r * r - 2 * w * jump;
        *passed = square > 0;
        memset(e->impulse, 0, (size_t)e->n_rows * sizeof(mech_real));
        e->impulse[i] = ((*passed ? (r > 0 ? 1 : -1) * mech_sqrt(square) : -r) - r) / w;
        mech_apply_impulses(s);
        mech_note(s, *passed ? MECH_CROSSED : MECH_REFLECTED, i, mech_abs(r));
    }
    return MECH_RUNNING;
}
