/* Statically indeterminate contact forces, as under a table on four legs: of all forces that give the same motion, without tension
 * in a contact and within the cones of friction, those with the least sum of squares. This is the limit of stiff springs of equal
 * stiffness.
 *
 * The modes hold some rows; redundant ones rest (z[rest]) without force. The columns of B are the changes of velocity by unit forces
 * along rows (of a sliding contact together with its friction). With B_held C = B_resting, all x with A x = f, A = [1 C], give
 * the same motion as the forces f of the held rows. The least of them in the cones is P(A^T nu), with P the projection onto the
 * cones (J.-J. Moreau 1962) and A P(A^T nu) = f. This nu minimises a convex function, and Newton's method finds it (L. Qi,
 * J. Sun 1993), in one step where no cone is active.
 *
 * Rows with different units, such as torques and forces, are weighted by their own mobility. Generated
 * code and the kernel of pages include this file.
 */
#ifndef MECH_SHARES_H
#define MECH_SHARES_H

#include <stdlib.h>
#include <string.h>

#include "real.h"

/* Part of what a row does to velocities that the rows which hold cannot do: more, and it is not a share of their load. */
#define MECH_SHARES_APART MECH_C(1e-7)
/* What is left of A P(A^T nu) = f, beside f, where Newton's method is done; what may be left where it gets no further, as beside
 * cones that leave a load one share only. */
#define MECH_SHARES_LEFT MECH_C(1e-11)
#define MECH_SHARES_ROUGH MECH_C(1e-8)

enum { MECH_SHARES_STEPS = 100, MECH_SHARES_HALVES = 40 };

/* The rows that share: `held` of n hold, the others rest. */
typedef struct mech_shares {
    const mech_model *m;
    const mech_real *values; /* [n_rows][MECH_ROW_VALUES]                                       */
    const mech_real *z;
    int n, held;
    int *row;                /* [n] of the model                                                */
    int *place;              /* [n_rows] in `row`, or -1                                        */
    mech_real *own;          /* [n] what a unit force along a row does to its rate              */
    mech_real *weight;       /* [n] root of the weight of its square                            */
    mech_real *b;            /* [n][nv] columns of B                                            */
    mech_real *r;            /* [n][n] columns of R in B_held = Q R                             */
    mech_real *a;            /* [held][n] A, over the weights                                   */
    mech_real *h;            /* [held][held] the second derivative                              */
    mech_real *va;           /* [n][held] V A^T, with V the derivative of P                     */
    mech_real *f, *nu, *d, *left; /* [held]                                                     */
    mech_real *g, *x;        /* [n] A^T nu, P(A^T nu)                                           */
} mech_shares;

static inline mech_real mech_shares_value(const mech_shares *s, int row, int which)
{
    return s->values[row * MECH_ROW_VALUES + which];
}

static inline mech_real mech_shares_dot(int n, const mech_real *a, const mech_real *b)
{
    mech_real sum = 0;
    for (int i = 0; i < n; i++) sum += a[i] * b[i];
    return sum;
}

static inline int mech_shares_in_contact(const mech_shares *s, int row, int contact)
{
    const mech_row *of = s->m->hybrid->rows + row;
    return of->kind == MECH_FRICTION && of->normal == contact;
}

/* What a contact that slides brings along each row of its friction, for a force of one: 0 where that sticks. */
static inline mech_real mech_shares_slide(const mech_shares *s, int friction)
{
    const mech_hybrid *h = s->m->hybrid;
    const int contact = h->rows[friction].normal;
    const mech_real force = mech_shares_value(s, contact, MECH_FORCE);
    const int rest = h->shares[friction].rest;
    if (s->place[friction] >= 0 || (rest >= 0 && s->z[rest] > MECH_C(0.5))) return 0;
    if (force != 0) return mech_shares_value(s, friction, MECH_FORCE) / force;
    mech_real speed = 0;
    for (int k = 0; k < h->n_rows; k++) {
        const mech_real rate = mech_shares_in_contact(s, k, contact) ? mech_shares_value(s, k, MECH_RATE) : 0;
        speed += rate * rate;
    }
    const mech_real rate = mech_shares_value(s, friction, MECH_RATE);
    return speed > 0 ? -mech_shares_value(s, friction, MECH_EXTRA) * rate / mech_sqrt(speed) : 0;
}

/* The columns of B, and weights: one, or where units differ the mean of what rows of one unit move themselves by. `z`: to be written
 * to; `out` [nv + n_rows]. */
static inline void mech_shares_respond(mech_shares *s, mech_real t, const mech_real *y, const mech_real *u, mech_real *z,
                                       const mech_real *p, mech_real *out)
{
    const mech_hybrid *h = s->m->hybrid;
    const int nv = s->m->nv;
    int sorts = 0;
    memset(s->b, 0, (size_t)s->n * (size_t)nv * sizeof(mech_real));
    for (int i = 0; i < h->n_rows; i++) {
        const int contact = h->rows[i].kind == MECH_FRICTION ? h->rows[i].normal : -1;
        const int k = s->place[i] >= 0 || contact < 0 ? s->place[i] : s->place[contact];
        const mech_real part = s->place[i] >= 0 ? 1 : k < 0 ? 0 : mech_shares_slide(s, i);
        if (part == 0) continue;
        z[h->rows[i].impulse] = 1;
        h->respond(t, y, u, z, p, out);
        z[h->rows[i].impulse] = 0;
        if (s->place[i] >= 0) s->own[k] = out[nv + i];
        for (int v = 0; v < nv; v++) s->b[k * nv + v] += part * out[v];
    }
    for (int k = 0; k < s->n; k++) sorts |= h->shares[s->row[k]].sort != h->shares[s->row[0]].sort;
    for (int k = 0; k < s->n; k++) {
        mech_real sum = 0;
        int count = 0;
        for (int j = 0; j < s->n; j++) {
            if (h->shares[s->row[j]].sort != h->shares[s->row[k]].sort) continue;
            sum += s->own[j];
            count++;
        }
        s->weight[k] = sorts ? mech_sqrt(sum / count) : 1;
    }
}

/* Q R of the rows that hold, by Gram and Schmidt, twice; C of those that rest, of which those leave that others cannot stand for.
 * Gives whether any is left. */
static inline int mech_shares_depend(mech_shares *s)
{
    const int nv = s->m->nv, n = s->n, held = s->held;
    int kept = held;
    for (int v = 0; v < nv; v++) { /* velocities have several units */
        mech_real most = 0;
        for (int k = 0; k < n; k++) most = mech_max(most, mech_abs(s->b[k * nv + v]));
        for (int k = 0; k < n && most > 0; k++) s->b[k * nv + v] /= most;
    }
    for (int k = 0; k < n; k++) {
        mech_real *b = s->b + k * nv, *r = s->r + k * n;
        const mech_real size = mech_sqrt(mech_shares_dot(nv, b, b));
        memset(r, 0, (size_t)n * sizeof(mech_real));
        for (int pass = 0; pass < 2; pass++)
            for (int j = 0; j < held && j < k; j++) {
                const mech_real *q = s->b + j * nv, part = mech_shares_dot(nv, q, b);
                for (int v = 0; v < nv; v++) b[v] -= part * q[v];
                r[j] += part;
            }
        const mech_real left = mech_sqrt(mech_shares_dot(nv, b, b));
        if (k < held) {
            if (!(left > MECH_SHARES_APART * size)) return 0;
            r[k] = left;
            for (int v = 0; v < nv; v++) b[v] /= left;
            continue;
        }
        if (!(size > 0 && left <= MECH_SHARES_APART * size)) {
            s->place[s->row[k]] = -1;
            continue;
        }
        for (int i = held - 1; i >= 0; i--) {
            mech_real sum = r[i];
            for (int j = i + 1; j < held; j++) sum -= s->r[j * n + i] * s->a[j * n + kept];
            s->a[i * n + kept] = sum / s->r[i * n + i];
        }
        s->row[kept] = s->row[k];
        s->weight[kept] = s->weight[k];
        s->place[s->row[kept]] = kept;
        kept++;
    }
    for (int i = 0; i < held; i++)
        for (int k = 0; k < kept; k++)
            s->a[i * n + k] = (k < held ? k == i : s->a[i * n + k]) / s->weight[k];
    s->n = kept;
    return kept > held;
}

/* x = P(g); where asked for, V A^T. */
static inline void mech_shares_project(mech_shares *s, int width, int derive)
{
    const mech_hybrid *h = s->m->hybrid;
    const int held = s->held;
    for (int k = 0; k < s->n; k++) {
        const int row = s->row[k], kind = h->rows[row].kind;
        int slip[2] = {-1, -1}, slips = 0;
        const int contact = kind == MECH_FRICTION ? h->rows[row].normal : -1;
        if (contact >= 0 && s->place[contact] >= 0) continue; /* with its contact */
        for (int j = 0; kind == MECH_CONTACT && j < s->n; j++)
            if (mech_shares_in_contact(s, s->row[j], row)) slip[slips++] = j;
        mech_real *va = s->va + k * held, g = s->g[k], tangential = 0;
        for (int i = 0; derive && i < held; i++) va[i] = s->a[i * width + k];
        s->x[k] = g;
        if (kind == MECH_FRICTION) {
            const mech_real most = contact < 0 ? mech_shares_value(s, row, MECH_LIMIT) /* else the contact shares nothing */
                                               : mech_shares_value(s, row, MECH_COEFFICIENT) *
                                                     mech_shares_value(s, contact, MECH_FORCE);
            const mech_real limit = s->weight[k] * mech_max(0, most);
            if (mech_abs(g) <= limit) continue;
            s->x[k] = g > 0 ? limit : -limit;
            for (int i = 0; derive && i < held; i++) va[i] = 0;
            continue;
        }
        for (int c = 0; c < slips; c++) {
            s->x[slip[c]] = s->g[slip[c]];
            tangential += s->g[slip[c]] * s->g[slip[c]];
            for (int i = 0; derive && i < held; i++) s->va[slip[c] * held + i] = s->a[i * width + slip[c]];
        }
        if (kind != MECH_CONTACT) continue;
        tangential = mech_sqrt(tangential);
        const mech_real mu = slips ? mech_shares_value(s, s->row[slip[0]], MECH_COEFFICIENT) * s->weight[slip[0]] / s->weight[k] : 0;
        if (g >= 0 && tangential <= mu * g) continue;
        const mech_real size = (g + mu * tangential) / (1 + mu * mu);
        s->x[k] = mech_max(0, size);
        for (int i = 0; derive && i < held; i++) {
            mech_real along = 0;
            for (int c = 0; c < slips && tangential > 0; c++) along += s->a[i * width + slip[c]] * s->g[slip[c]] / tangential;
            const mech_real part = size > 0 ? (va[i] + mu * along) / (1 + mu * mu) : 0;
            va[i] = part;
            for (int c = 0; c < slips; c++) {
                mech_real *vt = s->va + slip[c] * held + i;
                const mech_real t = tangential > 0 ? s->g[slip[c]] / tangential : 0;
                *vt = size > 0 && tangential > 0 ? mu * (part * t + size / tangential * (*vt - along * t)) : 0;
            }
        }
        for (int c = 0; c < slips; c++) s->x[slip[c]] = tangential > 0 ? mu * s->x[k] * s->g[slip[c]] / tangential : 0;
    }
}

/* A P(A^T nu) - f, and the function whose slope that is. */
static inline mech_real mech_shares_slope(mech_shares *s, int width, const mech_real *nu, int derive)
{
    const int n = s->n, held = s->held;
    for (int k = 0; k < n; k++) {
        s->g[k] = 0;
        for (int i = 0; i < held; i++) s->g[k] += s->a[i * width + k] * nu[i];
    }
    mech_shares_project(s, width, derive);
    for (int i = 0; i < held; i++) s->left[i] = mech_shares_dot(n, s->a + i * width, s->x) - s->f[i];
    return mech_shares_dot(n, s->x, s->g) - mech_shares_dot(n, s->x, s->x) / 2 - mech_shares_dot(held, s->f, nu);
}

/* d = -h^-1 left, by Cholesky's factors; h becomes them. */
static inline void mech_shares_step(mech_shares *s)
{
    const int n = s->held;
    mech_real *h = s->h, *d = s->d;
    for (int i = 0; i < n; i++) {
        d[i] = -s->left[i];
        for (int j = 0; j <= i; j++) {
            mech_real sum = h[i * n + j];
            for (int k = 0; k < j; k++) sum -= h[i * n + k] * h[j * n + k];
            h[i * n + j] = i == j ? mech_sqrt(sum) : sum / h[j * n + j];
        }
        for (int k = 0; k < i; k++) d[i] -= h[i * n + k] * d[k];
        d[i] /= h[i * n + i];
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int k = i + 1; k < n; k++) d[i] -= h[k * n + i] * d[k];
        d[i] /= h[i * n + i];
    }
}

/* x of the least sum of squares, times its weights; 0 where it is not found. */
static inline int mech_shares_least(mech_shares *s, int width)
{
    const int n = s->n, held = s->held;
    mech_real size = 0, trace = 0;
    for (int i = 0; i < held; i++) {
        s->nu[i] = 0;
        s->left[i] = -s->f[i];
        size = mech_max(size, mech_abs(s->f[i]));
    }
    for (int k = 0; k < n; k++) /* without cones V = 1 */
        for (int i = 0; i < held; i++) s->va[k * held + i] = s->a[i * width + k];
    mech_real before = 0, last = (mech_real)INFINITY;
    for (int step = 0; step < MECH_SHARES_STEPS; step++) {
        mech_real most = 0;
        for (int i = 0; i < held; i++) most = mech_max(most, mech_abs(s->left[i]));
        if (step && most <= MECH_SHARES_LEFT * size) return 1;
        last = most;
        for (int i = 0; i < held; i++)
            for (int j = 0; j <= i; j++) {
                mech_real sum = 0;
                for (int k = 0; k < n; k++) sum += s->a[i * width + k] * s->va[k * held + j];
                s->h[i * held + j] = sum;
                if (!step && i == j) trace = mech_max(trace, sum);
            }
        for (int i = 0; step && i < held; i++)
            s->h[i * held + i] += trace * (MECH_C(1e-12) + MECH_C(1e-3) * mech_min(1, most / size));
        mech_shares_step(s);
        const mech_real slope = mech_shares_dot(held, s->left, s->d);
        mech_real part = 1, value = 0;
        int halves = 0;
        for (;; halves++, part /= 2) {
            for (int i = 0; i < held; i++) s->h[i] = s->nu[i] + part * s->d[i]; /* the factors are used up */
            value = mech_shares_slope(s, width, s->h, 1);
            if (!step || value <= before + MECH_C(1e-4) * part * slope + MECH_C(1e-13) * mech_abs(before)) break;
            if (halves == MECH_SHARES_HALVES) break;
        }
        memcpy(s->nu, s->h, (size_t)held * sizeof(mech_real));
        if (halves == MECH_SHARES_HALVES) break;
        before = value;
    }
    return last <= MECH_SHARES_ROUGH * size;
}

/* Lists the rows that share. */
static inline void mech_shares_list(mech_shares *s)
{
    const mech_hybrid *h = s->m->hybrid;
    s->n = 0;
    for (int i = 0; i < h->n_rows; i++) s->place[i] = -1;
    for (int rests = 0; rests < 2; rests++) {
        for (int i = 0; i < h->n_rows; i++) {
            const int flag = rests ? h->shares[i].rest : h->rows[i].flag;
            if (h->shares[i].share < 0 || s->place[i] >= 0 || !(s->z[flag] > MECH_C(0.5))) continue;
            s->place[i] = s->n;
            s->row[s->n++] = i;
        }
        if (!rests) s->held = s->n;
    }
}

/* A copy of z with what rows carry beside their forces in the present modes, in memory that its owner frees: NULL where there is none. */
static inline mech_real *mech_shares_found(const mech_model *m, mech_real t, const mech_real *y, const mech_real *u,
                                           const mech_real *z, const mech_real *p)
{
    const mech_hybrid *h = m->hybrid;
    const size_t n = (size_t)h->n_rows, nv = (size_t)m->nv, nz = (size_t)m->nz;
    const size_t numbers = nz + n * MECH_ROW_VALUES + nv + n + n * (nv + 4 * n + 8);
    mech_real *copy = (mech_real *)calloc(1, numbers * sizeof(mech_real) + 2 * n * sizeof(int));
    if (!copy) return NULL;
    mech_real *values = copy + nz, *out = values + n * MECH_ROW_VALUES;
    mech_shares s = {.m = m, .values = values, .z = z};
    s.b = out + nv + n;
    s.r = s.b + n * nv;
    s.a = s.r + n * n;
    s.h = s.a + n * n;
    s.va = s.h + n * n;
    s.own = s.va + n * n;
    s.weight = s.own + n;
    s.f = s.weight + n;
    s.nu = s.f + n;
    s.d = s.nu + n;
    s.left = s.d + n;
    s.g = s.left + n;
    s.x = s.g + n;
    s.row = (int *)(copy + numbers);
    s.place = s.row + n;
    memcpy(copy, z, nz * sizeof(mech_real));
    for (size_t i = 0; i < n; i++)
        if (h->shares[i].share >= 0) copy[h->shares[i].share] = 0;
    h->row_values(t, y, u, z, p, values);
    mech_shares_list(&s);
    const int width = s.n;
    mech_shares_respond(&s, t, y, u, copy, p, out);
    for (int k = 0; k < s.held; k++) s.f[k] = mech_shares_value(&s, s.row[k], MECH_FORCE);
    if (!mech_shares_depend(&s)) return copy;
    const int least = mech_shares_least(&s, width);
    for (int i = 0; i < h->n_rows; i++) {
        const int contact = h->rows[i].kind == MECH_FRICTION ? h->rows[i].normal : -1;
        const int k = s.place[i], at = k < 0 && contact >= 0 ? s.place[contact] : k;
        if (h->shares[i].share < 0 || at < 0) continue;
        const mech_real x = s.x[at] / s.weight[at] * (k < 0 ? mech_shares_slide(&s, i) : 1);
        /* where it is not found the load is that of the motion, which fulfils all laws as well */
        if (least) copy[h->shares[i].share] = x - mech_shares_value(&s, i, MECH_FORCE);
    }
    return copy;
}

/* Calls a function of the model that reads shares. */
static inline void mech_shares_call(const mech_model *m, mech_function *reads, int n_out, mech_real t, const mech_real *y,
                                    const mech_real *u, const mech_real *z, const mech_real *p, mech_real *out)
{
    const mech_hybrid *h = m->hybrid;
    int rests = 0;
    for (int i = 0; i < h->n_rows && !rests; i++) rests = h->shares[i].rest >= 0 && z[h->shares[i].rest] > MECH_C(0.5);
    if (!rests) {
        reads(t, y, u, z, p, out);
        return;
    }
    mech_real *copy = mech_shares_found(m, t, y, u, z, p);
    if (copy) reads(t, y, u, copy, p, out);
    for (int i = 0; !copy && i < n_out; i++) out[i] = (mech_real)NAN;
    free(copy);
}

#endif
