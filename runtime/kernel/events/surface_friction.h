/* Frictions on surfaces. Internal to the kernel. */
#ifndef MECH_SURFACE_FRICTION_H
#define MECH_SURFACE_FRICTION_H

#include "rows.h"

/* The slip of friction i that counts as none; whether it has no more than that. */
mech_real mech_surface_friction_none(const mech_solver *s, int i);
int mech_surface_friction_is_slow(const mech_solver *s, int i);
/* Takes the slow slips away; gives those that begin to slide a slip that counts as none. */
void mech_surface_friction_end(mech_solver *s);
void mech_surface_friction_begin(mech_solver *s);
/* Whether indicator `hit` is that of a slide. */
int mech_surface_friction_at(const mech_solver *s, int hit);
/* Turns slide i, from rest, into the direction in which it accelerates; 0 where it has that. */
int mech_surface_friction_aim(mech_solver *s, int i);

#endif
