/* Impacts: impulses along the rows that keep all constraints, by the response of the velocities to unit impulses.
 *
 * Newton's restitution, Coulomb's cone for the impulses. One after the other, the fastest approach first, or all
 * at once as a linear complementarity problem (solved by principal pivoting, K. G. Murty 1974).
 */
#include "impacts.h"

#include <string.h>

#include "journal.h"
#include "rows.h"

enum { ROUNDS_PER_ROW = 50, MOST_PIVOTS = 2000 };

static int engaged(const mech_solver *s, int i)
{
    return mech_row_of(s, i)->kind == MECH_BILATERAL && s->events->z[mech_row_of(s, i)->flag] > MECH_C(0.5);
}

/* What the present impulses take out of the energy. */
static mech_real energy_lost(const mech_solver *s, mech_real *size)
{
    const mech_event_state *e = s->events;
    mech_real lost = 0;
    *size = 0;
    for (int i = 0; i < e->n_rows; i++) {
        mech_real change = 0;
        for (int j = 0; j < e->n_rows; j++) change += mech_row_response(s, i, j) * e->impulse[j];
        lost -= e->impulse[i] * (*mech_row_rate(s, i) + change / 2);
        *size += mech_abs(e->impulse[i]) * (mech_abs(*mech_row_rate(s, i)) + mech_abs(change));
    }
    return lost;
}

/* Restitution of a contact that approaches: none where the rebound would be slower than the contact rests, or where
 * it would not rise above what rounding leaves of the gap. */
static mech_real restitution(mech_solver *s, int i)
{
    const mech_real e = mech_row_value(s, i, MECH_COEFFICIENT), rest = mech_row_value(s, i, MECH_EXTRA);
    const mech_real r = -*mech_row_rate(s, i);
    const mech_real t = s->run->report.t, flight = t - s->events->last_hit[i];
    const int rests = e * r <= (rest >= 0 ? rest : MECH_C(1e-9) * s->events->speed[i]) ||
                      mech_row_falls_back(s, i, e * r);
    /* The flights that are left out would last as long as this geometric series. */
    s->events->delay[i] = rests && e > 0 && e < 1 && s->events->last_hit[i] > s->o.t0 ? flight * e / (1 - e) : 0;
    s->events->last_hit[i] = t;
    return rests ? 0 : e;
}

static void set_impulses(mech_solver *s, int n, const int *set, const mech_real *x)
{
    memset(s->events->impulse, 0, (size_t)s->events->n_rows * sizeof(mech_real));
    for (int k = 0; k < n; k++) s->events->impulse[set[k]] = x[k];
}

/* The contact slides: its impulse and that of its friction lie on the cone and act as one. `push`: the direction of
 * the impulse of friction, in one row or two from `first` on; `set`: n rows, the last one the contact. */
static int hit_sliding(mech_solver *s, int n, const int *set, const mech_real *target, int first,
                       const mech_real *push)
{
    mech_event_state *e = s->events;
    const int width = s->model->nv + e->n_rows, count = mech_row_partner(s, first) < 0 ? 1 : 2;
    mech_real *b = e->response + set[n - 1] * width, x[MECH_MOST_ROWS];
    const mech_real kinetic = mech_row_value(s, first, MECH_EXTRA);
    for (int k = 0; k < count; k++)
        for (int i = 0; i < width; i++) b[i] += kinetic * push[k] * e->response[(first + k) * width + i];
    const int rank = mech_rows_solve(s, n, set, target, x);
    for (int k = 0; k < count; k++)
        for (int i = 0; i < width; i++) b[i] -= kinetic * push[k] * e->response[(first + k) * width + i];
    set_impulses(s, n, set, x);
    for (int k = 0; k < count; k++) e->impulse[first + k] = kinetic * push[k] * x[n - 1];
    return rank == n && x[n - 1] >= 0 ? MECH_RUNNING : mech_fail(s, MECH_NO_IMPACT, set[n - 1]);
}

/* One contact hits: its impulse, that of its friction, and those of constraints that are engaged. */
static int hit_alone(mech_solver *s, int contact)
{
    mech_event_state *e = s->events;
    int set[MECH_MOST_ROWS], n = 0, slips = -1;
    mech_real target[MECH_MOST_ROWS], x[MECH_MOST_ROWS];
    for (int i = 0; i < e->n_rows; i++)
        if (engaged(s, i)) {
            set[n] = i;
            target[n++] = -*mech_row_rate(s, i);
        }
    set[n] = contact;
    target[n++] = -(1 + restitution(s, contact)) * *mech_row_rate(s, contact);
    for (int i = e->n_rows - 1; i >= 0; i--)
        if (mech_row_of(s, i)->kind == MECH_FRICTION && mech_row_of(s, i)->normal == contact &&
            mech_row_value(s, i, MECH_COEFFICIENT) > 0)
            slips = i;
    if (slips < 0) {
        mech_rows_solve(s, n, set, target, x);
        set_impulses(s, n, set, x);
        return MECH_RUNNING;
    }
    const int count = mech_row_partner(s, slips) < 0 ? 1 : 2;
    for (int k = 0; k < count; k++) {
        set[n + k] = slips + k;
        target[n + k] = -*mech_row_rate(s, slips + k);
    }
    mech_rows_solve(s, n + count, set, target, x);
    const mech_real normal = x[n - 1], *tangential = x + n;
    const mech_real size = count == 1 ? mech_abs(x[n]) : mech_sqrt(x[n] * x[n] + x[n + 1] * x[n + 1]);
    if (size <= mech_row_value(s, slips, MECH_COEFFICIENT) * normal) {
        set_impulses(s, n + count, set, x);
        return MECH_RUNNING;
    }
    const mech_real slip = mech_row_size(s, slips, MECH_RATE);
    mech_real push[2];
    for (int k = 0; k < count; k++)
        push[k] = slip > mech_row_still(s, slips) ? -*mech_row_rate(s, slips + k) / slip : tangential[k] / size;
    return hit_sliding(s, n, set, target, slips, push);
}

/* All hits at once: 0 <= p, r+ + e r- >= 0, one of them zero in each touching row; r+ = 0 where engaged. */
static int hit_together(mech_solver *s)
{
    mech_event_state *e = s->events;
    int row[MECH_MOST_ROWS], in[MECH_MOST_ROWS], set[MECH_MOST_ROWS] = {0}, m = 0;
    mech_real aim[MECH_MOST_ROWS], target[MECH_MOST_ROWS] = {0}, x[MECH_MOST_ROWS];
    for (int i = 0; i < e->n_rows; i++)
        if (engaged(s, i) || mech_row_touches(s, i)) {
            row[m] = i;
            in[m] = engaged(s, i);
            const mech_real r = *mech_row_rate(s, i);
            aim[m++] = engaged(s, i) || r >= 0 ? -r : -(1 + restitution(s, i)) * r;
        }
    for (int pivots = 0; pivots < MOST_PIVOTS; pivots++) {
        int n = 0, wrong = -1;
        for (int k = 0; k < m; k++)
            if (in[k]) {
                set[n] = row[k];
                target[n++] = aim[k];
            }
        mech_rows_solve(s, n, set, target, x);
        set_impulses(s, n, set, x);
        for (int k = 0; k < m && wrong < 0; k++) {
            if (engaged(s, row[k])) continue;
            mech_real change = 0, size = mech_abs(aim[k]);
            for (int j = 0; j < n; j++) {
                const mech_real part = mech_row_response(s, row[k], set[j]) * x[j];
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
    mech_rows_apply_impulses(s);
    return MECH_RUNNING;
}

static int fastest_approach(const mech_solver *s)
{
    int found = -1;
    mech_real fastest = 0;
    for (int i = 0; i < s->events->n_rows; i++) {
        const mech_real approach = -*mech_row_rate(s, i);
        if (mech_row_touches(s, i) && approach > mech_row_still(s, i) && (found < 0 || approach > fastest)) {
            found = i;
            fastest = approach;
        }
    }
    return found;
}

/* Constraints that were engaged take their rates away at once. */
static int engage(mech_solver *s)
{
    mech_event_state *e = s->events;
    int set[MECH_MOST_ROWS], n = 0, moves = -1;
    mech_real target[MECH_MOST_ROWS], x[MECH_MOST_ROWS];
    for (int i = 0; i < e->n_rows; i++) {
        if (!engaged(s, i)) continue;
        if (!(mech_abs(mech_row_value(s, i, MECH_GAP)) <= MECH_C(1e-6) * mech_max(e->gap_scale[i], 0))) {
            s->run->report.failed_value = mech_row_value(s, i, MECH_GAP);
            return mech_fail(s, MECH_APART, i);
        }
        if (mech_abs(*mech_row_rate(s, i)) > mech_row_still(s, i)) moves = i;
        set[n] = i;
        target[n++] = -*mech_row_rate(s, i);
    }
    if (moves < 0) return MECH_RUNNING;
    mech_rows_find_response(s);
    mech_rows_solve(s, n, set, target, x);
    set_impulses(s, n, set, x);
    return apply_checked(s, moves);
}

/* A contact that is engaged at this instant must not be beyond its surface. */
static int check_engaged_contacts(mech_solver *s)
{
    const mech_event_state *e = s->events;
    for (int i = 0; i < e->n_rows; i++) {
        const int enabled = mech_row_of(s, i)->enabled;
        if (enabled < 0 || !(e->z[enabled] > MECH_C(0.5)) || e->z_before[enabled] > MECH_C(0.5)) continue;
        if (mech_row_value(s, i, MECH_GAP) >= -MECH_C(1e-6) * e->gap_scale[i]) continue;
        s->run->report.failed_value = mech_row_value(s, i, MECH_GAP);
        return mech_fail(s, MECH_PENETRATION, i);
    }
    return MECH_RUNNING;
}

int mech_impacts_resolve(mech_solver *s, int *count)
{
    mech_event_state *e = s->events;
    mech_rows_read(s);
    int status = check_engaged_contacts(s), ready = 0;
    if (!status) status = engage(s);
    for (int round = 0; !status; round++) {
        const int contact = fastest_approach(s);
        if (contact < 0) break;
        if (!ready) mech_rows_find_response(s);
        ready = 1;
        const mech_real approach = -*mech_row_rate(s, contact);
        const int together = s->model->hybrid->simultaneous || round >= ROUNDS_PER_ROW * e->n_rows;
        if (round > 2 * ROUNDS_PER_ROW * e->n_rows) return mech_fail(s, MECH_NO_IMPACT, contact);
        if (together)
            for (int i = 0; i < e->n_rows; i++) {
                if (i != contact && mech_row_touches(s, i) && -*mech_row_rate(s, i) > mech_row_still(s, i))
                    mech_journal_note(s, MECH_IMPACT, i, -*mech_row_rate(s, i));
            }
        mech_journal_note(s, MECH_IMPACT, contact, approach);
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
    mech_real *y = s->events->y_at, jump = mech_row_value(s, i, MECH_FORCE);
    mech_real h = 10 * MECH_EPSILON * mech_abs(t) + MECH_C(1e-24) * s->o.dt_max;
    for (int k = 0; !mech_finite(jump) && h < MECH_C(1e-9) * s->o.dt_max; k++) {
        memcpy(y, s->y, (size_t)s->ny * sizeof(mech_real));
        for (int j = 0; j < m->nq; j++)
            if (mech_finite(s->dy[j])) y[j] += (k % 2 ? h : -h) * s->dy[j];
        mech_normalise(m, y);
        m->hybrid->row_values(t, y, s->u, s->events->z, s->o.p, s->events->row);
        jump = mech_row_value(s, i, MECH_FORCE);
        if (k % 2) h *= 4;
        mech_rows_read(s);
    }
    return jump;
}

int mech_impacts_pass_step(mech_solver *s, int hit, int *passed)
{
    mech_event_state *e = s->events;
    for (int i = 0; i < e->n_rows; i++) {
        if (mech_row_of(s, i)->kind != MECH_STEP_ROW || mech_row_of(s, i)->normal != hit) continue;
        mech_rows_read(s);
        mech_rows_find_response(s);
        const mech_real jump = jump_in(s, i), r = *mech_row_rate(s, i), w = mech_row_response(s, i, i);
        if (jump != jump) { /* an infinite one is a wall */
            s->run->report.failed_value = jump;
            return mech_fail(s, MECH_UNDEFINED_JUMP, hit);
        }
        /* Beside a surface across which the energy only bends, rounding of its place gives a jump. */
        if (!(w > 0) || mech_abs(2 * w * jump) <= MECH_C(1e-13) * r * r) return MECH_RUNNING;
        const mech_real square = r * r - 2 * w * jump;
        *passed = square > 0;
        memset(e->impulse, 0, (size_t)e->n_rows * sizeof(mech_real));
        e->impulse[i] = ((*passed ? (r > 0 ? 1 : -1) * mech_sqrt(square) : -r) - r) / w;
        mech_rows_apply_impulses(s);
        mech_journal_note(s, *passed ? MECH_CROSSED : MECH_REFLECTED, i, mech_abs(r));
    }
    return MECH_RUNNING;
}
