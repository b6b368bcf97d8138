/* A run in the precision of this build, in terms of doubles. */
#ifndef MECH_REFERENCE_H
#define MECH_REFERENCE_H

#include "solver.h"

typedef struct mech_reference mech_reference;

typedef struct mech_reference_table {
    int input, interpolation, n; /* as in mech_table */
    const double *t, *value, *slope;
} mech_reference_table;

typedef struct mech_reference_case {
    int n_tables, n_stops;
    int decimals;                /* parameters and initial values as the model states them, where p and y0 round these */
    double t0, dt_max, rtol;
    const double *y0, *nominal;  /* [ny]; the absolute tolerance is rtol * nominal */
    const double *z, *p, *stops; /* p: hoisted constants are computed anew        */
    const mech_reference_table *tables;
} mech_reference_case;

/* NULL: no memory, or no such method. Everything is copied. */
MECH_API mech_reference *mech_reference_new(const mech_model *model, const char *method,
                                            const mech_reference_case *c);
MECH_API void mech_reference_free(mech_reference *r);
/* As mech_advance. */
MECH_API int mech_reference_advance(mech_reference *r, double t_end, long max_steps);
/* y = high + low; gives the number of evaluations so far. */
MECH_API long long mech_reference_read(const mech_reference *r, double *t, double *high, double *low);
MECH_API double mech_reference_epsilon(void);

#endif
