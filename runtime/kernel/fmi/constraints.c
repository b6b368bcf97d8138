/* States taken to the constraints.
 *
 * A projection moves everything. What was stated of an initial state must not move: displacements within the
 * constraints put it back, by Newton's method. They are what a projection leaves of unit displacements.
 */
#include <string.h>

#include "instance.h"
#include "projection.h"

enum { MOST_ROUNDS = 30 };

mech_real fmu_off_unit(const fmu *f)
{
    mech_real largest = 0;
    for (int k = 0; k < f->m->n_rotations; k++) {
        const mech_real *e = f->y + f->m->rotations[k];
        const mech_real off = e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3] - 1;
        largest = mech_max(largest, mech_abs(off));
    }
    return largest;
}

/* Only a quaternion off by more than rounding is changed: the solver normalises, too, and once is enough. */
int fmu_project(fmu *f)
{
    if (fmu_off_unit(f) > 16 * MECH_EPSILON) mech_normalise(f->m, f->y);
    return f->m->n_velocity ? mech_project(f->s, f->st->t, f->y) : MECH_RUNNING;
}

/* Solves a[n][n + 1] in place, by complete pivoting; what depends on the rest gets 0. */
static void solve(int n, mech_real *a, mech_real *x, int *column)
{
    const int width = n + 1;
    mech_real largest = 0;
    int rank = 0;
    for (int i = 0; i < n; i++) column[i] = i;
    for (; rank < n; rank++) {
        int p = rank, q = rank;
        for (int i = rank; i < n; i++)
            for (int j = rank; j < n; j++)
                if (mech_abs(a[i * width + column[j]]) > mech_abs(a[p * width + column[q]])) p = i, q = j;
        const int chosen = column[q];
        const mech_real pivot = a[p * width + chosen];
        largest = mech_max(largest, mech_abs(pivot));
        if (!(mech_abs(pivot) > MECH_C(1e-10) * largest)) break;
        column[q] = column[rank];
        column[rank] = chosen;
        for (int j = 0; j < width; j++) {
            const mech_real kept = a[p * width + j];
            a[p * width + j] = a[rank * width + j];
            a[rank * width + j] = kept;
        }
        for (int i = rank + 1; i < n; i++) {
            const mech_real factor = a[i * width + chosen] / a[rank * width + chosen];
            for (int j = 0; j < width; j++) a[i * width + j] -= factor * a[rank * width + j];
        }
    }
    for (int i = 0; i < n; i++) x[i] = 0;
    for (int k = rank - 1; k >= 0; k--) {
        mech_real sum = a[k * width + n];
        for (int j = k + 1; j < rank; j++) sum -= a[k * width + column[j]] * x[column[j]];
        x[column[k]] = sum / a[k * width + column[k]];
    }
}

/* Moves y[first..] within the constraints so that the n entries listed in `held` become as wanted. */
static void put_back(fmu *f, const mech_real *wanted, int first, int n, const int *held)
{
    const mech_model *m = f->m;
    const int nv = m->nv, rows = nv + m->n_velocity;
    mech_real *plain = f->room, *moved = plain + rows, *within = moved + rows, *a = within + nv * nv, *x = a + nv * (nv + 1);
    m->project_velocity(f->st->t, f->y, f->s->u, f->z, f->p, plain);
    for (int k = 0; k < n; k++) {
        mech_real *v = f->y + m->nq + held[k];
        const mech_real before = *v, unit = f->d->nominal[m->nq + held[k]];
        *v += unit;
        m->project_velocity(f->st->t, f->y, f->s->u, f->z, f->p, moved);
        *v = before;
        for (int i = 0; i < nv; i++) within[k * nv + i] = (i == held[k]) + (moved[i] - plain[i]) / unit;
    }
    for (int k = 0; k < n; k++) {
        for (int l = 0; l < n; l++) a[k * (n + 1) + l] = within[l * nv + held[k]];
        a[k * (n + 1) + n] = wanted[first + held[k]] - f->y[first + held[k]];
    }
    solve(n, a, x, (int *)(x + nv));
    for (int k = 0; k < n; k++)
        for (int i = 0; i < nv; i++) f->y[first + i] += x[k] * within[k * nv + i];
}

/* Whether all states from `first` on, `count` of them, that must not move are as wanted; lists them. */
static int list_held(const fmu *f, const mech_real *wanted, int first, int count, int model_holds, int *held, int *n)
{
    int as_wanted = 1;
    *n = 0;
    for (int i = 0; i < count; i++) {
        const int k = first + i;
        if (!f->y_set[k] && !(model_holds && f->d->y_held[k])) continue;
        held[(*n)++] = i;
        if (mech_abs(f->y[k] - wanted[k]) > 256 * MECH_EPSILON * (f->d->nominal[k] + mech_abs(wanted[k]))) as_wanted = 0;
    }
    return as_wanted;
}

static int undone(fmu *f, const mech_real *y)
{
    memcpy(f->y, y, (size_t)f->ny * sizeof(mech_real));
    return 1;
}

/* 0, or 1 where the constraints and what must not move cannot be met together. */
static int meet(fmu *f, int model_holds)
{
    const mech_model *m = f->m;
    mech_real *wanted = f->scratch;
    int *held = (int *)(f->room + 2 * (m->nv + m->n_velocity) + m->nv * (2 * m->nv + 3)), n = 0;
    memcpy(wanted, f->y, (size_t)f->ny * sizeof(mech_real));
    for (int first = 0, count = m->nq;; first = m->nq, count = m->nv) {
        int round = 0;
        for (; round < MOST_ROUNDS; round++) {
            if (first == 0) memcpy(f->y + m->nq, wanted + m->nq, (size_t)m->nv * sizeof(mech_real));
            if (fmu_project(f)) return undone(f, wanted);
            if (list_held(f, wanted, first, count, model_holds, held, &n)) break;
            if (m->nq != m->nv) round = MOST_ROUNDS; /* a rotation is not put back by its entries */
            if (round < MOST_ROUNDS) put_back(f, wanted, first, n, held);
        }
        if (round >= MOST_ROUNDS || !list_held(f, wanted, first, count, model_holds, held, &n)) break;
        if (first) return 0;
    }
    return undone(f, wanted);
}

/* Values that the importer has set go before those of the model. */
int fmu_meet_constraints(fmu *f)
{
    if (!f->m->n_velocity) {
        fmu_project(f); /* rotations alone, which always succeeds */
        return FMU_OK;
    }
    if (!meet(f, 1) || !meet(f, 0)) return FMU_OK;
    return fmu_fail(f, FMU_ERROR, "the initial values that were set contradict the constraints");
}
