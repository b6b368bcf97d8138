/* Pieces of a motion, between the times at which its derivative may jump. Internal to the kernel. */
#ifndef MECH_PIECES_H
#define MECH_PIECES_H

#include "run.h"

/* Takes up the motion from a state or a piece that begins at the present time: the derivative there is known. */
int mech_piece_enter(mech_solver *s);

/* The assertions of the model at the present time. */
int mech_piece_check(mech_solver *s);

#endif
