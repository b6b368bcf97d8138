/* Minimise |D (x - guess)|^2 + |e|^2 subject to c(x) = 0, with weights D and wishes e. Each step solves the linear
 * problem by orthogonal factors with pivoting, so that rows that repeat others do no harm. Steps longer than half a
 * characteristic size are shortened, and steps that raise the merit function |...|^2/2 + mu |c| are halved. Close to the
 * end the part along the rows is stretched by what the step before has left of it (A. Aitken 1937): steps do not see the
 * curvature of the rows, by which the nearest point may be much nearer or farther. Where they go to and fro,
 * second_order.c ends the search.
 *
 * J. Nocedal, S. Wright, Numerical Optimization, 2nd ed., Springer 2006, sections 10.3 and 15.4.
 */
#include "nearest.h"

#include <string.h>

#include "second_order.h"

enum { STEPS = 200, HALVINGS = 12 };

static const mech_real CLOSE = MECH_C(1e-7), NEAR_BY = MECH_C(0.05);
/* Of the sizes in a model: rows with smaller gradients are measured as if they had these, so that rounding is none of them. */
static const mech_real LEAST = MECH_C(1e-3);
/* Of a step along the rows: what is no way any more. */
static const mech_real LEFT = MECH_C(1e-11);

/* What depends on the precision of the numbers: 1e-15 and 1e-12 in double precision. */
static mech_real converged(void) { return MECH_C(4.5) * MECH_EPSILON; }
static mech_real settled(void) { return 4500 * MECH_EPSILON; }

static size_t larger(int a, int b) { return (size_t)(a > b ? a : b); }

size_t mech_nearest_numbers(const mech_model *m)
{
    const size_t rows = (size_t)m->start->n_rows, nv = (size_t)m->nv, both = rows + nv;
    /* factors of the gradients, of their range, of the wishes; right-hand sides and solutions */
    return 2 * rows * nv + both * nv + 3 * larger((int)rows, (int)nv) + 6 * both;
}

size_t mech_nearest_integers(const mech_model *m) { return 2 * (size_t)m->start->n_rows + (size_t)m->nv; }

static mech_real merit(const mech_task *k, const mech_point *at, mech_real mu)
{
    mech_real squares = 0, residuals = 0;
    for (int f = 0; f < k->n_free; f++) {
        const mech_real x = k->weights[k->free[f]] * at->deviation[k->free[f]];
        squares += x * x;
    }
    for (int a = 0; a < k->n_soft; a++) {
        const mech_real x = k->shares[k->soft[a]] * at->values[k->soft[a]];
        squares += x * x;
    }
    for (int a = 0; a < k->n_hard; a++) {
        const mech_real x = at->values[k->hard[a]] / mech_scale_of(k, k->hard[a]);
        residuals += x * x;
    }
    return squares / 2 + mu * mech_sqrt(residuals);
}

static mech_real wish(const mech_task *k, int a, const mech_real *step)
{
    const int row = k->soft[a];
    mech_real sum = k->here.values[row];
    for (int f = 0; f < k->n_free; f++) sum += mech_entry(k, &k->here, row, f) * step[f];
    return k->shares[row] * sum;
}

/* `share` of the steps along the rows, `taken` of the last one, the size of the whole one that is `left`; whether none is. */
typedef struct progress {
    mech_real unit, share, taken, left;
    int settled;
} progress;

/* The share of a step along the rows that ends it, as far as the step before tells. */
static mech_real share_of(const mech_task *k, const progress *at, const mech_real *step)
{
    mech_real product = 0, squares = 0, size = 0;
    for (int f = 0; f < k->n_free; f++) {
        const mech_real x = k->d[k->free[f]] * k->weights[k->free[f]];
        product += x * step[f];
        squares += x * x;
        size = mech_max(size, mech_abs(step[f]));
    }
    if (!(squares > 0) || !(size < NEAR_BY)) return 1;
    const mech_real best = at->taken * squares / (squares - at->taken * product);
    return best > 0 ? mech_min(mech_max(best, at->share / 4), mech_min(1, 2 * at->share)) : mech_min(1, 2 * at->share);
}

/* Adds to the step what brings it nearest to guesses and wishes within what the hard rows leave. */
static void along(const mech_task *k, mech_factors *x, progress *at, mech_real *step)
{
    const int n = k->n_free, r = x->across.rank, left = n - r, rows = left + k->n_soft;
    mech_real *back = x->rest, *b = back + n, *found = b + rows, *a = found + left;
    at->left = 0;
    if (!left) return;
    /* in the axes of the factors the guesses are an identity in the last `left` of them */
    for (int f = 0; f < n; f++) back[f] = k->weights[k->free[f]] * k->here.deviation[k->free[f]];
    mech_rotate(&x->across, 1, back);
    for (int i = 0; i < left; i++) b[i] = -back[r + i];
    if (k->n_soft) {
        mech_orthogonal wishes = {rows, left, 0, a, a + (size_t)rows * left, x->order};
        for (int i = 0; i < left; i++)
            for (int f = 0; f < left; f++) a[(size_t)i * rows + f] = f == i;
        for (int s = 0; s < k->n_soft; s++) {
            for (int f = 0; f < n; f++) back[f] = k->shares[k->soft[s]] * mech_entry(k, &k->here, k->soft[s], f);
            mech_rotate(&x->across, 1, back);
            for (int i = 0; i < left; i++) a[(size_t)i * rows + left + s] = back[r + i];
            b[left + s] = -wish(k, s, step);
        }
        mech_orthogonalise(&wishes, 0);
        mech_least_squares(&wishes, b, found);
    } else {
        memcpy(found, b, (size_t)left * sizeof(mech_real));
    }
    for (int i = 0; i < n; i++) back[i] = i < r ? 0 : found[i - r];
    mech_rotate(&x->across, 0, back);
    at->left = mech_largest(back, n);
    at->share = k->stage == 1 ? share_of(k, at, back) : 1;
    for (int f = 0; f < n; f++) step[f] += at->share * back[f];
}

/* The length of the multipliers of the hard rows: of the pull of guesses and wishes against them. */
static mech_real multipliers(const mech_task *k, mech_factors *x, const mech_real *step)
{
    const int n = k->n_free;
    mech_real *pull = x->rest, squares = 0;
    for (int f = 0; f < n; f++) pull[f] = k->weights[k->free[f]] * k->here.deviation[k->free[f]] + step[f];
    for (int s = 0; s < k->n_soft; s++) {
        const mech_real missing = k->shares[k->soft[s]] * wish(k, s, step);
        for (int f = 0; f < n; f++) pull[f] += missing * mech_entry(k, &k->here, k->soft[s], f);
    }
    mech_rotate(&x->across, 1, pull);
    mech_real *forward = pull + n;
    mech_multiply_back(x, k->n_hard, pull, forward);
    for (int i = 0; i < x->range.rank; i++) squares += forward[i] * forward[i];
    return mech_sqrt(squares);
}

/* The sizes of what pure numbers and lengths of the model are made of, or of their rates. */
static void sizes_of(const mech_task *k, mech_real *sizes)
{
    const mech_model *m = k->model;
    mech_real reach = k->length, rate = 1;
    for (int j = 0; j < m->nv; j++) {
        if (!(m->start->size[j] > 0)) reach = mech_max(reach, mech_abs(k->here.y[m->start->partner[j]]));
        if (k->stage == 2) rate = mech_max(rate, mech_abs(k->weights[j] * k->here.y[m->nq + j]));
    }
    sizes[0] = 0;
    sizes[1] = rate;
    sizes[2] = rate * reach;
}

static void measure_rows(mech_task *k)
{
    mech_real sizes[3];
    sizes_of(k, sizes);
    for (int a = 0; a < k->n_hard; a++) {
        mech_real *scale = &k->scale[k->hard[a]];
        *scale = mech_max(*scale, LEAST * sizes[k->model->start->rows[k->hard[a]].measure]);
        const mech_real *gradients = k->here.jacobian + (size_t)k->hard[a] * (size_t)k->model->nv;
        for (int j = 0; j < k->model->nv; j++) {
            const mech_real size = mech_abs(gradients[j] / k->weights[j]);
            if (!(size <= *scale)) *scale = size;
        }
    }
}

/* One step of the search; 0 where it is at its end. */
static int search(mech_task *k, progress *at)
{
    const int linear = k->stage == 2;
    mech_factors x;
    measure_rows(k);
    if (linear) at->unit = mech_max(at->unit, mech_worst_of(k, &k->here, NULL));
    mech_find_free(k);
    if (!mech_factor_rows(k, &x)) return 0;
    mech_onto(k, &x, k->step);
    along(k, &x, at, k->step);
    const mech_real mu = 1 + 2 * multipliers(k, &x, k->step), size = mech_largest(k->step, k->n_free);
    if (!mech_finite(size)) return 0;
    at->settled = at->left <= LEFT;
    if (size <= converged() * at->unit) return 0;
    mech_real factor = linear || size <= MECH_LONGEST ? 1 : MECH_LONGEST / size;
    const mech_real before = merit(k, &k->here, mu);
    for (int i = 0; i < HALVINGS; i++, factor /= 2) {
        mech_try_step(k, factor);
        const mech_real after = merit(k, &k->there, mu);
        /* close to rounding the merit function says nothing any more */
        if (!(after < before || (mech_finite(after) && factor * size < CLOSE * at->unit))) continue;
        mech_take(k);
        at->taken = factor * at->share;
        if (factor * size < settled() * at->unit && after >= before) return 0;
        at->settled = 0;
        return 1;
    }
    at->settled = 0;
    return 0;
}

int mech_nearest(mech_task *k, mech_real *worst, int *row, int *steps)
{
    progress at = {1, 1, 1, 0, 0};
    for (int i = 0; i < k->model->start->n_rows; i++) k->scale[i] = 0;
    for (int j = 0; j < k->model->nv; j++) k->d[j] = 0;
    mech_look(k, &k->here);
    int taken = 1;
    while (search(k, &at) && taken < STEPS) taken++;
    taken += mech_restore(k);
    k->settled = at.settled;
    if (k->stage == 1 && !at.settled && mech_worst_of(k, &k->here, NULL) <= MECH_FULFILLED) taken += mech_refine(k);
    *row = -1;
    *worst = mech_worst_of(k, &k->here, row);
    *steps += taken;
    return *worst <= MECH_FULFILLED * at.unit;
}
