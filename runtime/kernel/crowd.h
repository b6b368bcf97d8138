/* Crowds: contacts so many that their forces are found by numbers (model.h), over those that are closed.
 *
 * With accelerations a0 without them, a = a0 + sum_j R_j f_j, where R_j = M^-1 (directions of force j)^T. A contact
 * that presses, and a friction that sticks, has K a + gamma = 0; a friction that slides adds -sign mu f along its slip to
 * the force f of its contact. Contacts that have no velocities in common, by way of others, are solved apart. Both
 * generated code and the kernel include this file.
 */
#ifndef MECH_CROWD_H
#define MECH_CROWD_H

#include <stdlib.h>
#include <string.h>

#include "real.h"

/* How a contact stands, as z lists it; a friction that slides, along or against its slip. */
enum { MECH_CROWD_OPEN, MECH_CROWD_CLOSED, MECH_CROWD_STICKS, MECH_CROWD_FORWARD, MECH_CROWD_BACKWARD };

/* What functions of a model are called with. */
typedef struct mech_crowd_at {
    const mech_model *m;
    mech_real t;
    const mech_real *y, *u, *z, *p;
    mech_real *g; /* [nu + nv + ...] inputs, then what is given */
} mech_crowd_at;

static inline const mech_crowd_kind *mech_crowd_kind_of(const mech_crowd *c, int contact)
{
    return &c->kinds[c->kind[contact]];
}

/* Places of the values of a contact of kind k. */
static inline int mech_crowd_slip(const mech_crowd_kind *k) { return 5 + 2 * k->n_normal; }
static inline const int *mech_crowd_velocities(const mech_crowd *c, int contact)
{
    return c->table + c->at[contact] + mech_crowd_kind_of(c, contact)->n_leaves;
}

/* The values of one contact. */
static inline void mech_crowd_values(const mech_crowd_at *at, int contact, mech_real *out)
{
    const mech_model *m = at->m;
    const mech_crowd *c = m->hybrid->crowd;
    const mech_crowd_kind *k = mech_crowd_kind_of(c, contact);
    const int *leaf = c->table + c->at[contact], ny = m->nq + m->nv + m->nx, behind = ny + m->np;
    for (int i = 0; i < k->n_leaves; i++) {
        const int place = leaf[i];
        at->g[m->nu + i] = place < ny ? at->y[place] : place < behind ? at->p[place - ny] : at->z[place - behind];
    }
    k->values(at->t, at->y, at->g, at->z, at->p, out);
}

/* What an impulse of the given size along the gap, or the slip, adds to the impulses along v. */
static inline void mech_crowd_add(const mech_crowd *c, int contact, int slip, const mech_real *values, mech_real size,
                                  mech_real *along)
{
    const mech_crowd_kind *k = mech_crowd_kind_of(c, contact);
    const int *v = mech_crowd_velocities(c, contact) + (slip ? k->n_normal : 0);
    const mech_real *entries = values + (slip ? mech_crowd_slip(k) + 4 : 5);
    for (int i = 0; i < (slip ? k->n_slip : k->n_normal); i++) along[v[i]] += size * entries[i];
}

/* K x of a gap, or a slip, for x[nv]. */
static inline mech_real mech_crowd_along(const mech_crowd *c, int contact, int slip, const mech_real *values,
                                         const mech_real *x)
{
    const mech_crowd_kind *k = mech_crowd_kind_of(c, contact);
    const int *v = mech_crowd_velocities(c, contact) + (slip ? k->n_normal : 0);
    const mech_real *entries = values + (slip ? mech_crowd_slip(k) + 4 : 5);
    mech_real sum = 0;
    for (int i = 0; i < (slip ? k->n_slip : k->n_normal); i++) sum += entries[i] * x[v[i]];
    return sum;
}

static inline int mech_crowd_root(int *parent, int i)
{
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
}

/* x of a[n][n + 1], by rows and the largest of each column; what is left below rounding is dependent and gets 0. */
static inline void mech_crowd_eliminate(int n, mech_real *a, mech_real *x, int *pivot)
{
    const int width = n + 1;
    mech_real largest = 0;
    int rank = 0;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) largest = mech_max(largest, mech_abs(a[i * width + j]));
    for (int j = 0; j < n; j++) {
        int best = rank;
        for (int i = rank + 1; i < n; i++)
            if (mech_abs(a[i * width + j]) > mech_abs(a[best * width + j])) best = i;
        pivot[j] = -1;
        if (rank == n || !(mech_abs(a[best * width + j]) > MECH_C(1e-11) * largest)) continue;
        if (best != rank)
            for (int k = j; k < width; k++) {
                const mech_real swap = a[best * width + k];
                a[best * width + k] = a[rank * width + k];
                a[rank * width + k] = swap;
            }
        for (int i = rank + 1; i < n; i++) {
            const mech_real f = a[i * width + j] / a[rank * width + j];
            if (f == 0) continue;
            for (int k = j; k < width; k++) a[i * width + k] -= f * a[rank * width + k];
        }
        pivot[j] = rank++;
    }
    for (int j = n - 1; j >= 0; j--) {
        x[j] = 0;
        if (pivot[j] < 0) continue;
        mech_real sum = a[pivot[j] * width + n];
        for (int k = j + 1; k < n; k++) sum -= a[pivot[j] * width + k] * x[k];
        x[j] = sum / a[pivot[j] * width + j];
    }
}

/* The forces of n contacts in their modes, [n][2] with those of friction, and the accelerations, of which `a` holds those
 * without them; `values`: of each contact, `width` numbers. */
static inline void mech_crowd_solve(const mech_crowd_at *at, int n, const int *contacts, const int *modes,
                                    const mech_real *values, int width, mech_real *a, mech_real *force)
{
    const mech_model *m = at->m;
    const mech_crowd *c = m->hybrid->crowd;
    const size_t nv = (size_t)m->nv, real = sizeof(mech_real);
    int rows = 0;
    memset(force, 0, 2 * (size_t)n * real);
    for (int k = 0; k < n; k++) rows += modes[k] == MECH_CROWD_OPEN ? 0 : modes[k] == MECH_CROWD_STICKS ? 2 : 1;
    if (!rows) return;
    const size_t r = (size_t)rows;
    int *ints = (int *)malloc((6 * r + 2 * nv) * sizeof(int));
    mech_real *reals = (mech_real *)malloc((r * nv + r * (r + 1) + r + nv) * real);
    if (!ints || !reals) { /* as an undefined value */
        for (int i = 0; i < m->nv; i++) a[i] = (mech_real)NAN;
        free(ints);
        free(reals);
        return;
    }
    int *of = ints, *slip = of + r, *island = slip + r, *pivot = island + r, *set = pivot + r, *parent = set + r;
    mech_real *response = reals, *matrix = response + r * nv, *x = matrix + r * (r + 1), *along = x + r;
    for (int i = 0; i < m->nv; i++) parent[i] = i; /* of groups, which are numbered among velocities */
    rows = 0;
    for (int k = 0; k < n; k++) {
        if (modes[k] == MECH_CROWD_OPEN) continue;
        const mech_crowd_kind *kind = mech_crowd_kind_of(c, contacts[k]);
        const mech_real *own = values + k * width;
        const int *v = mech_crowd_velocities(c, contacts[k]);
        for (int s = 0; s <= (modes[k] == MECH_CROWD_STICKS); s++) {
            of[rows] = k;
            slip[rows] = s;
            memset(along, 0, nv * real);
            mech_crowd_add(c, contacts[k], s, own, 1, along);
            if (modes[k] >= MECH_CROWD_FORWARD) {
                const mech_real sign = modes[k] == MECH_CROWD_FORWARD ? -1 : 1;
                mech_crowd_add(c, contacts[k], 1, own, sign * own[mech_crowd_slip(kind) + 3], along);
            }
            memcpy(at->g + m->nu, along, nv * real);
            c->push(at->t, at->y, at->g, at->z, at->p, response + (size_t)rows * nv);
            rows++;
        }
        for (int i = 1; i < kind->n_normal + kind->n_slip; i++)
            parent[mech_crowd_root(parent, c->group[v[i]])] = mech_crowd_root(parent, c->group[v[0]]);
    }
    for (int i = 0; i < rows; i++)
        island[i] = mech_crowd_root(parent, c->group[mech_crowd_velocities(c, contacts[of[i]])[0]]);
    for (int first = 0; first < rows; first++) {
        const int here = island[first];
        int count = 0;
        if (here < 0) continue;
        for (int i = first; i < rows; i++)
            if (island[i] == here) {
                set[count++] = i;
                island[i] = -1;
            }
        for (int i = 0; i < count; i++) {
            const int k = of[set[i]], s = slip[set[i]];
            const mech_real *own = values + k * width;
            const mech_real bias = own[s ? mech_crowd_slip(mech_crowd_kind_of(c, contacts[k])) + 1 : 2];
            for (int j = 0; j < count; j++)
                matrix[i * (count + 1) + j] =
                    mech_crowd_along(c, contacts[k], s, own, response + (size_t)set[j] * nv);
            matrix[i * (count + 1) + count] = -(mech_crowd_along(c, contacts[k], s, own, a) + bias);
        }
        mech_crowd_eliminate(count, matrix, x, pivot);
        for (int i = 0; i < count; i++) force[2 * of[set[i]] + slip[set[i]]] = x[i];
    }
    for (int i = 0; i < rows; i++) {
        const mech_real f = force[2 * of[i] + slip[i]];
        for (size_t k = 0; k < nv; k++) a[k] += f * response[(size_t)i * nv + k];
    }
    for (int k = 0; k < n; k++)
        if (modes[k] >= MECH_CROWD_FORWARD) {
            const mech_real coefficient = values[k * width + mech_crowd_slip(mech_crowd_kind_of(c, contacts[k])) + 3];
            force[2 * k + 1] = (modes[k] == MECH_CROWD_FORWARD ? -1 : 1) * coefficient * force[2 * k];
        }
    free(ints);
    free(reals);
}

/* What a state needs of its closed contacts. */
typedef struct mech_crowd_closed {
    int n, width;
    int *contacts, *modes;
    mech_real *values, *force, *g; /* one block of memory, at `values` */
} mech_crowd_closed;

/* Reads z and finds the forces; 0 where nothing is closed. `a`: accelerations without them, then with them. */
static inline int mech_crowd_find(const mech_model *m, mech_real t, const mech_real *y, const mech_real *u,
                                  const mech_real *z, const mech_real *p, mech_real *a, mech_crowd_closed *found)
{
    const mech_crowd *c = m->hybrid->crowd;
    int n = 0;
    while (n < c->capacity && z[c->first + n] > MECH_C(0.5)) n++;
    if (!n) return 0;
    found->n = n;
    found->width = c->n_values;
    found->contacts = (int *)malloc(2 * (size_t)n * sizeof(int));
    found->values = (mech_real *)malloc(((size_t)n * (size_t)(found->width + 2) + (size_t)(m->nu + c->n_given)) * sizeof(mech_real));
    if (!found->contacts || !found->values) {
        free(found->contacts);
        free(found->values);
        for (int i = 0; i < m->nv; i++) a[i] = (mech_real)NAN;
        return 0;
    }
    found->modes = found->contacts + n;
    found->force = found->values + (size_t)n * (size_t)found->width;
    found->g = found->force + 2 * n;
    for (int i = 0; i < m->nu; i++) found->g[i] = u[i];
    const mech_crowd_at at = {m, t, y, u, z, p, found->g};
    for (int k = 0; k < n; k++) {
        const int code = (int)z[c->first + k];
        found->contacts[k] = code / 8 - 1;
        found->modes[k] = code % 8;
        mech_crowd_values(&at, found->contacts[k], found->values + k * found->width);
    }
    mech_crowd_solve(&at, n, found->contacts, found->modes, found->values, found->width, a, found->force);
    return 1;
}

static inline void mech_crowd_forget(mech_crowd_closed *found)
{
    free(found->contacts);
    free(found->values);
}

static inline void mech_crowd_rates(const mech_model *m, mech_real t, const mech_real *y, const mech_real *u,
                                    const mech_real *z, const mech_real *p, mech_real *out)
{
    const mech_hybrid *h = m->hybrid;
    const mech_crowd *c = h->crowd;
    mech_crowd_closed found;
    c->rhs(t, y, u, z, p, out);
    if (!mech_crowd_find(m, t, y, u, z, p, out + m->nq, &found)) return;
    for (int k = 0; k < found.n; k++) {
        const mech_crowd_kind *kind = mech_crowd_kind_of(c, found.contacts[k]);
        const mech_real *own = found.values + k * found.width, *force = found.force + 2 * k;
        mech_real supplied = -force[0] * own[1], lost = 0;
        if (kind->friction) {
            const mech_real drift = own[mech_crowd_slip(kind)];
            lost = -force[1] * (mech_crowd_along(c, found.contacts[k], 1, own, y + m->nq) + drift);
            supplied -= force[1] * drift;
        }
        if (h->dissipated >= 0) out[h->dissipated] += lost;
        if (h->supplied >= 0) out[h->supplied] += supplied;
    }
    mech_crowd_forget(&found);
}

static inline void mech_crowd_outputs(const mech_model *m, mech_real t, const mech_real *y, const mech_real *u,
                                      const mech_real *z, const mech_real *p, mech_real *out)
{
    const mech_crowd *c = m->hybrid->crowd;
    const int ny = m->nq + m->nv + m->nx;
    const size_t given = (size_t)(m->nu + c->n_given);
    mech_crowd_closed found;
    mech_real *rates = (mech_real *)malloc(((size_t)ny + given) * sizeof(mech_real));
    if (!rates) {
        for (int i = 0; i < m->n_outputs; i++) out[i] = (mech_real)NAN;
        return;
    }
    mech_real *g = rates + ny;
    c->rhs(t, y, u, z, p, rates);
    const int closed = mech_crowd_find(m, t, y, u, z, p, rates + m->nq, &found);
    for (int i = 0; i < m->nu; i++) g[i] = u[i];
    memcpy(g + m->nu, rates + m->nq, (size_t)m->nv * sizeof(mech_real));
    for (int i = 0; i < c->n_asked; i++) {
        mech_real *value = g + m->nu + m->nv + i;
        *value = 0;
        for (int k = 0; closed && k < found.n; k++)
            if (found.contacts[k] == c->asked[2 * i])
                *value = c->asked[2 * i + 1] == 2 ? 1 : found.force[2 * k + c->asked[2 * i + 1]];
    }
    c->outputs(t, y, g, z, p, out);
    if (closed) mech_crowd_forget(&found);
    free(rates);
}

#endif
