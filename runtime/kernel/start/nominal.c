/* Nominal values: the size that each state has in a run, against which its error is measured.
 *
 * Every rule multiplies and compares quantities of the same unit only, so that steps do not depend on units. The rules, in this order:
 *  1. a nominal that the model declares; 1 for the entries of a rotation;
 *  2. the initial value, else the size of the declared range;
 *  3. for a rate also sqrt(|acceleration| nominal of the coordinate), both at the start;
 *  4. where this is zero, the smallest nominal of the states of the same kind and unit, of those coupled to it if there are any;
 *  5. the geometric mean of the parameters of the same unit; 1 for an angle and for a pure number;
 *  6. the largest value in a trial run, in which the size is what the initial rate would lead to, if it is more than rounding of that where
 *     contacts and frictions hold;
 *  7. for a rate the nominal of its coordinate times the fastest other rate over its nominal; else 1.
 * Values below 1e-12 of the largest coupled one of their kind and unit count as zero, as do accelerations below 1e-12 of their
 * terms. A nominal is at least 1e-6 of that largest one, but not above the largest value of the state. An account of energy has
 * the size of the energies at the start, else its largest value.
 */
#include "nominal.h"

#include <stdlib.h>
#include <string.h>

#include "inputs.h"

static const mech_real FLOOR = MECH_C(1e-6), ROUNDING = MECH_C(1e-12), GROWTH = MECH_C(1e-6);

/* J: far below the heat of one freedom (4e-21 J). What an account reaches beside energies of zero is rounding below it, as in
   mechanisms without mass; it is the one size that is compared with a number. */
static const mech_real HEAT = MECH_C(1e-25);

static const mech_quantity *state(const mech_motion *x, int i) { return &x->sizes->states[i]; }

/* What nominal values are shared among: coordinates and states, or velocities. */
static int is_plain(const mech_motion *x, int i, int velocities)
{
    const mech_model *m = x->model;
    const int velocity = i >= m->nq && i < m->nq + m->nv;
    if (velocities) return velocity;
    return !velocity && state(x, i)->kind == MECH_PLAIN;
}

int mech_alike(const mech_quantity *a, const mech_quantity *b) { return a->unit == b->unit && a->group == b->group; }

static mech_real own_size(const mech_quantity *q, mech_real initial)
{
    if (q->nominal > 0) return q->nominal;
    return initial != 0 ? mech_abs(initial) : q->range;
}

/* Gives states without a size that of the smallest one of their unit, one that they feel if there is one; keeps those below
   the floor at what they reach, but not above it. 1 if there are such. */
static int share(const mech_motion *x, int velocities, const mech_real *bounds, mech_real *nominal)
{
    const mech_model *m = x->model;
    const int ny = m->nq + m->nv + m->nx;
    int low = 0;
    for (int first = 0; first < ny; first++) {
        const mech_quantity *q = state(x, first);
        int seen = !is_plain(x, first, velocities);
        for (int i = 0; i < first && !seen; i++) seen = is_plain(x, i, velocities) && mech_alike(state(x, i), q);
        if (seen) continue;
        mech_real largest = 0, smallest = (mech_real)INFINITY;
        for (int i = first; i < ny; i++)
            if (is_plain(x, i, velocities) && mech_alike(state(x, i), q)) largest = mech_max(largest, nominal[i]);
        const mech_real floor = FLOOR * largest;
        for (int i = first; i < ny; i++) {
            if (!is_plain(x, i, velocities) || !mech_alike(state(x, i), q)) continue;
            if (!(state(x, i)->nominal > 0) && nominal[i] > 0 && nominal[i] < floor) {
                low = 1;
                if (bounds) nominal[i] = mech_max(nominal[i], mech_min(floor, bounds[i]));
            }
            if (nominal[i] > 0) smallest = mech_min(smallest, nominal[i]);
        }
        for (int i = first; i < ny && mech_finite(smallest); i++)
            if (is_plain(x, i, velocities) && mech_alike(state(x, i), q) && nominal[i] == 0) nominal[i] = smallest;
    }
    for (int i = 0; i < ny; i++) { /* of which nothing that it feels has a size */
        if (!is_plain(x, i, velocities) || nominal[i] != 0) continue;
        mech_real smallest = (mech_real)INFINITY;
        for (int k = 0; k < ny; k++)
            if (is_plain(x, k, velocities) && state(x, k)->unit == state(x, i)->unit && nominal[k] > 0)
                smallest = mech_min(smallest, nominal[k]);
        if (mech_finite(smallest)) nominal[i] = smallest;
    }
    return low;
}

static mech_real parameter_size(const mech_motion *x, const mech_quantity *q)
{
    mech_real sum = 0;
    int n = 0;
    if (q->pure) return 1;
    for (int k = 0; k < x->model->np; k++)
        if (x->sizes->units[k] == q->unit && x->p[k] != 0) sum += mech_log(mech_abs(x->p[k])), n++;
    return n ? mech_exp(sum / n) : 0;
}

/* How far a state gets by its rate, and a coordinate by its acceleration, at the start. */
static mech_real reach(const mech_motion *x, int i)
{
    const mech_model *m = x->model;
    mech_real far = mech_abs(x->rates[i]) * x->duration;
    for (int j = 0; i < m->nq && j < m->nv; j++)
        if (x->sizes->partner[j] == i)
            far = mech_max(far, mech_abs(x->rates[m->nq + j]) * x->duration * x->duration);
    return far;
}

static int of_positions(const mech_motion *x, const mech_real *reached, const mech_real *bounds, mech_real *nominal)
{
    const mech_model *m = x->model;
    const int ny = m->nq + m->nv + m->nx;
    for (int i = 0; i < ny; i++)
        nominal[i] = state(x, i)->kind == MECH_ROTATION_ENTRY ? 1 : is_plain(x, i, 0) ? own_size(state(x, i), x->y0[i]) : 0;
    int unsized = share(x, 0, bounds, nominal);
    for (int i = 0; i < ny; i++) {
        if (!is_plain(x, i, 0) || nominal[i] != 0) continue;
        nominal[i] = parameter_size(x, state(x, i));
        if (nominal[i] != 0) continue;
        unsized = 1;
        nominal[i] = reached && reached[i] != 0 ? reached[i] : reach(x, i);
        if (nominal[i] == 0) nominal[i] = 1;
    }
    return unsized;
}

static int of_velocities(const mech_motion *x, const mech_real *bounds, mech_real *nominal)
{
    const mech_model *m = x->model;
    const int *partner = x->sizes->partner;
    mech_real speed = 0, acceleration = 0, fastest = 0;
    for (int j = 0; j < m->nv; j++) {
        speed = mech_max(speed, mech_abs(x->y0[m->nq + j]) / nominal[partner[j]]);
        acceleration = mech_max(acceleration, mech_abs(x->rates[m->nq + j]) / nominal[partner[j]]);
    }
    const mech_real slowest = x->duration > 0 ? 1 / x->duration : 0;
    const mech_real noise = ROUNDING * mech_max(mech_max(speed, mech_sqrt(acceleration)), slowest);
    for (int j = 0; j < m->nv; j++) {
        const int i = m->nq + j;
        const mech_real unit = nominal[partner[j]];
        mech_real own = own_size(state(x, i), mech_abs(x->y0[i]) / unit > noise ? x->y0[i] : 0);
        if (!(state(x, i)->nominal > 0) && mech_abs(x->rates[i]) / unit > noise * noise / ROUNDING)
            own = mech_max(own, mech_sqrt(mech_abs(x->rates[i]) * unit));
        nominal[i] = own;
    }
    const int unsized = share(x, 1, bounds, nominal);
    for (int j = 0; j < m->nv; j++) fastest = mech_max(fastest, nominal[m->nq + j] / nominal[partner[j]]);
    if (!(fastest > 0)) fastest = x->duration > 0 ? 1 / x->duration : 1;
    for (int j = 0; j < m->nv; j++)
        if (nominal[m->nq + j] == 0) nominal[m->nq + j] = nominal[partner[j]] * fastest;
    return unsized;
}

static int of_accounts(const mech_motion *x, const mech_real *reached, mech_real *nominal)
{
    const mech_model *m = x->model;
    const int first = m->nq + m->nv, ny = first + m->nx;
    mech_real largest = 0;
    int unsized = 0;
    for (int i = first; i < ny; i++) {
        if (state(x, i)->kind != MECH_ACCOUNT) continue;
        nominal[i] = state(x, i)->nominal > 0 ? state(x, i)->nominal : x->energy;
        if (nominal[i] == 0) nominal[i] = mech_abs(x->rates[i]) * x->duration;
        if (nominal[i] == 0) {
            unsized = 1;
            nominal[i] = !reached ? (mech_real)INFINITY : reached[i] > HEAT ? reached[i] : 1;
        }
        if (mech_finite(nominal[i])) largest = mech_max(largest, nominal[i]);
    }
    for (int i = first; i < ny; i++) /* what cancels up to rounding has no size of its own */
        if (state(x, i)->kind == MECH_ACCOUNT && !(state(x, i)->nominal > 0))
            nominal[i] = mech_max(nominal[i], FLOOR * largest);
    return unsized;
}

int mech_nominal_rules(const mech_motion *x, const mech_real *reached, const mech_real *bounds, mech_real *nominal)
{
    int unsized = of_positions(x, reached, bounds, nominal);
    unsized |= of_velocities(x, bounds, nominal);
    return unsized | of_accounts(x, reached, nominal);
}

/* Zero for what is rounding beside others of its unit that it feels, among n states from `first` on. */
static void drop_rounding(const mech_sizes *sizes, int first, int n, mech_real *values)
{
    mech_real most = 0;
    for (int i = first; i < first + n; i++) most = mech_max(most, mech_abs(values[i]));
    for (int i = first; i < first + n; i++) {
        mech_real largest = 0;
        if (values[i] == 0 || mech_abs(values[i]) >= ROUNDING * most) continue; /* beside all of them, too */
        for (int k = first; k < first + n; k++)
            if (mech_alike(&sizes->states[k], &sizes->states[i])) largest = mech_max(largest, mech_abs(values[k]));
        if (mech_abs(values[i]) < ROUNDING * largest) values[i] = 0;
    }
}

void mech_drop_rounding(const mech_model *m, const mech_sizes *sizes, mech_real *values)
{
    drop_rounding(sizes, 0, m->nq, values);
    drop_rounding(sizes, m->nq, m->nv, values);
    drop_rounding(sizes, m->nq + m->nv, m->nx, values);
}

/* The discrete variables at the start, where what was is what is; `room` [nz] for those of a model with delays. */
static const mech_real *z_at_start(const mech_model *m, const mech_options *o, const mech_real *u, mech_real *room)
{
    const mech_delays *d = m->hybrid ? m->hybrid->delays : NULL;
    if (!d || !room) return o->z;
    memcpy(room, o->z, (size_t)m->nz * sizeof(mech_real));
    for (int k = 0; k < d->n_delayed; k++) {
        const int *source = d->sources + 2 * d->delayed[3 * k + 1];
        const mech_real *arrays[] = {o->y0, u, o->z, &o->t0};
        room[d->delayed[3 * k]] = arrays[source[0]][source[0] == MECH_SOURCE_T ? 0 : source[1]];
    }
    return room;
}

/* Zero for accelerations that are rounding of what makes them up, as where a motion begins in equilibrium: their terms are as large as
   what a common growth of all coordinates by a share changes them, over the share. */
static void drop_balanced(const mech_motion *x, const mech_options *o, const mech_real *u, const mech_real *z)
{
    const mech_model *m = x->model;
    const int ny = m->nq + m->nv + m->nx;
    mech_real *moved = malloc(2 * (size_t)ny * sizeof *moved), *rates = moved + ny;
    if (!moved) return;
    for (int i = 0; i < ny; i++) moved[i] = i < m->nq ? o->y0[i] * (1 + GROWTH) : o->y0[i];
    m->rhs(o->t0, moved, u, z, o->p, rates);
    for (int i = m->nq; i < m->nq + m->nv; i++) {
        const mech_real terms = mech_abs(rates[i] - x->rates[i]) / GROWTH;
        if (mech_finite(terms) && mech_abs(x->rates[i]) < ROUNDING * terms) x->rates[i] = 0;
    }
    free(moved);
}

void mech_look_at_start(mech_motion *x, const mech_options *o, const mech_real *plain, mech_real *u, mech_real *out)
{
    const mech_model *m = x->model;
    const int ny = m->nq + m->nv + m->nx;
    if (m->nu) mech_inputs(m, o->tables, o->n_tables, NULL, o->t0, o->p, u);
    mech_real *room = m->hybrid && m->hybrid->delays ? malloc((size_t)m->nz * sizeof *room) : NULL;
    const mech_real *z = z_at_start(m, o, u, room);
    m->rhs(o->t0, o->y0, u, z, o->p, x->rates);
    for (int i = 0; i < ny; i++)
        if (!mech_finite(x->rates[i])) x->rates[i] = 0;
    drop_balanced(x, o, u, z);
    if (m->n_outputs) m->outputs(o->t0, o->y0, u, z, o->p, out);
    free(room);
    x->energy = 0;
    for (int k = 0; k < x->sizes->n_energies; k++) {
        const mech_real energy = mech_abs(out[x->sizes->energies[k]]);
        if (mech_finite(energy)) x->energy = mech_max(x->energy, energy);
    }
    memcpy(x->y0, plain, (size_t)ny * sizeof(mech_real));
    mech_drop_rounding(m, x->sizes, x->y0);
    mech_drop_rounding(m, x->sizes, x->rates);
}

int mech_nominal_at_start(const mech_model *m, const mech_sizes *sizes, const mech_options *o, mech_real stop,
                          const mech_real *plain, mech_real *nominal)
{
    const size_t ny = (size_t)(m->nq + m->nv + m->nx);
    mech_real *work = calloc(2 * ny + (size_t)(m->nu + m->n_outputs) + 1, sizeof *work);
    if (!work) return -1;
    mech_motion x = {m, sizes, o->p, work, work + ny, 0, stop - o->t0};
    mech_look_at_start(&x, o, plain, work + 2 * ny, work + 2 * ny + m->nu);
    const int unsized = mech_nominal_rules(&x, NULL, NULL, nominal);
    free(work);
    return unsized;
}
