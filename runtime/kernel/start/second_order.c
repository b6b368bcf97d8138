/* Minimise |D (x - guess)|^2 + |e|^2 along c(x) = 0 from a point there, where rows bend so much that steps which see
 * their slopes alone go to and fro. The second derivatives of the Lagrange function along the rows are differences of
 * first ones; a share of the identity is added until they are positive, and each step is brought back onto the rows
 * before it is judged.
 *
 * Where slopes say nothing, as those of a kinetic energy at rest, the search ends beside rows that bend towards zero. It
 * leaves such a point along the direction in which the sum of their squares falls most.
 *
 * J. Nocedal, S. Wright, Numerical Optimization, 2nd ed., Springer 2006, sections 3.4 and 12.3.
 */
#include "second_order.h"

#include <stdlib.h>
#include <string.h>

enum { REFINEMENTS = 60, HALVINGS = 30, SHIFTS = 200, POWERS = 300 };

static const mech_real CLOSE = MECH_C(1e-7);
/* Second derivatives below it are not believed; along a line they are 1. */
static const mech_real FLATTEST = MECH_C(1e-3);
/* Of a direction that is hardly orthogonal to any other; of the largest curvature: a smaller one leads nowhere. */
static const mech_real SPREAD = MECH_C(0.6180339887498949), BENT = MECH_C(1e-6);

/* Where first derivatives are compared for second ones, in characteristic sizes: 1e-6 in double precision. */
static mech_real nudge(void) { return 64 * mech_sqrt(MECH_EPSILON); }
static mech_real arrived(void) { return 45 * MECH_EPSILON; }

typedef struct room {
    mech_real *kept, *d, *pull, *beside, *multipliers, *slope, *curvature, *factor;
} room;

static void *make_room(const mech_task *k, room *at)
{
    const mech_model *m = k->model;
    const size_t ny = (size_t)(m->nq + m->nv + m->nx), nv = (size_t)m->nv, rows = (size_t)m->start->n_rows;
    mech_real *next = calloc(ny + 4 * nv + rows + 2 * nv * nv + 1, sizeof *next);
    if (!next) return NULL;
    at->kept = next;
    at->d = at->kept + ny;
    at->pull = at->d + nv;
    at->beside = at->pull + nv;
    at->slope = at->beside + nv;
    at->multipliers = at->slope + nv;
    at->curvature = at->multipliers + rows;
    at->factor = at->curvature + nv * nv;
    return next;
}

static mech_real half_squares(const mech_task *k)
{
    mech_real squares = 0;
    for (int f = 0; f < k->n_loose; f++) {
        const mech_real x = k->weights[k->loose[f]] * k->here.deviation[k->loose[f]];
        squares += x * x;
    }
    for (int a = 0; a < k->n_soft; a++) {
        const mech_real x = k->shares[k->soft[a]] * k->here.values[k->soft[a]];
        squares += x * x;
    }
    return squares / 2;
}

/* pull[n_free] = the gradient of the Lagrange function at a point, in scaled directions. */
static void lagrange(const mech_task *k, const mech_point *at, const mech_real *multipliers, mech_real *pull)
{
    for (int f = 0; f < k->n_free; f++) {
        const int j = k->free[f];
        pull[f] = k->weights[j] * at->deviation[j];
        for (int a = 0; a < k->n_soft; a++) {
            const mech_real share = k->shares[k->soft[a]];
            pull[f] += share * share * at->values[k->soft[a]] * mech_entry(k, at, k->soft[a], f);
        }
        for (int a = 0; a < k->n_hard; a++)
            pull[f] -= multipliers[a] * mech_entry(k, at, k->hard[a], f) / mech_scale_of(k, k->hard[a]);
    }
}

/* The multipliers [n_hard] that leave the least pull. */
static void multiply(const mech_task *k, const mech_factors *x, room *at)
{
    for (int a = 0; a < k->n_hard; a++) at->multipliers[a] = 0;
    lagrange(k, &k->here, at->multipliers, at->pull);
    mech_rotate(&x->across, 1, at->pull);
    mech_real *back = x->rest;
    for (int a = 0; a < k->n_hard; a++) back[a] = 0;
    mech_multiply_back(x, k->n_hard, at->pull, back);
    mech_rotate(&x->range, 0, back);
    for (int a = 0; a < k->n_hard; a++) at->multipliers[x->across.order[a]] = back[a];
}

/* Fills slope[left] and curvature[left][left] along the rows. */
static void measure(mech_task *k, const mech_factors *x, room *at)
{
    const int n = k->n_free, r = x->across.rank, left = n - r;
    lagrange(k, &k->here, at->multipliers, at->pull);
    for (int i = 0; i < left; i++) {
        for (int f = 0; f < n; f++) k->step[f] = f == r + i;
        mech_rotate(&x->across, 0, k->step);
        mech_try_step(k, nudge());
        lagrange(k, &k->there, at->multipliers, at->beside);
        for (int f = 0; f < n; f++) at->beside[f] = (at->beside[f] - at->pull[f]) / nudge();
        mech_rotate(&x->across, 1, at->beside);
        memcpy(at->curvature + (size_t)i * left, at->beside + r, (size_t)left * sizeof(mech_real));
    }
    mech_rotate(&x->across, 1, at->pull);
    memcpy(at->slope, at->pull + r, (size_t)left * sizeof(mech_real));
}

/* Cholesky factors of the symmetric part and a share of the identity; 0 where that is not positive. */
static int decompose(const mech_real *curvature, mech_real shift, int n, mech_real *factor)
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++) {
            mech_real sum = (curvature[(size_t)i * n + j] + curvature[(size_t)j * n + i]) / 2 + (i == j ? shift : 0);
            for (int l = 0; l < j; l++) sum -= factor[(size_t)i * n + l] * factor[(size_t)j * n + l];
            if (i == j && !(sum > FLATTEST / 1000)) return 0;
            factor[(size_t)i * n + j] = i == j ? mech_sqrt(sum) : sum / factor[(size_t)j * n + j];
        }
    return 1;
}

/* slope becomes the step along the rows that ends where it vanishes, or downwards; 0 where it is not finite. */
static int solve(room *at, int n)
{
    mech_real least = FLATTEST;
    for (int i = 0; i < n; i++) {
        if (!mech_finite(at->slope[i])) return 0;
        for (int j = 0; j < n; j++)
            if (!mech_finite(at->curvature[(size_t)i * n + j])) return 0;
        least = mech_min(least, at->curvature[(size_t)i * n + i]);
    }
    mech_real shift = FLATTEST - least;
    int positive = 0;
    for (int i = 0; i < SHIFTS && !positive; i++) {
        positive = decompose(at->curvature, shift, n, at->factor);
        if (!positive) shift = mech_max(2 * shift, FLATTEST);
    }
    if (!positive) return 0; /* beyond all sizes */
    const mech_real *l = at->factor;
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < i; j++) at->slope[i] -= l[(size_t)i * n + j] * at->slope[j];
        at->slope[i] /= l[(size_t)i * n + i];
    }
    for (int i = n; i-- > 0;) {
        for (int j = i + 1; j < n; j++) at->slope[i] -= l[(size_t)j * n + i] * at->slope[j];
        at->slope[i] /= l[(size_t)i * n + i];
    }
    return 1;
}

/* d[nv] = the step; returns its size in characteristic sizes, negative where none is known. */
static mech_real newton_step(mech_task *k, room *at)
{
    mech_factors x;
    mech_find_free(k);
    if (!mech_factor_rows(k, &x)) return -1;
    const int r = x.across.rank, left = k->n_free - r;
    if (!left) return 0;
    multiply(k, &x, at);
    measure(k, &x, at);
    if (!solve(at, left)) return -1;
    for (int f = 0; f < k->n_free; f++) k->step[f] = f < r ? 0 : -at->slope[f - r];
    mech_rotate(&x.across, 0, k->step);
    for (int j = 0; j < k->model->nv; j++) at->d[j] = 0;
    for (int f = 0; f < k->n_free; f++) at->d[k->free[f]] = k->step[f] / k->weights[k->free[f]];
    return mech_largest(k->step, k->n_free);
}

/* here = what was kept, moved by a factor of the step and brought onto the rows; whether it is on them. */
static int go_along(mech_task *k, room *at, mech_real factor)
{
    for (int j = 0; j < k->model->nv; j++) k->d[j] = factor * at->d[j];
    mech_go(k, at->kept, k->d, k->here.y);
    mech_look(k, &k->here);
    mech_restore(k);
    return mech_worst_of(k, &k->here, NULL) <= MECH_FULFILLED;
}

int mech_refine(mech_task *k)
{
    const size_t bytes = (size_t)(k->model->nq + k->model->nv + k->model->nx) * sizeof(mech_real);
    room at;
    void *block = make_room(k, &at);
    int taken = 0, going = block != NULL;
    k->settled = 0;
    mech_real last = 1;
    while (going && taken++ < REFINEMENTS) {
        mech_real size = newton_step(k, &at);
        if (!mech_finite(size) || size <= arrived()) {
            k->settled = size >= 0;
            break;
        }
        memcpy(at.kept, k->here.y, bytes);
        const mech_real before = half_squares(k);
        mech_real factor = size > MECH_LONGEST ? MECH_LONGEST / size : 1;
        int nearer = 0;
        for (int i = 0; i < HALVINGS && !nearer; i++) {
            nearer = go_along(k, &at, factor) && (half_squares(k) < before || factor * size < CLOSE);
            if (!nearer) factor /= 2;
        }
        k->settled = nearer && size < CLOSE;
        size *= factor;
        going = nearer && (size >= CLOSE || size < last / 2); /* else of rounding */
        if (!going) {
            memcpy(k->here.y, at.kept, bytes);
            mech_look(k, &k->here);
        }
        last = size;
    }
    free(block);
    return taken;
}

/* x[n_free] without what the rows see of it. */
static void let_along(const mech_factors *x, mech_real *way)
{
    mech_rotate(&x->across, 1, way);
    for (int i = 0; i < x->across.rank; i++) way[i] = 0;
    mech_rotate(&x->across, 0, way);
}

static mech_real length_of(const mech_real *x, int n)
{
    mech_real squares = 0;
    for (int i = 0; i < n; i++) squares += x[i] * x[i];
    return mech_sqrt(squares);
}

/* multipliers[n_hard] = what no slope brings nearer to zero; returns its square. */
static mech_real stubborn(const mech_task *k, const mech_factors *x, room *at)
{
    mech_real *c = x->rest;
    for (int a = 0; a < k->n_hard; a++) {
        const int row = k->hard[x->across.order[a]];
        c[a] = k->here.values[row] / mech_scale_of(k, row);
    }
    mech_rotate(&x->range, 1, c);
    for (int i = 0; i < x->range.rank; i++) c[i] = 0;
    mech_rotate(&x->range, 0, c);
    mech_real squares = 0;
    for (int a = 0; a < k->n_hard; a++) {
        at->multipliers[x->across.order[a]] = c[a];
        squares += c[a] * c[a];
    }
    return squares;
}

/* curvature[n_free][n_free] of half the squares of what is stubborn. */
static void bend(mech_task *k, room *at)
{
    const int n = k->n_free;
    for (int i = 0; i < n; i++) {
        for (int f = 0; f < n; f++) k->step[f] = f == i;
        mech_try_step(k, nudge());
        for (int f = 0; f < n; f++) {
            mech_real sum = 0;
            for (int a = 0; a < k->n_hard; a++)
                sum += at->multipliers[a] * (mech_entry(k, &k->there, k->hard[a], f) - mech_entry(k, &k->here, k->hard[a], f)) /
                       mech_scale_of(k, k->hard[a]);
            at->factor[(size_t)i * n + f] = sum / nudge();
        }
    }
    for (int i = 0; i < n; i++)
        for (int f = 0; f < n; f++)
            at->curvature[(size_t)i * n + f] = (at->factor[(size_t)i * n + f] + at->factor[(size_t)f * n + i]) / 2;
}

/* way[n_free] turns into the direction of least curvature; returns how much falls along it, and nothing where that is little. */
static mech_real turn_down(const mech_task *k, const mech_factors *x, room *at, mech_real *way, mech_real *bent)
{
    const int n = k->n_free;
    for (int i = 0; i < n; i++) let_along(x, at->curvature + (size_t)i * n);
    for (int f = 0; f < n; f++) { /* the columns, too */
        for (int i = 0; i < n; i++) bent[i] = at->curvature[(size_t)i * n + f];
        let_along(x, bent);
        for (int i = 0; i < n; i++) at->curvature[(size_t)i * n + f] = bent[i];
    }
    const mech_real size = length_of(at->curvature, n * n);
    if (!mech_finite(size) || !(size > 0)) return 0;
    for (int f = 0; f < n; f++) way[f] = 1 / (1 + SPREAD * (mech_real)f);
    let_along(x, way);
    mech_real fall = 0;
    for (int turn = 0; turn <= POWERS; turn++) {
        const mech_real length = length_of(way, n);
        if (!(length > 0)) return 0;
        for (int f = 0; f < n; f++) way[f] /= length;
        fall = 0;
        for (int i = 0; i < n; i++) {
            bent[i] = 0;
            for (int f = 0; f < n; f++) bent[i] += at->curvature[(size_t)i * n + f] * way[f];
            fall -= way[i] * bent[i];
        }
        if (turn == POWERS) break;
        for (int f = 0; f < n; f++) way[f] = size * way[f] - bent[f];
        let_along(x, way);
    }
    return fall > BENT * size ? fall : 0;
}

int mech_leave(mech_task *k)
{
    room at;
    mech_factors x;
    void *block = make_room(k, &at);
    mech_real fall = 0, squares = 0;
    k->n_free = k->n_loose;
    memcpy(k->free, k->loose, (size_t)k->n_loose * sizeof(int));
    if (block && k->n_free && mech_factor_rows(k, &x)) {
        squares = stubborn(k, &x, &at);
        bend(k, &at);
        fall = turn_down(k, &x, &at, at.pull, at.beside);
    }
    if (fall > 0) {
        memcpy(k->step, at.pull, (size_t)k->n_free * sizeof(mech_real));
        mech_try_step(k, mech_sqrt(2 * squares / fall));
        mech_take(k);
    }
    free(block);
    return fall > 0;
}
