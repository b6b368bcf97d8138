/* Crowds: contacts so many that their forces are found by numbers (model.h), over those that are closed.
 *
 * With accelerations a0 without them, a = a0 + sum_j R_j f_j, where R_j = M^-1 (directions of force j)^T. A contact
 * that presses, and a friction that sticks, has K a + gamma = 0; a friction that slides adds -sign mu f along its slip to
 * the force f of its contact. Contacts that have no velocities in common, by way of others, are solved apart. Both
 * generated code and the kernel include this file.
 */
#ifndef MECH_CROWD_H
#define MECH_CROWD_H

#include "crowd_response.h"
#include "envelope.h"

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

/* The forces of n contacts in their modes, [n][3] with those of friction, and the accelerations, of which `a` holds those
 * without them; `values`: of each contact, `width` numbers. */
static inline void mech_crowd_solve(const mech_crowd_at *at, int n, const int *contacts, const int *modes,
                                    const mech_real *values, int width, mech_real *a, mech_real *force)
{
    const mech_model *m = at->m;
    const mech_crowd *c = m->hybrid->crowd;
    mech_crowd_response response;
    int rows = 0, found = 0;
    memset(force, 0, MECH_CROWD_FORCES * (size_t)n * sizeof(mech_real));
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
            of[rows] = MECH_CROWD_FORCES * k + s;
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

/* How many contacts z lists. */
static inline int mech_crowd_listed(const mech_crowd *c, const mech_real *z)
{
    int n = 0;
    while (n < c->capacity && z[c->first + n] > MECH_C(0.5)) n++;
    return n;
}

/* What a step has told of the forces: their accelerations [nv], their efforts, then what is asked; NULL where none has. */
static inline const mech_real *mech_crowd_told(const mech_crowd *c, const mech_real *z)
{
    const mech_real *told = z + c->first + c->capacity;
    return c->n_told && *told > MECH_C(0.5) ? told + 1 : NULL;
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
    const int n = mech_crowd_listed(c, z);
    if (!n) return 0;
    found->n = n;
    found->width = c->n_values;
    found->contacts = (int *)malloc(2 * (size_t)n * sizeof(int));
    found->values = (mech_real *)malloc(((size_t)n * (size_t)(found->width + MECH_CROWD_FORCES) + (size_t)(m->nu + c->n_given)) * sizeof(mech_real));
    if (!found->contacts || !found->values) {
        free(found->contacts);
        free(found->values);
        for (int i = 0; i < m->nv; i++) a[i] = (mech_real)NAN;
        return 0;
    }
    found->modes = found->contacts + n;
    found->force = found->values + (size_t)n * (size_t)found->width;
    found->g = found->force + MECH_CROWD_FORCES * n;
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
    mech_real *a = out + m->nq, work = 0, all_lost = 0;
    c->rhs(t, y, u, z, p, out);
    if (mech_crowd_told(c, z)) return;
    mech_real *without = c->supply && h->supplied >= 0 ? (mech_real *)malloc((size_t)m->nv * sizeof(mech_real)) : NULL;
    if (without) memcpy(without, a, (size_t)m->nv * sizeof(mech_real));
    if (!mech_crowd_find(m, t, y, u, z, p, a, &found)) {
        free(without);
        return;
    }
    for (int k = 0; k < found.n; k++) {
        const mech_crowd_kind *kind = mech_crowd_kind_of(c, found.contacts[k]);
        const mech_real *own = found.values + k * found.width, *force = found.force + MECH_CROWD_FORCES * k;
        mech_real supplied = -force[0] * own[1], lost = 0;
        if (kind->friction) {
            const mech_real drift = own[mech_crowd_slip(kind)];
            lost = -force[1] * (mech_crowd_along(c, found.contacts[k], 1, own, y + m->nq) + drift);
            supplied -= force[1] * drift;
        }
        all_lost += lost;
        if (h->dissipated >= 0) out[h->dissipated] += lost;
        if (h->supplied >= 0 && !c->supply) out[h->supplied] += supplied;
    }
    if (without) { /* what constraints and drives that move bring in as well is the rest of the change of the energy */
        for (int i = 0; i < m->nv; i++) found.g[m->nu + i] = a[i] - without[i];
        c->supply(t, y, found.g, z, p, &work);
        out[h->supplied] += work + all_lost;
    } else if (c->supply && h->supplied >= 0) {
        out[h->supplied] = (mech_real)NAN; /* without memory: as an undefined value */
    }
    free(without);
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
    const mech_real *told = mech_crowd_told(c, z);
    const int closed = !told && mech_crowd_find(m, t, y, u, z, p, rates + m->nq, &found);
    for (int i = 0; told && i < m->nv; i++) rates[m->nq + i] += told[i];
    for (int i = 0; i < m->nu; i++) g[i] = u[i];
    memcpy(g + m->nu, rates + m->nq, (size_t)m->nv * sizeof(mech_real));
    int *place = c->n_asked && closed ? (int *)calloc((size_t)c->n, sizeof(int)) : NULL; /* 1 + that in the list */
    for (int k = 0; place && k < found.n; k++) place[found.contacts[k]] = k + 1;
    mech_real *asked = g + m->nu + m->nv + c->n_efforts;
    memset(asked - c->n_efforts, 0, (size_t)c->n_efforts * sizeof(mech_real));
    if (told) memcpy(g + m->nu + m->nv, told + m->nv, (size_t)(c->n_efforts + c->n_asked) * sizeof(mech_real));
    for (int k = 0; c->n_efforts && closed && k < found.n; k++)
        mech_crowd_press(c, found.contacts[k], found.values + k * found.width, found.force + MECH_CROWD_FORCES * k, asked - c->n_efforts);
    for (int i = 0; !told && i < c->n_asked; i++) {
        const int k = place ? place[c->asked[2 * i]] - 1 : -1, what = c->asked[2 * i + 1];
        asked[i] = k < 0 ? (closed && !place ? (mech_real)NAN : 0) : what == 3 ? 1 : found.force[MECH_CROWD_FORCES * k + what];
    }
    free(place);
    c->outputs(t, y, g, z, p, out);
    if (closed) mech_crowd_forget(&found);
    free(rates);
}

#endif
