/* The nearest point on rows from another one on them: Newton's method along them. Internal to the kernel. */
#ifndef MECH_SECOND_ORDER_H
#define MECH_SECOND_ORDER_H

#include "onto_rows.h"

/* Goes from here.y, a position on the hard rows, to the nearest one. Returns the steps. */
int mech_refine(mech_task *task);

#endif
