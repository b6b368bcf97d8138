/* What a method is, and what it sees of the solver. Internal to the kernel.
 *
 * A method is one const struct in one file, listed in methods.c.
 */
#ifndef MECH_METHOD_H
#define MECH_METHOD_H

#include "inputs.h"
#include "solver.h"

typedef struct mech_method {
    const char *name, *doc;
    int order;
    int adaptive;    /* else the step is the user's                                          */
    int n_stages;    /* derivative arrays that an attempt leaves at the start of work        */
    int n_work;      /* arrays of ny numbers in work                                         */
    int n_dense;     /* coefficients of the dense output                                     */
    int error_order; /* an error estimate falls as dt to this power                          */
    mech_real factor_min, factor_max;

    /* From (t, y, dy) over h: fills y_new and returns the error norm (0 without an estimate);
       not finite where a stage is undefined. */
    mech_real (*attempt)(mech_solver *s, mech_real h);
    /* After acceptance, with dy_new known: |h lambda| as the step saw it, or 0. NULL: none. */
    mech_real (*stiffness)(const mech_solver *s, mech_real h);
    mech_real stiffness_bound;
    /* After acceptance: fills dense[n_dense][ny]. */
    void (*dense)(mech_solver *s, mech_real h);
} mech_method;

extern const mech_method mech_rk4, mech_dop853;

extern const mech_method *const mech_methods[];
extern const int mech_n_methods;

/* All that changes during a run. */
typedef struct mech_run {
    mech_report report;
    mech_real error_old;
    mech_real origin;       /* fixed steps are counted from here                             */
    long long n_fixed;
    int next_stop, after_rejection, started, stiff_hits, calm_hits;
} mech_run;

struct mech_solver {
    const mech_model *model;
    const mech_method *method;
    mech_options o;
    int ny;
    size_t size;            /* bytes of the changing block that begins at run                */
    mech_run *run;
    mech_real *y, *dy, *y_new, *dy_new, *work, *dense, *u, *checks;
    int *segments;          /* the row of each table that holds during the present step      */
};

static inline void mech_rhs(mech_solver *s, mech_real t, const mech_real *y, mech_real *out)
{
    if (s->model->nu) mech_inputs(s->model, s->o.tables, s->o.n_tables, s->segments, t, s->o.p, s->u);
    s->model->rhs(t, y, s->u, s->o.z, s->o.p, out);
    s->run->report.evaluations++;
}

/* Dense output of a step from its ends alone, of order 3: the first four coefficients of every method. */
static inline void mech_hermite(mech_solver *s, mech_real h)
{
    const int n = s->ny;
    mech_real *c = s->dense;
    for (int i = 0; i < n; i++) {
        mech_real d = s->y_new[i] - s->y[i], b = h * s->dy[i] - d;
        c[i] = s->y[i];
        c[n + i] = d;
        c[2 * n + i] = b;
        c[3 * n + i] = d - h * s->dy_new[i] - b;
    }
}

#endif
