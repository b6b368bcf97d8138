#include "rows.h"

#include <stdlib.h>
#include <string.h>

#include "energy.h"
#include "near_rows.h"
#include "window.h"

/* Ratio of what an impulse moves rows by, from which on they are compared each with its own. */
static const mech_real FAR_APART = MECH_C(1e6);

void mech_rows_read(mech_solver *s)
{
    const mech_model *m = s->model;
    mech_event_state *e = s->events;
    const mech_real t = s->run->report.t;
    mech_surroundings(s, t);
    if (m->hybrid->crowd)
        mech_window_read(s, t, s->y, 1, e->row);
    else
        m->hybrid->row_values(t, s->y, s->u, e->z, s->o.p, e->row);
    for (int i = 0; i < e->n_rows; i++) {
        mech_widen(e->speed + i, *mech_row_rate(s, i));
        if (m->hybrid->crowd) {
            e->counters[MECH_FASTEST] = mech_max(e->counters[MECH_FASTEST], e->speed[i]);
            continue;
        }
        /* what would have to hold where nothing can is not a measure */
        mech_real force = mech_abs(mech_row_value(s, i, MECH_FORCE));
        if (mech_row_of(s, i)->kind == MECH_FRICTION)
            force = mech_min(force, mech_max(0, mech_row_value(s, i, MECH_LIMIT)));
        if (mech_row_of(s, i)->kind != MECH_STEP_ROW) mech_widen(e->force + i, force);
    }
}

int mech_rows_check(mech_solver *s, int limits)
{
    for (int i = 0; i < s->events->n_rows; i++) {
        const mech_real *row = s->events->row + i * MECH_ROW_VALUES;
        const mech_real coefficient = row[MECH_COEFFICIENT], limit = row[MECH_LIMIT];
        const int contact = s->events->rows[i].kind == MECH_CONTACT, friction = s->events->rows[i].kind == MECH_FRICTION;
        const int own = friction && s->events->rows[i].normal < 0;
        mech_real wrong = 0;
        if (contact && !(coefficient >= 0 && coefficient <= 1)) wrong = coefficient;
        if (friction && !own && coefficient < 0) wrong = coefficient;
        if (friction && !own && row[MECH_EXTRA] < 0) wrong = row[MECH_EXTRA];
        if (own && limits && limit < -MECH_C(1e-9) * s->events->force[i]) wrong = limit;
        if (wrong == 0) continue;
        s->run->report.failed_value = wrong;
        return mech_fail(s, MECH_OUT_OF_RANGE, i);
    }
    return MECH_RUNNING;
}

mech_real mech_row_still(const mech_solver *s, int i)
{
    const int j = mech_row_partner(s, i);
    const mech_real *speed = s->events->speed;
    return MECH_C(1e-11) * (j < 0 ? speed[i] : mech_max(speed[i], speed[j]));
}

mech_real mech_row_rest(const mech_solver *s, int i)
{
    const mech_event_state *e = s->events;
    const mech_real rest = mech_row_value(s, i, MECH_EXTRA);
    if (rest >= 0) return rest;
    return s->model->hybrid->crowd ? mech_max(s->o.rtol, MECH_C(1e-9)) * e->counters[MECH_FASTEST] : MECH_C(1e-9) * e->speed[i];
}

int mech_row_is_enabled(const mech_solver *s, int i)
{
    const int enabled = mech_row_of(s, i)->enabled;
    return enabled < 0 || s->events->z[enabled] > MECH_C(0.5);
}

int mech_row_touches(const mech_solver *s, int i)
{
    const mech_row *row = mech_row_of(s, i);
    if (row->kind != MECH_CONTACT || !mech_row_is_enabled(s, i)) return 0;
    const int closed = s->events->z[row->flag] > MECH_C(0.5);
    const mech_real gap = mech_row_value(s, i, MECH_GAP), near = (closed ? 1000 : 1) * MECH_C(1e-9) * s->events->gap_scale[i];
    return gap <= near && (gap >= -near || s->model->hybrid->crowd != NULL);
}

mech_real mech_row_idle(const mech_solver *s, int i)
{
    const mech_real still = mech_row_still(s, i);
    return s->model->hybrid->crowd ? mech_max(still, MECH_C(1e-4) * mech_row_rest(s, i)) : still;
}

int mech_row_may_rest(const mech_solver *s, int i)
{
    const int slow = mech_abs(mech_row_value(s, i, MECH_RATE)) <= 10 * mech_row_idle(s, i);
    return (slow || s->events->open[i] < 0) && mech_row_touches(s, i);
}

void mech_rows_weigh(mech_solver *s)
{
    mech_event_state *e = s->events;
    for (int i = 0; i < e->n_rows; i++) mech_widen(e->counters + MECH_STEEPEST, mech_row_value(s, i, MECH_SECOND));
    for (int i = 0; i < e->n_rows; i++)
        if (mech_row_moves_itself(s, i)) mech_widen(e->force + i, e->counters[MECH_STEEPEST] / mech_row_response(s, i, i));
}

void mech_rows_find_response(mech_solver *s)
{
    const mech_model *m = s->model;
    mech_event_state *e = s->events;
    if (m->hybrid->crowd) mech_window_respond(s);
    for (int j = 0; j < e->n_rows; j++) {
        if (!m->hybrid->crowd) {
            e->z[mech_row_of(s, j)->impulse] = 1;
            m->hybrid->respond(s->run->report.t, s->y, s->u, e->z, s->o.p, e->response + j * (m->nv + e->n_rows));
            e->z[mech_row_of(s, j)->impulse] = 0;
        }
        mech_real *own = e->response + j * (m->nv + e->n_rows) + m->nv + j;
        *own = *own < 0 ? 0 : *own; /* at a dead centre no impulse moves the row, but for rounding */
        mech_widen(e->mobility + j, mech_row_response(s, j, j));
    }
}

int mech_row_moves_itself(const mech_solver *s, int i)
{
    return mech_abs(mech_row_response(s, i, i)) > MECH_C(1e-11) * s->events->mobility[i];
}

/* Powers of two by which rows that move far less than others are multiplied, so that a mass of 1e6 kg is no rounding beside one
   of 1e-6 kg. Where all of them are within a factor of a million they are one: nothing changes, not even the last bit. */
static void find_scales(const mech_solver *s, int n, const int *set, mech_real *scale)
{
    const mech_real *mobility = s->events->mobility;
    mech_real largest = 0, smallest = (mech_real)INFINITY;
    for (int i = 0; i < n; i++) {
        scale[i] = 1;
        largest = mech_max(largest, mobility[set[i]]);
        if (mobility[set[i]] > 0) smallest = mech_min(smallest, mobility[set[i]]);
    }
    if (!(largest > FAR_APART * smallest) || !mech_finite(largest)) return;
    for (int i = 0; i < n; i++)
        for (mech_real ratio = mobility[set[i]] > 0 ? largest / mobility[set[i]] : 1; ratio > 4; ratio /= 4) scale[i] *= 2;
}

/* Of all solutions of rows that depend on each other the one that costs least, each unknown weighed by what it moves itself
 * by: what is alike has alike, whichever stands first. The rows are eliminated: of n columns, the first `rank` ones stand in
 * a triangle; of x in that order these are set, the rest is zero. */
static void share(const mech_solver *s, int n, int rank, const int *set, const int *used, const int *column,
                  const mech_real *scale, mech_real largest, mech_real *x)
{
    const int width = n + 1, free_ = n - rank;
    mech_real *a = s->events->matrix, weight[MECH_MOST_ROWS], right[MECH_MOST_ROWS];
    mech_real *gram = (mech_real *)malloc((size_t)free_ * (size_t)(free_ + 1) / 2 * sizeof(mech_real));
    if (!gram) return; /* one solution of many, then */
    for (int k = 0; k < n; k++) {
        const int i = column[k];
        weight[k] = mech_max(scale[i] * scale[i] * mech_row_response(s, set[i], set[i]), MECH_C(1e-11) * largest);
    }
    for (int k = rank - 1; k >= 0; k--) /* what each free unknown takes from the others, in its own column */
        for (int f = rank; f < n; f++) {
            mech_real *row = a + used[k] * width, sum = row[column[f]];
            for (int j = k + 1; j < rank; j++) sum -= row[column[j]] * a[used[j] * width + column[f]];
            row[column[f]] = sum / row[column[k]];
        }
    for (int f = 0; f < free_; f++) {
        right[f] = 0;
        for (int k = 0; k < rank; k++) right[f] += weight[k] * a[used[k] * width + column[rank + f]] * x[column[k]];
        for (int g = 0; g <= f; g++) {
            mech_real sum = f == g ? weight[rank + f] : 0;
            for (int k = 0; k < rank; k++)
                sum += weight[k] * a[used[k] * width + column[rank + f]] * a[used[k] * width + column[rank + g]];
            gram[f * (f + 1) / 2 + g] = sum;
        }
    }
    for (int f = 0; f < free_; f++) /* Cholesky's factors, and forwards */
        for (int g = 0; g <= f; g++) {
            mech_real sum = gram[f * (f + 1) / 2 + g];
            for (int k = 0; k < g; k++) sum -= gram[f * (f + 1) / 2 + k] * gram[g * (g + 1) / 2 + k];
            gram[f * (f + 1) / 2 + g] = f == g ? mech_sqrt(sum) : sum / gram[g * (g + 1) / 2 + g];
            if (g < f) right[f] -= gram[f * (f + 1) / 2 + g] * right[g];
            if (f == g) right[f] /= gram[f * (f + 1) / 2 + f];
        }
    for (int f = free_ - 1; f >= 0; f--) {
        for (int k = f + 1; k < free_; k++) right[f] -= gram[k * (k + 1) / 2 + f] * right[k];
        right[f] /= gram[f * (f + 1) / 2 + f];
        x[column[rank + f]] = right[f];
        for (int k = 0; k < rank; k++) x[column[k]] -= a[used[k] * width + column[rank + f]] * right[f];
    }
    free(gram);
}

static int solve(mech_solver *s, int n, const int *set, const mech_real *target, int shared, mech_real *x)
{
    /* Gaussian elimination with complete pivoting; what is left below rounding is dependent. */
    mech_real *a = s->events->matrix;
    const int width = n + 1;
    int rank = 0;
    int column[MECH_MOST_ROWS], used[MECH_MOST_ROWS];
    mech_real largest = 0, scale[MECH_MOST_ROWS];
    find_scales(s, n, set, scale);
    for (int i = 0; i < n; i++) {
        column[i] = i;
        used[i] = i;
        for (int j = 0; j < n; j++) {
            a[i * width + j] = scale[i] * scale[j] * mech_row_response(s, set[i], set[j]);
            largest = mech_max(largest, mech_abs(a[i * width + j]));
        }
        a[i * width + n] = scale[i] * target[i];
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
    if (shared && rank && rank < n) share(s, n, rank, set, used, column, scale, largest, x);
    for (int i = 0; i < n; i++) x[i] *= scale[i];
    return rank;
}

int mech_rows_solve(mech_solver *s, int n, const int *set, const mech_real *target, mech_real *x)
{
    int rises = s->model->hybrid->crowd != NULL;
    for (int k = 1; k < n; k++) rises &= set[k] > set[k - 1];
    if (rises) return mech_near_rows_solve(s, n, set, target, x);
    return solve(s, n, set, target, 0, x);
}

int mech_rows_share(mech_solver *s, int n, const int *set, const mech_real *target, mech_real *x)
{
    return solve(s, n, set, target, 1, x);
}

/* What the present impulses take out of the energy. */
mech_real mech_rows_impulse_loss(const mech_solver *s, mech_real *size)
{
    const mech_event_state *e = s->events;
    mech_real lost = 0;
    *size = 0;
    for (int i = 0; i < e->n_rows; i++) {
        mech_real change = 0;
        if (e->impulse[i] == 0) continue;
        for (int j = 0; j < e->n_rows; j++) change += mech_row_response(s, i, j) * e->impulse[j];
        lost -= e->impulse[i] * (*mech_row_rate(s, i) + change / 2);
        *size += mech_abs(e->impulse[i]) * (mech_abs(*mech_row_rate(s, i)) + mech_abs(change));
    }
    return lost;
}

void mech_rows_apply_impulses(mech_solver *s)
{
    const mech_model *m = s->model;
    const mech_hybrid *h = m->hybrid;
    mech_event_state *e = s->events;
    const int width = m->nv + e->n_rows, carried = h->carried && h->supplied >= 0 && h->total >= 0;
    mech_real lost = 0, supplied = 0, before = carried ? mech_energy_total(s) : 0;
    int steps = 0; /* impulses of jumps of an energy, which are booked with these */
    memset(e->change, 0, (size_t)width * sizeof(mech_real));
    for (int j = 0; j < e->n_rows; j++)
        for (int i = 0; e->impulse[j] != 0 && i < width; i++)
            e->change[i] += e->impulse[j] * e->response[j * width + i];
    for (int i = 0; i < e->n_rows; i++) {
        const mech_real *change = e->change + m->nv + i;
        if (mech_row_of(s, i)->kind != MECH_STEP_ROW) {
            lost -= e->impulse[i] * (*mech_row_rate(s, i) + *change / 2);
            supplied -= e->impulse[i] * mech_row_value(s, i, MECH_DRIFT);
        } else if (e->impulse[i] != 0) {
            steps = 1;
        }
        *mech_row_rate(s, i) += *change;
        e->impulse[i] = 0;
    }
    for (int i = 0; i < m->nv; i++) s->y[m->nq + i] += e->change[i];
    if (carried && !steps) supplied = mech_energy_total(s) - before + lost;
    if (h->dissipated >= 0) s->y[h->dissipated] += lost;
    if (h->supplied >= 0) s->y[h->supplied] += supplied;
}

int mech_row_partner(const mech_solver *s, int i)
{
    const mech_row *row = mech_row_of(s, i), *next = row + 1;
    if (i + 1 >= s->events->n_rows || row->kind != MECH_FRICTION || next->kind != MECH_FRICTION) return -1;
    return row->normal >= 0 && next->normal == row->normal ? i + 1 : -1;
}

mech_real mech_row_size(const mech_solver *s, int i, int which)
{
    const int j = mech_row_partner(s, i);
    const mech_real a = mech_row_value(s, i, which), b = j < 0 ? 0 : mech_row_value(s, j, which);
    return j < 0 ? mech_abs(a) : mech_sqrt(a * a + b * b);
}

mech_real mech_row_reach(const mech_solver *s, int i, int with_values, mech_real *speed)
{
    const mech_model *m = s->model;
    const int all = i < 0 || m->hybrid->crowd || m->nq != m->nv + m->n_rotations;
    const mech_real *response = all ? NULL : s->events->response + i * (m->nv + s->events->n_rows);
    mech_real length = 0, fastest = 0;
    for (int v = 0, q = 0, r = 0, in = 0; response && v < m->nv; v++) {
        const int turns = r < m->n_rotations && m->rotations[r] == q; /* three velocities of four entries */
        if (response[v] != 0) {
            fastest = mech_max(fastest, mech_nominal(s, m->nq + v));
            for (int k = 0; k < (turns ? 4 : 1); k++)
                length = mech_max(length, mech_max(mech_nominal(s, q + k), with_values ? mech_abs(s->y[q + k]) : 0));
        }
        in = turns ? (in + 1) % 3 : 0;
        if (in) continue;
        q += turns ? 4 : 1;
        r += turns;
    }
    if (!(length > 0)) {
        for (int k = 0; k < m->nq; k++)
            length = mech_max(length, mech_max(mech_nominal(s, k), with_values ? mech_abs(s->y[k]) : 0));
        for (int k = m->nq; k < m->nq + m->nv; k++) fastest = mech_max(fastest, mech_nominal(s, k));
    }
    if (speed) *speed = fastest;
    return length;
}

int mech_row_falls_back(const mech_solver *s, int i, mech_real rate)
{
    const mech_real length = mech_row_reach(s, i, 1, NULL); /* what rounding of the coordinates leaves of a gap goes with their size */
    const mech_real height = MECH_C(1e-13) * s->events->gap_scale[i] + 100 * MECH_EPSILON * length;
    return rate * rate <= -2 * mech_row_value(s, i, MECH_SECOND) * height;
}

void mech_row_share_across(mech_solver *s, int i)
{
    mech_event_state *e = s->events;
    int held[MECH_MOST_ROWS], n = 0;
    mech_real target[MECH_MOST_ROWS], x[MECH_MOST_ROWS], force[2], slope[2] = {0, 0}, of_limit = 0;
    mech_real low = -(mech_real)INFINITY, high = (mech_real)INFINITY;
    const int rests = mech_row_holds(s, i) ? i + 1 : i, normal = mech_row_of(s, i)->normal;
    const mech_real coefficient = mech_row_value(s, i, MECH_COEFFICIENT);
    for (int k = 0; k < e->n_rows; k++)
        if (e->rows[k].flag >= 0 && e->rows[k].kind <= MECH_BILATERAL && mech_row_holds(s, k)) held[n++] = k;
    mech_rows_find_response(s);
    for (int k = 0; k < n; k++) target[k] = mech_row_response(s, held[k], rests);
    mech_rows_solve(s, n, held, target, x); /* what a unit of force along the one takes from the others */
    slope[rests - i] = 1;
    for (int k = 0; k < n; k++) {
        if (held[k] == i || held[k] == i + 1) slope[held[k] - i] = -x[k];
        if (held[k] == normal) of_limit = -coefficient * x[k];
        if (e->rows[held[k]].kind != MECH_CONTACT || mech_abs(x[k]) < MECH_C(1e-10)) continue;
        const mech_real end = mech_row_value(s, held[k], MECH_FORCE) / x[k];
        if (x[k] > 0)
            high = mech_min(high, end);
        else
            low = mech_max(low, end);
    }
    for (int k = 0; k < 2; k++) force[k] = mech_row_value(s, i + k, MECH_FORCE);
    const mech_real square = slope[0] * slope[0] + slope[1] * slope[1], apart = mech_abs(slope[0] * force[1] - slope[1] * force[0]);
    mech_real part = -(slope[0] * force[0] + slope[1] * force[1]) / square; /* the least force; more where the limit grows with it */
    if (square > of_limit * of_limit)
        part += apart * of_limit / (square * mech_sqrt(square - of_limit * of_limit));
    else
        part = of_limit > 0 ? high : low;
    part = mech_min(high, mech_max(low, part));
    if (low > high || !mech_finite(part)) return;
    for (int k = 0; k < n; k++) {
        e->row[held[k] * MECH_ROW_VALUES + MECH_FORCE] -= part * x[k];
    }
    e->row[rests * MECH_ROW_VALUES + MECH_FORCE] += part;
    for (int k = 0; k < 2; k++) e->row[(i + k) * MECH_ROW_VALUES + MECH_LIMIT] += part * of_limit;
}

int mech_row_is_carried(const mech_solver *s, int i)
{
    const mech_row *row = mech_row_of(s, i);
    if (row->kind != MECH_CONTACT && row->kind != MECH_FRICTION) return 0;
    const int j = mech_row_partner(s, i);
    if (row->kind == MECH_FRICTION && row->normal < 0) return s->events->z[row->sign] == 0;
    return mech_row_holds(s, i) || (j >= 0 && mech_row_holds(s, j)) || (i > 0 && mech_row_partner(s, i - 1) == i && mech_row_holds(s, i - 1));
}
