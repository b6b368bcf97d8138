/* What the kernel offers its callers: a re-entrant solver of one initial value problem.
 *
 *  1. The caller owns every array that it passes (y0 is copied); they stay valid and in place until
 *     mech_free. `p`, `z` and table values may change between two calls of mech_advance: call
 *     mech_restart then.
 *  2. mech_advance takes at most max_steps accepted steps towards t_end and lands on it exactly. Cutting a run
 *     into slices by max_steps or longest_call changes no bit of the result.
 *  3. After mech_create only the history of models with delays is allocated, and nothing is printed. Several solvers may run at the same
 *     time, each in one thread at a time.
 *  4. Rows of `grid_y` are written as soon as a step passes their time, from the dense output of the step.
 *  5. All memory that changes during a run is one block, followed by the history of delays: mech_save copies it out,
 *     mech_load back into the same solver, and the run continues bit for bit. With delays its size grows.
 *  6. Dense output: on a step from t to t + h, with s = (time - t) / h and r = 1 - s,
 *     y = c0 + s (c1 + r (c2 + s (c3 + r (c4 + ...)))), n_dense coefficients of ny numbers each.
 *     A record is t, h, c0, c1, ... .
 */
#ifndef MECH_SOLVER_H
#define MECH_SOLVER_H

#include <stddef.h>

#include "real.h"

#if defined(_WIN32)
#define MECH_API __declspec(dllexport)
#else
#define MECH_API __attribute__((visibility("default")))
#endif

#define MECH_KERNEL_VERSION 1
#define MECH_LOOKS 20000 /* at what may be narrow, in the whole of a run */

enum mech_status {
    MECH_RUNNING = 0,         /* max_steps were taken; call again                              */
    MECH_REACHED = 1,         /* t_end is reached                                              */
    MECH_RECORD_FULL = 2,     /* give a new record buffer, then call again                     */
    MECH_STEP_TOO_SMALL = -1, /* the error bound cannot be met with any step above rounding    */
    MECH_NOT_FINITE = -2,     /* a derivative is infinite or not a number                      */
    MECH_ASSERTION = -3,      /* an assertion of the model does not hold                       */
    MECH_NOT_CONVERGED = -4,  /* the equations of an implicit step could not be solved         */
    MECH_OFF_CONSTRAINTS = -5, /* the state could not be projected onto the constraints        */
    MECH_NEEDS_JACOBIAN = -6, /* the method needs what the model does not give: a Jacobian,    */
    MECH_NEEDS_SEPARABLE = -7, /* accelerations that depend on positions and time alone,       */
    MECH_NEEDS_MOMENTA = -8,  /* momenta, forces and constraints (model.h, point 16),          */
    MECH_NEEDS_SERIES = -10,  /* or Taylor series (point 19)                                   */
    MECH_NEEDS_ROWS = -12,    /* or contacts, frictions or constraints that switch               */
    MECH_NEEDS_STEPS = -13,   /* the contacts of the model want a method whose steps solve for them */
    MECH_NO_SERIES = -11,     /* the derivatives are finite, their Taylor series are not: a root of zero */
    MECH_JUMPING = -9,        /* constraints of velocities would have to change these at once         */
    MECH_TERMINATED = 3,      /* a branch ended the run                                        */
    MECH_EVENTS_FULL = 4,     /* give new buffers of events, then call again                   */
    MECH_AT_EVENT = 5,        /* an event is reached; it happens in the next call              */
    MECH_EVENT_LOOP = -20,    /* the events of one instant do not come to rest                 */
    MECH_ZENO = -21,          /* a branch fires in ever shorter intervals                      */
    MECH_PENETRATION = -22,   /* a contact is penetrated                                       */
    MECH_ENERGY_RAISED = -23, /* an impact would raise the energy                              */
    MECH_CHATTER = -24,       /* a switch goes to and fro at one instant                       */
    MECH_BRANCH_ASSERTION = -25, /* an assertion of a branch does not hold                     */
    MECH_APART = -26,         /* a constraint was engaged that does not hold                   */
    MECH_NO_MODE = -27,       /* no combination of sticking, sliding and touching fits, or a force is undefined */
    MECH_NO_IMPACT = -28,     /* the impacts of one instant have no solution                   */
    MECH_OUT_OF_RANGE = -29,  /* a restitution beyond 0..1, or a negative limit of friction    */
    MECH_UNDEFINED_JUMP = -30, /* the energy behind a switch is not a number                   */
    MECH_NO_PERIOD = -31,     /* a clock whose next tick is not later than this one            */
    MECH_NO_DELAY = -32,      /* a delay that is not positive                                  */
    MECH_NO_MEMORY = -33      /* no memory for what delays look back at                        */
};

enum mech_event_kind {
    MECH_WHEN = 0, MECH_IMPACT, MECH_REST, MECH_LIFT_OFF, MECH_SLIP, MECH_STICK, MECH_CROSSED, MECH_REFLECTED,
    MECH_RELEASED, MECH_ENGAGED
};

/* One thing that happened: a branch (MECH_WHEN) or a row. `value`: of an impact the approach speed. */
typedef struct mech_event {
    mech_real t, value;
    int kind, index;
    long instant;             /* row of instants                                               */
} mech_event;

enum mech_interpolation { MECH_LINEAR = 0, MECH_STEP = 1, MECH_SPLINE = 2 };

/* Values of one input over time; the first and last value hold beyond the ends. */
typedef struct mech_table {
    int input;              /* index in u                                     */
    int interpolation;      /* enum mech_interpolation                        */
    int n;                  /* rows, at least 1                               */
    const mech_real *t;     /* [n] not falling; twice the same time is a jump */
    const mech_real *value; /* [n]                                            */
    const mech_real *slope; /* [n] derivative at t, MECH_SPLINE only          */
} mech_table;

typedef struct mech_options {
    int method;             /* from mech_method_index                         */
    int n_tables, n_stops;
    long n_grid, record_capacity;
    mech_real t0, dt_max;
    mech_real dt;           /* step of a fixed-step method; first step of others, 0: choose */
    mech_real rtol;
    const mech_real *atol;  /* [ny]                                           */
    const mech_real *y0, *z, *p;
    const mech_table *tables;
    const mech_real *stops; /* [n_stops] times of kinks, increasing, each the end of a step */
    const mech_real *grid;  /* [n_grid] increasing, first >= t0               */
    mech_real *grid_y;      /* [n_grid][ny]                                   */
    mech_real *record;      /* [record_capacity][2 + n_dense ny] or NULL      */
    mech_real *grid_z;      /* [n_grid][nz], hybrid models only               */
    mech_event *events;     /* [event_capacity], hybrid models only           */
    mech_real *instants;    /* [instant_capacity][1 + 2 (ny + nz)]: t, y and z before, y and z after */
    long event_capacity, instant_capacity;
    int dense;              /* the errors of all steps are bounded between their ends too, as they are where rows of
                               the grid or records ask for that */
    int halves;             /* the way to a known time is taken in two steps where one would do: a companion that ended its
                               steps where the main run does would make the same error */
    mech_real apart;        /* longest time between two looks at indicators that may be narrow; 0: as steps are */
    double longest_call;    /* mech_advance returns MECH_RUNNING between two steps after about so many seconds; 0: never */
} mech_options;

/* Where a run stands. */
typedef struct mech_report {
    mech_real t, dt, dt_min, dt_max;
    mech_real stiff_time;   /* where stiffness was first detected, else not-a-number */
    mech_real failed_value; /* the derivative that is not finite, the gap that is open or negative, ... */
    mech_real switch_time;  /* where the last change of method was, else not-a-number */
    mech_real drift_position, drift_velocity; /* largest correction by projection, over the nominal values */
    mech_real laid_energy;  /* taken out where contacts of a crowd were laid down */
    mech_real residual, overlap; /* of steps that solve a contact problem: the largest residual, the deepest overlap */
    double seconds;         /* spent in mech_advance                          */
    long long steps, rejected, evaluations;
    long long jacobians, factorisations, iterations, switches;
    long long laid;         /* how often a contact was                        */
    long long unsolved;     /* steps whose contact problem was not solved to the tolerance */
    long long indeterminate; /* rows that share loads which rigid bodies do not determine, at the end of the last such step */
    long long several;      /* instants at which forces had a second solution, with fewer contacts */
    long long poisson;      /* impacts by Poisson's law: Newton's would have raised the energy */
    long n_grid, n_record;  /* rows written                                   */
    int status;
    int failed_index;       /* of the derivative, assertion, branch, row or switch, else -1 */
    int method;             /* in use at present                              */
    int failed_part;        /* of a branch: its assertion; of a loop: 1 for a switch; of chatter: 1 for impacts,
                             2 for too many changes of sign within a step, 3 for a constraint that bends, 4 for rest where a force jumps;
                             of modes: 1 where they change without progress */
    long n_events, n_instants;
} mech_report;

typedef struct mech_solver mech_solver;

MECH_API int mech_kernel_version(void);
/* Bytes of mech_model, mech_hybrid, mech_branch, mech_table, mech_options, mech_report, mech_event: what callers in
   other languages check. */
MECH_API void mech_layout(size_t sizes[7]);
MECH_API int mech_method_count(void);
MECH_API int mech_method_index(const char *name); /* -1 if unknown */
MECH_API const char *mech_method_name(int method);
MECH_API const char *mech_method_doc(int method);
MECH_API int mech_method_is_adaptive(int method);
MECH_API int mech_method_order(int method);
MECH_API int mech_method_n_dense(int method);
/* MECH_RUNNING, or the status of what the method needs and the model does not give. */
MECH_API int mech_method_lacks(int method, const mech_model *model);

/* NULL: no memory, unknown method, or a model of another version. */
MECH_API mech_solver *mech_create(const mech_model *model, const mech_options *options);
MECH_API void mech_free(mech_solver *solver);
MECH_API int mech_advance(mech_solver *solver, mech_real t_end, long max_steps);
MECH_API void mech_read(const mech_solver *solver, mech_report *report, mech_real *y);
MECH_API void mech_write(mech_solver *solver, const mech_real *y); /* a new state at the present time */
MECH_API void mech_restart(mech_solver *solver);
/* Tells `listener` whenever about so many further rows of the grid are written, with the number of all of them: it may read
   them, not call the solver. */
MECH_API void mech_listen(mech_solver *solver, void (*listener)(long n_grid), long every);
MECH_API void mech_set_record(mech_solver *solver, mech_real *record, long capacity);
/* out[n_position + n_velocity]: the largest residual of each constraint before projection, in its own unit. */
MECH_API void mech_drift(const mech_solver *solver, mech_real *out);
/* Begins again at the first row of new buffers. */
MECH_API void mech_set_events(mech_solver *solver, mech_event *events, long event_capacity, mech_real *instants,
                              long instant_capacity);
MECH_API void mech_read_discretes(const mech_solver *solver, mech_real *z);
MECH_API size_t mech_save_size(const mech_solver *solver);
MECH_API void mech_save(const mech_solver *solver, void *memory);
MECH_API void mech_load(mech_solver *solver, const void *memory);

/* out[n][n_out] = f at n times and states; inputs from the model and the tables, right-continuous. */
MECH_API void mech_evaluate(const mech_model *model, mech_function *f, int n_out, const mech_table *tables,
                            int n_tables, long n, const mech_real *t, const mech_real *y,
                            const mech_real *z, const mech_real *p, mech_real *u, mech_real *out);

/* u[n][nu]: inputs at n times. */
MECH_API void mech_evaluate_inputs(const mech_model *model, const mech_table *tables, int n_tables, long n,
                                   const mech_real *t, const mech_real *p, mech_real *u);

/* y[ny] on a step, from its n_dense coefficients; s in 0..1. */
MECH_API void mech_dense_at(const mech_real *coefficients, int n_dense, int ny, mech_real s, mech_real *y);

MECH_API void mech_normalise(const mech_model *model, mech_real *y);

#endif
