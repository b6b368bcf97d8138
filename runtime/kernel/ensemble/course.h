/* A member from its start to its error estimate: its run, a second one at a tighter tolerance, and, where that takes too long, a
 * third at one between them. What steps them is another's. Internal to the ensemble. */
#ifndef MECH_COURSE_H
#define MECH_COURSE_H

#include "member.h"

typedef struct mech_course {
    mech_room room;      /* the start of each run in `y`, its tolerances in `atol`              */
    mech_member told;
    mech_outcome main, other;
    long k;              /* the member                                                          */
    int phase;
    mech_real rtol, dt_max;
    long bound;          /* steps of the run, 0: without a bound                                */
    long n_grid;         /* rows of the grid that are the start                                 */
} mech_course;

/* Makes member k ready. Gives whether a run of it is to be made; else `told` says why not. */
int mech_course_begin(const mech_ensemble *e, mech_course *c, long k);
/* Where the end of the present run and its rows on the grid belong. */
mech_real *mech_course_end(const mech_course *c);
mech_real *mech_course_rows(const mech_course *c);
/* Takes how the run ended, and what the watch has found. Gives whether another one is to be made. */
int mech_course_ended(const mech_ensemble *e, mech_course *c, int status, mech_real t, mech_real steps, long n_grid,
                      mech_real stiff_time);
/* Runs the member by the scalar kernel instead; `told` waits where the call is to end. */
void mech_course_by_scalar(const mech_ensemble *e, mech_course *c);
/* Writes what is told of the member. */
void mech_course_keep(const mech_ensemble *e, const mech_course *c);

#endif
