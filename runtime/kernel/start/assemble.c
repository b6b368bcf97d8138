/* Initial states: positions nearest to their guesses on the constraints, then velocities likewise. Known values stay. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "displacement.h"
#include "nearest.h"
#include "second_order.h"
#include "start.h"

enum { ATTEMPTS = 8, AGAIN = 20 };

/* A gradient that changes by a tenth within this distance, in characteristic sizes, has no direction; of states that are the nearest
   ones, and of those at which the search for these got stuck. */
static const mech_real NEARBY = MECH_C(1e-9), AROUND = MECH_C(1e-6), TURNED = MECH_C(0.1);
static const mech_real ROUNDING = MECH_C(1e-12); /* of assembled coordinates, in characteristic sizes */

/* G. Steele, D. Lea, C. Flood, Fast splittable pseudorandom number generators, OOPSLA 2014: evenly spread with
   variance 1, always the same ones. */
static mech_real next_number(uint64_t *state)
{
    uint64_t x = *state += 0x9e3779b97f4a7c15u;
    x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u;
    x = (x ^ x >> 27) * 0x94d049bb133111ebu;
    x ^= x >> 31;
    return MECH_C(1.7320508075688772) * ((mech_real)(x >> 11) / 4503599627370496.0 - 1);
}

static void *make_task(const mech_model *m, mech_task *k, mech_real length)
{
    const mech_start *s = m->start;
    const size_t ny = (size_t)(m->nq + m->nv + m->nx), nv = (size_t)m->nv, rows = (size_t)s->n_rows;
    const size_t point = ny + rows + rows * nv + nv;
    const size_t numbers = 2 * point + 3 * ny + 3 * nv + 2 * rows + mech_nearest_numbers(m);
    const size_t integers = 2 * rows + 3 * nv + mech_nearest_integers(m);
    mech_real *block = calloc(1, numbers * sizeof(mech_real) + integers * sizeof(int));
    if (!block) return NULL;
    mech_real *next = block;
    mech_point *points[2] = {&k->here, &k->there};
    for (int i = 0; i < 2; i++) {
        points[i]->y = next;
        points[i]->values = points[i]->y + ny;
        points[i]->jacobian = points[i]->values + rows;
        points[i]->deviation = points[i]->jacobian + rows * nv;
        next = points[i]->deviation + nv;
    }
    k->guess = next;
    k->first = k->guess + ny;
    k->best = k->first + ny;
    k->weights = k->best + ny;
    k->d = k->weights + nv;
    k->step = k->d + nv;
    k->shares = k->step + nv;
    k->scale = k->shares + rows;
    k->work = k->scale + rows;
    k->hard = (int *)(k->work + mech_nearest_numbers(m));
    k->soft = k->hard + rows;
    k->loose = k->soft + rows;
    k->free = k->loose + nv;
    k->reached = k->free + nv;
    k->order = k->reached + nv;
    k->length = length;
    for (int j = 0; j < m->nv; j++) k->weights[j] = 1 / (s->size[j] > 0 ? s->size[j] : length);
    for (int i = 0; i < s->n_rows; i++) k->shares[i] = s->rows[i].measure == 1 ? 1 : 1 / length;
    return block;
}

static void begin_stage(mech_task *k, int stage, const unsigned char *known)
{
    const mech_model *m = k->model;
    const mech_start *s = m->start;
    k->stage = stage;
    k->n_hard = k->n_soft = k->n_loose = k->n_free = 0;
    for (int i = 0; i < s->n_rows; i++) {
        if (s->rows[i].stage != stage) continue;
        if (s->rows[i].hard) k->hard[k->n_hard++] = i;
        else k->soft[k->n_soft++] = i;
    }
    for (int j = 0; j < m->nv; j++)
        if (!known[stage == 1 ? s->partner[j] : m->nq + j]) k->loose[k->n_loose++] = j;
}

/* From the guess by the shortest steps onto the rows, then along them. */
static int place_along(mech_task *k, mech_start_report *r)
{
    memcpy(k->here.y, k->guess, (size_t)(k->model->nq + k->model->nv + k->model->nx) * sizeof(mech_real));
    mech_look(k, &k->here);
    r->steps[0] += mech_restore(k);
    if (!(mech_worst_of(k, &k->here, NULL) <= MECH_FULFILLED)) return 0;
    r->steps[0] += mech_refine(k);
    r->row = -1;
    r->off = mech_worst_of(k, &k->here, &r->row);
    return 1;
}

/* Searches from here; where that ends off the rows, from beside a state at which their slopes say nothing, then from states
   around the first one: it may be one where nothing can begin. Leaves the closest state here. */
static int search(mech_task *k, mech_start_report *r)
{
    const size_t bytes = (size_t)(k->model->nq + k->model->nv + k->model->nx) * sizeof(mech_real);
    int *steps = &r->steps[k->stage - 1];
    uint64_t numbers = 3;
    mech_real size = MECH_C(0.05);
    memcpy(k->first, k->here.y, bytes);
    if (mech_nearest(k, &r->off, &r->row, steps)) return 1;
    memcpy(k->best, k->here.y, bytes);
    if (k->stage == 1 && place_along(k, r)) return 1;
    for (int attempt = -1; attempt < ATTEMPTS; attempt++) {
        mech_real off;
        int row;
        if (attempt < 0) {
            memcpy(k->here.y, k->best, bytes);
            mech_look(k, &k->here);
            if (!mech_leave(k)) continue;
        } else {
            for (int j = 0; j < k->model->nv; j++) k->d[j] = 0;
            for (int f = 0; f < k->n_loose; f++)
                k->d[k->loose[f]] = mech_min(size, MECH_C(1.5)) * next_number(&numbers) / k->weights[k->loose[f]];
            mech_go(k, k->first, k->d, k->here.y);
            size *= 2;
        }
        const int found = mech_nearest(k, &off, &row, steps);
        if (!found && r->off <= off) continue; /* nor is it nearer, where it is not a number */
        r->off = off;
        r->row = row;
        memcpy(k->best, k->here.y, bytes);
        if (found) return 1;
    }
    memcpy(k->here.y, k->best, bytes);
    return 0;
}

/* Whether all gradients of the hard rows are defined, and the same close by; else the row. */
static int undirected_row(mech_task *k)
{
    const int nv = k->model->nv;
    const mech_real distance = k->settled ? NEARBY : AROUND;
    uint64_t numbers = 5;
    for (int other = 0; other < 2; other++) {
        for (int j = 0; j < nv; j++) k->d[j] = distance * next_number(&numbers) / k->weights[j];
        memcpy(k->there.y, k->here.y, (size_t)(k->model->nq + nv + k->model->nx) * sizeof(mech_real));
        mech_displace(k->model, k->there.y, k->d);
        mech_look(k, &k->there);
        for (int a = 0; a < k->n_hard; a++) {
            const int i = k->hard[a];
            for (int j = 0; j < nv; j++) {
                const size_t e = (size_t)i * (size_t)nv + (size_t)j;
                const mech_real change = (k->there.jacobian[e] - k->here.jacobian[e]) / k->weights[j];
                if (!(mech_abs(change) <= TURNED * (k->scale[i] > 0 ? k->scale[i] : 1))) return i;
            }
        }
    }
    return -1;
}

static int both_stages(mech_task *k, const unsigned char *known, mech_real *y, mech_start_report *r)
{
    const mech_model *m = k->model;
    const size_t bytes = (size_t)(m->nq + m->nv + m->nx) * sizeof(mech_real);
    memcpy(k->guess, y, bytes);
    memcpy(k->here.y, y, bytes);
    begin_stage(k, 1, known);
    const int placed = search(k, r);
    memcpy(y, k->here.y, bytes);
    if (!placed) return MECH_START_APART;
    const int row = undirected_row(k);
    if (row >= 0) {
        r->row = row;
        return MECH_START_UNDIRECTED;
    }
    begin_stage(k, 2, known);
    const int moving = search(k, r);
    memcpy(y, k->here.y, bytes);
    return moving ? MECH_STARTED : MECH_START_RATES;
}

int mech_assemble(const mech_model *m, mech_real t, const unsigned char *known, const mech_real *u,
                  const mech_real *z, const mech_real *p, mech_real *y, mech_start_report *report)
{
    mech_start_report own, *r = report ? report : &own;
    *r = (mech_start_report){MECH_STARTED, -1, {0, 0}, 0};
    if (!m->start || !m->start->n_rows) return MECH_STARTED;
    mech_task task = {.model = m, .t = t, .u = u, .z = z, .p = p};
    void *block = make_task(m, &task, mech_characteristic_length(m, p));
    if (!block) return r->status = MECH_START_NO_MEMORY;
    r->status = both_stages(&task, known ? known : m->start->known, y, r);
    free(block);
    return r->status;
}

int mech_start_found(const mech_model *m, mech_real t, const mech_real *y, const mech_real *u, const mech_real *z,
                     mech_real *p, unsigned char *set)
{
    const mech_start *s = m->start;
    int wrong = -1;
    if (!s || !s->n_found) return wrong;
    mech_real *value = calloc((size_t)s->n_found, sizeof *value);
    if (!value) return s->found[0];
    s->find(t, y, u, z, p, value);
    for (int k = 0; k < s->n_found; k++) {
        if (!mech_finite(value[k])) wrong = s->found[k];
        p[s->found[k]] = value[k];
        set[s->found[k]] = 1;
    }
    free(value);
    m->parameters(p, set);
    return wrong;
}

/* Initial values that follow from those of others; gives whether a coordinate or velocity among them has another value now. */
static int follow_others(const mech_model *m, mech_real t, const unsigned char *given, const mech_real *u, const mech_real *z,
                         const mech_real *p, mech_real *y, mech_real *value)
{
    const mech_start *s = m->start;
    int moved = 0;
    for (int round = 0; s && round < s->n_dependent; round++) { /* one of them may be stated with another */
        s->others(t, y, u, z, p, value);
        for (int k = 0; k < s->n_dependent; k++) {
            const int i = s->dependent[k];
            if (given && given[i]) continue;
            if (i < m->nq + m->nv && mech_abs(y[i] - value[k]) > MECH_C(1e-14) * (mech_abs(y[i]) + mech_abs(value[k]))) moved = 1;
            y[i] = value[k];
        }
    }
    return moved;
}

/* Assembles from `first`, the state as it is stated; again where this moves what initial values are stated with. */
static void assemble_with_others(const mech_model *m, mech_real t, const unsigned char *given, const unsigned char *known,
                                 const mech_real *u, const mech_real *z, const mech_real *p, mech_real *first, mech_real *y,
                                 mech_real *value, mech_start_report *r)
{
    const size_t bytes = (size_t)(m->nq + m->nv + m->nx) * sizeof(mech_real);
    const mech_start *s = m->start;
    for (int again = 0; again < AGAIN; again++) {
        memcpy(y, first, bytes);
        if (mech_assemble(m, t, known, u, z, p, y, r) || !s || !s->n_dependent) return;
        const int moved = follow_others(m, t, given, u, z, p, y, value);
        for (int k = 0; k < s->n_dependent; k++) first[s->dependent[k]] = y[s->dependent[k]];
        if (!moved || !s->n_rows) return;
    }
    r->status = MECH_START_APART;
}

/* What the model states of y, behind what was given; then initial values that follow from those of others. */
static void state_values(const mech_model *m, mech_real t, const unsigned char *given, const mech_real *u,
                         const mech_real *z, const mech_real *p, mech_real *y, mech_real *value)
{
    const int ny = m->nq + m->nv + m->nx;
    m->initial(t, y, u, z, p, value);
    for (int i = 0; i < ny; i++)
        if (!given || !given[i]) y[i] = value[i];
    follow_others(m, t, given, u, z, p, y, value);
    mech_normalise(m, y);
}

/* plain = y, but what was stated where a coordinate was moved by no more than rounding, and zero where no more is left. */
static void put_back(const mech_model *m, const mech_real *p, const mech_real *stated, const mech_real *y, mech_real *plain)
{
    const mech_start *s = m->start;
    const mech_real length = s ? mech_characteristic_length(m, p) : 1;
    memcpy(plain, y, (size_t)(m->nq + m->nv + m->nx) * sizeof(mech_real));
    for (int j = 0; s && j < m->nv; j++) {
        const int i = s->partner[j];
        int rotation = 0;
        for (int k = 0; k < m->n_rotations; k++) rotation |= m->rotations[k] == i;
        const mech_real least = ROUNDING * (s->size[j] > 0 ? s->size[j] : length);
        if (rotation) continue;
        if (mech_abs(y[i] - stated[i]) < least) plain[i] = stated[i];
        else if (mech_abs(y[i]) < least) plain[i] = 0;
    }
}

int mech_start_state(const mech_model *m, mech_real t, const unsigned char *given, const mech_real *u, mech_real *z,
                     const mech_real *p, mech_real *y, mech_real *plain, mech_start_report *report)
{
    mech_start_report own, *r = report ? report : &own;
    const int ny = m->nq + m->nv + m->nx;
    *r = (mech_start_report){MECH_STARTED, -1, {0, 0}, 0};
    mech_real *value = calloc(2 * (size_t)ny + 2, sizeof *value); /* formulas, then what was stated; others */
    unsigned char *known = calloc((size_t)ny + 1, 1);
    if (!value || !known) r->status = MECH_START_NO_MEMORY;
    if (!r->status) {
        if (m->discretes) m->discretes(t, y, u, z, p, z);
        state_values(m, t, given, u, z, p, y, value);
        memcpy(value, y, (size_t)ny * sizeof(mech_real));
        for (int i = 0; i < ny && !r->status; i++)
            if (!mech_finite(y[i])) *r = (mech_start_report){MECH_START_UNDEFINED, i, {0, 0}, y[i]};
        for (int i = 0; m->start && i < ny; i++)
            known[i] = given && given[i] ? given[i] == MECH_KNOWN : m->start->known[i];
        if (!r->status) assemble_with_others(m, t, given, known, u, z, p, value, y, value + ny + 1, r);
        if (plain) put_back(m, p, value, y, plain);
    }
    free(value);
    free(known);
    return r->status;
}
