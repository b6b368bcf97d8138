/* Environments side by side in lanes, one team of lanes for each thread. Internal to the ensemble. */
#ifndef MECH_LANE_ENVIRONMENTS_H
#define MECH_LANE_ENVIRONMENTS_H

#include "environments.h"

enum { MECH_MOST_LANES = 64 };

typedef struct mech_lane_team {
    mech_environments *e;
    void *block;
    mech_lane_room rooms[4];
} mech_lane_team;

/* How many environments it steps at once. */
long mech_lane_team_size(const mech_environments *e);
/* 1 where memory is missing, else 0. */
int mech_lane_team_open(mech_lane_team *c, mech_environments *e);
void mech_lane_team_close(mech_lane_team *c);
/* One control step of n environments from `first` on, which begin at these times. */
void mech_lane_team_step(mech_lane_team *c, long first, long n, const mech_real *begin);

#endif
