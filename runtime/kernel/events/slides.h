/* Frictions on surfaces. Internal to the kernel. */
#ifndef MECH_SLIDES_H
#define MECH_SLIDES_H

#include "rows.h"

/* The slip of friction i that counts as none; whether it has no more than that. */
mech_real mech_slide_none(const mech_solver *s, int i);
int mech_slide_is_slow(const mech_solver *s, int i);
/* Takes the slow slips away; gives those that begin to slide a slip that counts as none. */
void mech_slides_end(mech_solver *s);
void mech_slides_begin(mech_solver *s);
/* Whether indicator `hit` is that of a slide. */
int mech_slide_at(const mech_solver *s, int hit);
/* Turns slide i, from rest, into the direction in which it accelerates; 0 where it has that. */
int mech_slide_aim(mech_solver *s, int i);

#endif
