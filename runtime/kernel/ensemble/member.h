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
void mech_watch_jump(mech_room *r, mech_real t, const mech_real *y, const mech_real *z);
void mech_watch_events(mech_room *r, const mech_event *events, long n);
void mech_watch_end(mech_room *r, mech_real t, const mech_real *y, const mech_real *z, mech_real *out);

/* Values of places of y, outputs and z. */
void mech_member_outputs(const mech_room *r, mech_real t, const mech_real *y, const mech_real *z, mech_real *u,
                         mech_real *out);

#endif
