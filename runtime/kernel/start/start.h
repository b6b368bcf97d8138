/* What callers get of the start of a run: initial states that fulfil the constraints, and the sizes that errors are
 * measured against. Nothing here reads or changes a solver that runs. Memory is taken and given back within a call.
 */
#ifndef MECH_START_H
#define MECH_START_H

#include "solver.h"

enum mech_start_status {
    MECH_STARTED = 0,
    MECH_START_APART = -1,     /* no position near the guesses fulfils the rows of positions        */
    MECH_START_RATES = -2,     /* no velocities fulfil those of velocities                          */
    MECH_START_UNDIRECTED = -3, /* a row holds, but its gradient is undefined there or turns about   */
    MECH_START_UNDEFINED = -4, /* an initial value is not finite                                   */
    MECH_START_NO_MEMORY = -5
};

typedef struct mech_start_report {
    int status;      /* enum mech_start_status                                                      */
    int row;         /* of `assembly`: the one that is off most; of UNDEFINED: index in y; else -1  */
    int steps[2];    /* of both stages                                                              */
    mech_real off;   /* how far that row is off: a length over the characteristic one               */
} mech_start_report;

/* Where an initial value comes from. */
enum mech_given { MECH_AS_STATED = 0, MECH_KNOWN = 1, MECH_GUESSED = 2 };

/* Fills z[nz] and y[ny] at t for the run to come, and returns the status. Entries of y with given[i] != 0 are read: values
   that were set, known or guessed; all others are as the model states them. given NULL: nothing was set. p as after
   `parameters`, u as at t. `plain`[ny], if it is not NULL, gets y with what was stated where the assembly has moved a
   coordinate by no more than rounding: nominal values are made from that. On failure y is the closest state. */
MECH_API int mech_start_state(const mech_model *model, mech_real t, const unsigned char *given, const mech_real *u,
                              mech_real *z, const mech_real *p, mech_real *y, mech_real *plain,
                              mech_start_report *report);

/* The second half of it: moves y onto the constraints; known[ny], NULL as the model says. */
MECH_API int mech_assemble(const mech_model *model, mech_real t, const unsigned char *known, const mech_real *u,
                           const mech_real *z, const mech_real *p, mech_real *y, mech_start_report *report);

/* Puts the parameters that the start finds into p, and what follows from them; `set` as of `parameters`. The index of one that is
 * not finite, else -1. */
MECH_API int mech_start_found(const mech_model *model, mech_real t, const mech_real *y, const mech_real *u,
                              const mech_real *z, mech_real *p, unsigned char *set);

enum mech_quantity_kind { MECH_PLAIN = 0, MECH_ACCOUNT = 1, MECH_ROTATION_ENTRY = 2 };

/* One state as nominal values see it. */
typedef struct mech_quantity {
    int unit;            /* the same number for the same unit                                      */
    int kind;            /* enum mech_quantity_kind                                               */
    int pure;            /* 1: an angle or a pure number                                            */
    mech_real nominal;   /* what the model declares, 0: nothing                                     */
    mech_real range;     /* the larger finite end of the declared range, 0: none                    */
    int group;           /* the same number for states that feel each other                         */
} mech_quantity;

typedef struct mech_sizes {
    const mech_quantity *states;  /* [ny]                                                          */
    const int *partner;           /* [nv] index in y of the coordinate of each velocity             */
    const int *units;             /* [np] of the parameters; -1 where no state has it               */
    int n_energies;
    const int *energies;          /* index in the outputs                                           */
} mech_sizes;

/* nominal[ny] of a run: `options` as for mech_create, of which tables, stops, dt_max, t0, y0, z and p are read; `plain`
   as of mech_start_state, or y0. A cheap first run is made where nothing in the model gives a state a size; it takes the method
   dop853 if the kernel holds it, else `options->method`. 0, or 1 where memory is missing. */
MECH_API int mech_nominal_values(const mech_model *model, const mech_sizes *sizes, const mech_options *options,
                                 mech_real stop, const mech_real *plain, mech_real *nominal);

/* The same without a first run. 0; 1 where one would tell more, and nominal[ny] is what it begins with; -1 where memory is
   missing. */
MECH_API int mech_nominal_at_start(const mech_model *model, const mech_sizes *sizes, const mech_options *options,
                                   mech_real stop, const mech_real *plain, mech_real *nominal);

#endif
