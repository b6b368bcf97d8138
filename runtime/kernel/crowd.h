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

#include "envelope.h"
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

/* A force of a crowd: along a gap or a slip; where `slide` is not 0, along a gap and that times its slip. */
typedef struct mech_crowd_force {
    int contact, slip;
    mech_real slide;
    const mech_real *values;
} mech_crowd_force;

/* What unit forces do: those that have no group of velocities in common share a colour, and are pushed at once. */
typedef struct mech_crowd_response {
    int colours;
    mech_real *push; /* [colours][nv] */
    int *owner;      /* [colours][nv] of each group the force that moves it, or -1 */
} mech_crowd_response;

/* The range in its list of velocities that a force acts along. */
static inline const int *mech_crowd_along_which(const mech_crowd *c, const mech_crowd_force *f, int *count)
{
    const mech_crowd_kind *k = mech_crowd_kind_of(c, f->contact);
    *count = f->slip ? k->n_slip : k->n_normal + (f->slide != 0 ? k->n_slip : 0);
    return mech_crowd_velocities(c, f->contact) + (f->slip ? k->n_normal : 0);
}

/* Finds it, in memory that its owner frees at `push`; 0 where there is none. */
static inline int mech_crowd_respond(const mech_crowd_at *at, int n, const mech_crowd_force *forces,
                                     mech_crowd_response *found)
{
    enum { SHARED = 64 };
    const mech_model *m = at->m;
    const mech_crowd *c = m->hybrid->crowd;
    const size_t nv = (size_t)m->nv;
    unsigned long long *used = (unsigned long long *)malloc(nv * sizeof(*used) + (size_t)n * sizeof(int));
    if (!used) return 0;
    int *colour = (int *)(used + nv), alone = SHARED, most = 0;
    memset(used, 0, nv * sizeof(*used));
    for (int j = 0; j < n; j++) {
        unsigned long long taken = 0;
        int count, own = 0;
        const int *v = mech_crowd_along_which(c, &forces[j], &count);
        for (int i = 0; i < count; i++) taken |= used[c->group[v[i]]];
        while (own < SHARED && taken >> own & 1) own++;
        colour[j] = own < SHARED ? own : alone++;
        for (int i = 0; own < SHARED && i < count; i++) used[c->group[v[i]]] |= 1ull << own;
        if (own < SHARED && own >= most) most = own + 1;
    }
    for (int j = 0; j < n; j++)
        if (colour[j] >= SHARED) colour[j] += most - SHARED;
    found->colours = most + alone - SHARED;
    const size_t numbers = (size_t)found->colours * nv;
    found->push = (mech_real *)malloc(numbers * (sizeof(mech_real) + sizeof(int)) + sizeof(mech_real));
    if (!found->push) {
        free(used);
        return 0;
    }
    found->owner = (int *)(found->push + numbers);
    for (size_t i = 0; i < numbers; i++) found->owner[i] = -1;
    for (int k = 0; k < found->colours; k++) {
        int *owner = found->owner + (size_t)k * nv;
        memset(at->g + m->nu, 0, nv * sizeof(mech_real));
        for (int j = 0; j < n; j++) {
            int count;
            if (colour[j] != k) continue;
            const int *v = mech_crowd_along_which(c, &forces[j], &count);
            for (int i = 0; i < count; i++) owner[c->group[v[i]]] = j;
            mech_crowd_add(c, forces[j].contact, forces[j].slip, forces[j].values, 1, at->g + m->nu);
            if (forces[j].slide != 0)
                mech_crowd_add(c, forces[j].contact, 1, forces[j].values, forces[j].slide, at->g + m->nu);
        }
        c->push(at->t, at->y, at->g, at->z, at->p, found->push + (size_t)k * nv);
    }
    free(used);
    return 1;
}

/* Calls for what each force changes the rate of row i by: *j the force, *part of it by one velocity. `place` counts from 0
 * and is opaque; 0 behind the last. */
static inline int mech_crowd_next(const mech_crowd *c, int nv, const mech_crowd_response *r, const mech_crowd_force *row,
                                  int *place, int *j, mech_real *part)
{
    enum { PLACE_BITS = 16 };
    const mech_crowd_kind *k = mech_crowd_kind_of(c, row->contact);
    const int *v = mech_crowd_velocities(c, row->contact) + (row->slip ? k->n_normal : 0);
    const mech_real *entries = row->values + (row->slip ? mech_crowd_slip(k) + 4 : 5);
    const int count = row->slip ? k->n_slip : k->n_normal, colours = r->colours;
    int i = *place >> PLACE_BITS, colour = *place & ((1 << PLACE_BITS) - 1);
    for (; i < count; i++, colour = 0) {
        const int *owner = r->owner + c->group[v[i]];
        for (; colour < colours; colour++) {
            *j = owner[(size_t)colour * (size_t)nv];
            if (*j < 0) continue;
            *part = entries[i] * r->push[(size_t)colour * (size_t)nv + (size_t)v[i]];
            *place = (i << PLACE_BITS) + colour + 1;
            return 1;
        }
    }
    return 0;
}

/* Of n rows, the first that moves each of them, or that it moves. */
static inline void mech_crowd_first(const mech_crowd *c, int nv, const mech_crowd_response *r, int n,
                                    const mech_crowd_force *rows, int *first)
{
    mech_real part;
    for (int i = 0; i < n; i++) first[i] = i;
    for (int i = 0; i < n; i++)
        for (int place = 0, j; mech_crowd_next(c, nv, r, &rows[i], &place, &j, &part);) {
            const int low = j < i ? j : i, high = j < i ? i : j;
            if (low < first[high]) first[high] = low;
        }
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

/* The forces x of n rows that have no rates of their own then, x their targets before; 0 where memory is lacking. */
static inline int mech_crowd_balance(const mech_crowd *c, int nv, const mech_crowd_response *r, int n,
                                     const mech_crowd_force *rows, mech_real *x)
{
    int slides = 0, j, place;
    mech_real part;
    int *first = (int *)malloc(3 * (size_t)n * sizeof(int));
    if (!first) return 0;
    int *at = first + n, *pivot = at + n;
    mech_crowd_first(c, nv, r, n, rows, first);
    const int entries = mech_envelope_places(n, first, at);
    for (int i = 0; i < n; i++) slides |= rows[i].slide != 0;
    const size_t room = (size_t)entries * (slides ? 2 : 1) + 2 * (size_t)n;
    mech_real *d = (mech_real *)calloc(room, sizeof(mech_real)), *lower = d + 2 * n, *upper = lower + entries, *full = NULL;
    if (!d) {
        free(first);
        return 0;
    }
    for (int i = 0; i < n; i++)
        for (place = 0; mech_crowd_next(c, nv, r, &rows[i], &place, &j, &part);) {
            if (j == i) d[i] += part;
            if (j < i) lower[at[i] + j] += part;
            if (j > i && slides) upper[at[j] + i] += part;
        }
    int done = 1;
    if (!slides) {
        mech_real *left = d + n;
        for (int i = 0; i < n; i++) left[i] = MECH_EASE * d[i];
        for (int i = 0; i < n; i++) d[i] += left[i];
        mech_envelope_factor(n, first, at, 0, lower, d);
        mech_envelope_solve(n, first, at, lower, d, x);
        for (int i = 0; i < n; i++) left[i] *= x[i];
        mech_envelope_solve(n, first, at, lower, d, left);
        for (int i = 0; i < n; i++) x[i] += left[i];
    } else if (mech_envelope_factor_lu(n, first, at, lower, upper, d)) {
        mech_envelope_solve_lu(n, first, at, lower, upper, d, x);
    } else {
        const int width = n + 1;
        full = (mech_real *)calloc((size_t)n * (size_t)width, sizeof(mech_real));
        done = full != NULL;
        for (int i = 0; done && i < n; i++) {
            for (place = 0; mech_crowd_next(c, nv, r, &rows[i], &place, &j, &part);) full[i * width + j] += part;
            full[i * width + n] = x[i];
        }
        if (done) mech_crowd_eliminate(n, full, x, pivot);
    }
    free(full);
    free(d);
    free(first);
    return done;
}

/* The forces of n contacts in their modes, [n][2] with those of friction, and the accelerations, of which `a` holds those
 * without them; `values`: of each contact, `width` numbers. */
static inline void mech_crowd_solve(const mech_crowd_at *at, int n, const int *contacts, const int *modes,
                                    const mech_real *values, int width, mech_real *a, mech_real *force)
{
    const mech_model *m = at->m;
    const mech_crowd *c = m->hybrid->crowd;
    mech_crowd_response response;
    int rows = 0, found = 0;
    memset(force, 0, 2 * (size_t)n * sizeof(mech_real));
    for (int k = 0; k < n; k++) rows += modes[k] == MECH_CROWD_OPEN ? 0 : modes[k] == MECH_CROWD_STICKS ? 2 : 1;
    if (!rows) return;
    mech_crowd_force *own = (mech_crowd_force *)malloc((size_t)rows * (sizeof(*own) + sizeof(mech_real) + sizeof(int)));
    mech_real *x = (mech_real *)(own + rows);
    int *of = (int *)(x + rows);
    rows = 0;
    for (int k = 0; own && k < n; k++) {
        const mech_real *value = values + k * width;
        if (modes[k] == MECH_CROWD_OPEN) continue;
        const int slip = mech_crowd_slip(mech_crowd_kind_of(c, contacts[k]));
        for (int s = 0; s <= (modes[k] == MECH_CROWD_STICKS); s++) {
            const int sign = modes[k] == MECH_CROWD_FORWARD ? -1 : modes[k] == MECH_CROWD_BACKWARD ? 1 : 0;
            of[rows] = 2 * k + s;
            own[rows] = (mech_crowd_force){contacts[k], s, sign ? sign * value[slip + 3] : 0, value};
            x[rows++] = -(mech_crowd_along(c, contacts[k], s, value, a) + value[s ? slip + 1 : 2]);
        }
    }
    if (own && mech_crowd_respond(at, rows, own, &response)) {
        found = mech_crowd_balance(c, m->nv, &response, rows, own, x);
        for (int k = 0; found && k < response.colours; k++)
            for (int v = 0; v < m->nv; v++) {
                const int j = response.owner[k * m->nv + c->group[v]];
                if (j >= 0) a[v] += x[j] * response.push[k * m->nv + v];
            }
        for (int i = 0; i < rows; i++) {
            force[of[i]] = x[i];
            if (own[i].slide != 0) force[of[i] + 1] = own[i].slide * x[i];
        }
        free(response.push);
    }
    for (int i = 0; !found && i < m->nv; i++) a[i] = (mech_real)NAN; /* without memory: as an undefined value */
    free(own);
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
