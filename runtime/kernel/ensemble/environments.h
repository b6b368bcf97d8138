/* Environments: runs of one model that a caller advances by control steps, with inputs that it writes between them. Each has a solver
 * of its own, or runs beside others in lanes; they are independent of each other, of their number and of the threads that step them.
 *
 *  1. The caller fills mech_environments up to `outputs` and owns its arrays, a row for each environment; they stay in place until
 *     mech_environments_close. It writes `u`, and `y` only before a reset; all else it reads.
 *  2. A control step begins with the inputs in `u`; they are held until its end, which is a whole number of periods
 *     after the start. If they have changed, the run restarts in the present state, as with mech_restart.
 *  3. An environment that has failed, terminated or ended stays as it is until it is reset; one that has taken max_steps continues with
 *     the next step.
 */
#ifndef MECH_ENVIRONMENTS_H
#define MECH_ENVIRONMENTS_H

#include "lanes.h"
#include "start.h"

/* The functions of solver.h and start.h in the kernel that steps: it is a library of its own, and there are several. */
typedef struct mech_kernel {
    mech_solver *(*create)(const mech_model *, const mech_options *);
    void (*free)(mech_solver *);
    int (*advance)(mech_solver *, mech_real, long);
    void (*write)(mech_solver *, const mech_real *);
    void (*restart)(mech_solver *);
    void (*set_events)(mech_solver *, mech_event *, long, mech_real *, long);
    size_t (*save_size)(const mech_solver *);
    void (*save)(const mech_solver *, void *);
    void (*load)(mech_solver *, const void *);
    int (*assemble)(const mech_model *, mech_real, const unsigned char *, const mech_real *, const mech_real *,
                    const mech_real *, mech_real *, mech_start_report *);
} mech_kernel;

typedef struct mech_environments {
    const mech_kernel *kernel;
    const mech_model *model;
    const mech_options *options; /* of each: its tables come before those of the held inputs          */
    const mech_lanes *lanes;     /* of fixed steps; NULL: by solvers                                  */
    const int *held;             /* [n_held] inputs that stand in u                                   */
    long n;
    int n_held, threads;
    int substeps;                /* of lanes                                                          */
    mech_real period;
    mech_real until;             /* of the next call: a time, or not-a-number: the end of the period  */
    long max_steps;              /* of the next call, in each environment                             */
    mech_real *y, *u, *z, *t;    /* [n][ny], [n][n_held], [n][nz], [n]                                */
    int *status;                 /* [n] enum mech_status                                              */
    mech_real *outputs;          /* [n][n_outputs]                                                    */
    void *memory;                /* of the environments                                               */
} mech_environments;

MECH_API size_t mech_environments_layout(void);
/* 1 where memory is missing, else 0. */
MECH_API int mech_environments_open(mech_environments *e);
MECH_API void mech_environments_close(mech_environments *e);
/* Takes all on. Gives how many were interrupted by options->longest_call and go on in a further call; -1 where memory is missing. */
MECH_API long mech_environments_step(mech_environments *e);
/* Begins environment k anew at the start, from the state that stands in y. `guess`: y may be off the constraints, and is moved
   onto them. The status. */
MECH_API int mech_environments_reset(mech_environments *e, long k, int guess);
/* Evaluates the outputs of all. Zero. */
MECH_API long mech_environments_read(mech_environments *e);
/* All that changes in environment k, beside its rows of the caller's arrays. */
MECH_API size_t mech_environments_save_size(const mech_environments *e, long k);
MECH_API void mech_environments_save(const mech_environments *e, long k, void *memory);
MECH_API void mech_environments_load(mech_environments *e, long k, const void *memory);
/* Where environment k stands; 0 in lanes, which keep no report. */
MECH_API int mech_environments_report(const mech_environments *e, long k, mech_report *report);

#endif
