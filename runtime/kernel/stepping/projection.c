/* Projection of a state onto the constraints: positions by Newton's method in the mass metric, of which the
 * model gives each correction; then velocities, which are linear.
 *
 * E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd ed., Springer 1996, section VII.2.
 */
#include "projection.h"

#include <string.h>

enum { MAX_CORRECTIONS = 10 };

/* A correction of the positions below this share of the nominal values leaves an error below rounding: Newton's
   method squares it. */
static mech_real last_correction(void) { return mech_sqrt(MECH_EPSILON) / 64; }

/* The equations for the velocities are linear: of a correction only its rounding is left, magnified by at most the
   condition of these equations. The inverse of this share leaves room for that. */
static const mech_real LAST_OF_VELOCITIES = MECH_C(1e-5);

static void keep_largest(mech_real *largest, const mech_real *residual, int n)
{
    for (int i = 0; i < n; i++) largest[i] = mech_max(largest[i], mech_abs(residual[i]));
}

/* The largest of n changes over the nominal size of what they change, which begins at y[first]. */
static mech_real relative_size(const mech_solver *s, const mech_real *change, const mech_real *y, int first,
                               int n)
{
    mech_real largest = 0;
    for (int i = 0; i < n; i++) {
        const mech_real size = mech_abs(change[i]) / (mech_nominal(s, first + i) + mech_abs(y[first + i]));
        if (!mech_finite(size)) return size;
        largest = mech_max(largest, size);
    }
    return largest;
}

/* The largest change of a velocity over its nominal size, or a rounding of the others' where that is less than one. */
static mech_real relative_jump(const mech_solver *s, const mech_real *change, const mech_real *v)
{
    const int nq = s->model->nq, nv = s->model->nv;
    mech_real most = 0, largest = 0;
    for (int i = 0; i < nv; i++) most = mech_max(most, mech_nominal(s, nq + i) + mech_abs(v[i]));
    for (int i = 0; i < nv; i++) {
        const mech_real size = mech_nominal(s, nq + i) + mech_abs(v[i]);
        largest = mech_max(largest, mech_abs(change[i]) / mech_max(size, MECH_C(1e-8) * most));
    }
    return largest;
}

/* One correction of the coordinates; gives its relative size. `moved` is y with d in the place of v. */
static mech_real correct_position(mech_solver *s, mech_real t, mech_real *y, mech_real *d, mech_real *moved,
                                  mech_real *change)
{
    const mech_model *m = s->model;
    m->project_position(t, y, s->u, s->o.z, s->o.p, d);
    memcpy(moved, y, (size_t)s->ny * sizeof(mech_real));
    memcpy(moved + m->nq, d, (size_t)m->nv * sizeof(mech_real));
    m->displace(t, moved, s->u, s->o.z, s->o.p, change);
    const mech_real size = relative_size(s, change, y, 0, m->nq);
    for (int i = 0; i < m->nq; i++) y[i] += change[i];
    mech_normalise(m, y);
    return size;
}

int mech_project(mech_solver *s, mech_real t, mech_real *y)
{
    const mech_model *m = s->model;
    mech_report *r = &s->run->report;
    const mech_real enough = last_correction();
    mech_real *d = s->project, *change = d + m->nv + m->n_velocity, *moved = change + m->nq;
    mech_surroundings(s, t);

    for (int k = 0; m->n_position; k++) {
        const mech_real size = correct_position(s, t, y, d, moved, change);
        if (!mech_finite(size) || (k == MAX_CORRECTIONS && size > enough)) return MECH_OFF_CONSTRAINTS;
        if (k == 0) {
            keep_largest(s->drift, d + m->nv, m->n_position);
            r->drift_position = mech_max(r->drift_position, size);
        }
        if (size <= enough) break;
    }
    for (int k = 0; k < 2; k++) {
        m->project_velocity(t, y, s->u, s->o.z, s->o.p, d);
        const mech_real size = relative_size(s, d, y, m->nq, m->nv);
        if (!mech_finite(size)) return MECH_OFF_CONSTRAINTS;
        for (int i = 0; i < m->nv; i++) y[m->nq + i] += d[i];
        if (k == 0) {
            s->run->corrected = relative_jump(s, d, y + m->nq);
            keep_largest(s->drift + m->n_position, d + m->nv, m->n_velocity);
            r->drift_velocity = mech_max(r->drift_velocity, size);
        }
        if (size <= LAST_OF_VELOCITIES) break;
    }
    return MECH_RUNNING;
}

/* Shares of a compliance in its row, about (x/s)^2 at the distance s from a singular position, with x = 3e-4 of what
   counts as far: where a step towards the position and any step are not to end, and where the position is left. The
   rounding of a position becomes rates by the projection, that of rates accelerations: a step that begins too near
   cannot go over, and steps that stop short of it become ever shorter. Measured on rows of 2 to 10 four-bars. */
static const mech_real CLOSE = MECH_C(1e-5), HOLE = MECH_C(1e-3), LEFT = MECH_C(1e-6);
/* By how much of a step one looks farther, to see whether it moves away. */
static const mech_real FARTHER = MECH_C(0.01);
/* Ends of steps that are refused until the position is left. */
enum { MOST_AVOIDED = 12 };

static mech_real closeness(mech_solver *s, mech_real t, const mech_real *y)
{
    mech_real found;
    s->model->closeness(t, y, s->u, s->o.z, s->o.p, &found);
    return found;
}

int mech_too_close(mech_solver *s, mech_real t, const mech_real *y, const mech_real *from)
{
    const mech_model *m = s->model;
    mech_run *run = s->run;
    if (!m->closeness) return 0;
    mech_surroundings(s, t);
    const mech_real here = closeness(s, t, y);
    run->near_singular = here > LEFT;
    if (!run->near_singular) run->avoided = 0;
    if (!(here > CLOSE) || run->avoided == MOST_AVOIDED) return 0;
    if (here < HOLE) {
        mech_real *farther = s->project + m->nv + m->n_velocity + m->nq;
        for (int i = 0; i < s->ny; i++) farther[i] = y[i] + FARTHER * (y[i] - from[i]);
        mech_normalise(m, farther);
        if (closeness(s, t, farther) < here) return 0;
    }
    run->avoided++;
    return 1;
}
