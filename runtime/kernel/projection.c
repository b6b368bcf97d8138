/* Projection of a state onto the constraints: positions by Newton's method in the mass metric, of which the
 * model gives each correction; then velocities, which are linear.
 *
 * E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd ed., Springer 1996, section VII.2.
 */
#include <string.h>

#include "method.h"

enum { MAX_CORRECTIONS = 10 };

/* A correction below this share of the nominal values leaves an error below rounding: Newton's method squares
   it, and the equations for the velocities are linear. */
static mech_real last_correction(void) { return mech_sqrt(MECH_EPSILON) / 64; }

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
    if (m->nu) mech_inputs(m, s->o.tables, s->o.n_tables, s->segments, t, s->o.p, s->u);

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
            keep_largest(s->drift + m->n_position, d + m->nv, m->n_velocity);
            r->drift_velocity = mech_max(r->drift_velocity, size);
        }
        if (size <= enough) break;
    }
    return MECH_RUNNING;
}
