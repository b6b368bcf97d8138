/* One member under way. Internal to the ensemble. */
#ifndef MECH_MEMBER_H
#define MECH_MEMBER_H

#include "ensemble.h"

/* Room of one thread, used by one member after the other. */
typedef struct mech_room {
    const mech_ensemble *e;
    const mech_real *values;        /* [n_varied] of the present member                      */
    mech_real *p, *z, *y, *plain, *u, *nominal, *atol, *numbers, *before, *z_before, *chosen, *outputs;
    unsigned char *p_set, *y_given;
    mech_table *tables;             /* those of varied inputs and of settings have values of this member */
    mech_real *table_values;        /* [n_tables]                                            */
    mech_real *grid_y, *grid_z, *other_y, *other_z, *record, *kept, *other_kept, *end;
    mech_event *events;
    mech_real *instants;
    struct mech_watch *watch;
    mech_options options;
} mech_room;

/* How a run ended. */
typedef struct mech_outcome {
    mech_report report;
    int status;
} mech_outcome;

/* Sets the pointers of a room into a block of so many bytes. */
size_t mech_room_in(mech_room *r, const mech_ensemble *e, char *block);
size_t mech_room_bytes(const mech_ensemble *e);

/* Member k as it waits: nothing is known of it. */
void mech_member_waits(const mech_ensemble *e, long k, mech_member *told);
/* Makes member k ready and runs it. Gives its stage; MECH_MEMBER_WAITS where the call is to end. */
int mech_member_make(mech_room *r, long k, mech_member *told);
/* Writes what its run gave, of which end, rows and kept numbers are in the room. Gives whether it reached an end. */
int mech_member_ran(mech_room *r, long k, const mech_outcome *main, mech_member *told);
/* How far the run is off another one, of which end, rows and kept numbers are in the room too. `factor`: from difference to
 * error. */
void mech_member_compare(const mech_room *r, const mech_outcome *main, const mech_outcome *other, mech_real factor,
                         mech_member *told, mech_real *errors);

/* The work of a thread whose members run side by side; `shared` is a mech_crew. */
void mech_members_in_lanes(void *shared);

/* How much room what is kept takes. */
size_t mech_watch_bytes(const mech_ensemble *e);

/* Makes a member ready: p, z, y, nominal values and tables of the room. Gives a stage; MECH_MEMBER_RAN where it can run. */
int mech_member_start(mech_room *r, mech_member *told);

/* What is kept: begun at the start, told each step (record as in solver.h) with the discrete variables that held during it, told
 * states after events and events, and finished at the end. out[n_kept]. */
int mech_keeps_steps(const mech_ensemble *e);  /* whether it must see every step                */
int mech_keeps_events(const mech_ensemble *e);
void mech_watch_begin(mech_room *r);
void mech_watch_step(mech_room *r, const mech_real *record, int n_dense, const mech_real *z);
/* The same of a step in one lane: numbers stand `width` apart, and the samples are there. */
typedef struct mech_beside {
    mech_real t, h;
    const mech_real *dense, *samples;
    int n_dense, width, plain;
} mech_beside;
void mech_watch_beside(mech_room *r, const mech_beside *step);
/* [n_kept] what was found so far. */
mech_real *mech_watch_sums(const mech_room *r);
void mech_watch_jump(mech_room *r, mech_real t, const mech_real *y, const mech_real *z);
void mech_watch_events(mech_room *r, const mech_event *events, long n);
void mech_watch_end(mech_room *r, mech_real t, const mech_real *y, const mech_real *z, mech_real *out);

/* As mech_dense_at, of numbers that stand `width` apart; `plain`: of a polynomial in powers of s alone. */
void mech_dense_beside(const mech_real *c, int n_dense, int ny, int width, int plain, mech_real s, mech_real *y);

/* Values of places of y, outputs and z. */
void mech_member_outputs(const mech_room *r, mech_real t, const mech_real *y, const mech_real *z, mech_real *u,
                         mech_real *out);

#endif
