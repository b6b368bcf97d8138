/* What rows are at a point, what they leave free, and the shortest steps onto them, by orthogonal factors of their
 * gradients with pivoting, so that rows that repeat others do no harm. What no row moves takes no part, so that it keeps
 * every bit.
 */
#include "onto_rows.h"

#include <string.h>

#include "displacement.h"

enum { RESTORATION = 50, HALVINGS = 12 };

static const mech_real RANK = MECH_C(1e-10);

/* 1e-16 in double precision. */
static mech_real rounding(void) { return MECH_C(0.45) * MECH_EPSILON; }

void mech_look(const mech_task *k, mech_point *point)
{
    const mech_model *m = k->model;
    m->start->assembly(k->t, point->y, k->u, k->z, k->p, point->values);
    m->start->assembly_jacobian(k->t, point->y, k->u, k->z, k->p, point->jacobian);
    if (k->stage == 1) mech_deviation(m, point->y, k->guess, point->deviation);
    else
        for (int j = 0; j < m->nv; j++) point->deviation[j] = point->y[m->nq + j] - k->guess[m->nq + j];
}

void mech_go(const mech_task *k, const mech_real *from, const mech_real *d, mech_real *y)
{
    const mech_model *m = k->model;
    memmove(y, from, (size_t)(m->nq + m->nv + m->nx) * sizeof(mech_real));
    if (k->stage == 1) mech_displace(m, y, d);
    else
        for (int j = 0; j < m->nv; j++) y[m->nq + j] += d[j];
}

mech_real mech_scale_of(const mech_task *k, int i) { return k->scale[i] > 0 ? k->scale[i] : 1; }

mech_real mech_worst_of(const mech_task *k, const mech_point *at, int *row)
{
    mech_real worst = 0;
    for (int a = 0; a < k->n_hard; a++) {
        const mech_real size = mech_abs(at->values[k->hard[a]]) / mech_scale_of(k, k->hard[a]);
        if (size <= worst) continue;
        worst = size;
        if (row) *row = k->hard[a];
        if (size != size) break;
    }
    return worst;
}

static const mech_real *gradient(const mech_task *k, int row)
{
    return k->here.jacobian + (size_t)row * (size_t)k->model->nv;
}

mech_real mech_entry(const mech_task *k, const mech_point *at, int row, int f)
{
    const int j = k->free[f];
    return at->jacobian[(size_t)row * (size_t)k->model->nv + (size_t)j] / k->weights[j];
}

/* Marks all that a row turns on, if it is off itself or turns on something marked; returns whether something is new. */
static int reach(const mech_task *k, int row)
{
    const mech_real *turns = gradient(k, row);
    int off = k->here.values[row] != 0, found = 0;
    for (int f = 0; f < k->n_loose && !off; f++) off = k->reached[k->loose[f]] && turns[k->loose[f]] != 0;
    for (int f = 0; f < k->n_loose && off; f++) {
        int *reached = &k->reached[k->loose[f]];
        if (!*reached && turns[k->loose[f]] != 0) found = *reached = 1;
    }
    return found;
}

void mech_find_free(mech_task *k)
{
    for (int f = 0; f < k->n_loose; f++) k->reached[k->loose[f]] = k->here.deviation[k->loose[f]] != 0;
    for (int found = 1; found;) {
        found = 0;
        for (int a = 0; a < k->n_hard; a++) found |= reach(k, k->hard[a]);
        for (int a = k->n_soft; a-- > 0;) found |= reach(k, k->soft[a]);
    }
    k->n_free = 0;
    for (int f = 0; f < k->n_loose; f++)
        if (k->reached[k->loose[f]]) k->free[k->n_free++] = k->loose[f];
}

int mech_factor_rows(const mech_task *k, mech_factors *x)
{
    const int n = k->n_free, m = k->n_hard, most = n < m ? n : m;
    x->across = (mech_orthogonal){n, m, 0, k->work, k->work + (size_t)n * m, k->order};
    for (int a = 0; a < m; a++) {
        const mech_real scale = mech_scale_of(k, k->hard[a]);
        if (!mech_finite(k->here.values[k->hard[a]])) return 0;
        for (int f = 0; f < n; f++) {
            const mech_real value = mech_entry(k, &k->here, k->hard[a], f) / scale;
            if (!mech_finite(value)) return 0;
            x->across.a[(size_t)a * n + f] = value;
        }
    }
    mech_orthogonalise(&x->across, RANK);
    const int r = x->across.rank;
    mech_real *next = x->across.head + most;
    x->range = (mech_orthogonal){m, r, 0, next, next + (size_t)m * r, k->order + m};
    for (int i = 0; i < r; i++)
        for (int a = 0; a < m; a++) x->range.a[(size_t)i * m + a] = a < i ? 0 : x->across.a[(size_t)a * n + i];
    mech_orthogonalise(&x->range, 0);
    x->rest = x->range.head + r;
    x->order = x->range.order + r;
    return 1;
}

void mech_onto(const mech_task *k, mech_factors *x, mech_real *step)
{
    mech_real *c = x->rest;
    for (int a = 0; a < k->n_hard; a++) {
        const int row = k->hard[x->across.order[a]];
        c[a] = -k->here.values[row] / mech_scale_of(k, row);
    }
    for (int f = 0; f < k->n_free; f++) step[f] = 0;
    mech_real *y = c + k->n_hard;
    mech_least_squares(&x->range, c, y);
    for (int i = 0; i < x->across.rank; i++) step[i] = y[i];
    mech_rotate(&x->across, 0, step);
}

void mech_multiply_back(const mech_factors *x, int n_hard, const mech_real *pull, mech_real *forward)
{
    for (int i = 0; i < x->range.rank; i++) { /* the triangle of the range, transposed */
        mech_real sum = pull[x->range.order[i]];
        for (int j = 0; j < i; j++) sum -= x->range.a[(size_t)i * n_hard + j] * forward[j];
        forward[i] = sum / x->range.a[(size_t)i * n_hard + i];
    }
}

mech_real mech_largest(const mech_real *x, int n)
{
    mech_real size = 0;
    for (int i = 0; i < n; i++)
        if (!(mech_abs(x[i]) <= size)) size = mech_abs(x[i]);
    return size;
}

void mech_try_step(mech_task *k, mech_real factor)
{
    for (int j = 0; j < k->model->nv; j++) k->d[j] = 0;
    for (int f = 0; f < k->n_free; f++) k->d[k->free[f]] = factor * k->step[f] / k->weights[k->free[f]];
    mech_go(k, k->here.y, k->d, k->there.y);
    mech_look(k, &k->there);
}

void mech_take(mech_task *k)
{
    const mech_point kept = k->here;
    k->here = k->there;
    k->there = kept;
}

int mech_restore(mech_task *k)
{
    mech_factors x;
    for (int taken = 0; taken < RESTORATION; taken++) {
        const mech_real worst = mech_worst_of(k, &k->here, NULL);
        if (!(worst > rounding())) return taken;
        mech_find_free(k);
        if (!mech_factor_rows(k, &x)) return taken;
        mech_onto(k, &x, k->step);
        const mech_real size = mech_largest(k->step, k->n_free);
        if (!mech_finite(size)) return taken;
        const int far = worst > MECH_FULFILLED;
        mech_real factor = size > MECH_LONGEST ? MECH_LONGEST / size : 1;
        int nearer = 0;
        for (int i = 0; i <= (far ? HALVINGS : 0) && !nearer; i++, factor /= 2) {
            mech_try_step(k, factor);
            nearer = mech_worst_of(k, &k->there, NULL) < (far ? worst : worst / 2);
        }
        if (!nearer) return taken;
        mech_take(k);
    }
    return RESTORATION;
}

