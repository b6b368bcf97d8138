/* The nearest point on rows from another one on them: Newton's method along them. Internal to the kernel. */
#ifndef MECH_SECOND_ORDER_H
#define MECH_SECOND_ORDER_H

#include "onto_rows.h"

/* Goes from here.y, a position on the hard rows, to the nearest one. Returns the steps. */
int mech_refine(mech_task *task);

/* Moves here from a point at which no slope brings the rows nearer to zero to one beside it, if their curvature does. Returns
   whether it moved. */
int mech_leave(mech_task *task);

#endif
