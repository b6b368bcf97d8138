/* Many runs of one model, which differ in parameters, initial values and inputs: one call, all of it without its caller.
 *
 *  1. Members are independent: what one gives depends on its own values alone, so that the results have the same bits
 *     whatever the number of threads, and wherever a member stands.
 *  2. The caller owns all arrays. Members take memory of their own while they run, and threads nothing that grows with n.
 *  3. A member that fails is told in its row of `members`; its kept numbers are not-a-number.
 *  4. What is kept is formed while a member runs. Between the ends of a step a quantity is read at three further places of
 *     the step's polynomial; a largest value is searched around the places that could hold it, a condition likewise.
 */
#ifndef MECH_ENSEMBLE_H
#define MECH_ENSEMBLE_H

#include "kinds.h"
#include "lanes.h"
#include "start.h"

enum mech_array { MECH_IN_P = 0, MECH_IN_Y, MECH_IN_U, MECH_IN_OUTPUTS, MECH_IN_Z };

/* One number that an array holds. `guess`: an initial value that the assembly may move. */
typedef struct mech_place {
    int array, index, guess;
} mech_place;

/* A number to keep of each member. FIRST: the first time at which the quantity is positive. EVENT_COUNT: how often a thing of
 * kind `event` happened (-1: any) to `row` (a branch for MECH_WHEN; -1: any). */
typedef struct mech_kept {
    int kind;
    int array, index;       /* of y, outputs or z                                         */
    int event, row;
} mech_kept;

enum mech_member_stage {
    MECH_MEMBER_WAITS = 0,     /* not made                                                   */
    MECH_MEMBER_RAN = 1,       /* `status` says how it ended; MECH_RUNNING: too many steps   */
    MECH_MEMBER_PARAMETER = 2, /* parameter `index` is not a number, or out of its range        */
    MECH_MEMBER_UNSETTLED = 3, /* the settings of the experiment depend on each other        */
    MECH_MEMBER_TIMES = 4,     /* option `index` of the experiment differs from the others'  */
    MECH_MEMBER_START = 5,     /* no start: `status` is of enum mech_start_status, `index` its row */
    MECH_MEMBER_STATE = 6,     /* initial value `index` is out of its range                  */
    MECH_MEMBER_MEMORY = 7
};

typedef struct mech_member {
    mech_real t;            /* where it ended                                             */
    mech_real failed_value;
    mech_real error;        /* largest relative error by the companion, else not-a-number */
    long long steps;
    int stage, status, index, part;
    int stiff;
    int companion;          /* 0: none, 1: it agrees how the run ended, -1: it does not, or failed */
} mech_member;

/* What makes the error estimate: a second run at the tolerance `rtol`, and where that takes more than
 * max(most, ten times the steps of the run), one at `loose_rtol`. `factor`: from difference to error. */
typedef struct mech_companion {
    mech_real rtol, dt, dt_max, factor;
    mech_real loose_rtol, loose_factor;
    long most;              /* 0: without a bound                                         */
} mech_companion;

typedef struct mech_ensemble {
    const mech_model *model;
    const mech_sizes *sizes;
    const mech_options *options;    /* of all: method, tables, stops, grid, t0, dt, dt_max, rtol */
    mech_real begin, stop;          /* what is kept begins here: an entry of stops, or t0    */
    long max_steps;                 /* of a member, 0: without a bound                       */
    /* what is given to all: p where p_set; entries of y where y_given (enum mech_given); inputs by tables of one row */
    const mech_real *p, *y;
    const unsigned char *p_set, *y_given;
    /* settings of the experiment: out[n_numbers + n_settings], as `numbers` for all members; those with array < 0 are
       given by the caller */
    mech_function *experiment;
    int n_numbers, n_settings;
    const mech_real *numbers;
    const mech_place *settings;
    /* ranges of p[np] and y[ny] */
    const mech_real *p_low, *p_high, *y_low, *y_high;
    /* what varies */
    int n_varied;
    const mech_place *varied;
    long n;
    const mech_real *values;        /* [n][n_varied]                                         */
    const unsigned char *estimated; /* [n] 1: a companion is run                             */
    mech_companion companion;
    /* results */
    int n_kept, n_series;
    const mech_kept *kept;
    const mech_place *series;       /* of y, outputs or z, at all times of the grid          */
    mech_real *kept_values;         /* [n][n_kept]                                           */
    mech_real *kept_errors;         /* [n][n_kept], by the companion                         */
    mech_real *series_values;       /* [n][n_series][n_grid]                                 */
    mech_real *ends;                /* [n][ny] states at the ends                            */
    mech_member *members;           /* [n] those that do not wait are left as they are       */
    const mech_lanes *lanes;        /* members run side by side; NULL: one after the other in each thread. Only of
                                       models without events and constraints, and tables of one row each */
    int turns;                      /* of lanes: members that turn out stiff go to the scalar kernel */
    int threads;
    volatile long *done;            /* counted up                                            */
    volatile int *stopped;          /* anything but 0 ends the call soon; members under way wait */
} mech_ensemble;

/* Bytes of mech_place, mech_kept, mech_member, mech_companion, mech_ensemble, mech_sizes, mech_quantity. */
MECH_API void mech_ensemble_layout(size_t sizes[7]);

/* 0, or 1 where no thread could be begun or memory is missing. */
MECH_API int mech_ensemble_run(const mech_ensemble *ensemble);

#endif
