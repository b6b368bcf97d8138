/* What unit forces of the contacts of a crowd do (crowd.h): R_j = M^-1 (directions of force j)^T, and the rates of rows by it. */
#ifndef MECH_CROWD_RESPONSE_H
#define MECH_CROWD_RESPONSE_H

#include <stdlib.h>
#include <string.h>

#include "real.h"

/* How a contact stands, as z lists it; a friction that slides, along or against its slip. */
enum { MECH_CROWD_OPEN, MECH_CROWD_CLOSED, MECH_CROWD_STICKS, MECH_CROWD_FORWARD, MECH_CROWD_BACKWARD };

enum { MECH_CROWD_FORCES = 3 }; /* of a contact: along its gap and its slips */

/* What functions of a model are called with. */
typedef struct mech_crowd_at {
    const mech_model *m;
    mech_real t;
    const mech_real *y, *u, *z, *p;
    mech_real *g; /* [nu + nv + ...] inputs, then what is given */
} mech_crowd_at;

/* A contact: its kind, and where it stands what it reads. */
typedef struct mech_crowd_who {
    const mech_crowd_kind *kind;
    const int *one, *other, *velocities;
} mech_crowd_who;

static inline const mech_crowd_line *mech_crowd_line_of(const mech_crowd *c, int contact)
{
    int low = 0, high = c->n_lines;
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        if (c->lines[middle].first <= contact)
            low = middle;
        else
            high = middle;
    }
    return &c->lines[low];
}

static inline const mech_crowd_kind *mech_crowd_kind_of(const mech_crowd *c, int contact)
{
    return &c->kinds[mech_crowd_line_of(c, contact)->kind];
}

static inline mech_crowd_who mech_crowd_who_on(const mech_crowd *c, const mech_crowd_line *line, int contact)
{
    const mech_crowd_kind *kind = &c->kinds[line->kind];
    return (mech_crowd_who){kind, c->table + line->one, c->table + line->others + (contact - line->first) * (kind->n_leaves - kind->n_one),
                            c->table + kind->velocities};
}

static inline mech_crowd_who mech_crowd_who_of(const mech_crowd *c, int contact)
{
    return mech_crowd_who_on(c, mech_crowd_line_of(c, contact), contact);
}

/* What it reads, as one index over y, p and z; its velocities, those of the gap before those of the slip, as indices of v. */
static inline int mech_crowd_leaf(const mech_crowd_who *who, int i)
{
    return i < who->kind->n_one ? who->one[i] : who->other[i - who->kind->n_one];
}
static inline int mech_crowd_velocity(const mech_crowd *c, const mech_crowd_who *who, int i)
{
    return mech_crowd_leaf(who, who->velocities[i]) - c->nq;
}

/* Places of the values of a contact of kind k: of its slip; of K of its gap (slip 0), or of a direction of slip (1, 2). */
static inline int mech_crowd_slip(const mech_crowd_kind *k) { return 5 + 2 * k->n_normal; }
static inline int mech_crowd_entries(const mech_crowd_kind *k, int slip)
{
    return slip == 0 ? 5 : mech_crowd_slip(k) + (slip == 1 ? 4 : 6 + k->n_slip);
}
static inline int mech_crowd_drift(const mech_crowd_kind *k, int slip)
{
    return slip == 0 ? 1 : mech_crowd_entries(k, slip) - (slip == 1 ? 4 : 2);
}

/* The values of one contact. */
static inline void mech_crowd_values_of(const mech_crowd_at *at, const mech_crowd_who *who, mech_real *out)
{
    const mech_model *m = at->m;
    const int ny = m->nq + m->nv + m->nx, behind = ny + m->np;
    for (int i = 0; i < who->kind->n_leaves; i++) {
        const int place = mech_crowd_leaf(who, i);
        at->g[m->nu + i] = place < ny ? at->y[place] : place < behind ? at->p[place - ny] : at->z[place - behind];
    }
    who->kind->values(at->t, at->y, at->g, at->z, at->p, out);
}

static inline void mech_crowd_values(const mech_crowd_at *at, int contact, mech_real *out)
{
    const mech_crowd_who who = mech_crowd_who_of(at->m->hybrid->crowd, contact);
    mech_crowd_values_of(at, &who, out);
}

/* What an impulse of the given size along the gap, or the slip, adds to the impulses along v. */
static inline void mech_crowd_add(const mech_crowd *c, int contact, int slip, const mech_real *values, mech_real size,
                                  mech_real *along)
{
    const mech_crowd_who who = mech_crowd_who_of(c, contact);
    const int from = slip ? who.kind->n_normal : 0, count = slip ? who.kind->n_slip : who.kind->n_normal;
    const mech_real *entries = values + mech_crowd_entries(who.kind, slip);
    for (int i = 0; i < count; i++) along[mech_crowd_velocity(c, &who, from + i)] += size * entries[i];
}

/* Adds what the forces of a contact, along its gap and its slips, are along the velocities. */
static inline void mech_crowd_press(const mech_crowd *c, int contact, const mech_real *values, const mech_real *force, mech_real *along)
{
    const int friction = mech_crowd_kind_of(c, contact)->friction;
    for (int slip = 0; slip <= friction; slip++) mech_crowd_add(c, contact, slip, values, force[slip], along);
}

/* K x of a gap, or a slip, for x[nv]. */
static inline mech_real mech_crowd_along(const mech_crowd *c, int contact, int slip, const mech_real *values,
                                         const mech_real *x)
{
    const mech_crowd_who who = mech_crowd_who_of(c, contact);
    const int from = slip ? who.kind->n_normal : 0, count = slip ? who.kind->n_slip : who.kind->n_normal;
    const mech_real *entries = values + mech_crowd_entries(who.kind, slip);
    mech_real sum = 0;
    for (int i = 0; i < count; i++) sum += entries[i] * x[mech_crowd_velocity(c, &who, from + i)];
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

/* The range among its velocities that a force acts along: gives its first, and how many. */
static inline int mech_crowd_along_which(const mech_crowd_who *who, const mech_crowd_force *f, int *count)
{
    *count = f->slip ? who->kind->n_slip : who->kind->n_normal + (f->slide != 0 ? who->kind->n_slip : 0);
    return f->slip ? who->kind->n_normal : 0;
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
        const mech_crowd_who who = mech_crowd_who_of(c, forces[j].contact);
        const int from = mech_crowd_along_which(&who, &forces[j], &count);
        for (int i = 0; i < count; i++) taken |= used[c->group[mech_crowd_velocity(c, &who, from + i)]];
        while (own < SHARED && taken >> own & 1) own++;
        colour[j] = own < SHARED ? own : alone++;
        for (int i = 0; own < SHARED && i < count; i++) used[c->group[mech_crowd_velocity(c, &who, from + i)]] |= 1ull << own;
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
            const mech_crowd_who who = mech_crowd_who_of(c, forces[j].contact);
            const int from = mech_crowd_along_which(&who, &forces[j], &count);
            for (int i = 0; i < count; i++) owner[c->group[mech_crowd_velocity(c, &who, from + i)]] = j;
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
    const mech_crowd_who who = mech_crowd_who_of(c, row->contact);
    const mech_real *entries = row->values + mech_crowd_entries(who.kind, row->slip);
    const int from = row->slip ? who.kind->n_normal : 0, count = row->slip ? who.kind->n_slip : who.kind->n_normal;
    const int colours = r->colours;
    int i = *place >> PLACE_BITS, colour = *place & ((1 << PLACE_BITS) - 1);
    for (; i < count; i++, colour = 0) {
        const int v = mech_crowd_velocity(c, &who, from + i), *owner = r->owner + c->group[v];
        for (; colour < colours; colour++) {
            *j = owner[(size_t)colour * (size_t)nv];
            if (*j < 0) continue;
            *part = entries[i] * r->push[(size_t)colour * (size_t)nv + (size_t)v];
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

#endif
