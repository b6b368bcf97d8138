/* Minimise |D (x - guess)|^2 + |e|^2 subject to c(x) = 0, with weights D and wishes e. Each step solves the linear
 * problem by orthogonal factors with pivoting, so that rows that repeat others do no harm. Steps longer than half a
 * characteristic size are shortened, and steps that raise the merit function |...|^2/2 + mu |c| are halved. Close to the
 * end the part along the rows is stretched by what the step before has left of it (A. Aitken 1937): steps do not see the
 * curvature of the rows, by which the nearest point may be much nearer or farther. What no row moves takes no part, so
 * that it keeps every bit.
 *
 * J. Nocedal, S. Wright, Numerical Optimization, 2nd ed., Springer 2006, sections 10.3 and 15.4.
 */
#include "nearest.h"

#include <string.h>

#include "displacement.h"

enum { STEPS = 200, RESTORATION = 50, HALVINGS = 12 };

static const mech_real LONGEST = MECH_C(0.5);
static const mech_real CLOSE = MECH_C(1e-7), NEAR_BY = MECH_C(0.05);
static const mech_real RANK = MECH_C(1e-10);
/* Largest residual, as a share of a characteristic size, that counts as none. */
static const mech_real FULFILLED = MECH_C(1e-11);

/* What depends on the precision of the numbers: 1e-15, 1e-16 and 1e-12 in double precision. */
static mech_real converged(void) { return MECH_C(4.5) * MECH_EPSILON; }
static mech_real rounding(void) { return MECH_C(0.45) * MECH_EPSILON; }
static mech_real settled(void) { return 4500 * MECH_EPSILON; }

static size_t larger(int a, int b) { return (size_t)(a > b ? a : b); }

size_t mech_nearest_numbers(const mech_model *m)
{
    const size_t rows = (size_t)m->start->n_rows, nv = (size_t)m->nv, both = rows + nv;
    /* factors of the gradients, of their range, of the wishes; right-hand sides and solutions */
    return 2 * rows * nv + both * nv + 3 * larger((int)rows, (int)nv) + 6 * both;
}

size_t mech_nearest_integers(const mech_model *m) { return 2 * (size_t)m->start->n_rows + (size_t)m->nv; }

void mech_look(const mech_task *k, mech_point *point)
{
    const mech_model *m = k->model;
    m->start->assembly(k->t, point->y, k->u, k->z, k->p, point->values);
    m->start->assembly_jacobian(k->t, point->y, k->u, k->z, k->p, point->jacobian);
    if (k->stage == 1) mech_deviation(m, point->y, k->guess, point->deviation);
    else
        for (int j = 0; j < m->nv; j++) point->deviation[j] = point->y[m->nq + j] - k->guess[m->nq + j];
}

static void go(const mech_task *k, const mech_real *from, const mech_real *d, mech_real *y)
{
    const mech_model *m = k->model;
    memmove(y, from, (size_t)(m->nq + m->nv + m->nx) * sizeof(mech_real));
    if (k->stage == 1) mech_displace(m, y, d);
    else
        for (int j = 0; j < m->nv; j++) y[m->nq + j] += d[j];
}

static mech_real scale_of(const mech_task *k, int i) { return k->scale[i] > 0 ? k->scale[i] : 1; }

/* The largest residual of the hard rows, not-a-number where there is one. */
static mech_real worst_of(const mech_task *k, const mech_point *at, int *row)
{
    mech_real worst = 0;
    for (int a = 0; a < k->n_hard; a++) {
        const mech_real size = mech_abs(at->values[k->hard[a]]) / scale_of(k, k->hard[a]);
        if (size <= worst) continue;
        worst = size;
        if (row) *row = k->hard[a];
        if (size != size) break;
    }
    return worst;
}

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
        const mech_real x = at->values[k->hard[a]] / scale_of(k, k->hard[a]);
        residuals += x * x;
    }
    return squares / 2 + mu * mech_sqrt(residuals);
}

static const mech_real *gradient(const mech_task *k, int row)
{
    return k->here.jacobian + (size_t)row * (size_t)k->model->nv;
}

/* The entry of a gradient in scaled directions. */
static mech_real entry(const mech_task *k, int row, int f)
{
    const int j = k->free[f];
    return gradient(k, row)[j] / k->weights[j];
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

/* Leaves free what is away from its guess, and what rows connect with that or with a row that is off. */
static void find_free(mech_task *k)
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

/* Where the parts of `work` lie: factors of the gradients' transpose and of their range. */
typedef struct factors {
    mech_orthogonal across, range;
    mech_real *rest;
    int *order;
} factors;

/* Factorises the gradients of the hard rows, [n_free][n_hard] after scaling, and their range; 0 where something is not
   finite. */
static int factorise(const mech_task *k, factors *x)
{
    const int n = k->n_free, m = k->n_hard, most = n < m ? n : m;
    x->across = (mech_orthogonal){n, m, 0, k->work, k->work + (size_t)n * m, k->order};
    for (int a = 0; a < m; a++) {
        const mech_real scale = scale_of(k, k->hard[a]);
        if (!mech_finite(k->here.values[k->hard[a]])) return 0;
        for (int f = 0; f < n; f++) {
            const mech_real value = entry(k, k->hard[a], f) / scale;
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

/* step[n_free] = the shortest one in scaled directions that fulfils the linearised hard rows. */
static void onto(const mech_task *k, factors *x, mech_real *step)
{
    mech_real *c = x->rest;
    for (int a = 0; a < k->n_hard; a++) {
        const int row = k->hard[x->across.order[a]];
        c[a] = -k->here.values[row] / scale_of(k, row);
    }
    for (int f = 0; f < k->n_free; f++) step[f] = 0;
    mech_real *y = c + k->n_hard;
    mech_least_squares(&x->range, c, y);
    for (int i = 0; i < x->across.rank; i++) step[i] = y[i];
    mech_rotate(&x->across, 0, step);
}

static mech_real wish(const mech_task *k, int a, const mech_real *step)
{
    const int row = k->soft[a];
    mech_real sum = k->here.values[row];
    for (int f = 0; f < k->n_free; f++) sum += entry(k, row, f) * step[f];
    return k->shares[row] * sum;
}

/* `share` of the steps along the rows, `taken` of the last one. */
typedef struct progress {
    mech_real unit, share, taken;
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
static void along(const mech_task *k, factors *x, progress *at, mech_real *step)
{
    const int n = k->n_free, r = x->across.rank, left = n - r, rows = left + k->n_soft;
    mech_real *back = x->rest, *b = back + n, *found = b + rows, *a = found + left;
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
            for (int f = 0; f < n; f++) back[f] = k->shares[k->soft[s]] * entry(k, k->soft[s], f);
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
    at->share = k->stage == 1 ? share_of(k, at, back) : 1;
    for (int f = 0; f < n; f++) step[f] += at->share * back[f];
}

/* The length of the multipliers of the hard rows: of the pull of guesses and wishes against them. */
static mech_real multipliers(const mech_task *k, factors *x, const mech_real *step)
{
    const int n = k->n_free;
    mech_real *pull = x->rest, squares = 0;
    for (int f = 0; f < n; f++) pull[f] = k->weights[k->free[f]] * k->here.deviation[k->free[f]] + step[f];
    for (int s = 0; s < k->n_soft; s++) {
        const mech_real missing = k->shares[k->soft[s]] * wish(k, s, step);
        for (int f = 0; f < n; f++) pull[f] += missing * entry(k, k->soft[s], f);
    }
    mech_rotate(&x->across, 1, pull);
    mech_real *forward = pull + n; /* the triangle of the range, transposed */
    for (int i = 0; i < x->range.rank; i++) {
        mech_real sum = pull[x->range.order[i]];
        for (int j = 0; j < i; j++) sum -= x->range.a[(size_t)i * k->n_hard + j] * forward[j];
        forward[i] = sum / x->range.a[(size_t)i * k->n_hard + i];
        squares += forward[i] * forward[i];
    }
    return mech_sqrt(squares);
}

static mech_real largest(const mech_real *x, int n)
{
    mech_real size = 0;
    for (int i = 0; i < n; i++)
        if (!(mech_abs(x[i]) <= size)) size = mech_abs(x[i]);
    return size;
}

/* there = here moved by a factor of the step; looks around there. */
static void try_step(mech_task *k, mech_real factor)
{
    for (int j = 0; j < k->model->nv; j++) k->d[j] = 0;
    for (int f = 0; f < k->n_free; f++) k->d[k->free[f]] = factor * k->step[f] / k->weights[k->free[f]];
    go(k, k->here.y, k->d, k->there.y);
    mech_look(k, &k->there);
}

static void take(mech_task *k)
{
    const mech_point kept = k->here;
    k->here = k->there;
    k->there = kept;
}

static void measure_rows(mech_task *k)
{
    for (int a = 0; a < k->n_hard; a++) {
        mech_real *scale = &k->scale[k->hard[a]];
        for (int j = 0; j < k->model->nv; j++) {
            const mech_real size = mech_abs(gradient(k, k->hard[a])[j] / k->weights[j]);
            if (!(size <= *scale)) *scale = size;
        }
    }
}

/* Goes on by the shortest steps onto the rows alone, as far as rounding allows: the search for the nearest point may
   come to rest beside them. Returns the steps. */
static int restore(mech_task *k)
{
    factors x;
    for (int taken = 0; taken < RESTORATION; taken++) {
        const mech_real worst = worst_of(k, &k->here, NULL);
        if (!(worst > rounding())) return taken;
        find_free(k);
        if (!factorise(k, &x)) return taken;
        onto(k, &x, k->step);
        const mech_real size = largest(k->step, k->n_free);
        if (!mech_finite(size)) return taken;
        try_step(k, size > LONGEST ? LONGEST / size : 1);
        if (!(worst_of(k, &k->there, NULL) < (worst > FULFILLED ? worst : worst / 2))) return taken;
        take(k);
    }
    return RESTORATION;
}

/* One step of the search; 0 where it is at its end. */
static int search(mech_task *k, progress *at)
{
    const int linear = k->stage == 2;
    factors x;
    measure_rows(k);
    if (linear) at->unit = mech_max(at->unit, worst_of(k, &k->here, NULL));
    find_free(k);
    if (!factorise(k, &x)) return 0;
    onto(k, &x, k->step);
    along(k, &x, at, k->step);
    const mech_real mu = 1 + 2 * multipliers(k, &x, k->step), size = largest(k->step, k->n_free);
    if (!mech_finite(size) || size <= converged() * at->unit) return 0;
    mech_real factor = linear || size <= LONGEST ? 1 : LONGEST / size;
    const mech_real before = merit(k, &k->here, mu);
    for (int i = 0; i < HALVINGS; i++, factor /= 2) {
        try_step(k, factor);
        const mech_real after = merit(k, &k->there, mu);
        /* close to rounding the merit function says nothing any more */
        if (!(after < before || (mech_finite(after) && factor * size < CLOSE * at->unit))) continue;
        take(k);
        at->taken = factor * at->share;
        return !(factor * size < settled() * at->unit && after >= before);
    }
    return 0;
}

int mech_nearest(mech_task *k, mech_real *worst, int *row, int *steps)
{
    progress at = {1, 1, 1};
    for (int i = 0; i < k->model->start->n_rows; i++) k->scale[i] = 0;
    for (int j = 0; j < k->model->nv; j++) k->d[j] = 0;
    mech_look(k, &k->here);
    int taken = 1;
    while (search(k, &at) && taken < STEPS) taken++;
    taken += restore(k);
    *row = -1;
    *worst = worst_of(k, &k->here, row);
    *steps += taken;
    return *worst <= FULFILLED * at.unit;
}
