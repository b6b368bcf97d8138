/* One run in memory: all that the kernel knows of it. Internal to the kernel. */
#ifndef MECH_RUN_H
#define MECH_RUN_H

#include "inputs.h"
#include "solver.h"

/* All that changes during a run. */
typedef struct mech_run {
    mech_report report;
    mech_real error_old;
    mech_real from;         /* where the present step begins                                 */
    mech_real origin;       /* fixed steps are counted from here                             */
    long long n_fixed;
    mech_real halfway;      /* where the first of two steps to a known time ended         */
    mech_real cut;          /* factor of the step after a failed attempt; 0: the usual one   */
    int next_stop, after_rejection, started, stiff_hits, calm_hits;
    int begun;              /* what happens at the start has happened                        */
    int pending;            /* 1: an event is reached, and waits; pending_hit as of mech_instant */
    int pending_hit;
    int trouble;            /* status to give if the present step cannot be taken            */
    mech_real dense_of;     /* the step from the present time that dense holds; 0: none      */
    int near_singular;      /* the last step ended in the neighbourhood of a singular position */
    mech_real corrected;    /* relative size of the last correction of velocities by projection   */
    mech_real jumped;       /* sum of those beyond what errors explain                      */
    int avoided;            /* ends of steps that were refused for that                      */
    mech_real fastest;      /* largest |lambda| of the derivative as measured; 0: not, or far from the bound */
    long long fastest_until; /* steps until which that counts                               */
    int near_bound;         /* that was measured near the bound of stability                 */
    int measures;           /* the step that is accepted is followed by a measurement        */
    int bounded;            /* stability, not accuracy, bounds the next step                 */
    int dense_limits;       /* the error between the ends of the step is larger than at them */
    int turning;            /* something slides on a surface: no Jacobian lasts              */
} mech_run;

struct mech_solver {
    const mech_model *model;
    const struct mech_method *method; /* in use                                              */
    const struct mech_method *chosen; /* by the caller; the same unless that consists of two        */
    mech_options o;
    int ny, n_dense;
    size_t size;            /* bytes of the changing block that begins at run                */
    mech_run *run;
    mech_real *y, *dy, *y_new, *dy_new, *work, *dense, *u, *checks;
    mech_real *drift, *project; /* of constraints: residuals; room for a projection          */
    int *segments;          /* the row of each table that holds during the present step      */
    struct mech_event_state *events; /* models with events only                              */
    struct mech_history *history;    /* models with delays only                              */
    void (*look_back)(mech_solver *s, mech_real t); /* the same: writes what z holds of the past (history.h)  */
    double call_end;        /* on the clock: mech_advance returns then; 0: no end               */
    int waits;              /* 1: events are told (MECH_AT_EVENT) before they happen         */
    void (*listener)(long n_grid); /* told of rows of the grid; NULL: nobody is              */
    long told_every, told_next;
};

/* What the model reads beside its state: u, and in z what delays look back at. Whoever calls a function of the model at a
 * time calls this before. */
static inline void mech_surroundings(mech_solver *s, mech_real t)
{
    if (s->model->nu) mech_inputs(s->model, s->o.tables, s->o.n_tables, s->segments, t, s->o.p, s->u);
    if (s->look_back) s->look_back(s, t);
}

static inline void mech_rhs(mech_solver *s, mech_real t, const mech_real *y, mech_real *out)
{
    mech_surroundings(s, t);
    s->model->rhs(t, y, s->u, s->o.z, s->o.p, out);
    s->run->report.evaluations++;
}

/* The size of a value that counts as 1, beside |y|; nominal values as far as the tolerances tell. */
static inline mech_real mech_nominal(const mech_solver *s, int i)
{
    return s->o.rtol > 0 ? s->o.atol[i] / s->o.rtol : 1;
}

/* Ends the run with a status; gives that. */
int mech_fail(mech_solver *s, int status, int index);

/* The same for the first of n derivatives, in the order of evaluation, that is not finite; MECH_RUNNING where all
   are. */
int mech_fail_not_finite(mech_solver *s, const mech_real *first, int n);

/* The same for what switches without end at an instant. Where a state passes through all of its size within a thousand
   roundings of the time, the motion goes to infinity: what switches there does so by rounding, and MECH_STEP_TOO_SMALL blames the state. */
int mech_fail_to_settle(mech_solver *s, int status, int index);

#endif
