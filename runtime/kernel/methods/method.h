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
    int n_dense;     /* coefficients of the dense output, at least 4                         */
    int error_order; /* an error estimate falls as dt to this power                          */
    mech_real factor_min, factor_max;

    /* MECH_RUNNING, or what the model lacks for this method. NULL: nothing. */
    int (*lacks)(const mech_model *model);
    /* Further numbers in work, behind n_work * ny. NULL: none. */
    size_t (*n_extra)(const mech_model *model);
    /* The derivative may jump at the present time; fresh: the state may, too. NULL: nothing is remembered. */
    void (*begin)(mech_solver *s, int fresh);
    /* Its extra numbers were copied from other memory: pointers to them. NULL: it keeps none. */
    void (*attach)(mech_solver *s);
    int gives_derivative;  /* an attempt fills dy_new, too                                   */
    int keeps_constraints; /* the new state needs no projection                              */

    /* From (t, y, dy) over h: fills y_new and returns the error norm (0 without an estimate);
       not finite where a stage is undefined, or where run->trouble says what else is wrong. */
    mech_real (*attempt)(mech_solver *s, mech_real h);
    /* Factor of the next step after one over h with this error. NULL: PI control. */
    mech_real (*control)(mech_solver *s, mech_real h, mech_real error);
    /* After acceptance, with dy_new known: |h lambda| as the step saw it, or 0. NULL: none. */
    mech_real (*stiffness)(mech_solver *s, mech_real h);
    mech_real stiffness_bound; /* above it for long: stiff; of an implicit method: below it for long, calm */
    /* With dy_new known: fills dense[n_dense][ny]. */
    void (*dense)(mech_solver *s, mech_real h);
    /* Norm of the largest error between the ends, from dense. NULL: never much larger than that of the step. */
    mech_real (*dense_error)(const mech_solver *s);

    /* A method that consists of two: begins with the first, goes over to the other where it is stiff. */
    const struct mech_method *explicit_part, *implicit_part;
} mech_method;

extern const mech_method mech_rk4, mech_dop853, mech_radau5;
extern const mech_method mech_gauss2, mech_gauss4, mech_gauss6, mech_gauss8, mech_verlet, mech_auto;
extern const mech_method mech_rattle, mech_lobatto4, mech_lobatto6;

extern const mech_method *const mech_methods[];
extern const int mech_n_methods;

/* All that changes during a run. */
typedef struct mech_run {
    mech_report report;
    mech_real error_old;
    mech_real origin;       /* fixed steps are counted from here                             */
    long long n_fixed;
    mech_real cut;          /* factor of the step after a failed attempt; 0: the usual one   */
    int next_stop, after_rejection, started, stiff_hits, calm_hits;
    int begun;              /* what happens at the start has happened                        */
    int pending;            /* 1: an event is reached, and waits; pending_hit as of mech_instant */
    int pending_hit;
    int trouble;            /* status to give if the present step cannot be taken            */
    mech_real dense_of;     /* the step from the present time that dense holds; 0: none      */
    int near_singular;      /* the last step ended in the neighbourhood of a singular position */
    int avoided;            /* ends of steps that were refused for that                      */
    int dense_limits;       /* the error between the ends of the step is larger than at them */
    int turning;            /* something slides on a surface: no Jacobian lasts              */
} mech_run;

struct mech_solver {
    const mech_model *model;
    const mech_method *method; /* in use                                                     */
    const mech_method *chosen; /* by the caller; the same unless that consists of two        */
    mech_options o;
    int ny, n_dense;
    size_t size;            /* bytes of the changing block that begins at run                */
    mech_run *run;
    mech_real *y, *dy, *y_new, *dy_new, *work, *dense, *u, *checks;
    mech_real *drift, *project; /* of constraints: residuals; room for a projection          */
    int *segments;          /* the row of each table that holds during the present step      */
    struct mech_modes *modes; /* hybrid models only                                          */
    int waits;              /* 1: events are told (MECH_AT_EVENT) before they happen         */
};

static inline void mech_rhs(mech_solver *s, mech_real t, const mech_real *y, mech_real *out)
{
    if (s->model->nu) mech_inputs(s->model, s->o.tables, s->o.n_tables, s->segments, t, s->o.p, s->u);
    s->model->rhs(t, y, s->u, s->o.z, s->o.p, out);
    s->run->report.evaluations++;
}

static inline void mech_jacobian(mech_solver *s, mech_real t, const mech_real *y, mech_real *out)
{
    if (s->model->nu) mech_inputs(s->model, s->o.tables, s->o.n_tables, s->segments, t, s->o.p, s->u);
    s->model->jacobian(t, y, s->u, s->o.z, s->o.p, out);
    s->run->report.jacobians++;
}

/* The extra numbers of a method. */
static inline mech_real *mech_extra(const mech_solver *s)
{
    return s->work + (size_t)s->ny * (size_t)s->method->n_work;
}

/* The size of a value that counts as 1, beside |y|; nominal values as far as the tolerances tell. */
static inline mech_real mech_nominal(const mech_solver *s, int i)
{
    return s->o.rtol > 0 ? s->o.atol[i] / s->o.rtol : 1;
}

/* Fills dense for a step of h that was attempted, unless it is there already. */
static inline void mech_fill_dense(mech_solver *s, mech_real h)
{
    if (s->run->dense_of != h) s->method->dense(s, h);
    s->run->dense_of = h;
}

/* Moves y onto the constraints at time t: 0, or MECH_OFF_CONSTRAINTS. */
int mech_project(mech_solver *s, mech_real t, mech_real *y);

/* Whether a step should not end at y at time t, as a singular position is too near and another end can be had.
   Asked once for each step that would be accepted: it counts. */
int mech_too_close(mech_solver *s, mech_real t, const mech_real *y, const mech_real *from);

/* Six coefficients of the dense output where q' = v, from the ends of the step. */
void mech_quintic(mech_solver *s, mech_real h);

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
